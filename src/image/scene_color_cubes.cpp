#include "core/digest.hpp"
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/math/triangle_box.hpp>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace farfield {

namespace {

/// As `build_color_cubes` wants placements, with room for its own check.
constexpr double kSimilar = 1e-7;

bool is_similarity(const glm::dmat4x3& matrix) noexcept {
    const glm::dmat3 linear(matrix[0], matrix[1], matrix[2]);
    const double scale = std::cbrt(glm::determinant(linear));
    if (!(scale > 0.0)) {
        return false;
    }
    const glm::dmat3 square = glm::transpose(linear) * linear;
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            const double expected = column == row ? scale * scale : 0.0;
            if (!(std::abs(square[column][row] - expected) <= kSimilar * scale * scale)) {
                return false;
            }
        }
    }
    return true;
}

Triangle3d corners(const Mesh& mesh, std::uint32_t triangle) noexcept {
    Triangle3d result{};
    for (std::size_t i = 0; i < 3; ++i) {
        result[i] = glm::dvec3(mesh.positions[mesh.indices[std::size_t{triangle} * 3 + i]]);
    }
    return result;
}

/// Boxes of the triangles of a mesh, in its frame.
std::vector<Box3f> triangle_boxes(const Mesh& mesh) {
    std::vector<Box3f> boxes(mesh.indices.size() / 3);
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
        boxes[i / 3] = unite(boxes[i / 3], mesh.positions[mesh.indices[i]]);
    }
    return boxes;
}

} // namespace

Result<ColorCubeModel> build_color_cubes(
    const Scene& scene,
    const SurfaceSampler& sampler,
    const ColorCubeOptions& options,
    Executor& executor,
    std::uint32_t min_shared
) {
    if (min_shared == 0) {
        return fail(
            ErrorCode::invalid_argument, "colour cubes: min_shared is 0, expected at least 1"
        );
    }
    const std::size_t items = scene.instances.size();
    std::vector<Object> objects(items);
    std::vector<CubePlacement> placements(items);
    std::vector<CubePrototype> prototypes;
    std::vector<std::uint32_t> mesh_of_prototype;
    std::vector<std::uint32_t> prototype_of(scene.meshes.size(), UINT32_MAX);
    std::vector<std::vector<Box3f>> boxes(scene.meshes.size());
    std::vector<glm::dmat3> to_object(items, glm::dmat3(1.0));
    for (std::size_t i = 0; i < items; ++i) {
        const Instance& instance = scene.instances[i];
        const std::size_t mesh_index = index_of(instance.mesh);
        const Mesh& mesh = scene.meshes[mesh_index];
        objects[i].bounds = item_bounds(scene, make_id<ItemId>(i));
        objects[i].primitives = primitive_count(mesh);
        const bool large = objects[i].primitives >= min_shared;
        const bool similar = is_similarity(instance.object_to_world);
        objects[i].splittable = mesh.splittable || (large && !similar);
        if (large && similar && !mesh.splittable) {
            if (prototype_of[mesh_index] == UINT32_MAX) {
                prototype_of[mesh_index] = static_cast<std::uint32_t>(prototypes.size());
                mesh_of_prototype.push_back(static_cast<std::uint32_t>(mesh_index));
                prototypes.push_back(
                    {make_id<ItemId>(i),
                     static_cast<std::uint32_t>(objects[i].primitives),
                     {mesh.bounds.lo - mesh.origin, mesh.bounds.hi - mesh.origin}}
                );
            }
            placements[i].prototype = prototype_of[mesh_index];
            placements[i].object_to_world = instance.object_to_world;
            placements[i].object_to_world[3] =
                instance.object_to_world * glm::dvec4(mesh.origin, 1.0);
        } else if (!objects[i].splittable) {
            if (boxes[mesh_index].empty()) {
                boxes[mesh_index] = triangle_boxes(mesh);
            }
            const glm::dmat4x3& world = instance.object_to_world;
            to_object[i] = glm::inverse(glm::dmat3(world[0], world[1], world[2]));
        }
    }
    ColorCubeInput input;
    input.objects = objects;
    input.prototypes = prototypes;
    input.placements = placements;
    input.light = scene.light;
    input.triangle = [&](std::uint32_t item, std::uint32_t triangle) {
        const Instance& instance = scene.instances[item];
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        Triangle3d result = corners(mesh, triangle);
        for (glm::dvec3& corner_point : result) {
            corner_point = instance.object_to_world * glm::dvec4(mesh.origin + corner_point, 1.0);
        }
        return result;
    };
    input.prototype_triangle = [&](std::uint32_t prototype, std::uint32_t triangle) {
        return corners(scene.meshes[mesh_of_prototype[prototype]], triangle);
    };
    input.part = [&](std::uint32_t item, const Box3d& box) {
        const Instance& instance = scene.instances[item];
        const std::size_t mesh_index = index_of(instance.mesh);
        const Mesh& mesh = scene.meshes[mesh_index];
        const glm::dmat3& inverse = to_object[item];
        if (!std::isfinite(inverse[0].x + inverse[1].x + inverse[2].x)) {
            return intersect(objects[item].bounds, box); // flat: its box will do
        }
        // The box as one in the frame of the mesh: exact unless the item is turned.
        const glm::dvec3 middle =
            inverse * (center(box) - instance.object_to_world[3]) - mesh.origin;
        const glm::dvec3 half = extent(box) * 0.5;
        glm::dvec3 reach(0.0);
        for (int axis = 0; axis < 3; ++axis) {
            reach += glm::abs(inverse[axis]) * half[axis];
        }
        const Box3d around{middle - reach, middle + reach};
        const Box3f rough = local_box(around, glm::dvec3(0.0));
        const std::vector<Box3f>& of_triangles = boxes[mesh_index];
        Box3d part;
        for (std::size_t i = 0; i < of_triangles.size(); ++i) {
            if (!is_empty(intersect(of_triangles[i], rough))) {
                part = unite(
                    part, clipped_bounds(around, corners(mesh, static_cast<std::uint32_t>(i)))
                );
            }
        }
        if (is_empty(part)) {
            return part;
        }
        part.lo += mesh.origin;
        part.hi += mesh.origin;
        return intersect(placed_bounds(part, instance.object_to_world), box);
    };
    return build_color_cubes(input, sampler, options, executor);
}

std::uint64_t
digest(const Scene& scene, const ColorCubeOptions& options, std::uint32_t min_shared) noexcept {
    Digest digest;
    digest.add(farfield::digest(scene));
    digest.add(options.cube_cost);
    digest.add(options.max_depth);
    digest.add(options.max_copies);
    digest.add(options.rays);
    digest.add(options.shared_rays);
    digest.add(options.colors);
    digest.add(options.max_light_sets);
    digest.add(min_shared);
    return digest.value();
}

} // namespace farfield
