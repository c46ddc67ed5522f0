#pragma once

#include "support/small_scene.hpp"
#include <farfield/gpu/backend.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

/// What every backend's benchmark of projected keyframes has in common.
namespace farfield::bench {

/// Hills of 131,072 triangles, and of 512, which are all that a frame shows.
inline Scene keyframe_scene() {
    Scene scene;
    for (const std::uint32_t cells : {256U, 16U}) {
        Mesh mesh = support::ground_mesh(cells, 100.0F);
        for (glm::vec3& position : mesh.positions) {
            position.y = 2.0F * std::sin(0.2F * position.x) * std::cos(0.15F * position.z);
        }
        support::add_instance(
            scene, support::add_mesh(scene, std::move(mesh), kNone<MaterialId>), {}
        );
    }
    return scene;
}

/// How many keyframes (0: plain geometry), the first of them that sees anything, and whether whole
/// triangles show them.
inline void keyframe_arguments(benchmark::internal::Benchmark* bench) {
    bench->ArgNames({"keyframes", "seeing", "whole"});
    bench->Args({0, 0, 0});
    for (const int keyframes : {1, 2, 4}) {
        for (int seeing = 0; seeing < keyframes; seeing += std::max(keyframes - 1, 1)) {
            bench->Args({keyframes, seeing, 0});
        }
    }
    bench->Args({1, 0, 1});
}

/// Shows the 512 triangles all over a frame of 512 x 512 pixels, plain or with keyframes of the
/// many from close by; those before the first that sees anything look elsewhere.
/// @param backend over `keyframe_scene`
inline void show_keyframes(benchmark::State& state, Backend& backend) {
    constexpr std::int32_t kSize = 512;
    const auto keyframes = static_cast<std::uint32_t>(state.range(0));
    const auto seeing = static_cast<std::uint32_t>(state.range(1));
    const Lens lens = {-0.4, 0.4, -0.4, 0.4, 0.5, 200.0};
    const auto look = [&](const glm::dvec3& eye) {
        return look_at(eye, {0, 0, -5}, {0, 1, 0}, lens, kSize, kSize);
    };
    FramePlan make;
    make.pages = {{.page = PageId{0}, .size = kSize, .scratch = true}};
    make.items = {ItemId{0}, ItemId{1}};
    Command fine;
    fine.count = 1;
    make.commands = {fine};
    FramePlan show;
    show.items = {ItemId{1}};
    for (std::uint32_t i = 0; i < keyframes; ++i) {
        const auto page = static_cast<PageId>(i + 1);
        make.pages.push_back({.page = page, .size = kSize, .depth = true});
        Pass pass;
        pass.page = PageId{0};
        pass.view = look({i < seeing ? 200.0 : 0.0, 40.0, 20.0});
        pass.viewport = {0, 0, kSize, kSize};
        pass.scissor = pass.viewport;
        pass.command_count = 1;
        pass.batch = i;
        pass.copy_page = page;
        pass.copy = pass.scissor;
        pass.copy_near = 10.0F;
        pass.copy_far = 110.0F;
        make.passes.push_back(pass);
        Keyframe keyframe;
        keyframe.page = page;
        keyframe.source = pass.copy;
        keyframe.view = pass.view;
        keyframe.copy_near = pass.copy_near;
        keyframe.copy_far = pass.copy_far;
        keyframe.offset_m = 1.0F;
        keyframe.max_shift_px = 2.0F;
        show.keyframes.push_back(keyframe);
    }
    Pass frame;
    frame.view = look({0.5, 40.0, 19.5});
    frame.viewport = {0, 0, kSize, kSize};
    frame.scissor = frame.viewport;
    frame.command_count = 1;
    Command coarse;
    coarse.count = 1;
    if (keyframes > 0) {
        coarse.kind = Command::Kind::projected;
        coarse.keyframe_count = keyframes;
        coarse.whole_triangles = state.range(2) == 1;
    }
    show.commands = {coarse};
    show.passes = {frame};
    make.commands.push_back(fine);
    frame.batch = keyframes;
    make.passes.push_back(frame);
    const auto target = backend.create_target(kSize, kSize, 1);
    const auto execute = [&](const FramePlan& plan) {
        if (const auto executed = backend.execute(plan, *target, {}); !executed) {
            state.SkipWithError(executed.error().message.c_str());
            return false;
        }
        return true;
    };
    // The first frame with keyframes makes the programs that show them.
    if (!execute(make) || !execute(show)) {
        return;
    }
    backend.finish();
    for ([[maybe_unused]] auto _ : state) {
        if (!execute(show)) {
            break;
        }
        backend.finish();
    }
    using benchmark::Counter;
    state.counters["seconds_a_pixel"] = Counter(
        static_cast<double>(kSize) * kSize, Counter::kIsIterationInvariantRate | Counter::kInvert
    );
}

} // namespace farfield::bench
