#include "support/allocation_counter.hpp"
#include "support/random.hpp"
#include "technique/scenes.hpp"
#include "technique/sprite_world.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/metric/pixel_conversion.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/lod_sprite.hpp>
#include <farfield/technique/sprite_error.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using farfield::support::make_sprite_world;
using farfield::support::Random;
using farfield::support::SpriteWorld;
using farfield::support::Step;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Costs with which keyframes of the small worlds here pay at once.
CostModel dear_triangles() {
    CostModel costs;
    costs.triangle_s = 1e-5;
    return costs;
}

LodSprite make_sprite(const SpriteWorld& world, LodSpriteOptions options) {
    options.costs = dear_triangles();
    auto made = LodSprite::create(world.hierarchy, world.pairs, options);
    INFO((made ? std::string() : made.error().message));
    REQUIRE(made.has_value());
    return std::move(*made);
}

/// Sideways past the terrain, looking at its middle.
std::vector<View>
passing(std::size_t frames, double step_m, const glm::dvec3& offset = glm::dvec3(0.0)) {
    std::vector<View> views;
    for (std::size_t i = 0; i < frames; ++i) {
        const glm::dvec3 eye(-100.0 + step_m * static_cast<double>(i), 150.0, 800.0);
        views.push_back(support::view_at(offset + eye, offset));
    }
    return views;
}

/// Sums of a walk.
struct Totals {
    std::uint32_t made = 0;
    std::uint32_t tiles = 0;
    std::uint32_t predicted = 0;
    std::uint32_t reused = 0;
    std::uint32_t geometry = 0;
    std::uint32_t projected = 0;
    std::uint64_t digest = 0;
};

/// Executes plans on paper, and holds statistics against them.
class Walker {
  public:
    explicit Walker(const SpriteWorld& world)
        : world_(&world), backend_(world.item_primitives, &world.hierarchy),
          target_(backend_.create_target(640, 480, 1).value()) {}

    Totals walk(
        LodSprite& sprite,
        std::span<const Step> steps,
        const std::function<void(const Step&, const FramePlan&)>& after = {}
    ) {
        Totals totals;
        for (std::size_t frame = 0; frame < steps.size(); ++frame) {
            CAPTURE(frame);
            const FramePlan& plan = sprite.plan(steps[frame].view, steps[frame].motion);
            execute(plan);
            const LodSpriteStatistics& statistics = sprite.statistics();
            REQUIRE(statistics.image_bytes == backend_.image_bytes());
            REQUIRE(plan.passes.size() == 1 + statistics.keyframes_made + statistics.tiles_made);
            REQUIRE(
                (statistics.refusal == SpriteRefusal::none) ==
                (statistics.frame != SpriteFrame::geometry)
            );
            REQUIRE((statistics.frame == SpriteFrame::projected) == !plan.keyframes.empty());
            totals.made += statistics.keyframes_made;
            totals.tiles += statistics.tiles_made;
            totals.predicted += statistics.keyframes_predicted;
            totals.reused += statistics.keyframes_reused;
            totals.geometry += statistics.frame == SpriteFrame::geometry ? 1U : 0U;
            totals.projected += statistics.frame == SpriteFrame::projected ? 1U : 0U;
            totals.digest = totals.digest * 1099511628211ULL + digest(plan);
            if (after) {
                after(steps[frame], plan);
            }
        }
        return totals;
    }

    Totals walk(LodSprite& sprite, std::span<const View> views) {
        return walk(sprite, support::walk_of(views));
    }

    void execute(const FramePlan& plan) {
        if (plan.passes.back().view.width != width_) {
            width_ = plan.passes.back().view.width;
            target_ = backend_.create_target(width_, plan.passes.back().view.height, 1).value();
        }
        const Result<void> executed = backend_.execute(plan, target_, {});
        INFO((executed ? std::string("executed") : executed.error().message));
        REQUIRE(executed.has_value());
    }

  private:
    const SpriteWorld* world_;
    NullBackend backend_;
    TargetId target_;
    int width_ = 640;
};

/// What the frame pass draws by a kind of command.
std::vector<Command> commands_of(const FramePlan& plan, Command::Kind kind) {
    std::vector<Command> found;
    const Pass& frame = plan.passes.back();
    for (std::uint32_t i = 0; i < frame.command_count; ++i) {
        if (plan.commands[frame.first_command + i].kind == kind) {
            found.push_back(plan.commands[frame.first_command + i]);
        }
    }
    return found;
}

/// Corners of chosen triangles that lie within an edge of another one.
std::size_t cracks(const SpriteWorld& world, const std::vector<std::uint32_t>& chosen) {
    const std::uint32_t columns = world.grid.columns;
    std::vector<bool> corners(world.grid.heights.size());
    for (const std::uint32_t triangle : chosen) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            corners[world.posts[triangle * 3 + k]] = true;
        }
    }
    std::size_t found = 0;
    for (const std::uint32_t triangle : chosen) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = world.posts[triangle * 3 + k];
            const std::uint32_t b = world.posts[triangle * 3 + (k + 1) % 3];
            const int across = static_cast<int>(b % columns) - static_cast<int>(a % columns);
            const int down = static_cast<int>(b / columns) - static_cast<int>(a / columns);
            const int steps = std::gcd(across, down);
            for (int step = 1; step < steps; ++step) {
                const int column = static_cast<int>(a % columns) + across / steps * step;
                const int row = static_cast<int>(a / columns) + down / steps * step;
                found += corners[world.grid.post(
                             static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row)
                         )]
                             ? 1U
                             : 0U;
            }
        }
    }
    return found;
}

} // namespace

