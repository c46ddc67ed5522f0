// What only casting has to get right: threads, samples, ties, parts of split items, and no
// allocation.
#include "embree/casting.hpp"
#include "gpu/flat_scene.hpp"
#include "gpu/hand_made_plan.hpp"
#include "gpu/layered_scene.hpp"
#include "support/allocation_counter.hpp"
#include "support/small_scene.hpp"
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr int kWidth = 200;
constexpr int kHeight = 150;

ImageCacheOptions eager_options(SurfacePlacement surfaces, std::int32_t samples) {
    ImageCacheOptions options = presets::shade1996();
    options.page_size = 512;
    options.costs.triangle_s = 1e-6;
    options.surfaces = surfaces;
    options.image_samples = samples;
    return options;
}

/// A flat grid of `side` x `side` squares of a metre about the origin, split into small pieces.
SmallWorld grid_world(std::uint32_t side) {
    Scene scene = flat_scene();
    Mesh mesh;
    mesh.splittable = true;
    const float half = static_cast<float>(side) / 2.0F;
    for (std::uint32_t row = 0; row <= side; ++row) {
        for (std::uint32_t column = 0; column <= side; ++column) {
            mesh.positions.push_back(
                {static_cast<float>(column) - half, static_cast<float>(row) - half, 0.0F}
            );
        }
    }
    for (std::uint32_t row = 0; row < side; ++row) {
        for (std::uint32_t column = 0; column < side; ++column) {
            const std::uint32_t a = row * (side + 1) + column;
            const std::uint32_t b = a + side + 1;
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, b + 1, a, b + 1, b});
        }
    }
    const MaterialId red = add_material(scene, {.base_color = kRedPaint});
    add_instance(scene, add_mesh(scene, std::move(mesh), red), {0.0, 0.0, 0.0});
    add_quad(scene, kGreenPaint, {0.0, 0.0, -2.0}, 10.0); // behind all of it
    return make_world(std::move(scene));
}

} // namespace

TEST_CASE("Pictures do not depend on the number of threads") {
    const SmallWorld world = make_world(small_scene());
    for (const std::int32_t samples : {1, 3}) {
        std::vector<Picture> pictures;
        for (const unsigned threads : {1U, 2U, 5U}) {
            const auto caster = make_caster(world.scene, &world.hierarchy, {.threads = threads});
            auto cache = ImageCache::create(
                world.hierarchy, eager_options(SurfacePlacement::in_images, samples)
            );
            REQUIRE(cache.has_value());
            const auto target = caster->create_target(kWidth, kHeight, samples);
            REQUIRE(target.has_value());
            for (int frame = 0; frame < 12; ++frame) {
                const View view = small_walk(frame * 3, kWidth, kHeight);
                const FramePlan& plan = cache->plan(view, small_walk_motion());
                REQUIRE(caster->execute(plan, *target, {}).has_value());
            }
            CHECK(cache->statistics().images_shown > 0);
            pictures.push_back(*caster->read_target(*target));
        }
        CHECK(pictures[0] == pictures[1]);
        CHECK(pictures[0] == pictures[2]);
    }
}

TEST_CASE("Executing allocates nothing once warm") {
    const SmallWorld world = make_world(small_scene());
    for (const SurfacePlacement surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        const auto caster = make_caster(world.scene, &world.hierarchy);
        auto cache = ImageCache::create(world.hierarchy, eager_options(surfaces, 4));
        REQUIRE(cache.has_value());
        const auto target = caster->create_target(kWidth, kHeight, 4);
        REQUIRE(target.has_value());
        CulledGeometry geometry(world.hierarchy);
        std::uint64_t allocations = 0;
        std::uint32_t images = 0;
        // There and back again: the second time everything has been as large before. Embree may
        // allocate of its own, with functions that are not counted; casting does not need to.
        for (int frame = 0; frame < 120; ++frame) {
            const View view = small_walk(frame % 60, kWidth, kHeight);
            if (frame % 60 == 0) {
                cache->forget_images();
            }
            const FramePlan& plan = cache->plan(view, small_walk_motion());
            const FramePlan& plain = geometry.plan(view);
            const bool pages = !plan.pages.empty(); // pages are memory
            const std::uint64_t before = allocation_count();
            REQUIRE(caster->execute(plan, *target, {}).has_value());
            REQUIRE(caster->execute(plain, *target, {}).has_value());
            if (frame >= 60 && !pages) {
                allocations += allocation_count() - before;
                images += cache->statistics().images_created;
            }
        }
        CHECK(allocations == 0);
        CHECK(images > 20);
    }
}

