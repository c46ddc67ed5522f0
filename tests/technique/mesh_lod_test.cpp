#include "support/allocation_counter.hpp"
#include "support/random.hpp"
#include "technique/scenes.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/mesh_lod.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
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

namespace {

using namespace farfield;
using farfield::support::Forest;
using farfield::support::Random;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Levels for the objects of a forest: none for every fifth and for the ground, up to six for the
/// others, each of about half the triangles and twice the error of the one before.
struct Levels {
    LodTable table;
    std::vector<std::uint64_t> item_primitives; ///< objects and levels
    std::vector<std::size_t> item_of;           ///< the object that an item stands for
    std::vector<double> error_of;               ///< [m] likewise its error
};

Levels make_levels(const std::vector<Object>& objects, std::uint64_t seed = 1) {
    Random random(seed);
    Levels levels;
    for (std::size_t i = 0; i < objects.size(); ++i) {
        levels.item_primitives.push_back(objects[i].primitives);
        levels.item_of.push_back(i);
        levels.error_of.push_back(0.0);
    }
    for (std::size_t i = 0; i < objects.size(); ++i) {
        LodItem item;
        item.bounds = objects[i].bounds;
        item.primitives = objects[i].primitives;
        item.first_level = static_cast<std::uint32_t>(levels.table.levels.size());
        item.level_count = objects[i].splittable || i % 5 == 0 ? 0 : 1 + random.below(6);
        double error_m = random.uniform(0.01, 0.03);
        std::uint64_t primitives = objects[i].primitives;
        for (std::uint32_t k = 0; k < item.level_count; ++k) {
            error_m *= random.uniform(1.0, 3.0);
            primitives /= 2;
            levels.table.levels.push_back(
                {make_id<ItemId>(levels.item_of.size()),
                 static_cast<float>(error_m),
                 static_cast<std::uint32_t>(primitives)}
            );
            levels.item_primitives.push_back(primitives);
            levels.item_of.push_back(i);
            levels.error_of.push_back(double{static_cast<float>(error_m)});
        }
        levels.table.items.push_back(item);
    }
    return levels;
}

MeshLod
make_technique(const Hierarchy& tree, const LodTable& table, const MeshLodOptions& options = {}) {
    auto technique = MeshLod::create(tree, table, options);
    INFO((technique ? std::string("created") : technique.error().message));
    REQUIRE(technique.has_value());
    return std::move(*technique);
}

/// Where a point is on the picture. [px] @pre it is before the eye
glm::dvec2 pixel_of(const View& view, const glm::dvec3& point) {
    const glm::dvec3 in_camera = glm::transpose(view.camera_to_world) * (point - view.eye);
    const glm::dvec2 tangent = glm::dvec2(in_camera) / -in_camera.z;
    return {
        (tangent.x - view.lens.left) / (view.lens.right - view.lens.left) * view.width,
        (tangent.y - view.lens.bottom) / (view.lens.top - view.lens.bottom) * view.height};
}

bool on_picture(const View& view, const glm::dvec2& pixel) {
    return pixel.x >= 0.0 && pixel.x <= view.width && pixel.y >= 0.0 && pixel.y <= view.height;
}

double depth_of(const View& view, const glm::dvec3& point) {
    return -glm::dot(view.camera_to_world[2], point - view.eye);
}

/// A single item at one point, before an eye at 0 that looks along -z, with one level.
struct Speck {
    Hierarchy tree;
    LodTable table;
};

Speck make_speck(const glm::dvec3& at, float error_m) {
    Speck speck;
    const std::vector<Object> objects = {{{at, at}, 100, false}};
    auto tree = partition::build_bsp(objects);
    REQUIRE(tree.has_value());
    speck.tree = std::move(*tree);
    speck.table.items = {{objects[0].bounds, 100, 0, 1}};
    speck.table.levels = {{ItemId{1}, error_m, 50}};
    return speck;
}

View view_ahead(const glm::dvec3& eye = glm::dvec3(0.0)) {
    return support::view_at(eye, eye - glm::dvec3(0.0, 0.0, 1.0));
}

/// What `create` says to a damaged table, or "".
std::string refusal(const std::function<void(LodTable&)>& damage) {
    const Forest forest = support::make_forest({.trees = 8});
    Levels levels = make_levels(forest.objects);
    damage(levels.table);
    const auto technique = MeshLod::create(forest.hierarchy, levels.table);
    const auto valid = validate(levels.table);
    CHECK(valid.has_value() == technique.has_value());
    return technique ? "" : technique.error().message;
}

} // namespace

