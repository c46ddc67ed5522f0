#include "gpu/drawer.hpp"
#include "gpu/drawing.hpp"
#include "gpu/flat_scene.hpp"
#include <farfield/technique/culled_geometry.hpp>

#include <catch2/catch.hpp>

#include <numbers>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

/// Pixels of a rectangle have one colour, all others another. Edges [px] from the top left.
void check_rectangle(
    const Picture& picture,
    int left,
    int top,
    int right,
    int bottom,
    const Color& inside,
    const Color& outside
) {
    int wrong = 0;
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            const bool in = x >= left && x < right && y >= top && y < bottom;
            wrong += color_at(picture, x, y) == (in ? inside : outside) ? 0 : 1;
        }
    }
    CHECK(wrong == 0);
}

} // namespace

TEST_CASE("A quad lands on its pixels: x to the right, y up, rows from the top") {
    Scene scene = flat_scene();
    // x 2 to 4 and y 1 to 3 metres: 8 and 4 pixels right and up of the middle, 8 wide and high.
    const ItemId item = add_quad(scene, kRedPaint, {3.0, 2.0, 0.0});
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const Picture picture = draw(drawer->backend(), flat_plan({item}), kSize, kSize);
    check_rectangle(picture, 40, 20, 48, 28, kRed, kBlack);

    FrameClear clear;
    clear.color = {0.0F, 1.0F, 0.0F, 0.0F};
    const Picture cleared = draw(drawer->backend(), flat_plan({item}), kSize, kSize, 1, clear);
    check_rectangle(cleared, 40, 20, 48, 28, kRed, {0, 255, 0, 0});

    // From behind: the other way round, of the same colour.
    const View behind =
        look_at({0.0, 0.0, -8.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, flat_view().lens, kSize, kSize);
    const Picture back = draw(drawer->backend(), flat_plan({item}, behind), kSize, kSize);
    check_rectangle(back, 16, 20, 24, 28, kRed, kBlack);
}

TEST_CASE("A part of a frame is cleared and drawn alone") {
    Scene scene = flat_scene();
    const ItemId item = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 100.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const auto target = drawer->backend().create_target(kSize, kSize, 1);
    REQUIRE(target.has_value());
    FrameClear clear;
    clear.color = {0.0F, 0.0F, 1.0F, 1.0F};
    REQUIRE(drawer->backend().execute(flat_plan({}), *target, clear).has_value());
    FramePlan plan = flat_plan({item}, flat_view({}, 32));
    plan.passes[0].viewport = {8, 4, 32, 32};
    plan.passes[0].scissor = {16, 20, 8, 4};
    clear.color = {0.0F, 1.0F, 0.0F, 1.0F};
    REQUIRE(drawer->backend().execute(plan, *target, clear).has_value());
    check_rectangle(*drawer->backend().read_target(*target), 16, 40, 24, 44, kRed, kBlue);

    // Without a clear, what was there stays, depth too: a quad behind is hidden by it.
    Scene two = flat_scene();
    const ItemId near = add_quad(two, kRedPaint, {0.0, 0.0, 2.0}, 0.75);
    const ItemId far = add_quad(two, kGreenPaint, {0.0, 0.0, 0.0}, 2.0);
    const auto other = make_drawer(two);
    if (other == nullptr) {
        return;
    }
    const auto second = other->backend().create_target(kSize, kSize, 1);
    REQUIRE(other->backend().execute(flat_plan({near}), *second, {}).has_value());
    clear.enabled = false;
    REQUIRE(other->backend().execute(flat_plan({far}), *second, clear).has_value());
    const Picture picture = *other->backend().read_target(*second);
    CHECK(color_at(picture, 32, 32) == kRed);
    CHECK(color_at(picture, 25, 32) == kGreen);
    CHECK(color_at(picture, 20, 32) == kBlack);
}

TEST_CASE("Nearer hides farther, whatever comes first") {
    Scene scene = flat_scene();
    const ItemId near = add_quad(scene, kRedPaint, {0.0, 0.0, 1.0});
    const ItemId far = add_quad(scene, kGreenPaint, {0.0, 0.0, 0.0}, 2.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const Picture a = draw(drawer->backend(), flat_plan({near, far}), kSize, kSize);
    const Picture b = draw(drawer->backend(), flat_plan({far, near}), kSize, kSize);
    CHECK(a == b);
    CHECK(color_at(a, 32, 32) == kRed);
    CHECK(color_at(a, 25, 32) == kGreen);
}

TEST_CASE("A scene at 1e7 metres renders as at 0") {
    // Offsets are formed in double: 1e7 m costs 2e-9 m. What is left is one rounding to float, a
    // few 1e-6 px, which may snap a vertex to another of 256 steps a pixel. That moves edges by
    // 1/256 px at about one vertex in a thousand, so hardly a pixel changes hands.
    constexpr int kWidth = 320;
    constexpr int kHeight = 240;
    constexpr int kMostDifferent = kWidth * kHeight / 1000;
    const glm::dvec3 offset(1e7, -2e6, 3e7);
    std::vector<Picture> pictures;
    for (const glm::dvec3& at : {glm::dvec3(0.0), offset}) {
        const SmallWorld world = make_world(small_scene(at));
        const auto drawer = make_drawer(world.scene, &world.hierarchy);
        if (drawer == nullptr) {
            return;
        }
        CulledGeometry geometry(world.hierarchy);
        const FramePlan& plan = geometry.plan(small_walk(20, kWidth, kHeight, at));
        pictures.push_back(draw(drawer->backend(), plan, kWidth, kHeight));
    }
    Picture black = pictures[0];
    for (std::size_t i = 0; i < black.rgba.size(); ++i) {
        black.rgba[i] = i % 4 == 3 ? 255 : 0;
    }
    CHECK(count_different(pictures[0], black) > kWidth * kHeight / 8);
    CHECK(count_different(pictures[0], pictures[1]) <= kMostDifferent);
}

TEST_CASE("A mesh far from the origin of its own keeps its digits") {
    Scene scene = flat_scene();
    const MaterialId red = add_material(scene, {.base_color = kRedPaint});
    Mesh mesh = quad_mesh();
    mesh.origin = {1e8, 0.0, 0.0};
    add_instance(scene, add_mesh(scene, std::move(mesh), red), {3.0 - 1e8, 2.0, 0.0});
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    check_rectangle(
        draw(drawer->backend(), flat_plan({ItemId{0}}), kSize, kSize), 40, 20, 48, 28, kRed, kBlack
    );
}

TEST_CASE("A clip box cuts geometry, wherever the plan's origin is") {
    Scene scene = flat_scene();
    const ItemId item = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 4.0);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    FramePlan plan = flat_plan({item});
    plan.origin = {100.0, 0.0, -50.0};
    plan.clips = {{{-101.0F, -2.0F, 49.0F}, {-97.0F, 1.0F, 51.0F}}};
    plan.commands[0].clip = 0;
    // x -1 to 3 and y -2 to 1 metres.
    check_rectangle(draw(drawer->backend(), plan, kSize, kSize), 28, 28, 44, 40, kRed, kBlack);
    // It cuts along the line of sight as well.
    plan.clips[0].lo.z = 50.5F;
    check_rectangle(draw(drawer->backend(), plan, kSize, kSize), 0, 0, 0, 0, kRed, kBlack);
    // And does not last.
    plan.commands[0].clip = Command::kNoClip;
    check_rectangle(draw(drawer->backend(), plan, kSize, kSize), 16, 16, 48, 48, kRed, kBlack);
}

TEST_CASE("A piece draws its primitives and no others") {
    // Cells of 4 x 8 pixels: no pixel centre lies on a diagonal, so it is plain which triangle of a
    // cell a pixel belongs to.
    constexpr std::uint32_t kColumns = 8;
    constexpr std::uint32_t kRows = 4;
    Scene scene = flat_scene();
    Mesh mesh;
    mesh.splittable = true;
    for (std::uint32_t row = 0; row <= kRows; ++row) {
        for (std::uint32_t column = 0; column <= kColumns; ++column) {
            mesh.positions.push_back(
                {static_cast<float>(column) - 4.0F, 2.0F * static_cast<float>(row) - 4.0F, 0.0F}
            );
        }
    }
    for (std::uint32_t row = 0; row < kRows; ++row) {
        for (std::uint32_t column = 0; column < kColumns; ++column) {
            const std::uint32_t a = row * (kColumns + 1) + column;
            const std::uint32_t b = a + kColumns + 1;
            // Lower right of the diagonal, then upper left.
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, b + 1, a, b + 1, b});
        }
    }
    add_instance(
        scene,
        add_mesh(scene, std::move(mesh), add_material(scene, {.base_color = kRedPaint})),
        {0.0, 0.0, 0.0}
    );
    const auto built = partition::build_bsp(
        objects_of(scene), {.max_piece_primitives = 8}, primitive_bounds_of(scene)
    );
    REQUIRE(built.has_value());
    REQUIRE(built->pieces.size() > 2);
    const auto drawer = make_drawer(scene, &*built);
    if (drawer == nullptr) {
        return;
    }
    const auto primitive_at = [](int x, int y_from_top) {
        const int column = (x - 16) / 4;
        const int row = (47 - y_from_top) / 8;
        const int in_x = (x - 16) % 4 * 2 + 1;          // half pixels from the left
        const int in_y = (47 - y_from_top) % 8 * 2 + 1; // from below
        const bool upper = in_y > 2 * in_x;
        return static_cast<std::uint32_t>((row * 8 + column) * 2 + (upper ? 1 : 0));
    };
    const auto check_pieces = [&](const std::vector<Piece>& pieces) {
        std::vector<bool> expected(std::size_t{kRows} * kColumns * 2, false);
        for (const Piece& piece : pieces) {
            for (std::uint32_t i = 0; i < piece.count; ++i) {
                expected[built->primitives[piece.first + i]] = true;
            }
        }
        FramePlan plan = flat_plan({});
        plan.pieces = pieces;
        plan.commands[0].piece_count = static_cast<std::uint32_t>(pieces.size());
        const Picture picture = draw(drawer->backend(), plan, kSize, kSize);
        int wrong = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const bool on_mesh = x >= 16 && x < 48 && y >= 16 && y < 48;
                const bool drawn = on_mesh && expected[primitive_at(x, y)];
                wrong += color_at(picture, x, y) == (drawn ? kRed : kBlack) ? 0 : 1;
            }
        }
        CHECK(wrong == 0);
    };
    for (const Piece& piece : built->pieces) {
        check_pieces({piece});
    }
    const Piece& first = built->pieces.front();
    check_pieces({{first.item, first.first + 1, 1}});
    check_pieces({built->pieces[2], built->pieces[0]});
    check_pieces(built->pieces);
}

