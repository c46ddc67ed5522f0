#include "noise.hpp"
#include "pipe_network.hpp"
#include "plant_layout.hpp"
#include "plant_parts.hpp"
#include "plant_site.hpp"
#include "solids.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

namespace farfield::scenes::plant {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;

const dvec3 kGravel(138.0, 132.0, 120.0);
const dvec3 kAsphalt(96.0, 98.0, 102.0);
const dvec3 kGrass(104.0, 124.0, 72.0);
const dvec3 kHallSheet(196.0, 186.0, 160.0);
const dvec3 kCopper(190.0, 124.0, 84.0);

void add_ground(Site& site) {
    constexpr double kQuad = 5.0;
    Solids ground;
    for (int row = -22; row < 13; ++row) {
        for (int column = -20; column < 20; ++column) {
            const dvec2 at(column * kQuad, row * kQuad);
            const dvec2 middle = at + kQuad / 2.0;
            const bool road = std::abs(middle.y - 15.0) < 5.0 || std::abs(middle.x + 30.0) < 5.0;
            const bool yard = middle.y > -55.0 && std::abs(middle.x) < 75.0;
            ground.add_sheet(
                {at.x, 0.0, at.y},
                {0.0, 0.0, kQuad},
                {kQuad, 0.0, 0.0},
                site.shade(
                    road   ? kAsphalt
                    : yard ? kGravel
                           : kGrass,
                    0.04
                )
            );
        }
    }
    site.add_whole(ground, "ground");
}

void add_tanks(Site& site) {
    const std::array<MeshId, 3> kinds = {
        site.add_part(tank({206.0, 208.0, 204.0}), "white tank"),
        site.add_part(tank({186.0, 164.0, 128.0}), "brown tank"),
        site.add_part(tank({132.0, 158.0, 178.0}), "blue tank")};
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
            const dvec3 at(-68.0 + 14.0 * column, 0.0, 23.0 + 14.0 * row);
            site.place(kinds.at(static_cast<std::size_t>(row + 2 * column) % kinds.size()), at, 0);
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
            dvec3(x, 0.6, 18.2), dvec3(x, 0.6, 17.0), dvec3(x, 10.2, 17.0), dvec3(x, 10.2, kRackZ)};
        solids.add_tube(
            points,
            {.radius = 0.2, .bend = 0.5, .sides = 20, .arc_segments = 8, .longest = 2.0},
            service.color
        );
        add_flanges(solids, {x, 2.0, 17.0}, kUp, 0.2, 20, service.color * 0.85);
        add_flanges(solids, {x, 6.0, 17.0}, kUp, 0.2, 20, service.color * 0.85);
    }
    site.add_whole(solids, "tank yard");
}

/// Two heat exchangers whose shells were taken off: rods through round plates.
void add_exchangers(Site& site) {
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
                    points, {.radius = 0.035, .sides = 8, .longest = 2.0}, site.shade(kCopper, 0.1)
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
                begin + dvec3(along, -1.9, -1.0), begin + dvec3(along + 0.3, -1.1, 1.0), kConcrete
            );
        }
    }
    site.add_whole(solids, "heat exchangers");
}

/// A filter house on legs with hoppers, the flue to the chimney and the chimney.
void add_filter_and_chimney(Site& site) {
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
                at + dvec3(-3.2, 0.0, -2.7), at + dvec3(-3.2, kLow, -2.7), 0.35, 0.35, kSteel, 4.0
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
    site.add_whole(solids, "filter and chimney");
}

/// A heap of coal, and the bridge that carries it to the top of the boiler house.
void add_coal(Site& site) {
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
            const double rough = 0.9 * noise(share.x * 14.0, share.y * 14.0, site.seed);
            const double height = 9.0 * std::max(1.0 - off, 0.0) +
                                  rough * std::min(1.0, 2.0 * std::max(1.0 - off, 0.0));
            const dvec2 at = corner + share * kSide;
            heap.positions.emplace_back(at.x, rim ? 0.0 : std::max(height, 0.0) + 0.02, at.y);
            const double tone = site.random.between(0.75, 1.3);
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
    heap.parts.push_back({0, static_cast<std::uint32_t>(heap.indices.size()), kNone<MaterialId>});
    compute_normals(heap);
    update_bounds(heap);
    io::optimize_for_drawing(heap);
    site.scene.instances.push_back({make_id<MeshId>(site.scene.meshes.size())});
    site.scene.meshes.push_back(std::move(heap));

    Solids bridge;
    const dvec3 from(50.0, 3.0, 36.0);
    const dvec3 to(15.0, 38.0, -14.0);
    const dvec3 along = glm::normalize(to - from);
    const dvec3 side = glm::normalize(glm::cross(along, kUp)) * 1.6;
    constexpr int kFields = 24;
    const auto at = [&](int field, double across, double up) {
        return glm::mix(from, to, static_cast<double>(field) / kFields) + side * across + kUp * up;
    };
    constexpr double kDeep = 2.6;
    for (int field = 0; field < kFields; ++field) {
        for (const double across : {-1.0, 1.0}) {
            for (const double up : {0.0, kDeep}) {
                bridge.add_bar(
                    at(field, across, up), at(field + 1, across, up), 0.18, 0.18, kSteel
                );
            }
            bridge.add_bar(at(field, across, 0.0), at(field, across, kDeep), 0.12, 0.12, kSteel);
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
    site.add_whole(bridge, "coal bridge");
}

void add_switchyard(Site& site) {
    const MeshId post = site.add_part(insulator(), "insulator");
    Solids wires;
    for (int row = 0; row < 7; ++row) {
        const double x = 78.0 + 2.5 * row;
        for (int column = 0; column < 8; ++column) {
            site.place(post, {x, 0.0, -46.0 + 5.0 * column});
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
    site.add_whole(wires, "switchyard");
}

void add_cooling_towers(Site& site) {
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
    site.add_whole(solids, "cooling towers");
}

} // namespace

void add_yard(Site& site) {
    add_ground(site);
    add_tanks(site);
    add_exchangers(site);
    add_filter_and_chimney(site);
    add_coal(site);
    add_switchyard(site);
    add_cooling_towers(site);
}

} // namespace farfield::scenes::plant
