#include "gpu/drawer.hpp"
#include "gpu/drawing.hpp"
#include "gpu/flat_scene.hpp"
#include "support/random.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

using Rgba = glm::vec<4, std::uint8_t>;
constexpr Rgba kRedCell{255, 0, 0, 255};
constexpr Rgba kGreenCell{0, 255, 0, 255};
constexpr Rgba kBlueCell{0, 0, 255, 255};
constexpr Rgba kWhiteCell{255};
/// Counts: each one on top adds 1, as long as there are so few that what shines through of those
/// below, 254 / 255 of them, rounds to all of them.
constexpr Rgba kCount{1};

/// A square on the pixels of the flat view; exact, since a pixel is a quarter of a metre there.
/// @param x, y [px] of its lower left corner, y up
Splat flat_splat(float x, float y, float side, const Rgba& color, float z = 0.0F) {
    constexpr float kHalf = 0.5F * kSize;
    const float pixel = (8.0F - z) / kHalf;
    return {
        {(x + 0.5F * side - kHalf) * pixel, (y + 0.5F * side - kHalf) * pixel, z},
        side * pixel,
        color};
}

void add_splats(FramePlan& plan, const std::vector<Splat>& splats) {
    Command command;
    command.kind = Command::Kind::splats;
    command.first = static_cast<std::uint32_t>(plan.splats.size());
    command.count = static_cast<std::uint32_t>(splats.size());
    plan.splats.insert(plan.splats.end(), splats.begin(), splats.end());
    plan.commands.push_back(command);
    ++plan.passes.back().command_count;
}

void add_cubes(FramePlan& plan, const std::vector<ShownCube>& cubes) {
    Command command;
    command.kind = Command::Kind::cubes;
    command.first = static_cast<std::uint32_t>(plan.cubes.size());
    command.count = static_cast<std::uint32_t>(cubes.size());
    plan.cubes.insert(plan.cubes.end(), cubes.begin(), cubes.end());
    plan.commands.push_back(command);
    ++plan.passes.back().command_count;
}

FramePlan splat_plan(const std::vector<Splat>& splats, const View& view = flat_view()) {
    FramePlan plan = flat_plan({}, view);
    add_splats(plan, splats);
    return plan;
}

FramePlan cube_plan(const std::vector<ShownCube>& cubes, const View& view = flat_view()) {
    FramePlan plan = flat_plan({}, view);
    plan.cube_frames = {glm::mat3(1.0F)};
    add_cubes(plan, cubes);
    return plan;
}

/// A scene where nothing needs to be.
std::unique_ptr<Drawer> empty_drawer() {
    Scene scene = flat_scene();
    add_quad(scene, kRedPaint, {0.0, 0.0, 0.0});
    return make_drawer(scene);
}

/// Of a pixel in an array of rows.
std::size_t place_of(int x, int y, int width) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
}

int count_colored(const Picture& picture) {
    int count = 0;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            count += color_at(picture, x, y) == kBlack ? 0 : 1;
        }
    }
    return count;
}

glm::dmat3 random_rotation(Random& random) {
    const glm::dvec3 x = random.direction<double>();
    const glm::dvec3 z = glm::normalize(glm::cross(x, random.direction<double>()));
    return {x, glm::cross(z, x), z};
}

/// Off its axis, on other pixels than those of its target, turned.
View tilted_view(Random& random, const glm::dvec3& offset) {
    View view;
    view.eye = offset + random.vector(-3.0, 3.0);
    view.camera_to_world = random_rotation(random);
    view.lens = {-0.4, 0.9, -0.7, 0.3, 0.5, 60.0};
    view.width = 91;
    view.height = 57;
    return view;
}

/// A point before the eye.
/// @param x, y [px] of the view @param depth [m]
glm::dvec3 point_at(const View& view, double x, double y, double depth) {
    const Lens& lens = view.lens;
    const double u = lens.left + (lens.right - lens.left) * x / view.width;
    const double v = lens.bottom + (lens.top - lens.bottom) * y / view.height;
    return view.eye + view.camera_to_world * (depth * glm::dvec3(u, v, -1.0));
}

} // namespace

