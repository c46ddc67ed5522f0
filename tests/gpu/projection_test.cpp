#include "gpu/drawer.hpp"
#include "gpu/keyframe_scene.hpp"
#include "gpu/position_checks.hpp"
#include "support/small_scene.hpp"
#include <farfield/technique/culled_geometry.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

/// Keyframes and frames are rounded to 8 bits once each, colours are filtered with weights of 8
/// bits or more, of gradients of at most 8 levels a texel, and interpolated in float.
constexpr int kRounding = 2;

/// A picture plane at z = 0 that colours tell points of, a red one to project it onto at
/// `coarse_z`, and a grey post between the eye and the picture plane.
struct Stage {
    Scene scene = flat_scene();
    Gradient picture = add_gradient(scene, {}, 12.0);
    double coarse_z = -2.0;
    ItemId coarse = add_quad(scene, kRedPaint, {0.0, 0.0, coarse_z}, 30.0);
    glm::dvec3 post_at{0.4, -0.3, 4.0};
    double post_half = 0.6;
    ItemId post = add_quad(scene, {0.4F, 0.4F, 0.4F, 1.0F}, post_at, post_half);

    /// Of a fragment on the red plane.
    [[nodiscard]] glm::dvec3 fragment(const View& view, int x, int y) const {
        const glm::dvec3 ray = ray_through(view, x, y);
        return view.eye + ray * ((coarse_z - view.eye.z) / ray.z);
    }
    /// Where the ray from an eye to a point meets a plane z = const.
    [[nodiscard]] static glm::dvec3
    on_plane(const glm::dvec3& eye, const glm::dvec3& point, double z) {
        return eye + (point - eye) * ((z - eye.z) / (point.z - eye.z));
    }
    /// How far outside of the post's outline a ray passes, in the post's plane; negative inside.
    [[nodiscard]] double beside_post(const glm::dvec3& eye, const glm::dvec3& point) const {
        const glm::dvec3 at = on_plane(eye, point, post_at.z) - post_at;
        return std::max(std::abs(at.x), std::abs(at.y)) - post_half;
    }
    [[nodiscard]] Color color_at_point(const glm::dvec2& point) const {
        const glm::dvec2 color = picture.green_and_blue(point);
        return {
            0, static_cast<int>(std::lround(color.x)), static_cast<int>(std::lround(color.y)), 255};
    }
};

/// Two planes this far apart along z are that far apart along a ray, over its cosine.
constexpr float kStageOffset = 2.0F;

Shot shot_of(const std::vector<ItemId>& items, const View& view = flat_view()) {
    Shot shot;
    shot.items = items;
    shot.view = view;
    shot.offset_m = kStageOffset;
    return shot;
}

/// From beside the flat view, not turned.
View view_from(const glm::dvec3& offset) {
    View view = flat_view();
    view.eye += offset;
    return view;
}

/// Pixels of a drawn plan that are red: of their own colour.
int count_red(const Picture& picture) {
    int count = 0;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            count += distance(color_at(picture, x, y), kRed) <= 1 ? 1 : 0;
        }
    }
    return count;
}

/// Boxes, boards and ground in many colours, and the same once more in black, to be projected onto.
struct Twins {
    Scene scene;
    std::vector<ItemId> colored;
    std::vector<ItemId> black;

    explicit Twins(const glm::dvec3& offset = {}) {
        const MaterialId brick = add_material(scene, {.base_color = {0.8F, 0.3F, 0.25F, 1.0F}});
        const MaterialId leaf = add_material(scene, {.base_color = {0.3F, 0.8F, 0.3F, 1.0F}});
        const MaterialId none = add_material(scene, {.base_color = {0.0F, 0.0F, 0.0F, 1.0F}});
        for (const bool dark : {false, true}) {
            std::vector<ItemId>& items = dark ? black : colored;
            const MeshId ground = add_mesh(scene, ground_mesh(16, 60.0F), dark ? none : leaf);
            const MeshId box =
                add_mesh(scene, box_mesh(glm::vec3(-1.0F), glm::vec3(1.0F)), dark ? none : brick);
            const MeshId board = add_mesh(scene, quad_mesh(), dark ? none : leaf);
            const auto add = [&](MeshId mesh, const glm::dvec3& at, double yaw_rad, double scale) {
                add_instance(scene, mesh, offset + at, yaw_rad, scale);
                items.push_back(make_id<ItemId>(scene.instances.size() - 1));
            };
            add(ground, {}, 0.0, 1.0);
            for (int i = 0; i < 12; ++i) {
                const glm::dvec3 at(-14.0 + 2.7 * i, 1.0 + 0.1 * i, -20.0 + 3.0 * (i % 5));
                add(i % 3 == 0 ? board : box, at, 0.5 * i, 1.0 + 0.1 * (i % 4));
            }
        }
    }

