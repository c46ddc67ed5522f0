#include <farfield/image/color_cube_model.hpp>

namespace farfield {

std::uint64_t memory_bytes(const ColorCubeTree& tree) noexcept {
    return tree.cells.size() * sizeof(CubeCell) + tree.cubes.size() * sizeof(ColorCube) +
           tree.gains.size() + tree.contents.size() * sizeof(std::uint32_t) +
           tree.items.size() * (sizeof(ItemId) + sizeof(std::uint32_t)) +
           tree.primitives.size() * sizeof(CubePrimitives);
}

std::uint64_t memory_bytes(const ColorCubeModel& model) noexcept {
    std::uint64_t bytes = model.references.size() * sizeof(CubeReference);
    for (const ColorCubeTree& tree : model.trees) {
        bytes += memory_bytes(tree);
    }
    return bytes;
}

} // namespace farfield
