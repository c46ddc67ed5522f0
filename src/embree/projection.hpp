#pragma once

#include "embree/frame_work.hpp"
#include "embree/tile.hpp"
#include <farfield/image/position_picture.hpp>

#include <glm/vec3.hpp>

#include <array>
#include <optional>
#include <span>

namespace farfield::embree {

/// A point of a triangle that a ray has met, in camera axes, relative to the eye [m].
struct MetPoint {
    glm::dvec3 point{0.0};
    std::array<glm::dvec3, 3> corners{};
};

/// What a keyframe shows there.
struct Projected {
    Color16 color{};        ///< opaque
    PositionTexel position; ///< where they are kept
};

/// Looks for the first keyframe that sees a point.
/// @param pass for positions: of its pixels
/// @param whole as `Command::whole_triangles`
/// @param positions whether they are kept
/// @return nothing where it has its own colour
[[nodiscard]] std::optional<Projected> project(
    std::span<const PassKeyframe> keyframes,
    const Pass& pass,
    const MetPoint& met,
    bool whole,
    bool positions
) noexcept;

} // namespace farfield::embree
