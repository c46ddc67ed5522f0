#include <farfield/math/closest_point.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace farfield {

namespace {

double length_sq(const glm::dvec3& v) noexcept {
    return glm::dot(v, v);
}

glm::dvec3 closest_on_edge(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) noexcept {
    const glm::dvec3 edge = b - a;
    const double edge_sq = length_sq(edge);
    const double at = edge_sq > 0.0 ? glm::clamp(glm::dot(p - a, edge) / edge_sq, 0.0, 1.0) : 0.0;
    return a + at * edge;
}

} // namespace

glm::dvec3 closest_point(const glm::dvec3& p, const std::array<glm::dvec3, 3>& triangle) noexcept {
    const auto& [a, b, c] = triangle;
    // The foot of the perpendicular, where it lies inside; else a point of an edge.
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    const double normal_sq = length_sq(normal);
    if (normal_sq > 0.0) {
        const glm::dvec3 foot = p - glm::dot(p - a, normal) / normal_sq * normal;
        const bool inside = glm::dot(glm::cross(b - a, foot - a), normal) >= 0.0 &&
                            glm::dot(glm::cross(c - b, foot - b), normal) >= 0.0 &&
                            glm::dot(glm::cross(a - c, foot - c), normal) >= 0.0;
        if (inside) {
            return foot;
        }
    }
    glm::dvec3 best = closest_on_edge(p, a, b);
    for (const glm::dvec3& candidate : {closest_on_edge(p, b, c), closest_on_edge(p, c, a)}) {
        if (length_sq(candidate - p) < length_sq(best - p)) {
            best = candidate;
        }
    }
    return best;
}

} // namespace farfield
