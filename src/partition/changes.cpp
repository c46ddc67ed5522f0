#include "partition/checks.hpp"
#include "partition/gap.hpp"
#include <farfield/partition/changes.hpp>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

namespace farfield::partition {

namespace {

std::string name_of(ItemId item) {
    return "item " + std::to_string(index_of(item));
}

/// The leaf that a place in `items` belongs to. Ranges of nodes nest, so they are the way there.
std::uint32_t leaf_of(const Hierarchy& hierarchy, std::uint32_t place) noexcept {
    const std::vector<HierarchyNode>& nodes = hierarchy.nodes;
    std::uint32_t index = 0;
    while (!is_leaf(nodes[index])) {
        const std::uint32_t front = nodes[index].first_child + 1;
        index = place < nodes[front].first_item ? front - 1 : front;
    }
    return index;
}

/// The leaf whose cell holds the middle of a box, found as the builders do.
std::uint32_t leaf_at(const Hierarchy& hierarchy, const Box3f& box) noexcept {
    std::uint32_t index = 0;
    while (!is_leaf(hierarchy.nodes[index])) {
        const HierarchyNode& node = hierarchy.nodes[index];
        const float middle = detail::middle(detail::extent_along(node.plane.normal, box));
        index = node.first_child + (middle < node.plane.offset ? 0U : 1U);
    }
    return index;
}

/// What `item_places` says; without it, found among the items.
std::uint32_t place_of(const Hierarchy& hierarchy, ItemId item) noexcept {
    if (hierarchy.item_places.empty() && item != kNone<ItemId>) {
        const auto found = std::find(hierarchy.items.begin(), hierarchy.items.end(), item);
        return found == hierarchy.items.end()
                   ? Hierarchy::kNoPlace
                   : static_cast<std::uint32_t>(found - hierarchy.items.begin());
    }
    return index_of(item) < hierarchy.item_places.size() ? hierarchy.item_places[index_of(item)]
                                                         : Hierarchy::kNoPlace;
}

void count_up(Hierarchy& hierarchy, std::uint32_t leaf) noexcept {
    for (std::uint32_t index = leaf;; index = hierarchy.nodes[index].parent) {
        ++hierarchy.nodes[index].content_version;
        if (index == 0) {
            return;
        }
    }
}

/// Fits boxes and counts from a leaf to the root to what is there now, and counts up versions.
void refit(Hierarchy& hierarchy, std::uint32_t leaf) noexcept {
    std::vector<HierarchyNode>& nodes = hierarchy.nodes;
    nodes[leaf].items_box = {};
    nodes[leaf].item_primitives = 0;
    for (std::uint32_t i = 0; i < nodes[leaf].item_count; ++i) {
        const std::uint32_t place = nodes[leaf].first_item + i;
        nodes[leaf].items_box = unite(nodes[leaf].items_box, hierarchy.item_boxes[place]);
        nodes[leaf].item_primitives += hierarchy.item_primitives[place];
    }
    for (std::uint32_t index = leaf; index != 0;) {
        index = nodes[index].parent;
        const HierarchyNode& behind = nodes[nodes[index].first_child];
        const HierarchyNode& front = nodes[nodes[index].first_child + 1];
        nodes[index].items_box = unite(behind.items_box, front.items_box);
        nodes[index].item_primitives = behind.item_primitives + front.item_primitives;
    }
    count_up(hierarchy, leaf);
}

bool holds(const std::vector<Piece>& pieces, std::size_t first, std::size_t count, ItemId item) {
    const auto begin = pieces.begin() + static_cast<std::ptrdiff_t>(first);
    return std::any_of(begin, begin + static_cast<std::ptrdiff_t>(count), [&](const Piece& piece) {
        return piece.item == item;
    });
}

/// Counts up the nodes under `index`, itself included, that hold a part of a split item.
/// @return whether there are any
bool mark_parts(Hierarchy& hierarchy, std::uint32_t index, ItemId item) noexcept {
    HierarchyNode& node = hierarchy.nodes[index];
    bool found = false;
    if (is_leaf(node)) {
        found = holds(hierarchy.pieces, node.first_piece, node.piece_count, item) ||
                holds(hierarchy.guests, node.first_guest, node.guest_count, item);
    } else if (node.piece_count > 0 || node.guest_count > 0) {
        found = mark_parts(hierarchy, node.first_child, item);
        found = mark_parts(hierarchy, node.first_child + 1, item) || found;
    }
    node.content_version += found ? 1U : 0U;
    return found;
}

bool meets(const Box3f& contents, const Box3f& box) noexcept {
    return !is_empty(contents) && !is_empty(intersect(contents, box));
}

struct Met {
    bool any = false;
    bool surfaces = false;
};

/// Counts up the nodes under `index`, itself included, that have a leaf whose contents meet a box.
Met mark_box(Hierarchy& hierarchy, std::uint32_t index, const Box3f& box) noexcept {
    HierarchyNode& node = hierarchy.nodes[index];
    const bool surfaces = meets(node.pieces_box, box);
    Met met{surfaces || meets(node.items_box, box), surfaces};
    if (met.any && !is_leaf(node)) {
        const Met behind = mark_box(hierarchy, node.first_child, box);
        const Met front = mark_box(hierarchy, node.first_child + 1, box);
        met = {behind.any || front.any, behind.surfaces || front.surfaces};
    }
    node.content_version += met.any ? 1U : 0U;
    return met;
}

/// An error unless the item is a whole one that can move.
Result<void> check_item(const Hierarchy& hierarchy, ItemId item) {
    if (hierarchy.item_boxes.size() != hierarchy.items.size() ||
        (hierarchy.item_places.empty() && !hierarchy.items.empty())) {
        return fail(
            ErrorCode::unsupported,
            name_of(item) + ": cannot move, the hierarchy has " +
                std::to_string(hierarchy.item_boxes.size()) + " item_boxes and " +
                std::to_string(hierarchy.item_places.size()) + " item_places for " +
                std::to_string(hierarchy.items.size()) + " items"
        );
    }
    if (place_of(hierarchy, item) != Hierarchy::kNoPlace) {
        return {};
    }
    if (holds(hierarchy.pieces, 0, hierarchy.pieces.size(), item)) {
        return fail(
            ErrorCode::unsupported, name_of(item) + ": is split, expected a whole item to move"
        );
    }
    return fail(ErrorCode::not_found, name_of(item) + ": the hierarchy does not hold it");
}

/// @pre check_item(hierarchy, item)
void move_to(Hierarchy& hierarchy, ItemId item, const Box3f& box) {
    const std::size_t places = hierarchy.items.size();
    std::uint32_t& place = hierarchy.item_places[index_of(item)];
    if (place >= places) {
        hierarchy.moving[place - places].box = box;
        return;
    }
    hierarchy.moving.push_back(
        {item, box, hierarchy.item_primitives[place], place, hierarchy.item_boxes[place]}
    );
    hierarchy.items[place] = kNone<ItemId>;
    hierarchy.item_boxes[place] = {};
    hierarchy.item_primitives[place] = 0;
    refit(hierarchy, leaf_of(hierarchy, place));
    place = static_cast<std::uint32_t>(places + hierarchy.moving.size() - 1);
}

/// Where an item can settle, or `kNoPlace`. @param leaf receives the leaf of that place
std::uint32_t
free_place(const Hierarchy& hierarchy, const MovingItem& item, std::uint32_t& leaf) noexcept {
    // Asked first: a partition need not put items where their centres are.
    leaf = item.box == item.home_box ? leaf_of(hierarchy, item.home) : leaf_at(hierarchy, item.box);
    const HierarchyNode& node = hierarchy.nodes[leaf];
    const auto is_free = [&](std::uint32_t place) {
        return hierarchy.items[place] == kNone<ItemId>;
    };
    if (item.home - node.first_item < node.item_count && is_free(item.home)) {
        return item.home;
    }
    for (std::uint32_t i = 0; i < node.item_count; ++i) {
        if (is_free(node.first_item + i)) {
            return node.first_item + i;
        }
    }
    return Hierarchy::kNoPlace;
}

} // namespace

void mark_changed(Hierarchy& hierarchy, ItemId item) noexcept {
    const std::uint32_t place = place_of(hierarchy, item);
    if (place == Hierarchy::kNoPlace) {
        hierarchy.surface_version += mark_parts(hierarchy, 0, item) ? 1U : 0U;
    } else if (place < hierarchy.items.size()) {
        count_up(hierarchy, leaf_of(hierarchy, place));
    }
}

void mark_changed(Hierarchy& hierarchy, const Box3d& world_box) noexcept {
    if (is_empty(world_box)) { // or NaN, which would be lost among minima and maxima
        return;
    }
    const Met met = mark_box(hierarchy, 0, local_box(world_box, hierarchy.origin));
    hierarchy.surface_version += met.surfaces ? 1U : 0U;
}

Result<void> update_bounds(Hierarchy& hierarchy, ItemId item, const Box3d& world_box) {
    if (auto checked = check_item(hierarchy, item); !checked) {
        return checked;
    }
    if (auto checked = detail::check_box(world_box, [item] { return name_of(item); }); !checked) {
        return checked;
    }
    move_to(hierarchy, item, local_box(world_box, hierarchy.origin));
    return {};
}

Result<void> hide(Hierarchy& hierarchy, ItemId item) {
    if (auto checked = check_item(hierarchy, item); !checked) {
        return checked;
    }
    move_to(hierarchy, item, {});
    return {};
}

bool settle(Hierarchy& hierarchy, ItemId item) noexcept {
    const std::size_t places = hierarchy.items.size();
    const std::uint32_t from = place_of(hierarchy, item);
    if (from == Hierarchy::kNoPlace) {
        return false;
    }
    if (from < places) {
        return true;
    }
    MovingItem& moving = hierarchy.moving[from - places];
    if (is_empty(moving.box)) {
        return false;
    }
    std::uint32_t leaf = 0;
    const std::uint32_t place = free_place(hierarchy, moving, leaf);
    if (place == Hierarchy::kNoPlace) {
        return false;
    }
    hierarchy.items[place] = item;
    hierarchy.item_boxes[place] = moving.box;
    hierarchy.item_primitives[place] = moving.primitives;
    hierarchy.item_places[index_of(item)] = place;
    if (&moving != &hierarchy.moving.back()) {
        moving = hierarchy.moving.back();
        hierarchy.item_places[index_of(moving.item)] = from;
    }
    hierarchy.moving.pop_back();
    refit(hierarchy, leaf);
    return true;
}

} // namespace farfield::partition
