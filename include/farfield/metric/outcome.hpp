#pragma once

#include <cstdint>

namespace farfield {

/// What became of a measurement. The checked functions of `metric` and the life span of `policy`
/// test their input in the order of this list and report the first that applies.
enum class MetricOutcome : std::uint8_t {
    ok,            ///< the value holds
    err_nonfinite, ///< a NaN, an infinity, or a coordinate so large that differences overflow
    err_box,       ///< lo > hi on an axis
    err_normal,    ///< the normal of the image plane is zero
    err_v0_plane,  ///< the viewpoint of the image lies in its plane
    err_behind,    ///< a point lies beside or behind the image's viewpoint: nothing projects it
    err_eps,       ///< a negative angle as error bound
    err_distance,  ///< a distance that must be positive is not
    err_fov,       ///< field of view outside (0, pi), or an image without pixels
    err_range,     ///< a negative number of pixels, angle or weight, or a part above its whole
    err_dt,        ///< the time between frames is not positive
    err_bound,     ///< a negative bound of acceleration, or more speed than the bound of speed
    err_zone,      ///< a ball with negative radius
    pi_inside,     ///< legal, angle pi: the viewer is in the box
    pi_backface,   ///< legal, angle pi: the viewer is in or behind the image plane
    pi_degenerate, ///< legal, angle pi: the viewer is at the point or at its image
    pi_behind,     ///< legal, size infinite: a corner lies beside or behind the eye
};

/// A value and what became of it. Where `outcome` is an `err_`, the value is a NaN; where it is a
/// `pi_`, the value is pi, or infinity if it is no angle, and the image must not be shown.
template <typename T>
struct Measured {
    T value;
    MetricOutcome outcome = MetricOutcome::ok;

    friend bool operator==(const Measured&, const Measured&) = default;
};

/// True for the outcomes that reject the input.
[[nodiscard]] constexpr bool is_error(MetricOutcome outcome) noexcept {
    return outcome >= MetricOutcome::err_nonfinite && outcome <= MetricOutcome::err_zone;
}

} // namespace farfield
