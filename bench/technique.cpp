// Planning of frames on a moving path: the island of 1117 trees and its terrain, and forests of
// equal density that are larger; and what placing images is made of.
#include "../tests/partition/scenes.hpp"
#include "technique/placement_search.hpp"
#include "technique/placement_site.hpp"
#include <farfield/math/frustum.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/technique/build_placement.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>
#include <farfield/technique/image_placement.hpp>
#include <farfield/technique/mesh_lod.hpp>

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <vector>

namespace {

using namespace farfield;

struct BenchScene {
    Hierarchy tree;
    LodTable levels;
    double radius = 0.0; ///< [m]
    std::string error;
};

/// Nine levels a tree, with errors like those of a willow of 36,230 triangles made of clusters.
LodTable make_levels(std::span<const Object> objects) {
    constexpr std::uint32_t kLevels = 9;
    LodTable table;
    std::size_t items = objects.size();
    for (const Object& object : objects) {
        const auto first = static_cast<std::uint32_t>(table.levels.size());
        const std::uint32_t count = object.splittable ? 0 : kLevels;
        table.items.push_back({object.bounds, object.primitives, first, count});
        float error_m = 0.25F;
        auto primitives = static_cast<std::uint32_t>(object.primitives);
        for (std::uint32_t level = 0; level < count; ++level) {
            primitives /= 2;
            table.levels.push_back({make_id<ItemId>(items++), error_m, primitives});
            error_m *= 1.3F;
        }
    }
    return table;
}

BenchScene built(Result<Hierarchy> tree, std::span<const Object> objects, double radius) {
    if (!tree) {
        return {{}, {}, 0.0, tree.error().message};
    }
    return {std::move(*tree), make_levels(objects), radius, {}};
}

BenchScene make_island_scene() {
    constexpr double kRadius = 400.0;
    const auto island = support::make_island(1117, kRadius, 12.0, 1);
    return built(
        partition::build_bsp(island.objects, {}, island.primitive_bounds()), island.objects, kRadius
    );
}

/// Trees somewhere in the squares of a grid of 16 m.
BenchScene make_forest_scene(std::size_t trees) {
    constexpr double kSquare = 16.0;
    support::Random random(1);
    const auto side = static_cast<std::size_t>(std::sqrt(static_cast<double>(trees)));
    const double radius = kSquare * static_cast<double>(side) / 2.0;
    std::vector<Object> objects;
    objects.reserve(side * side);
    for (std::size_t index = 0; index < side * side; ++index) {
        const double x = kSquare * static_cast<double>(index % side) - radius;
        const std::size_t row = index / side;
        const double z = kSquare * static_cast<double>(row) - radius;
        const double half = random.uniform(4.0, 6.0);
        const glm::dvec3 foot(x + random.uniform(6.0, 10.0), 0.0, z + random.uniform(6.0, 10.0));
        objects.push_back(
            {{foot - glm::dvec3(half, 0.0, half), foot + glm::dvec3(half, 14.0, half)},
             36'230,
             false}
        );
    }
    return built(partition::build_bsp(objects), objects, radius);
}

/// The island where `objects` is 0. Built once for all benchmarks.
const BenchScene& scene_of(std::int64_t objects) {
    static std::map<std::int64_t, BenchScene> scenes;
    const auto [place, is_new] = scenes.try_emplace(objects);
    if (is_new) {
        place->second = objects == 0 ? make_island_scene()
                                     : make_forest_scene(static_cast<std::size_t>(objects));
    }
    return place->second;
}

struct Path {
    std::vector<View> views;
    std::vector<Motion> motions;
};

/// Once around at 3/4 of the radius and 60 frames a second, above the trees, looking across.
Path make_path(double radius) {
    constexpr std::size_t kFrames = 1200;
    constexpr double kFrameSeconds = 1.0 / 60;
    const Lens lens = perspective_lens(std::numbers::pi / 4.0, 4.0 / 3.0, 0.5, 2e4);
    const double speed = 15.0; // [m/s]
    const double step = speed * kFrameSeconds / (0.75 * radius);
    const auto eye_at = [&](double frame) {
        return 0.75 * radius * glm::dvec3(std::cos(step * frame), 0.0, std::sin(step * frame)) +
               glm::dvec3(0.0, 40.0, 0.0);
    };
    Path path;
    for (std::size_t index = 0; index < kFrames; ++index) {
        const auto frame = static_cast<double>(index);
        const glm::dvec3 eye = eye_at(frame);
        path.views.push_back(look_at(eye, {0, 10, 0}, {0, 1, 0}, lens, 640, 480));
        path.motions.push_back(
            estimate_motion(eye, eye_at(frame - 1.0), eye_at(frame - 2.0), kFrameSeconds)
        );
    }
    return path;
}

/// Nodes that culling looks at; all but the counting is left out.
std::uint64_t count_visited(const Hierarchy& tree, const Frustum& frustum, std::uint32_t index) {
    const HierarchyNode& node = tree.nodes[index];
    const bool seen =
        (node.item_count > 0 && classify(frustum, node.items_box) != Overlap::outside) ||
        (node.piece_count > 0 && classify(frustum, node.pieces_box) != Overlap::outside);
    if (!seen || is_leaf(node)) {
        return 1;
    }
    return 1 + count_visited(tree, frustum, node.first_child) +
           count_visited(tree, frustum, node.first_child + 1);
}

void report_nodes(benchmark::State& state, double visited, const Hierarchy& tree) {
    using benchmark::Counter;
    state.counters["time_per_node"] = Counter(visited, Counter::kIsRate | Counter::kInvert);
    state.counters["nodes_visited"] = Counter(visited, Counter::kAvgIterations);
    state.counters["bytes"] = Counter(static_cast<double>(memory_bytes(tree)));
}

void culled_geometry(benchmark::State& state) {
    const BenchScene& scene = scene_of(state.range(0));
    if (!scene.error.empty()) {
        state.SkipWithError(scene.error.c_str());
        return;
    }
    const Path path = make_path(scene.radius);
    std::vector<std::uint64_t> visited;
    for (const View& view : path.views) {
        visited.push_back(count_visited(scene.tree, make_frustum(view, scene.tree.origin), 0));
    }
    CulledGeometry technique(scene.tree);
    std::size_t frame = 0;
    double nodes = 0.0;
    double items = 0.0;
    while (state.KeepRunning()) {
        items += static_cast<double>(technique.plan(path.views[frame]).items.size());
        nodes += static_cast<double>(visited[frame]);
        frame = (frame + 1) % path.views.size();
    }
    report_nodes(state, nodes, scene.tree);
    state.counters["items"] = benchmark::Counter(items, benchmark::Counter::kAvgIterations);
}

void mesh_lod(benchmark::State& state) {
    const BenchScene& scene = scene_of(state.range(0));
    if (!scene.error.empty()) {
        state.SkipWithError(scene.error.c_str());
        return;
    }
    auto technique = MeshLod::create(
        scene.tree, scene.levels, {.error_px = static_cast<double>(state.range(1))}
    );
    if (!technique) {
        state.SkipWithError(technique.error().message.c_str());
        return;
    }
    const Path path = make_path(scene.radius);
    std::size_t frame = 0;
    double items = 0.0;
    double triangles = 0.0;
    double full_triangles = 0.0;
    while (state.KeepRunning()) {
        items += static_cast<double>(technique->plan(path.views[frame]).items.size());
        triangles += static_cast<double>(technique->statistics().triangles);
        full_triangles += static_cast<double>(technique->statistics().full_triangles);
        frame = (frame + 1) % path.views.size();
    }
    using benchmark::Counter;
    state.counters["time_per_item"] = Counter(items, Counter::kIsRate | Counter::kInvert);
    state.counters["items"] = Counter(items, Counter::kAvgIterations);
    state.counters["triangles"] = Counter(triangles, Counter::kAvgIterations);
    state.counters["full_triangles"] = Counter(full_triangles, Counter::kAvgIterations);
}

void image_cache(benchmark::State& state) {
    const BenchScene& scene = scene_of(state.range(0));
    if (!scene.error.empty()) {
        state.SkipWithError(scene.error.c_str());
        return;
    }
    auto cache = ImageCache::create(
        scene.tree, presets::shade1996({.error_px = static_cast<double>(state.range(1))})
    );
    if (!cache) {
        state.SkipWithError(cache.error().message.c_str());
        return;
    }
    const Path path = make_path(scene.radius);
    // The first frame makes most images; it is the business of another measurement.
    for (std::size_t frame = 0; frame < 60; ++frame) {
        (void)cache->plan(path.views[frame], path.motions[frame]);
    }
    std::size_t frame = 60;
    double nodes = 0.0;
    double created = 0.0;
    double shown = 0.0;
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(cache->plan(path.views[frame], path.motions[frame]));
        nodes += cache->statistics().nodes_visited;
        created += cache->statistics().images_created;
        shown += cache->statistics().images_shown;
        frame = (frame + 1) % path.views.size();
    }
    report_nodes(state, nodes, scene.tree);
    using benchmark::Counter;
    state.counters["created"] = Counter(created, Counter::kAvgIterations);
    state.counters["shown"] = Counter(shown, Counter::kAvgIterations);
    state.counters["image_bytes"] =
        Counter(static_cast<double>(cache->statistics().image_bytes_peak));
}

