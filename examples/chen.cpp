// Repeats the experiments of Chen, Swan, Kuo, "LOD-Sprite Technique for Accelerated Terrain
// Rendering", 1999, section 4: keyframes, times and errors of a flight over a terrain (figures 7 to
// 12) and its pictures (13, 14); and what the paper has no figures of: how far points really are
// from their places, keyframes that are kept, made ahead or shown on other coarse models, real
// terrains, other models, and views that are hard.
#include "run/backends.hpp"
#include "run/contact_sheet.hpp"
#include "run/page.hpp"
#include "run/program.hpp"
#include "run/proxy.hpp"
#include "run/world.hpp"
#include <farfield/eval/camera_path.hpp>
#include <farfield/eval/crop.hpp>
#include <farfield/eval/frame_plot.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/run_report.hpp>
#include <farfield/eval/walk.hpp>
#include <farfield/io/png.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/policy/cost_model.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/lod_sprite.hpp>

#include <CLI/CLI.hpp>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace farfield;
using run::Page;

struct Options {
    std::string only;
    std::string out = "chen1999";
    std::string backend = "opengl";
    std::string height_field; ///< file; empty: none
    std::string mesh;         ///< file; empty: a generated one
    int repeats = 3;
    int laps = 10;
    std::optional<int> frames;
};

/// [frame] What foresees keyframes looks so far ahead, and makes one in so many tiles.
constexpr std::uint32_t kAhead = 12;
constexpr std::uint32_t kTiles = 8;
/// [s] of a frame of every walk.
constexpr double kFrameSeconds = 1.0 / 60.0;

using Pairs = std::vector<ProxyPair>;

/// One way to draw frames. Without pairs the coarse model alone, in its own colours.
struct Way {
    std::string name;
    const Pairs* pairs = nullptr;
    LodSpriteOptions options;
};

/// What is walked with which view, and what is measured.
struct WalkSpec {
    std::string name; ///< for progress
    int frames = 0;
    std::function<View(int)> view;
    int repeats = 1;          ///< of which the least time of every frame counts
    int reference_every = 20; ///< 0: no times and no pictures
    bool perceptual = true;
    bool positions = false;
};

/// Makes the scene of a world other than it is before anything is built over it.
using Change = void (*)(Scene& scene);

/// The hierarchy of a scene that was changed after it was loaded.
Result<Hierarchy> rebuild(const Scene& scene) {
    std::vector<Object> objects;
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
        {.up = scene.up},
        [&](std::uint32_t object, std::uint32_t primitive) {
            const Instance& instance = scene.instances[object];
            const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
            Box3d box;
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::dvec3 corner(mesh.positions[mesh.indices[std::size_t{primitive} * 3 + k]]
                );
                box = unite(
                    box,
                    glm::dvec3(instance.object_to_world * glm::dvec4(mesh.origin + corner, 1.0))
                );
            }
            return box;
        }
    );
}

/// One world with its coarse models and what draws it.
class Stage {
  public:
    static Result<std::unique_ptr<Stage>> create(
        const Options& options, const run::WorldOptions& world_options, Change change = nullptr
    ) {
        std::unique_ptr<Stage> stage(new Stage);
        auto loaded = run::load_world(world_options);
        if (!loaded) {
            return tl::unexpected(std::move(loaded).error());
        }
        run::World& world = stage->world_;
        world = std::move(*loaded);
        if (change != nullptr) {
            change(world.scene);
            auto hierarchy = rebuild(world.scene);
            if (!hierarchy) {
                return tl::unexpected(std::move(hierarchy).error());
            }
            world.hierarchy = std::move(*hierarchy);
        }
        stage->backend_name_ = options.backend;
        return stage;
    }

    /// What has heights gets a grid and a refined one, what has not a mesh that both stand for.
    /// Comes before anything is drawn.
    Result<void> make_pairs(bool heights) {
        auto fixed = run::make_proxies(world_, {.proxy = heights ? "grid" : "mesh"});
        if (!fixed) {
            return tl::unexpected(std::move(fixed).error());
        }
        fixed_ = std::move(*fixed);
        if (!heights) {
            return {};
        }
        auto refined = run::make_proxies(world_, {.proxy = "refined"});
        if (!refined) {
            return tl::unexpected(std::move(refined).error());
        }
        refined_ = std::move(*refined);
        return {};
    }

    [[nodiscard]] run::World& world() noexcept { return world_; }
    [[nodiscard]] const run::World& world() const noexcept { return world_; }
    [[nodiscard]] const Pairs& fixed() const noexcept { return fixed_; }
    [[nodiscard]] const Pairs& refined() const noexcept { return refined_; }
    [[nodiscard]] const std::string& backend_name() const noexcept { return backend_name_; }
    [[nodiscard]] FrameClear clear() const noexcept {
        return {true, glm::vec4(world_.scene.sky, 1.0F)};
    }

    /// A technique with the costs of the backend.
    [[nodiscard]] Result<LodSprite> sprite(const Way& way) const {
        LodSpriteOptions options = way.options;
        options.costs = backend_name_ == "embree" ? ray_casting_costs() : CostModel{};
        options.image_budget_bytes = std::uint64_t{256} << 20U;
        return LodSprite::create(world_.hierarchy, *way.pairs, options);
    }

    /// A plan of the coarse models of `fixed` alone.
    void plan_coarse(const View& view, FramePlan& plan) const {
        farfield::clear(plan);
        plan.origin = world_.hierarchy.origin;
        for (const ProxyPair& pair : fixed_) {
            plan.items.push_back(pair.coarse);
        }
        Command command;
        command.count = static_cast<std::uint32_t>(plan.items.size());
        plan.commands.push_back(command);
        Pass pass;
        pass.viewport = {0, 0, view.width, view.height};
        pass.scissor = pass.viewport;
        pass.view = view;
        pass.command_count = 1;
        plan.passes.push_back(pass);
    }

    /// Walks in several ways at once.
    [[nodiscard]] Result<WalkResult> walk(std::span<const Way> ways, const WalkSpec& spec) const;

  private:
    Stage() = default;
    [[nodiscard]] Result<WalkResult>
    walk_once(std::span<const Way> ways, const WalkSpec& spec, int repeat) const;

    run::World world_;
    Pairs fixed_;
    Pairs refined_;
    std::string backend_name_;
};