TEST_CASE("A mask hides what comes later and shows nothing") {
    Scene scene = flat_scene();
    const ItemId mask = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0});
    const ItemId behind = add_quad(scene, kGreenPaint, {0.0, 0.0, -8.0}, 4.0);
    const ItemId before = add_quad(scene, kBluePaint, {0.0, 0.0, 4.0}, 0.125);
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    FramePlan plan = flat_plan({mask, behind, before});
    plan.commands = {plan.commands[0], plan.commands[0]};
    plan.commands[0].kind = Command::Kind::mask;
    plan.commands[0].count = 1;
    plan.commands[1].first = 1;
    plan.commands[1].count = 2;
    plan.passes[0].command_count = 2;
    const Picture picture = draw(drawer->backend(), plan, kSize, kSize);
    CHECK(color_at(picture, 32, 32) == kBlue);  // 2 x 2 pixels
    CHECK(color_at(picture, 34, 32) == kBlack); // 8 x 8
    CHECK(color_at(picture, 37, 32) == kGreen); // 16 x 16
    CHECK(color_at(picture, 41, 32) == kBlack);
}

TEST_CASE("Textures stand upright and are cut out") {
    Scene scene = flat_scene();
    // 8 x 8 texels on 8 x 8 pixels: sampled at texel centres, of the finest level.
    Texture texture = checker_texture(8);
    texture.pixels[0] = 10; // top left, solid
    texture.pixels[1] = 20;
    texture.pixels[2] = 30;
    scene.textures.push_back(texture);
    for (const float cutoff : {0.5F, 0.0F}) {
        const MaterialId material = add_material(
            scene, {.base_color = glm::vec4(1.0F), .texture = TextureId{0}, .alpha_cutoff = cutoff}
        );
        add_instance(scene, add_mesh(scene, quad_mesh(), material), {0.0, 0.0, 0.0});
    }
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const Picture cut = draw(drawer->backend(), flat_plan({ItemId{0}}), kSize, kSize);
    const Picture whole = draw(drawer->backend(), flat_plan({ItemId{1}}), kSize, kSize);
    const Color paint = {220, 60, 40, 255};
    // One step of 255 for the filter's rounding.
    CHECK(distance(color_at(cut, 28, 28), {10, 20, 30, 255}) <= 1);
    int wrong = 0;
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
            if (x == 0 && y == 0) {
                continue;
            }
            const Color& expected = (x + y) % 2 == 0 ? paint : kBlack;
            wrong += distance(color_at(cut, 28 + x, 28 + y), expected) <= 1 ? 0 : 1;
            wrong += distance(color_at(whole, 28 + x, 28 + y), paint) <= 1 ? 0 : 1;
        }
    }
    CHECK(wrong == 0);
}