    [[nodiscard]] static View view(const glm::dvec3& offset, const glm::dvec3& moved = {}) {
        const Lens lens = perspective_lens(1.0, 1.5, 0.5, 120.0);
        const glm::dvec3 eye = offset + glm::dvec3(1.0, 4.0, 10.0) + moved;
        return look_at(eye, offset + glm::dvec3(0.0, 1.0, -15.0), {0.0, 1.0, 0.0}, lens, 120, 80);
    }
    /// Their picture, with a little room for rounding.
    [[nodiscard]] Shot shot(const glm::dvec3& offset) const {
        Shot shot;
        shot.items = colored;
        shot.view = view(offset);
        shot.copy_near = 1.0F;
        shot.copy_far = 101.0F;
        shot.offset_m = 0.002F;
        return shot;
    }
};

FramePlan plain_plan(const std::vector<ItemId>& items, const View& view) {
    return flat_plan(items, view);
}

} // namespace

TEST_CASE("Seen from where it was made, a keyframe is the picture that it is") {
    // Near and far from the world's origin: the shift is bounded so that wrong matrices show.
    const glm::dvec3 offset = GENERATE(glm::dvec3(0.0), glm::dvec3(1e7, -2e6, 4e6));
    const Twins twins(offset);
    const auto drawer = make_drawer(twins.scene);
    if (drawer == nullptr) {
        return;
    }
    Shot shot = twins.shot(offset);
    shot.max_shift_px = 0.05F;
    FramePlan plan = projecting_plan({shot}, twins.black, shot.view);
    plan.origin = offset;
    const Picture shown = draw(drawer->backend(), plan, 120, 80);
    const Picture plain = draw(drawer->backend(), plain_plan(twins.colored, shot.view), 120, 80);
    const Picture own = draw(drawer->backend(), plain_plan(twins.black, shot.view), 120, 80);
    CHECK(count_different(plain, own, 20) > 120 * 80 / 2);
    // Where the ground ends far off, one texel spans metres; all else is the picture itself.
    CHECK(count_different(shown, plain, 1) <= 5);
}

TEST_CASE("What nothing sees has its own colour, as if it were plain geometry") {
    // With textures, holes, vertex colours and split items.
    const SmallWorld world = make_world(small_scene());
    const auto drawer = make_drawer(world.scene, &world.hierarchy);
    if (drawer == nullptr) {
        return;
    }
    for (int frame = 0; frame < 160; frame += 40) {
        const View view = small_walk(frame, 160, 120);
        Shot shot;
        shot.items = {ItemId{1}};
        shot.view = view;
        shot.view.camera_to_world[0] *= -1.0; // turned about: looks the other way
        shot.view.camera_to_world[2] *= -1.0;
        CulledGeometry geometry(world.hierarchy);
        const FramePlan plain = geometry.plan(view);
        FramePlan plan = projecting_plan({shot}, {}, view);
        const auto first_item = static_cast<std::uint32_t>(plan.items.size());
        plan.items.insert(plan.items.end(), plain.items.begin(), plain.items.end());
        plan.pieces = plain.pieces;
        plan.passes.back().first_command = static_cast<std::uint32_t>(plan.commands.size());
        for (Command command : plain.commands) {
            command.kind = Command::Kind::projected;
            command.first += first_item;
            command.keyframe_count = 1;
            plan.commands.push_back(command);
        }
        plan.passes.back().command_count = static_cast<std::uint32_t>(plain.commands.size());
        const int samples = std::min(drawer->backend().limits().samples, frame == 40 ? 4 : 1);
        const Picture expected = draw(drawer->backend(), plain, 160, 120, samples);
        CHECK(draw(drawer->backend(), plan, 160, 120, samples) == expected);
    }
}

