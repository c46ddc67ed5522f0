#include "pictures.hpp"
#include <farfield/eval/flip.hpp>
#include <farfield/eval/pixel_map.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace {

using farfield::FlipOptions;
using farfield::Picture;
using farfield::PixelMap;
using farfield::test::at;
using farfield::test::channel;
using farfield::test::filled;
using farfield::test::noise;
using farfield::test::structured;
namespace eval = farfield::eval;

constexpr double kPi = 3.14159265358979323846;

using Triple = std::array<double, 3>;

// From the chromaticities of sRGB's primaries and of D65, solved in fractions.
constexpr double kX[] = {506752.0 / 1228815.0, 87881.0 / 245763.0, 12673.0 / 70218.0};
constexpr double kY[] = {87098.0 / 409605.0, 175762.0 / 245763.0, 12673.0 / 175545.0};
constexpr double kZ[] = {7918.0 / 409605.0, 87881.0 / 737289.0, 1001167.0 / 1053270.0};

double dot(const double* row, const Triple& rgb) {
    return row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2];
}

const double kWhiteX = kX[0] + kX[1] + kX[2];
const double kWhiteZ = kZ[0] + kZ[1] + kZ[2];

double decode(int level) {
    const double s = level / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

Triple linear_at(const Picture& picture, int x, int y) {
    const int u = std::clamp(x, 0, picture.width - 1);
    const int v = std::clamp(y, 0, picture.height - 1);
    return {
        decode(channel(picture, u, v, 0)),
        decode(channel(picture, u, v, 1)),
        decode(channel(picture, u, v, 2))};
}

Triple opponent_of(const Triple& rgb) {
    const double x = dot(kX, rgb) / kWhiteX;
    const double y = dot(kY, rgb);
    const double z = dot(kZ, rgb) / kWhiteZ;
    return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

/// Cramer's rule on the matrix of the primaries.
Triple rgb_of(const Triple& opponent) {
    const double y = (opponent[0] + 16.0) / 116.0;
    const Triple xyz = {
        (opponent[1] / 500.0 + y) * kWhiteX, y, (y - opponent[2] / 200.0) * kWhiteZ};
    const auto determinant = [](const Triple& a, const Triple& b, const Triple& c) {
        return a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) +
               c[0] * (a[1] * b[2] - a[2] * b[1]);
    };
    const Triple r = {kX[0], kY[0], kZ[0]};
    const Triple g = {kX[1], kY[1], kZ[1]};
    const Triple b = {kX[2], kY[2], kZ[2]};
    const double all = determinant(r, g, b);
    return {
        determinant(xyz, g, b) / all, determinant(r, xyz, b) / all, determinant(r, g, xyz) / all};
}

/// Hunt-adjusted L*a*b*.
Triple adjusted_lab_of(const Triple& rgb) {
    const auto root = [](double t) {
        const double delta = 6.0 / 29.0;
        return t > std::pow(delta, 3.0) ? std::cbrt(t) : t / (3.0 * delta * delta) + 4.0 / 29.0;
    };
    const double x = root(dot(kX, rgb) / kWhiteX);
    const double y = root(dot(kY, rgb));
    const double z = root(dot(kZ, rgb) / kWhiteZ);
    const double lightness = 116.0 * y - 16.0;
    return {lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)};
}

double color_distance(const Triple& a, const Triple& b) {
    return std::abs(a[0] - b[0]) +
           std::sqrt(std::pow(a[1] - b[1], 2.0) + std::pow(a[2] - b[2], 2.0));
}

double color_error(double distance) {
    const double largest = std::pow(
        color_distance(adjusted_lab_of({0.0, 1.0, 0.0}), adjusted_lab_of({0.0, 0.0, 1.0})), 0.7
    );
    const double compressed = std::pow(distance, 0.7);
    const double knee = 0.4 * largest;
    return compressed < knee ? compressed * 0.95 / knee
                             : 0.95 + (compressed - knee) / (largest - knee) * 0.05;
}

/// A kernel of two dimensions, summed as it stands.
struct Kernel {
    int radius = 0;
    std::vector<double> weights;

