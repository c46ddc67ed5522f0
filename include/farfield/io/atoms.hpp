#pragma once

#include <farfield/core/result.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace farfield::io {

/// An atom of a molecule.
struct Atom {
    glm::dvec3 position{0.0};       ///< [angstrom]
    std::uint8_t atomic_number = 6; ///< [1, 118]
};

/// Most atoms of a scene.
inline constexpr std::size_t kMaxAtoms = std::size_t{1} << 22U;

/// Triangles of the ball that stands for an atom.
inline constexpr std::uint32_t kBallTriangles = 800;

/// Symbol of an element, "C" or "Cl". @pre 1 <= atomic_number <= 118
[[nodiscard]] std::string_view element_symbol(std::uint8_t atomic_number) noexcept;

/// The element of a symbol in upper or lower case; "D" is hydrogen. Nothing when there is none.
[[nodiscard]] std::optional<std::uint8_t> find_element(std::string_view symbol) noexcept;

/// [angstrom] Van der Waals radius of an element; nothing for elements that Bondi does not give.
/// @par Source Bondi: van der Waals volumes and radii, 1964
[[nodiscard]] std::optional<double> van_der_waals_radius(std::uint8_t atomic_number) noexcept;

/// [angstrom] Radius that `make_balls` gives to elements of no van der Waals radius.
inline constexpr double kOtherRadius = 2.0;

/// Customary colour, sRGB-encoded, after the plastic models of Corey, Pauling and Koltun: carbon
/// grey, nitrogen blue, oxygen red, sulphur yellow, hydrogen white. Pink where there is no custom.
[[nodiscard]] glm::u8vec3 cpk_color(std::uint8_t atomic_number) noexcept;

/// A ball of radius 1 around 0 with smooth normals: 402 vertices on the unit sphere, evenly spread
/// along 19 circles and the poles, and `kBallTriangles` triangles between them.
[[nodiscard]] Mesh make_ball();

/// The molecule as balls of van der Waals radii in customary colours, a metre an angstrom. One mesh
/// and one material an element, in the order of atomic numbers; instance i is atom i, its matrix a
/// uniform scale and a translation.
/// @return the scene, valid; an error for no atoms, more than `kMaxAtoms`, and naming the atom and
/// its value for a position that is not finite or an element that does not exist
[[nodiscard]] Result<Scene> make_balls(std::span<const Atom> atoms);

} // namespace farfield::io
