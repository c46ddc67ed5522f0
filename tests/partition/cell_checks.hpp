#pragma once

#include "../support/random.hpp"
#include "tree_checks.hpp"
#include <farfield/math/triangle_box.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <span>
#include <utility>
#include <vector>

/// What the tests of k-d trees and octrees share: surfaces of triangles, cells found anew from the
/// planes, and everything that holds for any input.
namespace farfield::support {

/// Splittable objects of triangles, and whole ones.
struct Surfaces {
    std::vector<Object> objects;
    std::vector<std::vector<Triangle3d>> triangles; ///< by object; none for whole ones

    void add_whole(const Object& object) {
        objects.push_back(object);
        triangles.emplace_back();
    }

    void add(std::vector<Triangle3d> surface) {
        Object object;
        object.primitives = surface.size();
        object.splittable = true;
        object.bounds = surface.empty() ? Box3d{glm::dvec3(0.0), glm::dvec3(0.0)} : Box3d{};
        for (const Triangle3d& triangle : surface) {
            object.bounds = unite(object.bounds, bounds(triangle));
        }
        objects.push_back(object);
        triangles.push_back(std::move(surface));
    }

    [[nodiscard]] PrimitiveTriangle shape() const {
        return [this](std::uint32_t object, std::uint32_t primitive) {
            return triangles[object][primitive];
        };
    }

    [[nodiscard]] PrimitiveBounds boxes() const {
        return [this](std::uint32_t object, std::uint32_t primitive) {
            return bounds(triangles[object][primitive]);
        };
    }

