#include "plant_parts.hpp"

#include <glm/vec2.hpp>

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

constexpr double kTwoPi = 2.0 * std::numbers::pi;

const dvec3 kX(1.0, 0.0, 0.0);
const dvec3 kUp(0.0, 1.0, 0.0);
const dvec3 kZ(0.0, 0.0, 1.0);

const dvec3 kGalvanized(164.0, 168.0, 170.0);
const dvec3 kSafetyYellow(226.0, 182.0, 36.0);
const dvec3 kTubeRust(146.0, 96.0, 70.0);
const dvec3 kMachineGreen(70.0, 124.0, 104.0);
const dvec3 kMotorBlue(54.0, 92.0, 146.0);
const dvec3 kDark(44.0, 46.0, 50.0);
const dvec3 kScreen(30.0, 58.0, 74.0);
const dvec3 kWood(176.0, 142.0, 100.0);
const dvec3 kCabinet(188.0, 196.0, 190.0);
const dvec3 kPorcelain(122.0, 74.0, 56.0);

/// A thin round bar.
void add_rod(
    Solids& solids, const dvec3& from, const dvec3& to, double radius, const dvec3& color
) {
    const std::array<dvec3, 2> points = {from, to};
    solids.add_tube(points, {.radius = radius, .sides = 8}, color);
}

dvec3 around_y(double radius, double y, double angle) {
    return {radius * std::sin(angle), y, radius * std::cos(angle)};
}

} // namespace

std::vector<double> evenly(double begin, double end, double step) {
    const auto count = static_cast<int>(std::ceil((end - begin) / step - 1e-9));
    std::vector<double> values;
    values.reserve(static_cast<std::size_t>(std::max(count, 0)));
    for (int i = 0; i < count; ++i) {
        values.push_back(begin + step * i);
    }
    return values;
}

Solids tube_panel() {
    constexpr double kPitch = 0.16;
    constexpr double kHalf = kPanelLength / 2.0;
    std::vector<dvec3> points;
    for (int pass = 0; pass < kPanelPasses; ++pass) {
        const double y = 0.04 + kPitch * pass;
        const double begin = pass % 2 == 0 ? -kHalf : kHalf;
        points.emplace_back(begin, y, 0.0);
        points.emplace_back(-begin, y, 0.0);
    }
    Solids solids;
    solids.add_tube(
        points,
        {.radius = 0.032,
         .bend = kPitch / 2.0,
         .sides = 8,
         .arc_segments = 4,
         .longest = kPanelLength / 4.0},
        kTubeRust
    );
    return solids;
}

Solids grating() {
    constexpr int kBars = 25;
    constexpr int kCrossBars = 4;
    constexpr double kThick = 0.02;
    constexpr double kHigh = 0.04;
    Solids solids;
    for (int bar = 0; bar < kBars; ++bar) {
        const double z = (bar + 0.5) * kGratingLength / kBars;
        solids.add_box(
            {0.0, -kHigh, z - kThick / 2.0}, {kGratingWidth, 0.0, z + kThick / 2.0}, kGalvanized
        );
    }
    // Below the top of the others, so that no two faces share a plane.
    for (int bar = 0; bar < kCrossBars; ++bar) {
        const double x = (bar + 0.5) * kGratingWidth / kCrossBars;
        solids.add_box(
            {x - kThick / 2.0, -0.8 * kHigh, 0.0},
            {x + kThick / 2.0, -0.2 * kHigh, kGratingLength},
            kGalvanized * 0.9
        );
    }
    return solids;
}

Solids railing() {
    constexpr double kTop = 1.1;
    Solids solids;
    for (const double x : {0.25 * kRailingLength, 0.75 * kRailingLength}) {
        add_rod(solids, {x, 0.0, 0.0}, {x, kTop, 0.0}, 0.024, kSafetyYellow);
    }
    for (const double y : {0.55, kTop}) {
        add_rod(solids, {0.0, y, 0.0}, {kRailingLength, y, 0.0}, 0.02, kSafetyYellow);
    }
    solids.add_box({0.0, 0.01, -0.006}, {kRailingLength, 0.12, 0.006}, kSafetyYellow * 0.9);
    return solids;
}

