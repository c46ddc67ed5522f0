#include "plot.hpp"

#include "page_text.hpp"
#include "plot_axis.hpp"
#include "plot_labels.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace farfield::eval::detail {

namespace {

// Sizes in units of the drawing, which are pixels where it is shown as large as it is.
constexpr double kWidth = 860.0;
constexpr double kHeight = 330.0; // of the area inside the axes
constexpr double kTop = 46.0;
constexpr double kMargin = 16.0;
constexpr double kLabelSize = 12.0;
constexpr double kTextSize = 13.0;
constexpr double kTitleSize = 17.0;
constexpr double kLineHeight = 15.0;
constexpr double kMarkerRadius = 4.5;
constexpr double kLeader = 26.0; // from the area to the labels beside it
constexpr std::size_t kLongestLabel = 34;
constexpr std::size_t kCaptionLine = 115; // characters

std::string number(double value) {
    return fixed_text(value, 1);
}

std::string point_text(const glm::dvec2& at) {
    return number(at.x) + "," + number(at.y);
}

/// The elements of one drawing.
class Svg {
  public:
    void line(const glm::dvec2& a, const glm::dvec2& b, std::string_view classes) {
        body_ += "<path class=\"" + std::string(classes) + "\" d=\"M" + point_text(a) + "L" +
                 point_text(b) + "\"/>\n";
    }

    void text(
        const glm::dvec2& at,
        std::string_view words,
        double size,
        std::string_view classes = "ink",
        std::string_view attributes = ""
    ) {
        body_ += "<text class=\"" + std::string(classes) + "\" x=\"" + number(at.x) + "\" y=\"" +
                 number(at.y) + "\" font-size=\"" + number(size) + "\"" + std::string(attributes) +
                 ">" + escaped(words) + "</text>\n";
    }

    void rectangle(const glm::dvec2& corner, const glm::dvec2& size, std::string_view classes) {
        body_ += "<rect class=\"" + std::string(classes) + "\" x=\"" + number(corner.x) +
                 "\" y=\"" + number(corner.y) + "\" width=\"" + number(size.x) + "\" height=\"" +
                 number(size.y) + "\"/>\n";
    }

    void raw(const std::string& element) { body_ += element; }

    /// The whole drawing, of a width and height.
    [[nodiscard]] std::string finished(std::string_view title, double height, SvgUse use) const {
        const std::string size = number(kWidth) + " " + number(height);
        std::string result = "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" width=\"" +
                             number(kWidth) + "\" height=\"" + number(height) +
                             "\" viewBox=\"0 0 " + size + "\" role=\"img\">\n<title>" +
                             escaped(title) + "</title>\n";
        if (use == SvgUse::document) {
            result += "<style>" + plot_style_sheet() + "</style>\n";
        }
        return result + "<rect class=\"paper\" width=\"" + number(kWidth) + "\" height=\"" +
               number(height) + "\"/>\n" + body_ + "</svg>\n";
    }

