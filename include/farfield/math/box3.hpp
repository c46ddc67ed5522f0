#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <limits>
#include <type_traits>

namespace farfield {

/// Axis-aligned closed box; lo == hi on an axis is legal (flat, segment and point boxes).
/// The default value is the empty box, the neutral element of `unite`.
template <typename T>
struct Box3 {
    glm::vec<3, T> lo{std::numeric_limits<T>::infinity()};
    glm::vec<3, T> hi{-std::numeric_limits<T>::infinity()};

    friend bool operator==(const Box3&, const Box3&) = default;
};

using Box3d = Box3<double>; ///< world space [m]
using Box3f = Box3<float>;  ///< relative to an origin that is kept in double [m]

/// True when no point is inside: lo > hi on some axis.
template <typename T>
[[nodiscard]] bool is_empty(const Box3<T>& box) noexcept {
    return !(box.lo.x <= box.hi.x && box.lo.y <= box.hi.y && box.lo.z <= box.hi.z);
}

/// True when all six numbers are finite.
template <typename T>
[[nodiscard]] bool is_finite(const Box3<T>& box) noexcept {
    return std::isfinite(box.lo.x) && std::isfinite(box.lo.y) && std::isfinite(box.lo.z) &&
           std::isfinite(box.hi.x) && std::isfinite(box.hi.y) && std::isfinite(box.hi.z);
}

/// Smallest box around both.
template <typename T>
[[nodiscard]] Box3<T> unite(const Box3<T>& a, const Box3<T>& b) noexcept {
    return {glm::min(a.lo, b.lo), glm::max(a.hi, b.hi)};
}

/// Smallest box around a box and a point.
template <typename T>
[[nodiscard]] Box3<T> unite(const Box3<T>& a, const glm::vec<3, T>& p) noexcept {
    return {glm::min(a.lo, p), glm::max(a.hi, p)};
}

/// Common part of two boxes, possibly empty.
template <typename T>
[[nodiscard]] Box3<T> intersect(const Box3<T>& a, const Box3<T>& b) noexcept {
    return {glm::max(a.lo, b.lo), glm::min(a.hi, b.hi)};
}

/// True when the closed box holds the point.
template <typename T>
[[nodiscard]] bool contains(const Box3<T>& box, const glm::vec<3, T>& p) noexcept {
    return p.x >= box.lo.x && p.x <= box.hi.x && p.y >= box.lo.y && p.y <= box.hi.y &&
           p.z >= box.lo.z && p.z <= box.hi.z;
}

/// Midpoint, without overflow for finite boxes.
template <typename T>
[[nodiscard]] glm::vec<3, T> center(const Box3<T>& box) noexcept {
    return box.lo * T(0.5) + box.hi * T(0.5);
}

/// Edge lengths.
template <typename T>
[[nodiscard]] glm::vec<3, T> extent(const Box3<T>& box) noexcept {
    return box.hi - box.lo;
}

/// Corner `index` in 0..7; bit 0 chooses hi.x, bit 1 hi.y, bit 2 hi.z.
template <typename T>
[[nodiscard]] glm::vec<3, T> corner(const Box3<T>& box, unsigned index) noexcept {
    return {
        (index & 1U) != 0U ? box.hi.x : box.lo.x,
        (index & 2U) != 0U ? box.hi.y : box.lo.y,
        (index & 4U) != 0U ? box.hi.z : box.lo.z};
}

/// Distance of a point from the closed box; zero inside.
template <typename T>
[[nodiscard]] T distance(const Box3<T>& box, const glm::vec<3, T>& p) noexcept {
    return glm::length(glm::max(glm::max(box.lo - p, p - box.hi), glm::vec<3, T>(T(0))));
}

/// Box enlarged by `margin` on both sides of each axis.
template <typename T>
[[nodiscard]] Box3<T> inflate(const Box3<T>& box, const glm::vec<3, T>& margin) noexcept {
    return {box.lo - margin, box.hi + margin};
}

/// World point relative to `origin`, rounded to nearest. With `local_box` the only place where
/// world `double` becomes `float`: the difference is formed before the narrowing.
[[nodiscard]] inline glm::vec3
local_point(const glm::dvec3& world, const glm::dvec3& origin) noexcept {
    return glm::vec3(world - origin);
}

/// World box relative to `origin`, rounded **outwards**: it never loses a point of the world box.
[[nodiscard]] inline Box3f local_box(const Box3d& world, const glm::dvec3& origin) noexcept {
    Box3f local;
    for (int axis = 0; axis < 3; ++axis) {
        const double lo = world.lo[axis] - origin[axis];
        const double hi = world.hi[axis] - origin[axis];
        const auto lo_float = static_cast<float>(lo);
        const auto hi_float = static_cast<float>(hi);
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        local.lo[axis] =
            static_cast<double>(lo_float) > lo ? std::nextafter(lo_float, -kInfinity) : lo_float;
        local.hi[axis] =
            static_cast<double>(hi_float) < hi ? std::nextafter(hi_float, kInfinity) : hi_float;
    }
    return local;
}

} // namespace farfield
