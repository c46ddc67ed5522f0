#include "metric/reference.hpp"
#include "support/random.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/safety_zone.hpp>

#include <catch2/catch.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

namespace {

using namespace farfield;
using support::Case;
using support::kRoundoff;
using support::Real;
using support::RealVector;

template <typename T>
using Vector = glm::vec<3, T>;

} // namespace

TEMPLATE_TEST_CASE("Safety distances at their limits", "", float, double) {
    using T = TestType;
    constexpr T kPi = std::numbers::pi_v<T>;
    CHECK(metric::safety_distance_unchecked(T(4), T(4), T(0.01)) == T(4));
    CHECK(metric::safety_distance_unchecked(T(4), T(4), T(0)) == T(4));
    CHECK(metric::safety_distance_unchecked(T(4), T(5), T(0)) == T(0));
    CHECK(metric::safety_distance_unchecked(T(5), T(4), kPi / 2) == T(4));
    CHECK(metric::safety_distance_unchecked(T(4), T(5), kPi) == T(4));
    CHECK(metric::safety_distance(T(4), T(5), T(-1)).outcome == MetricOutcome::err_eps);
    CHECK(metric::safety_distance(T(0), T(5), T(1)).outcome == MetricOutcome::err_distance);
    CHECK(metric::safety_distance(T(4), T(-5), T(1)).outcome == MetricOutcome::err_distance);
    constexpr T kInfinity = std::numeric_limits<T>::infinity();
    CHECK(metric::safety_distance(kInfinity, T(5), T(1)).outcome == MetricOutcome::err_nonfinite);
    // An angle so small that the circles are larger than the largest number.
    const T least = std::numeric_limits<T>::min();
    const T huge = std::numeric_limits<T>::max() / 8;
    CHECK(metric::safety_distance_unchecked(huge, huge / 2, least) >= T(0));
    CHECK(metric::safety_distance_unchecked(huge, huge / 2, least) < huge);
}

TEMPLATE_TEST_CASE("A safety distance grows with the angle allowed", "", float, double) {
    using T = TestType;
    support::Random random(21);
    for (int i = 0; i < 500; ++i) {
        const T to_point = random.uniform(T(1), T(100));
        const T to_image = random.uniform(T(1), T(100));
        T before = 0;
        for (int step = 0; step <= 30; ++step) {
            const T epsilon = T(1e-5) * std::pow(T(1.5), static_cast<T>(step));
            const T distance = metric::safety_distance_unchecked(to_point, to_image, epsilon);
            // Both are within 8 units of rounding of the exact values, which grow.
            CHECK(distance >= before * (1 - T(16 * kRoundoff<T>)));
            before = distance;
        }
    }
}

TEST_CASE("At the safety distance the angle is attained and not exceeded") {
    support::Random random(22);
    for (int i = 0; i < 200; ++i) {
        // Point and image on the axis; by symmetry the viewer moves in a plane.
        const double to_point = random.uniform(1.0, 20.0);
        // A tenth apart or more, so that the circles are wide compared with the steps below.
        const double ratio = random.uniform(1.1, 5.0);
        const double to_image = random.below(2) == 0 ? to_point * ratio : to_point / ratio;
        const double epsilon = std::pow(10.0, random.uniform(-4.0, 0.3));
        INFO("h " << to_point << " h~ " << to_image << " eps " << epsilon);
        const double distance = metric::safety_distance_unchecked(to_point, to_image, epsilon);
        double largest = 0;
        constexpr int kSteps = 20000;
        for (int step = 0; step <= kSteps; ++step) {
            const double turn = std::numbers::pi * step / kSteps;
            const double x = distance * std::cos(turn);
            const double y = distance * std::sin(turn);
            const double across = std::abs(to_point - to_image) * y;
            const double along = (to_point - x) * (to_image - x) + y * y;
            largest = std::max(largest, std::atan2(across, along));
        }
        if (epsilon < std::numbers::pi / 2) {
            CHECK(largest <= epsilon * (1 + 1e-9));
            // The angle is stationary at its maximum: half a step, 8e-5 of the distance, is 2e-3 of
            // the smallest circle and loses the square of that.
            CHECK(largest >= epsilon * (1 - 1e-3));
        } else {
            // The nearest point of the lemon is its tip, where the angle is not continuous.
            CHECK(distance == std::min(to_point, to_image));
        }
    }
}

