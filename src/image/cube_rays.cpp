#include "image/cube_rays.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace farfield::image {

float jitter(std::uint32_t seed) noexcept {
    // Finaliser of MurmurHash3, which leaves no pattern.
    seed ^= seed >> 16U;
    seed *= 0x85EBCA6BU;
    seed ^= seed >> 13U;
    seed *= 0xC2B2AE35U;
    seed ^= seed >> 16U;
    return static_cast<float>(seed >> 8U) * 0x1p-24F;
}

void aim(std::uint32_t cell, const Box3f& box, const ObliqueCounts& counts, ObliqueRays& out) {
    // A little longer than the box, so that surfaces in its faces are met.
    constexpr float kBeyond = 1e-3F;
    const glm::vec3 size = extent(box);
    const float beyond = std::max({size.x, size.y, size.z}) * kBeyond;
    const glm::vec3 areas(size.y * size.z, size.z * size.x, size.x * size.y);
    // Powers of the inverse of the plastic number: any stretch of such steps fills a square evenly.
    constexpr float kStepU = 0.7548776662F;
    constexpr float kStepV = 0.5698402910F;
    const float per_ray = 1.0F / static_cast<float>(counts.each);
    out.directions.resize(counts.directions);
    out.silhouettes.resize(counts.directions);
    out.rays.resize(counts.directions * counts.each);
    std::uint32_t seed = (cell + 1U) * 0x9E3779B9U;
    for (std::size_t i = 0; i < counts.directions; ++i) {
        // Bands of equal area, the turn within each left to chance.
        const float band =
            (static_cast<float>(i) + jitter(seed++)) / static_cast<float>(counts.directions);
        const float z = -1.0F + 2.0F * band;
        const float turn = 2.0F * std::numbers::pi_v<float> * jitter(seed++);
        const float ring = std::sqrt(std::max(0.0F, 1.0F - z * z));
        const glm::vec3 direction(ring * std::cos(turn), ring * std::sin(turn), z);
        const glm::vec3 seen = glm::abs(direction) * areas;
        const float silhouette = seen.x + seen.y + seen.z;
        out.directions[i] = direction;
        out.silhouettes[i] = silhouette;
        glm::vec2 at(jitter(seed), jitter(seed + 1U));
        seed += 2;
        for (std::size_t k = 0; k < counts.each; ++k) {
            // Uniform over the silhouette: first the face, then the point on it.
            const float part = (static_cast<float>(k) + jitter(seed++)) * per_ray;
            float choice = part * silhouette;
            int axis = 0;
            while (axis < 2 && choice >= seen[axis]) {
                choice -= seen[axis++];
            }
            glm::vec3 from = box.lo;
            from[(axis + 1) % 3] += size[(axis + 1) % 3] * at.x;
            from[(axis + 2) % 3] += size[(axis + 2) % 3] * at.y;
            at = glm::fract(at + glm::vec2(kStepU, kStepV));
            from[axis] = direction[axis] > 0.0F ? box.lo[axis] : box.hi[axis];
            float length = std::numeric_limits<float>::infinity();
            for (int a = 0; a < 3; ++a) {
                const float way = direction[a] > 0.0F ? box.hi[a] - from[a] : from[a] - box.lo[a];
                length = std::min(length, way / std::max(std::abs(direction[a]), 1e-12F));
            }
            out.rays[i * counts.each + k] = {
                from - direction * beyond, direction * (length + 2.0F * beyond)};
        }
    }
}

float alpha_along(
    const ColorCube& cube,
    const glm::vec3& size,
    const glm::vec3& direction,
    const glm::vec3& gains,
    float factor
) noexcept {
    glm::vec3 depths(0.0F);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<int>(axis);
        depths[a] = optical_depth(cube.faces[face_of(axis, direction[a] < 0.0F)].a);
    }
    return oblique_alpha(depths, direction, size, gains, factor);
}

} // namespace farfield::image
