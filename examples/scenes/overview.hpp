#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>
#include <farfield/math/box3.hpp>

namespace farfield::scenes {

/// Frames of an overview.
inline constexpr int kOverviewFrames = 60;

/// An eye at rest that sees a whole box in a square picture: in front of its side of greatest z,
/// looking down at its middle, as near as lets the box fill 97 % of the picture in one direction.
/// @param bounds not empty, finite
/// @param fov_deg of the picture, (0, 170]
/// @param down_deg below the horizontal, [0, 80]
/// @return a valid path of one key; an error naming what is out of range
[[nodiscard]] Result<CameraPath>
overview_path(const Box3d& bounds, double fov_deg = 60.0, double down_deg = 28.0);

} // namespace farfield::scenes
