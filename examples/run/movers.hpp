#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/ext/matrix_double4x3.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace farfield::run {

/// A balloon that goes round in a level circle.
struct Mover {
    ItemId item = kNone<ItemId>;
    glm::dvec3 middle{0.0}; ///< of its circle [m]
    glm::dvec3 across{0.0}; ///< two radii at right angles [m]
    glm::dvec3 along{0.0};
    glm::dvec3 up{0.0, 1.0, 0.0}; ///< unit
    double phase = 0.0;           ///< [rad] at frame 0
    double scale = 1.0;           ///< [m] radius of the balloon

    /// Where it is: the same for the same frame.
    [[nodiscard]] glm::dmat4x3 object_to_world(int frame) const noexcept;
};

/// Adds balloons to a scene, among what is there: circles with middles all over it, within its
/// height, of which one takes 300 frames. Where they are at frame 0 is where they are made.
/// @param count 0 to 10000 @return an error that names the value
[[nodiscard]] Result<std::vector<Mover>> add_movers(Scene& scene, int count);

} // namespace farfield::run
