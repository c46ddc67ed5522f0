#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/detail/box_terms.hpp>
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

/// A box, an image of it on the plane through its centre that faces the image's viewpoint, and a
/// viewer who has moved away from there: all that the closed forms below depend on [length].
template <typename T>
struct ImpostorView {
    T distance = 0;   ///< D > 0 of the centre from the image's viewpoint
    T half_depth = 0; ///< f in [0, D), of the box along the axis from the viewpoint to the centre
    T half_width = 0; ///< W, largest distance of a corner from that axis
    T inwards = 0;    ///< y, how far the viewer has moved along the axis; negative: away
    T sideways = 0;   ///< x >= 0, how far across it
};

/// A view and what became of it: as `check(image, box, viewer)`; after an error all is NaN.
template <typename T>
struct MeasuredImpostorView {
    ImpostorView<T> view;
    MetricOutcome outcome = MetricOutcome::ok;
};

/// Schaufler's tests of an impostor: one angle for motion across the axis, one for motion along it,
/// each as if there were no other, and one for the size of texels. A new image is due when one
/// exceeds the angle of a pixel.
///
/// **Estimates, not bounds**: they are `angular_discrepancy` for two special motions and points.
/// The larger of the first two is 0.97 to 1.00 of the largest corner's angle in the median, 0.44 at
/// worst (motion by 0.3 distances): diagonal motion adds both, boxes seen wide have their worst
/// point elsewhere, and large motions interact. `angular_discrepancy_bound` with `impostor_plane`
/// is the safe side.
namespace metric {

namespace detail {

/// From a box's centre to a point, formed without the centre, whose digits may be few.
template <typename T>
[[nodiscard]] glm::vec<3, T> from_center(const Box3<T>& box, const glm::vec<3, T>& point) noexcept {
    return (point - box.lo) * T(0.5) + (point - box.hi) * T(0.5);
}

/// @param inwards, sideways parts of the viewer's motion to take
template <typename T>
[[nodiscard]] T split_corner_angle(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& motion
) noexcept {
    const Triple<T> viewpoint = triple(image.viewpoint);
    const auto terms = image_terms(
        viewpoint,
        triple(image.point),
        triple(image.normal),
        viewpoint + triple(motion),
        triple(motion)
    );
    return corner_angle(terms, box_terms(terms, box));
}

} // namespace detail

/// The plane of an impostor: through the centre of the box, facing the viewpoint.
template <typename T>
[[nodiscard]] ImagePlane<T>
impostor_plane(const Box3<T>& box, const glm::vec<3, T>& viewpoint) noexcept {
    return {viewpoint, center(box), -detail::from_center(box, viewpoint)};
}

/// Dimensions of an impostor and of the viewer's motion.
/// @param viewpoint of the image
/// @pre check(impostor_plane(box, viewpoint), box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] ImpostorView<T> impostor_view_unchecked(
    const Box3<T>& box, const glm::vec<3, T>& viewpoint, const glm::vec<3, T>& viewer
) noexcept {
    using Vector = glm::vec<3, T>;
    FARFIELD_ASSERT(check(impostor_plane(box, viewpoint), box) == MetricOutcome::ok);
    const auto axis = detail::scaled<T>(-detail::from_center(box, viewpoint));
    const Vector n = glm::normalize(axis.direction);
    const auto half = detail::scaled<T>(extent(box) * T(0.5));
    const auto motion = detail::scaled<T>(viewer - viewpoint);

    ImpostorView<T> view;
    view.distance = detail::times_power_of_two(glm::length(axis.direction), axis.exponent);
    view.half_depth =
        detail::times_power_of_two(glm::dot(glm::abs(n), half.direction), half.exponent);
    // Opposite corners are equally far from the axis: four of them are enough.
    T width = 0;
    for (unsigned index = 0; index < 4; ++index) {
        const Vector offset(
            (index & 1U) != 0U ? half.direction.x : -half.direction.x,
            (index & 2U) != 0U ? half.direction.y : -half.direction.y,
            half.direction.z
        );
        width = std::max(width, glm::length(glm::cross(offset, n)));
    }
    view.half_width = detail::times_power_of_two(width, half.exponent);
    view.inwards = detail::times_power_of_two(glm::dot(motion.direction, n), motion.exponent);
    view.sideways =
        detail::times_power_of_two(glm::length(glm::cross(motion.direction, n)), motion.exponent);
    return view;
}

/// The same with all input judged.
/// @return ok, pi_inside or pi_backface with the view, or the error of `check`
template <typename T>
[[nodiscard]] MeasuredImpostorView<T> impostor_view(
    const Box3<T>& box, const glm::vec<3, T>& viewpoint, const glm::vec<3, T>& viewer
) noexcept {
    MetricOutcome outcome = check(impostor_plane(box, viewpoint), box, viewer);
    if (outcome == MetricOutcome::err_normal) {
        // The viewpoint is the centre, so that no plane through it has a normal.
        outcome = MetricOutcome::err_v0_plane;
    }
    if (is_error(outcome)) {
        constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
        return {{kNone, kNone, kNone, kNone, kNone}, outcome};
    }
    return {impostor_view_unchecked(box, viewpoint, viewer), outcome};
}

