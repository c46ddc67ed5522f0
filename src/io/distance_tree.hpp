#pragma once

#include <farfield/math/box3.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace farfield::io {

/// Finds how far points are from a mesh: a tree of boxes over its triangles, halved by their
/// centres along the longest axis.
class DistanceTree {
  public:
    /// Copies the triangles. @pre the mesh has one
    explicit DistanceTree(const Mesh& mesh);

    /// Squared distance of a point from the surface. [m^2]
    [[nodiscard]] double distance_sq(const glm::dvec3& point) const noexcept;

  private:
    struct Node {
        Box3d box;
        std::uint32_t first = 0; ///< a leaf: into `triangles_`; else the first child of two
        std::uint32_t count = 0; ///< 0: not a leaf
    };

    void build(std::uint32_t node, std::uint32_t first, std::uint32_t count);
    void visit(std::uint32_t node, const glm::dvec3& point, double& best_sq) const noexcept;

    std::vector<std::array<glm::dvec3, 3>> triangles_;
    std::vector<Node> nodes_;
};

} // namespace farfield::io
