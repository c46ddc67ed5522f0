#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <cstdint>

namespace farfield {

/// In which order geometry is drawn; depth is tested either way.
enum class GeometryOrder : std::uint8_t {
    stored,        ///< as it lies in the hierarchy
    front_to_back, ///< nearer cells first, so that hidden fragments are rejected early
};

/// Plain geometry behind hierarchical frustum culling: the baseline that every claim of speed is
/// made against, and the plan of every frame in which no image is shown. Each primitive once, items
/// that move (`Hierarchy::moving`) last.
class CulledGeometry {
  public:
    /// @param hierarchy must outlive the technique
    explicit CulledGeometry(
        const Hierarchy& hierarchy, GeometryOrder order = GeometryOrder::front_to_back
    );

    /// The plan of one frame; valid until the next call. Allocates nothing once warm.
    /// @pre validate(view)
    /// @par Cost linear in the nodes that cross the frustum's border plus the items seen
    /// and those that move
    [[nodiscard]] const FramePlan& plan(const View& view) noexcept;

  private:
    const Hierarchy* hierarchy_;
    GeometryOrder order_;
    FramePlan plan_;
};

} // namespace farfield
