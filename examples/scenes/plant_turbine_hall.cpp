#include "pipe_network.hpp"
#include "plant_layout.hpp"
#include "plant_parts.hpp"
#include "plant_site.hpp"
#include "solids.hpp"

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace farfield::scenes::plant {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr Area kHall = {{24.0, -46.0}, {72.0, -16.0}};
constexpr double kHallTop = 20.0;

const dvec3 kHallSheet(196.0, 186.0, 160.0);
const dvec3 kTurbine(116.0, 150.0, 168.0);

/// Columns, trusses, the roof, the walls and the crane.
void add_shell(Site& site) {
    Solids shell;
    for (const double x : evenly(kHall.lo.x, kHall.hi.x + 0.5 * kBay, kBay)) {
        const double at = std::clamp(x, kHall.lo.x + 0.4, kHall.hi.x - 0.4);
        for (const double z : {kHall.lo.y + 0.4, kHall.hi.y - 0.4}) {
            shell.add_girder({at, 0.0, z}, {at, kHallTop, z}, 0.5, 0.6, kSteel, 4.0);
        }
        // A truss of two chords and slanted bars.
        const dvec3 south(at, kHallTop - 1.4, kHall.hi.y - 0.4);
        const dvec3 north(at, kHallTop - 1.4, kHall.lo.y + 0.4);
        shell.add_girder(south, north, 0.2, 0.2, kSteel * 0.95, 3.0);
        shell.add_girder(south + kUp * 1.3, north + kUp * 1.3, 0.2, 0.2, kSteel * 0.95, 3.0);
        constexpr int kBars = 14;
        for (int bar = 0; bar < kBars; ++bar) {
            const auto chord = [&](int i) {
                const double share = static_cast<double>(i) / kBars;
                return glm::mix(south, north, share) + kUp * (i % 2 == 0 ? 0.0 : 1.3);
            };
            shell.add_bar(chord(bar), chord(bar + 1), 0.1, 0.1, kSteel * 0.9);
        }
    }
    shell.add_box(
        {kHall.lo.x - 0.3, kHallTop, kHall.lo.y - 0.3},
        {kHall.hi.x + 0.3, kHallTop + 0.4, kHall.hi.y + 0.3},
        kConcrete * 0.8,
        kBay
    );
    add_walls(shell, kHall, kHallTop, kStorey + 3.0, kHallSheet);
    // The crane on its rails.
    for (const double z : {kHall.lo.y + 1.2, kHall.hi.y - 1.2}) {
        shell.add_girder(
            {kHall.lo.x + 1.0, 15.0, z}, {kHall.hi.x - 1.0, 15.0, z}, 0.4, 0.7, kSteel, 3.0
        );
    }
    for (const double x : {62.0, 64.0}) {
        shell.add_girder(
            {x, 15.9, kHall.lo.y + 1.0},
            {x, 15.9, kHall.hi.y - 1.0},
            0.5,
            1.0,
            {226.0, 176.0, 40.0},
            3.0
        );
    }
    shell.add_box({61.6, 16.4, -33.0}, {64.4, 17.6, -30.0}, {226.0, 176.0, 40.0});
    site.add_whole(shell, "turbine hall");
}

/// The machine on its table, the condenser below.
void add_turbine(Site& site) {
    Solids solids;
    constexpr double kTable = 6.0;
    solids.add_box({34.0, kTable - 0.8, -37.0}, {68.0, kTable, -25.0}, kConcrete, 3.0);
    for (const double x : evenly(35.0, 68.0, 8.0)) {
        for (const double z : {-36.2, -25.8}) {
            solids.add_box({x - 0.6, 0.0, z - 0.6}, {x + 0.6, kTable - 0.8, z + 0.6}, kConcrete);
        }
    }
    const auto casing = [&](double x, double radius, double length, const dvec3& color) {
        std::vector<dvec2> profile = {
            {0.0, 0.0}, {0.45 * radius, 0.0}, {0.5 * radius, 0.12 * length}};
        constexpr int kRibs = 6;
        for (int rib = 0; rib < kRibs; ++rib) {
            const double at = length * (0.16 + 0.68 * rib / kRibs);
            const double swell =
                radius * (0.72 + 0.28 * std::sin(std::numbers::pi * (rib + 1.0) / (kRibs + 1.0)));
            const double width = 0.68 * length / kRibs;
            profile.insert(
                profile.end(),
                {{swell, at},
                 {swell, at + 0.7 * width},
                 {1.06 * swell, at + 0.7 * width},
                 {1.06 * swell, at + width}}
            );
        }
        profile.insert(
            profile.end(), {{0.5 * radius, 0.88 * length}, {0.45 * radius, length}, {0.0, length}}
        );
        solids.add_lathe({x, kTable + 1.6, -31.0}, kX, profile, 48, color);
        solids.add_box(
            {x + 0.1 * length, kTable, -32.6}, {x + 0.9 * length, kTable + 0.7, -29.4}, color * 0.8
        );
    };
    casing(35.0, 1.5, 5.0, kTurbine);
    casing(40.5, 2.0, 6.0, kTurbine * 1.05);
    casing(47.0, 2.6, 8.0, kTurbine * 0.95);
    casing(56.0, 1.9, 9.5, kGenerator);
    solids.add_cylinder({34.4, kTable + 1.6, -31.0}, kX, 0.3, 32.0, 24, kGalvanized);
    // Steam pipes over the machine.
    for (int i = 0; i < 5; ++i) {
        const double z = -33.0 + i;
        const double x = 36.0 + 2.7 * i;
        const std::array<dvec3, 5> points = {
            dvec3(x, kTable + 2.2, z),
            dvec3(x, kTable + 5.4, z),
            dvec3(x, kTable + 5.4, -40.0 - i),
            dvec3(26.0, kTable + 5.4 + i * 0.9, -40.0 - i),
            dvec3(26.0, 2.0, -40.0 - i)};
        solids.add_tube(
            points,
            {.radius = 0.3, .bend = 1.0, .sides = 24, .arc_segments = 8, .longest = 2.0},
            pipe_services().at(static_cast<std::size_t>(i)).color
        );
    }
    // The condenser without its side: plates that hold the bundle.
    for (const double x : {41.7, 44.0, 46.0, 48.2}) {
        solids.add_bar({x, 0.9, -27.5}, {x, 0.9, -34.5}, 0.08, 0.3, kSteel);
        solids.add_bar({x, 3.55, -27.5}, {x, 3.55, -34.5}, 0.08, 0.3, kSteel);
        for (const double z : {-27.5, -34.5}) {
            solids.add_girder({x, 0.0, z}, {x, 5.2, z}, 0.2, 0.2, kSteel);
        }
    }
    solids.add_box({41.4, 3.9, -34.6}, {48.6, 5.2, -27.4}, kTurbine * 0.8, 2.0);
    site.add_whole(solids, "turbine");
}

} // namespace

void add_turbine_hall(Site& site, const PipeLayer& pipes) {
    add_shell(site);
    add_turbine(site);
    add_bundle(site, {45.0, 1.2, -31.0});
    for (int i = 0; i < 8; ++i) {
        site.place(site.pump, {29.0 + 5.0 * i, 0.0, -18.6});
    }
    site.fill(pipes, {28.0, 0.0, -45.6}, {30, 5, 6}, 1.1, 120'000);
}

} // namespace farfield::scenes::plant
