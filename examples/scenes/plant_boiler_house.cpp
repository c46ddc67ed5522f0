#include "plant_layout.hpp"
#include "plant_parts.hpp"
#include "plant_site.hpp"
#include "solids.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace farfield::scenes::plant {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr Area kBoilerHouse = {{-18.0, -50.0}, {18.0, -14.0}};
constexpr Area kFurnace = {{-7.5, -39.5}, {7.5, -24.5}};
constexpr Area kFurnaceHole = {{-8.0, -41.0}, {8.0, -23.0}}; // in the gratings around it
constexpr double kBoilerTop = 42.0;
constexpr Area kRoom = {{-17.6, -43.0}, {-11.3, -29.0}}; // the control room, on the first floor
constexpr double kRoomHeight = 3.2;

const dvec3 kBoilerSheet(178.0, 186.0, 196.0);
const dvec3 kWaterwall(150.0, 104.0, 80.0);

/// Columns, girders, the roof and the walls.
void add_frame(Site& site) {
    Solids solids;
    constexpr double kColumn = 0.5;
    constexpr double kInset = 0.4; // from the cladding
    std::vector<double> lines;
    for (const double x : evenly(kBoilerHouse.lo.x, kBoilerHouse.hi.x + 0.5 * kBay, kBay)) {
        lines.push_back(std::clamp(x, kBoilerHouse.lo.x + kInset, kBoilerHouse.hi.x - kInset));
    }
    constexpr std::array<double, 5> kRows = {-49.6, -41.0, -32.0, -23.0, -14.4};
    const auto stands = [](double x, double z) {
        const bool rim = std::abs(x) > 17.0 || z < -49.0 || z > -15.0;
        return rim || std::abs(std::abs(x) - 12.0) < 0.1;
    };
    for (const double x : lines) {
        for (const double z : kRows) {
            if (stands(x, z)) {
                solids.add_girder(
                    {x, 0.0, z}, {x, kBoilerTop - 0.7, z}, kColumn, kColumn, kSteel, kStorey
                );
            }
        }
    }
    for (int level = 1; level * kStorey < kBoilerTop + 1.0; ++level) {
        const double y = level * kStorey - 0.65;
        for (const double z : kRows) {
            for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
                // None where one climbs to the first floor.
                const bool over_stairs =
                    level == 1 && z == kRows[3] &&
                    std::abs(std::abs(lines[i] + lines[i + 1]) / 2.0 - 15.0) < 1.0;
                if (stands(lines[i], z) && stands(lines[i + 1], z) && !over_stairs) {
                    solids.add_girder(
                        {lines[i], y, z}, {lines[i + 1], y, z}, 0.3, 0.6, kSteel * 0.94, 3.0
                    );
                }
            }
        }
        for (const double x : lines) {
            if (std::abs(std::abs(x) - 12.0) > 0.1 && std::abs(x) < 17.0) {
                continue;
            }
            for (std::size_t i = 0; i + 1 < kRows.size(); ++i) {
                solids.add_girder(
                    {x, y - 0.02, kRows.at(i)},
                    {x, y - 0.02, kRows.at(i + 1)},
                    0.28,
                    0.54,
                    kSteel * 0.9,
                    3.0
                );
            }
        }
    }
    solids.add_box(
        {kBoilerHouse.lo.x - 0.3, kBoilerTop, kBoilerHouse.lo.y - 0.3},
        {kBoilerHouse.hi.x + 0.3, kBoilerTop + 0.4, kBoilerHouse.hi.y + 0.3},
        kConcrete * 0.8,
        kBay
    );
    add_walls(solids, kBoilerHouse, kBoilerTop, 2.0 * kStorey, kBoilerSheet);
    site.add_whole(solids, "boiler house");
}

