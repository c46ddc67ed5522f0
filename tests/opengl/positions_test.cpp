#include "gpu/depth_scene.hpp"
#include "gpu/flat_scene.hpp"
#include "gpu/position_checks.hpp"
#include "opengl/device.hpp"

#include <catch2/catch.hpp>

using namespace farfield;
using namespace farfield::support;

TEST_CASE("OpenGL keeps positions") {
    const SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    const auto positions = opengl::OpenGLBackend::create(*device->source, {.positions = true});
    REQUIRE(positions.has_value());
    check_positions(*device->backend, **positions, world);
}

TEST_CASE("Positions follow what OpenGL draws elsewhere") {
    SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    const auto positions = opengl::OpenGLBackend::create(*device->source, {.positions = true});
    REQUIRE(positions.has_value());
    check_moved_positions(**positions, world, [&](ItemId item, const glm::dmat4x3& transform) {
        return device->source->set_transform(item, transform);
    });
}

TEST_CASE("Positions of a scene far from the origin") {
    const glm::dvec3 offset(1.0e7, -2.0e6, 4.0e6);
    const SmallWorld world = make_world(small_scene(offset));
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    const auto positions = opengl::OpenGLBackend::create(*device->source, {.positions = true});
    REQUIRE(positions.has_value());
    const auto target = (*positions)->create_target(160, 120, 1);
    REQUIRE(target.has_value());
    CulledGeometry geometry(world.hierarchy);
    const View view = small_walk(30, 160, 120, offset);
    REQUIRE((*positions)->execute(geometry.plan(view), *target, {}).has_value());
    const auto picture = (*positions)->read_positions(*target);
    REQUIRE(picture.has_value());
    const PositionTally all = tally(*picture, view, world.scene);
    CHECK(all.geometry > 1000);
    CHECK(all.worst_geometry_px < kRasterPx);
}

TEST_CASE("Which item a pixel shows, in front and behind, with holes and masks") {
    Scene scene = flat_scene();
    const ItemId left = add_quad(scene, kRedPaint, {-4.0, 0.0, 0.0}, 2.0);
    const ItemId behind = add_quad(scene, kGreenPaint, {-4.0, 0.0, -1.0}, 2.0);
    const ItemId right = add_quad(scene, kBluePaint, {4.0, 0.0, 0.0}, 2.0);
    const auto device = Device::create(scene);
    if (device == nullptr) {
        return;
    }
    const auto positions = opengl::OpenGLBackend::create(*device->source, {.positions = true});
    REQUIRE(positions.has_value());
    const auto target = (*positions)->create_target(kSize, kSize, 1);
    REQUIRE(target.has_value());
    FramePlan plan = flat_plan({left, right, behind});
    // The right one only masks.
    plan.commands = {plan.commands[0], plan.commands[0], plan.commands[0]};
    for (std::uint32_t i = 0; i < 3; ++i) {
        plan.commands[i].first = i;
        plan.commands[i].count = 1;
    }
    plan.commands[1].kind = Command::Kind::mask;
    plan.passes[0].command_count = 3;
    REQUIRE((*positions)->execute(plan, *target, {}).has_value());
    const auto picture = (*positions)->read_positions(*target);
    REQUIRE(picture.has_value());
    const auto at = [&](int x, int y) {
        return picture->texels[static_cast<std::size_t>(y) * kSize + static_cast<std::size_t>(x)];
    };
    // A pixel is a quarter of a metre: the left quad covers columns 8 to 23, rows 24 to 39.
    CHECK(at(16, 32).item == left);
    CHECK(at(8, 24).item == left);
    CHECK(at(7, 24).item == kNone<ItemId>);
    CHECK(at(48, 32).item == kNone<ItemId>);
    // Column 16 has its centre 0.125 m right of the quad's middle, half of that as the mesh counts;
    // row 32 its centre as far below.
    CHECK(at(16, 32).point.x == Approx(0.0625).margin(1e-5));
    CHECK(at(16, 32).point.y == Approx(-0.0625).margin(1e-5));
    CHECK(at(16, 32).point.z == 0.0F);
}

TEST_CASE("Positions follow the depths of images") {
    const CrossedBoards boards;
    const auto device = Device::create(boards.scene);
    if (device == nullptr) {
        return;
    }
    const auto positions = opengl::OpenGLBackend::create(*device->source, {.positions = true});
    REQUIRE(positions.has_value());
    check_depth_positions(**positions, boards);
}

TEST_CASE("Nothing is known of points of splats and cubes that own pixels") {
    Scene scene = flat_scene();
    const ItemId wall = add_quad(scene, kRedPaint, {0.0, 0.0, 0.0}, 4.0);
    const auto device = Device::create(scene);
    if (device == nullptr) {
        return;
    }
    const auto positions = opengl::OpenGLBackend::create(*device->source, {.positions = true});
    REQUIRE(positions.has_value());
    check_cell_positions(**positions, wall);
}

TEST_CASE("A source that writes no positions") {
    class Silent final : public GeometrySource {
        [[nodiscard]] Capabilities capabilities() const noexcept override { return {}; }
        void draw(const DrawList& /*list*/, const PassContext& /*context*/) noexcept override {}
    };
    const auto context = make_context();
    if (!context) {
        return;
    }
    Silent source;
    CHECK(opengl::OpenGLBackend::create(source).has_value());
    const auto backend = opengl::OpenGLBackend::create(source, {.positions = true});
    REQUIRE_FALSE(backend.has_value());
    CHECK(backend.error().code == ErrorCode::unsupported);
}
