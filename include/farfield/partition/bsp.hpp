#pragma once

#include <farfield/core/result.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>

namespace farfield::partition {

/// How `build_bsp` partitions.
struct BspOptions {
    /// Plane normals: this many directions that evenly divide the half circle around `up`; 2 gives
    /// the horizontal axes. [1, 64]
    std::uint32_t directions = 2;
    /// Planes perpendicular to `up` as well, for scenes with storeys.
    bool split_vertically = false;
    /// World up, finite, any length but zero.
    glm::dvec3 up{0.0, 1.0, 0.0};
    /// Overlap of split surfaces in images, fraction of a cell's extent, half on each side. [0, 1]
    float inflation = 0.17F;
    /// A leaf is kept whole rather than cut an item while it holds at most this many. [1, 2^20]
    std::uint32_t max_items = 8;
    /// A leaf with more primitives of split surfaces than this is split further, between its items
    /// where that is possible, through them where it is not. >= 1
    std::uint32_t max_piece_primitives = 4096;
    /// Deepest level; what is left there becomes one leaf. [0, 64]
    std::uint32_t max_depth = 48;
    /// Worth of balance and of shape in the cost of a gap, as a fraction of the node's items: at
    /// 0.02 a node of a thousand items would sooner cut 20 of them than peel off a single one.
    /// 0 looks at cut items alone. Finite, >= 0; 0.005 to 0.1 are sensible.
    float balance_weight = 0.02F;
};

/// Builds a BSP by gaps.
///
/// Along each direction the lower and upper extents of the items are sorted once and kept sorted
/// down the tree; a scan counts the *active* items, those whose extents a plane would cut. Gaps
/// are the intervals where that count is a local minimum; a plane goes through the middle of the
/// gap of least cost:
///
///     cost = active / items + balance_weight * (imbalance^2 + 1 - extent / longest extent)
///
/// `imbalance` is the difference of the two sides in primitives over their sum; the extents are
/// those of the node's contents along the gap's direction and along the longest of all directions,
/// so that boxes tend to cubes. Items go to the side that holds the centre of their extent, split
/// objects by the centres of their primitives' boxes. Where every plane cuts most items (boxes in
/// boxes, heaps) and a leaf would hold too much, the node is halved by the centres of its items;
/// so it is where the gaps there are only peel off single items level after level.
///
/// Splitting ends with one item and few pieces, so that most leaves hold one item; more than
/// `max_items` stay together only where nothing tells their centres apart or at `max_depth`.
///
/// An item that no plane above it cuts lies on its own side of each of them exactly, in float: for
/// every point p of its world box, `signed_distance(plane, local_point(p, origin))` is >= 0 in
/// front and <= 0 behind. Boxes that only touch are not cut.
///
/// @param objects finite, not inverted boxes with coordinates up to 1e36 [m]; at most 2^32 - 2
/// objects, at most 2^32 - 1 primitives in the splittable ones, at most 2^64 - 1 primitives
/// altogether; may be empty (a lone, empty root). A splittable object without primitives lies
/// nowhere.
/// @param primitive_bounds needed when a splittable object has primitives; called once for each of
/// them, in order; the same limits hold for its boxes
/// @return the tree, or an error that names the object or the option and the value. The same tree
/// on every run.
/// @par Cost O(n d (log n + depth)) time for n items and primitives of splittable objects and d
/// directions; depth is about log2(n), and at most `max_depth`. Memory O(n d): 24 bytes an item and
/// 8 bytes a primitive for each direction.
/// @par Source Shade et al. 1996, section 4. Departures: costs in primitives of both kinds, items
/// are never duplicated, splitting stops by `max_items` rather than by a gap's absence alone;
/// active items are weighed as a fraction of the node's, because with a fixed price of a cut a
/// dense scene loses its outliers one by one and never gets deeper than its rim.
[[nodiscard]] Result<Hierarchy> build_bsp(
    std::span<const Object> objects,
    const BspOptions& options = {},
    const PrimitiveBounds& primitive_bounds = {}
);

} // namespace farfield::partition
