#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// Mountains: a square of heights whose ridges are sharp and whose valleys are smooth, with a
/// picture of grass, scree, rock and snow that has as much detail as the heights.
struct TerrainOptions {
    int posts = 513;           ///< a side; [9, 4097]
    double side_m = 10'240.0;  ///< of the square, > 0
    double relief_m = 1'200.0; ///< from the lowest post to the highest, >= 0
    std::uint64_t seed = 1;
};

/// Checks ranges. The message names the option and its value.
[[nodiscard]] Result<void> validate(const TerrainOptions& options);

/// Side of its texture. [texel]
inline constexpr int kTerrainTexels = 512;

/// One splittable mesh, a grid of heights (`height_grid_of`) centred on the origin in x and z with
/// the lowest post at 0, and one texture.
/// @par Source ridges after Musgrave, in Ebert et al., Texturing and Modeling, 2003, chapter 16
[[nodiscard]] Result<Scene> make_terrain(const TerrainOptions& options = {});

} // namespace farfield::scenes
