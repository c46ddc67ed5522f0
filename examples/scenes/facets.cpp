#include "facets.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <utility>

namespace farfield::scenes {

glm::u8vec4 to_color(const glm::dvec3& color) noexcept {
    const glm::dvec3 rounded = glm::clamp(color + 0.5, glm::dvec3(0.0), glm::dvec3(255.0));
    return {
        static_cast<std::uint8_t>(rounded.x),
        static_cast<std::uint8_t>(rounded.y),
        static_cast<std::uint8_t>(rounded.z),
        255};
}

glm::dvec3
Facets::facet_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept {
    return glm::normalize(glm::cross(b - a, c - a));
}

void Facets::add_vertex(const glm::dvec3& at, const glm::dvec3& normal, const glm::dvec3& color) {
    positions_.emplace_back(at);
    normals_.emplace_back(normal);
    colors_.push_back(to_color(color));
}

Mesh Facets::finish(std::string name) {
    Mesh mesh;
    mesh.name = std::move(name);
    mesh.positions = std::exchange(positions_, {});
    mesh.normals = std::exchange(normals_, {});
    mesh.colors = std::exchange(colors_, {});
    mesh.indices = std::exchange(indices_, {});
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size()), kNone<MaterialId>});
    mesh.splittable = true;
    update_bounds(mesh);
    return mesh;
}

} // namespace farfield::scenes
