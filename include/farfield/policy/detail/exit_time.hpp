#pragma once

#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/safety_zone.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield {

/// What is certain of a viewer's future motion.
template <typename T>
struct MotionBound {
    T max_acceleration = 0;                           ///< [length/s^2] >= 0
    T max_speed = std::numeric_limits<T>::infinity(); ///< [length/s] >= the present speed
    /// [s] >= 0; where the engine moves in steps `velocity += a dt; position += velocity dt`, which
    /// reach farther than continuous motion, the length of a step; 0: continuous motion.
    T step_seconds = 0;
};

/// When a viewer who is in a zone leaves it. [s], infinity: never.
namespace policy::detail {

/// `first_passage` for gap > 0, a != 0, and numbers whose squares neither overflow nor vanish.
template <typename T>
[[nodiscard]] T accelerated_passage(T gap, T v, T a) noexcept {
    constexpr T kNever = std::numeric_limits<T>::infinity();
    const T discriminant = v * v + 2 * a * gap;
    if (v > T(0)) {
        return discriminant >= T(0) ? 2 * gap / (v + std::sqrt(discriminant)) : kNever;
    }
    return a > T(0) ? (std::sqrt(discriminant) - v) / a : kNever;
}

/// First t >= 0 at which v t + a t^2 / 2 reaches `gap` going outwards. Touching counts, moving
/// along does not. @pre gap >= 0
template <typename T>
[[nodiscard]] T first_passage(T gap, T v, T a) noexcept {
    namespace scale = metric::detail;
    constexpr T kNever = std::numeric_limits<T>::infinity();
    if (gap == T(0)) {
        if (v > T(0) || (v == T(0) && a > T(0))) {
            return T(0);
        }
        return a > T(0) ? -2 * (v / a) : kNever;
    }
    if (a == T(0)) {
        return v > T(0) ? gap / v : kNever;
    }
    // Digits are lost outside this range.
    constexpr T kLeast = std::numeric_limits<T>::min() / std::numeric_limits<T>::epsilon();
    const T size = v * v + 2 * std::abs(a) * gap;
    if (size > kLeast && size < 1 / kLeast) {
        return accelerated_passage(gap, v, a);
    }
    // Lengths in units of 2^length and times in units of 2^time: gap about 1, v and a at most about
    // 1, and one of them about 1.
    const int length = scale::exponent_of(gap);
    const int time = std::min(length - scale::exponent_of(v), (length - scale::exponent_of(a)) / 2);
    const T scaled_time = accelerated_passage(
        scale::times_power_of_two(gap, -length),
        scale::times_power_of_two(v, time - length),
        scale::times_power_of_two(a, 2 * time - length)
    );
    return scale::times_power_of_two(scaled_time, time);
}

/// `first_passage` for the worst motion that the bound allows.
/// @param v [length/s] speed towards the boundary, negative where it is away from it
template <typename T>
[[nodiscard]] T first_worst_passage(T gap, T v, const MotionBound<T>& bound) noexcept {
    const T a = bound.max_acceleration;
    if (!std::isfinite(bound.max_speed)) {
        // Steps reach k v dt + a dt^2 k (k + 1) / 2: continuous motion with this head start.
        return first_passage(gap, v + a * bound.step_seconds / 2, a);
    }
    // With the speed limited inside a step, half a step's gain is too little where the limit is
    // reached; a whole one is enough.
    const T start = std::min(v + a * bound.step_seconds, std::max(v, bound.max_speed));
    if (a == T(0)) {
        return first_passage(gap, start, a);
    }
    const T full_speed_seconds = (bound.max_speed - start) / a;
    const T full_speed_gap = full_speed_seconds * ((bound.max_speed + start) / 2);
    return gap <= full_speed_gap ? first_passage(gap, start, a)
                                 : full_speed_seconds + (gap - full_speed_gap) / bound.max_speed;
}

/// The least of `passage(gap, axis, outwards)` over the six faces; `outwards` is 1 or -1.
template <typename T, typename Passage>
[[nodiscard]] T first_of_faces(
    const Box3<T>& zone, const glm::vec<3, T>& position, const Passage& passage
) noexcept {
    T first = std::numeric_limits<T>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
        first = std::min(first, passage(zone.hi[axis] - position[axis], axis, T(1)));
        first = std::min(first, passage(position[axis] - zone.lo[axis], axis, T(-1)));
    }
    return first;
}

/// Exit from a ball in straight, uniform motion. @pre the position is in the ball
template <typename T>
[[nodiscard]] T straight_exit(
    const Ball<T>& zone, const glm::vec<3, T>& position, const glm::vec<3, T>& velocity
) noexcept {
    namespace scale = metric::detail;
    const auto v = scale::scaled(velocity);
    const T speed_sq = glm::dot(v.direction, v.direction);
    if (speed_sq == T(0)) {
        return std::numeric_limits<T>::infinity();
    }
    const int exponent = scale::exponent_of(zone.radius);
    const T unit = scale::power_of_two<T>(-exponent);
    const glm::vec<3, T> w = (position - zone.center) * unit;
    const T radius = zone.radius * unit;
    const T center_distance = glm::length(w);
    const T outwards = glm::dot(w, v.direction);
    const T power = std::max((radius - center_distance) * (radius + center_distance), T(0));
    const T root = std::sqrt(outwards * outwards + speed_sq * power);
    const T time = outwards > T(0) ? power / (root + outwards) : (root - outwards) / speed_sq;
    return scale::times_power_of_two(time, exponent - v.exponent);
}

} // namespace policy::detail

} // namespace farfield
