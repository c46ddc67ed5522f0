// Repeats the experiments of Chamberlain et al., "Fast Rendering of Complex Environments Using a
// Spatial Hierarchy", 1996, section 5: what octrees of colour cubes take (table 1), what they save
// (table 2), how their cost grows with the scene (figure 5) and how surfaces tear (plate 4); and
// what the paper has no figures of: errors against the truth, covered area, slow motion.
#include "run/backends.hpp"
#include "run/page.hpp"
#include "run/program.hpp"
#include "run/technique.hpp"
#include "run/world.hpp"
#include <farfield/eval/flip.hpp>
#include <farfield/eval/frame_plot.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/io/color_cube_file.hpp>
#include <farfield/io/png.hpp>

#include <CLI/CLI.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using run::Page;

struct Options {
    std::string only;
    std::string out = "chamberlain1996";
    std::string backend = "opengl";
    std::string molecule = "molecule"; ///< scene, or a .pdb file
    int repeats = 7;
    int most_trees = 16384;
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

double ms_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

/// One world with what draws it.
class Stage {
  public:
    static Result<std::unique_ptr<Stage>>
    create(const Options& options, const run::WorldOptions& world_options) {
        std::unique_ptr<Stage> stage(new Stage);
        auto world = run::load_world(world_options);
        if (!world) {
            return tl::unexpected(std::move(world).error());
        }
        stage->world_ = std::move(*world);
        stage->backends_ = std::make_unique<run::Backends>(stage->world_);
        auto drawing = stage->backends_->make(options.backend);
        if (!drawing) {
            return tl::unexpected(std::move(drawing).error());
        }
        stage->drawing_ = *drawing;
        auto truth = stage->backends_->make("embree");
        if (!truth) {
            return tl::unexpected(std::move(truth).error());
        }
        stage->truth_ = *truth;
        stage->geometry_ = std::make_unique<CulledGeometry>(stage->world_.hierarchy);
        stage->stored_ =
            std::make_unique<CulledGeometry>(stage->world_.hierarchy, GeometryOrder::stored);
        stage->backend_name_ = options.backend;
        return stage;
    }

    [[nodiscard]] const run::World& world() const noexcept { return world_; }
    [[nodiscard]] CulledGeometry& geometry() noexcept { return *geometry_; }

    /// Colour cubes of the world.
    Result<run::Technique> technique(run::RunOptions options) {
        options.technique = "color-cubes";
        options.backend = backend_name_;
        return run::Technique::create(world_, options, *drawing_);
    }

    /// Plans and draws once. [ms]
    template <typename Plan>
    Result<double> time(const Plan& plan, int samples) {
        auto target = target_of(*drawing_, samples);
        if (!target) {
            return tl::unexpected(target.error());
        }
        drawing_->finish();
        const auto start = std::chrono::steady_clock::now();
        const FramePlan& made = plan();
        if (auto drawn = drawing_->execute(made, *target, clear(world_.scene.sky)); !drawn) {
            return tl::unexpected(drawn.error());
        }
        drawing_->finish();
        return ms_since(start);
    }

    /// Plain geometry, the faster of both orders. [ms]
    /// Plain geometry, ordered from the front and as it is stored. [ms]
    Result<std::array<double, 2>> time_geometry(const View& view, int samples) {
        const auto sorted =
            time([&]() -> const FramePlan& { return geometry_->plan(view); }, samples);
        const auto stored =
            time([&]() -> const FramePlan& { return stored_->plan(view); }, samples);
        if (!sorted || !stored) {
            return tl::unexpected((sorted ? stored : sorted).error());
        }
        return std::array<double, 2>{*sorted, *stored};
    }

    Result<Picture> picture(const FramePlan& plan, int samples, bool truth = false) {
        return picture_over(plan, samples, truth, world_.scene.sky);
    }

    /// Covered area of a picture [px]: what of a black and of a white background does not show.
    Result<double> covered(const FramePlan& plan, int samples, bool truth = false) {
        const auto over_black = picture_over(plan, samples, truth, glm::vec3(0.0F));
        if (!over_black) {
            return tl::unexpected(over_black.error());
        }
        const auto over_white = picture_over(plan, samples, truth, glm::vec3(1.0F));
        if (!over_white) {
            return tl::unexpected(over_white.error());
        }
        double area = 0.0;
        for (std::size_t i = 0; i < over_black->rgba.size(); i += 4) {
            area += 1.0 - (over_white->rgba[i] - over_black->rgba[i]) / 255.0;
        }
        return area;
    }

  private:
    Stage() = default;

    static FrameClear clear(const glm::vec3& color) { return {true, glm::vec4(color, 1.0F)}; }

