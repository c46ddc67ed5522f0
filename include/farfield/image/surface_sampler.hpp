#pragma once

#include <farfield/core/ids.hpp>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <span>

namespace farfield {

/// The points `from + t along` with t in [0, 1].
struct SurfaceRay {
    glm::vec3 from{0.0F};  ///< [m]
    glm::vec3 along{0.0F}; ///< [m] not zero
};

/// The first surface that a ray meets.
struct SurfaceHit {
    float t = 2.0F;         ///< [0, 1]; more: nothing is met
    glm::vec3 color{0.0F};  ///< of the surface before it is lit, sRGB-encoded [0, 1]
    glm::vec3 normal{0.0F}; ///< for shading, in the frame of the ray, of length about 1
};

/// Casts rays into surfaces, for those who build from what is seen of them. `farfield::embree`
/// has one of a `Scene`; an engine may write its own. Called by several threads at once.
class SurfaceSampler {
  public:
    SurfaceSampler() = default;
    SurfaceSampler(const SurfaceSampler&) = delete;
    SurfaceSampler& operator=(const SurfaceSampler&) = delete;
    virtual ~SurfaceSampler() = default;

    /// World position that rays of the world are relative to. [m]
    [[nodiscard]] virtual glm::dvec3 origin() const noexcept = 0;

    /// Casts rays.
    /// @param item none: rays are in the world, relative to `origin()`, and
    /// meet every item. Else rays are in the item's own frame, relative to the origin of
    /// its mesh, and meet nothing but that item
    /// @param spacing [m] from a ray to the next: how much of a texture one stands for
    /// @param hits as many as rays
    virtual void cast(
        ItemId item, std::span<const SurfaceRay> rays, float spacing, std::span<SurfaceHit> hits
    ) const noexcept = 0;
};

} // namespace farfield
