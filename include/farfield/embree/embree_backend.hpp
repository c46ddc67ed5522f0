#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <cstdint>
#include <memory>
#include <string>

namespace farfield::embree {

struct EmbreeBackendOptions {
    /// Threads that cast and blend, the caller's included; 0: one for every core. [0, 256] Pictures
    /// do not depend on it.
    unsigned threads = 0;
    /// Keeps surface points beside the colours of every page and target: see
    /// `Backend::read_positions`. For measuring: pages take seven times the memory, and whatever
    /// the plan says there is one sample a pixel.
    bool positions = false;
};

/// Executes frame plans on the CPU by ray casting with Embree 3: no graphics device is needed. It
/// draws a `Scene` itself, as `opengl::SceneSource` does, so there is no geometry source.
///
/// Of each pass the rays go only where the items and pieces listed may be, and meet nothing else.
/// All passes of a batch share the threads. Images are blended in tiles, with 16-bit fractions of
/// colours; a pixel is rounded to 8 bits once, when its pass is over. Textures repeat and are
/// filtered trilinearly, with the footprint of the pixel on the triangle.
///
/// Layered depth images are warped with `LayeredWarper`, once for each sample of a pixel, and then
/// stand among what is cast. Each that a batch shows takes 8 bytes for every sample of the pass;
/// that memory is kept.
///
/// Samples: `n` samples a pixel lie in the `n` rows and columns of the pixel, one in each, after
/// Hammersley; one sample is its centre. They are averaged as encoded. Image quads are filtered
/// once a pixel, at its centre; where they end, and what stands before them, is decided for every
/// sample.
///
/// Plans are checked as `gpu::check_structure` says; that items, pieces, pages and layered images
/// exist is checked as well.
///
/// Scratch pages take 4 bytes a texel, since samples and depths live in tiles only. `image_bytes`
/// counts them as the contract of plans does, 8 bytes a sample, so that budgets and reports of all
/// backends compare.
class EmbreeBackend final : public Backend {
  public:
    /// Copies what it needs of the scene and builds a bounding volume hierarchy over every mesh.
    /// @param scene one that passed `validate`; not needed afterwards
    /// @param hierarchy built over the scene's instances, for the primitives of split items; null
    /// when nothing is split. Not needed afterwards. Split items have the material of the first
    /// part of their mesh.
    /// @return `invalid_argument` for options out of range, `bad_data` for a hierarchy of another
    /// scene, `device` where Embree or its threads do not start, `out_of_memory`
    /// @par Cost about a microsecond a triangle of every mesh; instances cost nothing
    [[nodiscard]] static Result<std::unique_ptr<EmbreeBackend>> create(
        const Scene& scene, const Hierarchy* hierarchy, const EmbreeBackendOptions& options = {}
    );

    ~EmbreeBackend() override;

    /// Blocks until the plan is drawn; allocates nothing once warm.
    [[nodiscard]] Result<void>
    execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept override;
    void finish() noexcept override {}
    [[nodiscard]] Result<TargetId>
    create_target(std::int32_t width, std::int32_t height, std::int32_t samples) noexcept override;
    void destroy_target(TargetId target) noexcept override;
    [[nodiscard]] Result<Picture> read_target(TargetId target) override;
    [[nodiscard]] Result<PositionPicture> read_positions(TargetId target) override;
    [[nodiscard]] Limits limits() const noexcept override;
    /// For instance "Embree 3.13.5, 2 threads".
    [[nodiscard]] std::string device() const override;
    [[nodiscard]] std::uint64_t image_bytes() const noexcept override;
    [[nodiscard]] std::uint64_t position_bytes() const noexcept override;

    /// The item stands elsewhere from the next plan on, as if the scene had been made so. What
    /// images show of it is the technique's to know: `partition::update_bounds` says so.
    /// @param object_to_world as `Instance::object_to_world`
    /// @return `not_found` for an item that the scene does not have, `bad_data` for a transform
    /// that `check_placement` refuses, `unsupported` for one that flattens the mesh, and for an
    /// item that was made flat: those have surfaces of their own; nothing has changed then
    /// @par Cost constant; no hierarchy is built, allocates only for an error
    [[nodiscard]] Result<void> set_transform(ItemId item, const glm::dmat4x3& object_to_world);

    /// Bytes that the scene takes here: vertices, textures and the hierarchies of its meshes.
    [[nodiscard]] std::uint64_t scene_bytes() const noexcept;

  private:
    struct Impl;
    explicit EmbreeBackend(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::embree