TEST_CASE("a hierarchy without objects makes an empty frame") {
    const auto tree = partition::build_bsp({});
    REQUIRE(tree.has_value());
    MeshLod technique = make_technique(*tree, {});
    const FramePlan& plan = technique.plan(view_ahead());
    REQUIRE(plan.passes.size() == 1);
    CHECK(plan.commands.empty());
    CHECK(technique.statistics().triangles == 0);
    CHECK(technique.items_per_level().size() == 1);
}

TEST_CASE("without levels the plan is that of plain geometry") {
    const Forest forest = support::make_forest({.trees = 60, .ground_cells = 8});
    Levels levels = make_levels(forest.objects);
    for (LodItem& item : levels.table.items) {
        item.level_count = 0;
    }
    for (const auto order : {GeometryOrder::front_to_back, GeometryOrder::stored}) {
        MeshLod technique =
            make_technique(forest.hierarchy, levels.table, {.error_px = 1000.0, .order = order});
        CulledGeometry geometry(forest.hierarchy, order);
        for (const support::Step& step : support::curved_walk(200.0, 50)) {
            REQUIRE(digest(technique.plan(step.view)) == digest(geometry.plan(step.view)));
        }
    }
}

TEST_CASE("with a tiny threshold the plan is that of plain geometry, though there are levels") {
    const Forest forest = support::make_forest({.trees = 60, .ground_cells = 8});
    const Levels levels = make_levels(forest.objects);
    MeshLod technique = make_technique(forest.hierarchy, levels.table, {.error_px = 1e-6});
    CulledGeometry geometry(forest.hierarchy);
    for (const support::Step& step : support::curved_walk(200.0, 50)) {
        REQUIRE(digest(technique.plan(step.view)) == digest(geometry.plan(step.view)));
        REQUIRE(technique.statistics().triangles == technique.statistics().full_triangles);
        REQUIRE(technique.items_per_level()[0] == technique.plan(step.view).items.size());
    }
}

TEST_CASE("with a huge threshold every item has its coarsest level") {
    const Forest forest = support::make_forest({.trees = 60});
    const Levels levels = make_levels(forest.objects);
    MeshLod technique = make_technique(forest.hierarchy, levels.table, {.error_px = 1e6});
    const FramePlan& plan = technique.plan(support::view_at({0, 50, 400}, {0, 0, 0}));
    REQUIRE(plan.items.size() == 60);
    for (const ItemId id : plan.items) {
        const LodItem& item = levels.table.items[levels.item_of[index_of(id)]];
        const std::size_t expected =
            item.level_count == 0
                ? levels.item_of[index_of(id)]
                : index_of(levels.table.levels[item.first_level + item.level_count - 1].item);
        CHECK(index_of(id) == expected);
    }
}

TEST_CASE("around the eye an item is drawn as it is, unless a level has no error") {
    const float error_m = GENERATE(0.0F, 1e-30F, 1.0F);
    Speck speck = make_speck({0, 0, -10}, error_m);
    speck.table.items[0].bounds = {{-5, -5, -20}, {5, 5, 20}};
    MeshLod technique = make_technique(speck.tree, speck.table, {.error_px = 1e6});
    const FramePlan& plan = technique.plan(view_ahead());
    REQUIRE(plan.items.size() == 1);
    CHECK(plan.items[0] == (error_m == 0.0F ? ItemId{1} : ItemId{0}));
}

