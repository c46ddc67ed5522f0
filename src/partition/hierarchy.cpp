#include "partition/checks.hpp"
#include <farfield/partition/hierarchy.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace farfield {

namespace {

using partition::detail::text;

std::string node_name(std::size_t node) {
    return "hierarchy: node " + std::to_string(node) + ": ";
}

tl::unexpected<Error>
wrong(std::size_t node, const char* field, std::uint64_t value, std::uint64_t expected) {
    return fail(
        ErrorCode::bad_data,
        node_name(node) + field + " is " + std::to_string(value) + ", expected " +
            std::to_string(expected)
    );
}

bool holds(const Box3f& outer, const Box3f& inner) {
    return is_empty(inner) || (contains(outer, inner.lo) && contains(outer, inner.hi));
}

/// A box must be empty exactly where it has no contents, and finite otherwise.
bool fits_count(const Box3f& box, std::uint64_t count) {
    return count == 0 ? is_empty(box) : !is_empty(box) && is_finite(box);
}

/// @param holes how many places of `items` are empty before each place, and before the end
Result<void> check_boxes(
    const Hierarchy& hierarchy, std::size_t index, const std::vector<std::uint32_t>& holes
) {
    const HierarchyNode& node = hierarchy.nodes[index];
    const std::uint32_t empty = holes[node.first_item + node.item_count] - holes[node.first_item];
    if (!fits_count(node.items_box, node.item_count - empty)) {
        return fail(
            ErrorCode::bad_data,
            node_name(index) + "items_box does not fit item_count " +
                std::to_string(node.item_count) + " less " + std::to_string(empty) + " holes"
        );
    }
    if (!fits_count(node.pieces_box, std::uint64_t{node.piece_count} + node.guest_count)) {
        return fail(
            ErrorCode::bad_data,
            node_name(index) + "pieces_box does not fit piece_count " +
                std::to_string(node.piece_count) + " and guest_count " +
                std::to_string(node.guest_count)
        );
    }
    if (!fits_count(whole_pieces_box(hierarchy, index), node.piece_count)) {
        return fail(
            ErrorCode::bad_data,
            node_name(index) + "whole_pieces_boxes does not fit piece_count " +
                std::to_string(node.piece_count)
        );
    }
    return {};
}

/// Pieces and guests of a leaf lie inside their arrays (its ranges were checked on the way down).
Result<void> check_leaf(const Hierarchy& hierarchy, std::size_t index) {
    const HierarchyNode& node = hierarchy.nodes[index];
    if (!node.image_level) {
        return fail(
            ErrorCode::bad_data, node_name(index) + "image_level is false, expected true at a leaf"
        );
    }
    std::uint64_t primitives = 0;
    std::uint64_t begin = 0;
    std::uint64_t end = 0;
    for (std::uint32_t piece = 0; piece < node.piece_count; ++piece) {
        const Piece& own = hierarchy.pieces[node.first_piece + piece];
        begin = piece == 0 ? own.first : begin;
        end = std::uint64_t{own.first} + own.count;
        primitives += own.count;
    }
    if (node.piece_primitives != primitives) {
        return wrong(index, "piece_primitives", node.piece_primitives, primitives);
    }
    std::uint64_t guest_primitives = 0;
    std::uint64_t last_end = 0;
    for (std::uint32_t guest = 0; guest < node.guest_count; ++guest) {
        const Piece& run = hierarchy.guests[node.first_guest + guest];
        const std::uint64_t run_end = std::uint64_t{run.first} + run.count;
        if (run.first < last_end || (run.first < end && run_end > begin)) {
            return fail(
                ErrorCode::bad_data,
                node_name(index) + "guest " + std::to_string(node.first_guest + guest) +
                    " has primitives that are in the leaf already, or is out of order"
            );
        }
        last_end = run_end;
        guest_primitives += run.count;
    }
    if (node.guest_primitives != guest_primitives) {
        return wrong(index, "guest_primitives", node.guest_primitives, guest_primitives);
    }
    if (node.item_count == 0 && node.item_primitives != 0) {
        return wrong(index, "item_primitives", node.item_primitives, 0);
    }
    if (hierarchy.item_boxes.empty()) {
        return {};
    }
    std::uint64_t item_primitives = 0;
    for (std::uint32_t place = node.first_item; place < node.first_item + node.item_count;
         ++place) {
        item_primitives += hierarchy.item_primitives[place];
        if (!holds(node.items_box, hierarchy.item_boxes[place])) {
            return fail(
                ErrorCode::bad_data,
                node_name(index) + "items_box does not hold item_boxes[" + std::to_string(place) +
                    "]"
            );
        }
    }
    if (node.item_primitives != item_primitives) {
        return wrong(index, "item_primitives", node.item_primitives, item_primitives);
    }
    return {};
}

/// True when a clipped subtree is on its side of the plane above it, touching allowed.
bool on_its_side(const Plane& plane, const Box3f& box, bool in_front) {
    if (is_empty(box)) {
        return true;
    }
    float least = std::numeric_limits<float>::infinity();
    float most = -least;
    for (unsigned index = 0; index < 8; ++index) {
        const float distance = signed_distance(plane, corner(box, index));
        least = std::min(least, distance);
        most = std::max(most, distance);
    }
    return in_front ? least >= 0.0F : most <= 0.0F;
}

Result<void> check_interior(const Hierarchy& hierarchy, std::size_t index) {
    const std::vector<HierarchyNode>& nodes = hierarchy.nodes;
    const HierarchyNode& node = nodes[index];
    if (node.first_child <= index || node.first_child >= nodes.size() - 1) {
        return fail(
            ErrorCode::bad_data,
            node_name(index) + "first_child is " + std::to_string(node.first_child) +
                ", expected a pair after the node among " + std::to_string(nodes.size()) + " nodes"
        );
    }
    // A plane's normal comes from a double one and is rounded once: its length is off by 1e-7.
    constexpr float kUnit = 1e-5F;
    const float length = glm::length(node.plane.normal);
    if (!(std::abs(length - 1.0F) <= kUnit)) {
        return fail(
            ErrorCode::bad_data,
            node_name(index) + "plane normal has length " + text(static_cast<double>(length)) +
                ", expected 1"
        );
    }
    if (!std::isfinite(node.plane.offset)) {
        return fail(
            ErrorCode::bad_data,
            node_name(index) + "plane offset is " + text(static_cast<double>(node.plane.offset)) +
                ", expected a finite number"
        );
    }
    std::uint64_t items = node.first_item;
    std::uint64_t pieces = node.first_piece;
    std::uint64_t guests = node.first_guest;
    std::uint64_t item_primitives = 0;
    std::uint64_t piece_primitives = 0;
    std::uint64_t guest_primitives = 0;
    for (std::size_t child = node.first_child; child < node.first_child + 2ULL; ++child) {
        const HierarchyNode& below = nodes[child];
        if (below.parent != index) {
            return wrong(child, "parent", below.parent, index);
        }
        if (below.first_item != items) {
            return wrong(child, "first_item", below.first_item, items);
        }
        if (below.first_piece != pieces) {
            return wrong(child, "first_piece", below.first_piece, pieces);
        }
        if (below.first_guest != guests) {
            return wrong(child, "first_guest", below.first_guest, guests);
        }
        if (!holds(node.items_box, below.items_box) || !holds(node.pieces_box, below.pieces_box) ||
            !holds(whole_pieces_box(hierarchy, index), whole_pieces_box(hierarchy, child))) {
            return fail(
                ErrorCode::bad_data, node_name(child) + "a box reaches out of that of its parent"
            );
        }
        if (hierarchy.clip_leaves &&
            !on_its_side(node.plane, below.pieces_box, child != node.first_child)) {
            return fail(
                ErrorCode::bad_data,
                node_name(child) + "pieces_box crosses the plane of its parent, though leaves clip"
            );
        }
        items += below.item_count;
        pieces += below.piece_count;
        guests += below.guest_count;
        item_primitives += below.item_primitives;
        piece_primitives += below.piece_primitives;
        guest_primitives += below.guest_primitives;
    }
    if (items != std::uint64_t{node.first_item} + node.item_count) {
        return wrong(index, "item_count", node.item_count, items - node.first_item);
    }
    if (pieces != std::uint64_t{node.first_piece} + node.piece_count) {
        return wrong(index, "piece_count", node.piece_count, pieces - node.first_piece);
    }
    if (node.item_primitives != item_primitives) {
        return wrong(index, "item_primitives", node.item_primitives, item_primitives);
    }
    if (node.piece_primitives != piece_primitives) {
        return wrong(index, "piece_primitives", node.piece_primitives, piece_primitives);
    }
    if (guests != std::uint64_t{node.first_guest} + node.guest_count) {
        return wrong(index, "guest_count", node.guest_count, guests - node.first_guest);
    }
    if (node.guest_primitives != guest_primitives) {
        return wrong(index, "guest_primitives", node.guest_primitives, guest_primitives);
    }
    return {};
}

Result<void> check_root(const Hierarchy& hierarchy) {
    if (hierarchy.nodes.empty()) {
        return fail(ErrorCode::bad_data, "hierarchy: no nodes, expected at least the root");
    }
    for (const auto& [name, size] :
         {std::pair{"nodes", hierarchy.nodes.size()},
          std::pair{"items", hierarchy.items.size()},
          std::pair{"pieces", hierarchy.pieces.size()},
          std::pair{"guests", hierarchy.guests.size()},
          std::pair{"primitives", hierarchy.primitives.size()}}) {
        if (size > UINT32_MAX) {
            return fail(
                ErrorCode::bad_data,
                std::string("hierarchy: ") + name + " has " + std::to_string(size) +
                    " entries, expected at most 2^32 - 1"
            );
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(hierarchy.origin[axis])) {
            return fail(
                ErrorCode::bad_data,
                "hierarchy: origin is " + text(hierarchy.origin[axis]) +
                    " on an axis, expected a finite position"
            );
        }
    }
    if (!(hierarchy.inflation >= 0.0F && hierarchy.inflation <= 1.0F)) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: inflation is " + text(static_cast<double>(hierarchy.inflation)) +
                ", expected a number in [0, 1]"
        );
    }
    const HierarchyNode& root = hierarchy.nodes.front();
    if (root.parent != 0) {
        return wrong(0, "parent", root.parent, 0);
    }
    if (root.first_item != 0) {
        return wrong(0, "first_item", root.first_item, 0);
    }
    if (root.first_piece != 0) {
        return wrong(0, "first_piece", root.first_piece, 0);
    }
    if (root.item_count != hierarchy.items.size()) {
        return wrong(0, "item_count", root.item_count, hierarchy.items.size());
    }
    if (root.piece_count != hierarchy.pieces.size()) {
        return wrong(0, "piece_count", root.piece_count, hierarchy.pieces.size());
    }
    if (root.first_guest != 0) {
        return wrong(0, "first_guest", root.first_guest, 0);
    }
    if (root.guest_count != hierarchy.guests.size()) {
        return wrong(0, "guest_count", root.guest_count, hierarchy.guests.size());
    }
    if (!root.image_level) {
        return fail(
            ErrorCode::bad_data, node_name(0) + "image_level is false, expected true at the root"
        );
    }
    const std::size_t boxes = hierarchy.clip_leaves ? hierarchy.nodes.size() : 0;
    if (hierarchy.whole_pieces_boxes.size() != boxes) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: whole_pieces_boxes has " +
                std::to_string(hierarchy.whole_pieces_boxes.size()) + " entries, expected " +
                std::to_string(boxes)
        );
    }
    return {};
}

