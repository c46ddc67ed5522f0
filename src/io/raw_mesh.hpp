#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace farfield::io {

/// A mesh as a file has it: positions in double, arrays that may be missing.
struct RawMesh {
    std::vector<glm::dvec3> positions;
    std::vector<glm::vec3> normals;     ///< empty or one each, any length; zero or NaN: unknown
    std::vector<glm::u8vec4> colors;    ///< empty or one each
    std::vector<glm::vec2> texcoords;   ///< empty or one each
    std::vector<std::uint32_t> indices; ///< in range
    std::vector<MeshPart> parts;        ///< empty: one part of no material
};

/// The mesh relative to the centre of its positions, with unit normals and bounds; without
/// vertices that no triangle uses, so a stray one does not widen the bounds.
/// @return `bad_data` when there are no triangles or a position does not fit into a float
[[nodiscard]] Result<Mesh> finish_mesh(RawMesh raw, std::string_view file);

/// Removes vertices that no triangle uses; the others keep their order.
void drop_unused(Mesh& mesh);

/// Scales normals to unit length and computes those that are zero or not finite.
void complete_normals(Mesh& mesh);

/// A colour channel in [0, 1] as 8 bits; NaN is 255, so that three of them are white.
[[nodiscard]] std::uint8_t to_byte(double channel) noexcept;

/// Appends a polygon as a fan around its first corner.
template <typename Corner>
void append_fan(std::vector<std::uint32_t>& indices, std::size_t count, const Corner& corner) {
    for (std::size_t k = 2; k < count; ++k) {
        indices.insert(indices.end(), {corner(0), corner(k - 1), corner(k)});
    }
}

} // namespace farfield::io