    void transform(double scale, const glm::dvec3& offset) {
        for (std::size_t object = 0; object < objects.size(); ++object) {
            Box3d& box = objects[object].bounds;
            box = {box.lo * scale + offset, box.hi * scale + offset};
            for (Triangle3d& triangle : triangles[object]) {
                for (glm::dvec3& corner : triangle) {
                    corner = corner * scale + offset;
                }
            }
        }
    }
};

/// The twelve triangles of a box.
inline std::vector<Triangle3d> block(const Box3d& box) {
    constexpr unsigned kFaces[6][4] = {
        {0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    std::vector<Triangle3d> triangles;
    for (const auto& face : kFaces) {
        triangles.push_back({corner(box, face[0]), corner(box, face[1]), corner(box, face[2])});
        triangles.push_back({corner(box, face[0]), corner(box, face[2]), corner(box, face[3])});
    }
    return triangles;
}

/// Triangles of edges up to `size` anywhere in the cube of `reach`; every eighth is a sliver, a
/// segment or a point.
inline std::vector<Triangle3d>
random_triangles(std::size_t count, double reach, double size, Random& random) {
    std::vector<Triangle3d> triangles;
    for (std::size_t index = 0; index < count; ++index) {
        const glm::dvec3 middle = random.vector(-reach, reach);
        Triangle3d triangle;
        for (glm::dvec3& corner : triangle) {
            corner = middle + random.vector(-0.5 * size, 0.5 * size);
        }
        if (index % 8 == 0) {
            triangle[2] = index % 3 == 0 ? triangle[0] : (triangle[0] + triangle[1]) * 0.5;
            triangle[1] = index % 5 == 0 ? triangle[0] : triangle[1];
        }
        triangles.push_back(triangle);
    }
    return triangles;
}

inline Triangle3d local_triangle(const Triangle3d& world, const glm::dvec3& origin) {
    return {world[0] - origin, world[1] - origin, world[2] - origin};
}

/// Cells by node, from the planes of the tree alone. Where empty cells were left out, those here
/// are larger than the builder's.
inline std::vector<Box3f> cells_of(const Hierarchy& tree, const Box3f& root) {
    std::vector<Box3f> cells(tree.nodes.size());
    cells[0] = root;
    for (std::size_t index = 0; index < tree.nodes.size(); ++index) {
        const HierarchyNode& node = tree.nodes[index];
        if (is_leaf(node)) {
            continue;
        }
        int axis = 0;
        while (node.plane.normal[axis] == 0.0F) {
            ++axis;
        }
        cells[node.first_child] = cells[index];
        cells[node.first_child].hi[axis] = node.plane.offset;
        cells[node.first_child + 1] = cells[index];
        cells[node.first_child + 1].lo[axis] = node.plane.offset;
    }
    return cells;
}

/// The cell that an interior node of a k-d tree really halves: empty halves, which the planes do
/// not tell of, cut off by the rule. Fails where the node's plane is none that the rule can give.
inline Box3f halved_cell(const HierarchyNode& node, Box3f cell) {
    for (int cut = 0; cut < 200; ++cut) {
        const glm::vec3 sides = extent(cell);
        int axis = 0;
        for (int other = 1; other < 3; ++other) {
            axis = sides[other] > sides[axis] ? other : axis;
        }
        const float middle = cell.lo[axis] * 0.5F + cell.hi[axis] * 0.5F;
        if (node.plane.normal[axis] == 1.0F && node.plane.offset == middle) {
            return cell;
        }
        const Box3f contents = bounds(node);
        const bool behind = contents.lo[axis] + contents.hi[axis] < 2.0F * middle;
        (behind ? cell.hi : cell.lo)[axis] = middle;
    }
    FAIL("no halving gives the plane");
    return cell;
}

/// Box around all contents, as the root cell of a k-d tree.
inline Box3f contents_box(const Surfaces& scene, const Hierarchy& tree) {
    Box3f box;
    for (std::size_t object = 0; object < scene.objects.size(); ++object) {
        if (!scene.objects[object].splittable) {
            const Box3d& bounds = scene.objects[object].bounds;
            box = unite(box, local_point(bounds.lo, tree.origin));
            box = unite(box, local_point(bounds.hi, tree.origin));
        }
        for (const Triangle3d& triangle : scene.triangles[object]) {
            box = unite(box, local_box(bounds(triangle), tree.origin));
        }
    }
    return box;
}

/// A cell as guests see it, widened once more by two units in the last place.
inline Box3d enlarged_cell(const Box3f& cell, float inflation) {
    const glm::dvec3 lo(cell.lo);
    const glm::dvec3 hi(cell.hi);
    const glm::dvec3 margin = (hi - lo) * (0.5 * static_cast<double>(inflation)) +
                              glm::max(glm::abs(lo), glm::abs(hi)) * 2.4e-7;
    return {lo - margin, hi + margin};
}

/// Primitives of a leaf, as (object, primitive).
using Members = std::set<std::pair<std::uint32_t, std::uint32_t>>;

inline Members members_of(const Hierarchy& tree, std::span<const Piece> runs) {
    Members members;
    for (const Piece& run : runs) {
        for (std::uint32_t offset = 0; offset < run.count; ++offset) {
            const bool fresh =
                members
                    .insert(
                        {static_cast<std::uint32_t>(run.item), tree.primitives[run.first + offset]}
                    )
                    .second;
            REQUIRE(fresh);
        }
    }
    return members;
}

inline Members homes_of(const Hierarchy& tree, const HierarchyNode& node) {
    return members_of(tree, std::span(tree.pieces).subspan(node.first_piece, node.piece_count));
}

inline Members guests_of(const Hierarchy& tree, const HierarchyNode& node) {
    return members_of(tree, std::span(tree.guests).subspan(node.first_guest, node.guest_count));
}

/// Levels of images above a node.
inline std::vector<std::uint32_t> image_levels(const Hierarchy& tree) {
    std::vector<std::uint32_t> levels(tree.nodes.size(), 0);
    for (std::size_t node = 1; node < levels.size(); ++node) {
        levels[node] = levels[tree.nodes[node].parent] + (tree.nodes[node].image_level ? 1 : 0);
    }
    return levels;
}

inline std::size_t image_nodes(const Hierarchy& tree) {
    return static_cast<std::size_t>(std::count_if(
        tree.nodes.begin(),
        tree.nodes.end(),
        [](const HierarchyNode& node) { return node.image_level; }
    ));
}

/// Every image has two images below it at least and `branching` at most, and those in between are
/// not levels themselves.
inline void require_image_levels(const Hierarchy& tree, std::uint32_t branching) {
    std::vector<std::uint32_t> below(tree.nodes.size(), 0);
    for (std::size_t node = 1; node < tree.nodes.size(); ++node) {
        if (!tree.nodes[node].image_level) {
            REQUIRE_FALSE(is_leaf(tree.nodes[node]));
            continue;
        }
        std::uint32_t above = tree.nodes[node].parent;
        while (!tree.nodes[above].image_level) {
            above = tree.nodes[above].parent;
        }
        ++below[above];
    }
    for (std::size_t node = 0; node < tree.nodes.size(); ++node) {
        if (tree.nodes[node].image_level && !is_leaf(tree.nodes[node])) {
            CAPTURE(node, below[node]);
            REQUIRE(below[node] >= 2);
            REQUIRE(below[node] <= branching);
        }
    }
}

/// All that holds for any scene of triangles: each at home once and a guest wherever it reaches
/// into a cell, boxes that hold what is inside the cells.
inline void require_surfaces_in_place(const Hierarchy& tree, const Surfaces& scene) {
    const std::vector<Box3f> cells = cells_of(tree, contents_box(scene, tree));
    // What the builder takes for touching, and as much for the outward rounding of boxes here.
    double touch = 0.0;
    for (int axis = 0; axis < 3 && !is_empty(cells[0]); ++axis) {
        touch = std::max(
            touch, static_cast<double>(std::max(-cells[0].lo[axis], cells[0].hi[axis])) * 0x1p-21
        );
    }
    struct Primitive {
        std::uint32_t object = 0;
        std::uint32_t number = 0;
        Triangle3d triangle;
        Box3d box;
    };
    std::vector<Primitive> primitives;
    for (std::uint32_t object = 0; object < scene.objects.size(); ++object) {
        for (std::uint32_t number = 0; number < scene.triangles[object].size(); ++number) {
            const Triangle3d triangle =
                local_triangle(scene.triangles[object][number], tree.origin);
            primitives.push_back({object, number, triangle, bounds(triangle)});
        }
    }
    Members homes;
    for (std::size_t index = 0; index < tree.nodes.size(); ++index) {
        const HierarchyNode& node = tree.nodes[index];
        if (!is_leaf(node)) {
            continue;
        }
        CAPTURE(index);
        const Members own = homes_of(tree, node);
        const Members guests = guests_of(tree, node);
        const Box3d cell{glm::dvec3(cells[index].lo), glm::dvec3(cells[index].hi)};
        const Box3d wide = enlarged_cell(cells[index], tree.inflation);
        const Box3d inner{cell.lo + touch, cell.hi - touch};
        // Homes and guests are looked for among what is near; then there are no others.
        std::size_t homes_here = 0;
        std::size_t guests_here = 0;
        for (const Primitive& primitive : primitives) {
            const Triangle3d& triangle = primitive.triangle;
            if (is_empty(intersect(primitive.box, wide))) {
                continue;
            }
            const bool home = own.count({primitive.object, primitive.number}) > 0;
            const bool guest = guests.count({primitive.object, primitive.number}) > 0;
            CAPTURE(primitive.object, primitive.number, home, guest);
            homes_here += home ? 1 : 0;
            guests_here += guest ? 1 : 0;
            REQUIRE_FALSE((home && guest));
            if (home) {
                REQUIRE(homes.insert({primitive.object, primitive.number}).second);
                const glm::dvec3 middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
                REQUIRE(contains(inflate(cell, glm::dvec3(touch)), middle));
            }
            if (guest) {
                REQUIRE(overlaps(wide, triangle));
            }
            if (is_empty(inner) || !overlaps(inner, triangle)) {
                continue;
            }
            REQUIRE((home || guest));
            const Box3d inside = clipped_bounds(inner, triangle);
            const Box3d pieces{glm::dvec3(node.pieces_box.lo), glm::dvec3(node.pieces_box.hi)};
            // Clipping rounds by 1e-15 of the triangle; the box is rounded outwards in float. What
            // only touches a half that was left out is not in the box.
            if (!is_empty(inside)) {
                const glm::dvec3 slack(touch + 1e-14 * glm::length(extent(primitive.box)));
                REQUIRE(contains(inflate(pieces, slack), inside.lo));
                REQUIRE(contains(inflate(pieces, slack), inside.hi));
            }
        }
        REQUIRE(homes_here == own.size());
        REQUIRE(guests_here == guests.size());
        if (!is_empty(node.pieces_box)) {
            REQUIRE(contains(cells[index], node.pieces_box.lo));
            REQUIRE(contains(cells[index], node.pieces_box.hi));
        }
    }
    REQUIRE(homes.size() == primitives.size());
}

/// Each primitive's box held by that of its block, and by those around whole pieces of the nodes
/// above it.
inline void require_pieces_in_block_boxes(const Hierarchy& tree, const PrimitiveBounds& bounds_of) {
    for (std::uint32_t leaf = 0; leaf < tree.nodes.size(); ++leaf) {
        if (!is_leaf(tree.nodes[leaf])) {
            continue;
        }
        for (std::uint32_t index = 0; index < tree.nodes[leaf].piece_count; ++index) {
            const Piece& piece = tree.pieces[tree.nodes[leaf].first_piece + index];
            for (std::uint32_t place = piece.first; place < piece.first + piece.count; ++place) {
                const Box3d world =
                    bounds_of(static_cast<std::uint32_t>(piece.item), tree.primitives[place]);
                const Box3d box{world.lo - tree.origin, world.hi - tree.origin};
                const auto holds = [&](const Box3f& outer) {
                    const Box3d wide{glm::dvec3(outer.lo), glm::dvec3(outer.hi)};
                    return contains(wide, box.lo) && contains(wide, box.hi);
                };
                REQUIRE(holds(tree.block_boxes.at(place / Hierarchy::kBlockPrimitives)));
                for (std::uint32_t node = leaf; node != 0; node = tree.nodes[node].parent) {
                    REQUIRE(holds(whole_pieces_box(tree, node)));
                }
                REQUIRE(holds(whole_pieces_box(tree, 0)));
            }
        }
    }
}

} // namespace farfield::support