TEST_CASE("a level is shown exactly up to its threshold") {
    // A point in the upper right corner of the picture, where a pixel is the smallest angle, and a
    // level whose point lies off it radially outwards: the worst that there is.
    constexpr double kErrorPx = 3.0;
    constexpr double kDistance = 100.0;
    // The box is kept in float, rounded outwards: at 100 m by up to 7.6e-6 m on each axis, or
    // 1.4e-7 of the distance. Twice that for its sum.
    constexpr double kRounding = 3e-7;
    const View view = view_ahead();
    const glm::dvec3 ray = glm::normalize(glm::dvec3(view.lens.right, view.lens.top, -1.0));
    const glm::dvec3 at = kDistance * ray;
    const auto scale = metric::pixel_scale(view.lens, view.width, view.height).scale;
    const double angle = metric::angle_of_pixels_unchecked(scale, kErrorPx);
    const double error_m = kDistance * std::sin(angle);

    const auto shown = [&](double error) {
        const Speck speck = make_speck(at, static_cast<float>(error));
        MeshLod technique = make_technique(speck.tree, speck.table, {.error_px = kErrorPx});
        return technique.plan(view).items.at(0);
    };
    CHECK(shown(error_m * (1.0 - 2.0 * kRounding)) == ItemId{1});
    CHECK(shown(error_m * (1.0 + 2.0 * kRounding)) == ItemId{0});

    // The level's point that is seen farthest from the true one lies where its ray touches the ball
    // of radius `error_m`. Good to the digits of double, of which 640 pixels take three.
    const glm::dvec3 outwards = glm::normalize(
        glm::dvec3(view.lens.right, view.lens.top, 0.0) -
        ray * glm::dot(ray, glm::dvec3(view.lens.right, view.lens.top, 0.0))
    );
    const glm::dvec3 level_ray = std::cos(angle) * ray + std::sin(angle) * outwards;
    const glm::dvec3 level_point = glm::dot(at, level_ray) * level_ray;
    CHECK(glm::distance(level_point, at) == Approx(error_m).epsilon(1e-12));
    CHECK(
        glm::distance(pixel_of(view, level_point), pixel_of(view, at)) ==
        Approx(kErrorPx).epsilon(1e-9)
    );
}

TEST_CASE("the mean pixel angle allows what the image cache allows") {
    constexpr double kErrorPx = 3.0;
    constexpr double kDistance = 128.0; // exact in float, as is its box
    const View view = view_ahead();
    const double fov_y = 2.0 * std::atan(view.lens.top);
    const double error_m = kDistance * std::sin(kErrorPx * fov_y / view.height);
    for (const auto& [factor, expected] : {std::pair{0.999, ItemId{1}}, {1.001, ItemId{0}}}) {
        const Speck speck = make_speck({0, 0, -kDistance}, static_cast<float>(factor * error_m));
        MeshLod technique = make_technique(
            speck.tree, speck.table, {.error_px = kErrorPx, .conversion = PixelConversion::mean}
        );
        CHECK(technique.plan(view).items.at(0) == expected);
    }
}