TEST_CASE("From elsewhere, geometry shows what the keyframe's eye saw in its direction") {
    const Stage stage;
    const auto drawer = make_drawer(stage.scene);
    if (drawer == nullptr) {
        return;
    }
    int outside = 0;
    for (const glm::dvec3& moved :
         {glm::dvec3(0.0), glm::dvec3(3.0, -1.0, 0.0), glm::dvec3(-2.0, 0.5, -3.0)}) {
        INFO("moved by " << moved.x << ", " << moved.y << ", " << moved.z);
        const View view = view_from(moved);
        const Shot shot = shot_of({stage.picture.item});
        const Picture shown =
            draw(drawer->backend(), projecting_plan({shot}, {stage.coarse}, view), kSize, kSize);
        int seen = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                INFO("pixel " << x << ", " << y);
                const glm::dvec3 fragment = stage.fragment(view, x, y);
                const glm::dvec2 at = seen_at(shot.view, fragment);
                const Color color = color_at(shown, x, y);
                if (is_well_inside(shot.view, at)) {
                    // The outermost half texel has the colour of its centre.
                    const glm::dvec2 center = glm::clamp(at, 0.5, kSize - 0.5);
                    const glm::dvec2 point = (center / 32.0 - 1.0) * 8.0;
                    CHECK(distance(color, stage.color_at_point(point)) <= kRounding);
                    ++seen;
                } else if (is_well_outside(shot.view, at)) {
                    CHECK(color == kRed);
                    ++outside;
                }
            }
        }
        CHECK(seen > 1000);
    }
    CHECK(outside > 200);
}

TEST_CASE("A keyframe is taken for what stands as near to its picture as the offset says") {
    const Stage stage;
    const auto drawer = make_drawer(stage.scene);
    if (drawer == nullptr) {
        return;
    }
    // The planes face the keyframe's eye: rays that are slanted by their cosine are so in both. One
    // step of depth is half a millimetre, and no depth is lost on a slope: there is none.
    const auto red_at = [&](float offset_m) {
        Shot shot = shot_of({stage.picture.item});
        shot.offset_m = offset_m;
        const FramePlan plan = projecting_plan({shot}, {stage.coarse}, view_from({1.0, 0.0, 0.0}));
        return count_red(draw(drawer->backend(), plan, kSize, kSize));
    };
    // A fragment at the edge of the window is at most one column of pixels.
    CHECK(red_at(1.998F) == kSize * kSize);
    CHECK(red_at(0.0F) == kSize * kSize);
    CHECK(red_at(2.002F) < kSize * 6);
    // Behind the fragment as well as before it.
    Scene swapped = flat_scene();
    const ItemId behind = add_quad(swapped, kGreenPaint, {0.0, 0.0, -2.0}, 30.0);
    const ItemId front = add_quad(swapped, kRedPaint, {0.0, 0.0, 0.0}, 30.0);
    const auto other = make_drawer(swapped);
    for (const float offset_m : {1.998F, 2.002F}) {
        Shot shot = shot_of({behind});
        shot.offset_m = offset_m;
        const Picture shown =
            draw(other->backend(), projecting_plan({shot}, {front}), kSize, kSize);
        CHECK(count_red(shown) == (offset_m < 2.0F ? kSize * kSize : 0));
    }
}

