// Casting and blending on the CPU: frames of the island of 1117 trees, an image of one tree, image
// quads, which cost nothing but their pixels, splats and cubes, projected keyframes, and layered
// images. Pairs of meshes.
#include "cells.hpp"
#include "keyframes.hpp"
#include "layers.hpp"
#include "support/small_scene.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/embree/closest_point.hpp>
#include <farfield/embree/embree_backend.hpp>
#include <farfield/embree/scene_sampler.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/build_proxy.hpp>
#include <farfield/io/coarse_mesh.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <scenes/island.hpp>
#include <scenes/knot.hpp>
#include <string>
#include <utility>

namespace {

using namespace farfield;

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr int kPage = 1024;
constexpr PageId kScratchPage{0};
constexpr PageId kImagePage{1};

/// The island, with threads for every core.
struct Island {
    Scene scene;
    Hierarchy hierarchy;
    std::unique_ptr<embree::EmbreeBackend> backend;
    std::string error;
};

Island make() {
    Island island;
    auto scene = scenes::make_island();
    if (!scene) {
        island.error = scene.error().message;
        return island;
    }
    island.scene = std::move(*scene);
    auto hierarchy = partition::build_bsp(
        support::objects_of(island.scene),
        {.max_items = 1},
        support::primitive_bounds_of(island.scene)
    );
    if (!hierarchy) {
        island.error = hierarchy.error().message;
        return island;
    }
    island.hierarchy = std::move(*hierarchy);
    auto backend = embree::EmbreeBackend::create(island.scene, &island.hierarchy);
    if (!backend) {
        island.error = backend.error().message;
        return island;
    }
    island.backend = std::move(*backend);
    return island;
}

const Island& island() {
    static const Island kIsland = make();
    return kIsland;
}

/// From the shore to the middle, as the canonical walk begins.
View shore_view() {
    const Lens lens = perspective_lens(std::numbers::pi / 3.0, 4.0 / 3.0, 0.5, 2000.0);
    return look_at({460.0, 25.0, 0.0}, {0.0, 10.0, 0.0}, {0, 1, 0}, lens, kWidth, kHeight);
}

/// Executes a plan again and again.
void run(
    benchmark::State& state, Backend& backend, const FramePlan& plan, TargetId target, double pixels
) {
    for ([[maybe_unused]] auto _ : state) {
        if (const auto executed = backend.execute(plan, target, {}); !executed) {
            state.SkipWithError(executed.error().message.c_str());
            break;
        }
    }
    using benchmark::Counter;
    state.counters["pixels_per_second"] =
        Counter(pixels, Counter::kIsIterationInvariantRate, Counter::kIs1000);
    backend.destroy_target(target);
}

/// Casts the whole island, with so many samples a pixel.
void cast_island(benchmark::State& state) {
    const Island& scene = island();
    const auto samples = static_cast<std::int32_t>(state.range(0));
    if (!scene.error.empty()) {
        state.SkipWithError(scene.error.c_str());
        return;
    }
    const auto target = scene.backend->create_target(kWidth, kHeight, samples);
    CulledGeometry geometry(scene.hierarchy);
    run(state, *scene.backend, geometry.plan(shore_view()), *target, kWidth * kHeight);
}
BENCHMARK(cast_island)->Arg(1)->Arg(4)->Arg(16)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Makes images of 100 x 100 texels of one tree, one or several in a batch.
void make_images(benchmark::State& state) {
    const Island& scene = island();
    constexpr int kSide = 100;
    const auto count = static_cast<int>(state.range(0));
    const auto samples = static_cast<std::int32_t>(state.range(1));
    if (!scene.error.empty()) {
        state.SkipWithError(scene.error.c_str());
        return;
    }
    const ItemId tree{1};
    const Box3d box = item_bounds(scene.scene, tree);
    const glm::dvec3 middle = center(box);
    const double half = glm::length(extent(box)) / 2.0;
    constexpr double kDistance = 60.0;
    const double tangent = half / kDistance;
    FramePlan plan;
    plan.pages = {
        {.page = kScratchPage, .size = kPage, .scratch = true, .samples = samples},
        {.page = kImagePage, .size = kPage}};
    const auto target = scene.backend->create_target(1, 1, 1);
    Pass pass;
    pass.view = look_at(
        middle + glm::dvec3(kDistance, 0.0, 0.0),
        middle,
        {0, 1, 0},
        {-tangent, tangent, -tangent, tangent, 0.5, 2000.0},
        kSide,
        kSide
    );
    pass.page = kScratchPage;
    pass.copy_page = kImagePage;
    pass.command_count = 1;
    for (int i = 0; i < count; ++i) {
        constexpr int kRow = kPage / kSide;
        pass.viewport = {i % kRow * kSide, i / kRow * kSide, kSide, kSide};
        pass.scissor = pass.viewport;
        pass.copy = pass.viewport;
        plan.passes.push_back(pass);
    }
    Command draw;
    draw.count = 1;
    plan.commands = {draw};
    plan.items = {tree};
    Pass frame;
    frame.batch = 1;
    frame.view = shore_view();
    frame.view.width = 1;
    frame.view.height = 1;
    frame.viewport = {0, 0, 1, 1};
    frame.scissor = frame.viewport;
    plan.passes.push_back(frame);
    if (const auto made = scene.backend->execute(plan, *target, {}); !made) {
        state.SkipWithError(made.error().message.c_str());
        return;
    }
    plan.pages.clear();
    run(state, *scene.backend, plan, *target, static_cast<double>(count) * kSide * kSide);
}
BENCHMARK(make_images)
    ->Args({1, 1})
    ->Args({1, 16})
    ->Args({64, 1})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Shows so many images of so many pixels a side all over a frame, every texel half transparent.
void show_images(benchmark::State& state) {
    const auto count = static_cast<int>(state.range(0));
    const auto side = static_cast<int>(state.range(1));
    const auto samples = static_cast<std::int32_t>(state.range(2));
    Scene scene;
    const auto made = embree::EmbreeBackend::create(scene, nullptr);
    if (!made) {
        state.SkipWithError(made.error().message.c_str());
        return;
    }
    Backend& backend = **made;
    const View view = shore_view();
    const glm::vec3 right(view.camera_to_world[0]);
    const glm::vec3 up(view.camera_to_world[1]);
    const glm::vec3 forward = -glm::vec3(view.camera_to_world[2]);
    constexpr float kDistance = 10.0F;
    const auto pixel = static_cast<float>(
        static_cast<double>(kDistance) * (view.lens.top - view.lens.bottom) / kHeight
    );
    FramePlan plan;
    plan.pages = {{.page = kImagePage, .size = kPage}};
    support::Random random(1);
    for (int i = 0; i < count; ++i) {
        // Turned a little, so that no texel lies on a pixel.
        const float x = random.uniform(0.0F, static_cast<float>(kWidth - side)) - kWidth / 2.0F;
        const float y = random.uniform(0.0F, static_cast<float>(kHeight - side)) - kHeight / 2.0F;
        ImageQuad quad;
        quad.page = kImagePage;
        quad.source = {i * 37 % (kPage - side), i * 91 % (kPage - side), side, side};
        quad.origin =
            glm::vec3(view.eye) + forward * kDistance + right * (x * pixel) + up * (y * pixel);
        quad.edge_u = (right * 1.0F + forward * 0.02F) * (static_cast<float>(side) * pixel);
        quad.edge_v = (up * 1.0F + right * 0.01F) * (static_cast<float>(side) * pixel);
        quad.depth = kDistance;
        plan.quads.push_back(quad);
    }
    Command show;
    show.kind = Command::Kind::images;
    show.count = static_cast<std::uint32_t>(count);
    plan.commands = {show};
    Pass frame;
    frame.view = view;
    frame.viewport = {0, 0, kWidth, kHeight};
    frame.scissor = frame.viewport;
    frame.command_count = 1;
    plan.passes = {frame};
    const auto target = backend.create_target(kWidth, kHeight, samples);
    if (const auto executed = backend.execute(plan, *target, {}); !executed) {
        state.SkipWithError(executed.error().message.c_str());
        return;
    }
    plan.pages.clear();
    run(state, backend, plan, *target, static_cast<double>(count) * side * side);
}
BENCHMARK(show_images)
    ->Args({0, 40, 1})
    ->Args({300, 40, 1})
    ->Args({300, 40, 16})
    ->Args({1000, 12, 1})
    ->Args({100, 300, 1})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Shows splats or cubes. @see bench::kCellArguments
void show_cells(benchmark::State& state) {
    Scene scene;
    const auto made = embree::EmbreeBackend::create(scene, nullptr);
    if (!made) {
        state.SkipWithError(made.error().message.c_str());
        return;
    }
    bench::show_cells(state, **made);
}
BENCHMARK(show_cells)->Apply(bench::cell_arguments)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Projects keyframes. @see bench::keyframe_arguments
void project(benchmark::State& state) {
    const auto made = embree::EmbreeBackend::create(bench::keyframe_scene(), nullptr);
    if (!made) {
        state.SkipWithError(made.error().message.c_str());
        return;
    }
    bench::show_keyframes(state, **made);
}
BENCHMARK(project)->Apply(bench::keyframe_arguments)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Shows a layered image. @see bench::layer_arguments
void show_layers(benchmark::State& state) {
    const auto made = embree::EmbreeBackend::create(Scene(), nullptr);
    if (!made) {
        state.SkipWithError(made.error().message.c_str());
        return;
    }
    bench::show_layers(state, **made);
}
BENCHMARK(show_layers)->Apply(bench::layer_arguments)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Draws every n-th triangle of the ground and of a tree of the island, one by one.
void cast_selected(benchmark::State& state) {
    const Island& scene = island();
    const auto every = static_cast<std::uint32_t>(state.range(0));
    if (!scene.error.empty()) {
        state.SkipWithError(scene.error.c_str());
        return;
    }
    FramePlan plan;
    plan.origin = scene.hierarchy.origin;
    for (std::size_t item = 0; item < 200; ++item) {
        const Instance& instance = scene.scene.instances[item];
        const std::uint64_t triangles =
            primitive_count(scene.scene.meshes[index_of(instance.mesh)]);
        const auto first = static_cast<std::uint32_t>(plan.selected.size());
        for (std::uint32_t i = 0; i < triangles; i += every) {
            plan.selected.push_back(i);
        }
        const auto count = static_cast<std::uint32_t>(plan.selected.size()) - first;
        plan.selections.push_back({make_id<ItemId>(item), first, count});
    }
    Command command;
    command.selection_count = static_cast<std::uint32_t>(plan.selections.size());
    plan.commands = {command};
    Pass frame;
    frame.view = shore_view();
    frame.viewport = {0, 0, kWidth, kHeight};
    frame.scissor = frame.viewport;
    frame.command_count = 1;
    plan.passes = {frame};
    const auto target = scene.backend->create_target(kWidth, kHeight, 1);
    run(state, *scene.backend, plan, *target, kWidth * kHeight);
    state.counters["triangles"] = static_cast<double>(plan.selected.size());
}
BENCHMARK(cast_selected)->Arg(1)->Arg(10)->Arg(100)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Colours of the cells of a small wood, with so many rays a side; dividing them is a part of it.
void color_cells(benchmark::State& state) {
    const Scene scene = support::small_scene();
    const auto sampler = embree::SceneSampler::create(scene, glm::dvec3(0.0));
    if (!sampler) {
        state.SkipWithError(sampler.error().message.c_str());
        return;
    }
    const auto rays = static_cast<std::uint32_t>(state.range(0));
    SerialExecutor executor;
    std::size_t cells = 0;
    for ([[maybe_unused]] auto _ : state) {
        const auto model = build_color_cubes(scene, **sampler, {.rays = rays}, executor, 100);
        if (!model) {
            state.SkipWithError(model.error().message.c_str());
            return;
        }
        cells = model->trees[0].cells.size() + model->trees[1].cells.size();
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(cells) * state.iterations());
    // Six faces, and those aslant that the gain is measured with.
    constexpr double kAslant = 48.0;
    using benchmark::Counter;
    state.counters["rays_per_second"] = Counter(
        static_cast<double>(cells) * (6.0 * rays * rays + kAslant),
        Counter::kIsIterationInvariantRate,
        Counter::kIs1000
    );
}
BENCHMARK(color_cells)->Arg(1)->Arg(4)->Arg(16)->Unit(benchmark::kMillisecond);

/// A knot of 100,000 triangles and the coarse model of 2000 of it, reduced once.
struct KnotPair {
    Mesh fine;
    Mesh coarse;
    std::string error;
};

const KnotPair& knot_pair() {
    static const KnotPair pair = [] {
        KnotPair made;
        auto scene = scenes::make_knot({});
        if (!scene) {
            made.error = scene.error().message;
            return made;
        }
        made.fine = std::move(scene->meshes[0]);
        auto coarse = io::make_coarse_mesh(made.fine);
        if (!coarse) {
            made.error = coarse.error().message;
            return made;
        }
        made.coarse = std::move(*coarse);
        return made;
    }();
    return pair;
}

void reduce_mesh(benchmark::State& state) {
    const KnotPair& meshes = knot_pair();
    if (!meshes.error.empty()) {
        state.SkipWithError(meshes.error.c_str());
    }
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(io::make_coarse_mesh(meshes.fine).has_value());
    }
    state.SetItemsProcessed(
        state.iterations() * static_cast<std::int64_t>(primitive_count(meshes.fine))
    );
}
BENCHMARK(reduce_mesh)->Unit(benchmark::kMillisecond);

