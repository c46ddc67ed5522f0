#include "gpu/hand_made_plan.hpp"
#include "support/allocation_counter.hpp"
#include "support/small_scene.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr std::array<std::uint64_t, 3> kItems = {12, 20, 500};

/// Executes on a fresh backend with a frame to draw into; the message of the last plan, or "".
class Trial {
  public:
    explicit Trial(const Hierarchy* hierarchy = nullptr) : backend_(kItems, hierarchy) {
        target_ = backend_.create_target(kFrameSize, kFrameSize, 1).value();
    }
    std::string operator()(const FramePlan& plan) {
        const auto executed = backend_.execute(plan, target_, {});
        if (executed) {
            return "";
        }
        CHECK(executed.error().code == ErrorCode::invalid_argument);
        return executed.error().message;
    }
    [[nodiscard]] NullBackend& backend() { return backend_; }

  private:
    NullBackend backend_;
    TargetId target_{};
};

std::string refusal(const std::function<void(FramePlan&)>& damage) {
    FramePlan plan = plan_with_image();
    damage(plan);
    return Trial()(plan);
}

/// Adds a second image to `plan_with_image`, beside the first.
void add_image(FramePlan& plan, const Region& scratch, const Region& copy) {
    Pass pass = plan.passes[0];
    pass.viewport = scratch;
    pass.scissor = scratch;
    pass.view = hand_made_view(scratch.width);
    pass.copy = copy;
    plan.passes.insert(plan.passes.begin() + 1, pass);
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

} // namespace

TEST_CASE("A null backend counts the work of what it executed") {
    Trial trial;
    CHECK(trial.backend().plans_executed() == 0);
    FramePlan plan = plan_with_image();
    plan.items = {ItemId{0}, ItemId{2}};
    plan.commands[0].count = 2;
    plan.pieces = {{ItemId{1}, 3, 7}};
    plan.commands[0].piece_count = 1;
    REQUIRE(trial(plan).empty());
    REQUIRE(trial(plan_showing_image()).empty());
    const PlanWork& work = trial.backend().total_work();
    CHECK(trial.backend().plans_executed() == 2);
    CHECK(work.triangles == 12 + 500 + 7);
    CHECK(work.draws == 3 + 1 + 1);
    CHECK(work.image_quads == 2);
    CHECK(work.images == 1);
    CHECK(work.image_texels == area({0, 0, kImageSize, kImageSize}));
    plan.items[1] = ItemId{3};
    REQUIRE_FALSE(trial(plan).empty());
    CHECK(trial.backend().plans_executed() == 2);
    CHECK(work.triangles == 12 + 500 + 7);
}

TEST_CASE("Nothing is read from a null backend") {
    Trial trial;
    const auto target = trial.backend().create_target(8, 8, 1);
    REQUIRE(target.has_value());
    const auto read = trial.backend().read_target(*target);
    REQUIRE_FALSE(read.has_value());
    CHECK(read.error().code == ErrorCode::unsupported);
}

TEST_CASE("Limits are those asked for") {
    NullBackend backend(kItems, nullptr, {.page_size = 32, .samples = 2});
    CHECK(backend.limits().page_size == 32);
    CHECK(backend.limits().samples == 2);
    CHECK(backend.create_target(8, 8, 2).has_value());
    CHECK(backend.create_target(8, 8, 3).error().code == ErrorCode::unsupported);
    const auto target = backend.create_target(kFrameSize, kFrameSize, 1);
    CHECK(backend.execute(plan_with_image(), *target, {}).error().code == ErrorCode::unsupported);
}

TEST_CASE("Items must exist") {
    CHECK(refusal([](FramePlan& plan) {
              plan.items[0] = ItemId{3};
          }) == "plan: pass 0, command 0: items[0] is item 3 of 3");
    CHECK(refusal([](FramePlan& plan) {
              plan.items[0] = kNone<ItemId>;
          }) == "plan: pass 0, command 0: items[0] is item 4294967295 of 3");
}

