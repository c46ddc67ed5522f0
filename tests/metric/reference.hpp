#pragma once

#include "support/random.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/image_plane.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <limits>
#include <ostream>

namespace farfield::support {

using Real = long double;
using RealVector = glm::vec<3, Real>;

template <typename T>
inline constexpr Real kRoundoff = std::numeric_limits<T>::epsilon() / 2;

/// The angular discrepancy by its definition: the image is formed, then the angle is measured. In
/// extended precision it keeps about 15 digits for angles above 1e-4.
template <typename T>
[[nodiscard]] Real
reference_angle(const ImagePlane<T>& image, const glm::vec<3, T>& viewer, const RealVector& point) {
    const RealVector v0(image.viewpoint);
    const RealVector n(image.normal);
    const Real depth = glm::dot(n, RealVector(image.point) - v0);
    const RealVector ray = point - v0;
    const RealVector shown = v0 + ray * (depth / glm::dot(n, ray));
    const RealVector a = point - RealVector(viewer);
    const RealVector b = shown - RealVector(viewer);
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// First-order effect on the angle of relative errors of 1 in the products it is computed from: the
/// `scale` of the golden files.
template <typename T>
[[nodiscard]] Real
angle_scale(const ImagePlane<T>& image, const glm::vec<3, T>& viewer, const glm::vec<3, T>& point) {
    const RealVector n(image.normal);
    const RealVector u = RealVector(point) - RealVector(viewer);
    const RealVector m = RealVector(viewer) - RealVector(image.viewpoint);
    const RealVector to_plane = RealVector(image.point) - RealVector(image.viewpoint);
    const RealVector off_plane = RealVector(image.point) - RealVector(point);
    const Real sign = glm::dot(n, to_plane) < 0 ? Real(-1) : Real(1);
    const Real depth = std::abs(glm::dot(n, to_plane));
    const Real e = sign * glm::dot(n, off_plane);
    const Real across = std::abs(e) * glm::length(glm::cross(u, m));
    const Real along = depth * glm::dot(u, u) + e * glm::dot(u, m);
    const Real e_terms = glm::length(n) * glm::length(off_plane);
    const Real depth_terms = glm::length(n) * glm::length(to_plane);
    const Real product = glm::length(u) * glm::length(m);
    const Real weight =
        along * e_terms * product + across * (depth_terms * glm::dot(u, u) + e_terms * product);
    return std::atan2(across, along) + weight / (across * across + along * along);
}

/// A box, the image plane of its image, and a viewer.
template <typename T>
struct Case {
    ImagePlane<T> image;
    Box3<T> box;
    glm::vec<3, T> viewer{T(0)};

    friend std::ostream& operator<<(std::ostream& out, const Case& c) {
        const auto print = [&](const char* name, const glm::vec<3, T>& v) {
            out << name << '(' << v.x << ", " << v.y << ", " << v.z << ") ";
        };
        out.precision(std::numeric_limits<T>::max_digits10);
        print("v0", c.image.viewpoint);
        print("c", c.image.point);
        print("n", c.image.normal);
        print("lo", c.box.lo);
        print("hi", c.box.hi);
        print("v", c.viewer);
        return out;
    }
};

/// A legal case: a box about the origin of extents up to 1, now and then flat, seen from
/// `near_by` to `far_off` away, with a plane that is tilted and shifted, and a viewer who has moved
/// by up to half the distance. The viewer sees the front from outside.
template <typename T>
[[nodiscard]] Case<T> random_case(Random& random, T near_by, T far_off) {
    for (;;) {
        Case<T> c;
        glm::vec<3, T> half = random.vector(T(0.1), T(0.5));
        if (random.below(8) == 0) {
            half[static_cast<int>(random.below(3))] = T(0);
        }
        c.box = {-half, half};
        const glm::vec<3, T> away = random.direction<T>();
        const T distance = near_by * std::pow(far_off / near_by, random.uniform(T(0), T(1)));
        c.image.viewpoint = away * (distance + glm::length(half));
        c.image.normal = (away + random.direction<T>() * random.uniform(T(0), T(0.5))) *
                         random.uniform(T(0.2), T(5));
        c.image.point = random.vector(T(-0.4), T(0.4));
        c.viewer = c.image.viewpoint + random.direction<T>() * distance *
                                           std::pow(T(10), random.uniform(T(-4), T(-0.3)));
        if (metric::check(c.image, c.box, c.viewer) == MetricOutcome::ok) {
            return c;
        }
    }
}

/// A point of the surface of a box; half of them on its edges.
template <typename T>
[[nodiscard]] RealVector random_surface_point(Random& random, const Box3<T>& box) {
    const RealVector weight = random.vector(Real(0), Real(1));
    const unsigned fixed = random.below(3);
    const unsigned also_fixed = random.below(2) == 0 ? fixed : (fixed + 1) % 3;
    RealVector point(0);
    for (unsigned axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<int>(axis);
        const Real lo = box.lo[i];
        const Real hi = box.hi[i];
        const bool at_end = axis == fixed || axis == also_fixed;
        point[i] = at_end ? (random.below(2) == 0 ? lo : hi) : lo + (hi - lo) * weight[i];
    }
    return point;
}

} // namespace farfield::support
