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
    /// World up, any length but zero.
    glm::dvec3 up{0.0, 1.0, 0.0};
    /// Overlap of split surfaces in images, fraction of a cell's extent, half on each side. [0, 1]
    float inflation = 0.17F;
    /// A leaf is kept whole rather than cut an item while it holds at most this many. [1, 2^20]
    std::uint32_t max_items = 8;
    /// A leaf with more primitives of split surfaces than this is split further. >= 1
    std::uint32_t max_piece_primitives = 4096;
    /// Deepest level; what is left there becomes one leaf. [0, 64]
    std::uint32_t max_depth = 48;
    /// Weight of balance against active items in the cost of a gap: cost = active + balance_weight
    /// * (1 - smaller / larger half in primitives). >= 0
    float balance_weight = 1.0F;
};

/// Builds a BSP by gaps.
///
/// Along each direction the lower and upper extents of the items are sorted once and kept sorted
/// down the tree; a scan counts the *active* items, those whose extents the plane would cut. Gaps
/// are the intervals where that count is a local minimum; each is judged by its active items and by
/// the balance of primitives on its two sides, and the best gap of the direction with the longest
/// extent is preferred. Items go to the side that holds their centre; splittable objects go by the
/// centres of their primitives.
///
/// @param objects finite, not inverted boxes; may be empty (a lone, empty root)
/// @param primitive_bounds needed when an object is splittable
/// @return the tree, or an error that names the object and the value. The same for every run.
/// @par Cost O(n d log n) time for d directions, O(n d) memory
/// @par Source Shade et al. 1996, section 4. Departures: costs in primitives of both kinds, items
/// are never duplicated, splitting stops by `max_items` rather than by a gap's absence alone.
[[nodiscard]] Result<Hierarchy> build_bsp(
    std::span<const Object> objects,
    const BspOptions& options = {},
    const PrimitiveBounds& primitive_bounds = {}
);

} // namespace farfield::partition