Solids flight() {
    constexpr int kSteps = 35;
    constexpr double kRise = kFlightRise / kSteps;
    constexpr double kTread = kFlightRun / kSteps;
    constexpr double kHalf = kFlightWidth / 2.0;
    Solids solids;
    for (int step = 0; step < kSteps; ++step) {
        const double y = kRise * (step + 1);
        const double z = -kTread * step;
        solids.add_box(
            {-kHalf + 0.05, y - 0.03, z - kTread - 0.02}, {kHalf - 0.05, y, z}, kGalvanized * 0.94
        );
    }
    for (const double x : {-kHalf, kHalf}) {
        const dvec3 foot(x, 0.1, 0.0);
        const dvec3 top(x, kFlightRise - 0.05, -kFlightRun);
        solids.add_bar(foot, top, 0.05, 0.3, kSafetyYellow * 0.7, 2.0);
        constexpr int kPosts = 8;
        for (int post = 0; post <= kPosts; ++post) {
            const dvec3 at = foot + (top - foot) * (static_cast<double>(post) / kPosts);
            add_rod(solids, at, at + kUp * 1.05, 0.024, kSafetyYellow);
        }
        for (const double above : {0.55, 1.05}) {
            const std::array<dvec3, 2> rail = {foot + kUp * above, top + kUp * above};
            solids.add_tube(rail, {.radius = 0.022, .sides = 8, .longest = 2.0}, kSafetyYellow);
        }
    }
    return solids;
}

Solids tank(const dvec3& color) {
    constexpr int kSides = 48;
    Solids solids;
    const std::array<dvec2, 13> shell = {
        {{0.0, 0.0},
         {kTankRadius + 0.15, 0.0},
         {kTankRadius + 0.15, 0.2},
         {kTankRadius, 0.2},
         {kTankRadius, 2.2},
         {kTankRadius, 4.2},
         {kTankRadius, 6.2},
         {kTankRadius, 8.0},
         {kTankRadius, kTankHeight},
         {0.75 * kTankRadius, kTankHeight + 0.35},
         {0.5 * kTankRadius, kTankHeight + 0.6},
         {0.2 * kTankRadius, kTankHeight + 0.76},
         {0.0, kTankHeight + 0.8}}};
    solids.add_lathe(dvec3(0.0), kUp, shell, kSides, color);
    for (const double y : {2.2, 4.2, 6.2}) {
        const std::array<dvec2, 4> seam = {
            {{kTankRadius, -0.03},
             {kTankRadius + 0.02, -0.03},
             {kTankRadius + 0.02, 0.03},
             {kTankRadius, 0.03}}};
        solids.add_lathe(kUp * y, kUp, seam, kSides, color * 0.85);
    }
    // A railing around the roof.
    const double rail = kTankRadius - 0.15;
    for (const double y : {kTankHeight + 0.6, kTankHeight + 1.1}) {
        solids.add_ring(kUp * y, kUp, rail, 0.022, kSides, 6, kSafetyYellow);
    }
    constexpr int kPosts = 16;
    for (int post = 0; post < kPosts; ++post) {
        const double angle = kTwoPi * (post + 0.5) / kPosts;
        add_rod(
            solids,
            around_y(rail, kTankHeight, angle),
            around_y(rail, kTankHeight + 1.1, angle),
            0.022,
            kSafetyYellow
        );
    }
    // The ladder with its cage.
    const double off = kTankRadius + 0.25;
    for (const double x : {-0.25, 0.25}) {
        add_rod(solids, {x, 0.3, off}, {x, kTankHeight + 1.1, off}, 0.024, kSafetyYellow);
    }
    for (const double y : evenly(0.6, kTankHeight + 0.3, 0.3)) {
        add_rod(solids, {-0.25, y, off}, {0.25, y, off}, 0.014, kGalvanized);
    }
    for (const double y : evenly(2.6, kTankHeight + 0.6, 0.9)) {
        const std::array<dvec3, 4> hoop = {
            dvec3(-0.34, y, off),
            dvec3(-0.34, y, off + 0.6),
            dvec3(0.34, y, off + 0.6),
            dvec3(0.34, y, off)};
        solids.add_tube(
            hoop, {.radius = 0.014, .bend = 0.3, .sides = 6, .arc_segments = 4}, kSafetyYellow
        );
    }
    // A manhole and a nozzle to the rack.
    for (const double angle : {2.2, 4.4}) {
        const dvec3 outwards = around_y(1.0, 0.0, angle);
        const std::array<dvec2, 5> neck = {
            {{0.35, -0.2}, {0.35, 0.25}, {0.45, 0.25}, {0.45, 0.35}, {0.0, 0.35}}};
        solids.add_lathe(outwards * kTankRadius + kUp * 1.1, outwards, neck, 24, color * 0.75);
    }
    return solids;
}

