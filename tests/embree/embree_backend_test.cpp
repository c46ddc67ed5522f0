#include "embree/casting.hpp"
#include "gpu/backend_conformance.hpp"
#include "gpu/depth_scene.hpp"
#include "gpu/flat_scene.hpp"
#include "gpu/position_checks.hpp"
#include <farfield/gpu/calibrate.hpp>

#include <catch2/catch.hpp>

using namespace farfield;
using namespace farfield::support;

TEST_CASE("The Embree backend does what every backend does") {
    const SmallWorld world = make_world(small_scene());
    const auto caster = make_caster(world.scene, &world.hierarchy);
    check_conformance(*caster, world);
}

TEST_CASE("The Embree backend keeps positions") {
    const SmallWorld world = make_world(small_scene());
    const auto colors = make_caster(world.scene, &world.hierarchy);
    const auto positions =
        make_caster(world.scene, &world.hierarchy, {.threads = 2, .positions = true});
    check_positions(*colors, *positions, world);
}

TEST_CASE("Positions follow the depths of images") {
    const CrossedBoards boards;
    check_depth_positions(*make_caster(boards.scene, nullptr, {.positions = true}), boards);
}

TEST_CASE("Positions follow what is cast elsewhere") {
    SmallWorld world = make_world(small_scene());
    const auto positions =
        make_caster(world.scene, &world.hierarchy, {.threads = 2, .positions = true});
    check_moved_positions(*positions, world, [&](ItemId item, const glm::dmat4x3& transform) {
        return positions->set_transform(item, transform);
    });
}

TEST_CASE("Nothing is known of points of splats and cubes that own pixels") {
    Scene scene = flat_scene();
    const ItemId wall = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 4.0);
    check_cell_positions(*make_caster(scene, nullptr, {.positions = true}), wall);
}

TEST_CASE("The Embree backend can be measured") {
    const SmallWorld world = make_world(small_scene());
    const auto caster = make_caster(world.scene, &world.hierarchy);
    const auto costs =
        gpu::calibrate(*caster, world.hierarchy, world.item_primitives, {.seconds = 0.3});
    REQUIRE(costs.has_value());
    CHECK(validate(*costs).has_value());
    CHECK(caster->image_bytes() == 0);
}

TEST_CASE("The device says what it is") {
    const Scene scene = flat_scene();
    CHECK(make_caster(scene, nullptr, {.threads = 1})->device() == "Embree 3.13.5, 1 thread");
    CHECK(make_caster(scene, nullptr, {.threads = 3})->device() == "Embree 3.13.5, 3 threads");
    CHECK(make_caster(scene, nullptr, {})->device().find("Embree 3.13.5, ") == 0);
    CHECK(make_caster(scene)->limits().samples == 64);
    CHECK_FALSE(make_caster(scene)->limits().positions);
    CHECK(make_caster(scene, nullptr, {.positions = true})->limits().positions);
    const auto refused = embree::EmbreeBackend::create(scene, nullptr, {.threads = 257});
    REQUIRE_FALSE(refused.has_value());
    CHECK(refused.error().code == ErrorCode::invalid_argument);
    CHECK(refused.error().message.find("257") != std::string::npos);
}

TEST_CASE("A scene without meshes can be drawn") {
    const auto caster = make_caster(flat_scene());
    const Picture picture = draw(*caster, flat_plan({}), kSize, kSize);
    CHECK(color_at(picture, 0, 0) == kBlack);
}

TEST_CASE("Bytes of the scene grow with it") {
    const Scene empty = flat_scene();
    const SmallWorld world = make_world(small_scene());
    const std::uint64_t bytes = make_caster(world.scene, &world.hierarchy)->scene_bytes();
    CHECK(bytes > memory_bytes(world.scene) / 2);
    CHECK(make_caster(empty)->scene_bytes() < bytes / 100);
}

TEST_CASE("Items and pieces that do not exist are refused by name") {
    const SmallWorld world = make_world(small_scene());
    const auto caster = make_caster(world.scene, &world.hierarchy);
    const auto target = caster->create_target(kSize, kSize, 1);
    REQUIRE(target.has_value());
    const auto refused = [&](const FramePlan& plan, const char* named) {
        INFO(named);
        const auto executed = caster->execute(plan, *target, {});
        REQUIRE_FALSE(executed.has_value());
        CHECK(executed.error().code == ErrorCode::invalid_argument);
        CHECK(executed.error().message.find(named) != std::string::npos);
        CHECK(caster->execute(flat_plan({ItemId{1}}), *target, {}).has_value());
    };
    refused(flat_plan({ItemId{1}, ItemId{71}}), "items[1] is item 71 of 71");
    const Piece& last = world.hierarchy.pieces.back();
    for (const Piece& piece :
         {Piece{last.item, last.first, last.count + 1},
          Piece{last.item, UINT32_MAX, 1},
          Piece{last.item, last.first, 0},
          Piece{ItemId{1}, last.first, last.count},
          Piece{ItemId{1000}, last.first, last.count}}) {
        FramePlan plan = flat_plan({});
        plan.pieces = {piece};
        plan.commands[0].piece_count = 1;
        refused(plan, "pieces[0]");
    }
}

TEST_CASE("The hierarchy of another scene is refused") {
    const SmallWorld world = make_world(small_scene());
    Scene other = flat_scene();
    add_quad(other, kRedPaint, {0.0, 0.0, 0.0});
    const auto caster = embree::EmbreeBackend::create(other, &world.hierarchy);
    REQUIRE_FALSE(caster.has_value());
    CHECK(caster.error().code == ErrorCode::bad_data);
    CHECK(caster.error().message.find("item 0") != std::string::npos);
}
