#pragma once

#include <farfield/image/height_grid.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace farfield {

/// A place on a grid, in posts.
struct GridPlace {
    std::int64_t x = 0;
    std::int64_t z = 0;

    friend bool operator==(const GridPlace&, const GridPlace&) = default;
};

/// A triangle over a grid, counter-clockwise from above.
using GridTriangle = std::array<GridPlace, 3>;

/// Twice its area in squares; > 0 where it is seen from above.
[[nodiscard]] constexpr std::int64_t doubled_area(const GridTriangle& triangle) noexcept {
    const auto& [a, b, c] = triangle;
    return (b.z - a.z) * (c.x - a.x) - (b.x - a.x) * (c.z - a.z);
}

/// A triangle over a grid as a plane, and how the surface of the grid lies to it.
struct MeasuredTriangle {
    glm::dvec3 normal{0.0, 1.0, 0.0}; ///< unit
    double offset_m = 0.0;  ///< [m] the farthest that the surface over it is from its plane
    double upright_m = 0.0; ///< [m] the same along y
    double reach_m = 0.0;   ///< [m] the farthest that the surface over it is from a point
};

/// The surface of a grid of heights. [m] Relative to a point of the world.
class GridSurface {
  public:
    /// @param grid one that passed `validate`, which must outlive it
    GridSurface(const HeightGrid& grid, const glm::dvec3& origin)
        : grid_(&grid), shift_(grid.origin - origin) {}

    [[nodiscard]] GridPlace place_of(std::uint32_t post) const noexcept {
        return {post % grid_->columns, post / grid_->columns};
    }

    [[nodiscard]] glm::dvec3 point_at(const GridPlace& place) const noexcept {
        return point(static_cast<double>(place.x), height(place), static_cast<double>(place.z));
    }

    /// Calls `use` with every post over a closed triangle.
    template <typename Use>
    void for_posts(const GridTriangle& triangle, Use use) const;

    /// Measures what is over a triangle: exactly, since the surface and the plane are both linear
    /// between the posts over it and the places where its edges cross those of the surface.
    /// @param from [m] where `MeasuredTriangle::reach_m` is measured from
    [[nodiscard]] MeasuredTriangle
    measure(const GridTriangle& triangle, const glm::dvec3& from) const noexcept;

  private:
    [[nodiscard]] double height(const GridPlace& place) const noexcept {
        return double{grid_->heights
                          [static_cast<std::size_t>(place.z) * grid_->columns +
                           static_cast<std::size_t>(place.x)]};
    }

    [[nodiscard]] glm::dvec3 point(double x, double y, double z) const noexcept {
        return shift_ + glm::dvec3(x * grid_->spacing_m, y, z * grid_->spacing_m);
    }

    /// Height between two neighbouring posts.
    [[nodiscard]] double
    between(const GridPlace& a, const GridPlace& b, double share) const noexcept {
        return height(a) + (height(b) - height(a)) * share;
    }

    /// Calls `use(x, z, height)` wherever an edge crosses edges of the surface.
    template <typename Use>
    void for_crossings(const GridPlace& from, const GridPlace& to, Use use) const;

    const HeightGrid* grid_;
    glm::dvec3 shift_;
};

template <typename Use>
void GridSurface::for_posts(const GridTriangle& triangle, Use use) const {
    const auto divided_up = [](std::int64_t a, std::int64_t b) { // b > 0
        return a / b + (a % b > 0 ? 1 : 0);
    };
    const auto divided_down = [](std::int64_t a, std::int64_t b) { // b > 0
        return a / b - (a % b < 0 ? 1 : 0);
    };
    const auto [low, high] = std::minmax({triangle[0].z, triangle[1].z, triangle[2].z});
    const auto [left, right] = std::minmax({triangle[0].x, triangle[1].x, triangle[2].x});
    for (std::int64_t z = low; z <= high; ++z) {
        std::int64_t first = left;
        std::int64_t last = right;
        for (std::size_t k = 0; k < 3; ++k) {
            // Inside of the edge from a: down (x - a.x) >= across (z - a.z).
            const GridPlace& a = triangle[k];
            const GridPlace& b = triangle[(k + 1) % 3];
            const std::int64_t down = b.z - a.z;
            const std::int64_t across = (b.x - a.x) * (z - a.z);
            if (down > 0) {
                first = std::max(first, a.x + divided_up(across, down));
            } else if (down < 0) {
                last = std::min(last, a.x + divided_down(-across, -down));
            }
        }
        for (std::int64_t x = first; x <= last; ++x) {
            use(GridPlace{x, z});
        }
    }
}

} // namespace farfield
