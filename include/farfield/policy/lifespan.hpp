#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/scale.hpp>
#include <farfield/metric/outcome.hpp>
#include <farfield/metric/safety_zone.hpp>
#include <farfield/policy/detail/exit_time.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace farfield {

/// How frames are counted.
template <typename T>
struct FrameCount {
    T frame_seconds = T(1) / 60;           ///< [s] > 0
    std::uint32_t max_frames = 1'000'000U; ///< longest life span worth distinguishing
};

/// Life span and what became of it: ok, or an error with 0 frames.
template <typename T>
struct Lifespan {
    T exit_seconds = 0; ///< [s] when the viewer first leaves the zone; infinity: never; 0: outside
    std::uint32_t frames = 0; ///< frames in the zone in a row, the current one included
    MetricOutcome outcome = MetricOutcome::ok;
};

/// Life span of an image: for how many frames the viewer stays in the zone where the image is
/// valid, a box or a ball. Zones of several images are intersected as boxes
/// (`farfield::intersect`); an empty zone is legal and its life span is 0.
///
/// Functions come in pairs, as in `metric`: the plain one judges its input, the `_unchecked` one is
/// for the frame loop.
namespace policy {

namespace detail {

/// @param shortened 1, or slightly less where the exit time itself is a bound that rounding must
/// not exceed
template <typename T>
[[nodiscard]] Lifespan<T>
count_frames(T exit_seconds, const FrameCount<T>& count, T shortened = 1) noexcept {
    FARFIELD_ASSERT(count.frame_seconds > T(0));
    // Compared as numbers before the cast: the quotient may be infinite.
    const T frames = exit_seconds / count.frame_seconds * shortened;
    if (!(frames < static_cast<T>(count.max_frames))) {
        return {exit_seconds, count.max_frames};
    }
    return {exit_seconds, std::min(count.max_frames, 1U + static_cast<std::uint32_t>(frames))};
}

template <typename T>
[[nodiscard]] T shortened(const MotionBound<T>& bound) noexcept {
    return bound.step_seconds > T(0) ? 1 - 8 * metric::detail::kUnitRoundoff<T> : T(1);
}

template <typename T>
[[nodiscard]] MetricOutcome check_motion(
    const glm::vec<3, T>& position, const glm::vec<3, T>& velocity, const FrameCount<T>& count
) noexcept {
    if (!metric::detail::is_measurable(position) || !metric::detail::is_measurable(velocity) ||
        !std::isfinite(count.frame_seconds)) {
        return MetricOutcome::err_nonfinite;
    }
    return count.frame_seconds > T(0) ? MetricOutcome::ok : MetricOutcome::err_dt;
}

template <typename T>
[[nodiscard]] MetricOutcome
check_bound(const glm::vec<3, T>& velocity, const MotionBound<T>& bound) noexcept {
    if (!std::isfinite(bound.max_acceleration) || std::isnan(bound.max_speed) ||
        !std::isfinite(bound.step_seconds)) {
        return MetricOutcome::err_nonfinite;
    }
    if (bound.step_seconds < T(0)) {
        return MetricOutcome::err_dt;
    }
    // A speed that equals the bound may have been rounded up.
    const T most = bound.max_speed * (1 + 4 * metric::detail::kUnitRoundoff<T>);
    const bool holds = bound.max_acceleration >= T(0) && metric::detail::length(velocity) <= most;
    return holds ? MetricOutcome::ok : MetricOutcome::err_bound;
}

template <typename T>
[[nodiscard]] MetricOutcome check_zone(const Box3<T>& zone) noexcept {
    const bool measurable =
        metric::detail::is_measurable(zone.lo) && metric::detail::is_measurable(zone.hi);
    return measurable ? MetricOutcome::ok : MetricOutcome::err_nonfinite;
}

template <typename T>
[[nodiscard]] MetricOutcome check_zone(const Ball<T>& zone) noexcept {
    if (!metric::detail::is_measurable(zone.center) ||
        !metric::detail::is_measurable(zone.radius)) {
        return MetricOutcome::err_nonfinite;
    }
    return zone.radius < T(0) ? MetricOutcome::err_zone : MetricOutcome::ok;
}

/// The first outcome, in the order of `MetricOutcome`, that is not ok.
template <typename... Outcomes>
[[nodiscard]] MetricOutcome first_error(Outcomes... outcomes) noexcept {
    MetricOutcome first = MetricOutcome::ok;
    ((first = first == MetricOutcome::ok || (outcomes != MetricOutcome::ok && outcomes < first)
                  ? outcomes
                  : first),
     ...);
    return first;
}

template <typename T>
[[nodiscard]] Lifespan<T> rejected(MetricOutcome outcome) noexcept {
    return {std::numeric_limits<T>::quiet_NaN(), 0, outcome};
}

} // namespace detail

/// Life span in a box if acceleration stays what it is: an estimate, **not conservative**.
/// N = min(max_frames, 1 + floor(t_exit / frame_seconds)); 0 where the viewer is outside now. A
/// viewer on the boundary who moves outwards has one frame; a zone that is touched is left.
/// @param acceleration zero for uniform motion
/// @pre all finite, frame_seconds > 0
/// @par Source Shade et al. 1996, section 3
template <typename T>
[[nodiscard]] Lifespan<T> extrapolated_lifespan_unchecked(
    const Box3<T>& zone,
    const glm::vec<3, T>& position,
    const glm::vec<3, T>& velocity,
    const glm::vec<3, T>& acceleration,
    const FrameCount<T>& count
) noexcept {
    if (!contains(zone, position)) {
        return {};
    }
    const T exit = detail::first_of_faces(zone, position, [&](T gap, int axis, T outwards) {
        return detail::first_passage(gap, outwards * velocity[axis], outwards * acceleration[axis]);
    });
    return detail::count_frames(exit, count);
}

/// Life span in a ball in straight, uniform motion: an estimate, **not conservative**.
/// @return as for a box
/// @pre all finite, frame_seconds > 0, radius >= 0
template <typename T>
[[nodiscard]] Lifespan<T> extrapolated_lifespan_unchecked(
    const Ball<T>& zone,
    const glm::vec<3, T>& position,
    const glm::vec<3, T>& velocity,
    const FrameCount<T>& count
) noexcept {
    if (!contains(zone, position)) {
        return {};
    }
    return detail::count_frames(detail::straight_exit(zone, position, velocity), count);
}

/// Guaranteed life span in a box: no motion within the bound leaves it earlier. Exact worst case,
/// except that with both a speed limit and steps it may be up to half a step's gain too short.
/// @return as `extrapolated_lifespan_unchecked`
/// @pre all finite (max_speed may be infinite), frame_seconds > 0, max_acceleration >= 0, speed <=
/// max_speed
template <typename T>
[[nodiscard]] Lifespan<T> guaranteed_lifespan_unchecked(
    const Box3<T>& zone,
    const glm::vec<3, T>& position,
    const glm::vec<3, T>& velocity,
    const MotionBound<T>& bound,
    const FrameCount<T>& count
) noexcept {
    FARFIELD_ASSERT(detail::check_bound(velocity, bound) == MetricOutcome::ok);
    if (!contains(zone, position)) {
        return {};
    }
    const T exit = detail::first_of_faces(zone, position, [&](T gap, int axis, T outwards) {
        return detail::first_worst_passage(gap, outwards * velocity[axis], bound);
    });
    return detail::count_frames(exit, count, detail::shortened(bound));
}

/// Guaranteed life span in a ball, as if all speed were directed straight outwards: exact at the
/// centre and for such motion, else too short.
/// @return as `extrapolated_lifespan_unchecked`
/// @pre as for a box, radius >= 0
template <typename T>
[[nodiscard]] Lifespan<T> guaranteed_lifespan_unchecked(
    const Ball<T>& zone,
    const glm::vec<3, T>& position,
    const glm::vec<3, T>& velocity,
    const MotionBound<T>& bound,
    const FrameCount<T>& count
) noexcept {
    FARFIELD_ASSERT(detail::check_bound(velocity, bound) == MetricOutcome::ok);
    if (!contains(zone, position)) {
        return {};
    }
    const T gap = zone.radius - metric::detail::length(position - zone.center);
    const T exit = detail::first_worst_passage(gap, metric::detail::length(velocity), bound);
    return detail::count_frames(exit, count, detail::shortened(bound));
}

/// `extrapolated_lifespan_unchecked` with all input judged.
/// @return the life span with ok, or 0 frames with err_nonfinite or err_dt
template <typename T>
[[nodiscard]] Lifespan<T> extrapolated_lifespan(
    const Box3<T>& zone,
    const glm::vec<3, T>& position,
    const glm::vec<3, T>& velocity,
    const glm::vec<3, T>& acceleration,
    const FrameCount<T>& count
) noexcept {
    const MetricOutcome outcome = detail::first_error(
        detail::check_zone(zone),
        detail::check_motion(position, velocity, count),
        metric::detail::is_measurable(acceleration) ? MetricOutcome::ok
                                                    : MetricOutcome::err_nonfinite
    );
    return outcome == MetricOutcome::ok
               ? extrapolated_lifespan_unchecked(zone, position, velocity, acceleration, count)
               : detail::rejected<T>(outcome);
}

/// The same in a ball, in straight, uniform motion.
/// @return the life span with ok, or 0 frames with err_nonfinite, err_dt or err_zone
template <typename T>
[[nodiscard]] Lifespan<T> extrapolated_lifespan(
    const Ball<T>& zone,
    const glm::vec<3, T>& position,
    const glm::vec<3, T>& velocity,
    const FrameCount<T>& count
) noexcept {
    const MetricOutcome outcome = detail::first_error(
        detail::check_zone(zone), detail::check_motion(position, velocity, count)
    );
    return outcome == MetricOutcome::ok
               ? extrapolated_lifespan_unchecked(zone, position, velocity, count)
               : detail::rejected<T>(outcome);
}

/// `guaranteed_lifespan_unchecked` with all input judged.
/// @param zone a `Box3<T>` or a `Ball<T>`
/// @return the life span with ok, or 0 frames with err_nonfinite, err_dt, err_bound or err_zone
template <typename T, template <typename> class Zone>
[[nodiscard]] Lifespan<T> guaranteed_lifespan(
    const Zone<T>& zone,
    const glm::vec<3, T>& position,
    const glm::vec<3, T>& velocity,
    const MotionBound<T>& bound,
    const FrameCount<T>& count
) noexcept {
    const MetricOutcome outcome = detail::first_error(
        detail::check_zone(zone),
        detail::check_motion(position, velocity, count),
        detail::check_bound(velocity, bound)
    );
    return outcome == MetricOutcome::ok
               ? guaranteed_lifespan_unchecked(zone, position, velocity, bound, count)
               : detail::rejected<T>(outcome);
}

/// Life span of what a test says is valid, for a viewer who goes on with a constant acceleration:
/// found by doubling the number of frames until the test fails, and halving the last step until the
/// frame is found. Right where the test fails for good once it fails, as errors of images do on a
/// way that does not turn back; else the number of some frame before which it holds.
/// @param is_valid called with eyes; must hold for `position`
/// @return [frame] in a row, the current one included; at most `count.max_frames`
/// @par Cost at most 2 log2(life) + 2 calls
/// @par Source the life span of Shade et al. 1996, section 3.2, with the error itself in place of
/// the zone
template <typename T, typename IsValid>
[[nodiscard]] std::uint32_t extrapolated_lifespan_where(
    const IsValid& is_valid,
    const glm::vec<3, T>& position,
    const glm::vec<3, T>& velocity,
    const glm::vec<3, T>& acceleration,
    const FrameCount<T>& count
) noexcept {
    FARFIELD_ASSERT(count.frame_seconds > T(0) && count.max_frames >= 1);
    const auto holds = [&](std::uint32_t frame) {
        const T time = static_cast<T>(frame) * count.frame_seconds;
        return is_valid(position + (velocity + acceleration * (time / T(2))) * time);
    };
    const glm::vec<3, T> none(T(0));
    if (velocity == none && acceleration == none) {
        return count.max_frames;
    }
    std::uint32_t good = 0; // frame 0 is the current one
    std::uint32_t bad = 1;
    while (bad < count.max_frames && holds(bad)) {
        good = bad;
        bad = bad > count.max_frames / 2 ? count.max_frames : bad * 2;
    }
    while (bad - good > 1) {
        const std::uint32_t middle = good + (bad - good) / 2;
        if (holds(middle)) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    return good + 1;
}

} // namespace policy

} // namespace farfield