TEST_CASE("A splat covers the samples in its square, the left and lower edges included") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    // Edges at eighths of a pixel, so that an eighth of them pass through pixels' centres, exactly.
    Random random(11);
    for (const std::uint32_t most : {8U, 32U, 400U}) {
        std::vector<Splat> splats;
        std::vector<int> expected(std::size_t{kSize} * kSize, 0);
        const int count = most == 400 ? 3 : 400;
        for (int i = 0; i < count; ++i) {
            const int x = static_cast<int>(random.below(8 * kSize)) - 16;
            const int y = static_cast<int>(random.below(8 * kSize)) - 16;
            const int side = static_cast<int>(random.below(most));
            splats.push_back(flat_splat(
                static_cast<float>(x) / 8.0F,
                static_cast<float>(y) / 8.0F,
                static_cast<float>(side) / 8.0F,
                kCount
            ));
            for (int row = 0; row < kSize; ++row) {
                for (int column = 0; column < kSize; ++column) {
                    const int center_x = 8 * column + 4;
                    const int center_y = 8 * row + 4;
                    const bool inside = x <= center_x && center_x < x + side && y <= center_y &&
                                        center_y < y + side;
                    expected[place_of(column, kSize - 1 - row, kSize)] += inside ? 1 : 0;
                }
            }
        }
        const Picture picture = draw(drawer->backend(), splat_plan(splats), kSize, kSize);
        int wrong = 0;
        int covered = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const int there = expected[place_of(x, y, kSize)];
                wrong += color_at(picture, x, y)[0] == there ? 0 : 1;
                covered += there;
            }
        }
        INFO("sides up to " << most << " eighths of a pixel, " << covered << " covered");
        CHECK(wrong == 0);
        CHECK(covered > 100);
    }
}

TEST_CASE("Splats without a side or a colour show nothing") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    const FramePlan plan = splat_plan(
        {flat_splat(32.5F, 32.5F, 0.0F, kWhiteCell), flat_splat(10.0F, 10.0F, 9.0F, Rgba(0))}
    );
    for (const int samples : {1, std::min(4, drawer->backend().limits().samples)}) {
        CHECK(count_colored(draw(drawer->backend(), plan, kSize, kSize, samples)) == 0);
    }
    CHECK(count_colored(draw(drawer->backend(), splat_plan({}), kSize, kSize)) == 0);
    CHECK(count_colored(draw(drawer->backend(), cube_plan({}), kSize, kSize)) == 0);
}

TEST_CASE("Splats that tile a plane cover every sample once") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    // Three eighths of a pixel, from an eighth left of the frame: many edges meet in samples.
    constexpr int kAcross = kSize * 8 / 3 + 2;
    std::vector<Splat> splats;
    for (int row = 0; row < kAcross; ++row) {
        for (int column = 0; column < kAcross; ++column) {
            splats.push_back(flat_splat(
                static_cast<float>(3 * column - 1) / 8.0F,
                static_cast<float>(3 * row - 1) / 8.0F,
                0.375F,
                kCount
            ));
        }
    }
    for (const int samples : {1, std::min(4, drawer->backend().limits().samples)}) {
        const Picture picture = draw(drawer->backend(), splat_plan(splats), kSize, kSize, samples);
        int wrong = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                wrong += color_at(picture, x, y) == Color{1, 1, 1, 255} ? 0 : 1;
            }
        }
        INFO(samples << " samples");
        CHECK(wrong == 0);
    }
}

