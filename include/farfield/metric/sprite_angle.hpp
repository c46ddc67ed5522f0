#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/angle_parts.hpp>
#include <farfield/metric/detail/scale.hpp>
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
#include <span>

namespace farfield {

/// Root of the mean square and largest of several angles [rad].
template <typename T>
struct AngleSpread {
    T rms = 0; ///< bounds no single angle: the largest may be sqrt(count) times as large
    T largest = 0;
};

/// Angular error of a picture projected onto a coarse model: a point C of the fine model, drawn
/// from v1, is shown from v2 at C' = C + b dir(v1, C), where the ray from v1 meets the coarse
/// model. b > 0: behind C.
namespace metric {

namespace detail {

/// `angle` of turn and offset: atan2(|b| sin psi, a + b cos psi).
template <typename T>
[[nodiscard]] T angle_of_turn(T turn, T distance, T offset) noexcept {
    const T unit = power_of_two<T>(-exponent_of(std::max(distance, std::abs(offset))));
    const T a = distance * unit;
    const T b = offset * unit;
    return angle(AngleParts<T>{std::abs(b) * std::sin(turn), a + b * std::cos(turn)});
}

template <typename T>
[[nodiscard]] AngleParts<T> sprite_parts(
    const glm::vec<3, T>& drawn_from,
    const glm::vec<3, T>& seen_from,
    const glm::vec<3, T>& point,
    T offset
) noexcept {
    const auto u1 = scaled<T>(point - drawn_from);
    const auto u2 = scaled<T>(point - seen_from);
    const auto m = scaled<T>(seen_from - drawn_from);
    const int b_exponent = exponent_of(offset);
    const T b = times_power_of_two(offset, -b_exponent);
    // Of three products of lengths, all less |u2| to the first power, the largest keeps its scale.
    const int across_exponent = b_exponent + m.exponent;
    const int depth_exponent = u1.exponent + u2.exponent;
    const int offset_exponent = b_exponent + u1.exponent;
    const int most = std::max({across_exponent, depth_exponent, offset_exponent});
    const T across = std::abs(b) * glm::length(glm::cross(u2.direction, m.direction));
    const T depth = glm::length(u1.direction) * glm::dot(u2.direction, u2.direction);
    const T along = b * glm::dot(u1.direction, u2.direction);
    return {
        times_power_of_two(across, across_exponent - most),
        times_power_of_two(depth, depth_exponent - most) +
            times_power_of_two(along, offset_exponent - most)};
}

/// Distance of a segment from 0 to m and a box, both relative to one point; rounded down.
template <typename T>
[[nodiscard]] T segment_distance(const glm::vec<3, T>& m, const Box3<T>& box) noexcept {
    using Vector = glm::vec<3, T>;
    // The slope of the squared distance along the segment grows from one piece to the next, and is
    // linear between the places where a coordinate enters or leaves the box's range.
    std::array<T, 8> places{};
    std::size_t count = 0;
    places[count++] = T(0);
    for (int axis = 0; axis < 3; ++axis) {
        for (const T bound : {box.lo[axis], box.hi[axis]}) {
            const T place = m[axis] == T(0) ? T(0) : bound / m[axis];
            if (place > T(0) && place < T(1)) {
                places[count++] = place;
            }
        }
    }
    places[count++] = T(1);
    std::sort(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(count));
    const auto excess = [&](T place) {
        const Vector p = m * place;
        return p - glm::clamp(p, box.lo, box.hi);
    };
    const auto slope = [&](T place) { return glm::dot(m, excess(place)); };
    T nearest = T(0);
    if (slope(T(0)) < T(0)) {
        nearest = T(1);
        for (std::size_t i = 1; i < count; ++i) {
            const T after = slope(places[i]);
            if (after >= T(0)) {
                const T before = slope(places[i - 1]);
                const T part = before / (before - after);
                nearest = places[i - 1] + (places[i] - places[i - 1]) * part;
                break;
            }
        }
    }
    // Near its least value the squared distance changes with the square of an error of the place:
    // what remains is the rounding of the coordinates.
    const T reach = glm::length(glm::max(glm::abs(box.lo), glm::abs(box.hi))) + glm::length(m);
    return std::max(glm::length(excess(nearest)) - 16 * kUnitRoundoff<T> * reach, T(0));
}

template <typename T>
[[nodiscard]] MetricOutcome check_sprite(
    const glm::vec<3, T>& drawn_from,
    const glm::vec<3, T>& seen_from,
    const glm::vec<3, T>& point,
    T offset
) noexcept {
    if (!is_measurable(drawn_from) || !is_measurable(seen_from) || !is_measurable(point) ||
        !is_measurable(offset)) {
        return MetricOutcome::err_nonfinite;
    }
    if (point == drawn_from) {
        return MetricOutcome::err_distance;
    }
    return offset <= -length<T>(point - drawn_from) ? MetricOutcome::err_behind : MetricOutcome::ok;
}

} // namespace detail

/// The turn psi of a point: the angle at it between the two eyes.
///
///     psi = atan2(|u2 x m|, u1.u2),   u1 = C - v1,  u2 = C - v2,  m = v2 - v1
///
/// The paper's angle phi at C is pi - psi for b > 0 and psi for b < 0; stored as phi, small turns
/// lose their digits.
/// @return [rad] in [0, pi]; pi where v2 = C
/// @pre finite coordinates, point != drawn_from
template <typename T>
[[nodiscard]] T sprite_turn_unchecked(
    const glm::vec<3, T>& drawn_from, const glm::vec<3, T>& seen_from, const glm::vec<3, T>& point
) noexcept {
    const auto u1 = detail::scaled<T>(point - drawn_from);
    const auto u2 = detail::scaled<T>(point - seen_from);
    const auto m = detail::scaled<T>(seen_from - drawn_from);
    const T across = glm::length(glm::cross(u2.direction, m.direction));
    const T along = glm::dot(u1.direction, u2.direction);
    const int exponent = m.exponent - u1.exponent;
    return detail::angle(
        exponent > 0 ? detail::AngleParts<T>{across, detail::times_power_of_two(along, -exponent)}
                     : detail::AngleParts<T>{detail::times_power_of_two(across, exponent), along}
    );
}

/// Angle at `seen_from` between a point and where the picture shows it; exact, for this one point.
///
///     theta = atan2(|b| |u2 x m|, |u1| |u2|^2 + b (u1.u2)) = atan2(|b| sin psi, |u2| + b cos psi)
///
/// 0 for b = 0 and for v2 = v1. The law of cosines, as the paper has it, says the same and shows
/// nothing of it in float.
/// @param drawn_from v1
/// @param seen_from v2
/// @param point C of the fine model
/// @param offset [length] b, signed, along the ray from v1; by the distance from the facet, which
/// is shorter, the angle would come out too small
/// @return [rad] in [0, pi]; pi where the viewer is at the point or its image, and in between
/// @pre finite numbers, point != drawn_from, offset > -|point - drawn_from|
/// @par Source LOD-sprite technique (Chen et al. 1999), equation 1, in another form
template <typename T>
[[nodiscard]] T sprite_angle_unchecked(
    const glm::vec<3, T>& drawn_from,
    const glm::vec<3, T>& seen_from,
    const glm::vec<3, T>& point,
    T offset
) noexcept {
    FARFIELD_ASSERT(
        detail::check_sprite(drawn_from, seen_from, point, offset) == MetricOutcome::ok
    );
    return offset == T(0) && point != seen_from
               ? T(0)
               : detail::angle(detail::sprite_parts(drawn_from, seen_from, point, offset));
}

/// The same with all input judged.
/// @return the angle with ok or pi_degenerate, or err_nonfinite, err_distance (the point is where
/// the picture was drawn from) or err_behind (its image would be there or behind)
template <typename T>
[[nodiscard]] Measured<T> sprite_angle(
    const glm::vec<3, T>& drawn_from,
    const glm::vec<3, T>& seen_from,
    const glm::vec<3, T>& point,
    T offset
) noexcept {
    const MetricOutcome outcome = detail::check_sprite(drawn_from, seen_from, point, offset);
    if (outcome != MetricOutcome::ok) {
        return {std::numeric_limits<T>::quiet_NaN(), outcome};
    }
    const auto parts = detail::sprite_parts(drawn_from, seen_from, point, offset);
    const bool degenerate = parts.across == T(0) && parts.along == T(0);
    return {
        sprite_angle_unchecked(drawn_from, seen_from, point, offset),
        degenerate ? MetricOutcome::pi_degenerate : MetricOutcome::ok};
}

/// The angle of a point with a turn that is shared: that of one vertex taken for all. **Not a
/// bound**: points nearer than the circle through both eyes and the reference vertex turn more and
/// are under-estimated (the paper states the reverse).
/// @param turn [rad] in [0, pi], `sprite_turn_unchecked` of the reference
/// @param distance [length] > 0 of the point from where it is seen
/// @param offset [length] of the point, signed
/// @return [rad] in [0, pi]
template <typename T>
[[nodiscard]] T shared_sprite_angle_unchecked(T turn, T distance, T offset) noexcept {
    FARFIELD_ASSERT(turn >= T(0) && distance > T(0));
    return detail::angle_of_turn(turn, distance, offset);
}

/// Largest turn of any point of a box: 2 atan(|m| / (2 rho)) with the distance rho of the box from
/// the segment between both eyes. Never too small, rounding included.
/// @param bounds of the vertices
/// @return [rad] in [0, pi]; pi where the segment meets the box
/// @pre finite numbers, the box not empty
/// @par Cost About 150 operations
template <typename T>
[[nodiscard]] T largest_sprite_turn_unchecked(
    const glm::vec<3, T>& drawn_from, const glm::vec<3, T>& seen_from, const Box3<T>& bounds
) noexcept {
    FARFIELD_ASSERT(!is_empty(bounds));
    const glm::vec<3, T> lo = bounds.lo - drawn_from;
    const glm::vec<3, T> hi = bounds.hi - drawn_from;
    const glm::vec<3, T> m = seen_from - drawn_from;
    const glm::vec<3, T> most = glm::max(glm::max(glm::abs(lo), glm::abs(hi)), glm::abs(m));
    const T unit = detail::power_of_two<T>(-detail::exponent_of(detail::largest_component(most)));
    const T distance = detail::segment_distance<T>(m * unit, {lo * unit, hi * unit});
    if (distance == T(0)) {
        return std::numbers::pi_v<T>;
    }
    const auto motion = detail::scaled(m);
    const T length = detail::times_power_of_two(glm::length(motion.direction), motion.exponent);
    const T turn = 2 * std::atan(length * unit / distance / 2);
    return std::min(turn * (1 + 16 * detail::kUnitRoundoff<T>), std::numbers::pi_v<T>);
}

/// Largest angle of a point over all turns up to `turn`: with `largest_sprite_turn_unchecked` a
/// value for all vertices that none exceeds, if `distance` is no more and |offset| no less than
/// theirs.
///
///     theta(turn) while a cos(turn) + b > 0, then asin(|b| / a), then pi
///
/// @param turn [rad] in [0, pi]
/// @param distance [length] a > 0
/// @param offset [length] b, signed
/// @return [rad] in [0, pi], never too small
template <typename T>
[[nodiscard]] T sprite_angle_bound_unchecked(T turn, T distance, T offset) noexcept {
    FARFIELD_ASSERT(turn >= T(0) && distance > T(0));
    constexpr T kUnit = detail::kUnitRoundoff<T>;
    constexpr T kPi = std::numbers::pi_v<T>;
    if (offset == T(0)) {
        return T(0);
    }
    const T unit =
        detail::power_of_two<T>(-detail::exponent_of(std::max(distance, std::abs(offset))));
    const T a = distance * unit;
    const T b = offset * unit;
    const T turning = a * std::cos(turn) + b;
    if (turning > 4 * kUnit * (a + std::abs(b))) {
        // Both terms of the denominator are rounded, and may cancel where b is negative.
        const T along = a + b * std::cos(turn) - 4 * kUnit * (a + std::abs(b));
        const T angle = std::atan2(std::abs(b) * std::sin(turn), along);
        return along <= T(0) ? kPi : std::min(angle * (1 + 16 * kUnit), kPi);
    }
    const T sine = std::abs(b) / a * (1 + 4 * kUnit);
    return sine < T(1) ? std::asin(sine) * (1 + 16 * kUnit) : kPi;
}

/// Root of the mean square of angles, for the paper's criterion. Squares are scaled by the largest
/// angle and summed in double with their errors, so that nothing underflows and many equal terms
/// count as much as few.
/// @param angles [rad] >= 0, finite; none: all zero
/// @return relative error within 8 units of rounding
template <typename T>
[[nodiscard]] AngleSpread<T> angle_spread_unchecked(std::span<const T> angles) noexcept {
    AngleSpread<T> spread;
    for (const T angle : angles) {
        spread.largest = std::max(spread.largest, angle);
    }
    if (spread.largest == T(0)) {
        return spread;
    }
    double sum = 0;
    double lost = 0; // by rounding of the sum
    for (const T angle : angles) {
        const double part = static_cast<double>(angle) / static_cast<double>(spread.largest);
        const double term = part * part - lost;
        const double next = sum + term;
        lost = (next - sum) - term;
        sum = next;
    }
    const double root = std::sqrt(sum / static_cast<double>(angles.size()));
    spread.rms = static_cast<T>(root * static_cast<double>(spread.largest));
    return spread;
}

/// The criterion: whether the root of the mean square is **below** kappa times the angle of a
/// pixel.
/// @param kappa >= 0, 1 in the paper
/// @param pixel_angle [rad] >= 0
/// @par Source LOD-sprite technique, equation 2
template <typename T>
[[nodiscard]] bool is_below_unchecked(std::span<const T> angles, T kappa, T pixel_angle) noexcept {
    return angle_spread_unchecked(angles).rms < kappa * pixel_angle;
}

/// Whether `angle_spread_unchecked` may be asked about these angles.
/// @return ok, err_nonfinite or err_range (a negative angle)
template <typename T>
[[nodiscard]] MetricOutcome check_angles(std::span<const T> angles) noexcept {
    MetricOutcome outcome = MetricOutcome::ok;
    for (const T angle : angles) {
        if (!std::isfinite(angle)) {
            return MetricOutcome::err_nonfinite;
        }
        if (angle < T(0)) {
            outcome = MetricOutcome::err_range;
        }
    }
    return outcome;
}

} // namespace metric

} // namespace farfield
