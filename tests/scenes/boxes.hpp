#pragma once

#include <farfield/partition/kdtree.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/ext/vector_int3.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

/// What tests of scenes ask of all triangles at once.
namespace farfield::test {

/// Calls `use` with the box of every triangle of the scene, in the world.
template <typename Use>
void for_each_triangle(const Scene& scene, const Use& use) {
    for (const Instance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
            Box3d box;
            for (std::size_t corner = 0; corner < 3; ++corner) {
                const glm::dvec3 local(mesh.positions[mesh.indices[i + corner]]);
                box = unite(box, instance.object_to_world * glm::dvec4(mesh.origin + local, 1.0));
            }
            use(mesh, box);
        }
    }
}

/// How many triangles have their middle in each cell of a regular grid over the scene's box, x
/// first, then y, then z.
inline std::vector<int> triangles_by_cell(const Scene& scene, const glm::ivec3& cells) {
    const Box3d all = scene_bounds(scene);
    std::vector<int> counts(
        static_cast<std::size_t>(cells.x) * static_cast<std::size_t>(cells.y) *
        static_cast<std::size_t>(cells.z)
    );
    for_each_triangle(scene, [&](const Mesh& /*mesh*/, const Box3d& box) {
        const glm::dvec3 middle = (box.lo + box.hi) / 2.0;
        const glm::dvec3 share = (middle - all.lo) / (all.hi - all.lo);
        std::size_t index = 0;
        for (const int axis : {2, 1, 0}) {
            const int cell =
                std::clamp(static_cast<int>(share[axis] * cells[axis]), 0, cells[axis] - 1);
            index = index * static_cast<std::size_t>(cells[axis]) + static_cast<std::size_t>(cell);
        }
        ++counts[index];
    });
    return counts;
}

/// Boxes of the k-d tree over a scene that is divided everywhere to its last level: all nodes but
/// the steps between a box and its children.
inline std::size_t
boxes_of_kdtree(const Scene& scene, std::uint32_t branching, std::uint32_t levels) {
    std::vector<Object> objects;
    for (std::size_t item = 0; item < scene.instances.size(); ++item) {
        const Mesh& mesh = scene.meshes[index_of(scene.instances[item].mesh)];
        objects.push_back(
            {.bounds = item_bounds(scene, make_id<ItemId>(item)),
             .primitives = primitive_count(mesh),
             .splittable = mesh.splittable}
        );
    }
    const PrimitiveTriangle triangles = [&](std::uint32_t item, std::uint32_t primitive) {
        const Instance& instance = scene.instances[item];
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        Triangle3d triangle;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const std::uint32_t index = mesh.indices[std::size_t{3} * primitive + corner];
            const glm::dvec3 local(mesh.positions[index]);
            triangle.at(corner) = instance.object_to_world * glm::dvec4(mesh.origin + local, 1.0);
        }
        return triangle;
    };
    const Hierarchy tree =
        partition::build_kdtree(
            objects, {.branching = branching, .max_primitives = 1, .max_depth = levels}, triangles
        )
            .value();
    std::size_t boxes = 0;
    for (const HierarchyNode& node : tree.nodes) {
        boxes += node.image_level ? 1U : 0U;
    }
    return boxes;
}

} // namespace farfield::test
