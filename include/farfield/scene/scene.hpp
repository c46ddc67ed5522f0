#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/math/box3.hpp>

#include <glm/ext/matrix_double4x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <string>
#include <vector>

/// The scene that Farfield's own loaders fill and its own geometry sources draw: no more than the
/// techniques need. An engine keeps its scene and never meets these types.
namespace farfield {

/// 8-bit sRGB-encoded RGBA, rows from the top, not premultiplied.
struct Texture {
    int width = 0;                    ///< [texel] >= 1
    int height = 0;                   ///< [texel] >= 1
    std::vector<std::uint8_t> pixels; ///< width * height * 4 bytes
};

/// Surface colour: base colour times vertex colour times texture, all sRGB-encoded and multiplied
/// as encoded.
struct Material {
    glm::vec4 base_color{1.0F}; ///< [0, 1] each
    TextureId texture = kNone<TextureId>;
    float alpha_cutoff = 0.0F; ///< texels with alpha below it are holes; 0: opaque
};

/// Triangles of one mesh that share a material.
struct MeshPart {
    std::uint32_t first_index = 0;           ///< into `Mesh::indices`, a multiple of 3
    std::uint32_t index_count = 0;           ///< a multiple of 3
    MaterialId material = kNone<MaterialId>; ///< none: white
};

/// Indexed triangles in a frame of their own. Primitive i is the triangle of indices 3i..3i+2.
struct Mesh {
    std::string name;
    /// Positions are relative to it, so that a mesh far from 0 keeps its digits. [m]
    glm::dvec3 origin{0.0};
    std::vector<glm::vec3> positions; ///< [m] relative to `origin`
    std::vector<glm::vec3> normals;   ///< unit; as many as positions
    std::vector<glm::u8vec4> colors;  ///< empty, or as many as positions
    /// Empty, or as many as positions; (0, 0) is the corner of the top left texel.
    std::vector<glm::vec2> texcoords;
    std::vector<std::uint32_t> indices; ///< three a triangle
    std::vector<MeshPart> parts;        ///< in order, together all indices
    Box3d bounds;                       ///< of all positions, `origin` included
    bool splittable = false;            ///< a partition may put its triangles into several leaves
};

/// One placement of one mesh: an item. Its `ItemId` is its position in `Scene::instances`.
struct Instance {
    MeshId mesh = kNone<MeshId>;
    glm::dmat4x3 object_to_world{1.0}; ///< affine, columns x, y, z and translation
};

/// Light from infinitely far; shading is ambient + (1 - ambient) * (0.5 + 0.5 n.l), the same from
/// either side of a surface and from any eye, so that images stay right when the eye moves.
struct DirectionalLight {
    glm::vec3 to_light{0.35F, 0.85F, 0.40F}; ///< world direction towards the light, not zero
    float ambient = 0.25F;                   ///< [0, 1]
};

/// Meshes, where they stand, how they look. @see validate
struct Scene {
    std::string name;
    std::vector<Mesh> meshes;
    std::vector<Material> materials;
    std::vector<Texture> textures;
    std::vector<Instance> instances;
    DirectionalLight light;
    glm::vec3 sky{0.53F, 0.70F, 0.90F}; ///< background, sRGB-encoded
    glm::dvec3 up{0.0, 1.0, 0.0};       ///< unit
};

/// Checks every array against every other: indices in range, parts that cover all indices, finite
/// positions and transforms, textures of the announced size, ids that exist. The message names the
/// mesh, the element and its value. Linear in the size of the scene.
[[nodiscard]] Result<void> validate(const Scene& scene);

/// World box of an item; conservative for rotated instances (box of the transformed box).
[[nodiscard]] Box3d item_bounds(const Scene& scene, ItemId item) noexcept;

/// The same for a mesh with these bounds that is placed by a transform.
[[nodiscard]] Box3d
placed_bounds(const Box3d& mesh_bounds, const glm::dmat4x3& object_to_world) noexcept;

/// Checks one placement as `validate` does: a finite transform and a finite world box. For what
/// draws a scene whose instances move.
/// @return an error that names the instance, the column and its value
[[nodiscard]] Result<void>
check_placement(ItemId item, const Box3d& mesh_bounds, const glm::dmat4x3& object_to_world);

/// Where each item's surface points are: takes a point relative to the origin of the item's mesh,
/// as positions are kept (`PositionTexel::point`), into the world. By `ItemId`.
[[nodiscard]] std::vector<glm::dmat4x3> item_frames(const Scene& scene);

/// World box around all items; empty for an empty scene.
[[nodiscard]] Box3d scene_bounds(const Scene& scene) noexcept;

/// Triangles of a mesh.
[[nodiscard]] std::uint64_t primitive_count(const Mesh& mesh) noexcept;

/// Triangles of the scene with every instance counted.
[[nodiscard]] std::uint64_t primitive_count(const Scene& scene) noexcept;

/// Bytes held by meshes, textures and instances, each mesh once.
[[nodiscard]] std::uint64_t memory_bytes(const Scene& scene) noexcept;

/// A 64-bit digest of all that is drawn of a scene: meshes, materials, textures, instances and
/// light, but no names, sky or up. Equal scenes have equal digests on every little-endian machine:
/// what is stored about a scene can tell whether it still belongs to it.
/// @par Cost some nanoseconds a byte of the scene
[[nodiscard]] std::uint64_t digest(const Scene& scene) noexcept;

/// Fills `bounds` from `positions` and `origin`.
void update_bounds(Mesh& mesh) noexcept;

/// Replaces `normals` by area-weighted vertex normals. Degenerate triangles add nothing; a vertex
/// with no area around it gets (0, 1, 0).
void compute_normals(Mesh& mesh);

/// Flags as splittable every mesh that is used once, has at least `min_primitives` triangles and is
/// wider than `min_extent` of the scene along its longest axis: a terrain, the shell of a building.
/// A mesh of several parts becomes one mesh and one instance a part, since a primitive list has one
/// material.
void flag_splittable(Scene& scene, std::uint64_t min_primitives = 1024, double min_extent = 0.25);

} // namespace farfield
