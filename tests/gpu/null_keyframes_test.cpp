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

/// What a null backend says to the plan after some damage, or "".
std::string refusal(const std::function<void(FramePlan&)>& damage) {
    NullBackend backend(kItems);
    const TargetId target = backend.create_target(kFrameSize, kFrameSize, 1).value();
    FramePlan plan = plan_with_keyframe();
    damage(plan);
    const auto executed = backend.execute(plan, target, {});
    return executed ? "" : executed.error().message;
}

} // namespace

TEST_CASE("Projected geometry is counted as geometry") {
    NullBackend backend(kItems);
    const TargetId target = backend.create_target(kFrameSize, kFrameSize, 1).value();
    FramePlan plan = plan_with_keyframe();
    plan.items = {ItemId{0}, ItemId{1}};
    plan.commands[1].count = 2;
    plan.selected = {3, 4, 5};
    plan.selections = {{ItemId{1}, 0, 3}};
    plan.commands[1].selection_count = 1;
    plan.pieces = {{ItemId{1}, 0, 7}};
    plan.commands[1].piece_count = 1;
    plan.clips = {{glm::vec3(-1.0F), glm::vec3(1.0F)}};
    plan.commands[1].clip = 0;
    plan.commands[1].whole_triangles = true;
    REQUIRE(backend.execute(plan, target, {}).has_value());
    const PlanWork& work = backend.total_work();
    CHECK(work.triangles == 12 + (12 + 500 + 7 + 3));
    CHECK(work.draws == 1 + (2 + 1 + 1));
    CHECK(work.images == 1);
    CHECK(work.image_quads == 0);
}

TEST_CASE("Keyframes that are nothing wrong") {
    CHECK(refusal([](FramePlan&) {}).empty());
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes[0].max_shift_px = kInfinite;
              plan.keyframes[0].offset_m = 0.0F;
          }).empty());
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes.resize(kMostKeyframes, plan.keyframes[0]);
              plan.commands[1].keyframe_count = kMostKeyframes;
          }).empty());
    // One that no command names still must be one.
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.keyframes.emplace_back(); }).empty());
}

TEST_CASE("Projected geometry names 1 to 4 keyframes, and nothing else names any") {
    const std::string begin = "plan: pass 1, command 1: ";
    CHECK(refusal([](FramePlan& plan) {
              plan.commands[1].keyframe_count = 0;
          }) == begin + "projected geometry with 0 keyframes, expected 1 to 4");
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes.resize(5, plan.keyframes[0]);
              plan.commands[1].keyframe_count = 5;
          }) == begin + "projected geometry with 5 keyframes, expected 1 to 4");
    CHECK(refusal([](FramePlan& plan) {
              plan.commands[1].keyframe_count = 2;
          }) == begin + "keyframes 0 to 2 of 1");
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.commands[1].first_keyframe = UINT32_MAX; }
    ).empty());
    CHECK(refusal([](FramePlan& plan) {
              plan.commands[1].depth = QuadDepth::plane;
          }) == begin + "projected geometry with depth 1 of images");
    for (const Command::Kind kind :
         {Command::Kind::geometry,
          Command::Kind::mask,
          Command::Kind::images,
          Command::Kind::splats,
          Command::Kind::cubes}) {
        INFO("kind " << static_cast<unsigned>(kind));
        const std::string counted = refusal([=](FramePlan& plan) {
            plan.commands[1].kind = kind;
            plan.commands[1].count = 0;
        });
        CHECK(counted.find(" with 1 keyframes") != std::string::npos);
        const std::string whole = refusal([=](FramePlan& plan) {
            plan.commands[1].kind = kind;
            plan.commands[1].count = 0;
            plan.commands[1].keyframe_count = 0;
            plan.commands[1].whole_triangles = true;
        });
        CHECK(whole.find(" on whole triangles") != std::string::npos);
    }
}

TEST_CASE("Keyframes that cannot be projected are named") {
    const auto begins = [](const std::string& text, const std::string& with) {
        INFO(text);
        CHECK(text.rfind(with, 0) == 0);
    };
    begins(
        refusal([](FramePlan& plan) { plan.keyframes[0].view.lens.near_distance = 0.0; }),
        "plan: keyframe 0: "
    );
    begins(
        refusal([](FramePlan& plan) { plan.keyframes[0].view.eye.x = double{kNan}; }),
        "plan: keyframe 0: "
    );
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes[0].source.width = 8;
          }) == "plan: keyframe 0: shows 8 x 16 at 0, 0 for a view of 16 x 16");
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes[0].source.x = -1;
          }) == "plan: keyframe 0: shows 16 x 16 at -1, 0 for a view of 16 x 16");
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes[0].copy_near = 50.0F;
          }) == "plan: keyframe 0: keeps depths of 50.000000 to 50.000000 m");
    for (const float wrong : {-1.0F, kNan}) {
        INFO(wrong);
        begins(
            refusal([=](FramePlan& plan) { plan.keyframes[0].copy_near = wrong; }),
            "plan: keyframe 0: keeps depths of "
        );
        begins(
            refusal([=](FramePlan& plan) { plan.keyframes[0].offset_m = wrong; }),
            "plan: keyframe 0: is off by "
        );
        begins(
            refusal([=](FramePlan& plan) { plan.keyframes[0].max_shift_px = wrong; }),
            "plan: keyframe 0: may be shifted by "
        );
    }
    begins(
        refusal([](FramePlan& plan) { plan.keyframes[0].copy_far = kInfinite; }),
        "plan: keyframe 0: keeps depths of "
    );
    begins(
        refusal([](FramePlan& plan) { plan.keyframes[0].offset_m = kInfinite; }),
        "plan: keyframe 0: is off by "
    );
}

