#include "image/height_fields.hpp"
#include "opengl/device.hpp"
#include "support/random.hpp"
#include "support/small_scene.hpp"
#include <farfield/image/build_proxy.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/lod_sprite.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;

/// A terrain of 192 m with its coarse model, and perhaps a post on it that has none.
struct Terrain {
    SmallWorld world;
    std::vector<ProxyPair> pairs;
};

/// A box that stands on the ground.
Mesh post_mesh(const glm::dvec3& foot) {
    Mesh mesh;
    mesh.name = "post";
    mesh.origin = foot;
    for (unsigned i = 0; i < 8; ++i) {
        mesh.positions.emplace_back(
            (i & 1U) != 0U ? 4.0F : -4.0F,
            (i & 2U) != 0U ? 30.0F : -5.0F,
            (i & 4U) != 0U ? 4.0F : -4.0F
        );
    }
    mesh.indices = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                    2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
    mesh.parts.push_back({0, 36});
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

Terrain make_terrain(bool refinable, bool with_post) {
    const HeightGrid grid = wavy_grid(65, 65);
    Mesh fine = mesh_of(grid);
    // Every vertex in a colour of its own: what is off its place shows.
    Random random(11);
    for (std::size_t i = 0; i < fine.positions.size(); ++i) {
        fine.colors.emplace_back(
            50U + random.below(200), 50U + random.below(200), 50U + random.below(200), 255U
        );
    }
    Scene scene;
    scene.meshes.push_back(std::move(fine));
    scene.materials.resize(1);
    scene.instances.push_back({MeshId{0}});
    if (with_post) {
        scene.meshes.push_back(post_mesh(grid.origin + glm::dvec3(96.0, 10.0, 96.0)));
        scene.instances.push_back({MeshId{1}});
    }
    Terrain terrain;
    terrain.world = make_world(scene);
    const std::size_t items = scene.instances.size();
    const auto gridded = height_grid_of(scene.meshes[0]);
    REQUIRE(gridded.has_value());
    const ProxyItems of{ItemId{0}, make_id<ItemId>(items)};
    auto proxy = refinable ? build_refined_proxy(gridded->grid, of, {.root_squares = 2})
                           : build_grid_proxy(gridded->grid, of, {.squares = 16});
    REQUIRE(proxy.has_value());
    Scene& drawn = terrain.world.scene;
    const auto added = add_coarse_mesh(
        drawn, MeshId{0}, make_coarse_mesh(drawn.meshes[0], *gridded, *proxy), items
    );
    REQUIRE(added.size() == 1);
    REQUIRE(added[0].coarse == of.coarse);
    REQUIRE(validate(drawn).has_value());
    terrain.pairs.push_back(std::move(proxy->pair));
    return terrain;
}

/// Around the terrain, looking at its middle.
View view_at_frame(int frame) {
    const glm::dvec3 middle(1096.0, 25.0, -404.0);
    const double angle = 0.3 + 0.004 * frame;
    const glm::dvec3 eye =
        middle + glm::dvec3(200.0 * std::cos(angle), 90.0, 200.0 * std::sin(angle));
    const Lens lens = perspective_lens(0.9, static_cast<double>(kWidth) / kHeight, 0.5, 1000.0);
    return look_at(eye, middle, {0.0, 1.0, 0.0}, lens, kWidth, kHeight);
}

FrameClear sky_clear() {
    FrameClear clear;
    clear.color = {0.0F, 0.0F, 1.0F, 1.0F};
    return clear;
}

LodSpriteOptions guaranteed(double error_px) {
    LodSpriteOptions options = presets::guaranteed_sprite({.error_px = error_px});
    options.never_slower = false;
    return options;
}

double psnr_db(const Picture& a, const Picture& b) {
    double squares = 0.0;
    for (std::size_t i = 0; i < a.rgba.size(); ++i) {
        const double difference = double{static_cast<double>(a.rgba[i])} - b.rgba[i];
        squares += difference * difference;
    }
    const double mean = squares / (0.75 * static_cast<double>(a.rgba.size()));
    return mean > 0.0 ? 10.0 * std::log10(255.0 * 255.0 / mean) : 200.0;
}

/// Where a world point is on the picture. [px] From the upper left corner
glm::dvec2 pixel_of(const View& view, const glm::dvec3& point) {
    const glm::dvec3 at = glm::transpose(view.camera_to_world) * (point - view.eye);
    const glm::dvec2 tangent(at.x / -at.z, at.y / -at.z);
    return {
        (tangent.x - view.lens.left) / (view.lens.right - view.lens.left) * view.width,
        (view.lens.top - tangent.y) / (view.lens.top - view.lens.bottom) * view.height};
}

} // namespace