Result<WalkResult>
Stage::walk_once(std::span<const Way> ways, const WalkSpec& spec, int repeat) const {
    run::Backends backends(world_);
    std::vector<LodSprite> sprites;
    sprites.reserve(ways.size());
    std::vector<FramePlan> plans(ways.size());
    std::vector<Contender> contenders;
    for (std::size_t i = 0; i < ways.size(); ++i) {
        const Way& way = ways[i];
        Contender contender;
        contender.name = way.name;
        // Where nothing is timed or looked at, positions are all that has to be drawn.
        auto backend = backends.make(spec.reference_every > 0 ? backend_name_ : "null");
        if (!backend) {
            return tl::unexpected(std::move(backend).error());
        }
        contender.backend = *backend;
        if (spec.positions) {
            auto positions = backends.make(backend_name_, true);
            if (!positions) {
                return tl::unexpected(std::move(positions).error());
            }
            contender.positions = *positions;
            contender.error_px = way.options.error_px;
        }
        if (way.pairs == nullptr) {
            FramePlan* plan = &plans[i];
            contender.planner.plan =
                [this, plan](const View& view, const Motion& /*motion*/) -> const FramePlan& {
                plan_coarse(view, *plan);
                return *plan;
            };
        } else {
            auto made = sprite(way);
            if (!made) {
                return tl::unexpected(std::move(made).error());
            }
            LodSprite* sprite = &sprites.emplace_back(std::move(*made));
            contender.planner.plan = [sprite](
                                         const View& view, const Motion& motion
                                     ) -> const FramePlan& { return sprite->plan(view, motion); };
            contender.planner.keyframes = [sprite]() -> const LodSpriteStatistics& {
                return sprite->statistics();
            };
        }
        contenders.push_back(std::move(contender));
    }
    WalkSetup setup;
    setup.contenders = contenders;
    setup.reference = spec.reference_every > 0 ? contenders[0].backend : nullptr;
    setup.hierarchy = &world_.hierarchy;
    setup.item_primitives = world_.item_primitives;
    setup.item_frames = world_.item_frames;
    setup.view = spec.view;
    setup.clear = clear();
    WalkObserver observer;
    observer.on_progress = [&](int frame, int frames) {
        run::print_progress(spec.name, frame, frames);
    };
    return eval::walk(
        setup,
        {.frames = spec.frames,
         .frame_seconds = kFrameSeconds,
         .reference_every = spec.reference_every,
         .perceptual_errors = spec.perceptual && repeat == 0},
        observer
    );
}

Result<WalkResult> Stage::walk(std::span<const Way> ways, const WalkSpec& spec) const {
    auto best = walk_once(ways, spec, 0);
    for (int repeat = 1; best && repeat < spec.repeats; ++repeat) {
        // Plans do not read the clock: every walk draws the same.
        auto again = walk_once(ways, spec, repeat);
        if (!again) {
            return again;
        }
        for (std::size_t i = 0; i < best->contenders.size(); ++i) {
            ContenderResult& mine = best->contenders[i];
            const ContenderResult& other = again->contenders[i];
            for (std::size_t frame = 0; frame < mine.frames.size(); ++frame) {
                double& ms = mine.frames[frame].frame_ms;
                ms = std::min(ms, other.frames[frame].frame_ms);
            }
            for (std::size_t k = 0; k < mine.reference.size(); ++k) {
                mine.reference[k].ms = std::min(mine.reference[k].ms, other.reference[k].ms);
            }
        }
    }
    return best;
}

WalkSpec spec_of(const Stage& stage, const Options& options, const std::string& name) {
    WalkSpec spec;
    spec.name = name;
    spec.frames = std::min(stage.world().frames, options.frames.value_or(stage.world().frames));
    spec.view = [&stage](int frame) { return stage.world().view(frame); };
    spec.repeats = options.repeats;
    return spec;
}

/// Terrain of the paper's size, seen in pictures of its size.
run::WorldOptions terrain_options() {
    run::WorldOptions options;
    options.scene = "terrain";
    return options;
}

Result<std::unique_ptr<Stage>> terrain(const Options& options, Change change = nullptr) {
    auto stage = Stage::create(options, terrain_options(), change);
    if (stage) {
        if (Result<void> made = (*stage)->make_pairs(true); !made) {
            return tl::unexpected(std::move(made).error());
        }
    }
    return stage;
}

Way published(const Stage& stage, double error_px) {
    return {"as published", &stage.fixed(), presets::chen1999({.error_px = error_px})};
}

/// One keyframe at a time, on the fixed coarse model.
Way guaranteed(const Stage& stage, double error_px) {
    LodSpriteOptions options = presets::guaranteed_sprite({.error_px = error_px});
    options.max_keyframes = 1;
    options.keyframes_shown = 1;
    return {"guaranteed", &stage.fixed(), options};
}

Way with_refinement(const Stage& stage, Way way) {
    way.name += ", refined";
    way.pairs = &stage.refined();
    way.options.refine = true;
    return way;
}

Way with_keyframes(Way way, std::uint32_t kept = 8) {
    way.name += ", keyframes kept";
    way.options.max_keyframes = kept;
    way.options.keyframes_shown = 2;
    return way;
}

Way with_foresight(Way way, std::uint32_t frames = kAhead, std::uint32_t tiles = kTiles) {
    way.name += ", foreseen";
    way.options.predict_frames = frames;
    way.options.keyframe_tiles = tiles;
    return way;
}

/// From the paper's way to the last of ours; each of ours has what the one before has.
std::vector<Way> all_ways(const Stage& stage, double error_px) {
    Way exact = published(stage, error_px);
    exact.name = "exact angles, rms";
    exact.options.paper_theta = false;
    std::vector<Way> ways = {published(stage, error_px), std::move(exact)};
    ways.push_back(guaranteed(stage, error_px));
    if (!stage.refined().empty()) {
        ways.push_back(with_refinement(stage, ways.back()));
    }
    ways.push_back(with_keyframes(ways.back()));
    ways.push_back(with_foresight(ways.back()));
    return ways;
}

/// Frames of a walk by how they came about.
struct Counts {
    int frames = 0;
    int at_once = 0;  ///< keyframes
    int foreseen = 0; ///< keyframes
    int geometry = 0; ///< frames of plain geometry
    int projected = 0;
    double own_share = 0.0; ///< sum over projected frames

    void add(const LodSpriteStatistics& frame) noexcept {
        ++frames;
        at_once += static_cast<int>(frame.keyframes_made);
        foreseen += static_cast<int>(frame.keyframes_predicted);
        geometry += frame.frame == SpriteFrame::geometry ? 1 : 0;
        if (frame.frame == SpriteFrame::projected) {
            ++projected;
            own_share += frame.own_share;
        }
    }
    [[nodiscard]] int keyframes() const noexcept { return at_once + foreseen; }
    /// Of frames for which the fine models were drawn.
    [[nodiscard]] double fine_share() const noexcept {
        return frames > 0 ? static_cast<double>(keyframes() + geometry) / frames : 0.0;
    }
};

