#pragma once

#include "flat_town.hpp"
#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>

namespace farfield::scenes {

/// [m a frame] of the diagonal walk: crosses the default town from corner to corner.
inline constexpr double kFlatTownPace = 7.5;

/// The diagonal walk of the flat town: 120 frames straight from the corner of least x and z towards
/// the opposite one, as many metres before the middle as after it, a few metres above the highest
/// roof, looking ahead and a little down.
/// @param pace_m [m] a frame, > 0, finite
/// @return a valid path; an error naming the option and its value
/// @par Source Schaufler and Stürzlinger 1996, section 5.1: the diagonal and the number of frames
[[nodiscard]] Result<CameraPath>
flat_town_path(const FlatTownOptions& options = {}, double pace_m = kFlatTownPace);

} // namespace farfield::scenes
