#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace farfield {

/// Most posts of a height grid.
inline constexpr std::uint64_t kMostPosts = 1ULL << 28U;

/// Heights at regular places, y up. Post (column, row) is at
/// origin + (column * spacing_m, height, row * spacing_m). The surface is that of triangles: each
/// square is cut from (column, row) to (column + 1, row + 1).
struct HeightGrid {
    std::uint32_t columns = 0;  ///< along +x, >= 2
    std::uint32_t rows = 0;     ///< along +z, >= 2
    double spacing_m = 1.0;     ///< > 0
    glm::dvec3 origin{0.0};     ///< [m] world; of post (0, 0) at height 0
    std::vector<float> heights; ///< [m] row by row: columns * rows

    friend bool operator==(const HeightGrid&, const HeightGrid&) = default;

    /// Where a post is among `heights`.
    [[nodiscard]] std::size_t post(std::uint32_t column, std::uint32_t row) const noexcept {
        return std::size_t{row} * columns + column;
    }
};

/// Checks sizes, numbers that exist, and that the whole grid is finite.
/// @return an error that names the field or the post and its value
[[nodiscard]] Result<void> validate(const HeightGrid& grid);

/// A mesh that is a height grid, and which of its vertices stands at which post.
struct GriddedMesh {
    HeightGrid grid;                     ///< in the frame of the mesh, its origin included
    std::vector<std::uint32_t> vertices; ///< by post
};

/// Finds the grid that a mesh is the surface of, whatever the order of its vertices and triangles:
/// terrain from files, for instance. Places may be off by a thousandth of the spacing, which is
/// what rounding makes of them.
/// @param mesh one that passed `validate`
/// @return `unsupported` where it is no such surface: a vertex off the grid, a post without a
/// vertex or with several, a triangle that is not half a square
/// @par Cost O(n log n) for n vertices
[[nodiscard]] Result<GriddedMesh> height_grid_of(const Mesh& mesh);

} // namespace farfield
