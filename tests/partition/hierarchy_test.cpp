#include "scenes.hpp"
#include "tree_checks.hpp"
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace {

using namespace farfield;

/// Two boxes and a strip of four primitives: three nodes, two items, two pieces.
Hierarchy small_tree() {
    const std::vector<Object> objects{
        support::cube({-4.0, 0.0, 0.0}, 2.0, 10),
        {{{-8.0, -1.0, -1.0}, {8.0, -1.0, 1.0}}, 4, true},
        support::cube({4.0, 0.0, 0.0}, 2.0, 20)};
    const auto strip = [](std::uint32_t, std::uint32_t primitive) -> Box3d {
        const double x = -8.0 + 4.0 * primitive;
        return {{x, -1.0, -1.0}, {x + 4.0, -1.0, 1.0}};
    };
    auto tree = partition::build_bsp(objects, {}, strip);
    REQUIRE(tree.has_value());
    REQUIRE(tree->nodes.size() == 3);
    REQUIRE(tree->items.size() == 2);
    REQUIRE(tree->pieces.size() == 2);
    return *tree;
}

struct Damage {
    const char* message; ///< part of what validate must say
    std::function<void(Hierarchy&)> inflict;
};

/// The same tree, each leaf clipped to its half and with the neighbour's nearest primitive as its
/// guest.
Hierarchy clipped_tree() {
    Hierarchy tree = small_tree();
    tree.clip_leaves = true;
    for (const HierarchyNode& node : tree.nodes) {
        tree.whole_pieces_boxes.push_back(node.pieces_box);
    }
    tree.guests = {{ItemId{1}, 2, 1}, {ItemId{1}, 1, 1}};
    tree.nodes[0].guest_count = 2;
    tree.nodes[0].guest_primitives = 2;
    for (const std::uint32_t leaf : {1U, 2U}) {
        tree.nodes[leaf].first_guest = leaf - 1;
        tree.nodes[leaf].guest_count = 1;
        tree.nodes[leaf].guest_primitives = 1;
    }
    return tree;
}

/// As a hierarchy is whose items cannot move.
void forget_item_tables(Hierarchy& tree) {
    tree.item_boxes.clear();
    tree.item_primitives.clear();
    tree.item_places.clear();
}

} // namespace

TEST_CASE("a small tree is valid and adds up", "[hierarchy]") {
    const Hierarchy tree = small_tree();
    support::require_valid(tree);
    CHECK(primitive_count(tree.nodes[0]) == 34);
    CHECK(primitive_count(tree.nodes[1]) == 12);
    CHECK(primitive_count(tree.nodes[2]) == 22);
    CHECK(tree.quality.split_objects == 1);
    CHECK(bounds(tree.nodes[0]) == Box3f{{-8.0F, -1.0F, -1.0F}, {8.0F, 1.0F, 1.0F}});
    CHECK(bounds(tree.nodes[2]) == Box3f{{0.0F, -1.0F, -1.0F}, {8.0F, 1.0F, 1.0F}});
}

TEST_CASE("memory_bytes counts what the arrays hold", "[hierarchy]") {
    CHECK(memory_bytes(Hierarchy{}) == 0);
    Hierarchy tree;
    tree.nodes.resize(3);
    tree.items.resize(5);
    tree.pieces.resize(7);
    tree.primitives.resize(11);
    tree.block_boxes.resize(13);
    tree.guests.resize(17);
    tree.item_boxes.resize(19);
    tree.item_primitives.resize(23);
    tree.item_places.resize(29);
    tree.moving.resize(31);
    tree.whole_pieces_boxes.resize(37);
    CHECK(
        memory_bytes(tree) >= 3 * sizeof(HierarchyNode) + 5 * sizeof(ItemId) + 7 * sizeof(Piece) +
                                  11 * sizeof(std::uint32_t) + 13 * sizeof(Box3f) +
                                  17 * sizeof(Piece) + 19 * sizeof(Box3f) +
                                  23 * sizeof(std::uint64_t) + 29 * sizeof(std::uint32_t) +
                                  31 * sizeof(MovingItem) + 37 * sizeof(Box3f)
    );
    const std::uint64_t before = memory_bytes(tree);
    tree.primitives.reserve(tree.primitives.capacity() + 100);
    CHECK(memory_bytes(tree) >= before + 400);
}

TEST_CASE("the far child is the one across the plane", "[hierarchy]") {
    HierarchyNode node;
    node.plane = {{1.0F, 0.0F, 0.0F}, 2.0F};
    CHECK(far_child(node, {3.0F, 0.0F, 0.0F}) == 0);
    CHECK(far_child(node, {1.0F, 0.0F, 0.0F}) == 1);
    CHECK(far_child(node, {2.0F, 9.0F, 9.0F}) == 0);
}