TEST_CASE("Splats cover the samples that geometry of the same shape covers") {
    // Edges at odd sixteenths of a pixel: samples are at eighths or sixteenths, so that none is
    // nearer than devices snap vertices to, and rounding decides nothing.
    struct Square {
        float x;
        float y;
        float side;
    };
    Random random(5);
    std::vector<Square> squares;
    for (int i = 0; i < 150; ++i) {
        const auto eighths = [&](std::uint32_t below) {
            return static_cast<float>(random.below(below)) / 8.0F;
        };
        squares.push_back(
            {eighths(8 * kSize) + 0.03125F, eighths(8 * kSize) + 0.03125F, eighths(24) + 0.0625F}
        );
    }
    squares.push_back({20.03125F, 30.15625F, 17.0625F}); // the inner pixels as one
    Scene scene = flat_scene();
    std::vector<ItemId> items;
    std::vector<Splat> splats;
    for (const Square& square : squares) {
        const Splat splat = flat_splat(square.x, square.y, square.side, kWhiteCell);
        splats.push_back(splat);
        items.push_back(add_quad(scene, glm::vec4(1.0F), splat.center, 0.5 * double{splat.side}));
    }
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    for (const int wanted : {1, 2, 4, 8}) {
        const int samples = std::min(wanted, drawer->backend().limits().samples);
        const Picture geometry = draw(drawer->backend(), flat_plan(items), kSize, kSize, samples);
        const Picture cells = draw(drawer->backend(), splat_plan(splats), kSize, kSize, samples);
        INFO(samples << " samples");
        CHECK(count_different(geometry, cells) == 0);
        CHECK(count_colored(cells) > 500);
        // And each alone, in pixels that it shares with none.
        for (std::size_t i = 0; i < 20; ++i) {
            CHECK(
                draw(drawer->backend(), flat_plan({items[i]}), kSize, kSize, samples) ==
                draw(drawer->backend(), splat_plan({splats[i]}), kSize, kSize, samples)
            );
        }
    }
}

TEST_CASE("Splats are where the view projects them, far from the world's origin as well") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    for (const glm::dvec3& origin : {glm::dvec3(0.0), glm::dvec3(1.0e7, -2.0e6, 4.0e6)}) {
        INFO("origin " << origin.x);
        Random random(23);
        for (int round = 0; round < 5; ++round) {
            const View view = tilted_view(random, origin);
            const Region viewport{7, 5, view.width, view.height};
            const Region scissor{12, 9, 70, 44};
            constexpr int kWidth = 110;
            constexpr int kHeight = 70;
            FramePlan plan = flat_plan({}, view);
            plan.origin = origin;
            plan.passes[0].viewport = viewport;
            plan.passes[0].scissor = scissor;
            std::vector<Splat> splats;
            std::vector<int> expected(std::size_t{kWidth} * kHeight, 0);
            for (int i = 0; i < 500; ++i) {
                const double depth = random.uniform(0.4, 70.0);
                const glm::dvec3 world =
                    point_at(view, random.uniform(-5.0, 96.0), random.uniform(-5.0, 62.0), depth);
                Splat splat;
                splat.center = glm::vec3(world - origin);
                splat.side = static_cast<float>(random.uniform(0.0, 3.0) * depth / view.height);
                splat.color = kCount;
                // What the plan says, in camera axes.
                const glm::dvec3 camera = glm::transpose(view.camera_to_world) *
                                          (glm::dvec3(splat.center) - (view.eye - origin));
                const Lens& lens = view.lens;
                const double z = -camera.z;
                const double focal_x = view.width / (lens.right - lens.left);
                const double focal_y = view.height / (lens.top - lens.bottom);
                const double middle_x = viewport.x + (camera.x / z - lens.left) * focal_x;
                const double middle_y = viewport.y + (camera.y / z - lens.bottom) * focal_y;
                const double half_x = 0.5 * double{splat.side} * focal_x / z;
                const double half_y = 0.5 * double{splat.side} * focal_y / z;
                const auto beside_centre = [](double edge) {
                    return std::abs(edge - 0.5 - std::round(edge - 0.5)) < 1e-6;
                };
                if (beside_centre(middle_x - half_x) || beside_centre(middle_x + half_x) ||
                    beside_centre(middle_y - half_y) || beside_centre(middle_y + half_y) ||
                    std::abs(z - 0.5) < 1e-5 || std::abs(z - 60.0) < 1e-3) {
                    continue; // rounding would decide
                }
                splats.push_back(splat);
                if (z < 0.5 || z > 60.0) {
                    continue;
                }
                for (int y = scissor.y; y < scissor.y + scissor.height; ++y) {
                    for (int x = scissor.x; x < scissor.x + scissor.width; ++x) {
                        const bool inside = std::abs(x + 0.5 - middle_x) < half_x &&
                                            std::abs(y + 0.5 - middle_y) < half_y;
                        expected[place_of(x, kHeight - 1 - y, kWidth)] += inside ? 1 : 0;
                    }
                }
            }
            add_splats(plan, splats);
            const Picture picture = draw(drawer->backend(), plan, kWidth, kHeight);
            int wrong = 0;
            int covered = 0;
            for (int y = 0; y < kHeight; ++y) {
                for (int x = 0; x < kWidth; ++x) {
                    const int there = expected[place_of(x, y, kWidth)];
                    wrong += color_at(picture, x, y)[0] == there ? 0 : 1;
                    covered += there;
                }
            }
            CHECK(wrong == 0);
            CHECK(covered > 200);
        }
    }
}

