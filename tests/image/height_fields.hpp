#pragma once

#include "support/random.hpp"
#include <farfield/image/height_grid.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace farfield::support {

/// Waves, with ridges and a little noise, 3 m apart and some way off the origin.
inline HeightGrid wavy_grid(std::uint32_t columns, std::uint32_t rows, std::uint64_t seed = 1) {
    Random random(seed);
    HeightGrid grid;
    grid.columns = columns;
    grid.rows = rows;
    grid.spacing_m = 3.0;
    grid.origin = {1000.0, 20.0, -500.0};
    const double phase = random.uniform(0.0, 6.0);
    for (std::uint32_t row = 0; row < rows; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            const double wave = 12.0 * std::sin(column * 0.11 + phase) * std::cos(row * 0.07);
            const double ridge = 8.0 * (1.0 - std::abs(std::sin(column * 0.05 + row * 0.03)));
            grid.heights.push_back(static_cast<float>(wave + ridge + random.uniform(-0.3, 0.3)));
        }
    }
    return grid;
}

/// The surface of a grid as a mesh, vertices in the order of posts.
inline Mesh mesh_of(const HeightGrid& grid) {
    Mesh mesh;
    mesh.name = "field";
    mesh.origin = grid.origin;
    mesh.splittable = true;
    for (std::uint32_t row = 0; row < grid.rows; ++row) {
        for (std::uint32_t column = 0; column < grid.columns; ++column) {
            mesh.positions.emplace_back(
                column * grid.spacing_m, grid.heights[grid.post(column, row)], row * grid.spacing_m
            );
            mesh.texcoords.emplace_back(
                static_cast<float>(column) / static_cast<float>(grid.columns - 1),
                static_cast<float>(row) / static_cast<float>(grid.rows - 1)
            );
        }
    }
    for (std::uint32_t row = 0; row + 1 < grid.rows; ++row) {
        for (std::uint32_t column = 0; column + 1 < grid.columns; ++column) {
            const auto a = static_cast<std::uint32_t>(grid.post(column, row));
            const std::uint32_t b = a + 1;
            const std::uint32_t c = a + grid.columns;
            mesh.indices.insert(mesh.indices.end(), {a, c, c + 1, a, c + 1, b});
        }
    }
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size())});
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

/// Height of the surface of a grid at a place in posts. [m]
inline double height_at(const HeightGrid& grid, double x, double z) {
    const auto column = std::min(static_cast<std::uint32_t>(x), grid.columns - 2);
    const auto row = std::min(static_cast<std::uint32_t>(z), grid.rows - 2);
    const double u = x - column;
    const double v = z - row;
    const auto h = [&](std::uint32_t dx, std::uint32_t dz) {
        return double{grid.heights[grid.post(column + dx, row + dz)]};
    };
    return u >= v ? h(0, 0) + u * (h(1, 0) - h(0, 0)) + v * (h(1, 1) - h(1, 0))
                  : h(0, 0) + v * (h(0, 1) - h(0, 0)) + u * (h(1, 1) - h(0, 1));
}

} // namespace farfield::support
