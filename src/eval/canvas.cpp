#include "canvas.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace farfield::eval::detail {

namespace {

using glm::dvec2;

constexpr int kGlyphWidth = 5;
constexpr int kGlyphHeight = 9; // two rows below the line that characters stand on
constexpr int kGlyphAdvance = kGlyphWidth + 1;

/// Five dots a row, the left one is the highest bit.
struct Glyph {
    char character = ' ';
    std::array<std::uint8_t, kGlyphHeight> rows{};
};

// clang-format off
constexpr Glyph kGlyphs[] = {
    {'+', {0x00, 0x04, 0x04, 0x1F, 0x04, 0x04, 0x00, 0x00, 0x00}},
    {'-', {0x00, 0x00, 0x00, 0x0E, 0x00, 0x00, 0x00, 0x00, 0x00}},
    {'.', {0x00, 0x00, 0x00, 0x00, 0x00, 0x0C, 0x0C, 0x00, 0x00}},
    {'0', {0x0E, 0x11, 0x11, 0x11, 0x11, 0x11, 0x0E, 0x00, 0x00}},
    {'1', {0x04, 0x0C, 0x14, 0x04, 0x04, 0x04, 0x1F, 0x00, 0x00}},
    {'2', {0x0E, 0x11, 0x01, 0x06, 0x08, 0x10, 0x1F, 0x00, 0x00}},
    {'3', {0x0E, 0x11, 0x01, 0x06, 0x01, 0x11, 0x0E, 0x00, 0x00}},
    {'4', {0x02, 0x06, 0x0A, 0x12, 0x1F, 0x02, 0x02, 0x00, 0x00}},
    {'5', {0x1F, 0x10, 0x1E, 0x01, 0x01, 0x11, 0x0E, 0x00, 0x00}},
    {'6', {0x0E, 0x10, 0x10, 0x1E, 0x11, 0x11, 0x0E, 0x00, 0x00}},
    {'7', {0x1F, 0x01, 0x02, 0x02, 0x04, 0x04, 0x04, 0x00, 0x00}},
    {'8', {0x0E, 0x11, 0x11, 0x0E, 0x11, 0x11, 0x0E, 0x00, 0x00}},
    {'9', {0x0E, 0x11, 0x11, 0x0F, 0x01, 0x01, 0x0E, 0x00, 0x00}},
    {'a', {0x00, 0x00, 0x0E, 0x01, 0x0F, 0x11, 0x0F, 0x00, 0x00}},
    {'b', {0x10, 0x10, 0x1E, 0x11, 0x11, 0x11, 0x1E, 0x00, 0x00}},
    {'c', {0x00, 0x00, 0x0E, 0x11, 0x10, 0x11, 0x0E, 0x00, 0x00}},
    {'d', {0x01, 0x01, 0x0F, 0x11, 0x11, 0x11, 0x0F, 0x00, 0x00}},
    {'e', {0x00, 0x00, 0x0E, 0x11, 0x1F, 0x10, 0x0E, 0x00, 0x00}},
    {'f', {0x06, 0x09, 0x08, 0x1C, 0x08, 0x08, 0x08, 0x00, 0x00}},
    {'g', {0x00, 0x00, 0x0F, 0x11, 0x11, 0x11, 0x0F, 0x01, 0x0E}},
    {'h', {0x10, 0x10, 0x16, 0x19, 0x11, 0x11, 0x11, 0x00, 0x00}},
    {'i', {0x04, 0x00, 0x0C, 0x04, 0x04, 0x04, 0x0E, 0x00, 0x00}},
    {'k', {0x10, 0x10, 0x12, 0x14, 0x18, 0x14, 0x12, 0x00, 0x00}},
    {'l', {0x0C, 0x04, 0x04, 0x04, 0x04, 0x04, 0x0E, 0x00, 0x00}},
    {'m', {0x00, 0x00, 0x1A, 0x15, 0x15, 0x15, 0x15, 0x00, 0x00}},
    {'n', {0x00, 0x00, 0x1E, 0x11, 0x11, 0x11, 0x11, 0x00, 0x00}},
    {'o', {0x00, 0x00, 0x0E, 0x11, 0x11, 0x11, 0x0E, 0x00, 0x00}},
    {'p', {0x00, 0x00, 0x1E, 0x11, 0x11, 0x11, 0x1E, 0x10, 0x10}},
    {'q', {0x00, 0x00, 0x0F, 0x11, 0x11, 0x11, 0x0F, 0x01, 0x01}},
    {'r', {0x00, 0x00, 0x16, 0x19, 0x10, 0x10, 0x10, 0x00, 0x00}},
    {'s', {0x00, 0x00, 0x0F, 0x10, 0x0E, 0x01, 0x1E, 0x00, 0x00}},
    {'t', {0x08, 0x08, 0x1E, 0x08, 0x08, 0x09, 0x06, 0x00, 0x00}},
    {'u', {0x00, 0x00, 0x11, 0x11, 0x11, 0x13, 0x0D, 0x00, 0x00}},
    {'v', {0x00, 0x00, 0x11, 0x11, 0x0A, 0x0A, 0x04, 0x00, 0x00}},
    {'w', {0x00, 0x00, 0x11, 0x15, 0x15, 0x15, 0x0A, 0x00, 0x00}},
    {'x', {0x00, 0x00, 0x11, 0x0A, 0x04, 0x0A, 0x11, 0x00, 0x00}},
    {'y', {0x00, 0x00, 0x11, 0x11, 0x11, 0x11, 0x0F, 0x01, 0x0E}},
    {'z', {0x00, 0x00, 0x1F, 0x02, 0x04, 0x08, 0x1F, 0x00, 0x00}},
};
// clang-format on

bool is_finite(const dvec2& point) noexcept {
    return std::isfinite(point.x) && std::isfinite(point.y);
}

/// Cuts a segment to lo <= component <= hi. @return false when nothing is left
bool clip(dvec2& a, dvec2& b, int component, double lo, double hi) noexcept {
    if (a[component] > b[component]) {
        return clip(b, a, component, lo, hi);
    }
    if (b[component] < lo || a[component] > hi) {
        return false;
    }
    const dvec2 from = a;
    const dvec2 way = b - a;
    if (a[component] < lo) {
        a = from + way * ((lo - from[component]) / way[component]);
        a[component] = lo;
    }
    if (b[component] > hi) {
        b = from + way * ((hi - from[component]) / way[component]);
        b[component] = hi;
    }
    return is_finite(a) && is_finite(b);
}

double distance_to_segment(const dvec2& point, const dvec2& a, const dvec2& b) noexcept {
    const dvec2 way = b - a;
    const double length_sq = glm::dot(way, way);
    const double along =
        length_sq > 0.0 ? std::clamp(glm::dot(point - a, way) / length_sq, 0.0, 1.0) : 0.0;
    return glm::length(point - a - way * along);
}

} // namespace

