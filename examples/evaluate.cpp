// Walks through scenes with many techniques at once, and writes what they cost and how wrong they
// were: results.csv, report.html and its plots. All that measures is in farfield::eval.
#include "run/backends.hpp"
#include "run/evaluation.hpp"
#include "run/program.hpp"
#include "run/technique.hpp"
#include "run/world.hpp"
#include <farfield/eval/crop.hpp>
#include <farfield/eval/evaluation_report.hpp>
#include <farfield/eval/heat_map.hpp>
#include <farfield/eval/walk.hpp>
#include <farfield/io/png.hpp>

#include <CLI/CLI.hpp>
#include <glm/geometric.hpp>

#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;

struct Options {
    std::string plan;
    std::string out = "evaluation";
    std::string only;
    bool quick = false;
    bool whole_pictures = false;
    bool print = false;
};

/// The frame in which a run was furthest from the truth, as far as it was looked at.
struct WorstFrame {
    int frame = -1;
    double error = 0.0;
    Picture picture;
    Picture reference;
    std::optional<Picture> truth;
    std::optional<PixelMap> disparity;
};

/// How bad a frame is: by what can be seen, against the best there is.
double badness(const WalkFrame& frame) {
    if (frame.truth && frame.truth->flip) {
        return *frame.truth->flip;
    }
    return frame.image && frame.image->flip ? *frame.image->flip : 0.0;
}

void keep_if_worse(const WalkPictures& pictures, WorstFrame& worst) {
    const double error = badness(pictures.measured);
    if (worst.frame >= 0 && error <= worst.error) {
        return;
    }
    worst.frame = pictures.frame;
    worst.error = error;
    worst.picture = pictures.picture;
    worst.reference = pictures.reference;
    worst.truth.reset();
    worst.disparity.reset();
    if (pictures.truth != nullptr) {
        worst.truth = *pictures.truth;
    }
    if (pictures.disparity != nullptr) {
        worst.disparity = pictures.disparity->map;
    }
}

/// Pictures of the worst frame, or of the window in which it is furthest from the best there is.
Result<void> add_pictures(const WorstFrame& worst, double error_px, bool whole, EvaluatedRun& run) {
    if (worst.frame < 0) {
        return {};
    }
    run.worst_frame = worst.frame;
    const Picture& best = worst.truth ? *worst.truth : worst.reference;
    PictureWindow window{0, 0, best.width, best.height};
    if (!whole) {
        // Small enough for a page with many of them, large enough to see what is wrong.
        constexpr int kWidth = 80;
        constexpr int kHeight = 60;
        const auto found = eval::most_different_window(best, worst.picture, kWidth, kHeight);
        if (!found) {
            return tl::unexpected(found.error());
        }
        window = *found;
    }
    std::vector<std::pair<const char*, const Picture*>> pictures = {
        {"as drawn", &worst.picture}, {"plain geometry", &worst.reference}};
    if (worst.truth) {
        pictures.emplace_back("truth", &*worst.truth);
    }
    std::optional<Picture> disparity;
    if (worst.disparity) {
        HeatMapOptions heat;
        heat.bright = 2.0 * error_px;
        heat.unit = "px";
        heat.color_bar = false;
        auto map = eval::heat_map(*worst.disparity, heat);
        if (!map) {
            return tl::unexpected(std::move(map).error());
        }
        disparity = std::move(*map);
        pictures.emplace_back("disparity, brightest at twice the threshold", &*disparity);
    }
    for (const auto& [caption, picture] : pictures) {
        auto png = io::encode_png(eval::crop(*picture, window));
        if (!png) {
            return tl::unexpected(std::move(png).error());
        }
        run.pictures.push_back({caption, std::move(*png)});
    }
    return {};
}

std::string cell(std::optional<double> value, const char* format) {
    char text[32] = "-";
    if (value) {
        std::snprintf(text, sizeof text, format, *value);
    }
    return text;
}

void print_run(const EvaluatedRun& run) {
    const RunReport& figures = run.figures;
    std::printf(
        "  %-30s %9s ms %9s x %9s px %9s px %8s %8s dB\n",
        run.name.c_str(),
        cell(figures.frame_ms.mean, "%.2f").c_str(),
        cell(figures.speedup.overall, "%.2f").c_str(),
        cell(figures.disparity_px.p99, "%.2f").c_str(),
        cell(figures.disparity_px.max, "%.2f").c_str(),
        cell(figures.truth.flip_mean, "%.4f").c_str(),
        cell(figures.truth.psnr_db_median, "%.2f").c_str()
    );
    std::fflush(stdout);
}

/// Levels of every node below the root.
std::vector<int> levels_of(const Hierarchy& hierarchy) {
    std::vector<int> levels(hierarchy.nodes.size(), 0);
    for (std::size_t i = 0; i < hierarchy.nodes.size(); ++i) {
        if (!is_leaf(hierarchy.nodes[i])) {
            // Children follow their parents.
            const std::size_t child = hierarchy.nodes[i].first_child;
            levels[child] = levels[i] + 1;
            levels[child + 1] = levels[i] + 1;
        }
    }
    return levels;
}