TEST_CASE("Colours multiply, and vertex alpha cuts without a texture") {
    Scene scene = flat_scene();
    const MaterialId material =
        add_material(scene, {.base_color = {0.5F, 1.0F, 0.25F, 0.8F}, .alpha_cutoff = 0.5F});
    Mesh mesh = quad_mesh();
    mesh.colors.assign(4, {200, 100, 40, 255});
    const MeshId solid = add_mesh(scene, mesh, material);
    mesh.colors.assign(4, {200, 100, 40, 150}); // 0.59 x 0.8 is below the cutoff
    const MeshId hole = add_mesh(scene, mesh, material);
    add_instance(scene, solid, {-2.0, 0.0, 0.0});
    add_instance(scene, hole, {2.0, 0.0, 0.0});
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const Picture picture =
        draw(drawer->backend(), flat_plan({ItemId{0}, ItemId{1}}), kSize, kSize);
    CHECK(distance(color_at(picture, 24, 32), {100, 100, 10, 255}) <= 1);
    CHECK(color_at(picture, 40, 32) == kBlack);
}

TEST_CASE("Light is the same from both sides and follows turned instances") {
    Scene scene = flat_scene();
    scene.light.ambient = 0.25F;
    scene.light.to_light = {0.0F, 0.0F, 2.0F};
    const MaterialId white = add_material(scene, {});
    const MeshId mesh = add_mesh(scene, quad_mesh(), white);
    add_instance(scene, mesh, {-2.0, 0.0, 0.0});                  // faces the light
    add_instance(scene, mesh, {2.0, 0.0, 0.0}, std::numbers::pi); // turned away
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const Picture picture =
        draw(drawer->backend(), flat_plan({ItemId{0}, ItemId{1}}), kSize, kSize);
    // Normals are stored in 10 bits, so lit = 0.5 + 0.5 n.l is good to 1/1000.
    CHECK(distance(color_at(picture, 24, 32), {255, 255, 255, 255}) <= 1);
    CHECK(distance(color_at(picture, 40, 32), {64, 64, 64, 255}) <= 1);
    const View behind =
        look_at({0.0, 0.0, -8.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, flat_view().lens, kSize, kSize);
    const Picture back =
        draw(drawer->backend(), flat_plan({ItemId{0}, ItemId{1}}, behind), kSize, kSize);
    CHECK(color_at(back, 40, 32) == color_at(picture, 24, 32));
    CHECK(color_at(back, 24, 32) == color_at(picture, 40, 32));
}

TEST_CASE("Samples of a frame are averaged") {
    Scene scene = flat_scene();
    // The right edge goes through the middle of a pixel column: 4.125 m is 48.5 px.
    const ItemId item = add_quad(scene, kRedPaint, {3.125, 2.0, 0.0});
    const auto drawer = make_drawer(scene);
    if (drawer == nullptr) {
        return;
    }
    const int samples = std::min(4, drawer->backend().limits().samples);
    REQUIRE(samples >= 2); // OpenGL 4.5 has at least 4
    const Picture picture = draw(drawer->backend(), flat_plan({item}), kSize, kSize, samples);
    CHECK(color_at(picture, 47, 24) == kRed);
    CHECK(color_at(picture, 49, 24) == kBlack);
    const int red = color_at(picture, 48, 24)[0];
    // Any layout of 4 samples has 1 to 3 of them left of the middle.
    CHECK(red >= 255 / samples);
    CHECK(red <= 255 - 255 / samples);
    CHECK(color_at(picture, 48, 24)[3] == 255);
}
