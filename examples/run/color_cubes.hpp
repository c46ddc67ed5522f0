#pragma once

#include "run/world.hpp"
#include <farfield/core/result.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/color_cube_model.hpp>

#include <cstdint>
#include <string>

namespace farfield::run {

/// How colour cubes of a world are had.
struct CubeModelOptions {
    ColorCubeOptions build;
    std::uint32_t min_shared = 256; ///< [triangle] of meshes that have an octree of their own
    /// Where the model is kept: read if it is there, else built and written. Empty: built.
    std::string file;
};

/// Colour cubes, and how long it took to have them.
struct CubeModel {
    ColorCubeModel model;
    double build_s = 0.0; ///< [s] octrees and colours; 0: read
    double read_s = 0.0;  ///< [s] from the file; 0: built
};

/// Builds or reads the colour cubes of a world, without what moves in it. Uses all cores.
/// @return an error of the builder or of the file, which may be of another scene or of other
/// options
[[nodiscard]] Result<CubeModel>
make_color_cubes(const World& world, const CubeModelOptions& options);

} // namespace farfield::run
