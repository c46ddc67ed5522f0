#pragma once

#include "technique/yaw_set.hpp"
#include <farfield/technique/placement_map.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace farfield {

/// What placing images at sites needs to know of all of them.
struct PlacementTask {
    const PlacementOptions& options;
    std::span<const PlacementCell> cells;
    glm::dvec3 origin{0.0};
    YawFrame frame;
    double model_extent = 0.0; ///< [m] longest side of the model
    /// [m] Cells count as so much larger: what the frusta of run time, in float, round.
    double margin = 0.0;
};

/// Images of one site, numbered from 0.
struct SitePlacement {
    std::vector<PlacementRange> ranges;
    std::vector<PlacedImage> images;
    std::vector<std::uint32_t> replaced;
    std::uint64_t views = 0;
    std::uint64_t worst = 0;
    std::uint64_t worst_before = 0;
    double miss = 0.0; ///< sum over images
    /// False: more than the budget stands too near; then the direction and how much it is.
    bool feasible = true;
    double yaw = 0.0;
    std::uint64_t nearby = 0;
};

/// Directions in which a camera sees a box, plane by plane: at some pitch within `max_pitch` it is
/// not wholly outside of the left plane of the window, and so on for the others and the plane
/// through the eye. What is culled by these planes at run time is in no other direction.
/// @param lo, hi of the box, seen from the eye, in the world's axes
[[nodiscard]] YawSet
directions_of(const PlacementTask& task, const glm::dvec3& lo, const glm::dvec3& hi) noexcept;

/// Places images for a box of eyes.
[[nodiscard]] SitePlacement place_site(const PlacementTask& task, const Box3d& eyes);

} // namespace farfield
