#include <farfield/scene/surface_points.hpp>

#include <glm/geometric.hpp>

#include <cmath>
#include <cstddef>

namespace farfield {

std::vector<glm::vec3> points_of_surface(const Mesh& mesh, std::uint32_t count) {
    constexpr double kStepU = 0.7548776662466927;
    constexpr double kStepV = 0.5698402909980532;
    const auto corner = [&](std::size_t i) { return glm::dvec3(mesh.positions[mesh.indices[i]]); };
    std::vector<double> area_before{0.0};
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const glm::dvec3 a = corner(i);
        const glm::dvec3 across = glm::cross(corner(i + 1) - a, corner(i + 2) - a);
        area_before.push_back(area_before.back() + glm::length(across) / 2.0);
    }
    std::vector<glm::vec3> points;
    const double area = area_before.back();
    std::size_t triangle = 0;
    for (std::uint32_t i = 0; i < count && area > 0.0; ++i) {
        const double at = (i + 0.5) / count * area;
        while (area_before[triangle + 1] < at) {
            ++triangle;
        }
        double u = std::fmod(0.5 + i * kStepU, 1.0);
        double v = std::fmod(0.5 + i * kStepV, 1.0);
        if (u + v > 1.0) {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        const glm::dvec3 a = corner(3 * triangle);
        points.emplace_back(
            a + u * (corner(3 * triangle + 1) - a) + v * (corner(3 * triangle + 2) - a)
        );
    }
    return points;
}

} // namespace farfield
