#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/image_plane.hpp>
#include <farfield/metric/outcome.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace farfield {

/// Closed ball; with radius 0 a point.
template <typename T>
struct Ball {
    glm::vec<3, T> center{T(0)};
    T radius = 0; ///< >= 0

    friend bool operator==(const Ball&, const Ball&) = default;
};

/// True when the ball holds the point.
template <typename T>
[[nodiscard]] bool contains(const Ball<T>& ball, const glm::vec<3, T>& p) noexcept {
    return metric::detail::length(p - ball.center) <= ball.radius;
}

/// Safety zone: how far a viewer may move away from the viewpoint of an image, in any direction,
/// before a point and its place in the image come apart by more than an angle. It depends on that
/// angle only, not on where the viewer looks.
namespace metric {

namespace detail {

/// Equation 4 with the distance `apart` of point and image given, where it is known to more digits
/// than the difference of the others.
template <typename T>
[[nodiscard]] T zone_radius(T to_point, T to_image, T apart, T epsilon) noexcept {
    const T nearer = std::min(to_point, to_image);
    if (apart == T(0) || epsilon >= std::numbers::pi_v<T> / 2) {
        return nearer;
    }
    const T farther = std::max(to_point, to_image);
    const T unit = power_of_two<T>(-exponent_of(farther));
    // Radius of the circles through both points that see them under epsilon; infinite for 0.
    const T radius = apart * unit / (2 * std::sin(epsilon));
    const T mean = std::sqrt(farther * unit) * std::sqrt(nearer * unit);
    return std::min(nearer, nearer * (farther * unit / (std::hypot(mean, radius) + radius)));
}

template <typename T>
[[nodiscard]] MetricOutcome
check_zone(const ImagePlane<T>& image, const Box3<T>& box, T epsilon) noexcept {
    const MetricOutcome outcome = check_image(image, box, std::isfinite(epsilon));
    if (outcome == MetricOutcome::ok && epsilon < T(0)) {
        return MetricOutcome::err_eps;
    }
    return outcome;
}

} // namespace detail

/// Radius of the largest ball around an image's viewpoint from which one point and its image are
/// seen under no more than `epsilon`; attained on the ball.
///
///     s = |h - h~|,  r = s / (2 sin epsilon)
///     d = h h~ / (sqrt(h h~ + r^2) + r)     [ = sqrt(h h~ + r^2) - r, which cancels ]
///     d = min(h, h~)                        epsilon >= pi/2
///
/// Symmetric, so it holds on both sides of the image plane; never more than min(h, h~), which is
/// also the value for h = h~.
/// @param to_point [length] h > 0, distance of the point from the viewpoint
/// @param to_image [length] h~ > 0, distance of its image
/// @param epsilon [rad] >= 0
/// @return [length of the input], relative error within 8 units of rounding, without overflow
/// @par Source Shade et al. 1996, section 3, equations 2 to 4. There h is the distance of the
/// point, which is right only for points before the plane.
template <typename T>
[[nodiscard]] T safety_distance_unchecked(T to_point, T to_image, T epsilon) noexcept {
    FARFIELD_ASSERT(to_point > T(0) && to_image > T(0) && epsilon >= T(0));
    return detail::zone_radius(to_point, to_image, std::abs(to_point - to_image), epsilon);
}

/// The same with all input judged.
/// @return the radius with ok, or err_nonfinite, err_eps or err_distance
template <typename T>
[[nodiscard]] Measured<T> safety_distance(T to_point, T to_image, T epsilon) noexcept {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    if (!std::isfinite(to_point) || !std::isfinite(to_image) || !std::isfinite(epsilon)) {
        return {kNone, MetricOutcome::err_nonfinite};
    }
    if (epsilon < T(0)) {
        return {kNone, MetricOutcome::err_eps};
    }
    if (to_point <= T(0) || to_image <= T(0)) {
        return {kNone, MetricOutcome::err_distance};
    }
    return {safety_distance_unchecked(to_point, to_image, epsilon), MetricOutcome::ok};
}

/// Least safety distance of the eight corners of a box: the paper's estimate, **not a bound**. Up
/// to 1.7 times too large half a diagonal before the box, 8 times nearer, and for an image plane in
/// front of the box it may reach behind the plane.
/// @param epsilon [rad] >= 0
/// @return [length of the input]
/// @pre check(image, box) == MetricOutcome::ok
/// @par Source Shade et al. 1996, section 3
template <typename T>
[[nodiscard]] T corner_safety_distance_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, T epsilon
) noexcept {
    FARFIELD_ASSERT(detail::check_zone(image, box, epsilon) == MetricOutcome::ok);
    const auto n = detail::scaled(image.normal).direction;
    const auto to_plane = detail::scaled<T>(image.point - image.viewpoint);
    const T depth = glm::dot(n, to_plane.direction);
    T least = std::numeric_limits<T>::infinity();
    for (unsigned index = 0; index < 8; ++index) {
        const glm::vec<3, T> point = corner(box, index);
        const auto ray = detail::scaled<T>(point - image.viewpoint);
        const auto off_plane = detail::scaled<T>(image.point - point);
        // Lengths in units of the ray's exponent; the ratio of depths takes the ray to the image.
        const T length = glm::length(ray.direction);
        const T z = glm::dot(n, ray.direction);
        const T to_image =
            detail::times_power_of_two(std::abs(length * (depth / z)), to_plane.exponent);
        const T apart = detail::times_power_of_two(
            std::abs(length * (glm::dot(n, off_plane.direction) / z)), off_plane.exponent
        );
        const T to_point = detail::times_power_of_two(length, ray.exponent);
        least = std::min(least, detail::zone_radius(to_point, to_image, apart, epsilon));
    }
    return least;
}

