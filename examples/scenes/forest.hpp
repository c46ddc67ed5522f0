#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// A closed forest on flat ground, no two trees alike, which a partition may cut anywhere. The
/// defaults are the canonical scene: 100 trees of 1050 triangles.
/// @par Source Schaufler and Stürzlinger 1996, section 5.2: the number of trees and of triangles;
/// how they look and where they stand is ours
struct ForestOptions {
    int trees = 100;             ///< [1, 10000]
    int tree_triangles = 1050;   ///< of each tree; [200, 1000000]
    double spacing_m = 6.0;      ///< [m] from trunk to trunk on average, > 0
    double tree_height_m = 10.0; ///< [m] of the mean tree; single ones differ by a tenth; > 0
    std::uint64_t seed = 585;    ///< of places and trees
};

/// [m] Side of the square of ground that the trees stand on.
[[nodiscard]] double forest_extent(const ForestOptions& options) noexcept;

/// Checks the ranges above and finiteness; the message names the option and its value.
[[nodiscard]] Result<void> validate(const ForestOptions& options);

/// Grows the forest: y up, the ground at 0, its middle at 0. Mesh 0 is the ground, 1800 triangles
/// darker below crowns; then one mesh a tree with exactly the triangles asked for. Each is placed
/// once and splittable. Trees stand on a square lattice, moved from it by up to a fifth of the
/// spacing; their crowns close over the ground, and reach a little over its rim. The same options
/// give the same scene on every run.
/// @return the scene; an error naming the option and its value
[[nodiscard]] Result<Scene> make_forest(const ForestOptions& options = {});

} // namespace farfield::scenes
