#pragma once

#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// Scenes and walks of the technique tests. Coordinates of objects are multiples of 1/16 m and the
/// lens is four plain numbers, so that moving a scene far away is exact and plans do not hang on
/// the mathematics library.
namespace farfield::support {

struct ForestOptions {
    std::size_t trees = 100;
    double radius = 200.0; ///< [m] of the disc that they stand on
    std::uint64_t primitives = 20'000;
    std::uint32_t ground_cells = 0; ///< a side of the square ground, two triangles each; 0: none
    std::uint64_t seed = 1;
    glm::dvec3 offset{0.0}; ///< of everything. [m]
    float inflation = 0.17F;
};

/// Trees of 2 to 10 m on a disc, and perhaps a ground, which is the last object.
struct Forest {
    std::vector<Object> objects;
    std::vector<Box3d> ground; ///< box of each triangle
    Hierarchy hierarchy;
};

[[nodiscard]] Forest make_forest(const ForestOptions& options);

/// `count` boxes of 4 m in a row along x, 16 m apart, the first around `offset`; a balanced tree
/// with planes half way between them. Made by hand: no builder is involved. @pre a power of two
[[nodiscard]] Hierarchy make_row(std::uint32_t count, const glm::dvec3& offset);

/// One frame of a walk.
struct Step {
    View view;
    Motion motion;
};

/// 90 degrees wide, 4 : 3.
[[nodiscard]] Lens test_lens();

/// At `eye`, looking at `target`, 640 x 480.
[[nodiscard]] View view_at(const glm::dvec3& eye, const glm::dvec3& target);

/// Views with the motion between them, at 60 frames a second.
[[nodiscard]] std::vector<Step> walk_of(std::span<const View> views);

/// Past a forest around `offset`: from `radius` outside it in a slow curve, looking at it.
[[nodiscard]] std::vector<Step>
curved_walk(double radius, std::size_t frames, const glm::dvec3& offset = glm::dvec3(0.0));

struct FlightOptions {
    double reach = 300.0;       ///< [m] how far from the origin
    double speed = 15.0;        ///< [m/s]
    unsigned teleport_in = 200; ///< one frame of so many
    unsigned turn_in = 300;     ///< likewise a turn to anywhere in one frame
    unsigned lens_in = 1000;    ///< likewise another lens
};

/// A viewer who wanders, turns, stands still at times, jumps and changes lenses.
[[nodiscard]] std::vector<Step>
random_flight(std::size_t frames, std::uint64_t seed, const FlightOptions& options = {});

} // namespace farfield::support