/// Gratings, slabs, railings and stairs of all floors.
void add_floors(Site& site) {
    const MeshId tile = site.add_part(grating(), "grating");
    const MeshId rail = site.add_part(railing(), "railing");
    const MeshId stairs = site.add_part(flight(), "stairs");
    Solids slabs;
    constexpr double kThick = 0.3;
    constexpr double kSouth = kFlightFoot - kFlightRun; // edge of the strips on both sides
    const auto slab = [&](const Area& area, double y) {
        slabs.add_box(
            {area.lo.x, y - kThick, area.lo.y}, {area.hi.x, y, area.hi.y}, kConcrete, 4.0
        );
    };
    const auto tiles = [&](const Area& area, double y) {
        for (const double z : evenly(area.lo.y, area.hi.y - 0.1, kGratingLength)) {
            for (const double x : evenly(area.lo.x, area.hi.x - 0.1, kGratingWidth)) {
                if (!kFurnaceHole.contains({x + 0.5, z + 1.0})) {
                    site.place(tile, {x, y, z});
                }
            }
        }
    };
    // Along x, or along -z with a quarter turn.
    const auto rails = [&](const dvec2& from, int count, std::uint64_t turns, double y) {
        for (int i = 0; i < count; ++i) {
            const double along = i * kRailingLength;
            site.place(
                rail,
                turns == 0 ? dvec3(from.x + along, y, from.y) : dvec3(from.x, y, from.y - along),
                turns
            );
        }
    };
    for (int floor = 1; floor <= kFloors; ++floor) {
        const double y = floor * kStorey;
        const bool first = floor == 1;
        slab({{-17.5, -49.3}, {17.5, -43.0}}, y);
        slab({{-17.5, -43.0}, {-11.0, kSouth}}, y);
        tiles({{-11.0, -43.0}, {11.0, -21.0}}, y);
        tiles({{11.0, -43.0}, {first ? 17.0 : 15.0, kSouth}}, y);
        if (!first) {
            tiles({{15.0, -33.0}, {17.0, kSouth}}, y);
            rails({14.95, -33.0}, 5, 1, y);
        }
        // Around the hole for the furnace and along the south edges.
        rails({-8.0, -41.05}, 8, 0, y);
        rails({-8.0, -22.95}, 8, 0, y);
        rails({-8.05, -23.0}, 9, 1, y);
        rails({8.05, -23.0}, 9, 1, y);
        rails({-11.0, -21.05}, 11, 0, y);
        rails({-10.95, -21.0}, 3, 1, y);
        rails({10.95, -21.0}, 3, 1, y);
        if (first) {
            rails({14.5, kSouth + 0.05}, 1, 0, y);
            rails({-16.5, kSouth + 0.05}, 1, 0, y);
        } else {
            rails({11.0, kSouth + 0.05}, 3, 0, y);
            rails({-17.0, kSouth + 0.05}, 3, 0, y);
        }
        if (floor < kFloors) {
            site.place(stairs, {16.0, y, -33.0 - kFlightRun}, 2);
        }
    }
    for (const double x : {-kFlightX, kFlightX}) {
        site.place(stairs, {x, 0.0, kFlightFoot});
    }
    site.add_whole(slabs, "slabs");
}

