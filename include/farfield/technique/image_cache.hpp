#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/policy/cost_model.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <cstdint>
#include <memory>
#include <span>

namespace farfield {

/// When an image may still be shown.
enum class ImageValidity : std::uint8_t {
    /// As long as its error, measured afresh for the eye, is within the threshold: the corner
    /// estimate of the angular discrepancy plus what nested images brought with them.
    angle,
    /// As long as the eye is in the cube inscribed in the safety ball around the eye that made it,
    /// intersected with the cubes of the images nested in it.
    zone,
};

/// How the threshold in pixels becomes an angle.
enum class PixelConversion : std::uint8_t {
    mean,  ///< vertical field of view / height, as in the papers: up to 2.5 times too large at the
           ///< rim
    bound, ///< the largest angle that is never more than the pixels promised, anywhere on the image
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
    SurfacePlacement surfaces = SurfacePlacement::automatic;
    /// Renders images with the frame's own matrix at the frame's pixels, so that the frame in which
    /// an image is made equals geometry bit for bit; needs scratch memory of the size of the frame.
    bool exact_pixels = false;
    std::int32_t image_samples = 1; ///< per texel of images being made; 1 to what the backend takes
    std::uint64_t image_budget_bytes = std::uint64_t{64} << 20U; ///< [byte] 0: geometry only
    std::int32_t page_size =
        1024;                     ///< [texel] of an image page, 64 to 16384; larger nodes: no image
    std::uint32_t max_life = 600; ///< [frame] longest life span that is amortised over. >= 1
    double overlap_px = 2.0;      ///< [texel] least overlap of split surfaces in images. >= 0
    CostModel costs{};
    std::int32_t frame_samples = 1; ///< per pixel of the frames, for their costs; 1 to 64
    GeometryOrder order = GeometryOrder::front_to_back; ///< of frames in which no image is shown
    std::uint32_t cache_id = 0; ///< tells the pages of caches that share a backend apart
};

namespace presets {

/// Hierarchical image caching as published: corner error, mean pixel angle, life span by
/// extrapolation.
/// @param options what the preset leaves open: threshold, budget, costs, samples
/// @par Source Shade, Lischinski, Salesin, DeRose, Snyder 1996. Departures: images need not be
/// powers of two; an interior image may not be shown beyond the threshold less what the images
/// nested in it brought with them, where the paper intersects zones (`ImageValidity::zone` does);
/// life ends where the error is over the threshold on the eye's way, not where the eye leaves a
/// zone.
[[nodiscard]] ImageCacheOptions shade1996(ImageCacheOptions options = {}) noexcept;

} // namespace presets

/// What a node did in the last plan.
enum class NodeStatus : std::uint8_t {
    untouched, ///< not reached: below an image, or below a culled node
    culled,    ///< outside the frustum, or empty
    image,     ///< shown by its image
    geometry,  ///< a leaf drawn as geometry
    recursed,  ///< left to its children
};

/// What the last plan did; counts of one frame unless said otherwise.
struct ImageCacheStatistics {
    std::uint32_t nodes_visited = 0;
    std::uint32_t images_shown = 0;
    std::uint32_t images_reused = 0; ///< shown, and made in an earlier frame
    std::uint32_t images_created = 0;
    std::uint32_t images_combined = 0; ///< of the created: made from images of their children
    std::uint32_t images_stale = 0;    ///< found no longer valid
    std::uint32_t images_evicted = 0;  ///< given up to make room
    std::uint32_t images_refused = 0;  ///< would have paid, but there was no room
    std::uint32_t geometry_leaves = 0;
    std::uint64_t texels_created = 0;
    std::uint64_t texels_used = 0;      ///< by all images, now
    std::uint64_t texels_allocated = 0; ///< of all pages, now
    std::uint32_t pages = 0;            ///< now, without scratch
    std::uint64_t image_bytes = 0;      ///< now: pages and scratch as allocated
    std::uint64_t image_bytes_peak = 0; ///< ever
};

/// Caches images of hierarchy nodes and shows them while their error stays under a threshold.
///
///     auto tree = partition::build_bsp(objects);
///     auto cache = ImageCache::create(*tree, presets::shade1996({.error_px = 2}));
///     const FramePlan& plan = cache->plan(view, motion);
///     if (!backend.execute(plan, target, clear)) { cache->forget_images(); }
///
/// Each plan changes the cache and must be executed once, in order. A view with another lens or
/// resolution makes every image stale; another direction does not.
class ImageCache {
  public:
    /// @param hierarchy must outlive the cache; several caches may share one
    /// @return an error that names the option and its value
    [[nodiscard]] static Result<ImageCache>
    create(const Hierarchy& hierarchy, const ImageCacheOptions& options);

    ImageCache(ImageCache&& other) noexcept;
    ImageCache& operator=(ImageCache&& other) noexcept;
    ImageCache(const ImageCache&) = delete;
    ImageCache& operator=(const ImageCache&) = delete;
    ~ImageCache();

    /// The plan of one frame; valid until the next call. Deterministic; reads no clock; allocates
    /// nothing once warm.
    /// @param motion of the viewer in world units, for the life spans of images about to be made
    /// @pre validate(view)
    /// @par Cost linear in the nodes above the images shown
    [[nodiscard]] const FramePlan& plan(const View& view, const Motion& motion) noexcept;

    /// Starts over: the next plan drops every page. After a plan that failed or was not executed.
    void forget_images() noexcept;

    /// Of the last plan.
    [[nodiscard]] const ImageCacheStatistics& statistics() const noexcept;

    /// What each node of the hierarchy did in the last plan.
    [[nodiscard]] std::span<const NodeStatus> statuses() const noexcept;

    /// What the options came to for this hierarchy: `first` or `in_images`.
    [[nodiscard]] SurfacePlacement surfaces() const noexcept;

  private:
    struct Impl;
    explicit ImageCache(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield
