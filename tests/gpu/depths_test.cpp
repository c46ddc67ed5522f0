#include "gpu/depth_scene.hpp"
#include "gpu/drawer.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Two pictures are the same but for pixels where the boards are too close to tell.
void check_same_but_for_ties(
    const CrossedBoards& boards, const Picture& picture, const Picture& expected, double slab
) {
    const View view = flat_view();
    int wrong = 0;
    int ties = 0;
    int red = 0;
    int blue = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const glm::dvec3 direction = pixel_direction(view, x, y);
            const double a = boards.red.plane_depth(view.eye, direction);
            const double b = boards.blue.plane_depth(view.eye, direction);
            const Color shown = color_at(expected, x, y);
            const bool tie = std::abs(a - b) <= depth_tolerance(slab, std::min(a, b));
            ties += tie ? 1 : 0;
            wrong += !tie && color_at(picture, x, y) != shown ? 1 : 0;
            red += shown == kRed ? 1 : 0;
            blue += shown == kBlue ? 1 : 0;
        }
    }
    CHECK(wrong == 0);
    CHECK(ties <= kSize); // at most a pixel of each row of the line where they meet
    CHECK(red > 200);
    CHECK(blue > 200);
}

} // namespace

TEST_CASE("With depths of texels an image is cut as its contents would be") {
    const CrossedBoards boards;
    const auto drawer = make_drawer(boards.scene);
    if (drawer == nullptr) {
        return;
    }
    Backend& backend = drawer->backend();
    const Picture plain =
        draw(backend, flat_plan({boards.red.item, boards.blue.item}), kSize, kSize);
    for (const float slab : {16.0F, 100.0F, 1000.0F}) {
        INFO("slab " << slab);
        const ImageAmongItems after{
            .image = {boards.red.item},
            .after = {boards.blue.item},
            .copy_near = 0.25F,
            .copy_far = 0.25F + slab};
        ImageAmongItems before = after;
        std::swap(before.before, before.after);
        const double wide = double{slab};
        check_same_but_for_ties(
            boards, draw(backend, plan_among_items(after), kSize, kSize), plain, wide
        );
        check_same_but_for_ties(
            boards, draw(backend, plan_among_items(before), kSize, kSize), plain, wide
        );
        // Drawn by the caller, before the plan.
        const auto target = backend.create_target(kSize, kSize, 1);
        REQUIRE(target.has_value());
        before.before.clear();
        REQUIRE(backend.execute(flat_plan({boards.blue.item}), *target, {}).has_value());
        REQUIRE(backend.execute(plan_among_items(before), *target, {.enabled = false}).has_value());
        check_same_but_for_ties(boards, backend.read_target(*target).value(), plain, wide);
        backend.destroy_target(*target);
    }
}

TEST_CASE("With depths of planes an image is cut at its plane, without it stands at one depth") {
    const CrossedBoards boards;
    const auto drawer = make_drawer(boards.scene);
    if (drawer == nullptr) {
        return;
    }
    Backend& backend = drawer->backend();
    const Picture alone = draw(backend, flat_plan({boards.red.item}), kSize, kSize);
    const Picture other = draw(backend, flat_plan({boards.blue.item}), kSize, kSize);
    const View view = flat_view();
    const auto check = [&](QuadDepth depth, bool blue_after) {
        INFO("depth " << static_cast<int>(depth) << ", blue after " << blue_after);
        ImageAmongItems what{.image = {boards.red.item}, .depth = depth};
        (blue_after ? what.after : what.before) = {boards.blue.item};
        const Picture picture = draw(backend, plan_among_items(what), kSize, kSize);
        int wrong = 0;
        int both = 0;
        int cut = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const Color red = color_at(alone, x, y);
                const Color blue = color_at(other, x, y);
                const glm::dvec3 direction = pixel_direction(view, x, y);
                const double gap =
                    boards.blue.plane_depth(view.eye, direction) - double{kImagePlane};
                // Without depths, what comes after an image is drawn over it.
                const bool blue_before_red = (depth == QuadDepth::none && blue_after) || gap < 0.0;
                both += red == kRed && blue == kBlue ? 1 : 0;
                cut += red == kRed && blue == kBlue && blue_before_red ? 1 : 0;
                const bool shows_blue = blue == kBlue && (red != kRed || blue_before_red);
                const Color expected = shows_blue ? kBlue : red;
                const bool tie = std::abs(gap) <= depth_tolerance(0.0, double{kImagePlane});
                wrong += !tie && color_at(picture, x, y) != expected ? 1 : 0;
            }
        }
        CHECK(wrong == 0);
        CHECK(both > 500);
        CHECK(cut > 100);
        CHECK((cut < both || depth == QuadDepth::none));
    };
    for (const QuadDepth depth : {QuadDepth::none, QuadDepth::plane}) {
        check(depth, false);
        check(depth, true);
    }
}