TEST_CASE("Pieces must be runs of their item") {
    const auto with_piece = [](const Piece& piece) {
        FramePlan plan = plan_with_image();
        plan.pieces = {piece};
        plan.commands[0].piece_count = 1;
        return plan;
    };
    CHECK(Trial()(with_piece({ItemId{1}, 0, 20})).empty());
    CHECK(
        Trial()(with_piece({ItemId{1}, 4, 21})) ==
        "plan: pass 0, command 0: pieces[0], primitives 4 to 25, is no run of item 1"
    );
    CHECK_FALSE(Trial()(with_piece({ItemId{1}, 4, 0})).empty());
    CHECK_FALSE(Trial()(with_piece({ItemId{3}, 0, 1})).empty());

    // With a hierarchy it is known which primitives are whose.
    Hierarchy hierarchy;
    hierarchy.pieces = {{ItemId{1}, 0, 12}, {ItemId{1}, 12, 8}, {ItemId{2}, 20, 500}};
    const auto refused = [&](const Piece& piece) {
        return !Trial(&hierarchy)(with_piece(piece)).empty();
    };
    CHECK_FALSE(refused({ItemId{1}, 0, 20}));
    CHECK_FALSE(refused({ItemId{1}, 11, 2}));
    CHECK_FALSE(refused({ItemId{2}, 20, 500}));
    CHECK(refused({ItemId{1}, 19, 2}));
    CHECK(refused({ItemId{2}, 19, 2}));
    CHECK(refused({ItemId{2}, 519, 2}));
    CHECK(refused({ItemId{0}, 0, 1}));
}

TEST_CASE("Depths of images are a draw, and show no image once more") {
    Trial trial;
    REQUIRE(trial(plan_with_depths(QuadDepth::texel)).empty());
    const PlanWork& work = trial.backend().total_work();
    CHECK(work.triangles == 12 + 12);
    CHECK(work.draws == 1 + 1 + 1 + 1);
    CHECK(work.image_quads == 1);
}

TEST_CASE("Depths of images are refused by name") {
    const auto refusal_of = [](QuadDepth depth, const std::function<void(FramePlan&)>& damage) {
        FramePlan plan = plan_with_depths(depth);
        damage(plan);
        return Trial()(plan);
    };
    CHECK(
        refusal_of(QuadDepth::texel, [](FramePlan& plan) { plan.pages[1].depth = false; }) ==
        "plan: pass 1, command 1: quad 0 shows page 1, which keeps no depth, with that of its"
        " texels"
    );
    CHECK(refusal_of(QuadDepth::plane, [](FramePlan& plan) { plan.pages[1].depth = true; }).empty()
    );
    CHECK(refusal_of(QuadDepth::plane, [](FramePlan& plan) {
              plan.commands[2].depth = QuadDepth::none;
          }) == "plan: pass 1, command 2: depths of images with none");
    CHECK(refusal_of(QuadDepth::texel, [](FramePlan& plan) {
              plan.pages[0].depth = true;
          }) == "plan: page 0, a scratch page, that keeps depth beside its texels");
    CHECK(refusal_of(QuadDepth::texel, [](FramePlan& plan) {
              plan.passes[0].copy_near = 50.0F;
          }) == "plan: pass 0: copies depths of 50.000000 to 50.000000 m to page 1");
    const auto with_quad = [&](const std::function<void(ImageQuad&)>& damage) {
        return refusal_of(QuadDepth::texel, [&](FramePlan& plan) { damage(plan.quads[0]); });
    };
    CHECK(with_quad([](ImageQuad& quad) {
              quad.near_ratio = 11.0F;
          }) == "plan: quad 0 keeps depths of 11.000000 to 10.000000 of its distance");
    CHECK(with_quad([](ImageQuad& quad) { quad.near_ratio = 0.0F; }).empty());
    CHECK(with_quad([](ImageQuad& quad) { quad.near_ratio = 10.0F; }).empty());
    CHECK_FALSE(with_quad([](ImageQuad& quad) { quad.near_ratio = -0.1F; }).empty());
    CHECK_FALSE(with_quad([](ImageQuad& quad) { quad.near_ratio = kNan; }).empty());
    CHECK_FALSE(with_quad([](ImageQuad& quad) { quad.far_ratio = kNan; }).empty());
    CHECK_FALSE(with_quad([](ImageQuad& quad) { quad.viewpoint.y = kNan; }).empty());
    // One depth of the whole quad says nothing then.
    CHECK(with_quad([](ImageQuad& quad) { quad.depth = 0.0F; }).empty());
    CHECK(refusal_of(QuadDepth::plane, [](FramePlan& plan) { plan.quads[0].depth = 0.0F; }).empty()
    );
    // Only what was made is shown, its depths as well.
    CHECK_FALSE(with_quad([](ImageQuad& quad) { quad.source.x = 1; }).empty());
}

