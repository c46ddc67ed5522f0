#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/image/region.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace farfield {

/// A page to make or to drop before the passes run. Making one that exists replaces it; dropping
/// one that does not exist does nothing. Pages are square, RGBA8, premultiplied alpha.
struct PageUpdate {
    enum class Action : std::uint8_t { create, destroy };
    Action action = Action::create;
    PageId page = kNone<PageId>;
    std::int32_t size = 0;    ///< [texel] width and height
    bool scratch = false;     ///< images are rendered in it, with depth, then copied to their page
    std::int32_t samples = 1; ///< of a scratch page; copying resolves them
    /// Of a page of images, never of a scratch page: it keeps 16 bits of depth beside each texel.
    bool depth = false;
};

/// How images stand in depth among what else is drawn: what they test, and what image depths write.
/// Depths of planes and texels before the near plane or beyond the far one count as at it, so that
/// neither cuts an image.
enum class QuadDepth : std::uint8_t {
    none,  ///< the whole quad at `ImageQuad::depth`; never written
    plane, ///< every pixel at the plane of the quad
    texel, ///< every pixel at the depth that the page keeps of its texel
};

/// One image on a quadrilateral in space. The mapping is affine: corner `origin` shows the lower
/// left corner of `source`, `origin + edge_u` the lower right one, `origin + edge_v` the upper left
/// one.
struct ImageQuad {
    PageId page = kNone<PageId>;
    Region source;          ///< texels of the page, transparent border included
    glm::vec3 origin{0.0F}; ///< [m] relative to `FramePlan::origin`
    glm::vec3 edge_u{0.0F}; ///< [m]
    glm::vec3 edge_v{0.0F}; ///< [m]
    /// With `QuadDepth::none`, where the whole quad stands in depth: a distance along the view
    /// direction [m], at least the near distance. It is the nearest depth of what the image shows,
    /// so a surface drawn before hides the image only where it stands before all of it.
    float depth = 0.0F;
    /// With `QuadDepth::texel`: the eye that made the image, relative to `FramePlan::origin`. A
    /// pixel whose texel keeps the depth t in [0, 1] stands at `viewpoint + (q - viewpoint) *
    /// mix(near_ratio, far_ratio, t)`, where q is the place of the pixel on the quad. Its texel is,
    /// of the four that are filtered, the one of most weight that keeps something (less than 1).
    glm::vec3 viewpoint{0.0F};
    /// `Pass::copy_near` and `copy_far` of the pass that made the image, over the distance of the
    /// quad's plane from the viewpoint along that pass's view direction, which is normal to it:
    /// 0 <= near_ratio <= far_ratio.
    float near_ratio = 1.0F;
    float far_ratio = 1.0F;
    /// Node of the hierarchy that the image is of: for those who measure and report.
    std::uint32_t node = UINT32_MAX;
};

/// A square parallel to the image plane in one premultiplied colour, at the depth of its centre.
///
/// It covers exactly those samples of the target that lie inside of it, its left and lower edges
/// included, the others not. In pixels its centre is where the view projects it and its sides are
/// `side * f / z`: f is the focal length [px], that of x and that of y, z the depth of the centre
/// along the view direction. Neither is rounded. So of many splats smaller than a pixel most cover
/// no sample, and together they cover as many as they should: point sampling, without bias. A
/// splat whose centre is before the near plane or beyond the far one is not drawn.
struct Splat {
    glm::vec3 center{0.0F};             ///< [m] relative to `FramePlan::origin`
    float side = 0.0F;                  ///< [m] >= 0
    glm::vec<4, std::uint8_t> color{0}; ///< premultiplied, sRGB-encoded
};
static_assert(sizeof(Splat) == 20);

/// Up to three faces of a box, each a rectangle in one premultiplied colour.
///
/// Of the two faces normal to axis a, `faces[a]` is the one that the eye of the pass is in front
/// of. Where the eye is between their planes, or in one of them, that axis shows nothing.
struct ShownCube {
    glm::vec3 center{0.0F};  ///< [m] relative to `FramePlan::origin`
    glm::vec3 size{0.0F};    ///< [m] along the axes of the frame, >= 0
    std::uint32_t frame = 0; ///< into `FramePlan::cube_frames`
    std::array<glm::vec<4, std::uint8_t>, 3> faces{glm::vec<4, std::uint8_t>(0)}; ///< by axis
};
static_assert(sizeof(ShownCube) == 40);

/// Single primitives of one item.
struct Selection {
    ItemId item = kNone<ItemId>;
    /// Into `FramePlan::selected`: numbers of primitives of the item's own mesh, each at most once.
    /// Triangle i is what the indices 3i to 3i + 2 name.
    std::uint32_t first = 0;
    std::uint32_t count = 0;
};

