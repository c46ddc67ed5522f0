#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/placement_map.hpp>

#include <cstdint>
#include <memory>
#include <span>

namespace farfield {

/// Where the layered images of a map come from: a file that is paged, memory, or an engine's own
/// streaming. Called by `ImagePlacement::plan` alone.
class LayeredImageSource {
  public:
    LayeredImageSource() = default;
    LayeredImageSource(const LayeredImageSource&) = delete;
    LayeredImageSource& operator=(const LayeredImageSource&) = delete;
    virtual ~LayeredImageSource() = default;

    /// Tells which images are needed, the most urgent first. Those that there are stay until the
    /// next call, as far as memory goes in that order; the others are to come when they can.
    /// @param images into `PlacementMap::images`
    virtual void want(std::span<const std::uint32_t> images) noexcept = 0;

    /// An image, or null where it is not in memory yet: never waits. Valid until the call of `want`
    /// after the next one.
    [[nodiscard]] virtual const LayeredDepthImage* find(std::uint32_t image) noexcept = 0;
};

/// What an `ImagePlacement` leaves open.
struct ImagePlacementOptions {
    /// Layered images that the backend keeps at a time. [1, 64]
    std::uint32_t resident_images = 4;
    /// [frame] How far ahead images are asked for, along the motion: this and half of it. [0, 1000]
    std::uint32_t prefetch_frames = 60;
};

/// What the last plan did.
struct ImagePlacementStatistics {
    PlacementRefusal refusal = PlacementRefusal::none;
    std::uint32_t site = UINT32_MAX;  ///< of the eye
    std::uint32_t image = UINT32_MAX; ///< shown; none: all is geometry
    /// The image that belongs here was not in memory: the frame shows another one of the site or
    /// none, and may be over the budget.
    bool missed = false;
    std::uint64_t primitives = 0; ///< of the cells that the frame draws
    std::uint32_t cells = 0;      ///< drawn
    bool handed_over = false;     ///< the image was given to the backend
    std::uint64_t samples = 0;    ///< of the image
};

/// Draws no more than `PlacementOptions::max_primitives` of a model in any frame: what is over is
/// shown by a layered image, warped to the eye.
///
///     auto map = build_placement(*tree, {.max_primitives = 250'000}, executor);
///     auto placement = ImagePlacement::create(*tree, *map, images);
///     const FramePlan& plan = placement->plan(view, motion);
///
/// The bound holds for every view that the map serves, whatever the window, as long as images come
/// in time. A view that it does not serve is plain geometry (`refusal`). Items that move are drawn
/// on top of it. The model's own contents must not change: images would show what was.
/// @par Source Aliaga and Lastra 1999
class ImagePlacement {
  public:
    /// @param hierarchy, map, images must outlive the technique
    /// @return an error where the map is not of the hierarchy (`validate`), or that names the
    /// option and its value
    [[nodiscard]] static Result<ImagePlacement> create(
        const Hierarchy& hierarchy,
        const PlacementMap& map,
        LayeredImageSource& images,
        const ImagePlacementOptions& options = {}
    );

    ImagePlacement(ImagePlacement&& other) noexcept;
    ImagePlacement& operator=(ImagePlacement&& other) noexcept;
    ImagePlacement(const ImagePlacement&) = delete;
    ImagePlacement& operator=(const ImagePlacement&) = delete;
    ~ImagePlacement();

    /// The plan of one frame; valid until the next call. Reads no clock; allocates nothing once
    /// warm. Deterministic in the view and the images that are in memory.
    /// @pre validate(view)
    /// @par Cost linear in the cells in view, of which there are at most as many as the map has:
    /// the size of the model does not matter
    [[nodiscard]] const FramePlan& plan(const View& view, const Motion& motion) noexcept;

    /// Starts over: the next plan hands images over again. After a plan that failed or was not
    /// executed.
    void forget_images() noexcept;

    /// Of the last plan.
    [[nodiscard]] const ImagePlacementStatistics& statistics() const noexcept;

  private:
    struct Impl;
    explicit ImagePlacement(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield
