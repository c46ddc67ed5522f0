#include "cell_checks.hpp"
#include "order_checks.hpp"
#include "scenes.hpp"
#include "tree_checks.hpp"
#include "tree_hash.hpp"
#include <farfield/partition/kdtree.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace {

using namespace farfield;
using partition::build_kdtree;
using partition::KdTreeOptions;
using support::Surfaces;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Builds and demands everything that holds for any input.
Hierarchy built(const Surfaces& scene, const KdTreeOptions& options = {}) {
    auto tree = build_kdtree(scene.objects, options, scene.shape());
    INFO((tree ? std::string("built") : tree.error().message));
    REQUIRE(tree.has_value());
    support::require_valid(*tree);
    support::require_items_in_place(*tree, scene.objects);
    support::require_item_tables(*tree, scene.objects);
    support::require_image_levels(*tree, options.branching);
    support::require_surfaces_in_place(*tree, scene);
    REQUIRE(tree->clip_leaves);
    REQUIRE(tree->inflation == options.inflation);
    const std::vector<std::uint32_t> levels = support::image_levels(*tree);
    REQUIRE(*std::max_element(levels.begin(), levels.end()) <= options.max_depth);
    for (const HierarchyNode& node : tree->nodes) {
        REQUIRE((tree->nodes.size() == 1 || !is_empty(bounds(node))));
    }
    return *tree;
}

Surfaces whole_items(const std::vector<Object>& objects) {
    Surfaces scene;
    for (const Object& object : objects) {
        scene.add_whole(object);
    }
    return scene;
}

/// A square of blocks on the ground, of one size and a fifth of their distance apart.
Surfaces town(int side) {
    Surfaces scene;
    for (int z = 0; z < side; ++z) {
        for (int x = 0; x < side; ++x) {
            const glm::dvec3 lo(10.0 * x + 1.0, 0.0, 10.0 * z + 1.0);
            scene.add(support::block({lo, lo + glm::dvec3(8.0, 4.0, 8.0)}));
        }
    }
    return scene;
}

std::size_t largest_leaf(const Hierarchy& tree) {
    std::size_t most = 0;
    for (const HierarchyNode& node : tree.nodes) {
        if (is_leaf(node)) {
            most = std::max(
                most,
                static_cast<std::size_t>(
                    node.item_primitives + node.piece_primitives + node.guest_primitives
                )
            );
        }
    }
    return most;
}

} // namespace

TEST_CASE("no objects make a lone, empty root", "[kdtree]") {
    const Hierarchy tree = built({});
    CHECK(tree.nodes.size() == 1);
    CHECK(tree.quality.leaves == 1);
    CHECK(is_empty(bounds(tree.nodes[0])));
    CHECK(tree.origin == glm::dvec3(0.0));
}

TEST_CASE("one object makes one leaf", "[kdtree]") {
    Surfaces scene;
    scene.add_whole(support::cube({7.0, 8.0, 9.0}, 2.0, 1'000'000));
    const Hierarchy tree = built(scene);
    CHECK(tree.nodes.size() == 1);
    CHECK(tree.nodes[0].items_box == Box3f{glm::vec3(-1.0F), glm::vec3(1.0F)});

    Surfaces surface;
    surface.add(support::block({{0, 0, 0}, {1, 2, 3}}));
    const Hierarchy one = built(surface);
    CHECK(one.nodes.size() == 1);
    CHECK(one.guests.empty());
    CHECK(one.pieces == std::vector<Piece>{{ItemId{0}, 0, 12}});
    CHECK(one.nodes[0].pieces_box == Box3f{{-0.5F, -1.0F, -1.5F}, {0.5F, 1.0F, 1.5F}});

    Surfaces nothing;
    nothing.add({});
    CHECK(built(nothing).nodes.size() == 1);
}

TEST_CASE("all at one point: one leaf at any depth", "[kdtree]") {
    const glm::dvec3 place(1.0, 2.0, 3.0);
    Surfaces scene = whole_items(std::vector<Object>(100, support::cube(place, 0.0)));
    scene.add(std::vector<Triangle3d>(100, Triangle3d{place, place, place}));
    for (const std::uint32_t depth : {0U, 3U, 64U}) {
        CHECK(built(scene, {.max_primitives = 1, .max_depth = depth}).nodes.size() == 1);
    }
    // The same with something far off: one plane between the two, and no chain of nodes down to
    // what cannot be told apart.
    scene.add_whole(support::cube({1e6, 0.0, 0.0}, 1.0));
    const Hierarchy tree = built(scene, {.max_primitives = 1, .max_depth = 64});
    CHECK(tree.nodes.size() == 3);
    CHECK(tree.quality.depth == 1);
}