  private:
    std::string body_;
};

std::string color_class(char kind, unsigned color) {
    return kind + std::to_string(color % kPlotColors);
}

std::string line_classes(const PlotMark& mark) {
    std::string classes = "line " + color_class('s', mark.color);
    classes += " d" + std::to_string(mark.dash % kPlotDashes);
    return mark.faint ? classes + " faint" : classes;
}

/// Outline of a marker's shape. @param shape not 0, which is a circle
std::string outline(const glm::dvec2& at, unsigned shape) {
    // Corners, and the turn of the first one; radii that make areas look alike.
    struct Polygon {
        int corners;
        double first_rad;
        double scale;
    };
    constexpr double kUp = -std::numbers::pi / 2.0;
    constexpr std::array<Polygon, kPlotShapes - 1> kPolygons = {
        {{4, kUp / 2.0, 1.25},
         {3, kUp, 1.4},
         {4, kUp, 1.3},
         {3, -kUp, 1.4},
         {5, kUp, 1.2},
         {6, 0.0, 1.15}}};
    const Polygon& polygon = kPolygons[shape - 1];
    std::string points;
    for (int corner = 0; corner < polygon.corners; ++corner) {
        const double angle = polygon.first_rad + 2.0 * std::numbers::pi * corner / polygon.corners;
        const double radius = kMarkerRadius * polygon.scale;
        points += (points.empty() ? "" : " ") +
                  point_text(at + radius * glm::dvec2(std::cos(angle), std::sin(angle)));
    }
    return "<polygon points=\"" + points + "\"";
}

std::string circle(const glm::dvec2& at, double radius) {
    return "<circle cx=\"" + number(at.x) + "\" cy=\"" + number(at.y) + "\" r=\"" + number(radius) +
           "\"";
}

void draw_marker(Svg& svg, const glm::dvec2& at, const PlotMark& mark) {
    const unsigned shape = mark.shape % kPlotShapes;
    const bool filled = mark.variant % 3 == 0;
    const std::string body = filled ? color_class('f', mark.color) : "hollow";
    const std::string faint = mark.faint ? " faint" : "";
    svg.raw(
        (shape == 0 ? circle(at, kMarkerRadius) : outline(at, shape)) + " class=\"marker " + body +
        " " + color_class('s', mark.color) + faint + "\"/>\n"
    );
    if (mark.variant % 3 == 2) {
        svg.raw(
            circle(at, kMarkerRadius / 3.0) + " class=\"" + color_class('f', mark.color) + faint +
            "\"/>\n"
        );
    }
}

/// Where the axes lie, and what lies on them.
struct Area {
    Axis x;
    Axis y;
    double left = 0.0;
    double right = 0.0;
    double top = 0.0;
    double bottom = 0.0;

