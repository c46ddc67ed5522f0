#include "plant.hpp"

#include "noise.hpp"
#include "pipe_network.hpp"
#include "plant_layout.hpp"
#include "plant_parts.hpp"
#include "quarter_turn.hpp"
#include "random.hpp"
#include "solids.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/common.hpp>
#include <glm/ext/vector_int3.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace farfield::scenes {

namespace {

using glm::dvec2;
using glm::dvec3;
using glm::ivec3;
using namespace plant;

constexpr int kMaxPanels = 120;
constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kBay = 6.0; // between columns
// Triangles of pipework in the boiler house and in the turbine hall.
constexpr int kBoilerPipes = 240'000;
constexpr int kHallPipes = 120'000;

const dvec3 kUp(0.0, 1.0, 0.0);
const dvec3 kX(1.0, 0.0, 0.0);

const dvec3 kGravel(138.0, 132.0, 120.0);
const dvec3 kAsphalt(96.0, 98.0, 102.0);
const dvec3 kGrass(104.0, 124.0, 72.0);
const dvec3 kConcrete(160.0, 158.0, 152.0);
const dvec3 kSteel(98.0, 116.0, 128.0);
const dvec3 kRackSteel(132.0, 140.0, 146.0);
const dvec3 kGalvanized(168.0, 172.0, 174.0);
const dvec3 kBoilerSheet(178.0, 186.0, 196.0);
const dvec3 kHallSheet(196.0, 186.0, 160.0);
const dvec3 kWaterwall(150.0, 104.0, 80.0);
const dvec3 kCasing(190.0, 192.0, 192.0);
const dvec3 kTurbine(116.0, 150.0, 168.0);
const dvec3 kGenerator(84.0, 120.0, 92.0);
const dvec3 kCoal(46.0, 45.0, 46.0);
const dvec3 kBrick(168.0, 82.0, 66.0);
const dvec3 kWhite(226.0, 226.0, 222.0);
const dvec3 kCopper(190.0, 124.0, 84.0);

/// A rectangle of a floor. [m]
struct Area {
    dvec2 lo{0.0};
    dvec2 hi{0.0};

    [[nodiscard]] bool contains(const dvec2& at) const noexcept {
        return at.x > lo.x && at.y > lo.y && at.x < hi.x && at.y < hi.y;
    }
};

constexpr Area kBoilerHouse = {{-18.0, -50.0}, {18.0, -14.0}};
constexpr Area kFurnace = {{-7.5, -39.5}, {7.5, -24.5}};
constexpr Area kFurnaceHole = {{-8.0, -41.0}, {8.0, -23.0}}; // in the gratings around it
constexpr double kBoilerTop = 42.0;
constexpr Area kHall = {{24.0, -46.0}, {72.0, -16.0}};
constexpr double kHallTop = 20.0;
constexpr Area kRoom = {{-17.6, -43.0}, {-11.3, -29.0}}; // the control room, on the first floor
constexpr double kRoomHeight = 3.2;

class Builder {
  public:
    explicit Builder(const PlantOptions& options) : options_(options), random_(options.seed) {
        scene_.name = "plant";
        scene_.sky = glm::vec3(0.72F, 0.80F, 0.88F);
    }

    Scene build() {
        add_ground();
        add_boiler_house();
        add_floors();
        add_furnace();
        add_bundles();
        add_control_room();
        add_hall();
        add_rack();
        add_tanks();
        add_exchangers();
        add_filter_and_chimney();
        add_coal();
        add_switchyard();
        add_cooling_towers();
        add_pipework();
        return std::move(scene_);
    }

  private:
    MeshId add_mesh(Solids& solids, const char* name, bool splittable) {
        Mesh mesh = solids.finish(name, splittable);
        io::optimize_for_drawing(mesh);
        scene_.meshes.push_back(std::move(mesh));
        return make_id<MeshId>(scene_.meshes.size() - 1);
    }

    /// What there is once.
    void add_whole(Solids& solids, const char* name) {
        const MeshId mesh = add_mesh(solids, name, true);
        scene_.instances.push_back({mesh});
    }

    MeshId add_part(Solids solids, const char* name) { return add_mesh(solids, name, false); }

    /// A part at a place, turned from +z towards +x by quarter turns.
    void place(MeshId mesh, const dvec3& at, std::uint64_t turns = 0) {
        scene_.instances.push_back({mesh, quarter_turned(turns, 1.0, at)});
    }

