#pragma once

#include "support/random.hpp"
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/math/view.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

/// A layered depth image all over a frame of as many pixels, for every backend alike.
namespace farfield::bench {

/// The eye, and the window of 512 x 384 pixels.
inline View layers_view() {
    const Lens lens = {-0.4, 0.4, -0.3, 0.3, 0.5, 2000.0};
    return look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, lens, 512, 384);
}

/// As many samples in each texel, one on each of so many slanted walls, one behind the other.
inline LayeredDepthImage layers_image(int samples) {
    LayeredDepthImage image;
    image.view = layers_view();
    image.near_depth = 10.0;
    image.far_depth = 1000.0;
    support::Random random(1);
    for (int y = 0; y < image.view.height; ++y) {
        image.rows.push_back(static_cast<std::uint32_t>(image.samples.size()));
        for (int x = 0; x < image.view.width; ++x) {
            image.counts.push_back(static_cast<std::uint8_t>(samples));
            for (int i = 0; i < samples; ++i) {
                const double wall = 20.0 * std::pow(3.0, i) * (1.0 + 0.001 * (x + y));
                const double nearest = 1.0 / image.near_depth;
                const double farthest = 1.0 / image.far_depth;
                const double share = (1.0 / wall - farthest) / (nearest - farthest);
                image.samples.push_back(
                    {.x = static_cast<std::uint16_t>(x * kLayeredSteps + 8),
                     .y = static_cast<std::uint16_t>(y * kLayeredSteps + 8),
                     .depth = static_cast<std::uint16_t>(std::max(share, 0.0) * 65535.0),
                     .extent = 300,
                     .color = {random.below(256), random.below(256), 40 * i, 255}}
                );
            }
        }
    }
    image.rows.push_back(static_cast<std::uint32_t>(image.samples.size()));
    return image;
}

/// Samples a texel, samples a pixel.
inline void layer_arguments(benchmark::internal::Benchmark* benchmark) {
    benchmark->Args({1, 1})->Args({3, 1})->Args({3, 4});
}

/// Shows it again and again from an eye beside its own.
inline void show_layers(benchmark::State& state, Backend& backend) {
    const LayeredDepthImage image = layers_image(static_cast<int>(state.range(0)));
    FramePlan plan;
    Pass frame;
    frame.view = layers_view();
    frame.view.eye = {1.0, 0.4, -0.7};
    frame.viewport = {0, 0, frame.view.width, frame.view.height};
    frame.scissor = frame.viewport;
    frame.command_count = 1;
    plan.passes = {frame};
    plan.layered_updates = {{.image = LayeredImageId{0}, .content = &image}};
    plan.layers = {{.image = LayeredImageId{0}}};
    Command command;
    command.kind = Command::Kind::layers;
    command.count = 1;
    plan.commands = {command};
    const auto target = backend.create_target(
        frame.view.width, frame.view.height, static_cast<int>(state.range(1))
    );
    if (!target) {
        state.SkipWithError(target.error().message.c_str());
        return;
    }
    for ([[maybe_unused]] auto _ : state) {
        if (const auto executed = backend.execute(plan, *target, {}); !executed) {
            state.SkipWithError(executed.error().message.c_str());
            break;
        }
        backend.finish();
        plan.layered_updates.clear();
    }
    using benchmark::Counter;
    state.counters["seconds_each"] = Counter(
        static_cast<double>(image.samples.size()),
        Counter::kIsIterationInvariantRate | Counter::kInvert
    );
    backend.destroy_target(*target);
}

} // namespace farfield::bench
