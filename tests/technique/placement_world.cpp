#include "technique/placement_world.hpp"

#include <farfield/partition/bsp.hpp>
#include <farfield/partition/kdtree.hpp>
#include <farfield/partition/octree.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace farfield::support {

PlacementWorld make_world(const ForestOptions& options, TreeKind kind) {
    PlacementWorld world;
    world.forest = make_forest(options);
    for (const Object& object : world.forest.objects) {
        world.item_primitives.push_back(object.primitives);
    }
    if (kind == TreeKind::bsp) {
        return world;
    }
    const PrimitiveBounds bounds_of = [&](std::uint32_t, std::uint32_t primitive) {
        return world.forest.ground[primitive];
    };
    auto tree =
        kind == TreeKind::kdtree
            ? partition::build_kdtree(world.forest.objects, {.max_primitives = 128}, bounds_of)
            : partition::build_octree(world.forest.objects, {.max_primitives = 128}, bounds_of);
    REQUIRE(tree.has_value());
    world.forest.hierarchy = std::move(*tree);
    return world;
}

PlacementWorld make_cubes(const std::vector<Box3d>& boxes, std::uint64_t primitives) {
    PlacementWorld world;
    for (const Box3d& box : boxes) {
        world.forest.objects.push_back({box, primitives, false});
    }
    world.item_primitives.assign(boxes.size(), primitives);
    auto tree = partition::build_bsp(world.forest.objects, {.max_items = 1});
    REQUIRE(tree.has_value());
    world.forest.hierarchy = std::move(*tree);
    return world;
}

bool lets_through(const View& view, const Box3d& box, double margin) noexcept {
    const glm::dmat3& axes = view.camera_to_world;
    const Lens& lens = view.lens;
    std::array<double, 5> most{};
    most.fill(-std::numeric_limits<double>::infinity());
    for (unsigned i = 0; i < 8; ++i) {
        const glm::dvec3 at = corner(box, i) - view.eye;
        const double x = glm::dot(at, axes[0]);
        const double y = glm::dot(at, axes[1]);
        const double depth = -glm::dot(at, axes[2]);
        most = {
            std::max(most[0], (x - lens.left * depth) / std::hypot(1.0, lens.left)),
            std::max(most[1], (lens.right * depth - x) / std::hypot(1.0, lens.right)),
            std::max(most[2], (y - lens.bottom * depth) / std::hypot(1.0, lens.bottom)),
            std::max(most[3], (lens.top * depth - y) / std::hypot(1.0, lens.top)),
            std::max(most[4], depth)};
    }
    return *std::min_element(most.begin(), most.end()) >= -margin;
}

std::uint64_t
count_in_view(const PlacementMap& map, const View& view, std::uint32_t image, double margin) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < map.cells.size(); ++i) {
        const PlacementCell& cell = map.cells[i];
        const Box3d box{glm::dvec3(cell.box.lo) + map.origin, glm::dvec3(cell.box.hi) + map.origin};
        count += lets_through(view, box, margin) ? cell.primitives : 0;
    }
    if (image != UINT32_MAX) {
        const PlacedImage& placed = map.images.at(image);
        for (std::uint32_t i = 0; i < placed.cell_count; ++i) {
            const PlacementCell& cell = map.cells.at(map.replaced.at(placed.first_cell + i));
            const Box3d box{
                glm::dvec3(cell.box.lo) + map.origin, glm::dvec3(cell.box.hi) + map.origin};
            count -= lets_through(view, box, margin) ? cell.primitives : 0;
        }
    }
    return count;
}

} // namespace farfield::support