std::optional<double> median(std::vector<double> values) {
    return values.empty() ? std::nullopt : std::optional(eval::percentile(values, 0.5));
}

/// What a walk in one way came to.
struct Figures {
    Counts counts;
    Statistics frame_ms;
    double geometry_ms = 0.0; ///< mean
    std::optional<double> speedup;
    std::optional<double> psnr_db; ///< medians
    std::optional<double> flip;
    double triangles = 0.0; ///< a frame
};

Result<Figures> figures_of(const WalkResult& result, std::size_t contender) {
    const ContenderResult& mine = result.contenders[contender];
    Figures figures;
    std::vector<double> times;
    std::vector<double> psnr;
    std::vector<double> flip;
    for (const WalkFrame& frame : mine.frames) {
        times.push_back(frame.frame_ms);
        if (frame.sprite) {
            figures.counts.add(*frame.sprite);
        }
        figures.triangles +=
            static_cast<double>(frame.work.triangles) / static_cast<double>(mine.frames.size());
        if (frame.image) {
            psnr.push_back(frame.image->psnr_db);
            if (frame.image->flip) {
                flip.push_back(*frame.image->flip);
            }
        }
    }
    figures.frame_ms = eval::summarize(times).value_or(Statistics{});
    figures.psnr_db = median(psnr);
    figures.flip = median(flip);
    if (!mine.reference.empty()) {
        const auto gained = eval::speedup(times, mine.reference);
        if (!gained) {
            return tl::unexpected(gained.error());
        }
        figures.speedup = gained->overall;
        for (const SampledTime& time : mine.reference) {
            figures.geometry_ms += time.ms / static_cast<double>(mine.reference.size());
        }
    }
    return figures;
}

std::string text(std::optional<double> value, const char* format) {
    std::array<char, 32> shown{"-"};
    if (value) {
        std::snprintf(shown.data(), shown.size(), format, *value);
    }
    return shown.data();
}

void table_head(Page& page) {
    page.line(
        "| way | px | keyframes, foreseen | frames of geometry | share of frames | frame [ms] "
        "mean, median, worst | geometry [ms] | speed-up | PSNR [dB] | FLIP | triangles a frame "
        "| own colours |"
    );
    page.line("|---|---|---|---|---|---|---|---|---|---|---|---|");
}

void table_row(Page& page, const Way& way, const Figures& figures) {
    const Counts& counts = figures.counts;
    if (way.pairs == nullptr) {
        page.line(
            "| %s | | | | | %.2f, %.2f, %.1f | %.1f | %s | %s | %s | %.0f | |",
            way.name.c_str(),
            figures.frame_ms.mean,
            figures.frame_ms.median,
            figures.frame_ms.max,
            figures.geometry_ms,
            text(figures.speedup, "%.2f").c_str(),
            text(figures.psnr_db, "%.1f").c_str(),
            text(figures.flip, "%.4f").c_str(),
            figures.triangles
        );
        return;
    }
    const std::optional<double> own =
        counts.projected > 0 ? std::optional(100.0 * counts.own_share / counts.projected)
                             : std::nullopt;
    // Who does not ask for it does not estimate it.
    const bool estimated = way.options.max_own_share < 1.0 || way.options.keyframes_shown > 1;
    page.line(
        "| %s | %g | %d, %d | %d | %.3f | %.2f, %.2f, %.1f | %.1f | %s | %s | %s | %.0f | %s |",
        way.name.c_str(),
        way.options.error_px,
        counts.keyframes(),
        counts.foreseen,
        counts.geometry,
        counts.fine_share(),
        figures.frame_ms.mean,
        figures.frame_ms.median,
        figures.frame_ms.max,
        figures.geometry_ms,
        text(figures.speedup, "%.2f").c_str(),
        text(figures.psnr_db, "%.1f").c_str(),
        text(figures.flip, "%.4f").c_str(),
        figures.triangles,
        text(estimated ? own : std::nullopt, "%.1f %%").c_str()
    );
}

void table_rows(Page& page, std::span<const Way> ways, std::span<const Figures> figures) {
    for (std::size_t i = 0; i < ways.size(); ++i) {
        table_row(page, ways[i], figures[i]);
    }
}

/// Walks, and gives the figures of each way.
Result<std::vector<Figures>> figures_of(const WalkResult& result) {
    std::vector<Figures> all;
    for (std::size_t i = 0; i < result.contenders.size(); ++i) {
        const auto figures = figures_of(result, i);
        if (!figures) {
            return tl::unexpected(figures.error());
        }
        all.push_back(*figures);
    }
    return all;
}

FrameSeries times_of(const std::string& name, const ContenderResult& result) {
    FrameSeries series{name, {}};
    for (const WalkFrame& frame : result.frames) {
        series.values.emplace_back(frame.frame_ms);
    }
    return series;
}

Result<void> save(const Options& options, const FramePlot& plot, const std::string& stem) {
    const std::filesystem::path folder(options.out);
    if (Result<void> saved = eval::save(plot, folder / (stem + ".svg")); !saved) {
        return saved;
    }
    return eval::save_table(plot.series, folder / (stem + ".csv"));
}

/// Figures 8 and 9: errors of two ways, times of three levels.
Result<void> plot_walk(
    const Options& options,
    std::span<const Way> ways,
    const WalkResult& result,
    const std::string& stem
) {
    FramePlot errors;
    errors.title = "Error of the keyframe in use";
    errors.value_title = "root of the mean square [px], as each way estimates it";
    FramePlot times;
    times.title = "Drawing times";
    times.value_title = "frame [ms]";
    for (std::size_t i = 0; i < ways.size(); ++i) {
        const ContenderResult& mine = result.contenders[i];
        if (ways[i].pairs != nullptr && !ways[i].options.guaranteed) {
            FrameSeries series{ways[i].name, {}};
            for (const WalkFrame& frame : mine.frames) {
                series.values.emplace_back(frame.sprite->error_px);
            }
            errors.series.push_back(std::move(series));
            errors.levels = {{"threshold", ways[i].options.error_px}};
        }
        if (i == 0 || i + 2 >= ways.size()) {
            times.series.push_back(times_of(ways[i].name, mine));
        }
    }
    const ContenderResult& first = result.contenders[0];
    const auto full = eval::reference_times(first.reference, static_cast<int>(first.frames.size()));
    if (!full) {
        return tl::unexpected(full.error());
    }
    FrameSeries geometry{"full resolution", {}};
    geometry.values.assign(full->begin(), full->end());
    times.series.push_back(std::move(geometry));
    if (Result<void> saved = save(options, errors, stem + "_errors"); !saved) {
        return saved;
    }
    return save(options, times, stem + "_times");
}

