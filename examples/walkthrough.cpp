// Walks through a scene with one technique, and reports speed and error. All that measures is in
// farfield::eval; this program turns options into a run.
#include "scenes/scene_catalog.hpp"
#include <farfield/eval/camera_path.hpp>
#include <farfield/eval/cost_model_file.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/overlay.hpp>
#include <farfield/eval/run_report.hpp>
#include <farfield/eval/walk.hpp>
#include <farfield/gpu/calibrate.hpp>
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/io/png.hpp>
#include <farfield/io/scene_file.hpp>
#include <farfield/opengl/context.hpp>
#include <farfield/opengl/opengl_backend.hpp>
#include <farfield/opengl/scene_source.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/technique/image_cache.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <malloc.h>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

namespace {

using namespace farfield;

struct Options {
    std::string scene = "island";
    std::map<std::string, double, std::less<>> scene_values;
    std::string technique = "image-cache";
    std::string preset = "shade1996";
    std::string backend = "opengl";
    std::string cost_model;
    ImageCacheOptions cache;
    std::uint64_t budget_mib = 64;
    std::string size;
    std::optional<double> fov_deg;
    std::string path;
    std::optional<double> step_m;
    std::string up;
    std::optional<int> frames;
    std::optional<int> whole_path;
    WalkOptions walk;
    partition::BspOptions bsp;
    std::optional<std::uint32_t> max_items;
    std::string json;
    std::string frames_csv;
    std::string out;
    bool overlay = false;
};

/// What is walked through, from the catalogue or from a file.
struct World {
    Scene scene;
    CameraPath path;
    double fov_deg = 60.0;
    int width = 640;
    int height = 480;
    std::uint32_t max_items = partition::BspOptions{}.max_items;
};

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
        .count();
}

Result<World> load_world(const Options& options) {
    World world;
    const auto catalog = scenes::scene_catalog();
    const bool known = std::any_of(catalog.begin(), catalog.end(), [&](const auto& entry) {
        return entry.name == options.scene;
    });
    if (known) {
        auto made = scenes::make_scene(options.scene, options.scene_values);
        if (!made) {
            return tl::unexpected(made.error());
        }
        world.scene = std::move(made->scene);
        world.path = std::move(made->path);
        world.fov_deg = made->fov_deg;
        world.width = made->width;
        world.height = made->height;
        world.max_items = made->max_items;
    } else {
        io::LoadOptions load;
        load.up = options.up == "z" ? io::UpAxis::z : io::UpAxis::y;
        auto loaded = io::load_scene(options.scene, load);
        if (!loaded) {
            return tl::unexpected(loaded.error());
        }
        for (const std::string& warning : loaded->warnings) {
            std::fprintf(stderr, "warning: %s\n", warning.c_str());
        }
        world.scene = std::move(loaded->scene);
    }
    if (!options.path.empty()) {
        auto path = eval::load_camera_path(options.path);
        if (!path) {
            return tl::unexpected(path.error());
        }
        world.path = std::move(*path);
    } else if (!known) {
        const Box3d box = scene_bounds(world.scene);
        const bool height_field = std::filesystem::path(options.scene).extension() == ".png";
        auto path = height_field ? eval::height_field_path(box)
                                 : eval::default_path(
                                       box,
                                       {.frames = std::max(options.frames.value_or(1200), 2),
                                        .step_m = options.step_m,
                                        .up = world.scene.up}
                                   );
        if (!path) {
            return tl::unexpected(path.error());
        }
        world.path = std::move(*path);
    }
    if (options.fov_deg) {
        if (!(*options.fov_deg > 0.0 && *options.fov_deg < 180.0)) {
            return fail(
                ErrorCode::invalid_argument,
                "--fov-deg is " + std::to_string(*options.fov_deg) +
                    ", expected more than 0 and less than 180 degrees"
            );
        }
        world.fov_deg = *options.fov_deg;
    }
    if (!options.size.empty()) {
        int width = 0;
        int height = 0;
        int read = 0;
        if (std::sscanf(options.size.c_str(), "%dx%d%n", &width, &height, &read) != 2 ||
            static_cast<std::size_t>(read) != options.size.size()) {
            return fail(
                ErrorCode::invalid_argument,
                "--size is '" + options.size + "', expected WIDTHxHEIGHT, as 640x480"
            );
        }
        if (width < 1 || height < 1) {
            return fail(
                ErrorCode::invalid_argument,
                "--size is '" + options.size + "', expected at least 1x1 pixels"
            );
        }
        world.width = width;
        world.height = height;
    }
    return world;
}

