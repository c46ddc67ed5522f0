#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/math/view.hpp>
#include <farfield/metric/outcome.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace farfield {

/// What pixels mean as angles, for one lens and resolution. Square pixels; where a lens has others,
/// `focal_px` is that of the shorter side, which is the safe one.
template <typename T>
struct PixelScale {
    T focal_px = 0;       ///< pixels per unit tangent, > 0
    T corner_tangent = 0; ///< tangent of the angle between the axis and the farthest image corner

    friend bool operator==(const PixelScale&, const PixelScale&) = default;
};

/// A pixel scale and what became of it: ok, err_nonfinite or err_fov (the scale is then NaN).
template <typename T>
struct MeasuredPixelScale {
    PixelScale<T> scale;
    MetricOutcome outcome = MetricOutcome::ok;
};

/// Pixels and angles. A pixel at the rim of the image is a smaller angle than one at its centre, so
/// an error bound that is to hold everywhere is converted at the farthest corner.
namespace metric {

namespace detail {

/// @param amount of pixels or radians
template <typename T>
[[nodiscard]] MetricOutcome check_pixels(const PixelScale<T>& scale, T amount) noexcept {
    if (!std::isfinite(scale.focal_px) || !std::isfinite(scale.corner_tangent) ||
        !std::isfinite(amount)) {
        return MetricOutcome::err_nonfinite;
    }
    if (scale.focal_px <= T(0) || scale.corner_tangent < T(0)) {
        return MetricOutcome::err_fov;
    }
    return amount < T(0) ? MetricOutcome::err_range : MetricOutcome::ok;
}

} // namespace detail

/// Scale of a symmetric lens: focal_px = (height / 2) / tan(fov_y / 2), corner_tangent = half the
/// image diagonal / focal_px.
/// @param fov_y [rad] vertical field of view, in (0, pi)
/// @param width, height [px] >= 1
template <typename T>
[[nodiscard]] MeasuredPixelScale<T> pixel_scale(T fov_y, int width, int height) noexcept {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    if (!std::isfinite(fov_y)) {
        return {{kNone, kNone}, MetricOutcome::err_nonfinite};
    }
    if (fov_y <= T(0) || fov_y >= std::numbers::pi_v<T> || width < 1 || height < 1) {
        return {{kNone, kNone}, MetricOutcome::err_fov};
    }
    const T half_height = static_cast<T>(height) / 2;
    const T focal = half_height / std::tan(fov_y / 2);
    const T half_diagonal = std::hypot(static_cast<T>(width) / 2, half_height);
    return {{focal, half_diagonal / focal}, MetricOutcome::ok};
}

/// Scale of any lens, asymmetric ones included.
/// @param lens as `validate` accepts it
/// @param width, height [px] >= 1
[[nodiscard]] inline MeasuredPixelScale<double>
pixel_scale(const Lens& lens, int width, int height) noexcept {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(lens.left) || !std::isfinite(lens.right) || !std::isfinite(lens.bottom) ||
        !std::isfinite(lens.top)) {
        return {{kNone, kNone}, MetricOutcome::err_nonfinite};
    }
    if (lens.left >= lens.right || lens.bottom >= lens.top || width < 1 || height < 1) {
        return {{kNone, kNone}, MetricOutcome::err_fov};
    }
    const double focal =
        std::max(width / (lens.right - lens.left), height / (lens.top - lens.bottom));
    const double corner = std::hypot(
        std::max(std::abs(lens.left), std::abs(lens.right)),
        std::max(std::abs(lens.bottom), std::abs(lens.top))
    );
    return {{focal, corner}, MetricOutcome::ok};
}

/// Angle per pixel of a small step at the image centre: the largest. [rad/px]
template <typename T>
[[nodiscard]] T central_pixel_angle(const PixelScale<T>& scale) noexcept {
    return 1 / scale.focal_px;
}

/// Angle per pixel of a small radial step in the farthest corner: the smallest. [rad/px]
template <typename T>
[[nodiscard]] T corner_pixel_angle(const PixelScale<T>& scale) noexcept {
    return 1 / (scale.focal_px * (1 + scale.corner_tangent * scale.corner_tangent));
}

/// Mean angle of a pixel along one axis of the image, the conversion of the papers. **Not
/// conservative**: what it calls one pixel is 1.3 to 2.5 pixels in the corner. [rad]
/// @param fov [rad] field of view along the axis
/// @param resolution [px] along the same axis
template <typename T>
[[nodiscard]] T mean_pixel_angle(T fov, int resolution) noexcept {
    return fov / static_cast<T>(resolution);
}

