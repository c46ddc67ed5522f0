#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// A round island wooded with one instanced willow. The defaults are the canonical scene:
/// 131,072 triangles of terrain and 1117 trees of 36,230, together 40.6 million.
struct IslandOptions {
    int trees = 1117;             ///< instances; [0, 1000000]
    double radius_m = 400.0;      ///< [m] of the shore, > 0
    double height_m = 20.0;       ///< [m] of the ground at the centre, >= 0; 0: flat
    int terrain_quads = 256;      ///< along each side of the grid, two triangles each; [2, 4096]
    int tree_triangles = 36230;   ///< of the one tree; [2000, 10000000]
    double tree_height_m = 14.0;  ///< [m] > 0
    double tree_width_m = 11.0;   ///< [m] > 0
    double min_spacing_m = 12.0;  ///< [m] between trunks, >= 0
    double min_scale = 0.9;       ///< of a tree, > 0
    double max_scale = 1.1;       ///< >= min_scale
    bool quarter_turns = false;   ///< rounds turns of trees to quarters; see `quarter_turned`
    std::uint64_t seed = 1117;    ///< of hills, places, turns and sizes
    std::uint64_t tree_seed = 17; ///< of the tree
};

/// Height of the ground above the shore. [m] Smooth, never negative, `height_m` at the centre and
/// 0 on and beyond the shore. Hills of several wavelengths lie between.
[[nodiscard]] double island_height(const IslandOptions& options, double x, double z) noexcept;

/// Checks the ranges above and finiteness; the message names the option and its value.
[[nodiscard]] Result<void> validate(const IslandOptions& options);

/// Makes the island: y up, the centre of the shore's circle at 0. Mesh 0 is the terrain, instance 0
/// its only placement, flagged as splittable; mesh 1 is the willow. Trees stand outside the
/// outermost 3 % of the radius, at least `min_spacing_m` apart (thrown like darts), each turned and
/// scaled at random, its foot on `island_height`. The ground is darker below them. Both meshes are
/// ordered for drawing. The same options give the same scene on every run; across platforms
/// positions agree to the rounding of sin and cos.
/// @return the scene; an error naming the option and its value, or count, radius and spacing when
/// the trees do not fit
[[nodiscard]] Result<Scene> make_island(const IslandOptions& options = {});

} // namespace farfield::scenes
