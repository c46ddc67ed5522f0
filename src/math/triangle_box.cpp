#include <farfield/math/triangle_box.hpp>

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace farfield {

namespace {

/// Bound of the rounding of a projection, over the sum of the sizes of its terms. Three roundings
/// in each factor of a component of the axis and of the box, two more products and four sums make
/// at most 13 units of 2^-53 each; 16 leave room for the bound's own rounding.
constexpr double kRounding = 16.0 * 0.5 * std::numeric_limits<double>::epsilon();

/// A box relative to the first corner of the triangle.
struct RelativeBox {
    glm::dvec3 lo;
    glm::dvec3 hi;
    glm::dvec3 reach; ///< larger magnitude of the two, on each axis
};

/// True when the box lies beyond both `first` and `second` on an axis, surely.
/// @param size of each component of the axis before anything cancelled
bool separates(
    const RelativeBox& box,
    const glm::dvec3& axis,
    const glm::dvec3& size,
    double first,
    double second,
    double second_size
) noexcept {
    double least = 0.0;
    double most = 0.0;
    double sizes = second_size;
    for (int component = 0; component < 3; ++component) {
        const double a = axis[component] * box.lo[component];
        const double b = axis[component] * box.hi[component];
        least += std::min(a, b);
        most += std::max(a, b);
        sizes += size[component] * box.reach[component];
    }
    const double slack = kRounding * sizes;
    return std::max(first, second) < least - slack || std::min(first, second) > most + slack;
}

/// Corners of what is left of a triangle. A face adds one to a convex polygon; slivers may lose
/// that by rounding, and then it still cannot make more than half as many again: 3, 4, 6, 9, 13,
/// 19, 28.
struct Polygon {
    std::array<glm::dvec3, 28> corners{};
    std::size_t count = 0;

    void add(const glm::dvec3& corner) noexcept { corners.at(count++) = corner; }
};

/// What lies on the inner side of one face.
Polygon clip(const Polygon& polygon, int axis, double face, bool upper) noexcept {
    Polygon kept;
    for (std::size_t index = 0; index < polygon.count; ++index) {
        const glm::dvec3& a = polygon.corners.at(index);
        const glm::dvec3& b = polygon.corners.at((index + 1) % polygon.count);
        const bool a_inside = upper ? a[axis] <= face : a[axis] >= face;
        const bool b_inside = upper ? b[axis] <= face : b[axis] >= face;
        if (a_inside) {
            kept.add(a);
        }
        if (a_inside != b_inside) {
            const double share = (face - a[axis]) / (b[axis] - a[axis]);
            glm::dvec3 corner = a + (b - a) * share;
            // Between its ends and on the face, whatever the rounding said.
            corner = glm::clamp(corner, glm::min(a, b), glm::max(a, b));
            corner[axis] = face;
            kept.add(corner);
        }
    }
    return kept;
}

} // namespace

bool overlaps(const Box3d& box, const Triangle3d& triangle) noexcept {
    const Box3d around = bounds(triangle);
    for (int axis = 0; axis < 3; ++axis) {
        if (around.hi[axis] < box.lo[axis] || around.lo[axis] > box.hi[axis]) {
            return false;
        }
    }
    const glm::dvec3& base = triangle[0];
    RelativeBox relative{box.lo - base, box.hi - base, {}};
    relative.reach = glm::max(glm::abs(relative.lo), glm::abs(relative.hi));
    const glm::dvec3 ab = triangle[1] - base;
    const glm::dvec3 ac = triangle[2] - base;
    const glm::dvec3 bc = triangle[2] - triangle[1];

    // The normal: its components may cancel, so their rounding is bounded by the products.
    glm::dvec3 normal;
    glm::dvec3 size;
    for (int axis = 0; axis < 3; ++axis) {
        const int y = (axis + 1) % 3;
        const int z = (axis + 2) % 3;
        normal[axis] = ab[y] * ac[z] - ab[z] * ac[y];
        size[axis] = std::abs(ab[y] * ac[z]) + std::abs(ab[z] * ac[y]);
    }
    if (separates(relative, normal, size, 0.0, 0.0, 0.0)) {
        return false;
    }

    // Both ends of an edge project to one value on an axis perpendicular to it: that of `base` (0)
    // for the edges from there, and that of its end for the third; the opposite corner is the
    // other.
    struct Edge {
        const glm::dvec3& along;
        const glm::dvec3& first;  ///< a corner on the edge
        const glm::dvec3& second; ///< the corner opposite
    };
    constexpr glm::dvec3 kBase(0.0);
    for (const Edge& edge : {Edge{ab, kBase, ac}, Edge{ac, kBase, ab}, Edge{bc, ab, kBase}}) {
        for (int axis = 0; axis < 3; ++axis) {
            const int y = (axis + 1) % 3;
            const int z = (axis + 2) % 3;
            glm::dvec3 product(0.0);
            product[y] = -edge.along[z];
            product[z] = edge.along[y];
            const auto project = [&](const glm::dvec3& corner) {
                return product[y] * corner[y] + product[z] * corner[z];
            };
            const auto project_size = [&](const glm::dvec3& corner) {
                return std::abs(product[y] * corner[y]) + std::abs(product[z] * corner[z]);
            };
            const double corners = project_size(edge.first) + project_size(edge.second);
            if (separates(
                    relative,
                    product,
                    glm::abs(product),
                    project(edge.first),
                    project(edge.second),
                    corners
                )) {
                return false;
            }
        }
    }
    return true;
}

Box3d clipped_bounds(const Box3d& box, const Triangle3d& triangle) noexcept {
    Polygon polygon;
    for (const glm::dvec3& corner : triangle) {
        polygon.add(corner);
    }
    for (int axis = 0; axis < 3; ++axis) {
        polygon = clip(polygon, axis, box.lo[axis], false);
        polygon = clip(polygon, axis, box.hi[axis], true);
    }
    Box3d result;
    for (std::size_t index = 0; index < polygon.count; ++index) {
        result = unite(result, polygon.corners.at(index));
    }
    return result;
}

} // namespace farfield
