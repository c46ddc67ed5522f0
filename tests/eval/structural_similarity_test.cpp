#include "pictures.hpp"
#include <farfield/eval/pixel_map.hpp>
#include <farfield/eval/structural_similarity.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace {

using farfield::Picture;
using farfield::PixelMap;
using farfield::test::at;
using farfield::test::channel;
using farfield::test::filled;
using farfield::test::noise;
using farfield::test::structured;
namespace eval = farfield::eval;

constexpr double kC1 = 6.5025;
constexpr double kC2 = 58.5225;

// The index is computed in double to 1e-11 and stored as float, whose neighbours below 1 are 6e-8
// apart.
constexpr double kRounding = 1e-7;

/// The definition, word for word: weighted means first, then weighted squares of what is left.
double index_at(const Picture& a, const Picture& b, int x, int y) {
    const auto luma = [](const Picture& picture, int u, int v) {
        return (299.0 * channel(picture, u, v, 0) + 587.0 * channel(picture, u, v, 1) +
                114.0 * channel(picture, u, v, 2)) /
               1000.0;
    };
    const auto weighted = [](auto&& value) {
        double sum = 0.0;
        double weights = 0.0;
        for (int v = -5; v <= 5; ++v) {
            for (int u = -5; u <= 5; ++u) {
                const double weight = std::exp(-(u * u + v * v) / (2.0 * 1.5 * 1.5));
                sum += weight * value(u, v);
                weights += weight;
            }
        }
        return sum / weights;
    };
    const double ma = weighted([&](int u, int v) { return luma(a, x + u, y + v); });
    const double mb = weighted([&](int u, int v) { return luma(b, x + u, y + v); });
    const double va =
        weighted([&](int u, int v) { return std::pow(luma(a, x + u, y + v) - ma, 2.0); });
    const double vb =
        weighted([&](int u, int v) { return std::pow(luma(b, x + u, y + v) - mb, 2.0); });
    const double cov = weighted([&](int u, int v) {
        return (luma(a, x + u, y + v) - ma) * (luma(b, x + u, y + v) - mb);
    });
    return (2.0 * ma * mb + kC1) * (2.0 * cov + kC2) /
           ((ma * ma + mb * mb + kC1) * (va + vb + kC2));
}

void check_against_definition(const Picture& a, const Picture& b) {
    const auto map = eval::ssim_map(a, b);
    REQUIRE(map);
    double sum = 0.0;
    int windows = 0;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            CAPTURE(x, y);
            if (x < 5 || y < 5 || x >= a.width - 5 || y >= a.height - 5) {
                CHECK(std::isnan(at(*map, x, y)));
                continue;
            }
            const double expected = index_at(a, b, x, y);
            CHECK(at(*map, x, y) == Approx(expected).epsilon(0.0).margin(kRounding));
            sum += expected;
            ++windows;
        }
    }
    CHECK(*eval::mean(*map) == Approx(sum / windows).epsilon(0.0).margin(kRounding));
}

} // namespace

TEST_CASE("a mean is of what was measured", "[pixel_map]") {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    CHECK_FALSE(eval::mean(PixelMap{}).has_value());
    CHECK_FALSE(eval::mean(PixelMap{2, 1, {kNan, kNan}}).has_value());
    CHECK(eval::mean(PixelMap{3, 1, {1.0F, kNan, 4.0F}}) == 2.5);
    CHECK(eval::mean(PixelMap{2, 1, {1.0F, kInfinity}}) == std::numeric_limits<double>::infinity());
}

TEST_CASE("similarity needs two pictures of one size that hold a window", "[ssim]") {
    const Picture good = filled(11, 11, 1, 2, 3);
    CHECK(eval::ssim_map(good, good));
    CHECK_FALSE(eval::ssim_map(Picture{}, Picture{}));
    CHECK_FALSE(eval::ssim_map(good, filled(12, 11, 1, 2, 3)));
    const Picture dot = filled(1, 1, 1, 2, 3);
    CHECK_FALSE(eval::ssim_map(dot, dot));
    const Picture small = filled(11, 10, 1, 2, 3);
    const auto refused = eval::ssim_map(small, small);
    REQUIRE_FALSE(refused);
    CHECK(
        refused.error().message ==
        "structural similarity: pictures are 11x10 pixels, expected at least 11x11"
    );
    Picture cut = good;
    cut.rgba.pop_back();
    CHECK_FALSE(eval::ssim_map(good, cut));
}