/// Box, cost and place of every whole item, for those at rest and those that move.
Result<void> check_item_tables(const Hierarchy& hierarchy) {
    const std::size_t places = hierarchy.items.size();
    const auto bad = [](const std::string& what) {
        return fail(ErrorCode::bad_data, "hierarchy: " + what);
    };
    if (hierarchy.item_boxes.empty() && hierarchy.item_primitives.empty() &&
        hierarchy.item_places.empty()) {
        if (!hierarchy.moving.empty()) {
            return bad(
                "moving has " + std::to_string(hierarchy.moving.size()) +
                " entries, expected none without item_boxes"
            );
        }
        const auto hole = std::find(hierarchy.items.begin(), hierarchy.items.end(), kNone<ItemId>);
        return hole == hierarchy.items.end()
                   ? Result<void>()
                   : bad("items[" + std::to_string(hole - hierarchy.items.begin()) +
                         "] is none, expected an item without item_boxes");
    }
    for (const auto& [name, size] :
         {std::pair{"item_boxes", hierarchy.item_boxes.size()},
          std::pair{"item_primitives", hierarchy.item_primitives.size()}}) {
        if (size != places) {
            return bad(
                std::string(name) + " has " + std::to_string(size) + " entries, expected " +
                std::to_string(places)
            );
        }
    }
    const auto is_at = [&](ItemId item, std::size_t place) {
        return index_of(item) < hierarchy.item_places.size() &&
               hierarchy.item_places[index_of(item)] == place;
    };
    std::size_t found = hierarchy.moving.size();
    for (std::size_t place = 0; place < places; ++place) {
        const ItemId item = hierarchy.items[place];
        const Box3f& box = hierarchy.item_boxes[place];
        const std::string number = std::to_string(place);
        if (item == kNone<ItemId>) {
            if (!is_empty(box) || hierarchy.item_primitives[place] != 0) {
                return bad(
                    "items[" + number + "] is none, expected an empty box and no primitives there"
                );
            }
            continue;
        }
        ++found;
        if (is_empty(box) || !is_finite(box)) {
            return bad("item_boxes[" + number + "] is empty or not finite");
        }
        if (!is_at(item, place)) {
            return bad(
                "items[" + number + "] is item " + std::to_string(index_of(item)) +
                ", which item_places has elsewhere"
            );
        }
    }
    const std::size_t holes = places + hierarchy.moving.size() - found;
    if (holes != hierarchy.moving.size()) {
        return bad(
            "items has " + std::to_string(holes) +
            " holes, expected as many as moving has entries, " +
            std::to_string(hierarchy.moving.size())
        );
    }
    for (std::size_t index = 0; index < hierarchy.moving.size(); ++index) {
        const MovingItem& moving = hierarchy.moving[index];
        const std::string name = "moving[" + std::to_string(index) + "]: ";
        if (!is_at(moving.item, places + index)) {
            return bad(
                name + "is item " + std::to_string(index_of(moving.item)) +
                ", which item_places has elsewhere"
            );
        }
        if (!is_empty(moving.box) && !is_finite(moving.box)) {
            return bad(name + "box is not finite");
        }
        if (moving.home >= places) {
            return bad(
                name + "home is " + std::to_string(moving.home) + ", there are " +
                std::to_string(places) + " places"
            );
        }
    }
    const auto none =
        std::count(hierarchy.item_places.begin(), hierarchy.item_places.end(), Hierarchy::kNoPlace);
    const std::size_t listed = hierarchy.item_places.size() - static_cast<std::size_t>(none);
    if (listed != found) {
        return bad(
            "item_places has places of " + std::to_string(listed) + " items, expected " +
            std::to_string(found)
        );
    }
    return {};
}

