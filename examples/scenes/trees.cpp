#include "trees.hpp"

#include "facets.hpp"
#include "quarter_turn.hpp"
#include "random.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/vec3.hpp>

#include <array>
#include <bit>
#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

using glm::dvec3;

constexpr std::uint32_t kMaxCount = 1U << 22U;
constexpr double kSpacing = 0.87; // widths of a tree

bool is_power_of_four(std::uint32_t count) noexcept {
    return std::has_single_bit(count) && std::countr_zero(count) % 2 == 0;
}

/// Every second bit of a number on the Z curve: its column, or shifted by one its row.
std::uint32_t every_second_bit(std::uint32_t index) noexcept {
    std::uint32_t number = 0;
    for (std::uint32_t bit = 0; bit < 16; ++bit) {
        number |= ((index >> (2 * bit)) & 1U) << bit;
    }
    return number;
}

Mesh make_ground(double side) {
    const double half = side / 2.0;
    Facets facets;
    facets.add(
        std::array{
            dvec3(-half, 0.0, -half),
            dvec3(-half, 0.0, half),
            dvec3(half, 0.0, half),
            dvec3(half, 0.0, -half)},
        dvec3(96.0, 104.0, 60.0)
    );
    return facets.finish("ground");
}

} // namespace

double trees_spacing(const TreesOptions& options) noexcept {
    return kSpacing * options.tree.width_m;
}

Result<Scene> make_trees(const TreesOptions& options) {
    const auto count = static_cast<std::uint32_t>(options.count);
    if (options.count < 1 || count > kMaxCount || !is_power_of_four(count)) {
        return fail(
            ErrorCode::invalid_argument,
            "trees: count is " + std::to_string(options.count) +
                ", expected a power of four, 1 to 4194304"
        );
    }
    auto tree = make_broadleaf(options.tree);
    if (!tree) {
        return tl::unexpected(std::move(tree).error());
    }
    tree->splittable = count == 1;
    io::optimize_for_drawing(*tree);
    Scene scene;
    scene.name = count == 1 ? "tree" : "trees";
    scene.sky = glm::vec3(0.72F, 0.82F, 0.92F);
    scene.meshes.push_back(std::move(*tree));

    const double spacing = trees_spacing(options);
    const double columns = 1U << static_cast<unsigned>(std::countr_zero(count) / 2);
    scene.instances.reserve(count + 1);
    for (std::uint32_t i = 0; i < count; ++i) {
        const double column = every_second_bit(i);
        const double row = every_second_bit(i >> 1U);
        const dvec3 place = dvec3(column + 0.5, 0.0, row + 0.5) * spacing -
                            dvec3(0.5, 0.0, 0.5) * (columns * spacing);
        const std::uint64_t turns = count == 1 ? 0 : mix(options.seed ^ mix(i));
        scene.instances.push_back({make_id<MeshId>(0), quarter_turned(turns, 1.0, place)});
    }
    if (options.ground) {
        scene.meshes.push_back(make_ground((columns + 1.0) * spacing));
        scene.instances.push_back({make_id<MeshId>(1)});
    }
    return scene;
}

} // namespace farfield::scenes
