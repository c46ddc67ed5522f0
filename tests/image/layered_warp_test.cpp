#include "image/layered_images.hpp"
#include "support/allocation_counter.hpp"
#include "support/thread_executor.hpp"
#include <farfield/image/layered_warp.hpp>

#include <catch2/catch.hpp>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;
using glm::dvec2;
using glm::dvec3;

namespace {

constexpr std::uint32_t kNoSample = UINT32_MAX;

dvec2 tangents(const View& view) {
    const Lens& lens = view.lens;
    return {(lens.right - lens.left) / view.width, (lens.top - lens.bottom) / view.height};
}

/// The point of the ray through `place`, from the lower left corner, that is 1 m deep, seen from
/// the view's eye; in the world's axes.
dvec3 ray(const View& view, const dvec2& place) {
    const dvec2 at = dvec2(view.lens.left, view.lens.bottom) + place * tangents(view);
    return view.camera_to_world * dvec3(at, -1.0);
}

/// Where a point is seen, from the lower left corner, and how far along the view direction.
std::pair<dvec2, double> project(const View& view, const dvec3& point) {
    const dvec3 seen = glm::transpose(view.camera_to_world) * (point - view.eye);
    const dvec2 at = dvec2(seen) / -seen.z - dvec2(view.lens.left, view.lens.bottom);
    return {at / tangents(view), -seen.z};
}

dvec2 place_of(const LayeredSample& sample) {
    return dvec2(sample.x, sample.y) / double{kLayeredSteps};
}

double depth_of(const LayeredDepthImage& image, const LayeredSample& sample) {
    const double far = 1.0 / image.far_depth;
    return 1.0 / (far + sample.depth / 65535.0 * (1.0 / image.near_depth - far));
}

dvec3 point_of(const LayeredDepthImage& image, const LayeredSample& sample) {
    return image.view.eye + ray(image.view, place_of(sample)) * depth_of(image, sample);
}

double larger(const dvec2& v) {
    return std::max(std::abs(v.x), std::abs(v.y));
}

/// What a sample covers, as the header says it and in the same precision.
struct Square {
    int x0 = 0;
    int x1 = 0;
    int y0 = 0;
    int y1 = 0;
    float z = 0.0F;
};

Square square_of(const LayeredTerms& terms, const LayeredSample& sample, const View& view) {
    const auto x = static_cast<float>(sample.x);
    const auto y = static_cast<float>(sample.y);
    const auto depth = static_cast<float>(sample.depth);
    const glm::vec3 seen =
        terms.columns[0] * x + terms.columns[1] * y + terms.columns[2] * depth + terms.columns[3];
    Square square;
    square.z = seen.z / (terms.inverse_step * depth + terms.inverse_far);
    if (square.z < terms.near_distance || square.z > terms.far_distance) {
        return square;
    }
    const float inverse = 1.0F / seen.z;
    const float half = static_cast<float>(sample.extent) * (0.5F * terms.size) * inverse;
    const auto pixel = [&](float edge, int end) {
        return static_cast<int>(std::ceil(std::clamp(edge, 0.0F, static_cast<float>(end))));
    };
    const float center_x = seen.x * inverse - 0.5F;
    const float center_y = seen.y * inverse - 0.5F;
    square.x0 = pixel(center_x - half, view.width);
    square.x1 = pixel(center_x + half, view.width);
    square.y0 = pixel(center_y - half, view.height);
    square.y1 = pixel(center_y + half, view.height);
    return square;
}

/// A depth buffer: of each pixel the nearest sample, and how near.
struct Nearest {
    std::vector<std::uint32_t> samples;
    std::vector<float> depths;
};

Nearest nearest_samples(const LayeredDepthImage& image, const View& view) {
    const auto pixels = pixel_count(view);
    Nearest nearest;
    nearest.samples.assign(pixels, kNoSample);
    nearest.depths.assign(pixels, std::numeric_limits<float>::infinity());
    const LayeredTerms terms = layered_terms(image, view);
    for (std::uint32_t i = 0; i < image.samples.size(); ++i) {
        const Square square = square_of(terms, image.samples[i], view);
        for (int y = square.y0; y < square.y1; ++y) {
            for (int x = square.x0; x < square.x1; ++x) {
                const auto pixel = pixel_at(view, x, y);
                if (square.z < nearest.depths[pixel]) {
                    nearest.depths[pixel] = square.z;
                    nearest.samples[pixel] = i;
                }
            }
        }
    }
    return nearest;
}

WarpedLayers
warp(const LayeredDepthImage& image, const View& view, LayeredFront front = LayeredFront::order) {
    SerialExecutor executor;
    LayeredWarper warper;
    WarpedLayers warped;
    warper.warp(image, view, executor, warped, true, front);
    return warped;
}

struct Agreement {
    std::size_t covered = 0;
    std::size_t other = 0; ///< pixels that show another sample than the nearest
    std::size_t apart = 0; ///< of them, one that is farther by more than 3 %
};

/// Holds a warp against a depth buffer.
void compare(const LayeredDepthImage& image, const View& view, Agreement& agreement) {
    REQUIRE(validate(image).has_value());
    REQUIRE(validate(view).has_value());
    const WarpedLayers warped = warp(image, view);
    const Nearest nearest = nearest_samples(image, view);
    const WarpedLayers by_depth = warp(image, view, LayeredFront::depth);
    CHECK(by_depth.samples == nearest.samples);
    CHECK(by_depth.depths == nearest.depths);
    const LayeredTerms terms = layered_terms(image, view);
    REQUIRE(warped.width == view.width);
    REQUIRE(warped.height == view.height);
    REQUIRE(warped.samples.size() == nearest.samples.size());
    REQUIRE(warped.colors.size() == nearest.samples.size());
    REQUIRE(warped.depths.size() == nearest.samples.size());
    std::size_t wrong = 0;
    for (std::size_t pixel = 0; pixel < nearest.samples.size(); ++pixel) {
        const std::uint32_t shown = warped.samples[pixel];
        const std::uint32_t expected = nearest.samples[pixel];
        if ((shown == kNoSample) != (expected == kNoSample)) {
            ++wrong;
            continue;
        }
        if (shown == kNoSample) {
            wrong += warped.colors[pixel] == glm::vec<4, std::uint8_t>(0) ? 0 : 1;
            wrong += by_depth.colors[pixel] == glm::vec<4, std::uint8_t>(0) ? 0 : 1;
            wrong += std::isinf(warped.depths[pixel]) ? 0 : 1;
            continue;
        }
        ++agreement.covered;
        const LayeredSample& sample = image.samples[shown];
        const LayeredSample& other = image.samples[expected];
        wrong += warped.colors[pixel] == sample.color ? 0 : 1;
        wrong += by_depth.colors[pixel] == other.color ? 0 : 1;
        const float z = square_of(terms, sample, view).z;
        wrong += warped.depths[pixel] == z ? 0 : 1;
        if (z == nearest.depths[pixel]) {
            continue;
        }
        ++agreement.other;
        agreement.apart += z > 1.03F * nearest.depths[pixel] ? 1 : 0;
        const auto across = static_cast<std::size_t>(view.width);
        const dvec2 place(glm::uvec2(pixel % across, pixel / across));
        const dvec3 through = ray(view, place + 0.5);
        // The points on the pixel's ray at both depths, and what the image's eye sees of them.
        const dvec2 a = project(image.view, view.eye + through * double{z}).first;
        const dvec2 b =
            project(image.view, view.eye + through * double{nearest.depths[pixel]}).first;
        const double off = larger(a - place_of(sample)) + larger(b - place_of(other));
        // What rounding of depths and places to float adds is some thousand times smaller.
        constexpr double kRounding = 0.01;
        if (!(larger(a - b) <= 2.0 + off + kRounding)) {
            CAPTURE(pixel, shown, expected, z, nearest.depths[pixel], a.x, a.y, b.x, b.y, off);
            ++wrong;
            CHECK(larger(a - b) <= 2.0 + off + kRounding);
        }
        // Random layers have the samples of half of their texels on one ray.
        const bool is_centered = sample.x % kLayeredSteps == 8 && sample.y % kLayeredSteps == 8;
        if (sample.x == other.x && sample.y == other.y && is_centered) {
            const double along =
                glm::dot(ray(image.view, place_of(sample)), view.camera_to_world[2]);
            CAPTURE(pixel, shown, expected, along);
            ++wrong;
            CHECK(sample.depth == other.depth);
        }
    }
    CHECK(wrong == 0);
}

/// A view from `eye` in the direction that yaw and pitch [rad] say: with neither along -z.
View turned(View view, const dvec3& eye, double yaw, double pitch, double roll = 0.0) {
    const auto turn = [](int axis, double angle) {
        const int a = (axis + 1) % 3;
        const int b = (axis + 2) % 3;
        glm::dmat3 matrix(1.0);
        matrix[a][a] = matrix[b][b] = std::cos(angle);
        matrix[a][b] = std::sin(angle);
        matrix[b][a] = -std::sin(angle);
        return matrix;
    };
    view.eye = eye;
    view.camera_to_world = turn(1, yaw) * turn(0, pitch) * turn(2, roll);
    return view;
}

/// Runs tasks from the last to the first.
class BackwardExecutor final : public Executor {
  public:
    void run(std::size_t count, const std::function<void(std::size_t)>& task) override {
        for (std::size_t i = count; i > 0; --i) {
            task(i - 1);
        }
    }
};

bool same(const WarpedLayers& a, const WarpedLayers& b) {
    return a.width == b.width && a.height == b.height && a.colors == b.colors &&
           a.depths == b.depths && a.samples == b.samples;
}

} // namespace