    Result<Picture>
    picture_over(const FramePlan& plan, int samples, bool truth, const glm::vec3& color) {
        Backend& backend = truth ? *truth_ : *drawing_;
        auto target = target_of(backend, samples);
        if (!target) {
            return tl::unexpected(target.error());
        }
        if (auto drawn = backend.execute(plan, *target, clear(color)); !drawn) {
            return tl::unexpected(drawn.error());
        }
        return backend.read_target(*target);
    }

    Result<TargetId> target_of(Backend& backend, int samples) {
        for (const Made& made : targets_) {
            if (made.backend == &backend && made.samples == samples) {
                return made.target;
            }
        }
        auto target = backend.create_target(world_.width, world_.height, samples);
        if (target) {
            targets_.push_back({&backend, samples, *target});
        }
        return target;
    }

    struct Made {
        Backend* backend = nullptr;
        int samples = 1;
        TargetId target{};
    };

    run::World world_;
    std::unique_ptr<run::Backends> backends_;
    Backend* drawing_ = nullptr;
    Backend* truth_ = nullptr;
    std::string backend_name_;
    std::unique_ptr<CulledGeometry> geometry_;
    std::unique_ptr<CulledGeometry> stored_;
    std::vector<Made> targets_;
};

/// What one way of drawing a view comes to.
struct Measured {
    double ms = 0.0;
    double geometry_ms = 0.0; ///< plain geometry, beside it
    double speedup = 0.0;     ///< median of ratios of neighbouring frames
    double psnr_db = 0.0;     ///< to the truth
    double flip = 0.0;        ///< to the truth
    double extra_area = 0.0;  ///< covered, over that of the truth, less 1
};

struct Way {
    std::string name;
    int samples = 1;
    run::Technique* technique = nullptr; ///< null: plain geometry
};

/// @param once geometry takes minutes: one frame, in one order, without warming up
Result<Measured>
measure(Stage& stage, const Way& way, const View& view, int repeats, bool once = false) {
    const auto plan = [&]() -> const FramePlan& {
        return way.technique != nullptr ? way.technique->planner().plan(view, Motion{})
                                        : stage.geometry().plan(view);
    };
    Measured result;
    std::vector<double> times;
    std::array<std::vector<double>, 2> geometry_times; // by order
    const auto sorted = [&]() -> const FramePlan& { return stage.geometry().plan(view); };
    for (int i = once ? 0 : -1; i < repeats; ++i) {
        std::array<double, 2> geometry_ms{};
        if (!once) {
            const auto both = stage.time_geometry(view, way.samples);
            if (!both) {
                return tl::unexpected(both.error());
            }
            geometry_ms = *both;
        } else if (i == 0) {
            const auto one = stage.time(sorted, way.samples);
            if (!one) {
                return tl::unexpected(one.error());
            }
            geometry_ms = {*one, *one};
        } else {
            geometry_ms = {geometry_times[0].front(), geometry_times[1].front()};
        }
        const auto ms = stage.time(plan, way.samples);
        if (!ms) {
            return tl::unexpected(ms.error());
        }
        if (i >= 0) { // the first warms up
            times.push_back(*ms);
            geometry_times[0].push_back(geometry_ms[0]);
            geometry_times[1].push_back(geometry_ms[1]);
        }
    }
    // The faster order of all frames; of each frame, it would be the one that was less disturbed.
    const std::size_t faster = median(geometry_times[1]) < median(geometry_times[0]) ? 1 : 0;
    std::vector<double> ratios;
    for (std::size_t i = 0; i < times.size(); ++i) {
        ratios.push_back(geometry_times[faster][i] / times[i]);
    }
    result.ms = median(times);
    result.geometry_ms = median(geometry_times[faster]);
    result.speedup = median(ratios);
    constexpr int kTruthSamples = 16;
    const auto picture = stage.picture(plan(), way.samples);
    const auto truth = stage.picture(stage.geometry().plan(view), kTruthSamples, true);
    if (!picture || !truth) {
        return tl::unexpected((picture ? truth : picture).error());
    }
    const auto psnr = eval::psnr_db(*truth, *picture);
    const auto flip = eval::flip_map(*truth, *picture);
    const auto area = stage.covered(plan(), way.samples);
    const auto true_area = stage.covered(stage.geometry().plan(view), kTruthSamples, true);
    if (!psnr || !flip || !area || !true_area) {
        return fail(ErrorCode::device, "pictures of " + way.name + " cannot be compared");
    }
    result.psnr_db = *psnr;
    result.flip = eval::mean(*flip).value_or(0.0);
    result.extra_area = *area / *true_area - 1.0;
    return result;
}

/// The four distances of the paper: 1.75, 3.5, 7 and 14 radii.
constexpr std::array<int, 4> kDistances = {0, 40, 80, 120};
constexpr std::array<const char*, 4> kDistanceNames = {"1.75", "3.5", "7", "14"};

run::WorldOptions world_of(const std::string& scene, const std::string& size = "") {
    run::WorldOptions options;
    options.scene = scene;
    options.size = size;
    return options;
}

Result<void> table1(const Options& options, Page& page) {
    struct Row {
        const char* name;
        const char* scene;
        scenes::SceneValues values;
        std::uint32_t min_shared;
        double cube_cost; ///< 0: the default
        const char* paper;
    };
    const std::vector<Row> rows = {
        {"tree", "tree", {}, 256, 0, "9 levels, 6,967 nodes, 1.0 MB (19.4 B), 412 s"},
        {"molecule, an octree for each element", "molecule", {}, 256, 0, ""},
        {"molecule, balls as primitives",
         "molecule",
         {},
         1U << 20U,
         13, // as many nodes as the paper's
         "25 levels, 343,483 nodes, 24.5 MB, 5,078 s"},
        {"island, 96 trees, instanced",
         "island",
         {{"trees", 96}, {"quarter-turns", 1}},
         256,
         0,
         ""},
        {"16,384 trees", "trees", {{"count", 16384}}, 256, 0, ""},
        {"forest, 64 trees of 52,470, each its own",
         "forest",
         {{"trees", 64}, {"tree-triangles", 52470}},
         256,
         0,
         "island: 15 levels, 238,321 nodes, 52.6 MB (14.4 B), 6,525 s"}};
    page.line("## Octrees (table 1)\n");
    page.line(
        "| scene | triangles | levels | cells | MB | B per triangle | built [s] | file [MB] | "
        "read [s] | the paper's |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|");
    for (const Row& row : rows) {
        run::WorldOptions world_options =
            world_of(std::string(row.scene) == "molecule" ? options.molecule : row.scene);
        world_options.scene_values = row.values;
        const auto world = run::load_world(world_options);
        if (!world) {
            return tl::unexpected(world.error());
        }
        run::CubeModelOptions model_options;
        model_options.min_shared = row.min_shared;
        if (row.cube_cost > 0.0) {
            model_options.build.cube_cost = row.cube_cost;
        }
        model_options.file =
            (std::filesystem::path(options.out) / (std::string(row.scene) + ".cubes")).string();
        std::error_code ignored;
        std::filesystem::remove(model_options.file, ignored);
        const auto built = run::make_color_cubes(*world, model_options);
        if (!built) {
            return tl::unexpected(built.error());
        }
        const double file_bytes =
            static_cast<double>(std::filesystem::file_size(model_options.file, ignored));
        const auto read = run::make_color_cubes(*world, model_options);
        if (!read) {
            return tl::unexpected(read.error());
        }
        std::filesystem::remove(model_options.file, ignored);
        std::size_t cells = 0;
        std::uint32_t levels = 0;
        for (const ColorCubeTree& tree : built->model.trees) {
            cells += tree.cells.size();
            levels = std::max(levels, tree.quality.depth + 1);
        }
        const auto bytes = static_cast<double>(memory_bytes(built->model));
        const auto triangles = static_cast<double>(world->triangles);
        page.line(
            "| %s | %.0f | %u | %zu | %.2f | %.2f | %.2f | %.2f | %.3f | %s |",
            row.name,
            triangles,
            levels,
            cells,
            bytes * 1e-6,
            bytes / triangles,
            built->build_s,
            file_bytes * 1e-6,
            read->read_s,
            row.paper
        );
    }
    page.line("");
    return {};
}

Result<void> table2(const Options& options, Page& page) {
    constexpr std::array<std::array<const char*, 4>, 2> kPaper = {
        {{"0.4", "0.5", "1.3", "5.4"}, {"0.5", "4.6", "25.9", "136.3"}}};
    page.line("## Speed-up over plain geometry, at several distances (table 2)\n");
    page.line("Samples a pixel: of both. Errors are against 16 samples a pixel.\n");
    page.line(
        "| scene | size | samples | radii | geometry [ms] | cubes [ms] | speed-up | the paper's "
        "| cells | cubes shown | triangles, items drawn | PSNR geometry, cubes [dB] | "
        "FLIP geometry, cubes | covered area, cubes |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    const std::array<std::string, 2> scene_names = {"tree", options.molecule};
    for (std::size_t s = 0; s < scene_names.size(); ++s) {
        for (const char* size : {"124x124", "640x480"}) {
            auto stage = Stage::create(options, world_of(scene_names[s], size));
            if (!stage) {
                return tl::unexpected(stage.error());
            }
            auto technique = (*stage)->technique({});
            if (!technique) {
                return tl::unexpected(technique.error());
            }
            const bool small = std::string(size) == "124x124";
            for (const int samples : small ? std::vector<int>{1, 4} : std::vector<int>{1}) {
                for (std::size_t d = 0; d < kDistances.size(); ++d) {
                    const View view = (*stage)->world().view(kDistances[d]);
                    const auto geometry = measure(**stage, {"geometry", samples, nullptr}, view, 1);
                    const auto cubes =
                        measure(**stage, {"cubes", samples, &*technique}, view, options.repeats);
                    if (!geometry || !cubes) {
                        return tl::unexpected((geometry ? cubes : geometry).error());
                    }
                    const ColorCubesStatistics& did = technique->cubes()->statistics();
                    page.line(
                        "| %s | %s | %d | %s | %.2f | %.2f | %.2f | %s | %llu | %llu | %llu, %llu "
                        "| "
                        "%.1f, %.1f | %.4f, %.4f | %+.1f %% |",
                        s == 0 ? "tree" : "molecule",
                        size,
                        samples,
                        kDistanceNames[d],
                        cubes->geometry_ms,
                        cubes->ms,
                        cubes->speedup,
                        small ? kPaper[s][d] : "",
                        static_cast<unsigned long long>(did.cells),
                        static_cast<unsigned long long>(did.cubes),
                        static_cast<unsigned long long>(did.triangles),
                        static_cast<unsigned long long>(did.items),
                        geometry->psnr_db,
                        cubes->psnr_db,
                        geometry->flip,
                        cubes->flip,
                        100.0 * cubes->extra_area
                    );
                }
            }
        }
    }
    page.line("");
    return {};
}

/// y = a + b x by least squares, and how much of the variance it explains.
struct Fit {
    double a = 0.0;
    double b = 0.0;
    double r_sq = 0.0;
};

Fit fit(const std::vector<double>& x, const std::vector<double>& y) {
    const auto n = static_cast<double>(x.size());
    double sx = 0.0;
    double sy = 0.0;
    double sxx = 0.0;
    double sxy = 0.0;
    double syy = 0.0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        sx += x[i];
        sy += y[i];
        sxx += x[i] * x[i];
        sxy += x[i] * y[i];
        syy += y[i] * y[i];
    }
    Fit result;
    result.b = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    result.a = (sy - result.b * sx) / n;
    const double spread = (n * sxx - sx * sx) * (n * syy - sy * sy);
    result.r_sq = spread > 0.0 ? (n * sxy - sx * sy) * (n * sxy - sx * sy) / spread : 1.0;
    return result;
}

Result<void> growth(const Options& options, Page& page) {
    page.line("## Growth with the scene (figure 5)\n");
    page.line(
        "The whole wood in view on 512x512 pixels. Always cubes, so that what is small is not "
        "drawn as geometry. Bytes are the distinct ones of the octrees that a frame reads.\n"
    );
    page.line(
        "| trees | triangles | model [MB] | built [s] | cells visited | KB read | cubes [ms] | "
        "geometry [ms] | speed-up | PSNR geometry, cubes [dB] | covered area |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|---|");
    FramePlot plot;
    plot.title = "Cost of a frame against the number of trees, 4 to the power of the abscissa";
    plot.value_title = "thousands of cells, MB read, and ms";
    plot.series = {{"cells visited [1000]", {}}, {"read [MB]", {}}, {"colour cubes [ms]", {}}};
    std::vector<double> steps;
    std::vector<double> cells;
    std::vector<double> bytes;
    for (int trees = 1; trees <= options.most_trees; trees *= 4) {
        run::WorldOptions world_options = world_of("trees");
        world_options.scene_values["count"] = trees;
        auto stage = Stage::create(options, world_options);
        if (!stage) {
            return tl::unexpected(stage.error());
        }
        run::RunOptions run_options;
        run_options.cubes.never_slower = false;
        run_options.cubes.count_bytes = true;
        auto counted = (*stage)->technique(run_options);
        run_options.cubes.count_bytes = false;
        auto technique = (*stage)->technique(run_options);
        if (!technique || !counted) {
            return tl::unexpected((technique ? counted : technique).error());
        }
        const View view = (*stage)->world().view(0);
        static_cast<void>(counted->planner().plan(view, Motion{}));
        const ColorCubesStatistics did = counted->cubes()->statistics();
        const bool large = trees > 1024;
        const auto cubes =
            measure(**stage, {"cubes", 1, &*technique}, view, options.repeats, large);
        const auto geometry = large ? cubes : measure(**stage, {"geometry", 1, nullptr}, view, 1);
        if (!cubes || !geometry) {
            return tl::unexpected((cubes ? geometry : cubes).error());
        }
        page.line(
            "| %d | %.0f | %.2f | %.2f | %llu | %.0f | %.2f | %.1f | %.2f | %s%.1f | %+.1f %% |",
            trees,
            static_cast<double>((*stage)->world().triangles),
            static_cast<double>(memory_bytes(technique->cube_model()->model)) * 1e-6,
            technique->cube_model()->build_s,
            static_cast<unsigned long long>(did.cells),
            static_cast<double>(did.bytes) * 1e-3,
            cubes->ms,
            cubes->geometry_ms,
            cubes->speedup,
            large ? "" : (std::to_string(geometry->psnr_db).substr(0, 4) + ", ").c_str(),
            cubes->psnr_db,
            100.0 * cubes->extra_area
        );
        steps.push_back(static_cast<double>(steps.size()));
        cells.push_back(static_cast<double>(did.cells));
        bytes.push_back(static_cast<double>(did.bytes));
        plot.series[0].values.emplace_back(cells.back() * 1e-3);
        plot.series[1].values.emplace_back(bytes.back() * 1e-6);
        plot.series[2].values.emplace_back(cubes->ms);
    }
    if (steps.size() > 2) {
        const Fit of_cells = fit(steps, cells);
        const Fit of_bytes = fit(steps, bytes);
        page.line(
            "\nFit of n trees: cells = %.0f + %.0f log4 n (R2 %.3f); bytes = %.0f + %.0f log4 n "
            "(R2 "
            "%.3f).\n",
            of_cells.a,
            of_cells.b,
            of_cells.r_sq,
            of_bytes.a,
            of_bytes.b,
            of_bytes.r_sq
        );
    }
    return eval::save(plot, std::filesystem::path(options.out) / "growth.svg");
}

/// Ways of building and drawing, over the distances of a scene.
Result<void> compare_ways(
    const Options& options,
    Page& page,
    const std::string& scene,
    const scenes::SceneValues& values,
    const std::string& size,
    const std::vector<int>& frames,
    bool pictures
) {
    struct Choice {
        const char* name;
        CubeColors colors;
        CubeDrawing drawing;
        CubeSheets sheets;
        int samples;
    };
    constexpr std::array<Choice, 7> kChoices = {{
        {"as published, faces", CubeColors::composed, CubeDrawing::faces, CubeSheets::blended, 4},
        {"as published, splats", CubeColors::composed, CubeDrawing::splats, CubeSheets::blended, 4},
        {"sampled, faces", CubeColors::sampled, CubeDrawing::faces, CubeSheets::blended, 4},
        {"sampled, splats", CubeColors::sampled, CubeDrawing::splats, CubeSheets::blended, 4},
        {"sampled, splats, opaque sheets",
         CubeColors::sampled,
         CubeDrawing::splats,
         CubeSheets::opaque,
         4},
        {"as published, splats", CubeColors::composed, CubeDrawing::splats, CubeSheets::blended, 1},
        {"sampled, splats, opaque sheets",
         CubeColors::sampled,
         CubeDrawing::splats,
         CubeSheets::opaque,
         1},
    }};
    run::WorldOptions world_options = world_of(scene, size);
    world_options.scene_values = values;
    auto stage = Stage::create(options, world_options);
    if (!stage) {
        return tl::unexpected(stage.error());
    }
    const int all = (*stage)->world().path.frame_count;
    page.line(
        "| %s, frame | way | samples | ms | speed-up | PSNR [dB] | FLIP | covered area |",
        scene.c_str()
    );
    page.line("|---|---|---|---|---|---|---|---|");
    for (const int frame : frames) {
        const View view = (*stage)->world().view(std::min(frame, all - 1));
        for (const int samples : {1, 4}) {
            const auto plain =
                measure(**stage, {"geometry", samples, nullptr}, view, options.repeats);
            if (!plain) {
                return tl::unexpected(plain.error());
            }
            page.line(
                "| %d | geometry | %d | %.2f | 1 | %.2f | %.4f | %+.2f %% |",
                frame,
                samples,
                plain->geometry_ms,
                plain->psnr_db,
                plain->flip,
                100.0 * plain->extra_area
            );
        }
        int number = 0;
        for (const Choice& choice : kChoices) {
            run::RunOptions run_options;
            run_options.cube_model.build.colors = choice.colors;
            run_options.cubes.drawing = choice.drawing;
            run_options.cubes.sheets = choice.sheets;
            run_options.cubes.never_slower = false;
            auto technique = (*stage)->technique(run_options);
            if (!technique) {
                return tl::unexpected(technique.error());
            }
            const auto cubes =
                measure(**stage, {choice.name, choice.samples, &*technique}, view, options.repeats);
            if (!cubes) {
                return tl::unexpected(cubes.error());
            }
            page.line(
                "| %d | %s | %d | %.2f | %.2f | %.2f | %.4f | %+.2f %% |",
                frame,
                choice.name,
                choice.samples,
                cubes->ms,
                cubes->speedup,
                cubes->psnr_db,
                cubes->flip,
                100.0 * cubes->extra_area
            );
            if (pictures) {
                const auto picture =
                    (*stage)->picture(technique->planner().plan(view, Motion{}), choice.samples);
                const auto truth = (*stage)->picture((*stage)->geometry().plan(view), 16, true);
                if (!picture || !truth) {
                    return tl::unexpected((picture ? truth : picture).error());
                }
                const std::string kind = scene + "_" + std::to_string(number++);
                if (auto written =
                        io::write_png(run::frame_file(options.out, kind, frame), *picture);
                    !written) {
                    return written;
                }
                if (auto written = io::write_png(
                        run::frame_file(options.out, scene + "_truth", frame), *truth
                    );
                    !written) {
                    return written;
                }
            }
        }
    }
    page.line("");
    return {};
}

/// Covered area over the distance, from above, summed over several turns: what one picture covers
/// depends on where its samples fall, more than on anything else.
Result<void> coverage(
    const Options& options, Page& page, const std::string& scene, const scenes::SceneValues& values
) {
    constexpr int kTurns = 12;
    constexpr double kAbove = 25.0 * std::numbers::pi / 180.0;
    run::WorldOptions world_options = world_of(scene, "256x256");
    world_options.scene_values = values;
    auto stage = Stage::create(options, world_options);
    if (!stage) {
        return tl::unexpected(stage.error());
    }
    run::RunOptions run_options;
    run_options.cubes.never_slower = false;
    auto cubes = (*stage)->technique(run_options);
    run_options.cube_model.build.colors = CubeColors::composed;
    auto published = (*stage)->technique(run_options);
    if (!cubes || !published) {
        return tl::unexpected((cubes ? published : cubes).error());
    }
    const run::World& world = (*stage)->world();
    const Box3d box = scene_bounds(world.scene);
    const glm::dvec3 middle = center(box);
    const double radius = glm::length(extent(box)) * 0.5;
    page.line(
        "| %s, radii | covered [px] | geometry, 1 sample | 4 samples | as published, splats, 4 "
        "samples | cubes, 1 sample | 4 samples |",
        scene.c_str()
    );
    page.line("|---|---|---|---|---|---|---|");
    for (const double distance : {1.75, 2.5, 3.5, 5.0, 7.0, 10.0, 14.0, 20.0}) {
        std::array<double, 5> areas{};
        double truth = 0.0;
        for (int turn = 0; turn < kTurns; ++turn) {
            const double yaw = 2.0 * std::numbers::pi * (turn + 0.3) / kTurns;
            const glm::dvec3 towards(
                std::cos(yaw) * std::cos(kAbove), std::sin(kAbove), std::sin(yaw) * std::cos(kAbove)
            );
            View view = world.view(0);
            const double away = distance * radius;
            view.lens.near_distance = std::max(away - 1.1 * radius, 1e-3 * away);
            view.lens.far_distance = away + 1.1 * radius;
            view = look_at(
                middle + towards * away, middle, world.scene.up, view.lens, view.width, view.height
            );
            const FramePlan geometry = (*stage)->geometry().plan(view);
            const auto by = [&](const Result<run::Technique>& technique) -> const FramePlan& {
                return technique->planner().plan(view, Motion{});
            };
            const std::array<Result<double>, 6> measured = {
                (*stage)->covered(geometry, 1),
                (*stage)->covered(geometry, 4),
                (*stage)->covered(by(published), 4),
                (*stage)->covered(by(cubes), 1),
                (*stage)->covered(by(cubes), 4),
                (*stage)->covered(geometry, 64, true)};
            for (std::size_t i = 0; i < measured.size(); ++i) {
                if (!measured[i]) {
                    return tl::unexpected(measured[i].error());
                }
                (i < areas.size() ? areas[i] : truth) += *measured[i];
            }
        }
        const auto over = [&](double area) { return 100.0 * (area / truth - 1.0); };
        page.line(
            "| %.2f | %.0f | %+.2f %% | %+.2f %% | %+.2f %% | %+.2f %% | %+.2f %% |",
            distance,
            truth / kTurns,
            over(areas[0]),
            over(areas[1]),
            over(areas[2]),
            over(areas[3]),
            over(areas[4])
        );
    }
    page.line("");
    return {};
}

Result<void> errors(const Options& options, Page& page) {
    page.line("## Speed against error\n");
    page.line(
        "Always cubes. Against 16 samples a pixel; the covered area is that over the truth's, "
        "less 1.\n"
    );
    if (auto done = compare_ways(options, page, "tree", {}, "124x124", {80, 120}, true); !done) {
        return done;
    }
    page.line("## Covered area\n");
    page.line(
        "Over that with 64 samples a pixel, less 1; 256x256 pixels, from 25 degrees above, 12 "
        "directions together. Always cubes.\n"
    );
    if (auto done = coverage(options, page, "grass", {{"ground", 0}}); !done) {
        return done;
    }
    if (auto done = coverage(options, page, "trees", {{"count", 16}}); !done) {
        return done;
    }
    return coverage(options, page, "tree", {});
}

Result<void> tearing(const Options& options, Page& page) {
    page.line("## Surfaces that tear (plate 4)\n");
    page.line("A closed surface, 45 degrees off an axis, dark where it should not be seen.\n");
    return compare_ways(options, page, "knot", {}, "256x256", {80, 120}, true);
}

/// Mean absolute difference of two pictures over what either shows of geometry. [0, 255]
double change(const Picture& a, const Picture& b, const glm::vec3& sky) {
    double sum = 0.0;
    double shown = 0.0;
    for (std::size_t i = 0; i < a.rgba.size(); i += 4) {
        bool covered = false;
        double difference = 0.0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double background = 255.0 * double{sky[static_cast<int>(c)]};
            covered = covered || std::abs(a.rgba[i + c] - background) > 1.0 ||
                      std::abs(b.rgba[i + c] - background) > 1.0;
            difference += std::abs(a.rgba[i + c] - b.rgba[i + c]) / 3.0;
        }
        if (covered) {
            sum += difference;
            shown += 1.0;
        }
    }
    return shown > 0.0 ? sum / shown : 0.0;
}

