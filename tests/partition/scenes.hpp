#pragma once

#include "../support/random.hpp"
#include <farfield/partition/hierarchy.hpp>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

/// Scenes that the tests and the benchmarks of the partition builders share; the same numbers
/// everywhere.
namespace farfield::support {

/// Cube of a given edge.
inline Object cube(const glm::dvec3& middle, double edge, std::uint64_t primitives = 100) {
    return {{middle - 0.5 * edge, middle + 0.5 * edge}, primitives, false};
}

/// Cubes of 0.1 to 0.5 mean distances, anywhere in a cube of 1000 m: projections overlap a lot.
inline std::vector<Object> random_boxes(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    const double spacing = 1000.0 / std::cbrt(static_cast<double>(count));
    std::vector<Object> objects;
    for (std::size_t index = 0; index < count; ++index) {
        const glm::dvec3 middle = random.vector(-500.0, 500.0);
        objects.push_back(cube(middle, spacing * random.uniform(0.1, 0.5), 1 + random.below(999)));
    }
    return objects;
}

/// Floor tiles of 10 m that touch: a square of them, row by row.
inline std::vector<Object> grid_boxes(std::size_t count) {
    const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count))));
    std::vector<Object> objects;
    for (std::size_t index = 0; index < count; ++index) {
        const std::size_t row = index / side;
        const auto x = static_cast<double>(index % side);
        const auto z = static_cast<double>(row);
        objects.push_back({{{10 * x, 0, 10 * z}, {10 * (x + 1), 3, 10 * (z + 1)}}, 12, false});
    }
    return objects;
}

/// Towns: clusters of a hundred boxes that thin out from their middle, far from each other.
inline std::vector<Object> clustered_boxes(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    const double reach = 100.0 * std::sqrt(static_cast<double>(count));
    std::vector<Object> objects;
    glm::dvec3 town(0.0);
    for (std::size_t index = 0; index < count; ++index) {
        if (index % 100 == 0) {
            town = {random.uniform(-reach, reach), 0.0, random.uniform(-reach, reach)};
        }
        const double radius = 200.0 * random.uniform(0.0, 1.0);
        const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
        const glm::dvec3 middle = town + radius * glm::dvec3(std::cos(angle), 0.0, std::sin(angle));
        objects.push_back(cube(middle, random.uniform(2.0, 12.0), 1 + random.below(9999)));
    }
    return objects;
}

/// An island: object 0 is its terrain, splittable, a height field of `kCells` x `kCells` squares
/// of two triangles; the others are trees, 14 m high and 11 m wide, give or take a tenth.
struct Island {
    static constexpr std::uint32_t kCells = 256;
    static constexpr std::uint32_t kTriangles = 2 * kCells * kCells;

    double radius = 0.0; ///< [m]
    std::vector<Object> objects;

    [[nodiscard]] double height(double x, double z) const {
        return 20.0 * std::max(0.0, 1.0 - (x * x + z * z) / (radius * radius));
    }

    /// Box of one terrain triangle, whichever half of its square it is.
    [[nodiscard]] Box3d triangle_bounds(std::uint32_t triangle) const {
        const std::uint32_t cell = triangle / 2;
        const double edge = 2.0 * radius / kCells;
        const auto vertex = [&](std::uint32_t column, std::uint32_t row) {
            const double x = edge * column - radius;
            const double z = edge * row - radius;
            return glm::dvec3(x, height(x, z), z);
        };
        const std::uint32_t column = cell % kCells;
        const std::uint32_t row = cell / kCells;
        Box3d box = unite(unite(Box3d{}, vertex(column + 1, row)), vertex(column, row + 1));
        return unite(box, triangle % 2 == 0 ? vertex(column, row) : vertex(column + 1, row + 1));
    }

    [[nodiscard]] PrimitiveBounds primitive_bounds() const {
        return
            [this](std::uint32_t, std::uint32_t primitive) { return triangle_bounds(primitive); };
    }
};

/// Trees at random on the disc, no two nearer than `spacing`.
inline Island make_island(std::size_t trees, double radius, double spacing, std::uint64_t seed) {
    Island island;
    island.radius = radius;
    island.objects.push_back(
        {{{-radius, 0.0, -radius}, {radius, 20.0, radius}}, Island::kTriangles, true}
    );
    Random random(seed);
    std::vector<glm::dvec2> places;
    while (places.size() < trees) {
        const double r = radius * std::sqrt(random.uniform(0.0, 1.0));
        const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
        const glm::dvec2 place(r * std::cos(angle), r * std::sin(angle));
        const bool taken = std::any_of(places.begin(), places.end(), [&](const glm::dvec2& other) {
            return glm::length(place - other) < spacing;
        });
        if (taken) {
            continue;
        }
        places.push_back(place);
        const double scale = random.uniform(0.9, 1.1);
        const double half = 5.5 * scale;
        const double ground = island.height(place.x, place.y);
        island.objects.push_back(
            {{{place.x - half, ground, place.y - half},
              {place.x + half, ground + 14.0 * scale, place.y + half}},
             36'230,
             false}
        );
    }
    return island;
}

} // namespace farfield::support