/// Links, ranges, boxes, and what `quality` says of the shape.
Result<void> check_nodes(const Hierarchy& hierarchy) {
    const std::vector<HierarchyNode>& nodes = hierarchy.nodes;
    std::vector<std::uint32_t> holes{0};
    holes.reserve(hierarchy.items.size() + 1);
    for (const ItemId item : hierarchy.items) {
        holes.push_back(holes.back() + (item == kNone<ItemId> ? 1U : 0U));
    }
    std::vector<std::uint32_t> depths(nodes.size(), 0);
    std::uint32_t deepest = 0;
    std::uint32_t leaves = 0;
    // Parents come before their children: whatever a node is indexed by here was checked when its
    // parent was visited.
    for (std::size_t index = 0; index < nodes.size(); ++index) {
        const HierarchyNode& node = nodes[index];
        if (index != 0) {
            const std::size_t parent = node.parent;
            if (parent >= index || is_leaf(nodes[parent]) ||
                index - nodes[parent].first_child > 1) {
                return fail(
                    ErrorCode::bad_data,
                    node_name(index) + "parent is " + std::to_string(parent) +
                        ", which does not have it as a child"
                );
            }
            depths[index] = depths[parent] + 1;
            deepest = std::max(deepest, depths[index]);
        }
        if (auto checked = check_boxes(hierarchy, index, holes); !checked) {
            return checked;
        }
        auto checked =
            is_leaf(node) ? check_leaf(hierarchy, index) : check_interior(hierarchy, index);
        if (!checked) {
            return checked;
        }
        leaves += is_leaf(node) ? 1U : 0U;
    }
    if (hierarchy.quality.depth != deepest) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: quality.depth is " + std::to_string(hierarchy.quality.depth) +
                ", expected " + std::to_string(deepest)
        );
    }
    if (hierarchy.quality.leaves != leaves) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: quality.leaves is " + std::to_string(hierarchy.quality.leaves) +
                ", expected " + std::to_string(leaves)
        );
    }
    return {};
}