    [[nodiscard]] glm::dvec2 at(const glm::dvec2& point) const {
        return {
            left + (right - left) * x.share(point.x), bottom - (bottom - top) * y.share(point.y)};
    }
};

bool has_place(const Plot& plot, const glm::dvec2& point) {
    return Axis::has_place(plot.x.scale, point.x) && Axis::has_place(plot.y.scale, point.y);
}

/// The last point of a series that has a place.
std::optional<glm::dvec2> last_point(const Plot& plot, const PlotSeries& series) {
    for (auto point = series.points.rbegin(); point != series.points.rend(); ++point) {
        if (has_place(plot, *point)) {
            return *point;
        }
    }
    return std::nullopt;
}

void draw_axes(Svg& svg, const Area& area, const PlotAxis& x, const PlotAxis& y) {
    for (const Axis::Tick& tick : area.y.ticks()) {
        const double at = area.bottom - (area.bottom - area.top) * tick.share;
        svg.line({area.left, at}, {area.right, at}, "grid");
        svg.text({area.left - 8.0, at + 4.5}, tick.label, kTextSize, "ink end");
    }
    // Labels that would run into the one before are left out, their lines are not.
    double free_from = 0.0;
    for (const Axis::Tick& tick : area.x.ticks()) {
        const double at = area.left + (area.right - area.left) * tick.share;
        const double half = text_width(tick.label, kTextSize) / 2.0;
        svg.line({at, area.top}, {at, area.bottom}, "grid");
        if (at - half >= free_from) {
            svg.text({at, area.bottom + 19.0}, tick.label, kTextSize, "ink middle");
            free_from = at + half + 6.0;
        }
    }
    svg.line({area.left, area.bottom}, {area.right, area.bottom}, "axis");
    svg.line({area.left, area.top}, {area.left, area.bottom}, "axis");
    svg.text(
        {(area.left + area.right) / 2.0, area.bottom + 41.0}, x.title, kTextSize, "ink middle"
    );
    const glm::dvec2 side(kMargin + 6.0, (area.top + area.bottom) / 2.0);
    svg.text(
        side,
        y.title,
        kTextSize,
        "ink middle",
        " transform=\"rotate(-90 " + number(side.x) + " " + number(side.y) + ")\""
    );
}

void draw_series(Svg& svg, const Plot& plot, const Area& area, const PlotSeries& series) {
    if (series.joined) {
        std::string path;
        bool pen_down = false;
        for (const glm::dvec2& point : series.points) {
            if (!has_place(plot, point)) {
                pen_down = false;
                continue;
            }
            const std::string at = point_text(area.at(point));
            // A point alone is a line to itself, which round ends make visible.
            path += pen_down ? "" : "M" + at;
            path += "L" + at;
            pen_down = true;
        }
        if (!path.empty()) {
            svg.raw(
                "<path class=\"" + line_classes(series.mark) + (series.mark.faint ? " thin" : "") +
                "\" d=\"" + path + "\"/>\n"
            );
        }
    }
    bool drawn = false;
    for (const glm::dvec2& point : series.points) {
        const bool wanted =
            series.dots == PlotDots::all || (series.dots == PlotDots::first && !drawn);
        if (wanted && has_place(plot, point)) {
            draw_marker(svg, area.at(point), series.mark);
            drawn = true;
        }
    }
}

/// Labels beside the area, each with a piece of its line; as high as their lines end, moved apart.
void draw_labels_right(Svg& svg, const Plot& plot, const Area& area) {
    struct Label {
        std::string text;
        std::optional<PlotMark> mark; ///< none: of a level
        glm::dvec2 from{0.0};
    };
    std::vector<Label> labels;
    for (const PlotSeries& series : plot.series) {
        const std::optional<glm::dvec2> last = last_point(plot, series);
        if (last && !series.label.empty()) {
            labels.push_back({series.label, series.mark, area.at(*last)});
        }
    }
    for (const PlotLevel& level : plot.levels) {
        if (Axis::has_place(plot.y.scale, level.y)) {
            const double share = area.y.share(level.y);
            const double y = area.bottom - (area.bottom - area.top) * share;
            labels.push_back({level.label, std::nullopt, {area.right, y}});
        }
    }
    std::stable_sort(labels.begin(), labels.end(), [](const Label& a, const Label& b) {
        return a.from.y < b.from.y;
    });
    std::vector<double> wanted;
    wanted.reserve(labels.size());
    for (const Label& label : labels) {
        wanted.push_back(label.from.y);
    }
    const std::vector<double> heights = moved_apart(wanted, kLineHeight, area.top, area.bottom);
    for (std::size_t index = 0; index < labels.size(); ++index) {
        const Label& label = labels[index];
        const glm::dvec2 edge(area.right + 4.0, label.from.y);
        const glm::dvec2 end(area.right + kLeader, heights[index]);
        if (label.from.x + 1.0 < area.right) {
            svg.line(label.from, edge, "leader");
        }
        svg.line(edge, {end.x - 8.0, end.y}, label.mark ? line_classes(*label.mark) : "level");
        if (label.mark) {
            draw_marker(svg, {end.x - 6.0, end.y}, *label.mark);
        }
        const bool quiet = !label.mark || label.mark->faint;
        svg.text(
            {end.x + 3.0, end.y + 4.0},
            shortened(valid_utf8(label.text), kLongestLabel),
            kLabelSize,
            quiet ? "quiet" : "ink"
        );
    }
}

/// Labels inside the area, beside their points.
void draw_labels_at_points(Svg& svg, const Plot& plot, const Area& area) {
    std::vector<PointLabel> labels;
    std::vector<const PlotSeries*> owners;
    for (const PlotSeries& series : plot.series) {
        const std::optional<glm::dvec2> last = last_point(plot, series);
        if (last && !series.label.empty()) {
            const std::string text = shortened(valid_utf8(series.label), kLongestLabel);
            labels.push_back({area.at(*last), {text_width(text, kLabelSize), kLabelSize}, text});
            owners.push_back(&series);
        }
    }
    const LabelArea room{{area.left, area.top}, {kWidth - 8.0, area.bottom}};
    const std::vector<glm::dvec2> corners = places_beside(labels, kMarkerRadius + 2.0, room);
    // All leaders first, so that none crosses a label that is already there.
    for (std::size_t index = 0; index < labels.size(); ++index) {
        const PointLabel& label = labels[index];
        const glm::dvec2 nearest =
            glm::clamp(label.point, corners[index], corners[index] + label.size);
        if (glm::distance(nearest, label.point) > 3.0 * kMarkerRadius) {
            svg.line(label.point, nearest, "leader");
        }
    }
    for (std::size_t index = 0; index < labels.size(); ++index) {
        svg.text(
            corners[index] + glm::dvec2(0.0, labels[index].size.y - 2.5),
            labels[index].text,
            kLabelSize,
            owners[index]->mark.faint ? "quiet halo" : "ink halo"
        );
    }
}

/// Captions below the drawing. @return height of everything
double draw_captions(Svg& svg, const std::vector<std::string>& captions, double y) {
    for (const std::string& caption : captions) {
        for (const std::string& line : wrapped(valid_utf8(caption), kCaptionLine)) {
            svg.text({kMargin, y}, line, kTextSize, "quiet");
            y += kTextSize + 4.0;
        }
    }
    return y;
}

double widest_tick(const Axis& axis) {
    double widest = 0.0;
    for (const Axis::Tick& tick : axis.ticks()) {
        widest = std::max(widest, text_width(tick.label, kTextSize));
    }
    return widest;
}

} // namespace