    dvec3 shade(const dvec3& color, double by = 0.05) {
        return color * random_.between(1.0 - by, 1.0 + by);
    }

    void add_ground() {
        constexpr double kQuad = 5.0;
        Solids ground;
        for (int row = -22; row < 13; ++row) {
            for (int column = -20; column < 20; ++column) {
                const dvec2 at(column * kQuad, row * kQuad);
                const dvec2 middle = at + kQuad / 2.0;
                const bool road =
                    std::abs(middle.y - 15.0) < 5.0 || std::abs(middle.x + 30.0) < 5.0;
                const bool yard = middle.y > -55.0 && std::abs(middle.x) < 75.0;
                ground.add_sheet(
                    {at.x, 0.0, at.y},
                    {0.0, 0.0, kQuad},
                    {kQuad, 0.0, 0.0},
                    shade(
                        road   ? kAsphalt
                        : yard ? kGravel
                               : kGrass,
                        0.04
                    )
                );
            }
        }
        add_whole(ground, "ground");
    }

    /// Sheet metal folded along its height, between two corners of a building seen from outside
    /// from left to right, from one height to another.
    void add_cladding(
        Solids& solids,
        const dvec2& from,
        const dvec2& to,
        double low,
        double high,
        const dvec3& color
    ) {
        constexpr double kFold = 0.6;
        const dvec2 way = to - from;
        const double length = glm::length(way);
        const dvec2 along = way / length;
        const dvec3 out(-along.y, 0.0, along.x);
        const int folds = std::max(static_cast<int>(std::lround(length / kFold)), 1);
        const double width = length / folds;
        const dvec3 step(along.x * width, 0.0, along.y * width);
        // Across a fold: in, slope out, out, slope in.
        constexpr std::array<dvec2, 5> kProfile = {
            {{0.0, 0.0}, {0.4, 0.0}, {0.5, 0.06}, {0.9, 0.06}, {1.0, 0.0}}};
        for (int fold = 0; fold < folds; ++fold) {
            const dvec3 foot = dvec3(from.x, low, from.y) + step * static_cast<double>(fold);
            for (std::size_t i = 0; i + 1 < kProfile.size(); ++i) {
                const dvec3 left = foot + step * kProfile.at(i).x + out * kProfile.at(i).y;
                const dvec3 right = foot + step * kProfile.at(i + 1).x + out * kProfile.at(i + 1).y;
                solids.add_sheet(left, right - left, kUp * (high - low), color, kStorey);
            }
        }
    }

    /// All four walls of a house; its south wall begins higher up.
    void add_walls(Solids& solids, const Area& area, double top, double south, const dvec3& color) {
        add_cladding(solids, {area.lo.x, area.hi.y}, area.hi, south, top, color);
        add_cladding(solids, area.hi, {area.hi.x, area.lo.y}, 0.0, top, color * 0.97);
        add_cladding(solids, {area.hi.x, area.lo.y}, area.lo, 0.0, top, color * 0.95);
        add_cladding(solids, area.lo, {area.lo.x, area.hi.y}, 0.0, top, color * 0.97);
    }

    void add_boiler_house() {
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
        add_whole(solids, "boiler house");
    }

