#pragma once

#include "gpu/hand_made_plan.hpp"
#include "gpu/layered_scene.hpp"
#include "support/small_scene.hpp"
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/plan_rules.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

/// What holds of every backend; each has a program that calls `check_conformance`.
namespace farfield::support {

inline void require_executed(Backend& backend, const FramePlan& plan, TargetId target) {
    const Result<void> executed = backend.execute(plan, target, {});
    if (!executed) {
        FAIL(executed.error().message);
    }
}

/// The plan is refused as invalid, and the backend goes on working.
inline void check_refused(
    Backend& backend,
    TargetId target,
    const std::string& what,
    const FramePlan& plan,
    ErrorCode code = ErrorCode::invalid_argument
) {
    INFO(what);
    const Result<void> executed = backend.execute(plan, target, {});
    REQUIRE_FALSE(executed.has_value());
    CHECK(executed.error().code == code);
    CHECK(executed.error().message.find("plan: ") == 0);
    require_executed(backend, plan_with_image(), target);
}

/// A copy of `plan_with_image` with one damage.
inline FramePlan damaged(const std::function<void(FramePlan&)>& damage) {
    FramePlan plan = plan_with_image();
    damage(plan);
    return plan;
}

/// Walks with a cache and with plain geometry in turn; pages are as many bytes as the cache says.
/// @return images made
inline std::uint32_t walk_with_cache(
    Backend& backend, const SmallWorld& world, const ImageCacheOptions& options, int frames
) {
    constexpr int kWidth = 160;
    constexpr int kHeight = 120;
    const auto target = backend.create_target(kWidth, kHeight, 1);
    REQUIRE(target.has_value());
    auto cache = ImageCache::create(world.hierarchy, options);
    REQUIRE(cache.has_value());
    CulledGeometry geometry(world.hierarchy);
    std::uint32_t created = 0;
    for (int frame = 0; frame < frames; ++frame) {
        INFO("frame " << frame);
        View view = small_walk(frame, kWidth, kHeight);
        if (frame == frames / 2) {
            cache->forget_images();
        } else if (frame == frames / 2 + 3) {
            // Another lens: every image is stale.
            view.lens = sub_lens(view, 10.0, 10.0, 150.0, 115.0);
        } else if (frame == frames / 2 + 6) {
            view = small_walk(frame + 100, kWidth, kHeight); // among the trees
        }
        require_executed(backend, cache->plan(view, small_walk_motion()), *target);
        created += cache->statistics().images_created;
        REQUIRE(backend.image_bytes() == cache->statistics().image_bytes);
        require_executed(backend, geometry.plan(view), *target);
    }
    cache->forget_images();
    const FramePlan& last = cache->plan(small_walk(0, kWidth, kHeight), {});
    require_executed(backend, last, *target);
    CHECK(backend.image_bytes() == cache->statistics().image_bytes);
    backend.destroy_target(*target);
    return created;
}

/// Costs under which images pay quickly, so that short walks make many.
inline ImageCacheOptions eager_options() {
    ImageCacheOptions options = presets::shade1996();
    options.page_size = 512;
    options.costs.triangle_s = 1e-6;
    return options;
}

inline void check_targets(Backend& backend) {
    const std::int32_t most = backend.limits().samples;
    for (const auto& [width, height] : {std::pair{0, 8}, {8, 0}, {-1, 8}, {16385, 8}, {8, 16385}}) {
        INFO(width << " x " << height);
        const auto target = backend.create_target(width, height, 1);
        REQUIRE_FALSE(target.has_value());
        CHECK(target.error().code == ErrorCode::invalid_argument);
    }
    const auto none = backend.create_target(8, 8, 0);
    REQUIRE_FALSE(none.has_value());
    CHECK(none.error().code == ErrorCode::invalid_argument);
    const auto many = backend.create_target(8, 8, most + 1);
    REQUIRE_FALSE(many.has_value());
    CHECK(many.error().code == ErrorCode::unsupported);

    const auto first = backend.create_target(kFrameSize, kFrameSize, 1);
    const auto second = backend.create_target(kFrameSize, kFrameSize, most);
    REQUIRE(first.has_value());
    REQUIRE(second.has_value());
    CHECK(*first != *second);
    CHECK(*first != TargetId{});
    require_executed(backend, plan_with_item(), *first);
    require_executed(backend, plan_with_item(), *second);
    backend.destroy_target(*first);
    backend.destroy_target(*first); // once more does nothing
    backend.destroy_target(TargetId{});
    backend.destroy_target(TargetId{1000});
    for (const TargetId unknown : {*first, TargetId{}, TargetId{1000}}) {
        const auto executed = backend.execute(plan_with_item(), unknown, {});
        REQUIRE_FALSE(executed.has_value());
        CHECK(executed.error().code == ErrorCode::invalid_argument);
        const auto read = backend.read_target(unknown);
        REQUIRE_FALSE(read.has_value());
        CHECK(read.error().code == ErrorCode::invalid_argument);
    }
    require_executed(backend, plan_with_item(), *second);
    backend.finish();
}

inline void check_pages(Backend& backend) {
    const auto target = backend.create_target(kFrameSize, kFrameSize, 1);
    REQUIRE(target.has_value());
    constexpr std::uint64_t kTexels = area({0, 0, kPageSize, kPageSize});
    CHECK(backend.image_bytes() == 0);
    require_executed(backend, plan_with_image(), *target);
    CHECK(backend.image_bytes() == kTexels * (8 + 4));
    // Replaced, not added; scratch counts its samples.
    FramePlan plan = plan_with_image();
    const std::int32_t samples = backend.limits().samples;
    plan.pages[0].samples = samples;
    require_executed(backend, plan, *target);
    CHECK(backend.image_bytes() == kTexels * (8 * static_cast<std::uint64_t>(samples) + 4));
    require_executed(backend, plan_showing_image(), *target);
    // Pages belong to a cache: another one has none, and its page of the same name is another.
    FramePlan other = plan_showing_image();
    other.cache = 7;
    const auto shown = backend.execute(other, *target, {});
    REQUIRE_FALSE(shown.has_value());
    CHECK(shown.error().code == ErrorCode::invalid_argument);
    other = plan_with_image();
    other.cache = 7;
    const std::uint64_t before = backend.image_bytes();
    require_executed(backend, other, *target);
    CHECK(backend.image_bytes() == before + kTexels * (8 + 4));

    // Dropping one, or one that is not there, leaves the others.
    FramePlan drop = plan_with_item();
    drop.pages = {
        {.action = PageUpdate::Action::destroy, .page = kImagePage},
        {.action = PageUpdate::Action::destroy, .page = PageId{99}}};
    require_executed(backend, drop, *target);
    CHECK(backend.image_bytes() == before + kTexels * 8);
    other = plan_showing_image();
    other.cache = 7;
    require_executed(backend, other, *target);
    check_refused(backend, *target, "a dropped page", [&] {
        require_executed(backend, drop, *target);
        return plan_showing_image();
    }());
    drop.pages.push_back({.action = PageUpdate::Action::destroy, .page = kScratchPage});
    require_executed(backend, drop, *target);
    drop.cache = 7;
    require_executed(backend, drop, *target);
    CHECK(backend.image_bytes() == 0);
}

inline void check_wrong_plans(Backend& backend) {
    const auto made = backend.create_target(kFrameSize, kFrameSize, 1);
    REQUIRE(made.has_value());
    const TargetId target = *made;
    const Backend::Limits limits = backend.limits();
    const auto refused = [&](const char* what,
                             const std::function<void(FramePlan&)>& damage,
                             ErrorCode code = ErrorCode::invalid_argument) {
        check_refused(backend, target, what, damaged(damage), code);
    };
    refused("no passes", [](FramePlan& plan) { plan.passes.clear(); });
    refused("no frame", [](FramePlan& plan) { plan.passes.pop_back(); });
    refused("two frames", [](FramePlan& plan) { plan.passes[0].page = kNone<PageId>; });
    refused("frame in the batch of an image", [](FramePlan& plan) { plan.passes[1].batch = 0; });
    refused("batches descend", [](FramePlan& plan) { plan.passes[0].batch = 2; });
    refused("two pages in a batch", [](FramePlan& plan) {
        plan.pages.push_back({.page = PageId{2}, .size = kPageSize, .scratch = true});
        plan.passes.insert(plan.passes.begin(), plan.passes[0]);
        plan.passes[0].page = PageId{2};
        plan.passes[0].scissor.width = 4;
        plan.passes[0].copy.width = 4;
    });
    refused("the frame copied", [](FramePlan& plan) {
        plan.passes[1].copy_page = kImagePage;
        plan.passes[1].copy = {0, 0, kFrameSize, kFrameSize};
    });
    refused("a page that does not exist is drawn to", [](FramePlan& plan) {
        plan.passes[0].page = PageId{5};
    });
    refused("a page that is no scratch page is drawn to", [](FramePlan& plan) {
        plan.pages[0].scratch = false;
    });
    refused("a copy to a page that does not exist", [](FramePlan& plan) {
        plan.passes[0].copy_page = PageId{5};
    });
    refused("a copy to a scratch page", [](FramePlan& plan) { plan.pages[1].scratch = true; });
    refused("a copy onto itself", [](FramePlan& plan) { plan.passes[0].copy_page = kScratchPage; });
    refused("a copy of another size", [](FramePlan& plan) { --plan.passes[0].copy.width; });
    refused("a copy beyond the page", [](FramePlan& plan) {
        plan.passes[0].copy.x = kPageSize - kImageSize + 1;
    });
    refused("a viewport beyond the scratch page", [](FramePlan& plan) {
        plan.passes[0].viewport.y = kPageSize - kImageSize + 1;
        plan.passes[0].scissor.y = plan.passes[0].viewport.y;
    });
    refused("a viewport beyond the target", [](FramePlan& plan) {
        plan.passes[1].viewport.x = 1;
        plan.passes[1].scissor.x = 1;
    });
    refused("a viewport of another size than the view", [](FramePlan& plan) {
        --plan.passes[1].viewport.height;
        --plan.passes[1].scissor.height;
    });
    refused("a scissor beyond the viewport", [](FramePlan& plan) {
        plan.passes[0].scissor.width += 1;
        plan.passes[0].copy.width += 1;
    });
    refused("an empty scissor", [](FramePlan& plan) { plan.passes[1].scissor.width = 0; });
    refused("a huge scissor", [](FramePlan& plan) { plan.passes[1].scissor.x = INT32_MAX; });
    refused("a view without a lens", [](FramePlan& plan) {
        plan.passes[0].view.lens.near_distance = 0.0;
    });
    refused("an origin that is not finite", [](FramePlan& plan) {
        plan.origin.y = std::numeric_limits<double>::quiet_NaN();
    });
    refused("commands out of range", [](FramePlan& plan) { plan.passes[1].command_count = 2; });
    refused("commands far out of range", [](FramePlan& plan) {
        plan.passes[1].first_command = UINT32_MAX;
    });
    refused("items out of range", [](FramePlan& plan) { plan.commands[0].count = 2; });
    refused("items far out of range", [](FramePlan& plan) { plan.commands[0].first = UINT32_MAX; });
    refused("pieces out of range", [](FramePlan& plan) { plan.commands[0].piece_count = 1; });
    refused("a clip box out of range", [](FramePlan& plan) { plan.commands[0].clip = 0; });
    refused("quads out of range", [](FramePlan& plan) { plan.commands[1].count = 2; });
    refused("images with pieces", [](FramePlan& plan) {
        plan.pieces = {{ItemId{0}, 0, 1}};
        plan.commands[1].piece_count = 1;
    });
    refused("clipped images", [](FramePlan& plan) {
        plan.clips = {{glm::vec3(-1.0F), glm::vec3(1.0F)}};
        plan.commands[1].clip = 0;
    });
    refused("an unknown kind of command", [](FramePlan& plan) {
        plan.commands[0].kind = static_cast<Command::Kind>(77);
    });
    refused("an image of a page that does not exist", [](FramePlan& plan) {
        plan.quads[0].page = PageId{5};
    });
    refused("an image of no page", [](FramePlan& plan) { plan.quads[0].page = kNone<PageId>; });
    refused("an image of a scratch page", [](FramePlan& plan) {
        plan.quads[0].page = kScratchPage;
    });
    refused("an image of the page being written", [](FramePlan& plan) {
        plan.quads[0].page = kScratchPage;
        plan.passes[0].command_count = 2;
    });
    refused("images with an unknown depth", [](FramePlan& plan) {
        plan.commands[1].depth = static_cast<QuadDepth>(3);
    });
    refused("depths of images with none", [](FramePlan& plan) {
        plan.commands[1].kind = Command::Kind::image_depths;
    });
    refused("depths of images out of range", [](FramePlan& plan) {
        plan.commands[1].kind = Command::Kind::image_depths;
        plan.commands[1].depth = QuadDepth::plane;
        plan.commands[1].count = 2;
    });
    refused("geometry with depths of images", [](FramePlan& plan) {
        plan.commands[0].depth = QuadDepth::plane;
    });
    refused("a mask with depths of images", [](FramePlan& plan) {
        plan.commands[0].kind = Command::Kind::mask;
        plan.commands[0].depth = QuadDepth::texel;
    });
    refused("splats out of range", [](FramePlan& plan) {
        plan.commands[1].kind = Command::Kind::splats;
    });
    refused("cubes out of range", [](FramePlan& plan) {
        plan.commands[1].kind = Command::Kind::cubes;
    });
    refused("selections out of range", [](FramePlan& plan) {
        plan.commands[0].first_selection = UINT32_MAX;
        plan.commands[0].selection_count = 1;
    });
    refused("selected primitives out of range", [](FramePlan& plan) {
        plan.selections = {{ItemId{0}, UINT32_MAX, 1}};
        plan.commands[0].selection_count = 1;
    });
    refused("images with selections", [](FramePlan& plan) {
        plan.selections = {{ItemId{0}, 0, 0}};
        plan.commands[1].selection_count = 1;
    });
    refused("a splat of no size", [](FramePlan& plan) {
        plan.splats.resize(1);
        plan.splats[0].side = std::numeric_limits<float>::quiet_NaN();
    });
    refused("a cube without a frame", [](FramePlan& plan) { plan.cubes.resize(1); });
    refused("a page without texels", [](FramePlan& plan) { plan.pages[1].size = 0; });
    refused("a page with fewer than none", [](FramePlan& plan) { plan.pages[1].size = -4; });
    refused("a page without an id", [](FramePlan& plan) { plan.pages[1].page = kNone<PageId>; });
    refused("a page without samples", [](FramePlan& plan) { plan.pages[0].samples = 0; });
    refused("a page of images with samples", [](FramePlan& plan) { plan.pages[1].samples = 2; });
    refused(
        "a page larger than the device takes",
        [&](FramePlan& plan) { plan.pages[1].size = limits.page_size + 1; },
        ErrorCode::unsupported
    );
    refused(
        "more samples than the device takes",
        [&](FramePlan& plan) { plan.pages[0].samples = limits.samples + 1; },
        ErrorCode::unsupported
    );
}

/// Pages that keep depth, and what is drawn with it.
inline void check_depths(Backend& backend) {
    const auto made = backend.create_target(kFrameSize, kFrameSize, 1);
    REQUIRE(made.has_value());
    const TargetId target = *made;
    constexpr std::uint64_t kTexels = area({0, 0, kPageSize, kPageSize});
    const auto refused = [&](const char* what, const std::function<void(FramePlan&)>& damage) {
        check_refused(backend, target, what, damaged(damage));
    };
    // 16 bits beside each texel.
    FramePlan kept = plan_with_image();
    const std::int32_t samples = backend.limits().samples;
    kept.pages[0].samples = samples;
    kept.pages[1].depth = true;
    kept.passes[0].copy_far = 1.0F;
    require_executed(backend, kept, target);
    CHECK(backend.image_bytes() == kTexels * (8 * static_cast<std::uint64_t>(samples) + 6));
    require_executed(backend, plan_with_image(), target);
    CHECK(backend.image_bytes() == kTexels * (8 + 4));
    require_executed(backend, plan_showing_image(), target);

    for (const Command::Kind kind : {Command::Kind::images, Command::Kind::image_depths}) {
        refused("depths of texels of a page that keeps none", [&](FramePlan& plan) {
            plan.commands[1].kind = kind;
            plan.commands[1].depth = QuadDepth::texel;
        });
        refused("depths of planes of a scratch page", [&](FramePlan& plan) {
            plan.commands[1].kind = kind;
            plan.commands[1].depth = QuadDepth::plane;
            plan.quads[0].page = kScratchPage;
        });
    }
    refused("a scratch page that keeps depth", [](FramePlan& plan) { plan.pages[0].depth = true; });
    constexpr float kInfinite = std::numeric_limits<float>::infinity();
    constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();
    for (const auto& [nearest, farthest] :
         {std::pair{0.0F, 0.0F},
          {2.0F, 1.0F},
          {-1.0F, 1.0F},
          {0.0F, kInfinite},
          {kNoNumber, 1.0F},
          {0.0F, kNoNumber}}) {
        INFO(nearest << " to " << farthest << " m");
        const auto range = [from = nearest, to = farthest](FramePlan& plan) {
            plan.passes[0].copy_near = from;
            plan.passes[0].copy_far = to;
        };
        refused("depths copied that are none", [&](FramePlan& plan) {
            plan.pages[1].depth = true;
            range(plan);
        });
        require_executed(backend, damaged(range), target); // none are kept
    }

    for (const QuadDepth depth : {QuadDepth::plane, QuadDepth::texel}) {
        require_executed(backend, plan_with_depths(depth), target);
    }
    check_refused(backend, target, "a page that was made anew, without depth", [&] {
        require_executed(backend, plan_with_image(), target);
        FramePlan plan = plan_with_depths(QuadDepth::texel);
        plan.pages.clear();
        return plan;
    }());
}

/// Keyframes that are projected, by every backend alike.
inline void check_keyframes(Backend& backend) {
    const std::int32_t samples = std::min(4, backend.limits().samples);
    const auto made = backend.create_target(kFrameSize, kFrameSize, 1);
    const auto several = backend.create_target(kFrameSize, kFrameSize, samples);
    REQUIRE(made.has_value());
    REQUIRE(several.has_value());
    for (const bool whole_triangles : {false, true}) {
        for (std::uint32_t count = 1; count <= kMostKeyframes; ++count) {
            FramePlan plan = plan_with_keyframe();
            plan.pages[0].samples = samples;
            plan.keyframes.resize(count, plan.keyframes[0]);
            plan.commands[1].keyframe_count = count;
            plan.commands[1].whole_triangles = whole_triangles;
            require_executed(backend, plan, *made);
            require_executed(backend, plan, *several);
        }
    }
    const auto refused = [&](const char* what, const std::function<void(FramePlan&)>& damage) {
        FramePlan plan = plan_with_keyframe();
        damage(plan);
        check_refused(backend, *made, what, plan);
    };
    refused("no keyframes", [](FramePlan& plan) { plan.commands[1].keyframe_count = 0; });
    refused("more keyframes than there may be", [](FramePlan& plan) {
        plan.keyframes.resize(kMostKeyframes + 1, plan.keyframes[0]);
        plan.commands[1].keyframe_count = kMostKeyframes + 1;
    });
    refused("keyframes out of range", [](FramePlan& plan) {
        plan.commands[1].first_keyframe = UINT32_MAX;
    });
    refused("geometry with keyframes", [](FramePlan& plan) {
        plan.commands[1].kind = Command::Kind::geometry;
    });
    refused("a page that does not exist", [](FramePlan& plan) {
        plan.keyframes[0].page = PageId{9};
    });
    refused("a scratch page", [](FramePlan& plan) { plan.keyframes[0].page = kScratchPage; });
    refused("a page that keeps no depth", [](FramePlan& plan) { plan.pages[1].depth = false; });
    refused("a source beyond its page", [](FramePlan& plan) {
        plan.keyframes[0].source.x = kPageSize - 1;
    });
    refused("a page of the same batch", [](FramePlan& plan) { plan.passes[0].first_command = 1; });
    refused("a view without a lens", [](FramePlan& plan) {
        plan.keyframes[0].view.lens.near_distance = 0.0;
    });
}

/// Layered depth images come and go, each cache has its own.
inline void check_layered_images(Backend& backend) {
    const std::int32_t samples = std::min(4, backend.limits().samples);
    const auto made = backend.create_target(kFrameSize, kFrameSize, 1);
    const auto several = backend.create_target(kFrameSize, kFrameSize, samples);
    REQUIRE(made.has_value());
    REQUIRE(several.has_value());
    const TargetId target = *made;
    const LayeredDepthImage image = flat_layers(5.0, {200, 100, 0, 255});
    const LayeredDepthImage smaller = flat_layers(6.0, {0, 100, 0, 255}, kFrameSize / 2);
    const LayeredDepthImage nothing = make_layers(empty_layers(), {});
    CHECK(backend.image_bytes() == 0);
    for (const LayeredDepthImage* content : {&image, &smaller, &nothing, &image}) {
        // Replaced, not added.
        require_executed(backend, plan_with_layers(*content), target);
        CHECK(backend.image_bytes() == gpu::layered_bytes(*content));
        require_executed(backend, plan_showing_layers(), target);
        require_executed(backend, plan_showing_layers(), *several);
    }
    // They belong to a cache.
    FramePlan other = plan_showing_layers();
    other.cache = 7;
    const auto shown = backend.execute(other, target, {});
    REQUIRE_FALSE(shown.has_value());
    CHECK(shown.error().code == ErrorCode::invalid_argument);
    other = plan_with_layers(smaller);
    other.cache = 7;
    require_executed(backend, other, target);
    CHECK(backend.image_bytes() == gpu::layered_bytes(image) + gpu::layered_bytes(smaller));

    // One that is not there may be dropped, and one made and dropped by the same plan.
    FramePlan drop = plan_with_item();
    drop.layered_updates = {
        {.action = LayeredUpdate::Action::destroy, .image = kLayeredImage},
        {.action = LayeredUpdate::Action::destroy, .image = LayeredImageId{99}},
        {.image = LayeredImageId{4}, .content = &image},
        {.action = LayeredUpdate::Action::destroy, .image = LayeredImageId{4}}};
    require_executed(backend, drop, target);
    CHECK(backend.image_bytes() == gpu::layered_bytes(smaller));
    drop.cache = 7;
    require_executed(backend, drop, target);
    CHECK(backend.image_bytes() == 0);
    check_refused(backend, target, "an image that was dropped", plan_showing_layers());

    // Twice in one command, among geometry, and in an image with depth.
    FramePlan plan = plan_with_depths(QuadDepth::texel);
    plan.pages[0].samples = samples;
    plan.layered_updates = plan_with_layers(image).layered_updates;
    plan.layers = {plan_showing_layers().layers[0], plan_showing_layers().layers[0]};
    plan.commands[0].kind = Command::Kind::layers;
    plan.commands[0].count = 2;
    for (int i = 0; i < 2; ++i) {
        plan.commands.push_back(items_command(0, 1));
        plan.commands.push_back(plan.commands[0]);
    }
    plan.passes[1].command_count += 4;
    require_executed(backend, plan, target);
    require_executed(backend, plan, *several);
}

/// Plans with layered depth images that are wrong.
inline void check_wrong_layers(Backend& backend) {
    const auto made = backend.create_target(kFrameSize, kFrameSize, 1);
    REQUIRE(made.has_value());
    const LayeredDepthImage image = flat_layers(5.0, {200, 100, 0, 255});
    const auto refused = [&](const char* what, const std::function<void(FramePlan&)>& damage) {
        FramePlan plan = plan_with_layers(image);
        damage(plan);
        check_refused(backend, *made, what, plan);
    };
    refused("an image that does not exist", [](FramePlan& plan) {
        plan.layers[0].image = LayeredImageId{8};
    });
    refused("no image", [](FramePlan& plan) { plan.layers[0].image = kNone<LayeredImageId>; });
    refused("layers out of range", [](FramePlan& plan) { plan.commands[0].count = 2; });
    refused("layers far out of range", [](FramePlan& plan) {
        plan.commands[0].first = UINT32_MAX;
    });
    refused("an image of nothing", [](FramePlan& plan) {
        plan.layered_updates[0].content = nullptr;
    });
    refused("an image without an id", [](FramePlan& plan) {
        plan.layered_updates[0].image = kNone<LayeredImageId>;
    });
    refused("an unknown action", [](FramePlan& plan) {
        plan.layered_updates[0].action = static_cast<LayeredUpdate::Action>(2);
    });
    refused("layers with pieces", [](FramePlan& plan) {
        plan.pieces = {{ItemId{0}, 0, 1}};
        plan.commands[0].piece_count = 1;
    });
    refused("clipped layers", [](FramePlan& plan) {
        plan.clips = {{glm::vec3(-1.0F), glm::vec3(1.0F)}};
        plan.commands[0].clip = 0;
    });
    refused("layers at the depth of planes", [](FramePlan& plan) {
        plan.commands[0].depth = QuadDepth::plane;
    });
    refused("layers with keyframes", [](FramePlan& plan) { plan.commands[0].keyframe_count = 1; });
    const auto damaged_content = [&](const char* what,
                                     const std::function<void(LayeredDepthImage&)>& damage) {
        LayeredDepthImage wrong = image;
        damage(wrong);
        check_refused(backend, *made, what, plan_with_layers(wrong));
    };
    damaged_content("a view without a lens", [](LayeredDepthImage& wrong) {
        wrong.view.lens.near_distance = 0.0;
    });
    damaged_content("depths that are none", [](LayeredDepthImage& wrong) {
        wrong.far_depth = wrong.near_depth;
    });
    damaged_content("samples that are missing", [](LayeredDepthImage& wrong) {
        wrong.samples.pop_back();
    });
    damaged_content("a count too many", [](LayeredDepthImage& wrong) { ++wrong.counts[5]; });
    damaged_content("rows that are missing", [](LayeredDepthImage& wrong) {
        wrong.rows.pop_back();
    });
    damaged_content("a row that begins nowhere", [](LayeredDepthImage& wrong) {
        wrong.rows[3] = UINT32_MAX;
    });
    damaged_content("a sample in another texel", [](LayeredDepthImage& wrong) {
        wrong.samples[7].y = UINT16_MAX;
    });
    damaged_content("fewer points than samples", [](LayeredDepthImage& wrong) {
        wrong.points.resize(3);
    });
}

/// Calls every check above in a section of its own.
/// @param backend fresh, over the items of `world`
inline void check_conformance(Backend& backend, const SmallWorld& world) {
    SECTION("limits and names") {
        CHECK(backend.limits().page_size >= 1024);
        CHECK(backend.limits().samples >= 1);
        CHECK_FALSE(backend.device().empty());
    }
    SECTION("targets come and go, bad ones are refused") {
        check_targets(backend);
    }
    SECTION("pages come and go, each cache has its own") {
        check_pages(backend);
    }
    SECTION("wrong plans are refused and do no harm") {
        check_wrong_plans(backend);
    }
    SECTION("pages keep depth, and images are drawn with it") {
        check_depths(backend);
    }
    SECTION("keyframes are projected") {
        check_keyframes(backend);
    }
    SECTION("layered depth images come and go, and are shown") {
        check_layered_images(backend);
    }
    SECTION("wrong layered depth images are refused and do no harm") {
        check_wrong_layers(backend);
    }
    SECTION("splats, cubes and single primitives, in targets of one sample and of several") {
        for (const int samples : {1, std::min(4, backend.limits().samples)}) {
            const auto target = backend.create_target(kFrameSize, kFrameSize, samples);
            REQUIRE(target.has_value());
            require_executed(backend, plan_with_cells(), *target);
            require_executed(backend, plan_with_image(), *target);
            require_executed(backend, plan_with_cells(), *target);
        }
    }
    SECTION("plain geometry, in either order, with and without a clear") {
        const auto target = backend.create_target(160, 120, 1);
        REQUIRE(target.has_value());
        for (const GeometryOrder order : {GeometryOrder::stored, GeometryOrder::front_to_back}) {
            CulledGeometry geometry(world.hierarchy, order);
            for (int frame = 0; frame < 20; ++frame) {
                FrameClear clear;
                clear.enabled = frame % 2 == 0;
                const FramePlan& plan = geometry.plan(small_walk(frame * 5, 160, 120));
                REQUIRE(backend.execute(plan, *target, clear).has_value());
            }
        }
        CHECK(backend.image_bytes() == 0);
    }
    SECTION("a cache, surfaces in its images") {
        ImageCacheOptions options = eager_options();
        options.surfaces = SurfacePlacement::in_images;
        CHECK(walk_with_cache(backend, world, options, 60) > 20);
    }
    SECTION("a cache, surfaces first, zones, exact pixels") {
        ImageCacheOptions options = eager_options();
        options.surfaces = SurfacePlacement::first;
        options.validity = ImageValidity::zone;
        options.exact_pixels = true;
        CHECK(walk_with_cache(backend, world, options, 60) > 20);
    }
    SECTION("a cache with samples") {
        ImageCacheOptions options = eager_options();
        options.image_samples = std::min(4, backend.limits().samples);
        CHECK(walk_with_cache(backend, world, options, 30) > 20);
    }
    SECTION("a cache with hardly any room") {
        ImageCacheOptions options = eager_options();
        options.image_budget_bytes = 400'000;
        CHECK(walk_with_cache(backend, world, options, 60) > 10);
        CHECK(backend.image_bytes() <= options.image_budget_bytes);
    }
    SECTION("two caches on one backend") {
        const auto target = backend.create_target(160, 120, 1);
        REQUIRE(target.has_value());
        ImageCacheOptions options = eager_options();
        auto left = ImageCache::create(world.hierarchy, options);
        options.cache_id = 1;
        options.error_px = 4.0;
        auto right = ImageCache::create(world.hierarchy, options);
        REQUIRE(left.has_value());
        REQUIRE(right.has_value());
        for (int frame = 0; frame < 20; ++frame) {
            const View view = small_walk(frame, 160, 120);
            require_executed(backend, left->plan(view, small_walk_motion()), *target);
            require_executed(backend, right->plan(view, small_walk_motion()), *target);
            CHECK(
                backend.image_bytes() ==
                left->statistics().image_bytes + right->statistics().image_bytes
            );
            if (frame == 10) {
                left->forget_images();
            }
        }
        CHECK(left->statistics().images_shown > 0);
        CHECK(right->statistics().images_shown > 0);
    }
}

} // namespace farfield::support
