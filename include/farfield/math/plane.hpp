#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

namespace farfield {

/// Oriented plane {x : dot(normal, x) = offset}; the *front* side is where the normal points.
/// `normal` has unit length unless a function says otherwise.
struct Plane {
    glm::vec3 normal{0.0F, 1.0F, 0.0F};
    float offset = 0.0F; ///< [m] along the normal, in the frame of the points it is used with

    friend bool operator==(const Plane&, const Plane&) = default;
};

/// Signed distance of a point, positive in front. [m]
[[nodiscard]] inline float signed_distance(const Plane& plane, const glm::vec3& p) noexcept {
    return glm::dot(plane.normal, p) - plane.offset;
}

} // namespace farfield
