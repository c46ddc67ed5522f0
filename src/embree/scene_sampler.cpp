#include "embree/cast_scene.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/embree/scene_sampler.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace farfield::embree {

namespace {

/// Textures take rays to come from one eye. Parallel ones come from this many lengths before their
/// begin, so that they are as far apart at both of their ends, but for a tenth.
constexpr float kBefore = 10.0F;

} // namespace

struct SceneSampler::Impl {
    std::unique_ptr<CastScene> scene;
    SceneHandle world; ///< instances of the surfaces
    glm::dvec3 origin{0.0};
    std::vector<glm::vec3> places; ///< of the items, relative to the origin [m]

    [[nodiscard]] SurfaceHit
    look(std::size_t index, const RTCRayHit& met, const CastContext& context) const noexcept;
};

SceneSampler::SceneSampler(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
SceneSampler::~SceneSampler() = default;

Result<std::unique_ptr<SceneSampler>>
SceneSampler::create(const Scene& scene, const glm::dvec3& origin) {
    Result<std::unique_ptr<CastScene>> cast = CastScene::create(scene, nullptr);
    if (!cast) {
        return tl::unexpected(std::move(cast).error());
    }
    auto impl = std::make_unique<Impl>();
    impl->scene = std::move(*cast);
    impl->origin = origin;
    RTCDevice device = impl->scene->device();
    impl->world.reset(rtcNewScene(device));
    if (impl->world == nullptr) {
        return fail(ErrorCode::device, "Embree: no scene of instances");
    }
    rtcSetSceneBuildQuality(impl->world.get(), RTC_BUILD_QUALITY_MEDIUM);
    std::uint32_t id = 0;
    for (const CastItem& item : impl->scene->items()) {
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(geometry, item.surface->bvh.get());
        const glm::mat3 linear(item.linear);
        const glm::vec3 at(item.translation - origin);
        impl->places.push_back(at);
        const std::array<float, 12> columns = {
            linear[0].x,
            linear[0].y,
            linear[0].z,
            linear[1].x,
            linear[1].y,
            linear[1].z,
            linear[2].x,
            linear[2].y,
            linear[2].z,
            at.x,
            at.y,
            at.z};
        rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.data());
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(impl->world.get(), geometry, id++);
        rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(impl->world.get());
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
        return fail(
            error == RTC_ERROR_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::device,
            "Embree: " + std::to_string(id) + " instances: error " +
                std::to_string(static_cast<int>(error))
        );
    }
    return std::unique_ptr<SceneSampler>(new SceneSampler(std::move(impl)));
}

SurfaceHit SceneSampler::Impl::look(
    std::size_t index, const RTCRayHit& met, const CastContext& context
) const noexcept {
    const CastItem& item = scene->items()[index];
    const Surface& surface = *item.surface;
    const SurfacePart& part = surface.parts[met.hit.geomID];
    const std::uint32_t triangle = part.first_triangle + met.hit.primID;
    const TriangleLook& corners = surface.looks[triangle];
    const float u = met.hit.u;
    const float v = met.hit.v;
    const float w = 1.0F - u - v;
    constexpr float kMost = 255.0F;
    const glm::vec4 corner_color = glm::vec4(corners.colors[0]) * w +
                                   glm::vec4(corners.colors[1]) * u +
                                   glm::vec4(corners.colors[2]) * v;
    glm::vec4 color = corner_color / kMost * part.material->base_color;
    if (part.material->texture != nullptr) {
        const glm::vec3 from(met.ray.org_x, met.ray.org_y, met.ray.org_z);
        const glm::vec3 along(met.ray.dir_x, met.ray.dir_y, met.ray.dir_z);
        const bool in_world = met.hit.instID[0] != RTC_INVALID_GEOMETRY_ID;
        const glm::mat3 turn = in_world ? item.direction_to_object : glm::mat3(1.0F);
        color *= texel_at(
                     part,
                     triangle,
                     u,
                     v,
                     in_world ? turn * (from - places[index]) : from,
                     turn * along,
                     turn * context.direction_dx,
                     turn * context.direction_dy
                 ) /
                 kMost;
    }
    SurfaceHit hit;
    hit.t = met.ray.tfar - kBefore;
    hit.color = glm::clamp(glm::vec3(color), 0.0F, 1.0F);
    hit.normal =
        (unpacked_normal(corners.normals[0]) * w + unpacked_normal(corners.normals[1]) * u +
         unpacked_normal(corners.normals[2]) * v) /
        kNormalScale;
    return hit;
}

glm::dvec3 SceneSampler::origin() const noexcept {
    return impl_->origin;
}

void SceneSampler::cast(
    ItemId item, std::span<const SurfaceRay> rays, float spacing, std::span<SurfaceHit> hits
) const noexcept {
    FARFIELD_ASSERT(rays.size() == hits.size());
    const bool in_world = item == kNone<ItemId>;
    RTCScene scene =
        in_world ? impl_->world.get() : impl_->scene->items()[index_of(item)].surface->bvh.get();
    CastContext context;
    rtcInitIntersectContext(&context.embree);
    context.items = in_world ? impl_->scene->items().data() : nullptr;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const SurfaceRay& ray = rays[i];
        const glm::vec3 from = ray.from - ray.along * kBefore;
        const glm::vec3 unit = glm::normalize(ray.along);
        const glm::vec3 aside =
            std::abs(unit.x) < 0.5F ? glm::vec3(1.0F, 0.0F, 0.0F) : glm::vec3(0.0F, 1.0F, 0.0F);
        const float step = spacing / (kBefore + 0.5F);
        context.direction_dx = glm::normalize(glm::cross(unit, aside)) * step;
        context.direction_dy = glm::cross(unit, context.direction_dx);
        RTCRayHit met{};
        met.ray.org_x = from.x;
        met.ray.org_y = from.y;
        met.ray.org_z = from.z;
        met.ray.dir_x = ray.along.x;
        met.ray.dir_y = ray.along.y;
        met.ray.dir_z = ray.along.z;
        met.ray.tnear = kBefore;
        met.ray.tfar = kBefore + 1.0F;
        met.ray.mask = UINT32_MAX;
        met.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        met.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context.embree, &met);
        hits[i] = {};
        if (met.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
            continue;
        }
        const std::size_t shown = in_world ? met.hit.instID[0] : index_of(item);
        hits[i] = impl_->look(shown, met, context);
        if (in_world) {
            const glm::vec3 turned = impl_->scene->items()[shown].normal_to_world * hits[i].normal;
            hits[i].normal =
                turned / std::max(glm::length(turned), 1e-30F) * glm::length(hits[i].normal);
        }
    }
}

} // namespace farfield::embree
