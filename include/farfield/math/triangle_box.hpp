#pragma once

#include <farfield/math/box3.hpp>

#include <glm/vec3.hpp>

#include <array>

namespace farfield {

/// Three corners, in any order; they may be collinear or coincide.
using Triangle3d = std::array<glm::dvec3, 3>;

/// Smallest box around a triangle.
[[nodiscard]] inline Box3d bounds(const Triangle3d& triangle) noexcept {
    return unite(unite(unite(Box3d{}, triangle[0]), triangle[1]), triangle[2]);
}

/// True when a triangle and a closed box have a point in common, touching included.
///
/// Separating axes: the box's three, the triangle's normal and the nine products of an edge and an
/// axis. All lengths are taken from a corner of the triangle, so neither the distance from the
/// origin nor the size of what is far away costs digits; the box's own axes are compared exactly.
/// Segments and points, which have no normal, are right too.
///
/// Never false for what meets. Rounding may call a pair that misses by less than some 1e-14 of
/// their sizes together a hit.
/// @param box not empty, finite
/// @param triangle finite; no coordinate of either above 1e100
/// @par Source Akenine-Moeller, Fast 3D Triangle-Box Overlap Testing, 2001; the bounds of the
/// rounding are ours
[[nodiscard]] bool overlaps(const Box3d& box, const Triangle3d& triangle) noexcept;

/// Box around the part of a triangle inside a closed box; empty where there is none.
///
/// The triangle is clipped by the six faces one after the other. The result lies inside `box` and,
/// up to the rounding of the clipped corners (1e-15 of the triangle's edges), inside `bounds`.
/// @param box not empty, finite
[[nodiscard]] Box3d clipped_bounds(const Box3d& box, const Triangle3d& triangle) noexcept;

} // namespace farfield
