// Repeats the experiments of Schaufler and Stuerzlinger, "A Three Dimensional Image Cache for
// Virtual Reality", 1996, section 5: what an image cache does with its boxes on a diagonal walk
// through a flat scene, along a forest and into it, and what it saves; and what keeping images all
// around costs and brings when the head turns.
#include "run/backends.hpp"
#include "run/contact_sheet.hpp"
#include "run/program.hpp"
#include "run/technique.hpp"
#include "run/world.hpp"
#include "scenes/flat_town_path.hpp"
#include "scenes/forest_path.hpp"
#include <farfield/eval/frame_plot.hpp>
#include <farfield/eval/overlay.hpp>
#include <farfield/eval/walk.hpp>
#include <farfield/io/png.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/impostor_angles.hpp>
#include <farfield/metric/pixel_angle.hpp>

#include <CLI/CLI.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;

/// One experiment: a scene cut into boxes, and a motion.
struct Experiment {
    const char* name;
    const char* title;
    const char* scene;
    double pace_m; ///< [m a frame]
    std::uint32_t branching;
    std::uint32_t levels; ///< below the root
    int map_every;        ///< maps on every Nth frame; 0: none
    bool turn;            ///< on the spot, instead of the scene's walk
};

// The paper does not say how far its motions go. How much coherence there is depends on nothing
// else as much, so each is there twice: over the whole scene, and as far as one would walk.
constexpr std::array<Experiment, 7> kExperiments = {{
    {"flat", "Diagonally through a flat scene", "flat", scenes::kFlatTownPace, 4, 4, 6, false},
    {"flat-slow", "A slow walk in a flat scene", "flat", 1.0, 4, 4, 6, false},
    {"forest", "Sideways along a forest", "forest", scenes::kForestPace, 8, 3, 0, false},
    {"forest-slow", "Slowly sideways before a forest", "forest", 0.1, 8, 3, 0, false},
    {"zoom",
     "From a corner of a forest to its middle",
     "forest-zoom",
     scenes::kForestZoomPace,
     8,
     3,
     0,
     false},
    {"zoom-slow", "Slowly to the middle of a forest", "forest-zoom", 0.1, 8, 3, 0, false},
    {"turn", "A turn of the head in a flat scene", "flat", scenes::kFlatTownPace, 4, 4, 0, true},
}};

struct Options {
    run::RunOptions run;
    std::string size;
    std::optional<int> frames;
    std::string only;
    std::string out = "schaufler1996";
    bool no_measure = false;
};

/// The image that was furthest from where it belongs, and what its own tests said about it.
struct Worst {
    int frame = 0;
    std::uint32_t node = 0;
    double disparity_px = 0.0;
    double promise_px = 0.0;
    double distance_m = 0.0;
    double diagonal_m = 0.0;
    bool leaf = false;
    double trans_px = 0.0;    ///< alpha_trans over the mean angle of a pixel
    double size_px = 0.0;     ///< alpha_size over the mean angle of a pixel
    double pixel_share = 1.0; ///< angle of the pixel that is furthest off, over the mean one
};

/// What a walk leaves besides `WalkResult`, for one contender.
struct Record {
    std::vector<std::optional<double>> median_px;
    std::optional<Worst> worst;
};

/// One line of the table at the end.
struct Row {
    std::string name;
    std::size_t boxes = 0;
    RunReport figures;
    double memory_bytes = 0.0; ///< largest
};

/// Everything that one walk needs, in the order in which it goes.
struct Prepared {
    std::vector<run::Technique> techniques;
    std::vector<Contender> contenders;
};

std::string path_in(const Options& options, const std::string& file) {
    return (std::filesystem::path(options.out) / file).string();
}

/// All around once, from where the walk of the world is half over.
CameraPath turn_path(const run::World& world) {
    constexpr int kFrames = 90;
    const PathPose from = eval::pose_at(world.path, world.path.frame_count / 2.0);
    const glm::dvec3 ahead = from.target - from.eye;
    CameraPath path;
    path.frame_count = kFrames;
    for (int frame = 0; frame < kFrames; ++frame) {
        const double angle = 2.0 * std::numbers::pi * frame / kFrames;
        const double cosine = std::cos(angle);
        const double sine = std::sin(angle);
        PathKey key;
        key.frame = frame;
        key.eye = from.eye;
        key.target =
            from.eye +
            glm::dvec3(
                ahead.x * cosine - ahead.z * sine, ahead.y, ahead.x * sine + ahead.z * cosine
            );
        key.up = from.up;
        path.keys.push_back(key);
    }
    return path;
}