TEST_CASE("no point is shown farther from its place than the threshold") {
    // Eyes, lenses, points in the boxes of items and points of levels as far from them as the table
    // says, at random. Pixels are computed in double from coordinates below 1000 m: 1e-13 of them,
    // times 1e3 px a unit tangent and the 1e3 by which a nearby point enlarges it.
    constexpr double kRoundingPx = 1e-6;
    Random random(3);
    const Forest forest = support::make_forest({.trees = 150, .seed = 4});
    const Levels levels = make_levels(forest.objects, 5);
    double most_tight = 0.0;
    std::size_t tried = 0;
    for (const double error_px : {0.5, 2.0, 30.0}) {
        MeshLod technique = make_technique(forest.hierarchy, levels.table, {.error_px = error_px});
        for (int v = 0; v < 200; ++v) {
            glm::dvec3 eye = random.vector(-300.0, 300.0);
            eye.y = random.uniform(0.5, 40.0);
            Lens lens = support::test_lens();
            lens.left = random.uniform(-1.5, -0.2);
            lens.top = random.uniform(0.2, 1.5);
            View view = support::view_at(eye, eye + random.direction<double>());
            view.lens = lens;
            for (const ItemId id : technique.plan(view).items) {
                const double error_m = levels.error_of[index_of(id)];
                if (error_m == 0.0) {
                    continue;
                }
                const Box3d& box = forest.objects[levels.item_of[index_of(id)]].bounds;
                for (int sample = 0; sample < 8; ++sample) {
                    // The nearest point of the box, or any.
                    const glm::dvec3 fraction = 0.5 + random.vector(-0.5, 0.5);
                    const glm::dvec3 point = sample < 2 ? glm::clamp(eye, box.lo, box.hi)
                                                        : box.lo + fraction * extent(box);
                    const glm::dvec3 level_point = point + error_m * random.direction<double>();
                    if (depth_of(view, point) <= 1e-3 || depth_of(view, level_point) <= 1e-3) {
                        continue;
                    }
                    const glm::dvec2 a = pixel_of(view, point);
                    const glm::dvec2 b = pixel_of(view, level_point);
                    if (!on_picture(view, a) && !on_picture(view, b)) {
                        continue;
                    }
                    ++tried;
                    const double off_px = glm::distance(a, b);
                    CAPTURE(error_px, v, index_of(id), error_m, off_px);
                    REQUIRE(off_px <= error_px + kRoundingPx);
                    most_tight = std::max(most_tight, off_px / error_px);
                }
            }
        }
    }
    // The search would find a bound that is half as strict: levels are apart by a factor of up to
    // 3, and pixels in the corner of these lenses are down to a fifth of those in the middle.
    CHECK(tried > 20'000);
    CHECK(most_tight > 0.5);
}

TEST_CASE("items stay in place and order, and each is replaced by a level of its own") {
    const Forest forest = support::make_forest({.trees = 150, .ground_cells = 8, .seed = 6});
    const Levels levels = make_levels(forest.objects, 7);
    MeshLod technique = make_technique(forest.hierarchy, levels.table, {.error_px = 8.0});
    CulledGeometry geometry(forest.hierarchy);
    NullBackend backend(levels.item_primitives, &forest.hierarchy);
    const TargetId target = backend.create_target(640, 480, 1).value();
    std::uint64_t saved = 0;
    std::vector<std::uint64_t> used(technique.items_per_level().size());
    for (const support::Step& step : support::random_flight(300, 8)) {
        const FramePlan& plain = geometry.plan(step.view);
        const FramePlan& plan = technique.plan(step.view);
        REQUIRE(plan.items.size() == plain.items.size());
        std::vector<std::uint32_t> counted(technique.items_per_level().size());
        for (std::size_t i = 0; i < plan.items.size(); ++i) {
            const std::size_t item = index_of(plain.items[i]);
            REQUIRE(levels.item_of[index_of(plan.items[i])] == item);
            const std::uint32_t level =
                plan.items[i] == plain.items[i]
                    ? 0U
                    : static_cast<std::uint32_t>(index_of(plan.items[i])) -
                          static_cast<std::uint32_t>(index_of(
                              levels.table.levels[levels.table.items[item].first_level].item
                          )) +
                          1U;
            ++counted.at(level);
        }
        REQUIRE(std::equal(
            counted.begin(),
            counted.end(),
            technique.items_per_level().begin(),
            technique.items_per_level().end()
        ));
        REQUIRE(plan.pieces == plain.pieces);
        const PlanWork work = work_of(plan, levels.item_primitives);
        const PlanWork plain_work = work_of(plain, levels.item_primitives);
        REQUIRE(technique.statistics().triangles == work.triangles);
        REQUIRE(technique.statistics().full_triangles == plain_work.triangles);
        saved += plain_work.triangles - work.triangles;
        for (std::size_t level = 0; level < used.size(); ++level) {
            used[level] += counted[level];
        }
        const auto executed = backend.execute(plan, target, {});
        INFO((executed ? std::string("executed") : executed.error().message));
        REQUIRE(executed.has_value());
    }
    CHECK(saved > 0);
    // The flight comes across every level.
    CHECK(std::find(used.begin(), used.end(), 0U) == used.end());
}

TEST_CASE("what moves is drawn by the level for where it is now") {
    constexpr double kErrorPx = 2.0;
    constexpr double kLimit = 100.0; // [m] where the level is just good enough
    const View view = view_ahead();
    const auto scale = metric::pixel_scale(view.lens, view.width, view.height).scale;
    const double sine = std::sin(metric::angle_of_pixels_unchecked(scale, kErrorPx));
    Speck speck = make_speck({0, 0, -50}, static_cast<float>(kLimit * sine));
    MeshLod technique = make_technique(speck.tree, speck.table, {.error_px = kErrorPx});
    const auto shown_at = [&](double distance) {
        const glm::dvec3 at(0, 0, -distance);
        REQUIRE(partition::update_bounds(speck.tree, ItemId{0}, {at, at}).has_value());
        const ItemId moving = technique.plan(view).items.at(0);
        REQUIRE(partition::settle(speck.tree, ItemId{0}));
        REQUIRE(technique.plan(view).items.at(0) == moving); // at rest as on the way
        REQUIRE(technique.items_per_level()[moving == ItemId{0} ? 0 : 1] == 1);
        return moving;
    };
    CHECK(technique.plan(view).items.at(0) == ItemId{0});
    CHECK(shown_at(120) == ItemId{1});
    CHECK(shown_at(99) == ItemId{0});
    CHECK(shown_at(101) == ItemId{1});
    CHECK(shown_at(50) == ItemId{0}); // back where the table has it

    // A technique made while it is elsewhere takes the table's bounds for those of there.
    REQUIRE(
        partition::update_bounds(speck.tree, ItemId{0}, {{0, 0, -120}, {0, 0, -120}}).has_value()
    );
    MeshLod late = make_technique(speck.tree, speck.table, {.error_px = kErrorPx});
    CHECK(late.plan(view).items.at(0) == ItemId{0});
    REQUIRE(
        partition::update_bounds(speck.tree, ItemId{0}, {{0, 0, -119}, {0, 0, -119}}).has_value()
    );
    CHECK(late.plan(view).items.at(0) == ItemId{1});
    REQUIRE(partition::hide(speck.tree, ItemId{0}).has_value());
    CHECK(late.plan(view).items.empty());
    CHECK(late.statistics().full_triangles == 0);
}

TEST_CASE("levels change late with hysteresis, and never beyond the threshold") {
    constexpr double kErrorPx = 2.0;
    constexpr double kShare = 0.25;
    constexpr double kLimit = 100.0; // [m] where the level is just good enough
    const View at_origin = view_ahead();
    const auto scale = metric::pixel_scale(at_origin.lens, at_origin.width, at_origin.height).scale;
    const double sine = std::sin(metric::angle_of_pixels_unchecked(scale, kErrorPx));
    const Speck speck = make_speck({0, 0, 0}, static_cast<float>(kLimit * sine));
    MeshLod technique =
        make_technique(speck.tree, speck.table, {.error_px = kErrorPx, .hysteresis = kShare});
    const auto shows_level = [&](double distance) {
        return technique.plan(view_ahead({0, 0, distance})).items.at(0) == ItemId{1};
    };
    CHECK_FALSE(shows_level(99.0));
    CHECK_FALSE(shows_level(101.0)); // good, but not by a quarter
    CHECK_FALSE(shows_level(133.0)); // 100 / (1 - 0.25) = 133.3
    CHECK(shows_level(134.0));
    CHECK(shows_level(101.0));
    CHECK_FALSE(shows_level(99.0));
    CHECK_FALSE(shows_level(101.0));
    // Out of sight nothing changes.
    CHECK(shows_level(134.0));
    CHECK(technique.plan(support::view_at({0, 0, 50}, {0, 0, 60})).items.empty());
    CHECK(shows_level(101.0));
}

TEST_CASE("a scene far from the origin has the levels of one at it") {
    const glm::dvec3 far_away(1e7, -2e6, 1e7);
    const Forest here = support::make_forest({.trees = 100});
    const Forest there = support::make_forest({.trees = 100, .offset = far_away});
    MeshLod a = make_technique(here.hierarchy, make_levels(here.objects).table);
    MeshLod b = make_technique(there.hierarchy, make_levels(there.objects).table);
    for (int frame = 0; frame < 50; ++frame) {
        const glm::dvec3 eye(frame * 8.0 - 200.0, 4.0, 128.0);
        const glm::dvec3 target(0.0, 4.0, frame * 0.5);
        const FramePlan& plan_a = a.plan(support::view_at(eye, target));
        const FramePlan& plan_b = b.plan(support::view_at(far_away + eye, far_away + target));
        REQUIRE(plan_a.items == plan_b.items);
    }
}

TEST_CASE("planning is repeatable and allocates nothing once warm") {
    const double hysteresis = GENERATE(0.0, 0.2);
    const Forest forest = support::make_forest({.trees = 200, .ground_cells = 16});
    const Levels levels = make_levels(forest.objects);
    const auto walk = support::curved_walk(200.0, 300);
    MeshLod technique = make_technique(forest.hierarchy, levels.table, {.hysteresis = hysteresis});
    MeshLod again = make_technique(forest.hierarchy, levels.table, {.hysteresis = hysteresis});
    std::vector<std::uint64_t> digests;
    digests.reserve(walk.size());
    for (const support::Step& step : walk) {
        digests.push_back(digest(technique.plan(step.view)));
        (void)again.plan(walk.back().view); // warm, with memories of another view
    }
    MeshLod moved = std::move(again);
    std::size_t different = 0;
    for (std::size_t frame = 0; frame < walk.size(); ++frame) {
        different += digest(moved.plan(walk[frame].view)) != digests[frame] ? 1U : 0U;
    }
    // Without hysteresis a plan depends on the view alone.
    CHECK((hysteresis > 0.0 || different == 0));
    const std::uint64_t before = support::allocation_count();
    for (const support::Step& step : walk) {
        (void)technique.plan(step.view);
    }
    const std::uint64_t after = support::allocation_count();
    CHECK(after == before);
}

TEST_CASE("options out of range are refused by name") {
    const auto tree = partition::build_bsp({});
    REQUIRE(tree.has_value());
    const auto message = [&](const MeshLodOptions& options) {
        const auto technique = MeshLod::create(*tree, {}, options);
        REQUIRE_FALSE(technique.has_value());
        CHECK(technique.error().code == ErrorCode::invalid_argument);
        return technique.error().message;
    };
    using Catch::Matchers::Contains;
    CHECK_THAT(message({.error_px = 0.0}), Contains("error_px is 0,"));
    CHECK_THAT(message({.error_px = kNan}), Contains("error_px is nan"));
    CHECK_THAT(
        message({.error_px = std::numeric_limits<double>::infinity()}), Contains("error_px is inf")
    );
    CHECK_THAT(message({.hysteresis = 1.0}), Contains("hysteresis is 1,"));
    CHECK_THAT(message({.hysteresis = -0.1}), Contains("hysteresis is -0.1"));
    CHECK_THAT(message({.hysteresis = kNan}), Contains("hysteresis is nan"));
    const auto nothing = MeshLod::create(Hierarchy{}, {});
    REQUIRE_FALSE(nothing.has_value());
    CHECK_THAT(nothing.error().message, Contains("no nodes"));
}

TEST_CASE("tables that contradict themselves are refused by name") {
    using Catch::Matchers::Contains;
    CHECK(refusal([](LodTable&) {}).empty());
    CHECK_THAT(
        refusal([](LodTable& table) { table.items[1].first_level = 1000; }),
        Contains("item 1: levels 1000")
    );
    CHECK_THAT(
        refusal([](LodTable& table) { table.items[1].level_count = 256; }),
        Contains("item 1 has 256 levels, expected at most 255")
    );
    CHECK_THAT(
        refusal([](LodTable& table) { table.items[2].bounds.lo.y = kNan; }),
        Contains("item 2: bounds")
    );
    CHECK_THAT(
        refusal([](LodTable& table) { table.items[2].bounds = {}; }), Contains("item 2: bounds")
    );
    CHECK_THAT(
        refusal([](LodTable& table) {
            table.levels[table.items[3].first_level].item = kNone<ItemId>;
        }),
        Contains("item 3, level 1: item is none")
    );
    CHECK_THAT(
        refusal([](LodTable& table) { table.levels[table.items[3].first_level].error_m = -1.0F; }),
        Contains("item 3, level 1: error_m is -1, expected a finite number of at least 0")
    );
    CHECK_THAT(
        refusal([](LodTable& table) {
            table.levels[table.items[3].first_level].error_m =
                std::numeric_limits<float>::quiet_NaN();
        }),
        Contains("item 3, level 1: error_m is nan")
    );
    CHECK_THAT(
        refusal([](LodTable& table) { table.items[3].primitives = 7; }),
        Contains("item 3, level 1: primitives is") && Contains("expected less than 7")
    );
    // Two levels of one item, the second finer than the first in either respect.
    const auto two = [](float error_m, std::uint32_t primitives) {
        return refusal([=](LodTable& table) {
            table.items = {{{{0, 0, 0}, {1, 1, 1}}, 100, 0, 2}};
            table.items.resize(8, LodItem{{}, 1, 0, 0});
            table.levels = {{ItemId{8}, 0.5F, 50}, {ItemId{9}, error_m, primitives}};
        });
    };
    CHECK(two(0.5F, 49).empty());
    CHECK_THAT(two(0.4F, 25), Contains("item 0, level 2: error_m is 0.4"));
    CHECK_THAT(two(0.6F, 50), Contains("item 0, level 2: primitives is 50, expected less than 50"));
}

TEST_CASE("a hierarchy that holds levels, or other items than the table, is refused") {
    Forest forest = support::make_forest({.trees = 8});
    Levels levels = make_levels(forest.objects);
    levels.table.items.pop_back();
    for (const bool moves : {false, true}) {
        if (moves) {
            REQUIRE(partition::hide(forest.hierarchy, ItemId{7}).has_value());
        }
        const auto technique = MeshLod::create(forest.hierarchy, levels.table);
        REQUIRE_FALSE(technique.has_value());
        CHECK(technique.error().code == ErrorCode::invalid_argument);
        CHECK_THAT(
            technique.error().message, Catch::Matchers::Contains("holds item 7, the table 7 items")
        );
    }
}