TEST_CASE("coincident triangles and boxes in boxes stop at the depth", "[kdtree]") {
    // Whatever the cell, all of them meet it: dividing cannot tell them apart.
    Surfaces scene;
    scene.add(std::vector<Triangle3d>(50, {{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}}));
    const Hierarchy tree = built(scene, {.branching = 4, .max_primitives = 10, .max_depth = 2});
    CHECK(largest_leaf(tree) == 50);
    // The half of the square that they fill, of 4 x 4 cells: 10, four of which they fill half, and
    // 3 more that they touch with their long side.
    CHECK(tree.quality.leaves <= 13);
    CHECK(tree.quality.leaves >= 10);
    std::vector<Object> nested;
    for (int index = 1; index <= 50; ++index) {
        nested.push_back(support::cube({5.0, 5.0, 5.0}, index));
    }
    CHECK(built(whole_items(nested), {.max_primitives = 1}).nodes.size() == 1);
}

TEST_CASE("four boxes in a row: every number by hand", "[kdtree]") {
    std::vector<Object> objects;
    for (const double x : {12.0, 0.0, 10.0, 2.0}) {
        objects.push_back({{{x, 0.0, 0.0}, {x + 1.0, 1.0, 1.0}}, 1, false});
    }
    // Halved at 6.5, 3.25 and 9.75, 1.625 and 11.375 (whose empty halves are not there).
    const Hierarchy tree = built(whole_items(objects), {.branching = 2, .max_primitives = 1});
    CHECK(tree.origin == glm::dvec3(6.5, 0.5, 0.5));
    CHECK(tree.items == std::vector<ItemId>{ItemId{1}, ItemId{3}, ItemId{2}, ItemId{0}});
    REQUIRE(tree.nodes.size() == 7);
    CHECK(tree.nodes[0].plane == Plane{{1.0F, 0.0F, 0.0F}, 0.0F});
    CHECK(tree.nodes[tree.nodes[0].first_child].plane == Plane{{1.0F, 0.0F, 0.0F}, -4.875F});
    CHECK(tree.nodes[tree.nodes[0].first_child + 1].plane == Plane{{1.0F, 0.0F, 0.0F}, 4.875F});
    CHECK(tree.quality.depth == 2);
    CHECK(tree.quality.leaves == 4);
    CHECK(tree.quality.cut_items == 0);

    // A branching of 4 makes two halvings one level.
    const Hierarchy wide = built(whole_items(objects), {.branching = 4, .max_primitives = 1});
    // But the second, at 3.25 and 9.75, tells nothing apart: the level has two boxes, not four.
    CHECK(support::hash_of(wide) == support::hash_of(tree));
}

TEST_CASE("the flat scene of the paper: 341 boxes", "[kdtree]") {
    // 1 + 4 + 16 + 64 + 256.
    const Hierarchy tree = built(town(16), {.branching = 4, .max_primitives = 12, .max_depth = 4});
    CHECK(support::image_nodes(tree) == 341);
    CHECK(tree.nodes.size() == 511);
    CHECK(tree.quality.leaves == 256);
    CHECK(tree.quality.depth == 8);
    CHECK(tree.guests.empty());
    // Nothing changes when more depth is allowed, as each leaf holds no more than it may.
    const Hierarchy deep = built(town(16), {.branching = 4, .max_primitives = 12, .max_depth = 9});
    CHECK(support::hash_of(tree) == support::hash_of(deep));
}

TEST_CASE("a scene that fills space: 585 boxes", "[kdtree]") {
    // 1 + 8 + 64 + 512.
    Surfaces scene;
    for (int z = 0; z < 8; ++z) {
        for (int y = 0; y < 8; ++y) {
            for (int x = 0; x < 8; ++x) {
                const glm::dvec3 lo(x + 0.2, y + 0.2, z + 0.2);
                scene.add(support::block({lo, lo + 0.6}));
            }
        }
    }
    const Hierarchy tree = built(scene, {.branching = 8, .max_primitives = 12, .max_depth = 3});
    CHECK(support::image_nodes(tree) == 585);
    CHECK(tree.quality.leaves == 512);
    CHECK(tree.quality.depth == 9);
}