/// Angle between the front of the box on the axis and its image, after the motion across alone.
///
///     alpha_trans = atan2(f x, D (D - f) + x^2)
///
/// The back point is never worse.
/// @return [rad] relative error within 64 units of rounding of those of the view
/// @pre half_depth < distance
/// @par Source Schaufler and Stuerzlinger 1996, section 3
template <typename T>
[[nodiscard]] T alpha_trans_unchecked(const ImpostorView<T>& view) noexcept {
    FARFIELD_ASSERT(view.half_depth < view.distance);
    // In units of D, which no angle depends on.
    const T x = view.sideways / view.distance;
    const T f = view.half_depth / view.distance;
    const T front = (view.distance - view.half_depth) / view.distance;
    return std::atan2(f * x, front + x * x);
}

/// Angle between the front and the back of the box on the axis, after the motion across alone: the
/// other reading of the paper's figure, up to twice as strict.
///
///     atan2(2 f x, D^2 - f^2 + x^2)
///
/// @return [rad] as `alpha_trans_unchecked`
/// @pre half_depth < distance
template <typename T>
[[nodiscard]] T alpha_spread_unchecked(const ImpostorView<T>& view) noexcept {
    FARFIELD_ASSERT(view.half_depth < view.distance);
    const T x = view.sideways / view.distance;
    const T f = view.half_depth / view.distance;
    const T front = (view.distance - view.half_depth) / view.distance;
    return std::atan2(2 * f * x, front * (1 + f) + x * x);
}

/// Larger of the angles between the outermost corners, in front and at the back, and their images,
/// after the motion along the axis alone.
///
///     alpha_size = max over s = +-1 of atan2(f W |y|, D (w^2 + W^2) + s f w y),  w = D - s f - y
///
/// @return [rad] as `alpha_trans_unchecked`; pi once the viewer has reached the front of the box
/// @pre half_depth < distance
/// @par Source Schaufler and Stuerzlinger 1996, section 3
template <typename T>
[[nodiscard]] T alpha_size_unchecked(const ImpostorView<T>& view) noexcept {
    FARFIELD_ASSERT(view.half_depth < view.distance);
    const T y = view.inwards / view.distance;
    const T f = view.half_depth / view.distance;
    const T width = view.half_width / view.distance;
    T largest = 0;
    for (const T side : {T(1), T(-1)}) {
        const T w = (view.distance - side * view.half_depth - view.inwards) / view.distance;
        if (w <= T(0)) {
            return std::numbers::pi_v<T>;
        }
        const T along = w * w + width * width + side * f * w * y;
        largest = std::max(largest, std::atan2(f * width * std::abs(y), along));
    }
    return largest;
}

/// Largest angle of the eight corners after the motion across the axis alone: alpha_trans for the
/// box as it is.
/// @return [rad] in [0, pi]
/// @pre as `impostor_view_unchecked`
template <typename T>
[[nodiscard]] T alpha_trans_corners_unchecked(
    const Box3<T>& box, const glm::vec<3, T>& viewpoint, const glm::vec<3, T>& viewer
) noexcept {
    const ImagePlane<T> image = impostor_plane(box, viewpoint);
    const glm::vec<3, T> n = glm::normalize(detail::scaled(image.normal).direction);
    const glm::vec<3, T> motion = viewer - viewpoint;
    return detail::split_corner_angle<T>(image, box, glm::cross(n, glm::cross(motion, n)));
}

/// Largest angle of the eight corners after the motion along the axis alone: alpha_size for the box
/// as it is.
/// @return [rad] in [0, pi]
/// @pre as `impostor_view_unchecked`
template <typename T>
[[nodiscard]] T alpha_size_corners_unchecked(
    const Box3<T>& box, const glm::vec<3, T>& viewpoint, const glm::vec<3, T>& viewer
) noexcept {
    const ImagePlane<T> image = impostor_plane(box, viewpoint);
    const glm::vec<3, T> n = glm::normalize(detail::scaled(image.normal).direction);
    const glm::vec<3, T> motion = viewer - viewpoint;
    return detail::split_corner_angle<T>(image, box, n * glm::dot(motion, n));
}

/// Largest angle under which a texel can be seen: 2 atan(texel / (2 distance)); attained where the
/// middle of a texel is nearest. Texels never show where it is below the **smallest** angle of a
/// pixel, `corner_pixel_angle`.
/// @param texel [length] >= 0, size of a texel: its diagonal where texels may be seen along it
/// @param distance [length] >= 0 from the viewer to the image, or to its plane, which is no more
/// @return [rad] pi for a distance of 0
template <typename T>
[[nodiscard]] T alpha_tex_unchecked(T texel, T distance) noexcept {
    FARFIELD_ASSERT(texel >= T(0) && distance >= T(0));
    return distance == T(0) ? std::numbers::pi_v<T> : 2 * std::atan(texel / distance / 2);
}

/// The same with all input judged.
/// @return the angle with ok, or err_nonfinite or err_distance
template <typename T>
[[nodiscard]] Measured<T> alpha_tex(T texel, T distance) noexcept {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    if (!std::isfinite(texel) || !std::isfinite(distance)) {
        return {kNone, MetricOutcome::err_nonfinite};
    }
    if (texel < T(0) || distance < T(0)) {
        return {kNone, MetricOutcome::err_distance};
    }
    return {alpha_tex_unchecked(texel, distance), MetricOutcome::ok};
}

} // namespace metric

} // namespace farfield