TEST_CASE("What something hid from the keyframe's eye has its own colour") {
    const Stage stage;
    const auto drawer = make_drawer(stage.scene);
    if (drawer == nullptr) {
        return;
    }
    const int samples = GENERATE(1, 4);
    if (samples > drawer->backend().limits().samples) {
        return;
    }
    const View view = view_from({2.5, 1.0, 0.0});
    Shot shot = shot_of({stage.picture.item, stage.post});
    shot.samples = samples;
    const Picture shown =
        draw(drawer->backend(), projecting_plan({shot}, {stage.coarse}, view), kSize, kSize);
    // A texel at the post's distance is an eighth of a metre. Beyond one texel there is nothing of
    // the post in what is filtered, and before one texel there is nothing else.
    constexpr double kTexel = 4.0 / 32.0;
    int hidden = 0;
    int seen = 0;
    int rim = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            INFO("pixel " << x << ", " << y);
            const glm::dvec3 fragment = stage.fragment(view, x, y);
            const glm::dvec2 at = seen_at(shot.view, fragment);
            if (!is_well_inside(shot.view, at, 1.0)) {
                continue;
            }
            const double beside = stage.beside_post(shot.view.eye, fragment);
            const Color color = color_at(shown, x, y);
            const Color expected = stage.color_at_point((at / 32.0 - 1.0) * 8.0);
            if (beside < -1.01 * kTexel) {
                CHECK(color == kRed);
                ++hidden;
            } else if (beside > 1.01 * kTexel) {
                CHECK(distance(color, expected) <= kRounding);
                ++seen;
            } else {
                // Either, and nothing of the post shines through; with one sample a texel shows all
                // of the one or of the other. A single texel is up to half a texel off.
                constexpr int kHalfTexel = 2;
                CHECK(
                    (samples > 1 || color == kRed ||
                     distance(color, expected) <= kRounding + kHalfTexel)
                );
                ++rim;
            }
        }
    }
    CHECK(hidden > 50);
    CHECK(seen > 2000);
    CHECK(rim > 30);
}

TEST_CASE("Where a keyframe shows background, geometry has its own colour") {
    Scene scene = flat_scene();
    const Gradient small = add_gradient(scene, {}, 3.1);
    const ItemId coarse = add_quad(scene, kRedPaint, {}, 30.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const View view = view_from({0.7, -0.45, -1.0});
    Shot shot = shot_of({small.item});
    // The larger one takes anything for what is shown, and so the background's depth.
    shot.offset_m = GENERATE(2.0F, 100.0F);
    const Picture shown =
        draw(drawer->backend(), projecting_plan({shot}, {coarse}, view), kSize, kSize);
    int inside = 0;
    int outside = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const glm::dvec3 ray = ray_through(view, x, y);
            const glm::dvec3 point = view.eye + ray * (-view.eye.z / ray.z);
            // A texel is a quarter of a metre.
            if (small.holds(glm::dvec2(point), 0.25)) {
                CHECK(color_at(shown, x, y)[0] == 0);
                ++inside;
            } else if (!small.holds(glm::dvec2(point), -0.25)) {
                CHECK(color_at(shown, x, y) == kRed);
                ++outside;
            }
        }
    }
    CHECK(inside > 300);
    CHECK(outside > 1000);
}

TEST_CASE("The first keyframe that sees a fragment is shown, others fill its holes") {
    Stage stage;
    // The second keyframe's picture is darker, so that one knows which is shown.
    const ItemId other = add_quad(stage.scene, {0.0F, 0.1F, 0.1F, 1.0F}, {}, 12.0);
    const auto drawer = make_drawer(stage.scene);
    if (drawer == nullptr) {
        return;
    }
    const View view = view_from({0.0, 1.0, 0.0});
    const Shot left = shot_of({stage.picture.item, stage.post}, view_from({-2.0, 0.0, 0.0}));
    const Shot right = shot_of({other, stage.post}, view_from({2.0, 0.0, 0.0}));
    const FramePlan plan = projecting_plan({left, right}, {stage.coarse}, view);
    const Picture shown = draw(drawer->backend(), plan, kSize, kSize);
    FramePlan four = projecting_plan({right, right, right, left}, {stage.coarse}, view);
    const Picture last = draw(drawer->backend(), four, kSize, kSize);
    const Color dark = {0, 26, 26, 255};
    std::array<int, 3> counts{};
    // Of the middle of the picture, where both windows are.
    for (int y = 8; y < kSize - 8; ++y) {
        for (int x = 12; x < kSize - 12; ++x) {
            INFO("pixel " << x << ", " << y);
            const glm::dvec3 fragment = stage.fragment(view, x, y);
            const double by_left = stage.beside_post(left.view.eye, fragment);
            const double by_right = stage.beside_post(right.view.eye, fragment);
            constexpr double kTexel = 4.0 / 32.0;
            if (std::abs(by_left) < 1.01 * kTexel || std::abs(by_right) < 1.01 * kTexel) {
                continue; // at a rim
            }
            const glm::dvec2 at = seen_at(left.view, fragment);
            const Color expected =
                stage.color_at_point(glm::dvec2(-2.0, 0.0) + (at / 32.0 - 1.0) * 8.0);
            const Color color = color_at(shown, x, y);
            const Color color_last = color_at(last, x, y);
            if (by_left > 0.0) {
                CHECK(distance(color, expected) <= kRounding);
                ++counts[0];
            } else {
                CHECK(distance(color, by_right > 0.0 ? dark : kRed) <= 1);
                ++counts[by_right > 0.0 ? 1 : 2];
            }
            if (by_right > 0.0) {
                CHECK(distance(color_last, dark) <= 1);
            } else {
                CHECK((
                    by_left > 0.0 ? distance(color_last, expected) <= kRounding : color_last == kRed
                ));
            }
        }
    }
    CHECK(counts[0] > 500);
    CHECK(counts[1] > 20);
}

