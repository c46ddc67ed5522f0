#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::scenes {

/// A coal-fired power plant, crowded in places and empty in others.
struct PlantOptions {
    int panels = 50;           ///< tube panels in each of the bundles; [1, 120]
    std::uint64_t seed = 1999; ///< of pipes, colours and the coal
};

/// Checks the range above; the message names the option and its value.
[[nodiscard]] Result<void> validate(const PlantOptions& options);

/// Builds the plant: y up, the ground at 0, 2 million triangles by default, 12,860 more or fewer
/// with each panel. A boiler house of four floors of gratings around a furnace, whose walls are
/// tubes and which hangs full of bundles of tube panels; stairs, railings and a control room; a
/// turbine hall open to the south; a pipe rack along both, tanks, pumps, heat exchangers without
/// their shells, a filter house, coal with its conveyor, a switchyard, a chimney and cooling
/// towers. Repeated parts of up to 6000 triangles are instances and whole; what is there once is in
/// splittable meshes, of which the ground is mesh 0.
/// @return the scene; an error naming the option and its value
/// @par Source Aliaga and Lastra 1999: that a power plant is a model of the kind; what stands in it
/// is ours
[[nodiscard]] Result<Scene> make_plant(const PlantOptions& options = {});

} // namespace farfield::scenes