Result<run::World> load(const Options& options, const Experiment& experiment) {
    run::WorldOptions world_options;
    world_options.scene = experiment.scene;
    world_options.scene_values["pace"] = experiment.pace_m;
    world_options.size = options.size;
    world_options.partition = "kdtree";
    world_options.cells.branching = experiment.branching;
    world_options.cells.max_depth = experiment.levels;
    world_options.cells.max_primitives = 1; // always divided to the last level
    auto world = run::load_world(world_options);
    if (!world) {
        return world;
    }
    if (experiment.turn) {
        world->path = turn_path(*world);
    }
    world->frames = world->path.frame_count;
    if (options.frames) {
        world->frames = std::min(world->frames, *options.frames);
    }
    return world;
}

Result<void> add_contender(
    const Options& options,
    const run::World& world,
    const std::string& name,
    bool all_around,
    run::Backends& backends,
    Prepared& prepared
) {
    run::RunOptions run_options = options.run;
    run_options.cache.all_around = all_around;
    const auto backend = backends.make(run_options.backend);
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    auto technique = run::Technique::create(world, run_options, **backend);
    if (!technique) {
        return tl::unexpected(technique.error());
    }
    Contender contender;
    contender.name = name;
    contender.planner = technique->planner();
    contender.backend = *backend;
    contender.samples = run_options.samples;
    contender.error_px = technique->promise_px();
    if (!options.no_measure && run_options.backend != "null") {
        const auto positions = backends.make(run_options.backend, true);
        if (!positions) {
            return tl::unexpected(positions.error());
        }
        contender.positions = *positions;
    }
    prepared.techniques.push_back(std::move(*technique));
    prepared.contenders.push_back(std::move(contender));
    return {};
}

/// What the image of a node comes to for an eye, by the tests that say when it is made anew.
Worst examine(
    const run::World& world, const ImageCache& cache, int frame, const NodeDisparity& shown
) {
    const glm::dvec3 eye = world.view(frame).eye - world.hierarchy.origin;
    const Box3f cell = bounds(world.hierarchy.nodes[shown.node]);
    Worst worst;
    worst.frame = frame;
    worst.node = shown.node;
    worst.disparity_px = shown.disparity_px;
    worst.promise_px = shown.sampling_px;
    worst.leaf = is_leaf(world.hierarchy.nodes[shown.node]);
    worst.distance_m = distance(Box3d{glm::dvec3(cell.lo), glm::dvec3(cell.hi)}, eye);
    worst.diagonal_m = glm::length(glm::dvec3(extent(cell)));
    const std::optional<ImageFacts> image = cache.image_of(shown.node);
    if (!image) {
        return worst;
    }
    const Box3d box{glm::dvec3(image->box.lo), glm::dvec3(image->box.hi)};
    const glm::dvec3 viewpoint(image->viewpoint);
    if (is_error(metric::check(metric::impostor_plane(box, viewpoint), box, eye))) {
        return worst;
    }
    const double pixel =
        metric::mean_pixel_angle(world.fov_deg * std::numbers::pi / 180.0, world.height);
    worst.trans_px = metric::alpha_trans_corners_unchecked(box, viewpoint, eye) / pixel;
    worst.size_px = metric::alpha_size_corners_unchecked(box, viewpoint, eye) / pixel;
    // A small step outwards from the middle of the image, by its angle.
    const double focal_px =
        world.height / (2.0 * std::tan(world.fov_deg * std::numbers::pi / 360.0));
    const glm::dvec2 outwards(
        shown.x + 0.5 - world.width / 2.0, shown.y + 0.5 - world.height / 2.0
    );
    const double share = glm::dot(outwards, outwards) / (focal_px * focal_px);
    worst.pixel_share = 1.0 / (focal_px * (1.0 + share)) / pixel;
    return worst;
}

