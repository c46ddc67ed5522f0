#include "technique/plan_replay.hpp"
#include "technique/scenes.hpp"
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>

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