TEST_CASE("empty cells make no nodes", "[kdtree]") {
    // Two blocks in opposite corners, far apart: two leaves, though their cells are many halvings
    // down; and a third beside the first, so that a chain of empty cells lies between two levels.
    Surfaces scene;
    scene.add(support::block({{0, 0, 0}, {1, 1, 1}}));
    scene.add(support::block({{999, 999, 999}, {1000, 1000, 1000}}));
    const KdTreeOptions options{.branching = 8, .max_primitives = 12, .max_depth = 12};
    const Hierarchy two = built(scene, options);
    CHECK(two.nodes.size() == 3);
    CHECK(two.nodes[1].image_level);
    scene.add(support::block({{2, 0, 0}, {3, 1, 1}}));
    const Hierarchy three = built(scene, options);
    CHECK(three.quality.leaves == 3);
    CHECK(three.nodes.size() == 5);
    CHECK(support::image_nodes(three) == 5);
}

TEST_CASE("blocks that touch are told apart, whatever their numbers", "[kdtree]") {
    // 16 x 16 blocks of a third of a metre, in all places: no coordinate is a float. Neighbours
    // touch cells and are their guests, and make no cell of their own and no larger box. Walls in
    // the plane between two of them go where rounding puts them.
    for (const double offset : {0.0, 1e7}) {
        Surfaces scene;
        for (int z = 0; z < 16; ++z) {
            for (int x = 0; x < 16; ++x) {
                const glm::dvec3 lo(x / 3.0 + offset, offset, z / 3.0 - offset);
                scene.add(support::block({lo, lo + 1.0 / 3.0}));
            }
        }
        const Hierarchy tree = built(scene, {.branching = 4, .max_primitives = 1, .max_depth = 4});
        CHECK(tree.quality.leaves == 256);
        for (const HierarchyNode& node : tree.nodes) {
            if (is_leaf(node)) {
                // To within the rounding at 1e7, and what counts as touching.
                CHECK(extent(node.pieces_box).x == Approx(1.0 / 3.0).margin(1e-5));
                CHECK(extent(node.pieces_box).z == Approx(1.0 / 3.0).margin(1e-5));
                CHECK(node.guest_count > 0);
            }
        }
    }
}

TEST_CASE("walls in a plane have one side", "[kdtree]") {
    // One in the plane that halves the scene, and two boxes to its sides.
    Surfaces scene;
    scene.add({{{{0, 0, -1}, {0, 1, -1}, {0, 0, 1}}}, {{{0, 1, -1}, {0, 1, 1}, {0, 0, 1}}}});
    scene.add_whole({{{-8, 0, -1}, {-6, 1, 1}}, 1, false});
    scene.add_whole({{{6, 0, -1}, {8, 1, 1}}, 1, false});
    const Hierarchy tree =
        built(scene, {.branching = 2, .max_primitives = 3, .max_depth = 1, .inflation = 0.0F});
    REQUIRE(tree.nodes.size() == 3);
    CHECK(tree.nodes[1].piece_primitives == 0);
    // It touches the cell behind, of which nothing else is surface: no guest there.
    CHECK(tree.nodes[1].guest_primitives == 0);
    CHECK(tree.nodes[2].piece_primitives == 2);
}

TEST_CASE("a primitive is at home in a cell that it meets", "[kdtree]") {
    // The centre of this triangle's box, (0.5, 0.5, 0.5), is in a cell that the triangle does not
    // reach when cells are halves of a cube of 2 (its plane is x + y + z = 1).
    Surfaces scene;
    scene.add({{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}});
    scene.add_whole(support::cube({0.05, 0.05, 0.05}, 0.1));
    scene.add_whole(support::cube({0.95, 0.95, 0.95}, 0.1));
    const Hierarchy tree =
        built(scene, {.branching = 8, .max_primitives = 1, .max_depth = 1, .inflation = 0.0F});
    for (const HierarchyNode& node : tree.nodes) {
        if (is_leaf(node) && node.piece_count > 0) {
            // The lowest of the eight.
            CHECK(node.pieces_box.hi == glm::vec3(0.0F));
        }
    }
}