/// Plans a walk without drawing it: plans depend on nothing that is drawn.
/// @param use is called after each plan with its frame
Result<Counts> plan_walk(
    const Stage& stage,
    const Way& way,
    int frames,
    const std::function<View(int)>& view,
    const std::function<void(int, const LodSpriteStatistics&)>& use = nullptr
) {
    auto sprite = stage.sprite(way);
    if (!sprite) {
        return tl::unexpected(std::move(sprite).error());
    }
    Counts counts;
    std::array<glm::dvec3, 3> eyes{};
    for (int frame = 0; frame < frames; ++frame) {
        const View now = view(frame);
        eyes = {now.eye, eyes[0], eyes[1]};
        Motion motion;
        motion.frame_seconds = kFrameSeconds;
        if (frame >= 2) {
            motion = estimate_motion(eyes[0], eyes[1], eyes[2], kFrameSeconds);
        } else if (frame == 1) {
            motion.velocity = (eyes[0] - eyes[1]) / kFrameSeconds;
        }
        static_cast<void>(sprite->plan(now, motion));
        counts.add(sprite->statistics());
        if (use) {
            use(frame, sprite->statistics());
        }
    }
    return counts;
}

/// Figures 10 and 11: shares of frames that the fine model is drawn for.
Result<void> fractions(Stage& stage, Page& page) {
    struct Column {
        double error_px;
        int frames;
    };
    const std::array<std::vector<Column>, 2> sweeps = {
        {{{0.25, 460}, {0.5, 460}, {1.0, 460}, {1.5, 460}, {2.0, 460}, {3.0, 460}, {4.0, 460}},
         {{1.0, 115}, {1.0, 230}, {1.0, 460}, {1.0, 920}, {1.0, 1840}, {1.0, 3680}}}};
    constexpr std::array<const char*, 2> kTitles = {
        "Share of frames that the fine model is drawn for, by threshold (figure 11)",
        "The same at 1 px, by frames on the whole path (figure 10)"};
    for (std::size_t s = 0; s < sweeps.size(); ++s) {
        page.line("### %s\n", kTitles[s]);
        std::string head = "| way |";
        std::string rule = "|---|";
        for (const Column& column : sweeps[s]) {
            head += s == 0 ? text(column.error_px, " %g px |") : text(column.frames, " %g |");
            rule += "---|";
        }
        page.line("%s", head.c_str());
        page.line("%s", rule.c_str());
        const std::size_t count = all_ways(stage, 1.0).size();
        for (std::size_t i = 0; i < count; ++i) {
            std::string row;
            for (const Column& column : sweeps[s]) {
                const Way way = all_ways(stage, column.error_px)[i];
                if (row.empty()) {
                    row = "| " + way.name + " |";
                }
                stage.world().whole_path = column.frames;
                const auto counts = plan_walk(stage, way, column.frames, [&](int frame) {
                    return stage.world().view(frame);
                });
                stage.world().whole_path.reset();
                if (!counts) {
                    return tl::unexpected(counts.error());
                }
                row += text(counts->fine_share(), " %.3f |");
            }
            page.line("%s", row.c_str());
        }
        page.line("");
    }
    return {};
}

Result<void> walk(const Options& options, Page& page) {
    auto stage = terrain(options);
    if (!stage) {
        return tl::unexpected(std::move(stage).error());
    }
    page.line("## The paper's walk (figures 7 to 12)\n");
    page.line("Terrain of 513x513 posts, 16x16 squares of them as its coarse model, 460 frames of "
              "512x512 "
              "pixels. The paper's at 1 px: 28 keyframes, 0.061 of the frames, speed-up 12.3; a "
              "full frame "
              "took 55 times as long as a projected one. PSNR and FLIP are medians against plain "
              "geometry; "
              "own colours: estimated share of the picture that no keyframe serves, on average.\n");
    table_head(page);
    for (const double error_px : {0.5, 1.0, 2.0, 4.0}) {
        std::vector<Way> ways = all_ways(**stage, error_px);
        if (error_px == 1.0) {
            ways.push_back({"coarse model alone", nullptr, {}});
        }
        const auto result = (*stage)->walk(ways, spec_of(**stage, options, "walk"));
        if (!result) {
            return tl::unexpected(result.error());
        }
        const auto figures = figures_of(*result);
        if (!figures) {
            return tl::unexpected(figures.error());
        }
        table_rows(page, ways, *figures);
        if (error_px == 1.0) {
            if (Result<void> plotted = plot_walk(options, ways, *result, "walk"); !plotted) {
                return plotted;
            }
        }
    }
    page.line("");
    return fractions(**stage, page);
}

/// All ways at 1 px, on another world.
Result<void> compare_at_one(const Options& options, Page& page, Stage& stage) {
    const run::World& world = stage.world();
    const WalkSpec spec = spec_of(stage, options, world.scene.name);
    page.line(
        "%llu triangles, %u coarse ones; %d frames of %dx%d pixels.\n",
        static_cast<unsigned long long>(world.triangles),
        stage.fixed().front().quality.facets,
        spec.frames,
        world.width,
        world.height
    );
    std::vector<Way> ways = all_ways(stage, 1.0);
    ways.push_back({"coarse model alone", nullptr, {}});
    const auto result = stage.walk(ways, spec);
    if (!result) {
        return tl::unexpected(result.error());
    }
    const auto figures = figures_of(*result);
    if (!figures) {
        return tl::unexpected(figures.error());
    }
    table_head(page);
    table_rows(page, ways, *figures);
    page.line("");
    return {};
}

Result<void> field(const Options& options, Page& page) {
    page.line("## A height field of a file\n");
    if (options.height_field.empty()) {
        page.line("Left out: no file, give one with --height-field.\n");
        return {};
    }
    run::WorldOptions world_options;
    world_options.scene = options.height_field;
    world_options.size = "512x512";
    auto stage = Stage::create(options, world_options);
    if (!stage) {
        return tl::unexpected(std::move(stage).error());
    }
    if (Result<void> made = (*stage)->make_pairs(true); !made) {
        return made;
    }
    return compare_at_one(options, page, **stage);
}

