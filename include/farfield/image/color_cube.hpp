#pragma once

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
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
///     alpha(d) = 1 - exp(-F |(f_a d_a tau_a / e_a)| V / S),   S = sum_a |d_a| V / e_a
///     f_a = 1 + (gain_a - 1) o,                               o = sqrt(3/2 (1 - sum_a d_a^4))
///
/// The gains tell how contents differ from a medium: they are measured such that the covered area
/// is right in the mean over directions, and over those near each axis. Along the axes, where o is
/// 0, what was measured there holds. Beside them o grows with the angle, as the silhouette does.
/// @param depths tau of the faces seen, by axis (`optical_depth`)
/// @param direction of any length but 0
/// @param size of the box along the axes, >= 0; without a silhouette it covers 0
/// @param gains by axis, > 0
/// @param factor F > 0, of all cells of a level (`level_factor`)
/// @return covered fraction of the silhouette [0, 1]; 1 where no float is between
[[nodiscard]] inline float oblique_alpha(
    const glm::vec3& depths,
    const glm::vec3& direction,
    const glm::vec3& size,
    const glm::vec3& gains,
    float factor
) noexcept {
    // V |d_a| / e_a: what of the silhouette a face takes. No side is divided by, as flat ones are
    // 0.
    const glm::vec3 areas(size.y * size.z, size.z * size.x, size.x * size.y);
    const glm::vec3 seen = glm::abs(direction) * areas;
    const float silhouette = seen.x + seen.y + seen.z;
    const glm::vec3 square = direction * direction / glm::dot(direction, direction);
    const float oblique = std::sqrt(std::max(0.0F, 1.5F * (1.0F - glm::dot(square, square))));
    const glm::vec3 factors = 1.0F + (gains - 1.0F) * oblique;
    return silhouette > 0.0F
               ? 1.0F - std::exp(-factor * glm::length(factors * seen * depths) / silhouette)
               : 0.0F;
}

/// What depends on the direction alone, whichever side it comes from: its value along x, y and z,
/// then that between y and z, z and x, x and y.
using LevelFactors = std::array<float, 6>;
inline constexpr float kLeastLevelFactor = 0.25F;
inline constexpr float kMostLevelFactor = 4.0F;

/// How much each of the six counts along a direction: with u_a = s_a |d_a| / sum_b s_b |d_b|, u_a^2
/// and 2 u_b u_c, whose sum is 1.
/// @param direction not 0
/// @param scale s > 0; the roots of the sides of the tree, upside down: what a carpet looks like
/// changes most where it is seen at a grazing angle
[[nodiscard]] inline LevelFactors
level_weights(const glm::vec3& direction, const glm::vec3& scale) noexcept {
    const glm::vec3 along = glm::abs(direction) * scale;
    const glm::vec3 u = along / (along.x + along.y + along.z);
    return {u.x * u.x, u.y * u.y, u.z * u.z, 2.0F * u.y * u.z, 2.0F * u.z * u.x, 2.0F * u.x * u.y};
}

/// The factor along a direction: the mean of the six by these weights.
[[nodiscard]] inline float level_factor(
    const LevelFactors& factors, const glm::vec3& direction, const glm::vec3& scale
) noexcept {
    // Not by an array of weights, which compilers keep in memory.
    const glm::vec3 along = glm::abs(direction) * scale;
    const float sum = along.x + along.y + along.z;
    const float doubled = along.y * along.z * factors[3] + along.z * along.x * factors[4] +
                          along.x * along.y * factors[5];
    const float squares = along.x * along.x * factors[0] + along.y * along.y * factors[1] +
                          along.z * along.z * factors[2];
    return (squares + 2.0F * doubled) / (sum * sum);
}

/// How contents of a cell differ from a medium, in a byte for each axis.
struct CubeGain {
    /// The lower seven bits: 2^((value - 64) / 16), 1/16 to 15.3. The highest one of the first:
    /// they are one sheet, a part of a surface, that hides what is behind it. The others have none.
    std::array<std::uint8_t, 3> stored{64, 64, 64};

    friend bool operator==(const CubeGain&, const CubeGain&) = default;
};
static_assert(sizeof(CubeGain) == 3);

/// @param gains by axis, > 0; rounded to the nearest that can be kept
[[nodiscard]] CubeGain make_gain(const glm::vec3& gains, bool sheet) noexcept;
[[nodiscard]] glm::vec3 gain_of(const CubeGain& gain) noexcept;
[[nodiscard]] constexpr bool is_sheet(const CubeGain& gain) noexcept {
    return (gain.stored[0] & 0x80U) != 0U;
}

} // namespace farfield