TEST_CASE("similarity of flat pictures follows its closed form", "[ssim]") {
    for (const int a : {0, 1, 100, 255}) {
        for (const int b : {0, 3, 100, 254}) {
            CAPTURE(a, b);
            const auto level_a = static_cast<std::uint8_t>(a);
            const auto level_b = static_cast<std::uint8_t>(b);
            const auto map = eval::ssim_map(
                filled(13, 12, level_a, level_a, level_a), filled(13, 12, level_b, level_b, level_b)
            );
            REQUIRE(map);
            const double expected = (2.0 * a * b + kC1) / (a * a + b * b + kC1);
            int windows = 0;
            for (const float value : map->values) {
                if (!std::isnan(value)) {
                    CHECK(value == Approx(expected).epsilon(0.0).margin(kRounding));
                    ++windows;
                }
            }
            CHECK(windows == 3 * 2);
        }
    }
}

TEST_CASE("equal pictures have a similarity of exactly 1", "[ssim]") {
    for (const Picture& picture : {noise(40, 30, 7), structured(40, 30, 0)}) {
        CHECK(eval::mean(*eval::ssim_map(picture, picture)) == 1.0);
        Picture clear = picture;
        for (std::size_t i = 3; i < clear.rgba.size(); i += 4) {
            clear.rgba[i] = 0;
        }
        CHECK(eval::mean(*eval::ssim_map(picture, clear)) == 1.0); // alpha is not looked at
    }
}

TEST_CASE("similarity is symmetric, and one spot is felt by its windows alone", "[ssim]") {
    const Picture a = structured(41, 29, 0);
    Picture b = a;
    channel(b, 20, 14, 1) = static_cast<std::uint8_t>(channel(b, 20, 14, 1) ^ 0x80U);
    const auto map = eval::ssim_map(a, b);
    const auto reversed = eval::ssim_map(b, a);
    REQUIRE(map);
    REQUIRE(reversed);
    for (int y = 5; y < 24; ++y) {
        for (int x = 5; x < 36; ++x) {
            CAPTURE(x, y);
            CHECK(at(*map, x, y) == at(*reversed, x, y));
            const bool near = std::abs(x - 20) <= 5 && std::abs(y - 14) <= 5;
            CHECK((at(*map, x, y) < 1.0F) == near);
        }
    }
}

TEST_CASE("the negative of a pattern is less like it than nothing", "[ssim]") {
    Picture checks = filled(16, 16, 0, 0, 0);
    Picture negative = filled(16, 16, 0, 0, 0);
    for (int y = 0; y < 16; ++y) {
        for (int x = 0; x < 16; ++x) {
            for (int index = 0; index < 3; ++index) {
                channel(checks, x, y, index) = (x + y) % 2 == 0 ? 255 : 0;
                channel(negative, x, y, index) = (x + y) % 2 == 0 ? 0 : 255;
            }
        }
    }
    // With means of one half (the Gaussian sees both colours alike but for 1e-4) and covariance
    // -127.5^2: (C2 - 2 * 127.5^2) / (C2 + 2 * 127.5^2).
    const double squares = 2.0 * 127.5 * 127.5;
    CHECK(
        eval::mean(*eval::ssim_map(checks, negative)) ==
        Approx((kC2 - squares) / (kC2 + squares)).epsilon(0.0).margin(1e-4)
    );
}

TEST_CASE("similarity agrees with its definition, computed directly", "[ssim]") {
    check_against_definition(noise(31, 24, 1), noise(31, 24, 2));
    check_against_definition(structured(37, 26, 0), structured(37, 26, 1));
    check_against_definition(filled(14, 19, 255, 255, 255), noise(14, 19, 3));
    check_against_definition(noise(11, 11, 4), structured(11, 11, 0)); // one window
}
