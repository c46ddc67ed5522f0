#pragma once

#include <cstdint>

namespace farfield::policy {

/// True when an image that lives `life_frames` frames is cheaper, frame by frame, than drawing the
/// contents: create / life + draw_image < draw_contents. A life of zero never pays.
/// @param create_s, draw_image_s, draw_contents_s [s] >= 0
/// @par Source Shade et al. 1996, section 2, UpdateNode
[[nodiscard]] constexpr bool image_pays(
    double create_s, double draw_image_s, double draw_contents_s, std::uint32_t life_frames
) noexcept {
    return life_frames > 0 &&
           create_s / static_cast<double>(life_frames) + draw_image_s < draw_contents_s;
}

} // namespace farfield::policy