TEST_CASE("A splat is drawn while its centre is between near and far") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    // The eye is at z = 8, near is 0.5 and far 100: these are exact.
    const auto shown = [&](float z) {
        Splat splat = flat_splat(30.0F, 30.0F, 4.0F, kWhiteCell, z);
        splat.side = std::abs(splat.side); // behind the eye as well
        return count_colored(draw(drawer->backend(), splat_plan({splat}), kSize, kSize));
    };
    CHECK(shown(7.5F) == 16);
    CHECK(shown(7.5001F) == 0);
    CHECK(shown(8.5F) == 0);
    CHECK(shown(20.0F) == 0);
    CHECK(shown(-92.0F) == 16);
    CHECK(shown(-92.001F) == 0);
}

TEST_CASE("Splats are blended one over the other in the order of the plan") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    const Rgba half_red{128, 0, 0, 128};
    const Rgba half_blue{0, 0, 128, 128};
    const Splat red = flat_splat(20.0F, 20.0F, 8.0F, half_red, 1.0F);
    const Splat blue = flat_splat(20.0F, 20.0F, 8.0F, half_blue, -1.0F);
    const FrameClear green{.enabled = true, .color = kGreenPaint};
    const auto color_of = [&](const FramePlan& plan, int samples) {
        return color_at(draw(drawer->backend(), plan, kSize, kSize, samples, green), 24, 40);
    };
    // 127 / 255 of what was there shines through: of 255 are left 127, of these 63, and of 128 64.
    // Two roundings to 8 bits.
    const int most_samples = std::min(4, drawer->backend().limits().samples);
    for (const int samples : {1, most_samples}) {
        CHECK(distance(color_of(splat_plan({red}), samples), {128, 127, 0, 255}) <= 1);
        CHECK(distance(color_of(splat_plan({red, blue}), samples), {64, 63, 128, 255}) <= 1);
        CHECK(distance(color_of(splat_plan({blue, red}), samples), {128, 63, 64, 255}) <= 1);
        // In commands of their own, cubes between them.
        FramePlan plan = splat_plan({red});
        plan.cube_frames = {glm::mat3(1.0F)};
        ShownCube cube;
        cube.center = {-2.0F, -2.0F, 0.0F};
        cube.size = glm::vec3(1.0F);
        cube.faces.fill(kWhiteCell);
        add_cubes(plan, {cube});
        add_splats(plan, {blue});
        CHECK(distance(color_of(plan, samples), {127, 127, 255, 255}) <= 1);
    }
    // Opaque is the colour itself, without rounding, and nothing at all leaves what was there.
    const Splat opaque = flat_splat(20.0F, 20.0F, 8.0F, {201, 7, 33, 255});
    CHECK(color_of(splat_plan({red, opaque}), 1) == Color{201, 7, 33, 255});
}