TEST_CASE("Kept depths are off by half a step at most") {
    // Boards at random depths in the squares of a grid, and each once more a little before or
    // behind.
    constexpr int kGrid = 8;
    constexpr double kSlab = 99.0;
    constexpr double kNear = 0.75;
    Scene scene = flat_scene();
    std::vector<ItemId> red;
    std::vector<ItemId> before;
    std::vector<ItemId> behind;
    Random random(5);
    for (int i = 0; i < kGrid * kGrid; ++i) {
        const double depth = random.uniform(1.0, 99.0);
        const int column = i % kGrid;
        const int row = i / kGrid;
        const double x = (column + 0.5) * 2.0 / kGrid - 1.0;
        const double y = (row + 0.5) * 2.0 / kGrid - 1.0;
        const double off = depth_tolerance(kSlab, depth);
        const auto add = [&](const glm::vec4& color, double at) {
            return add_quad(scene, color, {x * at, y * at, 8.0 - at}, 0.6 * at / kGrid);
        };
        red.push_back(add(kRedPaint, depth));
        before.push_back(add(kBluePaint, depth - off));
        behind.push_back(add(kBluePaint, depth + off));
    }
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    ImageAmongItems what{
        .image = red, .copy_near = float{kNear}, .copy_far = static_cast<float>(kNear + kSlab)};
    const auto count = [&](const Color& color) {
        const Picture picture = draw(drawer->backend(), plan_among_items(what), kSize, kSize);
        int found = 0;
        for (int i = 0; i < kGrid * kGrid; ++i) {
            constexpr int kCell = kSize / kGrid;
            const int x = i % kGrid * kCell + kCell / 2;
            const int y = kSize - 1 - (i / kGrid * kCell + kCell / 2);
            found += color_at(picture, x, y) == color ? 1 : 0;
        }
        return found;
    };
    what.after = before;
    CHECK(count(kBlue) == kGrid * kGrid);
    what.after = behind;
    CHECK(count(kRed) == kGrid * kGrid);
    what.after.clear();
    what.before = before;
    CHECK(count(kBlue) == kGrid * kGrid);
    what.before = behind;
    CHECK(count(kRed) == kGrid * kGrid);
}

TEST_CASE("From another eye texels stand where they were seen") {
    const CrossedBoards boards;
    const auto drawer = make_drawer(boards.scene);
    if (drawer == nullptr) {
        return;
    }
    ImageAmongItems what{.image = {boards.red.item}, .after = {boards.blue.item}};
    const double slab = double{what.copy_far} - double{what.copy_near};
    const View made = flat_view();
    for (const glm::dvec3& eye :
         {glm::dvec3(0.5, 0.3, 8.2), glm::dvec3(-1.0, 0.5, 11.0), glm::dvec3(0.7, -1.0, 6.0)}) {
        INFO("eye " << eye.x << ", " << eye.y << ", " << eye.z);
        what.view = look_at(eye, {0.3, 0.1, 0.0}, {0, 1, 0}, made.lens, kSize, kSize);
        const Picture picture = draw(drawer->backend(), plan_among_items(what), kSize, kSize);
        const glm::dvec3 forward = -what.view.camera_to_world[2];
        int wrong = 0;
        int red = 0;
        int blue = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const glm::dvec3 direction = pixel_direction(what.view, x, y);
                // Its place on the quad, in texels from the top left as the image's view counts.
                const glm::dvec3 place = eye - direction * (eye.z / direction.z);
                const glm::dvec2 texel((place.x + 8.0) / 0.25 - 0.5, (8.0 - place.y) / 0.25 - 0.5);
                int texels = 0;
                for (const double right : {std::floor(texel.x), std::floor(texel.x) + 1.0}) {
                    for (const double down : {std::floor(texel.y), std::floor(texel.y) + 1.0}) {
                        const glm::dvec3 ray = pixel_direction(made, right, down);
                        texels += boards.red.depth(made.eye, ray) < kInfinite ? 1 : 0;
                    }
                }
                const glm::dvec3 ray =
                    pixel_direction(made, std::round(texel.x), std::round(texel.y));
                const double ratio = boards.red.plane_depth(made.eye, ray) / double{kImagePlane};
                const glm::dvec3 shown = made.eye + (place - made.eye) * ratio;
                const double red_depth = texels == 4 ? glm::dot(shown - eye, forward) : kInfinite;
                const double blue_depth = boards.blue.depth(eye, direction);
                // Half a step as this eye sees it: a point moves along its ray, which is at most
                // sqrt(3) times as long as the image's eye counts. Which texel is the nearest is
                // rounded to a 256th of one.
                const double tolerance = 2.0 * depth_tolerance(slab, 16.0);
                const glm::dvec2 rim = glm::abs(glm::abs(texel - glm::round(texel)) - 0.5);
                const bool certain = (texels == 0 || texels == 4) &&
                                     std::min(rim.x, rim.y) > 1.0 / 128.0 &&
                                     !(std::abs(red_depth - blue_depth) <= tolerance);
                // Rims of the blue board are left out as well.
                const auto hits_blue = [&](double right, double down) {
                    const glm::dvec3 other = pixel_direction(what.view, right, down);
                    return boards.blue.depth(eye, other) < kInfinite;
                };
                const bool blue_rim = hits_blue(x + 0.5, y + 0.5) != hits_blue(x, y) ||
                                      hits_blue(x - 0.5, y - 0.5) != hits_blue(x, y);
                if (!certain || blue_rim) {
                    continue;
                }
                const bool is_red = red_depth < blue_depth;
                const bool is_blue = blue_depth < red_depth;
                red += is_red ? 1 : 0;
                blue += is_blue ? 1 : 0;
                const Color expected = is_red ? kRed : is_blue ? kBlue : kBlack;
                wrong += distance(color_at(picture, x, y), expected) > 1 ? 1 : 0;
            }
        }
        CHECK(wrong == 0);
        CHECK(red > 150);
        CHECK(blue > 150);
    }
}

TEST_CASE("Images made from images keep depth") {
    const CrossedBoards boards;
    const auto drawer = make_drawer(boards.scene);
    if (drawer == nullptr) {
        return;
    }
    Backend& backend = drawer->backend();
    const Picture plain =
        draw(backend, flat_plan({boards.red.item, boards.blue.item}), kSize, kSize);
    FramePlan plan = plan_among_items({.image = {boards.red.item}, .after = {boards.blue.item}});
    // A second image shows the first, and the frame shows it instead. Its slab is another.
    constexpr float kNear = 2.0F;
    constexpr float kFar = 52.0F;
    const Region place{100, 80, kImageWithBorder, kImageWithBorder};
    Pass second = depth_image_pass(place, kNear, kFar);
    second.batch = 1;
    second.first_command = static_cast<std::uint32_t>(plan.commands.size());
    add_quads_command(plan, Command::Kind::images, QuadDepth::texel, 0, second.command_count);
    add_quads_command(plan, Command::Kind::image_depths, QuadDepth::texel, 0, second.command_count);
    plan.passes.insert(plan.passes.begin() + 1, second);
    plan.passes[2].batch = 2;
    plan.quads.push_back(depth_quad(place, kNear, kFar));
    for (Command& command : plan.commands) {
        const bool of_frame = &command < &plan.commands[second.first_command];
        command.first = draws_images(command) && of_frame ? 1 : command.first;
    }
    // Half a step of each.
    check_same_but_for_ties(boards, draw(backend, plan, kSize, kSize), plain, 32.0 + 50.0);
}