TEST_CASE("Splats, cubes and single primitives allocate nothing once warm") {
    const SmallWorld world = make_world(small_scene());
    const auto caster = make_caster(world.scene, &world.hierarchy);
    const auto target = caster->create_target(kFrameSize, kFrameSize, 4);
    REQUIRE(target.has_value());
    const FramePlan plan = plan_with_cells();
    REQUIRE(caster->execute(plan, *target, {}).has_value());
    const std::uint64_t before = allocation_count();
    REQUIRE(caster->execute(plan, *target, {}).has_value());
    CHECK(allocation_count() == before);
}

TEST_CASE("Layered images among geometry allocate nothing once warm") {
    const SmallWorld world = make_world(small_scene());
    const LayeredDepthImage image = flat_layers(6.0, {90, 160, 30, 255});
    for (const bool positions : {false, true}) {
        const auto caster =
            make_caster(world.scene, &world.hierarchy, {.threads = 2, .positions = positions});
        const auto target = caster->create_target(kFrameSize, kFrameSize, 4);
        REQUIRE(target.has_value());
        FramePlan plan = plan_with_layers(image);
        plan.layers.resize(2, plan.layers[0]);
        plan.items = {ItemId{0}};
        plan.commands.push_back(items_command(0, 1));
        plan.commands.push_back(plan.commands[0]);
        plan.commands.back().count = 2;
        plan.passes[0].command_count = 3;
        REQUIRE(caster->execute(plan, *target, {}).has_value());
        plan.layered_updates.clear();
        const std::uint64_t before = allocation_count();
        REQUIRE(caster->execute(plan, *target, {}).has_value());
        CHECK(allocation_count() == before);
    }
}

