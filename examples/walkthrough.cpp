// Walks through a scene with one technique, and reports speed and error. All that measures is in
// farfield::eval; this program turns options into a run.
#include "run/backends.hpp"
#include "run/program.hpp"
#include "run/technique.hpp"
#include "run/world.hpp"
#include <farfield/eval/camera_path.hpp>
#include <farfield/eval/heat_map.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/overlay.hpp>
#include <farfield/eval/run_report.hpp>
#include <farfield/eval/walk.hpp>
#include <farfield/io/png.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using farfield::run::World;

struct Options {
    run::WorldOptions world;
    run::RunOptions run;
    WalkOptions walk;
    int truth_samples = 0; ///< 0: no truth
    bool measure = false;
    std::string json;
    std::string frames_csv;
    std::string out;
    bool overlay = false;
    OverlayShow overlay_show = OverlayShow::statuses;
    bool overlay_zones = false;
};

/// The map of what the cache did with each node, on the frames whose pictures are written.
Result<void> write_overlay(
    const Options& options,
    const ImageCache& cache,
    const World& world,
    int frame,
    const View& view,
    const FramePlan& plan
) {
    std::vector<glm::dvec3> eyes;
    eyes.reserve(static_cast<std::size_t>(world.path.frame_count));
    for (int at = 0; at < world.path.frame_count; ++at) {
        eyes.push_back(eval::pose_at(world.path, at).eye);
    }
    BirdsEyeOptions map;
    map.show = options.overlay_show;
    map.error_scale_px = options.run.cache.error_px;
    map.with_surfaces = cache.surfaces() == SurfacePlacement::in_images;
    map.zones = options.overlay_zones;
    map.path = eyes;
    map.plan = &plan;
    const auto images = eval::images_of(cache);
    return io::write_png(
        run::frame_file(options.out, "map", frame),
        eval::birds_eye(
            world.hierarchy,
            {.statuses = cache.statuses(), .events = cache.events(), .images = images},
            view,
            map
        )
    );
}

void print_row(const char* name, std::optional<double> value, const char* unit) {
    if (value) {
        std::printf("  %-28s %12.2f %s\n", name, *value, unit);
    }
}

/// How many pixels of images are further off than promised, and which nodes they show.
void print_disparity(const std::optional<DisparitySummary>& disparity) {
    if (!disparity || disparity->image_pixels == 0) {
        return;
    }
    if (disparity->over_bound) {
        std::printf(
            "  %-28s %12.4f %% of %.1f million\n",
            "pixels over their promise",
            100.0 * static_cast<double>(*disparity->over_bound) /
                static_cast<double>(disparity->image_pixels),
            static_cast<double>(disparity->image_pixels) * 1e-6
        );
    }
    constexpr std::size_t kShown = 5;
    for (std::size_t i = 0; i < std::min(kShown, disparity->worst.size()); ++i) {
        const NodeOvershoot& worst = disparity->worst[i];
        std::printf(
            "    node %u, frame %d: %.2f px where %.2f were promised, %llu pixels\n",
            worst.node,
            worst.frame,
            worst.disparity_px,
            worst.promise_px,
            static_cast<unsigned long long>(worst.pixels)
        );
    }
}

