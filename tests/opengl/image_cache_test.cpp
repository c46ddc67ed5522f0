#include "opengl/device.hpp"
#include "support/small_scene.hpp"
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <utility>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr int kWidth = 480;
constexpr int kHeight = 320;

/// How a frame made of images differs from geometry.
struct Difference {
    double psnr_db = 0.0;
    double over_share = 0.0; ///< of the covered pixels, further apart than 2/255 in a channel
    int covered = 0;
    int covered_border = 0; ///< of those, on the border of the frame
};

Difference compare(const Picture& geometry, const Picture& images, const Color& sky) {
    Difference result;
    double squares = 0.0;
    int over = 0;
    for (int y = 0; y < geometry.height; ++y) {
        for (int x = 0; x < geometry.width; ++x) {
            const Color a = color_at(geometry, x, y);
            const Color b = color_at(images, x, y);
            for (std::size_t channel = 0; channel < 3; ++channel) {
                const double difference = a[channel] - b[channel];
                squares += difference * difference;
            }
            const bool border =
                x == 0 || y == 0 || x == geometry.width - 1 || y == geometry.height - 1;
            result.covered += a != sky ? 1 : 0;
            result.covered_border += border && a != sky ? 1 : 0;
            over += distance(a, b) > 2 ? 1 : 0;
        }
    }
    const double mean = squares / (3.0 * geometry.width * geometry.height);
    result.psnr_db = mean > 0.0 ? 10.0 * std::log10(255.0 * 255.0 / mean) : 200.0;
    result.over_share = static_cast<double>(over) / result.covered;
    return result;
}

/// The whole of `small_scene` from a hill beside it: every image is wholly on screen.
View overview() {
    const Lens lens = perspective_lens(0.9, static_cast<double>(kWidth) / kHeight, 0.5, 1000.0);
    return look_at({-70.0, 45.0, 110.0}, {-4.0, -4.0, 0.0}, {0.0, 1.0, 0.0}, lens, kWidth, kHeight);
}

ImageCacheOptions eager_options() {
    ImageCacheOptions options = presets::shade1996();
    options.error_px = 2.0;
    options.costs.triangle_s = 1e-6;
    options.overlap_px = 0.0; // images are not inflated
    return options;
}

SmallWorld uninflated_world() {
    SmallWorld world = make_world(small_scene());
    world.hierarchy.inflation = 0.0F;
    return world;
}

FrameClear sky_clear() {
    FrameClear clear;
    clear.color = {0.0F, 0.0F, 1.0F, 1.0F}; // nothing in the scene is
    return clear;
}

} // namespace

TEST_CASE("The frame in which images are made equals geometry") {
    const SmallWorld world = uninflated_world();
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    const View view = overview();
    CulledGeometry geometry(world.hierarchy);
    const Picture reference =
        draw(*device->backend, geometry.plan(view), kWidth, kHeight, 1, sky_clear());
    for (const SurfacePlacement surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        for (const bool exact : {false, true}) {
            INFO((surfaces == SurfacePlacement::first ? "surfaces first" : "surfaces in images"));
            INFO((exact ? "exact pixels" : "own matrices"));
            ImageCacheOptions options = eager_options();
            options.surfaces = surfaces;
            options.exact_pixels = exact;
            auto cache = ImageCache::create(world.hierarchy, options);
            REQUIRE(cache.has_value());
            const FramePlan plan = cache->plan(view, {});
            REQUIRE(cache->statistics().images_created > 10);
            REQUIRE(cache->statistics().images_combined > 3);
            const Picture picture = draw(*device->backend, plan, kWidth, kHeight, 1, sky_clear());
            const Difference difference = compare(reference, picture, {0, 0, 255, 255});
            CHECK(difference.covered > kWidth * kHeight / 8);
            CHECK(difference.covered_border == 0); // images are wholly on screen
            if (exact) {
                CHECK(difference.psnr_db == 200.0);
                CHECK(count_different(reference, picture) == 0);
            } else {
                // An off-axis matrix moves edges by some steps of 1/256 pixel.
                CHECK(difference.psnr_db >= 50.0);
                CHECK(difference.over_share <= 0.002);
            }
            // The next frame from there shows the same images, made of nothing.
            const FramePlan& again = cache->plan(view, {});
            CHECK(cache->statistics().images_created == 0);
            CHECK(draw(*device->backend, again, kWidth, kHeight, 1, sky_clear()) == picture);
        }
    }
}

TEST_CASE("Without images a cache draws what geometry draws") {
    const SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    ImageCacheOptions options = eager_options();
    options.image_budget_bytes = 0;
    auto cache = ImageCache::create(world.hierarchy, options);
    REQUIRE(cache.has_value());
    CulledGeometry geometry(world.hierarchy);
    for (int frame = 0; frame < 60; frame += 20) {
        const View view = small_walk(frame, kWidth, kHeight);
        const Picture with = draw(*device->backend, cache->plan(view, {}), kWidth, kHeight);
        CHECK(with == draw(*device->backend, geometry.plan(view), kWidth, kHeight));
    }
}

TEST_CASE("Every surface is drawn once, whatever the order") {
    const SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    // Items drawn alone, and the ground by all its pieces: no hierarchy decides.
    FramePlan all;
    all.origin = world.hierarchy.origin;
    Command command;
    for (std::size_t i = 1; i < world.scene.instances.size(); ++i) {
        all.items.push_back(make_id<ItemId>(i));
    }
    all.pieces = world.hierarchy.pieces;
    command.count = static_cast<std::uint32_t>(all.items.size());
    command.piece_count = static_cast<std::uint32_t>(all.pieces.size());
    all.commands = {command};
    Pass pass;
    pass.view = small_walk(10, kWidth, kHeight);
    pass.viewport = {0, 0, kWidth, kHeight};
    pass.scissor = pass.viewport;
    pass.command_count = 1;
    all.passes = {pass};
    const Picture reference = draw(*device->backend, all, kWidth, kHeight);
    for (const GeometryOrder order : {GeometryOrder::stored, GeometryOrder::front_to_back}) {
        CulledGeometry geometry(world.hierarchy, order);
        const Picture picture = draw(*device->backend, geometry.plan(pass.view), kWidth, kHeight);
        // Surfaces that cross at one depth may be drawn in either order.
        CHECK(count_different(reference, picture) <= kWidth * kHeight / 10000);
    }
}