TEST_CASE("cells are near cubes after the first cuts", "[kdtree]") {
    support::Random random(7);
    for (const glm::dvec3& stretch :
         {glm::dvec3(1, 1, 1), glm::dvec3(30, 1, 1), glm::dvec3(7, 3, 50)}) {
        Surfaces scene;
        std::vector<Triangle3d> triangles = support::random_triangles(2000, 1.0, 0.02, random);
        for (Triangle3d& triangle : triangles) {
            for (glm::dvec3& corner : triangle) {
                corner *= stretch;
            }
        }
        scene.add(std::move(triangles));
        auto found = build_kdtree(scene.objects, {.max_primitives = 8}, scene.shape());
        REQUIRE(found.has_value());
        const Hierarchy& tree = *found;
        const std::vector<Box3f> cells =
            support::cells_of(tree, support::contents_box(scene, tree));
        const glm::vec3 whole = extent(cells[0]);
        const float thinnest = std::min(whole.x, std::min(whole.y, whole.z));
        std::size_t halved = 0;
        for (std::size_t node = 0; node < cells.size(); ++node) {
            if (is_leaf(tree.nodes[node])) {
                continue;
            }
            const glm::vec3 sides = extent(support::halved_cell(tree.nodes[node], cells[node]));
            const float longest = std::max(sides.x, std::max(sides.y, sides.z));
            const float shortest = std::min(sides.x, std::min(sides.y, sides.z));
            // Cells longer than twice the scene's thickness are still being cut to length.
            if (longest <= 2.0F * thinnest) {
                CAPTURE(node, longest, shortest);
                CHECK(longest <= 2.0F * shortest * (1.0F + 1e-5F));
                ++halved;
            }
        }
        CHECK(halved > 100);
    }
}

TEST_CASE("guests are exactly those of a brute force over all pairs", "[kdtree]") {
    // Dense enough that no cell is empty, so that the planes tell the cells of all leaves.
    support::Random random(8);
    for (const float inflation : {0.0F, 0.02F, 0.5F, 1.0F}) {
        Surfaces scene;
        scene.add(support::random_triangles(3000, 10.0, 3.0, random));
        scene.add(support::random_triangles(1000, 10.0, 12.0, random));
        const KdTreeOptions options{
            .branching = 4, .max_primitives = 1, .max_depth = 3, .inflation = inflation};
        const Hierarchy tree = built(scene, options);
        CHECK(tree.quality.leaves == 64);
        const std::vector<Box3f> cells =
            support::cells_of(tree, support::contents_box(scene, tree));
        std::size_t guests_seen = 0;
        std::size_t box_hits = 0;
        for (std::size_t index = 0; index < cells.size(); ++index) {
            const HierarchyNode& node = tree.nodes[index];
            if (!is_leaf(node)) {
                continue;
            }
            // As the builder enlarges: by the half of it on each side, then to the next float.
            Box3f wide = inflate(cells[index], extent(cells[index]) * (0.5F * inflation));
            for (int axis = 0; axis < 3; ++axis) {
                wide.lo[axis] = std::nextafter(wide.lo[axis], -INFINITY);
                wide.hi[axis] = std::nextafter(wide.hi[axis], INFINITY);
            }
            const Box3d cell{glm::dvec3(wide.lo), glm::dvec3(wide.hi)};
            support::Members expected;
            for (std::uint32_t object = 0; object < 2; ++object) {
                for (std::uint32_t primitive = 0; primitive < scene.triangles[object].size();
                     ++primitive) {
                    const Triangle3d triangle =
                        support::local_triangle(scene.triangles[object][primitive], tree.origin);
                    box_hits += is_empty(intersect(cell, bounds(triangle))) ? 0 : 1;
                    if (overlaps(cell, triangle)) {
                        expected.insert({object, primitive});
                    }
                }
            }
            support::Members found = support::homes_of(tree, node);
            const support::Members guests = support::guests_of(tree, node);
            guests_seen += guests.size();
            found.insert(guests.begin(), guests.end());
            REQUIRE(found == expected);
        }
        CHECK(guests_seen > 1000);
        CHECK(box_hits > guests_seen + 4000); // boxes alone would say more
    }
}