TEST_CASE("a walk past a terrain makes few keyframes and shows the coarse model between them") {
    const SpriteWorld world = make_sprite_world({});
    LodSprite sprite = make_sprite(world, {.error_px = 2.0});
    Walker walker(world);
    std::uint64_t frames = 0;
    const auto views = passing(200, 0.5);
    const auto check = [&](const Step& step, const FramePlan& plan) {
        const LodSpriteStatistics& statistics = sprite.statistics();
        if (frames++ == 0) {
            REQUIRE(statistics.frame == SpriteFrame::image);
        }
        REQUIRE(statistics.error_px <= 2.0);
        REQUIRE(statistics.own_share <= 0.1);
        if (statistics.frame == SpriteFrame::image) {
            // The picture that was just made, on its own pixels.
            REQUIRE(plan.quads.size() == 1);
            REQUIRE(plan.passes[0].view == step.view);
            REQUIRE(plan.passes[0].copy == plan.quads[0].source);
            REQUIRE(plan.passes[0].copy_page == plan.quads[0].page);
            REQUIRE(commands_of(plan, Command::Kind::images).size() == 1);
            REQUIRE(commands_of(plan, Command::Kind::geometry).empty());
            return;
        }
        const auto projected = commands_of(plan, Command::Kind::projected);
        REQUIRE(projected.size() == 1);
        REQUIRE(projected[0].count == 1);
        REQUIRE(plan.items[projected[0].first] == world.pairs[0].coarse);
        REQUIRE(plan.pieces.empty());
        REQUIRE(statistics.coarse_triangles == world.pairs[0].facets.size());
        // The first keyframe is right, by the samples one by one.
        const Keyframe& keyframe = plan.keyframes[projected[0].first_keyframe];
        const ProxyPair& pair = world.pairs[0];
        const SpriteEyes eyes{
            local_point(keyframe.view.eye, pair.origin),
            local_point(step.view.eye, pair.origin),
            make_frustum(keyframe.view, pair.origin),
            make_frustum(step.view, pair.origin)};
        const double threshold = metric::angle_of_pixels(step.view, 2.0, PixelConversion::bound);
        REQUIRE(sprite_error::rms(pair, eyes, 0).largest_rad <= threshold);
        REQUIRE(keyframe.offset_m == pair.offset_m);
    };
    const Totals totals = walker.walk(sprite, support::walk_of(views), check);
    CHECK(totals.made >= 2);
    CHECK(totals.made <= 40);
    CHECK(totals.geometry == 0);
    CHECK(totals.projected == views.size() - totals.made);
}

TEST_CASE("a higher threshold makes no more keyframes") {
    const SpriteWorld world = make_sprite_world({});
    const SpriteCriterion criterion = GENERATE(SpriteCriterion::largest, SpriteCriterion::rms);
    const auto steps = support::walk_of(passing(300, 0.5));
    std::uint32_t before = UINT32_MAX;
    std::uint32_t most = 0;
    for (const double error_px : {0.5, 1.0, 2.0, 4.0, 8.0}) {
        LodSprite sprite = make_sprite(
            world,
            {.error_px = error_px,
             .criterion = criterion,
             .max_own_share = 1.0,
             .keyframes_shown = 1,
             .never_slower = false}
        );
        Walker walker(world);
        const Totals totals = walker.walk(sprite, steps);
        CAPTURE(error_px, before);
        CHECK(totals.made <= before);
        before = totals.made;
        most = std::max(most, totals.made);
    }
    CHECK(most > 2 * before);
}

TEST_CASE("over a flat field a keyframe is right until its texels are too large") {
    const auto world = make_sprite_world({}, [](double, double) { return 0.0; });
    Walker walker(world);
    std::vector<View> sideways;
    sideways.reserve(400);
    for (int i = 0; i < 400; ++i) {
        // Across the whole field, looking straight down from far above: all of it is in view.
        sideways.push_back(look_at(
            {-400.0 + 2.0 * i, 2000.0, 0.0},
            {-400.0 + 2.0 * i, 0.0, 0.1},
            {0, 1, 0},
            support::test_lens(),
            640,
            480
        ));
    }
    LodSprite over = make_sprite(world, {.error_px = 0.5, .max_texel_px = kInfinity});
    CHECK(walker.walk(over, sideways).made == 1);

    // Down to a twentieth of the height, towards the middle: each keyframe lasts for a factor of
    // two, give or take how many parts of the picture are beyond it.
    std::vector<View> down;
    down.reserve(200);
    for (int i = 0; i < 200; ++i) {
        const double height = 2000.0 * std::pow(0.05, i / 199.0);
        down.push_back(
            look_at({0, height, 0}, {0, 0, 0.1}, {0, 1, 0}, support::test_lens(), 640, 480)
        );
    }
    LodSprite any = make_sprite(world, {.error_px = 0.5, .max_texel_px = kInfinity});
    CHECK(Walker(world).walk(any, down).made == 1);
    LodSprite sharp = make_sprite(world, {.error_px = 0.5, .max_texel_px = 2.0});
    const std::uint32_t made = Walker(world).walk(sharp, down).made;
    CHECK(made >= 4);
    CHECK(made <= 7);
}