    template <typename Weight>
    Kernel(int reach, const Weight& weight) : radius(reach) {
        for (int y = -radius; y <= radius; ++y) {
            for (int x = -radius; x <= radius; ++x) {
                weights.push_back(weight(x, y));
            }
        }
    }

    /// Scales positive and negative weights to a sum of 1 and -1.
    void normalize() {
        double positive = 0.0;
        double negative = 0.0;
        for (const double weight : weights) {
            (weight > 0.0 ? positive : negative) += weight;
        }
        for (double& weight : weights) {
            if (weight != 0.0) {
                weight /= weight > 0.0 ? positive : -negative;
            }
        }
    }

    template <typename Value>
    [[nodiscard]] double apply(const Value& value) const {
        double sum = 0.0;
        std::size_t i = 0;
        for (int y = -radius; y <= radius; ++y) {
            for (int x = -radius; x <= radius; ++x) {
                sum += weights[i++] * value(x, y);
            }
        }
        return sum;
    }
};

/// The definition, word for word, one pixel at a time.
class Definition {
  public:
    explicit Definition(double pixels_per_degree)
        : reach_(static_cast<int>(
              std::ceil(3.0 * std::sqrt(0.04 / (2.0 * kPi * kPi)) * pixels_per_degree)
          )),
          sigma_(0.5 * 0.082 * pixels_per_degree),
          feature_reach_(static_cast<int>(std::ceil(3.0 * sigma_))) {
        const double a1[] = {1.0, 1.0, 34.1};
        const double b1[] = {0.0047, 0.0053, 0.04};
        const double a2[] = {0.0, 0.0, 13.5};
        const double b2[] = {1e-5, 1e-5, 0.025};
        for (int i = 0; i < 3; ++i) {
            Kernel kernel(reach_, [&](int x, int y) {
                const double d = (x * x + y * y) / (pixels_per_degree * pixels_per_degree);
                return a1[i] * std::sqrt(kPi / b1[i]) * std::exp(-kPi * kPi * d / b1[i]) +
                       a2[i] * std::sqrt(kPi / b2[i]) * std::exp(-kPi * kPi * d / b2[i]);
            });
            kernel.normalize();
            sensitivity_.push_back(kernel);
        }
        const auto add = [&](const auto& weight) {
            Kernel kernel(feature_reach_, [&](int x, int y) {
                const double g = std::exp(-(x * x + y * y) / (2.0 * sigma_ * sigma_));
                return weight(x, y) * g;
            });
            kernel.normalize();
            features_.push_back(kernel);
        };
        add([](int x, int) { return -x; });
        add([](int, int y) { return -y; });
        add([this](int x, int) { return x * x / (sigma_ * sigma_) - 1.0; });
        add([this](int, int y) { return y * y / (sigma_ * sigma_) - 1.0; });
    }

    [[nodiscard]] double error(const Picture& a, const Picture& b, int x, int y) const {
        const double color = color_error(color_distance(seen(a, x, y), seen(b, x, y)));
        const double edges = std::abs(feature(a, x, y, 0) - feature(b, x, y, 0));
        const double points = std::abs(feature(a, x, y, 2) - feature(b, x, y, 2));
        return std::pow(color, 1.0 - std::pow(std::max(edges, points) / std::sqrt(2.0), 0.5));
    }

  private:
    [[nodiscard]] Triple seen(const Picture& picture, int x, int y) const {
        Triple filtered{};
        for (std::size_t i = 0; i < 3; ++i) {
            filtered[i] = sensitivity_[i].apply([&](int u, int v) {
                return opponent_of(linear_at(picture, x + u, y + v))[i];
            });
        }
        Triple rgb = rgb_of(filtered);
        for (double& value : rgb) {
            value = std::clamp(value, 0.0, 1.0);
        }
        return adjusted_lab_of(rgb);
    }

    [[nodiscard]] double feature(const Picture& picture, int x, int y, std::size_t first) const {
        const auto luminance = [&](int u, int v) {
            return (opponent_of(linear_at(picture, x + u, y + v))[0] + 16.0) / 116.0;
        };
        return std::hypot(features_[first].apply(luminance), features_[first + 1].apply(luminance));
    }

