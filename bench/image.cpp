// The atlas as an image cache uses it: rectangles come and go, and the oldest go first when there
// is no room. Cells of colour cubes. Pairs of grids of heights. Layered depth images.
#include "image/analytic_views.hpp"
#include "image/cube_scenes.hpp"
#include "image/height_fields.hpp"
#include "image/layered_images.hpp"
#include "support/thread_executor.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/image/atlas.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/build_layered_image.hpp>
#include <farfield/image/build_proxy.hpp>
#include <farfield/image/layered_warp.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

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

/// Wavy layers in 512 x 384 texels, of which so many are in a texel on average.
farfield::LayeredDepthImage wavy_layers(unsigned layers) {
    using namespace farfield;
    support::Random random(1);
    const auto fill = [&](int column, int row, std::vector<LayeredSample>& samples) {
        for (unsigned layer = 0; layer < 2 * layers; ++layer) {
            // Every layer has patches of a few texels, half of them empty.
            const double phase = 3.0 * layer;
            if (std::sin(column * 0.21 + phase) * std::sin(row * 0.17 + phase) < 0.0) {
                continue;
            }
            const double wave = std::sin(column * 0.02 + phase) + std::cos(row * 0.03 - phase);
            const double depth = 60'000.0 * (layer + 0.9) / (2.0 * layers) + 1500.0 * wave;
            samples.push_back(support::sample_in(
                column,
                row,
                static_cast<unsigned>(std::max(depth, 0.0)),
                random.below(kLayeredSteps),
                random.below(kLayeredSteps)
            ));
            samples.back().extent = 290;
            samples.back().color = support::random_color(random);
        }
    };
    return support::layered_image(support::straight_view(512, 384), 10.0, 200.0, fill);
}

/// Eyes that the epipole is in the image, beside it, and infinitely far for.
farfield::View warped_view(std::int64_t eye) {
    farfield::View view = farfield::support::straight_view(512, 384);
    constexpr std::array<glm::dvec3, 3> kEyes = {
        glm::dvec3(0.2, 0.1, -1.0), glm::dvec3(0.8, 0.3, 0.3), glm::dvec3(1.0, 0.2, 0.0)};
    view.eye = kEyes[static_cast<std::size_t>(eye)];
    return view;
}

void warp_layers(benchmark::State& state) {
    using namespace farfield;
    const LayeredDepthImage image = wavy_layers(static_cast<unsigned>(state.range(0)));
    const View view = warped_view(state.range(1));
    std::unique_ptr<Executor> executor = std::make_unique<SerialExecutor>();
    if (const auto threads = static_cast<unsigned>(state.range(2)); threads > 1) {
        executor = std::make_unique<support::ThreadExecutor>(threads);
    }
    const auto front = state.range(3) == 0 ? LayeredFront::order : LayeredFront::depth;
    LayeredWarper warper;
    WarpedLayers warped;
    while (state.KeepRunning()) {
        warper.warp(image, view, *executor, warped, false, front);
        benchmark::DoNotOptimize(warped.colors.data());
    }
    const auto samples = static_cast<std::int64_t>(image.samples.size());
    state.SetItemsProcessed(samples * state.iterations());
    state.counters["layers"] =
        static_cast<double>(samples) / static_cast<double>(image.counts.size());
}

/// The same with a depth buffer: samples as they are stored, one after the other.
void warp_layers_depth_buffer(benchmark::State& state) {
    using namespace farfield;
    const LayeredDepthImage image = wavy_layers(static_cast<unsigned>(state.range(0)));
    const View view = warped_view(state.range(1));
    const LayeredTerms terms = layered_terms(image, view);
    const auto pixels = support::pixel_count(view);
    std::vector<glm::vec<4, std::uint8_t>> colors(pixels);
    std::vector<float> depths(pixels);
    while (state.KeepRunning()) {
        std::fill(colors.begin(), colors.end(), glm::vec<4, std::uint8_t>(0));
        std::fill(depths.begin(), depths.end(), std::numeric_limits<float>::infinity());
        for (const LayeredSample& sample : image.samples) {
            const auto depth = static_cast<float>(sample.depth);
            const glm::vec3 seen = terms.columns[0] * static_cast<float>(sample.x) +
                                   terms.columns[1] * static_cast<float>(sample.y) +
                                   terms.columns[2] * depth + terms.columns[3];
            const float z = seen.z / (terms.inverse_step * depth + terms.inverse_far);
            if (z < terms.near_distance || z > terms.far_distance) {
                continue;
            }
            const float inverse = 1.0F / seen.z;
            const float half = 0.5F * static_cast<float>(sample.extent) * terms.size * inverse;
            const auto pixel = [](float edge, int end) {
                const float inside = std::clamp(edge - 0.5F, 0.0F, static_cast<float>(end));
                const auto whole = static_cast<int>(inside);
                return whole + static_cast<int>(static_cast<float>(whole) < inside);
            };
            const int x0 = pixel(seen.x * inverse - half, view.width);
            const int x1 = pixel(seen.x * inverse + half, view.width);
            const int y1 = pixel(seen.y * inverse + half, view.height);
            for (int y = pixel(seen.y * inverse - half, view.height); y < y1; ++y) {
                for (int x = x0; x < x1; ++x) {
                    const auto at = support::pixel_at(view, x, y);
                    if (z < depths[at]) {
                        depths[at] = z;
                        colors[at] = sample.color;
                    }
                }
            }
        }
        benchmark::DoNotOptimize(colors.data());
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(image.samples.size()) * state.iterations());
}

/// Nine pictures of balls in a room.
void merge_views(benchmark::State& state) {
    using namespace farfield;
    View central = support::straight_view(512, 384);
    central.lens.far_distance = 60.0;
    support::AnalyticScene scene;
    scene.balls = {{{-2.0, 0.5, -10.0}, 1.5}, {{1.5, -0.5, -8.0}, 1.0}, {{0.3, 1.2, -14.0}, 2.0}};
    scene.planes = {
        {{0.0, 1.0, 0.0}, -3.0},
        {glm::normalize(glm::dvec3(1.0, 0.0, 0.15)), -6.0},
        {{0.0, 0.0, 1.0}, -20.0}};
    std::vector<ConstructionView> views;
    for (const View& view : support::construction_views(central, 8.0)) {
        views.push_back(scene.picture(view));
    }
    const std::vector<glm::dmat4x3> frames = scene.frames();
    LayeredImageQuality quality;
    while (state.KeepRunning()) {
        const auto built = build_layered_image(central, views, frames);
        if (!built) {
            state.SkipWithError(built.error().message.c_str());
            return;
        }
        quality = built->quality;
    }
    state.SetItemsProcessed(static_cast<std::int64_t>(quality.seen) * state.iterations());
    state.counters["layers"] = quality.mean_layers;
}

BENCHMARK(merge_views)->Unit(benchmark::kMillisecond);
BENCHMARK(warp_layers)
    ->ArgNames({"layers", "eye", "threads", "by_depth"})
    ->ArgsProduct({{2, 3, 4}, {0, 1, 2}, {1, 2}, {0, 1}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(warp_layers_depth_buffer)
    ->ArgNames({"layers", "eye"})
    ->ArgsProduct({{2, 3, 4}, {0}})
    ->Unit(benchmark::kMillisecond);
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
