#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/arc.hpp>
#include <farfield/metric/detail/lanes.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/image_plane.hpp>

#include <glm/vec3.hpp>

#include <limits>
#include <numbers>

/// What all angles between a box and its image are made of. With u = a - v, m = v - v0,
/// e = n.(c - a) and D = n.(c - v0), the angle at a point a of the box is
///
///     atan2(r |e| |u x m|, D |u|^2 + r e (u.m))
///
/// where e, u, m and D have been divided by powers of two that bring each to about 1, and r is the
/// power of two that makes up for it. `Number` is explained in `lanes.hpp`.
namespace farfield::metric::detail {

/// What an image and a viewer say about every box.
template <typename Number>
struct ImageTerms {
    Triple<Number> viewer;
    Triple<Number> point;                     ///< of the plane
    Triple<Number> n;                         ///< scaled, pointing from the viewpoint to the plane
    Triple<Number> m;                         ///< v - v0, scaled
    Number m_length{};                        ///< of the scaled m
    Number depth{};                           ///< D > 0
    Number depth_sum{};                       ///< sum of the magnitudes of the terms of D
    typename Lanes<Number>::Whole exponent{}; ///< part of m and D in the exponent of r
    typename Lanes<Number>::Mask is_still{};  ///< the viewer is at the image's viewpoint
    typename Lanes<Number>::Mask sees_back{}; ///< the viewer is in or behind the image plane
};

/// @param motion viewer - viewpoint, perhaps known to more digits than that difference
template <typename Number>
[[nodiscard]] ImageTerms<Number> image_terms(
    const Triple<Number>& viewpoint,
    const Triple<Number>& point,
    const Triple<Number>& normal,
    const Triple<Number>& viewer,
    const Triple<Number>& motion
) noexcept {
    using Lane = Lanes<Number>;
    using T = typename Lane::Scalar;
    const Number zero(T(0));
    const auto m = scaled(motion);
    const auto to_plane = scaled(point - viewpoint);
    const auto n = scaled(normal).direction;
    const Triple<Number> depth_terms = n * to_plane.direction;
    const Number depth = sum(depth_terms);
    const Number side = Lane::select(depth < zero, Number(T(-1)), Number(T(1)));

    ImageTerms<Number> terms;
    terms.viewer = viewer;
    terms.point = point;
    terms.n = n * side;
    terms.m = m.direction;
    terms.m_length = Lane::square_root(dot(m.direction, m.direction));
    terms.depth = Lane::magnitude(depth);
    terms.depth_sum = sum(magnitude(depth_terms));
    terms.exponent = m.exponent - to_plane.exponent;
    terms.is_still = terms.m_length <= zero;
    terms.sees_back = dot(terms.n, scaled(point - viewer).direction) <= zero;
    return terms;
}

/// What a box adds.
template <typename Number>
struct BoxTerms {
    Triple<Number> u_lo;                        ///< lo - v, not scaled
    Triple<Number> u_hi;                        ///< hi - v, not scaled
    Triple<Number> gap;                         ///< from the viewer to the box, not scaled
    Triple<Number> half;                        ///< half the extent, not scaled
    Triple<Number> e_lo;                        ///< n_i (c_i - lo_i)
    Triple<Number> e_hi;                        ///< n_i (c_i - hi_i)
    Triple<Number> e_lowest;                    ///< the smaller of both on each axis
    Triple<Number> e_highest;                   ///< the larger
    Number e_unit{};                            ///< what divides lengths for e
    Number e_sum{};                             ///< no less than |e| anywhere in the box
    typename Lanes<Number>::Whole e_exponent{}; ///< part of e in the exponent of r
    typename Lanes<Number>::Mask is_flush{};    ///< the box is in the plane, or the viewer still
    typename Lanes<Number>::Mask is_hidden{};   ///< no image: in the box, or behind the plane
};

template <typename Number>
[[nodiscard]] BoxTerms<Number> box_terms(
    const ImageTerms<Number>& image, const Triple<Number>& lo, const Triple<Number>& hi
) noexcept {
    using Lane = Lanes<Number>;
    using T = typename Lane::Scalar;
    const Number zero(T(0));
    BoxTerms<Number> terms;
    terms.u_lo = lo - image.viewer;
    terms.u_hi = hi - image.viewer;
    terms.half = (hi - lo) * Number(T(0.5));
    // Signs of differences are exact, so the gap is zero for the viewers in the closed box only.
    terms.gap = positive_part(greatest(terms.u_lo, image.viewer - hi));
    terms.is_hidden = image.sees_back | (largest(terms.gap) <= zero);

    const Triple<Number> c_lo = image.point - lo;
    const Triple<Number> c_hi = image.point - hi;
    // Since c_hi <= c_lo, the larger of their magnitudes is the larger of c_lo and -c_hi.
    terms.e_exponent = Lane::exponent(largest(greatest(c_lo, hi - image.point)));
    terms.e_unit = Lane::power(-terms.e_exponent);
    terms.e_lo = image.n * (c_lo * terms.e_unit);
    terms.e_hi = image.n * (c_hi * terms.e_unit);
    terms.e_lowest = least(terms.e_lo, terms.e_hi);
    terms.e_highest = greatest(terms.e_lo, terms.e_hi);
    terms.e_sum = sum(greatest(-terms.e_lowest, terms.e_highest));
    terms.is_flush = image.is_still | (terms.e_sum <= zero);
    return terms;
}

/// An angle where an image is shown, 0 where nothing can be wrong, pi where there is none.
template <typename Number>
[[nodiscard]] Number shown(const BoxTerms<Number>& box, const Number& angle) noexcept {
    using Lane = Lanes<Number>;
    using T = typename Lane::Scalar;
    const Number flush = Lane::select(box.is_flush, Number(T(0)), angle);
    return Lane::select(box.is_hidden, Number(std::numbers::pi_v<T>), flush);
}

/// The largest of the angles at the eight corners.
template <typename Number>
[[nodiscard]] Number
corner_angle(const ImageTerms<Number>& image, const BoxTerms<Number>& box) noexcept {
    using Lane = Lanes<Number>;
    using T = typename Lane::Scalar;
    constexpr int kMax = kMaxExponent<T>;
    const Number zero(T(0));
    const auto u_exponent = Lane::exponent(largest(greatest(-box.u_lo, box.u_hi)));
    const Number u_unit = Lane::power(-u_exponent);
    const Triple<Number> u[2] = {box.u_lo * u_unit, box.u_hi * u_unit};
    const Triple<Number> e[2] = {box.e_lo, box.e_hi};
    // The larger of the two kinds of terms keeps its scale, so that nothing overflows.
    const auto exponent = box.e_exponent + image.exponent - u_exponent;
    const Number depth = image.depth * Lane::power(-Lane::limited(exponent, 0, kMax));
    const Number unit = Lane::power(Lane::limited(exponent, -kMax, 0));
    const Triple<Number>& m = image.m;

    Number worst_across = zero;
    Number worst_along(T(1));
    auto is_opposite = worst_along < zero;
    for (int z = 0; z < 2; ++z) {
        for (int y = 0; y < 2; ++y) {
            const Number cross_x = u[y].y * m.z - u[z].z * m.y;
            for (int x = 0; x < 2; ++x) {
                const Number cross_y = u[z].z * m.x - u[x].x * m.z;
                const Number cross_z = u[x].x * m.y - u[y].y * m.x;
                const Number off = e[x].x + e[y].y + e[z].z;
                const Number length =
                    Lane::square_root(cross_x * cross_x + cross_y * cross_y + cross_z * cross_z);
                const Number square = u[x].x * u[x].x + u[y].y * u[y].y + u[z].z * u[z].z;
                const Number aligned = u[x].x * m.x + u[y].y * m.y + u[z].z * m.z;
                const Number across = Lane::magnitude(off) * length * unit;
                const Number along = depth * square + off * unit * aligned;
                // Angles in [0, pi] are compared by a product instead of eight arc tangents. The
                // opposite direction is parallel to 0, so it needs a word of its own.
                is_opposite = is_opposite | ((across <= zero) & (along <= zero));
                const auto is_worse = worst_across * along < across * worst_along;
                worst_across = Lane::select(is_worse, across, worst_across);
                worst_along = Lane::select(is_worse, along, worst_along);
            }
        }
    }
    const Number angle = arc_of(worst_across, worst_along);
    return shown(box, Lane::select(is_opposite, Number(std::numbers::pi_v<T>), angle));
}

/// Bound from distances: asin(E |m| / (D rho)), as an arc tangent.
template <typename Number>
[[nodiscard]] Number
bound_t1(const ImageTerms<Number>& image, const BoxTerms<Number>& box) noexcept {
    using Lane = Lanes<Number>;
    using T = typename Lane::Scalar;
    constexpr T kUnit = kUnitRoundoff<T>;
    constexpr int kMax = kMaxExponent<T>;
    const Number zero(T(0));
    // e and D are sums of three rounded products of a rounded difference: four units of their
    // terms. Since the lowest e is no more than the highest, -lowest or highest has the larger
    // magnitude.
    const Number e_most = greatest(-sum(box.e_lowest), sum(box.e_highest));
    const Number e_bound = e_most + box.e_sum * Number(8 * kUnit);
    const Number depth = image.depth - image.depth_sum * Number(8 * kUnit);
    const auto gap_exponent = Lane::exponent(largest(box.gap));
    const Triple<Number> gap = box.gap * Lane::power(-gap_exponent);
    // The exponent is limited on the safe side: beyond the upper limit the sine is above 1 anyway.
    const auto exponent =
        Lane::limited(box.e_exponent + image.exponent - gap_exponent, -kMax, kMax);
    // Seven roundings in the sine, six units in the arc, two in the cosine: as asin bends upwards,
    // to enlarge the sine by 32 enlarges the angle by no less. What a product loses by becoming
    // denormal is less than the smallest normal number.
    const Number sine =
        e_bound * (image.m_length * Number(1 + 32 * kUnit)) * Lane::power(exponent) +
        Number(std::numeric_limits<T>::min());
    // Eight roundings in each square, and the second is no more than the first.
    const Number cosine_sq = depth * depth * Number(1 - 24 * kUnit) * dot(gap, gap) - sine * sine;
    const Number angle = arc_tangent(sine, Lane::square_root(Lane::positive_part(cosine_sq)));
    const auto is_bounded = (zero < depth) & (zero < cosine_sq);
    return shown(box, Lane::select(is_bounded, angle, Number(std::numbers::pi_v<T>)));
}

/// Bound from Bernstein coefficients on the grid {lo, middle, hi}^3, where all that is needed is a
/// sum of one term per axis.
template <typename Number>
[[nodiscard]] Number
bound_t2(const ImageTerms<Number>& image, const BoxTerms<Number>& box) noexcept {
    using Lane = Lanes<Number>;
    using T = typename Lane::Scalar;
    using Nodes = Triple<Number>[3];
    constexpr T kUnit = kUnitRoundoff<T>;
    // Largest exponent of r at which no product below overflows.
    constexpr int kMost = kMaxExponent<T> - 8;
    const Number zero(T(0));
    const Number half(T(0.5));
    const Triple<Number>& m = image.m;

    const Triple<Number> reach = greatest(-box.u_lo, box.u_hi);
    const auto u_exponent = Lane::exponent(largest(reach));
    const Number u_unit = Lane::power(-u_exponent);
    // e is brought to about 1 once more, by its own size over the box: with a box that nearly lies
    // in the plane the squares below would vanish.
    const auto e_exponent = Lane::exponent(box.e_sum);
    const Number e_unit = Lane::power(-e_exponent);
    const auto exponent = box.e_exponent + e_exponent + image.exponent - u_exponent;
    const auto limited = Lane::limited(exponent, -kMaxExponent<T>, kMost);
    const Number unit = Lane::power(limited);

    const Triple<Number> u_lo = box.u_lo * u_unit;
    const Triple<Number> u_hi = box.u_hi * u_unit;
    const Triple<Number> e_lo = box.e_lo * e_unit;
    const Triple<Number> e_hi = box.e_hi * e_unit;
    const Triple<Number> bend = image.n * (box.half * u_unit) * (box.half * box.e_unit) * e_unit;
    const Nodes u = {u_lo, u_lo + (u_hi - u_lo) * half, u_hi};
    const Nodes e = {e_lo, (e_lo + e_hi) * half, e_hi};
    const Nodes s = {
        u_lo * u_lo * image.depth, u_lo * u_hi * image.depth, u_hi * u_hi * image.depth};
    // u.m and the parts of N and P from k, which the middle of an axis alone has.
    const Nodes um = {u[0] * m, u[1] * m, u[2] * m};
    const Triple<Number> km = bend * m;

    // Roundings add up to 32 units of what N and the second part of P could be, 16 of the first.
    const Number reach_sq = dot(reach * u_unit, reach * u_unit);
    const Number across_slack =
        Number(32 * kUnit) * box.e_sum * e_unit * Lane::square_root(reach_sq) * image.m_length;
    const Number along_slack =
        Number(16 * kUnit) * image.depth_sum * reach_sq + across_slack * unit;

    Number steepest = zero;
    Number least_along(std::numeric_limits<T>::max());
    for (int z = 0; z < 3; ++z) {
        const Number km_z = z == 1 ? km.z : zero;
        const Number kz_my = z == 1 ? bend.z * m.y : zero;
        const Number kz_mx = z == 1 ? bend.z * m.x : zero;
        for (int y = 0; y < 3; ++y) {
            const Number e_yz = e[y].y + e[z].z;
            const Number s_yz = s[y].y + s[z].z - along_slack;
            const Number um_yz = um[y].y + um[z].z;
            const Number km_yz = (y == 1 ? km.y : zero) + km_z;
            const Number ky_mx = y == 1 ? bend.y * m.x : zero;
            const Number ky_mz = y == 1 ? bend.y * m.z : zero;
            const Number cross_x = u[y].y * m.z - u[z].z * m.y;
            const Number bend_x = ky_mz - kz_my;
            for (int x = 0; x < 3; ++x) {
                // The maximum lies on the surface of the box: the node inside has no part in it.
                if (x == 1 && y == 1 && z == 1) {
                    continue;
                }
                const Number kx_my = x == 1 ? bend.x * m.y : zero;
                const Number kx_mz = x == 1 ? bend.x * m.z : zero;
                const Number off = e[x].x + e_yz;
                const Triple<Number> cross{
                    off * cross_x + bend_x,
                    off * (u[z].z * m.x - u[x].x * m.z) + (kz_mx - kx_mz),
                    off * (u[x].x * m.y - u[y].y * m.x) + (kx_my - ky_mx)};
                const Number across = Lane::square_root(dot(cross, cross)) + across_slack;
                const Number aligned = off * (um[x].x + um_yz) + ((x == 1 ? km.x : zero) + km_yz);
                const Number along = s[x].x + s_yz + aligned * unit;
                steepest = greatest(steepest, across / along);
                least_along = least(least_along, along);
            }
        }
    }
    // What a product loses by becoming denormal is less than the smallest normal number.
    const Number tangent = steepest * unit + Number(std::numeric_limits<T>::min());
    const Number angle = arc_tangent(tangent, Number(T(1))) * Number(1 + 8 * kUnit);
    const auto is_bounded = (zero < least_along) & (exponent <= limited);
    return shown(box, Lane::select(is_bounded, angle, Number(std::numbers::pi_v<T>)));
}

/// The terms of one image and viewer, with what is asked of them asserted.
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] ImageTerms<T> image_terms(
    const ImagePlane<T>& image, [[maybe_unused]] const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    FARFIELD_ASSERT(check_image(image, box, is_measurable(viewer)) == MetricOutcome::ok);
    const Triple<T> from = triple(image.viewpoint);
    const Triple<T> to = triple(viewer);
    return image_terms(from, triple(image.point), triple(image.normal), to, to - from);
}

template <typename T>
[[nodiscard]] BoxTerms<T> box_terms(const ImageTerms<T>& image, const Box3<T>& box) noexcept {
    return box_terms(image, triple(box.lo), triple(box.hi));
}

} // namespace farfield::metric::detail
