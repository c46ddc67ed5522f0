#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/gpu/geometry_source.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>

namespace farfield::opengl {

/// Draws a `Scene` with OpenGL: indexed, instanced, one call for all instances of a mesh part in a
/// draw list. Transforms are formed relative to the eye in double precision.
///
/// Of OpenGL's state, drawing changes the program, the vertex array, the 2D texture of unit 0 and
/// clip distances 0 to 5, which it leaves off, and where it projects keyframes the 2D textures of
/// units 1 to 16; creating and preparing change nothing.
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

    /// Links a program for each kind of material that the scene has, once. Where the driver keeps
    /// no programs from an earlier run, that takes tens of milliseconds each.
    /// @return `device` for what the driver does not take
    [[nodiscard]] Result<void> prepare_projection(
        std::size_t keyframes, bool whole_triangles, bool positions
    ) noexcept override;

    /// Each selection is one call for every part of its mesh that it has primitives of. The first
    /// one makes a copy of all indices in memory, 4 bytes each; selected ones go to the device with
    /// each draw.
    /// @pre items and pieces are those of the scene and the hierarchy, and what projecting needs
    /// was prepared. Primitives of a selection that its item does not have are not drawn.
    void draw(const DrawList& list, const PassContext& context) noexcept override;

    /// The item stands elsewhere from the next draw on, as if the scene had been made so. What
    /// images show of it is the technique's to know: `partition::update_bounds` says so.
    /// @param object_to_world as `Instance::object_to_world`
    /// @return `not_found` for an item that the scene does not have, `bad_data` for a transform
    /// that `check_placement` refuses; nothing has changed then
    /// @par Cost constant; nothing is uploaded, allocates only for an error
    [[nodiscard]] Result<void> set_transform(ItemId item, const glm::dmat4x3& object_to_world);

    /// Bytes of buffers and textures on the device that the scene takes, and of the buffer of
    /// selected indices; transforms of what is drawn not counted.
    [[nodiscard]] std::uint64_t device_bytes() const noexcept;

  private:
    struct Impl;
    explicit SceneSource(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::opengl