TEST_CASE("validate finds every kind of damage", "[hierarchy]") {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    const std::vector<Damage> damages{
        {"no nodes", [](Hierarchy& tree) { tree.nodes.clear(); }},
        {"origin is nan", [](Hierarchy& tree) { tree.origin.y = std::nan(""); }},
        {"inflation is -0.5", [](Hierarchy& tree) { tree.inflation = -0.5F; }},
        {"inflation is nan", [](Hierarchy& tree) { tree.inflation = kNaN; }},
        {"node 0: parent is 1", [](Hierarchy& tree) { tree.nodes[0].parent = 1; }},
        {"node 0: first_item is 1", [](Hierarchy& tree) { tree.nodes[0].first_item = 1; }},
        {"node 0: first_piece is 1", [](Hierarchy& tree) { tree.nodes[0].first_piece = 1; }},
        {"node 0: item_count is 1", [](Hierarchy& tree) { tree.nodes[0].item_count = 1; }},
        {"node 0: piece_count is 3", [](Hierarchy& tree) { tree.nodes[0].piece_count = 3; }},
        {"node 0: first_child is 2", [](Hierarchy& tree) { tree.nodes[0].first_child = 2; }},
        {"node 1: first_child is 1", [](Hierarchy& tree) { tree.nodes[1].first_child = 1; }},
        {"node 2: parent is 1", [](Hierarchy& tree) { tree.nodes[2].parent = 1; }},
        {"node 1: parent is 0, which", [](Hierarchy& tree) { tree.nodes[0].first_child = 0; }},
        {"node 2: first_item is 0", [](Hierarchy& tree) { tree.nodes[2].first_item = 0; }},
        {"node 2: first_piece is 0", [](Hierarchy& tree) { tree.nodes[2].first_piece = 0; }},
        {"node 0: item_count is 2", [](Hierarchy& tree) { tree.nodes[2].item_count = 2; }},
        {"node 0: piece_count is 2", [](Hierarchy& tree) { tree.nodes[2].piece_count = 2; }},
        {"node 0: item_primitives is 31", [](Hierarchy& tree) { ++tree.nodes[0].item_primitives; }},
        {"node 0: piece_primitives is 5",
         [](Hierarchy& tree) { ++tree.nodes[0].piece_primitives; }},
        {"node 1: piece_primitives is 3",
         [](Hierarchy& tree) {
             ++tree.nodes[1].piece_primitives;
             ++tree.nodes[0].piece_primitives;
         }},
        {"normal has length 2", [](Hierarchy& tree) { tree.nodes[0].plane.normal.x = 2.0F; }},
        {"normal has length nan", [](Hierarchy& tree) { tree.nodes[0].plane.normal.x = kNaN; }},
        {"plane offset is nan", [](Hierarchy& tree) { tree.nodes[0].plane.offset = kNaN; }},
        {"node 0: items_box", [](Hierarchy& tree) { tree.nodes[0].items_box = {}; }},
        {"node 0: items_box", [](Hierarchy& tree) { tree.nodes[0].items_box.hi.x = INFINITY; }},
        {"node 2: pieces_box", [](Hierarchy& tree) { tree.nodes[2].pieces_box.lo.z = kNaN; }},
        {"node 1: a box reaches out",
         [](Hierarchy& tree) { tree.nodes[1].items_box.lo.x = -9.0F; }},
        {"node 2: a box reaches out",
         [](Hierarchy& tree) { tree.nodes[2].pieces_box.hi.y = 7.0F; }},
        {"items: item 0 lies in two",
         [](Hierarchy& tree) {
             forget_item_tables(tree);
             tree.items[1] = tree.items[0];
         }},
        {"items[0] is none, expected an item without",
         [](Hierarchy& tree) {
             forget_item_tables(tree);
             tree.items[0] = kNone<ItemId>;
         }},
        {"item 1: whole in one leaf",
         [](Hierarchy& tree) {
             forget_item_tables(tree);
             tree.items[0] = ItemId{1};
         }},
        {"moving has 1 entries, expected none",
         [](Hierarchy& tree) {
             forget_item_tables(tree);
             tree.moving.emplace_back();
         }},
        {"items[1] is item 0, which item_places has elsewhere",
         [](Hierarchy& tree) { tree.items[1] = tree.items[0]; }},
        {"items[0] is item 7, which item_places has elsewhere",
         [](Hierarchy& tree) { tree.items[0] = ItemId{7}; }},
        {"items[0] is none, expected an empty box",
         [](Hierarchy& tree) { tree.items[0] = kNone<ItemId>; }},
        {"item_boxes has 1 entries", [](Hierarchy& tree) { tree.item_boxes.pop_back(); }},
        {"item_primitives has 3 entries",
         [](Hierarchy& tree) { tree.item_primitives.push_back(1); }},
        {"item_boxes[1] is empty or", [](Hierarchy& tree) { tree.item_boxes[1] = {}; }},
        {"item_boxes[1] is empty or", [](Hierarchy& tree) { tree.item_boxes[1].hi.z = INFINITY; }},
        {"node 2: items_box does not hold item_boxes[1]",
         [](Hierarchy& tree) { tree.item_boxes[1].hi.z = 1.5F; }},
        {"node 1: item_primitives is 10, expected 11",
         [](Hierarchy& tree) { tree.item_primitives[0] = 11; }},
        {"item_places has places of 3 items, expected 2",
         [](Hierarchy& tree) { tree.item_places[1] = 0; }},
        {"items has 0 holes, expected as many as moving has entries, 1",
         [](Hierarchy& tree) {
             tree.moving.push_back({ItemId{0}, {}, 1, 0, {}});
         }},
        {"items has 1 holes, expected as many as moving has entries, 0",
         [](Hierarchy& tree) {
             REQUIRE(partition::hide(tree, ItemId{2}).has_value());
             tree.moving.clear();
         }},
        {"moving[0]: is item 0, which item_places has elsewhere",
         [](Hierarchy& tree) {
             REQUIRE(partition::hide(tree, ItemId{2}).has_value());
             tree.moving[0].item = ItemId{0};
         }},
        {"moving[0]: is item 4294967295, which",
         [](Hierarchy& tree) {
             REQUIRE(partition::hide(tree, ItemId{2}).has_value());
             tree.moving[0].item = kNone<ItemId>;
         }},
        {"moving[0]: home is 2",
         [](Hierarchy& tree) {
             REQUIRE(partition::hide(tree, ItemId{2}).has_value());
             tree.moving[0].home = 2;
         }},
        {"moving[0]: box is not finite",
         [](Hierarchy& tree) {
             REQUIRE(partition::hide(tree, ItemId{2}).has_value());
             tree.moving[0].box = {{0, 0, 0}, {0, INFINITY, 0}};
         }},
        {"item 1: whole in one leaf",
         [](Hierarchy& tree) {
             REQUIRE(partition::hide(tree, ItemId{2}).has_value());
             tree.moving[0].item = ItemId{1};
             tree.item_places = {0, 2, Hierarchy::kNoPlace};
         }},
        {"node 0: image_level", [](Hierarchy& tree) { tree.nodes[0].image_level = false; }},
        {"node 2: image_level", [](Hierarchy& tree) { tree.nodes[2].image_level = false; }},
        {"guests has 1 entries, expected none",
         [](Hierarchy& tree) {
             tree.nodes[0].guest_count = 1;
             tree.guests.push_back({ItemId{1}, 2, 1});
         }},
        {"whole_pieces_boxes has 0 entries, expected 3",
         [](Hierarchy& tree) { tree.clip_leaves = true; }},
        {"whole_pieces_boxes has 3 entries, expected 0",
         [](Hierarchy& tree) { tree.whole_pieces_boxes.resize(3); }},
        {"piece 1: item is none", [](Hierarchy& tree) { tree.pieces[1].item = kNone<ItemId>; }},
        {"piece 1: first is 1", [](Hierarchy& tree) { tree.pieces[1].first = 1; }},
        {"piece 1: count is 3", [](Hierarchy& tree) { tree.pieces[1].count = 3; }},
        {"piece 0: count is 0", [](Hierarchy& tree) { tree.pieces[0].count = 0; }},
        {"primitives has 5 entries", [](Hierarchy& tree) { tree.primitives.push_back(4); }},
        {"primitive 3 lies in two", [](Hierarchy& tree) { tree.primitives[0] = 3; }},
        {"primitive 4, though it has 4", [](Hierarchy& tree) { tree.primitives[0] = 4; }},
        {"block_boxes has 2 entries", [](Hierarchy& tree) { tree.block_boxes.emplace_back(); }},
        {"block_boxes: box 0", [](Hierarchy& tree) { tree.block_boxes[0] = {}; }},
        {"block_boxes: box 0", [](Hierarchy& tree) { tree.block_boxes[0].hi.y = kNaN; }},
        {"block_boxes: box 0", [](Hierarchy& tree) { tree.block_boxes[0].hi.y = INFINITY; }},
        {"quality.depth is 2", [](Hierarchy& tree) { tree.quality.depth = 2; }},
        {"quality.leaves is 3", [](Hierarchy& tree) { tree.quality.leaves = 3; }},
        {"quality.cut_items is 3", [](Hierarchy& tree) { tree.quality.cut_items = 3; }},
        {"quality.split_objects is 0", [](Hierarchy& tree) { tree.quality.split_objects = 0; }},
    };
    for (const Damage& damage : damages) {
        Hierarchy tree = small_tree();
        damage.inflict(tree);
        const Result<void> checked = validate(tree);
        CAPTURE(damage.message);
        REQUIRE_FALSE(checked.has_value());
        CHECK(checked.error().code == ErrorCode::bad_data);
        CHECK_THAT(checked.error().message, Catch::Contains(damage.message));
    }
}