/// Once around a model, a little from above, and near at the end.
CameraPath orbit(const run::World& world) {
    constexpr int kFrames = 460;
    constexpr int kStep = 10;
    constexpr double kFar = 2.2; // half diagonals of the box
    constexpr double kNear = 1.3;
    constexpr double kAbove = 0.3; // [rad]
    const glm::dvec3 up = world.scene.up;
    const glm::dvec3 other = std::abs(up.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1);
    const glm::dvec3 across = glm::normalize(glm::cross(other, up));
    const glm::dvec3 ahead = glm::cross(up, across);
    CameraPath path;
    path.frame_count = kFrames;
    for (int frame = 0; frame <= kFrames; frame += kStep) {
        const double share = static_cast<double>(frame) / kFrames;
        const double turn = 2.0 * std::numbers::pi * share;
        const double away =
            world.radius * std::lerp(kFar, kNear, glm::smoothstep(0.75, 1.0, share));
        PathKey key;
        key.frame = frame;
        key.eye = world.middle +
                  away * (std::sin(kAbove) * up +
                          std::cos(kAbove) * (std::cos(turn) * across + std::sin(turn) * ahead));
        key.target = world.middle;
        key.up = up;
        path.keys.push_back(key);
    }
    return path;
}

Result<void> mesh(const Options& options, Page& page) {
    page.line("## Around a mesh\n");
    run::WorldOptions world_options;
    world_options.scene = options.mesh.empty() ? "knot" : options.mesh;
    world_options.size = "512x512";
    auto stage = Stage::create(options, world_options);
    if (!stage) {
        return tl::unexpected(std::move(stage).error());
    }
    if (Result<void> made = (*stage)->make_pairs(false); !made) {
        return made;
    }
    (*stage)->world().path = orbit((*stage)->world());
    (*stage)->world().frames = (*stage)->world().path.frame_count;
    return compare_at_one(options, page, **stage);
}

void promise_head(Page& page) {
    page.line(
        "| | px | keyframes, foreseen | frames of geometry | disparity [px] median, p99, largest "
        "| over their promise | pixels of keyframes | of geometry |"
    );
    page.line("|---|---|---|---|---|---|---|---|");
}

void promise_row(
    Page& page, const std::string& name, const Way& way, const WalkResult& result, std::size_t i
) {
    const ContenderResult& mine = result.contenders[i];
    Counts counts;
    for (const WalkFrame& frame : mine.frames) {
        counts.add(*frame.sprite);
    }
    const DisparitySummary disparity = mine.disparity.value_or(DisparitySummary{});
    const auto pixels = static_cast<double>(disparity.image_pixels);
    page.line(
        "| %s | %g | %d, %d | %d | %s, %s, %s | %s | %.1f million | %.1f million |",
        name.c_str(),
        way.options.error_px,
        counts.keyframes(),
        counts.foreseen,
        counts.geometry,
        text(disparity.median_px, "%.3f").c_str(),
        text(disparity.p99_px, "%.3f").c_str(),
        text(disparity.max_px, "%.3f").c_str(),
        disparity.over_bound && pixels > 0.0
            ? text(100.0 * static_cast<double>(*disparity.over_bound) / pixels, "%.4f %%").c_str()
            : "-",
        pixels * 1e-6,
        static_cast<double>(disparity.geometry_pixels) * 1e-6
    );
}

Result<void> promise(const Options& options, Page& page) {
    auto stage = terrain(options);
    if (!stage) {
        return tl::unexpected(std::move(stage).error());
    }
    page.line("## How far points are from their places\n");
    page.line(
        "Every pixel of the walk that shows a keyframe. A pixel's promise is the threshold and "
        "%.2f "
        "sizes of the texel that it shows; the paper's way promises nothing, and is held to the "
        "same. "
        "Pixels of geometry are those in own colours, and those of frames of geometry.\n",
        eval::kSamplingShare
    );
    promise_head(page);
    for (const double error_px : {0.5, 1.0, 2.0, 4.0}) {
        const Way fixed = guaranteed(**stage, error_px);
        const std::array<Way, 3> ways = {
            published(**stage, error_px),
            fixed,
            with_foresight(with_keyframes(with_refinement(**stage, fixed)))};
        WalkSpec spec = spec_of(**stage, options, "promise");
        spec.repeats = 1;
        spec.reference_every = 0;
        spec.positions = true;
        const auto result = (*stage)->walk(ways, spec);
        if (!result) {
            return tl::unexpected(result.error());
        }
        for (std::size_t i = 0; i < ways.size(); ++i) {
            promise_row(page, ways[i].name, ways[i], *result, i);
        }
        if (error_px != 1.0) {
            continue;
        }
        FramePlot plot;
        plot.title = "Largest disparity of the pixels that show keyframes";
        plot.value_title = "disparity [px]";
        for (const std::size_t i : {std::size_t{0}, ways.size() - 1}) {
            FrameSeries largest{ways[i].name, {}};
            for (const WalkFrame& frame : result->contenders[i].frames) {
                largest.values.push_back(frame.disparity_max_px);
            }
            plot.series.push_back(std::move(largest));
        }
        plot.levels = {{"threshold", error_px}};
        if (Result<void> saved = save(options, plot, "promise"); !saved) {
            return saved;
        }
    }
    page.line("");
    return {};
}

/// Red and green squares, as many as the coarse model has twice over.
void paint_checkerboard(Scene& scene) {
    constexpr int kSquares = 32;
    const glm::u8vec4 red(200, 40, 30, 255);
    const glm::u8vec4 green(30, 150, 50, 255);
    for (Texture& texture : scene.textures) {
        for (int y = 0; y < texture.height; ++y) {
            for (int x = 0; x < texture.width; ++x) {
                const bool odd =
                    (x * kSquares / texture.width + y * kSquares / texture.height) % 2 != 0;
                const auto at =
                    (static_cast<std::size_t>(y) * static_cast<std::size_t>(texture.width) +
                     static_cast<std::size_t>(x)) *
                    4;
                for (int c = 0; c < 4; ++c) {
                    texture.pixels[at + static_cast<std::size_t>(c)] = odd ? red[c] : green[c];
                }
            }
        }
    }
}

/// A frame, and the one in which its keyframe is made.
struct Midway {
    int keyframe = 0;
    int frame = 0;
};

