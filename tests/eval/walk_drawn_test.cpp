#include "support/small_scene.hpp"
#include <farfield/embree/embree_backend.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/walk.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

// Walks whose frames are really drawn, by casting rays: no graphics device is needed.

namespace {

using farfield::Backend;
using farfield::Contender;
using farfield::CulledGeometry;
using farfield::DisparitySummary;
using farfield::FramePlan;
using farfield::ImageCache;
using farfield::ImageCacheStatistics;
using farfield::Motion;
using farfield::PictureErrors;
using farfield::Planner;
using farfield::RunReport;
using farfield::View;
using farfield::WalkFrame;
using farfield::WalkObserver;
using farfield::WalkPictures;
using farfield::WalkResult;
using farfield::WalkSetup;
using farfield::support::small_walk;
using farfield::support::SmallWorld;
namespace eval = farfield::eval;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

const SmallWorld& world() {
    static const SmallWorld kWorld =
        farfield::support::make_world(farfield::support::small_scene());
    return kWorld;
}

std::unique_ptr<Backend> caster(bool positions = false) {
    auto backend = farfield::embree::EmbreeBackend::create(
        world().scene, &world().hierarchy, {.threads = 2, .positions = positions}
    );
    REQUIRE(backend);
    return std::move(*backend);
}

Planner plain(CulledGeometry& geometry) {
    Planner planner;
    planner.plan = [&geometry](const View& view, const Motion& /*motion*/) -> const FramePlan& {
        return geometry.plan(view);
    };
    return planner;
}

Planner images(ImageCache& cache) {
    Planner planner;
    planner.plan = [&cache](const View& view, const Motion& motion) -> const FramePlan& {
        return cache.plan(view, motion);
    };
    planner.statistics = [&cache]() -> const ImageCacheStatistics& { return cache.statistics(); };
    return planner;
}

ImageCache image_cache(double error_px) {
    auto cache =
        ImageCache::create(world().hierarchy, farfield::presets::shade1996({.error_px = error_px}));
    REQUIRE(cache);
    return std::move(*cache);
}

WalkSetup
setup_of(std::span<const Contender> contenders, const std::vector<glm::dmat4x3>& item_frames) {
    WalkSetup setup;
    setup.contenders = contenders;
    setup.hierarchy = &world().hierarchy;
    setup.item_primitives = world().item_primitives;
    setup.item_frames = item_frames;
    setup.view = [](int frame) { return small_walk(frame, kWidth, kHeight); };
    return setup;
}

} // namespace

TEST_CASE("plain geometry agrees with itself", "[walk]") {
    const auto item_frames = farfield::item_frames(world().scene);
    const auto backend = caster();
    const auto positions = caster(true);
    const auto reference = caster();
    CulledGeometry geometry(world().hierarchy);
    Contender contender;
    contender.name = "geometry";
    contender.planner = plain(geometry);
    contender.backend = backend.get();
    contender.positions = positions.get();
    WalkSetup setup = setup_of({&contender, 1}, item_frames);
    setup.reference = reference.get();
    const auto result = eval::walk(setup, {.frames = 6, .reference_every = 2});
    REQUIRE(result);
    for (const WalkFrame& frame : result->contenders[0].frames) {
        if (frame.image) {
            CHECK(frame.image->psnr_db == eval::kMaxPsnrDb);
            CHECK(*frame.image->ssim == Approx(1.0));
            CHECK(*frame.image->flip == 0.0);
            CHECK(*frame.image->missing_fraction == 0.0);
            CHECK(*frame.image->extra_fraction == 0.0);
        }
        // It shows no images whose disparity there could be.
        CHECK_FALSE(frame.disparity_max_px.has_value());
    }
    CHECK(result->contenders[0].sky_holes == 0);
    REQUIRE(result->contenders[0].disparity);
    const DisparitySummary& disparity = *result->contenders[0].disparity;
    CHECK(disparity.frames == 6);
    CHECK(disparity.image_pixels == 0);
    // The scene lies across a tenth of the picture at least.
    CHECK(disparity.geometry_pixels > 6U * kWidth * kHeight / 10U);
    CHECK(disparity.unmeasured_pixels == 0);
    CHECK(disparity.remade_images == 0);
    // Float arithmetic of values of 100 m, whose last bit is 4e-6 m: a hundredth of a pixel at one
    // metre, and nothing is nearer.
    CHECK(*disparity.geometry_max_px < 0.01);
    CHECK(result->contenders[0].position_bytes_peak == positions->position_bytes());
    CHECK(result->contenders[0].image_bytes_peak == 0);
}

