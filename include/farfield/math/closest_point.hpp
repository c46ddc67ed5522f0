#pragma once

#include <glm/vec3.hpp>

#include <array>

namespace farfield {

/// The point of a triangle nearest to `p`; of a degenerate one, of its edges. In the unit of its
/// arguments, relative error some units of rounding of the largest coordinate.
[[nodiscard]] glm::dvec3
closest_point(const glm::dvec3& p, const std::array<glm::dvec3, 3>& triangle) noexcept;

} // namespace farfield
