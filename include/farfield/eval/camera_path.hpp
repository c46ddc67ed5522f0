#pragma once

#include <farfield/core/result.hpp>
#include <farfield/math/box3.hpp>

#include <glm/vec3.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace farfield {

/// Control point of a path.
struct PathKey {
    double frame = 0.0;
    glm::dvec3 eye{0.0};          ///< [m] world
    glm::dvec3 target{0.0};       ///< [m] world; what the camera looks at
    glm::dvec3 up{0.0, 1.0, 0.0}; ///< not zero; need not be unit or at a right angle

    friend bool operator==(const PathKey&, const PathKey&) = default;
};

/// Where the camera is, and how it looks. Goes into `look_at`.
struct PathPose {
    glm::dvec3 eye{0.0};
    glm::dvec3 target{0.0}; ///< never the eye
    glm::dvec3 up{0.0, 1.0, 0.0};

    friend bool operator==(const PathPose&, const PathPose&) = default;
};

/// A walk: uniform cubic B-splines through space and time, one each for eye, target and up.
///
/// Keys are control points: the curve passes near them, with continuous velocity and acceleration
/// where keys are evenly spaced in frames. At both ends the first and last but one keys are
/// reflected (P[-1] = 2 P[0] - P[1]), so the walk begins on its first key and ends on its last.
/// Two keys give a straight line, one key stands still.
///
/// Frame i is one pose whatever `frame_count` says: fewer frames walk a shorter way, never a faster
/// one, because speed-up depends on metres a frame. @see whole_path_frame
struct CameraPath {
    int frame_count = 0;       ///< frames 0 .. frame_count - 1 are walked
    std::vector<PathKey> keys; ///< ascending in frame

    friend bool operator==(const CameraPath&, const CameraPath&) = default;
};

/// How `default_path` walks around a model.
struct DefaultPathOptions {
    int frames = 1200;                           ///< of the whole walk, [2, 10000000]
    std::optional<double> step_m = std::nullopt; ///< [m] a frame, (0, R / 20]; none: R / 500
    glm::dvec3 up{0.0, 1.0, 0.0};                ///< not zero
};

namespace eval {

/// Checks that there are 1 to 10,000,000 frames and a key at least; that frames of keys ascend and,
/// unless there is one key, reach from 0 or before to the last frame or beyond; that everything is
/// finite, no eye is its target and no up is zero. The message names key, field and value.
[[nodiscard]] Result<void> validate(const CameraPath& path);

/// Pose at a frame, fractions allowed; before the first and after the last key it stands still.
/// Where the curves of eye and target meet, the direction is that of the key before. Logarithmic in
/// the number of keys. @pre validate(path)
[[nodiscard]] PathPose pose_at(const CameraPath& path, double frame) noexcept;

/// The frame to show as number `index` of `count` when the **whole** path is to be seen in `count`
/// frames: evenly spaced, the first at frame 0 and the last at the path's last one. A walk made so
/// is faster than the path; its times must not be compared with those of the path.
/// @pre 0 <= index < count
[[nodiscard]] double whole_path_frame(const CameraPath& path, int index, int count) noexcept;

/// Reads `{"frame_count": 600, "keys": [{"frame": 0, "eye": [x, y, z], "target": [x, y, z],
/// "up": [x, y, z]}, ...]}`. All of it has to be there and nothing else may be.
/// @param name stands for the text in messages
/// @return the path, which is valid; an error that names key and value, "walk.json: keys[2].eye[1]
/// is null, expected a number"
[[nodiscard]] Result<CameraPath> parse_camera_path(std::string_view text, std::string_view name);

/// `parse_camera_path` of a file.
[[nodiscard]] Result<CameraPath> load_camera_path(const std::filesystem::path& file);

/// The text that `parse_camera_path` reads back exactly.
[[nodiscard]] std::string to_json(const CameraPath& path);

/// Writes `to_json`; an existing file is replaced at once or not at all.
[[nodiscard]] Result<void> save(const CameraPath& path, const std::filesystem::path& file);

/// The walk that a model without one gets, R being half the diagonal of its box: an arc at 1.15 R
/// from the middle, looking at it, the eye 6 % of R above the ground (the lower side of the box);
/// for the last 40 % of the frames straight in, though never further than R: a longer walk goes
/// further around instead. Each frame goes one step, save at the corner, which the spline cuts.
/// @return an error where the box is empty, not finite or a point, or an option out of range
[[nodiscard]] Result<CameraPath>
default_path(const Box3d& bounds, const DefaultPathOptions& options = {});

/// The walk over a height field, 460 frames: above the middle, looking straight down (60); rolling
/// over until the horizon shows (60); 270 degrees around (240); in to the centre (100). The eye
/// stays above the box.
/// @param bounds box of the terrain, y up
/// @return an error where the box is empty, not finite or has no horizontal extent
[[nodiscard]] Result<CameraPath> height_field_path(const Box3d& bounds);

} // namespace eval
} // namespace farfield
