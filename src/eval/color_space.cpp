#include "color_space.hpp"

#include <glm/matrix.hpp>

#include <cmath>

namespace farfield::eval::detail {

namespace {

constexpr double kDelta = 6.0 / 29.0; // below its cube, L*a*b* is linear

double lab_root(double share) noexcept {
    return share > kDelta * kDelta * kDelta ? std::cbrt(share)
                                            : share / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
}

double lab_cube(double root) noexcept {
    return root > kDelta ? root * root * root : 3.0 * kDelta * kDelta * (root - 4.0 / 29.0);
}

/// XYZ of a chromaticity at Y = 1.
glm::dvec3 from_chromaticity(double x, double y) noexcept {
    return {x / y, 1.0, (1.0 - x - y) / y};
}

} // namespace

double linear_from_srgb(double encoded) noexcept {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

double srgb_from_linear(double linear) noexcept {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

glm::dmat3 xyz_from_linear_rgb() noexcept {
    const glm::dvec3 white = from_chromaticity(0.3127, 0.3290);
    glm::dmat3 matrix(
        from_chromaticity(0.64, 0.33), from_chromaticity(0.30, 0.60), from_chromaticity(0.15, 0.06)
    );
    const glm::dvec3 amounts = glm::inverse(matrix) * white; // of the primaries in white
    for (int primary = 0; primary < 3; ++primary) {
        matrix[primary] *= amounts[primary] / white;
    }
    return matrix;
}

glm::dvec3 lab_from_xyz(const glm::dvec3& xyz) noexcept {
    const glm::dvec3 root(lab_root(xyz.x), lab_root(xyz.y), lab_root(xyz.z));
    return {116.0 * root.y - 16.0, 500.0 * (root.x - root.y), 200.0 * (root.y - root.z)};
}

glm::dvec3 xyz_from_lab(const glm::dvec3& lab) noexcept {
    const double y = (lab.x + 16.0) / 116.0;
    return {lab_cube(y + lab.y / 500.0), lab_cube(y), lab_cube(y - lab.z / 200.0)};
}

} // namespace farfield::eval::detail
