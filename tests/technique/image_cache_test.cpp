#include "support/allocation_counter.hpp"
#include "technique/plan_replay.hpp"
#include "technique/scenes.hpp"
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using farfield::support::Forest;
using farfield::support::PlanReplay;
using farfield::support::ReplayedImage;
using farfield::support::Step;

constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 40U;

// Errors are computed in float by the cache and in double here. In float the corner estimate is
// good to 1e-6 of itself, but it starts from differences of positions that are rounded: below 1 km
// those are good to 6e-5 m, and the boxes here, at whose size the error is proportional to, are 2 m
// and more. Taken together less than 1e-4 of the threshold.
constexpr double kErrorSlack = 1e-4;

ImageCache make_cache(const Hierarchy& tree, const ImageCacheOptions& options) {
    auto cache = ImageCache::create(tree, options);
    INFO((cache ? std::string("created") : cache.error().message));
    REQUIRE(cache.has_value());
    return std::move(*cache);
}

PlanReplay
make_replay(const Hierarchy& tree, const ImageCache& cache, const ImageCacheOptions& options) {
    return PlanReplay(
        tree, {.budget_bytes = options.image_budget_bytes, .surfaces = cache.surfaces()}
    );
}

double threshold_rad(const ImageCacheOptions& options, const View& view) {
    if (options.conversion == PixelConversion::bound) {
        const auto scale = metric::pixel_scale(view.lens, view.width, view.height);
        return metric::angle_of_pixels(scale.scale, options.error_px).value;
    }
    const double fov_y = std::atan(view.lens.top) - std::atan(view.lens.bottom);
    return options.error_px * fov_y / view.height;
}

/// Sums of a whole walk.
struct Totals {
    std::uint64_t created = 0;
    std::uint64_t reused = 0;
    std::uint64_t combined = 0;
    std::uint64_t evicted = 0;
    std::uint64_t refused = 0;
    std::uint64_t shown = 0;
};

/// Walks with every check of the replay, and those of the statistics.
Totals walk(
    ImageCache& cache,
    PlanReplay& replay,
    std::span<const Step> steps,
    const std::function<void(const Step&)>& after_frame = {}
) {
    Totals totals;
    for (std::size_t frame = 0; frame < steps.size(); ++frame) {
        CAPTURE(frame);
        const FramePlan& plan = cache.plan(steps[frame].view, steps[frame].motion);
        replay.execute(plan);
        const ImageCacheStatistics& statistics = cache.statistics();
        std::uint32_t reused = 0;
        for (const auto& image : replay.shown()) {
            reused += image->frame < replay.plans() ? 1U : 0U;
        }
        REQUIRE(statistics.images_created + 1 == plan.passes.size());
        REQUIRE(statistics.images_shown == replay.shown().size());
        const auto statuses = cache.statuses();
        REQUIRE(
            std::count(statuses.begin(), statuses.end(), NodeStatus::image) ==
            statistics.images_shown
        );
        REQUIRE(statistics.images_reused == reused);
        REQUIRE(statistics.image_bytes == replay.bytes());
        REQUIRE(statistics.images_combined <= statistics.images_created);
        totals.created += statistics.images_created;
        totals.reused += statistics.images_reused;
        totals.combined += statistics.images_combined;
        totals.evicted += statistics.images_evicted;
        totals.refused += statistics.images_refused;
        totals.shown += statistics.images_shown;
        if (after_frame) {
            after_frame(steps[frame]);
        }
    }
    return totals;
}

Step still(const View& view) {
    return {view, {}};
}

/// Looking at a forest of radius 200 from the side, far enough for images.
const glm::dvec3 kSide(0.0, 8.0, 300.0);
const glm::dvec3 kMiddle(0.0, 4.0, 0.0);

} // namespace

TEST_CASE("bad options are refused by name and value") {
    const Hierarchy tree = support::make_row(2, {});
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    struct Bad {
        const char* name;
        std::string value;
        std::function<void(ImageCacheOptions&)> spoil;
    };
    std::vector<Bad> all;
    for (const double value : {0.0, -1.0, kNan, kInfinity}) {
        all.push_back({"error_px", std::to_string(value), [=](ImageCacheOptions& options) {
                           options.error_px = value;
                       }});
    }
    for (const double value : {-0.5, kNan, kInfinity}) {
        all.push_back({"overlap_px", std::to_string(value), [=](ImageCacheOptions& options) {
                           options.overlap_px = value;
                       }});
    }
    for (const std::int32_t value : {0, -4, 65, INT32_MAX, INT32_MIN}) {
        all.push_back({"image_samples", std::to_string(value), [=](ImageCacheOptions& options) {
                           options.image_samples = value;
                       }});
    }
    for (const std::int32_t value : {0, 63, 16385, -1, INT32_MAX}) {
        all.push_back({"page_size", std::to_string(value), [=](ImageCacheOptions& options) {
                           options.page_size = value;
                       }});
    }
    all.push_back({"max_life", "0", [](ImageCacheOptions& options) { options.max_life = 0; }});
    all.push_back({"pass_s", "-2", [](ImageCacheOptions& options) { options.costs.pass_s = -2; }});
    for (const Bad& bad : all) {
        ImageCacheOptions options;
        bad.spoil(options);
        const auto cache = ImageCache::create(tree, options);
        CAPTURE(bad.name, bad.value);
        REQUIRE_FALSE(cache.has_value());
        CHECK(cache.error().code == ErrorCode::invalid_argument);
        CHECK_THAT(cache.error().message, Catch::Contains(bad.name));
        CHECK_THAT(cache.error().message, Catch::Contains(bad.value));
    }
    const auto cache = ImageCache::create(Hierarchy{}, {});
    REQUIRE_FALSE(cache.has_value());
    CHECK_THAT(cache.error().message, Catch::Contains("no nodes"));
}

