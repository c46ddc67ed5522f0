#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/metric/camera_pose.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/outcome.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace farfield {

/// Half the field of view to the side and upwards.
template <typename T>
struct HalfAngles {
    T x = 0; ///< [rad] in (0, pi/2)
    T y = 0; ///< [rad] in (0, pi/2)
};

/// Distances within which eyes are served by images at the points of a cubic grid [length].
template <typename T>
struct StarShape {
    T half_spacing = 0; ///< s = r / (2 tan x): how far before the next point a frustum closes
    /// The paper's 2 r. **Not a bound** but for eyes in a plane of the grid that are turned about
    /// its normal only, and then only for fields of view from 56.2 degrees on.
    T paper_radius = 0;
    /// Exact for eyes in a plane of the grid that are turned about its normal only; none for s > r.
    std::optional<T> planar_radius;
    T guaranteed_radius = 0; ///< holds for every eye and every rotation
};

/// A star shape and what became of it: ok, err_nonfinite, err_fov or err_distance.
template <typename T>
struct MeasuredStarShape {
    StarShape<T> shape;
    MetricOutcome outcome = MetricOutcome::ok;
};

/// Star shapes: from which eyes a set of images, made at the points of a grid, shows all that can
/// be seen. An image at g shows the whole frustum of an eye E exactly if g lies in the frustum of E
/// turned backwards; the star shape around a point is where that holds for some point of the grid.
namespace metric {

/// How far g lies inside the reversed frustum of a camera, in the unit of length: the least of
///
///     z,   tan x z - |(E - g).right|,   tan y z - |(E - g).up|     with z = (E - g).forward
///
/// so it is negative outside and 0 on the boundary, which counts as inside. The images at g must
/// have the camera's orientation (roll included) and field of view; a far plane must lie farther by
/// z.
/// @param half_tangents of the field of view, > 0
/// @return [length] exact but for the rounding of z, 4 units of rounding of |E - g| (2 + tan x +
/// tan y)
/// @pre finite numbers, an orthonormal pose
/// @par Source Aliaga and Lastra 1999, section 3.2, where samples of yaw decide
template <typename T>
[[nodiscard]] T reverse_frustum_margin_unchecked(
    const CameraPose<T>& pose, const glm::vec<2, T>& half_tangents, const glm::vec<3, T>& grid_point
) noexcept {
    FARFIELD_ASSERT(half_tangents.x > T(0) && half_tangents.y > T(0));
    const glm::vec<3, T> behind = detail::camera_offset<T>(pose, pose.eye - grid_point);
    const T to_side = half_tangents.x * behind.z - std::abs(behind.x);
    const T upwards = half_tangents.y * behind.z - std::abs(behind.y);
    return std::min({behind.z, to_side, upwards});
}

/// The same with all input judged.
/// @return the margin with ok, or err_nonfinite, or err_fov for tangents that are not positive
template <typename T>
[[nodiscard]] Measured<T> reverse_frustum_margin(
    const CameraPose<T>& pose, const glm::vec<2, T>& half_tangents, const glm::vec<3, T>& grid_point
) noexcept {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    if (!detail::is_measurable(pose) || !detail::is_measurable(grid_point) ||
        !std::isfinite(half_tangents.x) || !std::isfinite(half_tangents.y)) {
        return {kNone, MetricOutcome::err_nonfinite};
    }
    if (half_tangents.x <= T(0) || half_tangents.y <= T(0)) {
        return {kNone, MetricOutcome::err_fov};
    }
    return {reverse_frustum_margin_unchecked(pose, half_tangents, grid_point), MetricOutcome::ok};
}

/// Whether images made at a grid point show all that the camera sees. Closed: the apex and the
/// faces count as inside.
/// @pre as `reverse_frustum_margin_unchecked`
template <typename T>
[[nodiscard]] bool serves_unchecked(
    const CameraPose<T>& pose, const glm::vec<2, T>& half_tangents, const glm::vec<3, T>& grid_point
) noexcept {
    return reverse_frustum_margin_unchecked(pose, half_tangents, grid_point) >= T(0);
}

/// Radius around a grid point beyond which no pose needs that point: every reversed frustum holds a
/// cone of the smaller half angle, hence a ball as large as the widest gap of the grid, hence
/// another point.
///
///     covering radius (1 + 1 / sin(min(x, y)))
///
/// Never too small, rounding included.
/// @param covering_radius [length] > 0, largest distance of any place from the grid:
/// `cubic_covering_radius` or `odd_level_covering_radius`
/// @return [length] for any eye and any rotation; infinite beyond what the type can hold
template <typename T>
[[nodiscard]] T
guaranteed_star_radius_unchecked(const HalfAngles<T>& angles, T covering_radius) noexcept {
    FARFIELD_ASSERT(angles.x > T(0) && angles.y > T(0) && covering_radius > T(0));
    const T sine = std::sin(std::min(angles.x, angles.y));
    return covering_radius * (1 + 1 / sine) * (1 + 4 * detail::kUnitRoundoff<T>);
}

/// Covering radius of a cubic grid: half the diagonal of a cell. @param spacing [length]
template <typename T>
[[nodiscard]] T cubic_covering_radius(T spacing) noexcept {
    return spacing * (std::numbers::sqrt3_v<T> / 2);
}

/// Covering radius of a cubic grid with a point in the middle of each cell and of each edge, which
/// is the half grid without the middles of faces. @param spacing [length] of the cubic grid
template <typename T>
[[nodiscard]] T odd_level_covering_radius(T spacing) noexcept {
    return spacing / 2;
}

/// Star radii of a cubic grid.
///
///     s = r / (2 tan x),  planar radius = sqrt((r + s)^2 + r^2 / 4) for s <= r
///
/// s <= r from a field of view of 53.1301 degrees on (2 atan(1/2)).
/// @param spacing [length] r > 0
/// @pre both angles in (0, pi/2)
/// @par Source Aliaga and Lastra 1999, section 3.2.1; 54 degrees there is rounded up, and the
/// radius 2 r does not hold there
template <typename T>
[[nodiscard]] StarShape<T> star_shape_unchecked(const HalfAngles<T>& angles, T spacing) noexcept {
    FARFIELD_ASSERT(angles.x > T(0) && angles.y > T(0) && spacing > T(0));
    StarShape<T> shape;
    shape.half_spacing = spacing / (2 * std::tan(angles.x));
    shape.paper_radius = 2 * spacing;
    if (shape.half_spacing <= spacing) {
        shape.planar_radius = std::hypot(spacing + shape.half_spacing, spacing / 2);
    }
    shape.guaranteed_radius =
        guaranteed_star_radius_unchecked(angles, cubic_covering_radius(spacing));
    return shape;
}

/// The same with all input judged.
/// @return the shape with ok, or err_nonfinite, err_fov (an angle outside (0, pi/2)) or
/// err_distance (a spacing that is not positive)
template <typename T>
[[nodiscard]] MeasuredStarShape<T> star_shape(const HalfAngles<T>& angles, T spacing) noexcept {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    const auto rejected = [](MetricOutcome outcome) {
        return MeasuredStarShape<T>{{kNone, kNone, std::nullopt, kNone}, outcome};
    };
    if (!std::isfinite(angles.x) || !std::isfinite(angles.y) || !std::isfinite(spacing)) {
        return rejected(MetricOutcome::err_nonfinite);
    }
    constexpr T kRightAngle = std::numbers::pi_v<T> / 2;
    if (angles.x <= T(0) || angles.y <= T(0) || angles.x >= kRightAngle ||
        angles.y >= kRightAngle) {
        return rejected(MetricOutcome::err_fov);
    }
    if (spacing <= T(0)) {
        return rejected(MetricOutcome::err_distance);
    }
    return {star_shape_unchecked(angles, spacing), MetricOutcome::ok};
}

} // namespace metric

} // namespace farfield
