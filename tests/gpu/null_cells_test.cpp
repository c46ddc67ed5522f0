#include "gpu/hand_made_plan.hpp"
#include <farfield/gpu/null/null_backend.hpp>

#include <catch2/catch.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr std::array<std::uint64_t, 2> kItems = {12, 500};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinite = std::numeric_limits<float>::infinity();

/// Two selections, three splats and a cube, in that order.
FramePlan counted_plan() {
    FramePlan plan;
    plan.selected = {499, 0, 7, 11, 0};
    plan.selections = {{ItemId{1}, 0, 3}, {ItemId{0}, 3, 2}};
    plan.splats.resize(3);
    plan.splats[1] = {{1.0F, 2.0F, 3.0F}, 0.5F, {10, 20, 30, 40}};
    plan.cube_frames = {glm::mat3(1.0F)};
    plan.cubes.resize(1);
    plan.cubes[0].size = glm::vec3(1.0F);
    plan.commands.resize(3);
    plan.commands[0].selection_count = 2;
    plan.commands[1].kind = Command::Kind::splats;
    plan.commands[1].count = 3;
    plan.commands[2].kind = Command::Kind::cubes;
    plan.commands[2].count = 1;
    plan.passes = {hand_made_pass(kFrameSize)};
    plan.passes[0].command_count = 3;
    return plan;
}

/// What a null backend says to the plan after some damage, or "".
std::string refusal(const std::function<void(FramePlan&)>& damage) {
    NullBackend backend(kItems);
    const TargetId target = backend.create_target(kFrameSize, kFrameSize, 1).value();
    FramePlan plan = counted_plan();
    damage(plan);
    const auto executed = backend.execute(plan, target, {});
    return executed ? "" : executed.error().message;
}

} // namespace

TEST_CASE("Splats, cubes and single primitives are counted") {
    NullBackend backend(kItems);
    const TargetId target = backend.create_target(kFrameSize, kFrameSize, 1).value();
    REQUIRE(backend.execute(counted_plan(), target, {}).has_value());
    REQUIRE(backend.execute(counted_plan(), target, {}).has_value());
    const PlanWork& work = backend.total_work();
    CHECK(work.triangles == 2 * 5);
    CHECK(work.splats == 2 * 3);
    CHECK(work.cubes == 2 * 1);
    CHECK(work.draws == 2 * 4);
    CHECK(work.image_quads == 0);
}

TEST_CASE("Empty selections, splats and cubes of no size are nothing wrong") {
    CHECK(refusal([](FramePlan& plan) {
              plan.selections[0].count = 0;
              plan.commands[1].count = 0;
              plan.splats[0].side = 0.0F;
              plan.cubes[0].size = glm::vec3(0.0F);
          }).empty());
}

TEST_CASE("Selections are held against their items") {
    CHECK(refusal([](FramePlan& plan) {
              plan.selections[1].item = ItemId{2};
          }) == "plan: pass 0, command 0: selections[1] is of item 2 of 2");
    CHECK(
        refusal([](FramePlan& plan) { plan.selected[2] = 500; }) ==
        "plan: pass 0, command 0: selections[0] has primitive 500 of item 1, which has 500"
    );
    CHECK(refusal([](FramePlan& plan) {
              plan.selected[4] = 11;
          }) == "plan: pass 0, command 0: selections[1] has primitive 11 of item 0 twice");
    CHECK(refusal([](FramePlan& plan) {
              plan.selections[1].first = 4;
          }) == "plan: selection 1: primitives 4 to 6 of 5 selected");
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.selections[1].first = UINT32_MAX; }).empty());
    CHECK(refusal([](FramePlan& plan) {
              plan.commands[0].first_selection = 1;
          }) == "plan: pass 0, command 0: selections 1 to 3 of 2");
}

