#pragma once

#include <glm/vec2.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Plots as SVG: plain data in, text out, the same text on every run. What has no place on its axis
/// (not finite, below 0, or 0 on a logarithmic one) is left out, so no coordinate is ever bad.
namespace farfield::eval::detail {

/// Colours that colour-blind readers tell apart, on paper and on a dark screen: 0 is ink, the
/// others are hues.
inline constexpr unsigned kPlotColors = 8;
inline constexpr unsigned kPlotShapes = 7;
inline constexpr unsigned kPlotDashes = 4;

/// How a series looks. Indices wrap around.
struct PlotMark {
    unsigned color = 0;
    unsigned shape = 0;
    unsigned dash = 0;    ///< 0: a solid line
    unsigned variant = 0; ///< of the shape: filled, hollow, hollow with a dot
    bool faint = false;
};

/// Which points of a series have a marker.
enum class PlotDots : std::uint8_t { none, first, all };

struct PlotSeries {
    std::string label; ///< empty: none
    PlotMark mark;
    std::vector<glm::dvec2> points; ///< one that has no place breaks the line
    bool joined = true;             ///< by a line
    PlotDots dots = PlotDots::all;
};

/// A dashed line at one value of y.
struct PlotLevel {
    std::string label;
    double y = 0.0;
};

enum class PlotScale : std::uint8_t {
    linear,       ///< from 0 to a round value
    linear_tight, ///< from 0 to the last value
    logarithmic,  ///< from one round value to another
};

struct PlotAxis {
    std::string title; ///< with the unit
    PlotScale scale = PlotScale::linear;
};

enum class PlotLabels : std::uint8_t {
    right,    ///< beside the plot, at the height of the last point of the series
    at_points ///< beside the last point of the series, where there is room
};

struct Plot {
    std::string title;
    PlotAxis x;
    PlotAxis y;
    std::vector<PlotSeries> series;
    std::vector<PlotLevel> levels;
    PlotLabels labels = PlotLabels::right;
    std::vector<std::string> captions; ///< below, a paragraph each
};

/// One bar of several parts.
struct PlotBar {
    std::string label;
    std::vector<std::optional<double>> parts; ///< by `BarPlot::parts`; none: not measured
    std::optional<double> limit;              ///< marked across the bar
    std::string text;                         ///< after the bar
};

/// Bars that lie below each other; zero is at the left.
struct BarPlot {
    std::string title;
    std::string axis_title; ///< with the unit
    std::vector<std::string> parts;
    std::string limit; ///< what the limits are
    std::vector<PlotBar> bars;
    std::vector<std::string> captions;
};

enum class SvgUse : std::uint8_t {
    document, ///< a document that carries its colours
    element   ///< an element of a page that has `plot_style_sheet`
};

/// Rules for both schemes, for the elements of class `plot`.
[[nodiscard]] std::string plot_style_sheet();

[[nodiscard]] std::string to_svg(const Plot& plot, SvgUse use);
[[nodiscard]] std::string to_svg(const BarPlot& plot, SvgUse use);

/// The median of y over the `window` points around each, fewer at the ends; a point without a
/// finite y stays one. @pre window is odd
[[nodiscard]] std::vector<glm::dvec2>
smoothed(const std::vector<glm::dvec2>& points, std::size_t window);

/// At most four points for each of `columns` stretches of a line: first, least, most and last in
/// their order, so that no peak is lost. A gap in a stretch is kept.
[[nodiscard]] std::vector<glm::dvec2>
thinned(const std::vector<glm::dvec2>& points, std::size_t columns);

} // namespace farfield::eval::detail