TEST_CASE("A keyframe of tiles is the same as one made at once") {
    const Stage stage;
    const auto drawer = make_drawer(stage.scene);
    if (drawer == nullptr) {
        return;
    }
    const View view = view_from({1.3, 0.4, 0.0});
    const Shot shot = shot_of({stage.picture.item, stage.post});
    const FramePlan whole = projecting_plan({shot}, {stage.coarse}, view);
    FramePlan tiled = whole;
    tiled.passes.clear();
    for (const std::int32_t x : {0, 24}) {
        for (const std::int32_t y : {0, 40}) {
            Pass tile = whole.passes[0];
            tile.scissor.x += x;
            tile.scissor.y += y;
            tile.scissor.width = x == 0 ? 24 : kSize - 24;
            tile.scissor.height = y == 0 ? 40 : kSize - 40;
            tile.copy = tile.scissor;
            tile.copy.x += kKeyframeCorner.x - tile.viewport.x;
            tile.copy.y += kKeyframeCorner.y - tile.viewport.y;
            tiled.passes.push_back(tile);
        }
    }
    tiled.passes.push_back(whole.passes[1]);
    const Picture expected = draw(drawer->backend(), whole, kSize, kSize);
    CHECK(count_red(expected) < kSize * kSize / 2);
    CHECK(draw(drawer->backend(), tiled, kSize, kSize) == expected);
}

TEST_CASE("Projected geometry is clipped and selected as plain geometry") {
    Stage stage;
    Mesh strips;
    // Eight strips from left to right, two triangles each.
    for (std::uint32_t i = 0; i < 8; ++i) {
        const float x = -8.0F + 2.0F * static_cast<float>(i);
        for (const glm::vec2& corner :
             {glm::vec2(x, -8.0F),
              glm::vec2(x + 2.0F, -8.0F),
              glm::vec2(x, 8.0F),
              glm::vec2(x + 2.0F, 8.0F)}) {
            strips.positions.emplace_back(corner, 0.0F);
        }
        for (const std::uint32_t index : {0U, 1U, 2U, 2U, 1U, 3U}) {
            strips.indices.push_back(4 * i + index);
        }
    }
    const MaterialId red = add_material(stage.scene, {.base_color = kRedPaint});
    add_instance(stage.scene, add_mesh(stage.scene, std::move(strips), red), {});
    const auto item = make_id<ItemId>(stage.scene.instances.size() - 1);
    const auto drawer = make_drawer(stage.scene);
    if (drawer == nullptr) {
        return;
    }
    FramePlan plan = projecting_plan({shot_of({stage.picture.item})}, {item});
    plan.selected = {2, 3, 9, 14};
    plan.selections = {{item, 0, 4}};
    plan.commands[1].count = 0;
    plan.commands[1].selection_count = 1;
    const Picture selected = draw(drawer->backend(), plan, kSize, kSize);
    plan.clips = {{glm::vec3(-5.0F, -3.1F, -1.0F), glm::vec3(5.9F, 4.2F, 1.0F)}};
    plan.commands[1].clip = 0;
    const Picture clipped = draw(drawer->backend(), plan, kSize, kSize);
    for (const Picture* shown : {&selected, &clipped}) {
        FramePlan plain = plan;
        plain.commands[1].kind = Command::Kind::geometry;
        plain.commands[1].keyframe_count = 0;
        if (shown == &selected) {
            plain.commands[1].clip = Command::kNoClip;
        }
        const Picture red_ones = draw(drawer->backend(), plain, kSize, kSize);
        int covered = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const Color color = color_at(*shown, x, y);
                const bool is_shown = color_at(red_ones, x, y) == kRed;
                CHECK(color[0] == 0);
                CHECK((color[1] > 0) == is_shown);
                covered += is_shown ? 1 : 0;
            }
        }
        CHECK(covered > 200);
        CHECK(covered < kSize * kSize / 2);
    }
}

