#include "level_walk.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace farfield::scenes {

namespace {

using glm::dvec3;

/// Points along the corners, which are replaced by parabolas that begin and end `corner` metres
/// before and after them.
std::vector<dvec3> rounded(std::span<const dvec3> corners, double corner) {
    constexpr int kSteps = 24;
    std::vector<dvec3> points = {corners.front()};
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        const dvec3& at = corners[i];
        const auto towards = [&](const dvec3& other) {
            const double share = std::min(corner / glm::distance(at, other), 0.5);
            return glm::mix(at, other, share);
        };
        const dvec3 from = towards(corners[i - 1]);
        const dvec3 to = towards(corners[i + 1]);
        for (int step = 0; step <= kSteps; ++step) {
            const double t = static_cast<double>(step) / kSteps;
            points.push_back(glm::mix(glm::mix(from, at, t), glm::mix(at, to, t), t));
        }
    }
    points.push_back(corners.back());
    return points;
}

/// A line of points by the way along it.
class Way {
  public:
    Way(std::vector<dvec3> points, bool closed) : points_(std::move(points)), closed_(closed) {
        along_.push_back(0.0);
        for (std::size_t i = 1; i < points_.size(); ++i) {
            along_.push_back(along_.back() + glm::distance(points_[i - 1], points_[i]));
        }
    }

    [[nodiscard]] double length() const { return along_.back(); }

    /// Beyond the ends a closed way goes on, another one stands still.
    [[nodiscard]] dvec3 at(double way) const {
        if (closed_) {
            way -= std::floor(way / length()) * length();
        }
        const auto above = std::upper_bound(along_.begin() + 1, along_.end() - 1, way);
        const auto i = static_cast<std::size_t>(above - along_.begin());
        const double piece = along_[i] - along_[i - 1];
        const double share = std::clamp((way - along_[i - 1]) / std::max(piece, 1e-12), 0.0, 1.0);
        return glm::mix(points_[i - 1], points_[i], share);
    }

  private:
    std::vector<dvec3> points_;
    std::vector<double> along_;
    bool closed_;
};

} // namespace

CameraPath level_walk(std::span<const dvec3> corners, const LevelWalkOptions& options) {
    const Way way(rounded(corners, options.corner), options.closed);
    // Frame `frames` of a closed walk is frame 0 again.
    const int last = options.closed ? options.frames : options.frames - 1;
    constexpr double kTargetDistance = 6.0; // [m]
    CameraPath path;
    path.frame_count = options.frames;
    for (int frame = 0; frame <= last; frame += options.frames_per_key) {
        const double share = static_cast<double>(frame) / last;
        const double here = share * way.length();
        const dvec3 chord = way.at(here + options.look) - way.at(here - options.look);
        const double heading = std::atan2(chord.z, chord.x);
        const double sway = options.sway_deg * std::numbers::pi / 180.0 *
                            std::sin(2.0 * std::numbers::pi * options.sways * share);
        PathKey key;
        key.frame = frame;
        key.eye = way.at(here);
        key.target = key.eye + dvec3(std::cos(heading + sway), 0.0, std::sin(heading + sway)) *
                                   kTargetDistance;
        path.keys.push_back(key);
    }
    return path;
}

} // namespace farfield::scenes
