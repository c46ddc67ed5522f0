#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/geometry_source.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>
#include <memory>

namespace farfield::opengl {

/// Draws a `Scene` with OpenGL: indexed, instanced, one call for all instances of a mesh part in a
/// draw list. Transforms are formed relative to the eye in double precision.
///
/// Of OpenGL's state, drawing changes the program, the vertex array, the 2D texture of unit 0 and
/// clip distances 0 to 5, which it leaves off; creating changes nothing.
class SceneSource final : public GeometrySource {
  public:
    /// Uploads meshes and textures; the scene is not needed afterwards.
    /// @param scene one that passed `validate`
    /// @param hierarchy built over the scene's instances, for the primitives of split items; null
    /// when nothing is split. Not needed afterwards.
    [[nodiscard]] static Result<std::unique_ptr<SceneSource>>
    create(const Scene& scene, const Hierarchy* hierarchy);

    ~SceneSource() override;

    [[nodiscard]] Capabilities capabilities() const noexcept override;

    /// @pre items and pieces are those of the scene and the hierarchy
    void draw(const DrawList& list, const PassContext& context) noexcept override;

    /// Bytes of buffers and textures on the device.
    [[nodiscard]] std::uint64_t device_bytes() const noexcept;

  private:
    struct Impl;
    explicit SceneSource(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::opengl