TEST_CASE("every point of a surface is inside the clipped box of a leaf that has it", "[kdtree]") {
    support::Random random(9);
    Surfaces scene;
    scene.add(support::random_triangles(300, 10.0, 8.0, random));
    const Hierarchy tree = built(scene, {.max_primitives = 20, .max_depth = 3});
    struct Leaf {
        Box3d box;
        support::Members members;
    };
    std::vector<Leaf> leaves;
    for (const HierarchyNode& node : tree.nodes) {
        if (is_leaf(node)) {
            Leaf leaf{
                {glm::dvec3(node.pieces_box.lo), glm::dvec3(node.pieces_box.hi)},
                support::homes_of(tree, node)};
            const support::Members guests = support::guests_of(tree, node);
            leaf.members.insert(guests.begin(), guests.end());
            leaves.push_back(std::move(leaf));
        }
    }
    for (std::uint32_t primitive = 0; primitive < 300; ++primitive) {
        const Triangle3d triangle =
            support::local_triangle(scene.triangles[0][primitive], tree.origin);
        for (int sample = 0; sample < 50; ++sample) {
            const double u = random.uniform(0.0, 1.0);
            const double v = random.uniform(0.0, 1.0 - u);
            const glm::dvec3 point =
                triangle[0] + (triangle[1] - triangle[0]) * u + (triangle[2] - triangle[0]) * v;
            // The touching distance of a scene of 14 m, 2^-22 of it, and rounding far below that.
            constexpr double kTouch = 5e-6;
            REQUIRE(std::any_of(leaves.begin(), leaves.end(), [&](const Leaf& leaf) {
                return leaf.members.count({0, primitive}) > 0 &&
                       contains(inflate(leaf.box, glm::dvec3(kTouch)), point);
            }));
        }
    }
}

TEST_CASE("clipped leaves and uncut items are met in the reverse order of drawing", "[kdtree]") {
    // Clipped boxes lie exactly on the sides of planes across the axes, and so do uncut items with
    // numbers that float has.
    support::Random random(10);
    for (const std::uint32_t branching : {2U, 8U}) {
        Surfaces scene;
        scene.add(support::random_triangles(2000, 40.0, 6.0, random));
        for (int index = 0; index < 300; ++index) {
            const glm::dvec3 lo = glm::floor(random.vector(-40.0, 40.0) * 16.0) / 16.0;
            const glm::dvec3 edges = glm::floor(glm::abs(random.vector(-4.0, 4.0)) * 16.0) / 16.0;
            scene.add_whole({{lo, lo + edges}, 10, false});
        }
        const Hierarchy tree = built(scene, {.branching = branching, .max_primitives = 60});
        const std::vector<bool> cut = support::require_items_in_place(tree, scene.objects);
        const std::vector<std::uint32_t> leaves =
            support::leaf_of_items(tree, scene.objects.size());
        std::vector<support::Placed> placed;
        for (std::uint32_t node = 0; node < tree.nodes.size(); ++node) {
            const Box3f& box = tree.nodes[node].pieces_box;
            if (is_leaf(tree.nodes[node]) && !is_empty(box)) {
                placed.push_back({{glm::dvec3(box.lo), glm::dvec3(box.hi)}, node});
            }
        }
        for (std::size_t index = 0; index < scene.objects.size(); ++index) {
            if (!scene.objects[index].splittable && !cut[index]) {
                const Box3d& box = scene.objects[index].bounds;
                // The origin is none of those numbers: the float box is what lies on its side.
                const glm::vec3 lo = local_point(box.lo, tree.origin);
                const glm::vec3 hi = local_point(box.hi, tree.origin);
                placed.push_back({{glm::dvec3(lo), glm::dvec3(hi)}, leaves[index]});
            }
        }
        const support::Tally tally = support::shoot(tree, placed, random);
        CAPTURE(branching, tree.quality.cut_items, tally.pairs);
        CHECK(tally.wrong == 0);
        CHECK(tally.pairs > 5000);
    }
}

