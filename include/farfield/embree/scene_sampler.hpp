#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/surface_sampler.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/vec3.hpp>

#include <memory>

namespace farfield::embree {

/// Casts rays into a `Scene` with Embree. Holes of materials with a cutoff are holes; textures are
/// filtered as wide as rays are apart.
class SceneSampler final : public SurfaceSampler {
  public:
    /// Copies what it needs of the scene.
    /// @param scene one that passed `validate`; not needed afterwards
    /// @param origin [m] world position that rays of the world are relative to
    /// @return `device` where Embree does not start, `out_of_memory`
    /// @par Cost about a microsecond a triangle of every mesh, less for an instance
    [[nodiscard]] static Result<std::unique_ptr<SceneSampler>>
    create(const Scene& scene, const glm::dvec3& origin);

    ~SceneSampler() override;

    [[nodiscard]] glm::dvec3 origin() const noexcept override;

    void cast(
        ItemId item, std::span<const SurfaceRay> rays, float spacing, std::span<SurfaceHit> hits
    ) const noexcept override;

  private:
    struct Impl;
    explicit SceneSampler(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::embree
