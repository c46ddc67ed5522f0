#include "support/random.hpp"
#include <farfield/eval/heat_map.hpp>
#include <farfield/eval/overlay.hpp>
#include <farfield/partition/bsp.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

namespace {

using namespace farfield;
using Pixel = std::array<int, 3>;

Pixel pixel(const Picture& picture, int x, int y) {
    const std::size_t at = (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                            static_cast<std::size_t>(x)) *
                           4;
    return {picture.rgba.at(at), picture.rgba.at(at + 1), picture.rgba.at(at + 2)};
}

Pixel solid(const glm::u8vec3& color) {
    return {color.r, color.g, color.b};
}

/// True when `pixel` is `color` over `ground` with this opacity; each of the steps that led there
/// may round by half a level.
bool is_tinted(
    const Pixel& pixel, const glm::u8vec3& ground, const glm::u8vec3& color, double opacity
) {
    for (int i = 0; i < 3; ++i) {
        const double expected = std::lerp(double{1} * ground[i], double{1} * color[i], opacity);
        if (std::abs(pixel[static_cast<std::size_t>(i)] - expected) > 1.0) {
            return false;
        }
    }
    return true;
}

std::size_t count(const Picture& picture, const glm::u8vec3& color) {
    std::size_t pixels = 0;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            pixels += pixel(picture, x, y) == solid(color) ? 1U : 0U;
        }
    }
    return pixels;
}

bool is_whole(const Picture& picture, int width, int height) {
    if (picture.width != width || picture.height != height ||
        picture.rgba.size() !=
            static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4) {
        return false;
    }
    for (std::size_t i = 3; i < picture.rgba.size(); i += 4) {
        if (picture.rgba[i] != 255) {
            return false;
        }
    }
    return true;
}

/// A root with two leaves, 80 m wide each, 40 m apart, 200 m long.
Hierarchy two_leaves() {
    Hierarchy hierarchy;
    hierarchy.nodes.resize(3);
    hierarchy.nodes[0].first_child = 1;
    hierarchy.nodes[0].items_box = {{-100.0F, 0.0F, -100.0F}, {100.0F, 10.0F, 100.0F}};
    hierarchy.nodes[1].items_box = {{-100.0F, 0.0F, -100.0F}, {-20.0F, 10.0F, 100.0F}};
    hierarchy.nodes[2].items_box = {{20.0F, 0.0F, -100.0F}, {100.0F, 10.0F, 100.0F}};
    return hierarchy;
}

Hierarchy one_box(const Box3f& box) {
    Hierarchy hierarchy;
    hierarchy.nodes.resize(1);
    hierarchy.nodes[0].items_box = box;
    return hierarchy;
}

constexpr std::array kStatuses = {NodeStatus::recursed, NodeStatus::image, NodeStatus::geometry};

/// Looks along -z with 90 degrees both ways.
View right_angle_view(const glm::dvec3& eye, double far_distance = 1000.0) {
    const Lens lens = perspective_lens(std::numbers::pi / 2.0, 1.0, 0.5, far_distance);
    return look_at(eye, eye - glm::dvec3(0.0, 0.0, 1.0), {0.0, 1.0, 0.0}, lens, 100, 100);
}

/// 240 px with a margin of 4 % leave 220.8 px for 200 m: x m is at 120 + 1.104 x px.
const BirdsEyeOptions kMap = {.width = 240, .height = 240, .legend = false};
const OverlayColors kColors = kMap.colors;

ImageFacts image_with(float error_px, const glm::vec3& viewpoint = {}, const Box3f& zone = {}) {
    ImageFacts facts;
    facts.viewpoint = viewpoint;
    facts.zone = zone;
    facts.error_px = error_px;
    return facts;
}

Picture grey_frame(int size) {
    Picture frame{size, size, {}};
    frame.rgba.assign(static_cast<std::size_t>(size) * static_cast<std::size_t>(size) * 4, 128);
    return frame;
}

} // namespace

TEST_CASE("a map of nothing shows the eye", "[overlay]") {
    const View view = right_angle_view({5.0, 6.0, 7.0});
    Hierarchy nothing;
    const Picture without_nodes = eval::birds_eye(nothing, {}, view, kMap);
    REQUIRE(is_whole(without_nodes, 240, 240));
    CHECK(pixel(without_nodes, 120, 120) == solid(kColors.frustum));
    CHECK(pixel(without_nodes, 20, 200) == solid(kColors.background));

    nothing.nodes.resize(1); // as builders give for no objects: a root with an empty box
    const std::array statuses = {NodeStatus::culled};
    CHECK(eval::birds_eye(nothing, {.statuses = statuses}, view, kMap) == without_nodes);
}