TEST_CASE("items share a leaf up to max_primitives, and one alone is not divided for", "[kdtree]") {
    const std::vector<Object> objects = support::random_boxes(1000, 11);
    const Surfaces scene = whole_items(objects);
    const Hierarchy tree = built(scene, {.max_primitives = 3000, .max_depth = 20});
    CHECK(largest_leaf(tree) <= 3000);
    CHECK(tree.quality.leaves < 1000);
    // Each has more than that: leaves of one item, and no deeper.
    const Hierarchy single = built(scene, {.max_primitives = 1, .max_depth = 20});
    for (const HierarchyNode& node : single.nodes) {
        REQUIRE((!is_leaf(node) || node.item_count == 1));
    }

    // A tree far heavier than max_primitives on ground that is light: the ground stays whole.
    Surfaces island;
    island.add(support::block({{-100, -1, -100}, {100, 0, 100}}));
    island.add_whole({{{-5, 0, -5}, {5, 14, 5}}, 36'230, false});
    CHECK(built(island, {.max_primitives = 100}).nodes.size() == 1);
}

TEST_CASE("the depth is limited", "[kdtree]") {
    support::Random random(12);
    Surfaces scene;
    scene.add(support::random_triangles(1000, 10.0, 0.1, random));
    CHECK(built(scene, {.max_primitives = 1, .max_depth = 0}).nodes.size() == 1);
    for (const std::uint32_t branching : {2U, 4U, 8U}) {
        const Hierarchy tree =
            built(scene, {.branching = branching, .max_primitives = 1, .max_depth = 2});
        CHECK(tree.quality.leaves == branching * branching);
    }
}

TEST_CASE("copies are limited where dividing only multiplies", "[kdtree]") {
    // Triangles as large as the scene: each of 8^4 cells would have thousands of them.
    support::Random random(13);
    Surfaces scene;
    scene.add(support::random_triangles(10'000, 1.0, 20.0, random));
    const auto copies = [&](std::uint32_t max_copies) {
        const auto tree = build_kdtree(
            scene.objects,
            {.max_primitives = 10, .max_depth = 4, .max_copies = max_copies},
            scene.shape()
        );
        REQUIRE(tree.has_value());
        support::require_valid(*tree);
        return tree->nodes[0].piece_primitives + tree->nodes[0].guest_primitives;
    };
    // One copy each is 10,000, fewer than the 65,536 that are free.
    CHECK(copies(1) <= 65'536);
    const std::uint64_t some = copies(8);
    CHECK(some <= 80'000);
    CHECK(some > 10'000);
    CHECK(copies(64) > some);
}

TEST_CASE("boxes for triangles: the same pieces, and guests that are not fewer", "[kdtree]") {
    // Points, whose centroids are the centres of their boxes, beside blocks whose boxes lie on
    // their faces: nothing depends on which of the two is told.
    Surfaces scene = town(8);
    const KdTreeOptions options{.branching = 4, .max_primitives = 12, .max_depth = 3};
    const auto by_boxes = build_kdtree(scene.objects, options, scene.boxes());
    REQUIRE(by_boxes.has_value());
    CHECK(support::structure_of(*by_boxes) == support::structure_of(built(scene, options)));

    // Oblique ones: each triangle's guests are among those of its box.
    support::Random random(14);
    Surfaces oblique;
    oblique.add(support::random_triangles(500, 10.0, 6.0, random));
    const KdTreeOptions deep{.branching = 8, .max_primitives = 1, .max_depth = 2};
    const auto boxes = build_kdtree(oblique.objects, deep, oblique.boxes());
    REQUIRE(boxes.has_value());
    support::require_valid(*boxes);
    support::require_pieces_in_block_boxes(*boxes, oblique.boxes());
    const Hierarchy triangles = built(oblique, deep);
    REQUIRE(boxes->quality.leaves == 64);
    REQUIRE(triangles.quality.leaves == 64);
    CHECK(boxes->nodes[0].guest_primitives > triangles.nodes[0].guest_primitives);
    for (std::size_t node = 0; node < triangles.nodes.size(); ++node) {
        if (!is_leaf(triangles.nodes[node])) {
            continue;
        }
        support::Members of_boxes = support::homes_of(*boxes, boxes->nodes[node]);
        of_boxes.merge(support::guests_of(*boxes, boxes->nodes[node]));
        support::Members of_triangles = support::homes_of(triangles, triangles.nodes[node]);
        of_triangles.merge(support::guests_of(triangles, triangles.nodes[node]));
        CHECK(std::includes(
            of_boxes.begin(), of_boxes.end(), of_triangles.begin(), of_triangles.end()
        ));
    }
}

TEST_CASE("blocks and nodes hold pieces whole where they are drawn whole", "[kdtree]") {
    support::Random random(15);
    Surfaces scene;
    scene.add(support::random_triangles(700, 10.0, 6.0, random));
    scene.add(support::random_triangles(70, 10.0, 6.0, random));
    const Hierarchy tree = built(scene, {.max_primitives = 50});
    support::require_pieces_in_block_boxes(tree, scene.boxes());
    CHECK(tree.quality.split_objects == 2);
}

TEST_CASE("a scene at 1e7 m is divided as one at zero", "[kdtree]") {
    // Multiples of 1/64 m: exact in double at 1e7, so that both scenes are the same one. Centroids
    // are not, but none of these falls on a plane.
    support::Random random(16);
    Surfaces scene;
    std::vector<Triangle3d> triangles = support::random_triangles(1000, 50.0, 9.0, random);
    for (Triangle3d& triangle : triangles) {
        for (glm::dvec3& corner : triangle) {
            corner = glm::floor(corner * 64.0) / 64.0;
        }
    }
    scene.add(std::move(triangles));
    scene.add_whole({{{1, 2, 3}, {4, 5, 6}}, 7, false});
    const KdTreeOptions options{.max_primitives = 30};
    Hierarchy here = built(scene, options);
    const glm::dvec3 offset(1e7, -1e7, 1e7);
    scene.transform(1.0, offset);
    const Hierarchy there = built(scene, options);
    CHECK(there.origin == here.origin + offset);
    here.origin = there.origin;
    CHECK(support::hash_of(here) == support::hash_of(there));
}

TEST_CASE("scale changes nothing but the numbers", "[kdtree]") {
    support::Random random(17);
    Surfaces scene;
    scene.add(support::random_triangles(1000, 50.0, 9.0, random));
    scene.add_whole({{{1, 2, 3}, {4, 5, 6}}, 7, false});
    const KdTreeOptions options{.max_primitives = 30};
    const auto structure = support::structure_of(built(scene, options));
    for (const double scale : {1e-3, 0.25, 1e3}) {
        Surfaces scaled = scene;
        scaled.transform(scale, glm::dvec3(0.0));
        CHECK(support::structure_of(built(scaled, options)) == structure);
    }
}

TEST_CASE("sizes from 1e-30 to 1e30", "[kdtree]") {
    Surfaces scene;
    std::vector<Triangle3d> triangles;
    for (int exponent = -30; exponent <= 30; ++exponent) {
        const double size = std::pow(10.0, exponent);
        scene.add_whole({{{size, size, size}, {2 * size, 2 * size, 2 * size}}, 1, false});
        triangles.push_back({{{size, 0, 0}, {0, -size, size}, {size, size, size}}});
    }
    scene.add(std::move(triangles));
    built(scene, {.max_primitives = 1, .max_depth = 64});
    Surfaces largest;
    largest.add_whole({{{-1e36, -1e36, -1e36}, {-1e36, 1e36, 1e36}}, 1, false});
    largest.add_whole({{{1e36, -1e36, -1e36}, {1e36, 1e36, 1e36}}, 1, false});
    largest.add({{{{-1e36, 0, 0}, {1e36, 0, 0}, {0, 1e36, 0}}}});
    CHECK(built(largest, {.max_primitives = 1, .max_depth = 1}).quality.leaves >= 2);
}

TEST_CASE("the same tree on every run", "[kdtree]") {
    support::Random random(18);
    Surfaces scene;
    scene.add(support::random_triangles(500, 10.0, 3.0, random));
    const auto hash = support::hash_of(built(scene, {.max_primitives = 20}));
    CHECK(hash == support::hash_of(built(scene, {.max_primitives = 20})));
    CHECK(hash != support::hash_of(built(scene, {.max_primitives = 19})));
}

TEST_CASE("random scenes under random options", "[kdtree]") {
    support::Random random(19);
    for (int round = 0; round < 200; ++round) {
        KdTreeOptions options;
        options.branching = 2U << random.below(3);
        options.max_primitives = 1 + random.below(30);
        options.max_depth = random.below(7);
        options.inflation = static_cast<float>(random.uniform(0.0, 1.0));
        options.max_copies = 1 + random.below(20);
        CAPTURE(round, options.branching, options.max_primitives, options.max_depth);
        // Snapping to a coarse grid makes triangles that touch planes, coincide and vanish.
        const double grid = random.below(2) == 0 ? 4.0 : 1e-3;
        const glm::dvec3 offset = random.below(2) == 0 ? glm::dvec3(0.0) : random.vector(-1e7, 1e7);
        const auto point = [&](const glm::dvec3& around, double reach) {
            return glm::floor((around + random.vector(-reach, reach)) / grid) * grid;
        };
        Surfaces scene;
        const unsigned count = random.below(20);
        for (unsigned index = 0; index < count; ++index) {
            if (random.below(2) == 0) {
                const glm::dvec3 lo = point(glm::dvec3(0.0), 50.0);
                const glm::dvec3 hi = glm::max(lo, point(lo, 10.0));
                scene.add_whole({{lo + offset, hi + offset}, random.below(40), false});
                continue;
            }
            std::vector<Triangle3d> triangles(random.below(30));
            for (Triangle3d& triangle : triangles) {
                const glm::dvec3 around = random.vector(-50.0, 50.0);
                for (glm::dvec3& corner : triangle) {
                    corner = point(around, 15.0) + offset;
                }
            }
            scene.add(std::move(triangles));
        }
        built(scene, options);
    }
}

TEST_CASE("every option has a default", "[kdtree]") {
    // Compiled with warnings as errors: a field without a default would not pass.
    CHECK(KdTreeOptions{.branching = 4}.max_depth == 8);
    CHECK(KdTreeOptions{.max_primitives = 4}.branching == 8);
    CHECK(KdTreeOptions{.max_depth = 4}.branching == 8);
    CHECK(KdTreeOptions{.inflation = 0.5F}.branching == 8);
    CHECK(KdTreeOptions{.max_copies = 4}.branching == 8);
}

TEST_CASE("options out of range are named with their value", "[kdtree]") {
    struct Case {
        KdTreeOptions options;
        const char* message;
    };
    const std::vector<Case> cases{
        {{.branching = 0}, "KdTreeOptions: branching is 0"},
        {{.branching = 3}, "branching is 3"},
        {{.branching = 16}, "branching is 16"},
        {{.max_primitives = 0}, "max_primitives is 0"},
        {{.max_depth = 65}, "max_depth is 65"},
        {{.inflation = -0.1F}, "inflation is -0.1"},
        {{.inflation = 1.5F}, "inflation is 1.5"},
        {{.inflation = std::nanf("")}, "inflation is nan"},
        {{.max_copies = 0}, "max_copies is 0"},
        {{.max_copies = 1025}, "max_copies is 1025"}};
    for (const Case& wrong : cases) {
        const auto tree = build_kdtree({}, wrong.options);
        CAPTURE(wrong.message);
        REQUIRE_FALSE(tree.has_value());
        CHECK(tree.error().code == ErrorCode::invalid_argument);
        CHECK_THAT(tree.error().message, Catch::Contains(wrong.message));
    }
}

TEST_CASE("objects and primitives that cannot be placed are named", "[kdtree]") {
    const Box3d fine{{0, 0, 0}, {1, 1, 1}};
    struct Case {
        Object object;
        ErrorCode code;
        const char* message;
    };
    const std::vector<Case> cases{
        {{{{kNaN, 0, 0}, {1, 1, 1}}}, ErrorCode::bad_data, "object 1: bounds: lo.x is nan"},
        {{{{0, 5, 0}, {1, 4, 1}}}, ErrorCode::bad_data, "object 1: bounds: inverted, lo.y is 5"},
        {{fine, 5, true}, ErrorCode::invalid_argument, "object 1: splittable is true"}};
    for (const Case& wrong : cases) {
        const std::vector<Object> objects{{fine, 1, false}, wrong.object};
        const auto tree = build_kdtree(objects);
        CAPTURE(wrong.message);
        REQUIRE_FALSE(tree.has_value());
        CHECK(tree.error().code == wrong.code);
        CHECK_THAT(tree.error().message, Catch::Contains(wrong.message));
    }
    const std::vector<Object> objects{{fine, 1, false}, {fine, 5, true}};
    const auto no_triangles = build_kdtree(objects, {}, PrimitiveTriangle());
    REQUIRE_FALSE(no_triangles.has_value());
    CHECK_THAT(no_triangles.error().message, Catch::Contains("object 1: splittable is true"));
    for (const double value : {kNaN, kInfinity, -2e36}) {
        const auto tree =
            build_kdtree(objects, {}, [&](std::uint32_t, std::uint32_t primitive) -> Triangle3d {
                return {glm::dvec3(0.0), glm::dvec3(0.0, primitive == 3 ? value : 0.0, 0.0), {}};
            });
        REQUIRE_FALSE(tree.has_value());
        CHECK(tree.error().code == ErrorCode::bad_data);
        CHECK_THAT(tree.error().message, Catch::Contains("object 1: primitive 3: corner 1: y is "));
    }
    const auto boxes = build_kdtree(objects, {}, [&](std::uint32_t, std::uint32_t primitive) {
        return Box3d{{0, 0, primitive == 2 ? 2.0 : 0.0}, {1, 1, 1}};
    });
    REQUIRE_FALSE(boxes.has_value());
    CHECK_THAT(
        boxes.error().message, Catch::Contains("object 1: primitive 2: bounds: inverted, lo.z is 2")
    );
}
