#include "pipes_path.hpp"

#include "level_walk.hpp"
#include "pipe_network.hpp"

#include <glm/vec3.hpp>

#include <array>
#include <utility>

namespace farfield::scenes {

Result<CameraPath> pipes_path(const PipesOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    constexpr double kEyeHeight = 1.7; // [m]
    const double side = (pipes_nodes(options) / 2.0 - pipes_aisle(options)) * kPipeSpacing;
    const std::array<glm::dvec3, 6> corners = {
        {{0.0, kEyeHeight, side},
         {side, kEyeHeight, side},
         {side, kEyeHeight, -side},
         {-side, kEyeHeight, -side},
         {-side, kEyeHeight, side},
         {0.0, kEyeHeight, side}}};
    return level_walk(
        corners, {.frames = 300, .frames_per_key = 5, .sway_deg = 50.0, .sways = 3, .closed = true}
    );
}

} // namespace farfield::scenes