TEST_CASE("boxes on a map have the colour of their status", "[overlay]") {
    const Hierarchy hierarchy = two_leaves();
    const Picture map = eval::birds_eye(
        hierarchy, {.statuses = kStatuses}, right_angle_view({0.0, 5.0, 0.0}), kMap
    );
    REQUIRE(is_whole(map, 240, 240));
    // Lower sides -100 m and -20 m are at 9.6 and 97.9 px, which is rounded to 10 and 98; the
    // outline of 2 px lies inside of that. Columns left to right, well away from the frustum.
    CHECK(pixel(map, 9, 200) == solid(kColors.background));
    CHECK(pixel(map, 10, 200) == solid(kColors.image));
    CHECK(pixel(map, 11, 200) == solid(kColors.image));
    CHECK(is_tinted(pixel(map, 12, 200), kColors.background, kColors.image, 0.22));
    CHECK(is_tinted(pixel(map, 95, 200), kColors.background, kColors.image, 0.22));
    CHECK(pixel(map, 96, 200) == solid(kColors.image));
    CHECK(pixel(map, 97, 200) == solid(kColors.image));
    CHECK(pixel(map, 98, 200) == solid(kColors.background));
    CHECK(pixel(map, 142, 200) == solid(kColors.geometry));
    CHECK(pixel(map, 229, 200) == solid(kColors.geometry));
    CHECK(pixel(map, 230, 200) == solid(kColors.background));
    CHECK(pixel(map, 50, 229) == solid(kColors.image));
    CHECK(pixel(map, 50, 230) == solid(kColors.background));
    // Between the leaves the root shows, half as wide.
    CHECK(pixel(map, 120, 10) == solid(kColors.recursed));
    CHECK(pixel(map, 120, 11) != solid(kColors.recursed));
    CHECK(pixel(map, 120, 229) == solid(kColors.recursed));

    SECTION("culled nodes have theirs, untouched ones none") {
        const std::array statuses = {
            NodeStatus::recursed, NodeStatus::culled, NodeStatus::untouched};
        const Picture other = eval::birds_eye(
            hierarchy, {.statuses = statuses}, right_angle_view({0.0, 5.0, 0.0}), kMap
        );
        CHECK(pixel(other, 10, 200) == solid(kColors.culled));
        CHECK(pixel(other, 142, 200) == solid(kColors.background));
    }
    SECTION("nodes without a status are untouched ones") {
        const Picture other = eval::birds_eye(
            hierarchy,
            {.statuses = std::span(kStatuses).first(2)},
            right_angle_view({0.0, 5.0, 0.0}),
            kMap
        );
        CHECK(pixel(other, 10, 200) == solid(kColors.image));
        CHECK(pixel(other, 142, 200) == solid(kColors.background));
    }
}

TEST_CASE("a map shows where the eye is and what it sees", "[overlay]") {
    const Hierarchy hierarchy = two_leaves();
    const Picture map = eval::birds_eye(
        hierarchy, {.statuses = kStatuses}, right_angle_view({0.0, 5.0, 0.0}), kMap
    );
    CHECK(pixel(map, 120, 120) == solid(kColors.frustum));
    // 90 degrees: the sides go diagonally up, through the middles of pixels, to the rim.
    CHECK(pixel(map, 100, 100) == solid(kColors.frustum));
    CHECK(pixel(map, 139, 100) == solid(kColors.frustum));
    CHECK(pixel(map, 2, 2) == solid(kColors.frustum));
    CHECK(pixel(map, 100, 139) == solid(kColors.background));
    CHECK(is_tinted(pixel(map, 120, 60), kColors.background, kColors.frustum, 0.10));

    SECTION("an eye outside makes the map wider") {
        // -100 m to 1000 m in 220.8 px: the eye is at 120 + 550 * 0.2007 px, the middle of z.
        const View view = right_angle_view({1000.0, 5.0, 0.0});
        const Picture wide = eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, kMap);
        CHECK(pixel(wide, 230, 120) == solid(kColors.frustum));
        CHECK(pixel(wide, 10, 120) == solid(kColors.image));
        CHECK(pixel(wide, 10, 200) == solid(kColors.background));
    }
    SECTION("a far plane within the map ends the frustum") {
        const View view = right_angle_view({0.0, 5.0, 0.0}, 50.0);
        const Picture near_sighted =
            eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, kMap);
        CHECK(is_tinted(pixel(near_sighted, 120, 80), kColors.background, kColors.frustum, 0.10));
        CHECK(pixel(near_sighted, 120, 50) == solid(kColors.background));
    }
}

TEST_CASE("a map is seen along the reverse of up", "[overlay]") {
    // With +z up, x is to the right and y to the top.
    const Hierarchy hierarchy = one_box({{-100.0F, 0.0F, 0.0F}, {100.0F, 100.0F, 5.0F}});
    const std::array statuses = {NodeStatus::image};
    BirdsEyeOptions options = kMap;
    options.up = {0.0, 0.0, 2.0};
    const std::array<glm::dvec3, 2> path = {
        {{-100.0, -100.0, 0.0}, {-50.0, -100.0, 0.0}}}; // gives the map its 200 m
    options.path = path;
    const View view = right_angle_view({0.0, -50.0, 0.0});
    const Picture map = eval::birds_eye(hierarchy, {.statuses = statuses}, view, options);
    CHECK(pixel(map, 10, 60) == solid(kColors.image));
    CHECK(pixel(map, 50, 119) == solid(kColors.image)); // y = 0 is in the middle
    // Below that there is but the frustum, which looks down and is wider than the map.
    CHECK(is_tinted(pixel(map, 10, 150), kColors.background, kColors.frustum, 0.10));
    CHECK(pixel(map, 120, 175) == solid(kColors.frustum)); // the eye

    SECTION("any direction will do") {
        options.up = {0.3, 1.0, -0.2};
        CHECK(
            count(
                eval::birds_eye(hierarchy, {.statuses = statuses}, view, options), kColors.image
            ) > 100
        );
    }
}

TEST_CASE("boxes of whole items leave surfaces out", "[overlay]") {
    Hierarchy hierarchy = two_leaves();
    hierarchy.nodes[0].pieces_box = hierarchy.nodes[0].items_box;
    hierarchy.nodes[1].pieces_box = hierarchy.nodes[1].items_box;
    hierarchy.nodes[1].items_box = {};
    const View view = right_angle_view({0.0, 5.0, 0.0});
    CHECK(
        pixel(eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, kMap), 10, 200) ==
        solid(kColors.image)
    );
    BirdsEyeOptions options = kMap;
    options.with_surfaces = false;
    const Picture map = eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, options);
    CHECK(count(map, kColors.image) == 0);
    CHECK(pixel(map, 142, 200) == solid(kColors.geometry));

    Picture frame = grey_frame(100);
    const std::array surfaces_only = {
        NodeStatus::recursed, NodeStatus::image, NodeStatus::recursed};
    eval::draw_nodes(frame, hierarchy, {.statuses = surfaces_only}, view, {.with_surfaces = false});
    CHECK(frame == grey_frame(100));
    eval::draw_nodes(frame, hierarchy, {.statuses = surfaces_only}, view);
    CHECK(frame != grey_frame(100));
}

TEST_CASE("a map shows the walk and the quads of the frame", "[overlay]") {
    const Hierarchy hierarchy = two_leaves();
    const View view = right_angle_view({0.0, 5.0, 0.0});
    BirdsEyeOptions options = kMap;
    const std::array<glm::dvec3, 3> path = {
        {{0.0, 0.0, 30.0}, {0.0, 0.0, 60.0}, {10.0, 0.0, 60.0}}};
    options.path = path;
    Picture map = eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, options);
    // x = 0 is at 120 px, z = 45 at 169.7: both columns beside are covered wholly, then the casing.
    CHECK(pixel(map, 119, 169) == solid(kColors.path));
    CHECK(pixel(map, 120, 169) == solid(kColors.path));
    CHECK(pixel(map, 121, 169) == solid(kColors.text));
    CHECK(pixel(map, 120, 140) == solid(kColors.background));

    FramePlan plan;
    plan.origin = {0.0, 0.0, 40.0};
    // One quad that an image shows, one that the frame shows: 20 m wide, at x = 0, z = 80.
    plan.quads.resize(2);
    plan.quads[0].origin = {0.0F, 0.0F, -80.0F};
    plan.quads[0].edge_u = {20.0F, 0.0F, 0.0F};
    plan.quads[1].origin = {-10.0F, 0.0F, 40.0F};
    plan.quads[1].edge_u = {20.0F, 0.0F, 0.0F};
    plan.quads[1].edge_v = {0.0F, 10.0F, 0.0F};
    plan.commands = {
        {.kind = Command::Kind::images, .first = 0, .count = 1},
        {.kind = Command::Kind::geometry, .first = 0, .count = 0},
        {.kind = Command::Kind::images, .first = 1, .count = 1}};
    plan.passes.resize(2);
    plan.passes[0].command_count = 1;
    plan.passes[1].first_command = 1;
    plan.passes[1].command_count = 2;
    options.plan = &plan;
    map = eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, options);
    // z = 80 is at 208.3 px: row 208 is covered wholly, from 109 to 131 px.
    CHECK(pixel(map, 110, 208) == solid(kColors.quad));
    CHECK(pixel(map, 129, 208) == solid(kColors.quad));
    CHECK(pixel(map, 106, 208) == solid(kColors.background));
    constexpr std::size_t kMost = 48; // two rows of that length, and no other quad
    CHECK(count(map, kColors.quad) <= kMost);

    plan.passes.clear();
    CHECK(
        count(eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, options), kColors.quad) == 0
    );
}

