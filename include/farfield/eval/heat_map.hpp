#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/pixel_map.hpp>
#include <farfield/image/picture.hpp>

#include <glm/ext/vector_uint3_sized.hpp>

#include <string>

namespace farfield {

/// How numbers become colours.
struct HeatMapOptions {
    double dark = 0.0;   ///< [unit of the map] shown darkest, with all that lies beyond it; finite
    double bright = 1.0; ///< [unit of the map] shown brightest; finite, more or less than `dark`
    glm::u8vec3 beyond{0, 255, 160};      ///< 8-bit sRGB; what lies beyond `bright`
    glm::u8vec3 unmeasured{96, 104, 112}; ///< 8-bit sRGB; where nothing was measured
    bool color_bar = true;                ///< the scale with both its ends, below the map
    /// Of the map's values, written behind both ends of the scale: "px". Digits, most lower-case
    /// letters and . + - have a shape, other characters stay blank. Empty: numbers alone.
    std::string unit = {};
};

namespace eval {

/// Height of the strip that holds the colour bar. [px]
inline constexpr int kColorBarHeight = 20;

/// Colour of a share of the scale, 8-bit sRGB: from near black over violet, red and orange to pale
/// yellow. L* rises evenly from 4 to 94, so it is read in grey and by the colour-blind as well; the
/// hue turns with it, and the colour is as strong as sRGB allows up to a chroma of 70.
/// @param share [0, 1], else clamped; not a number counts as 0
[[nodiscard]] glm::u8vec3 heat_color(double share) noexcept;

/// A picture of a map: of errors `{.bright = 3}` in their unit, of similarity `{.dark = 1, .bright
/// = 0}`, where less is worse.
/// @return an opaque picture of the map's size, higher by `kColorBarHeight` with the colour bar; or
/// an error where the map is empty, its values do not fill its size, or the ends of the scale are
/// equal or not finite
[[nodiscard]] Result<Picture> heat_map(const PixelMap& map, const HeatMapOptions& options = {});

} // namespace eval
} // namespace farfield