/// Midway between keyframes, where the paper's way keeps one longest from `first` on.
Result<Midway> midway_from(const Stage& stage, int first) {
    int start = first;
    int longest = 0;
    Midway best{first, first};
    const auto planned = plan_walk(
        stage,
        published(stage, 1.0),
        stage.world().frames,
        [&](int frame) { return stage.world().view(frame); },
        [&](int frame, const LodSpriteStatistics& did) {
            if (frame <= first || did.frame != SpriteFrame::projected) {
                start = frame;
            } else if (frame - start > longest) {
                longest = frame - start;
                best = {start, start + longest / 2};
            }
        }
    );
    return planned ? Result<Midway>(best) : tl::unexpected(planned.error());
}

/// Draws a frame with a keyframe of another one.
Result<Picture>
picture_of(const Stage& stage, run::Backends& backends, const Way* way, const Midway& at) {
    const auto backend = backends.make(stage.backend_name());
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    const View last = stage.world().view(at.frame);
    const auto target = (*backend)->create_target(last.width, last.height, 1);
    if (!target) {
        return tl::unexpected(target.error());
    }
    const auto draw = [&](const FramePlan& plan) {
        return (*backend)->execute(plan, *target, stage.clear());
    };
    Result<void> drawn;
    if (way == nullptr) {
        CulledGeometry geometry(stage.world().hierarchy);
        drawn = draw(geometry.plan(last));
    } else if (way->pairs == nullptr) {
        FramePlan plan;
        stage.plan_coarse(last, plan);
        drawn = draw(plan);
    } else {
        auto sprite = stage.sprite(*way);
        if (!sprite) {
            return tl::unexpected(std::move(sprite).error());
        }
        drawn = draw(sprite->plan(stage.world().view(at.keyframe), Motion{}));
        if (drawn) {
            drawn = draw(sprite->plan(last, Motion{}));
        }
    }
    if (!drawn) {
        return tl::unexpected(drawn.error());
    }
    return (*backend)->read_target(*target);
}

/// Figures 13 and 14.
Result<void> pictures(const Options& options, Page& page) {
    page.line("## Pictures (figures 13 and 14)\n");
    page.line(
        "The frame midway between the keyframes that are farthest apart, with the paper's way at "
        "1 px. Above: full resolution, the coarse model in its own colours, as published; below: "
        "guaranteed and refined, and four times the differences of the coarse model and of the "
        "published way.\n"
    );
    page.line(
        "| texture | keyframe, frame | file | PSNR [dB] coarse alone, as published, guaranteed and "
        "refined | mean difference [1/255] of these |"
    );
    page.line("|---|---|---|---|---|");
    struct Look {
        const char* name;
        Change change;
    };
    for (const Look& look : {Look{"checkerboard", paint_checkerboard}, Look{"terrain", nullptr}}) {
        auto stage = terrain(options, look.change);
        if (!stage) {
            return tl::unexpected(std::move(stage).error());
        }
        constexpr int kBesides = 150; // from here on the eye looks at the terrain from beside it
        const auto midway = midway_from(**stage, kBesides);
        if (!midway) {
            return tl::unexpected(midway.error());
        }
        const Way coarse{"coarse model alone", nullptr, {}};
        const Way paper = published(**stage, 1.0);
        const Way ours = with_refinement(**stage, guaranteed(**stage, 1.0));
        run::Backends backends((*stage)->world());
        std::vector<Picture> tiles;
        for (const Way* way : {static_cast<const Way*>(nullptr), &coarse, &paper, &ours}) {
            auto picture = picture_of(**stage, backends, way, *midway);
            if (!picture) {
                return tl::unexpected(std::move(picture).error());
            }
            tiles.push_back(std::move(*picture));
        }
        constexpr double kAmplify = 4.0;
        std::array<double, 3> psnr{};
        std::array<double, 3> mean{};
        for (std::size_t i = 0; i < psnr.size(); ++i) {
            const auto decibels = eval::psnr_db(tiles[0], tiles[i + 1]);
            const auto difference = eval::compare(tiles[0], tiles[i + 1], 0);
            if (!decibels || !difference) {
                return tl::unexpected((decibels ? difference.error() : decibels.error()));
            }
            psnr[i] = *decibels;
            mean[i] = difference->mean;
        }
        for (const std::size_t i : {std::size_t{1}, std::size_t{2}}) {
            auto difference = eval::difference_picture(tiles[0], tiles[i], kAmplify);
            if (!difference) {
                return tl::unexpected(std::move(difference).error());
            }
            tiles.push_back(std::move(*difference));
        }
        const std::string file = std::string(look.name) + ".png";
        if (Result<void> written = io::write_png(
                std::filesystem::path(options.out) / file, run::contact_sheet(tiles, 3)
            );
            !written) {
            return written;
        }
        page.line(
            "| %s | %d, %d | %s | %.1f, %.1f, %.1f | %.2f, %.2f, %.2f |",
            look.name,
            midway->keyframe,
            midway->frame,
            file.c_str(),
            psnr[0],
            psnr[1],
            psnr[2],
            mean[0],
            mean[1],
            mean[2]
        );
    }
    page.line("");
    return {};
}

Result<void> laps(const Options& options, Page& page) {
    auto stage = terrain(options);
    if (!stage) {
        return tl::unexpected(std::move(stage).error());
    }
    page.line("## Back and forth\n");
    constexpr int kFirst = 140;
    constexpr int kLast = 260;
    constexpr int kLap = 2 * (kLast - kFirst);
    page.line(
        "From frame %d to %d of the walk and back, %d times, 1 px: keyframes of each lap, frames "
        "of "
        "geometry among them.\n",
        kFirst,
        kLast,
        options.laps
    );
    const Way refined = with_refinement(**stage, guaranteed(**stage, 1.0));
    std::vector<Way> ways = {published(**stage, 1.0), refined};
    for (const std::uint32_t kept : {4U, 8U, 16U, 32U}) {
        ways.push_back(with_keyframes(refined, kept));
        ways.back().name += ": " + std::to_string(kept);
    }
    std::string head = "| way |";
    std::string rule = "|---|";
    for (int lap = 1; lap <= options.laps; ++lap) {
        head += " " + std::to_string(lap) + " |";
        rule += "---|";
    }
    page.line("%s", head.c_str());
    page.line("%s", rule.c_str());
    for (const Way& way : ways) {
        std::vector<Counts> laps(static_cast<std::size_t>(options.laps));
        const auto planned = plan_walk(
            **stage,
            way,
            options.laps * kLap,
            [&](int frame) {
                const int at = frame % kLap;
                return (*stage)->world().view(kFirst + std::min(at, kLap - at));
            },
            [&](int frame, const LodSpriteStatistics& did) {
                laps[static_cast<std::size_t>(frame / kLap)].add(did);
            }
        );
        if (!planned) {
            return tl::unexpected(planned.error());
        }
        std::string row = "| " + way.name + " |";
        for (const Counts& lap : laps) {
            row += " " + std::to_string(lap.keyframes() + lap.geometry) + " |";
        }
        page.line("%s", row.c_str());
    }
    page.line("");
    return {};
}

