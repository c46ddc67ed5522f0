#include "pictures.hpp"
#include "support/random.hpp"
#include <farfield/eval/disparity.hpp>
#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

namespace {

using farfield::FrameDisparity;
using farfield::ItemId;
using farfield::NodeDisparity;
using farfield::PositionPicture;
using farfield::PositionTexel;
using farfield::Result;
using farfield::View;
using farfield::test::pixel_at;
using glm::dmat4x3;
using glm::dvec2;
using glm::dvec3;
namespace eval = farfield::eval;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFocalPx = 100.0;
constexpr int kSize = 200;
constexpr std::size_t kPixels = std::size_t{kSize} * kSize;

// Positions and tangents are of the order of 10 and 1 and rounded a few times in double.
constexpr double kRounding = 1e-11;

/// 90 degrees wide: the tangents at the edges are 1.
View square_view(const dvec3& eye) {
    View view;
    view.eye = eye;
    view.lens = farfield::Lens{-1.0, 1.0, -1.0, 1.0, 0.1, 1000.0};
    view.width = kSize;
    view.height = kSize;
    return view;
}

/// Through the middle of a pixel, at depth 1, relative to the eye. @param y from the top
dvec3 direction(const View& view, double x, double y) {
    const farfield::Lens& lens = view.lens;
    const double tan_x = lens.left + (x + 0.5) / view.width * (lens.right - lens.left);
    const double tan_y = lens.top - (y + 0.5) / view.height * (lens.top - lens.bottom);
    return view.camera_to_world * dvec3(tan_x, tan_y, -1.0);
}

/// A picture that shows exactly known points: each has an item of its own, whose frame alone says
/// where it is, so that nothing is rounded to float.
class Shown {
  public:
    explicit Shown(const View& view) : view_(view), picture_{view.width, view.height, {}} {
        picture_.texels.resize(pixel_at(view.width, 0, view.height));
    }

    PositionTexel& show(int x, int y, const dvec3& world, std::uint32_t node, float texel_px) {
        dmat4x3 frame(1.0);
        frame[3] = world;
        frames_.push_back(frame);
        PositionTexel& texel = texel_at(x, y);
        texel.item = farfield::make_id<ItemId>(frames_.size() - 1);
        texel.node = node;
        texel.texel_px = texel_px;
        return texel;
    }

    PositionTexel& texel_at(int x, int y) {
        return picture_.texels[pixel_at(picture_.width, x, y)];
    }

    /// Shows a point that belongs (dx, dy) pixels from the middle of the pixel, y down.
    PositionTexel&
    show_off(int x, int y, double dx, double dy, std::uint32_t node = 1, float texel_px = 0.0F) {
        return show(x, y, view_.eye + 10.0 * direction(view_, x + dx, y + dy), node, texel_px);
    }

    [[nodiscard]] FrameDisparity measured(std::optional<double> error_px) const {
        auto result = eval::measure_disparity(picture_, view_, frames_, error_px);
        REQUIRE(result);
        return *result;
    }

    std::vector<dmat4x3>& frames() { return frames_; }

  private:
    View view_;
    PositionPicture picture_;
    std::vector<dmat4x3> frames_;
};

float at(const FrameDisparity& disparity, int x, int y) {
    return farfield::test::at(disparity.map, x, y);
}

auto near(double value, double margin) {
    return Approx(value).epsilon(0.0).margin(margin);
}

} // namespace

TEST_CASE("disparity is measured on a picture of the view alone", "[disparity]") {
    const View view = square_view(dvec3(0.0));
    PositionPicture good{kSize, kSize, std::vector<PositionTexel>(kPixels)};
    CHECK(eval::measure_disparity(good, view, {}, 2.0));
    CHECK_FALSE(eval::measure_disparity(PositionPicture{}, View{}, {}, 2.0));
    CHECK_FALSE(eval::measure_disparity(good, View{}, {}, 2.0));
    for (const double wrong : {0.0, -1.0, std::nan(""), kInfinity}) {
        CHECK_FALSE(eval::measure_disparity(good, view, {}, wrong));
    }
    PositionPicture cut = good;
    cut.texels.pop_back();
    CHECK_FALSE(eval::measure_disparity(cut, view, {}, 2.0));
    View other = view;
    other.height = kSize / 2;
    const auto refused = eval::measure_disparity(good, other, {}, 2.0);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message == "position picture is 200x200 pixels, the view 200x100");
}

