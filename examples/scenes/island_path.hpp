#pragma once

#include "island.hpp"
#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>

namespace farfield::scenes {

/// The canonical walk of the island, 1200 frames, with R the radius of the shore and steps of
/// R / 500 on average (0.8 m; 0.5 m at the start, 1.1 m on the way in, 0.4 m at the end):
/// - 720 frames along 63 degrees of a circle of 1.15 R, 25 m up, looking at the middle;
/// - 380 frames inwards, rising to the tops of the trees;
/// - 100 frames that come to the centre while the camera turns by 120 degrees.
/// Its keys are at least 1.05 tree heights above the ground.
/// @return a valid path; the error of `validate(options)`
[[nodiscard]] Result<CameraPath> island_path(const IslandOptions& options = {});

} // namespace farfield::scenes
