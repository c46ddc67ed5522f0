#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/position_picture.hpp>
#include <farfield/math/view.hpp>

#include <glm/vec4.hpp>

#include <cstdint>
#include <vector>

namespace farfield {

/// One surface point of a `LayeredDepthImage`, seen from its eye.
struct LayeredSample {
    std::uint16_t x = 0;     ///< [1/16 texel] from the left edge of the image
    std::uint16_t y = 0;     ///< [1/16 texel] from the lower edge
    std::uint16_t depth = 0; ///< [step] of inverse depth, see `LayeredDepthImage`: larger is nearer
    /// Side of the square that the sample stands for, parallel to the image plane of whoever looks,
    /// where one texel of the image at the sample's own depth is 1. [1/256]
    std::uint16_t extent = 256;
    glm::vec<4, std::uint8_t> color{0}; ///< sRGB-encoded, opaque: alpha is 255

    friend bool operator==(const LayeredSample&, const LayeredSample&) = default;
};
static_assert(sizeof(LayeredSample) == 12);

/// A picture with depth that keeps in each texel not only the nearest surface but several, one
/// behind the other: what is hidden from its eye is there when it is looked at from beside it.
///
/// Sample (x, y, d) is the point at `z` along the view direction of `view`, on the ray through
/// (x / 16, y / 16) [texel], with
///
///     1 / z = 1 / far_depth + d / 65535 (1 / near_depth - 1 / far_depth)
///
/// so a step of depth is one of parallax, at most `near_depth` over 131070 texel distances for
/// eyes no farther from the view's than `near_depth`.
/// @par Source Shade, Gortler, He, Szeliski 1998; Aliaga and Lastra 1999, section 4
struct LayeredDepthImage {
    /// The eye, and the window that the texels divide: `width` x `height` of them, at most 4096 a
    /// side. near and far distances say nothing here.
    View view;
    double near_depth = 1.0; ///< [m] > 0
    double far_depth = 2.0;  ///< [m] > near_depth, finite
    /// Samples in each texel, rows from below, texels from the left.
    std::vector<std::uint8_t> counts;
    /// Of each row, the first of its samples; one more at the end, the number of all.
    std::vector<std::uint32_t> rows;
    /// Texel after texel as `counts`; in a texel near to far. A sample lies inside of its texel.
    std::vector<LayeredSample> samples;
    /// Which surface point each sample is, for those who measure; or empty. Texel sizes and nodes
    /// of it say nothing.
    std::vector<PositionTexel> points;

    friend bool operator==(const LayeredDepthImage&, const LayeredDepthImage&) = default;
};

/// Most texels of a layered depth image along a side.
inline constexpr std::int32_t kMostLayeredTexels = 4096;
/// [1/texel] of `LayeredSample::x` and `y`.
inline constexpr std::int32_t kLayeredSteps = 16;

/// Checks all that warping relies on: the view, sizes, depths in order, counts that add up to rows
/// and samples, samples inside of their texels and near to far, extents above 0, points of all
/// samples or none. For images from files, and for tests.
/// @return an error that names the texel or sample, the field and the value
/// @par Cost linear in texels and samples
[[nodiscard]] Result<void> validate(const LayeredDepthImage& image);

/// Bytes held by the arrays.
[[nodiscard]] std::uint64_t memory_bytes(const LayeredDepthImage& image) noexcept;

} // namespace farfield
