#pragma once

#include <farfield/eval/camera_path.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <span>

namespace farfield::scenes {

/// How a walk goes along its corners.
struct LevelWalkOptions {
    int frames = 300;
    int frames_per_key = 5; ///< divides `frames` where the walk is closed, `frames` - 1 where not
    double corner = 3.0;    ///< [m] of a way before and after a corner, where it is rounded
    double look = 8.0;      ///< [m] of the way behind and ahead, whose chord the eye looks along
    double sway_deg = 50.0; ///< to both sides of it
    int sways = 3;          ///< on the way
    bool closed = false;    ///< ends where it begins; begin in the middle of a straight line then
};

/// A walk at an even pace along corners, their heights included, that looks around level: neither
/// up nor down, and upright.
/// @param corners of the eye's way [m]; no two neighbours above each other; of a closed walk the
/// last is the first
[[nodiscard]] CameraPath
level_walk(std::span<const glm::dvec3> corners, const LevelWalkOptions& options);

} // namespace farfield::scenes