/// Keeps what the disparity of a frame adds.
void keep(
    const WalkPictures& pictures, const run::World& world, const ImageCache& cache, Record& record
) {
    record.median_px.emplace_back();
    if (pictures.disparity == nullptr) {
        return;
    }
    record.median_px.back() = pictures.disparity->histogram.percentile(0.5);
    for (const NodeDisparity& node : pictures.disparity->nodes) {
        if (!record.worst || node.disparity_px > record.worst->disparity_px) {
            record.worst = examine(world, cache, pictures.frame, node);
            record.worst->promise_px += pictures.disparity->error_px.value_or(0.0);
        }
    }
}

/// A map of the events of a frame.
Picture draw_map(
    const run::World& world,
    const ImageCache& cache,
    const View& view,
    std::span<const glm::dvec3> eyes,
    int side,
    bool legend
) {
    BirdsEyeOptions map;
    map.width = side;
    map.height = side;
    map.show = OverlayShow::events;
    map.path = eyes;
    map.legend = legend;
    map.line_px = legend ? 2.0F : 1.0F;
    const OverlayNodes nodes = {.statuses = cache.statuses(), .events = cache.events()};
    return eval::birds_eye(world.hierarchy, nodes, view, map);
}

/// One figure of every frame, by a function of the frame.
template <typename Figure>
FrameSeries
series_of(const std::string& name, const std::vector<WalkFrame>& frames, Figure figure) {
    FrameSeries series{name, {}};
    for (const WalkFrame& frame : frames) {
        series.values.emplace_back(figure(frame));
    }
    return series;
}

/// Bytes of the texels of all images.
double texture_bytes(const WalkFrame& frame) {
    constexpr double kTexel = 4.0;
    return kTexel * static_cast<double>(frame.cache.texels_used);
}

std::vector<FrameSeries> event_series(const std::vector<WalkFrame>& frames) {
    const auto count = [](std::uint32_t number) { return static_cast<double>(number); };
    return {
        series_of(
            "new",
            frames,
            [&](const WalkFrame& frame) {
                return count(frame.cache.images_created - frame.cache.images_combined);
            }
        ),
        series_of(
            "combined",
            frames,
            [&](const WalkFrame& frame) { return count(frame.cache.images_combined); }
        ),
        series_of(
            "reused",
            frames,
            [&](const WalkFrame& frame) { return count(frame.cache.images_reused); }
        ),
        series_of("impossible", frames, [&](const WalkFrame& frame) {
            return count(frame.cache.images_impossible);
        })};
}

FrameSeries time_series(const std::string& name, const std::vector<SampledTime>& times) {
    FrameSeries series{name, {}};
    for (const SampledTime& time : times) {
        series.values.resize(static_cast<std::size_t>(time.frame) + 1);
        series.values.back() = time.ms;
    }
    return series;
}

FrameSeries time_series(const std::string& name, const std::vector<WalkFrame>& frames) {
    return series_of(name, frames, [](const WalkFrame& frame) { return frame.frame_ms; });
}

/// Table and plots of one contender.
Result<void> write_figures(
    const Options& options,
    const std::string& name,
    const std::string& title,
    std::size_t boxes,
    const std::string& device,
    const ContenderResult& result,
    const Record& record
) {
    const std::vector<FrameSeries> events = event_series(result.frames);
    FramePlot plot;
    plot.title = title;
    plot.value_title = "images; memory in 100 kB";
    plot.series = events;
    plot.series.push_back(series_of("memory", result.frames, [](const WalkFrame& frame) {
        constexpr double kUnit = 100'000.0;
        return texture_bytes(frame) / kUnit;
    }));
    plot.levels = {{"boxes", static_cast<double>(boxes)}};
    plot.captions = {device + "."};
    if (Result<void> saved = eval::save(plot, path_in(options, name + "_events.svg")); !saved) {
        return saved;
    }
    std::vector<FrameSeries> table = events;
    table.push_back(series_of("texture_bytes", result.frames, texture_bytes));
    table.push_back(series_of("image_bytes", result.frames, [](const WalkFrame& frame) {
        return static_cast<double>(frame.cache.image_bytes);
    }));
    table.push_back(time_series("images_ms", result.frames));
    table.push_back(time_series("geometry_ms", result.reference));
    if (result.disparity) {
        plot.value_title = "disparity of images [px]";
        plot.series = {
            {"median", record.median_px},
            series_of(
                "p99", result.frames, [](const WalkFrame& frame) { return frame.disparity_p99_px; }
            ),
            series_of("largest", result.frames, [](const WalkFrame& frame) {
                return frame.disparity_max_px;
            })};
        plot.levels = {{"threshold", options.run.cache.error_px}};
        if (Result<void> saved = eval::save(plot, path_in(options, name + "_disparity.svg"));
            !saved) {
            return saved;
        }
        table.insert(table.end(), plot.series.begin(), plot.series.end());
        for (std::size_t column = table.size() - 3; column < table.size(); ++column) {
            table[column].name = "disparity_" + table[column].name + "_px";
        }
    }
    return eval::save_table(table, path_in(options, name + "_frames.csv"));
}