void print_table(const RunReport& report, const WalkResult& result) {
    std::printf(
        "%s, %s on %s, %dx%d, %d frames\n",
        report.scene.name.c_str(),
        report.technique.c_str(),
        report.device.c_str(),
        report.width,
        report.height,
        report.frames
    );
    print_row("speed-up, overall", report.speedup.overall, "x");
    print_row("speed-up, without first", report.speedup.without_first, "x");
    print_row("speed-up, least", report.speedup.min, "x");
    print_row("speed-up, most", report.speedup.max, "x");
    print_row("frame, first", report.frame_ms.first, "ms");
    print_row("frame, median", report.frame_ms.median, "ms");
    print_row("frame, mean", report.frame_ms.mean, "ms");
    print_row("frame, p99", report.frame_ms.p99, "ms");
    print_row("frame, longest", report.frame_ms.max, "ms");
    print_row("geometry, first", report.reference_frame_ms.first, "ms");
    print_row("geometry, mean", report.reference_frame_ms.mean, "ms");
    print_row("planning, mean", report.plan_ms.mean, "ms");
    print_row("PSNR, median", report.image.psnr_db_median, "dB");
    print_row("PSNR, least", report.image.psnr_db_min, "dB");
    print_row("SSIM, median", report.image.ssim_median, "");
    print_row("FLIP, mean", report.image.flip_mean, "");
    if (!result.reference.empty()) {
        const auto holes = static_cast<double>(result.contenders[0].sky_holes);
        print_row("sky inside geometry, pixels", holes, "");
    }
    print_row("PSNR to the truth, median", report.truth.psnr_db_median, "dB");
    print_row("PSNR geometry to the truth", report.truth.reference_psnr_db_median, "dB");
    print_row("FLIP to the truth, mean", report.truth.flip_mean, "");
    print_row("disparity, median", report.disparity_px.median, "px");
    print_row("disparity, p99", report.disparity_px.p99, "px");
    print_row("disparity, largest", report.disparity_px.max, "px");
    print_row("disparity, promised at most", report.disparity_px.bound, "px");
    print_row("disparity, tightness", report.disparity_px.tightness, "");
    print_disparity(result.contenders[0].disparity);
    print_row("triangles a frame", report.work.triangles_per_frame, "");
    print_row("image quads a frame", report.work.image_quads_per_frame, "");
    if (report.work.images_created) {
        print_row("images made", static_cast<double>(*report.work.images_created), "");
    }
    if (report.work.keyframes) {
        print_row("keyframes made", static_cast<double>(*report.work.keyframes), "");
    }
    if (report.memory.image_bytes_peak) {
        constexpr double kMib = 1024.0 * 1024.0;
        print_row(
            "image memory, peak", static_cast<double>(*report.memory.image_bytes_peak) / kMib, "MiB"
        );
    }
}

/// Everything that is written for one frame.
Result<void> write_pictures(
    const Options& options,
    const World& world,
    const ImageCache* cache,
    const WalkPictures& pictures
) {
    const std::string& out = options.out;
    const int frame = pictures.frame;
    std::vector<std::pair<const char*, Picture>> files;
    files.emplace_back("frame", pictures.picture);
    files.emplace_back("reference", pictures.reference);
    constexpr double kAmplify = 4.0;
    auto difference = eval::difference_picture(pictures.reference, pictures.picture, kAmplify);
    if (!difference) {
        return tl::unexpected(difference.error());
    }
    files.emplace_back("difference", std::move(*difference));
    if (pictures.truth != nullptr) {
        files.emplace_back("truth", *pictures.truth);
    }
    if (pictures.disparity != nullptr) {
        HeatMapOptions heat;
        heat.bright = pictures.disparity->error_px.value_or(1.0);
        heat.unit = "px";
        auto map = eval::heat_map(pictures.disparity->map, heat);
        if (!map) {
            return tl::unexpected(map.error());
        }
        files.emplace_back("disparity", std::move(*map));
    }
    if (options.overlay && cache != nullptr) {
        Picture overlay = pictures.picture;
        NodeOverlayOptions nodes;
        nodes.show = options.overlay_show;
        nodes.error_scale_px = options.run.cache.error_px;
        nodes.with_surfaces = cache->surfaces() == SurfacePlacement::in_images;
        nodes.legend = true;
        const auto images = eval::images_of(*cache);
        eval::draw_nodes(
            overlay,
            world.hierarchy,
            {.statuses = cache->statuses(), .events = cache->events(), .images = images},
            world.view(frame),
            nodes
        );
        files.emplace_back("overlay", std::move(overlay));
    }
    for (const auto& [kind, picture] : files) {
        if (auto written = io::write_png(run::frame_file(out, kind, frame), picture); !written) {
            return written;
        }
    }
    return {};
}