/// The nodes that were furthest beyond their promise, and what they are.
std::vector<ReportOvershoot>
overshoots_of(const run::World& world, const DisparitySummary& disparity) {
    const std::vector<int> levels = levels_of(world.hierarchy);
    std::vector<ReportOvershoot> overshoots;
    overshoots.reserve(disparity.worst.size());
    for (const NodeOvershoot& worst : disparity.worst) {
        const HierarchyNode& node = world.hierarchy.nodes[worst.node];
        const Box3f box = bounds(node);
        const glm::vec3 eye = local_point(world.view(worst.frame).eye, world.hierarchy.origin);
        overshoots.push_back(
            {worst,
             levels[worst.node],
             is_leaf(node),
             static_cast<double>(glm::length(extent(box))),
             static_cast<double>(distance(box, eye))}
        );
    }
    return overshoots;
}

/// What is in one walk, in the order in which it goes.
struct Prepared {
    std::vector<run::Technique> techniques;
    std::vector<Contender> contenders;
};

/// @param references plain geometry is drawn by, one for each kind of backend; those missing are
/// made
Result<Prepared> prepare(
    const run::World& world,
    const run::ComparedWalk& walk,
    run::Backends& backends,
    std::map<std::string, Backend*>& references
) {
    Prepared prepared;
    for (const run::ComparedRun& compared : walk.runs) {
        const auto backend = backends.make(compared.options.backend);
        if (!backend) {
            return tl::unexpected(backend.error());
        }
        auto technique = run::Technique::create(world, compared.options, **backend);
        if (!technique) {
            return fail(technique.error().code, compared.name + ": " + technique.error().message);
        }
        Contender contender;
        contender.name = compared.name;
        contender.planner = technique->planner();
        contender.backend = *backend;
        contender.samples = compared.options.samples;
        Backend*& reference = references[compared.options.backend];
        if (reference == nullptr) {
            const auto made = backends.make(compared.options.backend);
            if (!made) {
                return tl::unexpected(made.error());
            }
            reference = *made;
        }
        contender.reference = reference;
        contender.error_px = technique->promise_px();
        if (compared.measure) {
            const auto positions = backends.make(compared.options.backend, true);
            if (!positions) {
                return tl::unexpected(positions.error());
            }
            contender.positions = *positions;
        }
        prepared.techniques.push_back(std::move(*technique));
        prepared.contenders.push_back(std::move(contender));
    }
    return prepared;
}

Result<void> run_walk(const run::ComparedWalk& walk, bool whole_pictures, Evaluation& evaluation) {
    auto world = run::load_world(walk.world);
    if (!world) {
        return tl::unexpected(world.error());
    }
    for (const run::ComparedRun& compared : walk.runs) {
        if (Result<void> made = run::prepare(*world, compared.options); !made) {
            return fail(made.error().code, compared.name + ": " + made.error().message);
        }
    }
    run::Backends backends(*world);
    std::map<std::string, Backend*> references;
    const auto reference = backends.make("opengl");
    if (!reference) {
        return tl::unexpected(reference.error());
    }
    references["opengl"] = *reference;
    const auto prepared = prepare(*world, walk, backends, references);
    if (!prepared) {
        return tl::unexpected(prepared.error());
    }
    WalkSetup setup;
    setup.contenders = prepared->contenders;
    setup.reference = *reference;
    setup.hierarchy = &world->hierarchy;
    setup.item_primitives = world->item_primitives;
    setup.item_frames = world->item_frames;
    setup.view = [&](int frame) { return world->view(frame); };
    setup.clear.color = glm::vec4(world->scene.sky, 1.0F);
    if (walk.truth_samples > 0) {
        const auto truth = backends.make("embree");
        if (!truth) {
            return tl::unexpected(truth.error());
        }
        setup.truth = *truth;
        setup.truth_samples = walk.truth_samples;
    }
    std::vector<WorstFrame> worst(walk.runs.size());
    WalkObserver observer;
    observer.on_progress = [&](int frame, int frames) {
        run::print_progress(walk.name, frame, frames);
    };
    observer.on_pictures = [&](const WalkPictures& pictures) -> Result<void> {
        keep_if_worse(pictures, worst[pictures.contender]);
        return {};
    };
    WalkOptions options;
    options.frames = world->frames;
    options.reference_every = walk.reference_every;
    options.reference_pictures = true;
    const auto result = eval::walk(setup, options, observer);
    if (!result) {
        return tl::unexpected(result.error());
    }

    EvaluatedRun plain;
    plain.walk = walk.name;
    plain.name = "geometry";
    plain.figures = run::report_of(*world);
    plain.figures.technique = "geometry";
    plain.figures.backend = "opengl";
    plain.figures.device = (*reference)->device();
    if (Result<void> added = eval::add_reference_to_report(*result, plain.figures); !added) {
        return added;
    }
    std::printf(
        "%s: %.1f million triangles, %d frames of %dx%d\n  %-30s %12s %11s %12s %12s %8s %11s\n",
        walk.name.c_str(),
        static_cast<double>(world->triangles) * 1e-6,
        world->frames,
        world->width,
        world->height,
        "",
        "mean frame",
        "speed-up",
        "disparity p99",
        "largest",
        "FLIP",
        "to the truth"
    );
    print_run(plain);
    evaluation.runs.push_back(std::move(plain));
    for (std::size_t i = 0; i < walk.runs.size(); ++i) {
        EvaluatedRun run;
        run.walk = walk.name;
        run.name = walk.runs[i].name;
        run.figures = run::report_of(*world);
        prepared->techniques[i].add_to_report(run.figures);
        run.figures.device = prepared->contenders[i].backend->device();
        if (Result<void> added = eval::add_to_report(*result, i, run.figures); !added) {
            return added;
        }
        for (const WalkFrame& frame : result->contenders[i].frames) {
            run.frame_ms.push_back(frame.frame_ms);
            if (walk.runs[i].measure) {
                run.disparity_p99_px.push_back(frame.disparity_p99_px);
            }
        }
        const double error_px = walk.runs[i].options.cache.error_px;
        if (Result<void> added = add_pictures(worst[i], error_px, whole_pictures, run); !added) {
            return added;
        }
        print_run(run);
        if (const auto& disparity = result->contenders[i].disparity) {
            run.overshoots = overshoots_of(*world, *disparity);
        }
        evaluation.runs.push_back(std::move(run));
    }
    return {};
}