std::string plot_style_sheet() {
    struct Scheme {
        std::string_view paper;
        std::string_view ink;
        std::string_view quiet;
        std::string_view grid;
        std::array<std::string_view, kPlotColors> colors;
    };
    // The hues of Okabe and Ito, Color Universal Design, 2008, darker or lighter where the paper
    // would swallow them.
    constexpr Scheme kLight = {
        "#ffffff",
        "#1f2933",
        "#5b6773",
        "#e3e8ed",
        {"#1f2933", "#0072b2", "#d55e00", "#009e73", "#c26a9b", "#c08400", "#3fa2db", "#7a858f"}};
    constexpr Scheme kDark = {
        "#14191f",
        "#e4e9ee",
        "#9aa6b2",
        "#2b343d",
        {"#e4e9ee", "#3d94d6", "#f0762f", "#1fc196", "#dd8fbb", "#e69f00", "#85cdf7", "#8e99a4"}};
    const auto rules = [](const Scheme& scheme) {
        std::string text;
        const auto rule =
            [&](std::string_view selector, std::string_view property, std::string_view value) {
                text += ".plot ";
                text += selector;
                text += "{";
                text += property;
                text += ":";
                text += value;
                text += "}";
            };
        rule(".paper", "fill", scheme.paper);
        rule(".hollow", "fill", scheme.paper);
        rule(".ink", "fill", scheme.ink);
        rule(".quiet", "fill", scheme.quiet);
        rule(".grid", "stroke", scheme.grid);
        rule(".axis", "stroke", scheme.ink);
        rule(".leader", "stroke", scheme.quiet);
        rule(".level", "stroke", scheme.quiet);
        rule(".halo", "stroke", scheme.paper);
        for (unsigned color = 0; color < kPlotColors; ++color) {
            rule("." + color_class('s', color), "stroke", scheme.colors[color]);
            rule("." + color_class('f', color), "fill", scheme.colors[color]);
        }
        return text;
    };
    return ".plot{font-family:Arial,'Liberation Sans',Helvetica,sans-serif}"
           ".plot path{fill:none;stroke-linejoin:round;stroke-linecap:round}"
           ".plot .line{stroke-width:2}.plot .thin{stroke-width:1.2}"
           ".plot .marker{stroke-width:1.8}"
           ".plot .axis{stroke-width:1.2}.plot .leader{stroke-width:.8;stroke-dasharray:1 3}"
           ".plot .level{stroke-width:1.4;stroke-dasharray:7 5}"
           ".plot .limit{stroke-width:2.2}"
           ".plot .d1{stroke-dasharray:7 4}.plot .d2{stroke-dasharray:2 4}"
           ".plot .d3{stroke-dasharray:9 4 2 4}"
           ".plot .middle{text-anchor:middle}.plot .end{text-anchor:end}"
           ".plot .title{font-weight:600}"
           ".plot .halo{stroke-width:3;paint-order:stroke}"
           ".plot .faint{opacity:.45}" +
           rules(kLight) + "@media (prefers-color-scheme:dark){" + rules(kDark) + "}";
}