Result<void> spikes(const Options& options, Page& page) {
    auto stage = terrain(options);
    if (!stage) {
        return tl::unexpected(std::move(stage).error());
    }
    page.line("## The longest frames\n");
    page.line("The walk at 1 px. Foreseen: frames ahead, tiles. Nothing can be foreseen before the "
              "first frame, which is left out of the worst that is set against the median.\n");
    const Way kept = with_keyframes(with_refinement(**stage, guaranteed(**stage, 1.0)));
    std::vector<Way> ways = {published(**stage, 1.0), kept};
    struct Foresight {
        std::uint32_t frames;
        std::uint32_t tiles;
        double margin;
    };
    for (const Foresight& foresight :
         {Foresight{4, 4, 1.0},
          Foresight{8, 8, 1.0},
          Foresight{12, 8, 1.0},
          Foresight{16, 8, 1.0},
          Foresight{16, 16, 1.0},
          Foresight{16, 8, 1.2},
          Foresight{32, 16, 1.2}}) {
        ways.push_back(with_foresight(kept, foresight.frames, foresight.tiles));
        ways.back().options.keyframe_margin = foresight.margin;
        ways.back().name += " " + std::to_string(foresight.frames) + ", " +
                            std::to_string(foresight.tiles) +
                            (foresight.margin > 1.0 ? ", wider" : "");
    }
    WalkSpec spec = spec_of(**stage, options, "spikes");
    spec.perceptual = false;
    spec.reference_every = 4;
    const auto result = (*stage)->walk(ways, spec);
    if (!result) {
        return tl::unexpected(result.error());
    }
    page.line("| way | keyframes, foreseen | frames of geometry | frame [ms] mean, median, p95, "
              "p99, worst "
              "| worst but for the first over median | frames over 2 medians | speed-up |");
    page.line("|---|---|---|---|---|---|---|---|");
    std::vector<double> geometry;
    for (const SampledTime& time : result->contenders[0].reference) {
        geometry.push_back(time.ms);
    }
    const Statistics plain = eval::summarize(geometry).value_or(Statistics{});
    page.line(
        "| plain geometry | | %d | %.1f, %.1f, %.1f, %.1f, %.1f | %.2f | | 1 |",
        spec.frames,
        plain.mean,
        plain.median,
        plain.p95,
        plain.p99,
        plain.max,
        plain.max / plain.median
    );
    for (std::size_t i = 0; i < ways.size(); ++i) {
        const auto figures = figures_of(*result, i);
        if (!figures) {
            return tl::unexpected(figures.error());
        }
        const Statistics& ms = figures->frame_ms;
        const auto slow = std::count_if(
            result->contenders[i].frames.begin(),
            result->contenders[i].frames.end(),
            [&](const WalkFrame& frame) { return frame.frame_ms > 2.0 * ms.median; }
        );
        double worst = 0.0; // but for the first
        for (std::size_t frame = 1; frame < result->contenders[i].frames.size(); ++frame) {
            worst = std::max(worst, result->contenders[i].frames[frame].frame_ms);
        }
        page.line(
            "| %s | %d, %d | %d | %.1f, %.1f, %.1f, %.1f, %.1f | %.2f | %td | %s |",
            ways[i].name.c_str(),
            figures->counts.keyframes(),
            figures->counts.foreseen,
            figures->counts.geometry,
            ms.mean,
            ms.median,
            ms.p95,
            ms.p99,
            ms.max,
            worst / ms.median,
            slow,
            text(figures->speedup, "%.2f").c_str()
        );
    }
    page.line("");
    FramePlot times;
    times.title = "Drawing times with foreseen keyframes";
    times.value_title = "frame [ms]";
    for (std::size_t i = 0; i < ways.size(); ++i) {
        const LodSpriteOptions& way = ways[i].options;
        const bool chosen = way.predict_frames == kAhead && way.keyframe_margin == 1.0;
        if (way.predict_frames == 0 || chosen) {
            times.series.push_back(times_of(ways[i].name, result->contenders[i]));
        }
    }
    return save(options, times, "spikes_times");
}

/// Needles of a single post, a ninth of the side high.
void raise_needles(Scene& scene) {
    constexpr std::size_t kEvery = 997; // a prime: nowhere in line with the coarse grid
    Mesh& mesh = scene.meshes[0];
    const auto height = static_cast<float>(extent(mesh.bounds).x / 9.0);
    for (std::size_t i = kEvery; i < mesh.positions.size(); i += kEvery) {
        mesh.positions[i].y += height;
    }
    compute_normals(mesh);
    update_bounds(mesh);
}

/// A view that is hard for some part of the technique. Lengths are in sides of the terrain.
struct HardCase {
    const char* name;
    double side_m = 10'240.0;
    double relief = 0.15; ///< in sides
    Change change = nullptr;
    /// Eye and target by share of the path, from the middle of the ground; none: the terrain's own.
    std::function<std::pair<glm::dvec3, glm::dvec3>(double)> pose = nullptr;
    double near = 0.0; ///< 0: the world's own
};

