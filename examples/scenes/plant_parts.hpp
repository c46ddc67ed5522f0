#pragma once

#include "solids.hpp"

#include <glm/vec3.hpp>

#include <vector>

/// Parts that a power plant has many of, each in its own frame: y up, its foot at 0. [m]
namespace farfield::scenes::plant {

/// Of a serpentine of boiler tube, in the plane of x and y: length, height, passes of the tube.
inline constexpr double kPanelLength = 6.0;
inline constexpr double kPanelHeight = 2.16;
inline constexpr int kPanelPasses = 14;

/// Grating that is walked on, its top at 0, from 0 to these along x and z.
inline constexpr double kGratingWidth = 1.0;
inline constexpr double kGratingLength = 2.0;

/// Railing along x from 0 to this.
inline constexpr double kRailingLength = 2.0;

/// A flight of stairs along -z and up.
inline constexpr double kFlightRise = 7.0;
inline constexpr double kFlightRun = 9.8;
inline constexpr double kFlightWidth = 1.6;

/// A storage tank, round its axis at 0.
inline constexpr double kTankRadius = 5.0;
inline constexpr double kTankHeight = 9.0;

/// From `begin` in steps of `step` > 0 to before `end`.
[[nodiscard]] std::vector<double> evenly(double begin, double end, double step);

[[nodiscard]] Solids tube_panel();
[[nodiscard]] Solids grating();
[[nodiscard]] Solids railing();
[[nodiscard]] Solids flight();
/// With a caged ladder on its side of greatest z.
[[nodiscard]] Solids tank(const glm::dvec3& color);
/// Shaft along x.
[[nodiscard]] Solids pump();
/// For two screens, a keyboard and a chair on its side of greatest z.
[[nodiscard]] Solids desk();
/// Its front with buttons and gauges towards +z.
[[nodiscard]] Solids cabinet();
/// A post with a stack of sheds.
[[nodiscard]] Solids insulator();

} // namespace farfield::scenes::plant
