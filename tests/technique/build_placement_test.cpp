#include "support/random.hpp"
#include "support/thread_executor.hpp"
#include "technique/placement_world.hpp"
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/technique/build_placement.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using farfield::support::PlacementWorld;
using farfield::support::Random;
using farfield::support::TreeKind;

constexpr double kPi = std::numbers::pi;

PlacementMap placed(const Hierarchy& hierarchy, const PlacementOptions& options) {
    SerialExecutor executor;
    auto map = build_placement(hierarchy, options, executor);
    if (!map) {
        FAIL(map.error().message);
    }
    const Result<void> valid = validate(*map, hierarchy);
    if (!valid) {
        FAIL(valid.error().message);
    }
    return std::move(*map);
}

Error refused(const Hierarchy& hierarchy, const PlacementOptions& options) {
    SerialExecutor executor;
    const auto map = build_placement(hierarchy, options, executor);
    REQUIRE_FALSE(map.has_value());
    return map.error();
}

bool says(const std::string& message, const std::string& what) {
    return message.find(what) != std::string::npos;
}

bool same(const PlacementMap& a, const PlacementMap& b) {
    const auto equal = [](const auto& x, const auto& y, const auto& is_same) {
        return std::equal(x.begin(), x.end(), y.begin(), y.end(), is_same);
    };
    return a.origin == b.origin && a.model_digest == b.model_digest && a.grid == b.grid &&
           a.spacing == b.spacing && a.replaced == b.replaced &&
           a.quality.views == b.quality.views && a.quality.worst == b.quality.worst &&
           a.quality.worst_before == b.quality.worst_before && a.quality.miss == b.quality.miss &&
           equal(
               a.nodes,
               b.nodes,
               [](const PlacementNode& x, const PlacementNode& y) {
                   return x.first_child == y.first_child && x.axes == y.axes && x.site == y.site;
               }
           ) &&
           equal(
               a.sites,
               b.sites,
               [](const PlacementSite& x, const PlacementSite& y) {
                   return x.eyes == y.eyes && x.level == y.level &&
                          x.first_range == y.first_range && x.range_count == y.range_count;
               }
           ) &&
           equal(
               a.ranges,
               b.ranges,
               [](const PlacementRange& x, const PlacementRange& y) {
                   return x.yaw == y.yaw && x.image == y.image && x.primitives == y.primitives;
               }
           ) &&
           equal(a.images, b.images, [](const PlacedImage& x, const PlacedImage& y) {
               return x.site == y.site && x.view == y.view && x.near_depth == y.near_depth &&
                      x.far_depth == y.far_depth && x.primitives == y.primitives &&
                      x.first_cell == y.first_cell && x.cell_count == y.cell_count;
           });
}

/// A place in a box; every other one on its sides, edges and corners.
glm::dvec3 place_in(Random& random, const Box3d& box) {
    const bool on_rim = random.below(2) == 0;
    glm::dvec3 place(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        double share = random.uniform(0.0, 1.0);
        if (on_rim) {
            share = static_cast<double>(random.below(2));
        }
        place[axis] = box.lo[axis] + share * (box.hi[axis] - box.lo[axis]);
    }
    return glm::min(glm::max(place, box.lo), box.hi);
}

/// The view of the map's lens from a place of a site, at a yaw and pitch.
View view_of(const PlacementMap& map, const glm::dvec3& eye, double yaw, double pitch) {
    const PlacementOptions& options = map.options;
    return level_view(
        yaw_frame(options.up),
        eye,
        yaw,
        pitch,
        {.lens = options.lens, .width = options.width, .height = options.height}
    );
}

