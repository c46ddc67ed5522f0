#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/camera_path.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/vec3.hpp>

namespace farfield::scenes {

/// A ball around something.
struct Sphere {
    glm::dvec3 middle{0.0};
    double radius = 0.0; ///< [m]
};

/// The ball around the middle of the scene's box that reaches to its farthest vertex. Linear in the
/// vertices of all instances. @pre the scene is not empty
[[nodiscard]] Sphere bounding_sphere(const Scene& scene);

/// A straight way off from a thing that is looked at.
struct DollyOptions {
    double angle_deg = 0.0;     ///< around y from +z towards +x; finite
    double elevation_deg = 0.0; ///< above the horizontal; [-80, 80]
    double nearest = 1.75;      ///< [radii] from the middle, in frame 0; > 0
    double farthest = 14.0;     ///< [radii] in the last frame; >= nearest
};

/// Frames of a dolly. From 1.75 to 14 radii, frames 0, 40, 80 and 120 are at 1.75, 3.5, 7 and 14.
inline constexpr int kDollyFrames = 121;

/// Backs off from the middle of a ball and looks at it: the logarithm of the distance grows evenly
/// from frame to frame. Distances are exact in the first and the last frame and right to 1e-5
/// between them.
/// @return a valid path; an error naming the option and its value, or the radius, which is > 0
/// @par Source Chamberlain et al. 1996, section 4: the distances; their spacing is ours
[[nodiscard]] Result<CameraPath> dolly_path(const Sphere& around, const DollyOptions& options = {});

} // namespace farfield::scenes
