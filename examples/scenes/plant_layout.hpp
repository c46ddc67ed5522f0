#pragma once

/// Where things of the power plant stand that both it and the walk through it have to know. [m]
namespace farfield::scenes::plant {

/// Of the floors of the boiler house, and how many there are above the ground.
inline constexpr double kStorey = 7.0;
inline constexpr int kFloors = 4;

/// The lower flights of stairs go from the ground to the first floor, one on each side, at x = this
/// and -this.
inline constexpr double kFlightX = 13.5;
inline constexpr double kFlightFoot = -17.2; ///< z; the top is `kFlightRun` further north

/// Middle of the corridor along the north side of every floor.
inline constexpr double kCorridorZ = -46.35;

/// Middle of the lane between the legs of the pipe rack.
inline constexpr double kRackZ = 6.0;

/// Middle of the lane between the tanks.
inline constexpr double kTankLaneX = -61.0;

} // namespace farfield::scenes::plant
