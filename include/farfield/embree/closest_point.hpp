#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/surface_finder.hpp>
#include <farfield/scene/scene.hpp>

#include <memory>

namespace farfield::embree {

/// Finds closest points of a mesh with Embree's hierarchy over its triangles; distances themselves
/// are computed in double. Of any size, however large or small: what is found is the closest but
/// for 4e-7 of the mesh's extent.
class ClosestPointFinder final : public SurfaceFinder {
  public:
    /// Copies what it needs of the mesh.
    /// @param mesh of a scene that passed `validate`; not needed afterwards
    /// @return `invalid_argument` for a mesh without triangles, `device` where Embree does not
    /// start, `out_of_memory`
    /// @par Cost about a microsecond a triangle
    [[nodiscard]] static Result<std::unique_ptr<ClosestPointFinder>> create(const Mesh& mesh);

    ~ClosestPointFinder() override;

    /// @par Cost about 2 us a point near the surface, more far from it
    void find(std::span<const glm::vec3> points, std::span<SurfacePoint> closest)
        const noexcept override;

  private:
    struct Impl;
    explicit ClosestPointFinder(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::embree