/// A cache without images: the first plan of a path.
void image_cache_first_frame(benchmark::State& state) {
    const BenchScene& scene = scene_of(state.range(0));
    if (!scene.error.empty()) {
        state.SkipWithError(scene.error.c_str());
        return;
    }
    auto cache = ImageCache::create(
        scene.tree, presets::shade1996({.error_px = static_cast<double>(state.range(1))})
    );
    if (!cache) {
        state.SkipWithError(cache.error().message.c_str());
        return;
    }
    const Path path = make_path(scene.radius);
    double nodes = 0.0;
    double created = 0.0;
    while (state.KeepRunning()) {
        cache->forget_images();
        benchmark::DoNotOptimize(cache->plan(path.views[0], path.motions[0]));
        nodes += cache->statistics().nodes_visited;
        created += cache->statistics().images_created;
    }
    report_nodes(state, nodes, scene.tree);
    state.counters["created"] = benchmark::Counter(created, benchmark::Counter::kAvgIterations);
}

/// The same image for all that a map places.
class OneLayeredImage final : public LayeredImageSource {
  public:
    OneLayeredImage() {
        image_.view.width = 1;
        image_.view.height = 1;
        image_.counts = {1};
        image_.rows = {0, 1};
        image_.samples.resize(1);
    }
    void want(std::span<const std::uint32_t>) noexcept override {}
    const LayeredDepthImage* find(std::uint32_t) noexcept override { return &image_; }