/// Largest angle that is never more than `pixels` pixels anywhere on the image, for a shown point
/// whose true place may be off the image.
///
///     atan(r + p / f) - atan(r) = atan2(p / f, 1 + r (r + p / f)),   r = corner_tangent, f =
///     focal_px
///
/// Attained: radially, in the corner, outwards.
/// @param pixels [px] >= 0
/// @return [rad]
/// @pre the scale is finite and pixels >= 0
template <typename T>
[[nodiscard]] T angle_of_pixels_unchecked(const PixelScale<T>& scale, T pixels) noexcept {
    FARFIELD_ASSERT(scale.focal_px > T(0) && pixels >= T(0));
    const T step = pixels / scale.focal_px;
    return std::atan2(step, 1 + scale.corner_tangent * (scale.corner_tangent + step));
}

/// The same with all input judged.
/// @return the angle with ok, or err_nonfinite, err_fov or err_range
template <typename T>
[[nodiscard]] Measured<T> angle_of_pixels(const PixelScale<T>& scale, T pixels) noexcept {
    const MetricOutcome outcome = detail::check_pixels(scale, pixels);
    return outcome == MetricOutcome::ok
               ? Measured<T>{angle_of_pixels_unchecked(scale, pixels), outcome}
               : Measured<T>{std::numeric_limits<T>::quiet_NaN(), outcome};
}

/// Largest angle that is never more than `pixels` pixels between two points that are both on the
/// image; larger than `angle_of_pixels`. More pixels than the image diagonal count as the diagonal.
/// @param pixels [px] >= 0
/// @return [rad]
/// @pre the scale is finite and pixels >= 0
template <typename T>
[[nodiscard]] T angle_of_pixels_inside_unchecked(const PixelScale<T>& scale, T pixels) noexcept {
    FARFIELD_ASSERT(scale.focal_px > T(0) && pixels >= T(0));
    const T step = std::min(pixels / scale.focal_px, 2 * scale.corner_tangent);
    return std::atan2(step, 1 + scale.corner_tangent * (scale.corner_tangent - step));
}

/// The same with all input judged.
/// @return the angle with ok, or err_nonfinite, err_fov or err_range
template <typename T>
[[nodiscard]] Measured<T> angle_of_pixels_inside(const PixelScale<T>& scale, T pixels) noexcept {
    const MetricOutcome outcome = detail::check_pixels(scale, pixels);
    return outcome == MetricOutcome::ok
               ? Measured<T>{angle_of_pixels_inside_unchecked(scale, pixels), outcome}
               : Measured<T>{std::numeric_limits<T>::quiet_NaN(), outcome};
}

/// Most pixels that an angle can be anywhere on the image; the inverse of `angle_of_pixels`.
///
///     f tan(theta) (1 + r^2) / (1 - r tan(theta))
///
/// @param angle [rad] >= 0
/// @return [px] infinite where the angle may reach beyond the horizon
/// @pre the scale is finite and angle >= 0
template <typename T>
[[nodiscard]] T pixels_of_angle_unchecked(const PixelScale<T>& scale, T angle) noexcept {
    FARFIELD_ASSERT(scale.focal_px > T(0) && angle >= T(0));
    if (angle >= std::numbers::pi_v<T> / 2) {
        return std::numeric_limits<T>::infinity();
    }
    const T tangent = std::tan(angle);
    const T corner = scale.corner_tangent;
    const T rest = 1 - corner * tangent;
    return rest <= T(0) ? std::numeric_limits<T>::infinity()
                        : scale.focal_px * tangent * (1 + corner * corner) / rest;
}

/// The same with all input judged.
/// @return the number of pixels with ok, or err_nonfinite, err_fov or err_range
template <typename T>
[[nodiscard]] Measured<T> pixels_of_angle(const PixelScale<T>& scale, T angle) noexcept {
    const MetricOutcome outcome = detail::check_pixels(scale, angle);
    return outcome == MetricOutcome::ok
               ? Measured<T>{pixels_of_angle_unchecked(scale, angle), outcome}
               : Measured<T>{std::numeric_limits<T>::quiet_NaN(), outcome};
}

} // namespace metric

} // namespace farfield
