#pragma once

#include "gpu/flat_scene.hpp"
#include "support/small_scene.hpp"
#include <farfield/gpu/backend.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/scene/scene.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

/// What holds of the positions of every backend that keeps them.
namespace farfield::support {

/// Distance between a pixel's centre and the projection of the point that it shows. [px]
inline double displacement_px(
    const PositionTexel& texel,
    int x,
    int y,
    const View& view,
    const std::vector<glm::dmat4x3>& frames
) {
    const glm::dmat4x3& frame = frames[index_of(texel.item)];
    const glm::dvec3 world = frame * glm::dvec4(glm::dvec3(texel.point), 1.0);
    const glm::dvec3 camera = glm::transpose(view.camera_to_world) * (world - view.eye);
    if (camera.z >= 0.0) {
        return std::numeric_limits<double>::infinity();
    }
    const Lens& lens = view.lens;
    const double at_x =
        (camera.x / -camera.z - lens.left) / (lens.right - lens.left) * view.width - 0.5;
    const double at_y =
        (lens.top - camera.y / -camera.z) / (lens.top - lens.bottom) * view.height - 0.5;
    return std::hypot(at_x - x, at_y - y);
}

/// What the pixels of one frame show.
struct PositionTally {
    int background = 0;
    int geometry = 0;
    int images = 0;
    double worst_geometry_px = 0.0;
    double worst_over_sampling_px = -1.0; ///< of images: displacement less error of sampling
};

inline PositionTally tally(const PositionPicture& picture, const View& view, const Scene& scene) {
    REQUIRE(picture.width == view.width);
    REQUIRE(picture.height == view.height);
    REQUIRE(picture.texels.size() == static_cast<std::size_t>(view.width * view.height));
    const std::vector<glm::dmat4x3> frames = item_frames(scene);
    PositionTally result;
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const PositionTexel& texel =
                picture.texels
                    [static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) +
                     static_cast<std::size_t>(x)];
            if (texel.item == kNone<ItemId>) {
                ++result.background;
                continue;
            }
            REQUIRE(index_of(texel.item) < frames.size());
            const double moved = displacement_px(texel, x, y, view, frames);
            if (texel.node == UINT32_MAX) {
                ++result.geometry;
                CHECK(texel.texel_px == 0.0F);
                result.worst_geometry_px = std::max(result.worst_geometry_px, moved);
            } else {
                ++result.images;
                result.worst_over_sampling_px = std::max(
                    result.worst_over_sampling_px,
                    moved - std::sqrt(0.5) * static_cast<double>(texel.texel_px)
                );
            }
        }
    }
    return result;
}

/// Vertices are snapped to 1/256 of a pixel on devices that rasterise, so a point inside a triangle
/// is off by at most half the diagonal of that. The rest is for float arithmetic along the way, of
/// values of 100 m whose last bit is 4e-6 m, a hundredth of a pixel at one metre.
inline constexpr double kRasterPx = 0.0028 + 0.01;