TEST_CASE("The frame in which a keyframe is made equals geometry") {
    const bool with_post = GENERATE(false, true);
    const double margin = GENERATE(1.0, 1.3);
    const Terrain terrain = make_terrain(false, with_post);
    const auto device = Device::create(terrain.world.scene, &terrain.world.hierarchy);
    if (device == nullptr) {
        return;
    }
    const View view = view_at_frame(0);
    CulledGeometry geometry(terrain.world.hierarchy);
    const Picture reference =
        draw(*device->backend, geometry.plan(view), kWidth, kHeight, 1, sky_clear());
    LodSpriteOptions options = guaranteed(1.0);
    options.keyframe_margin = margin;
    auto sprite = LodSprite::create(terrain.world.hierarchy, terrain.pairs, options);
    REQUIRE(sprite.has_value());
    const FramePlan& plan = sprite->plan(view, {});
    REQUIRE(sprite->statistics().frame == SpriteFrame::image);
    const Picture picture = draw(*device->backend, plan, kWidth, kHeight, 1, sky_clear());
    int different = 0;
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            // A colour may be rounded once more; a wider matrix moves edges by 1/256 pixel.
            different += distance(color_at(picture, x, y), color_at(reference, x, y)) > 2 ? 1 : 0;
        }
    }
    CAPTURE(with_post, margin, different);
    // Where the post stands in the ground, 16 bits of depth over 300 m decide: 5 mm.
    CHECK(different <= kWidth * kHeight / 500);
    CHECK((with_post || margin > 1.0 || different == 0));
}

TEST_CASE("A keyframe of what is all around the eye is not cut by the near plane") {
    const Terrain terrain = make_terrain(false, false);
    const auto device = Device::create(terrain.world.scene, &terrain.world.hierarchy);
    if (device == nullptr) {
        return;
    }
    // Within the box of the pair, over the rim: as near as the near plane for all that is known.
    const Box3d box = scene_bounds(terrain.world.scene);
    const glm::dvec3 eye(box.lo.x + 1.0, box.hi.y, center(box).z);
    CulledGeometry geometry(terrain.world.hierarchy);
    for (int i = 0; i < 16; ++i) {
        // Whether rounding brings a depth before the near plane depends on all of its digits.
        const double near_distance = 0.05 * (1.0 + 0.13 * i);
        const Lens lens =
            perspective_lens(0.9, static_cast<double>(kWidth) / kHeight, near_distance, 1000.0);
        const View view = look_at(eye, center(box), {0.0, 1.0, 0.0}, lens, kWidth, kHeight);
        auto sprite = LodSprite::create(terrain.world.hierarchy, terrain.pairs, guaranteed(1.0));
        REQUIRE(sprite.has_value());
        const FramePlan& plan = sprite->plan(view, {});
        REQUIRE(sprite->statistics().frame == SpriteFrame::image);
        REQUIRE(plan.passes[0].copy_near == static_cast<float>(near_distance));
        const Picture picture = draw(*device->backend, plan, kWidth, kHeight, 1, sky_clear());
        const Picture reference =
            draw(*device->backend, geometry.plan(view), kWidth, kHeight, 1, sky_clear());
        CAPTURE(near_distance);
        CHECK(picture == reference);
    }
}

