#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>

namespace farfield {

/// The point of a surface that is closest to another point.
struct SurfacePoint {
    glm::vec3 point{0.0F};      ///< [m]
    std::uint32_t triangle = 0; ///< that it lies on
    float distance = 0.0F;      ///< [m] >= 0
};

/// Finds closest points of one mesh, for those who compare surfaces. `farfield::embree` has one;
/// an engine may write its own. Called by several threads at once.
class SurfaceFinder {
  public:
    SurfaceFinder() = default;
    SurfaceFinder(const SurfaceFinder&) = delete;
    SurfaceFinder& operator=(const SurfaceFinder&) = delete;
    virtual ~SurfaceFinder() = default;

    /// Of closest points that are equally far, any; of triangles that share it, any.
    /// @param points [m] in the frame of the mesh, relative to its origin; finite
    /// @param closest as many as points
    virtual void
    find(std::span<const glm::vec3> points, std::span<SurfacePoint> closest) const noexcept = 0;
};

} // namespace farfield
