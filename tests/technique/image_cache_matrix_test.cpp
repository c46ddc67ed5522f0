// Any partition goes with any metric and any policy: every combination, over a world that changes,
// is replayed on paper, which knows nothing of how a cache decides.
#include "support/random.hpp"
#include "technique/plan_replay.hpp"
#include "technique/scenes.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/partition/kdtree.hpp>
#include <farfield/partition/octree.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

using namespace farfield;
using support::Forest;
using support::Random;
using support::Step;

namespace {

enum class Partition : std::uint8_t { bsp, kdtree, octree };

constexpr std::uint32_t kTrees = 40;

Hierarchy build(const Forest& forest, Partition partition) {
    const PrimitiveBounds bounds = [&](std::uint32_t, std::uint32_t primitive) {
        return forest.ground[primitive];
    };
    const auto tree = [&]() -> Result<Hierarchy> {
        switch (partition) {
        case Partition::kdtree:
            return partition::build_kdtree(
                forest.objects, {.branching = 4, .max_primitives = 20'100}, bounds
            );
        case Partition::octree:
            return partition::build_octree(forest.objects, {.max_primitives = 20'100}, bounds);
        case Partition::bsp:
            break;
        }
        return partition::build_bsp(forest.objects, {.max_piece_primitives = 32}, bounds);
    }();
    REQUIRE(tree.has_value());
    REQUIRE(validate(*tree).has_value());
    return *tree;
}

/// What happens to a world, at random and the same for the same seed: things look different, move,
/// rest, vanish and come back, and the light changes.
class ChangingWorld {
  public:
    ChangingWorld(Hierarchy& tree, const Forest& forest, std::uint64_t seed)
        : tree_(&tree), forest_(&forest), random_(seed) {
        tree.moving.reserve(forest.objects.size());
    }

    void step() {
        const auto item = make_id<ItemId>(random_.below(kTrees));
        switch (random_.below(40)) {
        case 0:
            partition::mark_changed(*tree_, item);
            break;
        case 1:
            partition::mark_changed(
                *tree_, make_id<ItemId>(static_cast<std::uint32_t>(forest_->objects.size() - 1))
            );
            break;
        case 2:
            REQUIRE(partition::hide(*tree_, item).has_value());
            break;
        case 3:
        case 4:
            move(item);
            break;
        case 5:
            ++appearance_;
            break;
        default:
            break;
        }
        // What moves goes on for a while, and then rests where it is, or at home.
        for (std::size_t i = 0; i < tree_->moving.size(); ++i) {
            const ItemId mover = tree_->moving[i].item;
            switch (random_.below(12)) {
            case 0:
                (void)partition::settle(*tree_, mover);
                break;
            case 1:
                send_home(mover);
                break;
            default:
                move(mover);
                break;
            }
        }
    }

    /// Everything back to where it was.
    void restore() {
        for (std::uint32_t item = 0; item < kTrees; ++item) {
            const Box3d& home = forest_->objects[item].bounds;
            REQUIRE(partition::update_bounds(*tree_, make_id<ItemId>(item), home).has_value());
        }
        for (std::uint32_t item = 0; item < kTrees; ++item) {
            REQUIRE(partition::settle(*tree_, make_id<ItemId>(item)));
        }
    }

    [[nodiscard]] std::uint64_t appearance() const { return appearance_; }

  private:
    void move(ItemId item) {
        Box3d box = forest_->objects[index_of(item)].bounds;
        const glm::dvec3 by(random_.uniform(-8.0, 8.0), 0.0, random_.uniform(-8.0, 8.0));
        REQUIRE(partition::update_bounds(*tree_, item, Box3d{box.lo + by, box.hi + by}).has_value()
        );
    }
    void send_home(ItemId item) {
        const Box3d& home = forest_->objects[index_of(item)].bounds;
        REQUIRE(partition::update_bounds(*tree_, item, home).has_value());
        (void)partition::settle(*tree_, item);
    }

    Hierarchy* tree_;
    const Forest* forest_;
    Random random_;
    std::uint64_t appearance_ = 0;
};

} // namespace

TEST_CASE("every partition goes with every metric and every policy, in a world that changes") {
    const auto partition = GENERATE(Partition::bsp, Partition::kdtree, Partition::octree);
    const auto validity = GENERATE(
        ImageValidity::angle,
        ImageValidity::zone,
        ImageValidity::impostor_angles,
        ImageValidity::bound
    );
    const auto policy = GENERATE(ImagePolicy::amortized, ImagePolicy::whenever_possible);
    const auto surfaces = GENERATE(SurfacePlacement::first, SurfacePlacement::in_images);
    CAPTURE(partition, validity, policy, surfaces);
    const Forest forest =
        support::make_forest({.trees = kTrees, .radius = 50.0, .ground_cells = 8});
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
        Hierarchy tree = build(forest, partition);
        ChangingWorld world(tree, forest, 5);
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