TEST_CASE("a map of events fills boxes, and nests what is below an image", "[overlay]") {
    Hierarchy hierarchy = two_leaves();
    const View view = right_angle_view({0.0, 5.0, 0.0});
    BirdsEyeOptions options = kMap;
    options.show = OverlayShow::events;
    const std::array combined = {ImageEvent::combined, ImageEvent::made, ImageEvent::reused};

    SECTION("a combined image of a new and an older one") {
        // The root reaches from 10 to 230 px. Its leaves are drawn at 0.7 of their size around its
        // middle: from 120 - 0.7 * 110.4 = 42.7 to 120 - 0.7 * 22.1 = 104.5 px, and mirrored.
        const std::array statuses = {
            NodeStatus::image, NodeStatus::untouched, NodeStatus::untouched};
        const Picture map =
            eval::birds_eye(hierarchy, {.statuses = statuses, .events = combined}, view, options);
        REQUIRE(is_whole(map, 240, 240));
        CHECK(pixel(map, 9, 180) == solid(kColors.background));
        CHECK(pixel(map, 10, 180) == solid(kColors.in_use));
        CHECK(pixel(map, 11, 180) == solid(kColors.in_use));
        CHECK(pixel(map, 12, 180) == solid(kColors.combined));
        CHECK(pixel(map, 42, 180) == solid(kColors.combined));
        CHECK(pixel(map, 43, 180) == solid(kColors.recursed)); // a thin outline
        CHECK(pixel(map, 44, 180) == solid(kColors.made));
        CHECK(pixel(map, 103, 180) == solid(kColors.made));
        CHECK(pixel(map, 106, 180) == solid(kColors.combined));
        CHECK(pixel(map, 170, 180) == solid(kColors.reused));
        CHECK(pixel(map, 229, 180) == solid(kColors.in_use));
        CHECK(pixel(map, 60, 210) == solid(kColors.combined)); // below both
    }
    SECTION("steps between a box and its children nest nothing") {
        hierarchy.nodes.resize(5);
        hierarchy.nodes[1].first_child = 3;
        hierarchy.nodes[1].image_level = false;
        for (const std::size_t node : {3U, 4U}) {
            hierarchy.nodes[node].parent = 1;
        }
        hierarchy.nodes[3].items_box = {{-100.0F, 0.0F, 0.0F}, {-20.0F, 10.0F, 100.0F}};
        const std::array events = {
            ImageEvent::combined,
            ImageEvent::none,
            ImageEvent::none,
            ImageEvent::made,
            ImageEvent::none};
        const Picture map = eval::birds_eye(hierarchy, {.events = events}, view, options);
        CHECK(pixel(map, 42, 180) == solid(kColors.combined));
        CHECK(pixel(map, 44, 180) == solid(kColors.made));
        CHECK(pixel(map, 103, 180) == solid(kColors.made));
        // One image in use; the one below it has no black outline.
        CHECK(pixel(map, 43, 180) == solid(kColors.recursed));
    }
    SECTION("what can have no image, and children that have their whole place in it") {
        const std::array events = {
            ImageEvent::impossible, ImageEvent::made, ImageEvent::impossible};
        const Picture map =
            eval::birds_eye(hierarchy, {.statuses = kStatuses, .events = events}, view, options);
        CHECK(pixel(map, 10, 200) == solid(kColors.in_use));
        CHECK(pixel(map, 12, 200) == solid(kColors.made));
        CHECK(pixel(map, 95, 200) == solid(kColors.made));
        CHECK(pixel(map, 97, 200) == solid(kColors.in_use));
        CHECK(pixel(map, 120, 200) == solid(kColors.impossible)); // the root's
        CHECK(pixel(map, 142, 200) == solid(kColors.recursed));   // tells leaves apart
        CHECK(pixel(map, 170, 200) == solid(kColors.impossible));
    }
    SECTION("geometry that could have an image") {
        const std::array events = {ImageEvent::none, ImageEvent::reused, ImageEvent::none};
        const Picture map =
            eval::birds_eye(hierarchy, {.statuses = kStatuses, .events = events}, view, options);
        CHECK(pixel(map, 60, 200) == solid(kColors.reused));
        CHECK(pixel(map, 120, 200) == solid(kColors.background)); // recursed: no event
        CHECK(pixel(map, 142, 200) == solid(kColors.geometry));
        CHECK(is_tinted(pixel(map, 170, 200), kColors.background, kColors.geometry, 0.22));
    }
    SECTION("without events there is nothing but geometry") {
        const Picture map = eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, options);
        CHECK(pixel(map, 60, 200) == solid(kColors.background));
        CHECK(pixel(map, 142, 200) == solid(kColors.geometry));
    }
}

TEST_CASE("a map of errors has the colours of heat maps", "[overlay]") {
    const Hierarchy hierarchy = two_leaves();
    const View view = right_angle_view({0.0, 5.0, 0.0});
    BirdsEyeOptions options = kMap;
    options.show = OverlayShow::errors;
    options.error_scale_px = 4.0;
    const std::array statuses = {NodeStatus::recursed, NodeStatus::image, NodeStatus::image};
    std::array<std::optional<ImageFacts>, 3> images;
    images[0] = image_with(1.0F); // held, but not shown
    images[1] = image_with(1.0F);
    images[2] = image_with(4.5F);
    const Picture map =
        eval::birds_eye(hierarchy, {.statuses = statuses, .images = images}, view, options);
    const glm::u8vec3 quarter = eval::heat_color(0.25);
    CHECK(pixel(map, 10, 200) == solid(quarter));
    CHECK(is_tinted(pixel(map, 60, 200), kColors.background, quarter, 0.60));
    CHECK(pixel(map, 120, 200) == solid(kColors.background));
    CHECK(pixel(map, 142, 200) == solid(kColors.beyond));
    CHECK(is_tinted(pixel(map, 170, 200), kColors.background, kColors.beyond, 0.60));

    SECTION("geometry as ever, and nothing where no image is known") {
        images[1].reset();
        const std::array other = {NodeStatus::recursed, NodeStatus::image, NodeStatus::geometry};
        const Picture without =
            eval::birds_eye(hierarchy, {.statuses = other, .images = images}, view, options);
        CHECK(pixel(without, 10, 200) == solid(kColors.background));
        CHECK(pixel(without, 142, 200) == solid(kColors.geometry));
    }
    SECTION("the legend has the ramp") {
        options.width = 400;
        options.height = 400;
        options.legend = true;
        const Picture with =
            eval::birds_eye(hierarchy, {.statuses = statuses, .images = images}, view, options);
        REQUIRE(is_whole(with, 400, 400));
        CHECK(count(with, eval::heat_color(1.0)) >= 9); // a column of the sample
        CHECK(count(with, eval::heat_color(0.0)) >= 9);
        CHECK(count(map, eval::heat_color(1.0)) == 0);
    }
}

