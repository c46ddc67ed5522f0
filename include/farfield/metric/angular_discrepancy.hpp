#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/angle_parts.hpp>
#include <farfield/metric/detail/box_terms.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/image_plane.hpp>
#include <farfield/metric/outcome.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <limits>
#include <numbers>

/// Angular discrepancy: how far apart, as an angle at the viewer, a scene point and its place in an
/// image are. `pixel_angle` turns pixels into such angles.
///
/// Functions come in pairs. The plain one judges its input and says what became of it. The
/// `_unchecked` one is for the frame loop: it may be called for an image and a box of which `check`
/// said ok when they were made, and for every viewer with finite coordinates.
namespace farfield::metric {

namespace detail {

template <typename T>
[[nodiscard]] AngleParts<T> point_parts(
    const ImagePlane<T>& image, const glm::vec<3, T>& viewer, const glm::vec<3, T>& point
) noexcept {
    const auto u = scaled<T>(point - viewer);
    const auto m = scaled<T>(viewer - image.viewpoint);
    const auto n = scaled(image.normal).direction;
    const auto to_plane = scaled<T>(image.point - image.viewpoint);
    const auto off_plane = scaled<T>(image.point - point);
    const T depth = glm::dot(n, to_plane.direction);
    const T e = std::copysign(T(1), depth) * glm::dot(n, off_plane.direction);

    T across = std::abs(e) * glm::length(glm::cross(u.direction, m.direction));
    T along_motion = e * glm::dot(u.direction, m.direction);
    T along_depth = std::abs(depth) * glm::dot(u.direction, u.direction);
    // The larger of the two kinds of terms keeps its scale, so that nothing overflows.
    const int exponent = off_plane.exponent + m.exponent - to_plane.exponent - u.exponent;
    if (exponent > 0) {
        along_depth = times_power_of_two(along_depth, -exponent);
    } else {
        across = times_power_of_two(across, exponent);
        along_motion = times_power_of_two(along_motion, exponent);
    }
    return {across, along_depth + along_motion};
}

} // namespace detail

/// Angle at `viewer` between a point and its image; exact, for this one point.
///
///     u = a - v,  m = v - v0,  e = n.(c - a),  D = n.(c - v0)
///     theta = atan2(|e| |u x m|, D |u|^2 + e (u.m))
///
/// Neither the image of the point nor the cosine of the angle is formed, so nothing cancels; the
/// angle does not depend on the unit of length, and small motions keep all their digits. 0 where
/// the point is on the plane or the viewer at the image's viewpoint; pi between point and image,
/// and where the viewer coincides with either. Which side of the plane the viewer is on does not
/// matter.
/// @return [rad] in [0, pi]; relative error about 1e-6 in float, except next to 0 and pi
/// @pre check(image, {point, point}) == MetricOutcome::ok and the viewer is finite
/// @par Source Shade et al. 1996, section 3, equation 1, in another form
template <typename T>
[[nodiscard]] T angular_discrepancy_unchecked(
    const ImagePlane<T>& image, const glm::vec<3, T>& viewer, const glm::vec<3, T>& point
) noexcept {
    FARFIELD_ASSERT(check(image, Box3<T>{point, point}) == MetricOutcome::ok);
    return detail::angle(detail::point_parts(image, viewer, point));
}

/// The same with all input judged.
/// @return [rad] the angle with ok or pi_degenerate, or err_nonfinite, err_normal, err_v0_plane or
/// err_behind
template <typename T>
[[nodiscard]] Measured<T> angular_discrepancy(
    const ImagePlane<T>& image, const glm::vec<3, T>& viewer, const glm::vec<3, T>& point
) noexcept {
    const MetricOutcome outcome =
        detail::check_image(image, Box3<T>{point, point}, detail::is_measurable(viewer));
    if (outcome != MetricOutcome::ok) {
        return {std::numeric_limits<T>::quiet_NaN(), outcome};
    }
    const auto parts = detail::point_parts(image, viewer, point);
    const bool degenerate = parts.across == T(0) && parts.along == T(0);
    return {detail::angle(parts), degenerate ? MetricOutcome::pi_degenerate : MetricOutcome::ok};
}

/// Largest angular discrepancy of the eight corners of a box: the paper's estimate, cheap, and
/// **not a bound**. The true maximum over the box may lie on an edge or in a face: the estimate is
/// down to 0.6 of it at a distance of one diagonal, 0.1 nearer, and without limit for slabs that
/// are wide compared with their distance. `angular_discrepancy_bound` is the safe side.
/// @return [rad] in [0, pi]; pi where the viewer is in the box or does not see the image's front
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
/// @par Source Shade et al. 1996, section 3
template <typename T>
[[nodiscard]] T corner_discrepancy_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    const auto terms = detail::image_terms(image, box, viewer);
    return detail::corner_angle(terms, detail::box_terms(terms, box));
}

/// The same with all input judged.
/// @return [rad] the estimate with ok, pi_inside or pi_backface, or the error of `check`
template <typename T>
[[nodiscard]] Measured<T> corner_discrepancy(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    return detail::judged<T>(check(image, box, viewer), [&] {
        return corner_discrepancy_unchecked(image, box, viewer);
    });
}

} // namespace farfield::metric
