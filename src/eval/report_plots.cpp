#include "report_plots.hpp"

#include "page_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace farfield::eval::detail {

namespace {

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr std::size_t kColumns = 600; // about as many pixels as the area of a plot is wide

template <typename AnyPlot>
ReportPlot rendered(const std::string& file, const AnyPlot& plot) {
    return {file, to_svg(plot, SvgUse::document), to_svg(plot, SvgUse::element)};
}

std::optional<double> finite(const std::optional<double>& value) {
    return value && std::isfinite(*value) ? value : std::nullopt;
}

/// Where it was measured, for below a plot.
std::string devices_text(const ComparedWalk& walk) {
    if (walk.devices.size() == 1) {
        return walk.devices.front() + ".";
    }
    std::string text;
    for (std::size_t device = 0; device < walk.devices.size(); ++device) {
        text += (text.empty() ? "" : "; ") + device_letter(device) + ": " + walk.devices[device];
    }
    return text + ".";
}

std::string speedup_title(const ComparedWalk& walk) {
    if (walk.devices.size() == 1 || !walk.geometry) {
        return "speed-up over plain geometry [x]";
    }
    return "speed-up over plain geometry on " + device_letter(walk.geometry->device) + " [x]";
}

/// What speed-up means below a plot that mixes devices.
std::vector<std::string> speedup_captions(const ComparedWalk& walk) {
    std::vector<std::string> captions = {devices_text(walk)};
    if (walk.devices.size() > 1 && walk.geometry) {
        captions.push_back(
            "Runs of several devices: 1 is the fastest plain geometry of them all, on " +
            device_letter(walk.geometry->device) + ", " + figure_text(walk.geometry->mean_ms) +
            " ms a frame."
        );
    }
    return captions;
}

/// Adds a caption that names those who are missing from a plot.
void name_missing(std::vector<std::string>& captions, const std::vector<std::string>& missing) {
    if (missing.empty()) {
        return;
    }
    std::string text;
    for (const std::string& name : missing) {
        text += (text.empty() ? "" : ", ") + name;
    }
    captions.push_back("Not measured: " + text + ".");
}

std::vector<glm::dvec2> time_by_frame(const EvaluatedRun& run) {
    std::vector<glm::dvec2> points;
    for (std::size_t frame = 0; frame < run.frame_ms.size(); ++frame) {
        points.emplace_back(static_cast<double>(frame), run.frame_ms[frame]);
    }
    return points;
}

std::vector<glm::dvec2> disparity_by_frame(const EvaluatedRun& run) {
    constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
    std::vector<glm::dvec2> points;
    for (std::size_t frame = 0; frame < run.disparity_p99_px.size(); ++frame) {
        points.emplace_back(static_cast<double>(frame), run.disparity_p99_px[frame].value_or(kGap));
    }
    return points;
}

/// A plot over the frames of a walk: every run as it was measured, pale, and of long walks its
/// medians above. Runs of one technique lie close, so here each has a hue of its own.
Plot over_frames(
    const ComparedWalk& walk, std::vector<glm::dvec2> (*points_of)(const EvaluatedRun&)
) {
    Plot plot;
    plot.x = {"frame of the walk", PlotScale::linear_tight};
    plot.captions = {devices_text(walk)};
    std::size_t frames = 0;
    for (const ComparedRun& run : walk.runs) {
        frames = std::max(frames, points_of(*run.run).size());
    }
    constexpr std::size_t kShort = 200; // frames, which can be told apart
    constexpr std::size_t kWindows = 60;
    const std::size_t window = frames / kWindows / 2 * 2 + 1;
    const bool smooth = frames >= kShort;
    std::vector<PlotSeries> medians;
    unsigned hues = 0;
    for (const ComparedRun& run : walk.runs) {
        const std::vector<glm::dvec2> points = points_of(*run.run);
        const bool any = std::any_of(points.begin(), points.end(), [](const glm::dvec2& point) {
            return std::isfinite(point.y);
        });
        if (!any) {
            continue;
        }
        PlotMark mark = run.mark;
        mark.faint = false;
        mark.dash = 0;
        if (mark.color != 0) {
            mark.color = 1 + hues % (kPlotColors - 1);
            mark.dash = hues / (kPlotColors - 1);
            ++hues;
        }
        const std::string name = label(walk, run);
        if (smooth) {
            medians.push_back(
                {name, mark, thinned(smoothed(points, window), kColumns), true, PlotDots::none}
            );
            mark.faint = true;
            mark.dash = 0;
        }
        plot.series.push_back(
            {smooth ? "" : name, mark, thinned(points, kColumns), true, PlotDots::first}
        );
    }
    if (!medians.empty()) {
        plot.captions.push_back(
            "Pale: every frame. Full: the median of the " + std::to_string(window) +
            " frames around."
        );
    }
    // The first series lie above the later ones.
    plot.series.insert(plot.series.begin(), medians.begin(), medians.end());
    return plot;
}

/// Speed-up by threshold: a line for every technique, preset and backend.
Plot speedup_by_threshold(const ComparedWalk& walk) {
    Plot plot;
    plot.title = "Speed-up against the threshold";
    plot.x = {"threshold [px]", PlotScale::logarithmic};
    plot.y = {speedup_title(walk), PlotScale::logarithmic};
    plot.captions = speedup_captions(walk);
    using Key = std::tuple<std::string, std::string, std::string, std::size_t>;
    std::map<Key, std::size_t> places;
    std::vector<std::string> missing;
    for (const ComparedRun& run : walk.runs) {
        const RunReport& figures = run.run->figures;
        if (!finite(run.speedup)) {
            missing.push_back(label(walk, run));
            continue;
        }
        if (!finite(figures.error_px)) {
            plot.levels.push_back({label(walk, run), *run.speedup});
            continue;
        }
        const Key key(figures.technique, figures.preset, figures.backend, run.device);
        const auto [place, is_new] = places.try_emplace(key, plot.series.size());
        if (is_new) {
            std::string name = figures.technique;
            name += figures.preset.empty() ? "" : ", " + figures.preset;
            name += walk.devices.size() > 1 ? " \u00B7 " + device_letter(run.device) : "";
            PlotMark mark = run.mark;
            mark.faint = false; // a line joins several runs
            plot.series.push_back({name, mark, {}});
        }
        plot.series[place->second].points.emplace_back(*figures.error_px, *run.speedup);
    }
    for (PlotSeries& series : plot.series) {
        std::stable_sort(
            series.points.begin(),
            series.points.end(),
            [](const glm::dvec2& a, const glm::dvec2& b) { return a.x < b.x; }
        );
    }
    name_missing(plot.captions, missing);
    return plot;
}

/// An error of every run against its speed-up.
Plot error_by_speedup(
    const ComparedWalk& walk,
    const std::string& title,
    const std::string& axis_title,
    const std::function<std::optional<double>(const RunReport&)>& error
) {
    Plot plot;
    plot.title = title;
    plot.x = {speedup_title(walk), PlotScale::logarithmic};
    plot.y = {axis_title, PlotScale::linear};
    plot.labels = PlotLabels::at_points;
    plot.captions = speedup_captions(walk);
    bool any_dominated = false;
    std::vector<std::string> missing;
    for (const ComparedRun& run : walk.runs) {
        const std::optional<double> value = finite(error(run.run->figures));
        if (!value || !finite(run.speedup)) {
            missing.push_back(label(walk, run));
            continue;
        }
        any_dominated = any_dominated || run.dominated;
        plot.series.push_back(
            {label(walk, run), run.mark, {glm::dvec2(*run.speedup, *value)}, false}
        );
    }
    plot.captions.emplace_back(
        any_dominated ? "Right and low is good. Pale: dominated by another run of the walk."
                      : "Right and low is good."
    );
    name_missing(plot.captions, missing);
    return plot;
}

std::optional<double> mebibytes(const std::optional<std::uint64_t>& bytes) {
    return bytes ? std::optional(static_cast<double>(*bytes) / kMebibyte) : std::nullopt;
}

BarPlot memory_bars(const ComparedWalk& walk) {
    BarPlot plot;
    plot.title = "Memory";
    plot.axis_title = "peak [MiB]";
    plot.parts = {"images", "hierarchy", "position AOV (measuring only)"};
    plot.limit = "budget of images";
    for (const ComparedRun& run : walk.runs) {
        const RunReport::Memory& memory = run.run->figures.memory;
        PlotBar bar{
            label(walk, run),
            {mebibytes(memory.image_bytes_peak),
             mebibytes(memory.hierarchy_bytes),
             mebibytes(memory.aov_bytes)},
            mebibytes(memory.image_budget_bytes),
            "images " + figure_text(mebibytes(memory.image_bytes_peak))};
        plot.bars.push_back(std::move(bar));
    }
    plot.captions = {devices_text(walk)};
    return plot;
}

bool shows_anything(const BarPlot& plot) {
    return std::any_of(plot.bars.begin(), plot.bars.end(), [](const PlotBar& bar) {
        return std::any_of(bar.parts.begin(), bar.parts.end(), [](const auto& part) {
            return part.has_value();
        });
    });
}

/// A run as it is found again in other walks.
struct RunIdentity {
    std::string name;
    std::string technique;
    std::string preset;
    std::string backend;
    std::string device;
    std::optional<double> error_px;