TEST_CASE("Depth is written where alpha is at least one half") {
    Scene scene = flat_scene();
    // Columns 24 to 39 at a depth of 6, and all of the view at one of 12.
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, 2.0}, 1.5);
    const ItemId blue = add_quad(scene, kBluePaint, {0.0, 0.0, -4.0}, 13.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const QuadDepth depth = GENERATE(QuadDepth::plane, QuadDepth::texel);
    INFO("depth " << static_cast<int>(depth));
    // Four tenths of a pixel to the right: column 24 has an alpha of 0.6, column 40 one of 0.4.
    ImageAmongItems what{.image = {red}, .after = {blue}, .depth = depth, .shift_px = {0.4F, 0.0F}};
    const Picture picture = draw(drawer->backend(), plan_among_items(what), kSize, kSize);
    CHECK(color_at(picture, 23, 32) == kBlue);
    CHECK(distance(color_at(picture, 24, 32), {153, 0, 0, 255}) <= 1);
    CHECK(color_at(picture, 25, 32) == kRed);
    CHECK(color_at(picture, 39, 32) == kRed);
    CHECK(color_at(picture, 40, 32) == kBlue);
    // Not written at all, the image is drawn over.
    what.write_depths = false;
    const Picture over = draw(drawer->backend(), plan_among_items(what), kSize, kSize);
    CHECK(color_at(over, 32, 32) == kBlue);
}

TEST_CASE("Clear texels take the depth of the neighbour that shows something") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, 2.0}, 1.5);      // depth 6
    const ItemId between = add_quad(scene, kBluePaint, {0.0, 0.0, 0.0}, 9.0); // depth 8
    const ItemId before = add_quad(scene, kBluePaint, {0.0, 0.0, 3.0}, 9.0);  // depth 5
    // Just beside the red one, from column 40 on; of the image alone, and nothing of it is shown.
    const ItemId near = add_quad(scene, kGreenPaint, {1.5, 0.0, 5.0}, 0.75); // depth 3
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    ImageAmongItems what{.image = {red}, .before = {between}, .shift_px = {0.4F, 0.0F}};
    const std::array<std::vector<ItemId>, 2> masks = {{{}, {near}}};
    for (const std::vector<ItemId>& mask : masks) {
        INFO(mask.size() << " masks");
        what.mask = mask;
        what.before = {between};
        const Picture shown = draw(drawer->backend(), plan_among_items(what), kSize, kSize);
        CHECK(color_at(shown, 39, 32) == kRed);
        CHECK(distance(color_at(shown, 40, 32), {102, 0, 153, 255}) <= 1);
        CHECK(color_at(shown, 41, 32) == kBlue);
        what.before = {before};
        const Picture hidden = draw(drawer->backend(), plan_among_items(what), kSize, kSize);
        CHECK(color_at(hidden, 39, 32) == kBlue);
        CHECK(color_at(hidden, 40, 32) == kBlue);
    }
}

