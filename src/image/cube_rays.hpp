#pragma once

#include <farfield/image/color_cube.hpp>
#include <farfield/image/surface_sampler.hpp>
#include <farfield/math/box3.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace farfield::image {

/// A number in [0, 1) for a ray of a cell: the same on every run, unlike its neighbours'.
[[nodiscard]] float jitter(std::uint32_t seed) noexcept;

/// Directions all around, and rays along each of them.
struct ObliqueCounts {
    std::size_t directions = 0;
    std::size_t each = 0;
};

/// Directions all around and, along each, rays through the silhouette of a box.
struct ObliqueRays {
    std::vector<glm::vec3> directions;
    std::vector<float> silhouettes; ///< [m^2] by direction
    std::vector<SurfaceRay> rays;   ///< as many of each direction, one after the other
};

/// Directions for a cell and rays along them through the silhouette of its box, the same on every
/// run.
void aim(std::uint32_t cell, const Box3f& box, const ObliqueCounts& counts, ObliqueRays& out);

/// Share of the silhouette of a cell's box that it covers, by its colours and gains.
/// @param size of the box
/// @param factor of its level
[[nodiscard]] float alpha_along(
    const ColorCube& cube,
    const glm::vec3& size,
    const glm::vec3& direction,
    const glm::vec3& gains,
    float factor
) noexcept;

} // namespace farfield::image