std::string to_svg(const Plot& plot, SvgUse use) {
    std::vector<double> xs;
    std::vector<double> ys;
    std::size_t lines = plot.levels.size();
    double longest = 0.0;
    for (const PlotSeries& series : plot.series) {
        lines += series.label.empty() ? 0 : 1;
        for (const glm::dvec2& point : series.points) {
            if (has_place(plot, point)) {
                xs.push_back(point.x);
                ys.push_back(point.y);
            }
        }
    }
    const bool empty = xs.empty();
    const auto measure = [&](const std::string& label) {
        const std::string text = shortened(valid_utf8(label), kLongestLabel);
        longest = std::max(longest, text_width(text, kLabelSize));
    };
    for (const PlotSeries& series : plot.series) {
        measure(series.label);
    }
    for (const PlotLevel& level : plot.levels) {
        measure(level.label);
        ys.push_back(level.y);
    }
    Area area{Axis(plot.x.scale, xs), Axis(plot.y.scale, ys)};
    const bool beside = plot.labels == PlotLabels::right;
    area.left = kMargin + 26.0 + widest_tick(area.y);
    area.right = kWidth - (beside ? kLeader + longest + kMargin : 3.0 * kMargin);
    area.top = kTop;
    // As many labels as there are need their room beside the area.
    area.bottom = kTop + std::max(kHeight, beside ? kLineHeight * static_cast<double>(lines) : 0.0);

    Svg svg;
    svg.text({kMargin, 26.0}, plot.title, kTitleSize, "ink title");
    draw_axes(svg, area, plot.x, plot.y);
    for (const PlotLevel& level : plot.levels) {
        if (Axis::has_place(plot.y.scale, level.y)) {
            const double y = area.bottom - (area.bottom - area.top) * area.y.share(level.y);
            svg.line({area.left, y}, {area.right, y}, "level");
        }
    }
    // The first series is drawn last: it lies above the others.
    for (auto series = plot.series.rbegin(); series != plot.series.rend(); ++series) {
        draw_series(svg, plot, area, *series);
    }
    if (empty) {
        svg.text(
            {(area.left + area.right) / 2.0, (area.top + area.bottom) / 2.0},
            "nothing was measured",
            kTextSize,
            "quiet middle"
        );
    } else if (beside) {
        draw_labels_right(svg, plot, area);
    } else {
        draw_labels_at_points(svg, plot, area);
    }
    const double height = draw_captions(svg, plot.captions, area.bottom + 68.0);
    return svg.finished(plot.title, height, use);
}

