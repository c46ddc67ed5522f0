#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// One weeping willow. Everything is geometry: no texture, no transparency.
struct WillowOptions {
    int triangles = 36230;   ///< exactly so many; [2000, 10000000]
    double height_m = 14.0;  ///< [m] highest leaf above the ground, > 0
    double width_m = 11.0;   ///< [m] the wider of the two horizontal extents, > 0
    std::uint64_t seed = 17; ///< another seed, another tree
};

/// Grows a willow: a trunk, limbs that arch outwards, branches over a dome, and hanging strands of
/// narrow leaves that take four fifths and more of the triangles. It stands at 0 with y up; its
/// foot reaches 4 % of the height into the ground, for slopes. Fewer triangles mean fewer and
/// larger leaves, so that the crown keeps its density. Vertex colours are darker inside the crown
/// and lighter outside, since nothing casts shadows.
/// @return one opaque mesh with normals and colours; fails with the option and its value when one
/// is out of range
[[nodiscard]] Result<Mesh> make_willow(const WillowOptions& options = {});

} // namespace farfield::scenes
