#include "metric/reference.hpp"
#include "support/random.hpp"
#include <farfield/math/view.hpp>
#include <farfield/metric/pixel_angle.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace farfield;
using support::kRoundoff;
using support::Real;

} // namespace

TEMPLATE_TEST_CASE("Lenses and amounts out of range are named", "", float, double) {
    using T = TestType;
    constexpr T kPi = std::numbers::pi_v<T>;
    constexpr T kInfinity = std::numeric_limits<T>::infinity();
    CHECK(metric::pixel_scale(T(1), 640, 480).outcome == MetricOutcome::ok);
    CHECK(metric::pixel_scale(T(0), 640, 480).outcome == MetricOutcome::err_fov);
    CHECK(metric::pixel_scale(kPi, 640, 480).outcome == MetricOutcome::err_fov);
    CHECK(metric::pixel_scale(T(1), 0, 480).outcome == MetricOutcome::err_fov);
    CHECK(metric::pixel_scale(T(1), 640, -1).outcome == MetricOutcome::err_fov);
    CHECK(metric::pixel_scale(kInfinity, 640, 480).outcome == MetricOutcome::err_nonfinite);
    CHECK(std::isnan(metric::pixel_scale(T(0), 640, 480).scale.focal_px));
    const PixelScale<T> scale = metric::pixel_scale(T(1), 640, 480).scale;
    CHECK(metric::angle_of_pixels(scale, T(-1)).outcome == MetricOutcome::err_range);
    CHECK(metric::angle_of_pixels_inside(scale, T(-1)).outcome == MetricOutcome::err_range);
    CHECK(metric::pixels_of_angle(scale, T(-1)).outcome == MetricOutcome::err_range);
    CHECK(metric::pixels_of_angle(scale, kInfinity).outcome == MetricOutcome::err_nonfinite);
    CHECK(metric::angle_of_pixels(PixelScale<T>{}, T(1)).outcome == MetricOutcome::err_fov);
    CHECK(metric::angle_of_pixels(scale, T(0)) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(metric::pixels_of_angle(scale, T(0)) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(metric::pixels_of_angle_unchecked(scale, kPi / 2) == kInfinity);
    CHECK(metric::pixels_of_angle_unchecked(scale, T(1.4)) == kInfinity);
}

TEMPLATE_TEST_CASE("Pixels of an angle undo angles of pixels", "", float, double) {
    using T = TestType;
    support::Random random(31);
    for (int i = 0; i < 1000; ++i) {
        const T fov = random.uniform(T(0.1), T(2.5));
        const PixelScale<T> scale = metric::pixel_scale(fov, 1920, 1080).scale;
        const T pixels = std::pow(T(10), random.uniform(T(-2), T(2)));
        const T angle = metric::angle_of_pixels_unchecked(scale, pixels);
        const T back = metric::pixels_of_angle_unchecked(scale, angle);
        // Both directions keep their digits; the way back amplifies by 1 / (1 - r tan) =
        // 1 + r p / f / (1 + r^2), at most 1 + p / f here.
        const Real gain = 1 + Real(pixels) / Real(scale.focal_px);
        CHECK(std::abs(Real(back) - Real(pixels)) <= 32 * kRoundoff<T> * gain * Real(pixels));
        CHECK(metric::angle_of_pixels_inside_unchecked(scale, pixels) >= angle);
        CHECK(angle <= metric::central_pixel_angle(scale) * pixels);
    }
}

TEST_CASE("An angle within the bound is nowhere more than its pixels") {
    support::Random random(32);
    double worst = 0;
    for (int lens_index = 0; lens_index < 100; ++lens_index) {
        // Off-axis lenses with square pixels, as tiles and stereo views have them.
        Lens lens;
        constexpr int kWidth = 64;
        constexpr int kHeight = 48;
        const double pixel = random.uniform(0.002, 0.04);
        lens.left = random.uniform(-2.0, 1.0);
        lens.right = lens.left + kWidth * pixel;
        lens.bottom = random.uniform(-2.0, 1.0);
        lens.top = lens.bottom + kHeight * pixel;
        const auto measured = metric::pixel_scale(lens, kWidth, kHeight);
        REQUIRE(measured.outcome == MetricOutcome::ok);
        const double pixels = random.uniform(0.1, 4.0);
        const double epsilon = metric::angle_of_pixels_unchecked(measured.scale, pixels);
        for (int i = 0; i < 2000; ++i) {
            // Half of the shown points in a corner, where the bound is attained.
            const bool in_corner = random.below(2) == 0;
            const double x = in_corner ? (random.below(2) == 0 ? lens.left : lens.right)
                                       : random.uniform(lens.left, lens.right);
            const double y = in_corner ? (random.below(2) == 0 ? lens.bottom : lens.top)
                                       : random.uniform(lens.bottom, lens.top);
            const glm::dvec3 shown = glm::normalize(glm::dvec3(x, y, -1.0));
            const glm::dvec3 axis = glm::normalize(glm::cross(shown, random.direction<double>()));
            const glm::dvec3 truth = shown * std::cos(epsilon) + axis * std::sin(epsilon);
            REQUIRE(truth.z < 0);
            const double dx = (-truth.x / truth.z - x) / pixel;
            const double dy = (-truth.y / truth.z - y) / pixel;
            worst = std::max(worst, std::hypot(dx, dy) / pixels);
        }
    }
    // Both steps round to about 1e-13 relative.
    CHECK(worst <= 1 + 1e-9);
    CHECK(worst > 0.99);
}

TEST_CASE("The mean pixel angle allows more pixels than it says") {
    // 60 degrees horizontally on 1920 x 1080.
    const double fov_x = std::numbers::pi / 3;
    const double fov_y = 2 * std::atan(std::tan(fov_x / 2) * 1080 / 1920);
    const PixelScale<double> scale = metric::pixel_scale(fov_y, 1920, 1080).scale;
    const double mean = metric::mean_pixel_angle(fov_x, 1920);
    CHECK(metric::pixels_of_angle_unchecked(scale, mean) == Approx(1.31).margin(0.005));
    CHECK(metric::angle_of_pixels_unchecked(scale, 1.0) == Approx(0.418e-3).margin(0.0005e-3));
}

TEST_CASE("Scales of lenses") {
    const Lens symmetric = perspective_lens(1.0, 4.0 / 3.0, 0.1, 10.0);
    const auto from_lens = metric::pixel_scale(symmetric, 640, 480);
    const auto from_fov = metric::pixel_scale(1.0, 640, 480);
    CHECK(from_lens.scale.focal_px == Approx(from_fov.scale.focal_px).epsilon(1e-14));
    CHECK(from_lens.scale.corner_tangent == Approx(from_fov.scale.corner_tangent).epsilon(1e-14));

    Lens lens;
    lens.left = 0.5;
    lens.right = 1.5;
    lens.bottom = -2.0;
    lens.top = 1.0;
    const PixelScale<double> scale = metric::pixel_scale(lens, 100, 600).scale;
    CHECK(scale.focal_px == 200.0);
    CHECK(scale.corner_tangent == 2.5);
    // Wide pixels: the shorter side counts.
    CHECK(metric::pixel_scale(lens, 400, 600).scale.focal_px == 400.0);

    CHECK(metric::pixel_scale(lens, 0, 600).outcome == MetricOutcome::err_fov);
    lens.right = lens.left;
    CHECK(metric::pixel_scale(lens, 100, 600).outcome == MetricOutcome::err_fov);
    lens.right = std::numeric_limits<double>::infinity();
    CHECK(metric::pixel_scale(lens, 100, 600).outcome == MetricOutcome::err_nonfinite);
}

TEST_CASE("More pixels than the diagonal count as the diagonal") {
    const PixelScale<double> scale = metric::pixel_scale(1.0, 3, 4).scale;
    const double diagonal = metric::angle_of_pixels_inside_unchecked(scale, 5.0);
    CHECK(diagonal == Approx(2 * std::atan(scale.corner_tangent)).epsilon(1e-12));
    CHECK(metric::angle_of_pixels_inside_unchecked(scale, 50.0) == Approx(diagonal));
}
