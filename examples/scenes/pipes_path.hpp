#pragma once

#include "pipes.hpp"
#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>

namespace farfield::scenes {

/// Once around the array at head height: 300 frames at an even pace along its four outer aisles,
/// looking ahead and to both sides, neither up nor down; frame 300 would be the first again.
/// @return a valid path; an error naming the option and its value
[[nodiscard]] Result<CameraPath> pipes_path(const PipesOptions& options = {});

} // namespace farfield::scenes