TEST_CASE("a frame that shows nothing has no disparity", "[disparity]") {
    const FrameDisparity nothing = Shown(square_view(dvec3(0.0))).measured(2.0);
    CHECK(nothing.image_pixels == 0);
    CHECK(nothing.geometry_pixels == 0);
    CHECK(nothing.unmeasured_pixels == 0);
    CHECK_FALSE(nothing.bound_px.has_value());
    CHECK(nothing.over_bound == 0U);
    CHECK_FALSE(nothing.geometry_max_px.has_value());
    CHECK(nothing.histogram.count() == 0);
    CHECK(nothing.nodes.empty());
    CHECK(std::all_of(nothing.map.values.begin(), nothing.map.values.end(), [](float value) {
        return std::isnan(value);
    }));
}

TEST_CASE("geometry is told apart and promises nothing", "[disparity]") {
    const View view = square_view(dvec3(3.0, -2.0, 5.0));
    Shown shown(view);
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            shown.show_off(x, y, 0.0, 0.0, UINT32_MAX);
        }
    }
    const FrameDisparity exact = shown.measured(2.0);
    CHECK(exact.geometry_pixels == kPixels);
    CHECK(exact.image_pixels == 0);
    REQUIRE(exact.geometry_max_px.has_value());
    CHECK(*exact.geometry_max_px <= kRounding);
    CHECK(exact.over_bound == 0U);
    CHECK_FALSE(exact.bound_px.has_value());
    CHECK(exact.nodes.empty());

    shown.show_off(7, 9, 5.0, -12.0, UINT32_MAX);
    const FrameDisparity off = shown.measured(2.0);
    CHECK(*off.geometry_max_px == near(13.0, kRounding));
    CHECK(off.over_bound == 0U);
    CHECK(at(off, 7, 9) == 13.0F);
}

TEST_CASE("a point moved by an angle is further off at the corner", "[disparity]") {
    // Turned about the eye's vertical axis by a, the tangents (u, v) become
    // (tan(atan(u) + a), v cos(atan(u)) / cos(atan(u) + a)).
    const View view = square_view(dvec3(0.0));
    const double angle_rad = 0.01;
    Shown shown(view);
    const auto turned = [&](int x, int y) {
        const dvec3 from = 10.0 * direction(view, x, y);
        const double c = std::cos(angle_rad);
        const double s = std::sin(angle_rad);
        shown.show(x, y, dvec3(c * from.x - s * from.z, from.y, s * from.x + c * from.z), 4, 0.0F);
        const double u = from.x / 10.0;
        const double v = from.y / 10.0;
        const double turned_u = std::tan(std::atan(u) + angle_rad);
        const double turned_v = v * std::cos(std::atan(u)) / std::cos(std::atan(u) + angle_rad);
        return kFocalPx * std::hypot(turned_u - u, turned_v - v);
    };
    const double centre = turned(99, 99);
    const double edge = turned(199, 99);
    const double corner = turned(199, 0);
    // By hand: tan(0.01) * 100 at the centre; twice that at the edge, where the tangent is 1 and
    // its derivative 1 + 1^2; at the corner sqrt(2^2 + 1^2) of it.
    CHECK(centre == near(1.0, 2e-3));
    CHECK(edge == near(2.0, 5e-2));
    CHECK(corner == near(std::sqrt(5.0), 5e-2));

    const FrameDisparity disparity = shown.measured(2.0);
    CHECK(disparity.image_pixels == 3);
    CHECK(at(disparity, 99, 99) == near(centre, 1e-6)); // stored as float
    CHECK(at(disparity, 199, 99) == near(edge, 1e-6));
    CHECK(at(disparity, 199, 0) == near(corner, 1e-6));
    REQUIRE(disparity.nodes.size() == 1);
    CHECK(disparity.nodes[0].disparity_px == near(corner, kRounding));
    CHECK(disparity.nodes[0].x == 199);
    CHECK(disparity.nodes[0].y == 0);
    CHECK(disparity.over_bound == 1U + (edge > 2.0 ? 1U : 0U));
}

