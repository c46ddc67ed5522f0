#include "pipe_network.hpp"
#include "plant_layout.hpp"
#include "plant_parts.hpp"
#include "plant_site.hpp"
#include "solids.hpp"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace farfield::scenes::plant {

namespace {

using glm::dvec3;

const dvec3 kRackSteel(132.0, 140.0, 146.0);
const dvec3 kBrick(168.0, 82.0, 66.0);

/// One pipe along the rack, its foot at a height, with flanges here and there; some of them
/// leave it for the boiler house or the turbine hall.
void add_rack_pipe(
    Site& site,
    Solids& pipes,
    const PipeService& service,
    double radius,
    const dvec3& begin,
    double length
) {
    const double y = begin.y + radius;
    const double end = begin.x + length;
    const dvec3 color = site.shade(service.color);
    std::vector<dvec3> points = {{begin.x - 1.0, y, begin.z}};
    const double kind = site.random.unit();
    if (kind < 0.5) {
        // Up and over the others, between two columns, into the boiler house or the hall.
        const bool boiler = kind < 0.3;
        const double bay = boiler ? -12.0 + kBay * static_cast<double>(site.random.bits() % 4)
                                  : 24.0 + kBay * static_cast<double>(site.random.bits() % 5);
        const double x = bay + site.random.between(1.2, 4.8);
        const double above = site.random.between(11.2, 12.6);
        points.insert(
            points.end(), {{x, y, begin.z}, {x, above, begin.z}, {x, above, boiler ? -14.9 : -18.0}}
        );
    } else {
        points.emplace_back(end + 1.0, y, begin.z);
    }
    pipes.add_tube(
        points,
        {.radius = radius,
         .bend = std::max(2.0 * radius, 0.3),
         .sides = service.sides,
         .arc_segments = 8,
         .longest = 3.0},
        color
    );
    const double last = points[1].x - 1.5;
    for (const double x : evenly(begin.x + 2.0, last, kBay)) {
        if (site.random.unit() < 0.36) {
            add_flanges(pipes, {x, y, begin.z}, kX, radius, service.sides, color * 0.85);
        }
    }
}

/// A ladder of rungs between two rails, with cables on it.
void add_tray(Solids& trays, const dvec3& begin, double length) {
    constexpr double kWidth = 0.6;
    const dvec3 at = begin + dvec3(0.0, 0.05, 0.1);
    for (const double z : {0.0, kWidth}) {
        trays.add_bar(
            at + dvec3(0.0, 0.05, z), at + dvec3(length, 0.05, z), 0.02, 0.1, kGalvanized, 3.0
        );
    }
    for (const double x : evenly(0.2, length, 0.4)) {
        trays.add_bar(
            at + dvec3(x, 0.02, 0.01), at + dvec3(x, 0.02, kWidth - 0.01), 0.04, 0.02, kGalvanized
        );
    }
    for (int cable = 0; cable < 8; ++cable) {
        const double z = 0.08 + 0.063 * cable;
        const std::array<dvec3, 2> points = {
            at + dvec3(0.0, 0.055, z), at + dvec3(length, 0.055, z)};
        const dvec3 color = cable % 3 == 0 ? kBrick : dvec3(48.0, 48.0, 52.0);
        trays.add_tube(points, {.radius = 0.025, .sides = 6, .longest = 3.0}, color);
    }
}

} // namespace

/// Portals with pipes on three levels and trays of cables on the uppermost.
void add_rack(Site& site) {
    Solids steel;
    constexpr double kHalf = 5.0;
    constexpr int kBays = 20;
    constexpr double kBegin = -kBay * kBays / 2.0;
    constexpr std::array<double, 3> kLevels = {4.6, 6.8, 9.0};
    const double top = kLevels.back();
    for (int portal = 0; portal <= kBays; ++portal) {
        const double x = kBegin + kBay * portal;
        for (const double side : {-kHalf, kHalf}) {
            const dvec3 foot(x, 0.0, kRackZ + side);
            steel.add_box(foot - dvec3(0.4, 0.1, 0.4), foot + dvec3(0.4, 0.25, 0.4), kConcrete);
            steel.add_girder(foot, foot + kUp * (top + 0.3), 0.3, 0.3, kRackSteel, 3.0);
            if (portal < kBays) {
                for (const double y : kLevels) {
                    steel.add_girder(
                        {x, y - 0.45, kRackZ + side},
                        {x + kBay, y - 0.45, kRackZ + side},
                        0.2,
                        0.26,
                        kRackSteel * 0.95,
                        3.0
                    );
                }
                if (portal % 4 == 1) {
                    steel.add_bar(
                        foot + kUp * 0.4,
                        foot + dvec3(kBay, 4.0, 0.0),
                        0.1,
                        0.1,
                        kRackSteel * 0.9,
                        3.0
                    );
                }
            }
        }
        for (const double y : kLevels) {
            steel.add_girder(
                {x, y - 0.16, kRackZ - kHalf},
                {x, y - 0.16, kRackZ + kHalf},
                0.22,
                0.3,
                kRackSteel * 0.97,
                3.0
            );
        }
    }
    site.add_whole(steel, "pipe rack");

    Solids pipes;
    Solids trays;
    const double length = kBay * kBays;
    for (std::size_t level = 0; level < kLevels.size(); ++level) {
        double z = kRackZ - kHalf + 0.5;
        int since_tray = 0;
        while (z < kRackZ + kHalf - 0.6) {
            if (level == 2 && ++since_tray % 4 == 0) {
                add_tray(trays, {kBegin - 1.0, kLevels.at(level), z}, length + 2.0);
                z += 0.95;
                continue;
            }
            const PipeService& service =
                pipe_services().at(site.random.bits() % pipe_services().size());
            const double radius = 0.8 * service.radius;
            z += radius + 0.05;
            add_rack_pipe(site, pipes, service, radius, {kBegin, kLevels.at(level), z}, length);
            z += 1.22 * radius + 0.16;
        }
    }
    site.add_whole(pipes, "rack pipes");
    site.add_whole(trays, "cable trays");
    for (int i = 0; i < 18; ++i) {
        const double x = kBegin + kBay * (i + 1) + 3.0;
        if (std::abs(std::abs(x) - kFlightX) > 3.0) {
            site.place(site.pump, {x, 0.0, kRackZ + (i % 2 == 0 ? -3.2 : 3.2)});
        }
    }
}

} // namespace farfield::scenes::plant
