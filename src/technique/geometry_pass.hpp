#pragma once

#include "technique/plan_writer.hpp"
#include <farfield/math/frustum.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <glm/vec3.hpp>

namespace farfield {

/// The pass that draws the caller's frame.
[[nodiscard]] Pass frame_pass(const View& view, std::uint32_t batch) noexcept;

/// Commands for the items that have left their places, each where its own box meets the frustum:
/// part of every frame, whatever else is in it.
void write_moving(const Hierarchy& hierarchy, const Frustum& frustum, PlanWriter& writer) noexcept;

/// Commands for everything in the frustum, what moves last: the baseline, shared with the frames of
/// other techniques in which no image is shown.
/// @param eye relative to the hierarchy's origin
void write_geometry(
    const Hierarchy& hierarchy,
    const Frustum& frustum,
    const glm::vec3& eye,
    GeometryOrder order,
    PlanWriter& writer
) noexcept;

/// Commands for the split surfaces in a frustum alone.
/// @param kind geometry or mask
void write_surfaces(
    const Hierarchy& hierarchy,
    const Frustum& frustum,
    const glm::vec3& eye,
    GeometryOrder order,
    Command::Kind kind,
    PlanWriter& writer
) noexcept;

} // namespace farfield
