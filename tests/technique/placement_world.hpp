#pragma once

#include "technique/scenes.hpp"
#include <farfield/technique/build_placement.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

/// Worlds of the placement tests, and what their cameras see, cell by cell.
namespace farfield::support {

enum class TreeKind : std::uint8_t { bsp, kdtree, octree };

/// A forest and the primitives of its items, for those who count.
struct PlacementWorld {
    Forest forest;
    std::vector<std::uint64_t> item_primitives; ///< by `ItemId`
};

/// A forest under a tree of any kind.
[[nodiscard]] PlacementWorld make_world(const ForestOptions& options, TreeKind kind);

/// Cubes under a BSP. @param primitives of each
[[nodiscard]] PlacementWorld make_cubes(const std::vector<Box3d>& boxes, std::uint64_t primitives);

/// How much of a box a view lets through, plane by plane in double: a box that is not wholly
/// outside of any of the four sides and the plane through the eye by more than `margin` [m].
[[nodiscard]] bool lets_through(const View& view, const Box3d& box, double margin) noexcept;

/// Primitives of the cells that a view lets through, but those of an image.
/// @param image into `PlacementMap::images`, or UINT32_MAX
[[nodiscard]] std::uint64_t
count_in_view(const PlacementMap& map, const View& view, std::uint32_t image, double margin);

} // namespace farfield::support