void Canvas::blend(int x, int y, const glm::u8vec3& color, double opacity) noexcept {
    const std::size_t pixel =
        (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture_->width) +
         static_cast<std::size_t>(x)) *
        4;
    const std::array<std::uint8_t, 4> target = {color.r, color.g, color.b, 255};
    for (std::size_t channel = 0; channel < target.size(); ++channel) {
        std::uint8_t& value = picture_->rgba[pixel + channel];
        value = static_cast<std::uint8_t>(
            std::lround(std::lerp(double{1} * value, double{1} * target[channel], opacity))
        );
    }
}

void Canvas::line(const dvec2& a, const dvec2& b, double width, const glm::u8vec3& color) noexcept {
    if (!is_finite(a) || !is_finite(b)) {
        return;
    }
    const double radius = width / 2.0;
    const double reach = radius + 1.0; // beyond that no pixel has a share of the line
    dvec2 begin = a;
    dvec2 end = b;
    if (!clip(begin, end, 0, -reach, picture_->width + reach) ||
        !clip(begin, end, 1, -reach, picture_->height + reach)) {
        return;
    }
    // Along the axis on which it is longer a line meets every row or column of pixels once.
    const dvec2 size = glm::abs(end - begin);
    const int major = size.y > size.x ? 1 : 0;
    const int minor = 1 - major;
    if (begin[major] > end[major]) {
        std::swap(begin, end);
    }
    const int major_size = major == 0 ? picture_->width : picture_->height;
    const int minor_size = major == 0 ? picture_->height : picture_->width;
    const double slope =
        size[major] > 0.0 ? (end[minor] - begin[minor]) / (end[major] - begin[major]) : 0.0;
    const double minor_reach = reach * std::sqrt(1.0 + slope * slope);
    const int first = std::max(static_cast<int>(std::floor(begin[major] - reach)), 0);
    const int last = std::min(static_cast<int>(std::ceil(end[major] + reach)), major_size - 1);
    for (int i = first; i <= last; ++i) {
        const double at = std::clamp(i + 0.5, begin[major], end[major]);
        const double middle = begin[minor] + slope * (at - begin[major]);
        const int low = std::max(static_cast<int>(std::floor(middle - minor_reach)), 0);
        const int high =
            std::min(static_cast<int>(std::ceil(middle + minor_reach)), minor_size - 1);
        for (int j = low; j <= high; ++j) {
            const int x = major == 0 ? i : j;
            const int y = major == 0 ? j : i;
            const double away = distance_to_segment({x + 0.5, y + 0.5}, begin, end);
            // A line thinner than a pixel covers no more of it than its width.
            const double coverage = std::clamp(radius + 0.5 - away, 0.0, std::min(width, 1.0));
            if (coverage > 0.0) {
                blend(x, y, color, coverage);
            }
        }
    }
}

