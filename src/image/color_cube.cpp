#include <farfield/image/color_cube.hpp>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace farfield {

ColorCube composed(const std::array<ColorCube, 8>& octants) noexcept {
    ColorCube result;
    constexpr std::uint32_t kMost = 255;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const bool positive : {false, true}) {
            const std::size_t face = face_of(axis, positive);
            // Sums of four colours, 255 times as large, so that rounding happens once.
            glm::uvec4 sum(0U);
            for (std::size_t octant = 0; octant < 8; ++octant) {
                if (((octant >> axis & 1U) != 0U) != positive) {
                    continue;
                }
                const glm::uvec4 near_color(octants[octant].faces[face]);
                const glm::uvec4 far_color(octants[octant ^ (std::size_t{1} << axis)].faces[face]);
                sum += near_color * kMost + far_color * (kMost - near_color.a);
            }
            result.faces[face] = glm::u8vec4((sum + kMost * 2) / (kMost * 4));
        }
    }
    return result;
}

float optical_depth(std::uint8_t alpha) noexcept {
    // An alpha of 8 bits that says 1 says no more than half a step less.
    return -std::log1p(-std::min(static_cast<float>(alpha), 254.5F) / 255.0F);
}

CubeGain make_gain(const glm::vec3& gains, bool sheet) noexcept {
    CubeGain result;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float power = 16.0F * std::log2(gains[static_cast<int>(axis)]);
        const float value = std::clamp(64.0F + power, 0.0F, 127.0F);
        result.stored[axis] = static_cast<std::uint8_t>(std::lround(value));
    }
    result.stored[0] = static_cast<std::uint8_t>(result.stored[0] | (sheet ? 0x80U : 0U));
    return result;
}

glm::vec3 gain_of(const CubeGain& gain) noexcept {
    const auto of = [&](std::size_t axis) {
        return std::exp2((static_cast<float>(gain.stored[axis] & 0x7FU) - 64.0F) / 16.0F);
    };
    return {of(0), of(1), of(2)};
}

} // namespace farfield