Solids pump() {
    Solids solids;
    solids.add_box({-1.1, 0.0, -0.4}, {1.1, 0.3, 0.4}, dvec3(150.0, 148.0, 142.0));
    constexpr double kShaft = 0.75;
    // The motor with its cooling fins.
    std::vector<dvec2> motor = {{0.0, -1.05}, {0.3, -1.05}, {0.3, -0.9}};
    for (int fin = 0; fin < 8; ++fin) {
        const double at = -0.9 + 0.09 * fin;
        motor.insert(
            motor.end(),
            {{0.26, at + 0.02}, {0.26, at + 0.05}, {0.31, at + 0.05}, {0.31, at + 0.09}}
        );
    }
    motor.insert(motor.end(), {{0.2, -0.14}, {0.06, -0.14}, {0.06, 0.1}, {0.0, 0.1}});
    solids.add_lathe(kUp * kShaft, kX, motor, 24, kMotorBlue);
    solids.add_box({-0.8, 0.3, -0.22}, {-0.3, 0.5, 0.22}, kDark);
    // The casing, its inlet along the shaft and its outlet up.
    const std::array<dvec2, 8> casing = {
        {{0.0, 0.1},
         {0.3, 0.1},
         {0.42, 0.2},
         {0.42, 0.5},
         {0.3, 0.6},
         {0.18, 0.62},
         {0.18, 0.9},
         {0.0, 0.9}}};
    solids.add_lathe(kUp * kShaft, kX, casing, 28, kMachineGreen);
    solids.add_box({0.15, 0.3, -0.25}, {0.55, 0.42, 0.25}, kDark);
    const std::array<dvec2, 5> outlet = {
        {{0.14, 0.0}, {0.14, 0.75}, {0.24, 0.75}, {0.24, 0.83}, {0.0, 0.83}}};
    solids.add_lathe({0.35, kShaft, 0.2}, kUp, outlet, 20, kMachineGreen);
    return solids;
}

