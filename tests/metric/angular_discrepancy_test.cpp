#include "metric/reference.hpp"
#include "support/random.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>

#include <catch2/catch.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace farfield;
using support::Case;
using support::kRoundoff;
using support::Real;

template <typename T>
using Vector = glm::vec<3, T>;

/// Image plane z = -6 seen from the origin.
template <typename T>
ImagePlane<T> simple_image() {
    return {Vector<T>(T(0)), {T(0), T(0), T(-6)}, {T(0), T(0), T(-1)}};
}

} // namespace

TEMPLATE_TEST_CASE("Angles are exact where they are zero or pi", "", float, double) {
    using T = TestType;
    const ImagePlane<T> image = simple_image<T>();
    const Vector<T> point(T(1), T(2), T(-5));
    const Vector<T> viewer(T(0.5), T(0.25), T(1));
    const auto angle = [&](const Vector<T>& v, const Vector<T>& a) {
        return metric::angular_discrepancy(image, v, a);
    };
    CHECK(angle(image.viewpoint, point) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(angle(viewer, {T(1), T(2), T(-6)}) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(angle(point, point).outcome == MetricOutcome::pi_degenerate);
    CHECK(angle(point, point).value == std::numbers::pi_v<T>);
    // At the image, with numbers that show it exactly.
    CHECK(
        angle({T(2), T(4), T(-6)}, {T(1), T(2), T(-3)}) ==
        Measured<T>{std::numbers::pi_v<T>, MetricOutcome::pi_degenerate}
    );
    // Halfway between point and image, and beyond the image.
    CHECK(angle({T(0), T(0), T(-5)}, {T(0), T(0), T(-4)}).value == std::numbers::pi_v<T>);
    CHECK(angle({T(0), T(0), T(-7)}, {T(0), T(0), T(-4)}).value == T(0));
}

TEMPLATE_TEST_CASE("Lengths of very different size do not overflow", "", float, double) {
    using T = TestType;
    // Viewer and point a hair apart, viewpoint and plane far away: u = -(1, 0, 2) small, m along
    // -z, so that the angle is that between -u and -z, or that of (2, 1).
    const T large = T(1e20);
    const T small = std::numeric_limits<T>::min() * 16;
    const ImagePlane<T> image{
        {T(0), T(0), large}, {T(0), T(0), large - large / 64}, {T(0), T(0), T(-1)}};
    const Vector<T> viewer(small, T(0), 2 * small);
    const T angle = metric::angular_discrepancy_unchecked(image, viewer, Vector<T>(T(0)));
    const T expected = std::atan2(T(1), T(-2));
    CHECK(std::abs(angle - expected) <= 4 * std::numeric_limits<T>::epsilon() * expected);
}

TEMPLATE_TEST_CASE("Input that cannot be measured is named", "", float, double) {
    using T = TestType;
    constexpr T kHuge = std::numeric_limits<T>::max();
    const Vector<T> point(T(1), T(2), T(-5));
    const Vector<T> viewer(T(0.5), T(0.25), T(1));
    const auto outcome = [&](const ImagePlane<T>& image, const Vector<T>& v, const Vector<T>& a) {
        const Measured<T> measured = metric::angular_discrepancy(image, v, a);
        CHECK(std::isnan(measured.value) == is_error(measured.outcome));
        return measured.outcome;
    };
    const ImagePlane<T> image = simple_image<T>();
    CHECK(outcome(image, viewer, point) == MetricOutcome::ok);
    CHECK(outcome(image, {kHuge, T(0), T(0)}, point) == MetricOutcome::err_nonfinite);
    CHECK(outcome(image, {std::nan(""), T(0), T(0)}, point) == MetricOutcome::err_nonfinite);
    CHECK(outcome(image, viewer, -point) == MetricOutcome::err_behind);
    ImagePlane<T> wrong = image;
    wrong.normal = Vector<T>(T(0));
    CHECK(outcome(wrong, viewer, point) == MetricOutcome::err_normal);
    wrong.normal = {T(1), T(0), T(0)};
    CHECK(outcome(wrong, viewer, point) == MetricOutcome::err_v0_plane);
    // The first of several errors is reported.
    wrong.normal = {T(0), T(0), std::numeric_limits<T>::infinity()};
    CHECK(outcome(wrong, viewer, -point) == MetricOutcome::err_nonfinite);
    // A plane and a box far below the smallest square are still judged by their signs.
    constexpr T kTiny = std::numeric_limits<T>::min();
    const ImagePlane<T> tiny{image.viewpoint * kTiny, image.point * kTiny, image.normal * kTiny};
    CHECK(outcome(tiny, viewer * kTiny, point * kTiny) == MetricOutcome::ok);
    CHECK(outcome(tiny, viewer * kTiny, -point * kTiny) == MetricOutcome::err_behind);
}

TEMPLATE_TEST_CASE("Angles depend on shapes, not on units or frames", "", float, double) {
    using T = TestType;
    support::Random random(1);
    for (int i = 0; i < 500; ++i) {
        const Case<T> c = support::random_case<T>(random, T(0.1), T(20));
        INFO(c);
        const Vector<T>& point = c.box.hi;
        const T angle = metric::angular_discrepancy_unchecked(c.image, c.viewer, point);
        const T corners = metric::corner_discrepancy_unchecked(c.image, c.box, c.viewer);
        // Powers of two change no digit; the range is limited by the coordinates, which may be 1e2.
        for (const int exponent : {-60, -20, 7, 100}) {
            const T unit = metric::detail::power_of_two<T>(exponent);
            const ImagePlane<T> image{
                c.image.viewpoint * unit, c.image.point * unit, -c.image.normal / unit};
            const Box3<T> box{c.box.lo * unit, c.box.hi * unit};
            CHECK(
                metric::angular_discrepancy_unchecked(image, c.viewer * unit, point * unit) == angle
            );
            CHECK(metric::corner_discrepancy_unchecked(image, box, c.viewer * unit) == corners);
        }
        // A cyclic change of axes changes the order of sums, hence the rounding of both results.
        const auto turned = [](const Vector<T>& v) { return Vector<T>(v.y, v.z, v.x); };
        const ImagePlane<T> image{
            turned(c.image.viewpoint), turned(c.image.point), turned(c.image.normal)};
        const Real limit = 16 * kRoundoff<T> * support::angle_scale(c.image, c.viewer, point);
        const T turned_angle =
            metric::angular_discrepancy_unchecked(image, turned(c.viewer), turned(point));
        CHECK(std::abs(Real(turned_angle) - Real(angle)) <= limit);
    }
}

TEMPLATE_TEST_CASE("Moving everything by the same amount changes nothing", "", float, double) {
    using T = TestType;
    support::Random random(2);
    // On a grid of 1/256 with coordinates below 64, sums with 4096 are exact even in float.
    const auto on_grid = [](const Vector<T>& v) { return glm::round(v * T(256)) / T(256); };
    int compared = 0;
    for (int i = 0; i < 500; ++i) {
        Case<T> c = support::random_case<T>(random, T(0.3), T(10));
        c.image = {on_grid(c.image.viewpoint), on_grid(c.image.point), c.image.normal};
        c.box = {on_grid(c.box.lo), on_grid(c.box.hi)};
        c.viewer = on_grid(c.viewer);
        if (metric::check(c.image, c.box, c.viewer) != MetricOutcome::ok) {
            continue;
        }
        ++compared;
        const Vector<T> shift(T(4096), T(-1024), T(2048));
        const ImagePlane<T> image{c.image.viewpoint + shift, c.image.point + shift, c.image.normal};
        const Box3<T> box{c.box.lo + shift, c.box.hi + shift};
        CHECK(
            metric::corner_discrepancy_unchecked(image, box, c.viewer + shift) ==
            metric::corner_discrepancy_unchecked(c.image, c.box, c.viewer)
        );
    }
    CHECK(compared > 400);
}

TEMPLATE_TEST_CASE("A rotated scene has the same angles", "", double) {
    support::Random random(3);
    for (int i = 0; i < 500; ++i) {
        const Case<double> c = support::random_case<double>(random, 0.3, 10.0);
        INFO(c);
        const glm::dvec3 x = random.direction<double>();
        const glm::dvec3 y = glm::normalize(glm::cross(x, random.direction<double>()));
        const glm::dvec3 z = glm::cross(x, y);
        const auto turned = [&](const glm::dvec3& v) { return v.x * x + v.y * y + v.z * z; };
        const ImagePlane<double> image{
            turned(c.image.viewpoint), turned(c.image.point), turned(c.image.normal)};
        const double before = metric::angular_discrepancy_unchecked(c.image, c.viewer, c.box.lo);
        const double after =
            metric::angular_discrepancy_unchecked(image, turned(c.viewer), turned(c.box.lo));
        // The rotation rounds coordinates of about 10 to 1e-15; motions are at least 3e-5, so their
        // direction and length change by 1e-10 relative at most.
        const double scale = static_cast<double>(support::angle_scale(c.image, c.viewer, c.box.lo));
        CHECK(std::abs(after - before) <= 1e-9 * scale);
    }
}

TEMPLATE_TEST_CASE("Angles are those of the definition", "", float, double) {
    using T = TestType;
    support::Random random(4);
    for (int i = 0; i < 2000; ++i) {
        const Case<T> c = support::random_case<T>(random, T(0.1), T(50));
        INFO(c);
        const Vector<T> point = corner(c.box, random.below(8));
        const T angle = metric::angular_discrepancy_unchecked(c.image, c.viewer, point);
        const Real expected =
            support::reference_angle(c.image, c.viewer, support::RealVector(point));
        // The reference forms the image and so loses up to 1e5 units of extended rounding.
        const Real limit = 8 * kRoundoff<T> * support::angle_scale(c.image, c.viewer, point);
        CHECK(std::abs(Real(angle) - expected) <= limit + 1e-14L);
    }
}

TEMPLATE_TEST_CASE("The corner estimate is the largest corner", "", float, double) {
    using T = TestType;
    support::Random random(5);
    for (int i = 0; i < 2000; ++i) {
        const Case<T> c = support::random_case<T>(random, T(0.05), T(50));
        INFO(c);
        Real largest = 0;
        Real limit = 0;
        for (unsigned index = 0; index < 8; ++index) {
            const Vector<T> point = corner(c.box, index);
            largest = std::max(
                largest, Real(metric::angular_discrepancy_unchecked(c.image, c.viewer, point))
            );
            limit = std::max(limit, support::angle_scale(c.image, c.viewer, point));
        }
        const T estimate = metric::corner_discrepancy_unchecked(c.image, c.box, c.viewer);
        CHECK(std::abs(Real(estimate) - largest) <= 16 * kRoundoff<T> * limit);
    }
}

TEMPLATE_TEST_CASE("Corner estimates of hidden images are pi", "", float, double) {
    using T = TestType;
    const ImagePlane<T> image = simple_image<T>();
    const Box3<T> box{{T(-1), T(-1), T(-7)}, {T(1), T(1), T(-5)}};
    const auto estimate = [&](const Vector<T>& viewer) {
        return metric::corner_discrepancy(image, box, viewer);
    };
    constexpr T kPi = std::numbers::pi_v<T>;
    CHECK(estimate({T(0), T(0), T(-5)}) == Measured<T>{kPi, MetricOutcome::pi_inside});
    CHECK(estimate({T(3), T(0), T(-6)}) == Measured<T>{kPi, MetricOutcome::pi_backface});
    CHECK(estimate({T(3), T(0), T(-9)}) == Measured<T>{kPi, MetricOutcome::pi_backface});
    CHECK(estimate({T(0), T(0), T(0)}) == Measured<T>{T(0), MetricOutcome::ok});
    // Between a corner of a box before the plane and its image.
    const Box3<T> before{{T(-1), T(-1), T(-5)}, {T(1), T(1), T(-4)}};
    CHECK(metric::corner_discrepancy_unchecked(image, before, {T(1.1), T(1.1), T(-4.4)}) > T(3.1));
}
