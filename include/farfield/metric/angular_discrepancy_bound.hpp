#pragma once

#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/box_terms.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/image_plane.hpp>
#include <farfield/metric/outcome.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

/// Upper bounds of the angular discrepancy over a whole box. Never too small, rounding included;
/// without the allowance for rounding 0.8 % of random boxes would be under-estimated in float.
namespace farfield::metric {

namespace detail {

template <typename T>
[[nodiscard]] T bound_t1(const BoxTerms<T>& terms) noexcept {
    constexpr T kUnit = kUnitRoundoff<T>;
    if (terms.e_sum == T(0)) {
        return T(0);
    }
    const glm::vec<3, T> e_lowest = glm::min(terms.e_lo, terms.e_hi);
    const glm::vec<3, T> e_highest = glm::max(terms.e_lo, terms.e_hi);
    const T e_most = std::max(
        std::abs(e_lowest.x + e_lowest.y + e_lowest.z),
        std::abs(e_highest.x + e_highest.y + e_highest.z)
    );
    const T e_bound = e_most + 8 * kUnit * terms.e_terms_bound;
    const T depth = terms.depth - 8 * kUnit * terms.depth_terms_bound;
    const T distance =
        glm::length(glm::max(glm::max(terms.u_lo, -terms.u_hi), glm::vec<3, T>(T(0))));
    if (depth <= T(0) || distance == T(0)) {
        return std::numbers::pi_v<T>;
    }
    // The exponent is limited on the safe side: beyond the upper limit the sine is above 1 anyway.
    const T unit = power_of_two<T>(std::clamp(terms.exponent, -kMaxExponent<T>, kMaxExponent<T>));
    const T sine = e_bound * glm::length(terms.m) / (depth * distance) * unit * (1 + 16 * kUnit);
    return sine < T(1) ? std::asin(sine) * (1 + 4 * kUnit) : std::numbers::pi_v<T>;
}

template <typename T>
[[nodiscard]] T bound_t2(const BoxTerms<T>& terms) noexcept {
    using Vector = glm::vec<3, T>;
    constexpr T kSlack = 16 * kUnitRoundoff<T>;
    if (terms.e_sum == T(0)) {
        return T(0);
    }
    // e is brought to about 1 once more, by its own size over the box: with a box that nearly lies
    // in the plane the squares below would vanish.
    const int e_exponent = exponent_of(terms.e_sum);
    const int exponent = terms.exponent + e_exponent;
    if (exponent > kMaxExponent<T>) {
        return std::numbers::pi_v<T>;
    }
    const T e_unit = power_of_two<T>(-e_exponent);
    const T unit = power_of_two<T>(std::max(exponent, -kMaxExponent<T>));

    // Bernstein coefficients on the grid {lo, middle, hi}^3, as sums of one term per axis.
    const std::array<Vector, 3> u{
        terms.u_lo, terms.u_lo + (terms.u_hi - terms.u_lo) * T(0.5), terms.u_hi};
    const std::array<Vector, 3> s{
        terms.u_lo * terms.u_lo * terms.depth,
        terms.u_lo * terms.u_hi * terms.depth,
        terms.u_hi * terms.u_hi * terms.depth};
    const Vector e_lo = terms.e_lo * e_unit;
    const Vector e_hi = terms.e_hi * e_unit;
    const std::array<Vector, 3> e{e_lo, (e_lo + e_hi) * T(0.5), e_hi};
    const Vector bend = terms.bend * e_unit;
    const std::array<Vector, 3> k{Vector(T(0)), bend, Vector(T(0))};

    const T reach = glm::length(glm::max(glm::abs(terms.u_lo), glm::abs(terms.u_hi)));
    const T across_slack = kSlack * terms.e_sum * e_unit * reach * glm::length(terms.m);
    const T along_slack = kSlack * terms.depth_terms_bound * reach * reach + across_slack * unit;

    T steepest = 0;
    T least_along = std::numeric_limits<T>::max();
    for (std::size_t z = 0; z < 3; ++z) {
        for (std::size_t y = 0; y < 3; ++y) {
            const T e_yz = e[y].y + e[z].z;
            const T s_yz = s[y].y + s[z].z;
            for (std::size_t x = 0; x < 3; ++x) {
                // The maximum lies on the surface of the box: the node inside has no part in it.
                if (x == 1 && y == 1 && z == 1) {
                    continue;
                }
                const T e_node = e[x].x + e_yz;
                const Vector w(
                    e_node * u[x].x + k[x].x, e_node * u[y].y + k[y].y, e_node * u[z].z + k[z].z
                );
                const T across = glm::length(glm::cross(w, terms.m)) + across_slack;
                const T along = s[x].x + s_yz + glm::dot(w, terms.m) * unit - along_slack;
                steepest = std::max(steepest, across / along);
                least_along = std::min(least_along, along);
            }
        }
    }
    if (!(least_along > T(0))) {
        return std::numbers::pi_v<T>;
    }
    return std::atan(steepest * unit) * (1 + 4 * kUnitRoundoff<T>);
}

} // namespace detail

/// Bound from distances alone, about 60 operations.
///
///     theta <= asin(E |m| / (D rho)) where E |m| < D rho, else pi
///
/// with E the largest |e| in the box and rho the distance of the viewer from it (e, m and D as in
/// `angular_discrepancy`). About 1.3 times the truth in the median, 5 to 10 times at worst, and the
/// only bound that still holds something closer than half a diagonal.
/// @return [rad] in [0, pi], never too small; pi where the viewer is in the box or does not see the
/// image's front; 0 where the whole box is in the image plane
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] T bound_t1_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    const auto terms = detail::box_terms(image, box, viewer);
    return terms.hidden ? std::numbers::pi_v<T> : detail::bound_t1(terms);
}