Result<void> check(const Options& options) {
    const auto refused = [](const char* message) {
        return fail(ErrorCode::invalid_argument, message);
    };
    if (options.run.backend == "null" && options.walk.picture_every > 0) {
        return refused("--png: the null backend draws no pictures");
    }
    if (options.run.backend == "null" && (options.measure || options.truth_samples > 0)) {
        return refused("--measure, --truth: the null backend draws no pictures");
    }
    if (options.walk.picture_every > 0 && options.out.empty()) {
        return refused("--png: no folder, give one with --out");
    }
    if (options.overlay && options.walk.picture_every == 0) {
        return refused("--overlay: no frames, choose them with --png");
    }
    if (options.overlay_zones && !options.overlay) {
        return refused("--overlay-zones: no maps, draw them with --overlay");
    }
    if (options.overlay && options.run.technique != "image-cache") {
        return refused("--overlay: only image-cache has nodes to show");
    }
    if (options.truth_samples > 0 && options.walk.reference_every == 0) {
        return refused("--truth: no frames to compare, choose them with --reference");
    }
    return run::validate(options.run);
}

Result<void> run_walk(const Options& options) {
    if (Result<void> valid = check(options); !valid) {
        return valid;
    }
    run::WorldOptions world_options = options.world;
    world_options.levels = options.run.technique == "mesh-lod";
    auto world = run::load_world(world_options);
    if (!world) {
        return tl::unexpected(world.error());
    }
    if (Result<void> prepared = run::prepare(*world, options.run); !prepared) {
        return prepared;
    }
    run::Backends backends(*world, options.run.layers);
    const auto backend = backends.make(options.run.backend);
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    auto technique = run::Technique::create(*world, options.run, **backend);
    if (!technique) {
        return tl::unexpected(technique.error());
    }
    Contender contender;
    contender.name = options.run.technique;
    contender.planner = technique->planner();
    contender.backend = *backend;
    contender.samples = options.run.samples;
    contender.error_px = technique->promise_px();
    WalkSetup setup;
    setup.hierarchy = &world->hierarchy;
    setup.item_primitives = world->item_primitives;
    setup.item_frames = world->item_frames;
    setup.view = [&](int frame) { return world->view(frame); };
    if (!world->movers.empty()) {
        setup.before_frame = [&](int frame) -> Result<void> {
            if (Result<void> moved = world->move(frame); !moved) {
                return moved;
            }
            return backends.move();
        };
    }
    setup.clear.color = glm::vec4(world->scene.sky, 1.0F);
    if (options.measure) {
        const auto positions = backends.make(options.run.backend, true);
        if (!positions) {
            return tl::unexpected(positions.error());
        }
        contender.positions = *positions;
    }
    if (options.run.backend != "null") {
        setup.reference = *backend;
        setup.reference_samples = options.run.samples;
    }
    if (options.truth_samples > 0) {
        // Cast, since software OpenGL has no more than 4 samples.
        const auto truth = backends.make("embree");
        if (!truth) {
            return tl::unexpected(truth.error());
        }
        setup.truth = *truth;
        setup.truth_samples = options.truth_samples;
    }
    setup.contenders = std::span(&contender, 1);

    if (Result<void> made = run::make_folder(options.out); !made) {
        return made;
    }
    WalkObserver observer;
    observer.on_progress = [&](int frame, int frames) {
        run::print_progress(options.run.technique, frame, frames);
    };
    const ImageCache* cache = technique->cache();
    if (options.walk.picture_every > 0) {
        observer.on_pictures = [&](const WalkPictures& pictures) {
            return write_pictures(options, *world, cache, pictures);
        };
    }
    if (options.overlay && cache != nullptr) {
        observer.on_frame = [&](int frame, std::size_t, const View& view, const FramePlan& plan
                            ) -> Result<void> {
            return frame % options.walk.picture_every == 0
                       ? write_overlay(options, *cache, *world, frame, view, plan)
                       : Result<void>{};
        };
    }
    WalkOptions walk_options = options.walk;
    walk_options.frames = world->frames;
    const auto result = eval::walk(setup, walk_options, observer);
    if (!result) {
        return tl::unexpected(result.error());
    }
    RunReport report = run::report_of(*world);
    technique->add_to_report(report);
    report.device = contender.backend->device();
    if (Result<void> added = eval::add_to_report(*result, 0, report); !added) {
        return added;
    }
    if (!options.frames_csv.empty()) {
        if (Result<void> saved = eval::save_frames(*result, 0, options.frames_csv); !saved) {
            return saved;
        }
    }
    if (!options.json.empty()) {
        if (Result<void> saved = eval::save(report, options.json); !saved) {
            return saved;
        }
    }
    print_table(report, *result);
    return {};
}