/// Views from all sites, half of them at the ends of ranges: what they let through, but what the
/// image of their range replaces, is no more than the range says.
void check_ranges(const PlacementMap& map, std::size_t views, std::uint64_t seed) {
    Random random(seed);
    // Of a view at an end: less than what cells are grown by, more than what counting rounds.
    const double size = glm::length(extent(map.options.eyes)) + 1.0;
    const double rounding = 1e-9 * size;
    for (std::size_t i = 0; i < views; ++i) {
        const std::size_t index = i % map.sites.size();
        const PlacementSite& site = map.sites[index];
        const glm::dvec3 eye = place_in(random, site.eyes);
        double yaw = random.uniform(-kPi, kPi);
        if (random.below(2) == 0) {
            const auto range = site.first_range + random.below(site.range_count);
            const double off = std::pow(10.0, random.uniform(-12.0, -6.0));
            yaw = map.ranges[range].yaw + (random.below(2) == 0 ? off : -off);
        }
        yaw = std::remainder(yaw, 2.0 * kPi);
        const double pitch = map.options.max_pitch * random.uniform(-1.0, 1.0);
        const View view = view_of(map, eye, yaw, pitch);
        const PlacedView found = find(map, view);
        CAPTURE(i, index, yaw, pitch);
        REQUIRE(found.refusal == PlacementRefusal::none);
        REQUIRE(found.range >= map.sites[found.site].first_range);
        REQUIRE(
            found.range < map.sites[found.site].first_range + map.sites[found.site].range_count
        );
        // An eye on the side between two sites is of one of them.
        REQUIRE(distance(map.sites[found.site].eyes, eye) <= rounding);
        const PlacementRange& range = map.ranges[found.range];
        REQUIRE(support::count_in_view(map, view, range.image, rounding) <= range.primitives);
        REQUIRE(range.primitives <= map.options.max_primitives);
    }
}

/// Images stand off their site's eyes, and hold all that they replace.
void check_images(const PlacementMap& map) {
    for (std::size_t i = 0; i < map.images.size(); ++i) {
        const PlacedImage& image = map.images[i];
        const Box3d& eyes = map.sites[image.site].eyes;
        const double half_diagonal = 0.5 * glm::length(extent(eyes));
        const glm::dmat3& axes = image.view.camera_to_world;
        const Lens& lens = image.view.lens;
        CAPTURE(i);
        REQUIRE(glm::distance(image.view.eye, center(eyes)) <= 1e-9 * half_diagonal);
        std::uint64_t primitives = 0;
        double nearest = std::numeric_limits<double>::infinity();
        double farthest = 0.0;
        for (std::uint32_t k = 0; k < image.cell_count; ++k) {
            const PlacementCell& cell = map.cells.at(map.replaced.at(image.first_cell + k));
            primitives += cell.primitives;
            for (unsigned c = 0; c < 8; ++c) {
                const glm::dvec3 at = glm::dvec3(corner(cell.box, c)) + map.origin;
                for (unsigned e = 0; e < 8; ++e) {
                    const double depth = -glm::dot(at - corner(eyes, e), axes[2]);
                    REQUIRE(depth >= map.options.clearance * half_diagonal * (1.0 - 1e-9));
                }
                const glm::dvec3 from = at - image.view.eye;
                const double depth = -glm::dot(from, axes[2]);
                nearest = std::min(nearest, depth);
                farthest = std::max(farthest, depth);
                const double x = glm::dot(from, axes[0]) / depth;
                const double y = glm::dot(from, axes[1]) / depth;
                REQUIRE(x >= lens.left - 1e-9);
                REQUIRE(x <= lens.right + 1e-9);
                REQUIRE(y >= lens.bottom - 1e-9);
                REQUIRE(y <= lens.top + 1e-9);
            }
        }
        REQUIRE(primitives == image.primitives);
        REQUIRE(image.near_depth <= nearest);
        REQUIRE(image.near_depth >= nearest * (1.0 - 1e-5));
        REQUIRE(image.far_depth >= farthest);
        REQUIRE(image.far_depth <= farthest * (1.0 + 1e-5));
        // Texels as fine as the frame's pixels.
        const PlacementOptions& options = map.options;
        const double frame_x = options.width / (options.lens.right - options.lens.left);
        const double frame_y = options.height / (options.lens.top - options.lens.bottom);
        const double texels_x = image.view.width / (lens.right - lens.left);
        const double texels_y = image.view.height / (lens.top - lens.bottom);
        REQUIRE(image.view.width <= kMostLayeredTexels);
        REQUIRE(image.view.height <= kMostLayeredTexels);
        REQUIRE(texels_x / frame_x == Approx(texels_y / frame_y));
        // Only those that would have too many have larger ones.
        REQUIRE(texels_x <= frame_x * options.texels_per_pixel * (1.0 + 1e-9));
        if (std::max(image.view.width, image.view.height) < kMostLayeredTexels) {
            REQUIRE(texels_x == Approx(frame_x * options.texels_per_pixel));
        }
    }
}

