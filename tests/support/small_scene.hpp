#pragma once

#include "support/random.hpp"
#include <farfield/core/ids.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

/// Scenes of a few thousand triangles, generated, with one of everything that a backend draws.
namespace farfield::support {

/// Fills what follows from positions and indices, and adds the mesh as one part.
inline MeshId add_mesh(Scene& scene, Mesh mesh, MaterialId material) {
    compute_normals(mesh);
    update_bounds(mesh);
    mesh.parts = {{0, static_cast<std::uint32_t>(mesh.indices.size()), material}};
    scene.meshes.push_back(std::move(mesh));
    return make_id<MeshId>(scene.meshes.size() - 1);
}

inline MaterialId add_material(Scene& scene, const Material& material) {
    scene.materials.push_back(material);
    return make_id<MaterialId>(scene.materials.size() - 1);
}

/// An instance, turned about y and scaled.
inline void add_instance(
    Scene& scene, MeshId mesh, const glm::dvec3& at, double yaw_rad = 0.0, double scale = 1.0
) {
    const double s = std::sin(yaw_rad) * scale;
    const double c = std::cos(yaw_rad) * scale;
    Instance instance;
    instance.mesh = mesh;
    instance.object_to_world = glm::dmat4x3(
        glm::dvec3(c, 0.0, -s), glm::dvec3(0.0, scale, 0.0), glm::dvec3(s, 0.0, c), at
    );
    scene.instances.push_back(instance);
}

/// Two triangles in the plane z = 0, [-1, 1] in x and y, facing +z; texture upright.
inline Mesh quad_mesh() {
    Mesh mesh;
    mesh.name = "quad";
    mesh.positions = {
        {-1.0F, -1.0F, 0.0F}, {1.0F, -1.0F, 0.0F}, {-1.0F, 1.0F, 0.0F}, {1.0F, 1.0F, 0.0F}};
    mesh.texcoords = {{0.0F, 1.0F}, {1.0F, 1.0F}, {0.0F, 0.0F}, {1.0F, 0.0F}};
    mesh.indices = {0, 1, 2, 2, 1, 3};
    return mesh;
}

/// Box with corners of its own for each face, so that faces are shaded flat. 12 triangles.
inline Mesh box_mesh(const glm::vec3& lo, const glm::vec3& hi) {
    Mesh mesh;
    mesh.name = "box";
    for (int axis = 0; axis < 3; ++axis) {
        for (int side = 0; side < 2; ++side) {
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (unsigned corner_index = 0; corner_index < 4; ++corner_index) {
                glm::vec3 p(0.0F);
                p[axis] = side == 0 ? lo[axis] : hi[axis];
                const int u = (axis + 1) % 3;
                const int v = (axis + 2) % 3;
                p[u] = (corner_index & 1U) != 0U ? hi[u] : lo[u];
                p[v] = (corner_index & 2U) != 0U ? hi[v] : lo[v];
                mesh.positions.push_back(p);
            }
            for (const std::uint32_t k : {0U, 1U, 2U, 2U, 1U, 3U}) {
                mesh.indices.push_back(first + k);
            }
            if (side == 0) {
                std::swap(mesh.indices.end()[-5], mesh.indices.end()[-4]);
                std::swap(mesh.indices.end()[-2], mesh.indices.end()[-1]);
            }
        }
    }
    return mesh;
}

/// A trunk and a crown of loose leaves, 5 m high, 3 m wide; 12 + `leaves` triangles.
inline Mesh tree_mesh(std::uint32_t leaves, std::uint64_t seed = 7) {
    Mesh mesh = box_mesh({-0.15F, 0.0F, -0.15F}, {0.15F, 3.0F, 0.15F});
    mesh.name = "tree";
    mesh.colors.assign(mesh.positions.size(), {110, 80, 50, 255});
    Random random(seed);
    for (std::uint32_t leaf = 0; leaf < leaves; ++leaf) {
        const glm::vec3 middle =
            glm::vec3(0.0F, 3.5F, 0.0F) + random.direction<float>() * random.uniform(0.2F, 1.3F);
        const glm::vec3 u = random.direction<float>() * 0.2F;
        const glm::vec3 v = random.direction<float>() * 0.2F;
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        const auto green = static_cast<std::uint8_t>(100U + random.below(120));
        for (const glm::vec3& corner_at : {middle + u, middle + v, middle - u - v}) {
            mesh.positions.push_back(corner_at);
            mesh.colors.push_back({40, green, 30, 255});
        }
        mesh.indices.insert(mesh.indices.end(), {first, first + 1, first + 2});
    }
    return mesh;
}

/// Ground in rolling hills, `cells` x `cells` squares over `size` metres about the origin;
/// splittable.
inline Mesh ground_mesh(std::uint32_t cells, float size) {
    Mesh mesh;
    mesh.name = "ground";
    mesh.splittable = true;
    const float step = size / static_cast<float>(cells);
    for (std::uint32_t row = 0; row <= cells; ++row) {
        for (std::uint32_t column = 0; column <= cells; ++column) {
            const float x = static_cast<float>(column) * step - size / 2.0F;
            const float z = static_cast<float>(row) * step - size / 2.0F;
            mesh.positions.push_back({x, std::sin(x * 0.07F) * std::cos(z * 0.05F) - 1.0F, z});
        }
    }
    for (std::uint32_t row = 0; row < cells; ++row) {
        for (std::uint32_t column = 0; column < cells; ++column) {
            const std::uint32_t a = row * (cells + 1) + column;
            const std::uint32_t b = a + cells + 1;
            mesh.indices.insert(mesh.indices.end(), {a, b, a + 1, a + 1, b, b + 1});
        }
    }
    return mesh;
}

/// A grid of holes: every other texel of a checkerboard is transparent.
inline Texture checker_texture(int size) {
    Texture texture;
    texture.width = size;
    texture.height = size;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const bool solid = (x + y) % 2 == 0;
            const std::uint8_t alpha = solid ? 255 : 0;
            texture.pixels.insert(texture.pixels.end(), {220, 60, 40, alpha});
        }
    }
    return texture;
}

