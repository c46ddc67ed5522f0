#include "gpu/layered_scene.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/gpu/plan_rules.hpp>

#include <catch2/catch.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <string>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr std::array<std::uint64_t, 1> kItems = {12};

/// What a null backend says to a plan with a layered image after some damage, or "".
std::string refusal(const std::function<void(FramePlan&)>& damage) {
    NullBackend backend(kItems);
    const TargetId target = backend.create_target(kFrameSize, kFrameSize, 1).value();
    const LayeredDepthImage image = flat_layers(5.0, {1, 2, 3, 255}, 4);
    FramePlan plan = plan_with_layers(image);
    damage(plan);
    const auto executed = backend.execute(plan, target, {});
    return executed ? "" : executed.error().message;
}

} // namespace

TEST_CASE("Layered images are counted each time they are shown") {
    NullBackend backend(kItems);
    const TargetId target = backend.create_target(kFrameSize, kFrameSize, 1).value();
    const LayeredDepthImage image = flat_layers(5.0, {1, 2, 3, 255});
    FramePlan plan = plan_with_layers(image);
    plan.layers.resize(3, plan.layers[0]);
    plan.commands[0].count = 3;
    plan.items = {ItemId{0}};
    plan.commands.push_back(items_command(0, 1));
    plan.passes[0].command_count = 2;
    REQUIRE(backend.execute(plan, target, {}).has_value());
    plan.layered_updates.clear();
    REQUIRE(backend.execute(plan, target, {}).has_value());
    const PlanWork& work = backend.total_work();
    CHECK(work.layered_images == 6);
    CHECK(work.draws == 8);
    CHECK(work.triangles == 24);
    CHECK(work.splats == 0);
    CHECK(work.cubes == 0);
}

TEST_CASE("Bytes of layered images are those of their arrays, points apart") {
    LayeredDepthImage image = flat_layers(5.0, {1, 2, 3, 255}, 4);
    constexpr std::uint64_t kBytes = 16 * 12 + 16 + 5 * 4;
    CHECK(gpu::layered_bytes(image) == kBytes);
    image.points.resize(image.samples.size());
    CHECK(gpu::layered_bytes(image) == kBytes);
    for (const bool positions : {false, true}) {
        Backend::Limits limits = NullBackend::kDefaultLimits;
        limits.positions = positions;
        NullBackend backend(kItems, nullptr, limits);
        const TargetId target = backend.create_target(kFrameSize, kFrameSize, 1).value();
        REQUIRE(backend.execute(plan_with_layers(image), target, {}).has_value());
        CHECK(backend.image_bytes() == kBytes);
        CHECK(backend.position_bytes() == (positions ? 16 * 24 : 0));
    }
}

TEST_CASE("What is wrong with layered images is named") {
    CHECK(refusal([](FramePlan&) {}).empty());
    CHECK(refusal([](FramePlan& plan) {
              plan.layers[0].image = LayeredImageId{8};
          }) == "plan: pass 0, command 0: layers[0] shows layered image 8, which does not exist");
    CHECK(refusal([](FramePlan& plan) {
              plan.layered_updates.clear();
          }) == "plan: pass 0, command 0: layers[0] shows layered image 3, which does not exist");
    CHECK(refusal([](FramePlan& plan) {
              plan.commands[0].first = 1;
          }) == "plan: pass 0, command 0: layered images 1 to 2 of 1");
    CHECK(refusal([](FramePlan& plan) {
              plan.layered_updates[0].content = nullptr;
          }) == "plan: layered update 0 creates layered image 3 of nothing");
    CHECK(refusal([](FramePlan& plan) {
              plan.layered_updates[0].image = kNone<LayeredImageId>;
          }) == "plan: layered update 0 names no image");
    CHECK(refusal([](FramePlan& plan) {
              plan.layered_updates[0].action = static_cast<LayeredUpdate::Action>(9);
          }) == "plan: layered update 0 has unknown action 9");
    LayeredDepthImage wrong = flat_layers(5.0, {1, 2, 3, 255}, 4);
    wrong.samples[6].extent = 0;
    CHECK(refusal([&](FramePlan& plan) {
              plan.layered_updates[0].content = &wrong;
          }) == "plan: layered image 3: layered depth image: sample 6 has an extent of 0");
    CHECK(refusal([](FramePlan& plan) {
              plan.commands[0].clip = 0;
          }) == "plan: pass 0, command 0: layered images with clip box 0");
}

TEST_CASE("After an error layered images count as never made") {
    NullBackend backend(kItems);
    const TargetId target = backend.create_target(kFrameSize, kFrameSize, 1).value();
    const LayeredDepthImage image = flat_layers(5.0, {1, 2, 3, 255});
    FramePlan other = plan_with_layers(image);
    other.cache = 1;
    REQUIRE(backend.execute(plan_with_layers(image), target, {}).has_value());
    REQUIRE(backend.execute(other, target, {}).has_value());
    FramePlan wrong = plan_showing_layers();
    wrong.layers[0].image = LayeredImageId{8};
    REQUIRE_FALSE(backend.execute(wrong, target, {}).has_value());
    CHECK_FALSE(backend.execute(plan_showing_layers(), target, {}).has_value());
    CHECK(backend.image_bytes() == 2 * gpu::layered_bytes(image)); // they are still there
    REQUIRE(backend.execute(plan_with_layers(image), target, {}).has_value());
    CHECK(backend.execute(plan_showing_layers(), target, {}).has_value());
    // That of another cache was never in doubt.
    other.layered_updates.clear();
    CHECK(backend.execute(other, target, {}).has_value());
}

TEST_CASE("Digests tell plans with layered images apart, not what these hold") {
    const LayeredDepthImage image = flat_layers(5.0, {1, 2, 3, 255}, 4);
    const LayeredDepthImage other = flat_layers(6.0, {1, 2, 3, 255}, 4);
    const FramePlan plan = plan_with_layers(image);
    CHECK(digest(plan) == digest(plan_with_layers(other)));
    const auto changes = [&](const std::function<void(FramePlan&)>& change) {
        FramePlan changed = plan;
        change(changed);
        return digest(changed) != digest(plan);
    };
    CHECK(changes([](FramePlan& changed) { changed.layers[0].image = LayeredImageId{8}; }));
    CHECK(changes([](FramePlan& changed) { changed.layers[0].node = 1; }));
    CHECK(changes([](FramePlan& changed) { changed.layered_updates.clear(); }));
    CHECK(changes([](FramePlan& changed) {
        changed.layered_updates[0].action = LayeredUpdate::Action::destroy;
    }));
    CHECK(changes([](FramePlan& changed) { changed.layered_updates[0].image = LayeredImageId{8}; })
    );
    FramePlan cleared = plan;
    clear(cleared);
    CHECK(cleared.layers.empty());
    CHECK(cleared.layered_updates.empty());
}
