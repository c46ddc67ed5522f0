#include "technique/plan_replay.hpp"
#include "technique/scenes.hpp"
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>

using namespace farfield;

TEST_CASE("100,000 frames of random flight break no rule of plans") {
    const support::Forest forest =
        support::make_forest({.trees = 24, .radius = 120.0, .ground_cells = 4});
    const ImageCacheOptions options{
        .error_px = 3.0,
        .surfaces = GENERATE(SurfacePlacement::first, SurfacePlacement::in_images),
        .image_budget_bytes = 8U * 128U * 128U + 3U * 4U * 128U * 128U,
        .page_size = 128};
    auto cache = ImageCache::create(forest.hierarchy, options);
    REQUIRE(cache.has_value());
    support::PlanReplay replay(
        forest.hierarchy,
        {.budget_bytes = options.image_budget_bytes, .surfaces = cache->surfaces()}
    );
    std::uint64_t created = 0;
    std::uint64_t shown = 0;
    std::uint64_t evicted = 0;
    for (const support::Step& step : support::random_flight(100'000, 1, {.reach = 200.0})) {
        replay.execute(cache->plan(step.view, step.motion));
        created += cache->statistics().images_created;
        shown += cache->statistics().images_shown;
        evicted += cache->statistics().images_evicted;
    }
    CHECK(created > 1'000);
    CHECK(shown > 10 * created);
    CHECK(evicted > 100);
}
