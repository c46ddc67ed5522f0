#include "run/placement.hpp"

#include "run/backends.hpp"
#include "run/program.hpp"
#include <farfield/parallel/parallel_executor.hpp>

#include <algorithm>
#include <chrono>
#include <numbers>
#include <utility>

namespace farfield::run {

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Images that frames of the walk show, in their order.
std::vector<std::uint32_t> images_of_walk(const World& world, const PlacementMap& map) {
    std::vector<std::uint32_t> images;
    for (int frame = 0; frame < world.frames; ++frame) {
        const PlacedView found = find(map, world.view(frame));
        if (found.refusal != PlacementRefusal::none) {
            continue;
        }
        const std::uint32_t image = map.ranges[found.range].image;
        if (image != UINT32_MAX && std::find(images.begin(), images.end(), image) == images.end()) {
            images.push_back(image);
        }
    }
    return images;
}

} // namespace

PlacementOptions placement_options(const World& world, const PlacementSetup& setup) {
    PlacementOptions options = setup.placement;
    options.lens = perspective_lens(
        world.fov_deg * std::numbers::pi / 180.0,
        static_cast<double>(world.width) / world.height,
        0.1,
        1e4
    );
    options.width = world.width;
    options.height = world.height;
    options.up = world.scene.up;
    return options;
}

Result<PlacedWorld> place_images(const World& world, const PlacementSetup& setup) {
    parallel::ParallelExecutor executor;
    const auto placing = std::chrono::steady_clock::now();
    auto map = build_placement(
        world.hierarchy,
        placement_options(world, setup),
        executor,
        [](std::size_t placed, std::size_t known) {
            print_progress("place images", static_cast<int>(placed), static_cast<int>(known));
        }
    );
    if (!map) {
        return tl::unexpected(std::move(map).error());
    }
    PlacedWorld placed;
    placed.map = std::move(*map);
    placed.images = std::make_unique<MadeImages>(placed.map.images.size());
    placed.work.place_s = seconds_since(placing);

    const auto making = std::chrono::steady_clock::now();
    Backends backends(world);
    const auto backend = backends.make("embree", true);
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    auto maker = LayeredImageMaker::create(
        world.hierarchy, placed.map, **backend, world.item_frames, setup.making
    );
    if (!maker) {
        return tl::unexpected(std::move(maker).error());
    }
    const std::vector<std::uint32_t> shown = images_of_walk(world, placed.map);
    PlacementWork& work = placed.work;
    for (const std::uint32_t image : shown) {
        auto made = maker->make(image);
        if (!made) {
            return tl::unexpected(std::move(made).error());
        }
        work.image_bytes += memory_bytes(made->image);
        work.mean_layers += made->quality.mean_layers / static_cast<double>(shown.size());
        placed.images->add(image, std::move(made->image));
        ++work.images_made;
        print_progress(
            "make images", static_cast<int>(work.images_made), static_cast<int>(shown.size())
        );
    }
    work.make_s = seconds_since(making);
    return placed;
}

} // namespace farfield::run
