#pragma once

#include "embree/cast_scene.hpp"
#include "embree/memory.hpp"
#include <farfield/gpu/cell_shapes.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/gpu/keyframe_lookup.hpp>
#include <farfield/gpu/plan_rules.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/image/layered_warp.hpp>
#include <farfield/image/position_picture.hpp>

#include <glm/ext/matrix_float3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace farfield::embree {

/// A page or a scratch page. Rows go up, as those of regions do.
struct Page : gpu::PageFacts {
    std::uint32_t cache = 0;
    PageId id = kNone<PageId>;
    std::int32_t samples = 1;     ///< of a scratch page
    Memory<std::uint32_t> colors; ///< RGBA, 8 bits each; a row and a texel more than there are
    /// As `Pass::copy_near` says: of a page that keeps depth, likewise a row and a texel more; of a
    /// scratch page, where a pass is copied to one.
    Memory<std::uint16_t> depths;
    Memory<PositionTexel> positions;
};

/// The depth of a texel that keeps none.
inline constexpr std::uint16_t kNoKeptDepth = 0xFFFF;

/// A frame.
struct Target {
    std::int32_t width = 0; ///< [px] 0: destroyed
    std::int32_t height = 0;
    std::int32_t samples = 1;
    Memory<std::uint32_t> colors; ///< of whole pixels
    Memory<float> depths;         ///< distances along the view direction [m]; infinite: nothing
    /// With several samples: whether those of a pixel differ, and then what they are. The samples
    /// of a pixel lie together.
    Memory<std::uint8_t> mixed;
    Memory<std::uint32_t> sample_colors;
    Memory<float> sample_depths;
    Memory<PositionTexel> positions;
};

/// How one command draws something.
struct Use {
    std::uint32_t order = 0;          ///< of the command within the pass, from 1
    bool mask = false;                ///< writes depth alone
    bool whole_triangles = false;     ///< as `Command::whole_triangles`
    std::uint32_t clip = kNoClip;     ///< into `FrameWork::clips`
    std::uint32_t first_keyframe = 0; ///< into `FrameWork::keyframes`: those projected
    std::uint32_t keyframe_count = 0;

    static constexpr std::uint32_t kNoClip = UINT32_MAX;
};

/// A keyframe as one pass projects it.
struct PassKeyframe {
    gpu::KeyframeLookup lookup;
    const Page* page = nullptr;
    std::uint32_t node = UINT32_MAX;
};

/// Triangles of a split item that the same commands draw.
struct Cell {
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;
    std::uint32_t first_use = 0; ///< into `FrameWork::uses`, the first command first
    std::uint32_t use_count = 0;
};

/// Distances along the view direction between which something may be met [m]; nothing at first.
struct DepthRange {
    float nearest = std::numeric_limits<float>::infinity();
    float farthest = -std::numeric_limits<float>::infinity();
};

/// Width and height of the squares of pixels that know their depths. [px]
inline constexpr std::int32_t kDepthSquare = 4;

/// What one cast is about: an item as one command draws it, or the parts of a split item that all
/// commands of a phase draw.
struct Draw {
    const CastItem* item = nullptr;
    std::uint32_t item_index = 0;
    glm::vec3 eye{0.0F};  ///< in object space
    float nearest = 0.0F; ///< of all that is drawn, along the view direction [m]
    float farthest = 0.0F;
    std::uint32_t triangles = 0;  ///< that are drawn
    Region around;                ///< [px] of the target: where it may be seen
    std::uint32_t use = 0;        ///< into `FrameWork::uses`: of all triangles, where
    std::uint32_t first_cell = 0; ///< into `FrameWork::cells`, ordered and apart
    std::uint32_t cell_count = 0; ///< is 0
    /// With cells: into `FrameWork::depths`, by squares of `around` from its lower left, row by
    /// row.
    std::uint32_t first_depth = 0;

    [[nodiscard]] std::int32_t squares_a_row() const noexcept {
        return (around.width + kDepthSquare - 1) / kDepthSquare;
    }
};

/// A run of triangles of a split item as one command lists it.
struct ListedRun {
    std::uint32_t item = 0;
    std::uint32_t first_triangle = 0;
    std::uint32_t end_triangle = 0;
    std::uint32_t use = 0; ///< into `FrameWork::uses`
};

/// An image quad as one pass sees it. With x and y [px] of the target, its own coordinates [texel]
/// are (u.x + u.y x + u.z y) / (w.x + w.y x + w.z y), and likewise v; w is 1 over the distance
/// along the view direction.
struct PassQuad {
    glm::dvec3 u{0.0};
    glm::dvec3 v{0.0};
    glm::dvec3 w{0.0};
    const Page* page = nullptr;
    Region source;
    Region around; ///< [px] of the target: where it may be seen
    QuadDepth stands = QuadDepth::none;
    bool writes_depth = false; ///< into depth alone
    float depth = 0.0F;        ///< of the whole quad, standing by none
    float nearest = 0.0F;      ///< depths that count, else; of the lens [m]
    float farthest = 0.0F;
    float viewpoint_depth = 0.0F; ///< of the eye that made the image [m]
    float near_ratio = 1.0F;      ///< as of `ImageQuad`
    float far_ratio = 1.0F;
    std::uint32_t order = 0;
    std::uint32_t node = UINT32_MAX;
};