TEST_CASE("back and forth there are no new keyframes after the first lap") {
    const SpriteWorld world = make_sprite_world({});
    const auto there = passing(120, 0.5);
    auto lap = there;
    lap.insert(lap.end(), there.rbegin(), there.rend());
    const bool guaranteed = GENERATE(false, true);
    LodSprite sprite = make_sprite(
        world,
        {.error_px = 2.0,
         .guaranteed = guaranteed,
         .max_keyframes = 32,
         .image_budget_bytes = std::uint64_t{256} << 20U}
    );
    Walker walker(world);
    const Totals first = walker.walk(sprite, lap);
    CHECK(first.made > 1);
    for (int again = 1; again < 10; ++again) {
        const Totals totals = walker.walk(sprite, lap);
        CAPTURE(again);
        CHECK(totals.made == 0);
        CHECK(totals.geometry == 0);
        CHECK(totals.reused > 0);
    }
}

TEST_CASE("who stands still sees the picture itself") {
    const SpriteWorld world = make_sprite_world({.trees = 20});
    LodSprite sprite = make_sprite(world, {});
    Walker walker(world);
    const View view = support::view_at({0, 150, 800}, {0, 0, 0});
    for (int i = 0; i < 5; ++i) {
        const FramePlan& plan = sprite.plan(view, {});
        walker.execute(plan);
        CHECK(sprite.statistics().frame == SpriteFrame::image);
        CHECK(sprite.statistics().keyframes_made == (i == 0 ? 1U : 0U));
        // What has no pair stands among it by depth.
        CHECK(commands_of(plan, Command::Kind::image_depths).size() == 1);
        CHECK(commands_of(plan, Command::Kind::images)[0].depth == QuadDepth::texel);
        const auto trees = commands_of(plan, Command::Kind::geometry);
        REQUIRE(trees.size() == 1);
        CHECK(trees[0].count == 20);
    }
}

TEST_CASE("what has no pair, and what moves, is geometry after the coarse model") {
    SpriteWorld world = make_sprite_world({.trees = 20});
    LodSprite sprite = make_sprite(world, {.error_px = 4.0});
    Walker walker(world);
    const auto views = passing(20, 0.25);
    const Box3d box{{0, 100, 300}, {10, 110, 310}};
    const auto steps = support::walk_of(views);
    for (std::size_t i = 0; i < steps.size(); ++i) {
        CAPTURE(i);
        if (i >= 10) {
            REQUIRE(partition::update_bounds(world.hierarchy, ItemId{3}, box).has_value());
        }
        const FramePlan& plan = sprite.plan(steps[i].view, steps[i].motion);
        walker.execute(plan);
        if (sprite.statistics().frame == SpriteFrame::projected) {
            const Pass& frame = plan.passes.back();
            REQUIRE(plan.commands[frame.first_command].kind == Command::Kind::projected);
        }
        const auto trees = commands_of(plan, Command::Kind::geometry);
        REQUIRE(trees.size() == 1);
        std::vector<ItemId> items(
            plan.items.begin() + trees[0].first,
            plan.items.begin() + trees[0].first + trees[0].count
        );
        REQUIRE(items.size() == 20);
        if (i >= 10) {
            REQUIRE(items.back() == ItemId{3});
        }
        std::sort(items.begin(), items.end());
        for (std::size_t k = 0; k < items.size(); ++k) {
            REQUIRE(items[k] == make_id<ItemId>(k + 1));
        }
        // Leaving its place changes the world once; moving on does not.
        REQUIRE(sprite.statistics().keyframes_made == ((i == 0 || i == 10) ? 1U : 0U));
    }
}