TEST_CASE("Splats and cubes test depth and do not write it") {
    Scene scene = flat_scene();
    const ItemId wall = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 2.0); // 24 to 40 px
    const ItemId behind = add_quad(scene, kGreenPaint, {0.0, 0.0, -4.0}, 9.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const int most_samples = std::min(4, drawer->backend().limits().samples);
    for (const int samples : {1, most_samples}) {
        for (const bool cubes : {false, true}) {
            INFO(samples << " samples, cubes " << cubes);
            const auto plan_with = [&](const std::vector<ItemId>& items, float z) {
                FramePlan plan = flat_plan(items);
                if (cubes) {
                    plan.cube_frames = {glm::mat3(1.0F)};
                    ShownCube cube;
                    cube.size = glm::vec3(3.0F);
                    cube.center = {2.0F, 0.0F, z - 0.5F * cube.size.z};
                    cube.faces.fill(kBlueCell);
                    add_cubes(plan, {cube});
                } else {
                    add_splats(plan, {flat_splat(30.0F, 26.0F, 20.0F, kBlueCell, z)});
                }
                return plan;
            };
            const auto picture_of = [&](const FramePlan& plan) {
                return draw(drawer->backend(), plan, kSize, kSize, samples);
            };
            // The wall ends at column 39.
            Picture picture = picture_of(plan_with({wall}, -1.0F));
            CHECK(color_at(picture, 36, 31) == kRed);
            CHECK(color_at(picture, 42, 31) == kBlue);
            picture = picture_of(plan_with({wall}, 1.0F));
            CHECK(color_at(picture, 36, 31) == kBlue);
            CHECK(color_at(picture, 42, 31) == kBlue);
            // Geometry that comes later does not know of them.
            FramePlan later = plan_with({wall, behind}, 1.0F);
            later.commands[0].count = 1;
            later.commands.push_back(later.commands[0]);
            later.commands.back().first = 1;
            ++later.passes[0].command_count;
            picture = picture_of(later);
            CHECK(color_at(picture, 36, 31) == kBlue); // over the wall, which hides the other
            CHECK(color_at(picture, 42, 31) == kGreen);
            // A mask hides them.
            FramePlan masked = plan_with({wall}, -1.0F);
            masked.commands[0].kind = Command::Kind::mask;
            picture = picture_of(masked);
            CHECK(color_at(picture, 36, 31) == kBlack);
            CHECK(color_at(picture, 42, 31) == kBlue);
            // And so does one that comes after some of them.
            FramePlan twice = plan_with({wall}, -1.0F);
            twice.commands[0].kind = Command::Kind::mask;
            twice.commands = {twice.commands[1], twice.commands[0], twice.commands[1]};
            picture = picture_of(twice);
            CHECK(color_at(picture, 36, 31) == kBlue);
        }
    }
}

