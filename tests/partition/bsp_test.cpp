#include "scenes.hpp"
#include "tree_checks.hpp"
#include "tree_hash.hpp"
#include <farfield/partition/bsp.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace {

using namespace farfield;
using partition::BspOptions;
using partition::build_bsp;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Builds and demands everything that holds for any input.
Hierarchy built(
    std::span<const Object> objects,
    const BspOptions& options = {},
    const PrimitiveBounds& primitive_bounds = {}
) {
    auto tree = build_bsp(objects, options, primitive_bounds);
    INFO((tree ? std::string("built") : tree.error().message));
    REQUIRE(tree.has_value());
    support::require_valid(*tree);
    support::require_items_in_place(*tree, objects);
    support::require_item_tables(*tree, objects);
    support::require_pieces_in_place(*tree, objects, primitive_bounds);
    REQUIRE(tree->quality.depth <= options.max_depth);
    REQUIRE(tree->inflation == options.inflation);
    for (const HierarchyNode& node : tree->nodes) {
        REQUIRE((tree->nodes.size() == 1 || node.item_count + node.piece_count > 0));
    }
    return *tree;
}

std::uint32_t largest_leaf(const Hierarchy& tree) {
    std::uint32_t items = 0;
    for (const HierarchyNode& node : tree.nodes) {
        items = std::max(items, is_leaf(node) ? node.item_count : 0);
    }
    return items;
}

std::uint64_t largest_piece(const Hierarchy& tree) {
    std::uint64_t primitives = 0;
    for (const HierarchyNode& node : tree.nodes) {
        primitives = std::max(primitives, is_leaf(node) ? node.piece_primitives : 0);
    }
    return primitives;
}

/// A strip of unit squares along x from 0, the primitives of every splittable object.
Box3d strip_square(std::uint32_t /*object*/, std::uint32_t primitive) {
    return {{1.0 * primitive, 0.0, 0.0}, {1.0 * primitive + 1.0, 0.0, 1.0}};
}

Object strip(std::uint32_t squares) {
    return {{{0.0, 0.0, 0.0}, {1.0 * squares, 0.0, 1.0}}, squares, true};
}

} // namespace

TEST_CASE("no objects make a lone, empty root", "[bsp]") {
    const Hierarchy tree = built({});
    CHECK(tree.nodes.size() == 1);
    CHECK(tree.quality.leaves == 1);
    CHECK(tree.quality.depth == 0);
    CHECK(is_empty(bounds(tree.nodes[0])));
    CHECK(tree.origin == glm::dvec3(0.0));
}

TEST_CASE("one object makes one leaf", "[bsp]") {
    const std::vector<Object> one{support::cube({7.0, 8.0, 9.0}, 2.0, 3)};
    const Hierarchy tree = built(one);
    CHECK(tree.nodes.size() == 1);
    CHECK(tree.origin == glm::dvec3(7.0, 8.0, 9.0));
    CHECK(tree.nodes[0].items_box == Box3f{glm::vec3(-1.0F), glm::vec3(1.0F)});
    CHECK(tree.nodes[0].item_primitives == 3);

    const std::vector<Object> point{support::cube({1.0, 1.0, 1.0}, 0.0)};
    CHECK(built(point).nodes.size() == 1);
}

TEST_CASE("a splittable object without primitives lies nowhere", "[bsp]") {
    const std::vector<Object> nothing{{{{0, 0, 0}, {1, 1, 1}}, 0, true}};
    const Hierarchy tree = built(nothing);
    CHECK(tree.nodes.size() == 1);
    CHECK(tree.pieces.empty());
    CHECK(is_empty(bounds(tree.nodes[0])));
}

