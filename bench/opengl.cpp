// Splats, cubes, single triangles, projected keyframes and layered images on the device that OpenGL
// finds.
#include "cells.hpp"
#include "keyframes.hpp"
#include "layers.hpp"
#include "support/small_scene.hpp"
#include <farfield/opengl/context.hpp>
#include <farfield/opengl/opengl_backend.hpp>
#include <farfield/opengl/scene_source.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace {

using namespace farfield;

/// A scene on the device. Members go in the reverse order.
struct Device {
    std::optional<opengl::HeadlessContext> context;
    std::unique_ptr<opengl::SceneSource> source;
    std::unique_ptr<opengl::OpenGLBackend> backend;
    std::string error;

    explicit Device(const Scene& scene, const opengl::OpenGLBackendOptions& options = {}) {
        if (auto made = opengl::HeadlessContext::create(); made) {
            context.emplace(std::move(*made));
        } else {
            error = made.error().message;
            return;
        }
        if (auto made = opengl::SceneSource::create(scene, nullptr); made) {
            source = std::move(*made);
        } else {
            error = made.error().message;
            return;
        }
        if (auto made = opengl::OpenGLBackend::create(*source, options); made) {
            backend = std::move(*made);
        } else {
            error = made.error().message;
        }
    }
};

/// Shows splats or cubes. @see bench::cell_arguments
void show_cells(benchmark::State& state) {
    const Device device{Scene()};
    if (!device.error.empty()) {
        state.SkipWithError(device.error.c_str());
        return;
    }
    bench::show_cells(state, *device.backend);
}
BENCHMARK(show_cells)->Apply(bench::cell_arguments)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Projects keyframes. @see bench::keyframe_arguments
void project(benchmark::State& state) {
    const Device device(bench::keyframe_scene());
    if (!device.error.empty()) {
        state.SkipWithError(device.error.c_str());
        return;
    }
    bench::show_keyframes(state, *device.backend);
}
BENCHMARK(project)->Apply(bench::keyframe_arguments)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Shows a layered image. @see bench::layer_arguments
void show_layers(benchmark::State& state, opengl::LayerDrawing layers) {
    const Device device(Scene(), {.layers = layers});
    if (!device.error.empty()) {
        state.SkipWithError(device.error.c_str());
        return;
    }
    bench::show_layers(state, *device.backend);
}
BENCHMARK_CAPTURE(show_layers, points, opengl::LayerDrawing::points)
    ->Apply(bench::layer_arguments)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(show_layers, warped, opengl::LayerDrawing::warped)
    ->Apply(bench::layer_arguments)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Draws every n-th triangle of a tree of 50,000, or with 0 the tree as an item.
void draw_selected(benchmark::State& state) {
    Scene scene;
    support::add_instance(
        scene, support::add_mesh(scene, support::tree_mesh(50'000), kNone<MaterialId>), {}
    );
    const Device device(scene);
    if (!device.error.empty()) {
        state.SkipWithError(device.error.c_str());
        return;
    }
    FramePlan plan;
    Pass frame;
    const Lens lens = {-0.4, 0.4, -0.3, 0.3, 0.5, 2000.0};
    frame.view = look_at({0, 3, 14}, {0, 3, 0}, {0, 1, 0}, lens, 640, 480);
    frame.viewport = {0, 0, 640, 480};
    frame.scissor = frame.viewport;
    frame.command_count = 1;
    plan.passes = {frame};
    Command command;
    double triangles = static_cast<double>(scene.meshes[0].indices.size()) / 3.0;
    if (const auto every = static_cast<std::uint32_t>(state.range(0)); every == 0) {
        plan.items = {ItemId{0}};
        command.count = 1;
    } else {
        for (std::uint32_t i = 0; i < scene.meshes[0].indices.size() / 3; i += every) {
            plan.selected.push_back(i);
        }
        plan.selections = {{ItemId{0}, 0, static_cast<std::uint32_t>(plan.selected.size())}};
        command.selection_count = 1;
        triangles = static_cast<double>(plan.selected.size());
    }
    plan.commands = {command};
    const auto target = device.backend->create_target(640, 480, 1);
    for ([[maybe_unused]] auto _ : state) {
        if (const auto executed = device.backend->execute(plan, *target, {}); !executed) {
            state.SkipWithError(executed.error().message.c_str());
            break;
        }
        device.backend->finish();
    }
    using benchmark::Counter;
    state.counters["seconds_each"] =
        Counter(triangles, Counter::kIsIterationInvariantRate | Counter::kInvert);
}
BENCHMARK(draw_selected)
    ->Arg(0)
    ->Arg(1)
    ->Arg(10)
    ->Arg(100)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

} // namespace
