#include "grass_path.hpp"

#include "dolly.hpp"

#include <glm/vec3.hpp>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

constexpr double kDownDeg = 10.0;

} // namespace

Result<CameraPath> grass_flight(const GrassOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    constexpr int kFrames = 120;
    constexpr double kEyeHeight = 1.7; // [m]
    constexpr double kLast = kFrames - 1;
    const glm::dvec3 ahead(0.0, -std::tan(kDownDeg * std::numbers::pi / 180.0), -1.0);
    CameraPath path;
    path.frame_count = kFrames;
    for (const double frame : {0.0, kLast}) {
        PathKey key;
        key.frame = frame;
        key.eye = {0.0, kEyeHeight, options.field_m * (0.45 - 0.5 * frame / kLast)};
        key.target = key.eye + ahead;
        path.keys.push_back(key);
    }
    return path;
}

Result<CameraPath> grass_dolly(const GrassOptions& options, double farthest) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    if (!(farthest >= 1.0 && farthest <= 1000.0)) {
        return fail(
            ErrorCode::invalid_argument,
            "grass: distance is " + std::to_string(farthest) + ", expected 1 to 1000 radii"
        );
    }
    return dolly_path(
        {glm::dvec3(0.0), options.field_m * std::sqrt(0.5)},
        {.elevation_deg = kDownDeg, .nearest = 1.0, .farthest = farthest}
    );
}

} // namespace farfield::scenes
