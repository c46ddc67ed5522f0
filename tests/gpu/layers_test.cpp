#include "gpu/drawer.hpp"
#include "gpu/drawing.hpp"
#include "gpu/flat_scene.hpp"
#include "gpu/layered_scene.hpp"
#include "gpu/layered_truth.hpp"
#include "support/random.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

using Rgba = glm::vec<4, std::uint8_t>;

Command layers_command(std::uint32_t first, std::uint32_t count) {
    Command command = items_command(first, count);
    command.kind = Command::Kind::layers;
    return command;
}

/// A frame of the flat view that shows layered images, each in a command of its own.
FramePlan
layers_plan(const std::vector<const LayeredDepthImage*>& images, const View& view = flat_view()) {
    FramePlan plan = flat_plan({}, view);
    plan.commands.clear();
    for (const LayeredDepthImage* image : images) {
        const auto id = make_id<LayeredImageId>(plan.layers.size());
        plan.layered_updates.push_back({.image = id, .content = image});
        plan.commands.push_back(layers_command(static_cast<std::uint32_t>(plan.layers.size()), 1));
        plan.layers.push_back({.image = id, .node = 40 + static_cast<std::uint32_t>(index_of(id))});
    }
    plan.passes[0].command_count = static_cast<std::uint32_t>(plan.commands.size());
    return plan;
}

/// Of the flat view.
LayeredDepthImage flat_image(double distance, const Rgba& color) {
    LayeredDepthImage image = flat_layers(distance, color, kSize);
    image.view = flat_view();
    return image;
}

/// Only what lies left of the middle.
LayeredDepthImage left_half(const LayeredDepthImage& image) {
    std::vector<LayeredSample> samples;
    std::copy_if(
        image.samples.begin(),
        image.samples.end(),
        std::back_inserter(samples),
        [&](const LayeredSample& sample) { return sample.x < image.view.width * kLayeredSteps / 2; }
    );
    return make_layers(image, samples);
}

std::unique_ptr<Drawer> empty_drawer(bool positions = false) {
    Scene scene = flat_scene();
    add_quad(scene, kRedPaint, {0.0, 0.0, 0.0});
    return make_drawer(scene, nullptr, positions);
}

constexpr Rgba kGreenSample{0, 255, 0, 255};
constexpr Rgba kBlueSample{0, 0, 255, 255};
constexpr Rgba kWhiteSample{255};

/// Pixels of the color.
int count_of(const Picture& picture, const Color& color) {
    int count = 0;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            count += color_at(picture, x, y) == color ? 1 : 0;
        }
    }
    return count;
}

} // namespace

TEST_CASE("From its own eye a layered image is the picture that it was made of") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    LayeredDepthImage image = flat_image(8.0, kWhiteSample);
    Random random(3);
    for (LayeredSample& sample : image.samples) {
        sample.depth = static_cast<std::uint16_t>(random.below(65536));
        sample.color = Rgba(random.below(256), random.below(256), random.below(256), 255);
        // Up to as much as stays within its pixel's neighbours' centres.
        sample.extent = static_cast<std::uint16_t>(1 + random.below(500));
    }
    for (const int samples : {1, std::min(4, drawer->backend().limits().samples)}) {
        INFO(samples << " samples");
        for (LayeredSample& sample : image.samples) {
            if (samples > 1) {
                sample.extent = 256; // all samples of its pixel, of no other
            }
        }
        const Picture picture =
            draw(drawer->backend(), layers_plan({&image}), kSize, kSize, samples);
        int wrong = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const Rgba& color = image.samples[place_in_rows(x, kSize - 1 - y, kSize)].color;
                wrong += color_at(picture, x, y) == Color{color.r, color.g, color.b, 255} ? 0 : 1;
            }
        }
        CHECK(wrong == 0);
    }
}

TEST_CASE("Layered images without samples show nothing") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    const LayeredDepthImage image = make_layers(flat_image(8.0, kWhiteSample), {});
    for (const int samples : {1, std::min(4, drawer->backend().limits().samples)}) {
        const Picture picture =
            draw(drawer->backend(), layers_plan({&image, &image}), kSize, kSize, samples);
        CHECK(count_of(picture, kBlack) == kSize * kSize);
    }
}