  private:
    LayeredDepthImage image_;
};

/// Turning around in the middle of a forest, one cell a tree or few.
void placement_plan(benchmark::State& state) {
    const BenchScene& scene = scene_of(state.range(0));
    if (!scene.error.empty()) {
        state.SkipWithError(scene.error.c_str());
        return;
    }
    PlacementOptions options;
    // A view through this lens has a fifth of the forest.
    options.max_primitives = primitive_count(scene.tree.nodes[0]) / 8;
    options.eyes = {{-8.0, 2.0, -8.0}, {8.0, 10.0, 8.0}};
    options.first_grid = 2;
    options.cell_depth = 24;
    SerialExecutor executor;
    const auto map = build_placement(scene.tree, options, executor);
    if (!map) {
        state.SkipWithError(map.error().message.c_str());
        return;
    }
    OneLayeredImage images;
    auto technique = ImagePlacement::create(scene.tree, *map, images);
    if (!technique) {
        state.SkipWithError(technique.error().message.c_str());
        return;
    }
    const View like{.lens = options.lens, .width = options.width, .height = options.height};
    std::vector<View> views;
    for (int i = 0; i < 720; ++i) {
        const double turn = 2.0 * std::numbers::pi * i / 720.0;
        const glm::dvec3 eye(7.0 * std::cos(turn), 5.0, 7.0 * std::sin(turn));
        views.push_back(level_view(yaw_frame(options.up), eye, turn, 0.0, like));
    }
    std::size_t frame = 0;
    double drawn = 0.0;
    double shown = 0.0;
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(technique->plan(views[frame], {}));
        drawn += technique->statistics().cells;
        shown += technique->statistics().samples > 0 ? 1.0 : 0.0;
        frame = (frame + 1) % views.size();
    }
    using benchmark::Counter;
    state.counters["cells"] = Counter(static_cast<double>(map->cells.size()));
    state.counters["cells_drawn"] = Counter(drawn, Counter::kAvgIterations);
    state.counters["images_shown"] = Counter(shown, Counter::kAvgIterations);
}

