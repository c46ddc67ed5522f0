#include "metric/reference.hpp"
#include "support/random.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>

#include <catch2/catch.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

namespace {

using namespace farfield;
using support::Case;
using support::Real;

template <typename T>
using Vector = glm::vec<3, T>;

} // namespace

TEMPLATE_TEST_CASE("No point of a box has a larger angle than the bound", "", float, double) {
    using T = TestType;
    support::Random random(11);
    int below_pi = 0;
    constexpr int kCases = 4000;
    for (int i = 0; i < kCases; ++i) {
        const Case<T> c = support::random_case<T>(random, T(0.02), T(100));
        const T t1 = metric::bound_t1_unchecked(c.image, c.box, c.viewer);
        const T t2 = metric::bound_t2_unchecked(c.image, c.box, c.viewer);
        below_pi += t2 < std::numbers::pi_v<T> ? 1 : 0;
        Real largest = 0;
        for (int sample = 0; sample < 50; ++sample) {
            const auto point = support::random_surface_point(random, c.box);
            largest = std::max(largest, support::reference_angle(c.image, c.viewer, point));
        }
        for (unsigned index = 0; index < 8; ++index) {
            const support::RealVector point(corner(c.box, index));
            largest = std::max(largest, support::reference_angle(c.image, c.viewer, point));
        }
        // 1e-14: what the reference may lose by forming the image in extended precision.
        if (largest > Real(std::min(t1, t2)) + 1e-14L) {
            FAIL_CHECK(c << "truth " << largest << " t1 " << t1 << " t2 " << t2);
        }
    }
    CHECK(below_pi > kCases / 2);
}

TEMPLATE_TEST_CASE("Rounding does not push a bound below a point's angle", "", float, double) {
    using T = TestType;
    support::Random random(15);
    for (int i = 0; i < 4000; ++i) {
        // A point box that is far from the plane's own point but nearly in the plane, so that most
        // digits of its distance from the plane cancel, and a viewer who has moved at a right angle
        // to the line of sight, where the bound from distances is the truth.
        const Vector<T> normal = random.direction<T>();
        const Vector<T> aside = glm::normalize(glm::cross(normal, random.direction<T>()));
        const T off = random.uniform(T(1e-5), T(1e-3));
        const Vector<T> point = aside * T(10) + normal * off;
        Case<T> c;
        c.box = {point, point};
        c.image = {point + normal * random.uniform(T(5), T(20)), Vector<T>(T(0)), normal};
        const Vector<T> sight = point - c.image.viewpoint;
        c.viewer = c.image.viewpoint + glm::cross(sight, random.direction<T>()) * T(1e-2);
        const T t1 = metric::bound_t1_unchecked(c.image, c.box, c.viewer);
        const T t2 = metric::bound_t2_unchecked(c.image, c.box, c.viewer);
        const Real truth = support::reference_angle(c.image, c.viewer, support::RealVector(point));
        // The reference is good to 1e-17 here; angles are 1e-8 and more.
        if (truth > Real(std::min(t1, t2)) + 1e-16L) {
            FAIL_CHECK(c << "truth " << truth << " t1 " << t1 << " t2 " << t2);
        }
    }
}

TEMPLATE_TEST_CASE("The tight bound is the truth beyond two diagonals", "", float, double) {
    using T = TestType;
    support::Random random(12);
    int within = 0;
    constexpr int kCases = 1000;
    for (int i = 0; i < kCases; ++i) {
        const Case<T> c = support::random_case<T>(random, T(4), T(100));
        const T bound = metric::bound_t2_unchecked(c.image, c.box, c.viewer);
        const T corners = metric::corner_discrepancy_unchecked(c.image, c.box, c.viewer);
        CHECK(bound >= corners);
        within += bound <= corners * T(1.05) ? 1 : 0;
    }
    // The documented 99 in 100 for the ratio to the truth, less the corners' own shortfall.
    CHECK(within > kCases * 95 / 100);
}

TEMPLATE_TEST_CASE("Bounds depend on shapes, not on units", "", float, double) {
    using T = TestType;
    support::Random random(13);
    for (int i = 0; i < 500; ++i) {
        const Case<T> c = support::random_case<T>(random, T(0.1), T(20));
        INFO(c);
        const T t1 = metric::bound_t1_unchecked(c.image, c.box, c.viewer);
        const T t2 = metric::bound_t2_unchecked(c.image, c.box, c.viewer);
        for (const int exponent : {-60, -20, 7, 100}) {
            const T unit = metric::detail::power_of_two<T>(exponent);
            const ImagePlane<T> image{
                c.image.viewpoint * unit, c.image.point * unit, -c.image.normal / unit};
            const Box3<T> box{c.box.lo * unit, c.box.hi * unit};
            CHECK(metric::bound_t1_unchecked(image, box, c.viewer * unit) == t1);
            CHECK(metric::bound_t2_unchecked(image, box, c.viewer * unit) == t2);
        }
    }
}

