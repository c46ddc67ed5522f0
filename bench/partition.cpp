// Growth of the partition builders with the number of objects, on scenes of different kinds.
#include "../tests/partition/scenes.hpp"
#include <farfield/partition/bsp.hpp>

#include <benchmark/benchmark.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace {

using farfield::Object;

/// What a tree is worth, beside the time it took.
void report(benchmark::State& state, const farfield::Hierarchy& tree, std::size_t elements) {
    using benchmark::Counter;
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(elements));
    state.counters["depth"] = Counter(tree.quality.depth);
    state.counters["leaves"] = Counter(tree.quality.leaves);
    state.counters["cut_items"] = Counter(tree.quality.cut_items);
    state.counters["tree_bytes"] = Counter(static_cast<double>(farfield::memory_bytes(tree)));
}

void build(
    benchmark::State& state,
    std::span<const Object> objects,
    std::size_t elements,
    const farfield::partition::BspOptions& options,
    const farfield::PrimitiveBounds& primitive_bounds = {}
) {
    farfield::Hierarchy last;
    while (state.KeepRunning()) {
        auto tree = farfield::partition::build_bsp(objects, options, primitive_bounds);
        if (!tree) {
            state.SkipWithError(tree.error().message.c_str());
            return;
        }
        last = std::move(*tree);
    }
    report(state, last, elements);
}

void random_boxes(benchmark::State& state) {
    const auto objects =
        farfield::support::random_boxes(static_cast<std::size_t>(state.range(0)), 1);
    build(state, objects, objects.size(), {.split_vertically = true});
}

void touching_grid(benchmark::State& state) {
    const auto objects = farfield::support::grid_boxes(static_cast<std::size_t>(state.range(0)));
    build(state, objects, objects.size(), {});
}

void clusters(benchmark::State& state) {
    const auto objects =
        farfield::support::clustered_boxes(static_cast<std::size_t>(state.range(0)), 1);
    build(state, objects, objects.size(), {});
}

/// 1117 trees and nothing else, then with a terrain of 131,072 triangles; on discs of two sizes.
void island(benchmark::State& state) {
    const auto island =
        farfield::support::make_island(1117, static_cast<double>(state.range(0)), 12.0, 1);
    const bool terrain = state.range(1) != 0;
    const std::span<const Object> objects(island.objects);
    build(
        state,
        terrain ? objects : objects.subspan(1),
        island.objects.size() - 1 + (terrain ? farfield::support::Island::kTriangles : 0U),
        {.directions = static_cast<std::uint32_t>(state.range(2))},
        island.primitive_bounds()
    );
}

BENCHMARK(random_boxes)
    ->RangeMultiplier(10)
    ->Range(1'000, 1'000'000)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(touching_grid)
    ->RangeMultiplier(10)
    ->Range(1'000, 1'000'000)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(clusters)->RangeMultiplier(10)->Range(1'000, 1'000'000)->Unit(benchmark::kMillisecond);
BENCHMARK(island)
    ->ArgNames({"radius", "terrain", "directions"})
    ->ArgsProduct({{400, 2000}, {0, 1}, {2, 4}})
    ->Unit(benchmark::kMillisecond);

} // namespace
