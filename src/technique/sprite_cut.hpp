#pragma once

#include <farfield/image/proxy_pair.hpp>
#include <farfield/math/frustum.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace farfield {

/// What a cut of a refinable coarse model is made for. Relative to the pair's origin.
struct CutQuery {
    Frustum frustum;
    glm::dvec3 seen_from{0.0};                ///< [m]
    std::span<const glm::dvec3> drawn_from{}; ///< [m] of the keyframes to be shown on it
    double threshold_rad = 0.0; ///< a triangle is split where it may be more wrong than this
    std::size_t most = 0;       ///< triangles. >= 1
};

/// What became of it.
struct Cut {
    std::uint32_t first = 0;    ///< where its triangles are among those selected
    std::size_t count = 0;      ///< triangles
    double threshold_rad = 0.0; ///< that it holds, down to the finest triangles: that asked for,
                                ///< doubled until the triangles were few enough
    float offset_m = 0.0F;      ///< [m] the greatest of its triangles
    bool complete = true;       ///< false: even the roots in view are more than `most`
};

/// A threshold, for many triangles.
struct CutLimit {
    double sine = 0.0;
    double tangent = 0.0; ///< infinite for a right angle and more
    bool all = false;     ///< no angle is more
};
[[nodiscard]] CutLimit limit_of(double threshold_rad) noexcept;

/// Whether a triangle with this split may show what it stands for farther off its place than the
/// limit, over all points of its sphere and offsets either way: the bound of
/// `metric::sprite_angle_bound_unchecked` for the least distance and the largest turn. Never turns
/// false as the radius of nested spheres or the offset grows, so that triangles along an edge
/// decide alike.
/// @param axis unit: what facets face, about; rays count as they cross it
[[nodiscard]] bool exceeds(
    const ProxySplit& split,
    const glm::dvec3& axis,
    const glm::dvec3& drawn_from,
    const glm::dvec3& seen_from,
    const CutLimit& limit
) noexcept;

/// Appends the triangles of the coarse mesh to draw: those in the frustum, without cracks between
/// them.
/// @pre is_refinable(pair)
/// @par Cost linear in the triangles of the cut; twice that for every doubling
[[nodiscard]] Cut
cut_coarse(const ProxyPair& pair, const CutQuery& query, std::vector<std::uint32_t>& out) noexcept;

/// Appends the finest triangles in the frustum.
/// @pre is_refinable(pair)
[[nodiscard]] std::size_t finest_triangles(
    const ProxyPair& pair, const Frustum& frustum, std::vector<std::uint32_t>& out
) noexcept;

} // namespace farfield