TEST_CASE("Samples cover an edge as much as it does") {
    // A half-plane whose edge goes through the middle of the frame, at many angles.
    Scene scene = flat_scene();
    constexpr int kAngles = 24;
    std::vector<ItemId> planes;
    for (int i = 0; i < kAngles; ++i) {
        const double angle = 0.1 + i * 2.0 * 3.14159265358979 / kAngles;
        const MaterialId red = add_material(scene, {.base_color = kRedPaint});
        Mesh mesh = quad_mesh();
        add_mesh(scene, mesh, red);
        // A square of 40 m beside the origin, turned about the line of sight.
        Instance instance;
        instance.mesh = make_id<MeshId>(scene.meshes.size() - 1);
        const double c = std::cos(angle) * 20.0;
        const double s = std::sin(angle) * 20.0;
        instance.object_to_world = glm::dmat4x3(
            glm::dvec3(c, s, 0.0), glm::dvec3(-s, c, 0.0), glm::dvec3(0.0, 0.0, 1.0), {c, s, 0.0}
        );
        scene.instances.push_back(instance);
        planes.push_back(make_id<ItemId>(scene.instances.size() - 1));
    }
    const auto caster = make_caster(scene);
    for (const int samples : {1, 2, 3, 4, 7, 8, 16, 64}) {
        INFO(samples << " samples");
        double worst = 0.0;
        double sum = 0.0;
        int edges = 0;
        for (int i = 0; i < kAngles; ++i) {
            const double angle = 0.1 + i * 2.0 * 3.14159265358979 / kAngles;
            const Picture picture = draw(
                *caster, flat_plan({planes[static_cast<std::size_t>(i)]}), kSize, kSize, samples
            );
            for (int y = 0; y < kSize; ++y) {
                for (int x = 0; x < kSize; ++x) {
                    // Covered part of the pixel, by 64 x 64 points.
                    const double dx = x + 0.5 - kSize / 2.0;
                    const double dy = kSize / 2.0 - y - 0.5;
                    const double offset = dx * std::cos(angle) + dy * std::sin(angle);
                    double covered = offset > 0.0 ? 1.0 : 0.0;
                    if (std::abs(offset) < 0.8) {
                        int inside = 0;
                        for (int k = 0; k < 4096; ++k) {
                            const int row = k / 64;
                            const double px = (k % 64 + 0.5) / 64.0 - 0.5;
                            const double py = (row + 0.5) / 64.0 - 0.5;
                            inside +=
                                offset + px * std::cos(angle) + py * std::sin(angle) > 0 ? 1 : 0;
                        }
                        covered = inside / 4096.0;
                        ++edges;
                        sum += color_at(picture, x, y)[0] / 255.0 - covered;
                    }
                    const double shown = color_at(picture, x, y)[0] / 255.0;
                    worst = std::max(worst, std::abs(shown - covered));
                }
            }
        }
        REQUIRE(edges > 1000);
        // No angle is favoured, so the errors even out.
        CHECK(std::abs(sum / edges) < 0.01);
        // One sample is right to a half. Samples thrown at random would be off by half of
        // 1 / sqrt(n) on average, and four times that in the worst of thousands of pixels.
        CHECK(worst <= (samples == 1 ? 0.51 : 0.75 / std::sqrt(samples)));
    }
}

TEST_CASE("One sample is the centre of the pixel") {
    Scene scene = flat_scene();
    // Ends a hundredth of a pixel right of the centre of column 40, and as much left of it.
    for (const double end : {40.51, 40.49}) {
        add_quad(scene, kRedPaint, {(end - 32.0) * 0.25 - 1.0, 0.0, 0.0});
    }
    const auto caster = make_caster(scene);
    CHECK(color_at(draw(*caster, flat_plan({ItemId{0}}), kSize, kSize), 40, 32) == kRed);
    CHECK(color_at(draw(*caster, flat_plan({ItemId{1}}), kSize, kSize), 40, 32) == kBlack);
}

TEST_CASE("Of surfaces at one depth the first one drawn stays") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0});
    // A part of it stands nearer, beside the other, so that it is cast at first whoever comes
    // first.
    Mesh mesh = quad_mesh();
    mesh.texcoords.clear();
    mesh.positions.insert(
        mesh.positions.end(), {{3.0F, 0.0F, 2.0F}, {4.0F, 0.0F, 2.0F}, {3.0F, 1.0F, 2.0F}}
    );
    mesh.indices.insert(mesh.indices.end(), {4, 5, 6});
    const MaterialId paint = add_material(scene, {.base_color = kGreenPaint});
    add_instance(scene, add_mesh(scene, mesh, paint), {0.0, 0.0, 0.0});
    const ItemId green{1};
    const auto caster = make_caster(scene);
    for (const bool red_first : {true, false}) {
        FramePlan plan = flat_plan({red_first ? red : green, red_first ? green : red});
        plan.commands = {plan.commands[0], plan.commands[0]};
        plan.commands[0].count = 1;
        plan.commands[1].first = 1;
        plan.commands[1].count = 1;
        plan.passes[0].command_count = 2;
        const Picture picture = draw(*caster, plan, kSize, kSize);
        CHECK(color_at(picture, 32, 32) == (red_first ? kRed : kGreen));
    }
}