/// Four walls of tubes with a hopper below, stays around them, and drums and headers above.
void add_furnace(Site& site) {
    Solids solids;
    constexpr double kLow = 6.0;
    constexpr double kHigh = 36.0;
    constexpr double kPitch = 0.125;
    constexpr double kTube = 0.045;
    const dvec2 size = kFurnace.hi - kFurnace.lo;
    const auto tube_wall = [&](const dvec2& from, const dvec2& to, double open_below) {
        const int tubes = static_cast<int>(std::lround(glm::distance(from, to) / kPitch));
        for (int tube = 0; tube <= tubes; ++tube) {
            const double share = static_cast<double>(tube) / tubes;
            const dvec2 at = glm::mix(from, to, share);
            // A hatch in the middle of the wall, below this height.
            const bool open = std::abs(share - 0.5) < 0.3;
            const double foot = open ? std::max(open_below, kLow) : kLow;
            const std::array<dvec3, 2> points = {dvec3(at.x, foot, at.y), dvec3(at.x, kHigh, at.y)};
            solids.add_tube(
                points,
                {.radius = kTube, .sides = 8, .longest = 3.75},
                kWaterwall * (0.9 + 0.2 * site.random.unit())
            );
        }
    };
    const dvec2 west_south(kFurnace.lo.x, kFurnace.hi.y);
    const dvec2 east_north(kFurnace.hi.x, kFurnace.lo.y);
    tube_wall(kFurnace.lo, east_north, 13.0); // open to the corridor
    tube_wall(west_south, kFurnace.hi, kLow);
    tube_wall(kFurnace.lo, west_south, kLow);
    tube_wall(east_north, kFurnace.hi, kLow);
    constexpr double kStay = 0.25;
    for (const double y : evenly(9.0, kHigh, 3.0)) {
        const dvec2 lo = kFurnace.lo - 0.2;
        const dvec2 hi = kFurnace.hi + 0.2;
        const std::array<dvec2, 4> corners = {lo, dvec2(hi.x, lo.y), hi, dvec2(lo.x, hi.y)};
        // None across the hatch.
        for (std::size_t side = y < 13.0 ? 1 : 0; side < 4; ++side) {
            const dvec2& a = corners.at(side);
            const dvec2& b = corners.at((side + 1) % 4);
            solids.add_girder({a.x, y, a.y}, {b.x, y, b.y}, kStay, kStay, kSteel * 1.1, 3.0);
        }
    }
    // The hopper for ash, as a frustum of four sheets, and its outlet.
    const dvec2 middle = (kFurnace.lo + kFurnace.hi) / 2.0;
    const auto ring = [&](double share, double y, std::size_t corner) {
        constexpr std::array<dvec2, 4> kCorners = {
            {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}};
        const dvec2 at = middle + kCorners.at(corner % 4) * size * share;
        return dvec3(at.x, y, at.y);
    };
    for (std::size_t side = 0; side < 4; ++side) {
        constexpr int kTubes = 64;
        for (int tube = 0; tube < kTubes; ++tube) {
            const double share = (tube + 0.5) / kTubes;
            const std::array<dvec3, 2> points = {
                glm::mix(ring(0.16, 1.6, side), ring(0.16, 1.6, side + 1), share),
                glm::mix(ring(1.0, kLow, side), ring(1.0, kLow, side + 1), share)};
            solids.add_tube(
                points,
                {.radius = 0.11, .sides = 8, .longest = 3.0},
                kWaterwall * (0.8 + 0.2 * site.random.unit())
            );
        }
    }
    solids.add_box(
        {middle.x - 1.2, 0.0, middle.y - 1.2}, {middle.x + 1.2, 1.6, middle.y + 1.2}, kConcrete
    );
    // The drum and the headers with the risers from the walls.
    const double drum_y = kHigh + 2.6;
    const std::array<dvec2, 8> drum = {
        {{0.0, -9.6},
         {0.45, -9.5},
         {0.8, -9.25},
         {0.95, -8.8},
         {0.95, 8.8},
         {0.8, 9.25},
         {0.45, 9.5},
         {0.0, 9.6}}};
    solids.add_lathe({0.0, drum_y, kFurnace.hi.y}, kX, drum, 32, kCasing);
    for (const double z : {kFurnace.lo.y, kFurnace.hi.y}) {
        solids.add_cylinder({-8.0, kHigh + 0.2, z}, kX, 0.3, 16.0, 20, kCasing * 0.9);
    }
    for (int riser = 0; riser < 24; ++riser) {
        const double x = -7.2 + 14.4 * riser / 23.0;
        for (const double z : {kFurnace.lo.y, kFurnace.hi.y}) {
            const std::array<dvec3, 3> points = {
                dvec3(x, kHigh + 0.2, z),
                dvec3(x, drum_y, z == kFurnace.hi.y ? z + 0.01 : z),
                dvec3(x, drum_y, kFurnace.hi.y)};
            const std::span<const dvec3> way(points.data(), z == kFurnace.hi.y ? 2 : 3);
            solids.add_tube(
                way, {.radius = 0.08, .bend = 0.4, .sides = 10, .longest = 4.0}, kCasing * 0.85
            );
        }
    }
    // Burners in rows on the south wall, each with its coal pipe.
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) {
            const dvec3 at(-5.4 + 3.6 * column, 10.5 + 3.0 * row, kFurnace.hi.y);
            const std::array<dvec2, 6> burner = {
                {{0.0, 0.0}, {0.75, 0.0}, {0.75, 0.5}, {0.4, 0.8}, {0.3, 1.3}, {0.0, 1.3}}};
            solids.add_lathe(at, {0.0, 0.0, 1.0}, burner, 24, kSteel * 0.8);
        }
    }
    site.add_whole(solids, "furnace");
}

