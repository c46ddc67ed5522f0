#include "plot.hpp"
#include "text_file.hpp"
#include <farfield/eval/frame_plot.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>

namespace farfield::eval {

namespace {

/// A cell of a table, in quotes where it needs them.
std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\r\n") == std::string::npos) {
        return text;
    }
    std::string result = "\"";
    for (const char letter : text) {
        result += letter == '"' ? "\"\"" : std::string(1, letter);
    }
    return result + "\"";
}

std::string cell(const std::optional<double>& value) {
    if (!value || !std::isfinite(*value)) {
        return {};
    }
    constexpr double kExact = 9007199254740992.0; // 2^53: below it, doubles have their fractions
    const bool whole = std::abs(*value) < kExact && *value == std::floor(*value);
    std::array<char, 400> text{}; // the largest double has 309 digits before the point
    std::snprintf(text.data(), text.size(), whole ? "%.0f" : "%.6f", *value);
    return text.data();
}

} // namespace

std::string to_svg(const FramePlot& plot) {
    constexpr std::size_t kColumns = 600; // about as many pixels as the area of a plot is wide
    detail::Plot lines;
    lines.title = plot.title;
    lines.x = {"frame of the walk", detail::PlotScale::linear_tight};
    lines.y = {plot.value_title, detail::PlotScale::linear};
    lines.captions = plot.captions;
    unsigned hue = 0;
    for (const FrameSeries& series : plot.series) {
        detail::PlotSeries line;
        line.label = series.name;
        line.mark.color = ++hue;
        line.dots = detail::PlotDots::none;
        for (std::size_t frame = 0; frame < series.values.size(); ++frame) {
            line.points.emplace_back(
                static_cast<double>(frame),
                series.values[frame].value_or(std::numeric_limits<double>::quiet_NaN())
            );
        }
        line.points = detail::thinned(line.points, kColumns);
        lines.series.push_back(std::move(line));
    }
    for (const FramePlot::Level& level : plot.levels) {
        lines.levels.push_back({level.name, level.value});
    }
    return detail::to_svg(lines, detail::SvgUse::document);
}

Result<void> save(const FramePlot& plot, const std::filesystem::path& file) {
    return detail::write_text(file, to_svg(plot));
}

Result<void> save_table(std::span<const FrameSeries> series, const std::filesystem::path& file) {
    std::string text = "frame";
    std::size_t frames = 0;
    for (const FrameSeries& one : series) {
        text += "," + quoted(one.name);
        frames = std::max(frames, one.values.size());
    }
    text += "\n";
    for (std::size_t frame = 0; frame < frames; ++frame) {
        text += std::to_string(frame);
        for (const FrameSeries& one : series) {
            text += "," + (frame < one.values.size() ? cell(one.values[frame]) : std::string());
        }
        text += "\n";
    }
    return detail::write_text(file, text);
}

} // namespace farfield::eval