/// Mean colour of what a picture shows of geometry, over the whole picture. [0, 255]
double brightness(const Picture& picture) {
    double sum = 0.0;
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
        sum += (picture.rgba[i] + picture.rgba[i + 1] + picture.rgba[i + 2]) / 3.0;
    }
    return sum / (static_cast<double>(picture.rgba.size()) / 4.0);
}

Result<void> dolly(const Options& options, Page& page) {
    page.line("## A slow dolly\n");
    auto stage = Stage::create(options, world_of("tree", "124x124"));
    if (!stage) {
        return tl::unexpected(stage.error());
    }
    run::RunOptions run_options;
    run_options.cubes.never_slower = false;
    auto technique = (*stage)->technique(run_options);
    if (!technique) {
        return tl::unexpected(technique.error());
    }
    constexpr int kFrames = 360; // from 5.3 to 14 radii, 0.27 % a frame
    constexpr double kFirst = 64.0;
    constexpr double kLast = 120.0;
    constexpr int kSamples = 4;
    FramePlot plot;
    plot.title = "Change from frame to frame in a slow dolly";
    plot.value_title = "mean difference where a tree is shown [1/255]";
    plot.series = {{"colour cubes", {}}, {"geometry", {}}, {"truth", {}}};
    std::array<std::optional<Picture>, 3> before;
    std::array<double, 3> most{};
    std::array<double, 3> mean{};
    double most_jump = 0.0;
    std::optional<double> difference_before;
    for (int frame = 0; frame < kFrames; ++frame) {
        const double at = kFirst + (kLast - kFirst) * frame / (kFrames - 1);
        const PathPose pose = eval::pose_at((*stage)->world().path, at);
        View view = (*stage)->world().view(static_cast<int>(at));
        view = look_at(pose.eye, pose.target, pose.up, view.lens, view.width, view.height);
        const auto cubes = (*stage)->picture(technique->planner().plan(view, Motion{}), kSamples);
        const auto geometry = (*stage)->picture((*stage)->geometry().plan(view), kSamples);
        const auto truth = (*stage)->picture((*stage)->geometry().plan(view), 16, true);
        if (!cubes || !geometry || !truth) {
            return fail(ErrorCode::device, "the dolly cannot be drawn");
        }
        const std::array<const Picture*, 3> now = {&*cubes, &*geometry, &*truth};
        for (std::size_t i = 0; i < now.size(); ++i) {
            if (before[i]) {
                const double changed = change(*before[i], *now[i], (*stage)->world().scene.sky);
                plot.series[i].values.emplace_back(changed);
                most[i] = std::max(most[i], changed);
                mean[i] += changed / (kFrames - 1);
            } else {
                plot.series[i].values.emplace_back(std::nullopt);
            }
            before[i] = *now[i];
        }
        // A switch of level shows as a step of what cubes are off in the mean.
        const double off = brightness(*cubes) - brightness(*truth);
        if (difference_before) {
            most_jump = std::max(most_jump, std::abs(off - *difference_before));
        }
        difference_before = off;
        run::print_progress("dolly", frame, kFrames);
    }
    page.line(
        "Tree, 124x124 pixels, 4 samples, from 5.3 to 14 radii in %d frames: mean change from "
        "frame to frame where the tree is shown, mean and largest over the frames:\n",
        kFrames
    );
    page.line("| | mean [1/255] | largest [1/255] |");
    page.line("|---|---|---|");
    constexpr std::array<const char*, 3> kNames = {"colour cubes", "geometry", "truth, 16 samples"};
    for (std::size_t i = 0; i < kNames.size(); ++i) {
        page.line("| %s | %.2f | %.2f |", kNames[i], mean[i], most[i]);
    }
    page.line(
        "\nLargest step of the mean brightness of the picture against the truth's: %.3f/255.\n",
        most_jump
    );
    return eval::save(plot, std::filesystem::path(options.out) / "dolly.svg");
}