TEST_CASE("the extremes of options are accepted") {
    const Hierarchy tree = support::make_row(2, {});
    CHECK(ImageCache::create(tree, {}).has_value());
    CHECK(ImageCache::create(
              tree,
              {.error_px = 1e-9,
               .image_samples = 64,
               .page_size = 64,
               .max_life = 1,
               .overlap_px = 0.0}
    )
              .has_value());
    CHECK(ImageCache::create(
              tree, {.error_px = 1e9, .image_budget_bytes = UINT64_MAX, .page_size = 16384}
    )
              .has_value());
}

TEST_CASE("the preset keeps what it leaves open") {
    const ImageCacheOptions options = presets::shade1996(
        {.error_px = 3.5,
         .conversion = PixelConversion::bound,
         .validity = ImageValidity::zone,
         .image_budget_bytes = 77,
         .cache_id = 4}
    );
    CHECK(options.conversion == PixelConversion::mean);
    CHECK(options.validity == ImageValidity::angle);
    CHECK(options.error_px == 3.5);
    CHECK(options.image_budget_bytes == 77);
    CHECK(options.cache_id == 4);
}

TEST_CASE("an empty scene is an empty frame") {
    const auto tree = partition::build_bsp({});
    REQUIRE(tree.has_value());
    ImageCache cache = make_cache(*tree, {});
    const FramePlan& plan = cache.plan(support::view_at({0, 0, 0}, {0, 0, -1}), {});
    CHECK(plan.passes.size() == 1);
    CHECK(plan.commands.empty());
    CHECK(plan.pages.empty());
    CHECK(cache.statistics().nodes_visited == 1);
    CHECK(cache.statuses()[0] == NodeStatus::culled);
}

TEST_CASE("where surfaces are drawn follows their share of the whole") {
    // 512 triangles of ground.
    const Forest rich = support::make_forest({.trees = 10, .ground_cells = 16});
    const Forest poor = support::make_forest({.trees = 10, .primitives = 10, .ground_cells = 16});
    CHECK(make_cache(rich.hierarchy, {}).surfaces() == SurfacePlacement::first);
    CHECK(
        make_cache(rich.hierarchy, {.surfaces = SurfacePlacement::in_images}).surfaces() ==
        SurfacePlacement::in_images
    );
    CHECK(
        make_cache(poor.hierarchy, {.surfaces = SurfacePlacement::first}).surfaces() ==
        SurfacePlacement::first
    );
}