TEST_CASE("Of several samples the nearest that shows something is kept") {
    Scene scene = flat_scene();
    // The red one's right edge cuts column 40 in the middle; the mask hides columns from 50.7 on.
    const ItemId red = add_quad(scene, kRedPaint, {0.09375, 0.0, 2.0}, 1.5);    // depth 6
    const ItemId green = add_quad(scene, kGreenPaint, {0.0, 0.0, -8.0}, 15.0);  // depth 16
    const ItemId between = add_quad(scene, kBluePaint, {0.0, 0.0, -2.0}, 9.0);  // depth 10
    const ItemId mask = add_quad(scene, kBluePaint, {3.753125, 0.0, 5.0}, 2.0); // depth 3
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const int samples = std::min(4, drawer->backend().limits().samples);
    REQUIRE(samples >= 2);
    ImageAmongItems what{
        .image = {red, green}, .after = {between}, .mask = {mask}, .samples = samples};
    const Picture picture = draw(drawer->backend(), plan_among_items(what), kSize, kSize);
    CHECK(color_at(picture, 39, 32) == kRed);
    CHECK(color_at(picture, 41, 32) == kBlue);
    const Color edge = color_at(picture, 40, 32);
    CHECK(edge[0] > 0);
    CHECK(edge[1] > 0);
    CHECK(edge[2] == 0);
    // Most samples of column 50 show green, so its depth is written; that of the mask is not kept.
    CHECK(color_at(picture, 49, 32) == kBlue);
    CHECK(color_at(picture, 50, 32) == kBlue);
    CHECK(color_at(picture, 51, 32) == kBlue);
}

TEST_CASE("Images hide each other only by depths that were written") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, 2.0}, 1.0);      // depth 6
    const ItemId green = add_quad(scene, kGreenPaint, {0.0, 0.0, -2.0}, 3.0); // depth 10
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const QuadDepth depth = GENERATE(QuadDepth::plane, QuadDepth::texel);
    INFO("depth " << static_cast<int>(depth));
    FramePlan plan = plan_among_items({.image = {red}, .depth = depth, .write_depths = false});
    // An image of the green one, on a plane behind that of the red one, shown after it.
    const Region place{100, 80, kImageWithBorder, kImageWithBorder};
    Pass second = depth_image_pass(place, 1.0F, 33.0F);
    second.batch = 1;
    second.first_command = static_cast<std::uint32_t>(plan.commands.size());
    add_command(plan, Command::Kind::geometry, {green}, second.command_count);
    plan.passes.insert(plan.passes.begin() + 1, second);
    ImageQuad quad = depth_quad(place, 1.0F, 33.0F);
    constexpr float kBehind = 1.25F;
    quad.origin *= kBehind;
    quad.origin.z = kImagePlane * (1.0F - kBehind);
    quad.edge_u *= kBehind;
    quad.edge_v *= kBehind;
    quad.near_ratio /= kBehind;
    quad.far_ratio /= kBehind;
    plan.quads.push_back(quad);
    Pass& frame = plan.passes[2];
    frame.batch = 2;
    frame.first_command = static_cast<std::uint32_t>(plan.commands.size());
    frame.command_count = 0;
    add_quads_command(plan, Command::Kind::images, depth, 0, frame.command_count);
    add_quads_command(plan, Command::Kind::images, depth, 1, frame.command_count);
    add_quads_command(plan, Command::Kind::image_depths, depth, 0, frame.command_count);
    add_quads_command(plan, Command::Kind::image_depths, depth, 1, frame.command_count);
    CHECK(color_at(draw(drawer->backend(), plan, kSize, kSize), 32, 32) == kGreen);
    std::swap(plan.commands[frame.first_command + 1], plan.commands[frame.first_command + 2]);
    const Picture picture = draw(drawer->backend(), plan, kSize, kSize);
    CHECK(color_at(picture, 32, 32) == kRed);
    CHECK(color_at(picture, 24, 32) == kGreen);
    // Before the near plane both count as at it, and so does the one behind.
    frame.view.lens.near_distance = 20.0;
    CHECK(color_at(draw(drawer->backend(), plan, kSize, kSize), 32, 32) == kGreen);
}