TEST_CASE("terms say where a sample is seen, and how large") {
    Random random(3);
    for (int trial = 0; trial < 200; ++trial) {
        View from = straight_view(64, 48);
        from.lens.left *= random.uniform(0.5, 1.5);
        from.lens.top *= random.uniform(0.5, 1.5);
        from = turned(from, random.vector(-1e5, 1e5), random.uniform(-3.0, 3.0), 0.3, 0.2);
        const LayeredDepthImage image = random_layers(random, from, 2.0, 300.0, 1);
        View view = turned(
            straight_view(80, 50, 1.2),
            from.eye + random.vector(-1.0, 1.0),
            random.uniform(-3.0, 3.0),
            random.uniform(-1.0, 1.0),
            random.uniform(-1.0, 1.0)
        );
        view.lens.right *= random.uniform(0.5, 1.5);
        view.lens.bottom *= random.uniform(0.5, 1.5);
        const LayeredTerms terms = layered_terms(image, view);
        CHECK(terms.near_distance == static_cast<float>(view.lens.near_distance));
        CHECK(terms.far_distance == static_cast<float>(view.lens.far_distance));
        for (std::size_t i = 0; i < image.samples.size(); i += 7) {
            const LayeredSample& sample = image.samples[i];
            const dvec3 point = point_of(image, sample);
            const auto [place, z] = project(view, point);
            // Nearer, or farther aside, places lose digits that are there for all that is in view.
            if (z < 0.2 || larger(place) > 1000.0) {
                continue;
            }
            const glm::dvec3 seen = glm::dvec3(terms.columns[0]) * double(sample.x) +
                                    glm::dvec3(terms.columns[1]) * double(sample.y) +
                                    glm::dvec3(terms.columns[2]) * double(sample.depth) +
                                    glm::dvec3(terms.columns[3]);
            const double inverse_depth =
                double{terms.inverse_step} * sample.depth + double{terms.inverse_far};
            CAPTURE(trial, i, place.x, place.y, z);
            // Terms are rounded to 24 bits; what they sum up to is up to 1000 times smaller than
            // they are (a place of a thousand pixels, W of a tenth), so some 1e-4 are left.
            CHECK(larger(dvec2(seen) / seen.z - place) < 1e-2);
            CHECK(seen.z / inverse_depth == Approx(z).epsilon(1e-4));
            // A texel at the depth of the sample, turned to the view.
            const dvec2 texel = tangents(from) * depth_of(image, sample);
            const dvec2 pixel = tangents(view) * z;
            const double side = std::max(texel.x, texel.y) / std::min(pixel.x, pixel.y);
            CHECK(256.0 * double{terms.size} / seen.z == Approx(side).epsilon(1e-4));
        }
    }
}

