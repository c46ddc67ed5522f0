#pragma once

#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/outcome.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <limits>
#include <numbers>

namespace farfield {

/// A flat image of a part of the scene: each point `a` is shown where the ray from `viewpoint`
/// through `a` meets the plane {x : dot(normal, x - point) = 0}.
template <typename T>
struct ImagePlane {
    glm::vec<3, T> viewpoint{T(0)}; ///< where the image was made from, not in the plane
    glm::vec<3, T> point{T(0)};     ///< any point of the plane
    glm::vec<3, T> normal{T(0)};    ///< of any length but zero, to either side
};

namespace metric {

namespace detail {

template <typename T>
[[nodiscard]] MetricOutcome
check_image(const ImagePlane<T>& image, const Box3<T>& box, bool viewer_is_measurable) noexcept {
    const bool measurable = viewer_is_measurable && is_measurable(image.viewpoint) &&
                            is_measurable(image.point) && is_measurable(image.normal) &&
                            is_measurable(box.lo) && is_measurable(box.hi);
    if (!measurable) {
        return MetricOutcome::err_nonfinite;
    }
    if (is_empty(box)) {
        return MetricOutcome::err_box;
    }
    const glm::vec<3, T> normal = scaled(image.normal).direction;
    if (normal == glm::vec<3, T>(T(0))) {
        return MetricOutcome::err_normal;
    }
    const T plane_depth = glm::dot(normal, scaled(image.point - image.viewpoint).direction);
    if (plane_depth == T(0)) {
        return MetricOutcome::err_v0_plane;
    }
    const glm::vec<3, T> ahead = plane_depth > T(0) ? normal : -normal;
    const glm::vec<3, T> lo = box.lo - image.viewpoint;
    const glm::vec<3, T> hi = box.hi - image.viewpoint;
    const T unit = power_of_two<T>(-std::max(scaled(lo).exponent, scaled(hi).exponent));
    const glm::vec<3, T> nearest = glm::min(ahead * (lo * unit), ahead * (hi * unit));
    if (nearest.x + nearest.y + nearest.z <= T(0)) {
        return MetricOutcome::err_behind;
    }
    return MetricOutcome::ok;
}

/// True when the viewer is in the image plane or on the side of it away from the image's viewpoint.
/// @param depth dot(normal, point - viewpoint) of the image, of either sign
template <typename T>
[[nodiscard]] bool sees_back(
    const ImagePlane<T>& image, const glm::vec<3, T>& normal, T depth, const glm::vec<3, T>& viewer
) noexcept {
    const T before = glm::dot(normal, scaled(image.point - viewer).direction);
    return depth > T(0) ? before <= T(0) : before >= T(0);
}

} // namespace detail

/// Whether an image can stand for the contents of a box at all. What this accepts, the `_unchecked`
/// functions of the metrics may be called with, for every viewer with finite coordinates.
/// @return ok, err_nonfinite, err_box, err_normal, err_v0_plane or err_behind
template <typename T>
[[nodiscard]] MetricOutcome check(const ImagePlane<T>& image, const Box3<T>& box) noexcept {
    return detail::check_image(image, box, true);
}

/// The same with a viewer, who must see the front of the image from outside the box.
/// @return as above, or pi_inside or pi_backface
template <typename T>
[[nodiscard]] MetricOutcome
check(const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer) noexcept {
    const MetricOutcome outcome = detail::check_image(image, box, detail::is_measurable(viewer));
    if (outcome != MetricOutcome::ok) {
        return outcome;
    }
    if (contains(box, viewer)) {
        return MetricOutcome::pi_inside;
    }
    const glm::vec<3, T> normal = detail::scaled(image.normal).direction;
    const T depth = glm::dot(normal, detail::scaled(image.point - image.viewpoint).direction);
    return detail::sees_back(image, normal, depth, viewer) ? MetricOutcome::pi_backface
                                                           : MetricOutcome::ok;
}

namespace detail {

/// Value and outcome of a function of an angle; what cannot be measured is not computed.
template <typename T, typename Compute>
[[nodiscard]] Measured<T> judged(MetricOutcome outcome, const Compute& compute) noexcept {
    if (is_error(outcome)) {
        return {std::numeric_limits<T>::quiet_NaN(), outcome};
    }
    return {outcome == MetricOutcome::ok ? compute() : std::numbers::pi_v<T>, outcome};
}

} // namespace detail

} // namespace metric

} // namespace farfield
