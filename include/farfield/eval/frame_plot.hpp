#pragma once

#include <farfield/core/result.hpp>

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace farfield {

/// A figure of every frame of a walk.
struct FrameSeries {
    std::string name;                          ///< of its line, and of its column in a table
    std::vector<std::optional<double>> values; ///< of frame 0, 1, ...; none: not measured
};

/// Figures of a walk over its frames, as lines.
struct FramePlot {
    std::string title;
    std::string value_title; ///< what the values are, with their unit
    std::vector<FrameSeries> series;
    /// A dashed line at one value, such as the number of all there are, or a threshold.
    struct Level {
        std::string name;
        double value = 0.0;
    };
    std::vector<Level> levels;
    std::vector<std::string> captions; ///< below the plot, a paragraph each
};

namespace eval {

/// The plot as an SVG document that carries its colours, light and dark, and needs no other file.
/// Values are on a linear axis from 0; what is none, not finite or below 0 leaves a gap in its
/// line. The same plot gives the same text.
[[nodiscard]] std::string to_svg(const FramePlot& plot);

/// Writes `to_svg`; an existing file is replaced at once or not at all.
[[nodiscard]] Result<void> save(const FramePlot& plot, const std::filesystem::path& file);

/// Writes a table with a line a frame, as many as the longest series has: `frame` and a column for
/// each series; cells of what is none or not finite are empty. Numbers have six digits after the
/// point, whole ones none.
[[nodiscard]] Result<void>
save_table(std::span<const FrameSeries> series, const std::filesystem::path& file);

} // namespace eval
} // namespace farfield