TEST_CASE("Neither the near plane nor the far one cuts an image") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, -4.0}, 3.0); // depth 12
    const ItemId blue = add_quad(scene, kBluePaint, {0.0, 0.0, -9.0}, 13.0);
    const ItemId close = add_quad(scene, kBluePaint, {0.0, 0.0, -3.9}, 13.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const auto shown = [&](double eye_z, QuadDepth depth, ItemId item, const Lens& lens) {
        ImageAmongItems what{.image = {red}, .after = {item}, .depth = depth};
        what.view = look_at({0, 0, eye_z}, {0, 0, -100}, {0, 1, 0}, lens, kSize, kSize);
        return color_at(draw(drawer->backend(), plan_among_items(what), kSize, kSize), 32, 32);
    };
    const Lens lens = flat_view().lens;
    // The quad is 0.3 m off, before the near plane at 0.5, and what it shows at 4.3.
    CHECK(shown(0.3, QuadDepth::texel, blue, lens) == kRed);
    CHECK(shown(0.3, QuadDepth::texel, close, lens) == kBlue);
    CHECK(shown(0.3, QuadDepth::plane, close, lens) == kRed);
    // What it shows is before the near plane as well: it counts as at it.
    const Lens beyond{-1, 1, -1, 1, 20.0, 100.0};
    CHECK(shown(8.0, QuadDepth::texel, blue, beyond) == kRed);
    CHECK(shown(8.0, QuadDepth::plane, blue, beyond) == kRed);
    // All of it is beyond the far plane: anything in view is before it.
    const Lens before{-1, 1, -1, 1, 0.5, 7.0};
    CHECK(shown(8.0, QuadDepth::texel, blue, before) == kRed);
    CHECK(shown(8.0, QuadDepth::plane, blue, before) == kRed);
}

TEST_CASE("Depths of images and samples of the frame") {
    CrossedBoards boards;
    // Behind all of it, so that the samples of every pixel have met something.
    const ItemId green = add_quad(boards.scene, kGreenPaint, {0.0, 0.0, -20.0}, 50.0);
    const auto drawer = make_drawer(boards.scene);
    if (drawer == nullptr) {
        return;
    }
    Backend& backend = drawer->backend();
    const int samples = std::min(4, backend.limits().samples);
    const QuadDepth depth = GENERATE(QuadDepth::plane, QuadDepth::texel);
    const View view = flat_view();
    for (const bool blue_after : {false, true}) {
        INFO("depth " << static_cast<int>(depth) << ", blue after " << blue_after);
        ImageAmongItems what{
            .image = {boards.red.item}, .before = {green}, .depth = depth, .samples = samples};
        (blue_after ? what.after : what.before).push_back(boards.blue.item);
        const Picture picture = draw(backend, plan_among_items(what), kSize, kSize, samples);
        int wrong = 0;
        int red = 0;
        int blue = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                // Where a whole pixel shows one board, by the depths of its corners.
                bool is_red = true;
                bool is_blue = true;
                for (const double right : {x - 0.6, x + 0.6}) {
                    for (const double down : {y - 0.6, y + 0.6}) {
                        const glm::dvec3 ray = pixel_direction(view, right, down);
                        const double at = boards.red.depth(view.eye, ray);
                        const double a =
                            depth == QuadDepth::plane && at < kInfinite ? double{kImagePlane} : at;
                        const double b = boards.blue.depth(view.eye, ray);
                        is_red = is_red && a < b;
                        is_blue = is_blue && b < a;
                    }
                }
                red += is_red ? 1 : 0;
                blue += is_blue ? 1 : 0;
                wrong += is_red && color_at(picture, x, y) != kRed ? 1 : 0;
                wrong += is_blue && color_at(picture, x, y) != kBlue ? 1 : 0;
            }
        }
        CHECK(wrong == 0);
        CHECK(red > 200);
        CHECK(blue > 200);
    }
}