Solids desk() {
    Solids solids;
    solids.add_box({-0.9, 0.7, -0.4}, {0.9, 0.74, 0.4}, kWood);
    for (const double x : {-0.85, 0.8}) {
        solids.add_box({x, 0.0, -0.36}, {x + 0.05, 0.7, 0.36}, kDark);
    }
    for (const double x : {-0.42, 0.42}) {
        solids.add_box({x - 0.3, 0.86, -0.22}, {x + 0.3, 1.24, -0.18}, kDark);
        solids.add_box({x - 0.28, 0.88, -0.18}, {x + 0.28, 1.22, -0.176}, kScreen);
        solids.add_box({x - 0.03, 0.76, -0.22}, {x + 0.03, 0.86, -0.19}, kDark);
        solids.add_box({x - 0.12, 0.74, -0.3}, {x + 0.12, 0.76, -0.1}, kDark);
    }
    solids.add_box({-0.26, 0.74, 0.05}, {0.26, 0.755, 0.25}, kDark);
    for (int row = 0; row < 5; ++row) {
        for (int key = 0; key < 14; ++key) {
            const dvec3 lo(-0.245 + 0.035 * key, 0.755, 0.065 + 0.035 * row);
            solids.add_box(lo, lo + dvec3(0.029, 0.012, 0.029), {208.0, 208.0, 204.0});
        }
    }
    // The chair.
    const dvec3 foot(0.0, 0.0, 0.85);
    for (int leg = 0; leg < 5; ++leg) {
        const double angle = kTwoPi * leg / 5.0;
        add_rod(solids, foot + kUp * 0.1, foot + around_y(0.3, 0.05, angle), 0.02, kDark);
    }
    add_rod(solids, foot + kUp * 0.08, foot + kUp * 0.46, 0.03, kDark);
    solids.add_box(foot + dvec3(-0.24, 0.46, -0.24), foot + dvec3(0.24, 0.53, 0.24), kMotorBlue);
    solids.add_box(foot + dvec3(-0.22, 0.62, 0.2), foot + dvec3(0.22, 1.05, 0.26), kMotorBlue);
    solids.add_bar(foot + dvec3(0.0, 0.5, 0.22), foot + dvec3(0.0, 0.7, 0.25), 0.06, 0.02, kDark);
    return solids;
}

Solids cabinet() {
    Solids solids;
    constexpr double kFront = 0.25;
    solids.add_box({-0.4, 0.0, -kFront}, {0.4, 2.1, kFront}, kCabinet);
    const std::array<dvec3, 3> lamps = {
        dvec3(204.0, 60.0, 52.0), dvec3(80.0, 170.0, 84.0), dvec3(226.0, 190.0, 70.0)};
    for (int row = 0; row < 6; ++row) {
        for (int column = 0; column < 8; ++column) {
            const dvec3 at(-0.3 + 0.085 * column, 0.9 + 0.085 * row, kFront);
            const auto lamp = static_cast<std::size_t>(row * 5 + column * column) % lamps.size();
            solids.add_cylinder(at, kZ, 0.022, 0.025, 10, lamps[lamp]);
        }
    }
    for (const double x : {-0.24, 0.0, 0.24}) {
        const std::array<dvec2, 5> gauge = {
            {{0.1, 0.0}, {0.1, 0.05}, {0.09, 0.05}, {0.09, 0.035}, {0.0, 0.035}}};
        solids.add_lathe({x, 1.65, kFront}, kZ, gauge, 20, {236.0, 236.0, 228.0});
        solids.add_bar(
            {x, 1.65, kFront + 0.042}, {x + 0.05, 1.7, kFront + 0.042}, 0.006, 0.006, kDark
        );
    }
    solids.add_box({-0.34, 0.12, kFront}, {0.34, 0.8, kFront + 0.015}, kCabinet * 0.92);
    return solids;
}

Solids insulator() {
    Solids solids;
    constexpr double kPost = 2.4;
    solids.add_box({-0.25, 0.0, -0.25}, {0.25, 0.2, 0.25}, {150.0, 148.0, 142.0});
    solids.add_girder({0.0, 0.2, 0.0}, {0.0, kPost, 0.0}, 0.22, 0.22, kGalvanized);
    std::vector<dvec2> sheds = {{0.0, 0.0}, {0.1, 0.0}};
    constexpr int kSheds = 11;
    for (int shed = 0; shed < kSheds; ++shed) {
        const double y = 0.05 + 0.12 * shed;
        sheds.insert(sheds.end(), {{0.07, y}, {0.18, y + 0.03}, {0.07, y + 0.07}});
    }
    sheds.insert(sheds.end(), {{0.06, 1.42}, {0.0, 1.42}});
    solids.add_lathe(kUp * kPost, kUp, sheds, 16, kPorcelain);
    return solids;
}

} // namespace farfield::scenes::plant