/// A forest of instanced trees on split ground, some boxes, a sign with holes: 100 m wide.
/// @param offset of everything from the world's origin [m]
inline Scene small_scene(const glm::dvec3& offset = glm::dvec3(0.0)) {
    Scene scene;
    scene.name = "small";
    scene.textures.push_back(checker_texture(8));
    const MaterialId earth = add_material(scene, {.base_color = {0.45F, 0.40F, 0.25F, 1.0F}});
    const MaterialId brick = add_material(scene, {.base_color = {0.70F, 0.30F, 0.25F, 1.0F}});
    const MaterialId sign = add_material(
        scene, {.base_color = glm::vec4(1.0F), .texture = TextureId{0}, .alpha_cutoff = 0.5F}
    );
    const MeshId ground = add_mesh(scene, ground_mesh(32, 100.0F), earth);
    const MeshId tree = add_mesh(scene, tree_mesh(300), kNone<MaterialId>);
    const MeshId box = add_mesh(scene, box_mesh(glm::vec3(-1.0F), glm::vec3(1.0F)), brick);
    const MeshId board = add_mesh(scene, quad_mesh(), sign);
    add_instance(scene, ground, offset);
    Random random(42);
    constexpr int kSide = 8; // trees stand in the squares of a grid, so that boxes stay apart
    constexpr double kSquare = 12.0;
    constexpr double kMiddle = (kSide - 1) / 2.0;
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            const double x = (column - kMiddle) * kSquare + random.uniform(-3.0, 3.0);
            const double z = (row - kMiddle) * kSquare + random.uniform(-3.0, 3.0);
            add_instance(
                scene,
                tree,
                offset + glm::dvec3(x, 0.0, z),
                random.uniform(0.0, 6.28),
                random.uniform(0.8, 1.2)
            );
        }
    }
    for (int i = 0; i < 5; ++i) {
        add_instance(scene, box, offset + glm::dvec3(i * 9.0 - 18.0, 0.5, 53.0), 0.3 * i);
    }
    add_instance(scene, board, offset + glm::dvec3(24.0, 1.0, 53.0), 0.4, 1.5);
    return scene;
}

/// What builders ask about a scene.
inline std::vector<Object> objects_of(const Scene& scene) {
    std::vector<Object> objects;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[index_of(scene.instances[i].mesh)];
        objects.push_back(
            {item_bounds(scene, make_id<ItemId>(i)), primitive_count(mesh), mesh.splittable}
        );
    }
    return objects;
}

/// Boxes of the triangles of split items; the scene must outlive it.
inline PrimitiveBounds primitive_bounds_of(const Scene& scene) {
    return [&scene](std::uint32_t object, std::uint32_t primitive) {
        const Instance& instance = scene.instances[object];
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        Box3d box;
        for (std::size_t k = 0; k < 3; ++k) {
            const glm::vec3& p = mesh.positions[mesh.indices[std::size_t{primitive} * 3 + k]];
            box =
                unite(box, instance.object_to_world * glm::dvec4(mesh.origin + glm::dvec3(p), 1.0));
        }
        return box;
    };
}

/// Triangles of every item.
inline std::vector<std::uint64_t> item_primitives_of(const Scene& scene) {
    std::vector<std::uint64_t> primitives;
    for (const Instance& instance : scene.instances) {
        primitives.push_back(primitive_count(scene.meshes[index_of(instance.mesh)]));
    }
    return primitives;
}

/// A scene with its hierarchy.
struct SmallWorld {
    Scene scene;
    Hierarchy hierarchy;
    std::vector<std::uint64_t> item_primitives;
};

/// Throws std::runtime_error where the scene is refused.
inline SmallWorld make_world(Scene scene) {
    SmallWorld world;
    world.scene = std::move(scene);
    world.item_primitives = item_primitives_of(world.scene);
    if (const auto valid = validate(world.scene); !valid) {
        throw std::runtime_error(valid.error().message);
    }
    auto built = partition::build_bsp(
        objects_of(world.scene), {.max_items = 1}, primitive_bounds_of(world.scene)
    );
    if (!built) {
        throw std::runtime_error(built.error().message);
    }
    world.hierarchy = std::move(*built);
    return world;
}

/// Frame `frame` of a walk past the edge of `small_scene` and into it, half a metre a frame.
inline View small_walk(int frame, int width, int height, const glm::dvec3& offset = {}) {
    constexpr double kFieldOfView = 50.0 * std::numbers::pi / 180.0;
    const Lens lens =
        perspective_lens(kFieldOfView, static_cast<double>(width) / height, 0.1, 400.0);
    const glm::dvec3 eye(-30.0 + 0.3 * frame, 2.5, 75.0 - 0.4 * frame);
    const glm::dvec3 target(0.0, 1.5, 0.0);
    return look_at(offset + eye, offset + target, {0.0, 1.0, 0.0}, lens, width, height);
}

/// Motion of that walk at 60 frames a second.
inline Motion small_walk_motion() {
    Motion motion;
    motion.velocity = glm::dvec3(0.3, 0.0, -0.4) * 60.0;
    return motion;
}

} // namespace farfield::support
