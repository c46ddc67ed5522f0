#include "knot.hpp"

#include "facets.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kTubeRadius = 0.62; // [m]

const dvec3 kLight(232.0, 206.0, 160.0);
const dvec3 kDark(24.0, 58.0, 132.0);

/// A trefoil on a torus: twice around its axis, three times around its ring.
dvec3 trefoil(double t) {
    const double outward = 2.2 + std::cos(3.0 * t);
    return {outward * std::cos(2.0 * t), outward * std::sin(2.0 * t), std::sin(3.0 * t)};
}

dvec3 trefoil_tangent(double t) {
    const double outward = 2.2 + std::cos(3.0 * t);
    const double rate = -3.0 * std::sin(3.0 * t);
    return glm::normalize(dvec3(
        rate * std::cos(2.0 * t) - 2.0 * outward * std::sin(2.0 * t),
        rate * std::sin(2.0 * t) + 2.0 * outward * std::cos(2.0 * t),
        3.0 * std::cos(3.0 * t)
    ));
}

/// Outwards of the torus there, at a right angle to the curve, so that the tube closes untwisted.
dvec3 torus_normal(double t) {
    return {
        std::cos(3.0 * t) * std::cos(2.0 * t),
        std::cos(3.0 * t) * std::sin(2.0 * t),
        std::sin(3.0 * t)};
}

} // namespace

Result<Scene> make_knot(const KnotOptions& options) {
    const auto wrong = [](const char* name, int value, const char* expected) {
        return fail(
            ErrorCode::invalid_argument,
            std::string("knot: ") + name + " is " + std::to_string(value) + ", expected " + expected
        );
    };
    if (options.along < 24 || options.along > 10'000) {
        return wrong("along", options.along, "24 to 10000");
    }
    if (options.around < 3 || options.around > 2000) {
        return wrong("around", options.around, "3 to 2000");
    }
    const dvec3 to_viewer = glm::normalize(dvec3(1.0, 0.0, 1.0));
    Mesh mesh;
    mesh.name = "knot";
    mesh.splittable = true;
    for (int ring = 0; ring < options.along; ++ring) {
        const double t = kTwoPi * ring / options.along;
        const dvec3 first = torus_normal(t);
        const dvec3 second = glm::cross(trefoil_tangent(t), first);
        for (int corner = 0; corner < options.around; ++corner) {
            const double angle = kTwoPi * corner / options.around;
            const dvec3 normal = first * std::cos(angle) + second * std::sin(angle);
            mesh.positions.emplace_back(trefoil(t) + normal * kTubeRadius);
            mesh.normals.emplace_back(normal);
            mesh.colors.push_back(to_color(glm::dot(normal, to_viewer) > 0.0 ? kLight : kDark));
        }
    }
    const auto rings = static_cast<std::uint32_t>(options.along);
    const auto corners = static_cast<std::uint32_t>(options.around);
    for (std::uint32_t ring = 0; ring < rings; ++ring) {
        const std::uint32_t here = ring * corners;
        const std::uint32_t ahead = (ring + 1) % rings * corners;
        for (std::uint32_t corner = 0; corner < corners; ++corner) {
            const std::uint32_t next = (corner + 1) % corners;
            mesh.indices.insert(
                mesh.indices.end(),
                {here + corner,
                 here + next,
                 ahead + next,
                 here + corner,
                 ahead + next,
                 ahead + corner}
            );
        }
    }
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size()), kNone<MaterialId>});
    update_bounds(mesh);
    io::optimize_for_drawing(mesh);
    Scene scene;
    scene.name = "knot";
    scene.sky = glm::vec3(0.90F, 0.92F, 0.95F);
    scene.meshes.push_back(std::move(mesh));
    scene.instances.push_back({make_id<MeshId>(0)});
    return scene;
}

} // namespace farfield::scenes
