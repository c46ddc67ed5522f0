#pragma once

#include <farfield/core/result.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <cstdint>
#include <span>
#include <string>

namespace farfield::partition::detail {

/// Largest coordinate of a box [m]. Sums of three of them, differences included, stay finite in
/// float, so no plane distance of a hierarchy ever overflows.
inline constexpr double kMaxCoordinate = 1e36;

/// A number as error messages show it.
[[nodiscard]] std::string text(double value);

/// A failure when a box is empty, not finite or too far away. `name` says whose box it is; it is
/// called for the message only.
template <typename Name>
[[nodiscard]] Result<void> check_box(const Box3d& box, const Name& name) {
    constexpr const char* kAxes[] = {"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis) {
        const double lo = box.lo[axis];
        const double hi = box.hi[axis];
        // Written so that NaN fails.
        if (!(lo >= -kMaxCoordinate && lo <= kMaxCoordinate)) {
            return fail(
                ErrorCode::bad_data,
                name() + ": lo." + kAxes[axis] + " is " + text(lo) +
                    ", expected a finite number up to 1e36"
            );
        }
        if (!(hi >= -kMaxCoordinate && hi <= kMaxCoordinate)) {
            return fail(
                ErrorCode::bad_data,
                name() + ": hi." + kAxes[axis] + " is " + text(hi) +
                    ", expected a finite number up to 1e36"
            );
        }
        if (lo > hi) {
            return fail(
                ErrorCode::bad_data,
                name() + ": inverted, lo." + kAxes[axis] + " is " + text(lo) + ", hi." +
                    kAxes[axis] + " is " + text(hi)
            );
        }
    }
    return {};
}

/// The same for a point.
template <typename Name>
[[nodiscard]] Result<void> check_point(const glm::dvec3& point, const Name& name) {
    constexpr const char* kAxes[] = {"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis) {
        if (!(point[axis] >= -kMaxCoordinate && point[axis] <= kMaxCoordinate)) {
            return fail(
                ErrorCode::bad_data,
                name() + ": " + kAxes[axis] + " is " + text(point[axis]) +
                    ", expected a finite number up to 1e36"
            );
        }
    }
    return {};
}

/// Checks what every builder needs of its objects: boxes, counts and a callback for primitives.
[[nodiscard]] Result<void>
check_objects(std::span<const Object> objects, const PrimitiveShape& shape);

} // namespace farfield::partition::detail