Result<void> run_program(CLI::App& app, const std::function<void()>& parse) {
    Options options;
    run::add_scene_options(app, options.world);
    app.add_option("--technique", options.run.technique)
        ->check(CLI::IsMember(
            {"geometry", "mesh-lod", "image-cache", "color-cubes", "lod-sprite", "placement"}
        ));
    app.add_option("--backend", options.run.backend)
        ->check(CLI::IsMember({"opengl", "embree", "null"}));
    app.add_option(
        "--cost-model", options.run.cost_model, "file, or 'measure'; a stored one if not given"
    );
    app.add_option("--preset", options.run.preset)
        ->check(CLI::IsMember({"shade1996", "schaufler1996", "chen1999", "guaranteed-sprite"}));
    app.add_option("--error-px", options.run.cache.error_px, "largest displacement [px]");
    app.add_option("--frames", options.world.frames, "how many frames of the path, at its own pace")
        ->check(CLI::Range(1, 10'000'000));
    app.add_option("--whole-path", options.world.whole_path, "the whole path in this many frames")
        ->check(CLI::Range(1, 10'000'000));
    app.add_option("--fov-deg", options.world.fov_deg, "vertical field of view [degrees]");
    app.add_option("--step", options.world.step_m, "metres a frame of a default path");
    app.add_option("--samples", options.run.samples, "per pixel of the frame");
    app.add_option("--image-samples", options.run.cache.image_samples, "per texel of images");
    app.add_option("--levels", options.run.levels, "how mesh-lod simplifies")
        ->check(CLI::IsMember({"collapse", "cluster"}));
    app.add_option(
           "--truth", options.truth_samples, "also compare with geometry of so many samples a pixel"
    )
        ->check(CLI::Range(1, 64));
    app.add_flag(
        "--measure", options.measure, "draw each plan once more and measure its disparity"
    );
    app.add_option("--reference", options.walk.reference_every, "geometry on every Nth frame")
        ->check(CLI::Range(0, 10'000'000));
    app.add_option("--png", options.walk.picture_every, "pictures of every Nth frame into --out")
        ->check(CLI::Range(0, 10'000'000));
    app.add_option("--image-budget-mib", options.run.budget_mib, "memory for images [MiB]")
        ->check(CLI::Range(0, 1 << 20));
    app.add_flag("--exact-pixels", options.run.cache.exact_pixels);
    run::add_axis_options(app, options.run);
    run::add_cube_options(app, options.run);
    run::add_sprite_options(app, options.run);
    run::add_placement_options(app, options.run.placement);
    static const run::Names<opengl::LayerDrawing> drawings = {
        {"points", opengl::LayerDrawing::points}, {"warped", opengl::LayerDrawing::warped}};
    run::add_names(
        app, "--layers", options.run.layers, drawings, "how OpenGL draws layered images"
    );
    run::add_partition_options(app, options.world);
    app.add_option(
        "--overlap-px", options.run.cache.overlap_px, "least overlap of split surfaces [texels]"
    );
    app.add_option("--json", options.json, "file for all figures");
    app.add_option("--frames-csv", options.frames_csv, "file for the figures of every frame");
    app.add_option("--out", options.out, "folder for pictures");
    app.add_flag("--overlay", options.overlay, "also what each node did, in colours (with --png)");
    static const run::Names<OverlayShow> shows = {
        {"statuses", OverlayShow::statuses},
        {"events", OverlayShow::events},
        {"errors", OverlayShow::errors}};
    run::add_names(
        app, "--overlay-show", options.overlay_show, shows, "what its colours tell of nodes"
    );
    app.add_flag(
        "--overlay-zones", options.overlay_zones, "where images were made and are valid, on its map"
    );
    parse();
    return run_walk(options);
}

} // namespace

int main(int argc, char** argv) {
    run::keep_freed_memory();
    return run::run_program(
        "walkthrough",
        "Walks through a scene with one technique and reports speed against error.",
        argc,
        argv,
        run_program
    );
}