/// A picture of the scene with depth that can be projected onto other geometry, most often a
/// coarser model of what it shows. `gpu/keyframe_lookup.hpp` has the formulas. It sees a fragment
/// of that geometry where all of this holds:
///
/// - the fragment is before the eye of `view` and inside its window;
/// - the texel there keeps something: a depth less than 1;
/// - what the texel shows stands no farther from the fragment than `offset_m` says: else it is
///   something that hides the fragment from the eye of `view`, or that stands behind it;
/// - it is shifted by no more than `max_shift_px`;
/// - the colour has an alpha of at least 0.5. It is filtered, never with texels outside of
///   `source`; where not all of the four texels stand so near, it is that of the texel alone, so
///   that no rim of what hides the fragment is seen.
///
/// The fragment then has that colour over its alpha, since geometry is opaque.
struct Keyframe {
    PageId page = kNone<PageId>; ///< keeps depth
    /// Texels of the page: what the copies of passes through `view` brought together. Several are
    /// tiles: passes of one view with scissors side by side, copied side by side.
    Region source;
    View view; ///< of those passes; its window maps to `source`, one texel a pixel of the view
    float copy_near = 0.0F; ///< [m] as `Pass::copy_near` and `copy_far` of those passes
    float copy_far = 0.0F;  ///< [m]
    /// How far the geometry that shows the picture is from what the picture shows, at most. Both
    /// are taken for the same if they are no farther apart along the ray of the keyframe's eye than
    /// `offset_m / max(|n.d|, 1/16)`, where n is the normal of the fragment's triangle and d the
    /// direction of the ray, plus what one step of the kept depth and the slope of the triangle
    /// over one texel make. [m] >= 0
    float offset_m = 0.0F;
    /// The point on the keyframe's ray through the fragment that is as far off as the texel keeps,
    /// seen by the pass, may be no farther from the fragment on the pass's target: the centre of
    /// its pixel or, from a backend that shades every sample, the sample. So what is projected
    /// holds this bound and half a texel's diagonal, as any picture that is sampled, whatever the
    /// geometry is, grazing views and things that hide each other included. >= 0; infinite: not
    /// tested. [px]
    float max_shift_px = std::numeric_limits<float>::infinity();
    std::uint32_t node = UINT32_MAX; ///< as `ImageQuad::node`
};

/// Keyframes that one command may try.
inline constexpr std::uint32_t kMostKeyframes = 4;

/// A layered depth image to hand to a backend, or to drop, before the passes run. Handing over one
/// that is there replaces it; dropping one that is not does nothing.
struct LayeredUpdate {
    enum class Action : std::uint8_t { create, destroy };
    Action action = Action::create;
    LayeredImageId image = kNone<LayeredImageId>;
    /// Of create: valid as `validate` says, and alive until the plan was executed or the technique
    /// makes its next one.
    const LayeredDepthImage* content = nullptr;
};

/// A layered depth image that is warped to the eye of a pass.
struct ShownLayers {
    LayeredImageId image = kNone<LayeredImageId>;
    std::uint32_t node = UINT32_MAX; ///< as `ImageQuad::node`
};

/// What to draw next within a pass, in order.
struct Command {
    enum class Kind : std::uint8_t {
        geometry, ///< items, pieces and selections, depth tested and written
        mask,     ///< the same into depth alone: hides what is drawn later, shows nothing
        images,   ///< quads, blended (premultiplied over), bilinear, depth tested, not written
        /// Quads into depth alone, tested as well, where their filtered alpha is at least 0.5: so
        /// that what is drawn later can stand among them. Not with `QuadDepth::none`. Images never
        /// hide each other unless some are drawn after the depths of others.
        image_depths,
        splats, ///< `Splat`s, blended (premultiplied over), depth tested, not written
        cubes,  ///< `ShownCube`s, likewise
        /// As geometry, each fragment in the colour of the first of the command's keyframes that
        /// sees it, and in its own if none does. What geometry cuts out stays cut out.
        projected,
        /// The samples of layered depth images: each covers what a `Splat` at its point covers that
        /// is opaque and as large as `image/layered_warp.hpp` says; depth tested and written.
        layers,
    };
    static constexpr std::uint32_t kNoClip = UINT32_MAX;

