#include "support/allocation_counter.hpp"
#include "technique/changing_world.hpp"
#include "technique/plan_replay.hpp"
#include "technique/scenes.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

using namespace farfield;

TEST_CASE("100,000 frames of random flight break no rule of plans") {
    const support::Forest forest =
        support::make_forest({.trees = 30, .radius = 40.0, .ground_cells = 4});
    const ImageCacheOptions options{
        .error_px = 3.0,
        .surfaces = GENERATE(SurfacePlacement::first, SurfacePlacement::in_images),
        .image_budget_bytes =
            std::uint64_t{16} * 64 * 64, // two pages that hold a handful of images
        .page_size = 64};
    auto cache = ImageCache::create(forest.hierarchy, options);
    REQUIRE(cache.has_value());
    support::PlanReplay replay(
        forest.hierarchy,
        {.budget_bytes = options.image_budget_bytes, .surfaces = cache->surfaces()}
    );
    std::uint64_t created = 0;
    std::uint64_t shown = 0;
    std::uint64_t evicted = 0;
    std::uint64_t refused = 0;
    for (const support::Step& step :
         support::random_flight(100'000, 1, {.reach = 200.0, .speed = 5.0, .turn_in = 30})) {
        replay.execute(cache->plan(step.view, step.motion));
        created += cache->statistics().images_created;
        shown += cache->statistics().images_shown;
        evicted += cache->statistics().images_evicted;
        refused += cache->statistics().images_refused;
    }
    CHECK(created > 1'000);
    CHECK(shown > created);
    CHECK(evicted > 1'000);
    CHECK(refused > 1'000);
}

TEST_CASE("100,000 frames over a world that changes keep to budget, memory and decisions") {
    const support::Forest forest =
        support::make_forest({.trees = 30, .radius = 40.0, .ground_cells = 4});
    const bool schaufler = GENERATE(false, true);
    CAPTURE(schaufler);
    ImageCacheOptions options{.error_px = 3.0, .image_budget_bytes = std::uint64_t{20} * 256 * 256};
    options = schaufler ? presets::schaufler1996(options) : presets::shade1996(options);
    options.all_around = schaufler;
    options.quad_depth = schaufler ? QuadDepth::texel : QuadDepth::none;
    options.page_size = 256;
    Hierarchy tree =
        support::build(forest, schaufler ? support::Partition::kdtree : support::Partition::bsp);
    const auto flight =
        support::random_flight(100'000, 1, {.reach = 200.0, .speed = 5.0, .turn_in = 30});
    std::vector<std::uint64_t> primitives;
    for (const Object& object : forest.objects) {
        primitives.push_back(object.primitives);
    }
    struct Outcome {
        std::uint64_t digest = 0;
        std::uint64_t allocations = 0;
        std::uint64_t created = 0;
        std::uint64_t stale = 0;
    };
    const auto make_cache = [&] {
        auto made = ImageCache::create(tree, options);
        REQUIRE(made.has_value());
        return std::move(*made);
    };
    // Changes and views are the same each time.
    const auto fly = [&](ImageCache& cache, std::size_t frames, bool drawn) {
        support::ChangingWorld world(tree, forest, 7);
        NullBackend backend(primitives, &tree);
        Outcome outcome;
        const auto wide = backend.create_target(640, 480, 1);
        const auto narrow = backend.create_target(320, 480, 1);
        REQUIRE(wide.has_value());
        REQUIRE(narrow.has_value());
        const std::uint64_t before = support::allocation_count();
        for (const support::Step& step : std::span(flight).first(frames)) {
            world.step();
            cache.set_appearance(world.appearance());
            const FramePlan& plan = cache.plan(step.view, step.motion);
            outcome.digest = outcome.digest * 1099511628211ULL + digest(plan);
            outcome.created += cache.statistics().images_created;
            outcome.stale += cache.statistics().images_stale;
            if (cache.statistics().image_bytes > options.image_budget_bytes) {
                FAIL("over budget");
            }
            if (drawn) {
                const TargetId target = step.view.width == 640 ? *wide : *narrow;
                if (const Result<void> done = backend.execute(plan, target, {}); !done) {
                    FAIL(done.error().message);
                }
                if (backend.image_bytes() > options.image_budget_bytes) {
                    FAIL("more bytes than the budget");
                }
            }
        }
        outcome.allocations = support::allocation_count() - before;
        world.restore();
        return outcome;
    };
    ImageCache cache = make_cache();
    const Outcome first = fly(cache, flight.size(), true);
    CHECK(first.created > 1'000);
    CHECK(first.stale > 1'000);
    ImageCache again = make_cache();
    CHECK(fly(again, flight.size(), false).digest == first.digest);
    // The second flight begins with the images of the first, so the third repeats it.
    (void)fly(cache, 10'000, false);
    CHECK(fly(cache, 10'000, false).allocations == 0);
}