TEST_CASE("without memory for images every plan is the baseline's") {
    const Forest forest = support::make_forest({.trees = 60, .ground_cells = 12});
    const auto steps = support::random_flight(300, 1);
    // Scratch takes 8 bytes a texel and each of two pages 4; the smallest page has 64 x 64.
    for (const std::uint64_t budget : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{65'535}}) {
        for (const auto surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
            for (const auto order : {GeometryOrder::front_to_back, GeometryOrder::stored}) {
                CAPTURE(budget, surfaces, order);
                ImageCache cache = make_cache(
                    forest.hierarchy,
                    {.surfaces = surfaces, .image_budget_bytes = budget, .order = order}
                );
                CulledGeometry baseline(forest.hierarchy, order);
                for (const Step& step : steps) {
                    REQUIRE(
                        digest(cache.plan(step.view, step.motion)) ==
                        digest(baseline.plan(step.view))
                    );
                }
                CHECK(cache.statistics().image_bytes_peak == 0);
            }
        }
    }
    // A frame of 640 x 480 does not fit into scratch.
    ImageCache cache =
        make_cache(forest.hierarchy, {.exact_pixels = true, .image_budget_bytes = 1'000'000});
    CulledGeometry baseline(forest.hierarchy);
    for (const Step& step : steps) {
        REQUIRE(digest(cache.plan(step.view, step.motion)) == digest(baseline.plan(step.view)));
    }
}

TEST_CASE("where images do not pay every plan is the baseline's") {
    const Forest forest = support::make_forest({.trees = 60, .primitives = 1, .ground_cells = 12});
    ImageCacheOptions options;
    options.costs.image_quad_s = 1.0;
    ImageCache cache = make_cache(forest.hierarchy, options);
    CulledGeometry baseline(forest.hierarchy);
    for (const Step& step : support::random_flight(300, 2)) {
        REQUIRE(digest(cache.plan(step.view, step.motion)) == digest(baseline.plan(step.view)));
    }
    CHECK(cache.statistics().image_bytes_peak == 0);
}

TEST_CASE("the smallest budget still makes images and stays a limit") {
    const Forest forest = support::make_forest({.trees = 60});
    for (const std::uint64_t budget : {65'536U, 100'000U, 300'000U, 1'000'000U}) {
        CAPTURE(budget);
        const ImageCacheOptions options{.image_budget_bytes = budget};
        ImageCache cache = make_cache(forest.hierarchy, options);
        PlanReplay replay = make_replay(forest.hierarchy, cache, options);
        const Totals totals = walk(cache, replay, support::curved_walk(200.0, 400));
        CHECK(totals.shown > 0);
        CHECK(cache.statistics().image_bytes_peak <= budget);
        CHECK(cache.statistics().image_bytes_peak > 0);
    }
}

TEST_CASE("the first frame shows images and the second the same ones") {
    const Forest forest = support::make_forest({});
    ImageCache cache = make_cache(forest.hierarchy, {});
    PlanReplay replay = make_replay(forest.hierarchy, cache, {});
    const Step step = still(support::view_at(kSide, kMiddle));
    const Totals first = walk(cache, replay, {&step, 1});
    CHECK(first.created > 0);
    CHECK(first.shown > 0);
    CHECK(first.reused == 0);
    const auto images = replay.shown();
    const Totals second = walk(cache, replay, {&step, 1});
    CHECK(second.created == 0);
    CHECK(second.reused == first.shown);
    CHECK(replay.shown() == images);
}

TEST_CASE("a still eye makes no image after the first frame") {
    for (const auto surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        for (const std::uint64_t primitives : {std::uint64_t{300}, std::uint64_t{20'000}}) {
            const Forest forest =
                support::make_forest({.trees = 150, .primitives = primitives, .ground_cells = 12});
            CAPTURE(surfaces, primitives);
            for (int place = 0; place < 20; ++place) {
                const glm::dvec3 eye(place * 20.0 - 200.0, 3.0 + place, 150.0 + 10.0 * place);
                const ImageCacheOptions options{
                    .surfaces = surfaces, .image_budget_bytes = kNoLimit};
                ImageCache cache = make_cache(forest.hierarchy, options);
                const View view = support::view_at(eye, kMiddle);
                (void)cache.plan(view, {});
                std::uint32_t created = 0;
                for (int frame = 0; frame < 5; ++frame) {
                    (void)cache.plan(view, {});
                    created += cache.statistics().images_created;
                }
                CHECK(created == 0);
            }
        }
    }
}

TEST_CASE("an image is shown until its error exceeds the threshold and not a frame longer") {
    // Overlap would enlarge the boxes of images that show surfaces; without it they are known.
    const Forest forest =
        support::make_forest({.trees = 120, .ground_cells = 10, .inflation = 0.0F});
    for (const auto surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        for (const auto conversion : {PixelConversion::mean, PixelConversion::bound}) {
            const ImageCacheOptions options{
                .error_px = 2.0,
                .conversion = conversion,
                .surfaces = surfaces,
                .image_budget_bytes = kNoLimit,
                .page_size = 2048, // for all images: none is given up unseen
                .overlap_px = 0.0};
            CAPTURE(surfaces, conversion);
            ImageCache cache = make_cache(forest.hierarchy, options);
            PlanReplay replay = make_replay(forest.hierarchy, cache, options);
            std::size_t nearly_spent = 0;
            const Totals totals = walk(
                cache,
                replay,
                support::random_flight(1800, 3, {.lens_in = 1'000'000}),
                [&](const Step& step) {
                    const double threshold = threshold_rad(options, step.view);
                    const glm::vec3 eye = local_point(step.view.eye, forest.hierarchy.origin);
                    for (const auto& image : replay.shown()) {
                        const double error = replay.error_rad(*image, eye);
                        REQUIRE(error <= threshold * (1.0 + kErrorSlack));
                        nearly_spent += error > 0.9 * threshold ? 1U : 0U;
                    }
                    // Whoever was asked and shows no image had none that would do.
                    for (std::uint32_t node = 0; node < cache.statuses().size(); ++node) {
                        const NodeStatus status = cache.statuses()[node];
                        if (status == NodeStatus::geometry || status == NodeStatus::recursed) {
                            const auto image = replay.image_of(node);
                            if (image != nullptr) {
                                REQUIRE(
                                    replay.error_rad(*image, eye) >= threshold * (1.0 - kErrorSlack)
                                );
                            }
                        }
                    }
                }
            );
            CHECK(totals.evicted == 0);
            CHECK(totals.created > 100);
            CHECK(totals.combined > 10);
            CHECK(totals.reused > 8 * totals.created);
            CHECK(nearly_spent > 100);
        }
    }
}

TEST_CASE("by zones, an image and all that is nested in it stay within the threshold") {
    const Forest forest =
        support::make_forest({.trees = 120, .ground_cells = 10, .inflation = 0.0F});
    for (const auto surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        const ImageCacheOptions options{
            .validity = ImageValidity::zone,
            .surfaces = surfaces,
            .image_budget_bytes = kNoLimit,
            .overlap_px = 0.0};
        CAPTURE(surfaces);
        ImageCache cache = make_cache(forest.hierarchy, options);
        PlanReplay replay = make_replay(forest.hierarchy, cache, options);
        const Totals totals = walk(
            cache,
            replay,
            support::random_flight(3000, 4, {.lens_in = 1'000'000}),
            [&](const Step& step) {
                const double threshold = threshold_rad(options, step.view);
                const glm::vec3 eye = local_point(step.view.eye, forest.hierarchy.origin);
                const std::function<void(const ReplayedImage&)> check =
                    [&](const ReplayedImage& image) {
                        REQUIRE(
                            replay.own_error_rad(image, eye) <= threshold * (1.0 + kErrorSlack)
                        );
                        for (const auto& nested : image.nested) {
                            check(*nested);
                        }
                    };
                for (const auto& image : replay.shown()) {
                    check(*image);
                }
            }
        );
        CHECK(totals.created > 100);
        CHECK(totals.combined > 10);
        CHECK(totals.reused > totals.created);
    }
}

TEST_CASE("a larger threshold never makes more images on the same walk") {
    const Forest forest = support::make_forest({.trees = 120});
    const auto steps = support::curved_walk(200.0, 600);
    std::uint64_t before = UINT64_MAX;
    for (const double error_px : {0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
        const ImageCacheOptions options{.error_px = error_px, .image_budget_bytes = kNoLimit};
        ImageCache cache = make_cache(forest.hierarchy, options);
        PlanReplay replay = make_replay(forest.hierarchy, cache, options);
        const std::uint64_t created = walk(cache, replay, steps).created;
        CAPTURE(error_px);
        CHECK(created <= before);
        CHECK(created > 0);
        before = created;
    }
}

TEST_CASE("after a whole turn of the head everything is still there") {
    // Trees all around, and none so near that its box reaches behind the near plane when it is in
    // sight.
    const Forest forest = support::make_forest({.trees = 150, .radius = 400.0, .seed = 8});
    const ImageCacheOptions options{.image_budget_bytes = kNoLimit};
    ImageCache cache = make_cache(forest.hierarchy, options);
    PlanReplay replay = make_replay(forest.hierarchy, cache, options);
    std::vector<Step> turn;
    const glm::dvec3 eye(3.0, 60.0, 5.0);
    constexpr int kFrames = 72;
    for (int frame = 0; frame < kFrames; ++frame) {
        const double angle = 2.0 * std::numbers::pi * frame / kFrames;
        turn.push_back(
            still(support::view_at(eye, eye + glm::dvec3(std::cos(angle), -0.3, std::sin(angle))))
        );
    }
    const Totals first = walk(cache, replay, turn);
    CHECK(first.created > 10);
    const Totals second = walk(cache, replay, turn);
    // Which nodes are worth one image may differ with the direction, so a few are still made; and
    // all of them are there in the third turn.
    CHECK(second.created <= first.created / 10);
    CHECK(second.reused > 0);
    const Totals third = walk(cache, replay, turn);
    CHECK(third.created == 0);
    CHECK(third.reused == third.shown);
    CHECK(cache.statistics().images_evicted == 0);
}

TEST_CASE("with another lens or resolution only images whose texels still fit are shown") {
    const Forest forest = support::make_forest({});
    const View view = support::view_at(kSide, kMiddle);
    struct Change {
        const char* what;
        void (*change)(View&);
        bool fits; // texels are between half a pixel and one
    };
    const Change change = GENERATE(
        Change{"larger pixels", [](View& other) { other.height = other.height * 9 / 10; }, true},
        Change{"a wider lens", [](View& other) { other.lens.right *= 1.5; }, true},
        Change{"smaller pixels", [](View& other) { other.width = other.width * 11 / 10; }, false},
        Change{"a narrower lens", [](View& other) { other.lens.top *= 0.98; }, false},
        Change{"pixels three times as large", [](View& other) { other.width /= 3; }, false},
        Change{"another near plane", [](View& other) { other.lens.near_distance *= 2.0; }, false},
        Change{"another far plane", [](View& other) { other.lens.far_distance *= 2.0; }, false}
    );
    View other = view;
    change.change(other);
    CAPTURE(change.what);
    for (const bool exact : {false, true}) {
        const ImageCacheOptions options{.exact_pixels = exact};
        ImageCache cache = make_cache(forest.hierarchy, options);
        PlanReplay replay = make_replay(forest.hierarchy, cache, options);
        const std::vector<Step> before(3, still(view));
        const std::vector<Step> after(1, still(other));
        CHECK(walk(cache, replay, before).reused > 0);
        // What is shown is right at once, and images are there in the same frame.
        const Totals totals = walk(cache, replay, after);
        CHECK((totals.reused > 0) == change.fits);
        CHECK(totals.shown > 0);
        CHECK(walk(cache, replay, after).reused > 0);
    }
    ImageCache cache = make_cache(forest.hierarchy, {});
    PlanReplay replay = make_replay(forest.hierarchy, cache, {});
    const std::vector<Step> turned{still(view), still(support::view_at(kSide, {20, 0, 0}))};
    CHECK(walk(cache, replay, turned).reused > 0);
}

TEST_CASE("teleports, an eye in a box, on a plane and far outside make valid plans") {
    const Forest forest = support::make_forest({.trees = 80, .ground_cells = 8});
    const Hierarchy& tree = forest.hierarchy;
    std::vector<View> views;
    for (const HierarchyNode& node : tree.nodes) {
        const Box3f box = bounds(node);
        const glm::dvec3 inside = tree.origin + glm::dvec3(center(box));
        views.push_back(support::view_at(inside, inside + glm::dvec3(1, 0, 0.25)));
        for (unsigned index : {0U, 3U, 6U}) { // on the surface of the box
            const glm::dvec3 on = tree.origin + glm::dvec3(corner(box, index));
            views.push_back(support::view_at(on, inside + glm::dvec3(0, 0.5, 0)));
        }
        if (!is_leaf(node)) {
            const glm::vec3 on_plane = node.plane.normal * node.plane.offset;
            const glm::dvec3 eye = tree.origin + glm::dvec3(on_plane) + glm::dvec3(0, 3, 0);
            views.push_back(support::view_at(eye, eye + glm::dvec3(node.plane.normal)));
            views.push_back(support::view_at(eye, eye + glm::dvec3(node.plane.normal.z, 0, 0.5)));
        }
    }
    for (const glm::dvec3 far_away :
         {glm::dvec3(1e7, 0, 0), glm::dvec3(-1e7, 1e7, 1e7), glm::dvec3(0, -1e7, 0)}) {
        views.push_back(support::view_at(far_away, {0, 0, 0}));
        views.push_back(support::view_at(far_away, 2.0 * far_away));
        views.back().lens.far_distance = 1e9;
        views.push_back(support::view_at(far_away, {0, 0, 0}));
        views.back().lens.far_distance = 1e9;
        views.push_back(support::view_at(kSide, kMiddle));
    }
    const auto steps = support::walk_of(views);
    for (const auto surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        for (const auto validity : {ImageValidity::angle, ImageValidity::zone}) {
            for (const bool exact : {false, true}) {
                CAPTURE(surfaces, validity, exact);
                const ImageCacheOptions options{
                    .validity = validity, .surfaces = surfaces, .exact_pixels = exact};
                ImageCache cache = make_cache(tree, options);
                PlanReplay replay = make_replay(tree, cache, options);
                const Totals totals = walk(cache, replay, steps);
                CHECK(totals.created > 0);
                // A second visit, against the order.
                walk(cache, replay, std::vector<Step>(steps.rbegin(), steps.rend()));
            }
        }
    }
}

TEST_CASE("no node around the eye or across the near plane is shown by an image") {
    const Hierarchy tree = support::make_row(8, {});
    ImageCache cache = make_cache(tree, {.error_px = 1000.0});
    // Along the row, through all the boxes.
    for (int step = 0; step < 640; ++step) {
        const double x = -20.0 + 0.25 * step;
        const View view = support::view_at({x, 0, 0}, {x + 1, 0, 0.1});
        (void)cache.plan(view, {});
        const glm::vec3 eye(static_cast<float>(x), 0, 0);
        for (std::size_t node = 0; node < tree.nodes.size(); ++node) {
            if (cache.statuses()[node] == NodeStatus::image) {
                CAPTURE(x, node);
                REQUIRE_FALSE(contains(tree.nodes[node].items_box, eye));
            }
        }
    }
}

TEST_CASE("a scene at 10,000 km is planned as one at the origin") {
    const glm::dvec3 far_away(1e7, 1e7, -1e7);
    const auto here_steps = support::curved_walk(200.0, 300);
    const auto there_steps = support::curved_walk(200.0, 300, far_away);
    for (const std::uint32_t ground_cells : {0U, 12U}) {
        const Forest here = support::make_forest({.ground_cells = ground_cells});
        const Forest there =
            support::make_forest({.ground_cells = ground_cells, .offset = far_away});
        ImageCache a = make_cache(here.hierarchy, {});
        ImageCache b = make_cache(there.hierarchy, {});
        std::uint64_t created = 0;
        for (std::size_t frame = 0; frame < here_steps.size(); ++frame) {
            CAPTURE(frame);
            const FramePlan& plan_a = a.plan(here_steps[frame].view, here_steps[frame].motion);
            const FramePlan& plan_b = b.plan(there_steps[frame].view, there_steps[frame].motion);
            REQUIRE(plan_a.items == plan_b.items);
            REQUIRE(plan_a.pieces == plan_b.pieces);
            REQUIRE(plan_a.passes.size() == plan_b.passes.size());
            REQUIRE(plan_a.commands.size() == plan_b.commands.size());
            REQUIRE(plan_a.quads.size() == plan_b.quads.size());
            for (std::size_t quad = 0; quad < plan_a.quads.size(); ++quad) {
                REQUIRE(plan_a.quads[quad].source == plan_b.quads[quad].source);
                REQUIRE(plan_a.quads[quad].page == plan_b.quads[quad].page);
            }
            REQUIRE(std::equal(
                a.statuses().begin(), a.statuses().end(), b.statuses().begin(), b.statuses().end()
            ));
            created += a.statistics().images_created;
        }
        CHECK(created > 20);
    }
}

TEST_CASE("a long flight under a small budget breaks no rule of plans") {
    const Forest forest = support::make_forest({.trees = 80, .radius = 80.0, .ground_cells = 10});
    for (const auto surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        for (const auto validity : {ImageValidity::angle, ImageValidity::zone}) {
            for (const bool exact : {false, true}) {
                CAPTURE(surfaces, validity, exact);
                // Pages of 128 texels, or what is left beside a scratch page of 640.
                const ImageCacheOptions options{
                    .error_px = 4.0,
                    .validity = validity,
                    .surfaces = surfaces,
                    .exact_pixels = exact,
                    .image_budget_bytes =
                        8U * (exact ? 640U * 640U : 128U * 128U) + 4U * 4U * 128U * 128U,
                    .page_size = 128};
                ImageCache cache = make_cache(forest.hierarchy, options);
                PlanReplay replay = make_replay(forest.hierarchy, cache, options);
                const Totals totals = walk(
                    cache,
                    replay,
                    support::random_flight(
                        4000, 5, {.reach = 120.0, .speed = 3.0, .lens_in = 1'000'000}
                    )
                );
                CHECK(totals.evicted > 50);
                CHECK(totals.reused > 100);
            }
        }
    }
}

TEST_CASE("images that make room for each other within a frame are not mixed up") {
    // Pages that hold a handful of images, and groups of trees that just fit into one: making the
    // images of children gives up the stale one of their parent, or that of a sibling beside the
    // frustum, which the parent's would show.
    struct Case {
        std::size_t trees;
        double radius;
        std::int32_t page_size;
        double image_quad_s; // where it is large, one quad for all is worth much
        double speed;
    };
    const auto [trees, radius, page_size, image_quad_s, speed] = GENERATE(
        Case{30, 40.0, 64, 5e-6, 10.0},
        Case{30, 40.0, 64, 5e-6, 4.0},
        Case{100, 100.0, 128, 1e-4, 4.0},
        Case{100, 100.0, 128, 1e-3, 4.0}
    );
    CAPTURE(trees, radius, page_size, image_quad_s, speed);
    const Forest forest = support::make_forest({.trees = trees, .radius = radius});
    for (std::uint64_t seed = 9; seed < 12; ++seed) {
        CAPTURE(seed);
        ImageCacheOptions options{
            .image_budget_bytes =
                16U * static_cast<std::uint64_t>(page_size) * static_cast<std::uint64_t>(page_size),
            .page_size = page_size};
        options.costs.image_quad_s = image_quad_s;
        ImageCache cache = make_cache(forest.hierarchy, options);
        PlanReplay replay = make_replay(forest.hierarchy, cache, options);
        const Totals totals = walk(
            cache,
            replay,
            support::random_flight(
                3000, seed, {.reach = 250.0, .speed = speed, .teleport_in = 1000, .turn_in = 10}
            )
        );
        CHECK(totals.evicted > 100);
        CHECK(totals.refused > 100);
        CHECK(totals.combined > 10);
    }
}

TEST_CASE("forgotten images are made again, in new pages") {
    const Forest forest = support::make_forest({});
    ImageCache cache = make_cache(forest.hierarchy, {});
    PlanReplay replay = make_replay(forest.hierarchy, cache, {});
    const Step step = still(support::view_at(kSide, kMiddle));
    const Totals first = walk(cache, replay, {&step, 1});
    cache.forget_images();
    cache.forget_images();
    const FramePlan& plan = cache.plan(step.view, step.motion);
    CHECK(std::any_of(plan.pages.begin(), plan.pages.end(), [](const PageUpdate& update) {
        return update.action == PageUpdate::Action::destroy;
    }));
    replay.execute(plan);
    CHECK(cache.statistics().images_created == first.created);
    CHECK(cache.statistics().images_reused == 0);
    CHECK(walk(cache, replay, {&step, 1}).reused == first.shown);
}

TEST_CASE("caches that share a hierarchy and a backend are told apart") {
    const Hierarchy tree = support::make_row(4, {});
    ImageCache cache = make_cache(tree, {.cache_id = 3});
    ImageCache moved = std::move(cache);
    CHECK(moved.plan(support::view_at({24, 0, 80}, {24, 0, 0}), {}).cache == 3);
    CHECK(moved.statistics().images_shown > 0);
}

TEST_CASE("two runs make the same plans") {
    const Forest forest = support::make_forest({.trees = 80, .ground_cells = 8});
    const auto steps = support::random_flight(1500, 6);
    const ImageCacheOptions options{.image_budget_bytes = 2'000'000};
    ImageCache a = make_cache(forest.hierarchy, options);
    ImageCache b = make_cache(forest.hierarchy, options);
    for (const Step& step : steps) {
        REQUIRE(digest(a.plan(step.view, step.motion)) == digest(b.plan(step.view, step.motion)));
    }
}

TEST_CASE("where pixels of geometry cost, images are made of what covers many for long") {
    const Hierarchy tree = support::make_row(8, {});
    const auto made_with = [&](const CostModel& costs, std::int32_t frame_samples) {
        const ImageCacheOptions options{
            .error_px = 4.0, .costs = costs, .frame_samples = frame_samples};
        ImageCache cache = make_cache(tree, options);
        PlanReplay replay = make_replay(tree, cache, options);
        std::vector<View> views;
        views.reserve(60);
        for (int frame = 0; frame < 60; ++frame) {
            views.push_back(
                support::view_at({frame * 0.5, 4.0, 96.0 - frame * 0.25}, {56.0, 0.0, 0.0})
            );
        }
        return walk(cache, replay, support::walk_of(views)).created;
    };
    CostModel costs = ray_casting_costs();
    CHECK(made_with(costs, 1) > 0);
    // Samples of the frame make its geometry dearer, and images of one sample no more so.
    CHECK(made_with(costs, 16) >= made_with(costs, 1));
    // Nothing else costs enough to be saved.
    costs.geometry_pixel_s = 0.0;
    CHECK(made_with(costs, 1) == 0);
}

TEST_CASE("a small walk makes the plans on record") {
    // Past a row of eight boxes; no builder and no library function but the square root decides
    // what is in the plans. Where decisions are changed on purpose, the value printed by the
    // failure is the new one.
    const Hierarchy tree = support::make_row(8, {});
    ImageCache cache = make_cache(tree, {.error_px = 4.0, .image_budget_bytes = 2'000'000});
    PlanReplay replay = make_replay(tree, cache, {});
    std::vector<View> views;
    for (int frame = 0; frame < 120; ++frame) {
        const glm::dvec3 eye(frame * 0.5, 4.0, 96.0 - frame * 0.25);
        views.push_back(support::view_at(eye, {56.0, 0.0, 0.0}));
    }
    std::uint64_t all = 0;
    Totals totals;
    for (const Step& step : support::walk_of(views)) {
        const FramePlan& plan = cache.plan(step.view, step.motion);
        replay.execute(plan);
        all = all * 1099511628211ULL + digest(plan);
        totals.created += cache.statistics().images_created;
        totals.reused += cache.statistics().images_reused;
    }
    CHECK(totals.created == 25);
    CHECK(totals.reused == 721);
    CHECK(all == 0x8def5d32a29d76c6U);
}

TEST_CASE("once warm, planning allocates nothing") {
    const Forest forest = support::make_forest({.trees = 120, .ground_cells = 10});
    const auto steps = support::random_flight(1500, 7, {.lens_in = 500});
    for (const auto surfaces : {SurfacePlacement::first, SurfacePlacement::in_images}) {
        for (const bool exact : {false, true}) {
            CAPTURE(surfaces, exact);
            ImageCache cache = make_cache(
                forest.hierarchy,
                {.surfaces = surfaces, .exact_pixels = exact, .image_budget_bytes = 6'000'000}
            );
            const auto fly = [&] {
                std::uint64_t created = 0;
                for (const Step& step : steps) {
                    (void)cache.plan(step.view, step.motion);
                    created += cache.statistics().images_created;
                }
                return created;
            };
            // The second flight begins with the images of the first, so the third repeats it.
            CHECK(fly() > 100);
            fly();
            const std::uint64_t before = support::allocation_count();
            fly();
            const std::uint64_t after = support::allocation_count();
            CHECK(after == before);
        }
    }
}

TEST_CASE("options that cannot mean anything together are refused by name") {
    const Hierarchy tree = support::make_row(4, {});
    const auto refused = [&](const ImageCacheOptions& options) {
        const auto made = ImageCache::create(tree, options);
        REQUIRE_FALSE(made.has_value());
        CHECK(made.error().code == ErrorCode::invalid_argument);
        return made.error().message;
    };
    const auto facing = ImageOrientation::facing_eye;
    CHECK(
        refused({.all_around = true}) ==
        "image cache: all_around needs images that face the eye (orientation)"
    );
    CHECK(
        refused({.validity = ImageValidity::impostor_angles}) ==
        "image cache: the angles of impostors need images that face the eye (orientation)"
    );
    CHECK(
        refused({.orientation = facing, .exact_pixels = true}) ==
        "image cache: exact_pixels needs view-aligned images (orientation)"
    );
    CHECK(
        refused({.surfaces = SurfacePlacement::first, .quad_depth = QuadDepth::plane}) ==
        "image cache: quad_depth plane does not go with surfaces drawn first"
    );
    CHECK(refused({.texel_px = 0.5}).find("texel_px is 0.5") != std::string::npos);
    CHECK(refused({.orientation = facing, .texel_px = 0.0}).find("texel_px") != std::string::npos);
    CHECK(
        refused({.orientation = facing, .texel_px = 0.75, .max_texel_px = 0.5})
            .find("max_texel_px is 0.5") != std::string::npos
    );
    CHECK(refused({.image_limit = 15}).find("image_limit is 15") != std::string::npos);
    CHECK(validate(presets::schaufler1996()).has_value());
    CHECK(presets::schaufler1996().error_px == 1.0);
    CHECK(validate(presets::schaufler1996({.all_around = true})).has_value());
}

TEST_CASE("with images all around a turn of the head makes none") {
    const Forest forest = support::make_forest({.trees = 60, .radius = 60.0});
    for (const bool all_around : {true, false}) {
        ImageCacheOptions options = presets::schaufler1996({.all_around = all_around});
        options.image_budget_bytes = std::uint64_t{256} << 20U;
        ImageCache cache = make_cache(forest.hierarchy, options);
        PlanReplay replay = make_replay(forest.hierarchy, cache, options);
        const glm::dvec3 eye(8.0, 12.0, -4.0);
        std::vector<Step> turn;
        for (int frame = 0; frame < 24; ++frame) {
            const double angle = frame * 0.2617993877991494; // 15 degrees
            const glm::dvec3 ahead(std::cos(angle), -0.2, std::sin(angle));
            turn.push_back(still(support::view_at(eye, eye + ahead)));
        }
        const auto look = [&](std::size_t frame) {
            replay.execute(cache.plan(turn[frame].view, turn[frame].motion));
            CHECK(cache.statistics().images_shown == replay.shown().size());
            return cache.statistics().images_created;
        };
        CHECK(look(0) > 0);
        std::uint64_t created = 0;
        for (std::size_t frame = 1; frame < turn.size(); ++frame) {
            created += look(frame);
            CHECK(cache.statistics().images_shown > 0);
        }
        CHECK((created == 0) == all_around);
        // Once around, nothing is missing any more.
        for (std::size_t frame = 0; frame < turn.size(); ++frame) {
            CHECK(look(frame) == 0);
        }
    }
}

TEST_CASE("texels are never shown larger than the limit, nor images made beyond theirs") {
    const Hierarchy tree = support::make_row(1, {});
    ImageCache cache = make_cache(tree, presets::schaufler1996());
    std::uint64_t impossible = 0;
    std::uint64_t combined = 0;
    int last_event = -1;
    for (int frame = 0; frame < 400; ++frame) {
        const View view = support::view_at({0.0, 1.0, 202.0 - 0.5 * frame}, {0.0, 0.0, -10.0});
        const FramePlan& plan = cache.plan(view, {});
        const ImageEvent event = cache.events()[0];
        impossible += event == ImageEvent::impossible ? 1U : 0U;
        combined += event == ImageEvent::combined ? 1U : 0U;
        // Towards a box its image becomes impossible once, and stays so.
        CHECK(
            (last_event != static_cast<int>(ImageEvent::impossible) ||
             event == ImageEvent::impossible)
        );
        last_event = static_cast<int>(event);
        if (event == ImageEvent::impossible) {
            CHECK(plan.quads.empty());
            continue;
        }
        REQUIRE(plan.quads.size() == 1);
        const ImageQuad& quad = plan.quads[0];
        CHECK(quad.source.width <= 256);
        CHECK(quad.source.height <= 256);
        const double texel = glm::length(glm::dvec3(quad.edge_u)) / quad.source.width;
        const double distance = glm::length(
            glm::dvec3(quad.origin + 0.5F * (quad.edge_u + quad.edge_v)) - view.eye + tree.origin
        );
        const double pixel = (std::atan(0.75) * 2.0) / 480.0;
        // The plane may be nearer than the middle of the quad is, never farther.
        CHECK(2.0 * std::atan(texel / (2.0 * distance)) <= 1.0001 * pixel);
    }
    CHECK(impossible > 10);
    CHECK(combined == 0);
    CHECK(last_event == static_cast<int>(ImageEvent::impossible));
}

TEST_CASE("after a change of contents or light images are back in the same frame") {
    Forest forest = support::make_forest({.trees = 60, .ground_cells = 6});
    const auto surfaces = GENERATE(SurfacePlacement::first, SurfacePlacement::in_images);
    const ImageCacheOptions options{.surfaces = surfaces};
    ImageCache cache = make_cache(forest.hierarchy, options);
    PlanReplay replay = make_replay(forest.hierarchy, cache, options);
    const Step step = still(support::view_at(kSide, kMiddle));
    const std::vector<Step> settled(3, step);
    const Totals first = walk(cache, replay, settled);
    const std::uint64_t shown = first.shown / 3;
    REQUIRE(shown > 0);
    CHECK(walk(cache, replay, {&step, 1}).created == 0);

    // One tree: its image and those that show it, no others.
    partition::mark_changed(forest.hierarchy, ItemId{0});
    const Totals item = walk(cache, replay, {&step, 1});
    CHECK(item.created > 0);
    CHECK(item.created < first.created / 2);
    CHECK(item.shown == shown);
    CHECK(walk(cache, replay, {&step, 1}).created == 0);

    // The light: all of them.
    cache.set_appearance(1);
    replay.execute(cache.plan(step.view, step.motion), 1);
    CHECK(cache.statistics().images_reused == 0);
    CHECK(cache.statistics().images_shown == shown);
    replay.execute(cache.plan(step.view, step.motion), 1);
    CHECK(cache.statistics().images_created == 0);
}