std::string to_svg(const BarPlot& plot, SvgUse use) {
    constexpr double kRow = 26.0;
    constexpr double kBar = 15.0;
    std::vector<double> ends;
    double longest_label = 0.0;
    double longest_text = 0.0;
    const auto has_length = [](const std::optional<double>& part) {
        return part && Axis::has_place(PlotScale::linear, *part);
    };
    for (const PlotBar& bar : plot.bars) {
        double end = 0.0;
        for (const std::optional<double>& part : bar.parts) {
            end += has_length(part) ? *part : 0.0;
        }
        ends.push_back(end);
        if (bar.limit) {
            ends.push_back(*bar.limit);
        }
        const std::string label = shortened(valid_utf8(bar.label), kLongestLabel);
        longest_label = std::max(longest_label, text_width(label, kLabelSize));
        longest_text = std::max(longest_text, text_width(valid_utf8(bar.text), kLabelSize));
    }
    const Axis axis(PlotScale::linear, ends);
    const double left = kMargin + longest_label + 10.0;
    const double right = std::max(left + 100.0, kWidth - kMargin - longest_text - 12.0);
    const double top = kTop + 24.0;
    const double bottom = top + kRow * std::max(1.0, static_cast<double>(plot.bars.size()));
    const auto at = [&](double value) { return left + (right - left) * axis.share(value); };

    Svg svg;
    svg.text({kMargin, 26.0}, plot.title, kTitleSize, "ink title");
    double key_x = left;
    for (std::size_t part = 0; part < plot.parts.size(); ++part) {
        const auto color = static_cast<unsigned>(part) + 1;
        svg.rectangle({key_x, kTop - 4.0}, {12.0, 12.0}, color_class('f', color));
        svg.text({key_x + 17.0, kTop + 6.5}, plot.parts[part], kLabelSize);
        key_x += 17.0 + text_width(plot.parts[part], kLabelSize) + 18.0;
    }
    const bool limited = std::any_of(plot.bars.begin(), plot.bars.end(), [&](const PlotBar& bar) {
        return has_length(bar.limit);
    });
    if (limited) {
        svg.line({key_x + 4.0, kTop - 5.0}, {key_x + 4.0, kTop + 9.0}, "limit axis");
        svg.text({key_x + 12.0, kTop + 6.5}, plot.limit, kLabelSize);
    }
    for (const Axis::Tick& tick : axis.ticks()) {
        const double x = left + (right - left) * tick.share;
        svg.line({x, top}, {x, bottom}, "grid");
        svg.text({x, bottom + 19.0}, tick.label, kTextSize, "ink middle");
    }
    double y = top;
    for (const PlotBar& bar : plot.bars) {
        svg.text(
            {left - 8.0, y + kRow / 2.0 + 4.0},
            shortened(valid_utf8(bar.label), kLongestLabel),
            kLabelSize,
            "ink end"
        );
        double begin = 0.0;
        for (std::size_t part = 0; part < bar.parts.size(); ++part) {
            if (!has_length(bar.parts[part])) {
                continue;
            }
            const double end = begin + *bar.parts[part];
            const auto color = static_cast<unsigned>(part) + 1;
            svg.rectangle(
                {at(begin), y + (kRow - kBar) / 2.0},
                {at(end) - at(begin), kBar},
                color_class('f', color)
            );
            begin = end;
        }
        double text_from = at(begin);
        if (has_length(bar.limit)) {
            const double x = at(*bar.limit);
            svg.line({x, y + 3.0}, {x, y + kRow - 3.0}, "limit axis");
            text_from = std::max(text_from, x);
        }
        svg.text({text_from + 7.0, y + kRow / 2.0 + 4.0}, bar.text, kLabelSize, "quiet halo");
        y += kRow;
    }
    svg.line({left, top}, {left, bottom}, "axis");
    svg.text({(left + right) / 2.0, bottom + 41.0}, plot.axis_title, kTextSize, "ink middle");
    const double height = draw_captions(svg, plot.captions, bottom + 68.0);
    return svg.finished(plot.title, height, use);
}

std::vector<glm::dvec2> smoothed(const std::vector<glm::dvec2>& points, std::size_t window) {
    std::vector<glm::dvec2> result = points;
    std::vector<double> around;
    for (std::size_t index = 0; index < points.size(); ++index) {
        if (!std::isfinite(points[index].y)) {
            continue;
        }
        around.clear();
        const std::size_t begin = index - std::min(index, window / 2);
        const std::size_t end = std::min(points.size(), index + window / 2 + 1);
        for (std::size_t other = begin; other < end; ++other) {
            if (std::isfinite(points[other].y)) {
                around.push_back(points[other].y);
            }
        }
        const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
        std::nth_element(around.begin(), middle, around.end());
        result[index].y = *middle;
    }
    return result;
}

std::vector<glm::dvec2> thinned(const std::vector<glm::dvec2>& points, std::size_t columns) {
    if (points.size() <= 4 * columns) {
        return points;
    }
    std::vector<glm::dvec2> kept;
    for (std::size_t column = 0; column < columns; ++column) {
        const std::size_t begin = points.size() * column / columns;
        const std::size_t end = points.size() * (column + 1) / columns;
        std::vector<std::size_t> chosen = {begin, end - 1};
        std::optional<std::size_t> least;
        std::optional<std::size_t> most;
        for (std::size_t index = begin; index < end; ++index) {
            const double y = points[index].y;
            if (!std::isfinite(y)) {
                chosen.push_back(index);
                continue;
            }
            if (!least || y < points[*least].y) {
                least = index;
            }
            if (!most || y > points[*most].y) {
                most = index;
            }
        }
        if (least) {
            chosen.push_back(*least);
            chosen.push_back(*most);
        }
        std::sort(chosen.begin(), chosen.end());
        chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
        for (const std::size_t index : chosen) {
            kept.push_back(points[index]);
        }
    }
    return kept;
}

} // namespace farfield::eval::detail