    int reach_;
    double sigma_;
    int feature_reach_;
    std::vector<Kernel> sensitivity_;
    std::vector<Kernel> features_;
};

// Both ways compute in double; luminances agree to 1e-14. Where features are equal, the square root
// of their difference makes that 1e-7, and so does storing as float.
constexpr double kRounding = 1e-6;

void check_against_definition(const Picture& a, const Picture& b, double pixels_per_degree) {
    const auto map = eval::flip_map(a, b, {.pixels_per_degree = pixels_per_degree});
    REQUIRE(map);
    const Definition definition(pixels_per_degree);
    double sum = 0.0;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            CAPTURE(x, y, pixels_per_degree);
            const double expected = definition.error(a, b, x, y);
            const float value = at(*map, x, y);
            CHECK(value == Approx(expected).epsilon(0.0).margin(kRounding));
            sum += expected;
        }
    }
    CHECK(*eval::mean(*map) == Approx(sum / (a.width * a.height)).epsilon(0.0).margin(kRounding));
}

double flat_error(const Picture& a, const Picture& b) {
    const auto map = eval::flip_map(a, b);
    REQUIRE(map);
    const auto [low, high] = std::minmax_element(map->values.begin(), map->values.end());
    CHECK(*high - *low <= kRounding);
    return *eval::mean(*map);
}

} // namespace

TEST_CASE("FLIP refuses what it cannot compare", "[flip]") {
    const Picture good = filled(4, 3, 1, 2, 3);
    CHECK_FALSE(eval::flip_map(Picture{}, Picture{}));
    CHECK_FALSE(eval::flip_map(good, filled(3, 4, 1, 2, 3)));
    Picture cut = good;
    cut.rgba.pop_back();
    CHECK_FALSE(eval::flip_map(cut, good));
    for (const double wrong : {0.0, -67.0, 0.99, 1001.0, std::nan("")}) {
        CHECK_FALSE(eval::flip_map(good, good, {.pixels_per_degree = wrong}));
    }
    const auto refused = eval::flip_map(good, good, {.pixels_per_degree = 0.5});
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message == "FLIP: pixels per degree are 0.500000, expected 1 to 1000");
    CHECK(eval::flip_map(good, good, {.pixels_per_degree = 1.0}));
    CHECK(eval::flip_map(good, good, {.pixels_per_degree = 1000.0}));
}

TEST_CASE("FLIP of equal pictures is exactly 0", "[flip]") {
    for (const Picture& picture :
         {noise(30, 20, 5), structured(30, 20, 0), filled(1, 1, 9, 8, 7)}) {
        const auto map = eval::flip_map(picture, picture);
        REQUIRE(map);
        CHECK(map->values.size() == picture.rgba.size() / 4);
        CHECK(
            std::count(map->values.begin(), map->values.end(), 0.0F) ==
            static_cast<std::ptrdiff_t>(map->values.size())
        );
    }
}

TEST_CASE("FLIP of flat pictures follows from their colours alone", "[flip]") {
    const Picture black = filled(9, 8, 0, 0, 0);
    const Picture white = filled(9, 8, 255, 255, 255);
    const Picture green = filled(9, 8, 0, 255, 0);
    const Picture blue = filled(9, 8, 0, 0, 255);

    // By hand, from the published L*a*b* of the primaries, green (87.735, -86.183, 83.179) and blue
    // (32.297, 79.188, -107.860): adjusted distance 203.30, to the power of 0.7 41.276. Green and
    // blue are the largest distance there is. Black and white are 100 apart, 25.119 after the
    // power: 0.95 + 0.05 (25.119 - 0.4 * 41.276) / (0.6 * 41.276).
    CHECK(flat_error(green, blue) == Approx(1.0).epsilon(0.0).margin(kRounding));
    CHECK(flat_error(black, white) == Approx(0.96738).epsilon(0.0).margin(1e-5));
    CHECK(flat_error(white, black) == flat_error(black, white));

    // L* of sRGB 119 is 50.034 (Y = 0.18447) and of 120 is 50.430 (Y = 0.18782): 0.396 apart.
    CHECK(
        flat_error(filled(9, 8, 119, 119, 119), filled(9, 8, 120, 120, 120)) ==
        Approx(0.95 / (0.4 * 41.276) * std::pow(0.396, 0.7)).epsilon(2e-3)
    );
    for (const Picture& other : {noise(1, 1, 1), noise(1, 1, 2), noise(1, 1, 3)}) {
        const Picture flat =
            filled(9, 8, channel(other, 0, 0, 0), channel(other, 0, 0, 1), channel(other, 0, 0, 2));
        const double expected = color_error(color_distance(
            adjusted_lab_of(linear_at(other, 0, 0)), adjusted_lab_of(linear_at(green, 0, 0))
        ));
        CHECK(flat_error(flat, green) == Approx(expected).epsilon(0.0).margin(kRounding));
        CHECK(flat_error(flat, green) < 1.0);
    }
}