TEST_CASE("Geometry through the near plane and behind the eye shows the keyframe before it") {
    // A floor that goes on behind the eye, in two triangles, and the same in a gradient.
    Scene scene = flat_scene();
    const auto add_floor = [&](Mesh mesh, MaterialId material) {
        for (glm::vec3& position : mesh.positions) {
            position = glm::vec3(position.x, 0.0F, -position.y) * 40.0F;
        }
        add_instance(scene, add_mesh(scene, std::move(mesh), material), {});
        return make_id<ItemId>(scene.instances.size() - 1);
    };
    Mesh colored = quad_mesh();
    colored.colors = {{0, 40, 40, 255}, {0, 255, 40, 255}, {0, 40, 255, 255}, {0, 255, 255, 255}};
    const ItemId fine = add_floor(colored, kNone<MaterialId>);
    const ItemId coarse = add_floor(quad_mesh(), add_material(scene, {.base_color = kRedPaint}));
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const Lens lens{-1, 1, -1, 1, 0.5, 100.0};
    const auto from = [&](const glm::dvec3& eye) {
        return look_at(eye, eye + glm::dvec3(0.0, -0.7, -1.0), {0.0, 1.0, 0.0}, lens, kSize, kSize);
    };
    Shot shot;
    shot.items = {fine};
    shot.view = from({0.0, 1.5, 0.0});
    shot.copy_near = 0.5F;
    shot.copy_far = 100.5F;
    shot.offset_m = 0.01F;
    const View view = from({0.2, 1.2, 0.3});
    const Picture shown =
        draw(drawer->backend(), projecting_plan({shot}, {coarse}, view), kSize, kSize);
    const Picture plain = draw(drawer->backend(), plain_plan({fine}, view), kSize, kSize);
    int inside = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const glm::dvec3 ray = ray_through(view, x, y);
            const glm::dvec3 point = view.eye - ray * (view.eye.y / ray.y);
            const glm::dvec2 at = seen_at(shot.view, point);
            // One plane, so that its own colours are what is seen. Over a texel of 1/32 a slant of
            // s has h / s metres to go by, h the height of the eye, and filtering is off by h / (4
            // s^3) / 32^2: at 12 m half of a level, and more farther off.
            if (ray.y < 0.0 && is_well_inside(shot.view, at, 1.0) && std::abs(point.x) < 35.0 &&
                point.z > -12.0) {
                INFO("pixel " << x << ", " << y);
                CHECK(distance(color_at(shown, x, y), color_at(plain, x, y)) <= kRounding + 1);
                ++inside;
            }
        }
    }
    CHECK(inside > 1500);
}

