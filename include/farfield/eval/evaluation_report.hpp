#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/disparity_series.hpp>
#include <farfield/eval/run_report.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace farfield {

/// A picture of a report: a whole PNG file, as bytes.
struct ReportPicture {
    std::string caption;
    std::vector<std::uint8_t> png;
};

/// A node whose image was further off than promised, and what it is.
struct ReportOvershoot {
    NodeOvershoot worst;
    int level = 0; ///< below the root
    bool leaf = false;
    double diagonal_m = 0.0; ///< [m] of its box
    double distance_m = 0.0; ///< [m] of the eye from its box in the frame
};

/// One run of an evaluation.
struct EvaluatedRun {
    std::string walk; ///< runs of one walk are compared with each other; they take the same frames
    std::string name; ///< unique within the walk
    RunReport figures;
    std::vector<double> frame_ms; ///< [ms] of every frame; empty: not kept
    /// [px] of every frame, none where a frame showed no image; empty: not measured.
    std::vector<std::optional<double>> disparity_p99_px;
    std::vector<ReportOvershoot> overshoots; ///< the worst nodes; empty: none, or not measured
    int worst_frame = -1;                    ///< that the pictures show; -1: none
    /// Of the worst frame, side by side: picture, reference, truth, heat map.
    std::vector<ReportPicture> pictures;
};

/// Runs that were measured on one machine, to be looked at side by side.
struct Evaluation {
    std::string title;
    std::vector<std::string> notes; ///< under the title: the command, what was set, what to know
    std::vector<EvaluatedRun> runs; ///< in any order; walks appear in that of their first runs
};

namespace eval {

/// Writes a folder of results, which is made where it is missing. Files of the same names are
/// replaced, each at once or not at all:
///
/// - `results.csv`: one line a run. Columns are walk, name, and every leaf of the JSON of a run as
///   `group.key`; what is null there is an empty cell.
/// - `overshoots.csv`: one line a node of a run that was beyond its promise, in the frame in which
/// it
///   was so most. Columns are walk, run, node, level, kind, diagonal_m, distance_m, frame,
///   disparity_px, promise_px and pixels.
/// - `report.html`: one page without scripts or other files, for screens of every size and for
///   paper. For each walk a table of its runs, the fastest first, which of them are dominated,
///   plots, and the worst frames. What was not measured is a dash, never zero.
/// - the plots of the page, each a file `*.svg`.
///
/// A run is **dominated** where another of its walk takes at most 0.95 times its mean time a frame
/// and is nearer to the truth, or as near. Near is what both have of, in this order, FLIP against
/// the truth, PSNR against the truth, FLIP and PSNR against plain geometry; FLIP within 2 % and
/// PSNR within 0.1 dB count as equal.
///
/// Backends of different speed are compared by milliseconds: where the runs of a walk were measured
/// on several devices, its plots divide the time of the fastest plain geometry of all of them by
/// that of the run, and say so.
///
/// The same evaluation gives the same bytes. Text that is not UTF-8 has its bad bytes replaced; in
/// plots, what is not a finite number has no place.
/// @return an error where two runs of a walk have one name, a name is empty, a picture is not a PNG
/// file, or a file cannot be written; the message names run or file
[[nodiscard]] Result<void>
write_report(const Evaluation& evaluation, const std::filesystem::path& folder);

} // namespace eval
} // namespace farfield
