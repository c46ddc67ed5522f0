#pragma once

#include <farfield/core/executor.hpp>
#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/image/height_grid.hpp>
#include <farfield/image/proxy_pair.hpp>
#include <farfield/image/surface_finder.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace farfield {

/// Makes pairs of a fine and a coarse model: from grids of heights, or from any two meshes.
///
/// Pairs of height grids are exact: heights of the fine surface over the coarse one are measured
/// at every post and wherever an edge of the coarse model crosses one of the fine. Those of meshes
/// are measured at the vertices of the fine model.

/// Which items a pair will be of: that of the fine model and that of the coarse one, which may yet
/// have to be added.
struct ProxyItems {
    ItemId fine = kNone<ItemId>;
    ItemId coarse = kNone<ItemId>;
};

/// A pair of height grids, with the triangles of its coarse model.
struct HeightProxy {
    ProxyPair pair;
    /// Corners, three a triangle, by facet: posts of the grid (`HeightGrid::post`),
    /// counter-clockwise from above.
    std::vector<std::uint32_t> posts;
};

/// A coarse grid that does not change.
struct GridProxyOptions {
    /// Along the longer side, each cut into two triangles; as many along the other as make them
    /// nearly square. Corners are posts: sizes that are no multiple are rounded. [1, posts - 1]
    std::uint32_t squares = 16;
};

/// Every k-th post of a grid, for a fixed coarse model.
/// @return a pair that passes `validate`, not refinable; an error that names the field and value
/// @par Cost O(n log n) for n posts; see docs/lod-sprite.md
/// @par Source Chen, Swan, Kuo 1999, section 4: 16 x 16 for 512 x 512 samples
[[nodiscard]] Result<HeightProxy>
build_grid_proxy(const HeightGrid& grid, const ProxyItems& items, const GridProxyOptions& options);

/// A coarse model that may be refined where it has to be.
struct RefinedProxyOptions {
    std::uint32_t root_squares = 1; ///< of the coarsest model, as `GridProxyOptions::squares`
    /// Of the finest choice, at most; no fewer than those of the roots. [2, 2^26]
    std::uint32_t max_triangles = 16384;
    /// [m] Triangles that are off by no more are not split. Some that are stay as they are where
    /// posts are too close to halve an edge. >= 0
    double error_m = 0.0;
};

/// A binary tree of right triangles, halved from the right angle to the middle of the longest edge;
/// the middle is rounded to a post, so that grids of any size end at their rims. Triangles that
/// are off farthest are split first, with whatever has to be split for them.
/// @return a pair that passes `validate` and is refinable; an error that names the field and value
/// @par Cost O(n d) for n posts and d levels; see docs/lod-sprite.md
/// @par Source the tree of Lindstrom et al., Real-time continuous level of detail rendering of
/// height fields, 1996; nested errors and spheres as in Lindstrom and Pascucci, Visualization of
/// large terrains made easy, 2001, with exact errors of planes in place of those of points
[[nodiscard]] Result<HeightProxy> build_refined_proxy(
    const HeightGrid& grid, const ProxyItems& items, const RefinedProxyOptions& options
);

/// The coarse model as a mesh in the frame of the fine one, triangle i being facet i: vertices of
/// the fine mesh with their colours and texture coordinates, its first material, and normals that
/// are means over what a vertex stands for, so that it is lit as the fine mesh is from afar.
/// @param fine the mesh that `gridded` was found in
[[nodiscard]] Mesh
make_coarse_mesh(const Mesh& fine, const GriddedMesh& gridded, const HeightProxy& proxy);

/// Adds a coarse model to a scene: one mesh, and one instance for each of the fine one. Nothing
/// that was there changes its number. Hierarchies are built over the instances of before; counts of
/// triangles by item (`NullBackend`, `work_of`) are made of all of them, after.
/// @param fine a mesh of the scene
/// @param items only the first so many instances are looked at
/// @return by instance of the fine mesh, in order
[[nodiscard]] std::vector<ProxyItems>
add_coarse_mesh(Scene& scene, MeshId fine, Mesh coarse, std::size_t items);

/// Two meshes, in one place. Spans and references are used during the call alone.
struct MeshProxyInput {
    const Mesh& fine;
    const Mesh& coarse; ///< with the same `Mesh::origin`
    const SurfaceFinder& on_fine;
    const SurfaceFinder& on_coarse;
    glm::dmat4x3 object_to_world{1.0};
};

/// Matches the vertices of a fine mesh to the closest points of a coarse one. Distances are
/// measured from the fine vertices, and back from the coarse ones and as many points all over the
/// coarse surface as there are fine vertices.
///
/// Blind spots: what a fine triangle does between its vertices, and that the closest point is not
/// the one behind a vertex as an eye sees it. Where the placement does not keep angles, the closest
/// point of the meshes is not that of the world, and distances are no less than they should be.
/// @return a pair that passes `validate`; an error that names the mesh and what it has none of
/// @par Cost O(n log n) for n vertices, shared out by the executor
[[nodiscard]] Result<ProxyPair>
build_mesh_proxy(const MeshProxyInput& input, const ProxyItems& items, Executor& executor);

/// Orders the samples of a pair and builds its nodes over them, for builders of other pairs.
/// @pre at least one sample; facets of samples exist; all numbers are finite
/// @par Cost O(n log n) for n samples
void build_proxy_nodes(ProxyPair& pair);

} // namespace farfield