TEST_CASE("A triangle that is shown as a whole needs all of its corners seen") {
    Stage stage;
    constexpr int kCells = 6;
    Mesh grid;
    for (int row = 0; row <= kCells; ++row) {
        for (int column = 0; column <= kCells; ++column) {
            grid.positions.emplace_back(
                -9.0F + 3.0F * static_cast<float>(column),
                -9.0F + 3.0F * static_cast<float>(row),
                0.0F
            );
        }
    }
    for (std::uint32_t row = 0; row < kCells; ++row) {
        for (std::uint32_t column = 0; column < kCells; ++column) {
            const std::uint32_t first = row * (kCells + 1) + column;
            const std::uint32_t above = first + kCells + 1;
            for (const std::uint32_t index :
                 {first, first + 1, above, above, first + 1, above + 1}) {
                grid.indices.push_back(index);
            }
        }
    }
    const Mesh kept = grid;
    const MaterialId red = add_material(stage.scene, {.base_color = kRedPaint});
    add_instance(stage.scene, add_mesh(stage.scene, std::move(grid), red), {0.0, 0.0, -2.0});
    const auto item = make_id<ItemId>(stage.scene.instances.size() - 1);
    const auto drawer = make_drawer(stage.scene);
    if (drawer == nullptr) {
        return;
    }
    const View view = view_from({0.5, -0.7, 0.0});
    std::vector<Shot> shots = {
        shot_of({stage.picture.item, stage.post}, view_from({-1.15, 0.2, 0.0}))};
    const bool two = GENERATE(false, true);
    if (two) {
        shots.push_back(shot_of({stage.picture.item, stage.post}, view_from({2.2, 1.6, 0.0})));
    }
    FramePlan plan = projecting_plan(shots, {item}, view);
    plan.commands.back().whole_triangles = true;
    const Picture shown = draw(drawer->backend(), plan, kSize, kSize);
    // What sees all three corners: the first shot, or none (-1).
    const auto shot_of_triangle = [&](std::size_t triangle) {
        for (std::size_t s = 0; s < shots.size(); ++s) {
            bool all = true;
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::dvec3 corner =
                    glm::dvec3(kept.positions[kept.indices[triangle * 3 + k]]) -
                    glm::dvec3(0.0, 0.0, 2.0);
                const double beside = stage.beside_post(shots[s].view.eye, corner);
                const glm::dvec2 at = seen_at(shots[s].view, corner);
                // No corner is so close to a rim or an edge that it matters.
                REQUIRE(std::abs(beside) > 0.13);
                REQUIRE(
                    (is_well_inside(shots[s].view, at, 0.6) || is_well_outside(shots[s].view, at))
                );
                all = all && beside > 0.0 && is_well_inside(shots[s].view, at);
            }
            if (all) {
                return static_cast<int>(s);
            }
        }
        return -1;
    };
    std::array<int, 3> counts{};
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            INFO("pixel " << x << ", " << y);
            const glm::dvec3 fragment = stage.fragment(view, x, y);
            const glm::dvec2 cell = (glm::dvec2(fragment) + 9.0) / 3.0;
            const glm::ivec2 whole(glm::floor(cell));
            const glm::dvec2 share = cell - glm::dvec2(whole);
            const double diagonal = share.x + share.y - 1.0;
            constexpr double kEdge = 0.02; // of a cell: nearer, a neighbour may be meant
            if (glm::any(glm::lessThan(whole, glm::ivec2(0))) ||
                glm::any(glm::greaterThanEqual(whole, glm::ivec2(kCells))) ||
                std::abs(diagonal) < kEdge || glm::any(glm::lessThan(share, glm::dvec2(kEdge))) ||
                glm::any(glm::greaterThan(share, glm::dvec2(1.0 - kEdge)))) {
                continue;
            }
            const auto index =
                static_cast<std::size_t>(whole.y * kCells + whole.x) * 2 + (diagonal > 0.0 ? 1 : 0);
            const int of = shot_of_triangle(index);
            const Color color = color_at(shown, x, y);
            const int counted = of + 1;
            ++counts[static_cast<std::size_t>(counted)];
            if (of < 0) {
                CHECK(color == kRed);
                continue;
            }
            const View& eye = shots[static_cast<std::size_t>(of)].view;
            const glm::dvec2 at = seen_at(eye, fragment);
            if (stage.beside_post(eye.eye, fragment) > 0.13 && is_well_inside(eye, at, 0.5)) {
                const glm::dvec2 point = glm::dvec2(eye.eye) + (at / 32.0 - 1.0) * 8.0;
                CHECK(distance(color, stage.color_at_point(point)) <= kRounding);
            }
        }
    }
    CHECK(counts[0] > (two ? 50 : 300));
    CHECK(counts[1] > 300);
    CHECK((counts[2] > 100) == two);
}