TEST_CASE("from its own eye every texel shows its nearest sample") {
    Random random(11);
    const View view = straight_view(37, 21);
    const auto fill = [&](int column, int row, std::vector<LayeredSample>& samples) {
        for (unsigned left = random.below(5); left > 0; --left) {
            samples.push_back(sample_in(column, row, random.below(65536)));
            samples.back().color = random_color(random);
        }
    };
    const LayeredDepthImage image = layered_image(view, 2.0, 50.0, fill);
    const WarpedLayers warped = warp(image, view);
    std::uint32_t next = 0;
    for (std::size_t texel = 0; texel < image.counts.size(); ++texel) {
        CAPTURE(texel);
        const bool is_empty = image.counts[texel] == 0;
        REQUIRE(warped.samples[texel] == (is_empty ? kNoSample : next));
        if (!is_empty) {
            CHECK(warped.colors[texel] == image.samples[next].color);
            const double depth = depth_of(image, image.samples[next]);
            CHECK(double{warped.depths[texel]} == Approx(depth).epsilon(1e-6));
        }
        next += image.counts[texel];
    }
}

TEST_CASE("images with next to nothing are warped") {
    const View target = straight_view(9, 7);
    const auto none = [](int, int, std::vector<LayeredSample>&) {};
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(5, 1), std::pair(33, 40)}) {
        const WarpedLayers warped =
            warp(layered_image(straight_view(width, height), 1.0, 2.0, none), target);
        CHECK(std::count(warped.samples.begin(), warped.samples.end(), kNoSample) == 63);
        for (std::size_t i = 0; i < warped.depths.size(); ++i) {
            CHECK(std::isinf(warped.depths[i]));
            CHECK(warped.colors[i] == glm::vec<4, std::uint8_t>(0));
        }
    }
    const auto one = [](int column, int row, std::vector<LayeredSample>& samples) {
        samples = {sample_in(column, row, 0)};
    };
    // One texel fills what it is the whole window of.
    const LayeredDepthImage single = layered_image(straight_view(1, 1), 1.0, 2.0, one);
    View square = straight_view(6, 6);
    const WarpedLayers warped = warp(single, square);
    CHECK(std::count(warped.samples.begin(), warped.samples.end(), 0U) == 36);
    CHECK(warped.depths[0] == Approx(2.0));
    // And a pixel is one of one texel.
    square = straight_view(1, 1);
    CHECK(warp(single, square).samples == std::vector<std::uint32_t>{0});

    Random random(5);
    Agreement agreement;
    for (const auto& [width, height] : {std::pair(1, 1), std::pair(40, 1), std::pair(1, 40)}) {
        const LayeredDepthImage image =
            random_layers(random, straight_view(width, height), 3.0, 30.0, 6);
        for (int trial = 0; trial < 10; ++trial) {
            compare(image, turned(target, random.vector(-1.0, 1.0), 0.0, 0.0), agreement);
        }
    }
    CHECK(agreement.covered > 0);
}

