#pragma once

#include <farfield/technique/placement_map.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace farfield {

/// A cell in view: tangents of the box around it on the screen, and depths along the view
/// direction.
struct SeenCell {
    double left = 0.0;
    double right = 0.0;
    double bottom = 0.0;
    double top = 0.0;
    double near_depth = 0.0; ///< [m]
    std::uint64_t primitives = 0;
};

/// What a subset is searched for.
struct SubsetTask {
    std::span<const SeenCell> cells; ///< that may be replaced
    std::uint64_t total = 0;         ///< primitives in view, others included
    /// That may be left of `total`, of which it is only a part; all cells together leave no more.
    std::uint64_t target = 0;
    Lens lens;                 ///< of the screen
    std::int32_t width = 0;    ///< [px] of the screen
    std::int32_t height = 0;   ///< [px]
    double model_extent = 0.0; ///< [m]
    PlacementWeights<double> weights;
    std::uint32_t lookahead = 2;
};

/// The subset, as indices into `SubsetTask::cells`, ascending; never empty where `cells` is not.
struct Subset {
    std::vector<std::uint32_t> cells;
    std::uint64_t primitives = 0;
};

/// Searches a contiguous subset: one of all boxes of screen and depth.
/// @par Cost some `5^lookahead` passes over the cells for each of the steps, which are about as
/// many as the borders have bits
[[nodiscard]] Subset search_subset(const SubsetTask& task);

} // namespace farfield
