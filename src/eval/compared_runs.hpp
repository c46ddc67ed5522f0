#pragma once

#include "plot.hpp"
#include <farfield/eval/evaluation_report.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// What the figures of an evaluation say when runs of one walk are held against each other.
namespace farfield::eval::detail {

/// A figure that tells how near pictures are to what they should show.
struct Nearness {
    std::string_view figure; ///< "FLIP against the truth"
    std::string_view target; ///< "the truth"
    std::optional<double> (*value)(const RunReport& report);
    bool less_is_nearer;
    /// Figures this close are as good as equal: a share of the larger where less is nearer, dB
    /// where it is not.
    double tolerance;
};

/// Another run is faster, and nearer or as near.
struct Domination {
    /// Index into `ComparedWalk::runs`: of the baselines that dominate the fastest, else of all.
    std::size_t by = 0;
    const Nearness* nearness = nullptr;
    bool equal = false; ///< as near
};

struct ComparedRun {
    const EvaluatedRun* run = nullptr;
    std::size_t device = 0; ///< index into `ComparedWalk::devices`
    PlotMark mark;
    std::optional<double> mean_ms; ///< of a frame
    /// With one device, that of the run; with several, over the fastest geometry of them all.
    std::optional<double> speedup;
    std::optional<Domination> dominated;
};

struct FastestGeometry {
    std::size_t device = 0;
    double mean_ms = 0.0;
};

struct ComparedWalk {
    std::string name;
    std::vector<std::string> devices;
    std::optional<FastestGeometry> geometry; ///< plain, as reference or as a run of its own
    std::vector<ComparedRun> runs;           ///< the fastest first, those without times last
};

/// Runs by walk. Marks are the same for a technique and a backend throughout.
[[nodiscard]] std::vector<ComparedWalk> compare(const Evaluation& evaluation);

/// Capital letters for devices: A ... Z, AA, ...
[[nodiscard]] std::string device_letter(std::size_t device);

/// Name of a run, with the letter of its device where the walk has several.
[[nodiscard]] std::string label(const ComparedWalk& walk, const ComparedRun& run);

/// True for what a user would take without Farfield.
[[nodiscard]] bool is_baseline(const RunReport& report);

/// True where nothing tells how near the run is, so that nothing can be said of domination.
[[nodiscard]] bool lacks_nearness(const RunReport& report);

} // namespace farfield::eval::detail