/// @param colors, positions fresh backends over `small_scene` that differ in keeping positions
inline void check_positions(Backend& colors, Backend& positions, const SmallWorld& world) {
    constexpr int kWidth = 160;
    constexpr int kHeight = 120;
    REQUIRE(positions.limits().positions);
    REQUIRE_FALSE(colors.limits().positions);
    const auto color_target = colors.create_target(kWidth, kHeight, 1);
    const auto position_target = positions.create_target(kWidth, kHeight, 1);
    REQUIRE(color_target.has_value());
    REQUIRE(position_target.has_value());

    SECTION("none are kept where they were not asked for") {
        const auto read = colors.read_positions(*color_target);
        REQUIRE_FALSE(read.has_value());
        CHECK(read.error().code == ErrorCode::unsupported);
        CHECK(colors.position_bytes() == 0);
        const auto unknown = positions.read_positions(TargetId{1000});
        REQUIRE_FALSE(unknown.has_value());
        CHECK(unknown.error().code == ErrorCode::invalid_argument);
    }
    SECTION("geometry shows at each pixel the point that is there") {
        CulledGeometry geometry(world.hierarchy);
        for (int frame = 0; frame < 160; frame += 40) {
            INFO("frame " << frame);
            const View view = small_walk(frame, kWidth, kHeight);
            REQUIRE(positions.execute(geometry.plan(view), *position_target, {}).has_value());
            const auto picture = positions.read_positions(*position_target);
            REQUIRE(picture.has_value());
            const PositionTally all = tally(*picture, view, world.scene);
            CHECK(all.geometry > 1000);
            CHECK(all.background > 0);
            CHECK(all.images == 0);
            CHECK(all.worst_geometry_px < kRasterPx);
        }
    }
    SECTION("images show what was there when they were made, and colours stay as they are") {
        for (const bool exact_pixels : {false, true}) {
            for (const SurfacePlacement surfaces :
                 {SurfacePlacement::first, SurfacePlacement::in_images}) {
                ImageCacheOptions options = presets::shade1996();
                options.page_size = 512;
                options.costs.triangle_s = 1e-6;
                options.surfaces = surfaces;
                options.exact_pixels = exact_pixels;
                auto cache = ImageCache::create(world.hierarchy, options);
                REQUIRE(cache.has_value());
                int images = 0;
                for (int frame = 0; frame < 40; ++frame) {
                    INFO("frame " << frame << ", exact pixels " << exact_pixels);
                    const View view = small_walk(frame, kWidth, kHeight);
                    if (frame == 20) {
                        cache->forget_images(); // the pages go as well
                    }
                    const FramePlan& plan = cache->plan(view, small_walk_motion());
                    REQUIRE(colors.execute(plan, *color_target, {}).has_value());
                    REQUIRE(positions.execute(plan, *position_target, {}).has_value());
                    const auto color = colors.read_target(*color_target);
                    const auto beside = positions.read_target(*position_target);
                    REQUIRE(color.has_value());
                    REQUIRE(beside.has_value());
                    CHECK(*color == *beside);
                    const auto picture = positions.read_positions(*position_target);
                    REQUIRE(picture.has_value());
                    const PositionTally all = tally(*picture, view, world.scene);
                    CHECK(all.worst_geometry_px < kRasterPx);
                    images += all.images;
                    if (frame == 0 || frame == 20) {
                        // All images are new, so sampling is their only error.
                        CHECK(all.images > 0);
                        CHECK(all.worst_over_sampling_px < kRasterPx);
                    }
                }
                CHECK(images > 1000);
                // 24 bytes a texel, of which colour has 4, and depth 4 in a scratch page.
                CHECK(positions.position_bytes() > 3 * positions.image_bytes());
                CHECK(positions.position_bytes() < 6 * positions.image_bytes());
                cache->forget_images();
                const FramePlan& drop = cache->plan(small_walk(0, kWidth, kHeight), {});
                REQUIRE(colors.execute(drop, *color_target, {}).has_value());
                REQUIRE(positions.execute(drop, *position_target, {}).has_value());
            }
        }
    }
}

