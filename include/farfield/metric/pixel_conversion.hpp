#pragma once

#include <farfield/math/view.hpp>
#include <farfield/metric/pixel_angle.hpp>

#include <cmath>
#include <cstdint>

namespace farfield {

/// How a threshold in pixels becomes an angle.
enum class PixelConversion : std::uint8_t {
    mean,  ///< vertical field of view / height, as in the papers: up to 2.5 times too large at the
           ///< rim
    bound, ///< the largest angle that is never more than the pixels promised, anywhere on the image
};

namespace metric {

/// The angle that stands for `pixels` of the image of a view.
/// @param pixels > 0, finite
/// @return [rad] > 0; not limited to what a cone can be, where `pixels` are more than the image has
/// @pre validate(view)
[[nodiscard]] inline double
angle_of_pixels(const View& view, double pixels, PixelConversion conversion) noexcept {
    if (conversion == PixelConversion::mean) {
        const double fov_y = std::atan(view.lens.top) - std::atan(view.lens.bottom);
        return pixels * mean_pixel_angle(fov_y, view.height);
    }
    return angle_of_pixels_unchecked(pixel_scale(view.lens, view.width, view.height).scale, pixels);
}

} // namespace metric

} // namespace farfield
