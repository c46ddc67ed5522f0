#include "pictures.hpp"
#include <farfield/eval/heat_map.hpp>

#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace {

using farfield::HeatMapOptions;
using farfield::Picture;
using farfield::PixelMap;
using farfield::test::channel;
using glm::u8vec3;
namespace eval = farfield::eval;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

u8vec3 color_at(const Picture& picture, int x, int y) {
    CHECK(channel(picture, x, y, 3) == 255);
    return {channel(picture, x, y, 0), channel(picture, x, y, 1), channel(picture, x, y, 2)};
}

double lightness(const u8vec3& color) {
    const auto linear = [](int level) {
        const double s = level / 255.0;
        return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
    };
    const double y =
        0.2126390 * linear(color.r) + 0.7151687 * linear(color.g) + 0.0721923 * linear(color.b);
    return y > 216.0 / 24389.0 ? 116.0 * std::cbrt(y) - 16.0 : y * 24389.0 / 27.0;
}

} // namespace

TEST_CASE("heat maps refuse maps and scales that say nothing", "[heat_map]") {
    const PixelMap good{2, 1, {0.0F, 1.0F}};
    CHECK(eval::heat_map(good));
    CHECK_FALSE(eval::heat_map(PixelMap{}));
    CHECK_FALSE(eval::heat_map(PixelMap{2, 1, {0.0F}}));
    CHECK_FALSE(eval::heat_map(good, {.dark = 1.0}));
    CHECK_FALSE(eval::heat_map(good, {.dark = std::nan("")}));
    const auto refused = eval::heat_map(good, {.bright = std::numeric_limits<double>::infinity()});
    REQUIRE_FALSE(refused);
    CHECK(
        refused.error().message ==
        "heat map: scale goes from 0.000000 to inf, expected two different finite values"
    );
}

TEST_CASE("the ramp rises evenly in lightness", "[heat_map]") {
    // Rounding moves a channel by half a level. Where L* is steepest, near black, all three
    // channels by that are less than 0.3 of it.
    constexpr double kRounding = 0.3;
    for (int step = 0; step < 256; ++step) {
        CAPTURE(step);
        const double share = step / 255.0;
        CHECK(
            lightness(eval::heat_color(share)) ==
            Approx(4.0 + 90.0 * share).epsilon(0.0).margin(kRounding)
        );
    }
    CHECK(eval::heat_color(-3.0) == eval::heat_color(0.0));
    CHECK(eval::heat_color(7.0) == eval::heat_color(1.0));
    CHECK(eval::heat_color(std::nan("")) == eval::heat_color(0.0));
}

TEST_CASE("no colour of the ramp can be taken for the special ones", "[heat_map]") {
    const HeatMapOptions options;
    for (const u8vec3& special : {options.beyond, options.unmeasured}) {
        for (int step = 0; step < 256; ++step) {
            CAPTURE(step);
            const u8vec3 color = eval::heat_color(step / 255.0);
            const int distance = std::abs(int{color.r} - special.r) +
                                 std::abs(int{color.g} - special.g) +
                                 std::abs(int{color.b} - special.b);
            CHECK(distance > 60);
        }
    }
}

TEST_CASE("values become colours by their place on the scale", "[heat_map]") {
    const PixelMap map{4, 2, {0.0F, 1.5F, 3.0F, 3.01F, -1.0F, kNan, kInfinity, -kInfinity}};
    const auto picture = eval::heat_map(map, {.bright = 3.0, .color_bar = false});
    REQUIRE(picture);
    REQUIRE(picture->width == 4);
    REQUIRE(picture->height == 2);
    const HeatMapOptions colors;
    CHECK(color_at(*picture, 0, 0) == eval::heat_color(0.0));
    CHECK(color_at(*picture, 1, 0) == eval::heat_color(0.5));
    CHECK(color_at(*picture, 2, 0) == eval::heat_color(1.0));
    CHECK(color_at(*picture, 3, 0) == colors.beyond);
    CHECK(color_at(*picture, 0, 1) == eval::heat_color(0.0));
    CHECK(color_at(*picture, 1, 1) == colors.unmeasured);
    CHECK(color_at(*picture, 2, 1) == colors.beyond);
    CHECK(color_at(*picture, 3, 1) == eval::heat_color(0.0));

    // Similarity: 1 is dark, and below 0 is beyond.
    const PixelMap similarity{3, 1, {1.0F, 0.5F, -0.5F}};
    const auto reversed =
        eval::heat_map(similarity, {.dark = 1.0, .bright = 0.0, .color_bar = false});
    REQUIRE(reversed);
    CHECK(color_at(*reversed, 0, 0) == eval::heat_color(0.0));
    CHECK(color_at(*reversed, 1, 0) == eval::heat_color(0.5));
    CHECK(color_at(*reversed, 2, 0) == colors.beyond);
}