/// Matches all vertices and measures both ways, with what finds closest points.
void pair_meshes(benchmark::State& state) {
    const KnotPair& meshes = knot_pair();
    if (!meshes.error.empty()) {
        state.SkipWithError(meshes.error.c_str());
    }
    SerialExecutor executor;
    double hausdorff_m = 0.0;
    while (state.KeepRunning()) {
        const auto on_fine = embree::ClosestPointFinder::create(meshes.fine);
        const auto on_coarse = embree::ClosestPointFinder::create(meshes.coarse);
        if (!on_fine || !on_coarse) {
            state.SkipWithError("no closest points");
            break;
        }
        const auto pair = build_mesh_proxy(
            {meshes.fine, meshes.coarse, **on_fine, **on_coarse, glm::dmat4x3(1.0)},
            {ItemId{0}, ItemId{1}},
            executor
        );
        if (!pair) {
            state.SkipWithError(pair.error().message.c_str());
            break;
        }
        hausdorff_m = pair->quality.hausdorff_m;
    }
    state.SetItemsProcessed(
        state.iterations() * static_cast<std::int64_t>(meshes.fine.positions.size())
    );
    state.counters["hausdorff_m"] = hausdorff_m;
}
BENCHMARK(pair_meshes)->Unit(benchmark::kMillisecond);

} // namespace
