#pragma once

#include <farfield/scene/scene.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace farfield {

/// Points of the triangles of a mesh at even steps of the area, the same on every run: at places in
/// their triangles that follow an additive recurrence, which leaves no pattern. [m] Relative to
/// `Mesh::origin`.
/// @return `count` points; none where no triangle has an area
/// @pre the mesh passes `validate`
/// @par Cost linear in triangles and points
/// @par Source Roberts: The unreasonable effectiveness of quasirandom sequences, 2018
[[nodiscard]] std::vector<glm::vec3> points_of_surface(const Mesh& mesh, std::uint32_t count);

} // namespace farfield