TEMPLATE_TEST_CASE("In a box's safety zone no point errs by more than allowed", "", float, double) {
    using T = TestType;
    support::Random random(23);
    int zones = 0;
    for (int i = 0; i < 1500; ++i) {
        const Case<T> c = support::random_case<T>(random, T(0.05), T(50));
        const T epsilon = std::pow(T(10), random.uniform(T(-3.5), T(0.2)));
        const T radius = metric::safety_distance_bound_unchecked(c.image, c.box, epsilon);
        zones += radius > T(0) ? 1 : 0;
        CHECK(radius <= distance(c.box, c.image.viewpoint));
        Real largest = 0;
        for (int sample = 0; sample < 40; ++sample) {
            // At the surface of the ball, from where the angles are largest; in extended precision,
            // so that the viewer is not rounded out of it.
            const RealVector way = random.direction<Real>() * Real(radius);
            const Case<Real> viewed{
                {RealVector(c.image.viewpoint),
                 RealVector(c.image.point),
                 RealVector(c.image.normal)},
                {},
                RealVector(c.image.viewpoint) + way};
            const RealVector point = support::random_surface_point(random, c.box);
            largest =
                std::max(largest, support::reference_angle(viewed.image, viewed.viewer, point));
        }
        const Real allowed = std::min(Real(epsilon), std::numbers::pi_v<Real> / 2);
        if (largest > allowed * (1 + 1e-15L) + 1e-14L) {
            FAIL_CHECK(c << "eps " << epsilon << " radius " << radius << " angle " << largest);
        }
    }
    CHECK(zones > 1400);
}

TEMPLATE_TEST_CASE("A zone stays before the image plane", "", float, double) {
    using T = TestType;
    // A box far to the side, behind the plane: it alone would allow a radius of 5.
    const ImagePlane<T> image{Vector<T>(T(0)), {T(0), T(0), T(-1)}, {T(0), T(0), T(-3)}};
    const Box3<T> box{{T(10), T(-1), T(-3)}, {T(11), T(1), T(-2)}};
    const T zone = metric::safety_distance_bound_unchecked(image, box, T(2));
    CHECK(zone <= T(1));
    CHECK(zone >= 1 - 64 * metric::detail::kUnitRoundoff<T>);
}

TEMPLATE_TEST_CASE("Zones of boxes depend on shapes, not on units", "", float, double) {
    using T = TestType;
    support::Random random(24);
    for (int i = 0; i < 300; ++i) {
        const Case<T> c = support::random_case<T>(random, T(0.1), T(20));
        INFO(c);
        const T bound = metric::safety_distance_bound_unchecked(c.image, c.box, T(0.01));
        const T corners = metric::corner_safety_distance_unchecked(c.image, c.box, T(0.01));
        for (const int exponent : {-60, -20, 7, 100}) {
            const T unit = metric::detail::power_of_two<T>(exponent);
            const ImagePlane<T> image{
                c.image.viewpoint * unit, c.image.point * unit, -c.image.normal / unit};
            const Box3<T> box{c.box.lo * unit, c.box.hi * unit};
            CHECK(metric::safety_distance_bound_unchecked(image, box, T(0.01)) == bound * unit);
            CHECK(metric::corner_safety_distance_unchecked(image, box, T(0.01)) == corners * unit);
        }
    }
}