TEST_CASE("Numbers must be finite") {
    CHECK(refusal([](FramePlan& plan) {
              plan.quads[0].origin.x = kNan;
          }) == "plan: quad 0 has a number that is not finite");
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.quads[0].edge_u.y = kNan; }).empty());
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.quads[0].edge_v.z = kNan; }).empty());
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.quads[0].depth = kNan; }).empty());
    const auto with_clip = [](const Box3f& clip) {
        return refusal([&](FramePlan& plan) {
            plan.clips = {clip};
            plan.commands[0].clip = 0;
        });
    };
    CHECK(with_clip({glm::vec3(0.0F), glm::vec3(1.0F)}).empty());
    CHECK(
        with_clip({glm::vec3(0.0F), glm::vec3(1.0F, kNan, 1.0F)}) ==
        "plan: clip box 0 is empty or not finite"
    );
    CHECK_FALSE(with_clip({}).empty());
}

TEST_CASE("Images stand within the depths of the lens") {
    const auto at = [](float depth) {
        return refusal([=](FramePlan& plan) { plan.quads[0].depth = depth; });
    };
    CHECK(at(0.5F).empty());
    CHECK(at(50.0F).empty());
    CHECK(
        at(0.49F) ==
        "plan: pass 1, command 1: quad 0 stands at depth 0.490000, outside 0.500000 to 50.005000"
    );
    CHECK_FALSE(at(50.1F).empty());
    // Baked into an image, one beyond the far distance is merely not seen.
    Trial trial;
    REQUIRE(trial(plan_with_image()).empty());
    FramePlan baked = plan_with_image();
    baked.pages.clear();
    baked.commands[0] = images_command(0, 1);
    baked.passes[0].copy.x = kImageSize;
    baked.quads.push_back(baked.quads[0]);
    baked.quads[0].depth = 60.0F;
    baked.commands[1].first = 1;
    CHECK(trial(baked).empty());
    baked.quads[0].depth = 0.4F;
    CHECK_FALSE(trial(baked).empty());
}

TEST_CASE("Passes of a batch do not overlap") {
    FramePlan plan = plan_with_image();
    add_image(plan, {kImageSize, 0, 16, 16}, {kImageSize, 0, 16, 16});
    CHECK(Trial()(plan).empty());
    plan = plan_with_image();
    add_image(plan, {15, 15, 16, 16}, {kImageSize, 0, 16, 16});
    CHECK(Trial()(plan) == "plan: passes 0 and 1 of batch 0 both draw to 16 x 16 at 15, 15");
    plan.passes[1].batch = 1;
    plan.passes[2].batch = 2;
    CHECK(Trial()(plan).empty());
}

TEST_CASE("An image is shown only after it was made") {
    const std::string message = refusal([](FramePlan& plan) { plan.quads[0].source.x = 1; });
    CHECK(
        message == "plan: pass 1, command 1: quad 0 shows 16 x 16 at 1, 0 of page 1, where no image"
                   " was made"
    );
    // A part of it may be shown.
    CHECK(refusal([](FramePlan& plan) { plan.quads[0].source = {3, 4, 5, 6}; }).empty());
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.quads[0].source = {3, 4, 5, 13}; }).empty());
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.quads[0].source = {0, 0, 0, 0}; }).empty());
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.quads[0].source.x = INT32_MAX; }).empty());
    CHECK_FALSE(refusal([](FramePlan& plan) { plan.quads[0].source.width = INT32_MIN; }).empty());

    // Not within the batch that makes it: copies are made when that is over.
    FramePlan plan = plan_with_image();
    add_image(plan, {kImageSize, 0, 16, 16}, {kImageSize, 0, 16, 16});
    plan.passes[1].first_command = 1;
    CHECK_FALSE(Trial()(plan).empty());
    plan.passes[1].batch = 1;
    plan.passes[2].batch = 2;
    CHECK(Trial()(plan).empty());
}

