#pragma once

#include <farfield/core/result.hpp>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/ext/matrix_float4x4.hpp>
#include <glm/vec3.hpp>

namespace farfield {

/// Perspective lens as four tangents: the window on the plane at distance 1 before the eye, so
/// that asymmetric, tiled and stereo frusta are all the same thing. `left < right` and
/// `bottom < top`, x to the right, y up.
struct Lens {
    double left = -1.0;
    double right = 1.0;
    double bottom = -1.0;
    double top = 1.0;
    double near_distance = 0.1; ///< [m] > 0
    double far_distance = 1e4;  ///< [m] > near_distance, finite

    friend bool operator==(const Lens&, const Lens&) = default;
};

/// Symmetric lens from a **vertical** field of view. No checks here: `validate` judges the view.
/// @param fov_y [rad] in (0, pi)
/// @param aspect width / height of the image
[[nodiscard]] Lens
perspective_lens(double fov_y, double aspect, double near_distance, double far_distance) noexcept;

/// Who looks where through which lens on how many pixels. Right-handed; the camera looks along
/// its own -z, x is right, y is up.
struct View {
    glm::dvec3 eye{0.0};           ///< world position [m]
    glm::dmat3 camera_to_world{1}; ///< rotation; columns are right, up and backward in the world
    Lens lens;
    int width = 0;  ///< [px] >= 1
    int height = 0; ///< [px] >= 1

    friend bool operator==(const View&, const View&) = default;
};

/// A view at `eye` looking at `target`. Where the direction is parallel to `up`, another up is
/// chosen, the same on every run. @pre eye != target
[[nodiscard]] View look_at(
    const glm::dvec3& eye,
    const glm::dvec3& target,
    const glm::dvec3& up,
    const Lens& lens,
    int width,
    int height
) noexcept;

/// Checks everything that `plan()` and a backend rely on: finite eye, orthonormal rotation (to
/// 1e-6), ordered finite tangents, 0 < near < far, at least one pixel and at most 16384 a side.
/// The message names the field and its value.
[[nodiscard]] Result<void> validate(const View& view);

/// Pixels per unit tangent at the image centre, vertically: height / (top - bottom). The `f` of
/// the error metrics.
[[nodiscard]] double focal_length_px(const View& view) noexcept;

/// Clip matrix of a lens with reverse-z: depth is 1 at the near and 0 at the far plane, x and y in
/// [-1, 1], y up.
[[nodiscard]] glm::mat4 projection_matrix(const Lens& lens) noexcept;

/// Lens of a rectangle of the view's own pixel grid. The rectangle may reach beyond the image.
/// Coordinates [px] from the lower left corner, y up.
[[nodiscard]] Lens sub_lens(const View& view, double x0, double y0, double x1, double y1) noexcept;

/// How the viewer moves; estimated from past frames only. All in world units and seconds.
struct Motion {
    glm::dvec3 velocity{0.0};        ///< [m/s]
    glm::dvec3 acceleration{0.0};    ///< [m/s^2]
    double frame_seconds = 1.0 / 60; ///< [s] time from one frame to the next, > 0

    friend bool operator==(const Motion&, const Motion&) = default;
};

/// Motion from the last three eye positions by backward differences: exact for constant
/// acceleration.
/// @param now eye of this frame, @param before of the one before, @param earlier of the one
/// before that
[[nodiscard]] Motion estimate_motion(
    const glm::dvec3& now, const glm::dvec3& before, const glm::dvec3& earlier, double frame_seconds
) noexcept;

} // namespace farfield
