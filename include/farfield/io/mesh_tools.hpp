#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>
#include <farfield/technique/mesh_lod.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace farfield::io {

/// Reorders a mesh for fast drawing: vertices that agree in every attribute become one, unused ones
/// go; triangles are ordered within each part for the vertex cache and then against overdraw,
/// vertices by first use.
///
/// The set of triangles, their orientation and material and the parts stay; the numbers of the
/// primitives change, so a splittable mesh is optimised before a hierarchy is built over it.
/// @pre the mesh passes `farfield::validate`
/// @par Cost O(n) in triangles; about 1 s for 3 million
/// @par Source meshoptimizer: vertex cache by Forsyth's and overdraw by Sander, Nehab and Barczak's
/// method
void optimize_for_drawing(Mesh& mesh);

/// How triangles are taken away.
enum class Simplification : std::uint8_t {
    /// Edges are collapsed, least error first. Keeps surfaces closed and borders in place. Small
    /// loose parts vanish at next to no error: a tree loses its leaves, see `error_samples`.
    collapse,
    /// Vertices in one cell of a grid become one, whether they are connected or not. Coarser than
    /// `collapse` on closed surfaces, but loose parts grow together rather than vanish.
    cluster,
};

/// How levels of detail are made.
struct LevelOptions {
    Simplification method = Simplification::collapse;
    double ratio = 0.5; ///< triangles of a level for one of the level before. [0.05, 0.9]
    std::uint32_t least_triangles = 32; ///< of the coarsest level asked for. >= 1
    /// Samples a surface to measure how far each level is from the original. 0: the simplifier is
    /// believed, as is common practice; 10,000 find what it loses.
    std::uint32_t error_samples = 0;
};

/// One level of detail of a mesh.
struct MeshLevel {
    Mesh mesh; ///< made from vertices of the original, in its frame, ordered for drawing
    /// [m] that a point of the original may be off: what the simplifier reports, or where they were
    /// measured the larger of that and the distance of the surfaces. Never less than the error of
    /// the level before.
    double error_m = 0.0;
};

/// Makes levels of detail, from fine to coarse. Each is made from the original, so errors do not
/// add up; that they never fall is enforced. A level asked for that is not clearly smaller than the
/// one before is left out, and so is one that has no triangles.
///
/// Parts are simplified apart, each by the same ratio: where two materials meet, a seam may open by
/// the error. Vertices keep their normals, colours and texture coordinates.
///
/// Blind spots of the simplifier's error: it is a mean over planes, not a bound, and what vanishes
/// as a whole does not count. Those of the measured one: see `surface_distance`; and neither sees
/// how much of a crown or a fence is left.
/// @pre the mesh passes `farfield::validate`
/// @return `invalid_argument` for an option out of range
/// @par Cost about 0.15 s for 36,000 triangles and all levels, and 1 s for 10,000 samples of each
/// @par Source meshoptimizer: collapse by quadric errors (Garland, Heckbert 1997), clusters on the
/// finest grid that makes few enough triangles (Rossignac, Borrel 1993)
[[nodiscard]] Result<std::vector<MeshLevel>>
make_levels(const Mesh& mesh, const LevelOptions& options = {});

/// Distance of two surfaces, the symmetric Hausdorff distance, estimated: the farthest that a
/// sample of either is from the other surface. [m] In the frame of the meshes, origins included.
///
/// Samples are the same on every run: `samples` points spread over the triangles by area, and the
/// vertices in use, at most as many, evenly picked by number.
///
/// Never too large, but for rounding; too small by at most the distance of a point of either
/// surface from its nearest sample. Blind spots: which way surfaces face, how much there is of
/// them, and what is thinner than the samples are apart.
/// @param samples of each surface, >= 1
/// @pre both meshes pass `farfield::validate`
/// @par Cost O((n + samples) log n) for n triangles
[[nodiscard]] double surface_distance(const Mesh& a, const Mesh& b, std::uint32_t samples);

/// Which meshes of a scene get levels of detail, and which.
struct SceneLevelOptions {
    LevelOptions levels{};
    std::uint64_t min_triangles = 256; ///< smaller meshes get none
    std::uint32_t min_instances = 1;   ///< meshes used less often get none, to save memory and time
    /// Only the first so many instances get levels: those that are there beside other levels, made
    /// before. None: all.
    std::optional<std::size_t> items = std::nullopt;
};

/// Adds levels of detail to a scene: for every level a mesh, and for every instance and level of
/// its mesh an instance. So geometry sources draw levels as they draw everything else, instanced.
/// Nothing that was there changes its number; errors are scaled by the instances.
///
/// Hierarchies are built over the first `LodTable::items.size()` instances, those of before; counts
/// of triangles by item (`NullBackend`, `work_of`) are made of all of them, after. Splittable
/// meshes get no levels.
/// @param scene one that passed `farfield::validate`; unchanged where an error is returned
/// @return the table, with every item that was there, for `MeshLod`; `invalid_argument` for an
/// option out of range, `unsupported` for more than 2^32 - 2 instances
[[nodiscard]] Result<LodTable>
add_levels_of_detail(Scene& scene, const SceneLevelOptions& options = {});

} // namespace farfield::io