TEST_CASE("only samples between the near and the far plane are drawn") {
    // The middle texel of three, with one sample of each of four depths.
    const auto fill = [](int column, int, std::vector<LayeredSample>& samples) {
        if (column == 1) {
            for (const unsigned depth : {65535U, 40000U, 20000U, 0U}) {
                samples.push_back(sample_in(1, 0, depth));
            }
        }
    };
    const LayeredDepthImage image = layered_image(straight_view(3, 1), 2.0, 10.0, fill);
    View view = straight_view(3, 1);
    for (std::uint32_t first = 0; first < 4; ++first) {
        const double depth = depth_of(image, image.samples[first]);
        view.lens.near_distance = depth * 0.999;
        view.lens.far_distance = 11.0;
        CHECK(warp(image, view).samples[1] == first);
        view.lens.near_distance = depth * 1.001;
        CHECK(warp(image, view).samples[1] == (first == 3 ? kNoSample : first + 1));
        // Seen from behind the farthest one: that is the nearest then.
        View back = turned(straight_view(3, 1), {0.0, 0.0, -12.0}, 3.14159265358979, 0.0);
        back.lens.far_distance = (12.0 - depth) * 1.001;
        CHECK(warp(image, back).samples[1] == 3);
        back.lens.near_distance = (12.0 - depth) * 0.999;
        CHECK(warp(image, back).samples[1] == first);
        back.lens.near_distance = 0.1;
        back.lens.far_distance = (12.0 - depth) * 0.999;
        CHECK(warp(image, back).samples[1] == (first == 3 ? kNoSample : 3));
    }
    // What is behind the eye is nowhere.
    view = turned(straight_view(3, 1), {0.0, 0.0, -20.0}, 0.0, 0.0);
    CHECK(warp(image, view).samples[1] == kNoSample);
}

