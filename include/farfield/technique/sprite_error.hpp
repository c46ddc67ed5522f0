#pragma once

#include <farfield/image/proxy_pair.hpp>
#include <farfield/math/frustum.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace farfield {

/// Where a picture of a pair's fine model was drawn from, and where it is seen from once it is
/// projected on the coarse one. All relative to `ProxyPair::origin`.
struct SpriteEyes {
    glm::vec3 drawn_from{0.0F}; ///< [m]
    glm::vec3 seen_from{0.0F};  ///< [m]
    Frustum drawn;              ///< what the picture holds
    Frustum seen;               ///< what the frame shows
};

/// Angles by which the samples are shown off their places.
struct SpriteError {
    double rms_rad = 0.0;      ///< [rad] root of their mean square; 0 where none is measured
    double largest_rad = 0.0;  ///< [rad] the largest of those measured
    std::uint32_t samples = 0; ///< measured
    std::uint32_t nodes = 0;   ///< looked at
};

/// Errors of a pair and a picture: samples that are in both frusta count, but for `paper`.
///
/// A sample C with the height s over the plane of its facet, of normal n, is shown where the ray
/// from v1 meets that plane: at C + b d with
///
///     d = (C - v1) / |C - v1|,   b = -s / (n.d),   |n.d| taken as 1/16 at least
///
/// and is seen off its place by `metric::sprite_angle_unchecked(v1, v2, C, b)`; pi where the plane
/// is met behind v1, or C is an eye.
/// @par Source Chen, Swan, Kuo 1999, section 3.2. Departures: the turn of every sample and b along
/// the ray, where the paper has one turn for all and the distance to the facet (`paper`).
///
/// Blind spots: planes are taken for facets, so a ray that leaves its facet before it meets the
/// plane is measured as if it had not; rays that graze facets at less than 3.6 degrees are measured
/// as at 3.6; what the picture does not show because something hides it counts like the rest.
namespace sprite_error {

/// The offset b of a sample. [m]
[[nodiscard]] float offset_along_ray(
    const ProxyFacet& facet, const glm::vec3& point, const glm::vec3& drawn_from
) noexcept;

/// The angle of one sample. [rad]
[[nodiscard]] float
of_sample(const ProxyPair& pair, const ProxySample& sample, const SpriteEyes& eyes) noexcept;

/// Largest angle of any sample under a node. [rad] Never too small
[[nodiscard]] float bound_of_node(const ProxyNode& node, const SpriteEyes& eyes) noexcept;

/// The largest angle of all samples: nodes whose bound is not over the largest found so far are
/// left out, so that `rms_rad` is 0.
/// @param ignore_rad angles up to this are not told apart: the largest is at least that much, and
/// what lies below is not searched. [rad] >= 0; 0: exact
/// @par Cost a few hundred nodes for 10^5 samples, growing where many are almost as wrong
[[nodiscard]] SpriteError
largest(const ProxyPair& pair, const SpriteEyes& eyes, float ignore_rad) noexcept;

/// The root of the mean square, in double.
/// @param most where more samples are in both frusta, every k-th in the order of the tree is
/// measured, so that about so many are: they are spread as evenly as the samples are. 0: all
/// @par Cost linear in the samples measured and the nodes that cross a frustum's border
[[nodiscard]] SpriteError
rms(const ProxyPair& pair, const SpriteEyes& eyes, std::uint32_t most) noexcept;

/// The paper's shortcut: one turn for all, that of the middle of the root node, and the distance to
/// the facet's plane as b; all samples given, in sight or not. Not a bound.
/// @param samples into `ProxyPair::samples`
[[nodiscard]] SpriteError paper(
    const ProxyPair& pair, const SpriteEyes& eyes, std::span<const std::uint32_t> samples
) noexcept;

/// The samples for `paper`: of each facet that has any, the one nearest to their mean.
/// @par Source The paper takes the middle of each square of the coarse grid, which is two facets
[[nodiscard]] std::vector<std::uint32_t> middle_samples(const ProxyPair& pair);

/// True where the coarse surface may be as near to an eye as `margin`, or on its other side: some
/// sample is no farther from the eye than its height over its facet and the margin. What is drawn
/// of the coarse model may then hide all that there is to see. Bounds of nodes stand for samples.
/// @param margin [m] >= 0
[[nodiscard]] bool is_near(const ProxyPair& pair, const glm::vec3& eye, float margin) noexcept;

} // namespace sprite_error

} // namespace farfield