TEST_CASE("a pair whose item has moved is geometry from then on") {
    // A world of trees alone, the first of which has a pair: a box of one facet.
    SpriteWorld world = make_sprite_world({.trees = 8});
    ProxyPair pair;
    pair.fine = ItemId{1};
    pair.coarse = make_id<ItemId>(world.item_primitives.size());
    pair.origin = center(world.objects[1].bounds);
    pair.samples = {{{0.0F, 0.5F, 0.0F}, 0}};
    pair.facets.resize(1);
    pair.nodes.resize(1);
    pair.nodes[0].bounds = {{0.0F, 0.5F, 0.0F}, {0.0F, 0.5F, 0.0F}};
    pair.nodes[0].below = 0.5F;
    pair.nodes[0].above = 0.5F;
    pair.nodes[0].cosine = 1.0F;
    pair.nodes[0].count = 1;
    pair.offset_m = 4.0F;
    pair.quality = {.facets = 1, .samples = 1, .rms_m = 0.5, .hausdorff_m = 4.0};
    world.pairs.push_back(pair);
    world.item_primitives.push_back(1);
    LodSprite sprite = make_sprite(world, {.error_px = 4.0});
    Walker walker(world);
    const auto steps = support::walk_of(passing(4, 0.25));
    const auto coarse_shown = [&](std::size_t frame) {
        const FramePlan& plan = sprite.plan(steps[frame].view, steps[frame].motion);
        walker.execute(plan);
        REQUIRE(std::count(plan.items.begin(), plan.items.end(), ItemId{1}) <= 1);
        return std::count(plan.items.begin(), plan.items.end(), pair.coarse);
    };
    CHECK(coarse_shown(0) == 0); // an image
    CHECK(coarse_shown(1) == 1);
    const Box3d elsewhere{
        world.objects[1].bounds.lo + glm::dvec3(1, 0, 0),
        world.objects[1].bounds.hi + glm::dvec3(1, 0, 0)};
    REQUIRE(partition::update_bounds(world.hierarchy, ItemId{1}, elsewhere).has_value());
    CHECK(coarse_shown(2) == 0);
    CHECK(sprite.statistics().keyframes_made == 1);
    CHECK(coarse_shown(3) == 0);
    CHECK(sprite.statistics().frame == SpriteFrame::projected);
    REQUIRE(partition::settle(world.hierarchy, ItemId{1}));
    CHECK(coarse_shown(2) == 0);
    CHECK(coarse_shown(3) == 0);
    REQUIRE(
        partition::update_bounds(world.hierarchy, ItemId{1}, world.objects[1].bounds).has_value()
    );
    REQUIRE(partition::settle(world.hierarchy, ItemId{1}));
    CHECK(coarse_shown(2) == 0); // an image
    CHECK(coarse_shown(3) == 1);
}

TEST_CASE("frames of plain geometry are the baseline's") {
    const SpriteWorld world = make_sprite_world({.trees = 10});
    CulledGeometry baseline(world.hierarchy);
    const auto same = [&](LodSprite& sprite, const View& view, SpriteRefusal refusal) {
        CHECK(digest(sprite.plan(view, {})) == digest(baseline.plan(view)));
        CHECK(sprite.statistics().frame == SpriteFrame::geometry);
        CHECK(sprite.statistics().refusal == refusal);
        CHECK(sprite.statistics().image_bytes == 0);
    };
    const View view = support::view_at({0, 150, 800}, {0, 0, 0});
    LodSprite none = make_sprite(world, {.image_budget_bytes = 0});
    same(none, view, SpriteRefusal::memory);
    LodSprite small = make_sprite(world, {.keyframe_limit = 512});
    same(small, view, SpriteRefusal::memory);
    LodSprite sprite = make_sprite(world, {});
    same(sprite, support::view_at({0, 150, 800}, {0, 2000, 900}), SpriteRefusal::empty);
    // Under the terrain, and among its hills.
    same(sprite, support::view_at({0, 5, 0}, {100, 5, 0}), SpriteRefusal::near);
    LodSprite cheap =
        LodSprite::create(world.hierarchy, world.pairs, {.costs = {.triangle_s = 1e-15}}).value();
    same(cheap, view, SpriteRefusal::too_dear);

    auto without = LodSprite::create(world.hierarchy, {}, {});
    REQUIRE(without.has_value());
    same(*without, view, SpriteRefusal::empty);
}

TEST_CASE("a smaller view after one that is too large has keyframes") {
    const SpriteWorld world = make_sprite_world({});
    LodSprite sprite = make_sprite(world, {.keyframe_limit = 640});
    Walker walker(world);
    View view = support::view_at({0, 150, 800}, {0, 0, 0});
    View large = view;
    large.width = 1280;
    large.height = 960;
    walker.execute(sprite.plan(large, {}));
    CHECK(sprite.statistics().refusal == SpriteRefusal::memory);
    walker.execute(sprite.plan(view, {}));
    CHECK(sprite.statistics().frame == SpriteFrame::image);
    view.width = 320;
    view.height = 240;
    walker.execute(sprite.plan(view, {}));
    CHECK(sprite.statistics().frame != SpriteFrame::geometry);
}

TEST_CASE("turning round leaves the keyframe, and a margin holds it longer") {
    const SpriteWorld world = make_sprite_world({});
    // From above the middle, all around.
    const auto turn = [](std::size_t frames) {
        std::vector<View> views;
        for (std::size_t i = 0; i < frames; ++i) {
            const double angle = 6.283185307179586 * static_cast<double>(i) / 400.0;
            const glm::dvec3 eye(0, 200, 0);
            views.push_back(
                support::view_at(eye, eye + glm::dvec3(std::cos(angle), -0.6, std::sin(angle)))
            );
        }
        return views;
    };
    const auto made = [&](double margin) {
        LodSprite sprite = make_sprite(
            world,
            {.image_budget_bytes = std::uint64_t{256} << 20U,
             .keyframes_shown = 1,
             .keyframe_margin = margin}
        );
        return Walker(world).walk(sprite, turn(400)).made;
    };
    const std::uint32_t narrow = made(1.0);
    const std::uint32_t wide = made(1.5);
    CAPTURE(narrow, wide);
    CHECK(narrow > 10);
    CHECK(wide * 2 < narrow);

    // Half a turn at once: what the keyframe shows is no longer there.
    LodSprite sprite = make_sprite(world, {});
    Walker walker(world);
    const auto views = turn(400);
    walker.execute(sprite.plan(views[0], {}));
    walker.execute(sprite.plan(views[200], {}));
    CHECK(sprite.statistics().keyframes_made == 1);
    // And back: the first one is still there.
    walker.execute(sprite.plan(views[1], {}));
    CHECK(sprite.statistics().keyframes_made == 0);
    CHECK(sprite.statistics().keyframes_reused == 1);
}

