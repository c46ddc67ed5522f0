#pragma once

#include <farfield/core/executor.hpp>
#include <farfield/core/result.hpp>
#include <farfield/image/color_cube_model.hpp>
#include <farfield/image/surface_sampler.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <cstdint>
#include <functional>
#include <span>

namespace farfield {

/// Box around the part of an item inside a closed box, both of the world [m]; empty where there is
/// none. Called by several threads at once.
using ItemPart = std::function<Box3d(std::uint32_t item, const Box3d& box)>;

/// A shape that stands in several places.
struct CubePrototype {
    ItemId item = kNone<ItemId>;  ///< one of those that have it: its surface is sampled
    std::uint32_t primitives = 0; ///< [1, 2^30)
    Box3d bounds;                 ///< [m] in its own frame, relative to the origin of its mesh
};

/// Where an item shows a prototype.
struct CubePlacement {
    std::uint32_t prototype = UINT32_MAX; ///< none: the item is what its object says
    glm::dmat4x3 object_to_world{1.0};    ///< a proper rotation, a uniform scale and a translation
};

/// What colour cubes are built from. Spans and callbacks are used during the call alone.
struct ColorCubeInput {
    /// As for every builder (partition/hierarchy.hpp): by item. Triangles of splittable objects are
    /// primitives of their own, the others are drawn whole.
    std::span<const Object> objects;
    /// World corners of triangles of splittable objects. Called by several threads at once.
    PrimitiveTriangle triangle;
    /// Says for items that are not splittable where they are within their boxes; else they count as
    /// everywhere in them. May be empty.
    ItemPart part;
    std::span<const CubePrototype> prototypes;
    /// Corners of triangles of a prototype, in its frame. Called by several threads at once.
    std::function<Triangle3d(std::uint32_t prototype, std::uint32_t triangle)> prototype_triangle;
    std::span<const CubePlacement> placements; ///< by item, or empty
    DirectionalLight light;                    ///< that falls on what the sampler finds
};

/// What colours are of, and where those of interior cells come from.
enum class CubeColors : std::uint8_t {
    /// Rays through the box of the contents of every cell.
    sampled,
    /// As published: of whole cells, and from those of the children in interior ones (`composed`).
    composed,
};

/// How `build_color_cubes` decides.
struct ColorCubeOptions {
    /// What drawing a colour cube costs, in triangles: cells are divided until their contents cost
    /// no more than the cubes of the children that they would get. (0, 1e6]
    double cube_cost = 2.5;
    std::uint32_t max_depth = 16; ///< levels below the root, [0, 20]
    /// A cell is not divided where its contents would be in more cells than about this for every
    /// triangle that they cost, taking those of each to be alike: bounds the memory of heaps of
    /// large primitives. [1, 1024]
    std::uint32_t max_copies = 8;
    /// A side of the grid that samples a face, at least. [1, 64]
    std::uint32_t rays = 4;
    /// Rays of each direction that all leaves of a tree share where that is more: a small tree may
    /// be shown in many places. Twice as many a cell on each level above, up to 64 a side. As many
    /// again, but 8192 to 262144, go through the whole tree (`LevelFactors`). 0: every cell has
    /// `rays`. [0, 1e9]
    std::uint32_t shared_rays = 330'000;
    CubeColors colors = CubeColors::sampled;
    /// Most sets of colours of one prototype: turned items see the light from elsewhere. [1, 64]
    std::uint32_t max_light_sets = 8;
};

/// Builds the octrees of a scene and their colours.
///
/// Primitives are pushed down until drawing those of a cell costs no more than drawing the colour
/// cubes of the children that it would get. What reaches into m cells counts 1/m in each; triangles
/// are tested exactly against cells, not their boxes.
///
/// The colour of a face is the mean of `rays`^2 parallel rays or more through the cell, one in each
/// square of a grid. Light is as of `DirectionalLight`.
///
/// @return a model that passes `validate`; errors name the object, prototype, placement or option
/// and its value: no objects, boxes that are not finite, placements that are not similarities
/// @par Cost O(n log n) for n primitives and their copies; about a quarter of a microsecond a ray
/// @par Source Chamberlain et al. 1996, section 4. Departures: overlap is exact, rays take the
/// place of small pictures, primitives share by leaf.
/// @param sampler its origin becomes that of the model
[[nodiscard]] Result<ColorCubeModel> build_color_cubes(
    const ColorCubeInput& input,
    const SurfaceSampler& sampler,
    const ColorCubeOptions& options,
    Executor& executor
);

/// The same for a `Scene`. Meshes of at least `min_shared` triangles become prototypes where they
/// are placed by rotation, uniform scale and translation, and single triangles of the scene's tree
/// where they are not, or where the mesh is splittable; items of smaller meshes stay whole.
/// @param scene one that passed `validate`
/// @param sampler of the same scene
/// @param min_shared [triangles] >= 1
[[nodiscard]] Result<ColorCubeModel> build_color_cubes(
    const Scene& scene,
    const SurfaceSampler& sampler,
    const ColorCubeOptions& options,
    Executor& executor,
    std::uint32_t min_shared = 256
);

/// A 64-bit digest of all that the model of a `Scene` depends on: with it a stored model tells
/// whether it is still the one that would be built.
[[nodiscard]] std::uint64_t digest(
    const Scene& scene, const ColorCubeOptions& options, std::uint32_t min_shared = 256
) noexcept;

} // namespace farfield