void Canvas::outline(
    std::span<const dvec2> points, double width, const glm::u8vec3& color
) noexcept {
    for (std::size_t i = 0; i < points.size(); ++i) {
        line(points[i], points[(i + 1) % points.size()], width, color);
    }
}

void Canvas::fill(
    std::span<const dvec2> points, const glm::u8vec3& color, double opacity
) noexcept {
    if (points.empty() || !std::all_of(points.begin(), points.end(), is_finite)) {
        return;
    }
    double top = points[0].y;
    double bottom = points[0].y;
    for (const dvec2& point : points) {
        top = std::min(top, point.y);
        bottom = std::max(bottom, point.y);
    }
    const int first = static_cast<int>(std::clamp(std::floor(top), 0.0, picture_->height * 1.0));
    const int last = static_cast<int>(std::clamp(std::ceil(bottom), 0.0, picture_->height * 1.0));
    for (int y = first; y < last; ++y) {
        const double at = y + 0.5;
        double left = std::numeric_limits<double>::infinity();
        double right = -left;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const dvec2& a = points[i];
            const dvec2& b = points[(i + 1) % points.size()];
            if ((a.y <= at) == (b.y <= at)) {
                continue;
            }
            const double x = std::lerp(a.x, b.x, (at - a.y) / (b.y - a.y));
            left = std::min(left, x);
            right = std::max(right, x);
        }
        left = std::max(left, 0.0);
        right = std::min(right, picture_->width * 1.0);
        if (!(left < right)) {
            continue;
        }
        const int end = static_cast<int>(std::ceil(right));
        for (int x = static_cast<int>(left); x < end; ++x) {
            const double coverage = std::min(right, x + 1.0) - std::max(left, x * 1.0);
            blend(x, y, color, opacity * coverage);
        }
    }
}

void Canvas::text(
    const dvec2& at, std::string_view text, int scale, const glm::u8vec3& color
) noexcept {
    double x = std::round(at.x);
    const double y = std::round(at.y);
    for (const char character : text) {
        const auto* const glyph =
            std::find_if(std::begin(kGlyphs), std::end(kGlyphs), [&](const Glyph& candidate) {
                return candidate.character == character;
            });
        if (glyph != std::end(kGlyphs)) {
            for (int row = 0; row < kGlyphHeight; ++row) {
                for (int column = 0; column < kGlyphWidth; ++column) {
                    const unsigned bits = glyph->rows[static_cast<std::size_t>(row)];
                    if (((bits >> static_cast<unsigned>(kGlyphWidth - 1 - column)) & 1U) == 0U) {
                        continue;
                    }
                    const dvec2 lo(x + column * scale, y + row * scale);
                    const dvec2 hi = lo + double(scale);
                    const std::array<dvec2, 4> dot = {lo, dvec2(hi.x, lo.y), hi, dvec2(lo.x, hi.y)};
                    fill(dot, color, 1.0);
                }
            }
        }
        x += kGlyphAdvance * scale;
    }
}

int Canvas::text_width(std::string_view text, int scale) noexcept {
    return static_cast<int>(text.size()) * kGlyphAdvance * scale;
}

int Canvas::text_height(int scale) noexcept {
    return kGlyphHeight * scale;
}

} // namespace farfield::eval::detail