View make_view(const World& world, const CameraPose& pose, double scene_radius) {
    // Reverse-z in float keeps its precision over any range; the near plane only has to stay off
    // what the eye may touch.
    const double near_distance = scene_radius * 1e-4;
    const double far_distance = scene_radius * 16.0;
    const Lens lens = perspective_lens(
        world.fov_deg * std::numbers::pi / 180.0,
        static_cast<double>(world.width) / static_cast<double>(world.height),
        near_distance,
        far_distance
    );
    return look_at(pose.eye, pose.target, pose.up, lens, world.width, world.height);
}

Result<Hierarchy> build_hierarchy(const Scene& scene, partition::BspOptions options) {
    options.up = scene.up;
    std::vector<Object> objects;
    objects.reserve(scene.instances.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[index_of(scene.instances[i].mesh)];
        objects.push_back(
            {.bounds = item_bounds(scene, make_id<ItemId>(i)),
             .primitives = primitive_count(mesh),
             .splittable = mesh.splittable}
        );
    }
    return partition::build_bsp(
        objects,
        options,
        [&](std::uint32_t object, std::uint32_t primitive) {
            const Instance& instance = scene.instances[object];
            const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
            Box3d box;
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::vec3& p = mesh.positions[mesh.indices[std::size_t{primitive} * 3 + k]];
                box = unite(
                    box, instance.object_to_world * glm::dvec4(mesh.origin + glm::dvec3(p), 1.0)
                );
            }
            return box;
        }
    );
}

std::string frame_file(const std::string& out, const char* kind, int frame) {
    char name[64];
    std::snprintf(name, sizeof name, "%s_%05d.png", kind, frame);
    return (std::filesystem::path(out) / name).string();
}

/// The map of what each node did, on the frames whose pictures are written.
Result<void> write_overlay(
    const Options& options,
    const Hierarchy& hierarchy,
    const ImageCache& cache,
    const CameraPath& path,
    int frame,
    const View& view,
    const FramePlan& plan
) {
    if (frame % options.walk.picture_every != 0) {
        return {};
    }
    std::vector<glm::dvec3> eyes;
    eyes.reserve(static_cast<std::size_t>(path.frame_count));
    for (int at = 0; at < path.frame_count; ++at) {
        eyes.push_back(eval::pose_at(path, at).eye);
    }
    BirdsEyeOptions map;
    map.with_surfaces = cache.surfaces() == SurfacePlacement::in_images;
    map.path = eyes;
    map.plan = &plan;
    return io::write_png(
        frame_file(options.out, "map", frame),
        eval::birds_eye(hierarchy, cache.statuses(), view, map)
    );
}

void print_progress(int frame, int frames) {
    constexpr int kWidth = 40;
    const int filled = frame * kWidth / frames;
    std::fprintf(
        stderr,
        "\r[%.*s%*s] %d/%d",
        filled,
        "########################################",
        kWidth - filled,
        "",
        frame,
        frames
    );
    if (frame == frames) {
        std::fprintf(stderr, "\n");
    }
}

