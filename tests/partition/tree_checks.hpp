#pragma once

#include <farfield/partition/hierarchy.hpp>

#include <catch2/catch.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <vector>

/// What the tests of every builder demand of its trees, found anew from the objects.
namespace farfield::support {

inline void require_valid(const Hierarchy& tree) {
    const Result<void> checked = validate(tree);
    INFO((checked ? std::string("valid") : checked.error().message));
    REQUIRE(checked.has_value());
}

inline std::vector<std::uint32_t> node_depths(const Hierarchy& tree) {
    std::vector<std::uint32_t> depths(tree.nodes.size(), 0);
    for (std::size_t node = 1; node < depths.size(); ++node) {
        depths[node] = depths[tree.nodes[node].parent] + 1;
    }
    return depths;
}

/// Leaf of each object that is kept whole; 0 for the others.
inline std::vector<std::uint32_t> leaf_of_items(const Hierarchy& tree, std::size_t objects) {
    std::vector<std::uint32_t> leaves(objects, 0);
    for (std::uint32_t index = 0; index < tree.nodes.size(); ++index) {
        const HierarchyNode& node = tree.nodes[index];
        for (std::uint32_t item = 0; is_leaf(node) && item < node.item_count; ++item) {
            leaves[index_of(tree.items[node.first_item + item])] = index;
        }
    }
    return leaves;
}

/// Least and greatest signed distance of a world box's corners, narrowed as the library does.
struct Reach {
    float least = std::numeric_limits<float>::infinity();
    float greatest = -std::numeric_limits<float>::infinity();
};

inline Reach reach_of(const Plane& plane, const Box3d& box, const glm::dvec3& origin) {
    Reach reach;
    for (unsigned index = 0; index < 8; ++index) {
        const float distance = signed_distance(plane, local_point(corner(box, index), origin));
        reach.least = std::min(reach.least, distance);
        reach.greatest = std::max(reach.greatest, distance);
    }
    return reach;
}

/// Every whole object has its box and its cost beside its place, and the way from item to place
/// leads there.
inline void require_item_tables(const Hierarchy& tree, std::span<const Object> objects) {
    REQUIRE(tree.item_boxes.size() == tree.items.size());
    REQUIRE(tree.item_primitives.size() == tree.items.size());
    REQUIRE(tree.item_places.size() == objects.size());
    for (std::size_t place = 0; place < tree.items.size(); ++place) {
        CAPTURE(place);
        const std::size_t item = index_of(tree.items[place]);
        REQUIRE(tree.item_places[item] == place);
        REQUIRE(tree.item_boxes[place] == local_box(objects[item].bounds, tree.origin));
        REQUIRE(tree.item_primitives[place] == objects[item].primitives);
    }
    for (std::size_t item = 0; item < objects.size(); ++item) {
        REQUIRE((tree.item_places[item] == Hierarchy::kNoPlace) == objects[item].splittable);
    }
}

/// Every object in exactly one place, its box held by all nodes above it; each whole item on its
/// side of every plane above it, exactly, or counted as cut. Says for each object whether it is
/// cut.
inline std::vector<bool>
require_items_in_place(const Hierarchy& tree, std::span<const Object> objects) {
    const std::vector<std::uint32_t> leaves = leaf_of_items(tree, objects.size());
    std::vector<int> places(objects.size(), 0);
    for (const ItemId item : tree.items) {
        REQUIRE(index_of(item) < objects.size());
        ++places[index_of(item)];
    }
    std::vector<bool> cut(objects.size(), false);
    std::vector<std::uint64_t> primitives(tree.nodes.size(), 0);
    std::uint32_t cut_items = 0;
    for (std::size_t index = 0; index < objects.size(); ++index) {
        CAPTURE(index);
        REQUIRE(places[index] == (objects[index].splittable ? 0 : 1));
        if (objects[index].splittable) {
            continue;
        }
        const Box3d& box = objects[index].bounds;
        std::uint32_t node = leaves[index];
        for (;;) {
            const Box3f& outer = tree.nodes[node].items_box;
            for (int axis = 0; axis < 3; ++axis) {
                REQUIRE(static_cast<double>(outer.lo[axis]) <= box.lo[axis] - tree.origin[axis]);
                REQUIRE(static_cast<double>(outer.hi[axis]) >= box.hi[axis] - tree.origin[axis]);
            }
            primitives[node] += objects[index].primitives;
            if (node == 0) {
                break;
            }
            const std::uint32_t parent = tree.nodes[node].parent;
            const bool in_front = node == tree.nodes[parent].first_child + 1;
            const Reach reach = reach_of(tree.nodes[parent].plane, box, tree.origin);
            if (reach.least < 0.0F && reach.greatest > 0.0F) {
                cut[index] = true;
            } else if (in_front) {
                REQUIRE(reach.least >= 0.0F);
            } else {
                REQUIRE(reach.greatest <= 0.0F);
            }
            node = parent;
        }
        cut_items += cut[index] ? 1U : 0U;
    }
    REQUIRE(tree.quality.cut_items == cut_items);
    for (std::size_t node = 0; node < tree.nodes.size(); ++node) {
        REQUIRE(tree.nodes[node].item_primitives == primitives[node]);
    }
    return cut;
}

/// Every primitive of every splittable object in exactly one leaf, its box held by its block's and
/// by those of the nodes above it, and the centre of its box on its side of every plane above it,
/// exactly.
inline void require_pieces_in_place(
    const Hierarchy& tree, std::span<const Object> objects, const PrimitiveBounds& bounds_of
) {
    std::map<std::uint32_t, std::vector<int>> places;
    for (std::uint32_t leaf = 0; leaf < tree.nodes.size(); ++leaf) {
        if (!is_leaf(tree.nodes[leaf])) {
            continue;
        }
        for (std::uint32_t index = 0; index < tree.nodes[leaf].piece_count; ++index) {
            const Piece& piece = tree.pieces[tree.nodes[leaf].first_piece + index];
            const auto object = static_cast<std::uint32_t>(piece.item);
            REQUIRE(object < objects.size());
            REQUIRE(objects[object].splittable);
            std::vector<int>& seen = places[object];
            seen.resize(objects[object].primitives, 0);
            for (std::uint32_t offset = 0; offset < piece.count; ++offset) {
                const std::uint32_t primitive = tree.primitives[piece.first + offset];
                REQUIRE(primitive < seen.size());
                ++seen[primitive];
                const Box3d box = bounds_of(object, primitive);
                const glm::vec3 middle = local_point(center(box), tree.origin);
                const Box3f& block =
                    tree.block_boxes.at((piece.first + offset) / Hierarchy::kBlockPrimitives);
                const auto holds = [&](const Box3f& outer) {
                    bool inside = true;
                    for (int axis = 0; axis < 3; ++axis) {
                        const double lo = box.lo[axis] - tree.origin[axis];
                        const double hi = box.hi[axis] - tree.origin[axis];
                        inside = inside && static_cast<double>(outer.lo[axis]) <= lo &&
                                 static_cast<double>(outer.hi[axis]) >= hi;
                    }
                    return inside;
                };
                std::uint32_t node = leaf;
                bool held = holds(block);
                bool on_its_side = true;
                for (;;) {
                    held = held && holds(tree.nodes[node].pieces_box);
                    if (node == 0) {
                        break;
                    }
                    const HierarchyNode& parent = tree.nodes[tree.nodes[node].parent];
                    const bool behind = signed_distance(parent.plane, middle) < 0.0F;
                    on_its_side = on_its_side && behind == (node == parent.first_child);
                    node = tree.nodes[node].parent;
                }
                CAPTURE(object, primitive);
                REQUIRE(held);
                REQUIRE(on_its_side);
            }
        }
    }
    for (std::uint32_t object = 0; object < objects.size(); ++object) {
        if (objects[object].splittable && objects[object].primitives > 0) {
            const std::vector<int>& seen = places[object];
            REQUIRE(seen.size() == objects[object].primitives);
            REQUIRE(std::all_of(seen.begin(), seen.end(), [](int count) { return count == 1; }));
        }
    }
}

} // namespace farfield::support