TEST_CASE("a warp shows what a depth buffer shows, from wherever it is") {
    Random random(17);
    const View from = straight_view(24, 18);
    const LayeredDepthImage image = random_layers(random, from, 3.0, 30.0, 4);
    const View target = straight_view(40, 30);
    Agreement agreement;
    const double half = tangents(from).x * 0.5; // of a texel, at 1 m
    const std::vector<dvec3> eyes = {
        {0.0, 0.0, 0.0},    // the image's own
        {0.0, 0.0, -1.0},   // ahead: the epipole is where texels meet
        {half, half, -1.0}, // in the middle of one
        {0.0, 0.0, -8.0},   // among the samples
        {0.0, 0.0, 2.0},    // behind
        {half, half, 1.0},  //
        {1.0, 0.0, 0.0},    // beside: the epipole is infinitely far
        {-1.0, 0.0, 0.0},   //
        {0.0, 1.0, 0.0},    //
        {0.0, -1.0, 0.0},   //
        {0.7, 0.7, 0.0},    // and on a diagonal
        {0.7, -0.7, 0.0},   //
        {0.3, 0.0, -1.0},   // in the epipole's row, ahead and behind
        {0.3, 0.0, 1.0},    //
        {0.0, -0.3, -1.0},  // in its column
        {0.0, -0.3, 1.0},   //
        {1.0, 1.0, -1e-9},  // just not beside
        {1.0, 1.0, 1e-9},   //
        {1e-12, 0.0, 0.0},  // just not its own
        {-1.5, 0.4, -0.5},  // the epipole is outside of the image, ahead and behind
        {-1.5, 0.4, 0.5}};
    for (const dvec3& eye : eyes) {
        CAPTURE(eye.x, eye.y, eye.z);
        compare(image, turned(target, eye, 0.0, 0.0), agreement);
        compare(image, turned(target, eye, 0.4, -0.2, 0.7), agreement);
        compare(image, turned(target, eye, -1.2, 0.1), agreement);
    }
    CHECK(agreement.covered > 20'000);
    CAPTURE(agreement.covered, agreement.other);
    // Layers without any shape are the worst there is: of what overlaps much is less than 2 texels
    // of parallax apart, and either is shown. Measured: 0.21.
    CHECK(static_cast<double>(agreement.other) < 0.25 * static_cast<double>(agreement.covered));

    // From far ahead, looking back: what was behind is in front.
    Agreement back;
    for (const dvec3& eye :
         {dvec3(0.0, 0.0, -35.0), dvec3(3.0, 1.0, -32.0), dvec3(half, half, -31.0)}) {
        CAPTURE(eye.x, eye.y, eye.z);
        compare(image, turned(target, eye, 3.14159265358979, 0.0), back);
        compare(image, turned(target, eye, 2.6, 0.3), back);
        compare(image, turned(target, eye, 1.7, 0.0), back); // across: some rays come, some go
    }
    CHECK(back.covered > 1000);
}

TEST_CASE("a warp shows what a depth buffer shows, of random images from random eyes") {
    Random random(23);
    Agreement agreement;
    for (int trial = 0; trial < 300; ++trial) {
        CAPTURE(trial);
        const View from = turned(
            straight_view(
                5 + static_cast<int>(random.below(40)), 5 + static_cast<int>(random.below(40))
            ),
            random.vector(-1e4, 1e4),
            random.uniform(-3.0, 3.0),
            random.uniform(-1.0, 1.0)
        );
        const double near = random.uniform(1.0, 5.0);
        const LayeredDepthImage image = random_layers(
            random, from, near, near * random.uniform(1.1, 20.0), 1 + random.below(5)
        );
        View view = turned(
            straight_view(
                5 + static_cast<int>(random.below(70)), 5 + static_cast<int>(random.below(70))
            ),
            from.eye + random.vector(-2.0, 2.0) * random.uniform(0.0, 1.0),
            0.0,
            0.0
        );
        view.camera_to_world = from.camera_to_world * turned(
                                                          view,
                                                          view.eye,
                                                          random.uniform(-0.8, 0.8),
                                                          random.uniform(-0.5, 0.5),
                                                          random.uniform(-0.5, 0.5)
                                                      )
                                                          .camera_to_world;
        compare(image, view, agreement);
    }
    CAPTURE(agreement.covered, agreement.other);
    CHECK(agreement.covered > 100'000);
    CHECK(static_cast<double>(agreement.other) < 0.25 * static_cast<double>(agreement.covered));
}

TEST_CASE("of surfaces a warp shows what a depth buffer shows nearly everywhere") {
    // Discs of different depths, whole behind each other, before a wall that recedes to the right.
    const View from = straight_view(96, 72);
    const auto fill = [](int column, int row, std::vector<LayeredSample>& samples) {
        samples.push_back(sample_in(column, row, static_cast<unsigned>(12'000 - 80 * column)));
        const dvec2 place(column, row);
        for (int disc = 0; disc < 8; ++disc) {
            const dvec2 middle(10 + 11 * disc, 15 + (disc * 29) % 45);
            if (glm::distance(place, middle) < 14.0) {
                samples.push_back(
                    sample_in(column, row, static_cast<unsigned>(20'000 + 6000 * disc))
                );
            }
        }
        for (LayeredSample& sample : samples) {
            sample.extent = 320;
        }
    };
    const LayeredDepthImage image = layered_image(from, 3.0, 30.0, fill);
    Agreement agreement;
    for (const dvec3& eye :
         {dvec3(0.5, 0.1, 0.0),
          dvec3(-0.4, 0.4, 0.2),
          dvec3(0.0, -0.5, -0.3),
          dvec3(0.02, 0.01, -1.0),
          dvec3(0.1, 0.0, 1.0)}) {
        CAPTURE(eye.x, eye.y, eye.z);
        compare(image, turned(straight_view(96, 72), eye, 0.1, 0.0, 0.05), agreement);
    }
    CAPTURE(agreement.covered, agreement.other, agreement.apart);
    CHECK(agreement.covered > 25'000);
    // Neighbours on one surface overlap in many pixels. Those of two do at rims.
    CHECK(static_cast<double>(agreement.apart) < 0.01 * static_cast<double>(agreement.covered));
}

TEST_CASE("a warp is the same with every executor, and with samples or without") {
    Random random(31);
    const LayeredDepthImage image = random_layers(random, straight_view(70, 50), 3.0, 30.0, 4);
    const View view = turned(straight_view(150, 133), {0.4, 0.2, -0.9}, 0.1, 0.05);
    for (const LayeredFront front : {LayeredFront::order, LayeredFront::depth}) {
        const WarpedLayers expected = warp(image, view, front);
        LayeredWarper warper;
        WarpedLayers warped;
        BackwardExecutor backward;
        warper.warp(image, view, backward, warped, true, front);
        CHECK(same(warped, expected));
        for (const unsigned threads : {1U, 2U, 5U}) {
            ThreadExecutor executor(threads);
            warper.warp(image, view, executor, warped, true, front);
            CHECK(same(warped, expected));
        }
        warper.warp(image, view, backward, warped, false, front);
        CHECK(warped.samples.empty());
        CHECK(warped.colors == expected.colors);
        CHECK(warped.depths == expected.depths);
    }
}

TEST_CASE("a warm warper allocates nothing, for other images neither") {
    Random random(37);
    const LayeredDepthImage large = random_layers(random, straight_view(70, 50), 3.0, 30.0, 4);
    const LayeredDepthImage small = random_layers(random, straight_view(20, 33), 3.0, 30.0, 2);
    const View view = turned(straight_view(150, 133), {0.4, 0.2, -0.9}, 0.1, 0.05);
    const View less = turned(straight_view(31, 77), {-0.4, 0.2, 0.9}, 0.1, 0.05);
    const WarpedLayers expected = warp(small, less);
    LayeredWarper warper;
    WarpedLayers warped;
    SerialExecutor executor;
    const auto warp_all = [&] {
        for (const LayeredFront front : {LayeredFront::depth, LayeredFront::order}) {
            for (const bool keep_samples : {false, true}) {
                warper.warp(large, view, executor, warped, keep_samples, front);
                warper.warp(large, less, executor, warped, keep_samples, front);
                warper.warp(small, view, executor, warped, keep_samples, front);
                warper.warp(small, less, executor, warped, keep_samples, front);
            }
        }
    };
    warp_all();
    const std::uint64_t before = allocation_count();
    warp_all();
    CHECK(allocation_count() == before);
    // What was there before does not show.
    CHECK(same(warped, expected));
    LayeredWarper moved = std::move(warper);
    moved.warp(small, less, executor, warped, true, LayeredFront::order);
    CHECK(same(warped, expected));
}
