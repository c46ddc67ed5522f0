#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/log_histogram.hpp>
#include <farfield/eval/pixel_map.hpp>
#include <farfield/image/position_picture.hpp>
#include <farfield/math/view.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace farfield {

/// How far off the image of one node is in one frame.
struct NodeDisparity {
    std::uint32_t node = UINT32_MAX; ///< `PositionTexel::node`
    std::uint64_t pixels = 0;        ///< that show it
    std::uint64_t over_bound = 0;    ///< of them, further off than promised; 0 without a promise
    /// The pixel that is furthest off when its own error of sampling is taken away; of several the
    /// first from the top left.
    int x = 0;                 ///< [px]
    int y = 0;                 ///< [px] from the top
    double disparity_px = 0.0; ///< of that pixel [px]
    double sampling_px = 0.0;  ///< of that pixel: the part of its promise that pays for sampling

    /// May be less than 0, since the error of sampling is mostly smaller than its bound. [px]
    [[nodiscard]] double less_sampling_px() const noexcept { return disparity_px - sampling_px; }

    friend bool operator==(const NodeDisparity&, const NodeDisparity&) = default;
};

/// How far from where they belong a frame shows surface points. Pixels of background count nowhere.
struct FrameDisparity {
    std::optional<double> error_px; ///< that the technique promises; none: it promises nothing
    PixelMap map; ///< [px] of every pixel, images and geometry; not a number: not measured
    std::uint64_t image_pixels = 0;
    std::uint64_t infinite_pixels = 0; ///< of the image pixels; their points are behind the eye
    std::uint64_t geometry_pixels = 0;
    /// Of pixels that show something, but not what: a point or a texel size that is not a finite
    /// number, or an item that there is no frame for. They count nowhere else.
    std::uint64_t unmeasured_pixels = 0;
    /// Largest promise of all image pixels. [px] None without image pixels or without a promise.
    std::optional<double> bound_px;
    /// Image pixels that are further off than their own promise; none without a promise.
    std::optional<std::uint64_t> over_bound;
    /// Largest disparity of geometry: no more than rounding. [px] None without geometry.
    std::optional<double> geometry_max_px;
    LogHistogram histogram;           ///< [px] of the image pixels, the infinite ones included
    std::vector<NodeDisparity> nodes; ///< that the frame shows images of, ascending
};

namespace eval {

/// What sampling alone may move a point, in sizes of the texels it is seen through: half of their
/// diagonal, sqrt(0.5), rounded up to the two digits in which it is quoted.
inline constexpr double kSamplingShare = 0.71;

/// Measures where each pixel's point belongs: projected by the true view, in double and relative to
/// the eye, so that a scene at 1e7 m is measured as at 0. The disparity is the distance from there
/// to the middle of the pixel; infinite for a point that is not in front of the eye. A point that
/// belongs outside the window has its distance like any other.
///
/// The promise of an image pixel is error_px + `kSamplingShare` * texel_px. Geometry promises 0 and
/// is told apart.
///
/// It tells where points are that are shown, not which ones should be: a surface that is missing
/// has no disparity, and one that shines through where another should hide it has none either.
/// @param frames of the scene, as `farfield::item_frames`, by `ItemId`
/// @param error_px > 0, finite; none: there is no promise
/// @return an error where the view is not valid, the picture's texels do not fill its size, its
/// size is not the view's, or error_px is out of range
/// @par Cost linear in pixels
[[nodiscard]] Result<FrameDisparity> measure_disparity(
    const PositionPicture& picture,
    const View& view,
    std::span<const glm::dmat4x3> frames,
    std::optional<double> error_px
);

} // namespace eval
} // namespace farfield