TEST_CASE("a map shows where images were made and are valid", "[overlay]") {
    const Hierarchy hierarchy = two_leaves();
    const View view = right_angle_view({0.0, 5.0, 0.0});
    BirdsEyeOptions options = kMap;
    options.zones = true;
    options.line_px = 4.0F; // half of it for zones
    const std::array statuses = {NodeStatus::untouched, NodeStatus::image, NodeStatus::untouched};
    std::array<std::optional<ImageFacts>, 2> images;
    // 50 m is at 120 + 55.2 px; the zone from 30 m to 70 m is from 153 to 197 px.
    images[1] =
        image_with(0.0F, {50.0F, 0.0F, 50.0F}, {{30.0F, 0.0F, 30.0F}, {70.0F, 0.0F, 70.0F}});
    Picture map =
        eval::birds_eye(hierarchy, {.statuses = statuses, .images = images}, view, options);
    CHECK(pixel(map, 152, 185) == solid(kColors.background));
    CHECK(pixel(map, 153, 185) == solid(kColors.zone));
    CHECK(pixel(map, 154, 185) == solid(kColors.zone));
    CHECK(pixel(map, 155, 185) == solid(kColors.background));
    CHECK(pixel(map, 196, 185) == solid(kColors.zone));
    CHECK(pixel(map, 175, 175) == solid(kColors.zone)); // the cross
    CHECK(pixel(map, 175, 185) == solid(kColors.background));

    SECTION("those without a zone have the cross") {
        constexpr float kInfinity = std::numeric_limits<float>::infinity();
        for (const Box3f& zone : {Box3f{}, Box3f{glm::vec3(-kInfinity), glm::vec3(kInfinity)}}) {
            images[1]->zone = zone;
            map =
                eval::birds_eye(hierarchy, {.statuses = statuses, .images = images}, view, options);
            CHECK(pixel(map, 175, 175) == solid(kColors.zone));
            CHECK(pixel(map, 153, 185) == solid(kColors.background));
        }
    }
    SECTION("but only those that are shown, and where they are asked for") {
        const std::array held = {
            NodeStatus::untouched, NodeStatus::recursed, NodeStatus::untouched};
        map = eval::birds_eye(hierarchy, {.statuses = held, .images = images}, view, options);
        CHECK(count(map, kColors.zone) == 0);
        options.zones = false;
        map = eval::birds_eye(hierarchy, {.statuses = statuses, .images = images}, view, options);
        CHECK(count(map, kColors.zone) == 0);
    }
}