std::string cell(std::optional<double> value, const char* format) {
    char text[32] = "-";
    if (value) {
        std::snprintf(text, sizeof text, format, *value);
    }
    return text;
}

/// Why an image was so far off, as far as its own tests tell.
std::string cause_of(const Worst& worst, double threshold_px) {
    const bool trans = worst.trans_px > threshold_px;
    const bool size = worst.size_px > threshold_px;
    if (worst.disparity_px <= worst.promise_px) {
        return "within its promise, which pays for texels as well";
    }
    if (trans || size) {
        return trans && size ? "both are over the threshold"
               : trans       ? "alpha_trans is over the threshold"
                             : "alpha_size is over the threshold";
    }
    if (std::max(worst.trans_px, worst.size_px) > threshold_px * worst.pixel_share) {
        return "over the threshold for the pixel there, " + cell(worst.pixel_share, "%.2f") +
               " of the mean one";
    }
    return worst.leaf ? "neither is over the threshold, but both are there at once"
                      : "neither is over the threshold; images nested in it are not counted";
}

void print_worst(const Worst& worst, double threshold_px) {
    std::printf(
        "  furthest off: %.2f px where %.2f were promised, frame %d, node %u (%s), %.1f m across, "
        "%.1f m away;\n    alpha_trans %.2f px, alpha_size %.2f px: %s\n",
        worst.disparity_px,
        worst.promise_px,
        worst.frame,
        worst.node,
        worst.leaf ? "a leaf" : "of children",
        worst.diagonal_m,
        worst.distance_m,
        worst.trans_px,
        worst.size_px,
        cause_of(worst, threshold_px).c_str()
    );
}

/// A count of the whole walk as its mean a frame.
std::string mean_cell(std::optional<std::uint64_t> count, int frames) {
    return count ? cell(static_cast<double>(*count) / frames, "%.1f") : "-";
}

void print_header() {
    std::printf(
        "%-18s %6s %7s %9s %7s %11s %8s %8s %9s %9s %7s %7s\n",
        "a frame, on average",
        "boxes",
        "new",
        "combined",
        "reused",
        "impossible",
        "MB, most",
        "ms",
        "plain ms",
        "speed-up",
        "p99 px",
        "most px"
    );
}

void print_row(const Row& row) {
    const RunReport& figures = row.figures;
    const auto& work = figures.work;
    constexpr double kMegabyte = 1e6;
    std::printf(
        "%-18s %6zu %7s %9s %7s %11s %8.1f %8s %9s %9s %7s %7s\n",
        row.name.c_str(),
        row.boxes,
        mean_cell(work.new_count, figures.frames).c_str(),
        mean_cell(work.combined, figures.frames).c_str(),
        mean_cell(work.reused, figures.frames).c_str(),
        mean_cell(work.impossible, figures.frames).c_str(),
        row.memory_bytes / kMegabyte,
        cell(figures.frame_ms.mean, "%.2f").c_str(),
        cell(figures.reference_frame_ms.mean, "%.2f").c_str(),
        cell(figures.speedup.overall, "%.2f").c_str(),
        cell(figures.disparity_px.p99, "%.2f").c_str(),
        cell(figures.disparity_px.max, "%.2f").c_str()
    );
}