/// Tight bound, about 950 operations.
///
/// Both arguments of the arc tangent are quadratics over the box, so each lies between its
/// Bernstein coefficients, 26 of which can matter; the bound is the arc tangent of the largest
/// quotient of coefficients, pi where a denominator is not positive. It *is* the truth where the
/// largest quotient is at a corner, which beyond two diagonals it nearly always is: at most 1.03
/// times the truth in 99 of 100 cases there, 1.6 times at one diagonal.
/// @return as `bound_t1_unchecked`
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] T bound_t2_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    const auto terms = detail::box_terms(image, box, viewer);
    return terms.hidden ? std::numbers::pi_v<T> : detail::bound_t2(terms);
}

/// The smaller of both bounds: what to compare with a threshold.
/// @return as `bound_t1_unchecked`
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] T angular_discrepancy_bound_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    const auto terms = detail::box_terms(image, box, viewer);
    return terms.hidden ? std::numbers::pi_v<T>
                        : std::min(detail::bound_t1(terms), detail::bound_t2(terms));
}

/// Whether an image may stand for a box seen by `viewer`: exactly
/// `angular_discrepancy_bound_unchecked(image, box, viewer) <= threshold`, but the costly bound is
/// evaluated only where the cheap one is above the threshold.
/// @param threshold [rad] >= 0, see `pixel_angle`
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] bool is_within_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer, T threshold
) noexcept {
    const auto terms = detail::box_terms(image, box, viewer);
    return !terms.hidden &&
           (detail::bound_t1(terms) <= threshold || detail::bound_t2(terms) <= threshold);
}

/// `bound_t1_unchecked` with all input judged.
/// @return [rad] the bound with ok, pi_inside or pi_backface, or the error of `check`
template <typename T>
[[nodiscard]] Measured<T>
bound_t1(const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer) noexcept {
    return detail::judged<T>(check(image, box, viewer), [&] {
        return bound_t1_unchecked(image, box, viewer);
    });
}

/// `bound_t2_unchecked` with all input judged.
/// @return as `bound_t1`
template <typename T>
[[nodiscard]] Measured<T>
bound_t2(const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer) noexcept {
    return detail::judged<T>(check(image, box, viewer), [&] {
        return bound_t2_unchecked(image, box, viewer);
    });
}

/// `angular_discrepancy_bound_unchecked` with all input judged.
/// @return as `bound_t1`
template <typename T>
[[nodiscard]] Measured<T> angular_discrepancy_bound(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    return detail::judged<T>(check(image, box, viewer), [&] {
        return angular_discrepancy_bound_unchecked(image, box, viewer);
    });
}

} // namespace farfield::metric