TEST_CASE("a keyframe of another lens serves, where its texels are small enough") {
    const SpriteWorld world = make_sprite_world({});
    LodSprite sprite = make_sprite(world, {});
    Walker walker(world);
    const View view = support::view_at({0, 250, 250}, {0, 0, 0});
    walker.execute(sprite.plan(view, {}));
    const auto zoomed = [&](double factor) {
        View other = view;
        for (double* tangent :
             {&other.lens.left, &other.lens.right, &other.lens.bottom, &other.lens.top}) {
            *tangent /= factor;
        }
        walker.execute(sprite.plan(other, {}));
        return sprite.statistics().keyframes_made;
    };
    CHECK(zoomed(1.5) == 0);
    CHECK(zoomed(1.9) == 0);
    CHECK(zoomed(2.5) == 1);
    // Wider: rims of the picture are missing.
    CHECK(zoomed(0.6) == 1);
}

TEST_CASE("who moves too fast for keyframes sees geometry") {
    const SpriteWorld world = make_sprite_world({});
    LodSprite sprite = make_sprite(world, {.error_px = 0.5});
    Walker walker(world);
    const Totals fast = walker.walk(sprite, passing(60, 25.0));
    // Motion is known from the third frame on.
    CHECK(fast.made <= 2);
    CHECK(fast.geometry >= 56);
    // Whose motion is not known for what it is: jumps, each after standing still.
    LodSprite jumped = make_sprite(world, {.error_px = 0.5});
    Walker jumper(world);
    Totals jumps;
    const auto views = passing(200, 25.0);
    for (std::size_t i = 0; i < views.size(); ++i) {
        jumper.execute(jumped.plan(views[i % 50], {}));
        jumps.made += jumped.statistics().keyframes_made;
    }
    CHECK(jumps.made < 40);
    // Slowly, keyframes are back.
    const Totals slow = walker.walk(sprite, passing(200, 0.05));
    CHECK(slow.projected > 150);
    LodSprite eager = make_sprite(world, {.error_px = 0.5, .never_slower = false});
    Walker other(world);
    CHECK(other.walk(eager, passing(20, 25.0)).made == 20);
}

TEST_CASE("keyframes made ahead, in tiles, leave no frame with a whole one") {
    const SpriteWorld world = make_sprite_world({});
    LodSprite sprite = make_sprite(
        world,
        {.error_px = 2.0,
         .image_budget_bytes = std::uint64_t{128} << 20U,
         .keyframe_margin = 1.2,
         .predict_frames = 10,
         .keyframe_tiles = 8}
    );
    Walker walker(world);
    std::uint64_t most_after_first = 0;
    std::uint64_t whole = 0;
    std::size_t frame = 0;
    const auto check = [&](const Step&, const FramePlan& plan) {
        const std::uint64_t triangles = work_of(plan, world.item_primitives).triangles;
        if (frame++ == 0) {
            whole = triangles;
        } else {
            most_after_first = std::max(most_after_first, triangles);
        }
        // Tiles of one keyframe are side by side.
        if (sprite.statistics().tiles_made == 1) {
            REQUIRE(plan.passes[0].scissor.width < plan.passes[0].viewport.width);
            REQUIRE(plan.passes[0].copy == plan.passes[0].scissor);
        }
    };
    const auto views = passing(600, 0.125);
    const Totals totals = walker.walk(sprite, support::walk_of(views), check);
    CAPTURE(totals.made, totals.predicted, totals.tiles);
    CHECK(totals.made == 1);
    CHECK(totals.predicted >= 3);
    CHECK(totals.tiles >= 8 * totals.predicted);
    CHECK(totals.geometry == 0);
    // A tile is an eighth of the picture, whose share of the pieces is more as they are not cut.
    CHECK(most_after_first * 2 < whole);
}

TEST_CASE("with a promise for every fragment, keyframes say so") {
    const SpriteWorld world = make_sprite_world({});
    LodSprite sprite = make_sprite(world, presets::guaranteed_sprite({.error_px = 1.5}));
    Walker walker(world);
    const auto steps = support::walk_of(passing(200, 0.5));
    const Totals totals =
        walker.walk(sprite, steps, [&](const Step& /*step*/, const FramePlan& plan) {
            for (const Keyframe& keyframe : plan.keyframes) {
                REQUIRE(keyframe.max_shift_px == 1.5F);
            }
            REQUIRE(sprite.statistics().own_share <= 0.1);
        });
    CHECK(totals.geometry == 0);
    CHECK(totals.made > 1);
    CHECK(totals.made < 40);
}