TEST_CASE("images of a cache are those that it holds", "[overlay]") {
    std::vector<Object> objects;
    for (int i = 0; i < 8; ++i) {
        const glm::dvec3 at(20.0 * i - 80.0, 0.0, -200.0);
        objects.push_back({.bounds = {at, at + 10.0}, .primitives = 100'000});
    }
    const Hierarchy hierarchy = partition::build_bsp(objects, {.max_items = 1}).value();
    ImageCache cache = ImageCache::create(hierarchy, presets::shade1996({.error_px = 2.0})).value();
    for (const std::optional<ImageFacts>& none : eval::images_of(cache)) {
        CHECK_FALSE(none);
    }
    const View view = right_angle_view({0.0, 5.0, 0.0});
    static_cast<void>(cache.plan(view, {}));
    const auto images = eval::images_of(cache);
    REQUIRE(images.size() == hierarchy.nodes.size());
    std::size_t held = 0;
    for (std::size_t node = 0; node < images.size(); ++node) {
        const bool shown = cache.statuses()[node] == NodeStatus::image;
        CHECK((images[node].has_value() || !shown));
        if (images[node]) {
            ++held;
            CHECK(glm::dvec3(images[node]->viewpoint) + hierarchy.origin == view.eye);
        }
    }
    CHECK(held > 0);
}

TEST_CASE("a map far from zero is the same", "[overlay]") {
    Hierarchy hierarchy = two_leaves();
    const Picture here = eval::birds_eye(
        hierarchy, {.statuses = kStatuses}, right_angle_view({0.0, 5.0, 0.0}), kMap
    );
    hierarchy.origin = {1e7, -2e6, 3e7}; // the differences are exact
    const View view = right_angle_view(glm::dvec3(0.0, 5.0, 0.0) + hierarchy.origin);
    CHECK(eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, kMap) == here);

    Picture frame = grey_frame(100);
    eval::draw_nodes(frame, hierarchy, {.statuses = kStatuses}, view);
    Picture frame_here = grey_frame(100);
    eval::draw_nodes(
        frame_here, two_leaves(), {.statuses = kStatuses}, right_angle_view({0.0, 5.0, 0.0})
    );
    CHECK(frame == frame_here);
    CHECK(frame != grey_frame(100));
}

TEST_CASE("a legend is a band below the map", "[overlay]") {
    const Hierarchy hierarchy = two_leaves();
    const View view = right_angle_view({0.0, 5.0, 0.0});
    const BirdsEyeOptions options = {.width = 400, .height = 480};
    const Picture with = eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, options);
    BirdsEyeOptions plain = options;
    plain.legend = false;
    const Picture without = eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, plain);
    REQUIRE(is_whole(with, 400, 480));
    REQUIRE(is_whole(without, 400, 480));
    // Two rows of text; without them only the ring around the eye has that colour.
    CHECK(count(with, kColors.text) > count(without, kColors.text) + 300);
    CHECK(count(with, kColors.culled) > 0); // the sample; no node is culled
    CHECK(count(without, kColors.culled) == 0);

    SECTION("with the number of nodes") {
        const std::array statuses = {NodeStatus::recursed, NodeStatus::image, NodeStatus::image};
        const Picture other = eval::birds_eye(hierarchy, {.statuses = statuses}, view, options);
        // "image 1" and "geometry 1" become "image 2" and "geometry 0", in the first row of the
        // band; the rows of the map that lie below both boxes stay.
        bool differs = false;
        for (int y = 480 - 40; y < 480; ++y) {
            for (int x = 0; x < 400; ++x) {
                differs = differs || pixel(with, x, y) != pixel(other, x, y);
            }
        }
        CHECK(differs);
    }
    SECTION("left out where it would take too much") {
        BirdsEyeOptions narrow = options;
        narrow.width = 60;
        narrow.height = 60;
        const Picture small = eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, narrow);
        narrow.legend = false;
        CHECK(small == eval::birds_eye(hierarchy, {.statuses = kStatuses}, view, narrow));
    }
}

TEST_CASE("no size and no place draws outside of the picture", "[overlay]") {
    // A failure here is one of the address sanitizer, or a picture of the wrong size.
    support::Random random(11);
    const std::array<float, 4> scales = {1e-20F, 1.0F, 1e5F, 1e30F};
    for (int i = 0; i < 200; ++i) {
        const float scale = scales[random.below(4)];
        Hierarchy hierarchy;
        hierarchy.nodes.resize(20);
        std::vector<NodeStatus> statuses;
        std::vector<ImageEvent> events;
        std::vector<std::optional<ImageFacts>> images;
        for (HierarchyNode& node : hierarchy.nodes) {
            const glm::vec3 a = random.vector(-scale, scale);
            node.items_box = unite(Box3f{a, a}, random.vector(-scale, scale));
            hierarchy.nodes[0].items_box = unite(hierarchy.nodes[0].items_box, node.items_box);
            statuses.push_back(static_cast<NodeStatus>(random.below(5)));
            events.push_back(static_cast<ImageEvent>(random.below(5)));
            images.emplace_back();
            if (random.below(2) == 0) {
                images.back() = image_with(
                    random.uniform(0.0F, 5.0F), random.vector(-scale, scale), node.items_box
                );
            }
        }
        const glm::dvec3 eye = glm::dvec3(random.vector(-2.0F, 2.0F)) * double{scale};
        const Lens lens = perspective_lens(random.uniform(0.01, 3.0), 1.5, 1e-3, 1e6);
        const View view =
            look_at(eye, eye + random.direction<double>() * 1e31, {0.0, 1.0, 0.0}, lens, 64, 48);
        BirdsEyeOptions options;
        options.width = static_cast<int>(1 + random.below(90));
        options.height = static_cast<int>(1 + random.below(90));
        options.up = random.direction<double>();
        options.line_px = random.uniform(0.1F, 9.0F);
        const std::array<glm::dvec3, 2> path = {eye, random.vector(-1.0, 1.0)};
        options.path = path;
        options.show = static_cast<OverlayShow>(random.below(3));
        options.zones = random.below(2) == 0;
        const OverlayNodes nodes = {.statuses = statuses, .events = events, .images = images};
        REQUIRE(is_whole(
            eval::birds_eye(hierarchy, nodes, view, options), options.width, options.height
        ));
        Picture frame = grey_frame(40);
        eval::draw_nodes(
            frame, hierarchy, nodes, view, {.show = options.show, .line_px = options.line_px}
        );
        REQUIRE(frame.rgba.size() == grey_frame(40).rgba.size());
    }
}

