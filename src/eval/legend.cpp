#include "legend.hpp"

#include <farfield/eval/heat_map.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <utility>

namespace farfield::eval::detail {

namespace {

using glm::dvec2;

/// The largest of 1, 2, 5, 10, ... that is not more.
double round_length(double most) noexcept {
    const double power = std::pow(10.0, std::floor(std::log10(most)));
    for (const double factor : {5.0, 2.0}) {
        if (factor * power <= most) {
            return factor * power;
        }
    }
    return power;
}

std::string length_text(double metres) {
    constexpr double kKilometre = 1000.0;
    std::array<char, 32> text{};
    const bool long_way = metres >= kKilometre;
    std::snprintf(
        text.data(),
        text.size(),
        "%g %s",
        long_way ? metres / kKilometre : metres,
        long_way ? "km" : "m"
    );
    return text.data();
}

/// A line with ticks at both ends, of a round length. @return its right end [px]
double draw_scale_bar(
    Canvas& canvas,
    const dvec2& begin,
    double length_px,
    const LegendLayout& layout,
    const glm::u8vec3& color
) noexcept {
    const dvec2 end = begin + dvec2(std::round(length_px), 0.0);
    const dvec2 tick(0.0, 2.5 * layout.scale);
    canvas.line(begin, end, layout.scale, color);
    canvas.line(begin - tick, begin + tick, layout.scale, color);
    canvas.line(end - tick, end + tick, layout.scale, color);
    return end.x;
}

void draw_ramp(Canvas& canvas, const dvec2& lo, int width, int height) noexcept {
    for (int x = 0; x < width; ++x) {
        const dvec2 left = lo + dvec2(x, 0.0);
        const std::array<dvec2, 4> column = {
            left, left + dvec2(1.0, 0.0), left + dvec2(1.0, height), left + dvec2(0.0, height)};
        canvas.fill(column, heat_color(x / std::max(width - 1.0, 1.0)), 1.0);
    }
}

} // namespace

LegendLayout::LegendLayout(int width, int height) {
    constexpr int kPixelsPerScale = 400;
    scale = std::max(std::min(width, height) / kPixelsPerScale, 1);
    sample_px = 9 * scale;
    bar_px = 60 * scale;
    gap_px = 5 * scale;
    row_px = Canvas::text_height(scale) + gap_px;
}

Legend::Legend(
    std::vector<LegendEntry> entries, const LegendLayout& layout, int width, int most_px
) noexcept
    : entries_(std::move(entries)), layout_(layout) {
    if (entries_.empty()) {
        return;
    }
    const int left = 2 * layout.gap_px;
    int x = left;
    int y = layout.gap_px;
    for (LegendEntry& entry : entries_) {
        const bool bar =
            entry.sample == LegendSample::scale_bar || entry.sample == LegendSample::ramp;
        const int sample = bar ? layout.bar_px : layout.sample_px;
        const int needed = sample + layout.gap_px + Canvas::text_width(entry.label, layout.scale);
        if (x + needed > width && x > left) {
            x = left;
            y += layout.row_px;
        }
        entry.at = dvec2(x, y);
        x += needed + 2 * layout.gap_px;
    }
    height_ = y + layout.row_px > most_px ? 0 : y + layout.row_px;
}

void Legend::append_to(Picture& picture, const LegendColors& colors, double pixels_per_metre)
    const {
    if (height_ == 0) {
        return;
    }
    constexpr double kMiddleOfCapitals = 3.5;
    const int top = picture.height;
    // Rows are stored from the top, so the legend goes below by adding some.
    const Picture below = blank_picture(picture.width, height_, colors.background);
    picture.rgba.insert(picture.rgba.end(), below.rgba.begin(), below.rgba.end());
    picture.height += height_;
    Canvas canvas(picture);
    canvas.line({0.0, top}, {picture.width, top}, 1.0, colors.rule);
    const double size = layout_.sample_px;
    for (const LegendEntry& entry : entries_) {
        const dvec2 at = entry.at + dvec2(0.0, top);
        const dvec2 left(at.x, at.y + kMiddleOfCapitals * layout_.scale);
        const dvec2 right = left + dvec2(size, 0.0);
        const dvec2 upper_left(left.x, std::round(left.y - size / 2.0));
        std::string label = entry.label;
        double end = right.x;
        switch (entry.sample) {
        case LegendSample::box: {
            const double half = entry.line_px / 2.0;
            const dvec2 lo = upper_left + half;
            const dvec2 hi = lo + (size - entry.line_px);
            const std::array<dvec2, 4> square = {lo, dvec2(hi.x, lo.y), hi, dvec2(lo.x, hi.y)};
            canvas.fill(square, entry.color, entry.tint);
            canvas.outline(square, entry.line_px, entry.color);
            break;
        }
        case LegendSample::line:
            canvas.line(left, right, entry.line_px, entry.color);
            break;
        case LegendSample::path: {
            const std::array<dvec2, 2> ends = {left, right};
            draw_cased_path(canvas, ends, entry.line_px, colors.text, entry.color);
            break;
        }
        case LegendSample::eye:
            draw_eye(canvas, left + dvec2(size / 2.0, 0.0), size, colors.text, colors.eye);
            break;
        case LegendSample::mark:
            draw_mark(
                canvas, left + dvec2(size / 2.0, 0.0), size * 0.6, entry.line_px, entry.color
            );
            break;
        case LegendSample::ramp:
            draw_ramp(canvas, upper_left, layout_.bar_px, layout_.sample_px);
            end = left.x + layout_.bar_px;
            break;
        case LegendSample::scale_bar: {
            const double metres = round_length(layout_.bar_px / pixels_per_metre);
            end = draw_scale_bar(canvas, left, metres * pixels_per_metre, layout_, entry.color);
            label = length_text(metres);
            break;
        }
        }
        canvas.text({end + layout_.gap_px, at.y}, label, layout_.scale, colors.text);
    }
}

void draw_eye(
    Canvas& canvas,
    const dvec2& at,
    double size_px,
    const glm::u8vec3& ring,
    const glm::u8vec3& color
) noexcept {
    canvas.line(at, at, size_px, ring);
    canvas.line(at, at, size_px * 0.6, color);
}

void draw_cased_path(
    Canvas& canvas,
    std::span<const dvec2> points,
    double line_px,
    const glm::u8vec3& casing,
    const glm::u8vec3& color
) noexcept {
    constexpr double kCasing = 2.0; // width of the dark line, in widths of the light one
    for (std::size_t i = 1; i < points.size(); ++i) {
        canvas.line(points[i - 1], points[i], kCasing * line_px, casing);
    }
    for (std::size_t i = 1; i < points.size(); ++i) {
        canvas.line(points[i - 1], points[i], line_px, color);
    }
}

void draw_mark(
    Canvas& canvas, const dvec2& at, double size_px, double line_px, const glm::u8vec3& color
) noexcept {
    const dvec2 fall(size_px / 2.0, size_px / 2.0);
    const dvec2 rise(size_px / 2.0, -size_px / 2.0);
    canvas.line(at - fall, at + fall, line_px, color);
    canvas.line(at - rise, at + rise, line_px, color);
}

Picture blank_picture(int width, int height, const glm::u8vec3& color) {
    Picture picture{width, height, {}};
    const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    picture.rgba.reserve(pixels * 4);
    for (std::size_t i = 0; i < pixels; ++i) {
        picture.rgba.insert(picture.rgba.end(), {color.r, color.g, color.b, 255});
    }
    return picture;
}

} // namespace farfield::eval::detail