TEST_CASE("a scene far from the origin is measured as one near it", "[disparity]") {
    // Near 1e7 doubles are 1.9e-9 apart. The point and the eye are each rounded by half of that, in
    // three axes at a depth of 10 and up to 45 degrees aside: at most 100 / 10 * 2 * sqrt(3) *
    // 1.9e-9 pixels.
    const double margin = 7e-8;
    const View view = square_view(dvec3(1e7, -2e6, 7e6));
    Shown shown(view);
    double expected = 0.0;
    for (int i = 0; i < kSize; i += 3) {
        const double dx = 0.01 * i;
        expected = std::hypot(dx, 1.5);
        shown.show_off(i, kSize - 1 - i, dx, -1.5, static_cast<std::uint32_t>(i));
    }
    const FrameDisparity disparity = shown.measured(2.0);
    CHECK(disparity.nodes.size() == 67);
    for (const NodeDisparity& node : disparity.nodes) {
        CHECK(node.disparity_px == near(std::hypot(0.01 * node.node, 1.5), margin));
    }
    CHECK(disparity.nodes.back().disparity_px == near(expected, margin));
}

TEST_CASE("the eye is taken away before digits are lost", "[disparity]") {
    // Doubles near 1e12 are 1.2e-4 apart. Eye and item are on them; the point in the item is not.
    const View view = square_view(dvec3(1e12, -3e12, 2e12));
    Shown shown(view);
    PositionTexel& texel = shown.show(100, 99, view.eye + dvec3(0.0, 0.0, -8.0), 1, 0.0F);
    texel.point = glm::vec3(0.3F, 0.7F, 0.0F);
    const dvec2 belongs(100.0 + 100.0 / 8.0 * double{0.3F}, 100.0 - 100.0 / 8.0 * double{0.7F});
    const FrameDisparity disparity = shown.measured(2.0);
    REQUIRE(disparity.nodes.size() == 1);
    CHECK(
        disparity.nodes[0].disparity_px ==
        near(glm::distance(belongs, dvec2(100.5, 99.5)), kRounding)
    );
}

TEST_CASE("any view brings points back to their pixels", "[disparity]") {
    farfield::support::Random random(30);
    for (int round = 0; round < 50; ++round) {
        CAPTURE(round);
        const double left = random.uniform(-2.0, 0.5);
        const double bottom = random.uniform(-2.0, 0.5);
        const farfield::Lens lens{
            left,
            left + random.uniform(0.1, 3.0),
            bottom,
            bottom + random.uniform(0.1, 3.0),
            0.1,
            1000.0};
        const dvec3 eye = random.vector(-100.0, 100.0);
        const View view =
            farfield::look_at(eye, eye + random.direction<double>(), {0.0, 1.0, 0.0}, lens, 31, 17);
        Shown shown(view);
        for (std::uint32_t node = 0; node < 10; ++node) {
            const auto x = static_cast<int>(random.below(31));
            const int y = static_cast<int>(node);
            const double length = random.uniform(0.0, 30.0);
            const double angle = random.uniform(0.0, 6.28);
            shown.show_off(x, y, length * std::cos(angle), length * std::sin(angle), node);
            const FrameDisparity disparity = shown.measured(std::nullopt);
            REQUIRE(disparity.nodes.size() == node + 1);
            // Pixels are as small as a tangent of 0.1 / 31, positions as large as 200.
            CHECK(disparity.nodes.back().disparity_px == near(length, 1e-9));
        }
    }
}

