#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <cstdint>

namespace farfield::io {

/// How far a coarse model is to be reduced: to both, whichever is met first.
struct CoarseMeshOptions {
    std::uint32_t triangles = 2000; ///< fewer are not made of more. >= 1
    /// [m] No vertex that is taken away is farther from the triangles that take its place, each
    /// time it is looked at. 0: not looked at. >= 0
    double error_m = 0.0;
};

/// Reduces a mesh to a coarse model of it, by collapsing edges, least error first: every vertex is
/// one of the original, in its frame, with its normal, colour and texture coordinates. Rims of
/// surfaces, seams of textures and borders of colours and materials stay where they are; only what
/// lies along them is collapsed.
///
/// Vertices in one place are one, whatever else they are. Triangles without area and all but one of
/// those with the same corners are left out. Surfaces that do not bound a volume, or meet three at
/// an edge, are taken apart there, so that seams may open by the error. How far the result is from
/// the original is not known: `build_mesh_proxy` measures it.
///
/// A mesh that has more seams and loose pieces than triangles to spare stays larger than asked for.
/// @pre the mesh passes `farfield::validate`
/// @return a mesh ordered for drawing, all of whose triangles have an area; `invalid_argument` for
/// an option out of range, `bad_data` for a mesh without a triangle that has one
/// @par Cost about 20 us a triangle taken away
/// @par Source OpenMesh; quadric errors by Garland and Heckbert, Surface simplification using
/// quadric error metrics, 1997
[[nodiscard]] Result<Mesh>
make_coarse_mesh(const Mesh& fine, const CoarseMeshOptions& options = {});

} // namespace farfield::io
