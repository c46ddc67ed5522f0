#pragma once

#include <farfield/core/result.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <cstdint>
#include <span>

namespace farfield::partition::detail {

/// Where cells are halved.
enum class CellShape : std::uint8_t {
    near_cube, ///< across the longest side
    cube,      ///< the root is a cube; across x, y and z in turn
};

/// What the options of k-d trees and octrees come to.
struct CellRules {
    const char* options = ""; ///< name of the options, for messages
    CellShape shape = CellShape::near_cube;
    std::uint32_t halvings = 3; ///< of an image level, 1 to 3
    std::uint32_t max_primitives = 1;
    std::uint32_t max_depth = 0;
    float inflation = 0.0F;
    std::uint32_t max_copies = 1;
};

/// Checks all arguments and builds. @see build_kdtree, build_octree
[[nodiscard]] Result<Hierarchy>
build_cells(std::span<const Object> objects, const CellRules& rules, const PrimitiveShape& shape);

} // namespace farfield::partition::detail
