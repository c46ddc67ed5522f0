#pragma once

#include <farfield/math/box3.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

namespace farfield::partition::detail {

/// One end of an item's extent, or the centre of a primitive, along a direction.
struct Entry {
    float value = 0.0F;
    std::uint32_t index = 0;

    /// Ties are broken by index, so that sorting has one result.
    friend bool operator<(const Entry& a, const Entry& b) noexcept {
        return a.value != b.value ? a.value < b.value : a.index < b.index;
    }
};

/// Extent of an item along a direction, lower < upper: a flat one is given the thickness of one
/// float, so that no plane lies between its two ends and none needs a special case.
struct Extent {
    float lower = 0.0F;
    float upper = 0.0F;
};

/// Halfway, without leaving [a, b].
[[nodiscard]] inline float halfway(float a, float b) noexcept {
    return std::clamp(a * 0.5F + b * 0.5F, a, b);
}

/// Extent of a box along a direction. Every rounding of a float dot product is monotone in each
/// coordinate, so the dot products of the extreme corners bound those of all points of the box
/// exactly, rounding included: a plane between two extents separates the boxes as
/// `signed_distance` computes it.
[[nodiscard]] inline Extent extent_along(const glm::vec3& normal, const Box3f& box) noexcept {
    glm::vec3 low;
    glm::vec3 high;
    for (int axis = 0; axis < 3; ++axis) {
        const bool ascending = normal[axis] >= 0.0F;
        low[axis] = ascending ? box.lo[axis] : box.hi[axis];
        high[axis] = ascending ? box.hi[axis] : box.lo[axis];
    }
    Extent extent{glm::dot(normal, low), glm::dot(normal, high)};
    if (!(extent.lower < extent.upper)) {
        extent.upper = std::nextafter(extent.lower, std::numeric_limits<float>::infinity());
    }
    return extent;
}

/// Middle of an extent, lower <= middle < upper: what a plane does not cut lies on the side of its
/// middle (in front from the plane on, behind before it).
[[nodiscard]] inline float middle(const Extent& extent) noexcept {
    const float value = halfway(extent.lower, extent.upper);
    return value < extent.upper ? value : extent.lower;
}

/// What a node holds along one direction, each list sorted.
struct SortedContents {
    std::span<const Entry> lowers;    ///< of the items' extents
    std::span<const Entry> uppers;    ///< of the items' extents
    std::span<const Entry> fragments; ///< centres of the primitives of splittable objects
};

/// From the first to the last value, 0 for nothing.
[[nodiscard]] float length(const SortedContents& contents) noexcept;

/// What makes one gap better than another.
struct GapRules {
    std::span<const float> weights; ///< of the items, by index
    double item_weight = 0.0;       ///< of all items of the node
    double balance_weight = 0.0;    ///< `BspOptions::balance_weight`
    double shape_penalty = 0.0;     ///< added to the cost: that of the direction
    double max_side = 0.0;          ///< most items that a side may keep
    bool must_not_cut = false;      ///< only gaps without active items
    bool between_fragments = false; ///< also planes beside all items, amid the fragments
};

/// A place for a plane.
struct Gap {
    double cost = 0.0;
    float offset = 0.0F;
    bool found = false;
};

/// The gap of least cost; the first of equal ones. Both sides of it hold something.
[[nodiscard]] Gap best_gap(const SortedContents& contents, const GapRules& rules) noexcept;

/// The value that halves a sorted list best, larger than the first: entries before it and from it
/// on. Not found when all values are equal.
[[nodiscard]] Gap median_gap(std::span<const Entry> sorted) noexcept;

} // namespace farfield::partition::detail