/// Boxes that images are made of: all nodes but the steps between a box and its children.
std::size_t count_boxes(const Hierarchy& hierarchy) {
    return static_cast<std::size_t>(std::count_if(
        hierarchy.nodes.begin(),
        hierarchy.nodes.end(),
        [](const HierarchyNode& node) { return node.image_level; }
    ));
}

/// Plots all drawing times of an experiment, and writes what each contender did.
Result<void> report(
    const Options& options,
    const Experiment& experiment,
    const run::World& world,
    const Prepared& prepared,
    const WalkResult& result,
    const std::vector<Record>& records,
    std::vector<Row>& rows
) {
    const bool drawn = options.run.backend != "null";
    const std::string device = prepared.contenders[0].backend->device();
    FramePlot times;
    times.title = experiment.title;
    times.value_title = "drawing time [ms]";
    times.captions = {device + "."};
    for (std::size_t i = 0; i < prepared.contenders.size(); ++i) {
        const ContenderResult& mine = result.contenders[i];
        Row row;
        row.name = experiment.name;
        if (prepared.contenders.size() > 1) {
            row.name += ", " + prepared.contenders[i].name;
        }
        std::string stem = row.name;
        std::replace(stem.begin(), stem.end(), ' ', '_');
        stem.erase(std::remove(stem.begin(), stem.end(), ','), stem.end());
        row.boxes = count_boxes(world.hierarchy);
        for (const WalkFrame& frame : mine.frames) {
            row.memory_bytes = std::max(row.memory_bytes, texture_bytes(frame));
        }
        row.figures = run::report_of(world);
        prepared.techniques[i].add_to_report(row.figures);
        row.figures.device = device;
        if (Result<void> added = eval::add_to_report(result, i, row.figures); !added) {
            return added;
        }
        if (!drawn) {
            row.figures.frame_ms = {}; // of planning alone
        }
        if (Result<void> saved = eval::save(row.figures, path_in(options, stem + ".json"));
            !saved) {
            return saved;
        }
        if (Result<void> written = write_figures(
                options,
                stem,
                std::string(experiment.title) +
                    (prepared.contenders.size() > 1 ? ", " + prepared.contenders[i].name : ""),
                row.boxes,
                device,
                mine,
                records[i]
            );
            !written) {
            return written;
        }
        times.series.push_back(time_series(prepared.contenders[i].name, mine.frames));
        rows.push_back(std::move(row));
    }
    if (!drawn) {
        return {};
    }
    times.series.push_back(time_series("plain geometry", result.contenders[0].reference));
    return eval::save(times, path_in(options, std::string(experiment.name) + "_times.svg"));
}