/// The island at several sizes, as the paper's plate 5.
Result<void> island(const Options& options, Page& page) {
    page.line("## The island, by the size of the picture\n");
    page.line("The paper's, 480 trees and 3.6 million triangles: 22.7 at 64x64, 1.7 at 1024x1024.\n"
    );
    page.line("| size | geometry [ms] | cubes [ms] | speed-up | cells | triangles, items | PSNR "
              "geometry, cubes [dB] |");
    page.line("|---|---|---|---|---|---|---|");
    for (const char* size : {"64x64", "128x128", "256x256", "512x512", "1024x1024"}) {
        run::WorldOptions world_options = world_of("island", size);
        world_options.scene_values = {{"quarter-turns", 1}};
        auto stage = Stage::create(options, world_options);
        if (!stage) {
            return tl::unexpected(stage.error());
        }
        auto technique = (*stage)->technique({});
        if (!technique) {
            return tl::unexpected(technique.error());
        }
        const View view = (*stage)->world().view(0);
        const auto geometry = measure(**stage, {"geometry", 1, nullptr}, view, 1);
        const auto cubes = measure(**stage, {"cubes", 1, &*technique}, view, 3);
        if (!geometry || !cubes) {
            return tl::unexpected((geometry ? cubes : geometry).error());
        }
        const ColorCubesStatistics& did = technique->cubes()->statistics();
        page.line(
            "| %s | %.1f | %.1f | %.2f | %llu | %llu, %llu | %.1f, %.1f |",
            size,
            cubes->geometry_ms,
            cubes->ms,
            cubes->speedup,
            static_cast<unsigned long long>(did.cells),
            static_cast<unsigned long long>(did.triangles),
            static_cast<unsigned long long>(did.items),
            geometry->psnr_db,
            cubes->psnr_db
        );
    }
    page.line("");
    return {};
}

