#pragma once

#include <farfield/core/executor.hpp>
#include <farfield/core/ids.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/color_cube_model.hpp>
#include <farfield/image/surface_sampler.hpp>

#include <span>

namespace farfield::image {

/// Fills in `level_factors` of a tree that has colours and gains.
///
/// Cells are blended as if they hid each other by chance, but a ray that is long in one is short in
/// the next, and what is in both hides itself. With the factors the tree, shown by the cells of one
/// level, covers as much as rays into it find, in a mean over all directions that knows six of
/// them. A tree that stands in several places is taken together with what stands around one of
/// them: in a field no silhouette has a rim.
/// @param item as of `SurfaceSampler::cast`
/// @param places all that refer to the tree; empty: it stands alone, as the scene's
void fit_level_factors(
    const SurfaceSampler& sampler,
    ItemId item,
    std::span<const CubeReference> places,
    const ColorCubeOptions& options,
    Executor& executor,
    ColorCubeTree& tree
);

} // namespace farfield::image