/// The same with all input judged.
/// @return the radius with ok, or the error of `check(image, box)`, or err_eps
template <typename T>
[[nodiscard]] Measured<T>
corner_safety_distance(const ImagePlane<T>& image, const Box3<T>& box, T epsilon) noexcept {
    return detail::judged<T>(detail::check_zone(image, box, epsilon), [&] {
        return corner_safety_distance_unchecked(image, box, epsilon);
    });
}

/// Radius of a ball around an image's viewpoint in which **no** point of a box comes apart from its
/// image by more than `epsilon`; never too large, rounding included. With z = n.(a - v0) for a unit
/// normal, e = D - z and K(z) = 2 D sin epsilon / (|e| + sqrt(e^2 + 4 z D sin^2 epsilon)), which is
/// taken at the least and the greatest depth of the box,
///
///     d = min(D, max(min(z0 K0, z1 K1), rho min(K0, K1)))
///
/// where rho is the distance of the box. The ball stays before the image plane and out of the box.
/// Beyond 0.6 diagonals the median is 0.98 of the largest such ball or more.
/// @param epsilon [rad] >= 0; what is above pi/2 counts as pi/2
/// @return [length of the input] >= 0
/// @pre check(image, box) == MetricOutcome::ok
/// @par Cost About 80 operations and three calls into the C library
template <typename T>
[[nodiscard]] T safety_distance_bound_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, T epsilon
) noexcept {
    FARFIELD_ASSERT(detail::check_zone(image, box, epsilon) == MetricOutcome::ok);
    using Vector = glm::vec<3, T>;
    constexpr T kUnit = detail::kUnitRoundoff<T>;
    if (epsilon == T(0)) {
        return T(0);
    }
    const Vector a_lo = box.lo - image.viewpoint;
    const Vector a_hi = box.hi - image.viewpoint;
    const Vector c_lo = image.point - box.lo;
    const Vector c_hi = image.point - box.hi;
    const Vector to_plane = image.point - image.viewpoint;
    const int exponent = std::max(
        detail::exponent_of(detail::largest_component(to_plane)),
        detail::exponent_of(detail::largest_component(glm::max(glm::abs(a_lo), glm::abs(a_hi))))
    );
    const T unit = detail::power_of_two<T>(-exponent);

    Vector n = glm::normalize(detail::scaled(image.normal).direction);
    T depth = glm::dot(n, to_plane * unit);
    if (depth < T(0)) {
        n = -n;
        depth = -depth;
    }
    depth -= 8 * kUnit * glm::length(to_plane * unit);
    if (depth <= T(0)) {
        return T(0);
    }
    const T e_slack = 8 * kUnit * glm::length(glm::max(glm::abs(c_lo), glm::abs(c_hi)) * unit);
    const T sine = std::sin(std::min(epsilon, std::numbers::pi_v<T> / 2));
    const auto ratio = [&](T z, T e) {
        const T e_bound = (std::abs(e) + e_slack) / sine;
        return 2 * depth / (e_bound + std::hypot(e_bound, 2 * std::sqrt(z * depth)));
    };
    const auto sum = [](const Vector& v) { return v.x + v.y + v.z; };
    const Vector z_lo = n * (a_lo * unit);
    const Vector z_hi = n * (a_hi * unit);
    const Vector e_lo = n * (c_lo * unit);
    const Vector e_hi = n * (c_hi * unit);
    // The nearest point has the greatest e: both fall along the normal.
    const T z_least = std::max(sum(glm::min(z_lo, z_hi)), T(0));
    const T z_most = std::max(sum(glm::max(z_lo, z_hi)), T(0));
    const T k_least = ratio(z_least, sum(glm::max(e_lo, e_hi)));
    const T k_most = ratio(z_most, sum(glm::min(e_lo, e_hi)));
    const T distance = glm::length(glm::max(glm::max(a_lo, -a_hi), Vector(T(0))) * unit);
    const T by_depth = std::min(z_least * k_least, z_most * k_most);
    const T by_distance = distance * std::min(k_least, k_most);
    const T radius = std::min(depth, std::max(by_depth, by_distance)) * (1 - 32 * kUnit);
    return detail::times_power_of_two(radius, exponent);
}

/// The same with all input judged.
/// @return the radius with ok, or the error of `check(image, box)`, or err_eps
template <typename T>
[[nodiscard]] Measured<T>
safety_distance_bound(const ImagePlane<T>& image, const Box3<T>& box, T epsilon) noexcept {
    return detail::judged<T>(detail::check_zone(image, box, epsilon), [&] {
        return safety_distance_bound_unchecked(image, box, epsilon);
    });
}

/// Largest axis-parallel cube in a ball, half side radius / sqrt(3), rounded inwards. A cube loses
/// 63 % of the volume; it is for zones that are intersected as boxes.
/// @return never empty: at least the centre
template <typename T>
[[nodiscard]] Box3<T> inscribed_cube(const Ball<T>& ball) noexcept {
    FARFIELD_ASSERT(ball.radius >= T(0));
    constexpr T kInfinity = std::numeric_limits<T>::infinity();
    const T half = ball.radius * std::numbers::inv_sqrt3_v<T> * (1 - 4 * detail::kUnitRoundoff<T>);
    Box3<T> cube;
    for (int axis = 0; axis < 3; ++axis) {
        const T middle = ball.center[axis];
        // The difference is rounded to nearest, so one step inwards is enough.
        cube.lo[axis] = std::min(middle, std::nextafter(middle - half, kInfinity));
        cube.hi[axis] = std::max(middle, std::nextafter(middle + half, -kInfinity));
    }
    return cube;
}

} // namespace metric

} // namespace farfield