TEST_CASE("Layered images hide and are hidden by geometry and by each other, in any order") {
    // A red quad over the middle quarter of the frame at 8 m; green all over at 9 m, blue over the
    // left half at 7 m.
    Scene scene = flat_scene();
    const ItemId quad = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 4.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const LayeredDepthImage far = flat_image(9.0, kGreenSample);
    const LayeredDepthImage near = left_half(flat_image(7.0, kBlueSample));
    const FramePlan shown = layers_plan({&far, &near});
    std::array<std::size_t, 3> order = {0, 1, 2};
    for (const int samples : {1, std::min(4, drawer->backend().limits().samples)}) {
        do {
            FramePlan plan = shown;
            plan.items = {quad};
            const std::array<Command, 3> commands = {
                items_command(0, 1), shown.commands[0], shown.commands[1]};
            plan.commands = {commands[order[0]], commands[order[1]], commands[order[2]]};
            plan.passes[0].command_count = 3;
            INFO(samples << " samples, order " << order[0] << order[1] << order[2]);
            const Picture picture = draw(drawer->backend(), plan, kSize, kSize, samples);
            CHECK(count_of(picture, kBlue) == kSize * kSize / 2);
            CHECK(count_of(picture, kRed) == kSize * kSize / 8);
            CHECK(count_of(picture, kGreen) == kSize * kSize * 3 / 8);
            CHECK(color_at(picture, kSize / 2 + 1, kSize / 2) == kRed);
        } while (std::next_permutation(order.begin(), order.end()));
    }
}

TEST_CASE("Masks, image depths and splats among layered images are drawn as one after the other") {
    Scene scene = flat_scene();
    const ItemId quad = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 4.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const LayeredDepthImage far = flat_image(9.0, kGreenSample);
    const LayeredDepthImage near = left_half(flat_image(7.0, kBlueSample));
    Command mask = items_command(0, 1);
    mask.kind = Command::Kind::mask;
    FramePlan plan = layers_plan({&far, &near});
    plan.items = {quad};
    const Command show_far = plan.commands[0];
    const Command show_near = plan.commands[1];
    const auto picture_of = [&](const std::vector<Command>& commands) {
        plan.commands = commands;
        plan.passes.back().command_count = static_cast<std::uint32_t>(commands.size());
        return draw(drawer->backend(), plan, kSize, kSize);
    };
    SECTION("a mask hides what is drawn later and stands behind it") {
        const Picture picture = picture_of({mask, show_far, show_near});
        CHECK(count_of(picture, kBlack) == kSize * kSize / 8);
        CHECK(count_of(picture, kBlue) == kSize * kSize / 2);
    }
    SECTION("a mask after them changes nothing, and hides the rest") {
        const Picture picture = picture_of({show_far, mask, items_command(0, 1), show_near});
        CHECK(count_of(picture, kRed) == 0);
        CHECK(count_of(picture, kBlue) == kSize * kSize / 2);
        CHECK(count_of(picture, kGreen) == kSize * kSize / 2);
    }
    SECTION("splats are hidden by what stands before them and was drawn before") {
        plan.splats = {{{0.0F, 0.0F, 0.0F}, 100.0F, {255, 0, 0, 255}}};
        Command splats = items_command(0, 1);
        splats.kind = Command::Kind::splats;
        const Picture behind = picture_of({show_near, splats, show_far});
        // They write no depth: what comes later covers them wherever it stands.
        CHECK(count_of(behind, kBlue) == kSize * kSize / 2);
        CHECK(count_of(behind, kGreen) == kSize * kSize / 2);
        const Picture among = picture_of({show_near, show_far, splats});
        CHECK(count_of(among, kBlue) == kSize * kSize / 2);
        CHECK(count_of(among, kRed) == kSize * kSize / 2);
    }
    SECTION("images with depth, made of layers, stand among layers") {
        // The far layers as an image with their depths; the near ones and geometry behind them.
        constexpr PageId kScratch{0};
        constexpr PageId kPage{1};
        plan.pages = {
            {.page = kScratch, .size = kSize, .scratch = true},
            {.page = kPage, .size = kSize, .depth = true}};
        Pass image = plan.passes[0];
        image.page = kScratch;
        image.copy_page = kPage;
        image.copy = image.scissor;
        image.copy_near = 5.0F;
        image.copy_far = 10.0F;
        image.command_count = 1;
        plan.passes = {image, plan.passes[0]};
        plan.passes[1].first_command = 1;
        plan.passes[1].batch = 1;
        ImageQuad shown;
        shown.page = kPage;
        shown.source = {0, 0, kSize, kSize};
        shown.origin = {-8.0F, -8.0F, 0.0F};
        shown.edge_u = {16.0F, 0.0F, 0.0F};
        shown.edge_v = {0.0F, 16.0F, 0.0F};
        shown.viewpoint = {0.0F, 0.0F, 8.0F};
        shown.near_ratio = image.copy_near / 8.0F;
        shown.far_ratio = image.copy_far / 8.0F;
        plan.quads = {shown};
        Command images = images_command(0, 1);
        images.depth = QuadDepth::texel;
        Command depths = images;
        depths.kind = Command::Kind::image_depths;
        const LayeredDepthImage behind = flat_image(9.5, kWhiteSample);
        plan.layered_updates.push_back({.image = LayeredImageId{9}, .content = &behind});
        plan.layers.push_back({.image = LayeredImageId{9}});
        const Command show_behind = layers_command(2, 1);
        plan.commands = {show_far, images, depths, show_behind, show_near, items_command(0, 1)};
        plan.passes[1].command_count = 5;
        const Picture picture = draw(drawer->backend(), plan, kSize, kSize);
        CHECK(count_of(picture, kBlue) == kSize * kSize / 2);
        CHECK(count_of(picture, kRed) == kSize * kSize / 8);
        CHECK(count_of(picture, kGreen) == kSize * kSize * 3 / 8);
    }
}