TEST_CASE("a way that was not foreseen costs own colours for a while, not a whole keyframe") {
    const SpriteWorld world = make_sprite_world({.refinable = true});
    LodSpriteOptions options =
        presets::guaranteed_sprite({.error_px = 0.5, .predict_frames = 8, .refine = true});
    LodSprite patient = make_sprite(world, options);
    // With no keyframe to spare for the one that is being made there is nothing to wait with.
    options.max_keyframes = 2;
    LodSprite pressed = make_sprite(world, options);
    // Sideways, and all at once towards the hills.
    std::vector<View> views = passing(60, 0.25);
    for (int i = 0; i < 120; ++i) {
        const glm::dvec3 eye = views[59].eye + glm::dvec3(0.0, -0.4, -2.2) * (i + 1.0);
        views.push_back(support::view_at(eye, {}));
    }
    const auto steps = support::walk_of(views);
    Walker walker(world);
    double largest = 0.0;
    const Totals totals = walker.walk(patient, steps, [&](const Step&, const FramePlan&) {
        largest = std::max(largest, patient.statistics().own_share);
        REQUIRE(patient.statistics().tiles_made <= 2);
    });
    CAPTURE(totals.made, totals.predicted, largest);
    CHECK(totals.made == 1);
    CHECK(totals.predicted > 1);
    CHECK(totals.geometry == 0);
    CHECK(largest > options.max_own_share);
    CHECK(largest <= 3.0 * options.max_own_share);
    Walker other(world);
    const Totals without = other.walk(pressed, steps, [&](const Step&, const FramePlan&) {
        REQUIRE(pressed.statistics().own_share <= options.max_own_share);
    });
    CHECK(without.made + without.predicted > 1);
}

TEST_CASE("triangles try one keyframe where it serves as well as all that are shown") {
    const SpriteWorld world = make_sprite_world({.refinable = true});
    LodSprite sprite = make_sprite(
        world, presets::guaranteed_sprite({.error_px = 0.5, .keyframes_shown = 3, .refine = true})
    );
    Walker walker(world);
    std::array<std::size_t, kMostKeyframes + 1> commands{};
    const auto steps = support::walk_of(passing(300, 1.0));
    const Totals totals = walker.walk(sprite, steps, [&](const Step&, const FramePlan& plan) {
        std::vector<std::uint32_t> drawn;
        for (const Command& command : plan.commands) {
            if (command.kind != Command::Kind::projected) {
                continue;
            }
            ++commands[command.keyframe_count];
            const std::uint32_t shown = sprite.statistics().keyframes_shown;
            REQUIRE((command.keyframe_count == 1 || command.keyframe_count == shown));
            REQUIRE(command.selection_count > 0);
            for (std::uint32_t i = 0; i < command.selection_count; ++i) {
                const Selection& selection = plan.selections[command.first_selection + i];
                const auto first = plan.selected.begin() + selection.first;
                drawn.insert(drawn.end(), first, first + selection.count);
            }
        }
        // All of the cut, and each triangle once.
        REQUIRE(drawn.size() == sprite.statistics().coarse_triangles);
        REQUIRE(drawn.size() == plan.selected.size());
        std::sort(drawn.begin(), drawn.end());
        REQUIRE(std::adjacent_find(drawn.begin(), drawn.end()) == drawn.end());
    });
    CHECK(totals.projected > 200);
    CHECK(commands[1] > 0);
    CHECK(commands[2] + commands[3] > 0);
}

TEST_CASE("the published system has one keyframe, for whole triangles") {
    const SpriteWorld world = make_sprite_world({});
    LodSprite sprite = make_sprite(world, presets::chen1999({.error_px = 0.25}));
    Walker walker(world);
    const auto steps = support::walk_of(passing(200, 0.5));
    const Totals totals =
        walker.walk(sprite, steps, [&](const Step& /*step*/, const FramePlan& plan) {
            for (const Command& command : commands_of(plan, Command::Kind::projected)) {
                REQUIRE(command.whole_triangles);
                REQUIRE(command.keyframe_count == 1);
            }
            REQUIRE(sprite.statistics().keyframes_kept == 1);
            REQUIRE(sprite.statistics().error_px < 0.25);
        });
    CHECK(totals.made > 1);
    CHECK(totals.reused == 0);
}

TEST_CASE("a cut holds the threshold, and is as fine as it has to be") {
    const SpriteWorld world = make_sprite_world({.posts = 129, .refinable = true});
    LodSprite sprite = make_sprite(world, {.error_px = 2.0, .refine = true});
    Walker walker(world);
    std::uint64_t least = UINT64_MAX;
    std::uint64_t most = 0;
    const auto steps = support::walk_of(passing(200, 0.5));
    const Totals totals =
        walker.walk(sprite, steps, [&](const Step& /*step*/, const FramePlan& plan) {
            if (sprite.statistics().frame != SpriteFrame::projected) {
                return;
            }
            REQUIRE(plan.selections.size() == 1);
            REQUIRE(plan.selections[0].item == world.pairs[0].coarse);
            const std::uint64_t triangles = plan.selections[0].count;
            REQUIRE(sprite.statistics().coarse_triangles == triangles);
            least = std::min(least, triangles);
            most = std::max(most, triangles);
            REQUIRE(cracks(world, plan.selected) == 0);
        });
    CHECK(totals.projected > 150);
    CHECK(least >= 8);
    CHECK(most < world.pairs[0].quality.facets);
    // Few triangles are allowed: another keyframe, or geometry, and never more than that.
    LodSprite few = make_sprite(world, {.error_px = 2.0, .refine = true, .max_triangles = 100});
    Walker other(world);
    other.walk(few, steps, [&](const Step& /*step*/, const FramePlan& plan) {
        REQUIRE(plan.selected.size() <= 100);
        REQUIRE(cracks(world, plan.selected) == 0);
    });
    // Not refined, the finest model is drawn.
    LodSprite finest = make_sprite(world, {.error_px = 2.0});
    Walker third(world);
    third.walk(finest, steps, [&](const Step& /*step*/, const FramePlan& plan) {
        REQUIRE((plan.selected.empty() || plan.selected.size() > most));
    });
}