    Kind kind = Kind::geometry;
    std::uint32_t first = 0; ///< into `items`, `quads`, `splats`, `cubes` or `layers`
    std::uint32_t count = 0;
    std::uint32_t first_piece = 0; ///< into `pieces`; geometry, mask and projected only
    std::uint32_t piece_count = 0;
    std::uint32_t clip = kNoClip;      ///< into `clips`: draw only what is inside that box
    QuadDepth depth = QuadDepth::none; ///< of images and image depths; none of all others
    std::uint32_t first_selection = 0; ///< into `selections`; geometry, mask and projected only
    std::uint32_t selection_count = 0;
    std::uint32_t first_keyframe = 0; ///< into `keyframes`; projected only
    /// Of projected 1 to `kMostKeyframes`, tried in order; of all others 0.
    std::uint32_t keyframe_count = 0;
    /// Of projected: a triangle shows the first keyframe that sees all of its three corners, as if
    /// there were fragments there, without tests of depth and shift in between; where that keeps
    /// nothing, or not half of an alpha, and where no keyframe sees all corners, it has its own
    /// colour. A corner that is not before the eye of the pass is shifted too far, unless that is
    /// not tested.
    bool whole_triangles = false;
};

/// True for commands whose `first` and `count` are of items: geometry, masks and projected.
[[nodiscard]] constexpr bool draws_geometry(const Command& command) noexcept {
    return command.kind == Command::Kind::geometry || command.kind == Command::Kind::mask ||
           command.kind == Command::Kind::projected;
}

/// True for commands whose `first` and `count` are of quads.
[[nodiscard]] constexpr bool draws_images(const Command& command) noexcept {
    return command.kind == Command::Kind::images || command.kind == Command::Kind::image_depths;
}

/// True for commands whose `first` and `count` are of splats or cubes.
[[nodiscard]] constexpr bool draws_cells(const Command& command) noexcept {
    return command.kind == Command::Kind::splats || command.kind == Command::Kind::cubes;
}

/// Commands into one target through one view.
struct Pass {
    PageId page = kNone<PageId>; ///< scratch page, or none: the caller's frame
    Region viewport;             ///< [px] of the target: what the view's window maps to
    Region scissor;              ///< [px] of the target: cleared, and drawn to
    View view;
    std::uint32_t first_command = 0;
    std::uint32_t command_count = 0;
    /// Passes of one batch write disjoint regions; their copies are made when the batch is over,
    /// before the next one begins. The final frame is a batch of its own, the last.
    std::uint32_t batch = 0;
    PageId copy_page = kNone<PageId>; ///< where the `copy_size` texels at `scissor` go, or none
    Region copy;                      ///< [texel] of `copy_page`; the size is that of `scissor`
    /// Distances along the view direction that the depths 0 and 1 of the copied texels stand for,
    /// where their page keeps depth: 0 <= copy_near < copy_far then. Between them depths are
    /// linear, rounded to the nearest of 65536; nearer is 0, farther is 1, and so is a texel that
    /// shows nothing, or to which no depth was written. Of several samples the nearest to the eye
    /// of those that show something counts. [m]
    float copy_near = 0.0F;
    float copy_far = 0.0F;
    std::uint32_t node = UINT32_MAX; ///< of which an image is made, as `ImageQuad::node`
};

/// All that one frame needs, as plain data: executed, recorded, printed, compared, or handed to an
/// engine's own renderer. Made by a technique's `plan()`.
///
/// Order: `pages` and `layered_updates` first, then `passes` as listed. Image passes clear their
/// scissor to transparent black and depth to far; the frame pass, the last, clears as the target
/// says. A pass never samples the page it writes, and every image it samples was copied in an
/// earlier batch or plan. All passes of a batch write one page. A pass's viewport has the size of
/// its view and lies inside its target. The page of a keyframe that a pass projects is copied to by
/// no pass of its batch.
struct FramePlan {
    /// Whose pages these are: plans of several caches may go to one backend, and page ids are per
    /// cache.
    std::uint32_t cache = 0;
    glm::dvec3 origin{0.0}; ///< world position of the frame that floats are relative to
    std::vector<PageUpdate> pages;
    std::vector<Pass> passes;
    std::vector<Command> commands;
    std::vector<ItemId> items;
    std::vector<Piece> pieces; ///< runs of `Hierarchy::primitives`
    std::vector<ImageQuad> quads;
    std::vector<Box3f> clips; ///< relative to `origin`
    std::vector<Splat> splats;
    std::vector<ShownCube> cubes;
    std::vector<glm::mat3> cube_frames; ///< rotations: columns are a cube's axes in the world
    std::vector<Selection> selections;
    std::vector<std::uint32_t> selected; ///< primitive numbers of `selections`
    std::vector<Keyframe> keyframes;
    std::vector<LayeredUpdate> layered_updates; ///< carried out with `pages`
    std::vector<ShownLayers> layers;
};

/// Empties a plan and keeps its storage.
void clear(FramePlan& plan) noexcept;

/// A 64-bit digest of all that a plan says; equal plans have equal digests on every machine with
/// IEEE 754 arithmetic.
[[nodiscard]] std::uint64_t digest(const FramePlan& plan) noexcept;

} // namespace farfield