TEST_CASE("Samples cover the pixels whose centres are in their squares, the nearest on top") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    Random random(17);
    for (int round = 0; round < 12; ++round) {
        const View view = random_layered_view(random);
        const LayeredDepthImage image = random_layers(random, view, round);
        FramePlan plan = layers_plan({&image}, view);
        const Picture picture = draw(drawer->backend(), plan, view.width, view.height);
        const LayeredTruth truth = layered_truth(image, view);
        const LayeredTally tally = tally_layers(picture, image, truth);
        INFO("round " << round);
        CHECK(tally.sure > 9 * view.width * view.height / 10);
        CHECK(tally.covered > view.width * view.height / 20);
        CHECK(tally.wrong_coverage == 0);
        CHECK(tally.not_nearest == 0);
        // Where only a part is drawn, that part is the same.
        Pass& pass = plan.passes[0];
        constexpr int kOffset = 5;
        pass.viewport.x = kOffset;
        pass.viewport.y = 2 * kOffset;
        pass.scissor = {kOffset + 11, 2 * kOffset + 7, 40, 30};
        const int width = view.width + kOffset;
        const int height = view.height + 3 * kOffset;
        View around = view;
        around.width = width;
        around.height = height;
        const auto target = drawer->backend().create_target(width, height, 1);
        REQUIRE(target.has_value());
        REQUIRE(drawer->backend().execute(flat_plan({}, around), *target, {}).has_value());
        REQUIRE(drawer->backend().execute(plan, *target, {}).has_value());
        const Picture part = drawer->backend().read_target(*target).value();
        drawer->backend().destroy_target(*target);
        int different = 0;
        for (int y = 0; y < part.height; ++y) {
            for (int x = 0; x < part.width; ++x) {
                const int up = part.height - 1 - y;
                const bool inside =
                    x >= pass.scissor.x && x < pass.scissor.x + pass.scissor.width &&
                    up >= pass.scissor.y && up < pass.scissor.y + pass.scissor.height;
                const Color expected =
                    inside ? color_at(picture, x - kOffset, view.height - 1 - (up - 2 * kOffset))
                           : kBlack;
                different += color_at(part, x, y) == expected ? 0 : 1;
            }
        }
        CHECK(different == 0);
    }
}

