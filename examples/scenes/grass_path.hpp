#pragma once

#include "grass.hpp"
#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>

namespace farfield::scenes {

/// Low over the field: 120 frames straight along -z at an eye height of 1.7 m, looking 10 degrees
/// down, from a twentieth of the field's side inside its rim over half of it.
/// @return a valid path; an error naming the option and its value
[[nodiscard]] Result<CameraPath> grass_flight(const GrassOptions& options = {});

/// Away from the field, 10 degrees above the horizontal: the dolly from 1 to so many radii (half
/// the diagonal of the field) from its middle.
/// @param farthest [radii] [1, 1000]
/// @return a valid path; an error naming the option and its value
[[nodiscard]] Result<CameraPath> grass_dolly(const GrassOptions& options, double farthest);

} // namespace farfield::scenes
