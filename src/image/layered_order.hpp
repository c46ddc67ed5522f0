#pragma once

#include "image/layered_cover.hpp"
#include <farfield/math/view.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>

/// The order in which samples are drawn without depths: McMillan, An image-based approach to
/// three-dimensional computer graphics, 1997, in rings around the epipole instead of sheets beside
/// it. Those order points of one ray; rings order, but for a texel or two, those of neighbouring
/// rays as well, whose squares overlap.
namespace farfield::detail {

/// Where in a layered image another eye is seen.
struct Epipole {
    std::int32_t column = 0;
    std::int32_t row = 0;
    bool outward = false; ///< what is farther is nearer to the epipole: the inner rings come first
};

/// How much farther a point gets along the view direction of `view` for each metre that it is
/// farther along that of the image: affine in the texels.
struct Recession {
    double per_column = 0.0;
    double per_row = 0.0;
    double corner = 0.0;

    [[nodiscard]] double at(double x, double y) const noexcept {
        return per_column * x + per_row * y + corner;
    }
};

struct RingOrder {
    Epipole epipole;
    Recession recession;
    bool recedes = true; ///< in every texel what is farther from one eye is so from the other
};

[[nodiscard]] RingOrder ring_order(const LayeredDepthImage& image, const View& view) noexcept;

/// Draws all samples into a band: the last one of a pixel is shown.
/// @param shown by pixel of the whole target
void draw_rings(
    const LayeredJob& job, const RingOrder& order, const Band& band, std::span<std::uint32_t> shown
) noexcept;

} // namespace farfield::detail
