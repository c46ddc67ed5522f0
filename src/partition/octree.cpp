#include "partition/cells.hpp"
#include <farfield/partition/octree.hpp>

namespace farfield::partition {

Result<Hierarchy> build_octree(
    std::span<const Object> objects, const OctreeOptions& options, const PrimitiveShape& shape
) {
    detail::CellRules rules;
    rules.options = "OctreeOptions";
    rules.shape = detail::CellShape::cube;
    rules.halvings = 3;
    rules.max_primitives = options.max_primitives;
    rules.max_depth = options.max_depth;
    rules.inflation = options.inflation;
    rules.max_copies = options.max_copies;
    return detail::build_cells(objects, rules, shape);
}

} // namespace farfield::partition
