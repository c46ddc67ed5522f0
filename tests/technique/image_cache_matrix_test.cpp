// Any partition goes with any metric and any policy: every combination, over a world that changes,
// is replayed on paper, which knows nothing of how a cache decides.
#include "technique/changing_world.hpp"
#include "technique/plan_replay.hpp"
#include "technique/scenes.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

using namespace farfield;
using support::Forest;
using support::Step;

TEST_CASE("every partition goes with every metric and every policy, in a world that changes") {
    const auto partition =
        GENERATE(support::Partition::bsp, support::Partition::kdtree, support::Partition::octree);
    const auto validity = GENERATE(
        ImageValidity::angle,
        ImageValidity::zone,
        ImageValidity::impostor_angles,
        ImageValidity::bound
    );
    const auto policy = GENERATE(ImagePolicy::amortized, ImagePolicy::whenever_possible);
    const auto surfaces = GENERATE(SurfacePlacement::first, SurfacePlacement::in_images);
    CAPTURE(partition, validity, policy, surfaces);
    const Forest forest = support::make_forest({.trees = 40, .radius = 50.0, .ground_cells = 8});
    struct Kind {
        ImageOrientation orientation;
        bool all_around;
        QuadDepth depth;
    };
    const std::vector<Kind> kinds = {
        {ImageOrientation::view_aligned, false, QuadDepth::none},
        {ImageOrientation::facing_eye, false, QuadDepth::none},
        {ImageOrientation::facing_eye, true, QuadDepth::texel},
        {ImageOrientation::view_aligned, false, QuadDepth::plane}};
    for (const Kind& kind : kinds) {
        CAPTURE(kind.orientation, kind.all_around, kind.depth);
        ImageCacheOptions options{
            .error_px = 3.0,
            .validity = validity,
            .orientation = kind.orientation,
            .policy = policy,
            .surfaces = surfaces,
            .quad_depth = kind.depth,
            .all_around = kind.all_around,
            .image_budget_bytes = std::uint64_t{20} * 256 * 256,
            .page_size = 256};
        if (!validate(options)) {
            continue; // said by name, and tested where options are
        }
        Hierarchy tree = support::build(forest, partition);
        support::ChangingWorld world(tree, forest, 5);
        auto cache = ImageCache::create(tree, options);
        REQUIRE(cache.has_value());
        support::PlanReplay replay(
            tree,
            {.budget_bytes = options.image_budget_bytes,
             .surfaces = cache->surfaces(),
             .quad_depth = kind.depth}
        );
        std::vector<std::uint64_t> primitives;
        for (const Object& object : forest.objects) {
            primitives.push_back(object.primitives);
        }
        NullBackend backend(primitives, &tree);
        std::uint64_t created = 0;
        std::uint64_t combined = 0;
        std::uint64_t reused = 0;
        std::uint64_t stale = 0;
        const auto flight = support::random_flight(
            250, 3, {.reach = 120.0, .teleport_in = 60, .turn_in = 40, .lens_in = 80}
        );
        TargetId target{};
        for (std::size_t frame = 0; frame < flight.size(); ++frame) {
            CAPTURE(frame);
            world.step();
            cache->set_appearance(world.appearance());
            const Step& step = flight[frame];
            const FramePlan& plan = cache->plan(step.view, step.motion);
            replay.execute(plan, world.appearance());
            const auto made = backend.create_target(step.view.width, step.view.height, 1);
            REQUIRE(made.has_value());
            target = *made;
            const Result<void> drawn = backend.execute(plan, target, {});
            INFO((drawn ? std::string() : drawn.error().message));
            REQUIRE(drawn.has_value());
            backend.destroy_target(target);
            REQUIRE(backend.image_bytes() <= options.image_budget_bytes);
            REQUIRE(backend.image_bytes() == cache->statistics().image_bytes);
            created += cache->statistics().images_created;
            combined += cache->statistics().images_combined;
            reused += cache->statistics().images_reused;
            stale += cache->statistics().images_stale;
        }
        REQUIRE(validate(tree).has_value());
        CHECK(created > 20);
        CHECK(reused > 50);
        CHECK(stale > 10);
        if (policy == ImagePolicy::whenever_possible) {
            CHECK(combined > 0);
        }
    }
}
