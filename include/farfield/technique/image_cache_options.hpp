#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/metric/pixel_conversion.hpp>
#include <farfield/policy/cost_model.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <cstdint>
#include <limits>

namespace farfield {

/// When an image may still be shown: the metric of a cache.
enum class ImageValidity : std::uint8_t {
    /// As long as its error, measured afresh for the eye, is within the threshold: the corner
    /// estimate of the angular discrepancy plus what nested images brought with them.
    angle,
    /// As long as the eye is in the cube inscribed in the safety ball around the eye that made it,
    /// intersected with the cubes of the images nested in it.
    zone,
    /// As long as alpha_trans and alpha_size, by the corners of the box, are each within the
    /// threshold. Every image for itself: what nested images brought with them is not counted. For
    /// images that face the eye.
    impostor_angles,
    /// As `angle`, with the bound over the whole box in place of the estimate by its corners.
    bound,
};

/// Where the planes of images are.
enum class ImageOrientation : std::uint8_t {
    /// Perpendicular to the view, on the frame's own pixels: in the frame in which an image is made
    /// it shows what geometry would.
    view_aligned,
    /// Facing the eye, on pixels of its own: for nodes outside the frustum as well.
    facing_eye,
};

/// Which images are made: the policy of a cache.
enum class ImagePolicy : std::uint8_t {
    amortized,         ///< those that cost less than what they save over their life span
    whenever_possible, ///< all that can be
};

/// Where the split surfaces of a hierarchy (terrain, shells of buildings) are drawn.
enum class SurfacePlacement : std::uint8_t {
    automatic, ///< first where they are a small part of the whole, else in the images
    in_images, ///< in the images of their nodes, overlapping their neighbours to hide cracks
    first,     ///< as geometry under the images, which test depth against them
};

/// How an `ImageCache` decides. Presets fill it in; every field has its default.
struct ImageCacheOptions {
    double error_px = 2.0; ///< [px] largest displacement of what an image shows. > 0, finite
    PixelConversion conversion = PixelConversion::mean;
    ImageValidity validity = ImageValidity::angle;
    ImageOrientation orientation = ImageOrientation::view_aligned;
    ImagePolicy policy = ImagePolicy::amortized;
    SurfacePlacement surfaces = SurfacePlacement::automatic;
    /// What images test depth with, and whether what is drawn after them stands among them: items
    /// that move, objects of the engine's own. `plane` does not go with surfaces drawn first, whose
    /// depths are nearer than the plane of an image where it stands on them.
    QuadDepth quad_depth = QuadDepth::none;
    /// Renders images with the frame's own matrix at the frame's pixels, so that the frame in which
    /// an image is made equals geometry bit for bit; needs scratch memory of the size of the frame.
    /// For view-aligned images.
    bool exact_pixels = false;
    /// Keeps images of what is outside the frustum as well, so that turning the head costs nothing.
    /// For images that face the eye.
    bool all_around = false;
    std::int32_t image_samples = 1; ///< per texel of images being made; 1 to what the backend takes
    std::uint64_t image_budget_bytes = std::uint64_t{64} << 20U; ///< [byte] 0: geometry only
    std::int32_t page_size = 1024;    ///< [texel] of an image page, 64 to 16384
    std::int32_t image_limit = 16384; ///< [texel] largest side of an image, border included; >= 16
    /// [px] size of the texels of an image when it is made; (0, 1], and 1 for view-aligned images,
    /// which are made on the frame's pixels. Less than `max_texel_px` leaves room to go nearer.
    double texel_px = 1.0;
    /// [px] largest size of texels that are shown: beyond it an image is made anew. >= texel_px;
    /// infinite: any. Where texels of this size, or of one pixel if that is less, take more than
    /// `image_limit` of them, there is no image.
    double max_texel_px = std::numeric_limits<double>::infinity();
    std::uint32_t max_life = 600; ///< [frame] longest life span that is amortised over. >= 1
    double overlap_px = 2.0;      ///< [texel] least overlap of split surfaces in images. >= 0
    CostModel costs{};
    std::int32_t frame_samples = 1; ///< per pixel of the frames, for their costs; 1 to 64
    GeometryOrder order = GeometryOrder::front_to_back; ///< of frames in which no image is shown
    std::uint32_t cache_id = 0; ///< tells the pages of caches that share a backend apart
};

/// Checks values, and what they cannot mean together.
/// @return an error that names the option and its value
[[nodiscard]] Result<void> validate(const ImageCacheOptions& options);

namespace presets {

/// Hierarchical image caching as published: corner error, mean pixel angle, life span by
/// extrapolation. Made for a BSP.
/// @param options what the preset leaves open: threshold, budget, costs, samples
/// @par Source Shade, Lischinski, Salesin, DeRose, Snyder 1996. Departures: images need not be
/// powers of two; an interior image may not be shown beyond the threshold less what the images
/// nested in it brought with them, where the paper intersects zones (`ImageValidity::zone` does);
/// life ends where the error is over the threshold on the eye's way, not where the eye leaves a
/// zone.
[[nodiscard]] ImageCacheOptions shade1996(ImageCacheOptions options = {}) noexcept;

/// The three-dimensional image cache as published: images face the eye, of at most 256 x 256
/// texels, for every box in which texels of that many are no larger than a pixel; made anew when
/// alpha_trans, alpha_size or alpha_tex is over its threshold, from the images of its children.
/// Made for a k-d tree with `branching` 8, or 4 for flat scenes.
/// @param options what the preset leaves open: threshold (the paper's is one pixel), budget,
/// samples, `all_around`, `quad_depth`
/// @par Source Schaufler and Stuerzlinger 1996, sections 3 and 4. Departures: images need not be
/// square nor powers of two, so texels are made at 3/4 of a pixel for the room that rounding up
/// gave; without `all_around` nodes outside the frustum are kept up to date only where the image of
/// a node in view is made from them.
[[nodiscard]] ImageCacheOptions
schaufler1996(ImageCacheOptions options = {.error_px = 1.0}) noexcept;

} // namespace presets

} // namespace farfield
