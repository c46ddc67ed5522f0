#pragma once

#include <farfield/core/executor.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/color_cube_model.hpp>
#include <farfield/image/surface_sampler.hpp>

#include <glm/vec3.hpp>

#include <span>

namespace farfield::image {

/// Fills in the cubes of a tree whose cells are there.
/// @param item as of `SurfaceSampler::cast`
/// @param lights unit directions towards the light in the frame of the tree, one a set
void color_cells(
    const SurfaceSampler& sampler,
    ItemId item,
    std::span<const glm::vec3> lights,
    float ambient,
    const ColorCubeOptions& options,
    Executor& executor,
    ColorCubeTree& tree
);

} // namespace farfield::image