/// Pieces follow each other without gaps in the primitive list.
Result<void> check_pieces(const Hierarchy& hierarchy) {
    std::uint64_t next = 0;
    for (std::size_t index = 0; index < hierarchy.pieces.size(); ++index) {
        const Piece& piece = hierarchy.pieces[index];
        const std::string name = "hierarchy: piece " + std::to_string(index) + ": ";
        if (piece.item == kNone<ItemId>) {
            return fail(ErrorCode::bad_data, name + "item is none");
        }
        if (piece.first != next) {
            return fail(
                ErrorCode::bad_data,
                name + "first is " + std::to_string(piece.first) + ", expected " +
                    std::to_string(next)
            );
        }
        if (piece.count == 0 || piece.count > hierarchy.primitives.size() - next) {
            return fail(
                ErrorCode::bad_data,
                name + "count is " + std::to_string(piece.count) + ", expected 1 to " +
                    std::to_string(hierarchy.primitives.size() - next)
            );
        }
        next += piece.count;
    }
    if (next != hierarchy.primitives.size()) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: primitives has " + std::to_string(hierarchy.primitives.size()) +
                " entries, the pieces hold " + std::to_string(next)
        );
    }
    constexpr std::size_t kBlock = Hierarchy::kBlockPrimitives;
    const std::size_t blocks = (hierarchy.primitives.size() + kBlock - 1) / kBlock;
    if (!hierarchy.block_boxes.empty() && hierarchy.block_boxes.size() != blocks) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: block_boxes has " + std::to_string(hierarchy.block_boxes.size()) +
                " entries, expected none or " + std::to_string(blocks)
        );
    }
    for (std::size_t block = 0; block < hierarchy.block_boxes.size(); ++block) {
        if (is_empty(hierarchy.block_boxes[block]) || !is_finite(hierarchy.block_boxes[block])) {
            return fail(
                ErrorCode::bad_data,
                "hierarchy: block_boxes: box " + std::to_string(block) +
                    " is empty or not finite, though it has primitives"
            );
        }
    }
    return {};
}

