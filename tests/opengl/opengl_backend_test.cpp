#include "gpu/backend_conformance.hpp"
#include "gpu/flat_scene.hpp"
#include "opengl/device.hpp"
#include <farfield/gpu/calibrate.hpp>

#include <catch2/catch.hpp>

using namespace farfield;
using namespace farfield::support;

namespace {

/// Draws nothing, in any context or none.
class NoGeometry final : public GeometrySource {
  public:
    [[nodiscard]] Capabilities capabilities() const noexcept override { return {}; }
    void draw(const DrawList& /*list*/, const PassContext& /*context*/) noexcept override {}
};

} // namespace

TEST_CASE("Without a context there is no OpenGL backend") {
    NoGeometry nothing;
    const auto backend = opengl::OpenGLBackend::create(nothing);
    REQUIRE_FALSE(backend.has_value());
    CHECK(backend.error().code == ErrorCode::device);
}

TEST_CASE("The OpenGL backend does what every backend does") {
    const SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    CHECK(device->source->capabilities().subset);
    CHECK(device->source->capabilities().clip_planes);
    CHECK(device->source->device_bytes() > 0);
    check_conformance(*device->backend, world);
}

TEST_CASE("The OpenGL backend can be measured") {
    const SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    const auto costs =
        gpu::calibrate(*device->backend, world.hierarchy, world.item_primitives, {.seconds = 0.3});
    REQUIRE(costs.has_value());
    CHECK(validate(*costs).has_value());
    CHECK(device->backend->image_bytes() == 0);
}

TEST_CASE("A scene without meshes can be drawn") {
    const auto device = Device::create(flat_scene());
    if (device == nullptr) {
        return;
    }
    const Picture picture = draw(*device->backend, flat_plan({}), kSize, kSize);
    CHECK(color_at(picture, 0, 0) == kBlack);
}

TEST_CASE("A texture larger than the device takes is refused by name") {
    const auto context = make_context();
    if (!context) {
        return;
    }
    Scene scene = flat_scene();
    constexpr int kTooWide = 1 << 20;
    scene.textures.push_back({kTooWide, 1, std::vector<std::uint8_t>(std::size_t{kTooWide} * 4)});
    const auto source = opengl::SceneSource::create(scene, nullptr);
    REQUIRE_FALSE(source.has_value());
    CHECK(source.error().code == ErrorCode::unsupported);
    CHECK(source.error().message.find("texture 0 is 1048576 x 1") != std::string::npos);
}

TEST_CASE("One context after the other") {
    for (int i = 0; i < 3; ++i) {
        const auto device = Device::create(flat_scene());
        if (device == nullptr) {
            return;
        }
        CHECK_FALSE(device->backend->device().empty());
    }
}
