#pragma once

#include <farfield/core/executor.hpp>
#include <farfield/core/result.hpp>
#include <farfield/technique/placement_map.hpp>

#include <cstdint>
#include <functional>

namespace farfield {

/// Told while a map is built: sites placed so far, and those known of.
using PlacementProgress = std::function<void(std::size_t placed, std::size_t known)>;

/// Places images so that no view renders more primitives than the budget.
///
/// Eyes are divided into boxes, *sites*. What any eye of a site can see in one direction is what
/// its middle sees of the model with every cell grown by half of the site, plane by plane: so a
/// site answers for all of its eyes, exactly. As a view turns, the cells in it change at finitely
/// many angles, each worked out from the corners of a cell; between two of them a view costs the
/// same. The most expensive view gets an image of the subset of its cells that is best to replace,
/// then the most expensive of those left, until none is over the budget. A site where too much
/// stands too near for that is halved in all directions.
///
/// The subset is a box of screen and depth: all cells in view right of a left border, left of a
/// right one, above a bottom, below a top and behind a near one. The search starts with all that is
/// far enough and moves one border at a time, half of what is left between it and the opposite one
/// or less, to where `policy::placement_benefit` promises most `lookahead` steps later, for as long
/// as what is left in view is within the target.
///
/// The published grid has points instead, which eyes before them share; section 3.2. There an image
/// is made up to 2.8 spacings behind the eye, here at most half a diagonal from it.
/// @param hierarchy any partition; an octree cuts cells of one size
/// @param executor shares the work; the map does not depend on it
/// @return an error that names the option and its value; `unsupported` where more than the budget
/// stands around a site of `max_level`, which names the place, the direction and the count
/// @par Cost for every site some ten microseconds a cell, and a millisecond an image
/// @par Source Aliaga and Lastra 1999, section 3
[[nodiscard]] Result<PlacementMap> build_placement(
    const Hierarchy& hierarchy,
    const PlacementOptions& options,
    Executor& executor,
    const PlacementProgress& progress = {}
);

} // namespace farfield