TEST_CASE("An image is gone once another overwrote it") {
    Trial trial;
    REQUIRE(trial(plan_with_image()).empty());
    REQUIRE(trial(plan_showing_image()).empty());
    FramePlan over = plan_with_image();
    over.pages.clear();
    over.passes[0].copy = {15, 15, 16, 16};
    over.quads[0].source = over.passes[0].copy;
    REQUIRE(trial(over).empty());
    FramePlan rest = plan_showing_image();
    rest.quads[0].source = {0, 0, 8, 8}; // not overwritten, yet part of an image no longer whole
    CHECK_FALSE(trial(rest).empty());
}

TEST_CASE("Images are gone with their page") {
    Trial trial;
    REQUIRE(trial(plan_with_image()).empty());
    FramePlan again = plan_showing_image();
    again.pages = {{.page = kImagePage, .size = kPageSize}};
    CHECK_FALSE(trial(again).empty());
}

TEST_CASE("After an error the images of that cache are gone, those of others are not") {
    Trial trial;
    REQUIRE(trial(plan_with_image()).empty());
    FramePlan other = plan_with_image();
    other.cache = 1;
    REQUIRE(trial(other).empty());
    FramePlan wrong = plan_showing_image();
    wrong.quads[0].depth = -1.0F;
    REQUIRE_FALSE(trial(wrong).empty());
    CHECK_FALSE(trial(plan_showing_image()).empty());
    other = plan_showing_image();
    other.cache = 1;
    CHECK(trial(other).empty());
}

TEST_CASE("A technique that forgets to start over is found out") {
    const SmallWorld world = make_world(small_scene());
    NullBackend backend(world.item_primitives, &world.hierarchy);
    const auto target = backend.create_target(160, 120, 1);
    ImageCacheOptions options = presets::shade1996();
    options.costs.triangle_s = 1e-6;
    auto cache = ImageCache::create(world.hierarchy, options);
    REQUIRE(cache.has_value());
    const View view = small_walk(0, 160, 120);
    REQUIRE(backend.execute(cache->plan(view, {}), *target, {}).has_value());
    REQUIRE(cache->statistics().images_created > 0);
    FramePlan wrong = plan_with_item();
    wrong.passes.clear();
    REQUIRE_FALSE(backend.execute(wrong, *target, {}).has_value());
    CHECK_FALSE(backend.execute(cache->plan(view, {}), *target, {}).has_value());
    cache->forget_images();
    CHECK(backend.execute(cache->plan(view, {}), *target, {}).has_value());
}

TEST_CASE("A warm null backend allocates nothing") {
    const SmallWorld world = make_world(small_scene());
    NullBackend backend(world.item_primitives, &world.hierarchy);
    const auto target = backend.create_target(160, 120, 1);
    ImageCacheOptions options = presets::shade1996();
    options.costs.triangle_s = 1e-6;
    auto cache = ImageCache::create(world.hierarchy, options);
    REQUIRE(cache.has_value());
    std::uint64_t while_executing = 0;
    std::uint32_t created = 0;
    constexpr int kFrames = 120;
    for (int round = 0; round < 3; ++round) {
        while_executing = 0;
        created = 0;
        for (int frame = 0; frame < kFrames; ++frame) {
            const FramePlan& plan = cache->plan(small_walk(frame, 160, 120), small_walk_motion());
            created += cache->statistics().images_created;
            const std::uint64_t before = allocation_count();
            const auto executed = backend.execute(plan, *target, {});
            while_executing += allocation_count() - before;
            REQUIRE(executed.has_value());
        }
    }
    CHECK(created > 0);
    CHECK(while_executing == 0);
}