TEST_CASE("FLIP is symmetric, within 0 and 1, and blind to alpha", "[flip]") {
    const Picture a = noise(33, 21, 11);
    const Picture b = structured(33, 21, 0);
    const auto map = eval::flip_map(a, b);
    const auto reversed = eval::flip_map(b, a);
    REQUIRE(map);
    REQUIRE(reversed);
    CHECK(map->values == reversed->values);
    CHECK(*std::min_element(map->values.begin(), map->values.end()) >= 0.0F);
    CHECK(*std::max_element(map->values.begin(), map->values.end()) <= 1.0F);
    Picture clear = a;
    for (std::size_t i = 3; i < clear.rgba.size(); i += 4) {
        clear.rgba[i] = 0;
    }
    CHECK(eval::flip_map(clear, b)->values == map->values);
}

TEST_CASE("FLIP of a spot ends where its filters end", "[flip]") {
    // At 67 pixels a degree colours reach ceil(9.05) and features ceil(8.24) pixels.
    const Picture a = filled(41, 41, 128, 128, 128);
    Picture b = a;
    channel(b, 20, 20, 0) = 255;
    const auto map = eval::flip_map(a, b);
    REQUIRE(map);
    for (int y = 0; y < 41; ++y) {
        for (int x = 0; x < 41; ++x) {
            CAPTURE(x, y);
            const float value = at(*map, x, y);
            const bool near = std::max(std::abs(x - 20), std::abs(y - 20)) <= 10;
            CHECK((value > 0.0F) == near);
        }
    }
    // Seen from farther, with more pixels a degree, the same spot is less.
    const auto farther = eval::flip_map(a, b, {.pixels_per_degree = 134.0});
    CHECK(farther->values[20 * 41 + 20] < map->values[20 * 41 + 20]);
}

TEST_CASE("edges make a difference count for more", "[flip]") {
    // The same two colours: all over, and as stripes that the other picture lacks. With stripes a
    // pixel amid its stripe has nearly the colour it has without, and edges on top.
    const Picture dark = filled(60, 40, 120, 120, 120);
    const Picture light = filled(60, 40, 150, 150, 150);
    Picture stripes = dark;
    for (int y = 0; y < 40; ++y) {
        for (int x = 0; x < 60; ++x) {
            for (int index = 0; index < 3 && (x / 6) % 2 == 0; ++index) {
                channel(stripes, x, y, index) = 150;
            }
        }
    }
    const std::size_t middle = 20 * 60 + 26; // x = 24 to 29 is light
    CHECK(
        eval::flip_map(dark, stripes)->values[middle] > eval::flip_map(dark, light)->values[middle]
    );
}

TEST_CASE("FLIP agrees with its definition, computed directly", "[flip]") {
    check_against_definition(noise(24, 17, 1), noise(24, 17, 2), 67.0);
    check_against_definition(structured(27, 20, 0), structured(27, 20, 1), 67.0);
    check_against_definition(noise(10, 10, 3), structured(10, 10, 0), 67.0);
    check_against_definition(structured(16, 14, 0), noise(16, 14, 4), 30.0);
    check_against_definition(noise(13, 7, 5), noise(13, 7, 6), 1.0);
    check_against_definition(noise(5, 1, 7), noise(5, 1, 8), 95.5);
}