TEST_CASE("Keyframes show what was made of a page with depth") {
    const std::string begin = "plan: pass 1, command 1: keyframe 0 shows ";
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes[0].page = PageId{9};
          }) == begin + "page 9, which does not exist");
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes[0].page = kScratchPage;
          }) == begin + "page 0, a scratch page");
    CHECK(refusal([](FramePlan& plan) {
              plan.pages[1].depth = false;
          }) == begin + "page 1, which keeps no depth");
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes[0].source.y = kPageSize - 15;
          }) == begin + "page 1, 16 x 16 at 0, 49 of 64 texels a side");
    CHECK(refusal([](FramePlan& plan) {
              plan.keyframes[0].source.x = 4;
          }) == begin + "16 x 16 at 4, 0 of page 1, of which only 192 texels were made");
}

TEST_CASE("A keyframe may be made of tiles, and lacks none") {
    const auto in_tiles = [](FramePlan& plan) {
        const std::int32_t half = kImageSize / 2;
        Pass tile = plan.passes[0];
        tile.scissor = {0, 0, half, kImageSize};
        tile.copy = tile.scissor;
        Pass other = plan.passes[0];
        other.scissor = {half, 0, half, kImageSize};
        other.copy = other.scissor;
        plan.passes = {tile, other, plan.passes[1]};
    };
    CHECK(refusal(in_tiles).empty());
    CHECK(
        refusal([&](FramePlan& plan) {
            in_tiles(plan);
            plan.passes.erase(plan.passes.begin() + 1);
        }) == "plan: pass 1, command 1: keyframe 0 shows 16 x 16 at 0, 0 of page 1, of which "
              "only 128 texels were made"
    );
}

TEST_CASE("A keyframe is finished before the batch that projects it") {
    // An image is projected onto geometry in the second batch, into another page.
    const auto nested = [](FramePlan& plan) {
        plan.pages.push_back({.page = PageId{2}, .size = kPageSize, .depth = true});
        Pass image = plan.passes[0];
        image.first_command = 1;
        image.batch = 1;
        image.copy_page = PageId{2};
        plan.passes[1].batch = 2;
        plan.passes.insert(plan.passes.begin() + 1, image);
    };
    CHECK(refusal(nested).empty());
    CHECK(
        refusal([&](FramePlan& plan) {
            nested(plan);
            plan.passes[1].copy_page = kImagePage;
        }) == "plan: pass 1, command 1: projects page 1, which pass 1 of the same batch copies to"
    );
    CHECK(
        refusal([&](FramePlan& plan) {
            // Another pass of the batch does, and comes first.
            nested(plan);
            Pass other = plan.passes[0];
            other.batch = 1;
            other.copy.x = 32;
            plan.passes[1].viewport.x = kImageSize;
            plan.passes[1].scissor.x = kImageSize;
            plan.passes.insert(plan.passes.begin() + 1, other);
        }) == "plan: pass 2, command 1: projects page 1, which pass 1 of the same batch copies to"
    );
}

TEST_CASE("Keyframes are in the digest of a plan, and cleared with it") {
    const FramePlan plan = plan_with_keyframe();
    const std::uint64_t whole = digest(plan);
    const auto changes = [&](const std::function<void(FramePlan&)>& change) {
        FramePlan other = plan;
        change(other);
        return digest(other) != whole;
    };
    CHECK_FALSE(changes([](FramePlan&) {}));
    CHECK(changes([](FramePlan& other) { other.commands[1].first_keyframe = 1; }));
    CHECK(changes([](FramePlan& other) { other.commands[1].keyframe_count = 2; }));
    CHECK(changes([](FramePlan& other) { other.commands[1].whole_triangles = true; }));
    CHECK(changes([](FramePlan& other) { other.keyframes[0].page = PageId{3}; }));
    CHECK(changes([](FramePlan& other) { other.keyframes[0].source.y = 1; }));
    CHECK(changes([](FramePlan& other) { other.keyframes[0].view.eye.z = 4.0; }));
    CHECK(changes([](FramePlan& other) { other.keyframes[0].copy_near = 0.25F; }));
    CHECK(changes([](FramePlan& other) { other.keyframes[0].copy_far = 60.0F; }));
    CHECK(changes([](FramePlan& other) { other.keyframes[0].offset_m = 0.25F; }));
    CHECK(changes([](FramePlan& other) { other.keyframes[0].max_shift_px = 0.25F; }));
    CHECK(changes([](FramePlan& other) { other.keyframes[0].node = 7; }));
    FramePlan emptied = plan;
    clear(emptied);
    CHECK(digest(emptied) == digest(FramePlan()));
}