TEST_CASE("points are brought into the world by the frame of their item", "[disparity]") {
    const View view = square_view(dvec3(0.0));
    farfield::Scene scene;
    scene.meshes.resize(2);
    scene.meshes[1].origin = dvec3(1e7, 0.0, -4.0);
    scene.instances.resize(2);
    scene.instances[0].mesh = farfield::MeshId{0};
    scene.instances[1].mesh = farfield::MeshId{1};
    // A quarter turn about y, doubled, then moved so that the origin of the mesh comes to
    // (0.5, 0.5, -10): x goes to -2z, z to 2x.
    dmat4x3& placed = scene.instances[1].object_to_world;
    placed[0] = dvec3(0.0, 0.0, -2.0);
    placed[1] = dvec3(0.0, 2.0, 0.0);
    placed[2] = dvec3(2.0, 0.0, 0.0);
    placed[3] = dvec3(8.5, 0.5, 2e7 - 10.0);
    const std::vector<dmat4x3> frames = farfield::item_frames(scene);
    REQUIRE(frames.size() == 2);
    CHECK(frames[0] == dmat4x3(1.0));
    CHECK(frames[1][3] == dvec3(0.5, 0.5, -10.0));

    PositionPicture picture{kSize, kSize, std::vector<PositionTexel>(kPixels)};
    PositionTexel& texel = picture.texels[pixel_at(kSize, 105, 95)];
    texel.item = ItemId{1};
    texel.node = 3;
    // World (0.75, 1, -10.5): pixel (100 + 100 * 0.75 / 10.5, 100 - 100 / 10.5).
    texel.point = glm::vec3(0.25F, 0.25F, 0.125F);
    const auto disparity = eval::measure_disparity(picture, view, frames, 2.0);
    REQUIRE(disparity);
    REQUIRE(disparity->nodes.size() == 1);
    const dvec2 belongs(100.0 + 75.0 / 10.5, 100.0 - 100.0 / 10.5);
    CHECK(
        disparity->nodes[0].disparity_px ==
        near(glm::distance(belongs, dvec2(105.5, 95.5)), kRounding)
    );
}

TEST_CASE("what is behind the eye is infinitely far off", "[disparity]") {
    const View view = square_view(dvec3(1.0, 2.0, 3.0));
    Shown shown(view);
    shown.show(5, 6, view.eye + dvec3(0.0, 0.0, 1.0), 2, 1.0F); // behind
    shown.show(6, 6, view.eye + dvec3(1.0, 1.0, 0.0), 2, 1.0F); // beside
    shown.show(7, 6, view.eye, 2, 1.0F);                        // in it
    shown.show(8, 6, view.eye + dvec3(0.0, 0.0, 2.0), UINT32_MAX, 0.0F);
    shown.show_off(9, 6, 1000.0, 0.0, 2); // outside the window, but in front
    const FrameDisparity disparity = shown.measured(2.0);
    CHECK(disparity.infinite_pixels == 3);
    CHECK(disparity.image_pixels == 4);
    CHECK(disparity.over_bound == 4U);
    CHECK(disparity.geometry_max_px == kInfinity);
    CHECK(disparity.histogram.max() == kInfinity);
    CHECK(std::isinf(at(disparity, 5, 6)));
    CHECK(at(disparity, 9, 6) == near(1000.0, 1e-4));
    REQUIRE(disparity.nodes.size() == 1);
    CHECK(disparity.nodes[0].disparity_px == kInfinity);
    CHECK(disparity.nodes[0].x == 5);
    CHECK(disparity.nodes[0].pixels == 4);
}

TEST_CASE("the promise pays for the error and for sampling", "[disparity]") {
    CHECK(eval::kSamplingShare >= std::sqrt(0.5)); // the safe side of half a diagonal
    CHECK(eval::kSamplingShare < std::sqrt(0.5) + 0.005);

    const View view = square_view(dvec3(0.0));
    Shown shown(view);
    shown.show_off(10, 10, 2.40, 0.0, 7, 0.5F);  // promise 2.355
    shown.show_off(11, 10, 2.30, 0.0, 7, 0.5F);  // kept
    shown.show_off(12, 10, 3.40, 0.0, 7, 2.0F);  // promise 3.42: kept, though further off
    shown.show_off(13, 10, 0.0, 1.999, 3, 0.0F); // promise 2
    const FrameDisparity disparity = shown.measured(2.0);
    CHECK(disparity.over_bound == 1U);
    CHECK(*disparity.bound_px == near(3.42, kRounding));
    CHECK(*disparity.histogram.max() == near(3.40, kRounding));
    REQUIRE(disparity.nodes.size() == 2);
    CHECK(disparity.nodes[0].node == 3);
    CHECK(disparity.nodes[0].over_bound == 0);
    CHECK(disparity.nodes[1].node == 7);
    CHECK(disparity.nodes[1].pixels == 3);
    CHECK(disparity.nodes[1].over_bound == 1);
    CHECK(disparity.nodes[1].x == 10);
    CHECK(disparity.nodes[1].less_sampling_px() == near(2.40 - 0.355, kRounding));

    // A promise is kept up to its very end.
    Shown one(view);
    one.show_off(20, 30, 1.0, 1.0);
    const double exact = one.measured(2.0).nodes[0].disparity_px;
    CHECK(one.measured(exact).over_bound == 0U);
    CHECK(one.measured(std::nextafter(exact, 0.0)).over_bound == 1U);

    // Without a promise nothing is over it, and disparity is the same.
    const FrameDisparity free = shown.measured(std::nullopt);
    CHECK_FALSE(free.over_bound.has_value());
    CHECK_FALSE(free.bound_px.has_value());
    CHECK(free.histogram == disparity.histogram);
    CHECK(free.nodes[1].over_bound == 0);
    CHECK(free.nodes[1].less_sampling_px() == disparity.nodes[1].less_sampling_px());
}

