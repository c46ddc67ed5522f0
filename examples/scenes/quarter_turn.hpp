#pragma once

#include <glm/ext/matrix_double4x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>

namespace farfield::scenes {

/// Stands something at a place, larger by a factor and turned around y by a number of quarter
/// turns, from +z towards +x. Entries of the matrix are exactly 0, `scale` or -`scale`, so boxes
/// along the axes stay boxes along the axes.
[[nodiscard]] constexpr glm::dmat4x3
quarter_turned(std::uint64_t turns, double scale, const glm::dvec3& place) noexcept {
    constexpr std::array<double, 4> kCosine = {1.0, 0.0, -1.0, 0.0};
    constexpr std::array<double, 4> kSine = {0.0, 1.0, 0.0, -1.0};
    const double cosine = kCosine[turns % 4] * scale;
    const double sine = kSine[turns % 4] * scale;
    return {
        {cosine, 0.0, 0.0 - sine}, // and not -0
        {0.0, scale, 0.0},
        {sine, 0.0, cosine},
        place};
}

} // namespace farfield::scenes
