#include "island_path.hpp"

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfield::scenes {

namespace {

using glm::dvec3;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kFrames = 1200;
constexpr double kLast = kFrames - 1;
constexpr double kInwardBegins = 720.0;
constexpr double kTurnBegins = 1100.0;
constexpr double kArc = 63.0 * kDegree;
constexpr double kTurn = 120.0 * kDegree;
constexpr double kOrbit = 1.15;       // radii
constexpr double kOrbitHeight = 25.0; // [m]
constexpr double kClearance = 1.05;   // tree heights above the ground
constexpr double kLookAhead = 0.15;   // radii
constexpr int kFramesPerKey = 11;     // divides the 1199 steps

/// Share of the arc behind at a share t of its frames: the step grows evenly from 3/4 to 5/4 of its
/// mean.
double along_arc(double t) {
    return t * (3.0 + t) / 4.0;
}

/// Share of the way in behind at a share t of its frames. The step begins with that of the arc's
/// end, grows in the first fifth and sinks in the last one, in these proportions.
double along_way_in(double t) {
    constexpr double kBegin = 1.03;
    constexpr double kMiddle = 1.24;
    constexpr double kEnd = 0.44;
    constexpr double kFifth = 0.2;
    const double first = std::min(t, kFifth);
    const double middle = std::clamp(t - kFifth, 0.0, 1.0 - 2.0 * kFifth);
    const double last = std::max(t - (1.0 - kFifth), 0.0);
    const auto ramp = [](double from, double to, double part) {
        return from * part + (to - from) * part * part / (2.0 * kFifth);
    };
    constexpr double kWhole = kFifth * (kBegin + kMiddle) / 2.0 + (1.0 - 2.0 * kFifth) * kMiddle +
                              kFifth * (kMiddle + kEnd) / 2.0;
    return (ramp(kBegin, kMiddle, first) + kMiddle * middle + ramp(kMiddle, kEnd, last)) / kWhole;
}

PathKey key_at(const IslandOptions& options, double frame) {
    const double radius = options.radius_m;
    const double top = options.height_m + kClearance * options.tree_height_m;
    const double arc = std::clamp(frame / kInwardBegins, 0.0, 1.0);
    const double in =
        along_way_in(std::clamp((frame - kInwardBegins) / (kLast - kInwardBegins), 0.0, 1.0));
    const double angle = kArc * along_arc(arc);
    const double distance = kOrbit * radius * (1.0 - in);

    PathKey key;
    key.frame = frame;
    key.eye = dvec3(std::cos(angle) * distance, 0.0, std::sin(angle) * distance);
    const double ground = island_height(options, key.eye.x, key.eye.z);
    key.eye.y = std::max(
        std::lerp(kOrbitHeight, std::max(top, kOrbitHeight), in),
        ground + kClearance * options.tree_height_m
    );

    // The middle, until it comes near; then a point that keeps ahead and turns aside at the end.
    const double turn = kTurn * glm::smoothstep(kTurnBegins, kLast, std::max(frame, kTurnBegins));
    const double ahead = std::max(distance, kLookAhead * radius);
    const double direction = angle + std::numbers::pi + turn;
    key.target = key.eye + dvec3(std::cos(direction) * ahead, 0.0, std::sin(direction) * ahead);
    key.target.y = std::min(options.height_m, key.eye.y);
    key.up = dvec3(0.0, 1.0, 0.0);
    return key;
}

} // namespace

Result<CameraPath> island_path(const IslandOptions& options) {
    if (auto valid = validate(options); !valid) {
        return tl::unexpected(valid.error());
    }
    CameraPath path;
    path.frame_count = kFrames;
    for (int frame = 0; frame < kFrames; frame += kFramesPerKey) {
        path.keys.push_back(key_at(options, frame));
    }
    return path;
}

} // namespace farfield::scenes