TEST_CASE("A mask after something else leaves what was there") {
    Scene scene = flat_scene();
    const ItemId red = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 2.0);
    const ItemId mask = add_quad(scene, kBluePaint, {0.0, 0.0, 1.0}, 1.0);
    const ItemId green = add_quad(scene, kGreenPaint, {0.0, 0.0, 0.5}, 4.0);
    const auto caster = make_caster(scene);
    FramePlan plan = flat_plan({red, mask, green});
    plan.commands = {plan.commands[0], plan.commands[0], plan.commands[0]};
    for (std::uint32_t i = 0; i < 3; ++i) {
        plan.commands[i].first = i;
        plan.commands[i].count = 1;
    }
    plan.commands[1].kind = Command::Kind::mask;
    plan.passes[0].command_count = 3;
    for (const int samples : {1, 4}) {
        const Picture picture = draw(*caster, plan, kSize, kSize, samples);
        // Red shows where the mask hides green, green all around it.
        CHECK(color_at(picture, 32, 32) == kRed);
        CHECK(color_at(picture, 26, 32) == kGreen);
        CHECK(color_at(picture, 20, 32) == kGreen);
    }
}

TEST_CASE("A triangle that several commands draw is cut by each of their boxes") {
    const SmallWorld world = grid_world(8);
    REQUIRE_FALSE(world.hierarchy.pieces.empty());
    const auto caster = make_caster(world.scene, &world.hierarchy);
    const std::vector<Piece>& pieces = world.hierarchy.pieces;
    const auto count = static_cast<std::uint32_t>(pieces.size());
    // The whole grid twice, in boxes of x -3 to -1 and x 0 to 2 metres, and one primitive of it
    // whole, with a third box as a mask.
    FramePlan plan = flat_plan({ItemId{1}});
    plan.origin = {10.0, 20.0, 30.0};
    plan.pieces = pieces;
    plan.pieces.insert(plan.pieces.end(), pieces.begin(), pieces.end());
    plan.pieces.insert(plan.pieces.end(), pieces.begin(), pieces.end());
    const auto box = [](float from, float to) {
        return Box3f{{from - 10.0F, -23.0F, -31.0F}, {to - 10.0F, -17.0F, -29.0F}};
    };
    plan.clips = {box(-3.0F, -1.0F), box(0.0F, 2.0F), box(3.0F, 4.0F)};
    const Command back = plan.commands[0];
    plan.commands.clear();
    for (std::uint32_t i = 0; i < 3; ++i) {
        Command command;
        command.kind = i == 2 ? Command::Kind::mask : Command::Kind::geometry;
        command.first_piece = i * count;
        command.piece_count = count;
        command.clip = i;
        plan.commands.push_back(command);
    }
    // A mask comes first, or what follows it is a phase of its own.
    for (const bool mask_first : {false, true}) {
        FramePlan ordered = plan;
        if (mask_first) {
            std::swap(ordered.commands[0], ordered.commands[2]);
        }
        ordered.commands.push_back(back);
        ordered.passes[0].command_count = 4;
        for (const int samples : {1, 4}) {
            const Picture picture = draw(*caster, ordered, kSize, kSize, samples);
            int wrong = 0;
            for (int y = 0; y < kSize; ++y) {
                for (int x = 0; x < kSize; ++x) {
                    const double metre_x = (x + 0.5 - 32.0) * 0.25;
                    const double metre_y = (32.0 - y - 0.5) * 0.25;
                    const bool inside = std::abs(metre_y) < 3.0;
                    const bool red = inside && ((metre_x > -3.0 && metre_x < -1.0) ||
                                                (metre_x > 0.0 && metre_x < 2.0));
                    const bool masked = inside && metre_x > 3.0 && metre_x < 4.0;
                    // The quad behind is 10 m at a distance of 10: all of the frame.
                    const Color expected = red ? kRed : masked ? kBlack : kGreen;
                    wrong += color_at(picture, x, y) == expected ? 0 : 1;
                }
            }
            CHECK(wrong == 0);
        }
    }
}