void print_row(const char* name, std::optional<double> value, const char* unit) {
    if (value) {
        std::printf("  %-28s %12.2f %s\n", name, *value, unit);
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
    if (result.compared) {
        print_row("sky inside geometry, pixels", static_cast<double>(result.sky_holes), "");
    }
    print_row("triangles a frame", report.work.triangles_per_frame, "");
    print_row("image quads a frame", report.work.image_quads_per_frame, "");
    if (report.work.images_created) {
        print_row("images made", static_cast<double>(*report.work.images_created), "");
    }
    if (report.memory.image_bytes_peak) {
        constexpr double kMib = 1024.0 * 1024.0;
        print_row(
            "image memory, peak", static_cast<double>(*report.memory.image_bytes_peak) / kMib, "MiB"
        );
    }
}

/// A backend and what it stands on, in the order in which they may go.
struct Device {
    std::optional<opengl::HeadlessContext> context;
    std::unique_ptr<opengl::SceneSource> source;
    std::unique_ptr<Backend> backend;
};

Result<Device> make_device(
    const std::string& name,
    const Scene& scene,
    const Hierarchy& hierarchy,
    std::span<const std::uint64_t> item_primitives
) {
    Device device;
    if (name == "null") {
        device.backend = std::make_unique<NullBackend>(item_primitives, &hierarchy);
        return device;
    }
    auto context = opengl::HeadlessContext::create();
    if (!context) {
        return tl::unexpected(context.error());
    }
    device.context.emplace(std::move(*context));
    auto source = opengl::SceneSource::create(scene, &hierarchy);
    if (!source) {
        return tl::unexpected(source.error());
    }
    device.source = std::move(*source);
    auto backend = opengl::OpenGLBackend::create(*device.source);
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    device.backend = std::move(*backend);
    return device;
}

/// The model of a file, one measured now, or the default.
Result<CostModel> choose_cost_model(
    const std::string& choice,
    Backend& backend,
    const Hierarchy& hierarchy,
    std::span<const std::uint64_t> item_primitives
) {
    if (choice.empty()) {
        return CostModel{};
    }
    if (choice == "measure") {
        return gpu::calibrate(backend, hierarchy, item_primitives);
    }
    return eval::load_cost_model(choice);
}

Result<void> run(const Options& options) {
    if (options.backend == "null" && options.walk.picture_every > 0) {
        return fail(ErrorCode::invalid_argument, "--png: the null backend draws no pictures");
    }
    if (options.walk.picture_every > 0 && options.out.empty()) {
        return fail(ErrorCode::invalid_argument, "--png: no folder, give one with --out");
    }
    if (options.overlay && options.walk.picture_every == 0) {
        return fail(ErrorCode::invalid_argument, "--overlay: no frames, choose them with --png");
    }
    auto world = load_world(options);
    if (!world) {
        return tl::unexpected(world.error());
    }
    const Scene& scene = world->scene;
    const Box3d box = scene_bounds(scene);
    const double radius = glm::length(extent(box)) / 2.0;

    WalkOptions walk_options = options.walk;
    walk_options.frames =
        options.whole_path.value_or(options.frames.value_or(world->path.frame_count));
    if (!options.whole_path && walk_options.frames > world->path.frame_count) {
        return fail(
            ErrorCode::invalid_argument,
            "--frames is " + std::to_string(walk_options.frames) + ", the path has " +
                std::to_string(world->path.frame_count) +
                " (--whole-path walks all of it in any number of frames)"
        );
    }
    const auto view = [&](int frame) {
        const double at = options.whole_path
                              ? eval::whole_path_frame(world->path, frame, *options.whole_path)
                              : frame;
        return make_view(*world, eval::pose_at(world->path, at), radius);
    };
    if (Result<void> valid = validate(view(0)); !valid) {
        return valid;
    }

    const auto build_begin = std::chrono::steady_clock::now();
    partition::BspOptions bsp = options.bsp;
    bsp.max_items = options.max_items.value_or(world->max_items);
    const auto hierarchy = build_hierarchy(scene, bsp);
    if (!hierarchy) {
        return tl::unexpected(hierarchy.error());
    }
    const double build_ms = milliseconds_since(build_begin);

    std::vector<std::uint64_t> item_primitives;
    for (const Instance& instance : scene.instances) {
        item_primitives.push_back(primitive_count(scene.meshes[index_of(instance.mesh)]));
    }
    const auto device = make_device(options.backend, scene, *hierarchy, item_primitives);
    if (!device) {
        return tl::unexpected(device.error());
    }
    const auto costs =
        choose_cost_model(options.cost_model, *device->backend, *hierarchy, item_primitives);
    if (!costs) {
        return tl::unexpected(costs.error());
    }

    std::optional<ImageCache> cache;
    ImageCacheOptions cache_options = presets::shade1996(options.cache);
    cache_options.validity = options.cache.validity;
    cache_options.costs = *costs;
    cache_options.image_budget_bytes = options.budget_mib << 20U;
    if (options.technique == "image-cache") {
        auto made = ImageCache::create(*hierarchy, cache_options);
        if (!made) {
            return tl::unexpected(made.error());
        }
        cache.emplace(std::move(*made));
    }

    if (options.backend == "null") {
        walk_options.reference_every = 0; // nothing to compare
    }
    WalkSetup setup;
    setup.backend = device->backend.get();
    setup.hierarchy = &*hierarchy;
    setup.item_primitives = item_primitives;
    setup.view = view;
    setup.cache = cache ? &*cache : nullptr;
    setup.clear.color = glm::vec4(scene.sky, 1.0F);

    if (!options.out.empty()) {
        std::error_code error;
        std::filesystem::create_directories(options.out, error);
        if (error) {
            return fail(
                ErrorCode::device,
                "cannot make the folder '" + options.out + "': " + error.message()
            );
        }
    }
    WalkObserver observer;
    if (isatty(STDERR_FILENO) != 0) {
        observer.on_progress = print_progress;
    }
    if (!options.out.empty() && walk_options.picture_every > 0) {
        observer.on_pictures = [&](const WalkPictures& pictures) -> Result<void> {
            const std::string& out = options.out;
            auto written =
                io::write_png(frame_file(out, "frame", pictures.frame), pictures.picture);
            if (written) {
                written =
                    io::write_png(frame_file(out, "reference", pictures.frame), pictures.reference);
                constexpr double kAmplify = 4.0;
                const auto difference =
                    eval::difference_picture(pictures.reference, pictures.picture, kAmplify);
                if (written && difference) {
                    written =
                        io::write_png(frame_file(out, "difference", pictures.frame), *difference);
                }
            }
            if (written && options.overlay && cache) {
                Picture overlay = pictures.picture;
                StatusOptions status;
                status.with_surfaces = cache->surfaces() == SurfacePlacement::in_images;
                eval::draw_status(
                    overlay, *hierarchy, cache->statuses(), view(pictures.frame), status
                );
                written = io::write_png(frame_file(out, "overlay", pictures.frame), overlay);
            }
            return written;
        };
    }

    if (options.overlay && cache && observer.on_pictures) {
        observer.on_frame = [&](int frame, const View& seen, const FramePlan& plan) {
            return write_overlay(options, *hierarchy, *cache, world->path, frame, seen, plan);
        };
    }

    const auto result = eval::walk(setup, walk_options, observer);
    if (!result) {
        return tl::unexpected(result.error());
    }

    RunReport report;
    report.scene.name = scene.name;
    report.scene.triangles = primitive_count(scene);
    report.scene.instances = scene.instances.size();
    report.scene.build_ms = build_ms;
    report.scene.nodes = hierarchy->nodes.size();
    report.scene.depth = hierarchy->quality.depth;
    report.technique = options.technique;
    report.preset = cache ? options.preset : "";
    report.backend = options.backend;
    report.device = device->backend->device();
    report.width = world->width;
    report.height = world->height;
    report.fov_deg = world->fov_deg;
    if (cache) {
        report.error_px = cache_options.error_px;
        report.cost_model = cache_options.costs;
        report.memory.image_budget_bytes = cache_options.image_budget_bytes;
    }
    report.memory.hierarchy_bytes = memory_bytes(*hierarchy);
    report.memory.scene_bytes = memory_bytes(scene);
    if (Result<void> added = eval::add_to_report(*result, report); !added) {
        return added;
    }
    if (!options.frames_csv.empty()) {
        if (Result<void> saved = eval::save_frames(*result, options.frames_csv); !saved) {
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

int walkthrough(int argc, char** argv) {
    // llvmpipe gives its memory back after every frame and asks for it again; that would be timed.
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
    mallopt(M_MMAP_THRESHOLD, 1 << 30);

    Options options;
    CLI::App app("Walks through a scene with one technique and reports speed against error.");
    app.add_option("--scene", options.scene, "island, or a file");
    app.add_option("--technique", options.technique)
        ->check(CLI::IsMember({"geometry", "image-cache"}));
    app.add_option("--backend", options.backend)->check(CLI::IsMember({"opengl", "null"}));
    app.add_option(
        "--cost-model", options.cost_model, "file, or 'measure'; a stored one if not given"
    );
    app.add_option("--preset", options.preset)->check(CLI::IsMember({"shade1996"}));
    app.add_option("--error-px", options.cache.error_px, "largest displacement [px]");
    app.add_option("--frames", options.frames, "how many frames of the path, at its own pace")
        ->check(CLI::Range(1, 10'000'000));
    app.add_option("--whole-path", options.whole_path, "the whole path in this many frames")
        ->check(CLI::Range(1, 10'000'000));
    app.add_option("--size", options.size, "WIDTHxHEIGHT [px]");
    app.add_option("--fov-deg", options.fov_deg, "vertical field of view [degrees]");
    app.add_option("--path", options.path, "JSON file of a camera path");
    app.add_option("--step", options.step_m, "metres a frame of a default path");
    app.add_option("--up", options.up, "axis that points up in a mesh file")
        ->check(CLI::IsMember({"y", "z"}));
    app.add_option("--samples", options.walk.samples, "per pixel of the frame");
    app.add_option("--image-samples", options.cache.image_samples, "per texel of images");
    app.add_option("--reference", options.walk.reference_every, "geometry on every Nth frame")
        ->check(CLI::Range(0, 10'000'000));
    app.add_option("--png", options.walk.picture_every, "pictures of every Nth frame into --out")
        ->check(CLI::Range(0, 10'000'000));
    app.add_option("--image-budget-mib", options.budget_mib, "memory for images [MiB]")
        ->check(CLI::Range(0, 1 << 20));
    app.add_flag("--exact-pixels", options.cache.exact_pixels);
    const std::map<std::string, SurfacePlacement> placements = {
        {"automatic", SurfacePlacement::automatic},
        {"in-images", SurfacePlacement::in_images},
        {"first", SurfacePlacement::first}};
    app.add_option("--surfaces", options.cache.surfaces, "where split surfaces are drawn")
        ->transform(CLI::CheckedTransformer(placements));
    const std::map<std::string, ImageValidity> validities = {
        {"angle", ImageValidity::angle}, {"zone", ImageValidity::zone}};
    app.add_option("--validity", options.cache.validity, "when images may still be shown")
        ->transform(CLI::CheckedTransformer(validities));
    app.add_option("--directions", options.bsp.directions, "of splitting planes around up");
    app.add_flag("--split-vertically", options.bsp.split_vertically, "splits storeys as well");
    app.add_option("--max-items", options.max_items, "kept whole rather than cut one");
    app.add_option(
        "--max-piece-primitives", options.bsp.max_piece_primitives, "of split surfaces in a leaf"
    );
    app.add_option(
        "--overlap-px", options.cache.overlap_px, "least overlap of split surfaces [texels]"
    );
    app.add_option("--inflation", options.bsp.inflation, "overlap of split surfaces [fraction]");
    app.add_option("--json", options.json, "file for all figures");
    app.add_option("--frames-csv", options.frames_csv, "file for the figures of every frame");
    app.add_option("--out", options.out, "folder for pictures");
    app.add_flag("--overlay", options.overlay, "also what each node did, in colours (with --png)");
    for (const auto& entry : farfield::scenes::scene_catalog()) {
        for (const auto& parameter : entry.parameters) {
            const std::string name(parameter.name);
            app.add_option_function<double>(
                "--" + name,
                [&options, name](double value) { options.scene_values[name] = value; },
                std::string(parameter.help)
            );
        }
    }
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const int status = app.exit(error);
        return status == 0 ? 0 : 2;
    }
    if (farfield::Result<void> done = run(options); !done) {
        std::fprintf(stderr, "walkthrough: %s\n", done.error().message.c_str());
        return 1;
    }
    return 0;
}

} // namespace

int main(int argc, char** argv) {
    // The library throws nothing, but its memory and the command line may.
    try {
        return walkthrough(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "walkthrough: %s\n", error.what());
    } catch (...) {
        std::fprintf(stderr, "walkthrough: ended by an unknown exception\n");
    }
    return 1;
}