void check_quality(const PlacementMap& map) {
    std::uint64_t worst = 0;
    for (const PlacementRange& range : map.ranges) {
        worst = std::max(worst, range.primitives);
    }
    std::uint32_t level = 0;
    for (const PlacementSite& site : map.sites) {
        level = std::max(level, site.level);
    }
    CHECK(map.quality.worst == worst);
    CHECK(map.quality.worst <= map.options.max_primitives);
    CHECK(map.quality.worst <= map.quality.worst_before);
    CHECK(map.quality.worst_before <= map.primitives);
    CHECK(map.quality.level == level);
    CHECK(map.quality.views >= map.ranges.size());
    CHECK(map.quality.miss >= 0.0);
}

void check_map(const PlacementMap& map, std::size_t views, std::uint64_t seed) {
    check_quality(map);
    check_images(map);
    check_ranges(map, views, seed);
}

PlacementOptions forest_options() {
    PlacementOptions options;
    options.max_primitives = 900'000;
    options.first_grid = 4;
    options.max_level = 4;
    return options;
}

PlacementWorld small_forest(TreeKind kind = TreeKind::bsp) {
    return support::make_world({.trees = 120, .ground_cells = 12, .seed = 3}, kind);
}

} // namespace

TEST_CASE("options are refused by name and value") {
    const PlacementWorld world = support::make_cubes({{glm::dvec3(-1.0), glm::dvec3(1.0)}}, 12);
    const Hierarchy& tree = world.forest.hierarchy;
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    struct Bad {
        const char* name = "";
        const char* value = "";
        std::function<void(PlacementOptions&)> spoil;
    };
    const std::vector<Bad> all = {
        {"max_primitives", "0", [](auto& o) { o.max_primitives = 0; }},
        {"max_primitives", "18014398509481984", [](auto& o) { o.max_primitives = 1ULL << 54U; }},
        {"target_primitives", "0", [](auto& o) { o.target_primitives = 0; }},
        {"target_primitives", "250001", [](auto& o) { o.target_primitives = 250'001; }},
        {"lens", "17", [](auto& o) { o.lens.right = 17.0; }},
        {"lens", "-16.5", [](auto& o) { o.lens.bottom = -16.5; }},
        {"field of view", "nan", [&](auto& o) { o.lens.top = kNan; }},
        {"field of view", "0.577", [](auto& o) { o.lens.left = o.lens.right; }},
        {"width", "0", [](auto& o) { o.width = 0; }},
        {"height", "-5", [](auto& o) { o.height = -5; }},
        {"texels_per_pixel", "0.05", [](auto& o) { o.texels_per_pixel = 0.05; }},
        {"texels_per_pixel", "4.5", [](auto& o) { o.texels_per_pixel = 4.5; }},
        {"texels_per_pixel", "nan", [&](auto& o) { o.texels_per_pixel = kNan; }},
        {"max_pitch", "-0.1", [](auto& o) { o.max_pitch = -0.1; }},
        {"max_pitch", "1.3", [](auto& o) { o.max_pitch = 1.3; }},
        {"max_pitch", "nan", [&](auto& o) { o.max_pitch = kNan; }},
        {"up", "0", [](auto& o) { o.up = glm::dvec3(0.0); }},
        {"up", "nan", [&](auto& o) { o.up.x = kNan; }},
        {"up", "inf", [&](auto& o) { o.up.x = kInfinity; }},
        {"eyes",
         "",
         [&](auto& o) {
             o.eyes = {glm::dvec3(0.0), glm::dvec3(1.0, 1.0, kInfinity)};
         }},
        {"first_grid", "0", [](auto& o) { o.first_grid = 0; }},
        {"first_grid", "65", [](auto& o) { o.first_grid = 65; }},
        {"max_level", "13", [](auto& o) { o.max_level = 13; }},
        {"cell_depth", "25", [](auto& o) { o.cell_depth = 25; }},
        {"clearance", "0", [](auto& o) { o.clearance = 0.0; }},
        {"clearance", "17", [](auto& o) { o.clearance = 17.0; }},
        {"clearance", "nan", [&](auto& o) { o.clearance = kNan; }},
        {"lookahead", "0", [](auto& o) { o.lookahead = 0; }},
        {"lookahead", "5", [](auto& o) { o.lookahead = 5; }},
        {"weight", "-0.5", [](auto& o) { o.weights.cost = -0.5; }},
        {"weight", "nan", [&](auto& o) { o.weights.benefit = kNan; }},
        {"weight", "inf", [&](auto& o) { o.weights.size = kInfinity; }},
        {"weight", "-1", [](auto& o) { o.weights.depth = -1.0; }}};
    for (const Bad& bad : all) {
        PlacementOptions options;
        bad.spoil(options);
        const Error error = refused(tree, options);
        CAPTURE(bad.name, bad.value, error.message);
        CHECK(error.code == ErrorCode::invalid_argument);
        CHECK(says(error.message, "placement"));
        CHECK(says(error.message, bad.name));
        CHECK(says(error.message, bad.value));
    }
    // The ends of ranges are not refused.
    PlacementOptions options;
    options.max_primitives = 1ULL << 53U;
    options.target_primitives = 1;
    options.texels_per_pixel = 4.0;
    options.max_pitch = 1.2;
    options.first_grid = 1;
    options.max_level = 0;
    options.cell_depth = 0;
    options.clearance = 0.01;
    options.lookahead = 4;
    CHECK(placed(tree, options).sites.size() == 1);
}

TEST_CASE("a hierarchy without primitives cannot be placed") {
    const auto empty = partition::build_bsp({});
    REQUIRE(empty.has_value());
    const Error error = refused(*empty, {});
    CHECK(error.code == ErrorCode::invalid_argument);
    CHECK(says(error.message, "0 cells"));
}

TEST_CASE("a model within the budget needs no image") {
    const PlacementWorld world = small_forest();
    PlacementOptions options = forest_options();
    options.max_primitives = 10'000'000;
    const PlacementMap map = placed(world.forest.hierarchy, options);
    CHECK(map.images.empty());
    CHECK(map.ranges.size() == map.sites.size());
    CHECK(map.sites.size() == std::size_t{map.grid[0]} * map.grid[1] * map.grid[2]);
    CHECK(map.quality.worst == map.quality.worst_before);
    CHECK(map.quality.miss == 0.0);
    check_map(map, 500, 1);
}

TEST_CASE("what is left of the default target and eyes is filled in") {
    const PlacementWorld world = small_forest();
    const Hierarchy& tree = world.forest.hierarchy;
    PlacementOptions options = forest_options();
    const PlacementMap map = placed(tree, options);
    const Box3f model = bounds(tree.nodes[0]);
    CHECK(map.options.eyes.lo == glm::dvec3(model.lo) + tree.origin);
    CHECK(map.options.eyes.hi == glm::dvec3(model.hi) + tree.origin);
    CHECK(map.primitives == primitive_count(tree.nodes[0]));
    CHECK(map.options.target_primitives == 900'000 - map.primitives / 20);
    options.max_primitives = 1'000'000'000;
    CHECK(placed(tree, options).options.target_primitives == 1'000'000'000 - map.primitives / 20);
    // Never less than half of the budget.
    const PlacementWorld one = support::make_cubes({{glm::dvec3(-1.0), glm::dvec3(1.0)}}, 100);
    options = {};
    options.max_primitives = 4;
    options.eyes = {glm::dvec3(50.0), glm::dvec3(60.0)};
    CHECK(placed(one.forest.hierarchy, options).options.target_primitives == 2);
}

TEST_CASE("one object gets an image where it is in view") {
    const PlacementWorld world =
        support::make_cubes({{{-1.0, -1.0, -101.0}, {1.0, 1.0, -99.0}}}, 1000);
    PlacementOptions options;
    options.max_primitives = 999;
    options.eyes = {glm::dvec3(-2.0), glm::dvec3(2.0)};
    options.first_grid = 1;
    const PlacementMap map = placed(world.forest.hierarchy, options);
    REQUIRE(map.sites.size() == 1);
    REQUIRE(map.images.size() == 1);
    CHECK(map.images[0].cell_count == 1);
    CHECK(map.images[0].primitives == 1000);
    CHECK(map.quality.worst_before == 1000);
    CHECK(map.quality.worst == 0);
    check_map(map, 2000, 2);
    // Ahead it is shown, behind nothing is; where it is in view depends on lens and distance: half
    // of 4:3 at 60 degrees is a tangent of 0.77, and the grown cube is 6 m wide, 97 m away.
    const auto image_at = [&](double yaw) {
        return map.ranges[find(map, view_of(map, glm::dvec3(0.0), yaw, 0.0)).range].image;
    };
    const double reach = std::atan(options.lens.right) + std::atan(3.0 / 97.0);
    CHECK(image_at(0.0) == 0);
    CHECK(image_at(reach - 1e-3) == 0);
    CHECK(image_at(-reach + 1e-3) == 0);
    CHECK(image_at(reach + 1e-3) == UINT32_MAX);
    CHECK(image_at(-reach - 1e-3) == UINT32_MAX);
    CHECK(image_at(kPi) == UINT32_MAX);
}

TEST_CASE("too small a budget is an error that names place, direction and count") {
    // The eyes are in the middle of the object: no image can stand off it.
    const PlacementWorld world = support::make_cubes({{glm::dvec3(-9.0), glm::dvec3(9.0)}}, 1234);
    PlacementOptions options;
    options.max_primitives = 1233;
    options.eyes = {{1.0, 2.0, 3.0}, {3.0, 4.0, 5.0}};
    options.first_grid = 1;
    options.max_level = 1;
    const Error error = refused(world.forest.hierarchy, options);
    CHECK(error.code == ErrorCode::unsupported);
    CAPTURE(error.message);
    CHECK(says(error.message, "(2.5"));
    CHECK(says(error.message, "yaw"));
    CHECK(says(error.message, "1234 primitives"));
    CHECK(says(error.message, "max_primitives of 1233"));
    CHECK(says(error.message, "max_level 1"));
    CHECK(says(error.message, "1.000000 m"));
}

TEST_CASE("eyes in one point are not halved") {
    const PlacementWorld world = support::make_cubes({{glm::dvec3(-9.0), glm::dvec3(9.0)}}, 1234);
    PlacementOptions options;
    options.max_primitives = 1233;
    options.eyes = {glm::dvec3(1.0), glm::dvec3(1.0)};
    options.max_level = 12;
    std::size_t most = 0;
    SerialExecutor executor;
    const auto map = build_placement(
        world.forest.hierarchy,
        options,
        executor,
        [&](std::size_t, std::size_t known) { most = std::max(most, known); }
    );
    REQUIRE_FALSE(map.has_value());
    CHECK(map.error().code == ErrorCode::unsupported);
    CHECK(says(map.error().message, "1234 primitives"));
    CHECK(most == 1);
}

TEST_CASE("every range holds for all eyes, yaws and pitches of its site") {
    for (const TreeKind kind : {TreeKind::bsp, TreeKind::kdtree, TreeKind::octree}) {
        const PlacementWorld world = small_forest(kind);
        PlacementOptions options = forest_options();
        CAPTURE(static_cast<int>(kind));
        const PlacementMap level = placed(world.forest.hierarchy, options);
        CHECK(level.images.size() > 20);
        CHECK(level.quality.level > 0);
        check_map(level, 4000, 4);
        options.max_pitch = 0.5;
        options.max_primitives = 1'200'000;
        const PlacementMap pitched = placed(world.forest.hierarchy, options);
        CHECK_FALSE(pitched.images.empty());
        check_map(pitched, 4000, 5);
    }
}

TEST_CASE("lenses may be off their axis and frames of any shape") {
    const PlacementWorld world = small_forest();
    PlacementOptions options = forest_options();
    options.lens = {-0.2, 1.1, -0.9, 0.1, 0.5, 1000.0};
    options.width = 300;
    options.height = 900;
    options.texels_per_pixel = 0.5;
    const PlacementMap map = placed(world.forest.hierarchy, options);
    CHECK_FALSE(map.images.empty());
    check_map(map, 4000, 6);
}

TEST_CASE("images that would have too many texels have larger ones") {
    const PlacementWorld world = small_forest();
    PlacementOptions options = forest_options();
    options.width = 12'000;
    options.height = 9'000;
    const PlacementMap map = placed(world.forest.hierarchy, options);
    check_map(map, 100, 17);
    const auto is_limited = [](const PlacedImage& image) {
        return std::max(image.view.width, image.view.height) == kMostLayeredTexels;
    };
    CHECK(std::any_of(map.images.begin(), map.images.end(), is_limited));
}

TEST_CASE("views turn about any axis") {
    const PlacementWorld world = small_forest();
    PlacementOptions options = forest_options();
    options.up = {0.3, 2.0, -0.4};
    check_map(placed(world.forest.hierarchy, options), 3000, 7);
    options.up = {0.0, 0.0, 0.1};
    options.max_primitives = 2'000'000;
    check_map(placed(world.forest.hierarchy, options), 3000, 8);
}

TEST_CASE("eyes may be on a plane or a line") {
    const PlacementWorld world = small_forest();
    PlacementOptions options = forest_options();
    options.eyes = {{-150.0, 2.0, -150.0}, {150.0, 2.0, 100.0}};
    const PlacementMap plane = placed(world.forest.hierarchy, options);
    CHECK(plane.grid == std::array<std::uint32_t, 3>{4, 1, 3});
    CHECK(plane.spacing.y == 0.0);
    check_map(plane, 3000, 9);
    options.eyes = {{-150.0, 2.0, 7.0}, {150.0, 2.0, 7.0}};
    const PlacementMap line = placed(world.forest.hierarchy, options);
    CHECK(line.grid == std::array<std::uint32_t, 3>{4, 1, 1});
    check_map(line, 3000, 10);
}

TEST_CASE("a flat world is placed") {
    const PlacementWorld world = support::make_world(
        {.trees = 0, .radius = 256.0, .ground_cells = 64, .seed = 1}, TreeKind::bsp
    );
    PlacementOptions options;
    options.max_primitives = 3000;
    options.eyes = {{-64.0, 0.0, -64.0}, {64.0, 0.0, 64.0}};
    const PlacementMap map = placed(world.forest.hierarchy, options);
    CHECK_FALSE(map.images.empty());
    check_map(map, 3000, 11);
}

TEST_CASE("a world far away is placed as one at the origin") {
    const glm::dvec3 offset(1e7, -2e6, 1e7);
    const PlacementWorld near_one = small_forest();
    const PlacementWorld far_one = support::make_world(
        {.trees = 120, .ground_cells = 12, .seed = 3, .offset = offset}, TreeKind::bsp
    );
    PlacementOptions options = forest_options();
    // Multiples of 1/16 m that stay such when halved four times.
    options.eyes = {{-128.0, 0.0, -128.0}, {128.0, 16.0, 128.0}};
    const PlacementMap here = placed(near_one.forest.hierarchy, options);
    options.eyes = {options.eyes.lo + offset, options.eyes.hi + offset};
    PlacementMap there = placed(far_one.forest.hierarchy, options);
    check_map(there, 2000, 12);
    there.origin -= offset;
    for (PlacementSite& site : there.sites) {
        site.eyes = {site.eyes.lo - offset, site.eyes.hi - offset};
    }
    for (PlacedImage& image : there.images) {
        image.view.eye -= offset;
    }
    CHECK_FALSE(here.images.empty());
    CHECK(same(here, there));
}

TEST_CASE("a map does not depend on threads or runs, and tells how far it is") {
    const PlacementWorld world = small_forest(TreeKind::octree);
    const PlacementOptions options = forest_options();
    const PlacementMap serial = placed(world.forest.hierarchy, options);
    support::ThreadExecutor threads(4);
    std::size_t last_placed = 0;
    std::size_t last_known = 0;
    bool ascending = true;
    const auto parallel = build_placement(
        world.forest.hierarchy,
        options,
        threads,
        [&](std::size_t now_placed, std::size_t known) {
            ascending =
                ascending && now_placed > last_placed && known >= last_known && now_placed <= known;
            last_placed = now_placed;
            last_known = known;
        }
    );
    REQUIRE(parallel.has_value());
    CHECK(same(serial, *parallel));
    CHECK(ascending);
    CHECK(last_placed == last_known);
    // Inner nodes count too: they were tried.
    CHECK(last_known == serial.nodes.size());
}

TEST_CASE("sites tile the eyes' box, and are found from within") {
    const PlacementWorld world = small_forest();
    const PlacementMap map = placed(world.forest.hierarchy, forest_options());
    double volume = 0.0;
    for (const PlacementSite& site : map.sites) {
        const glm::dvec3 size = extent(site.eyes);
        volume += size.x * size.y * size.z;
    }
    const glm::dvec3 all = extent(map.options.eyes);
    CHECK(volume == Approx(all.x * all.y * all.z).epsilon(1e-9));
    Random random(13);
    for (std::size_t i = 0; i < map.sites.size(); ++i) {
        const Box3d& eyes = map.sites[i].eyes;
        const glm::dvec3 inner = center(eyes) + extent(eyes) * random.vector(-0.49, 0.49);
        REQUIRE(find(map, view_of(map, inner, random.uniform(-kPi, kPi), 0.0)).site == i);
    }
}

TEST_CASE("a wide site's images stand farther off with more clearance") {
    const PlacementWorld world = small_forest();
    PlacementOptions options = forest_options();
    options.clearance = 3.0;
    const PlacementMap far_off = placed(world.forest.hierarchy, options);
    check_map(far_off, 1000, 14);
    options.clearance = 0.1;
    const PlacementMap near_by = placed(world.forest.hierarchy, options);
    check_map(near_by, 1000, 15);
    CHECK(near_by.sites.size() < far_off.sites.size());
}

TEST_CASE("cells that are seen at equal angles are counted as one view") {
    // A grid that is symmetric about the site: ends of arcs coincide but for the last digits.
    std::vector<Box3d> boxes;
    for (int z = -8; z <= 8; ++z) {
        for (int x = -8; x <= 8; ++x) {
            const glm::dvec3 middle(8.0 * x, 0.0, 8.0 * z);
            boxes.push_back({middle - 3.0, middle + 3.0});
        }
    }
    const PlacementWorld world = support::make_cubes(boxes, 100);
    for (const double half : {0.0, 0.5, 2.0}) {
        for (const double tangent : {0.5, 1.0, 2.0}) {
            for (const std::uint64_t budget : {1500U, 2500U, 4000U, 6000U, 9000U}) {
                PlacementOptions options;
                options.lens = {-tangent, tangent, -1.0, 1.0, 0.1, 1000.0};
                options.max_primitives = budget;
                options.eyes = {glm::dvec3(-half), glm::dvec3(half)};
                options.first_grid = 1;
                options.max_level = 3;
                options.cell_depth = 24;
                CAPTURE(half, tangent, budget);
                check_map(placed(world.forest.hierarchy, options), 200, 16);
            }
        }
    }
}

TEST_CASE("a map that is damaged, or of another model, is refused") {
    const PlacementWorld world = small_forest();
    const Hierarchy& tree = world.forest.hierarchy;
    const PlacementMap whole = placed(tree, forest_options());
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    REQUIRE(whole.images.size() > 1);
    REQUIRE(whole.images[0].cell_count > 1);
    struct Damage {
        const char* says = "";
        std::function<void(PlacementMap&)> make;
    };
    const std::vector<Damage> all = {
        {"cells", [](auto& m) { m.cells.clear(); }},
        {"sites", [](auto& m) { m.sites.clear(); }},
        {"ranges", [](auto& m) { m.ranges.clear(); }},
        {"cells are not", [](auto& m) { ++m.model_digest; }},
        {"cells are not", [](auto& m) { m.origin.x += 1.0; }},
        {"cells are not", [](auto& m) { m.cells[3].box.hi.y += 1.0F; }},
        {"cell 3",
         [](auto& m) {
             ++m.cells[3].primitives;
             m.model_digest = model_digest(m.cells);
         }},
        {"cell 3",
         [](auto& m) {
             m.cells[3].node = 1'000'000;
             m.model_digest = model_digest(m.cells);
         }},
        {"cell 3",
         [](auto& m) {
             m.cells[3].box.hi.y += 1.0F;
             m.model_digest = model_digest(m.cells);
         }},
        {"cell",
         [](auto& m) {
             m.cells[3] = m.cells[2];
             m.model_digest = model_digest(m.cells);
         }},
        {"no cell has node",
         [](auto& m) {
             m.cells.pop_back();
             m.model_digest = model_digest(m.cells);
         }},
        {"roots", [](auto& m) { m.grid[0] = 0; }},
        {"roots", [](auto& m) { m.grid[2] = 4'000'000'000; }},
        {"spacing", [](auto& m) { m.spacing.z = -1.0; }},
        {"spacing", [&](auto& m) { m.spacing.x = kNan; }},
        {"node 0",
         [](auto& m) {
             m.nodes[0] = {0, 0, UINT32_MAX};
         }},
        {"node 1",
         [](auto& m) {
             m.nodes[1] = {1, 7, 0};
         }},
        {"node 1",
         [](auto& m) {
             m.nodes[1] = {static_cast<std::uint32_t>(m.nodes.size()) - 1, 7, 0};
         }},
        {"node 1",
         [](auto& m) {
             m.nodes[1] = {static_cast<std::uint32_t>(m.nodes.size()) - 1, 0, 0};
         }},
        {"site 2", [&](auto& m) { m.sites[2].eyes.lo.x = kNan; }},
        {"site 2", [](auto& m) { m.sites[2].range_count = 0; }},
        {"site 2", [](auto& m) { m.sites[2].first_range = UINT32_MAX; }},
        {"site 1", [](auto& m) { m.ranges[m.sites[1].first_range].yaw += 1e-9; }},
        {"site 0", [&](auto& m) { m.ranges[1].yaw = kNan; }},
        {"range 0", [&](auto& m) { m.ranges[0].image = 1'000'000; }},
        {"range 0",
         [](auto& m) {
             const auto other =
                 std::find_if(m.images.begin(), m.images.end(), [](const PlacedImage& i) {
                     return i.site != 0;
                 });
             m.ranges[0].image = static_cast<std::uint32_t>(other - m.images.begin());
         }},
        {"range 0", [](auto& m) { m.ranges[0].primitives = m.options.max_primitives + 1; }},
        {"image", [](auto& m) { m.images[1].site = UINT32_MAX; }},
        {"image 1", [](auto& m) { m.images[1].view.width = 0; }},
        {"image 1", [&](auto& m) { m.images[1].view.eye.x = kNan; }},
        {"image 1", [](auto& m) { m.images[1].near_depth = 0.0; }},
        {"image 1", [](auto& m) { m.images[1].far_depth = m.images[1].near_depth; }},
        {"image 1",
         [](auto& m) { m.images[1].far_depth = std::numeric_limits<double>::infinity(); }},
        {"image 1", [](auto& m) { m.images[1].cell_count = 0; }},
        {"image 1", [](auto& m) { m.images[1].first_cell = UINT32_MAX; }},
        {"image 0", [](auto& m) { m.replaced[1] = m.replaced[0]; }},
        {"image 0", [](auto& m) { m.replaced[0] = UINT32_MAX; }}};
    for (std::size_t i = 0; i < all.size(); ++i) {
        PlacementMap map = whole;
        all[i].make(map);
        const Result<void> valid = validate(map, tree);
        CAPTURE(i, all[i].says);
        CHECK_FALSE(valid.has_value());
        if (!valid) {
            CAPTURE(valid.error().message);
            CHECK(valid.error().code == ErrorCode::bad_data);
            CHECK(says(valid.error().message, all[i].says));
        }
    }
    const PlacementWorld other =
        support::make_world({.trees = 120, .ground_cells = 12, .seed = 4}, TreeKind::bsp);
    CHECK_FALSE(validate(whole, other.forest.hierarchy).has_value());
    CHECK_FALSE(validate(whole, small_forest(TreeKind::kdtree).forest.hierarchy).has_value());
}