TEST_CASE("What a projected pixel shows is known, and shifted no farther than it may be") {
    const Stage stage;
    const auto drawer = make_drawer(stage.scene, nullptr, true);
    if (drawer == nullptr) {
        return;
    }
    const bool whole = GENERATE(false, true);
    // Mostly forwards: shifts grow from nearly nothing around where the eye goes to.
    const View view = view_from({0.6, 0.25, -3.0});
    Shot shot = shot_of({stage.picture.item, stage.post});
    shot.offset_m = 20.0F; // takes anything: the shift alone holds it
    const auto target = drawer->backend().create_target(kSize, kSize, 1);
    REQUIRE(target.has_value());
    const std::vector<glm::dmat4x3> frames = item_frames(stage.scene);
    int before = INT32_MAX;
    for (const float bound : {std::numeric_limits<float>::infinity(), 2.0F, 1.0F, 0.6F}) {
        INFO("bound " << bound);
        shot.max_shift_px = bound;
        FramePlan plan = projecting_plan({shot}, {stage.coarse}, view);
        plan.commands.back().whole_triangles = whole;
        REQUIRE(drawer->backend().execute(plan, *target, {}).has_value());
        const PositionPicture picture = drawer->backend().read_positions(*target).value();
        int shown = 0;
        int nearly = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                INFO("pixel " << x << ", " << y);
                const PositionTexel& texel =
                    picture
                        .texels[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
                REQUIRE(texel.item != kNone<ItemId>);
                if (texel.node == UINT32_MAX) {
                    CHECK(texel.item == stage.coarse);
                    CHECK(texel.texel_px == 0.0F);
                    CHECK(displacement_px(texel, x, y, view, frames) < kRasterPx);
                    continue;
                }
                ++shown;
                CHECK(texel.node == kKeyframeNode);
                CHECK((texel.item == stage.picture.item || texel.item == stage.post));
                CHECK(texel.texel_px > 0.0F);
                const double moved = displacement_px(texel, x, y, view, frames);
                // The bound is for the ray, the point is that of the texel's middle: half a
                // diagonal is between them at most. A step of depth is half a millimetre, at 4 m or
                // more: nothing, as is where the rasteriser puts vertices, 1/256 px in keyframe and
                // frame.
                if (!whole) {
                    const double sampling = std::sqrt(0.5) * static_cast<double>(texel.texel_px);
                    CHECK(moved <= static_cast<double>(bound) + sampling + kRasterPx);
                }
                nearly += moved > 0.8 * static_cast<double>(bound) ? 1 : 0;
                // The point is that of the keyframe's texel, at most a texel from the place.
                const glm::dvec3 point =
                    frames[index_of(texel.item)] * glm::dvec4(glm::dvec3(texel.point), 1.0);
                const glm::dvec2 center = seen_at(shot.view, point);
                const glm::dvec2 apart =
                    glm::abs(center - seen_at(shot.view, stage.fragment(view, x, y)));
                CHECK(std::max(apart.x, apart.y) < 1.0 + 0.02);
                CHECK(std::abs(center.x - std::floor(center.x) - 0.5) < 0.02);
            }
        }
        if (!whole) {
            CHECK(shown > 0);
            CHECK(shown < before);
            CHECK((std::isinf(bound) || nearly > 0)); // nothing is refused that need not be
            before = shown;
        } else if (std::isinf(bound)) {
            // No corner of the large square is in the window.
            CHECK(shown == 0);
        }
    }
}

TEST_CASE("Several samples a pixel show the keyframe where the geometry covers them") {
    const Stage stage;
    const auto drawer = make_drawer(stage.scene);
    if (drawer == nullptr || drawer->backend().limits().samples < 4) {
        return;
    }
    const View view = view_from({1.0, 0.6, 0.0});
    const Shot shot = shot_of({stage.picture.item});
    const FramePlan plan = projecting_plan({shot}, {stage.coarse}, view);
    const Picture one = draw(drawer->backend(), plan, kSize, kSize);
    const Picture four = draw(drawer->backend(), plan, kSize, kSize, 4);
    // Colours are linear over the window, so that samples average to the pixel's middle; at its
    // edge, one row and one column, some samples see the keyframe and others do not.
    CHECK(count_red(one) > kSize);
    CHECK(count_different(one, four, kRounding) <= 4 * kSize);
}