TEST_CASE("boxes are outlined over a frame", "[overlay]") {
    // 100 px, 90 degrees: a point at depth d and x is at 50 + 50 x / d px. The near face of the box
    // is from 25 to 75 px, the far one from 37.5 to 62.5.
    const Hierarchy hierarchy = one_box({{-1.0F, -1.0F, -4.0F}, {1.0F, 1.0F, -2.0F}});
    const View view = right_angle_view({0.0, 0.0, 0.0});
    const std::array image = {NodeStatus::image};
    const NodeOverlayOptions options = {.line_px = 2.0F};
    Picture frame = grey_frame(100);
    eval::draw_nodes(frame, hierarchy, {.statuses = image}, view, options);
    const Pixel grey = {128, 128, 128};
    CHECK(pixel(frame, 23, 50) == grey);
    CHECK(pixel(frame, 24, 50) == solid(kColors.image));
    CHECK(pixel(frame, 25, 50) == solid(kColors.image));
    CHECK(pixel(frame, 26, 50) == grey);
    CHECK(pixel(frame, 50, 24) == solid(kColors.image));
    CHECK(pixel(frame, 50, 75) == solid(kColors.image));
    CHECK(pixel(frame, 37, 50) == solid(kColors.image));
    CHECK(pixel(frame, 50, 50) == grey);
    CHECK(frame.rgba.at((50 * 100 + 24) * 4 + 3) == 255);

    SECTION("whatever the size of the picture") {
        Picture large = grey_frame(200);
        eval::draw_nodes(large, hierarchy, {.statuses = image}, view, options);
        CHECK(pixel(large, 49, 100) == solid(kColors.image));
        CHECK(pixel(large, 24, 100) == grey);
    }
    SECTION("in the colour of geometry where that is drawn") {
        const std::array geometry = {NodeStatus::geometry};
        eval::draw_nodes(frame, hierarchy, {.statuses = geometry}, view, options);
        CHECK(pixel(frame, 24, 50) == solid(kColors.geometry));
    }
    SECTION("and not at all where the node shows nothing itself") {
        for (const NodeStatus status :
             {NodeStatus::untouched, NodeStatus::culled, NodeStatus::recursed}) {
            Picture other = grey_frame(100);
            eval::draw_nodes(other, hierarchy, {.statuses = std::array{status}}, view, options);
            CHECK(other == grey_frame(100));
        }
        Picture other = grey_frame(100);
        eval::draw_nodes(other, hierarchy, {}, view, options);
        CHECK(other == grey_frame(100));
    }
}

TEST_CASE("outlines over a frame tell events and errors", "[overlay]") {
    // As above: the near face from 25 to 75 px.
    const Hierarchy hierarchy = one_box({{-1.0F, -1.0F, -4.0F}, {1.0F, 1.0F, -2.0F}});
    const View view = right_angle_view({0.0, 0.0, 0.0});
    NodeOverlayOptions options = {.show = OverlayShow::events, .line_px = 4.0F};
    const Pixel grey = {128, 128, 128};
    const auto drawn = [&](NodeStatus status, ImageEvent event) {
        Picture frame = grey_frame(100);
        eval::draw_nodes(
            frame,
            hierarchy,
            {.statuses = std::array{status}, .events = std::array{event}},
            view,
            options
        );
        return frame;
    };
    const auto outline = [&](NodeStatus status, ImageEvent event) {
        return pixel(drawn(status, event), 23, 50);
    };
    CHECK(outline(NodeStatus::image, ImageEvent::made) == solid(kColors.made));
    CHECK(outline(NodeStatus::image, ImageEvent::combined) == solid(kColors.combined));
    CHECK(outline(NodeStatus::image, ImageEvent::reused) == solid(kColors.reused));
    CHECK(outline(NodeStatus::geometry, ImageEvent::impossible) == solid(kColors.impossible));
    CHECK(outline(NodeStatus::geometry, ImageEvent::none) == solid(kColors.geometry));
    CHECK(drawn(NodeStatus::recursed, ImageEvent::impossible) == grey_frame(100));
    CHECK(drawn(NodeStatus::untouched, ImageEvent::reused) == grey_frame(100));
    // Made to be combined: half as wide.
    const Picture nested = drawn(NodeStatus::untouched, ImageEvent::made);
    CHECK(pixel(nested, 23, 50) == grey);
    CHECK(pixel(nested, 24, 50) == solid(kColors.made));
    CHECK(pixel(nested, 25, 50) == solid(kColors.made));
    CHECK(pixel(nested, 26, 50) == grey);

    SECTION("errors fill them") {
        options.show = OverlayShow::errors;
        const std::array image = {NodeStatus::image};
        const std::array<std::optional<ImageFacts>, 1> images = {image_with(1.0F)};
        Picture frame = grey_frame(100);
        eval::draw_nodes(frame, hierarchy, {.statuses = image, .images = images}, view, options);
        const glm::u8vec3 half = eval::heat_color(0.5);
        CHECK(pixel(frame, 23, 50) == solid(half));
        CHECK(is_tinted(pixel(frame, 30, 50), {128, 128, 128}, half, 0.22));
        CHECK(pixel(frame, 20, 50) == grey);
        // A box that begins behind the near plane has edges, but no inside.
        Picture around = grey_frame(100);
        eval::draw_nodes(
            around,
            one_box({{-1.0F, -1.0F, -4.0F}, {1.0F, 1.0F, 4.0F}}),
            {.statuses = image, .images = images},
            view,
            options
        );
        CHECK(pixel(around, 37, 50) == solid(half));
        CHECK(pixel(around, 20, 50) == grey);
    }
    SECTION("a legend grows the picture and leaves the frame as it is") {
        for (const OverlayShow show :
             {OverlayShow::statuses, OverlayShow::events, OverlayShow::errors}) {
            options.show = show;
            options.legend = false;
            const std::array image = {NodeStatus::image};
            const std::array<std::optional<ImageFacts>, 1> images = {image_with(1.0F)};
            const OverlayNodes nodes = {.statuses = image, .images = images};
            Picture without = grey_frame(400);
            eval::draw_nodes(without, hierarchy, nodes, view, options);
            options.legend = true;
            Picture with = grey_frame(400);
            eval::draw_nodes(with, hierarchy, nodes, view, options);
            CHECK(with.height > 400);
            REQUIRE(with.rgba.size() > without.rgba.size());
            // The line above the band covers half of the last row.
            const std::size_t rows = std::size_t{400} * 399 * 4;
            CHECK(std::equal(
                without.rgba.begin(),
                without.rgba.begin() + static_cast<std::ptrdiff_t>(rows),
                with.rgba.begin()
            ));
            CHECK(count(with, kColors.text) > 50);
        }
    }
}