TEST_CASE("Images between two draws of one triangle lie over it") {
    // Drawn first without a box, then with one: depth is there already, so the image that was shown
    // in between stays.
    const SmallWorld world = grid_world(8);
    const auto caster = make_caster(world.scene, &world.hierarchy);
    FramePlan plan = flat_plan({});
    plan.pages = {
        {.page = PageId{0}, .size = 64, .scratch = true}, {.page = PageId{1}, .size = 64}};
    plan.items = {ItemId{1}};
    plan.pieces = world.hierarchy.pieces;
    plan.clips = {{glm::vec3(-1.0F), glm::vec3(1.0F)}};
    Command make;
    make.count = 1;
    Command pieces;
    pieces.piece_count = static_cast<std::uint32_t>(plan.pieces.size());
    Command show;
    show.kind = Command::Kind::images;
    show.count = 1;
    Command again = pieces;
    again.clip = 0;
    plan.commands = {make, pieces, show, again};
    ImageQuad quad;
    quad.page = PageId{1};
    quad.source = {0, 0, 32, 32};
    quad.origin = {-4.0F, -4.0F, 0.0F};
    quad.edge_u = {8.0F, 0.0F, 0.0F};
    quad.edge_v = {0.0F, 8.0F, 0.0F};
    quad.depth = 7.0F;
    plan.quads = {quad};
    Pass image = plan.passes[0];
    image.page = PageId{0};
    image.view = flat_view({}, 32);
    image.viewport = {0, 0, 32, 32};
    image.scissor = image.viewport;
    image.copy_page = PageId{1};
    image.copy = image.viewport;
    plan.passes[0].first_command = 1;
    plan.passes[0].command_count = 3;
    plan.passes[0].batch = 1;
    plan.passes.insert(plan.passes.begin(), image);
    for (const int samples : {1, 4}) {
        const Picture picture = draw(*caster, plan, kSize, kSize, samples);
        CHECK(color_at(picture, 32, 32) == kGreen);
        CHECK(color_at(picture, 20, 32) == kGreen);
    }
    // Where the box comes first, and is all there is, the image is hidden by what follows it.
    plan.commands = {make, again, show, pieces};
    plan.quads[0].depth = 8.5F;
    const Picture picture = draw(*caster, plan, kSize, kSize);
    CHECK(color_at(picture, 32, 32) == kRed);
    CHECK(color_at(picture, 20, 32) == kRed);
}

TEST_CASE("Surfaces are closed") {
    // Rolling ground seen along its folds, every pixel below the horizon: no ray slips through
    // between two triangles.
    const SmallWorld world = grid_world(64);
    const auto caster = make_caster(world.scene, &world.hierarchy);
    FramePlan plan = flat_plan({});
    plan.pieces = world.hierarchy.pieces;
    plan.commands[0].piece_count = static_cast<std::uint32_t>(plan.pieces.size());
    constexpr int kWide = 500;
    int holes = 0;
    for (int i = 0; i < 8; ++i) {
        // All of the frame is on the grid, at angles that put edges anywhere.
        View view = look_at(
            {0.1 * i, 0.07 * i, 8.0},
            {0.3 * i - 1.0, 0.2, 0.0},
            {std::sin(0.3 * i), std::cos(0.3 * i), 0.1},
            {-1, 1, -1, 1, 0.5, 100.0},
            kWide,
            kWide
        );
        plan.passes[0].view = view;
        plan.passes[0].viewport = {0, 0, kWide, kWide};
        plan.passes[0].scissor = plan.passes[0].viewport;
        const Picture picture = draw(*caster, plan, kWide, kWide);
        for (int y = 0; y < kWide; ++y) {
            for (int x = 0; x < kWide; ++x) {
                holes += color_at(picture, x, y) == kRed ? 0 : 1;
            }
        }
    }
    CHECK(holes == 0);
}

