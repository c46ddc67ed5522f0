// The atlas as an image cache uses it: rectangles come and go, and the oldest go first when there
// is no room. Cells of colour cubes. Pairs of grids of heights.
#include "image/cube_scenes.hpp"
#include "image/height_fields.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/image/atlas.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/build_proxy.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

namespace {

using farfield::Atlas;
using farfield::Region;

/// One allocation a step into a page that is full: releases as many of the oldest as it takes.
void atlas_churn(benchmark::State& state) {
    const auto size = static_cast<std::int32_t>(state.range(0));
    const auto largest = static_cast<unsigned>(state.range(1));
    farfield::support::Random random(1);
    Atlas atlas(size);
    std::deque<Region> living;
    std::int64_t allocations = 0;
    double fill_sum = 0.0;
    const auto step = [&] {
        const auto width = static_cast<std::int32_t>(5 + random.below(largest - 4));
        const auto height = static_cast<std::int32_t>(5 + random.below(largest - 4));
        for (;;) {
            ++allocations;
            if (const std::optional<Region> region = atlas.allocate(width, height)) {
                living.push_back(*region);
                break;
            }
            atlas.release(living.front());
            living.pop_front();
        }
        fill_sum += static_cast<double>(atlas.used_texels());
    };
    for (int warm_up = 0; warm_up < 20'000; ++warm_up) {
        step();
    }
    allocations = 0;
    fill_sum = 0.0;
    while (state.KeepRunning()) {
        step();
    }
    using benchmark::Counter;
    state.SetItemsProcessed(allocations);
    state.counters["fill"] =
        Counter(fill_sum / (static_cast<double>(size) * size), Counter::kAvgIterations);
    state.counters["rectangles"] = Counter(static_cast<double>(living.size()));
}

/// An empty page filled to its first refusal.
void atlas_fill(benchmark::State& state) {
    const auto size = static_cast<std::int32_t>(state.range(0));
    const auto largest = static_cast<unsigned>(state.range(1));
    Atlas atlas(size);
    std::int64_t allocations = 0;
    while (state.KeepRunning()) {
        farfield::support::Random random(1);
        atlas.clear();
        std::optional<Region> region;
        do {
            const auto width = static_cast<std::int32_t>(5 + random.below(largest - 4));
            region =
                atlas.allocate(width, static_cast<std::int32_t>(5 + random.below(largest - 4)));
            ++allocations;
        } while (region);
    }
    state.SetItemsProcessed(allocations);
    state.counters["fill"] = benchmark::Counter(
        static_cast<double>(atlas.used_texels()) / (static_cast<double>(size) * size)
    );
}

/// Cells around triangles of a fifth of their mean distance, with next to no colours.
void divide_cells(benchmark::State& state) {
    using namespace farfield;
    const auto count = static_cast<std::size_t>(state.range(0));
    support::TriangleSoup soup =
        support::random_soup(count, 20.0 / std::cbrt(static_cast<double>(count)), 1);
    const ColorCubeInput input = soup.input();
    const support::EmptySampler sampler;
    SerialExecutor executor;
    std::size_t cells = 0;
    std::uint64_t bytes = 0;
    while (state.KeepRunning()) {
        const auto model = build_color_cubes(
            input, sampler, {.rays = 1, .colors = CubeColors::composed}, executor
        );
        if (!model) {
            state.SkipWithError(model.error().message.c_str());
            return;
        }
        cells = model->trees[0].cells.size();
        bytes = memory_bytes(*model);
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(cells) * state.iterations());
    state.counters["cells"] = static_cast<double>(cells);
    state.counters["bytes_per_triangle"] = static_cast<double>(bytes) / static_cast<double>(count);
}

/// The checks that a model from a file goes through.
void validate_cells(benchmark::State& state) {
    using namespace farfield;
    support::TriangleSoup soup = support::random_soup(100'000, 0.5, 1);
    SerialExecutor executor;
    const auto model = build_color_cubes(
        soup.input(), support::EmptySampler(), {.rays = 1, .colors = CubeColors::composed}, executor
    );
    if (!model) {
        state.SkipWithError(model.error().message.c_str());
        return;
    }
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(validate(*model).has_value());
    }
    const auto cells = static_cast<std::int64_t>(model->trees[0].cells.size());
    state.SetItemsProcessed(cells * state.iterations());
}

/// A grid of 16 squares along the longer side of so many posts, or a tree of 16384 triangles.
void pair_heights(benchmark::State& state) {
    const auto grid = farfield::support::wavy_grid(
        static_cast<std::uint32_t>(state.range(0)), static_cast<std::uint32_t>(state.range(1))
    );
    const farfield::ProxyItems items{farfield::ItemId{0}, farfield::ItemId{1}};
    const bool refined = state.range(2) != 0;
    double hausdorff_m = 0.0;
    double bytes = 0.0;
    while (state.KeepRunning()) {
        const auto built = refined ? farfield::build_refined_proxy(grid, items, {})
                                   : farfield::build_grid_proxy(grid, items, {});
        if (!built) {
            state.SkipWithError(built.error().message.c_str());
            break;
        }
        hausdorff_m = built->pair.quality.hausdorff_m;
        bytes = static_cast<double>(memory_bytes(built->pair));
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(grid.heights.size()));
    state.counters["hausdorff_m"] = hausdorff_m;
    state.counters["bytes"] = bytes;
}

void validate_pair(benchmark::State& state) {
    const auto built = farfield::build_refined_proxy(
        farfield::support::wavy_grid(513, 513), {farfield::ItemId{0}, farfield::ItemId{1}}, {}
    );
    if (!built) {
        state.SkipWithError(built.error().message.c_str());
    }
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(validate(built->pair).has_value());
    }
}

BENCHMARK(pair_heights)
    ->ArgNames({"columns", "rows", "refined"})
    ->ArgsProduct({{513}, {513}, {0, 1}})
    ->ArgsProduct({{1197}, {643}, {0, 1}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(validate_pair)->Unit(benchmark::kMillisecond);
BENCHMARK(divide_cells)->RangeMultiplier(10)->Range(1000, 100'000)->Unit(benchmark::kMillisecond);
BENCHMARK(validate_cells)->Unit(benchmark::kMillisecond);
BENCHMARK(atlas_churn)->ArgNames({"page", "largest"})->ArgsProduct({{512, 1024, 2048}, {30, 120}});
BENCHMARK(atlas_fill)->ArgNames({"page", "largest"})->ArgsProduct({{1024, 2048}, {30, 120}});

} // namespace