TEST_CASE("Of a square the left and lower edges are inside, the others not") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    // From its own eye, through a window of powers of two, places and sides are exact: edges at
    // sixteenths of a pixel, so that an eighth of them pass through centres.
    Random random(43);
    std::vector<LayeredSample> samples;
    std::vector<bool> expected(place_in_rows(0, kSize, kSize), false);
    for (int i = 0; i < 300; ++i) {
        const auto below = [&](std::uint32_t most) { return static_cast<int>(random.below(most)); };
        const int x = below(kSize * kLayeredSteps);
        const int y = below(kSize * kLayeredSteps);
        const int half = 1 + below(24); // [1/16 px]
        samples.push_back(
            {.x = static_cast<std::uint16_t>(x),
             .y = static_cast<std::uint16_t>(y),
             .depth = static_cast<std::uint16_t>(random.below(65536)),
             .extent = static_cast<std::uint16_t>(2 * half * 256 / kLayeredSteps),
             .color = kWhiteSample}
        );
        for (int row = 0; row < kSize; ++row) {
            for (int column = 0; column < kSize; ++column) {
                const int at_x = kLayeredSteps * column + kLayeredSteps / 2;
                const int at_y = kLayeredSteps * row + kLayeredSteps / 2;
                if (x - half <= at_x && at_x < x + half && y - half <= at_y && at_y < y + half) {
                    expected[place_in_rows(column, kSize - 1 - row, kSize)] = true;
                }
            }
        }
    }
    const LayeredDepthImage image = make_layers(flat_image(8.0, kWhiteSample), samples);
    const Picture picture = draw(drawer->backend(), layers_plan({&image}), kSize, kSize);
    int wrong = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const bool shown = color_at(picture, x, y) != kBlack;
            wrong += shown == expected[place_in_rows(x, y, kSize)] ? 0 : 1;
        }
    }
    CHECK(wrong == 0);
    const auto covered = std::count(expected.begin(), expected.end(), true);
    CHECK(covered > 300);
    CHECK(covered < kSize * kSize / 2);
}

TEST_CASE("Samples cover what splats at their points cover, sample by sample") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    Random random(29);
    for (const int wanted : {1, 4, 8}) {
        const int samples = std::min(wanted, drawer->backend().limits().samples);
        const View view = random_layered_view(random);
        // In one colour: which of them is on top does not show.
        LayeredDepthImage image = random_layers(random, view, 1);
        for (LayeredSample& sample : image.samples) {
            sample.color = kWhiteSample;
        }
        FramePlan splats = flat_plan({}, view);
        splats.origin = view.eye;
        splats.splats = splats_of(image, view);
        splats.commands[0].kind = Command::Kind::splats;
        splats.commands[0].count = static_cast<std::uint32_t>(splats.splats.size());
        const Picture expected = draw(drawer->backend(), splats, view.width, view.height, samples);
        const Picture picture =
            draw(drawer->backend(), layers_plan({&image}, view), view.width, view.height, samples);
        INFO(samples << " samples");
        CHECK(count_of(picture, {255, 255, 255, 255}) > view.width * view.height / 20);
        // Rounding decides where an edge passes by a sample nearer than it reaches: floats of up to
        // 120 px have steps of 2^-17 px, some of which add up to less than 5e-5. Of 1600 squares
        // four edges pass two pixels each on average, and 8 samples in each of these, on either
        // side: so 1600 * 4 * 2 * 8 * 1e-4 = 10 on average if no square hid another.
        CHECK(count_different(picture, expected) <= 10);
    }
}

TEST_CASE("Samples before the near plane and beyond the far one are not drawn") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    for (const auto& [distance, shown] :
         {std::pair{1.9, false}, {2.1, true}, {9.9, true}, {10.2, false}}) {
        INFO(distance << " m");
        const LayeredDepthImage image = flat_image(distance, kGreenSample);
        FramePlan plan = layers_plan({&image});
        plan.passes[0].view.lens.near_distance = 2.0;
        plan.passes[0].view.lens.far_distance = 10.0;
        const Picture picture = draw(drawer->backend(), plan, kSize, kSize);
        CHECK(count_of(picture, kGreen) == (shown ? kSize * kSize : 0));
    }
    // Behind the eye.
    const LayeredDepthImage image = flat_image(5.0, kGreenSample);
    View view = flat_view();
    view.eye.z -= 6.0;
    CHECK(
        count_of(draw(drawer->backend(), layers_plan({&image}, view), kSize, kSize), kBlack) ==
        kSize * kSize
    );
}