TEST_CASE("the colour bar lies below the map and shows the whole scale", "[heat_map]") {
    PixelMap map{120, 3, {}};
    map.values.assign(360, 0.25F);
    const auto bare = eval::heat_map(map, {.bright = 2.5, .color_bar = false});
    const auto with_bar = eval::heat_map(map, {.bright = 2.5});
    REQUIRE(bare);
    REQUIRE(with_bar);
    REQUIRE(with_bar->width == 120);
    REQUIRE(with_bar->height == 3 + eval::kColorBarHeight);
    CHECK(std::equal(bare->rgba.begin(), bare->rgba.end(), with_bar->rgba.begin()));

    const int middle = 3 + eval::kColorBarHeight / 2;
    int ramp = 0;
    int beyond = 0;
    double before = 0.0;
    for (int x = 0; x < 120; ++x) {
        const u8vec3 color = color_at(*with_bar, x, middle);
        beyond += color == HeatMapOptions{}.beyond ? 1 : 0;
        if (color == eval::heat_color(0.0)) {
            ramp = 0;
            before = lightness(color);
        } else if (lightness(color) > before && color != HeatMapOptions{}.beyond) {
            ++ramp;
            before = lightness(color);
        }
    }
    CHECK(beyond == 10);
    CHECK(ramp > 50); // rises all along the bar

    // Maps of any size have room for it, or for as much of it as fits.
    for (const int width : {1, 2, 7, 30}) {
        PixelMap narrow{width, 1, {}};
        narrow.values.assign(static_cast<std::size_t>(width), 0.0F);
        const auto picture = eval::heat_map(narrow, {.dark = -12345.678, .bright = 1e-9});
        REQUIRE(picture);
        CHECK(picture->rgba.size() == static_cast<std::size_t>(width) * 21 * 4);
    }
}

TEST_CASE("the unit is written behind both ends of the scale", "[heat_map]") {
    PixelMap map{160, 2, {}};
    map.values.assign(320, 0.0F);
    const auto bar = [&](const char* unit) {
        const auto picture = eval::heat_map(map, {.bright = 4.0, .unit = unit});
        REQUIRE(picture);
        return *picture;
    };
    // Pixels of the ramp itself in a row through its middle, and those of text in all rows.
    const auto count = [](const Picture& picture) {
        const u8vec3 text(240, 240, 240);
        const u8vec3 behind(24, 28, 32);
        const int middle = picture.height - eval::kColorBarHeight / 2;
        std::array<int, 2> counts{};
        for (int x = 0; x < picture.width; ++x) {
            const u8vec3 color = color_at(picture, x, middle);
            counts[0] += color != text && color != behind ? 1 : 0;
            for (int y = picture.height - eval::kColorBarHeight; y < picture.height; ++y) {
                counts[1] += color_at(picture, x, y) == text ? 1 : 0;
            }
        }
        return counts;
    };
    const auto bare = count(bar(""));
    const auto pixels = count(bar("px"));
    const auto blank = count(bar("~~"));
    // A gap and two characters of 6 pixels each, at both ends.
    CHECK(bare[0] - pixels[0] == 2 * 3 * 6);
    // p has 16 dots, x has 9.
    CHECK(pixels[1] - bare[1] == 2 * (16 + 9));
    // What has no shape takes its place nevertheless.
    CHECK(blank[0] == pixels[0]);
    CHECK(blank[1] == bare[1]);
}