/// Guests are runs of primitives of their item, which pieces have; only where leaves clip.
Result<void> check_guests(const Hierarchy& hierarchy) {
    if (!hierarchy.clip_leaves && !hierarchy.guests.empty()) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: guests has " + std::to_string(hierarchy.guests.size()) +
                " entries, expected none where clip_leaves is false"
        );
    }
    for (std::size_t index = 0; index < hierarchy.guests.size(); ++index) {
        const Piece& guest = hierarchy.guests[index];
        const std::string name = "hierarchy: guest " + std::to_string(index) + ": ";
        const std::uint64_t end = std::uint64_t{guest.first} + guest.count;
        if (guest.count == 0 || end > hierarchy.primitives.size()) {
            return fail(
                ErrorCode::bad_data,
                name + "first is " + std::to_string(guest.first) + ", count is " +
                    std::to_string(guest.count) + ", expected a run of the " +
                    std::to_string(hierarchy.primitives.size()) + " primitives"
            );
        }
        // The piece that holds the first of them; pieces follow each other without gaps.
        auto piece = std::upper_bound(
            hierarchy.pieces.begin(),
            hierarchy.pieces.end(),
            guest.first,
            [](std::uint32_t first, const Piece& other) { return first < other.first; }
        );
        for (--piece; piece != hierarchy.pieces.end() && piece->first < end; ++piece) {
            if (piece->item != guest.item) {
                return fail(
                    ErrorCode::bad_data,
                    name + "item is " + std::to_string(index_of(guest.item)) +
                        ", though it has primitives of item " +
                        std::to_string(index_of(piece->item))
                );
            }
        }
    }
    return {};
}

