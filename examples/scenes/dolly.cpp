#include "dolly.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace farfield::scenes {

namespace {

using glm::dvec3;

constexpr double kDegree = std::numbers::pi / 180.0;

Result<void> validate(const Sphere& around, const DollyOptions& options) {
    const auto wrong = [](const char* name, double value, const char* expected) {
        return fail(
            ErrorCode::invalid_argument,
            std::string("dolly: ") + name + " is " + std::to_string(value) + ", expected " +
                expected
        );
    };
    if (!(around.radius > 0.0) || !std::isfinite(around.radius)) {
        return wrong("radius", around.radius, "a finite value above 0");
    }
    if (!std::isfinite(options.angle_deg)) {
        return wrong("angle_deg", options.angle_deg, "a finite value");
    }
    if (!(std::abs(options.elevation_deg) <= 80.0)) {
        return wrong("elevation_deg", options.elevation_deg, "-80 to 80");
    }
    if (!(options.nearest > 0.0) || !std::isfinite(options.nearest)) {
        return wrong("nearest", options.nearest, "a finite value above 0");
    }
    if (!(options.farthest >= options.nearest) || !std::isfinite(options.farthest)) {
        return wrong("farthest", options.farthest, "a finite value, nearest or more");
    }
    return {};
}

} // namespace

Sphere bounding_sphere(const Scene& scene) {
    Sphere sphere;
    sphere.middle = center(scene_bounds(scene));
    double farthest_sq = 0.0;
    for (const Instance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        for (const glm::vec3& position : mesh.positions) {
            const dvec3 off =
                instance.object_to_world * glm::dvec4(mesh.origin + dvec3(position), 1.0) -
                sphere.middle;
            farthest_sq = std::max(farthest_sq, glm::dot(off, off));
        }
    }
    sphere.radius = std::sqrt(farthest_sq);
    return sphere;
}

Result<CameraPath> dolly_path(const Sphere& around, const DollyOptions& options) {
    if (Result<void> valid = validate(around, options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    const double azimuth = options.angle_deg * kDegree;
    const double elevation = options.elevation_deg * kDegree;
    const dvec3 direction(
        std::sin(azimuth) * std::cos(elevation),
        std::sin(elevation),
        std::cos(azimuth) * std::cos(elevation)
    );
    constexpr int kLast = kDollyFrames - 1;
    const double step = std::pow(options.farthest / options.nearest, 1.0 / kLast);
    // A spline through points that grow by a factor is that curve again, larger by a constant.
    const double larger = (1.0 / step + 4.0 + step) / 6.0;
    CameraPath path;
    path.frame_count = kDollyFrames;
    for (int frame = 0; frame <= kLast; ++frame) {
        const bool end = frame == 0 || frame == kLast;
        const double share = static_cast<double>(frame) / kLast;
        const double distance =
            options.nearest * std::pow(options.farthest / options.nearest, share);
        PathKey key;
        key.frame = frame;
        key.target = around.middle;
        key.eye =
            around.middle + direction * (around.radius * (end ? distance : distance / larger));
        path.keys.push_back(key);
    }
    if (Result<void> valid = eval::validate(path); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    return path;
}

} // namespace farfield::scenes