    [[nodiscard]] auto tied() const {
        return std::tie(name, technique, preset, backend, device, error_px);
    }
    friend bool operator<(const RunIdentity& a, const RunIdentity& b) {
        return a.tied() < b.tied();
    }
};

/// What walks of one plot share, the count aside that tells them apart.
struct WalkIdentity {
    std::string scene;
    int width = 0;
    int height = 0;
    double fov_deg = 0.0;
    std::uint64_t other_count = 0; ///< triangles where frames vary, frames where triangles do

    [[nodiscard]] auto tied() const { return std::tie(scene, width, height, fov_deg, other_count); }
    friend bool operator<(const WalkIdentity& a, const WalkIdentity& b) {
        return a.tied() < b.tied();
    }
};

struct Counts {
    std::uint64_t frames = 0;
    std::uint64_t triangles = 0;
};

/// How a plot across walks is made.
struct AcrossWalks {
    std::string title;
    std::string x_title;
    std::string stem;
    std::uint64_t Counts::*varying;
    std::uint64_t Counts::*other;
    std::string other_name;
};

struct FoundRun {
    const ComparedRun* run = nullptr;
    std::uint64_t count = 0;
};

std::optional<Counts> counts_of(const RunReport& figures) {
    if (figures.frames < 1 || !figures.scene.triangles) {
        return std::nullopt;
    }
    return Counts{static_cast<std::uint64_t>(figures.frames), *figures.scene.triangles};
}

void add_plots_across(
    std::vector<ReportPlot>& plots,
    const std::vector<ComparedWalk>& walks,
    const AcrossWalks& across
) {
    std::map<WalkIdentity, std::map<RunIdentity, std::vector<FoundRun>>> families;
    for (const ComparedWalk& walk : walks) {
        for (const ComparedRun& run : walk.runs) {
            const RunReport& figures = run.run->figures;
            const std::optional<Counts> counts = counts_of(figures);
            // Against itself, plain geometry has nothing to tell.
            if (!counts || !finite(figures.speedup.overall) || run.mark.color == 0) {
                continue;
            }
            const WalkIdentity family{
                figures.scene.name,
                figures.width,
                figures.height,
                figures.fov_deg,
                (*counts).*across.other};
            const RunIdentity identity{
                run.run->name,
                figures.technique,
                figures.preset,
                figures.backend,
                figures.device,
                figures.error_px};
            families[family][identity].push_back({&run, (*counts).*across.varying});
        }
    }
    std::size_t number = 0;
    for (auto& [family, lines] : families) {
        Plot plot;
        plot.title = across.title;
        plot.x = {across.x_title, PlotScale::logarithmic};
        plot.y = {"speed-up over plain geometry [x]", PlotScale::logarithmic};
        std::set<std::string> devices;
        for (auto& [identity, found] : lines) {
            std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
                return a.count < b.count;
            });
            const bool varies = found.front().count != found.back().count;
            if (!varies) {
                continue;
            }
            devices.insert(identity.device);
            PlotMark mark = found.front().run->mark;
            mark.faint = false; // a line joins runs of several walks
            PlotSeries series{identity.name, mark, {}};
            for (const FoundRun& one : found) {
                series.points.emplace_back(
                    static_cast<double>(one.count), *one.run->run->figures.speedup.overall
                );
            }
            plot.series.push_back(std::move(series));
        }
        if (plot.series.empty()) {
            continue;
        }
        plot.levels = {{"as fast as geometry", 1.0}};
        std::string caption = family.scene + ", " + whole_text(family.other_count) + " " +
                              across.other_name + ", " + std::to_string(family.width) + " x " +
                              std::to_string(family.height) + " pixels";
        for (const std::string& device : devices) {
            caption += "; " + device;
        }
        plot.captions = {
            caption + ".",
            "Time of plain geometry on the same device over that of the run, summed over all "
            "frames, "
            "the first included."};
        ++number;
        const std::string suffix = number == 1 ? "" : "_" + std::to_string(number);
        plots.push_back(rendered(across.stem + suffix + ".svg", plot));
    }
}

} // namespace

