#pragma once

#include <farfield/core/result.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <cstdint>
#include <span>

namespace farfield::partition {

/// How `build_octree` partitions; fields as of `KdTreeOptions`.
struct OctreeOptions {
    std::uint32_t max_primitives = 4096; ///< >= 1
    std::uint32_t max_depth = 8;         ///< [0, 64]
    float inflation = 0.02F;             ///< [0, 1]
    std::uint32_t max_copies = 8;        ///< [1, 1024]
};

/// Builds an octree: the cube around everything is halved across x, y and z, and so are the cubes
/// that this makes. An octant is an image level, and halves and quarters are not. All else is as
/// `build_kdtree` says; octants without contents are not there.
///
/// Cells are cubes whatever the scene, and cells of one level all have one size, which is what
/// those need who measure by the cell. A scene that is much longer than high or wide spends levels
/// on empty octants and may have a plane right through all of its ground: a k-d tree serves it
/// better.
///
/// @return, errors and cost as of `build_kdtree`
[[nodiscard]] Result<Hierarchy> build_octree(
    std::span<const Object> objects,
    const OctreeOptions& options = {},
    const PrimitiveShape& shape = {}
);

} // namespace farfield::partition
