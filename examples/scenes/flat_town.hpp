#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// A town of equal square blocks on flat ground, as rich in one place as in another: the scene in
/// which the events of an image cache can be shown on a map. The defaults give 256 blocks; a k-d
/// tree with four children a box and four levels below the root has 341 boxes over them, none of
/// them empty or split along up.
/// @par Source Schaufler and Stürzlinger 1996, section 5.1: the scene is assumed there; what stands
/// in it is ours
struct FlatTownOptions {
    int blocks = 16;          ///< a side; [1, 128]
    double block_m = 40.0;    ///< [m] side of a block, with half of the streets around it; > 0
    std::uint64_t seed = 341; ///< of houses, trees and colours
};

/// [m] The highest roof of the town is below it.
[[nodiscard]] double flat_town_height(const FlatTownOptions& options) noexcept;

/// Checks the ranges above and finiteness; the message names the option and its value.
[[nodiscard]] Result<void> validate(const FlatTownOptions& options);

/// Builds the town: y up, the ground at 0, the middle of the town at 0. Mesh 0 is the ground with
/// the streets, mesh 1 the houses, mesh 2 the trees, each placed once, each splittable. Every block
/// has streets around it, four houses of two storeys or three with windows and a roof, and trees in
/// its garden; nothing that stands reaches over the border of its block. About 1,600 triangles a
/// block. The same options give the same scene on every run.
/// @return the scene; an error naming the option and its value
[[nodiscard]] Result<Scene> make_flat_town(const FlatTownOptions& options = {});

} // namespace farfield::scenes
