#include "flat_town_path.hpp"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <string>

namespace farfield::scenes {

Result<CameraPath> flat_town_path(const FlatTownOptions& options, double pace_m) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    if (!(pace_m > 0.0) || !std::isfinite(pace_m)) {
        return fail(
            ErrorCode::invalid_argument,
            "flat: pace_m is " + std::to_string(pace_m) + ", expected a finite value above 0"
        );
    }
    constexpr int kFrames = 120;
    constexpr double kLast = kFrames - 1;
    const glm::dvec3 ahead = glm::normalize(glm::dvec3(1.0, 0.0, 1.0));
    const glm::dvec3 above(0.0, 1.25 * flat_town_height(options), 0.0);
    const glm::dvec3 look = ahead * options.block_m - above * 0.3;
    CameraPath path;
    path.frame_count = kFrames;
    for (const double frame : {0.0, kLast}) {
        PathKey key;
        key.frame = frame;
        key.eye = above + ahead * (pace_m * (frame - kLast / 2.0));
        key.target = key.eye + look;
        path.keys.push_back(key);
    }
    return path;
}

} // namespace farfield::scenes