TEST_CASE("four boxes in a row: every number by hand", "[bsp]") {
    // Along x: 0-1, 2-3, 10-11, 12-13. The gap 3-10 halves the primitives; its middle is 6.5, the
    // centre of everything. Then 1.5 and 11.5.
    std::vector<Object> objects;
    for (const double x : {12.0, 0.0, 10.0, 2.0}) {
        objects.push_back({{{x, 0.0, 0.0}, {x + 1.0, 1.0, 1.0}}, 1, false});
    }
    const Hierarchy tree = built(objects);
    CHECK(tree.origin == glm::dvec3(6.5, 0.5, 0.5));
    CHECK(tree.items == std::vector<ItemId>{ItemId{1}, ItemId{3}, ItemId{2}, ItemId{0}});
    REQUIRE(tree.nodes.size() == 7);
    CHECK(tree.nodes[0].plane == Plane{{1.0F, 0.0F, 0.0F}, 0.0F});
    CHECK(tree.nodes[0].first_child == 1);
    CHECK(tree.nodes[1].plane == Plane{{1.0F, 0.0F, 0.0F}, -5.0F});
    CHECK(tree.nodes[1].first_child == 3);
    CHECK(tree.nodes[1].items_box == Box3f{{-6.5F, -0.5F, -0.5F}, {-3.5F, 0.5F, 0.5F}});
    CHECK(tree.nodes[2].plane == Plane{{1.0F, 0.0F, 0.0F}, 5.0F});
    CHECK(tree.nodes[2].first_child == 5);
    CHECK(tree.nodes[2].first_item == 2);
    CHECK(tree.nodes[2].item_count == 2);
    CHECK(tree.quality.depth == 2);
    CHECK(tree.quality.leaves == 4);
    CHECK(tree.quality.cut_items == 0);
}

TEST_CASE("balance is in primitives, not in items", "[bsp]") {
    // Four boxes as above, the first as heavy as a thousand of the others: it stands alone.
    std::vector<Object> objects;
    for (const double x : {0.0, 2.0, 4.0, 6.0}) {
        objects.push_back({{{x, 0.0, 0.0}, {x + 1.0, 1.0, 1.0}}, x == 0.0 ? 1000U : 1U, false});
    }
    const Hierarchy tree = built(objects);
    // Middle of the gap 1-2, from the centre of everything at 3.5.
    CHECK(tree.nodes[0].plane == Plane{{1.0F, 0.0F, 0.0F}, -2.0F});
    CHECK(tree.nodes[1].item_count == 1);
}

TEST_CASE("a heavy item does not drown the balance of the others", "[bsp]") {
    // 2^60 primitives: in double the sum with 64 boxes of one primitive is 2^60 again. Split off
    // first, it must leave the row with its own balance: six levels of halving below one.
    std::vector<Object> objects{{{{-9, 0, 0}, {-8, 1, 1}}, 1ULL << 60U, false}};
    for (int index = 0; index < 64; ++index) {
        objects.push_back({{{2.0 * index, 0, 0}, {2.0 * index + 1.0, 1, 1}}, 1, false});
    }
    CHECK(built(objects).quality.depth == 7);
}

TEST_CASE("of equal gaps the one across the longest extent is taken", "[bsp]") {
    for (const bool long_in_x : {true, false}) {
        std::vector<Object> objects;
        for (const double a : {0.0, 2.0}) {
            for (const double b : {0.0, 10.0}) {
                const glm::dvec3 lo = long_in_x ? glm::dvec3(b, 0.0, a) : glm::dvec3(a, 0.0, b);
                objects.push_back({{lo, lo + 1.0}, 1, false});
            }
        }
        const Hierarchy tree = built(objects);
        const glm::vec3 expected = long_in_x ? glm::vec3(1, 0, 0) : glm::vec3(0, 0, 1);
        CHECK(glm::abs(tree.nodes[0].plane.normal) == expected);
        CHECK(tree.quality.leaves == 4);
    }
}

TEST_CASE("planes across up only where they are asked for", "[bsp]") {
    std::vector<Object> storeys;
    for (const double y : {0.0, 3.0, 6.0}) {
        storeys.push_back({{{0, y, 0}, {10, y + 2.5, 10}}, 100, false});
    }
    CHECK(built(storeys).nodes.size() == 1);
    const Hierarchy split = built(storeys, {.split_vertically = true});
    CHECK(split.quality.leaves == 3);
    CHECK(split.nodes[0].plane.normal == glm::vec3(0.0F, 1.0F, 0.0F));
    // The same with the storeys side by side, and up along them.
    for (Object& object : storeys) {
        std::swap(object.bounds.lo.x, object.bounds.lo.y);
        std::swap(object.bounds.hi.x, object.bounds.hi.y);
    }
    CHECK(built(storeys, {.up = {1e300, 0.0, 0.0}}).nodes.size() == 1);
    CHECK(built(storeys, {.split_vertically = true, .up = {-1e-300, 0, 0}}).quality.leaves == 3);
}

TEST_CASE("the directions divide the half circle around up", "[bsp]") {
    // Two boxes that only a plane across one oblique direction separates: neighbours on a diagonal
    // whose extents overlap in x and in z.
    const std::vector<Object> pair{
        {{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}}, 1, false},
        {{{0.9, 0.0, 0.9}, {5.0, 1.0, 5.0}}, 1, false}};
    CHECK(built(pair).nodes.size() == 1);
    const std::vector<Object> diagonal{
        {{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}}, 1, false},
        {{{1.1, 0.0, 1.1}, {2.0, 1.0, 2.0}}, 1, false}};
    const Hierarchy tree = built(diagonal, {.directions = 4});
    REQUIRE(tree.quality.leaves == 2);
    CHECK(std::abs(tree.nodes[0].plane.normal.y) == 0.0F);
    CHECK(std::abs(tree.nodes[0].plane.normal.x) == Approx(std::sqrt(0.5)).epsilon(1e-6));
    CHECK(std::abs(tree.nodes[0].plane.normal.z) == Approx(std::sqrt(0.5)).epsilon(1e-6));
}

TEST_CASE(
    "boxes that touch are separated without a cut, far from the world's origin too", "[bsp]"
) {
    for (const double offset : {0.0, 1e7}) {
        std::vector<Object> tiles = support::grid_boxes(100);
        for (Object& tile : tiles) {
            // A third of a metre: no coordinate is a float, so the narrowing has to round.
            tile.bounds.lo = tile.bounds.lo / 3.0 + offset;
            tile.bounds.hi = tile.bounds.hi / 3.0 + offset;
        }
        const Hierarchy tree = built(tiles);
        CHECK(tree.quality.cut_items == 0);
        CHECK(tree.quality.leaves == 100);
        // Halving 100 equal tiles needs seven levels; a gap need not halve a row of five exactly.
        CHECK(tree.quality.depth <= 8);
    }
}

TEST_CASE("equal boxes cannot be told apart: one leaf", "[bsp]") {
    const std::vector<Object> equal(1000, support::cube({1.0, 2.0, 3.0}, 1.0));
    CHECK(built(equal, {.split_vertically = true}).nodes.size() == 1);
    const std::vector<Object> points(1000, support::cube({1.0, 2.0, 3.0}, 0.0));
    CHECK(built(points, {.directions = 7}).nodes.size() == 1);
}

TEST_CASE("boxes in boxes with one centre: one leaf", "[bsp]") {
    std::vector<Object> nested;
    for (int index = 1; index <= 500; ++index) {
        nested.push_back(support::cube({5.0, 5.0, 5.0}, index));
    }
    CHECK(built(nested).nodes.size() == 1);
}

TEST_CASE("a heap without gaps is halved by centres", "[bsp]") {
    // All hold the origin; no plane is free of them, so some planes cut.
    std::vector<Object> heap;
    heap.reserve(64);
    for (int index = 0; index < 64; ++index) {
        heap.push_back({{{index - 64.0, 0, 0}, {index + 1.0, 1, 1}}, 1, false});
    }
    const Hierarchy tree = built(heap);
    CHECK(tree.quality.cut_items > 0);
    CHECK(largest_leaf(tree) <= 8);
    CHECK(tree.quality.depth == 3);

    // Up to max_items are rather kept together.
    const Hierarchy kept = built(heap, {.max_items = 64});
    CHECK(kept.nodes.size() == 1);
    CHECK(kept.quality.cut_items == 0);
}

TEST_CASE("a giant among dust is cut once and the dust is still sorted out", "[bsp]") {
    std::vector<Object> objects{support::cube({0.0, 0.0, 0.0}, 100.0, 1'000'000'000)};
    support::Random random(3);
    for (int index = 0; index < 5000; ++index) {
        objects.push_back(support::cube(random.vector(-50.0, 50.0), 0.001, 1));
    }
    const Hierarchy tree = built(objects);
    CHECK(tree.quality.cut_items >= 1);
    CHECK(tree.quality.cut_items < 50);
    CHECK(largest_leaf(tree) <= 8);
    // Halving 5001 down to single grains takes 13 levels; twice that and a few are allowed.
    CHECK(tree.quality.depth <= 2 * 10 + 8);
}

TEST_CASE("dust between giants does not make a chain", "[bsp]") {
    // Everywhere but at the rim a plane cuts many giants, at the rim it peels off single grains: a
    // builder that counts cuts alone peels until its depth is used up and leaves the rest a heap.
    std::vector<Object> objects;
    support::Random random(4);
    for (int index = 0; index < 4000; ++index) {
        const bool giant = index % 2 == 0;
        const double reach = giant ? 35.0 : 50.0;
        objects.push_back(support::cube(random.vector(-reach, reach), giant ? 30.0 : 0.01));
    }
    for (const float weight : {0.0F, 0.02F, 10.0F}) {
        const Hierarchy tree = built(objects, {.balance_weight = weight});
        CHECK(largest_leaf(tree) <= 8);
        // Twice the nine halvings of 4000 down to 8, the eight levels that may be spent beyond, and
        // the seven that bring eight items down to one each in the worst case.
        CHECK(tree.quality.depth <= 18 + 8 + 7);
    }
}

TEST_CASE("collinear, flat and point boxes", "[bsp]") {
    std::vector<Object> row;
    std::vector<Object> walls;
    std::vector<Object> points;
    for (int index = 0; index < 300; ++index) {
        row.push_back(support::cube({2.0 * index, 0.0, 0.0}, 1.0));
        walls.push_back({{{1.0 * index, 0, 0}, {1.0 * index, 3, 5}}, 2, false});
        points.push_back(support::cube({0.0, 0.0, 0.1 * index}, 0.0));
    }
    for (const auto& objects : {row, walls, points}) {
        const Hierarchy tree = built(objects);
        CHECK(tree.quality.leaves == 300);
        CHECK(tree.quality.cut_items == 0);
        CHECK(tree.quality.depth == 9); // 2^8 < 300 <= 2^9
    }
}

TEST_CASE("a wall between two rooms that touch it is no obstacle", "[bsp]") {
    const std::vector<Object> rooms{
        {{{0, 0, 0}, {5, 3, 5}}, 12, false},
        {{{5, 0, 0}, {5, 3, 5}}, 2, false},
        {{{5, 0, 0}, {10, 3, 5}}, 12, false}};
    const Hierarchy tree = built(rooms);
    CHECK(tree.quality.cut_items == 0);
    CHECK(tree.quality.leaves == 2);
}

TEST_CASE("negative zero is zero", "[bsp]") {
    // Symmetric, so that the origin is zero and the signs survive the re-basing.
    std::vector<Object> objects{
        {{{-1.0, -1.0, -1.0}, {-0.0, 1.0, 1.0}}, 1, false},
        {{{0.0, -1.0, -1.0}, {1.0, 1.0, 1.0}}, 1, false}};
    const Hierarchy tree = built(objects);
    CHECK(tree.quality.leaves == 2);
    CHECK(tree.quality.cut_items == 0);
    objects[0].bounds.hi.x = 0.0;
    objects[1].bounds.lo.x = -0.0;
    CHECK(support::hash_of(built(objects)) == support::hash_of(tree));
    // Every term of both dot products a negative zero: the plane's offset is positive all the same.
    objects[0].bounds = {{-1.0, -1.0, -1.0}, {-0.0, -0.5, -0.5}};
    CHECK_FALSE(std::signbit(built(objects).nodes[0].plane.offset));
}

TEST_CASE("sizes from 1e-30 to 1e30", "[bsp]") {
    std::vector<Object> objects;
    for (int exponent = -30; exponent <= 30; ++exponent) {
        const double size = std::pow(10.0, exponent);
        objects.push_back({{{size, size, size}, {2 * size, 2 * size, 2 * size}}, 1, false});
        objects.push_back({{{-2 * size, 0, 0}, {-size, size, size}}, 1, false});
    }
    for (const std::uint32_t directions : {2U, 5U}) {
        built(objects, {.directions = directions, .split_vertically = true});
    }
    const std::vector<Object> largest{
        {{{-1e36, -1e36, -1e36}, {-1e36, 1e36, 1e36}}, 1, false},
        {{{1e36, -1e36, -1e36}, {1e36, 1e36, 1e36}}, 1, false}};
    CHECK(built(largest, {.directions = 3}).quality.leaves == 2);
}

TEST_CASE("a scene at 1e7 m is split as one at zero", "[bsp]") {
    // Multiples of 1/64 m: exact in double at 1e7, so that both scenes are the same one.
    support::Random random(5);
    std::vector<Object> near_zero;
    for (int index = 0; index < 500; ++index) {
        const glm::dvec3 lo = glm::floor(random.vector(-100.0, 100.0) * 64.0) / 64.0;
        near_zero.push_back({{lo, lo + glm::floor(random.uniform(1.0, 300.0)) / 64.0}, 7, false});
    }
    std::vector<Object> far_away = near_zero;
    const glm::dvec3 offset(1e7, -1e7, 1e7);
    for (Object& object : far_away) {
        object.bounds.lo += offset;
        object.bounds.hi += offset;
    }
    Hierarchy here = built(near_zero);
    const Hierarchy there = built(far_away);
    CHECK(there.origin == here.origin + offset);
    here.origin = there.origin;
    CHECK(support::hash_of(here) == support::hash_of(there));
}

TEST_CASE("a surface alone is halved until its pieces are small", "[bsp]") {
    const std::vector<Object> objects{strip(64)};
    const Hierarchy whole = built(objects, {.max_piece_primitives = 64}, strip_square);
    CHECK(whole.nodes.size() == 1);
    CHECK(whole.quality.split_objects == 0);
    REQUIRE(whole.pieces.size() == 1);
    CHECK(whole.pieces[0] == Piece{ItemId{0}, 0, 64});

    const Hierarchy split = built(objects, {.max_piece_primitives = 16}, strip_square);
    CHECK(split.quality.depth == 2);
    CHECK(split.quality.leaves == 4);
    CHECK(split.quality.split_objects == 1);
    for (const Piece& piece : split.pieces) {
        CHECK(piece.count == 16);
    }

    const Hierarchy single = built(objects, {.max_piece_primitives = 1}, strip_square);
    CHECK(single.quality.leaves == 64);
    CHECK(single.quality.depth == 6);
}

TEST_CASE("coincident primitives cannot be told apart", "[bsp]") {
    const std::vector<Object> objects{{{{0, 0, 0}, {1, 1, 1}}, 1000, true}};
    const auto same = [](std::uint32_t, std::uint32_t) -> Box3d { return {{0, 0, 0}, {1, 1, 1}}; };
    CHECK(built(objects, {.max_piece_primitives = 1}, same).nodes.size() == 1);
    // One apart from the rest: its side is split off and no more.
    const auto almost = [](std::uint32_t, std::uint32_t primitive) -> Box3d {
        return {{primitive == 700 ? 0.5 : 0.0, 0, 0}, {1, 1, 1}};
    };
    CHECK(built(objects, {.max_piece_primitives = 1}, almost).quality.leaves == 2);
}

TEST_CASE("pieces follow the planes between items", "[bsp]") {
    const std::vector<Object> objects{
        {{{1, 0, 0}, {3, 1, 1}}, 5, false}, strip(8), {{{5, 0, 0}, {7, 1, 1}}, 5, false}};
    const Hierarchy tree = built(objects, {}, strip_square);
    CHECK(tree.quality.leaves == 2);
    CHECK(tree.nodes[0].plane == Plane{{1.0F, 0.0F, 0.0F}, 0.0F});
    CHECK(tree.pieces == std::vector<Piece>{{ItemId{1}, 0, 4}, {ItemId{1}, 4, 4}});
    CHECK(tree.primitives == std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7});
}

TEST_CASE(
    "a large surface is split beside its item, and through it only when it must be", "[bsp]"
) {
    // One box over squares 60 to 62 of 100; leaves of at most 10 squares.
    const std::vector<Object> objects{{{{60, 0, 0}, {63, 1, 1}}, 5, false}, strip(100)};
    const Hierarchy beside = built(objects, {.max_piece_primitives = 10}, strip_square);
    CHECK(beside.quality.cut_items == 0);
    CHECK(largest_piece(beside) <= 10);

    // Boxes over nearly all of it, the middle included: ten squares stick out at one end.
    for (const double x : {-1.0, 10.0}) {
        const std::vector<Object> end{{{{x, 0, 0}, {x + 91.0, 1, 1}}, 5, false}, strip(100)};
        const Hierarchy tree = built(end, {.max_piece_primitives = 95}, strip_square);
        CHECK(tree.quality.cut_items == 0);
        CHECK(tree.quality.leaves == 2);
        CHECK(largest_piece(tree) == 90);
    }

    // Leaves of one square: the three below the box have to part.
    const Hierarchy through = built(objects, {.max_piece_primitives = 1}, strip_square);
    CHECK(through.quality.cut_items == 1);
    CHECK(largest_piece(through) == 1);

    // A box over everything does not keep the surface whole either.
    const std::vector<Object> covered{{{{-1, -1, -1}, {101, 2, 2}}, 5, false}, strip(100)};
    CHECK(largest_piece(built(covered, {.max_piece_primitives = 10}, strip_square)) <= 10);
}

TEST_CASE("several surfaces keep their primitives apart", "[bsp]") {
    const std::vector<Object> objects{strip(40), strip(0), strip(25), strip(7)};
    const Hierarchy tree = built(objects, {.max_piece_primitives = 8}, strip_square);
    CHECK(largest_piece(tree) <= 8);
    CHECK(tree.primitives.size() == 72);
    CHECK(tree.quality.split_objects >= 2);
}

TEST_CASE("block boxes go around runs of primitives, across pieces", "[bsp]") {
    // 20 and 20 squares: the first block is full, the second holds the end of one piece and the
    // start of the next, the third is short.
    const Hierarchy tree = built(
        std::vector<Object>{
            support::cube({5.0, 0.0, 0.0}, 1.0), strip(40), support::cube({35.0, 0.0, 0.0}, 1.0)},
        {},
        strip_square
    );
    REQUIRE(tree.pieces == std::vector<Piece>{{ItemId{1}, 0, 20}, {ItemId{1}, 20, 20}});
    REQUIRE(tree.origin == glm::dvec3(20.0, 0.0, 0.25));
    CHECK(
        tree.block_boxes ==
        std::vector<Box3f>{
            {{-20.0F, 0.0F, -0.25F}, {-4.0F, 0.0F, 0.75F}},
            {{-4.0F, 0.0F, -0.25F}, {12.0F, 0.0F, 0.75F}},
            {{12.0F, 0.0F, -0.25F}, {20.0F, 0.0F, 0.75F}}}
    );
}

TEST_CASE("the depth is limited", "[bsp]") {
    const std::vector<Object> objects = support::random_boxes(500, 6);
    CHECK(built(objects, {.max_depth = 0}).nodes.size() == 1);
    CHECK(built(objects, {.max_depth = 3}).quality.depth == 3);
    CHECK(built(objects, {.max_depth = 64}).quality.depth > 3);
}

TEST_CASE("objects without primitives are still separated", "[bsp]") {
    std::vector<Object> objects;
    objects.reserve(16);
    for (int index = 0; index < 16; ++index) {
        objects.push_back(support::cube({3.0 * index, 0.0, 0.0}, 1.0, 0));
    }
    CHECK(built(objects).quality.depth == 4);
}

TEST_CASE("the same tree on every run", "[bsp]") {
    const support::Island island = support::make_island(200, 200.0, 12.0, 7);
    const BspOptions options{.directions = 3};
    const auto hash = support::hash_of(built(island.objects, options, island.primitive_bounds()));
    CHECK(hash == support::hash_of(built(island.objects, options, island.primitive_bounds())));
    // The hash sees a change: another island has another one.
    const support::Island other = support::make_island(200, 200.0, 12.0, 8);
    CHECK(hash != support::hash_of(built(other.objects, options, other.primitive_bounds())));
}

TEST_CASE("random scenes under random options", "[bsp]") {
    support::Random random(20);
    for (int round = 0; round < 300; ++round) {
        BspOptions options;
        options.directions = 1 + random.below(8);
        options.split_vertically = random.below(2) == 1;
        options.up = random.vector(-1.0, 1.0);
        options.inflation = static_cast<float>(random.uniform(0.0, 1.0));
        options.max_items = 1 + random.below(12);
        options.max_piece_primitives = 1 + random.below(20);
        options.max_depth = random.below(65);
        options.balance_weight = static_cast<float>(std::pow(10.0, random.uniform(-4.0, 2.0)));
        CAPTURE(round, options.directions, options.max_items, options.max_piece_primitives);

        // Snapping to a coarse grid makes boxes that touch, coincide and vanish.
        const double grid = random.below(2) == 0 ? 4.0 : 1e-3;
        const glm::dvec3 offset = random.below(2) == 0 ? glm::dvec3(0.0) : random.vector(-1e7, 1e7);
        const auto box = [&](double reach, double size) -> Box3d {
            const glm::dvec3 lo = glm::floor(random.vector(-reach, reach) / grid) * grid + offset;
            const glm::dvec3 edges = glm::floor(glm::abs(random.vector(-size, size)) / grid) * grid;
            return {lo, lo + edges};
        };
        std::vector<Object> objects;
        std::vector<std::vector<Box3d>> primitives;
        const unsigned count = random.below(60);
        for (unsigned index = 0; index < count; ++index) {
            Object object{box(50.0, random.below(10) == 0 ? 100.0 : 10.0), random.below(1000)};
            auto& own = primitives.emplace_back();
            if (random.below(8) == 0) {
                object.splittable = true;
                object.primitives = random.below(40);
                for (std::uint64_t primitive = 0; primitive < object.primitives; ++primitive) {
                    own.push_back(box(50.0, 5.0));
                }
            }
            objects.push_back(object);
        }
        built(objects, options, [&](std::uint32_t object, std::uint32_t primitive) {
            return primitives[object][primitive];
        });
    }
}

TEST_CASE("the island of the paper", "[bsp]") {
    // 1117 trees; the paper reports 13 levels, 1072 leaves and no tree split.
    SECTION("spread wide, gaps are found everywhere") {
        const support::Island island = support::make_island(1117, 2000.0, 12.0, 1);
        const Hierarchy tree = built(island.objects, {}, island.primitive_bounds());
        CHECK(tree.quality.cut_items == 0);
        CHECK(tree.quality.leaves >= 1072);
        CHECK(tree.quality.depth <= 12);
        CHECK(tree.quality.split_objects == 1);
    }
    SECTION("as dense as trees can well stand") {
        // Some fifteen trees stand across every straight line through the middle of this disc, so
        // that cuts cannot be avoided; a tenth of the trees is the bound, 83 what this seed needs
        // (depth 18, 973 leaves).
        const support::Island island = support::make_island(1117, 400.0, 12.0, 1);
        const Hierarchy tree = built(island.objects, {}, island.primitive_bounds());
        CAPTURE(tree.quality.depth, tree.quality.leaves, tree.quality.cut_items);
        CHECK(tree.quality.cut_items <= 112);
        CHECK(tree.quality.leaves >= 900);
        CHECK(tree.quality.depth <= 20);
        CHECK(largest_leaf(tree) <= 8);
        CHECK(largest_piece(tree) <= 4096);
    }
}

TEST_CASE("every option has a default", "[bsp]") {
    // Compiled with warnings as errors: a field without a default would not pass.
    CHECK(BspOptions{.directions = 3}.max_depth == 48);
    CHECK(BspOptions{.split_vertically = true}.directions == 2);
    CHECK(BspOptions{.up = {0.0, 0.0, 1.0}}.directions == 2);
    CHECK(BspOptions{.inflation = 0.5F}.directions == 2);
    CHECK(BspOptions{.max_items = 4}.directions == 2);
    CHECK(BspOptions{.max_piece_primitives = 4}.directions == 2);
    CHECK(BspOptions{.max_depth = 4}.directions == 2);
    CHECK(BspOptions{.balance_weight = 0.5F}.directions == 2);
}

TEST_CASE("options out of range are named with their value", "[bsp]") {
    struct Case {
        BspOptions options;
        const char* message;
    };
    const std::vector<Case> cases{
        {{.directions = 0}, "directions is 0"},
        {{.directions = 65}, "directions is 65"},
        {{.up = {0.0, 0.0, 0.0}}, "up is 0"},
        {{.up = {0.0, kNaN, 0.0}}, "up is nan"},
        {{.up = {0.0, 1.0, kInfinity}}, "up is inf"},
        {{.inflation = -0.1F}, "inflation is -0.1"},
        {{.inflation = 1.5F}, "inflation is 1.5"},
        {{.inflation = std::nanf("")}, "inflation is nan"},
        {{.max_items = 0}, "max_items is 0"},
        {{.max_items = (1U << 20U) + 1U}, "max_items is 1048577"},
        {{.max_piece_primitives = 0}, "max_piece_primitives is 0"},
        {{.max_depth = 65}, "max_depth is 65"},
        {{.balance_weight = -1.0F}, "balance_weight is -1"},
        {{.balance_weight = std::nanf("")}, "balance_weight is nan"},
        {{.balance_weight = INFINITY}, "balance_weight is inf"}};
    for (const Case& wrong : cases) {
        const auto tree = build_bsp({}, wrong.options);
        CAPTURE(wrong.message);
        REQUIRE_FALSE(tree.has_value());
        CHECK(tree.error().code == ErrorCode::invalid_argument);
        CHECK_THAT(tree.error().message, Catch::Contains(wrong.message));
    }
}

TEST_CASE("objects that cannot be placed are named with their value", "[bsp]") {
    const Object fine = support::cube({0.0, 0.0, 0.0}, 1.0);
    struct Case {
        Object object;
        ErrorCode code;
        const char* message;
    };
    const std::vector<Case> cases{
        {{{{kNaN, 0, 0}, {1, 1, 1}}}, ErrorCode::bad_data, "object 1: bounds: lo.x is nan"},
        {{{{0, 0, 0}, {1, kInfinity, 1}}}, ErrorCode::bad_data, "object 1: bounds: hi.y is inf"},
        {{{{0, 0, -1e37}, {1, 1, 1}}}, ErrorCode::bad_data, "object 1: bounds: lo.z is -1e+37"},
        {{{{0, 5, 0}, {1, 4, 1}}},
         ErrorCode::bad_data,
         "object 1: bounds: inverted, lo.y is 5, hi.y is 4"},
        {{Box3d{}}, ErrorCode::bad_data, "object 1: bounds: lo.x is inf"},
        {{fine.bounds, 1ULL << 32U, true}, ErrorCode::unsupported, "object 1: primitives is 42949"},
        {{fine.bounds, UINT64_MAX, false},
         ErrorCode::unsupported,
         "object 1: primitives is 18446744073709551615"},
        {{fine.bounds, 5, true}, ErrorCode::invalid_argument, "object 1: splittable is true"}};
    for (const Case& wrong : cases) {
        const std::vector<Object> objects{fine, wrong.object};
        const auto tree = build_bsp(objects);
        CAPTURE(wrong.message);
        REQUIRE_FALSE(tree.has_value());
        CHECK(tree.error().code == wrong.code);
        CHECK_THAT(tree.error().message, Catch::Contains(wrong.message));
    }
    // Two splittable objects that are too much together.
    const Object half{fine.bounds, 1ULL << 31U, true};
    const auto tree =
        build_bsp(std::vector<Object>{half, half}, {}, [&](std::uint32_t, std::uint32_t) {
            return fine.bounds;
        });
    REQUIRE_FALSE(tree.has_value());
    CHECK_THAT(tree.error().message, Catch::Contains("object 1: primitives is 2147483648"));
}

TEST_CASE("too many objects are counted before any is read", "[bsp]") {
    const Object one = support::cube({0.0, 0.0, 0.0}, 1.0);
    const auto tree = build_bsp(std::span<const Object>(&one, UINT32_MAX));
    REQUIRE_FALSE(tree.has_value());
    CHECK(tree.error().code == ErrorCode::unsupported);
    CHECK_THAT(tree.error().message, Catch::Contains("4294967295 of them"));
}

TEST_CASE("primitives that cannot be placed are named with their value", "[bsp]") {
    const std::vector<Object> objects{support::cube({0.0, 0.0, 0.0}, 1.0), strip(5)};
    const auto broken = [](std::uint32_t object, std::uint32_t primitive) {
        Box3d box = strip_square(object, primitive);
        if (primitive == 3) {
            box.hi.z = kNaN;
        }
        return box;
    };
    const auto tree = build_bsp(objects, {}, broken);
    REQUIRE_FALSE(tree.has_value());
    CHECK(tree.error().code == ErrorCode::bad_data);
    CHECK_THAT(tree.error().message, Catch::Contains("object 1: primitive 3: bounds: hi.z is nan"));
}
