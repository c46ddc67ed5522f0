#pragma once

#include "run/color_cubes.hpp"
#include "run/placement.hpp"
#include "run/proxy.hpp"
#include "run/world.hpp"
#include <farfield/core/result.hpp>
#include <farfield/eval/run_report.hpp>
#include <farfield/eval/walk.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/opengl/opengl_backend.hpp>
#include <farfield/technique/color_cubes.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>
#include <farfield/technique/lod_sprite.hpp>
#include <farfield/technique/mesh_lod.hpp>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace farfield::run {

/// What the programs and the plans of evaluations call the choices of an image cache.
template <typename Value>
using Names = std::map<std::string, Value>;
[[nodiscard]] const Names<ImageValidity>& validity_names();
[[nodiscard]] const Names<ImageOrientation>& orientation_names();
[[nodiscard]] const Names<ImagePolicy>& policy_names();
[[nodiscard]] const Names<QuadDepth>& depth_names();
[[nodiscard]] const Names<SurfacePlacement>& surface_names();

/// The same of colour cubes.
[[nodiscard]] const Names<CubeDrawing>& cube_drawing_names();
[[nodiscard]] const Names<CubeSheets>& cube_sheet_names();
[[nodiscard]] const Names<CubeColors>& cube_color_names();

/// The same of LOD-sprites.
[[nodiscard]] const Names<SpriteCriterion>& criterion_names();

/// One technique on one backend. Names as the options of the programs.
struct RunOptions {
    /// geometry, mesh-lod, image-cache, color-cubes, lod-sprite or placement
    std::string technique = "image-cache";
    /// Of an image cache: shade1996 or schaufler1996; of LOD-sprites chen1999 or guaranteed-sprite,
    /// and with any other their options as they are.
    std::string preset = "shade1996";
    std::string levels = "collapse"; ///< of mesh-lod: collapse or cluster
    std::string backend = "opengl";  ///< opengl, embree or null
    /// File of a cost model; "measure"; empty: the stored one of the backend.
    std::string cost_model;
    /// What the preset leaves open; `error_px` is that of mesh-lod as well.
    ImageCacheOptions cache;
    /// In place of what the preset says.
    std::optional<ImageValidity> validity;
    std::optional<ImageOrientation> orientation;
    std::optional<ImagePolicy> policy;
    std::uint64_t budget_mib = 64;
    std::int32_t samples = 1; ///< per pixel of the frame
    CubeModelOptions cube_model;
    ColorCubesOptions cubes; ///< all but the costs
    ProxyOptions proxy;      ///< coarse models of `lod-sprite`
    LodSpriteOptions sprite; ///< all but the threshold, the budget and the costs
    /// In place of what the preset says.
    std::optional<SpriteCriterion> criterion;
    PlacementSetup placement;
    ImagePlacementOptions placed;                               ///< how placed images are shown
    opengl::LayerDrawing layers = opengl::LayerDrawing::warped; ///< how OpenGL draws them
};

/// Checks names and what the options cannot mean together.
[[nodiscard]] Result<void> validate(const RunOptions& options);

/// Makes what a technique needs of a world beyond its hierarchy: pairs of fine and coarse models,
/// unless there are any. Comes before backends are made of the world.
[[nodiscard]] Result<void> prepare(World& world, const RunOptions& options);

/// A technique made as options say, whichever it is. It may be moved, what it hands out stays.
class Technique {
  public:
    /// @param world must outlive the technique
    /// @param backend to measure the cost model on, where that is asked for
    [[nodiscard]] static Result<Technique>
    create(const World& world, const RunOptions& options, Backend& backend);

    /// Drives the technique, which must outlive it.
    [[nodiscard]] Planner planner() const;

    /// Null unless it is an image cache.
    [[nodiscard]] const ImageCache* cache() const noexcept { return cache_.get(); }

    /// Null unless it is colour cubes.
    [[nodiscard]] const ColorCubes* cubes() const noexcept { return cubes_.get(); }
    [[nodiscard]] const CubeModel* cube_model() const noexcept { return cube_model_.get(); }

    /// Null unless it is LOD-sprites.
    [[nodiscard]] const LodSprite* sprite() const noexcept { return sprite_.get(); }

    /// Null unless it is placed images.
    [[nodiscard]] const ImagePlacement* placement() const noexcept { return placement_.get(); }
    [[nodiscard]] const PlacedWorld* placed() const noexcept { return placed_.get(); }

    /// What it promises; none for all but image caches, and LOD-sprites that promise it for every
    /// fragment.
    [[nodiscard]] std::optional<double> promise_px() const noexcept;

    /// Fills in what is known without walking.
    void add_to_report(RunReport& report) const;

  private:
    RunOptions options_;
    std::unique_ptr<CulledGeometry> geometry_;
    std::unique_ptr<MeshLod> levels_;
    std::unique_ptr<ImageCache> cache_;
    std::unique_ptr<CubeModel> cube_model_;
    std::unique_ptr<ColorCubes> cubes_;
    std::unique_ptr<LodSprite> sprite_;
    std::unique_ptr<PlacedWorld> placed_;
    std::unique_ptr<ImagePlacement> placement_;
    ImageCacheOptions cache_options_;
    LodSpriteOptions sprite_options_;
    CostModel costs_;
};

/// A report with all that is known of the world.
[[nodiscard]] RunReport report_of(const World& world);

} // namespace farfield::run
