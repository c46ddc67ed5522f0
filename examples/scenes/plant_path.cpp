#include "plant_path.hpp"

#include "level_walk.hpp"
#include "plant_layout.hpp"
#include "plant_parts.hpp"

#include <glm/vec3.hpp>

#include <array>
#include <utility>

namespace farfield::scenes {

Result<CameraPath> plant_path(const PlantOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    using namespace plant;
    constexpr double kEye = 1.7; // [m]
    constexpr double kUpstairs = kEye + kStorey;
    constexpr double kFlightTop = kFlightFoot - kFlightRun;
    const std::array<glm::dvec3, 12> corners = {
        {{kTankLaneX, kEye, 36.0},
         {kTankLaneX, kEye, kRackZ},
         {kFlightX, kEye, kRackZ},
         {kFlightX, kEye, kFlightFoot},
         {kFlightX, kUpstairs, kFlightTop},
         {kFlightX, kUpstairs, kCorridorZ},
         {-kFlightX, kUpstairs, kCorridorZ},
         {-kFlightX, kUpstairs, kFlightTop},
         {-kFlightX, kEye, kFlightFoot},
         {-kFlightX, kEye, kRackZ},
         {-kFlightX, kEye, 16.0},
         {-34.0, kEye, 13.5}}};
    return level_walk(
        corners,
        {.frames = 400,
         .frames_per_key = 3,
         .corner = 2.5,
         .look = 5.0,
         .sway_deg = 45.0,
         .sways = 6}
    );
}

} // namespace farfield::scenes
