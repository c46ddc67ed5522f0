#pragma once

#include <farfield/math/box3.hpp>
#include <farfield/math/plane.hpp>
#include <farfield/math/view.hpp>

#include <array>
#include <cstdint>

namespace farfield {

/// What a convex volume sees of a box.
enum class Overlap : std::uint8_t {
    outside, ///< certainly nothing
    partial, ///< perhaps something
    inside,  ///< certainly everything
};

/// The six planes of a view, in a frame relative to `origin`; normals point inwards.
/// Order: left, right, bottom, top, near, far.
struct Frustum {
    std::array<Plane, 6> planes;
};

/// The view's frustum relative to `origin`; formed in double and narrowed once, so a scene at
/// 1e7 m is culled as one at 0.
[[nodiscard]] Frustum make_frustum(const View& view, const glm::dvec3& origin) noexcept;

/// Box against frustum by the nearest and farthest corner of each plane. `outside` and `inside`
/// are certain up to rounding of the plane distances; a box near an edge of the frustum may be
/// `partial` though nothing of it is seen.
[[nodiscard]] Overlap classify(const Frustum& frustum, const Box3f& box) noexcept;

} // namespace farfield
