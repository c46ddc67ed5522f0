#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// One broad-leaved tree. Everything is geometry: no texture, no transparency.
struct BroadleafOptions {
    int triangles = 52470;   ///< exactly so many; [5000, 10000000]
    double height_m = 12.0;  ///< [m] > 0
    double width_m = 10.0;   ///< [m] the wider of the two horizontal extents, > 0
    std::uint64_t seed = 96; ///< another seed, another tree
};

/// Grows a tree with a round crown: a trunk, limbs that rise from it, boughs to points spread over
/// an ellipsoid, twigs, and leaves around the twigs that take four fifths of the triangles at the
/// default number. It stands on 0 with y up, its trunk around the y axis. Fewer triangles mean
/// fewer and larger leaves, so that the crown keeps its density. Vertex colours are darker inside
/// the crown and below it, since nothing casts shadows.
/// @return one opaque mesh with normals and colours; fails with the option and its value when one
/// is out of range
[[nodiscard]] Result<Mesh> make_broadleaf(const BroadleafOptions& options = {});

} // namespace farfield::scenes
