#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/image_cache_options.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace farfield {

/// What a node did in the last plan.
enum class NodeStatus : std::uint8_t {
    untouched, ///< not reached: below an image, or below a culled node
    culled,    ///< outside the frustum, or empty
    image,     ///< shown by its image
    geometry,  ///< a leaf drawn as geometry
    recursed,  ///< left to its children
};

/// What became of the image of a node in the last plan, in view or not.
enum class ImageEvent : std::uint8_t {
    none,       ///< not looked at, or of no use: below an image, or not worth making
    made,       ///< made, from primitives
    combined,   ///< made, from images of children
    reused,     ///< made in an earlier frame, and found valid
    impossible, ///< cannot be: too near, too large, or the eye within the box
};

/// An image that a cache holds of a node.
struct ImageFacts {
    glm::vec3 viewpoint{0.0F}; ///< eye that made it, relative to the hierarchy's origin
    Box3f box{};               ///< what it shows
    Box3f zone{};              ///< eyes it is valid for; empty but with `ImageValidity::zone`
    float error_px = 0.0F;     ///< its error when it was last looked at, as the cache measures it
    std::uint64_t made_frame = 0;
};

/// What the last plan did; counts of one frame unless said otherwise.
struct ImageCacheStatistics {
    std::uint32_t nodes_visited = 0;
    std::uint32_t images_shown = 0;
    /// Made in an earlier frame, and shown or kept: out of view only with `all_around`.
    std::uint32_t images_reused = 0;
    std::uint32_t images_created = 0;
    std::uint32_t images_combined = 0;   ///< of the created: made from images of their children
    std::uint32_t images_stale = 0;      ///< found no longer valid
    std::uint32_t images_impossible = 0; ///< nodes looked at that can have none: too near or large
    std::uint32_t images_evicted = 0;    ///< given up to make room
    std::uint32_t images_refused = 0;    ///< would have paid, but there was no room
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
/// Each plan changes the cache and must be executed once, in order.
///
/// The world may change between plans, by `partition::mark_changed` and `update_bounds` of the
/// hierarchy, and by `set_appearance` here: the next plan shows no image of what was. A view with
/// another lens or resolution is held to the threshold in its own pixels, and shows only images
/// whose texels are between half a pixel and one; another direction changes nothing.
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

    /// Light or shading look different when `version` is another number than before: every image is
    /// stale then. 0 at first.
    void set_appearance(std::uint64_t version) noexcept;

    /// Of the last plan.
    [[nodiscard]] const ImageCacheStatistics& statistics() const noexcept;

    /// What each node of the hierarchy did in the last plan.
    [[nodiscard]] std::span<const NodeStatus> statuses() const noexcept;

    /// What became of the image of each node in the last plan.
    [[nodiscard]] std::span<const ImageEvent> events() const noexcept;

    /// The image that the cache holds of a node, valid or not; none where it holds none.
    /// @pre node < size of `statuses()`
    [[nodiscard]] std::optional<ImageFacts> image_of(std::uint32_t node) const noexcept;

    /// What the options came to for this hierarchy: `first` or `in_images`.
    [[nodiscard]] SurfacePlacement surfaces() const noexcept;

  private:
    struct Impl;
    explicit ImageCache(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield
