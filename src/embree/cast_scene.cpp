#include "embree/cast_scene.hpp"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

namespace farfield::embree {

namespace {

/// A transform flattens where its volume is below this share of the cube of its longest axis: then
/// float has no digits left for the way back.
constexpr double kFlat = 1e-7;
/// Scaling counts as uniform where it differs by less between directions: shading is off by as much
/// at most, a tenth of a step of 255.
constexpr double kUniform = 1e-4;

tl::unexpected<Error> embree_failed(RTCError error, const std::string& what) {
    const bool memory = error == RTC_ERROR_OUT_OF_MEMORY;
    return fail(
        memory ? ErrorCode::out_of_memory : ErrorCode::device,
        "Embree: " + what + ": " +
            (memory ? "out of memory" : "error " + std::to_string(static_cast<int>(error)))
    );
}

/// Adds Embree's memory up; called by its threads.
bool count_bytes(void* sum, ssize_t bytes, bool /*post*/) {
    static_cast<std::atomic<std::int64_t>*>(sum)->fetch_add(bytes, std::memory_order_relaxed);
    return true;
}

/// Interpolated alpha of the vertices. [0, 255]
float corner_alpha(const TriangleLook& look, float u, float v) noexcept {
    return (1.0F - u - v) * static_cast<float>(look.colors[0].a) +
           u * static_cast<float>(look.colors[1].a) + v * static_cast<float>(look.colors[2].a);
}

std::uint32_t packed_normal(const glm::vec3& normal) noexcept {
    const float length = glm::length(normal);
    const glm::vec3 unit = length > 0.0F ? normal / length : glm::vec3(0.0F, 1.0F, 0.0F);
    std::uint32_t packed = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const auto value = static_cast<std::int32_t>(std::lround(unit[axis] * kNormalScale));
        packed |= (static_cast<std::uint32_t>(value) & 0x3FFU) << (10 * axis);
    }
    return packed;
}

/// Geometry filter of parts with holes.
void keep_solid(const RTCFilterFunctionNArguments* arguments) {
    const auto& part = *static_cast<const SurfacePart*>(arguments->geometryUserPtr);
    const auto& context = *reinterpret_cast<const CastContext*>(arguments->context);
    const unsigned count = arguments->N;
    for (unsigned i = 0; i < count; ++i) {
        if (arguments->valid[i] == 0) {
            continue;
        }
        const std::uint32_t triangle =
            part.first_triangle + RTCHitN_primID(arguments->hit, count, i);
        const float u = RTCHitN_u(arguments->hit, count, i);
        const float v = RTCHitN_v(arguments->hit, count, i);
        constexpr float kMost = 255.0F;
        float alpha =
            corner_alpha(part.surface->looks[triangle], u, v) / kMost * part.material->base_color.a;
        if (part.material->texture != nullptr) {
            const glm::vec3 origin(
                RTCRayN_org_x(arguments->ray, count, i),
                RTCRayN_org_y(arguments->ray, count, i),
                RTCRayN_org_z(arguments->ray, count, i)
            );
            const glm::vec3 direction(
                RTCRayN_dir_x(arguments->ray, count, i),
                RTCRayN_dir_y(arguments->ray, count, i),
                RTCRayN_dir_z(arguments->ray, count, i)
            );
            glm::vec3 direction_dx = context.direction_dx;
            glm::vec3 direction_dy = context.direction_dy;
            if (context.items != nullptr) {
                const unsigned item = RTCHitN_instID(arguments->hit, count, i, 0);
                direction_dx = context.items[item].direction_to_object * direction_dx;
                direction_dy = context.items[item].direction_to_object * direction_dy;
            }
            alpha *=
                texel_at(part, triangle, u, v, origin, direction, direction_dx, direction_dy).a /
                kMost;
        }
        if (alpha < part.material->alpha_cutoff) {
            arguments->valid[i] = 0;
        }
    }
}

std::unique_ptr<Surface> copy_vertices(const Mesh& mesh) {
    auto surface = std::make_unique<Surface>();
    surface->positions.reserve(mesh.positions.size() + 1);
    surface->positions = mesh.positions;
    surface->positions.emplace_back(0.0F);
    surface->texcoords = mesh.texcoords;
    surface->mesh_origin = mesh.origin;
    surface->mesh_bounds = mesh.bounds;
    return surface;
}

/// Whether a transform leaves too little of a volume for rays to be taken back through it.
bool is_flat(const glm::dmat3& linear) noexcept {
    const double longest =
        std::max({glm::length(linear[0]), glm::length(linear[1]), glm::length(linear[2])});
    return !(std::abs(glm::determinant(linear)) > kFlat * longest * longest * longest);
}

/// Fills in all that follows from the transform of an instance, but for the ways back.
void place(
    CastItem& item,
    const glm::dmat4x3& world,
    const glm::dvec3& mesh_origin,
    const glm::vec3& to_light
) noexcept {
    item.linear = glm::dmat3(world[0], world[1], world[2]);
    item.translation = item.linear * mesh_origin + world[3];
    const glm::dmat3 normal(
        glm::cross(item.linear[1], item.linear[2]),
        glm::cross(item.linear[2], item.linear[0]),
        glm::cross(item.linear[0], item.linear[1])
    );
    item.normal_to_world = glm::mat3(glm::determinant(item.linear) < 0.0 ? -normal : normal);
    const glm::dmat3 square = glm::transpose(normal) * normal;
    const double scale_sq = square[0][0];
    item.uniform = scale_sq > 0.0;
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            const double expected = column == row ? scale_sq : 0.0;
            item.uniform =
                item.uniform && std::abs(square[column][row] - expected) <= kUniform * scale_sq;
        }
    }
    item.object_light = item.uniform ? glm::transpose(item.normal_to_world) * to_light /
                                           static_cast<float>(std::sqrt(scale_sq))
                                     : glm::vec3(0.0F);
}

/// Fills in the ways back from the world.
void invert(CastItem& item) noexcept {
    item.inverse = glm::inverse(item.linear);
    item.direction_to_object = glm::mat3(item.inverse);
}

/// Gives the surface of an instance that is flattened its shape in the world, and the item a
/// transform that only moves it.
void bake(Surface& surface, CastItem& item) {
    item.mesh_points.assign(surface.positions.begin(), surface.positions.end() - 1);
    for (glm::vec3& position : surface.positions) {
        position = glm::vec3(item.linear * glm::dvec3(position));
    }
    item.linear = glm::dmat3(1.0);
}

} // namespace

glm::vec4 texel_at(
    const SurfacePart& part,
    std::uint32_t triangle,
    float u,
    float v,
    const glm::vec3& origin,
    const glm::vec3& direction,
    const glm::vec3& direction_dx,
    const glm::vec3& direction_dy
) noexcept {
    const Surface& surface = *part.surface;
    const MipTexture* texture = part.material->texture;
    constexpr glm::vec4 kWhite(255.0F);
    if (texture == nullptr) {
        return kWhite;
    }
    if (surface.texcoords.empty()) {
        return texture->sample(glm::vec2(0.0F), glm::vec2(0.0F), glm::vec2(0.0F));
    }
    const std::uint32_t* corners = &surface.indices[std::size_t{triangle} * 3];
    const glm::vec2 uv0 = surface.texcoords[corners[0]];
    const glm::vec2 uv1 = surface.texcoords[corners[1]] - uv0;
    const glm::vec2 uv2 = surface.texcoords[corners[2]] - uv0;
    // Where the ray of a neighbouring pixel meets the plane: both coordinates are quotients of
    // functions linear in its direction.
    const glm::vec3 p0 = surface.positions[corners[0]];
    const glm::vec3 e1 = surface.positions[corners[1]] - p0;
    const glm::vec3 e2 = surface.positions[corners[2]] - p0;
    const glm::vec3 s = origin - p0;
    const glm::vec3 to_u = glm::cross(e2, s);
    const glm::vec3 to_v = glm::cross(s, e1);
    const glm::vec3 to_scale = glm::cross(e2, e1);
    const auto uv_at = [&](const glm::vec3& d) {
        const float scale = glm::dot(d, to_scale);
        return uv1 * (glm::dot(d, to_u) / scale) + uv2 * (glm::dot(d, to_v) / scale);
    };
    const glm::vec2 here = uv_at(direction);
    return texture->sample(
        uv0 + uv1 * u + uv2 * v,
        uv_at(direction + direction_dx) - here,
        uv_at(direction + direction_dy) - here
    );
}

