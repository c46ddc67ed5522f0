#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/partition/hierarchy.hpp>

/// How a hierarchy follows a world that changes: an engine calls these between two plans, for what
/// happened since, and every technique over the hierarchy draws what is there now.
///
///     partition::mark_changed(tree, lamp);             // looks different where it stands
///     partition::update_bounds(tree, cart, new_box);   // moves: drawn as geometry from here on
///     partition::settle(tree, cart);                   // came to rest: images may show it again
///
/// Where and how an item is drawn is the geometry source's business, and has to be told there too.
/// None may run while a technique plans. Planes and cells stay as they were built: a world in which
/// much has moved for good is better built anew.
namespace farfield::partition {

/// The item looks different: images that show it are stale. Of a whole item at rest the leaf and
/// all nodes above it count up their `content_version`; of a split item every leaf that holds
/// pieces or guests of it, the nodes above those once each, and `surface_version`. An item that
/// moves is in no image, and an item that the hierarchy does not hold is nowhere: nothing changes.
/// @par Cost O(depth) for a whole item, O(nodes + pieces + guests) for a split one; without
/// `Hierarchy::item_places` a whole item is looked for in `items`. Allocates nothing
void mark_changed(Hierarchy& hierarchy, ItemId item) noexcept;

/// Something changed in a part of the world, a light or the weather: the same for every leaf of
/// which the box around its items or that around its pieces meets the closed box, and for
/// `surface_version` where one around pieces does.
/// @param world_box [m]; may be unbounded. One that is empty or has a NaN meets nothing
/// @par Cost O(nodes) at most, O(nodes met) usually. Allocates nothing
void mark_changed(Hierarchy& hierarchy, const Box3d& world_box) noexcept;

/// The item moves, turns or grows, and `world_box` is around it now. The first call takes it out of
/// its leaf: boxes and counts of the nodes above fit exactly what remains, their `content_version`
/// counts up, and the item joins `Hierarchy::moving`. From then on no image shows it, only its box
/// changes, and no image is touched. Also brings back what was hidden.
/// @param world_box [m] finite, at most 1e36 from 0, not inverted; a point is fine
/// @return an error that names the item and the value, and nothing has changed: `not_found` for an
/// item that the hierarchy does not hold, `unsupported` for a split item and for a hierarchy
/// without `item_boxes`, `bad_data` for the box
/// @par Cost O(items of the leaf + depth) the first time, then O(1). Allocates only for an error,
/// and where `moving` has no capacity left: `moving.reserve` as many as ever move at once
[[nodiscard]] Result<void> update_bounds(Hierarchy& hierarchy, ItemId item, const Box3d& world_box);

/// The item is gone until further notice. It leaves its leaf as with `update_bounds` and stays in
/// `moving` with an empty box, which nothing draws; `update_bounds` brings it back.
/// @return errors and cost as of `update_bounds`
[[nodiscard]] Result<void> hide(Hierarchy& hierarchy, ItemId item);

/// The item came to rest where it was last: it takes a free place in the leaf whose cell holds its
/// centre, images there are stale, boxes grow around it, and it leaves `moving`. Places are free
/// where items have left. An item with the box that it left its place with goes back to that place,
/// and everything but `content_version` is as it was before; only an item that has settled there
/// meanwhile can be in the way.
///
/// As with items that the builder had to cut, what sticks out of its cell is drawn with its leaf,
/// and the order of images around it is not exact.
/// @return true when the item rests in a leaf, as it may have before; false, and nothing has
/// changed, when there is no free place, or nothing to settle: a hidden item, or none of the
/// hierarchy's whole ones. An item without a place may go on moving for as long as it likes; when
/// too many do, build anew
/// @par Cost O(items of the leaf + depth). Allocates nothing
[[nodiscard]] bool settle(Hierarchy& hierarchy, ItemId item) noexcept;

/// Where a whole item is now, relative to the origin: empty while it is hidden, and for what is no
/// whole item or has no box.
/// @par Cost O(1)
[[nodiscard]] inline Box3f item_box(const Hierarchy& hierarchy, ItemId item) noexcept {
    if (index_of(item) >= hierarchy.item_places.size()) {
        return {};
    }
    const std::size_t place = hierarchy.item_places[index_of(item)];
    if (place == Hierarchy::kNoPlace) {
        return {};
    }
    const std::size_t places = hierarchy.items.size();
    return place < places ? hierarchy.item_boxes[place] : hierarchy.moving[place - places].box;
}

} // namespace farfield::partition
