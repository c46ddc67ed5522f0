#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/image_plane.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>

namespace farfield::metric::detail {

/// What all angles between a box and its image are made of. With u = a - v, m = v - v0,
/// e = n.(c - a) and D = n.(c - v0), the angle at a point a of the box is
///
///     atan2(r |e| |u x m|, D |u|^2 + r e (u.m)),   r = 2^exponent
///
/// where e, u, m and D have been divided by powers of two that bring each to about 1.
template <typename T>
struct BoxTerms {
    glm::vec<3, T> u_lo{T(0)}; ///< lo - v
    glm::vec<3, T> u_hi{T(0)}; ///< hi - v
    glm::vec<3, T> m{T(0)};    ///< v - v0
    glm::vec<3, T> e_lo{T(0)}; ///< n_i (c_i - lo_i)
    glm::vec<3, T> e_hi{T(0)}; ///< n_i (c_i - hi_i)
    glm::vec<3, T> bend{T(0)}; ///< n_i (hi_i - lo_i)^2 / 4, in units of e times u
    T depth = 0;               ///< D > 0
    T depth_terms_bound = 0;   ///< |n| |c - v0|, no less than the terms of D
    T e_terms_bound = 0;       ///< |n| times the largest |c_i - a_i| on each axis
    T e_sum = 0;               ///< no less than |e| anywhere in the box; 0: the box is in the plane
    int exponent = 0;          ///< of r
    bool hidden = false;       ///< the viewer is in the box, or in or behind the image plane
};

/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] BoxTerms<T>
box_terms(const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer) noexcept {
    FARFIELD_ASSERT(check_image(image, box, is_measurable(viewer)) == MetricOutcome::ok);
    using Vector = glm::vec<3, T>;
    BoxTerms<T> terms;

    const ScaledVector<T> m = scaled<T>(viewer - image.viewpoint);
    const ScaledVector<T> depth = scaled<T>(image.point - image.viewpoint);
    Vector n = scaled(image.normal).direction;
    terms.m = m.direction;
    terms.depth = glm::dot(n, depth.direction);
    terms.hidden = contains(box, viewer) || sees_back(image, n, terms.depth, viewer);
    if (terms.depth < T(0)) {
        n = -n;
        terms.depth = -terms.depth;
    }
    const T n_length = glm::length(n);
    terms.depth_terms_bound = n_length * glm::length(depth.direction);

    const Vector u_lo = box.lo - viewer;
    const Vector u_hi = box.hi - viewer;
    const int u_exponent = exponent_of(largest_component(glm::max(glm::abs(u_lo), glm::abs(u_hi))));
    const T u_unit = power_of_two<T>(-u_exponent);
    terms.u_lo = u_lo * u_unit;
    terms.u_hi = u_hi * u_unit;

    const Vector c_lo = image.point - box.lo;
    const Vector c_hi = image.point - box.hi;
    const Vector reach = glm::max(glm::abs(c_lo), glm::abs(c_hi));
    const int e_exponent = exponent_of(largest_component(reach));
    const T e_unit = power_of_two<T>(-e_exponent);
    terms.e_lo = n * (c_lo * e_unit);
    terms.e_hi = n * (c_hi * e_unit);
    terms.e_terms_bound = n_length * glm::length(reach * e_unit);
    const Vector e_most = glm::max(glm::abs(terms.e_lo), glm::abs(terms.e_hi));
    terms.e_sum = e_most.x + e_most.y + e_most.z;

    const Vector half = extent(box) * T(0.5);
    terms.bend = n * (half * u_unit) * (half * e_unit);
    terms.exponent = e_exponent + m.exponent - depth.exponent - u_exponent;
    return terms;
}

} // namespace farfield::metric::detail
