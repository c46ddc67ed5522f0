#pragma once

#include <farfield/scene/scene.hpp>

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace farfield::scenes {

/// 8-bit colour of a real one, rounded and clamped to [0, 255].
[[nodiscard]] glm::u8vec4 to_color(const glm::dvec3& color) noexcept;

/// Gathers flat triangles, each with a colour and a normal of its own, into a mesh.
class Facets {
  public:
    /// Triangles made so far.
    [[nodiscard]] int count() const noexcept { return static_cast<int>(indices_.size() / 3); }

    /// A triangle, or a fan of them: a convex polygon, anticlockwise as seen from its outside, with
    /// the normal of its first three corners. @pre those are not on one line
    template <std::size_t N>
    void add(const std::array<glm::dvec3, N>& corners, const glm::dvec3& color) {
        add(corners, facet_normal(corners[0], corners[1], corners[2]), color);
    }

    /// The same with another normal, which is unit.
    template <std::size_t N>
    void
    add(const std::array<glm::dvec3, N>& corners, const glm::dvec3& normal, const glm::dvec3& color
    ) {
        static_assert(N >= 3);
        const auto first = static_cast<std::uint32_t>(positions_.size());
        for (const glm::dvec3& corner : corners) {
            add_vertex(corner, normal, color);
        }
        for (std::uint32_t i = 2; i < N; ++i) {
            indices_.insert(indices_.end(), {first, first + i - 1, first + i});
        }
    }

    /// The mesh, of one opaque part; splittable. Leaves nothing behind.
    [[nodiscard]] Mesh finish(std::string name);

  private:
    [[nodiscard]] static glm::dvec3
    facet_normal(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept;
    void add_vertex(const glm::dvec3& at, const glm::dvec3& normal, const glm::dvec3& color);

    std::vector<glm::vec3> positions_;
    std::vector<glm::vec3> normals_;
    std::vector<glm::u8vec4> colors_;
    std::vector<std::uint32_t> indices_;
};

} // namespace farfield::scenes
