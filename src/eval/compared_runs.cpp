#include "compared_runs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace farfield::eval::detail {

namespace {

constexpr std::string_view kGeometry = "geometry";

constexpr double kEqualShare = 0.02;
constexpr double kEqualDb = 0.1;

/// The best one first.
constexpr std::array<Nearness, 4> kNearness = {
    {{"FLIP against the truth",
      "the truth",
      [](const RunReport& report) { return report.truth.flip_mean; },
      true,
      kEqualShare},
     {"PSNR against the truth [dB]",
      "the truth",
      [](const RunReport& report) { return report.truth.psnr_db_median; },
      false,
      kEqualDb},
     {"FLIP against plain geometry",
      "plain geometry",
      [](const RunReport& report) { return report.image.flip_mean; },
      true,
      kEqualShare},
     {"PSNR against plain geometry [dB]",
      "plain geometry",
      [](const RunReport& report) { return report.image.psnr_db_median; },
      false,
      kEqualDb}}};

bool is_equal(const Nearness& nearness, double a, double b) noexcept {
    const double allowed =
        nearness.less_is_nearer ? nearness.tolerance * std::max(a, b) : nearness.tolerance;
    return a == b || std::abs(a - b) <= allowed;
}

/// Position in a list that grows by what it does not have.
std::size_t position_in(std::vector<std::string>& list, const std::string& text) {
    const auto found = std::find(list.begin(), list.end(), text);
    if (found != list.end()) {
        return static_cast<std::size_t>(found - list.begin());
    }
    list.push_back(text);
    return list.size() - 1;
}

std::optional<double> usable_time(const std::optional<double>& ms) {
    return ms && std::isfinite(*ms) && *ms > 0.0 ? ms : std::nullopt;
}

/// Mean time of plain geometry on the run's device: its reference, or the run itself.
std::optional<double> geometry_ms(const RunReport& report) {
    if (report.reference_frame_ms.total && report.frames > 0) {
        return usable_time(*report.reference_frame_ms.total / report.frames);
    }
    return report.technique == kGeometry ? usable_time(report.frame_ms.mean) : std::nullopt;
}

/// How `other` dominates `run`, if it does.
std::optional<Domination> domination(const ComparedRun& run, const ComparedRun& other) {
    // Two runs of the same program differ by a few hundredths.
    constexpr double kFaster = 0.95;
    if (!run.mean_ms || !other.mean_ms || *other.mean_ms > kFaster * *run.mean_ms) {
        return std::nullopt;
    }
    for (const Nearness& nearness : kNearness) {
        const std::optional<double> own = nearness.value(run.run->figures);
        const std::optional<double> others = nearness.value(other.run->figures);
        if (!own || !others || std::isnan(*own) || std::isnan(*others)) {
            continue;
        }
        if (is_equal(nearness, *own, *others)) {
            return Domination{0, &nearness, true};
        }
        const bool nearer = nearness.less_is_nearer ? *others < *own : *others > *own;
        return nearer ? std::optional(Domination{0, &nearness, false}) : std::nullopt;
    }
    return std::nullopt;
}

void find_dominations(ComparedWalk& walk) {
    for (ComparedRun& run : walk.runs) {
        for (std::size_t other = 0; other < walk.runs.size(); ++other) {
            std::optional<Domination> found = domination(run, walk.runs[other]);
            const bool baseline = is_baseline(walk.runs[other].run->figures);
            if (!found || (run.dominated && !baseline)) {
                continue;
            }
            found->by = other;
            run.dominated = found;
            if (baseline) {
                break;
            }
        }
        run.mark.faint = run.dominated.has_value();
    }
}

void find_speedups(ComparedWalk& walk) {
    for (const ComparedRun& run : walk.runs) {
        const std::optional<double> ms = geometry_ms(run.run->figures);
        if (ms && (!walk.geometry || *ms < walk.geometry->mean_ms)) {
            walk.geometry = {run.device, *ms};
        }
    }
    for (ComparedRun& run : walk.runs) {
        if (walk.devices.size() == 1) {
            run.speedup = run.run->figures.speedup.overall;
        } else if (walk.geometry && run.mean_ms) {
            run.speedup = walk.geometry->mean_ms / *run.mean_ms;
        }
    }
}

} // namespace

std::vector<ComparedWalk> compare(const Evaluation& evaluation) {
    std::vector<ComparedWalk> walks;
    std::vector<std::string> names;
    std::vector<std::string> techniques = {std::string(kGeometry)};
    std::vector<std::string> backends;
    for (const EvaluatedRun& run : evaluation.runs) {
        const std::size_t index = position_in(names, run.walk);
        if (index == walks.size()) {
            walks.push_back({.name = run.walk, .devices = {}, .geometry = {}, .runs = {}});
        }
        ComparedWalk& walk = walks[index];
        ComparedRun compared;
        compared.run = &run;
        compared.device = position_in(walk.devices, run.figures.device);
        compared.mean_ms = usable_time(run.figures.frame_ms.mean);
        const std::size_t technique = position_in(techniques, run.figures.technique);
        // Ink is for plain geometry alone.
        constexpr std::size_t kHues = kPlotColors - 1;
        compared.mark.color =
            technique == 0 ? 0U : static_cast<unsigned>(1 + (technique - 1) % kHues);
        compared.mark.shape = static_cast<unsigned>(technique % kPlotShapes);
        compared.mark.variant =
            static_cast<unsigned>(position_in(backends, run.figures.backend) % 3);
        compared.mark.dash = static_cast<unsigned>(std::count_if(
            walk.runs.begin(),
            walk.runs.end(),
            [&](const ComparedRun& other) {
                return other.run->figures.technique == run.figures.technique;
            }
        ));
        walk.runs.push_back(compared);
    }
    for (ComparedWalk& walk : walks) {
        const auto time = [](const ComparedRun& run) {
            return run.mean_ms.value_or(std::numeric_limits<double>::infinity());
        };
        std::stable_sort(
            walk.runs.begin(),
            walk.runs.end(),
            [&](const ComparedRun& a, const ComparedRun& b) { return time(a) < time(b); }
        );
        find_speedups(walk);
        find_dominations(walk);
    }
    return walks;
}

std::string device_letter(std::size_t device) {
    constexpr std::size_t kLetters = 26;
    const std::string last(1, static_cast<char>('A' + device % kLetters));
    return device < kLetters ? last : device_letter(device / kLetters - 1) + last;
}

std::string label(const ComparedWalk& walk, const ComparedRun& run) {
    return walk.devices.size() == 1 ? run.run->name
                                    : run.run->name + " \u00B7 " + device_letter(run.device);
}

bool is_baseline(const RunReport& report) {
    return report.technique == kGeometry || report.technique == "mesh-lod";
}

bool lacks_nearness(const RunReport& report) {
    return std::none_of(kNearness.begin(), kNearness.end(), [&](const Nearness& nearness) {
        return nearness.value(report).has_value();
    });
}

} // namespace farfield::eval::detail
