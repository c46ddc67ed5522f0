#pragma once

#include <farfield/eval/disparity.hpp>
#include <farfield/eval/log_histogram.hpp>
#include <farfield/gpu/frame_plan.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace farfield {

/// An image that was further off than promised, in the frame in which it was so most.
struct NodeOvershoot {
    std::uint32_t node = UINT32_MAX;
    int frame = 0;
    double disparity_px = 0.0; ///< [px] of the pixel that is furthest beyond its own promise
    double promise_px = 0.0;   ///< [px] of that pixel
    std::uint64_t pixels = 0;  ///< over their promise in that frame

    friend bool operator==(const NodeOvershoot&, const NodeOvershoot&) = default;
};

/// Disparity of a walk. Pixels are those of all its frames; a figure without pixels is none.
struct DisparitySummary {
    std::uint64_t frames = 0;
    std::uint64_t image_pixels = 0;
    std::uint64_t infinite_pixels = 0;
    std::uint64_t geometry_pixels = 0;
    std::uint64_t unmeasured_pixels = 0;
    std::optional<double> median_px;         ///< of image pixels, to within a bin of `LogHistogram`
    std::optional<double> p99_px;            ///< likewise
    std::optional<double> max_px;            ///< of image pixels, exactly
    std::optional<double> bound_px;          ///< largest promise
    std::optional<std::uint64_t> over_bound; ///< image pixels further off than their own promise
    std::optional<double> geometry_max_px;
    std::uint64_t remade_images = 0; ///< that `tightness` is the median of
    /// How much of its threshold an image uses up before it is made anew: the median, to within a
    /// bin of `LogHistogram`, of the largest disparity less sampling (at least 0) in the last frame
    /// that showed it, over error_px. 1 is best: below, images are made anew too early; above, too
    /// late. It means something on a smooth path only.
    std::optional<double> tightness;
    LogHistogram histogram;           ///< [px] of image pixels
    std::vector<NodeOvershoot> worst; ///< nodes by how far they were beyond their promise, at most
};

/// Gathers the disparity of frame after frame. Memory is bounded by the nodes that were shown.
class DisparitySeries {
  public:
    /// @param frame greater than that of the call before. Where it leaves frames out, images made
    /// anew in between are not known, so they do not count for the tightness.
    /// @param disparity of the frame
    /// @param remade nodes whose images were made in this frame, in any order
    void add(int frame, const FrameDisparity& disparity, std::span<const std::uint32_t> remade);

    /// @param worst_nodes most entries of `worst`
    [[nodiscard]] DisparitySummary summary(std::size_t worst_nodes = 20) const;

  private:
    /// What is known of a node that was shown.
    struct Shown {
        int frame = 0; ///< the last one that showed it
        /// What it used of its threshold in that frame; none when it was not promised, or counted.
        std::optional<double> used;
        std::optional<NodeOvershoot> worst;
    };

    int last_frame_ = 0;
    DisparitySummary sums_; ///< without what `summary` derives
    LogHistogram used_;     ///< of images when they were made anew
    std::map<std::uint32_t, Shown> nodes_;
};

namespace eval {

/// Nodes whose images a plan makes: what `DisparitySeries::add` wants to know. Ascending, each
/// once.
[[nodiscard]] std::vector<std::uint32_t> images_made(const FramePlan& plan);

} // namespace eval
} // namespace farfield