TEST_CASE("validate finds damage where leaves clip", "[hierarchy]") {
    support::require_valid(clipped_tree());
    const std::vector<Damage> damages{
        {"node 0: first_guest is 1", [](Hierarchy& tree) { tree.nodes[0].first_guest = 1; }},
        {"node 0: guest_count is 1", [](Hierarchy& tree) { tree.nodes[0].guest_count = 1; }},
        {"node 2: first_guest is 0", [](Hierarchy& tree) { tree.nodes[2].first_guest = 0; }},
        {"node 0: guest_count is 2, expected 3",
         [](Hierarchy& tree) { tree.nodes[2].guest_count = 2; }},
        {"node 0: guest_primitives is 3",
         [](Hierarchy& tree) { ++tree.nodes[0].guest_primitives; }},
        {"node 1: guest_primitives is 2",
         [](Hierarchy& tree) {
             ++tree.nodes[1].guest_primitives;
             ++tree.nodes[0].guest_primitives;
         }},
        {"guest 0: first is 2, count is 0", [](Hierarchy& tree) { tree.guests[0].count = 0; }},
        {"guest 0: first is 2, count is 3", [](Hierarchy& tree) { tree.guests[0].count = 3; }},
        {"guest 1: item is 0, though", [](Hierarchy& tree) { tree.guests[1].item = ItemId{0}; }},
        // In the leaf as a piece already, wholly or by its end; the same one twice.
        {"node 1: guest 0", [](Hierarchy& tree) { tree.guests[0].first = 0; }},
        {"node 1: guest 0",
         [](Hierarchy& tree) {
             tree.guests[0] = {ItemId{1}, 1, 2};
         }},
        {"node 1: guest 1",
         [](Hierarchy& tree) {
             tree.guests = {{ItemId{1}, 2, 1}, {ItemId{1}, 2, 1}};
             tree.nodes[1].guest_count = 2;
             tree.nodes[2].guest_count = 0;
             tree.nodes[2].first_guest = 2;
         }},
        {"node 2: pieces_box crosses", [](Hierarchy& tree) { tree.nodes[2].pieces_box.lo.x = -1; }},
        {"node 1: whole_pieces_boxes", [](Hierarchy& tree) { tree.whole_pieces_boxes[1] = {}; }},
        {"node 2: a box reaches out",
         [](Hierarchy& tree) { tree.whole_pieces_boxes[2].hi.y = 7.0F; }},
        {"node 1: pieces_box does not fit piece_count 1 and guest_count 1",
         [](Hierarchy& tree) { tree.nodes[1].pieces_box = {}; }},
    };
    for (const Damage& damage : damages) {
        Hierarchy tree = clipped_tree();
        damage.inflict(tree);
        const Result<void> checked = validate(tree);
        CAPTURE(damage.message);
        REQUIRE_FALSE(checked.has_value());
        CHECK(checked.error().code == ErrorCode::bad_data);
        CHECK_THAT(checked.error().message, Catch::Contains(damage.message));
    }
}

