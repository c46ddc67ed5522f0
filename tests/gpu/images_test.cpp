#include "gpu/drawer.hpp"
#include "gpu/drawing.hpp"
#include "gpu/flat_scene.hpp"

#include <catch2/catch.hpp>

#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr PageId kScratch{0};
constexpr PageId kPage{1};
constexpr int kPageTexels = 64;

/// The part [16, 48) of the flat view in both directions, where images are made; x and y alike.
constexpr int kFirst = 16;
constexpr int kTexels = 32;

/// A pass that makes an image of that part, with `count` items from `first`.
Pass image_pass(const Region& copy) {
    Pass pass;
    pass.page = kScratch;
    pass.view = flat_view();
    pass.view.lens = sub_lens(pass.view, kFirst, kFirst, kFirst + kTexels, kFirst + kTexels);
    pass.view.width = kTexels;
    pass.view.height = kTexels;
    pass.viewport = {0, 0, kTexels, kTexels};
    pass.scissor = pass.viewport;
    pass.command_count = 1;
    pass.copy_page = kPage;
    pass.copy = copy;
    return pass;
}

/// A quad in the plane z = 0 on exactly the pixels of the image.
ImageQuad image_quad(const Region& source, float depth) {
    ImageQuad quad;
    quad.page = kPage;
    quad.source = source;
    quad.origin = {-4.0F, -4.0F, 0.0F};
    quad.edge_u = {8.0F, 0.0F, 0.0F};
    quad.edge_v = {0.0F, 8.0F, 0.0F};
    quad.depth = depth;
    return quad;
}

/// Makes one image of `image_items` and shows it over `frame_items`.
FramePlan plan_with_image(
    const std::vector<ItemId>& image_items,
    const std::vector<ItemId>& frame_items,
    float depth,
    int samples = 1
) {
    const Region place{5, 9, kTexels, kTexels};
    FramePlan plan = flat_plan(frame_items);
    plan.pages = {
        {.page = kScratch, .size = kPageTexels, .scratch = true, .samples = samples},
        {.page = kPage, .size = kPageTexels}};
    plan.items.insert(plan.items.end(), image_items.begin(), image_items.end());
    Command show;
    show.kind = Command::Kind::images;
    show.count = 1;
    Command make;
    make.first = static_cast<std::uint32_t>(frame_items.size());
    make.count = static_cast<std::uint32_t>(image_items.size());
    plan.commands.push_back(show);
    plan.commands.push_back(make);
    plan.passes[0].command_count = 2;
    plan.passes[0].batch = 1;
    Pass image = image_pass(place);
    image.first_command = 2;
    plan.passes.insert(plan.passes.begin(), image);
    plan.quads = {image_quad(place, depth)};
    return plan;
}

/// A handful of colours with edges in many places.
std::vector<ItemId> add_patchwork(Scene& scene) {
    std::vector<ItemId> items;
    Random random(3);
    for (int i = 0; i < 40; ++i) {
        const glm::vec3 color = random.vector(0.0F, 1.0F);
        const glm::dvec3 at(random.uniform(-4.0, 4.0), random.uniform(-4.0, 4.0), -0.01 * i);
        items.push_back(add_quad(scene, glm::vec4(color, 1.0F), at, random.uniform(0.1, 1.0)));
    }
    return items;
}

} // namespace

TEST_CASE("An image shown at its texels' centres is its source, bit for bit") {
    Scene scene = flat_scene();
    const std::vector<ItemId> items = add_patchwork(scene);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    // The source, drawn straight into a frame of its size.
    FramePlan plain = flat_plan(items, image_pass({}).view);
    const Picture source = draw(drawer->backend(), plain, kTexels, kTexels);
    const Picture frame = draw(drawer->backend(), plan_with_image(items, {}, 8.0F), kSize, kSize);
    int wrong = 0;
    int colored = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const bool inside =
                x >= kFirst && x < kFirst + kTexels && y >= kFirst && y < kFirst + kTexels;
            const Color expected = inside ? color_at(source, x - kFirst, y - kFirst) : kBlack;
            wrong += color_at(frame, x, y) == expected ? 0 : 1;
            colored += expected == kBlack ? 0 : 1;
        }
    }
    CHECK(wrong == 0);
    CHECK(colored > kTexels * kTexels / 4);

    // Pages last: the next plan shows the image without making it.
    FramePlan again = plan_with_image({}, {}, 8.0F);
    again.pages.clear();
    again.passes.erase(again.passes.begin());
    CHECK(draw(drawer->backend(), again, kSize, kSize) == frame);
}

