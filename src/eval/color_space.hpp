#pragma once

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/vec3.hpp>

namespace farfield::eval::detail {

/// Of one channel, [0, 1]. Source: IEC 61966-2-1.
[[nodiscard]] double linear_from_srgb(double encoded) noexcept;
[[nodiscard]] double srgb_from_linear(double linear) noexcept;

/// From linear RGB in the primaries of sRGB to CIE XYZ, each as a share of the white point D65:
/// white is (1, 1, 1).
[[nodiscard]] glm::dmat3 xyz_from_linear_rgb() noexcept;

/// CIE L*a*b* of XYZ as shares of the white point, and back.
[[nodiscard]] glm::dvec3 lab_from_xyz(const glm::dvec3& xyz) noexcept;
[[nodiscard]] glm::dvec3 xyz_from_lab(const glm::dvec3& lab) noexcept;

} // namespace farfield::eval::detail