/// No item twice, whole or split; the primitives of each split item are 0 .. n - 1, once each.
Result<void> check_membership(const Hierarchy& hierarchy) {
    std::vector<ItemId> whole = hierarchy.items;
    for (const MovingItem& moving : hierarchy.moving) {
        whole.push_back(moving.item);
    }
    std::sort(whole.begin(), whole.end());
    whole.erase(std::lower_bound(whole.begin(), whole.end(), kNone<ItemId>), whole.end());
    if (const auto twice = std::adjacent_find(whole.begin(), whole.end()); twice != whole.end()) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: items: item " + std::to_string(index_of(*twice)) + " lies in two places"
        );
    }

    std::vector<std::uint32_t> by_item(hierarchy.pieces.size());
    for (std::size_t index = 0; index < by_item.size(); ++index) {
        by_item[index] = static_cast<std::uint32_t>(index);
    }
    std::sort(by_item.begin(), by_item.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair{hierarchy.pieces[a].item, a} < std::pair{hierarchy.pieces[b].item, b};
    });
    std::vector<std::uint32_t> leaf_of_piece(hierarchy.pieces.size());
    for (std::size_t index = 0; index < hierarchy.nodes.size(); ++index) {
        const HierarchyNode& node = hierarchy.nodes[index];
        if (is_leaf(node)) {
            std::fill_n(
                leaf_of_piece.begin() + node.first_piece,
                node.piece_count,
                static_cast<std::uint32_t>(index)
            );
        }
    }
    std::vector<char> seen;
    std::uint64_t split_objects = 0;
    for (std::size_t begin = 0; begin < by_item.size();) {
        const ItemId item = hierarchy.pieces[by_item[begin]].item;
        const std::string name = "hierarchy: item " + std::to_string(index_of(item)) + ": ";
        std::size_t end = begin;
        std::uint64_t total = 0;
        for (; end < by_item.size() && hierarchy.pieces[by_item[end]].item == item; ++end) {
            total += hierarchy.pieces[by_item[end]].count;
        }
        if (std::binary_search(whole.begin(), whole.end(), item)) {
            return fail(ErrorCode::bad_data, name + "whole in one leaf, split in another");
        }
        seen.assign(total, 0);
        bool in_one_leaf = true;
        for (std::size_t position = begin; position < end; ++position) {
            const Piece& piece = hierarchy.pieces[by_item[position]];
            in_one_leaf =
                in_one_leaf && leaf_of_piece[by_item[position]] == leaf_of_piece[by_item[begin]];
            for (std::uint32_t offset = 0; offset < piece.count; ++offset) {
                const std::uint32_t primitive = hierarchy.primitives[piece.first + offset];
                if (primitive >= total) {
                    return fail(
                        ErrorCode::bad_data,
                        name + "primitive " + std::to_string(primitive) + ", though it has " +
                            std::to_string(total)
                    );
                }
                if (seen[primitive] != 0) {
                    return fail(
                        ErrorCode::bad_data,
                        name + "primitive " + std::to_string(primitive) + " lies in two places"
                    );
                }
                seen[primitive] = 1;
            }
        }
        split_objects += in_one_leaf ? 0U : 1U;
        begin = end;
    }
    if (hierarchy.quality.split_objects != split_objects) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: quality.split_objects is " +
                std::to_string(hierarchy.quality.split_objects) + ", expected " +
                std::to_string(split_objects)
        );
    }
    if (hierarchy.quality.cut_items > hierarchy.items.size()) {
        return fail(
            ErrorCode::bad_data,
            "hierarchy: quality.cut_items is " + std::to_string(hierarchy.quality.cut_items) +
                ", there are " + std::to_string(hierarchy.items.size()) + " items"
        );
    }
    return {};
}

} // namespace

std::uint64_t memory_bytes(const Hierarchy& hierarchy) noexcept {
    return hierarchy.nodes.capacity() * sizeof(HierarchyNode) +
           hierarchy.items.capacity() * sizeof(ItemId) +
           hierarchy.pieces.capacity() * sizeof(Piece) +
           hierarchy.primitives.capacity() * sizeof(std::uint32_t) +
           hierarchy.block_boxes.capacity() * sizeof(Box3f) +
           hierarchy.guests.capacity() * sizeof(Piece) +
           hierarchy.whole_pieces_boxes.capacity() * sizeof(Box3f) +
           hierarchy.item_boxes.capacity() * sizeof(Box3f) +
           hierarchy.item_primitives.capacity() * sizeof(std::uint64_t) +
           hierarchy.item_places.capacity() * sizeof(std::uint32_t) +
           hierarchy.moving.capacity() * sizeof(MovingItem);
}

Result<void> validate(const Hierarchy& hierarchy) {
    for (const auto check :
         {check_root,
          check_pieces,
          check_guests,
          check_item_tables,
          check_nodes,
          check_membership}) {
        if (auto checked = check(hierarchy); !checked) {
            return checked;
        }
    }
    return {};
}

} // namespace farfield
