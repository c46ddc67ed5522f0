#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/metric/camera_pose.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/outcome.hpp>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

namespace farfield {

/// An axis-parallel cube.
template <typename T>
struct Cube {
    glm::vec<3, T> center{T(0)};
    T edge = 0; ///< [length] >= 0
};

/// How large a cube is on the screen [px]. All infinite where a corner is beside or behind the eye.
template <typename T>
struct ProjectedSize {
    T width_px = 0;    ///< of the screen-parallel rectangle around it
    T height_px = 0;   ///< of the same
    T diameter_px = 0; ///< largest distance of two projected corners; no less than either
};

/// A projected size and what became of it: ok, pi_behind (infinite) or an error (NaN).
template <typename T>
struct MeasuredProjectedSize {
    ProjectedSize<T> size;
    MetricOutcome outcome = MetricOutcome::ok;
};

/// Projected size of a cube: whether something so small may be drawn as one colour. "At most one
/// pixel" means that the **diameter** is at most 1.
namespace metric {

namespace detail {

/// A cube before a camera, in units of 2^exponent of its distance.
template <typename T>
struct CubeTerms {
    glm::vec<3, T> center{T(0)};             ///< to the right, up and ahead
    std::array<glm::vec<3, T>, 8> corners{}; ///< the same, relative to the centre
    T radius = 0;                            ///< half the diagonal
    T distance = 0;                          ///< from the eye to the centre
    T least_depth = 0;                       ///< of the corners
};

template <typename T>
[[nodiscard]] CubeTerms<T> cube_terms(const Cube<T>& cube, const CameraPose<T>& pose) noexcept {
    CubeTerms<T> terms;
    const glm::vec<3, T> offset = cube.center - pose.eye;
    const int exponent = exponent_of(std::max(largest_component(offset), cube.edge));
    const T unit = power_of_two<T>(-exponent);
    const T half = cube.edge * unit / 2;
    terms.center = camera_offset<T>(pose, offset * unit);
    terms.radius = half * std::numbers::sqrt3_v<T>;
    terms.distance = glm::length(offset * unit);
    terms.least_depth = std::numeric_limits<T>::infinity();
    for (unsigned index = 0; index < 8; ++index) {
        const glm::vec<3, T> corner(
            (index & 1U) != 0U ? half : -half,
            (index & 2U) != 0U ? half : -half,
            (index & 4U) != 0U ? half : -half
        );
        terms.corners[index] = camera_offset(pose, corner);
        terms.least_depth = std::min(terms.least_depth, terms.center.z + terms.corners[index].z);
    }
    return terms;
}

template <typename T>
[[nodiscard]] MetricOutcome
check_cube(const Cube<T>& cube, const CameraPose<T>& pose, T focal_px) noexcept {
    if (!is_measurable(cube.center) || !is_measurable(cube.edge) || !is_measurable(pose) ||
        !std::isfinite(focal_px)) {
        return MetricOutcome::err_nonfinite;
    }
    if (cube.edge < T(0)) {
        return MetricOutcome::err_distance;
    }
    return focal_px > T(0) ? MetricOutcome::ok : MetricOutcome::err_fov;
}

} // namespace detail

/// Exact size of a cube on the screen. With the centre at (x, y, z) before the camera and a corner
/// (dx, dy, dz) from it, the corner is shown
///
///     f (dx z - x dz) / (z (z + dz))     to the right of the centre, and alike above it
///
/// so that nothing cancels, however far away and small the cube is.
/// @param focal_px [px] pixels per unit tangent, > 0
/// @return [px] relative error within 8 units of rounding of `jacobian_bound_px`; infinite where a
/// corner is beside or behind the eye, so around the eye as well
/// @pre finite numbers, edge >= 0, an orthonormal pose
/// @par Cost About 250 operations
/// @par Source Chamberlain et al. 1996, whose text leaves open what a pixel's size is compared with
template <typename T>
[[nodiscard]] ProjectedSize<T>
projected_size_unchecked(const Cube<T>& cube, const CameraPose<T>& pose, T focal_px) noexcept {
    FARFIELD_ASSERT(detail::check_cube(cube, pose, focal_px) == MetricOutcome::ok);
    const auto terms = detail::cube_terms(cube, pose);
    if (terms.least_depth <= T(0)) {
        constexpr T kInfinity = std::numeric_limits<T>::infinity();
        return {kInfinity, kInfinity, kInfinity};
    }
    using Point = glm::vec<2, T>;
    const T z = terms.center.z;
    std::array<Point, 8> shown{};
    Point lo(T(0));
    Point hi(T(0));
    for (std::size_t i = 0; i < shown.size(); ++i) {
        const glm::vec<3, T>& corner = terms.corners[i];
        const Point side(corner.x, corner.y);
        const Point center(terms.center.x, terms.center.y);
        shown[i] = (side * z - center * corner.z) / (z * (z + corner.z));
        lo = glm::min(lo, shown[i]);
        hi = glm::max(hi, shown[i]);
    }
    T diameter_sq = 0;
    for (std::size_t i = 0; i < shown.size(); ++i) {
        for (std::size_t j = i + 1; j < shown.size(); ++j) {
            const Point apart = shown[i] - shown[j];
            diameter_sq = std::max(diameter_sq, glm::dot(apart, apart));
        }
    }
    return {(hi.x - lo.x) * focal_px, (hi.y - lo.y) * focal_px, std::sqrt(diameter_sq) * focal_px};
}

/// The same with all input judged.
/// @return the size with ok or pi_behind, or err_nonfinite, err_distance (a negative edge) or
/// err_fov (focal_px not positive)
template <typename T>
[[nodiscard]] MeasuredProjectedSize<T>
projected_size(const Cube<T>& cube, const CameraPose<T>& pose, T focal_px) noexcept {
    const MetricOutcome outcome = detail::check_cube(cube, pose, focal_px);
    if (outcome != MetricOutcome::ok) {
        constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
        return {{kNone, kNone, kNone}, outcome};
    }
    const ProjectedSize<T> size = projected_size_unchecked(cube, pose, focal_px);
    return {size, std::isinf(size.diameter_px) ? MetricOutcome::pi_behind : MetricOutcome::ok};
}

/// Bound of the diameter from the sphere around the cube: does not depend on how the cube is
/// turned.
///
///     f 2 R sqrt(d^2 - R^2) / (z^2 - R^2)    where z > R, else infinite;   R = sqrt(3) edge / 2
///
/// Never too small, rounding included. For cubes 20 edges away and more, up to 60 degrees off the
/// axis: 1.06 times the diameter in the median, 1.5 at most.
/// @param focal_px [px] > 0
/// @return [px]
/// @pre as `projected_size_unchecked`
template <typename T>
[[nodiscard]] T
sphere_bound_px_unchecked(const Cube<T>& cube, const CameraPose<T>& pose, T focal_px) noexcept {
    FARFIELD_ASSERT(detail::check_cube(cube, pose, focal_px) == MetricOutcome::ok);
    constexpr T kUnit = detail::kUnitRoundoff<T>;
    const glm::vec<3, T> offset = cube.center - pose.eye;
    const int exponent =
        detail::exponent_of(std::max(detail::largest_component(offset), cube.edge));
    const T unit = detail::power_of_two<T>(-exponent);
    const T distance = glm::length(offset * unit) * (1 + 4 * kUnit);
    const T radius = cube.edge * unit * (std::numbers::sqrt3_v<T> / 2) * (1 + 4 * kUnit);
    // The depth is a sum of three rounded products of a rounded difference.
    const T depth = glm::dot(offset * unit, pose.forward) - 8 * kUnit * distance;
    if (depth <= radius) {
        return std::numeric_limits<T>::infinity();
    }
    const T tangent = std::sqrt((distance - radius) * (distance + radius)) /
                      ((depth - radius) * (depth + radius));
    return focal_px * 2 * radius * tangent * (1 + 16 * kUnit);
}

/// Bound of the diameter from how much the projection stretches at most: tighter in the middle of
/// the screen, twice too large beside it.
///
///     f 2 R sqrt(1 + r^2) / z    with the largest r (tangent off the axis) and the least z of the
///                                corners; infinite where that z is not positive
///
/// Never too small, rounding included. For cubes 20 edges away and more, up to 60 degrees off the
/// axis: 1.09 times the diameter in the median, 1.7 at most.
/// @param focal_px [px] > 0
/// @return [px]
/// @pre as `projected_size_unchecked`
template <typename T>
[[nodiscard]] T
jacobian_bound_px_unchecked(const Cube<T>& cube, const CameraPose<T>& pose, T focal_px) noexcept {
    FARFIELD_ASSERT(detail::check_cube(cube, pose, focal_px) == MetricOutcome::ok);
    constexpr T kUnit = detail::kUnitRoundoff<T>;
    const auto terms = detail::cube_terms(cube, pose);
    const T slack = 8 * kUnit * (terms.distance + terms.radius);
    const T least_depth = terms.least_depth - slack;
    if (least_depth <= T(0)) {
        return std::numeric_limits<T>::infinity();
    }
    T tangent_sq = 0;
    for (const glm::vec<3, T>& corner : terms.corners) {
        const T across = std::hypot(terms.center.x + corner.x, terms.center.y + corner.y) + slack;
        const T tangent = across / (terms.center.z + corner.z - slack);
        tangent_sq = std::max(tangent_sq, tangent * tangent);
    }
    const T stretch = std::sqrt(1 + tangent_sq);
    return focal_px * 2 * terms.radius * stretch / least_depth * (1 + 16 * kUnit);
}

/// Largest angle under which two points of a cube are seen: 2 asin(R / distance), for every view
/// direction. What is at most `angle_of_pixels(scale, 1)` is at most one pixel wherever it is
/// shown.
/// @param distance [length] from the eye to the centre, > 0
/// @param edge [length] >= 0
/// @return [rad] never too small; pi where the eye is in the sphere around the cube
template <typename T>
[[nodiscard]] T cube_angle_unchecked(T distance, T edge) noexcept {
    FARFIELD_ASSERT(distance > T(0) && edge >= T(0));
    constexpr T kUnit = detail::kUnitRoundoff<T>;
    const T sine = edge / distance * (std::numbers::sqrt3_v<T> / 2) * (1 + 8 * kUnit);
    return sine < T(1) ? std::min(2 * std::asin(sine) * (1 + 4 * kUnit), std::numbers::pi_v<T>)
                       : std::numbers::pi_v<T>;
}

/// The same with all input judged.
/// @return the angle with ok, or err_nonfinite or err_distance
template <typename T>
[[nodiscard]] Measured<T> cube_angle(T distance, T edge) noexcept {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    if (!std::isfinite(distance) || !std::isfinite(edge)) {
        return {kNone, MetricOutcome::err_nonfinite};
    }
    if (distance <= T(0) || edge < T(0)) {
        return {kNone, MetricOutcome::err_distance};
    }
    return {cube_angle_unchecked(distance, edge), MetricOutcome::ok};
}

} // namespace metric

} // namespace farfield