TEST_CASE("every combination of options plans what backends accept") {
    struct Case {
        SpriteCriterion criterion;
        bool paper;
        bool guaranteed;
        SpriteVisibility visibility;
        std::uint32_t shown;
        double margin;
        std::uint32_t predict;
        bool refine;
    };
    std::vector<Case> cases;
    for (unsigned bits = 0; bits < 256; ++bits) {
        const auto bit = [&](unsigned place) { return (bits >> place & 1U) != 0U; };
        const Case one{
            bit(0) ? SpriteCriterion::rms : SpriteCriterion::largest,
            bit(0) && bit(1),
            bit(2),
            bit(3) ? SpriteVisibility::triangles : SpriteVisibility::fragments,
            bit(4) ? 4U : 1U,
            bit(5) ? 1.3 : 1.0,
            bit(6) ? 12U : 0U,
            bit(7)};
        if (bit(0) || !bit(1)) {
            cases.push_back(one);
        }
    }
    const SpriteWorld fixed = make_sprite_world({.posts = 33, .trees = 6});
    const SpriteWorld refinable = make_sprite_world({.posts = 33, .refinable = true, .trees = 6});
    const auto flight = support::random_flight(
        40, 3, {.reach = 500.0, .speed = 40.0, .teleport_in = 12, .turn_in = 20, .lens_in = 25}
    );
    std::uint32_t projected = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const Case& one = cases[i];
        CAPTURE(i);
        LodSpriteOptions options;
        options.error_px = 3.0;
        options.criterion = one.criterion;
        options.paper_theta = one.paper;
        options.guaranteed = one.guaranteed;
        options.visibility = one.visibility;
        options.keyframes_shown = one.shown;
        options.keyframe_margin = one.margin;
        options.predict_frames = one.predict;
        options.keyframe_tiles = 4;
        options.refine = one.refine;
        options.max_keyframes = 3;
        options.never_slower = i % 3 == 0;
        const SpriteWorld& world = one.refine ? refinable : fixed;
        LodSprite sprite = make_sprite(world, options);
        Walker walker(world);
        projected += walker.walk(sprite, flight).projected;
        projected += walker.walk(sprite, passing(12, 1.0)).projected;
        sprite.forget_images();
        sprite.set_appearance(i);
        walker.walk(sprite, passing(3, 1.0));
    }
    CHECK(projected > cases.size() * 8);
}

TEST_CASE("after forgetting, and in another light, keyframes are made anew") {
    const SpriteWorld world = make_sprite_world({});
    LodSprite sprite = make_sprite(world, {.error_px = 4.0});
    Walker walker(world);
    const auto steps = support::walk_of(passing(6, 0.1));
    const auto made = [&](std::size_t frame) {
        walker.execute(sprite.plan(steps[frame].view, steps[frame].motion));
        return sprite.statistics().keyframes_made;
    };
    CHECK(made(0) == 1);
    CHECK(made(1) == 0);
    sprite.set_appearance(1);
    CHECK(made(2) == 1);
    CHECK(made(3) == 0);
    sprite.set_appearance(1);
    CHECK(made(4) == 0);
    sprite.forget_images();
    CHECK(made(5) == 1);
    CHECK(sprite.statistics().keyframes_kept == 1);
}

TEST_CASE("plans are the same on every run, far away as well, and allocate nothing once warm") {
    const glm::dvec3 far_off(1e7, 0.0, -1e7);
    const bool refine = GENERATE(false, true);
    const SpriteWorld world = make_sprite_world({.refinable = refine, .trees = 10});
    const SpriteWorld moved =
        make_sprite_world({.refinable = refine, .trees = 10, .offset = far_off});
    const LodSpriteOptions options{
        .error_px = 2.0,
        .image_budget_bytes = std::uint64_t{128} << 20U,
        .keyframe_margin = 1.1,
        .predict_frames = 20,
        .keyframe_tiles = 5,
        .refine = refine};
    const auto steps = support::walk_of(passing(200, 0.5));
    LodSprite sprite = make_sprite(world, options);
    const Totals first = Walker(world).walk(sprite, steps);
    LodSprite again = make_sprite(world, options);
    CHECK(Walker(world).walk(again, steps).digest == first.digest);

    LodSprite elsewhere = make_sprite(moved, options);
    const Totals there =
        Walker(moved).walk(elsewhere, support::walk_of(passing(200, 0.5, far_off)));
    CHECK(there.made == first.made);
    CHECK(there.predicted == first.predicted);
    CHECK(there.projected == first.projected);

    for (const Step& step : steps) {
        (void)sprite.plan(step.view, step.motion);
    }
    const std::uint64_t before = support::allocation_count();
    for (const Step& step : steps) {
        (void)sprite.plan(step.view, step.motion);
    }
    const std::uint64_t after = support::allocation_count();
    CHECK(after == before);
}

