#pragma once

#include "embree/texture.hpp"
#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/ext/matrix_double4x3.hpp>
#include <glm/ext/matrix_float3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <embree3/rtcore.h>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace farfield::embree {

struct DeviceRelease {
    void operator()(RTCDevice device) const noexcept { rtcReleaseDevice(device); }
};
struct SceneRelease {
    void operator()(RTCScene scene) const noexcept { rtcReleaseScene(scene); }
};
using DeviceHandle = std::unique_ptr<RTCDeviceTy, DeviceRelease>;
using SceneHandle = std::unique_ptr<RTCSceneTy, SceneRelease>;

/// What shading needs of the corners of a triangle, together, since what a ray meets next may be
/// anywhere: a vertex each would be three ways to memory.
struct TriangleLook {
    std::array<std::uint32_t, 3> normals{}; ///< unit; 10 bits a component, signed, x in the lowest
    std::array<glm::u8vec4, 3> colors{};
};
static_assert(sizeof(TriangleLook) == 24);

struct SurfaceMaterial {
    glm::vec4 base_color{1.0F};
    const MipTexture* texture = nullptr;
    float alpha_cutoff = 0.0F; ///< 0: opaque
};

struct Surface;

/// One Embree geometry: triangles of one material.
struct SurfacePart {
    const Surface* surface = nullptr;
    std::uint32_t first_triangle = 0;
    std::uint32_t triangle_count = 0;
    const SurfaceMaterial* material = nullptr;
};

/// Triangles with their own hierarchy, in the frame of their mesh, relative to its origin. All
/// instances of a mesh share one; a split item has its own, whose triangles are in the order of
/// `Hierarchy::primitives`.
struct Surface {
    SceneHandle bvh;
    std::vector<glm::vec3> positions; ///< one more than there are: Embree reads 16 bytes each
    std::vector<TriangleLook> looks;  ///< by triangle
    std::vector<glm::vec2> texcoords; ///< empty, or one a position
    std::vector<std::uint32_t> indices;
    std::vector<SurfacePart> parts; ///< by geometry id
    Box3f bounds;
    glm::dvec3 mesh_origin{0.0}; ///< what positions are relative to in the frame of the mesh [m]
    Box3d mesh_bounds;
    std::vector<Box3f> block_boxes; ///< of runs of 16 triangles
    /// Of a split item: by primitive of the mesh, its triangle here; none for those in no piece.
    std::vector<std::uint32_t> triangle_of;
    static constexpr std::uint32_t kNoTriangle = UINT32_MAX;
    static constexpr std::uint32_t kBlock = 16;
};

/// Where one placement of a surface stands, and how the light falls on it there.
struct CastItem {
    const Surface* surface = nullptr;
    glm::dmat3 linear{1.0};      ///< object to world
    glm::dmat3 inverse{1.0};     ///< world to object
    glm::dvec3 translation{0.0}; ///< world position of the surface's origin [m]
    glm::mat3 direction_to_object{1.0F};
    glm::mat3 normal_to_world{1.0F}; ///< not normalised
    /// Unit normals alone are enough where scaling is uniform: the light in object space, over that
    /// scale. Otherwise zero.
    glm::vec3 object_light{0.0F};
    bool uniform = true;
    bool split = false;
    /// Of an instance flattened by its transform, which no ray can be taken back through: the
    /// points of its mesh. Its surface is in the world's axes. Else empty.
    std::vector<glm::vec3> mesh_points;
};

/// Neighbouring entries of `Hierarchy::primitives` that belong to one item.
struct SplitRun {
    std::uint32_t first = 0; ///< into `Hierarchy::primitives`
    std::uint32_t count = 0;
    ItemId item = kNone<ItemId>;
    std::uint32_t first_triangle = 0; ///< of the item's surface
};