TEST_CASE("Cubes show the faces that the eye is in front of") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    const std::array<Color, 3> face_colors = {{kRed, kGreen, kBlue}};
    // The axis of the face that a ray meets first, none where it misses.
    const auto axis_met = [](const ShownCube& cube,
                             const glm::dmat3& frame,
                             const glm::dvec3& eye,
                             const glm::dvec3& direction) -> std::optional<int> {
        const glm::dvec3 from = glm::transpose(frame) * (eye - glm::dvec3(cube.center));
        const glm::dvec3 along = glm::transpose(frame) * direction;
        const glm::dvec3 half = 0.5 * glm::dvec3(cube.size);
        double enter = -std::numeric_limits<double>::infinity();
        double leave = std::numeric_limits<double>::infinity();
        int axis = 0;
        for (int a = 0; a < 3; ++a) {
            const double t0 = (-half[a] - from[a]) / along[a];
            const double t1 = (half[a] - from[a]) / along[a];
            if (std::min(t0, t1) > enter) {
                enter = std::min(t0, t1);
                axis = a;
            }
            leave = std::min(leave, std::max(t0, t1));
        }
        return enter < leave && enter > 0.0 ? std::optional(axis) : std::nullopt;
    };
    for (const glm::dvec3& origin : {glm::dvec3(0.0), glm::dvec3(1.0e7, -2.0e6, 4.0e6)}) {
        Random random(31);
        int seen_axes = 0;
        for (int round = 0; round < 60; ++round) {
            INFO("origin " << origin.x << ", round " << round);
            const View view = tilted_view(random, origin);
            FramePlan plan = flat_plan({}, view);
            plan.origin = origin;
            // Frames are floats: the reference takes them as they are.
            plan.cube_frames = {glm::mat3(1.0F), glm::mat3(random_rotation(random))};
            ShownCube cube;
            cube.frame = static_cast<std::uint32_t>(round % 2);
            const double depth = random.uniform(3.0, 20.0);
            cube.center = glm::vec3(
                point_at(view, random.uniform(10.0, 80.0), random.uniform(10.0, 45.0), depth) -
                origin
            );
            cube.size = glm::vec3(
                static_cast<float>(random.uniform(0.1, 0.7) * depth),
                static_cast<float>(random.uniform(0.1, 0.7) * depth),
                static_cast<float>(random.uniform(0.1, 0.7) * depth)
            );
            cube.faces = {kRedCell, kGreenCell, kBlueCell};
            add_cubes(plan, {cube});
            const Picture picture = draw(drawer->backend(), plan, view.width, view.height);
            const glm::dmat3 frame(plan.cube_frames[cube.frame]);
            const glm::dvec3 eye = view.eye - origin;
            int wrong = 0;
            std::array<bool, 3> axes{};
            for (int y = 0; y < view.height; ++y) {
                for (int x = 0; x < view.width; ++x) {
                    const auto met = [&](double dx, double dy) {
                        const glm::dvec3 point =
                            point_at(view, x + 0.5 + dx, view.height - y - 0.5 + dy, 1.0);
                        return axis_met(cube, frame, eye, point - view.eye);
                    };
                    // Devices snap vertices to 1/256 px: the sample may count as that far away.
                    constexpr double kSnap = 0.02;
                    const std::optional<int> axis = met(0.0, 0.0);
                    if (met(kSnap, kSnap) != axis || met(-kSnap, kSnap) != axis ||
                        met(kSnap, -kSnap) != axis || met(-kSnap, -kSnap) != axis) {
                        continue;
                    }
                    const Color expected =
                        axis ? face_colors[static_cast<std::size_t>(*axis)] : kBlack;
                    wrong += color_at(picture, x, y) == expected ? 0 : 1;
                    if (axis) {
                        axes[static_cast<std::size_t>(*axis)] = true;
                    }
                }
            }
            CHECK(wrong == 0);
            seen_axes += static_cast<int>(std::count(axes.begin(), axes.end(), true));
        }
        CHECK(seen_axes > 100); // of 60 cubes
    }
}

TEST_CASE("A cube shows no face of an axis between whose planes the eye is") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    const auto picture_of = [&](const glm::vec3& center, float edge) {
        ShownCube cube;
        cube.center = center;
        cube.size = glm::vec3(edge);
        cube.faces = {kRedCell, kGreenCell, kBlueCell};
        return draw(drawer->backend(), cube_plan({cube}), kSize, kSize);
    };
    const auto count_of = [&](const Picture& picture, const Color& color) {
        int count = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                count += color_at(picture, x, y) == color ? 1 : 0;
            }
        }
        return count;
    };
    // Straight ahead: 4 m at a distance of 8 m are 16 x 16 pixels, and nothing else.
    Picture picture = picture_of({0.0F, 0.0F, -2.0F}, 4.0F);
    CHECK(count_of(picture, kBlue) == 256);
    CHECK(count_colored(picture) == 256);
    // Right of the eye, on its level.
    picture = picture_of({5.0F, 0.0F, -2.0F}, 4.0F);
    CHECK(count_of(picture, kBlue) == 256);
    CHECK(count_of(picture, kRed) > 0);
    CHECK(count_of(picture, kGreen) == 0);
    // Around the eye, or without a size.
    CHECK(count_colored(picture_of({0.0F, 0.0F, 8.0F}, 4.0F)) == 0);
    CHECK(count_colored(picture_of({1.0F, 1.0F, 0.0F}, 0.0F)) == 0);
    // The eye in the plane of a face.
    picture = picture_of({2.0F, 0.0F, -2.0F}, 4.0F);
    CHECK(count_of(picture, kRed) == 0);
    CHECK(count_of(picture, kBlue) == 256);
}