TEST_CASE("a box behind the eye or the near plane draws nothing", "[overlay]") {
    const View view = right_angle_view({0.0, 0.0, 0.0});
    const std::array image = {NodeStatus::image};
    Picture frame = grey_frame(100);
    eval::draw_nodes(
        frame, one_box({{-1.0F, -1.0F, 2.0F}, {1.0F, 1.0F, 4.0F}}), {.statuses = image}, view
    );
    CHECK(frame == grey_frame(100));
    eval::draw_nodes(
        frame, one_box({{-0.1F, -0.1F, -0.4F}, {0.1F, 0.1F, 0.4F}}), {.statuses = image}, view
    );
    CHECK(frame == grey_frame(100));
}

TEST_CASE("a box around the eye is cut at the near plane", "[overlay]") {
    const View view = right_angle_view({0.0, 0.0, 0.0});
    const std::array image = {NodeStatus::image};
    Picture frame = grey_frame(100);
    const NodeOverlayOptions options = {.line_px = 2.0F};
    eval::draw_nodes(
        frame,
        one_box({{-1.0F, -1.0F, -4.0F}, {1.0F, 1.0F, 4.0F}}),
        {.statuses = image},
        view,
        options
    );
    // The edges along z run from the far face, 37.5 px, to the corners of the picture: at depth 4/3
    // they are 37.5 px from the middle.
    for (const int x : {12, 87}) {
        for (const int y : {12, 87}) {
            CHECK(pixel(frame, x, y) == solid(kColors.image));
        }
    }
    CHECK(pixel(frame, 0, 0) == solid(kColors.image));
    CHECK(pixel(frame, 37, 50) == solid(kColors.image)); // the far face
    const Pixel grey = {128, 128, 128};
    CHECK(pixel(frame, 12, 50) == grey); // nothing of the face behind
    CHECK(pixel(frame, 50, 50) == grey);

    SECTION("where that is within the picture, the edge ends there") {
        // The box begins between eye and near plane, 0.5 m away: at 1/16 m from the axis the edge
        // ends 6.25 px from the middle, and would go on to 25 px at its end, 0.125 m away.
        Picture other = grey_frame(100);
        const float side = 0.0625F;
        eval::draw_nodes(
            other,
            one_box({{-side, -side, -4.0F}, {side, side, -0.125F}}),
            {.statuses = image},
            view,
            options
        );
        CHECK(pixel(other, 45, 45) == solid(kColors.image));
        CHECK(pixel(other, 40, 40) == grey);
    }
}

TEST_CASE("near boxes are drawn over far ones", "[overlay]") {
    // Both near faces are the same window of the picture.
    const Box3f near_box = {{-1.0F, -1.0F, -3.0F}, {1.0F, 1.0F, -2.0F}};
    const Box3f far_box = {{-2.0F, -2.0F, -6.0F}, {2.0F, 2.0F, -4.0F}};
    const View view = right_angle_view({0.0, 0.0, 0.0});
    for (const bool near_first : {false, true}) {
        Hierarchy hierarchy = one_box(near_first ? near_box : far_box);
        hierarchy.nodes.push_back(hierarchy.nodes.front());
        hierarchy.nodes[1].items_box = near_first ? far_box : near_box;
        const std::array statuses = {
            near_first ? NodeStatus::geometry : NodeStatus::image,
            near_first ? NodeStatus::image : NodeStatus::geometry};
        Picture frame = grey_frame(100);
        eval::draw_nodes(frame, hierarchy, {.statuses = statuses}, view, {.line_px = 2.0F});
        CHECK(pixel(frame, 24, 50) == solid(kColors.geometry));
    }
}
