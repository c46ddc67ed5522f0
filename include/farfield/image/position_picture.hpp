#pragma once

#include <farfield/core/ids.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace farfield {

/// What one pixel really shows, through every image that it is shown by.
struct PositionTexel {
    glm::vec3 point{0.0F};       ///< [m] in the frame of the item's mesh, relative to its origin
    ItemId item = kNone<ItemId>; ///< whose surface it is; none: background
    /// Sizes of the texels that lie between the pixel and the point, each as seen in this picture
    /// and added up along the chain of images: 0 where geometry is shown. [px] A point is sampled
    /// at most half a texel's diagonal off, so at most `sqrt(0.5)` times this is error of sampling.
    float texel_px = 0.0F;
    std::uint32_t node = UINT32_MAX; ///< `ImageQuad::node` of the image shown; none: geometry

    friend bool operator==(const PositionTexel&, const PositionTexel&) = default;
};

/// A frame told apart by surface points instead of colours: what disparity is measured on. The
/// front-most layer whose alpha is at least 0.5 owns a pixel; one sample a pixel, no blending.
struct PositionPicture {
    int width = 0;                     ///< [px]
    int height = 0;                    ///< [px]
    std::vector<PositionTexel> texels; ///< width * height, rows from the top

    friend bool operator==(const PositionPicture&, const PositionPicture&) = default;
};

} // namespace farfield