TEST_CASE("An instance flattened by its transform is drawn") {
    Scene scene = flat_scene();
    const MaterialId red = add_material(scene, {.base_color = kRedPaint});
    const MeshId box = add_mesh(scene, box_mesh(glm::vec3(-1.0F), glm::vec3(1.0F)), red);
    add_instance(scene, box, {3.0, 2.0, 0.0});
    scene.instances.back().object_to_world[2] = {0.0, 0.0, 0.0};
    const auto caster = make_caster(scene, nullptr, {.threads = 1, .positions = true});
    const auto target = caster->create_target(kSize, kSize, 1);
    REQUIRE(target.has_value());
    REQUIRE(caster->execute(flat_plan({ItemId{0}}), *target, {}).has_value());
    const Picture picture = *caster->read_target(*target);
    int drawn = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) {
            const bool inside = x >= 40 && x < 48 && y >= 20 && y < 28;
            drawn += (color_at(picture, x, y) == kRed) == inside ? 0 : 1;
        }
    }
    CHECK(drawn == 0);
    // The point is that of the mesh, on one of the two sides that have become one.
    const PositionPicture positions = *caster->read_positions(*target);
    const PositionTexel& texel = positions.texels[24 * kSize + 44];
    CHECK(texel.point.x == Approx(0.125).margin(1e-5));
    CHECK(std::abs(texel.point.z) == 1.0F);
}

TEST_CASE("What is flat does not move, and nothing is flattened on the way") {
    Scene scene = flat_scene();
    const MaterialId red = add_material(scene, {.base_color = kRedPaint});
    const MeshId box = add_mesh(scene, box_mesh(glm::vec3(-1.0F), glm::vec3(1.0F)), red);
    add_instance(scene, box, {3.0, 2.0, 0.0});
    add_instance(scene, box, {-3.0, 2.0, 0.0});
    scene.instances[0].object_to_world[2] = {0.0, 0.0, 0.0};
    const auto caster = make_caster(scene, nullptr, {.threads = 1});
    const Picture before = draw(*caster, flat_plan({ItemId{0}, ItemId{1}}), kSize, kSize);
    const Result<void> was_flat = caster->set_transform(ItemId{0}, glm::dmat4x3(1.0));
    REQUIRE_FALSE(was_flat.has_value());
    CHECK(was_flat.error().code == ErrorCode::unsupported);
    CHECK(was_flat.error().message == "Embree: item 0 was made flat, expected one with a volume");
    glm::dmat4x3 flat = scene.instances[1].object_to_world;
    flat[1] *= 1e-8;
    const Result<void> flattens = caster->set_transform(ItemId{1}, flat);
    REQUIRE_FALSE(flattens.has_value());
    CHECK(flattens.error().code == ErrorCode::unsupported);
    CHECK(flattens.error().message.find("item 1: the transform flattens") != std::string::npos);
    CHECK(draw(*caster, flat_plan({ItemId{0}, ItemId{1}}), kSize, kSize) == before);
}

TEST_CASE("Light on an instance that is stretched") {
    // A slope of 45 degrees, made flatter to tan = 1/2: its normal is (0, 2, 1) / sqrt(5) in the
    // y-z plane, whatever is interpolated.
    Scene scene = flat_scene();
    scene.light.ambient = 0.0F;
    scene.light.to_light = {0.0F, 0.0F, 1.0F};
    Mesh mesh = quad_mesh();
    for (glm::vec3& position : mesh.positions) {
        position.z = -position.y;
    }
    const MaterialId white = add_material(scene, {});
    add_instance(scene, add_mesh(scene, mesh, white), {0.0, 0.0, 0.0});
    scene.instances.back().object_to_world[2].z = 0.5;
    const auto caster = make_caster(scene);
    const Picture picture = draw(*caster, flat_plan({ItemId{0}}), kSize, kSize);
    const auto lit = static_cast<int>(std::lround((0.5 + 0.5 * 2.0 / std::sqrt(5.0)) * 255.0));
    CHECK(distance(color_at(picture, 32, 32), {lit, lit, lit, 255}) <= 1);
}