Result<void>
run_experiment(const Options& options, const Experiment& experiment, std::vector<Row>& rows) {
    const auto world = load(options, experiment);
    if (!world) {
        return tl::unexpected(world.error());
    }
    run::Backends backends(*world);
    Prepared prepared;
    const std::vector<std::pair<const char*, bool>> ways =
        experiment.turn
            ? std::vector<std::pair<const char*, bool>>{{"all around", true}, {"in view", false}}
            : std::vector<std::pair<const char*, bool>>{{"images", true}};
    for (const auto& [name, all_around] : ways) {
        if (Result<void> added =
                add_contender(options, *world, name, all_around, backends, prepared);
            !added) {
            return added;
        }
    }
    const bool drawn = options.run.backend != "null";
    WalkSetup setup;
    setup.contenders = prepared.contenders;
    setup.reference = drawn ? prepared.contenders[0].backend : nullptr;
    setup.reference_samples = options.run.samples;
    setup.hierarchy = &world->hierarchy;
    setup.item_primitives = world->item_primitives;
    setup.item_frames = world->item_frames;
    setup.view = [&](int frame) { return world->view(frame); };
    setup.clear.color = glm::vec4(world->scene.sky, 1.0F);

    std::vector<glm::dvec3> eyes;
    eyes.reserve(static_cast<std::size_t>(world->frames));
    for (int frame = 0; frame < world->frames; ++frame) {
        eyes.push_back(world->view(frame).eye);
    }
    std::vector<Record> records(prepared.contenders.size());
    std::vector<Picture> tiles;
    WalkObserver observer;
    observer.on_progress = [&](int frame, int frames) {
        run::print_progress(experiment.name, frame, frames);
    };
    observer.on_frame =
        [&](int frame, std::size_t, const View& view, const FramePlan&) -> Result<void> {
        if (experiment.map_every == 0 || frame % experiment.map_every != 0) {
            return {};
        }
        constexpr int kTile = 320;
        constexpr int kSide = 800;
        const ImageCache& cache = *prepared.techniques[0].cache();
        tiles.push_back(draw_map(*world, cache, view, eyes, kTile, false));
        return io::write_png(
            run::frame_file(options.out, std::string(experiment.name) + "_map", frame),
            draw_map(*world, cache, view, eyes, kSide, true)
        );
    };
    observer.on_pictures = [&](const WalkPictures& pictures) -> Result<void> {
        keep(
            pictures,
            *world,
            *prepared.techniques[pictures.contender].cache(),
            records[pictures.contender]
        );
        return {};
    };
    WalkOptions walk_options;
    walk_options.frames = world->frames;
    walk_options.reference_every = drawn ? 1 : 0;
    walk_options.picture_every = drawn ? 1 : 0;
    walk_options.perceptual_errors = false;
    const auto result = eval::walk(setup, walk_options, observer);
    if (!result) {
        return tl::unexpected(result.error());
    }
    if (!tiles.empty()) {
        constexpr int kColumns = 5;
        const std::string file = path_in(options, std::string(experiment.name) + "_maps.png");
        if (Result<void> written = io::write_png(file, run::contact_sheet(tiles, kColumns));
            !written) {
            return written;
        }
    }
    const std::size_t first = rows.size();
    if (Result<void> done = report(options, experiment, *world, prepared, *result, records, rows);
        !done) {
        return done;
    }
    for (std::size_t i = first; i < rows.size(); ++i) {
        print_row(rows[i]);
        if (records[i - first].worst) {
            print_worst(*records[i - first].worst, options.run.cache.error_px);
        }
    }
    return {};
}

Result<void> run_experiments(const Options& options) {
    if (Result<void> valid = run::validate(options.run); !valid) {
        return valid;
    }
    if (Result<void> made = run::make_folder(options.out); !made) {
        return made;
    }
    std::vector<Row> rows;
    print_header();
    for (const Experiment& experiment : kExperiments) {
        if (!options.only.empty() && options.only != experiment.name) {
            continue;
        }
        if (Result<void> done = run_experiment(options, experiment, rows); !done) {
            return fail(
                done.error().code, std::string(experiment.name) + ": " + done.error().message
            );
        }
    }
    std::printf("written to %s\n", options.out.c_str());
    return {};
}

Result<void> run_program(CLI::App& app, const std::function<void()>& parse) {
    Options options;
    options.run.preset = "schaufler1996";
    options.run.cache.error_px = 1.0;
    options.run.budget_mib = 256;
    std::vector<std::string> names;
    names.reserve(kExperiments.size());
    for (const Experiment& experiment : kExperiments) {
        names.emplace_back(experiment.name);
    }
    app.add_option("--backend", options.run.backend, "null counts events and draws nothing")
        ->check(CLI::IsMember({"opengl", "embree", "null"}));
    app.add_option("--only", options.only, "one experiment")->check(CLI::IsMember(names));
    app.add_option("--size", options.size, "WIDTHxHEIGHT [px]");
    app.add_option("--frames", options.frames, "the first so many of each experiment")
        ->check(CLI::Range(1, 10'000'000));
    app.add_option("--error-px", options.run.cache.error_px, "largest displacement [px]");
    app.add_option("--image-budget-mib", options.run.budget_mib, "memory for images [MiB]")
        ->check(CLI::Range(0, 1 << 20));
    app.add_flag("--no-measure", options.no_measure, "draw each plan only once; no disparity");
    app.add_option("--out", options.out, "folder for tables, plots and pictures");
    parse();
    return run_experiments(options);
}

} // namespace

int main(int argc, char** argv) {
    run::keep_freed_memory();
    return run::run_program(
        "schaufler",
        "Repeats the experiments of the three-dimensional image cache (Schaufler and "
        "Stuerzlinger 1996): its events, memory, drawing times and errors.",
        argc,
        argv,
        run_program
    );
}