TEST_CASE("what a device should not have written is counted, not measured", "[disparity]") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    const View view = square_view(dvec3(0.0));
    Shown shown(view);
    shown.show_off(0, 0, 0.0, 0.0).point.x = nan;
    shown.show_off(1, 0, 0.0, 0.0).point.y = infinity;
    shown.show_off(2, 0, 0.0, 0.0).point.z = -infinity;
    shown.show_off(3, 0, 0.0, 0.0).texel_px = nan;
    shown.show_off(4, 0, 0.0, 0.0).texel_px = infinity;
    shown.show_off(5, 0, 0.0, 0.0).texel_px = -1.0F;
    shown.show_off(6, 0, 0.0, 0.0).item = ItemId{1000};
    shown.show_off(7, 0, 0.0, 0.0, UINT32_MAX).point.x = nan;
    shown.show_off(8, 0, 0.0, 0.0);
    shown.frames().back()[3].x = std::nan("");
    shown.show_off(9, 0, 3.0, 4.0); // the only good one
    const FrameDisparity disparity = shown.measured(2.0);
    CHECK(disparity.unmeasured_pixels == 9);
    CHECK(disparity.geometry_pixels == 0);
    CHECK(disparity.image_pixels == 1);
    CHECK(std::isnan(at(disparity, 0, 0)));
    CHECK(at(disparity, 9, 0) == 5.0F);
    CHECK(*disparity.histogram.max() == near(5.0, kRounding));
}

TEST_CASE("any bits give counts that add up", "[disparity]") {
    farfield::support::Random random(31);
    const auto any_float = [&] {
        return std::bit_cast<float>(random.below(65536) * 65536U + random.below(65536));
    };
    View view = square_view(random.vector(-1e3, 1e3));
    view.width = 23;
    view.height = 19;
    const std::vector<dmat4x3> frames(5, dmat4x3(1.0));
    for (int round = 0; round < 100; ++round) {
        PositionPicture picture{23, 19, {}};
        std::uint64_t background = 0;
        for (int i = 0; i < 23 * 19; ++i) {
            PositionTexel& texel = picture.texels.emplace_back();
            texel.point = {any_float(), any_float(), any_float()};
            texel.texel_px = any_float();
            texel.node = random.below(3) == 0 ? UINT32_MAX : random.below(4);
            const unsigned item = random.below(7);
            texel.item = item == 6 ? farfield::kNone<ItemId> : ItemId{item};
            background += item == 6 ? 1 : 0;
        }
        const auto disparity = eval::measure_disparity(picture, view, frames, 1.0);
        REQUIRE(disparity);
        CHECK(
            disparity->image_pixels + disparity->geometry_pixels + disparity->unmeasured_pixels +
                background ==
            picture.texels.size()
        );
        CHECK(disparity->histogram.count() == disparity->image_pixels);
        CHECK(disparity->infinite_pixels <= disparity->image_pixels);
        std::uint64_t of_nodes = 0;
        for (const NodeDisparity& node : disparity->nodes) {
            CHECK(node.over_bound <= node.pixels);
            of_nodes += node.pixels;
        }
        CHECK(of_nodes == disparity->image_pixels);
    }
}
