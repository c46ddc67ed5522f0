#pragma once

#include "gpu/hand_made_plan.hpp"
#include "support/random.hpp"
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/math/view.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

/// Layered depth images written by hand.
namespace farfield::support {

inline constexpr LayeredImageId kLayeredImage{3};

/// The step of depth that stands for a distance along the view direction, or one next to it.
inline std::uint16_t layered_step(const LayeredDepthImage& image, double distance) {
    const double nearest = 1.0 / image.near_depth;
    const double farthest = 1.0 / image.far_depth;
    const double share = (1.0 / distance - farthest) / (nearest - farthest);
    return static_cast<std::uint16_t>(std::lround(std::clamp(share, 0.0, 1.0) * 65535.0));
}

/// What a step of depth stands for. [m]
inline double layered_distance(const LayeredDepthImage& image, std::uint16_t step) {
    const double nearest = 1.0 / image.near_depth;
    const double farthest = 1.0 / image.far_depth;
    return 1.0 / (farthest + step / 65535.0 * (nearest - farthest));
}

/// Brings samples into the order of an image. Points of an image that has some follow theirs.
inline LayeredDepthImage
make_layers(LayeredDepthImage image, const std::vector<LayeredSample>& samples) {
    const auto texel = [&](const LayeredSample& sample) {
        return static_cast<std::size_t>(sample.y / kLayeredSteps) *
                   static_cast<std::size_t>(image.view.width) +
               static_cast<std::size_t>(sample.x / kLayeredSteps);
    };
    std::vector<std::size_t> order(samples.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        const std::size_t first = texel(samples[a]);
        const std::size_t second = texel(samples[b]);
        return first != second ? first < second : samples[a].depth > samples[b].depth;
    });
    const auto width = static_cast<std::size_t>(image.view.width);
    const auto height = static_cast<std::size_t>(image.view.height);
    image.counts.assign(width * height, 0);
    image.rows.assign(height + 1, 0);
    image.samples.clear();
    std::vector<PositionTexel> points;
    for (const std::size_t index : order) {
        ++image.counts[texel(samples[index])];
        ++image.rows[texel(samples[index]) / width + 1];
        image.samples.push_back(samples[index]);
        if (!image.points.empty()) {
            points.push_back(image.points[index]);
        }
    }
    image.points = std::move(points);
    std::partial_sum(image.rows.begin(), image.rows.end(), image.rows.begin());
    return image;
}

/// Of `hand_made_view`, without samples: depths of 1 to 40 m.
inline LayeredDepthImage empty_layers(int size = kFrameSize) {
    LayeredDepthImage image;
    image.view = hand_made_view(size);
    image.near_depth = 1.0;
    image.far_depth = 40.0;
    return image;
}

/// One sample in the middle of each texel, at one distance.
inline LayeredDepthImage
flat_layers(double distance, const glm::vec<4, std::uint8_t>& color, int size = kFrameSize) {
    LayeredDepthImage image = empty_layers(size);
    std::vector<LayeredSample> samples;
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            samples.push_back(
                {.x = static_cast<std::uint16_t>(x * kLayeredSteps + kLayeredSteps / 2),
                 .y = static_cast<std::uint16_t>(y * kLayeredSteps + kLayeredSteps / 2),
                 .depth = layered_step(image, distance),
                 .extent = 256,
                 .color = color}
            );
        }
    }
    return make_layers(std::move(image), samples);
}

/// Hands over an image and shows it in the frame.
inline FramePlan plan_with_layers(const LayeredDepthImage& image) {
    FramePlan plan;
    plan.layered_updates = {{.image = kLayeredImage, .content = &image}};
    plan.layers = {{.image = kLayeredImage, .node = 7}};
    Command command;
    command.kind = Command::Kind::layers;
    command.count = 1;
    plan.commands = {command};
    plan.passes = {hand_made_pass(kFrameSize)};
    plan.passes[0].command_count = 1;
    return plan;
}

/// Shows what `plan_with_layers` handed over.
inline FramePlan plan_showing_layers() {
    FramePlan plan = plan_with_layers({});
    plan.layered_updates.clear();
    return plan;
}

} // namespace farfield::support