TEST_CASE("A sample before the eye covers as much as there is") {
    const auto drawer = empty_drawer();
    if (drawer == nullptr) {
        return;
    }
    // A texel of 64 m a side at 8 m, from as near as a metre: 4096 pixels of a frame of 640.
    constexpr int kWide = 640;
    LayeredDepthImage image = empty_layers(4);
    image.view = flat_view({}, 4);
    const auto middle = [&](std::uint16_t x, std::uint16_t y, const Rgba& color) {
        return LayeredSample{
            .x = static_cast<std::uint16_t>(x * kLayeredSteps + kLayeredSteps / 2),
            .y = static_cast<std::uint16_t>(y * kLayeredSteps + kLayeredSteps / 2),
            .depth = layered_step(image, 8.0),
            .extent = 4096,
            .color = color};
    };
    image = make_layers(image, {middle(1, 1, kGreenSample)});
    View view = flat_view();
    view.eye.z = 1.0;
    view.width = kWide;
    view.height = 2 * kSize;
    for (const int samples : {1, std::min(4, drawer->backend().limits().samples)}) {
        INFO(samples << " samples");
        const Picture picture =
            draw(drawer->backend(), layers_plan({&image}, view), view.width, view.height, samples);
        CHECK(count_of(picture, kGreen) == view.width * view.height);
    }
}

TEST_CASE("Each pixel of layered images shows the point of its sample") {
    const auto drawer = empty_drawer(true);
    if (drawer == nullptr) {
        return;
    }
    Random random(31);
    const View view = random_layered_view(random);
    LayeredDepthImage image = random_layers(random, view, 2);
    for (std::size_t i = 0; i < image.samples.size(); ++i) {
        PositionTexel point;
        point.point = random.vector(-5.0F, 5.0F);
        point.item = ItemId{0};
        point.texel_px = -1.0F; // says nothing
        point.node = 1234;
        image.points.push_back(point);
    }
    Backend& backend = drawer->backend();
    const auto target = backend.create_target(view.width, view.height, 1);
    REQUIRE(target.has_value());
    const FramePlan plan = layers_plan({&image}, view);
    REQUIRE(backend.execute(plan, *target, {}).has_value());
    CHECK(backend.position_bytes() == image.points.size() * sizeof(PositionTexel));
    const Picture colors = backend.read_target(*target).value();
    const PositionPicture positions = backend.read_positions(*target).value();
    const LayeredTruth truth = layered_truth(image, view);
    int checked = 0;
    for (int y = 0; y < view.height; ++y) {
        for (int x = 0; x < view.width; ++x) {
            const auto pixel = place_in_rows(x, y, view.width);
            const PositionTexel& texel = positions.texels[pixel];
            if (color_at(colors, x, y) == kBlack) {
                CHECK(texel == PositionTexel());
                continue;
            }
            const std::size_t sample = sample_of(color_at(colors, x, y));
            REQUIRE(sample < image.samples.size());
            CHECK(texel.point == image.points[sample].point);
            CHECK(texel.item == ItemId{0});
            CHECK(texel.node == 40);
            CHECK(texel.texel_px == Approx(truth.sides[sample]).epsilon(1e-4));
            ++checked;
        }
    }
    CHECK(checked > view.width * view.height / 20);

    // Of an image without points nothing is known, and what geometry was there is hidden.
    image.points.clear();
    REQUIRE(backend.execute(plan, *target, {}).has_value());
    CHECK(backend.position_bytes() == 0);
    const PositionPicture unknown = backend.read_positions(*target).value();
    CHECK(std::all_of(unknown.texels.begin(), unknown.texels.end(), [](const PositionTexel& texel) {
        return texel == PositionTexel();
    }));
    CHECK(backend.read_target(*target).value() == colors);
}
