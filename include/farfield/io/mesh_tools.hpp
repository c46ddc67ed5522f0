#pragma once

#include <farfield/scene/scene.hpp>

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

} // namespace farfield::io