const SurfaceMaterial* CastScene::material_of(MaterialId id) const noexcept {
    return id == kNone<MaterialId> ? &materials_.back() : &materials_[index_of(id)];
}

Result<const Surface*> CastScene::build(std::unique_ptr<Surface> surface, const Mesh& mesh) {
    const std::string name = "mesh " + mesh.name;
    surface->looks.resize(surface->indices.size() / 3);
    for (std::size_t i = 0; i < surface->indices.size(); ++i) {
        TriangleLook& look = surface->looks[i / 3];
        const std::uint32_t vertex = surface->indices[i];
        look.normals[i % 3] = packed_normal(mesh.normals[vertex]);
        look.colors[i % 3] = mesh.colors.empty() ? glm::u8vec4(255) : mesh.colors[vertex];
    }
    const std::vector<glm::vec3>& positions = surface->positions;
    for (std::size_t i = 0; i + 1 < positions.size(); ++i) {
        surface->bounds = unite(surface->bounds, positions[i]);
    }
    const std::size_t triangles = surface->indices.size() / 3;
    surface->block_boxes.resize((triangles + Surface::kBlock - 1) / Surface::kBlock);
    for (std::size_t block = 0; block < surface->block_boxes.size(); ++block) {
        constexpr std::size_t kIndices = std::size_t{Surface::kBlock} * 3;
        const std::size_t first = block * kIndices;
        const std::size_t last = std::min(first + kIndices, surface->indices.size());
        for (std::size_t i = first; i < last; ++i) {
            surface->block_boxes[block] =
                unite(surface->block_boxes[block], positions[surface->indices[i]]);
        }
    }
    SceneHandle bvh(rtcNewScene(device_.get()));
    if (bvh == nullptr) {
        return embree_failed(rtcGetDeviceError(device_.get()), name);
    }
    rtcSetSceneBuildQuality(bvh.get(), RTC_BUILD_QUALITY_MEDIUM);
    // Of any item some triangles may be drawn and others not.
    rtcSetSceneFlags(bvh.get(), RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    for (SurfacePart& part : surface->parts) {
        part.surface = surface.get();
        RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
        rtcSetSharedGeometryBuffer(
            geometry,
            RTC_BUFFER_TYPE_VERTEX,
            0,
            RTC_FORMAT_FLOAT3,
            surface->positions.data(),
            0,
            sizeof(glm::vec3),
            surface->positions.size() - 1
        );
        rtcSetSharedGeometryBuffer(
            geometry,
            RTC_BUFFER_TYPE_INDEX,
            0,
            RTC_FORMAT_UINT3,
            surface->indices.data(),
            std::size_t{part.first_triangle} * 3 * sizeof(std::uint32_t),
            3 * sizeof(std::uint32_t),
            part.triangle_count
        );
        rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_MEDIUM);
        if (part.material->alpha_cutoff > 0.0F) {
            rtcSetGeometryUserData(geometry, &part);
            rtcSetGeometryIntersectFilterFunction(geometry, keep_solid);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(bvh.get(), geometry);
        rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(bvh.get());
    if (const RTCError error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE) {
        return embree_failed(error, name);
    }
    surface->bvh = std::move(bvh);
    surfaces_.push_back(std::move(surface));
    return surfaces_.back().get();
}

std::unique_ptr<Surface> CastScene::whole_surface(const Mesh& mesh) const {
    std::unique_ptr<Surface> surface = copy_vertices(mesh);
    surface->indices = mesh.indices;
    for (const MeshPart& part : mesh.parts) {
        surface->parts.push_back(
            {nullptr, part.first_index / 3, part.index_count / 3, material_of(part.material)}
        );
    }
    return surface;
}

std::unique_ptr<Surface>
CastScene::split_surface(const Mesh& mesh, const Hierarchy& hierarchy, std::size_t item) const {
    std::unique_ptr<Surface> surface = copy_vertices(mesh);
    surface->indices.reserve(mesh.indices.size());
    surface->triangle_of.assign(mesh.indices.size() / 3, Surface::kNoTriangle);
    for (const SplitRun& run : split_runs_) {
        if (index_of(run.item) != item) {
            continue;
        }
        for (std::uint32_t i = 0; i < run.count; ++i) {
            const std::uint32_t primitive = hierarchy.primitives[run.first + i];
            surface->triangle_of[primitive] =
                static_cast<std::uint32_t>(surface->indices.size() / 3);
            const std::size_t first = std::size_t{primitive} * 3;
            for (std::size_t k = first; k < first + 3; ++k) {
                surface->indices.push_back(mesh.indices[k]);
            }
        }
    }
    const std::size_t triangles = surface->indices.size() / 3;
    surface->parts.push_back(
        {nullptr,
         0,
         static_cast<std::uint32_t>(triangles),
         material_of(mesh.parts.empty() ? kNone<MaterialId> : mesh.parts.front().material)}
    );
    return surface;
}

Result<void> CastScene::find_split_runs(const Scene& scene, const Hierarchy& hierarchy) {
    std::vector<std::uint32_t> triangles(scene.instances.size(), 0);
    for (const Piece& piece : hierarchy.pieces) {
        const std::size_t item = index_of(piece.item);
        const bool known = item < scene.instances.size() &&
                           std::size_t{piece.first} + piece.count <= hierarchy.primitives.size();
        const std::uint64_t most =
            known ? farfield::primitive_count(scene.meshes[index_of(scene.instances[item].mesh)])
                  : 0;
        bool fits = known && triangles[item] + piece.count <= most;
        for (std::uint32_t i = 0; fits && i < piece.count; ++i) {
            fits = hierarchy.primitives[piece.first + i] < most;
        }
        if (!fits) {
            return fail(
                ErrorCode::bad_data,
                "Embree: the hierarchy has a piece of item " + std::to_string(item) + " with " +
                    std::to_string(piece.count) + " primitives, which the scene has not"
            );
        }
        const bool joins = !split_runs_.empty() && split_runs_.back().item == piece.item &&
                           split_runs_.back().first + split_runs_.back().count == piece.first;
        if (joins) {
            split_runs_.back().count += piece.count;
        } else {
            split_runs_.push_back({piece.first, piece.count, piece.item, triangles[item]});
        }
        triangles[item] += piece.count;
    }
    return {};
}

bool CastScene::has_primitive(ItemId item, std::uint32_t primitive) const noexcept {
    const Surface& surface = *items_[index_of(item)].surface;
    if (!surface.triangle_of.empty()) {
        return primitive < surface.triangle_of.size() &&
               surface.triangle_of[primitive] != Surface::kNoTriangle;
    }
    return primitive < surface.indices.size() / 3;
}

const SplitRun* CastScene::run_of(const Piece& piece) const noexcept {
    const auto after = std::upper_bound(
        split_runs_.begin(),
        split_runs_.end(),
        piece.first,
        [](std::uint32_t first, const SplitRun& run) { return first < run.first; }
    );
    if (after == split_runs_.begin()) {
        return nullptr;
    }
    const SplitRun& run = *(after - 1);
    const bool whole =
        std::uint64_t{piece.first} + piece.count <= std::uint64_t{run.first} + run.count;
    return piece.count > 0 && run.item == piece.item && whole ? &run : nullptr;
}

Result<void> CastScene::add_items(const Scene& scene, const Hierarchy* hierarchy) {
    std::vector<bool> split(scene.instances.size(), false);
    for (const SplitRun& run : split_runs_) {
        split[index_of(run.item)] = true;
    }
    std::vector<const Surface*> of_mesh(scene.meshes.size(), nullptr);
    items_.resize(scene.instances.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Instance& instance = scene.instances[i];
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        CastItem& item = items_[i];
        place(item, instance.object_to_world, mesh.origin, to_light_);
        const bool flat = is_flat(item.linear);
        item.split = split[i];
        const Surface*& shared = of_mesh[index_of(instance.mesh)];
        if (!flat && !item.split && shared != nullptr) {
            item.surface = shared;
        } else {
            auto surface = item.split ? split_surface(mesh, *hierarchy, i) : whole_surface(mesh);
            if (flat) {
                bake(*surface, item);
            }
            Result<const Surface*> built = build(std::move(surface), mesh);
            if (!built) {
                return tl::unexpected(std::move(built).error());
            }
            item.surface = *built;
            if (!flat && !item.split) {
                shared = *built;
            }
        }
        invert(item);
    }
    return {};
}

Result<void> CastScene::set_transform(ItemId id, const glm::dmat4x3& object_to_world) {
    if (index_of(id) >= items_.size()) {
        return fail(
            ErrorCode::not_found,
            "Embree: item " + std::to_string(index_of(id)) + " of " + std::to_string(items_.size())
        );
    }
    CastItem& item = items_[index_of(id)];
    const Surface& surface = *item.surface;
    if (Result<void> valid = check_placement(id, surface.mesh_bounds, object_to_world); !valid) {
        return valid;
    }
    const bool was_flat = !item.mesh_points.empty();
    if (was_flat ||
        is_flat(glm::dmat3(object_to_world[0], object_to_world[1], object_to_world[2]))) {
        return fail(
            ErrorCode::unsupported,
            "Embree: item " + std::to_string(index_of(id)) +
                (was_flat ? " was made flat" : ": the transform flattens its mesh") +
                ", expected one with a volume"
        );
    }
    place(item, object_to_world, surface.mesh_origin, to_light_);
    invert(item);
    return {};
}

Result<std::unique_ptr<CastScene>>
CastScene::create(const Scene& scene, const Hierarchy* hierarchy) {
    std::unique_ptr<CastScene> result(new CastScene);
    result->device_.reset(rtcNewDevice(nullptr));
    if (result->device_ == nullptr) {
        return embree_failed(rtcGetDeviceError(nullptr), "no device");
    }
    rtcSetDeviceMemoryMonitorFunction(result->device_.get(), count_bytes, &result->embree_bytes_);
    for (const Texture& texture : scene.textures) {
        result->textures_.push_back(std::make_unique<MipTexture>(texture));
    }
    for (const Material& material : scene.materials) {
        const bool textured = material.texture != kNone<TextureId>;
        result->materials_.push_back(
            {material.base_color,
             textured ? result->textures_[index_of(material.texture)].get() : nullptr,
             material.alpha_cutoff}
        );
    }
    result->materials_.emplace_back();
    result->to_light_ = glm::normalize(scene.light.to_light);
    result->ambient_ = scene.light.ambient;
    if (hierarchy != nullptr) {
        if (Result<void> found = result->find_split_runs(scene, *hierarchy); !found) {
            return tl::unexpected(std::move(found).error());
        }
    }
    if (Result<void> added = result->add_items(scene, hierarchy); !added) {
        return tl::unexpected(std::move(added).error());
    }
    return result;
}

std::uint64_t CastScene::bytes() const noexcept {
    std::uint64_t bytes = static_cast<std::uint64_t>(embree_bytes_.load());
    for (const std::unique_ptr<MipTexture>& texture : textures_) {
        bytes += texture->bytes();
    }
    for (const std::unique_ptr<Surface>& surface : surfaces_) {
        bytes += surface->positions.size() * sizeof(glm::vec3) +
                 surface->looks.size() * sizeof(TriangleLook) +
                 surface->texcoords.size() * sizeof(glm::vec2) +
                 surface->indices.size() * sizeof(std::uint32_t) +
                 surface->block_boxes.size() * sizeof(Box3f) +
                 surface->triangle_of.size() * sizeof(std::uint32_t);
    }
    return bytes + items_.size() * sizeof(CastItem);
}

} // namespace farfield::embree
