#pragma once

#include "pipe_network.hpp"
#include "random.hpp"
#include "solids.hpp"
#include <farfield/scene/scene.hpp>

#include <glm/ext/vector_int3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

/// What builds the power plant, house by house.
namespace farfield::scenes::plant {

inline constexpr glm::dvec3 kUp{0.0, 1.0, 0.0};
inline constexpr glm::dvec3 kX{1.0, 0.0, 0.0};

inline constexpr glm::dvec3 kConcrete{160.0, 158.0, 152.0};
inline constexpr glm::dvec3 kSteel{98.0, 116.0, 128.0};
inline constexpr glm::dvec3 kGalvanized{168.0, 172.0, 174.0};
inline constexpr glm::dvec3 kCasing{190.0, 192.0, 192.0};
inline constexpr glm::dvec3 kGenerator{84.0, 120.0, 92.0};
inline constexpr glm::dvec3 kCoal{46.0, 45.0, 46.0};
inline constexpr glm::dvec3 kWhite{226.0, 226.0, 222.0};

/// [m] Between columns.
inline constexpr double kBay = 6.0;

/// A rectangle of the ground or of a floor, x and z. [m]
struct Area {
    glm::dvec2 lo{0.0};
    glm::dvec2 hi{0.0};

    [[nodiscard]] bool contains(const glm::dvec2& at) const noexcept {
        return at.x > lo.x && at.y > lo.y && at.x < hi.x && at.y < hi.y;
    }
};

/// The plant as far as it is built.
struct Site {
    Scene scene;
    Random random{0};
    std::uint64_t seed = 0;
    int panels = 0; ///< of a bundle
    MeshId panel = kNone<MeshId>;
    MeshId pump = kNone<MeshId>;

    /// What there is once: a splittable mesh.
    void add_whole(Solids& solids, const char* name);

    /// A part to be placed.
    [[nodiscard]] MeshId add_part(Solids solids, const char* name);

    /// Places a part, turned from +z towards +x by quarter turns.
    void place(MeshId mesh, const glm::dvec3& at, std::uint64_t turns = 0);

    /// Lays pipes through a box of lattice nodes until there are so many triangles of them.
    /// @param corner the lower one of the box
    void fill(
        const PipeLayer& pipes,
        const glm::dvec3& corner,
        const glm::ivec3& nodes,
        double spacing,
        int triangles
    );

    /// A colour a little lighter or darker.
    [[nodiscard]] glm::dvec3 shade(const glm::dvec3& color, double by = 0.05) noexcept;
};

/// All four walls of a house, of folded metal sheets; the south wall begins higher up.
void add_walls(Solids& solids, const Area& area, double top, double south, const glm::dvec3& color);

/// Tube panels hung side by side: the most triangles in the least space.
/// @param foot of the middle one
void add_bundle(Site& site, const glm::dvec3& foot);

/// The ground and what stands in the open.
void add_yard(Site& site);
/// Portals with pipes on three levels and trays of cables on the uppermost.
void add_rack(Site& site);
/// Frame, floors, furnace, bundles, control room and pipework.
void add_boiler_house(Site& site, const PipeLayer& pipes);
/// Shell, crane, turbine, condenser and pipework.
void add_turbine_hall(Site& site, const PipeLayer& pipes);

} // namespace farfield::scenes::plant
