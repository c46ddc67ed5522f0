#include "overview.hpp"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace farfield::scenes {

Result<CameraPath> overview_path(const Box3d& bounds, double fov_deg, double down_deg) {
    const auto wrong = [](const char* name, double value, const char* expected) {
        return fail(
            ErrorCode::invalid_argument,
            std::string("overview: ") + name + " is " + std::to_string(value) + ", expected " +
                expected
        );
    };
    if (!(fov_deg > 0.0 && fov_deg <= 170.0)) {
        return wrong("fov_deg", fov_deg, "more than 0, 170 at most");
    }
    if (!(down_deg >= 0.0 && down_deg <= 80.0)) {
        return wrong("down_deg", down_deg, "0 to 80");
    }
    constexpr double kDegree = std::numbers::pi / 180.0;
    constexpr double kFilled = 0.97;
    const double reach = kFilled * std::tan(fov_deg / 2.0 * kDegree);
    const double cosine = std::cos(down_deg * kDegree);
    const double sine = std::sin(down_deg * kDegree);
    const glm::dvec3 half = extent(bounds) / 2.0;
    double distance = 0.0;
    for (const double up : {-half.y, half.y}) {
        for (const double out : {-half.z, half.z}) {
            // Along the view, towards the eye, and across it; both signs of x are the same.
            const double towards = out * cosine + up * sine;
            const double above = up * cosine - out * sine;
            distance = std::max(distance, towards + std::max(half.x, std::abs(above)) / reach);
        }
    }
    CameraPath path;
    path.frame_count = kOverviewFrames;
    PathKey key;
    key.target = center(bounds);
    key.eye = key.target + glm::dvec3(0.0, sine, cosine) * distance;
    path.keys.push_back(key);
    if (Result<void> valid = eval::validate(path); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    return path;
}

} // namespace farfield::scenes