void add_bundles(Site& site) {
    // Behind the hatch and above it, one over the other.
    for (int i = 0; i < 4; ++i) {
        add_bundle(site, {0.0, 8.0 + 3.0 * i, kFurnace.lo.y + 4.0});
    }
    Solids headers;
    for (int i = 0; i < 4; ++i) {
        for (const double x : {-3.3, 3.3}) {
            for (const double y : {0.05, kPanelHeight - 0.05}) {
                headers.add_cylinder(
                    {x, 8.0 + 3.0 * i + y, kFurnace.lo.y + 0.5},
                    {0.0, 0.0, 1.0},
                    0.16,
                    7.0,
                    16,
                    kCasing * 0.8
                );
            }
        }
    }
    site.add_whole(headers, "headers");
}

void add_control_room(Site& site) {
    constexpr double kFloor = kStorey;
    constexpr double kWall = 0.15;
    constexpr double kDoor = 0.8; // half of one
    constexpr double kDoorTop = 2.3;
    Solids solids;
    const dvec3 paint(214.0, 212.0, 198.0);
    // North and south walls with a door each, a lintel over it.
    for (const double z : {kRoom.lo.y, kRoom.hi.y - kWall}) {
        const auto part = [&](double from, double to, double low) {
            solids.add_box(
                {from, kFloor + low, z}, {to, kFloor + kRoomHeight, z + kWall}, paint, 2.0
            );
        };
        part(kRoom.lo.x, -kFlightX - kDoor, 0.0);
        part(-kFlightX - kDoor, -kFlightX + kDoor, kDoorTop);
        part(-kFlightX + kDoor, kRoom.hi.x, 0.0);
    }
    // The east wall with a row of windows towards the furnace.
    const double east = kRoom.hi.x - kWall;
    const auto band = [&](double low, double high, const dvec3& color) {
        solids.add_box(
            {east, kFloor + low, kRoom.lo.y + kWall},
            {east + kWall, kFloor + high, kRoom.hi.y - kWall},
            color,
            2.0
        );
    };
    band(0.0, 1.0, paint);
    band(2.3, kRoomHeight, paint);
    for (const double z : evenly(kRoom.lo.y + kWall + 0.05, kRoom.hi.y - kWall, 1.7)) {
        solids.add_box(
            {east + 0.04, kFloor + 1.0, z}, {east + 0.11, kFloor + 2.3, z + 0.08}, kSteel * 0.6
        );
    }
    solids.add_box(
        {kRoom.lo.x, kFloor + kRoomHeight, kRoom.lo.y},
        {kRoom.hi.x, kFloor + kRoomHeight + 0.2, kRoom.hi.y},
        kWhite * 0.92,
        2.0
    );
    // Lamps below the ceiling.
    for (const double z : evenly(kRoom.lo.y + 1.5, kRoom.hi.y - 1.5, 2.4)) {
        for (const double x : {-16.0, -12.6}) {
            solids.add_box(
                {x, kFloor + kRoomHeight - 0.12, z},
                {x + 0.3, kFloor + kRoomHeight - 0.02, z + 1.4},
                kWhite * 1.1
            );
        }
    }
    site.add_whole(solids, "control room");
    const MeshId desks = site.add_part(desk(), "desk");
    for (const double z : evenly(kRoom.lo.y + 1.6, kRoom.hi.y - 1.2, 2.1)) {
        site.place(desks, {-16.3, kFloor, z}, 1);
    }
    const MeshId cabinets = site.add_part(cabinet(), "cabinet");
    for (const double z : evenly(kRoom.lo.y + 2.6, kRoom.hi.y - 0.6, 0.84)) {
        const bool column = std::abs(z + 32.0) < 0.75 || std::abs(z + 41.0) < 0.75;
        if (!column) {
            site.place(cabinets, {east - 0.3, kFloor, z}, 3);
        }
    }
    for (const double x : evenly(-8.0, 9.0, 0.84)) {
        site.place(cabinets, {x, kFloor, -48.9});
    }
}

} // namespace

void add_boiler_house(Site& site, const PipeLayer& pipes) {
    add_frame(site);
    add_floors(site);
    add_furnace(site);
    add_bundles(site);
    add_control_room(site);
    // South of the furnace from the first floor up, and over the control room.
    site.fill(pipes, {-11.0, 8.0, -20.8}, {22, 12, 6}, 1.0, 160'000);
    site.fill(pipes, {-17.4, 10.7, -42.8}, {7, 3, 16}, 0.85, 80'000);
}

} // namespace farfield::scenes::plant
