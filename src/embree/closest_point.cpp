#include "embree/cast_scene.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/embree/closest_point.hpp>
#include <farfield/math/closest_point.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace farfield::embree {

namespace {

/// Of the extent: how far rounding may have moved a corner in Embree's copy, both ways.
constexpr double kRounding = 4e-7;

/// What a search has found so far. In units of the mesh's extent.
struct Search {
    const std::vector<std::array<glm::dvec3, 3>>* triangles = nullptr;
    glm::dvec3 from{0.0};
    glm::dvec3 best{0.0};
    double distance = std::numeric_limits<double>::infinity();
    std::uint32_t triangle = 0;
};

bool look_at(RTCPointQueryFunctionArguments* arguments) {
    auto& search = *static_cast<Search*>(arguments->userPtr);
    const glm::dvec3 point = closest_point(search.from, (*search.triangles)[arguments->primID]);
    const double distance = glm::distance(search.from, point);
    // Ties go to the lower number, so that what is found does not depend on the hierarchy.
    if (distance > search.distance ||
        (distance == search.distance && arguments->primID >= search.triangle)) {
        return false;
    }
    search.best = point;
    search.distance = distance;
    search.triangle = arguments->primID;
    arguments->query->radius = static_cast<float>(distance + kRounding);
    return true;
}

} // namespace

struct ClosestPointFinder::Impl {
    DeviceHandle device;
    SceneHandle scene;
    std::vector<std::array<glm::dvec3, 3>> triangles; ///< in units of the extent from the center
    glm::dvec3 center{0.0};                           ///< [m] relative to the origin of the mesh
    double extent_m = 1.0;
};

ClosestPointFinder::ClosestPointFinder(std::unique_ptr<Impl> impl) noexcept
    : impl_(std::move(impl)) {}
ClosestPointFinder::~ClosestPointFinder() = default;

Result<std::unique_ptr<ClosestPointFinder>> ClosestPointFinder::create(const Mesh& mesh) {
    if (mesh.indices.empty()) {
        return fail(
            ErrorCode::invalid_argument,
            "closest points: mesh \"" + mesh.name + "\" has no triangles"
        );
    }
    auto impl = std::make_unique<Impl>();
    impl->center = farfield::center(mesh.bounds) - mesh.origin;
    const glm::dvec3 size = extent(mesh.bounds);
    const double largest = std::max({size.x, size.y, size.z});
    impl->extent_m = largest > 0.0 ? largest : 1.0;
    impl->triangles.resize(mesh.indices.size() / 3);
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
        impl->triangles[i / 3][i % 3] =
            (glm::dvec3(mesh.positions[mesh.indices[i]]) - impl->center) / impl->extent_m;
    }
    impl->device.reset(rtcNewDevice(nullptr));
    if (impl->device == nullptr) {
        return fail(
            ErrorCode::device,
            "Embree does not start: error " +
                std::to_string(static_cast<int>(rtcGetDeviceError(nullptr)))
        );
    }
    RTCDevice device = impl->device.get();
    impl->scene.reset(rtcNewScene(device));
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* const positions = static_cast<glm::vec3*>(rtcSetNewGeometryBuffer(
        geometry,
        RTC_BUFFER_TYPE_VERTEX,
        0,
        RTC_FORMAT_FLOAT3,
        sizeof(glm::vec3),
        impl->triangles.size() * 3
    ));
    auto* const indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry,
        RTC_BUFFER_TYPE_INDEX,
        0,
        RTC_FORMAT_UINT3,
        3 * sizeof(std::uint32_t),
        impl->triangles.size()
    ));
    if (positions != nullptr && indices != nullptr) {
        for (std::size_t i = 0; i < impl->triangles.size() * 3; ++i) {
            positions[i] = glm::vec3(impl->triangles[i / 3][i % 3]);
            indices[i] = static_cast<std::uint32_t>(i);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(impl->scene.get(), geometry);
        rtcCommitScene(impl->scene.get());
    }
    rtcReleaseGeometry(geometry);
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
        return fail(
            error == RTC_ERROR_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::device,
            "Embree: closest points of mesh \"" + mesh.name + "\": error " +
                std::to_string(static_cast<int>(error))
        );
    }
    return std::unique_ptr<ClosestPointFinder>(new ClosestPointFinder(std::move(impl)));
}

void ClosestPointFinder::find(std::span<const glm::vec3> points, std::span<SurfacePoint> closest)
    const noexcept {
    FARFIELD_ASSERT(points.size() == closest.size());
    RTCPointQueryContext context{};
    rtcInitPointQueryContext(&context);
    Search search;
    search.triangles = &impl_->triangles;
    for (std::size_t i = 0; i < points.size(); ++i) {
        search.from = (glm::dvec3(points[i]) - impl_->center) / impl_->extent_m;
        search.distance = std::numeric_limits<double>::infinity();
        search.triangle = UINT32_MAX;
        RTCPointQuery query{};
        query.x = static_cast<float>(search.from.x);
        query.y = static_cast<float>(search.from.y);
        query.z = static_cast<float>(search.from.z);
        query.time = 0.0F;
        query.radius = std::numeric_limits<float>::infinity();
        rtcPointQuery(impl_->scene.get(), &query, &context, look_at, &search);
        closest[i].point = glm::vec3(impl_->center + search.best * impl_->extent_m);
        closest[i].triangle = search.triangle;
        closest[i].distance = static_cast<float>(search.distance * impl_->extent_m);
    }
}

} // namespace farfield::embree