    /// Gratings, slabs, railings and stairs of all floors.
    void add_floors() {
        const MeshId tile = add_part(grating(), "grating");
        const MeshId rail = add_part(railing(), "railing");
        const MeshId stairs = add_part(flight(), "stairs");
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
                        place(tile, {x, y, z});
                    }
                }
            }
        };
        // Along x, or along -z with a quarter turn.
        const auto rails = [&](const dvec2& from, int count, std::uint64_t turns, double y) {
            for (int i = 0; i < count; ++i) {
                const double along = i * kRailingLength;
                place(
                    rail,
                    turns == 0 ? dvec3(from.x + along, y, from.y)
                               : dvec3(from.x, y, from.y - along),
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
                place(stairs, {16.0, y, -33.0 - kFlightRun}, 2);
            }
        }
        for (const double x : {-kFlightX, kFlightX}) {
            place(stairs, {x, 0.0, kFlightFoot});
        }
        add_whole(slabs, "slabs");
    }

    /// Four walls of tubes with a hopper below, stays around them, and drums and headers above.
    void add_furnace() {
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
                const std::array<dvec3, 2> points = {
                    dvec3(at.x, foot, at.y), dvec3(at.x, kHigh, at.y)};
                solids.add_tube(
                    points,
                    {.radius = kTube, .sides = 8, .longest = 3.75},
                    kWaterwall * (0.9 + 0.2 * random_.unit())
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
                    kWaterwall * (0.8 + 0.2 * random_.unit())
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
        add_whole(solids, "furnace");
    }

    /// Panels hung side by side: the most triangles in the least space.
    void add_bundle(MeshId panel, const dvec3& middle) {
        constexpr double kWidth = 6.6;
        for (int i = 0; i < options_.panels; ++i) {
            const double z = kWidth * ((i + 0.5) / options_.panels - 0.5);
            place(panel, middle + dvec3(0.0, 0.0, z));
        }
    }

    void add_bundles() {
        const MeshId panel = add_part(tube_panel(), "tube panel");
        // Behind the hatch and above it, one over the other, and one below the turbine.
        for (int i = 0; i < 4; ++i) {
            add_bundle(panel, {0.0, 8.0 + 3.0 * i, kFurnace.lo.y + 4.0});
        }
        add_bundle(panel, {45.0, 1.2, -31.0});
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
        add_whole(headers, "headers");
    }

    void add_control_room() {
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
        add_whole(solids, "control room");
        const MeshId desks = add_part(desk(), "desk");
        for (const double z : evenly(kRoom.lo.y + 1.6, kRoom.hi.y - 1.2, 2.1)) {
            place(desks, {-16.3, kFloor, z}, 1);
        }
        const MeshId cabinets = add_part(cabinet(), "cabinet");
        for (const double z : evenly(kRoom.lo.y + 2.6, kRoom.hi.y - 0.6, 0.84)) {
            const bool column = std::abs(z + 32.0) < 0.75 || std::abs(z + 41.0) < 0.75;
            if (!column) {
                place(cabinets, {east - 0.3, kFloor, z}, 3);
            }
        }
        for (const double x : evenly(-8.0, 9.0, 0.84)) {
            place(cabinets, {x, kFloor, -48.9});
        }
    }

    void add_hall() {
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
        add_whole(shell, "turbine hall");
        add_turbine();
        const MeshId feed = add_part(pump(), "pump");
        pump_ = feed;
        for (int i = 0; i < 8; ++i) {
            place(feed, {29.0 + 5.0 * i, 0.0, -18.6});
        }
    }

    /// The machine on its table, the condenser below.
    void add_turbine() {
        Solids solids;
        constexpr double kTable = 6.0;
        solids.add_box({34.0, kTable - 0.8, -37.0}, {68.0, kTable, -25.0}, kConcrete, 3.0);
        for (const double x : evenly(35.0, 68.0, 8.0)) {
            for (const double z : {-36.2, -25.8}) {
                solids.add_box(
                    {x - 0.6, 0.0, z - 0.6}, {x + 0.6, kTable - 0.8, z + 0.6}, kConcrete
                );
            }
        }
        const auto casing = [&](double x, double radius, double length, const dvec3& color) {
            std::vector<dvec2> profile = {
                {0.0, 0.0}, {0.45 * radius, 0.0}, {0.5 * radius, 0.12 * length}};
            constexpr int kRibs = 6;
            for (int rib = 0; rib < kRibs; ++rib) {
                const double at = length * (0.16 + 0.68 * rib / kRibs);
                const double swell =
                    radius *
                    (0.72 + 0.28 * std::sin(std::numbers::pi * (rib + 1.0) / (kRibs + 1.0)));
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
                profile.end(),
                {{0.5 * radius, 0.88 * length}, {0.45 * radius, length}, {0.0, length}}
            );
            solids.add_lathe({x, kTable + 1.6, -31.0}, kX, profile, 48, color);
            solids.add_box(
                {x + 0.1 * length, kTable, -32.6},
                {x + 0.9 * length, kTable + 0.7, -29.4},
                color * 0.8
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
        add_whole(solids, "turbine");
    }

    /// Portals with pipes on three levels and trays of cables on the uppermost.
    void add_rack() {
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
        add_whole(steel, "pipe rack");

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
                    pipe_services().at(random_.bits() % pipe_services().size());
                const double radius = 0.8 * service.radius;
                z += radius + 0.05;
                add_rack_pipe(pipes, service, radius, {kBegin, kLevels.at(level), z}, length);
                z += 1.22 * radius + 0.16;
            }
        }
        add_whole(pipes, "rack pipes");
        add_whole(trays, "cable trays");
        for (int i = 0; i < 18; ++i) {
            const double x = kBegin + kBay * (i + 1) + 3.0;
            if (std::abs(std::abs(x) - kFlightX) > 3.0) {
                place(pump_, {x, 0.0, kRackZ + (i % 2 == 0 ? -3.2 : 3.2)});
            }
        }
    }

    /// One pipe along the rack, its foot at a height, with flanges here and there; some of them
    /// leave it for the boiler house or the turbine hall.
    void add_rack_pipe(
        Solids& pipes, const PipeService& service, double radius, const dvec3& begin, double length
    ) {
        const double y = begin.y + radius;
        const double end = begin.x + length;
        const dvec3 color = shade(service.color);
        std::vector<dvec3> points = {{begin.x - 1.0, y, begin.z}};
        const double kind = random_.unit();
        if (kind < 0.5) {
            // Up and over the others, between two columns, into the boiler house or the hall.
            const bool boiler = kind < 0.3;
            const double bay = boiler ? -12.0 + kBay * static_cast<double>(random_.bits() % 4)
                                      : 24.0 + kBay * static_cast<double>(random_.bits() % 5);
            const double x = bay + random_.between(1.2, 4.8);
            const double above = random_.between(11.2, 12.6);
            points.insert(
                points.end(),
                {{x, y, begin.z}, {x, above, begin.z}, {x, above, boiler ? -14.9 : -18.0}}
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
            if (random_.unit() < 0.36) {
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
                at + dvec3(x, 0.02, 0.01),
                at + dvec3(x, 0.02, kWidth - 0.01),
                0.04,
                0.02,
                kGalvanized
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

    void add_tanks() {
        const std::array<MeshId, 3> kinds = {
            add_part(tank({206.0, 208.0, 204.0}), "white tank"),
            add_part(tank({186.0, 164.0, 128.0}), "brown tank"),
            add_part(tank({132.0, 158.0, 178.0}), "blue tank")};
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
                const dvec3 at(-68.0 + 14.0 * column, 0.0, 23.0 + 14.0 * row);
                place(kinds.at(static_cast<std::size_t>(row + 2 * column) % kinds.size()), at, 0);
            }
        }
        // A wall around them, open where the lane goes through, and pipes to the rack.
        Solids solids;
        constexpr double kHigh = 0.9;
        const auto wall = [&](const dvec2& lo, const dvec2& hi) {
            solids.add_box({lo.x, 0.0, lo.y}, {hi.x, kHigh, hi.y}, kConcrete * 1.05, 4.0);
        };
        wall({-76.0, 15.6}, {kTankLaneX - 1.5, 15.9});
        wall({kTankLaneX + 1.5, 15.6}, {-32.0, 15.9});
        wall({-76.0, 15.9}, {-75.7, 58.0});
        wall({-32.3, 15.9}, {-32.0, 58.0});
        for (int column = 0; column < 3; ++column) {
            const double x = -66.0 + 14.0 * column;
            const PipeService& service = pipe_services().at(static_cast<std::size_t>(column) + 1);
            const std::array<dvec3, 4> points = {
                dvec3(x, 0.6, 18.2),
                dvec3(x, 0.6, 17.0),
                dvec3(x, 10.2, 17.0),
                dvec3(x, 10.2, kRackZ)};
            solids.add_tube(
                points,
                {.radius = 0.2, .bend = 0.5, .sides = 20, .arc_segments = 8, .longest = 2.0},
                service.color
            );
            add_flanges(solids, {x, 2.0, 17.0}, kUp, 0.2, 20, service.color * 0.85);
            add_flanges(solids, {x, 6.0, 17.0}, kUp, 0.2, 20, service.color * 0.85);
        }
        add_whole(solids, "tank yard");
    }

    /// Two heat exchangers whose shells were taken off: rods through round plates.
    void add_exchangers() {
        Solids solids;
        for (const double x : {-26.0, 2.0}) {
            const dvec3 begin(x, 1.9, 21.0);
            constexpr double kLength = 8.0;
            constexpr double kRadius = 1.2;
            constexpr double kPitch = 0.11;
            for (const double y : evenly(-kRadius, kRadius + 0.5 * kPitch, kPitch)) {
                for (const double z : evenly(-kRadius, kRadius + 0.5 * kPitch, kPitch)) {
                    if (y * y + z * z > 0.9 * kRadius * kRadius) {
                        continue;
                    }
                    const std::array<dvec3, 2> points = {
                        begin + dvec3(0.0, y, z), begin + dvec3(kLength, y, z)};
                    solids.add_tube(
                        points, {.radius = 0.035, .sides = 8, .longest = 2.0}, shade(kCopper, 0.1)
                    );
                }
            }
            for (const double along : evenly(0.0, kLength + 0.5, 1.0)) {
                solids.add_cylinder(
                    begin + kX * (along - 0.02), kX, kRadius + 0.03, 0.04, 40, kSteel * 0.9
                );
            }
            const std::array<dvec2, 6> head = {
                {{0.0, 0.0}, {0.6, 0.05}, {1.1, 0.3}, {1.3, 0.7}, {1.3, 1.0}, {0.0, 1.0}}};
            solids.add_lathe(begin - kX * 1.05, kX, head, 40, kGenerator);
            for (const double along : {1.5, 6.5}) {
                solids.add_box(
                    begin + dvec3(along, -1.9, -1.0),
                    begin + dvec3(along + 0.3, -1.1, 1.0),
                    kConcrete
                );
            }
        }
        add_whole(solids, "heat exchangers");
    }

    /// A filter house on legs with hoppers, the flue to the chimney and the chimney.
    void add_filter_and_chimney() {
        Solids solids;
        const Area house = {{-14.0, -74.0}, {14.0, -56.0}};
        constexpr double kLow = 8.0;
        constexpr double kHigh = 20.0;
        solids.add_box(
            {house.lo.x, kLow, house.lo.y}, {house.hi.x, kHigh, house.hi.y}, kCasing * 0.85, 3.0
        );
        for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 4; ++column) {
                const dvec3 at(house.lo.x + 3.5 + 7.0 * column, 0.0, house.lo.y + 3.0 + 6.0 * row);
                const std::array<dvec2, 5> hopper = {
                    {{0.0, 2.6}, {0.25, 2.6}, {0.3, 3.4}, {2.9, kLow}, {0.0, kLow}}};
                solids.add_lathe(at, kUp, hopper, 4, kCasing * 0.75);
                solids.add_girder(
                    at + dvec3(3.2, 0.0, 2.7), at + dvec3(3.2, kLow, 2.7), 0.35, 0.35, kSteel, 4.0
                );
                solids.add_girder(
                    at + dvec3(-3.2, 0.0, -2.7),
                    at + dvec3(-3.2, kLow, -2.7),
                    0.35,
                    0.35,
                    kSteel,
                    4.0
                );
            }
        }
        for (const double x : evenly(house.lo.x, house.hi.x + 1.0, 2.0)) {
            solids.add_girder(
                {x, kLow, house.hi.y + 0.1}, {x, kHigh, house.hi.y + 0.1}, 0.2, 0.2, kSteel, 3.0
            );
        }
        // Flues from the boiler house and to the chimney.
        solids.add_box({-4.0, 14.0, -56.0}, {4.0, 19.0, -49.5}, kCasing * 0.8, 3.0);
        solids.add_box({-3.0, 12.0, -84.0}, {3.0, 17.0, -74.0}, kCasing * 0.8, 3.0);
        constexpr double kChimney = 95.0;
        constexpr int kBands = 19;
        for (int band = 0; band < kBands; ++band) {
            const auto radius = [](double share) { return 5.0 - 2.2 * share; };
            const double low = static_cast<double>(band) / kBands;
            const double high = (band + 1.0) / kBands;
            const std::array<dvec2, 2> profile = {
                {{radius(low), kChimney * low}, {radius(high), kChimney * high}}};
            const bool red = band > 12 && band % 2 == 1;
            solids.add_lathe(
                {0.0, 0.0, -88.0}, kUp, profile, 48, red ? dvec3(188.0, 60.0, 50.0) : kWhite * 0.86
            );
        }
        const std::array<dvec2, 4> mouth = {
            {{2.8, kChimney}, {2.4, kChimney}, {2.4, kChimney - 3.0}, {0.0, kChimney - 3.0}}};
        solids.add_lathe({0.0, 0.0, -88.0}, kUp, mouth, 48, kCoal);
        add_whole(solids, "filter and chimney");
    }

    /// A heap of coal, and the bridge that carries it to the top of the boiler house.
    void add_coal() {
        constexpr int kPosts = 64;
        constexpr double kSide = 44.0;
        const dvec2 corner(44.0, 14.0);
        Mesh heap;
        heap.name = "coal";
        heap.splittable = true;
        for (int row = 0; row <= kPosts; ++row) {
            for (int column = 0; column <= kPosts; ++column) {
                const dvec2 share(
                    static_cast<double>(column) / kPosts, static_cast<double>(row) / kPosts
                );
                const double off = glm::length((share - 0.5) * dvec2(1.0, 1.35)) * 2.0;
                const bool rim = row % kPosts == 0 || column % kPosts == 0;
                const double rough = 0.9 * noise(share.x * 14.0, share.y * 14.0, options_.seed);
                const double height = 9.0 * std::max(1.0 - off, 0.0) +
                                      rough * std::min(1.0, 2.0 * std::max(1.0 - off, 0.0));
                const dvec2 at = corner + share * kSide;
                heap.positions.emplace_back(at.x, rim ? 0.0 : std::max(height, 0.0) + 0.02, at.y);
                const double tone = random_.between(0.75, 1.3);
                heap.colors.emplace_back(
                    static_cast<std::uint8_t>(kCoal.x * tone),
                    static_cast<std::uint8_t>(kCoal.y * tone),
                    static_cast<std::uint8_t>(kCoal.z * tone),
                    255
                );
            }
        }
        for (std::uint32_t row = 0; row < kPosts; ++row) {
            for (std::uint32_t column = 0; column < kPosts; ++column) {
                const std::uint32_t here = row * (kPosts + 1) + column;
                const std::uint32_t below = here + kPosts + 1;
                heap.indices.insert(
                    heap.indices.end(), {here, below, below + 1, here, below + 1, here + 1}
                );
            }
        }
        heap.parts.push_back({0, static_cast<std::uint32_t>(heap.indices.size()), kNone<MaterialId>}
        );
        compute_normals(heap);
        update_bounds(heap);
        io::optimize_for_drawing(heap);
        scene_.instances.push_back({make_id<MeshId>(scene_.meshes.size())});
        scene_.meshes.push_back(std::move(heap));

        Solids bridge;
        const dvec3 from(50.0, 3.0, 36.0);
        const dvec3 to(15.0, 38.0, -14.0);
        const dvec3 along = glm::normalize(to - from);
        const dvec3 side = glm::normalize(glm::cross(along, kUp)) * 1.6;
        constexpr int kFields = 24;
        const auto at = [&](int field, double across, double up) {
            return glm::mix(from, to, static_cast<double>(field) / kFields) + side * across +
                   kUp * up;
        };
        constexpr double kDeep = 2.6;
        for (int field = 0; field < kFields; ++field) {
            for (const double across : {-1.0, 1.0}) {
                for (const double up : {0.0, kDeep}) {
                    bridge.add_bar(
                        at(field, across, up), at(field + 1, across, up), 0.18, 0.18, kSteel
                    );
                }
                bridge.add_bar(
                    at(field, across, 0.0), at(field, across, kDeep), 0.12, 0.12, kSteel
                );
                bridge.add_bar(
                    at(field, across, field % 2 == 0 ? 0.0 : kDeep),
                    at(field + 1, across, field % 2 == 0 ? kDeep : 0.0),
                    0.1,
                    0.1,
                    kSteel * 0.9
                );
            }
            bridge.add_bar(at(field, 0.0, kDeep), at(field + 1, 0.0, kDeep), 3.4, 0.08, kHallSheet);
            bridge.add_bar(at(field, 0.0, 0.5), at(field + 1, 0.0, 0.5), 1.2, 0.1, kCoal);
            for (const double across : {-0.3, 0.3}) {
                bridge.add_cylinder(
                    at(field, across - 0.2, 0.35), glm::normalize(side), 0.07, 0.6, 10, kGalvanized
                );
            }
        }
        for (const int field : {6, 12, 18}) {
            for (const double across : {-1.0, 1.0}) {
                const dvec3 top = at(field, across, 0.0);
                bridge.add_girder({top.x, 0.0, top.z}, top, 0.4, 0.4, kSteel * 0.95, 4.0);
            }
        }
        add_whole(bridge, "coal bridge");
    }

    void add_switchyard() {
        const MeshId post = add_part(insulator(), "insulator");
        Solids wires;
        for (int row = 0; row < 7; ++row) {
            const double x = 78.0 + 2.5 * row;
            for (int column = 0; column < 8; ++column) {
                place(post, {x, 0.0, -46.0 + 5.0 * column});
            }
            wires.add_cylinder({x, 3.9, -47.0}, {0.0, 0.0, 1.0}, 0.06, 37.0, 10, kGalvanized);
        }
        for (const double z : {-14.0, -6.0}) {
            const dvec3 at(84.0, 0.0, z);
            wires.add_box(at + dvec3(-2.5, 0.3, -1.6), at + dvec3(2.5, 3.4, 1.6), kGenerator, 1.5);
            for (int fin = 0; fin < 24; ++fin) {
                const double x = -2.4 + 0.2 * fin;
                wires.add_box(
                    at + dvec3(x, 0.7, 1.62), at + dvec3(x + 0.05, 3.0, 2.2), kGenerator * 0.9
                );
            }
        }
        add_whole(wires, "switchyard");
    }

    void add_cooling_towers() {
        Solids solids;
        constexpr double kHigh = 58.0;
        constexpr int kRings = 20;
        for (const dvec2& at : {dvec2(-68.0, -82.0), dvec2(62.0, -84.0)}) {
            // Outside up, over the rim and inside down again.
            const auto radius = [](double share) {
                const double waist = (share - 0.75) / 0.75;
                return 12.5 * std::sqrt(1.0 + 1.6 * waist * waist);
            };
            std::vector<dvec2> profile;
            for (int ring = 0; ring <= kRings; ++ring) {
                const double share = static_cast<double>(ring) / kRings;
                profile.emplace_back(radius(share), 5.0 + (kHigh - 5.0) * share);
            }
            for (int ring = kRings; ring >= 0; --ring) {
                const double share = static_cast<double>(ring) / kRings;
                profile.emplace_back(radius(share) - 0.5, 5.0 + (kHigh - 5.0) * share);
            }
            profile.push_back(profile.front());
            solids.add_lathe({at.x, 0.0, at.y}, kUp, profile, 72, kConcrete * 1.08);
            constexpr int kLegs = 36;
            for (int leg = 0; leg < kLegs; ++leg) {
                const double foot = kTwoPi * leg / kLegs;
                const auto around = [&](double angle, double y) {
                    const double r = radius(0.0) - 0.25;
                    return dvec3(at.x + r * std::cos(angle), y, at.y + r * std::sin(angle));
                };
                for (const double lean : {-0.5, 0.5}) {
                    solids.add_bar(
                        around(foot, 0.0),
                        around(foot + lean * kTwoPi / kLegs, 5.1),
                        0.4,
                        0.4,
                        kConcrete
                    );
                }
            }
        }
        add_whole(solids, "cooling towers");
    }

    void add_pipework() {
        const PipeLayer layer(scene_, random_);
        const auto fill = [&](const dvec3& corner, const ivec3& nodes, double spacing, int triangles
                          ) {
            PipeLattice lattice;
            lattice.corner = corner;
            lattice.spacing = spacing;
            lattice.nodes = nodes;
            lattice.taken.assign(
                static_cast<std::size_t>(nodes.x) * static_cast<std::size_t>(nodes.y) *
                    static_cast<std::size_t>(nodes.z),
                false
            );
            layer.lay(scene_, lattice, triangles, random_);
        };
        // South of the furnace from the first floor up, over the control room, and in the hall.
        fill({-11.0, 8.0, -20.8}, {22, 12, 6}, 1.0, kBoilerPipes * 2 / 3);
        fill({-17.4, 10.7, -42.8}, {7, 3, 16}, 0.85, kBoilerPipes / 3);
        fill({28.0, 0.0, -45.6}, {30, 5, 6}, 1.1, kHallPipes);
    }

    PlantOptions options_;
    Random random_;
    Scene scene_;
    MeshId pump_ = kNone<MeshId>;
};

} // namespace

Result<void> validate(const PlantOptions& options) {
    if (options.panels < 1 || options.panels > kMaxPanels) {
        return fail(
            ErrorCode::invalid_argument,
            "plant: panels is " + std::to_string(options.panels) + ", expected 1 to " +
                std::to_string(kMaxPanels)
        );
    }
    return {};
}

Result<Scene> make_plant(const PlantOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    return Builder(options).build();
}

} // namespace farfield::scenes