TEST_CASE("images of a walk are measured, and those made anew told to the series", "[walk]") {
    constexpr int kFrames = 60;
    constexpr double kErrorPx = 1.0;
    const auto item_frames = farfield::item_frames(world().scene);
    const auto backend = caster();
    const auto positions = caster(true);
    ImageCache cache = image_cache(kErrorPx);
    Contender contender;
    contender.name = "images";
    contender.planner = images(cache);
    contender.backend = backend.get();
    contender.positions = positions.get();
    contender.error_px = kErrorPx;
    const WalkSetup setup = setup_of({&contender, 1}, item_frames);
    std::size_t made = 0;
    WalkObserver observer;
    observer.on_frame = [&](int, std::size_t, const View&, const FramePlan& plan) {
        made += eval::images_made(plan).size();
        return farfield::Result<void>{};
    };
    const auto result = eval::walk(setup, {.frames = kFrames, .reference_every = 0}, observer);
    REQUIRE(result);
    const auto& frames = result->contenders[0].frames;
    REQUIRE(result->contenders[0].disparity);
    const DisparitySummary& disparity = *result->contenders[0].disparity;
    CHECK(disparity.frames == kFrames);
    CHECK(disparity.image_pixels > 0);
    CHECK(disparity.infinite_pixels == 0);
    // Every promise is the threshold and something for sampling.
    CHECK(*disparity.bound_px > kErrorPx);
    REQUIRE(disparity.over_bound.has_value());
    // Images that were made again were made before, and shown in between.
    CHECK(disparity.remade_images > 0);
    CHECK(disparity.remade_images < made);
    REQUIRE(disparity.tightness.has_value());
    CHECK(*disparity.tightness > 0.0);

    double largest = 0.0;
    bool shown = false;
    for (const WalkFrame& frame : frames) {
        CHECK(frame.disparity_p99_px.has_value() == frame.disparity_max_px.has_value());
        if (frame.disparity_max_px) {
            // Percentiles are known to within a bin of the histogram.
            CHECK(*frame.disparity_p99_px <= *frame.disparity_max_px * (1.0 + 1.0 / 128.0));
            largest = std::max(largest, *frame.disparity_max_px);
            CHECK(frame.cache.images_shown > 0);
            shown = true;
        }
    }
    CHECK(shown);
    CHECK(*disparity.max_px == largest);

    RunReport report;
    REQUIRE(eval::add_to_report(*result, 0, report));
    CHECK(report.disparity_px.median == disparity.median_px);
    CHECK(report.disparity_px.p99 == disparity.p99_px);
    CHECK(report.disparity_px.max == disparity.max_px);
    CHECK(report.disparity_px.bound == disparity.bound_px);
    CHECK(report.disparity_px.over_bound == disparity.over_bound);
    CHECK(report.disparity_px.tightness == disparity.tightness);
    CHECK(*report.work.images_created == made);
    CHECK(*report.memory.image_bytes_peak > 0);
    CHECK(*report.memory.aov_bytes > 0);
    CHECK(*report.memory.image_bytes_peak == cache.statistics().image_bytes_peak);
}

TEST_CASE("what technique and reference share on one backend does not change it", "[walk]") {
    // The same cache on the same walk: alone, and beside plain geometry on its own backend.
    constexpr int kFrames = 12;
    const auto item_frames = farfield::item_frames(world().scene);
    std::vector<std::vector<farfield::Picture>> pictures;
    for (const bool shared : {false, true}) {
        const auto backend = caster();
        const auto other = caster();
        ImageCache cache = image_cache(2.0);
        Contender contender;
        contender.name = "images";
        contender.planner = images(cache);
        contender.backend = backend.get();
        WalkSetup setup = setup_of({&contender, 1}, item_frames);
        setup.reference = shared ? backend.get() : other.get();
        std::vector<farfield::Picture>& drawn = pictures.emplace_back();
        WalkObserver observer;
        observer.on_pictures = [&](const WalkPictures& seen) {
            drawn.push_back(seen.picture);
            drawn.push_back(seen.reference);
            return farfield::Result<void>{};
        };
        REQUIRE(eval::walk(
            setup, {.frames = kFrames, .reference_every = 5, .picture_every = 1}, observer
        ));
    }
    REQUIRE(pictures[0].size() == std::size_t{2} * kFrames);
    CHECK(pictures[0] == pictures[1]);
}

TEST_CASE("more samples are nearer to the truth, and as many are the truth", "[walk]") {
    const auto item_frames = farfield::item_frames(world().scene);
    const auto one = caster();
    const auto two = caster();
    const auto four = caster();
    const auto truth = caster();
    CulledGeometry geometry(world().hierarchy);
    std::vector<Contender> contenders(3);
    for (std::size_t i = 0; i < contenders.size(); ++i) {
        contenders[i].name = std::to_string(i);
        contenders[i].planner = plain(geometry);
        contenders[i].backend = std::vector{one.get(), two.get(), four.get()}[i];
        contenders[i].samples = 1 << i;
    }
    WalkSetup setup = setup_of(contenders, item_frames);
    setup.reference = one.get();
    setup.truth = truth.get();
    setup.truth_samples = 4;
    const auto result = eval::walk(setup, {.frames = 4, .reference_every = 1});
    REQUIRE(result);
    REQUIRE(result->reference_truth.size() == 4);
    for (std::size_t frame = 0; frame < 4; ++frame) {
        CAPTURE(frame);
        const auto errors = [&](std::size_t contender) -> const PictureErrors& {
            return *result->contenders[contender].frames[frame].truth;
        };
        CHECK(errors(2).psnr_db == eval::kMaxPsnrDb);
        CHECK(*errors(2).flip == 0.0);
        CHECK(errors(1).psnr_db > errors(0).psnr_db + 1.0);
        CHECK(*errors(1).flip < *errors(0).flip);
        // The first contender draws what the reference draws.
        CHECK(errors(0).psnr_db == result->reference_truth[frame].psnr_db);
        CHECK(errors(0).flip == result->reference_truth[frame].flip);
        CHECK(result->contenders[0].frames[frame].image->psnr_db == eval::kMaxPsnrDb);
    }
    std::vector<RunReport> reports(2);
    REQUIRE(eval::add_to_report(*result, 0, reports[0]));
    REQUIRE(eval::add_to_report(*result, 2, reports[1]));
    CHECK(reports[0].truth.psnr_db_median == reports[0].truth.reference_psnr_db_median);
    CHECK(*reports[1].truth.psnr_db_median == eval::kMaxPsnrDb);
    CHECK(reports[1].truth.reference_psnr_db_median == reports[0].truth.reference_psnr_db_median);
}
