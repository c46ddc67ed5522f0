#pragma once

#include "forest.hpp"
#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>

namespace farfield::scenes {

/// [m a frame] of the way along the front: passes the whole side of the default forest.
inline constexpr double kForestPace = 0.6;
/// [m a frame] of the way in: begins at the corner of the default forest.
inline constexpr double kForestZoomPace = 0.42;

/// Sideways in front of the forest: 100 frames along its side of greatest z, one and a quarter tree
/// heights away from it, at a third of their height, looking at it at a right angle and a little
/// up.
/// @param pace_m [m] a frame, > 0, finite
/// @return a valid path; an error naming the option and its value
/// @par Source Schaufler and Stürzlinger 1996, section 5.2: the motion and the number of frames
[[nodiscard]] Result<CameraPath>
forest_sideways_path(const ForestOptions& options = {}, double pace_m = kForestPace);

/// In from the corner of least x and z to the middle of the forest: 100 frames straight and level,
/// a little above the tree tops, looking ahead and down into them.
/// @param pace_m [m] a frame, > 0, finite
/// @return a valid path; an error naming the option and its value
/// @par Source Schaufler and Stürzlinger 1996, section 5.2: the motion and the number of frames
[[nodiscard]] Result<CameraPath>
forest_zoom_path(const ForestOptions& options = {}, double pace_m = kForestZoomPace);

} // namespace farfield::scenes