std::vector<HardCase> hard_cases() {
    using glm::dvec3;
    const auto turn = [](double radians) {
        return dvec3(std::cos(radians), 0.0, std::sin(radians));
    };
    const auto ahead = [](const dvec3& eye, const dvec3& direction) {
        return std::pair(eye, eye + direction);
    };
    std::vector<HardCase> cases;
    cases.push_back({.name = "grazing, just over the peaks", .pose = [=](double at) {
                         return ahead({-0.6 + 0.5 * at, 0.152, 0.1}, {1.0, -0.02, 0.0});
                     }});
    cases.push_back(
        {.name = "down in the valleys, through slopes",
         .pose =
             [=](double at) {
                 return ahead({-0.4 + 0.6 * at, 0.05, 0.05 * std::sin(9.0 * at)}, {1, 0, 0.3});
             }}
    );
    cases.push_back({.name = "from below the ground", .pose = [=](double at) {
                         return ahead({-0.1 + 0.2 * at, -0.2, 0.3}, {0.2, 1.0, -0.3});
                     }});
    cases.push_back({.name = "straight down from high above", .pose = [=](double at) {
                         return ahead({0.02 * at, 2.0 - at, 0.01}, {0.0, -1.0, 0.0});
                     }});
    cases.push_back({.name = "flat field", .relief = 0.0});
    cases.push_back({.name = "needles of single posts", .change = raise_needles});
    cases.push_back({.name = "cliffs, as high as wide", .relief = 1.0});
    cases.push_back({.name = "half a turn on the spot, 30 frames", .pose = [=](double at) {
                         const double half = glm::clamp((at - 0.25) * 2.0, 0.0, 1.0);
                         return ahead(
                             {0.05 * at, 0.2, 0.0}, turn(std::numbers::pi * half) - dvec3(0, 0.2, 0)
                         );
                     }});
    cases.push_back({.name = "half a turn within a frame", .pose = [=](double at) {
                         return ahead(
                             {0.05 * at, 0.2, 0.0},
                             turn(at < 0.5 ? 0.0 : std::numbers::pi) - dvec3(0, 0.2, 0)
                         );
                     }});
    cases.push_back(
        {.name = "near plane through the terrain",
         .pose =
             [=](double at) {
                 return ahead({-0.5 + 0.3 * at, 0.16, 0.0}, {1.0, -0.15, 0.0});
             },
         .near = 0.4}
    );
    cases.push_back({.name = "nothing in view", .pose = [=](double at) {
                         return ahead({0.2 * at, 0.5, 0.0}, {0.1, 1.0, 0.0});
                     }});
    cases.push_back({.name = "side of 1 m", .side_m = 1.0});
    cases.push_back({.name = "side of 100 km", .side_m = 1e5});
    return cases;
}

Result<void> run_hard_case(const Options& options, Page& page, const HardCase& hard) {
    constexpr int kFrames = 60; // of the whole motion
    run::WorldOptions world_options = terrain_options();
    world_options.scene_values = {{"side", hard.side_m}, {"relief", hard.relief * hard.side_m}};
    auto stage = Stage::create(options, world_options, hard.change);
    if (!stage) {
        return tl::unexpected(std::move(stage).error());
    }
    if (Result<void> made = (*stage)->make_pairs(true); !made) {
        return made;
    }
    const run::World& world = (*stage)->world();
    WalkSpec spec = spec_of(**stage, options, hard.name);
    spec.frames = std::min(kFrames, options.frames.value_or(kFrames));
    spec.reference_every = 5;
    spec.repeats = 1;
    spec.perceptual = false;
    spec.positions = true;
    spec.view = [&](int frame) {
        constexpr int kOwnFirst = 200; // of the terrain's own walk
        View view = world.view(kOwnFirst + frame);
        if (hard.pose) {
            auto [eye, target] = hard.pose(static_cast<double>(frame) / (kFrames - 1));
            const glm::dvec3 ground(world.middle.x, 0.0, world.middle.z);
            view = look_at(
                ground + hard.side_m * eye,
                ground + hard.side_m * target,
                world.scene.up,
                view.lens,
                view.width,
                view.height
            );
        }
        if (hard.near > 0.0) {
            view.lens.near_distance = hard.near * hard.side_m;
        }
        return view;
    };
    const Way fixed = with_keyframes(guaranteed(**stage, 1.0));
    const Way refined = with_keyframes(with_refinement(**stage, guaranteed(**stage, 1.0)));
    const std::array<Way, 2> ways = {fixed, refined};
    const auto result = (*stage)->walk(ways, spec);
    if (!result) {
        return tl::unexpected(result.error());
    }
    for (std::size_t i = 0; i < ways.size(); ++i) {
        const auto figures = figures_of(*result, i);
        if (!figures) {
            return tl::unexpected(figures.error());
        }
        const ContenderResult& mine = result->contenders[i];
        const DisparitySummary disparity = mine.disparity.value_or(DisparitySummary{});
        double worst_psnr = eval::kMaxPsnrDb;
        for (const WalkFrame& frame : mine.frames) {
            worst_psnr = std::min(worst_psnr, frame.image ? frame.image->psnr_db : worst_psnr);
        }
        page.line(
            "| %s | %s | %d | %d | %s | %llu | %s | %s, %.1f | %llu |",
            hard.name,
            i == 0 ? "fixed" : "refined",
            figures->counts.keyframes(),
            figures->counts.geometry,
            text(disparity.max_px, "%.3f").c_str(),
            static_cast<unsigned long long>(disparity.over_bound.value_or(0)),
            text(figures->speedup, "%.2f").c_str(),
            text(figures->psnr_db, "%.1f").c_str(),
            worst_psnr,
            static_cast<unsigned long long>(mine.sky_holes)
        );
    }
    return {};
}

Result<void> hard(const Options& options, Page& page) {
    page.line("## Hard views\n");
    page.line("60 frames each, guaranteed at 1 px, keyframes kept. Sky inside: pixels of "
              "background where "
              "geometry has none around them, over 13 frames.\n");
    page.line("| | coarse model | keyframes | frames of geometry | largest disparity [px] | pixels "
              "over their "
              "promise | speed-up | PSNR [dB] median, least | sky inside |");
    page.line("|---|---|---|---|---|---|---|---|---|");
    for (const HardCase& one : hard_cases()) {
        if (Result<void> done = run_hard_case(options, page, one); !done) {
            return fail(done.error().code, std::string(one.name) + ": " + done.error().message);
        }
    }
    page.line("");
    return {};
}

Result<void> run_program(CLI::App& app, const std::function<void()>& parse) {
    struct Experiment {
        const char* name;
        Result<void> (*run)(const Options&, Page&);
    };
    constexpr std::array<Experiment, 8> kExperiments = {{
        {"walk", walk},
        {"field", field},
        {"promise", promise},
        {"pictures", pictures},
        {"laps", laps},
        {"spikes", spikes},
        {"mesh", mesh},
        {"hard", hard},
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
    app.add_option("--height-field", options.height_field, "a .png file of 16-bit heights");
    app.add_option("--mesh", options.mesh, "a file in place of the generated mesh");
    app.add_option(
           "--repeats", options.repeats, "walks of which the least time of every frame counts"
    )
        ->check(CLI::Range(1, 1000));
    app.add_option("--frames", options.frames, "the first so many of each walk that is drawn")
        ->check(CLI::Range(1, 10'000'000));
    app.add_option("--laps", options.laps, "back and forth")->check(CLI::Range(1, 50));
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
        "chen",
        "Repeats the experiments of Chen, Swan, Kuo 1999 with LOD-sprites.",
        argc,
        argv,
        run_program
    );
}
