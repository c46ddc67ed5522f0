#include "io/distance_tree.hpp"

#include <farfield/math/closest_point.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>

namespace farfield::io {

namespace {

constexpr std::uint32_t kLeafTriangles = 4;

double length_sq(const glm::dvec3& v) noexcept {
    return glm::dot(v, v);
}

double distance_sq(const Box3d& box, const glm::dvec3& p) noexcept {
    return length_sq(glm::max(glm::max(box.lo - p, p - box.hi), glm::dvec3(0.0)));
}

} // namespace

DistanceTree::DistanceTree(const Mesh& mesh) {
    triangles_.reserve(mesh.indices.size() / 3);
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        std::array<glm::dvec3, 3>& triangle = triangles_.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            triangle[k] = mesh.origin + glm::dvec3(mesh.positions[mesh.indices[i + k]]);
        }
    }
    nodes_.emplace_back();
    build(0, 0, static_cast<std::uint32_t>(triangles_.size()));
}

void DistanceTree::build(std::uint32_t node, std::uint32_t first, std::uint32_t count) {
    Box3d box;
    for (std::uint32_t i = first; i < first + count; ++i) {
        for (const glm::dvec3& vertex : triangles_[i]) {
            box = unite(box, vertex);
        }
    }
    nodes_[node] = {box, first, count};
    if (count <= kLeafTriangles) {
        return;
    }
    const glm::dvec3 size = extent(box);
    int axis = size.y > size.x ? 1 : 0;
    axis = size.z > size[axis] ? 2 : axis;
    const auto begin = triangles_.begin() + first;
    const std::uint32_t half = count / 2;
    std::nth_element(begin, begin + half, begin + count, [axis](const auto& a, const auto& b) {
        return a[0][axis] + a[1][axis] + a[2][axis] < b[0][axis] + b[1][axis] + b[2][axis];
    });
    const auto children = static_cast<std::uint32_t>(nodes_.size());
    nodes_[node].first = children;
    nodes_[node].count = 0;
    nodes_.resize(nodes_.size() + 2);
    build(children, first, half);
    build(children + 1, first + half, count - half);
}

void DistanceTree::visit(std::uint32_t node, const glm::dvec3& point, double& best_sq)
    const noexcept {
    const Node& at = nodes_[node];
    for (std::uint32_t i = at.first; i < at.first + at.count; ++i) {
        best_sq = std::min(best_sq, length_sq(closest_point(point, triangles_[i]) - point));
    }
    if (at.count > 0) {
        return;
    }
    const double first_sq = io::distance_sq(nodes_[at.first].box, point);
    const double second_sq = io::distance_sq(nodes_[at.first + 1].box, point);
    const std::uint32_t nearer = second_sq < first_sq ? 1 : 0;
    if (std::min(first_sq, second_sq) < best_sq) {
        visit(at.first + nearer, point, best_sq);
    }
    if (std::max(first_sq, second_sq) < best_sq) {
        visit(at.first + 1 - nearer, point, best_sq);
    }
}

double DistanceTree::distance_sq(const glm::dvec3& point) const noexcept {
    double best_sq = std::numeric_limits<double>::infinity();
    visit(0, point, best_sq);
    return best_sq;
}

} // namespace farfield::io