TEST_CASE("A cube that reaches behind the near plane is cut by it") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    ShownCube cube;
    // From z = 4 to 12 and x = 2 to 10: the face at x = 2 passes beside the eye, and fills the
    // columns right of where it is seen at z = 4, half a metre a metre: pixel 48.
    cube.center = {6.0F, 0.0F, 8.0F};
    cube.size = glm::vec3(8.0F);
    cube.faces = {kRedCell, kGreenCell, kBlueCell};
    const Picture picture = draw(drawer->backend(), cube_plan({cube}), kSize, kSize);
    int wrong = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            // At column x the face is at the depth 64 / (x - 31.5) m; it is 4 m high either way.
            const double depth = 64.0 / (x - 31.5);
            const double half_height = 4.0 / depth * 32.0;
            if (x >= 48 && std::abs(std::abs(y - 31.5) - half_height) < 0.1) {
                continue;
            }
            const bool inside = x >= 48 && std::abs(y - 31.5) < half_height;
            wrong += color_at(picture, x, y) == (inside ? kRed : kBlack) ? 0 : 1;
        }
    }
    CHECK(wrong == 0);
}

TEST_CASE("Cubes have the silhouettes of boxes at several samples") {
    Scene scene = flat_scene();
    const MaterialId white = add_material(scene, {.base_color = glm::vec4(1.0F)});
    const MeshId box = add_mesh(scene, box_mesh(glm::vec3(-0.5F), glm::vec3(0.5F)), white);
    Random random(17);
    FramePlan plan = cube_plan({});
    plan.cube_frames.clear();
    std::vector<ShownCube> cubes;
    for (int i = 0; i < 12; ++i) {
        const double yaw = random.uniform(0.0, 3.0);
        const double edge = random.uniform(0.05, 2.0);
        const glm::dvec3 at(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), 0.0);
        add_instance(scene, box, at, yaw, edge);
        const glm::dmat4x3& world = scene.instances.back().object_to_world;
        ShownCube cube;
        cube.center = glm::vec3(at);
        cube.size = glm::vec3(static_cast<float>(edge));
        cube.frame = static_cast<std::uint32_t>(i);
        cube.faces.fill(kWhiteCell);
        cubes.push_back(cube);
        plan.cube_frames.emplace_back(
            glm::vec3(world[0] / edge), glm::vec3(world[1] / edge), glm::vec3(world[2] / edge)
        );
    }
    add_cubes(plan, cubes);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const int samples = std::min(4, drawer->backend().limits().samples);
    const Picture cells = draw(drawer->backend(), plan, kSize, kSize, samples);
    std::vector<ItemId> items;
    for (std::size_t i = 0; i < cubes.size(); ++i) {
        items.push_back(make_id<ItemId>(i));
    }
    const Picture geometry = draw(drawer->backend(), flat_plan(items), kSize, kSize, samples);
    CHECK(count_colored(cells) > 200);
    // Both are snapped to 1/256 px, from places that floats keep to a tenth of that. About 300 px
    // of silhouettes with 4 samples each would have 2.3 samples within a whole step of the other.
    CHECK(count_different(geometry, cells) <= 3);
}

