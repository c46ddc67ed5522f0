#pragma once

#include "random.hpp"
#include "solids.hpp"
#include <farfield/scene/scene.hpp>

#include <glm/ext/vector_int3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace farfield::scenes {

/// What flows in a pipe decides how thick it is and how it is painted.
struct PipeService {
    glm::dvec3 color{0.0};
    double radius = 0.2; ///< [m] where nodes are `kPipeSpacing` apart
    int sides = 20;
    bool insulated = false; ///< in metal sheet with bands
};

/// Services that pipes may have.
inline constexpr std::size_t kPipeServices = 9;
[[nodiscard]] const std::array<PipeService, kPipeServices>& pipe_services() noexcept;

/// [m] From node to node of a lattice of pipes in their natural size.
inline constexpr double kPipeSpacing = 1.5;
/// [m] Nothing of a pipe, flanges included, is further from its middle line in that size, but for
/// the stems and wheels of valves.
inline constexpr double kPipeReach = 0.6;

/// Two flanges around a pipe with their bolts, across an axis (unit) at a place.
void add_flanges(
    Solids& solids,
    const glm::dvec3& at,
    const glm::dvec3& axis,
    double radius,
    int sides,
    const glm::dvec3& color
);

/// A box of lattice nodes that pipes run through.
struct PipeLattice {
    glm::dvec3 corner{0.0}; ///< lower corner of the box; nodes are in the middles of its cells
    double spacing = kPipeSpacing;
    glm::ivec3 nodes{1};
    std::vector<bool> taken; ///< x first, then y, then z: nodes that pipes must leave alone

    [[nodiscard]] std::size_t index_of(const glm::ivec3& node) const noexcept;
    [[nodiscard]] bool contains(const glm::ivec3& node) const noexcept;
    /// Inside and not taken.
    [[nodiscard]] bool is_free(const glm::ivec3& node) const noexcept;
};

/// Lays pipes through lattices out of a stock of pieces: straight ones, with and without flanges,
/// valves, elbows, ends, lids where they come out at a side. Every piece is an instance, whole in
/// the cell of its node; there is one mesh a piece and service.
class PipeLayer {
  public:
    /// Adds the pieces to the meshes of a scene.
    PipeLayer(Scene& scene, Random& random);

    /// Lays pipe after pipe, each from a side or the ground of the box on and on until it comes out
    /// or is stuck, until there are so many triangles more or no node is left.
    /// @return triangles laid
    int lay(Scene& scene, PipeLattice& lattice, int triangles, Random& random) const;

  private:
    enum Piece : std::uint8_t { plain, flanged, valve, elbow, end, lid };
    static constexpr std::size_t kPieces = 6;

    struct Run;

    [[nodiscard]] int place(
        Scene& scene,
        const PipeLattice& lattice,
        const glm::ivec3& node,
        std::size_t service,
        Piece piece,
        const glm::ivec3& ahead,
        const glm::ivec3& side
    ) const;
    [[nodiscard]] bool begin(const PipeLattice& lattice, Random& random, Run& run) const;
    [[nodiscard]] int lay_one(
        Scene& scene, PipeLattice& lattice, const Run& run, int triangles, Random& random
    ) const;

    std::array<std::array<MeshId, kPieces>, kPipeServices> meshes_{};
    std::array<std::array<int, kPieces>, kPipeServices> triangles_{};
};

} // namespace farfield::scenes
