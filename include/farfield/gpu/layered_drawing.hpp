#pragma once

#include <farfield/image/layered_depth_image.hpp>
#include <farfield/image/layered_warp.hpp>
#include <farfield/image/position_picture.hpp>
#include <farfield/math/view.hpp>

#include <glm/vec2.hpp>

#include <cstdint>

/// What all backends share that warp layered depth images with `LayeredWarper`.
namespace farfield::gpu {

/// The view whose pixels have their centres where those of `view` have one of their samples: what
/// is warped to it is, pixel for pixel, what that sample shows.
/// @param place of the sample within its pixel, in [0, 1]^2
/// @par Cost constant
[[nodiscard]] inline View view_of_sample(const View& view, const glm::dvec2& place) noexcept {
    constexpr double kCenter = 0.5;
    const double x = place.x - kCenter;
    const double y = place.y - kCenter;
    View shifted = view;
    shifted.lens = sub_lens(view, x, y, x + view.width, y + view.height);
    return shifted;
}

/// Which surface point a pixel shows that shows a sample of a layered image.
/// @param sample `WarpedLayers::samples` of the pixel; `UINT32_MAX`: none
/// @param node `ShownLayers::node`
/// @return of an image without points, and of no sample, what is known of nothing
/// @par Cost constant
[[nodiscard]] inline PositionTexel shown_point(
    const LayeredDepthImage& image,
    const LayeredTerms& terms,
    std::uint32_t sample,
    std::uint32_t node
) noexcept {
    if (image.points.empty() || sample == UINT32_MAX) {
        return {};
    }
    const LayeredSample& shown = image.samples[sample];
    const float w = terms.columns[0].z * static_cast<float>(shown.x) +
                    terms.columns[1].z * static_cast<float>(shown.y) +
                    terms.columns[2].z * static_cast<float>(shown.depth) + terms.columns[3].z;
    PositionTexel texel = image.points[sample];
    texel.texel_px = static_cast<float>(shown.extent) * terms.size / w;
    texel.node = node;
    return texel;
}

} // namespace farfield::gpu
