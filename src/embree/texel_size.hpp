#pragma once

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>

namespace farfield::embree {

/// `PositionTexel::texel_px` of a pixel that shows a texel of a page.
/// @param dx, dy steps on the page from the pixel to its neighbours [texel]
/// @param moved from the place of the pixel on the page to the centre of the texel [texel]
/// @param nested what the page keeps of the texel
[[nodiscard]] inline float seen_texel_px(
    const glm::vec2& dx, const glm::vec2& dy, const glm::vec2& moved, float nested
) noexcept {
    // Pixels per texel: the inverse of texels per pixel.
    const float area = dx.x * dy.y - dx.y * dy.x;
    const glm::vec2 u = glm::vec2(dy.y, -dx.y) / area;
    const glm::vec2 v = glm::vec2(-dy.x, dx.x) / area;
    const float half_diagonal = 0.5F * std::max(glm::length(u + v), glm::length(u - v));
    const float distance = glm::length(u * moved.x + v * moved.y);
    // Errors of the page's own sampling are seen enlarged by the largest singular value at most.
    const float squares = glm::dot(u, u) + glm::dot(v, v);
    const float product = u.x * v.y - u.y * v.x;
    const float scale = std::sqrt(
        0.5F * (squares + std::sqrt(std::max(squares * squares - 4.0F * product * product, 0.0F)))
    );
    constexpr float kSqrtHalf = 0.70710678F;
    return std::max(half_diagonal, distance) / kSqrtHalf + nested * scale;
}

} // namespace farfield::embree