TEST_CASE("Images are blended over what is behind them") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 2.0);
    const ItemId green = add_quad(scene, kGreenPaint, {0.0, 0.0, -8.0}, 6.0); // 24 pixels wide
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const Picture picture =
        draw(drawer->backend(), plan_with_image({red}, {green}, 8.0F), kSize, kSize);
    CHECK(color_at(picture, 32, 32) == kRed);
    CHECK(color_at(picture, 24, 32) == kRed);
    CHECK(color_at(picture, 23, 32) == kGreen);
    CHECK(color_at(picture, 19, 32) == kBlack);
}

TEST_CASE("Images test depth at one distance and write none") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 2.0);
    const ItemId blue = add_quad(scene, kBluePaint, {0.0, 0.0, 2.0}, 0.75); // 8 pixels, at depth 6
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    // The quad lies in the plane at 8 metres all the while: only its depth says who is hidden.
    const Picture before =
        draw(drawer->backend(), plan_with_image({red}, {blue}, 5.9F), kSize, kSize);
    CHECK(color_at(before, 32, 32) == kRed);
    const Picture behind =
        draw(drawer->backend(), plan_with_image({red}, {blue}, 6.1F), kSize, kSize);
    CHECK(color_at(behind, 32, 32) == kBlue);
    CHECK(color_at(behind, 25, 32) == kRed);
    // Close to either end of the depths there are.
    const Picture nearest =
        draw(drawer->backend(), plan_with_image({red}, {blue}, 0.5001F), kSize, kSize);
    CHECK(color_at(nearest, 32, 32) == kRed);
    const Picture farthest =
        draw(drawer->backend(), plan_with_image({red}, {blue}, 99.9F), kSize, kSize);
    CHECK(color_at(farthest, 32, 32) == kBlue);
    CHECK(color_at(farthest, 25, 32) == kRed);

    // Painter's order among images: the second is shown though it stands behind the first, and
    // geometry drawn after an image is not hidden by it.
    FramePlan plan = plan_with_image({red}, {}, 3.0F);
    plan.items.push_back(blue);
    plan.passes[1].command_count = 0;
    Command geometry;
    geometry.first = 1;
    geometry.count = 1;
    plan.commands.push_back(plan.commands[1]);
    plan.commands.push_back(geometry);
    plan.passes[1].first_command = 3;
    plan.passes[1].command_count = 2;
    CHECK(color_at(draw(drawer->backend(), plan, kSize, kSize), 32, 32) == kBlue);
}

TEST_CASE("Images are made from images, and one quad may be shown in many passes") {
    Scene scene = flat_scene();
    const std::vector<ItemId> items = add_patchwork(scene);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const Picture direct = draw(drawer->backend(), plan_with_image(items, {}, 8.0F), kSize, kSize);
    FramePlan plan = plan_with_image(items, {}, 8.0F);
    // A second image shows the first with the very quad that is there, then takes its place.
    Pass second = image_pass({5, 9, kTexels, kTexels});
    second.first_command = 1;
    second.batch = 1;
    plan.passes.insert(plan.passes.begin() + 1, second);
    plan.passes[2].batch = 2;
    CHECK(draw(drawer->backend(), plan, kSize, kSize) == direct);
}

TEST_CASE("An image is cleared before it is made") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 100.0);
    const ItemId green = add_quad(scene, kGreenPaint, {0.0, 0.0, -8.0}, 1.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    // The same place of the scratch page, twice: neither colour nor depth of the first is left.
    FramePlan plan = plan_with_image({red, green}, {}, 8.0F);
    plan.commands[2].count = 1;
    Command make = plan.commands[2];
    make.first = 1;
    plan.commands.push_back(make);
    Pass second = plan.passes[0];
    second.batch = 1;
    second.first_command = 3;
    plan.passes.insert(plan.passes.begin() + 1, second);
    plan.passes[2].batch = 2;
    const Picture picture = draw(drawer->backend(), plan, kSize, kSize);
    CHECK(color_at(picture, 32, 32) == kGreen);
    CHECK(color_at(picture, 20, 20) == kBlack);
}

TEST_CASE("Samples of an image are averaged with their alpha") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {1.125, 0.0, 0.0}); // ends at 40.5 px
    const ItemId green = add_quad(scene, kGreenPaint, {0.0, 0.0, -1.0}, 6.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const int samples = std::min(4, drawer->backend().limits().samples);
    const Picture picture =
        draw(drawer->backend(), plan_with_image({red}, {green}, 8.0F, samples), kSize, kSize);
    CHECK(color_at(picture, 39, 32) == kRed);
    CHECK(color_at(picture, 41, 32) == kGreen);
    const Color edge = color_at(picture, 40, 32);
    CHECK(edge[0] >= 255 / samples);
    CHECK(edge[0] <= 255 - 255 / samples);
    // Red and green add up: blending rounds each once.
    CHECK(edge[0] + edge[1] >= 254);
    CHECK(edge[0] + edge[1] <= 256);
    CHECK(edge[2] == 0);
}