Result<void> run_all(const Options& options) {
    if (!options.plan.empty() && (options.quick || options.print)) {
        return fail(
            ErrorCode::invalid_argument, "--quick and --print are of the built-in plan, not of one"
        );
    }
    if (options.print) {
        std::printf("%s\n", std::string(run::built_in_evaluation(options.quick)).c_str());
        return {};
    }
    const auto plan =
        options.plan.empty()
            ? run::parse_evaluation(run::built_in_evaluation(options.quick), "built-in evaluation")
            : run::load_evaluation(options.plan);
    if (!plan) {
        return tl::unexpected(plan.error());
    }
    Evaluation evaluation;
    evaluation.title = plan->title.empty() ? "Farfield: speed against error" : plan->title;
    evaluation.notes.push_back(
        options.plan.empty() ? std::string("Made by evaluate") + (options.quick ? " --quick" : "")
                             : "Made by evaluate " + options.plan
    );
    evaluation.notes.push_back(
        "All runs of a walk take turns, frame by frame, in one process. Speed-up is over plain "
        "geometry on the same device with as many samples."
    );
    for (const run::ComparedWalk& walk : plan->walks) {
        if (walk.truth_samples > 0 && (options.only.empty() || walk.name == options.only)) {
            evaluation.notes.push_back(
                walk.name + ": the truth is geometry cast with " +
                std::to_string(walk.truth_samples) + " samples a pixel."
            );
        }
    }

    const auto begin = std::chrono::steady_clock::now();
    bool any = false;
    for (const run::ComparedWalk& walk : plan->walks) {
        if (!options.only.empty() && walk.name != options.only) {
            continue;
        }
        any = true;
        if (Result<void> done = run_walk(walk, options.whole_pictures, evaluation); !done) {
            return fail(done.error().code, walk.name + ": " + done.error().message);
        }
        // After each walk, so that a run cut short leaves what it has.
        if (Result<void> written = eval::write_report(evaluation, options.out); !written) {
            return written;
        }
    }
    if (!any) {
        return fail(ErrorCode::not_found, "--only: no walk is named \"" + options.only + "\"");
    }
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::printf("%s/report.html after %.0f s\n", options.out.c_str(), seconds);
    return {};
}

Result<void> run_program(CLI::App& app, const std::function<void()>& parse) {
    Options options;
    app.add_option(
        "plan", options.plan, "JSON file of what to measure; a built-in one if not given"
    );
    app.add_option("--out", options.out, "folder for the report");
    app.add_option("--only", options.only, "only the walk of that name");
    app.add_flag("--quick", options.quick, "a small built-in evaluation of two minutes");
    app.add_flag(
        "--whole-pictures",
        options.whole_pictures,
        "pictures of the whole frame, not only of where it is worst"
    );
    app.add_flag("--print", options.print, "print the built-in evaluation, to begin with, and end");
    parse();
    return run_all(options);
}

} // namespace

int main(int argc, char** argv) {
    run::keep_freed_memory();
    return run::run_program(
        "evaluate",
        "Measures many techniques side by side and writes a report.",
        argc,
        argv,
        run_program
    );
}