/// A face of a cube as one pass sees it: a square whose own coordinates, in [0, 1) each, are as
/// those of a `PassQuad`.
struct PassFace {
    glm::dvec3 u{0.0};
    glm::dvec3 v{0.0};
    glm::dvec3 w{0.0};
};

/// Something in one colour that a pass shows: a splat, or a face of a cube.
struct Flat {
    static constexpr std::uint32_t kNoFace = UINT32_MAX;

    /// [px] of the target: where it may cover samples, and of one sample a pixel does, if it is a
    /// splat
    Region around;
    gpu::SplatSquare square; ///< of a splat
    std::uint32_t order = 0;
    std::uint32_t face = kNoFace; ///< into `FrameWork::faces`
    glm::vec<4, std::uint8_t> color{0};
};

/// A layered image as one pass sees it.
struct PassLayers {
    const LayeredDepthImage* image = nullptr;
    /// Of each sample of a pixel: what it is warped to, one pixel for each of the viewport.
    std::uint32_t first_warped = 0; ///< into `FrameWork::warped`
    LayeredTerms terms;             ///< of the pass; where positions are kept
    std::uint32_t order = 0;
    std::uint32_t node = UINT32_MAX;
};

/// Commands that are carried out together: one cast for all of their geometry, which layered images
/// are added to, then their quads, splats and cubes. Of geometry and layered images only the
/// nearest counts, and of the others those that come after it: the result is that of one command
/// after the other. Only masks must come before all else, and nothing is cast after depths of
/// quads.
struct Phase {
    std::uint32_t first_draw = 0; ///< into `FrameWork::draws`, the nearest first
    std::uint32_t draw_count = 0;
    std::uint32_t first_layer = 0; ///< into `FrameWork::layers`, in order
    std::uint32_t layer_count = 0;
    std::uint32_t first_quad = 0; ///< into `FrameWork::quads`, in order
    std::uint32_t quad_count = 0;
    std::uint32_t first_flat = 0; ///< into `FrameWork::flats`, in order
    std::uint32_t flat_count = 0;
};

/// A pass, with all that its tiles need.
struct PassWork {
    const Pass* pass = nullptr;
    Page* scratch = nullptr; ///< where it draws to, or
    Target* target = nullptr;
    std::int32_t samples = 1;
    bool clear = true;
    bool keeps_depth = false; ///< is copied to a page that does
    glm::vec4 clear_color{0.0F};
    glm::mat3 camera_to_world{1.0F};
    glm::vec3 direction_dx{0.0F}; ///< of a ray, from a pixel to the next; world
    glm::vec3 direction_dy{0.0F};
    std::uint32_t first_phase = 0; ///< into `FrameWork::phases`
    std::uint32_t phase_count = 0;
    std::uint32_t first_flat = 0; ///< into `FrameWork::flats`
};

/// A part of a pass that one thread draws.
struct TileTask {
    std::uint32_t pass = 0; ///< into `FrameWork::passes`
    Region region;          ///< [px] of the target
    /// Into `FrameWork::listed_flats`: those that it may show, in order.
    std::uint32_t first_flat = 0;
    std::uint32_t flat_count = 0;
};

/// All that is drawn in one batch of a plan.
struct FrameWork {
    std::vector<PassWork> passes;
    std::vector<Phase> phases;
    std::vector<Draw> draws;
    std::vector<Use> uses;
    std::vector<Cell> cells;
    std::vector<DepthRange> depths;
    std::vector<Box3f> clips; ///< relative to the eye, in the world's axes
    std::vector<PassKeyframe> keyframes;
    std::vector<PassLayers> layers;
    std::vector<WarpedLayers> warped; ///< kept when all else is cleared
    std::size_t warped_count = 0;     ///< of those that are in use
    std::vector<PassQuad> quads;
    std::vector<Flat> flats;
    std::vector<PassFace> faces;
    std::vector<std::uint32_t> listed_flats;
    std::vector<TileTask> tiles;

    // Of the phase that takes in commands.
    std::vector<ListedRun> listed;
    std::vector<ListedRun> open;       ///< where cells are made: runs that hold the next triangle
    std::vector<std::uint64_t> marked; ///< a bit for each triangle that is selected; else 0

    void clear() noexcept;
};

/// Width and height of a tile. [px]
inline constexpr std::int32_t kTile = 32;

/// Where a pass draws, before its commands are looked at.
void add_view(PassWork& pass) noexcept;

/// Adds items of a command as draws, and lists its pieces and selections. Its keyframes are the
/// last of the work's.
void add_draws(
    const CastScene& scene,
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    std::uint32_t order,
    FrameWork& work
);

/// Adds a draw for every item of which triangles were listed, and empties the list.
void add_listed_draws(const CastScene& scene, const Pass& pass, FrameWork& work);

/// Adds a quad of a command, unless it cannot be seen.
void add_quad(
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    const ImageQuad& quad,
    const Page& page,
    std::uint32_t order,
    FrameWork& work
);

/// Adds the splats of a command that cover samples.
/// @param places of the samples of a pixel
void add_splats(
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    std::uint32_t order,
    std::span<const glm::vec2> places,
    FrameWork& work
);

/// Adds the faces that are seen of the cubes of a command.
void add_cubes(
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    std::uint32_t order,
    FrameWork& work
);

/// Cuts the last pass into tiles, and lists for each what it may show of splats and cubes.
void add_tiles(FrameWork& work);

} // namespace farfield::embree