TEMPLATE_TEST_CASE("Zones of degenerate boxes", "", float, double) {
    using T = TestType;
    const ImagePlane<T> image{Vector<T>(T(0)), {T(0), T(0), T(-5)}, {T(0), T(0), T(-1)}};
    const Box3<T> box{{T(-1), T(-1), T(-6)}, {T(1), T(1), T(-4)}};
    CHECK(metric::safety_distance_bound_unchecked(image, box, T(0)) == T(0));
    CHECK(metric::corner_safety_distance_unchecked(image, box, T(0)) == T(0));
    const Box3<T> in_plane{{T(-1), T(-1), T(-5)}, {T(1), T(1), T(-5)}};
    CHECK(metric::corner_safety_distance_unchecked(image, in_plane, T(0.01)) > T(5));
    // Exactly 5, less the allowance for rounding: 8 u F / sin eps + 32 u relative, F < 2.
    const T zone = metric::safety_distance_bound_unchecked(image, in_plane, T(0.01));
    CHECK(zone <= T(5));
    CHECK(zone >= T(5) * (1 - 2000 * metric::detail::kUnitRoundoff<T>));
    const Box3<T> point{{T(0), T(0), T(-5)}, {T(0), T(0), T(-5)}};
    CHECK(metric::safety_distance_bound_unchecked(image, point, T(0.01)) <= T(5));
    CHECK(metric::safety_distance_bound_unchecked(image, point, T(0.01)) > T(4.99));
    CHECK(metric::safety_distance_bound(image, box, T(-1)).outcome == MetricOutcome::err_eps);
    CHECK(metric::safety_distance_bound(image, {}, T(1)).outcome == MetricOutcome::err_nonfinite);
}

TEMPLATE_TEST_CASE("Balls hold their points whatever the unit", "", float, double) {
    using T = TestType;
    for (const int exponent : {-100, 0, 100}) {
        const T unit = metric::detail::power_of_two<T>(exponent);
        const Ball<T> ball{Vector<T>(T(1), T(2), T(3)) * unit, 5 * unit};
        CHECK(contains(ball, Vector<T>(T(4), T(6), T(3)) * unit));
        CHECK_FALSE(contains(ball, Vector<T>(T(4), T(6), T(3.01)) * unit));
        CHECK(contains(ball, ball.center));
    }
    CHECK(contains(Ball<T>{}, Vector<T>(T(0))));
    CHECK_FALSE(contains(Ball<T>{}, Vector<T>(T(0), std::numeric_limits<T>::denorm_min(), T(0))));
}

TEMPLATE_TEST_CASE("The inscribed cube lies in the ball", "", float, double) {
    using T = TestType;
    support::Random random(25);
    for (int i = 0; i < 2000; ++i) {
        const T reach = std::pow(T(10), random.uniform(T(-3), T(7)));
        const Ball<T> ball{
            random.vector(-reach, reach), std::pow(T(10), random.uniform(T(-5), T(5)))};
        const Box3<T> cube = metric::inscribed_cube(ball);
        CHECK(contains(cube, ball.center));
        for (unsigned index = 0; index < 8; ++index) {
            const RealVector offset = RealVector(corner(cube, index)) - RealVector(ball.center);
            CHECK(glm::length(offset) <= Real(ball.radius));
        }
        // As large as it can be: rounding takes two steps of the coordinates and 8 u relative.
        const Real side = Real(cube.hi.x) - Real(cube.lo.x);
        const Real ideal = 2 * Real(ball.radius) * std::numbers::inv_sqrt3_v<Real>;
        const Real coordinate = std::abs(Real(ball.center.x)) + Real(ball.radius);
        CHECK(side >= ideal * (1 - 8 * kRoundoff<T>)-8 * kRoundoff<T> * coordinate);
    }
    const Ball<T> point{Vector<T>(T(1), T(-2), T(0)), T(0)};
    CHECK(metric::inscribed_cube(point) == Box3<T>{point.center, point.center});
}