/// A scene ready for rays.
class CastScene {
  public:
    /// @param scene one that passed `validate` @param hierarchy over it, or null
    [[nodiscard]] static Result<std::unique_ptr<CastScene>>
    create(const Scene& scene, const Hierarchy* hierarchy);

    CastScene(const CastScene&) = delete;
    CastScene& operator=(const CastScene&) = delete;
    ~CastScene() = default;

    /// As `EmbreeBackend::set_transform`.
    [[nodiscard]] Result<void> set_transform(ItemId item, const glm::dmat4x3& object_to_world);

    [[nodiscard]] std::span<const CastItem> items() const noexcept { return items_; }

    /// Whether an item, which must be one of `items`, has a primitive of that number.
    [[nodiscard]] bool has_primitive(ItemId item, std::uint32_t primitive) const noexcept;

    /// The run that holds a piece as a whole, or null for a piece that is none.
    [[nodiscard]] const SplitRun* run_of(const Piece& piece) const noexcept;

    [[nodiscard]] RTCDevice device() const noexcept { return device_.get(); }
    [[nodiscard]] const glm::vec3& to_light() const noexcept { return to_light_; } ///< unit
    [[nodiscard]] float ambient() const noexcept { return ambient_; }
    [[nodiscard]] std::uint64_t bytes() const noexcept;

  private:
    CastScene() = default;

    [[nodiscard]] Result<void> add_items(const Scene& scene, const Hierarchy* hierarchy);
    [[nodiscard]] std::unique_ptr<Surface> whole_surface(const Mesh& mesh) const;
    [[nodiscard]] std::unique_ptr<Surface>
    split_surface(const Mesh& mesh, const Hierarchy& hierarchy, std::size_t item) const;
    [[nodiscard]] Result<void> find_split_runs(const Scene& scene, const Hierarchy& hierarchy);
    [[nodiscard]] Result<const Surface*> build(std::unique_ptr<Surface> surface, const Mesh& mesh);
    [[nodiscard]] const SurfaceMaterial* material_of(MaterialId id) const noexcept;

    std::atomic<std::int64_t> embree_bytes_{0}; // outlives the device, which counts in it
    DeviceHandle device_;
    std::vector<std::unique_ptr<MipTexture>> textures_;
    std::vector<SurfaceMaterial> materials_; ///< the last is that of parts that name none
    std::vector<std::unique_ptr<Surface>> surfaces_;
    std::vector<CastItem> items_;
    std::vector<SplitRun> split_runs_; ///< ordered by `first`
    glm::vec3 to_light_{0.0F, 1.0F, 0.0F};
    float ambient_ = 0.0F;
};

/// What a filter needs to know of the rays that are cast: Embree hands it the context it was given.
struct CastContext {
    RTCIntersectContext embree{}; ///< the first member: filters get its address
    /// Steps of the direction from a pixel to the next, in object space.
    glm::vec3 direction_dx{0.0F};
    glm::vec3 direction_dy{0.0F};
    /// Where the rays are those of the world, and the steps with them: items by instance. Embree
    /// takes rays to object space, but not these.
    const CastItem* items = nullptr;
};

/// One normal of a `TriangleLook`, 511 times as long.
[[nodiscard]] inline glm::vec3 unpacked_normal(std::uint32_t packed) noexcept {
    const auto component = [&](unsigned shift) {
        return static_cast<float>(static_cast<std::int32_t>(packed << shift) >> 22);
    };
    return {component(22), component(12), component(2)};
}
inline constexpr float kNormalScale = 511.0F;

/// How the texture of a part looks from a ray.
/// @param origin, direction of the ray in object space @param u, v of the hit
/// @return texel of the part's texture [0, 255], white without one
[[nodiscard]] glm::vec4 texel_at(
    const SurfacePart& part,
    std::uint32_t triangle,
    float u,
    float v,
    const glm::vec3& origin,
    const glm::vec3& direction,
    const glm::vec3& direction_dx,
    const glm::vec3& direction_dy
) noexcept;

} // namespace farfield::embree
