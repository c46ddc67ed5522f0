// The order that a BSP promises: from any eye, what is drawn later is never behind what was drawn
// before, for all items that no plane cuts.
#include "order_checks.hpp"
#include "scenes.hpp"
#include "tree_checks.hpp"
#include <farfield/partition/bsp.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <vector>

namespace {

using namespace farfield;

/// Shoots rays at the uncut items. `shrink` [m] is taken off each side of each box.
support::Tally shoot(
    const std::vector<Object>& objects,
    const Hierarchy& tree,
    double shrink,
    support::Random& random
) {
    const std::vector<bool> cut = support::require_items_in_place(tree, objects);
    const std::vector<std::uint32_t> leaves = support::leaf_of_items(tree, objects.size());
    std::vector<support::Placed> items;
    for (std::size_t index = 0; index < objects.size(); ++index) {
        const Box3d& world = objects[index].bounds;
        if (!cut[index]) {
            items.push_back(
                {{world.lo - tree.origin + shrink, world.hi - tree.origin - shrink}, leaves[index]}
            );
        }
    }
    return support::shoot(tree, items, random);
}

} // namespace

TEST_CASE("rays meet boxes in the reverse order of drawing", "[bsp]") {
    // Multiples of 1/16 m and planes across the axes: extents and planes are exact in float. The
    // ray distances round, but (x - eye) / direction rises with x in floating point as it does
    // without, so that order is tested without a tolerance.
    support::Random random(11);
    for (const double size : {4.0, 12.0, 40.0}) {
        std::vector<Object> objects;
        for (int index = 0; index < 400; ++index) {
            const glm::dvec3 lo = glm::floor(random.vector(-100.0, 100.0) * 16.0) / 16.0;
            const glm::dvec3 edges = glm::floor(glm::abs(random.vector(-size, size)) * 16.0) / 16.0;
            objects.push_back({{lo, lo + edges}, 1 + random.below(100), false});
        }
        for (const bool vertical : {false, true}) {
            const auto tree = partition::build_bsp(objects, {.split_vertically = vertical});
            REQUIRE(tree.has_value());
            const support::Tally tally = shoot(objects, *tree, 0.0, random);
            CAPTURE(size, vertical, tree->quality.cut_items, tally.pairs);
            CHECK(tally.wrong == 0);
            // The test would prove nothing if the rays met no two boxes. Each is aimed at two.
            CHECK(tally.pairs > 500);
        }
    }
}

TEST_CASE("oblique planes keep the order within float rounding", "[bsp]") {
    // Coordinates up to 200 m are rounded to 2^-17 m at most once and each of the six operations of
    // a dot product adds as much: boxes made smaller by 1 mm lie strictly on their sides.
    support::Random random(12);
    std::vector<Object> objects;
    for (int index = 0; index < 400; ++index) {
        const glm::dvec3 lo = random.vector(-100.0, 100.0);
        objects.push_back({{lo, lo + 0.01 + glm::abs(random.vector(-5.0, 5.0))}, 1, false});
    }
    for (const std::uint32_t directions : {1U, 3U, 8U}) {
        const auto tree = partition::build_bsp(
            objects, {.directions = directions, .up = {0.3, 1.0, -0.2}, .balance_weight = 0.05F}
        );
        REQUIRE(tree.has_value());
        const support::Tally tally = shoot(objects, *tree, 0.001, random);
        CAPTURE(directions, tree->quality.cut_items, tally.pairs);
        CHECK(tally.wrong == 0);
        CHECK(tally.pairs > 500);
    }
}

TEST_CASE("every point of an uncut item is on its item's side", "[bsp]") {
    support::Random random(13);
    std::vector<Object> objects = support::random_boxes(300, 14);
    for (Object& object : objects) {
        object.bounds.lo += 1e7;
        object.bounds.hi += 1e7;
    }
    const auto tree =
        partition::build_bsp(objects, {.directions = 5, .split_vertically = true, .up = {1, 2, 3}});
    REQUIRE(tree.has_value());
    const std::vector<bool> cut = support::require_items_in_place(*tree, objects);
    const std::vector<std::uint32_t> leaves = support::leaf_of_items(*tree, objects.size());
    for (std::size_t index = 0; index < objects.size(); ++index) {
        const Box3d& box = objects[index].bounds;
        for (int sample = 0; sample < 20; ++sample) {
            glm::dvec3 point;
            for (int axis = 0; axis < 3; ++axis) {
                point[axis] = random.uniform(box.lo[axis], box.hi[axis]);
            }
            const glm::vec3 local = local_point(point, tree->origin);
            for (std::uint32_t node = leaves[index]; node != 0 && !cut[index];) {
                const HierarchyNode& parent = tree->nodes[tree->nodes[node].parent];
                const float distance = signed_distance(parent.plane, local);
                const bool in_front = node == parent.first_child + 1;
                CAPTURE(index, distance, in_front);
                REQUIRE((in_front ? distance >= 0.0F : distance <= 0.0F));
                node = tree->nodes[node].parent;
            }
        }
    }
}