/// @param positions a fresh backend over `small_scene` that keeps positions
/// @param set_transform of what draws the scene
template <typename SetTransform>
void check_moved_positions(
    Backend& positions, SmallWorld& world, const SetTransform& set_transform
) {
    constexpr int kWidth = 160;
    constexpr int kHeight = 120;
    const auto target = positions.create_target(kWidth, kHeight, 1);
    REQUIRE(target.has_value());
    // A tree hovers before the eye, on its side, half as large; then it goes on.
    const View view = small_walk(40, kWidth, kHeight);
    const glm::dvec3 ahead = -view.camera_to_world[2];
    for (const double distance : {8.0, 11.0}) {
        Instance& tree = world.scene.instances[1];
        tree.object_to_world = glm::dmat4x3(
            {0.0, 0.5, 0.0}, {-0.5, 0.0, 0.0}, {0.0, 0.0, 0.5}, view.eye + distance * ahead
        );
        REQUIRE(set_transform(ItemId{1}, tree.object_to_world).has_value());
        REQUIRE(partition::update_bounds(
                    world.hierarchy, ItemId{1}, item_bounds(world.scene, ItemId{1})
        )
                    .has_value());
        CulledGeometry geometry(world.hierarchy);
        REQUIRE(positions.execute(geometry.plan(view), *target, {}).has_value());
        const auto picture = positions.read_positions(*target);
        REQUIRE(picture.has_value());
        const PositionTally all = tally(*picture, view, world.scene);
        CHECK(all.geometry > 1000);
        CHECK(all.worst_geometry_px < kRasterPx);
        const auto of_tree =
            std::count_if(picture->texels.begin(), picture->texels.end(), [](const auto& texel) {
                return texel.item == ItemId{1};
            });
        CHECK(of_tree > 100);
    }
}

/// Half of a wall behind splats and a cube: what owns a pixel shows no point that is known.
/// @param positions a fresh backend over `scene` that keeps positions
/// @param wall in the plane z = 0, all over the flat view's pixels [16, 48)
inline void check_cell_positions(Backend& positions, ItemId wall) {
    const auto target = positions.create_target(kSize, kSize, 1);
    REQUIRE(target.has_value());
    FramePlan plan = flat_plan({wall});
    // In the plane z = 1 a pixel is 7 / 32 m.
    const auto splat = [](float x, float y, std::uint8_t alpha, float z) {
        const float pixel = (8.0F - z) / 32.0F;
        return Splat{{(x - 32.0F) * pixel, (y - 32.0F) * pixel, z}, 4.0F * pixel, {0, 0, 0, alpha}};
    };
    plan.splats = {
        splat(20.0F, 32.0F, 128, 1.0F),
        splat(28.0F, 32.0F, 127, 1.0F),
        splat(36.0F, 32.0F, 255, -1.0F), // behind the wall
        splat(8.0F, 32.0F, 255, 1.0F)};  // beside it
    plan.cube_frames = {glm::mat3(1.0F)};
    ShownCube cube;
    cube.center = {2.8F, 2.8F, 0.5F}; // 42.5 to 47.1 px at z = 1, from 41.2 px at z = 0
    cube.size = glm::vec3(1.0F);
    cube.faces.fill(glm::vec<4, std::uint8_t>(200));
    plan.cubes = {cube};
    for (const Command::Kind kind : {Command::Kind::splats, Command::Kind::cubes}) {
        Command command;
        command.kind = kind;
        command.count = kind == Command::Kind::splats ? 4 : 1;
        plan.commands.push_back(command);
    }
    plan.passes[0].command_count = 3;
    REQUIRE(positions.execute(plan, *target, {}).has_value());
    const auto picture = positions.read_positions(*target);
    REQUIRE(picture.has_value());
    const auto item_at = [&](int x, int y) {
        return picture
            ->texels[static_cast<std::size_t>(kSize - 1 - y) * kSize + static_cast<std::size_t>(x)]
            .item;
    };
    CHECK(item_at(19, 31) == kNone<ItemId>);
    CHECK(item_at(23, 31) == wall);
    CHECK(item_at(28, 31) == wall);
    CHECK(item_at(36, 31) == wall);
    CHECK(item_at(8, 31) == kNone<ItemId>);
    CHECK(item_at(45, 45) == kNone<ItemId>);
    CHECK(item_at(40, 40) == wall);
    // The next frame begins with none of it.
    REQUIRE(positions.execute(flat_plan({wall}), *target, {}).has_value());
    const auto plain = positions.read_positions(*target);
    REQUIRE(plain.has_value());
    const auto of_wall =
        std::count_if(plain->texels.begin(), plain->texels.end(), [&](const auto& texel) {
            return texel.item == wall;
        });
    CHECK(of_wall == 32L * 32);
}

} // namespace farfield::support
