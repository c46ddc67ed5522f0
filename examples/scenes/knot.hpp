#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

namespace farfield::scenes {

/// A closed smooth surface of opaque matter: a tube along a trefoil.
struct KnotOptions {
    int along = 500;  ///< rings of the tube; [24, 10000]
    int around = 100; ///< corners of a ring; [3, 2000]
};

/// Ties the knot: 2 x `along` x `around` triangles, 100,000 of them by default, about 7 m across
/// around 0, its axis along z, in one splittable mesh with smooth normals. What faces a viewer 45
/// degrees from +z towards +x is of a light colour, what is turned away of a dark one: where the
/// surface tears for this viewer, dark shows.
/// @return the scene; an error naming the option and its value
/// @par Source Chamberlain et al. 1996, section 4: that continuous surfaces tear; theirs is a head
[[nodiscard]] Result<Scene> make_knot(const KnotOptions& options = {});

} // namespace farfield::scenes