/// Cells anywhere before a camera, of which a half has to be replaced.
void search_subset(benchmark::State& state) {
    support::Random random(1);
    std::vector<SeenCell> cells(static_cast<std::size_t>(state.range(0)));
    SubsetTask task;
    for (SeenCell& cell : cells) {
        cell.near_depth = random.uniform(10.0, 1000.0);
        const double half = 4.0 / cell.near_depth;
        const double x = random.uniform(-0.8, 0.8);
        const double y = random.uniform(-0.6, 0.6);
        cell.left = x - half;
        cell.right = x + half;
        cell.bottom = y - half;
        cell.top = y + half;
        cell.primitives = 1 + random.below(1000);
        task.total += cell.primitives;
    }
    task.cells = cells;
    task.target = task.total / 2;
    task.lens = {-0.8, 0.8, -0.6, 0.6, 0.1, 1e4};
    task.width = 640;
    task.height = 480;
    task.model_extent = 1000.0;
    task.lookahead = static_cast<std::uint32_t>(state.range(1));
    double left = 0.0;
    while (state.KeepRunning()) {
        left = static_cast<double>(task.total - farfield::search_subset(task).primitives);
    }
    state.SetItemsProcessed(state.iterations() * state.range(0));
    state.counters["left_of_target"] = benchmark::Counter(left / static_cast<double>(task.target));
}

/// Boxes all around an eye.
void directions_of(benchmark::State& state) {
    support::Random random(1);
    std::vector<Box3d> boxes;
    for (int i = 0; i < 1024; ++i) {
        const glm::dvec3 middle = random.vector(-500.0, 500.0);
        const glm::dvec3 half = random.vector(1.0, 20.0);
        boxes.push_back({middle - half, middle + half});
    }
    PlacementOptions options;
    options.max_pitch = static_cast<double>(state.range(0)) * 0.1;
    const PlacementTask task{.options = options, .cells = {}, .frame = yaw_frame(options.up)};
    while (state.KeepRunning()) {
        for (const Box3d& box : boxes) {
            benchmark::DoNotOptimize(farfield::directions_of(task, box.lo, box.hi));
        }
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(boxes.size()));
}

constexpr std::int64_t kIsland = 0;

BENCHMARK(culled_geometry)
    ->ArgNames({"objects"})
    ->Arg(kIsland)
    ->Arg(16'384)
    ->Arg(262'144)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(mesh_lod)
    ->ArgNames({"objects", "error_px"})
    ->ArgsProduct({{kIsland, 16'384, 262'144}, {2}})
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(image_cache)
    ->ArgNames({"objects", "error_px"})
    ->ArgsProduct({{kIsland, 16'384, 262'144}, {2, 8}})
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(image_cache_first_frame)
    ->ArgNames({"objects", "error_px"})
    ->ArgsProduct({{kIsland, 16'384, 262'144}, {2}})
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(placement_plan)
    ->ArgNames({"objects"})
    ->RangeMultiplier(4)
    ->Range(512, 32'768)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(search_subset)
    ->ArgNames({"cells", "lookahead"})
    ->ArgsProduct({{512, 4096, 32'768}, {1, 2, 3}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(directions_of)->ArgNames({"pitch_tenths"})->Arg(0)->Arg(5)->Unit(benchmark::kMicrosecond);

} // namespace
