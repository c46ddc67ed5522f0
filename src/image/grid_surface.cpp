#include "image/grid_surface.hpp"

#include <glm/geometric.hpp>

namespace farfield {

template <typename Use>
void GridSurface::for_crossings(const GridPlace& from, const GridPlace& to, Use use) const {
    const std::int64_t dx = to.x - from.x;
    const std::int64_t dz = to.z - from.z;
    if (dx == 0 || dz == 0 || dx == dz) {
        return; // along edges of the surface: their posts are all there is
    }
    const auto along = [](std::int64_t a, std::int64_t length, double share) {
        return static_cast<double>(a) + static_cast<double>(length) * share;
    };
    // Lines of equal x, of equal z, and of equal x - z, which squares are cut along.
    const auto share_at = [](std::int64_t line, std::int64_t begin, std::int64_t length) {
        return static_cast<double>(line - begin) / static_cast<double>(length);
    };
    for (std::int64_t x = std::min(from.x, to.x) + 1; x < std::max(from.x, to.x); ++x) {
        const double z = along(from.z, dz, share_at(x, from.x, dx));
        const auto row = static_cast<std::int64_t>(z);
        const double share = z - static_cast<double>(row);
        const GridPlace post{x, row};
        use(static_cast<double>(x),
            z,
            share > 0.0 ? between(post, {x, row + 1}, share) : height(post));
    }
    for (std::int64_t z = std::min(from.z, to.z) + 1; z < std::max(from.z, to.z); ++z) {
        const double x = along(from.x, dx, share_at(z, from.z, dz));
        const auto column = static_cast<std::int64_t>(x);
        const double share = x - static_cast<double>(column);
        const GridPlace post{column, z};
        use(x,
            static_cast<double>(z),
            share > 0.0 ? between(post, {column + 1, z}, share) : height(post));
    }
    const std::int64_t begin = from.x - from.z;
    const std::int64_t end = to.x - to.z;
    for (std::int64_t line = std::min(begin, end) + 1; line < std::max(begin, end); ++line) {
        const double share_of_edge = share_at(line, begin, end - begin);
        const double x = along(from.x, dx, share_of_edge);
        const double z = along(from.z, dz, share_of_edge);
        // x and z are equally far from their posts, but for rounding.
        const auto column = static_cast<std::int64_t>(x);
        const double share = x - static_cast<double>(column);
        const GridPlace post{column, column - line};
        use(x, z, share > 0.0 ? between(post, {column + 1, column + 1 - line}, share) : height(post)
        );
    }
}

MeasuredTriangle
GridSurface::measure(const GridTriangle& triangle, const glm::dvec3& from) const noexcept {
    const glm::dvec3 a = point_at(triangle[0]);
    MeasuredTriangle measured;
    measured.normal =
        glm::normalize(glm::cross(point_at(triangle[1]) - a, point_at(triangle[2]) - a));
    const glm::dvec3 normal = measured.normal;
    double reach_sq = 0.0;
    double offset = 0.0;
    const auto meet = [&](const glm::dvec3& p) {
        offset = std::max(offset, std::abs(glm::dot(normal, p - a)));
        const glm::dvec3 apart = p - from;
        reach_sq = std::max(reach_sq, glm::dot(apart, apart));
    };
    for_posts(triangle, [&](const GridPlace& place) { meet(point_at(place)); });
    for (std::size_t k = 0; k < 3; ++k) {
        for_crossings(triangle[k], triangle[(k + 1) % 3], [&](double x, double z, double y) {
            meet(point(x, y, z));
        });
    }
    measured.offset_m = offset;
    measured.upright_m = offset / normal.y;
    measured.reach_m = std::sqrt(reach_sq);
    return measured;
}

} // namespace farfield
