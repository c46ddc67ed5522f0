#pragma once

#include "support/random.hpp"
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>

/// Splats and cubes all over a frame of 640 x 480 pixels, for every backend alike.
namespace farfield::bench {

/// @param cubes cubes turned in eight ways instead of splats
/// @param size_px side or edge on the screen
inline FramePlan cells_plan(bool cubes, std::uint32_t count, double size_px) {
    constexpr int kWidth = 640;
    constexpr int kHeight = 480;
    const Lens lens = {-0.4, 0.4, -0.3, 0.3, 0.5, 2000.0};
    FramePlan plan;
    Pass frame;
    frame.view = look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, lens, kWidth, kHeight);
    frame.viewport = {0, 0, kWidth, kHeight};
    frame.scissor = frame.viewport;
    frame.command_count = 1;
    plan.passes = {frame};
    for (int i = 0; i < 8; ++i) {
        const auto turn = static_cast<float>(i) * 0.7F;
        plan.cube_frames.push_back(glm::mat3(
            glm::vec3(std::cos(turn), 0.0F, -std::sin(turn)),
            glm::vec3(0.0F, 1.0F, 0.0F),
            glm::vec3(std::sin(turn), 0.0F, std::cos(turn))
        ));
    }
    support::Random random(1);
    for (std::uint32_t i = 0; i < count; ++i) {
        const double depth = random.uniform(20.0, 200.0);
        const glm::vec3 center(
            random.uniform(lens.left, lens.right) * depth,
            random.uniform(lens.bottom, lens.top) * depth,
            -depth
        );
        const auto size = static_cast<float>(size_px * depth * (lens.top - lens.bottom) / kHeight);
        const glm::vec<4, std::uint8_t> color(60, random.below(100), 30, 160);
        if (cubes) {
            plan.cubes.push_back({center, glm::vec3(size), i % 8, {color, color, color}});
        } else {
            plan.splats.push_back({center, size, color});
        }
    }
    Command command;
    command.kind = cubes ? Command::Kind::cubes : Command::Kind::splats;
    command.count = count;
    plan.commands = {command};
    return plan;
}

/// Cubes or splats, how many, tenths of a pixel a side, samples.
inline void cell_arguments(benchmark::internal::Benchmark* benchmark) {
    for (const int samples : {1, 4}) {
        for (const int tenths : {1, 5, 10, 20, 30, 100}) {
            benchmark->Args({0, 100'000, tenths, samples});
        }
        for (const int tenths : {5, 10, 30}) {
            benchmark->Args({1, 100'000, tenths, samples});
        }
    }
}

/// Shows them again and again.
inline void show_cells(benchmark::State& state, Backend& backend) {
    const auto count = static_cast<std::uint32_t>(state.range(1));
    const double size_px = 0.1 * static_cast<double>(state.range(2));
    const FramePlan plan = cells_plan(state.range(0) == 1, count, size_px);
    const View& view = plan.passes[0].view;
    const auto target =
        backend.create_target(view.width, view.height, static_cast<int>(state.range(3)));
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
    }
    using benchmark::Counter;
    state.counters["seconds_each"] =
        Counter(static_cast<double>(count), Counter::kIsIterationInvariantRate | Counter::kInvert);
    backend.destroy_target(*target);
}

} // namespace farfield::bench
