#include "technique/changing_world.hpp"

#include <farfield/partition/bsp.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/partition/kdtree.hpp>
#include <farfield/partition/octree.hpp>

#include <catch2/catch.hpp>

#include <cstddef>

namespace farfield::support {

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

ChangingWorld::ChangingWorld(Hierarchy& tree, const Forest& forest, std::uint64_t seed)
    : tree_(&tree), forest_(&forest), start_(tree), random_(seed) {
    tree.moving.reserve(forest.objects.size());
}

std::uint32_t ChangingWorld::trees() const {
    return static_cast<std::uint32_t>(forest_->objects.size()) - (forest_->ground.empty() ? 0 : 1);
}

void ChangingWorld::step() {
    const auto item = make_id<ItemId>(random_.below(trees()));
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

void ChangingWorld::restore() {
    // Versions go on: what was made of the world before is not of this one.
    const std::uint32_t version = tree_->nodes[0].content_version + 1;
    const std::uint32_t surface_version = tree_->surface_version + 1;
    *tree_ = start_;
    for (HierarchyNode& node : tree_->nodes) {
        node.content_version = version;
    }
    tree_->surface_version = surface_version;
}

void ChangingWorld::move(ItemId item) {
    Box3d box = forest_->objects[index_of(item)].bounds;
    const glm::dvec3 by(random_.uniform(-8.0, 8.0), 0.0, random_.uniform(-8.0, 8.0));
    REQUIRE(partition::update_bounds(*tree_, item, Box3d{box.lo + by, box.hi + by}).has_value());
}

void ChangingWorld::send_home(ItemId item) {
    const Box3d& home = forest_->objects[index_of(item)].bounds;
    REQUIRE(partition::update_bounds(*tree_, item, home).has_value());
    (void)partition::settle(*tree_, item);
}

} // namespace farfield::support