std::vector<ReportPlot> plots_of_walk(const ComparedWalk& walk, const std::string& stem) {
    std::vector<ReportPlot> plots;
    Plot times = over_frames(walk, time_by_frame);
    if (!times.series.empty()) {
        times.title = "Time of every frame";
        times.y = {"time of a frame [ms]", PlotScale::logarithmic};
        plots.push_back(rendered(stem + "_frame_times.svg", times));
    }
    if (const Plot plot = speedup_by_threshold(walk); !plot.series.empty()) {
        plots.push_back(rendered(stem + "_speedup_threshold.svg", plot));
    }
    const Plot disparity = error_by_speedup(
        walk,
        "Disparity against speed-up",
        "disparity of 99 % of image pixels is less [px]",
        [](const RunReport& report) { return report.disparity_px.p99; }
    );
    if (!disparity.series.empty()) {
        plots.push_back(rendered(stem + "_disparity_speedup.svg", disparity));
    }
    const Plot flip = error_by_speedup(
        walk,
        "Difference from the truth against speed-up",
        "FLIP against the truth, 0 is equal",
        [](const RunReport& report) { return report.truth.flip_mean; }
    );
    if (!flip.series.empty()) {
        plots.push_back(rendered(stem + "_flip_speedup.svg", flip));
    }
    Plot by_frame_disparity = over_frames(walk, disparity_by_frame);
    if (!by_frame_disparity.series.empty()) {
        by_frame_disparity.title = "Disparity of every frame";
        by_frame_disparity.y = {
            "disparity of 99 % of image pixels is less [px]", PlotScale::linear};
        plots.push_back(rendered(stem + "_disparity_frames.svg", by_frame_disparity));
    }
    if (const BarPlot bars = memory_bars(walk); shows_anything(bars)) {
        plots.push_back(rendered(stem + "_memory.svg", bars));
    }
    return plots;
}

std::vector<ReportPlot> plots_across_walks(const std::vector<ComparedWalk>& walks) {
    std::vector<ReportPlot> plots;
    add_plots_across(
        plots,
        walks,
        {"Speed-up against the number of frames on the path",
         "frames on the path",
         "speedup_frames",
         &Counts::frames,
         &Counts::triangles,
         "triangles"}
    );
    add_plots_across(
        plots,
        walks,
        {"Speed-up against the size of the scene",
         "triangles of the scene",
         "speedup_triangles",
         &Counts::triangles,
         &Counts::frames,
         "frames"}
    );
    return plots;
}

} // namespace farfield::eval::detail
