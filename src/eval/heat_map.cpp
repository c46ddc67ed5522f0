#include "canvas.hpp"
#include "color_space.hpp"
#include "picture_checks.hpp"
#include <farfield/eval/heat_map.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

namespace farfield::eval {

namespace {

using glm::dvec2;
using glm::dvec3;
using glm::u8vec3;

constexpr int kSteps = 256;
constexpr double kDegree = 3.14159265358979323846 / 180.0;

dvec3 linear_rgb(double lightness, double chroma, double hue_rad, const glm::dmat3& to_rgb) {
    const dvec3 lab(lightness, chroma * std::cos(hue_rad), chroma * std::sin(hue_rad));
    return to_rgb * detail::xyz_from_lab(lab);
}

bool in_gamut(const dvec3& rgb) noexcept {
    return glm::all(glm::greaterThanEqual(rgb, dvec3(0.0))) &&
           glm::all(glm::lessThanEqual(rgb, dvec3(1.0)));
}

u8vec3 ramp_color(double share) {
    // From violet (300 degrees) over red (30) to yellow (100).
    const double lightness = 4.0 + 90.0 * share;
    const double hue_rad = (300.0 + 160.0 * share) * kDegree;
    const glm::dmat3 to_rgb = glm::inverse(detail::xyz_from_linear_rgb());
    // Grey is always in gamut, so bisection finds the strongest colour that is.
    double weak = 0.0;
    double strong = 70.0;
    if (in_gamut(linear_rgb(lightness, strong, hue_rad, to_rgb))) {
        weak = strong;
    }
    for (int step = 0; step < 30; ++step) {
        const double chroma = 0.5 * (weak + strong);
        (in_gamut(linear_rgb(lightness, chroma, hue_rad, to_rgb)) ? weak : strong) = chroma;
    }
    const dvec3 rgb = linear_rgb(lightness, weak, hue_rad, to_rgb);
    u8vec3 color;
    for (int channel = 0; channel < 3; ++channel) {
        const double level = 255.0 * detail::srgb_from_linear(std::clamp(rgb[channel], 0.0, 1.0));
        color[channel] = static_cast<std::uint8_t>(std::lround(level));
    }
    return color;
}

std::array<u8vec3, kSteps> make_ramp() {
    std::array<u8vec3, kSteps> ramp{};
    for (int step = 0; step < kSteps; ++step) {
        ramp[static_cast<std::size_t>(step)] = ramp_color(step / (kSteps - 1.0));
    }
    return ramp;
}

void set(Picture& picture, std::size_t pixel, const u8vec3& color) noexcept {
    picture.rgba[4 * pixel] = color.r;
    picture.rgba[4 * pixel + 1] = color.g;
    picture.rgba[4 * pixel + 2] = color.b;
    picture.rgba[4 * pixel + 3] = 255;
}

std::string label(double value, const std::string& unit) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", value);
    return unit.empty() ? text.data() : text.data() + (" " + unit);
}

/// Both ends of the scale, the ramp between them, and what lies beyond; over what is there.
void draw_color_bar(Picture& picture, const HeatMapOptions& options) {
    constexpr int kMargin = 4;
    constexpr int kBeyondWidth = 10;
    const u8vec3 text(240, 240, 240);
    const int top = picture.height - kColorBarHeight;
    for (int y = top; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            set(picture,
                static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                    static_cast<std::size_t>(x),
                u8vec3(24, 28, 32));
        }
    }
    detail::Canvas canvas(picture);
    const std::string dark = label(options.dark, options.unit);
    const std::string bright = label(options.bright, options.unit);
    const int text_y = top + (kColorBarHeight - detail::Canvas::text_height(1)) / 2;
    const int left = 2 * kMargin + detail::Canvas::text_width(dark, 1);
    const int end = picture.width - 2 * kMargin - detail::Canvas::text_width(bright, 1);
    canvas.text(dvec2(kMargin, text_y), dark, 1, text);
    canvas.text(dvec2(end + kMargin, text_y), bright, 1, text);
    const int right = end - kBeyondWidth;
    for (int y = top + kMargin; y < picture.height - kMargin; ++y) {
        for (int x = std::max(left, 0); x < end; ++x) {
            const double share = (x - left) / std::max(right - left - 1.0, 1.0);
            set(picture,
                static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                    static_cast<std::size_t>(x),
                x < right ? heat_color(share) : options.beyond);
        }
    }
}

} // namespace

u8vec3 heat_color(double share) noexcept {
    static const std::array<u8vec3, kSteps> kRamp = make_ramp();
    const double step = std::round(std::clamp(share, 0.0, 1.0) * (kSteps - 1));
    return kRamp[std::isnan(share) ? 0 : static_cast<std::size_t>(step)];
}

Result<Picture> heat_map(const PixelMap& map, const HeatMapOptions& options) {
    if (auto checked = detail::check("heat map", map); !checked) {
        return tl::unexpected(checked.error());
    }
    if (!std::isfinite(options.dark) || !std::isfinite(options.bright) ||
        options.dark == options.bright) {
        return fail(
            ErrorCode::invalid_argument,
            "heat map: scale goes from " + std::to_string(options.dark) + " to " +
                std::to_string(options.bright) + ", expected two different finite values"
        );
    }
    Picture picture{map.width, map.height + (options.color_bar ? kColorBarHeight : 0), {}};
    picture.rgba.resize(
        static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height) * 4
    );
    for (std::size_t pixel = 0; pixel < map.values.size(); ++pixel) {
        const double value = static_cast<double>(map.values[pixel]);
        const double share = (value - options.dark) / (options.bright - options.dark);
        if (std::isnan(value)) {
            set(picture, pixel, options.unmeasured);
        } else if (share > 1.0) {
            set(picture, pixel, options.beyond);
        } else {
            set(picture, pixel, heat_color(share));
        }
    }
    if (options.color_bar) {
        draw_color_bar(picture, options);
    }
    return picture;
}

} // namespace farfield::eval