TEST_CASE("Splats and cubes are drawn into images") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    Backend& backend = drawer->backend();
    for (const int samples : {1, std::min(4, backend.limits().samples)}) {
        INFO(samples << " samples");
        // The part [16, 48) of the view, made at an odd place of the scratch page.
        constexpr int kFirst = 16;
        constexpr int kTexels = 32;
        FramePlan plan = flat_plan({});
        plan.pages = {
            {.page = PageId{0}, .size = 64, .scratch = true, .samples = samples},
            {.page = PageId{1}, .size = 64}};
        Pass image = plan.passes[0];
        image.page = PageId{0};
        image.view.lens = sub_lens(image.view, kFirst, kFirst, kFirst + kTexels, kFirst + kTexels);
        image.view.width = kTexels;
        image.view.height = kTexels;
        image.viewport = {11, 3, kTexels, kTexels};
        image.scissor = image.viewport;
        image.first_command = 1;
        image.command_count = 0;
        image.copy_page = PageId{1};
        image.copy = {5, 9, kTexels, kTexels};
        plan.passes.push_back(image);
        plan.cube_frames = {glm::mat3(1.0F)};
        ShownCube cube;
        cube.center = {1.0F, 2.0F, -1.0F};
        cube.size = glm::vec3(2.0F);
        cube.faces = {kRedCell, kGreenCell, kBlueCell};
        const std::vector<Splat> splats = {
            flat_splat(20.25F, 20.125F, 4.5F, kRedCell),
            flat_splat(26.0F, 21.0F, 7.0F, {0, 100, 0, 200}),
            flat_splat(10.0F, 30.0F, 10.0F, kBlueCell)}; // cut by the image
        add_splats(plan, splats);
        add_cubes(plan, {cube});
        std::swap(plan.passes[0], plan.passes[1]);
        plan.passes[1].batch = 1;
        plan.passes[1].first_command = static_cast<std::uint32_t>(plan.commands.size());
        Command show;
        show.kind = Command::Kind::images;
        show.count = 1;
        plan.commands.push_back(show);
        ImageQuad quad;
        quad.page = PageId{1};
        quad.source = plan.passes[0].copy;
        quad.origin = {-4.0F, -4.0F, 0.0F};
        quad.edge_u = {8.0F, 0.0F, 0.0F};
        quad.edge_v = {0.0F, 8.0F, 0.0F};
        quad.depth = 4.0F;
        plan.quads = {quad};
        const Picture shown = draw(backend, plan, kSize, kSize);

        FramePlan direct = splat_plan(splats);
        direct.cube_frames = plan.cube_frames;
        add_cubes(direct, {cube});
        const Picture plain = draw(backend, direct, kSize, kSize, samples);
        int wrong = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const bool inside =
                    x >= kFirst && x < kFirst + kTexels && y >= kFirst && y < kFirst + kTexels;
                const Color expected = inside ? color_at(plain, x, y) : kBlack;
                // An image is rounded to 8 bits once more.
                wrong += distance(color_at(shown, x, y), expected) <= 1 ? 0 : 1;
            }
        }
        CHECK(wrong == 0);
        CHECK(count_colored(shown) > 100);
    }
}

TEST_CASE("A cleared frame that cells are drawn over keeps the rest") {
    Scene scene = flat_scene();
    const ItemId wall = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 2.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    Backend& backend = drawer->backend();
    const int samples = std::min(4, backend.limits().samples);
    const auto target = backend.create_target(kSize, kSize, samples);
    REQUIRE(target.has_value());
    REQUIRE(backend.execute(flat_plan({wall}), *target, {}).has_value());
    const FramePlan plan = splat_plan({flat_splat(30.5F, 30.5F, 20.0F, kBlueCell, -1.0F)});
    REQUIRE(backend.execute(plan, *target, {.enabled = false, .color = {}}).has_value());
    const auto picture = backend.read_target(*target);
    REQUIRE(picture.has_value());
    CHECK(color_at(*picture, 36, 31) == kRed); // its depth is still there
    CHECK(color_at(*picture, 45, 31) == kBlue);
    CHECK(color_at(*picture, 60, 31) == kBlack);
}
