#pragma once

#include <farfield/math/view.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/outcome.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace farfield {

/// Where a camera stands and how it is turned. The three directions are orthonormal.
template <typename T>
struct CameraPose {
    glm::vec<3, T> eye{T(0)};
    glm::vec<3, T> right{T(1), T(0), T(0)};
    glm::vec<3, T> up{T(0), T(1), T(0)};
    glm::vec<3, T> forward{T(0), T(0), T(-1)}; ///< the camera looks this way
};

namespace metric {

/// The pose of a view.
[[nodiscard]] inline CameraPose<double> camera_pose(const View& view) noexcept {
    return {view.eye, view.camera_to_world[0], view.camera_to_world[1], -view.camera_to_world[2]};
}

namespace detail {

template <typename T>
[[nodiscard]] bool is_measurable(const CameraPose<T>& pose) noexcept {
    return is_measurable(pose.eye) && is_measurable(pose.right) && is_measurable(pose.up) &&
           is_measurable(pose.forward);
}

/// An offset in the directions of a camera: to the right, up and ahead.
template <typename T>
[[nodiscard]] glm::vec<3, T>
camera_offset(const CameraPose<T>& pose, const glm::vec<3, T>& offset) noexcept {
    return {
        glm::dot(offset, pose.right), glm::dot(offset, pose.up), glm::dot(offset, pose.forward)};
}

} // namespace detail

} // namespace metric

} // namespace farfield