TEST_CASE("a walk plans what it always has") {
    // Without prediction nothing in a plan comes from the mathematics library: it only decides, and
    // by more than its last digit.
    const SpriteWorld world = make_sprite_world({.trees = 10});
    LodSprite sprite = make_sprite(world, {.error_px = 2.0});
    const Totals totals = Walker(world).walk(sprite, passing(150, 0.5));
    CAPTURE(totals.made, totals.projected);
    CHECK(totals.digest == 0xcba23c214251676aULL);
}

TEST_CASE("options out of range are refused by name") {
    using Catch::Matchers::Contains;
    const auto message = [](const LodSpriteOptions& options) {
        const Result<void> valid = validate(options);
        REQUIRE_FALSE(valid.has_value());
        CHECK(valid.error().code == ErrorCode::invalid_argument);
        return valid.error().message;
    };
    CHECK(validate(LodSpriteOptions{}).has_value());
    CHECK(validate(presets::chen1999()).has_value());
    CHECK(validate(presets::guaranteed_sprite()).has_value());
    CHECK_THAT(message({.error_px = 0.0}), Contains("error_px is 0"));
    CHECK_THAT(message({.error_px = kNan}), Contains("error_px is nan"));
    CHECK_THAT(message({.error_px = kInfinity}), Contains("error_px is inf"));
    CHECK_THAT(message({.max_own_share = 1.5}), Contains("max_own_share is 1.5"));
    CHECK_THAT(message({.max_own_share = kNan}), Contains("max_own_share is nan"));
    CHECK_THAT(message({.max_texel_px = 0.5}), Contains("max_texel_px is 0.5"));
    CHECK_THAT(message({.max_texel_px = kNan}), Contains("max_texel_px is nan"));
    CHECK_THAT(message({.max_keyframes = 0}), Contains("max_keyframes is 0"));
    CHECK_THAT(message({.keyframe_limit = 63}), Contains("keyframe_limit is 63"));
    CHECK_THAT(message({.keyframe_limit = 16385}), Contains("keyframe_limit is 16385"));
    CHECK_THAT(message({.keyframes_shown = 0}), Contains("keyframes_shown is 0"));
    CHECK_THAT(message({.keyframes_shown = 5}), Contains("keyframes_shown is 5"));
    CHECK_THAT(message({.keyframe_margin = 0.9}), Contains("keyframe_margin is 0.9"));
    CHECK_THAT(message({.keyframe_margin = kNan}), Contains("keyframe_margin is nan"));
    CHECK_THAT(message({.predict_frames = 3}), Contains("predict_frames is 3"));
    CHECK_THAT(message({.max_keyframes = 1, .predict_frames = 30}), Contains("max_keyframes is 1"));
    CHECK_THAT(message({.keyframe_tiles = 0}), Contains("keyframe_tiles is 0"));
    CHECK_THAT(message({.keyframe_tiles = 65}), Contains("keyframe_tiles is 65"));
    CHECK_THAT(message({.refine_share = 0.0}), Contains("refine_share is 0"));
    CHECK_THAT(message({.max_triangles = 0}), Contains("max_triangles is 0"));
    CHECK_THAT(message({.keyframe_samples = 0}), Contains("keyframe_samples is 0"));
    CHECK_THAT(message({.paper_theta = true}), Contains("paper_theta"));
    CHECK_THAT(message({.costs = {.triangle_s = -1.0}}), Contains("triangle_s"));
}

TEST_CASE("pairs that do not fit the hierarchy are refused by name") {
    using Catch::Matchers::Contains;
    SpriteWorld world = make_sprite_world({.posts = 17, .trees = 2});
    const auto message = [&]() {
        const auto made = LodSprite::create(world.hierarchy, world.pairs, {});
        REQUIRE_FALSE(made.has_value());
        return made.error().message;
    };
    const ProxyPair right = world.pairs[0];
    world.pairs[0].fine = ItemId{77};
    CHECK_THAT(message(), Contains("pair 0: fine is item 77"));
    world.pairs[0] = right;
    world.pairs[0].coarse = ItemId{1};
    CHECK_THAT(message(), Contains("pair 0: coarse is item 1"));
    world.pairs = {right, right};
    CHECK_THAT(message(), Contains("pair 1: fine is item 0, which has a pair already"));
    world.pairs = {right};
    world.pairs[0].samples[0].point.y = std::numeric_limits<float>::quiet_NaN();
    CHECK_THAT(message(), Contains("pair 0: ") && Contains("nan"));
    CHECK_THAT(LodSprite::create(Hierarchy{}, {}, {}).error().message, Contains("no nodes"));
}
