// Places images in a scene so that no view renders more than a number of primitives, as Aliaga and
// Lastra 1999 do, checks the promise on random views, and tells what it takes: table 1 and figure
// 13 of the paper.
#include "run/page.hpp"
#include "run/placement.hpp"
#include "run/program.hpp"
#include "run/world.hpp"
#include <farfield/gpu/plan_work.hpp>
#include <farfield/parallel/parallel_executor.hpp>
#include <farfield/technique/build_placement.hpp>
#include <farfield/technique/image_placement.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using run::Page;

struct Options {
    run::WorldOptions world;
    run::PlacementSetup setup;
    std::vector<std::uint64_t> budgets;
    std::uint64_t checks = 100'000;
    std::uint32_t seed = 1;
    unsigned threads = 0;
    std::string out = "placement";
};

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Has every image and none: where plans are counted and not drawn.
class EmptyImages final : public LayeredImageSource {
  public:
    void want(std::span<const std::uint32_t> /*images*/) noexcept override {}
    [[nodiscard]] const LayeredDepthImage* find(std::uint32_t /*image*/) noexcept override {
        return &empty_;
    }

  private:
    LayeredDepthImage empty_;
};

/// What random views render.
struct Checked {
    std::uint64_t views = 0;
    std::uint64_t over = 0; ///< the budget
    std::uint64_t with_image = 0;
    std::uint64_t most = 0;
    std::uint64_t most_before = 0; ///< without images, of the views that show one
    double mean = 0.0;
    double plan_us = 0.0;
};

Result<Checked>
check(const run::World& world, const PlacementMap& map, std::uint64_t views, std::uint32_t seed) {
    EmptyImages images;
    auto placement = ImagePlacement::create(world.hierarchy, map, images);
    if (!placement) {
        return tl::unexpected(std::move(placement).error());
    }
    std::mt19937_64 random(seed);
    const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
    View screen;
    screen.lens = map.options.lens;
    screen.width = map.options.width;
    screen.height = map.options.height;
    const YawFrame frame = yaw_frame(map.options.up);
    const Box3d& eyes = map.options.eyes;
    Checked checked;
    checked.views = views;
    const auto start = std::chrono::steady_clock::now();
    for (std::uint64_t i = 0; i < views; ++i) {
        const glm::dvec3 eye = eyes.lo + extent(eyes) * glm::dvec3(uniform(), uniform(), uniform());
        const double yaw = (2.0 * uniform() - 1.0) * std::numbers::pi;
        const double pitch = (2.0 * uniform() - 1.0) * map.options.max_pitch;
        const FramePlan& plan = placement->plan(level_view(frame, eye, yaw, pitch, screen), {});
        const std::uint64_t rendered = work_of(plan, world.item_primitives).triangles;
        checked.most = std::max(checked.most, rendered);
        checked.mean += static_cast<double>(rendered);
        const ImagePlacementStatistics& statistics = placement->statistics();
        if (rendered > map.options.max_primitives || statistics.refusal != PlacementRefusal::none) {
            ++checked.over;
        }
        checked.with_image += statistics.image != UINT32_MAX ? 1U : 0U;
    }
    checked.plan_us = seconds_since(start) * 1e6 / static_cast<double>(views);
    checked.mean /= static_cast<double>(views);
    return checked;
}

Result<void> place(CLI::App& app, const std::function<void()>& parse) {
    Options options;
    options.world.scene = "pipes";
    options.world.partition = "octree";
    options.world.cells.max_primitives = 1024;
    run::add_scene_options(app, options.world);
    run::add_partition_options(app, options.world);
    run::add_placement_options(app, options.setup);
    app.add_option("--budgets", options.budgets, "several, one after the other");
    app.add_option("--check", options.checks, "random views to count primitives of");
    app.add_option("--check-seed", options.seed, "of random views");
    app.add_option("--threads", options.threads, "0: one for every core");
    app.add_option("--out", options.out, "folder for results");
    parse();
    if (Result<void> made = run::make_folder(options.out); !made) {
        return made;
    }
    const auto world = run::load_world(options.world);
    if (!world) {
        return tl::unexpected(world.error());
    }
    PlacementOptions placement = run::placement_options(*world, options.setup);
    if (options.budgets.empty()) {
        options.budgets = {placement.max_primitives};
    }
    parallel::ParallelExecutor executor(options.threads);
    Page page(std::filesystem::path(options.out) / "README.md");
    page.line(
        "%s: %llu triangles, %zu nodes.\n",
        options.world.scene.c_str(),
        static_cast<unsigned long long>(world->triangles),
        world->hierarchy.nodes.size()
    );
    page.line("| P | target | cells | sites, levels | views | images | of a site | miss | worst, "
              "before | placed [s] | views checked | over | most | mean | with image | plan [us] |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (const std::uint64_t budget : options.budgets) {
        placement.max_primitives = budget;
        const auto start = std::chrono::steady_clock::now();
        const auto map = build_placement(
            world->hierarchy,
            placement,
            executor,
            [](std::size_t placed, std::size_t known) {
                run::print_progress("place", static_cast<int>(placed), static_cast<int>(known));
            }
        );
        if (!map) {
            return tl::unexpected(map.error());
        }
        const double seconds = seconds_since(start);
        const auto checked = check(*world, *map, options.checks, options.seed);
        if (!checked) {
            return tl::unexpected(checked.error());
        }
        page.line(
            "| %llu | %llu | %zu | %zu, %u | %llu | %zu | %.2f | %.1f %% | %llu, %llu | %.1f | "
            "%llu | "
            "%llu | %llu | %.0f | %.1f %% | %.1f |",
            static_cast<unsigned long long>(budget),
            static_cast<unsigned long long>(*map->options.target_primitives),
            map->cells.size(),
            map->sites.size(),
            map->quality.level,
            static_cast<unsigned long long>(map->quality.views),
            map->images.size(),
            static_cast<double>(map->images.size()) / static_cast<double>(map->sites.size()),
            100.0 * map->quality.miss,
            static_cast<unsigned long long>(map->quality.worst),
            static_cast<unsigned long long>(map->quality.worst_before),
            seconds,
            static_cast<unsigned long long>(checked->views),
            static_cast<unsigned long long>(checked->over),
            static_cast<unsigned long long>(checked->most),
            checked->mean,
            100.0 * static_cast<double>(checked->with_image) / static_cast<double>(checked->views),
            checked->plan_us
        );
    }
    return {};
}

} // namespace

int main(int argc, char** argv) {
    return farfield::run::run_program(
        "place",
        "Places images so that no view renders more than a number of primitives.",
        argc,
        argv,
        place
    );
}
