#include "partition/cells.hpp"
#include "partition/checks.hpp"
#include <farfield/partition/kdtree.hpp>

#include <bit>

namespace farfield::partition {

Result<Hierarchy> build_kdtree(
    std::span<const Object> objects, const KdTreeOptions& options, const PrimitiveShape& shape
) {
    if (options.branching != 2 && options.branching != 4 && options.branching != 8) {
        return fail(
            ErrorCode::invalid_argument,
            "KdTreeOptions: branching is " + std::to_string(options.branching) +
                ", expected 2, 4 or 8"
        );
    }
    detail::CellRules rules;
    rules.options = "KdTreeOptions";
    rules.shape = detail::CellShape::near_cube;
    rules.halvings = static_cast<std::uint32_t>(std::countr_zero(options.branching));
    rules.max_primitives = options.max_primitives;
    rules.max_depth = options.max_depth;
    rules.inflation = options.inflation;
    rules.max_copies = options.max_copies;
    return detail::build_cells(objects, rules, shape);
}

} // namespace farfield::partition
