#pragma once

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace farfield {

/// How a cube of space looks from afar: for each face what is seen through it, looking straight in,
/// averaged. Premultiplied RGBA; alpha is the covered fraction of the face. 24 bytes.
/// @par Source Chamberlain et al. 1996, section 4
struct ColorCube {
    /// Seen from -x, +x, -y, +y, -z and +z: face 2a + 1 is the one whose outward normal is +a.
    std::array<glm::u8vec4, 6> faces{};

    friend bool operator==(const ColorCube&, const ColorCube&) = default;
};
static_assert(sizeof(ColorCube) == 24);

/// Number of the face of axis `axis` that is turned towards an eye on the positive or the negative
/// side.
[[nodiscard]] constexpr std::size_t face_of(std::size_t axis, bool positive_side) noexcept {
    return axis * 2 + (positive_side ? 1 : 0);
}

/// The cube of eight octants, where an octant without contents is a cube of zeros. Per face: each
/// of the four near octants over the far one behind it, then the mean of the four.
/// @param octants bit 0 of the position is the upper half of x, bit 1 of y, bit 2 of z
/// @return each component rounded to nearest
/// @par Source Chamberlain et al. 1996, section 4. It takes what is near and what is far to be
/// independent: a slanted surface, whose far part shows beside the near one, loses alpha.
[[nodiscard]] ColorCube composed(const std::array<ColorCube, 8>& octants) noexcept;

/// -ln(1 - alpha): what alphas of things behind each other add up as.
/// @param alpha 255 counts as 254.5
[[nodiscard]] float optical_depth(std::uint8_t alpha) noexcept;

/// How a box filled with something looks from any direction, from how it looks along its axes.
///
/// Contents are taken for a medium: along axis a their optical depth is tau_a = -ln(1 - alpha_a)
/// over the extent e_a. Along a unit direction d the density is the length of the vector of
/// |d_a| tau_a / e_a, which is exact for one flat sheet along an axis and for what has no
/// direction; with V the volume and S the silhouette of the box, a ray of that direction is V / S
/// long in the mean:
///
///     alpha(d) = 1 - exp(-g |(d_a tau_a / e_a)| V / S),   S = sum_a |d_a| V / e_a
///     g = 1 + (gain - 1) o,                                o = 3/2 (1 - sum_a d_a^4)
///
/// The gain tells how contents differ from a medium. It is measured such that the covered area is
/// right in the mean over all directions; along the axes, where o is 0, what was measured there
/// holds.
/// @param depths tau of the faces seen, by axis (`optical_depth`)
/// @param direction unit
/// @param size of the box along the axes, > 0
/// @param gain > 0
/// @return covered fraction of the silhouette [0, 1]; 1 where no float is between
[[nodiscard]] inline float oblique_alpha(
    const glm::vec3& depths, const glm::vec3& direction, const glm::vec3& size, float gain
) noexcept {
    const glm::vec3 way = glm::abs(direction) / size;
    const glm::vec3 square = direction * direction;
    const float factor = 1.0F + (gain - 1.0F) * 1.5F * (1.0F - glm::dot(square, square));
    const float silhouette = way.x + way.y + way.z; // per volume
    return 1.0F - std::exp(-factor * glm::length(way * depths) / silhouette);
}

/// How contents of a cell differ from a medium, in a byte.
struct CubeGain {
    /// The lower seven bits: 2^((value - 64) / 16), 1/16 to 15.3. The highest one: they are one
    /// sheet, a part of a surface, that hides what is behind it.
    std::uint8_t stored = 64;

    friend bool operator==(const CubeGain&, const CubeGain&) = default;
};

/// @param gain > 0; rounded to the nearest that can be kept
[[nodiscard]] CubeGain make_gain(float gain, bool sheet) noexcept;
[[nodiscard]] float gain_of(CubeGain gain) noexcept;
[[nodiscard]] constexpr bool is_sheet(CubeGain gain) noexcept {
    return (gain.stored & 0x80U) != 0U;
}
[[nodiscard]] constexpr CubeGain with_sheet(CubeGain gain, bool sheet) noexcept {
    return {static_cast<std::uint8_t>((gain.stored & 0x7FU) | (sheet ? 0x80U : 0U))};
}

} // namespace farfield
