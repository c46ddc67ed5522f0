#include "forest_path.hpp"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <string>

namespace farfield::scenes {

namespace {

using glm::dvec3;

constexpr int kFrames = 100;
constexpr double kLast = kFrames - 1;

Result<void> check(const ForestOptions& options, double pace_m) {
    if (Result<void> valid = validate(options); !valid) {
        return valid;
    }
    if (!(pace_m > 0.0) || !std::isfinite(pace_m)) {
        return fail(
            ErrorCode::invalid_argument,
            "forest: pace_m is " + std::to_string(pace_m) + ", expected a finite value above 0"
        );
    }
    return {};
}

/// Straight from `begin`, a step a frame, always looking along `look`.
CameraPath straight(const dvec3& begin, const dvec3& step, const dvec3& look) {
    CameraPath path;
    path.frame_count = kFrames;
    for (const double frame : {0.0, kLast}) {
        PathKey key;
        key.frame = frame;
        key.eye = begin + step * frame;
        key.target = key.eye + look;
        path.keys.push_back(key);
    }
    return path;
}

} // namespace

Result<CameraPath> forest_sideways_path(const ForestOptions& options, double pace_m) {
    if (Result<void> valid = check(options, pace_m); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    const double height = options.tree_height_m;
    const dvec3 begin(
        -pace_m * kLast / 2.0, height / 3.0, forest_extent(options) / 2.0 + 1.25 * height
    );
    return straight(begin, {pace_m, 0.0, 0.0}, {0.0, 0.1 * height, -height});
}

Result<CameraPath> forest_zoom_path(const ForestOptions& options, double pace_m) {
    if (Result<void> valid = check(options, pace_m); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    const double height = options.tree_height_m;
    const dvec3 ahead = glm::normalize(dvec3(1.0, 0.0, 1.0));
    const dvec3 above(0.0, 1.35 * height, 0.0); // the tallest trees are 1.1 times as high
    return straight(above - ahead * (pace_m * kLast), ahead * pace_m, ahead * height - above * 0.2);
}

} // namespace farfield::scenes