Result<void> run_program(CLI::App& app, const std::function<void()>& parse) {
    struct Experiment {
        const char* name;
        Result<void> (*run)(const Options&, Page&);
    };
    constexpr std::array<Experiment, 7> kExperiments = {{
        {"table1", table1},
        {"table2", table2},
        {"growth", growth},
        {"errors", errors},
        {"tearing", tearing},
        {"dolly", dolly},
        {"island", island},
    }};
    Options options;
    std::vector<std::string> names;
    names.reserve(kExperiments.size());
    for (const Experiment& experiment : kExperiments) {
        names.emplace_back(experiment.name);
    }
    app.add_option("--only", options.only, "one experiment")->check(CLI::IsMember(names));
    app.add_option("--out", options.out, "folder for results");
    app.add_option("--backend", options.backend)->check(CLI::IsMember({"opengl", "embree"}));
    app.add_option("--molecule", options.molecule, "a .pdb file in place of the generated one");
    app.add_option("--repeats", options.repeats, "frames of which the median counts")
        ->check(CLI::Range(1, 1000));
    app.add_option("--most-trees", options.most_trees, "of the growth")
        ->check(CLI::Range(1, 4'194'304));
    parse();
    if (Result<void> made = run::make_folder(options.out); !made) {
        return made;
    }
    const std::string file = options.only.empty() ? "README.md" : options.only + ".md";
    Page page(std::filesystem::path(options.out) / file);
    for (const Experiment& experiment : kExperiments) {
        if (options.only.empty() || options.only == experiment.name) {
            if (Result<void> done = experiment.run(options, page); !done) {
                return done;
            }
        }
    }
    return {};
}

} // namespace

int main(int argc, char** argv) {
    run::keep_freed_memory();
    return run::run_program(
        "chamberlain",
        "Repeats the experiments of Chamberlain et al. 1996 with colour cubes.",
        argc,
        argv,
        run_program
    );
}