TEMPLATE_TEST_CASE("Within a threshold means that the bound is", "", float, double) {
    using T = TestType;
    support::Random random(14);
    for (int i = 0; i < 500; ++i) {
        const Case<T> c = support::random_case<T>(random, T(0.1), T(20));
        INFO(c);
        const T bound = metric::angular_discrepancy_bound_unchecked(c.image, c.box, c.viewer);
        bool before = false;
        for (const T factor : {T(0), T(0.5), T(0.99), T(1), T(1.01), T(2)}) {
            const T threshold = std::min(bound * factor, T(3));
            const bool within = metric::is_within_unchecked(c.image, c.box, c.viewer, threshold);
            CHECK(within == (bound <= threshold));
            CHECK((within || !before));
            before = within;
        }
    }
}

TEMPLATE_TEST_CASE("Flat, thin and point boxes are bounded", "", float, double) {
    using T = TestType;
    const ImagePlane<T> image{Vector<T>(T(0)), {T(0), T(0), T(-5)}, {T(0), T(0), T(-1)}};
    const Vector<T> viewer(T(0.5), T(0.25), T(0));
    const auto bound = [&](const Box3<T>& box, const Vector<T>& v) {
        return metric::angular_discrepancy_bound(image, box, v);
    };
    const Vector<T> lo(T(-1), T(-1), T(-6));
    const Box3<T> in_plane{{T(-1), T(-1), T(-5)}, {T(1), T(1), T(-5)}};
    CHECK(bound(in_plane, viewer) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(metric::bound_t1_unchecked(image, in_plane, viewer) == T(0));
    CHECK(metric::bound_t2_unchecked(image, in_plane, viewer) == T(0));
    for (const Vector<T>& hi : {lo, Vector<T>(T(1), T(-1), T(-6)), Vector<T>(T(1), T(1), T(-6))}) {
        const Box3<T> box{lo, hi};
        CHECK(bound(box, image.viewpoint) == Measured<T>{T(0), MetricOutcome::ok});
        const T angle = bound(box, viewer).value;
        CHECK(angle >= metric::angular_discrepancy_unchecked(image, viewer, lo));
        CHECK(angle < T(0.1));
    }
    // A point box has one angle, and the tight bound is that angle but for rounding.
    const T point = metric::angular_discrepancy_unchecked(image, viewer, lo);
    CHECK(metric::bound_t2_unchecked(image, {lo, lo}, viewer) <= point * T(1.001));
}

TEMPLATE_TEST_CASE(
    "A box that nearly lies in its plane keeps a positive bound", "", float, double
) {
    using T = TestType;
    constexpr T kTiny = std::numeric_limits<T>::min();
    // e is the smallest normal number, so its square is zero.
    const ImagePlane<T> image{{T(0), T(0), T(8)}, {T(0), T(0), T(0)}, {T(0), T(0), T(-1)}};
    const Box3<T> box{{T(-1), T(-1), T(0)}, {T(1), T(1), kTiny}};
    const Vector<T> viewer(T(0.5), T(0.25), T(8));
    const T angle = metric::angular_discrepancy_unchecked(image, viewer, {T(1), T(1), kTiny});
    CHECK(angle > T(0));
    CHECK(metric::bound_t2_unchecked(image, box, viewer) >= angle);
    // Factors below the smallest normal number are rounded up to it, and one such number is added.
    CHECK(metric::bound_t2_unchecked(image, box, viewer) <= 3 * kTiny);
    CHECK(metric::bound_t1_unchecked(image, box, viewer) >= angle);
}

TEMPLATE_TEST_CASE("Bounds of hidden images are pi", "", float, double) {
    using T = TestType;
    const ImagePlane<T> image{Vector<T>(T(0)), {T(0), T(0), T(-8)}, {T(0), T(0), T(-1)}};
    const Box3<T> box{{T(-1), T(-1), T(-3)}, {T(1), T(1), T(-2)}};
    constexpr T kPi = std::numbers::pi_v<T>;
    const auto bound = [&](const Vector<T>& viewer) {
        return metric::angular_discrepancy_bound(image, box, viewer);
    };
    CHECK(bound({T(0), T(0), T(-2.5)}) == Measured<T>{kPi, MetricOutcome::pi_inside});
    CHECK(bound({T(1), T(1), T(-2)}) == Measured<T>{kPi, MetricOutcome::pi_inside});
    CHECK(bound({T(0), T(0), T(-8)}) == Measured<T>{kPi, MetricOutcome::pi_backface});
    // Between the box and its image.
    CHECK(bound({T(0.5), T(0.25), T(-4)}) == Measured<T>{kPi, MetricOutcome::ok});
    CHECK_FALSE(metric::is_within_unchecked(image, box, {T(0.5), T(0.25), T(-4)}, T(3)));
    CHECK_FALSE(metric::is_within_unchecked(image, box, {T(0), T(0), T(-2.5)}, T(3)));
}

TEST_CASE("The corner estimate misses most of the error of a wide slab") {
    // Why the bound exists: a viewer close to the middle of a plate of 40 by 40.
    const ImagePlane<double> image{{0, 0, 3}, {0, 0, 0}, {0, 0, -1}};
    const Box3<double> slab{{-20, -20, -0.5}, {20, 20, 0.5}};
    const glm::dvec3 viewer(0.5, 0, 3);
    const double corners = metric::corner_discrepancy_unchecked(image, slab, viewer);
    const double truth = metric::angular_discrepancy_unchecked(image, viewer, {0, 0, 0.5});
    CHECK(corners < 0.1 * truth);
    CHECK(metric::angular_discrepancy_bound_unchecked(image, slab, viewer) >= truth);
}