TEST_CASE("pieces that are drawn whole have their own boxes where leaves clip", "[hierarchy]") {
    Hierarchy tree = clipped_tree();
    tree.nodes[1].pieces_box.hi.x = -2.0F;
    CHECK(whole_pieces_box(tree, 1).hi.x == 0.0F);
    tree.clip_leaves = false;
    CHECK(whole_pieces_box(tree, 1).hi.x == -2.0F);
}

TEST_CASE("validate takes a tree without block boxes", "[hierarchy]") {
    Hierarchy tree = small_tree();
    tree.block_boxes.clear();
    support::require_valid(tree);
}

TEST_CASE("validate takes a tree whose items cannot move", "[hierarchy]") {
    Hierarchy tree = small_tree();
    forget_item_tables(tree);
    support::require_valid(tree);
}

TEST_CASE("validate takes two pieces of one object in a leaf", "[hierarchy]") {
    Hierarchy tree;
    tree.nodes.resize(1);
    tree.pieces = {{ItemId{0}, 0, 1}, {ItemId{0}, 1, 1}};
    tree.primitives = {1, 0};
    tree.nodes[0].piece_count = 2;
    tree.nodes[0].piece_primitives = 2;
    tree.nodes[0].pieces_box = {{0.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 1.0F}};
    tree.quality.leaves = 1;
    support::require_valid(tree);
}
