#pragma once

#include "compared_runs.hpp"

#include <string>
#include <vector>

/// Which plots a report has. One that has nothing to show is left out.
namespace farfield::eval::detail {

struct ReportPlot {
    std::string file;     ///< name without folder, "island_frame_times.svg"
    std::string document; ///< SVG that stands alone
    std::string element;  ///< the same for a page
};

/// Plots of one walk.
/// @param stem of the names of its files
[[nodiscard]] std::vector<ReportPlot>
plots_of_walk(const ComparedWalk& walk, const std::string& stem);

/// Plots over walks that differ in nothing but the number of frames, or of triangles: runs of one
/// name with the same technique, backend, device, size and threshold.
[[nodiscard]] std::vector<ReportPlot> plots_across_walks(const std::vector<ComparedWalk>& walks);

} // namespace farfield::eval::detail
