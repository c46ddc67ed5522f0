#pragma once

#include "plant.hpp"
#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>

namespace farfield::scenes {

/// Through the plant at head height: 400 frames at an even pace between the tanks, below the pipe
/// rack, into the boiler house, up to its first floor, around the furnace, through the control
/// room, down and out again, looking ahead and to both sides, neither up nor down.
/// @return a valid path; an error naming the option and its value
[[nodiscard]] Result<CameraPath> plant_path(const PlantOptions& options = {});

} // namespace farfield::scenes