TEST_CASE("Splats and cubes that cannot be drawn are named") {
    CHECK(refusal([](FramePlan& plan) {
              plan.splats[1].center.y = kNan;
          }) == "plan: splat 1 has a centre that is not finite");
    CHECK(refusal([](FramePlan& plan) {
              plan.splats[1].side = -1.0F;
          }) == "plan: splat 1 has sides of -1.000000 m");
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.splats[1].side = kNan; }).empty());
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.splats[1].side = kInfinite; }).empty());
    CHECK(refusal([](FramePlan& plan) {
              plan.splats[1].color.r = 41;
          }) == "plan: splat 1 has the colour 41, 20, 30, 40, not premultiplied");
    CHECK(refusal([](FramePlan& plan) {
              plan.commands[1].count = 4;
          }) == "plan: pass 0, command 1: splats 0 to 4 of 3");

    CHECK(refusal([](FramePlan& plan) {
              plan.cubes[0].center.x = kInfinite;
          }) == "plan: cube 0 has a centre that is not finite");
    CHECK(refusal([](FramePlan& plan) {
              plan.cubes[0].size = glm::vec3(-0.5F);
          }) == "plan: cube 0 has edges of -0.500000, -0.500000 and -0.500000 m");
    CHECK(refusal([](FramePlan& plan) {
              plan.cubes[0].frame = 1;
          }) == "plan: cube 0 has frame 1 of 1");
    CHECK(refusal([](FramePlan& plan) {
              plan.cubes[0].faces[2] = {0, 0, 9, 8};
          }) == "plan: cube 0 has the colour 0, 0, 9, 8, not premultiplied");
    CHECK(refusal([](FramePlan& plan) {
              plan.commands[2].first = 1;
          }) == "plan: pass 0, command 2: cubes 1 to 2 of 1");
    CHECK(refusal([](FramePlan& plan) {
              plan.cube_frames[0][1].y = kNan;
          }) == "plan: cube frame 0 is not finite");
    CHECK(refusal([](FramePlan& plan) {
              plan.cube_frames[0][1].y = -1.0F; // mirrored
          }) == "plan: cube frame 0 is no rotation");
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.cube_frames[0][0].y = 0.01F; }).empty());
}

TEST_CASE("Splats and cubes have nothing that only geometry has") {
    for (const std::uint32_t command : {1U, 2U}) {
        INFO("command " << command);
        const std::string name = command == 1 ? "splats" : "cubes";
        const std::string begin =
            "plan: pass 0, command " + std::to_string(command) + ": " + name + " with ";
        CHECK(refusal([=](FramePlan& plan) {
                  plan.commands[command].selection_count = 1;
              }) == begin + "1 selections");
        CHECK(refusal([=](FramePlan& plan) {
                  plan.pieces = {{ItemId{1}, 0, 1}};
                  plan.commands[command].piece_count = 1;
              }) == begin + "1 pieces");
        CHECK(refusal([=](FramePlan& plan) {
                  plan.clips = {{glm::vec3(0.0F), glm::vec3(1.0F)}};
                  plan.commands[command].clip = 0;
              }) == begin + "clip box 0");
        CHECK(refusal([=](FramePlan& plan) {
                  plan.commands[command].depth = QuadDepth::plane;
              }) == begin + "depth 1 of images");
    }
}

TEST_CASE("Everything that is drawn is in the digest of a plan, and cleared with it") {
    const FramePlan plan = counted_plan();
    const std::uint64_t whole = digest(plan);
    const auto changes = [&](const std::function<void(FramePlan&)>& change) {
        FramePlan other = plan;
        change(other);
        return digest(other) != whole;
    };
    CHECK(changes([](FramePlan& other) { other.commands[0].first_selection = 1; }));
    CHECK(changes([](FramePlan& other) { other.commands[0].selection_count = 1; }));
    CHECK(changes([](FramePlan& other) { other.splats[2].center.z = 1.0F; }));
    CHECK(changes([](FramePlan& other) { other.splats[2].side = 1.0F; }));
    CHECK(changes([](FramePlan& other) { other.splats[2].color.a = 1; }));
    CHECK(changes([](FramePlan& other) { other.cubes[0].center.x = 1.0F; }));
    CHECK(changes([](FramePlan& other) { other.cubes[0].size = glm::vec3(2.0F); }));
    CHECK(changes([](FramePlan& other) { other.cubes[0].frame = 1; }));
    CHECK(changes([](FramePlan& other) { other.cubes[0].faces[1].a = 1; }));
    CHECK(changes([](FramePlan& other) { other.cube_frames[0][2].z = 2.0F; }));
    CHECK(changes([](FramePlan& other) { other.selections[0].item = ItemId{0}; }));
    CHECK(changes([](FramePlan& other) { other.selections[0].first = 1; }));
    CHECK(changes([](FramePlan& other) { other.selections[0].count = 1; }));
    CHECK(changes([](FramePlan& other) { other.selected[0] = 1; }));
    FramePlan emptied = plan;
    clear(emptied);
    CHECK(digest(emptied) == digest(FramePlan()));
}