TEST_CASE("What is projected is near geometry, and nearer than the coarse model alone") {
    const bool refinable = GENERATE(false, true);
    const Terrain terrain = make_terrain(refinable, true);
    const auto device = Device::create(terrain.world.scene, &terrain.world.hierarchy);
    if (device == nullptr) {
        return;
    }
    CulledGeometry geometry(terrain.world.hierarchy);
    LodSpriteOptions options = guaranteed(1.0);
    options.refine = refinable;
    auto sprite = LodSprite::create(terrain.world.hierarchy, terrain.pairs, options);
    REQUIRE(sprite.has_value());
    int projected = 0;
    for (int frame = 0; frame < 24; ++frame) {
        const View view = view_at_frame(frame);
        FramePlan plan = sprite->plan(view, {});
        const Picture picture = draw(*device->backend, plan, kWidth, kHeight, 1, sky_clear());
        if (sprite->statistics().frame != SpriteFrame::projected || frame % 4 != 1) {
            continue;
        }
        ++projected;
        const Picture reference =
            draw(*device->backend, geometry.plan(view), kWidth, kHeight, 1, sky_clear());
        // The same without its keyframes.
        plan.keyframes.clear();
        for (Command& command : plan.commands) {
            if (command.kind == Command::Kind::projected) {
                command.kind = Command::Kind::geometry;
                command.first_keyframe = 0;
                command.keyframe_count = 0;
                command.whole_triangles = false;
            }
        }
        const Picture coarse = draw(*device->backend, plan, kWidth, kHeight, 1, sky_clear());
        const double with = psnr_db(picture, reference);
        const double without = psnr_db(coarse, reference);
        CAPTURE(refinable, frame, with, without, sprite->statistics().coarse_triangles);
        CHECK(with > without + 2.0);
    }
    CHECK(projected >= 3);
}

TEST_CASE("Nothing projected is farther off its place than promised") {
    const bool refinable = GENERATE(false, true);
    const double error_px = GENERATE(0.5, 2.0);
    const Terrain terrain = make_terrain(refinable, false);
    const auto device =
        Device::create(terrain.world.scene, &terrain.world.hierarchy, {.positions = true});
    if (device == nullptr) {
        return;
    }
    LodSpriteOptions options = guaranteed(error_px);
    options.refine = refinable;
    // So that much is projected that is nearly too far off.
    options.max_own_share = 0.5;
    auto sprite = LodSprite::create(terrain.world.hierarchy, terrain.pairs, options);
    REQUIRE(sprite.has_value());
    const auto target = device->backend->create_target(kWidth, kHeight, 1);
    REQUIRE(target.has_value());
    const glm::dvec3 origin = terrain.world.scene.meshes[0].origin;
    double farthest = 0.0;
    double over_sampling = 0.0;
    std::size_t shown = 0;
    std::size_t own = 0;
    for (int frame = 0; frame < 60; ++frame) {
        const View view = view_at_frame(frame);
        REQUIRE(device->backend->execute(sprite->plan(view, {}), *target, sky_clear()).has_value());
        if (sprite->statistics().frame != SpriteFrame::projected) {
            continue;
        }
        const auto positions = device->backend->read_positions(*target);
        REQUIRE(positions.has_value());
        for (int y = 0; y < kHeight; ++y) {
            for (int x = 0; x < kWidth; ++x) {
                const PositionTexel& texel =
                    positions->texels
                        [static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x)];
                if (texel.item != ItemId{0}) {
                    own += texel.item == kNone<ItemId> ? 0U : 1U;
                    continue;
                }
                ++shown;
                const glm::dvec2 at = pixel_of(view, origin + glm::dvec3(texel.point));
                const double off = glm::distance(at, glm::dvec2(x + 0.5, y + 0.5));
                farthest = std::max(farthest, off);
                // The point kept is that of the texel's middle; the bound is for what the keyframe
                // saw on the fragment's ray: half a diagonal is between them. One step of depth is
                // 5 mm of some 200 m, and seen along the way of the eye: far less than the rest.
                const double sampling = std::sqrt(0.5) * static_cast<double>(texel.texel_px);
                REQUIRE(off <= error_px + sampling + 0.02);
                over_sampling = std::max(over_sampling, off - sampling);
            }
        }
    }
    CAPTURE(refinable, error_px, shown, own, farthest, over_sampling);
    CHECK(shown > own);
    CHECK(shown > 50'000);
    CHECK(farthest > 0.5 * error_px);
    CHECK(over_sampling > 0.5 * error_px); // texels are not all there is
}
