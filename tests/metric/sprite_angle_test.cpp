#include "metric/reference.hpp"
#include "support/random.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/sprite_angle.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

namespace {

using namespace farfield;
using support::kRoundoff;
using support::Real;
using support::RealVector;

template <typename T>
using Vector = glm::vec<3, T>;

template <typename T>
struct Sight {
    Vector<T> drawn_from{T(0)};
    Vector<T> seen_from{T(0)};
    Vector<T> point{T(0)};
    T offset = 0;
};

/// A point 1 to 100 away, a motion of 1e-4 to 1/2 of that, an offset of up to a quarter.
template <typename T>
Sight<T> random_sight(support::Random& random) {
    Sight<T> sight;
    const T distance = std::pow(T(10), random.uniform(T(0), T(2)));
    sight.drawn_from = random.vector(T(-1), T(1));
    sight.point = sight.drawn_from + random.direction<T>() * distance;
    sight.seen_from = sight.drawn_from + random.direction<T>() * distance *
                                             std::pow(T(10), random.uniform(T(-4), T(-0.3)));
    sight.offset = distance * random.uniform(T(-0.25), T(0.25));
    return sight;
}

/// By the definition, with the shown point formed in extended precision.
template <typename T>
Real reference_sprite_angle(const Sight<T>& sight) {
    const RealVector ray = RealVector(sight.point) - RealVector(sight.drawn_from);
    const RealVector shown = RealVector(sight.point) + glm::normalize(ray) * Real(sight.offset);
    const RealVector a = RealVector(sight.point) - RealVector(sight.seen_from);
    const RealVector b = shown - RealVector(sight.seen_from);
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

Real reference_turn(const RealVector& v1, const RealVector& v2, const RealVector& point) {
    const RealVector a = point - v1;
    const RealVector b = point - v2;
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

} // namespace

TEMPLATE_TEST_CASE("Sprite angles at their limits", "", float, double) {
    using T = TestType;
    constexpr T kPi = std::numbers::pi_v<T>;
    const Vector<T> origin(T(0));
    const Vector<T> aside(T(1), T(0), T(0));
    const Vector<T> point(T(0), T(0), T(-10));
    const auto angle = [&](const Vector<T>& v1, const Vector<T>& v2, T offset) {
        return metric::sprite_angle(v1, v2, point, offset);
    };
    CHECK(angle(origin, aside, T(0)) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(angle(origin, origin, T(1)) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(angle(origin, point, T(0)).outcome == MetricOutcome::pi_degenerate);
    CHECK(angle(origin, point, T(1)) == Measured<T>{kPi, MetricOutcome::pi_degenerate});
    // At the image, between point and image, and beyond the image.
    CHECK(angle(origin, {T(0), T(0), T(-11)}, T(1)).outcome == MetricOutcome::pi_degenerate);
    CHECK(angle(origin, {T(0), T(0), T(-12)}, T(4)) == Measured<T>{kPi, MetricOutcome::ok});
    CHECK(angle(origin, {T(0), T(0), T(-8)}, T(-4)) == Measured<T>{kPi, MetricOutcome::ok});
    CHECK(angle(origin, {T(0), T(0), T(-15)}, T(4)) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(angle(point, aside, T(1)).outcome == MetricOutcome::err_distance);
    CHECK(angle(origin, aside, T(-10)).outcome == MetricOutcome::err_behind);
    CHECK(angle(origin, aside, T(-11)).outcome == MetricOutcome::err_behind);
    CHECK(angle(origin, aside, T(-9.5)).outcome == MetricOutcome::ok);
    CHECK(std::isnan(angle(origin, aside, T(-11)).value));
    CHECK(angle(origin, aside, std::nanf("")).outcome == MetricOutcome::err_nonfinite);
    CHECK(metric::sprite_turn_unchecked(origin, point, point) == kPi);
    CHECK(metric::sprite_turn_unchecked(origin, origin, point) == T(0));
    CHECK(metric::sprite_turn_unchecked(origin, aside, point) == Approx(std::atan2(1.0, 10.0)));
}

TEMPLATE_TEST_CASE("Sprite angles are those of the definition", "", float, double) {
    using T = TestType;
    support::Random random(71);
    for (int i = 0; i < 3000; ++i) {
        const Sight<T> s = random_sight<T>(random);
        const T angle =
            metric::sprite_angle_unchecked(s.drawn_from, s.seen_from, s.point, s.offset);
        const RealVector u1 = RealVector(s.point) - RealVector(s.drawn_from);
        const Real moved = glm::length(RealVector(s.seen_from) - RealVector(s.drawn_from));
        const Real shown = glm::length(
            RealVector(s.point) + glm::normalize(u1) * Real(s.offset) - RealVector(s.seen_from)
        );
        // The `scale` of the golden file, and what the reference loses by forming the image.
        const Real scale =
            Real(angle) + std::abs(Real(s.offset)) * moved / (glm::length(u1) * shown);
        CHECK(
            std::abs(Real(angle) - reference_sprite_angle(s)) <= 8 * kRoundoff<T> * scale + 1e-15L
        );
        // The same from the turn: within the rounding of both, as its cosine is above 1/2 here.
        const T turn = metric::sprite_turn_unchecked(s.drawn_from, s.seen_from, s.point);
        const T distance = glm::length(s.point - s.seen_from);
        const T shared = metric::shared_sprite_angle_unchecked(turn, distance, s.offset);
        CHECK(std::abs(Real(shared) - Real(angle)) <= 32 * kRoundoff<T> * scale);
    }
}

TEMPLATE_TEST_CASE("Sprite angles depend on shapes, not on units or places", "", float, double) {
    using T = TestType;
    support::Random random(72);
    const auto on_grid = [](const Vector<T>& v) { return glm::round(v * T(64)) / T(64); };
    for (int i = 0; i < 300; ++i) {
        Sight<T> s = random_sight<T>(random);
        const T angle =
            metric::sprite_angle_unchecked(s.drawn_from, s.seen_from, s.point, s.offset);
        for (const int exponent : {-60, -20, 7, 100}) {
            const T unit = metric::detail::power_of_two<T>(exponent);
            CHECK(
                metric::sprite_angle_unchecked<T>(
                    s.drawn_from * unit, s.seen_from * unit, s.point * unit, s.offset * unit
                ) == angle
            );
        }
        // On a grid of 1/64 with coordinates below 256, sums with 4096 are exact even in float.
        s.drawn_from = on_grid(s.drawn_from);
        s.seen_from = on_grid(s.seen_from);
        s.point = on_grid(s.point);
        const Vector<T> shift(T(4096), T(-1024), T(2048));
        CHECK(
            metric::sprite_angle<T>(
                s.drawn_from + shift, s.seen_from + shift, s.point + shift, s.offset
            ) == metric::sprite_angle(s.drawn_from, s.seen_from, s.point, s.offset)
        );
    }
}

TEST_CASE("A rotated scene has the same sprite angles") {
    support::Random random(73);
    for (int i = 0; i < 300; ++i) {
        const Sight<double> s = random_sight<double>(random);
        const glm::dvec3 x = random.direction<double>();
        const glm::dvec3 y = glm::normalize(glm::cross(x, random.direction<double>()));
        const glm::dvec3 z = glm::cross(x, y);
        const auto turned = [&](const glm::dvec3& v) { return v.x * x + v.y * y + v.z * z; };
        const double before =
            metric::sprite_angle_unchecked(s.drawn_from, s.seen_from, s.point, s.offset);
        const double after = metric::sprite_angle_unchecked(
            turned(s.drawn_from), turned(s.seen_from), turned(s.point), s.offset
        );
        // Coordinates of about 100 are rounded to 1e-14, motions are 1e-4 and more.
        const double scale = std::abs(s.offset) / glm::length(s.point - s.seen_from);
        CHECK(std::abs(after - before) <= 1e-9 * scale);
    }
}

TEMPLATE_TEST_CASE("No point of a box turns more than the largest turn", "", float, double) {
    using T = TestType;
    support::Random random(74);
    int below_pi = 0;
    for (int i = 0; i < 4000; ++i) {
        const Vector<T> v1 = random.vector(T(-3), T(3));
        const Vector<T> v2 =
            v1 + random.direction<T>() * std::pow(T(10), random.uniform(T(-4), T(0.7)));
        const Vector<T> corner_a = random.vector(T(-3), T(3));
        Vector<T> corner_b = random.vector(T(-3), T(3));
        if (random.below(4) == 0) {
            corner_b[static_cast<int>(random.below(3))] = corner_a.x;
        }
        const Box3<T> box = unite(Box3<T>{corner_a, corner_a}, corner_b);
        const Real largest = metric::largest_sprite_turn_unchecked(v1, v2, box);
        below_pi += largest < std::numbers::pi_v<T> ? 1 : 0;
        for (int sample = 0; sample < 40; ++sample) {
            const RealVector point = support::random_surface_point(random, box);
            const Real turn = reference_turn(RealVector(v1), RealVector(v2), point);
            if (turn > largest && largest < Real(std::numbers::pi_v<T>)) {
                FAIL_CHECK("turn " << turn << " above " << largest << " of case " << i);
            }
        }
    }
    CHECK(below_pi > 2000);
}

TEMPLATE_TEST_CASE("The largest turn is attained on the bisector", "", float, double) {
    using T = TestType;
    support::Random random(75);
    const Vector<T> v1(T(-1), T(0), T(0));
    const Vector<T> v2(T(1), T(0), T(0));
    for (int i = 0; i < 200; ++i) {
        const T distance = random.uniform(T(0.5), T(100));
        const Vector<T> point(T(0), distance, T(0));
        const Box3<T> box{point, point + Vector<T>(T(0.5), T(1), T(2))};
        const T largest = metric::largest_sprite_turn_unchecked(v1, v2, box);
        const T turn = metric::sprite_turn_unchecked(v1, v2, point);
        CHECK(largest >= turn);
        // The distance is shortened by 16 units of the reach, at most 6 distances.
        CHECK(largest <= turn * (1 + 256 * T(kRoundoff<T>)));
    }
    constexpr T kPi = std::numbers::pi_v<T>;
    // A box around an eye, around the middle of the way, and one that the way only touches.
    for (const Vector<T>& middle : {v1, Vector<T>(T(0)), Vector<T>(T(0), T(0.5), T(0))}) {
        const Box3<T> box{middle - Vector<T>(T(0.5)), middle + Vector<T>(T(0.5))};
        CHECK(metric::largest_sprite_turn_unchecked(v1, v2, box) == kPi);
    }
    // Who does not move turns nothing.
    const Box3<T> away{Vector<T>(T(5)), Vector<T>(T(6))};
    CHECK(metric::largest_sprite_turn_unchecked(v1, v1, away) == T(0));
    // Beside the segment, past its end, the nearest point is the eye.
    const Box3<T> past{{T(3), T(-1), T(-1)}, {T(4), T(1), T(1)}};
    CHECK(metric::largest_sprite_turn_unchecked(v1, v2, past) == Approx(2 * std::atan(0.5)));
}

TEMPLATE_TEST_CASE("A shared bound holds for every vertex", "", float, double) {
    using T = TestType;
    support::Random random(76);
    for (int i = 0; i < 20000; ++i) {
        const T turn = std::pow(T(10), random.uniform(T(-4), T(0.45)));
        const T distance = random.uniform(T(0.1), T(10));
        const T offset = random.uniform(T(-12), T(12));
        const Real bound = metric::sprite_angle_bound_unchecked(turn, distance, offset);
        // A vertex that turns less, is no nearer and no more off.
        const Real a = Real(distance) * random.uniform(Real(1), Real(1.5));
        const Real b = Real(offset) * random.uniform(Real(0.5), Real(1));
        const Real psi = Real(turn) * random.uniform(Real(0), Real(1));
        const Real angle = std::atan2(std::abs(b) * std::sin(psi), a + b * std::cos(psi));
        if (angle > bound && bound < Real(std::numbers::pi_v<T>)) {
            FAIL_CHECK(
                "angle " << angle << " above " << bound << " turn " << turn << " distance "
                         << distance << " offset " << offset
            );
        }
    }
    CHECK(metric::sprite_angle_bound_unchecked(T(1), T(2), T(0)) == T(0));
    CHECK(metric::sprite_angle_bound_unchecked(T(1), T(2), T(-3)) == std::numbers::pi_v<T>);
}

TEMPLATE_TEST_CASE("The shared bound grows with the turn and the offset", "", float, double) {
    using T = TestType;
    support::Random random(77);
    for (int i = 0; i < 500; ++i) {
        const T distance = random.uniform(T(0.5), T(5));
        const T offset = random.uniform(T(-4), T(4));
        T before = 0;
        for (int step = 1; step <= 31; ++step) {
            const T turn = static_cast<T>(step) / 10;
            const T bound = metric::sprite_angle_bound_unchecked(turn, distance, offset);
            // Two values within 32 units above the exact ones, which grow, and a denominator that
            // may have lost digits by cancelling.
            CHECK(bound >= before * (1 - T(1e-3)));
            before = bound;
        }
    }
}

TEMPLATE_TEST_CASE("Spreads of angles", "", float, double) {
    using T = TestType;
    const auto spread = [](const std::vector<T>& angles) {
        return metric::angle_spread_unchecked(std::span<const T>(angles));
    };
    const auto is_below = [](const std::vector<T>& angles, T kappa, T alpha) {
        return metric::is_below_unchecked(std::span<const T>(angles), kappa, alpha);
    };
    CHECK(spread({}).rms == T(0));
    CHECK(spread({}).largest == T(0));
    CHECK(is_below({}, T(1), T(1e-3)));
    CHECK_FALSE(is_below({}, T(0), T(1e-3)));
    CHECK(spread({T(0), T(0)}).rms == T(0));
    CHECK(spread({T(3), T(4)}).rms == Approx(std::sqrt(12.5)));
    // The criterion is strict.
    const T step = T(1) / 512;
    CHECK_FALSE(is_below({step, step, step}, T(1), step));
    CHECK(is_below({step, step, step}, T(1), std::nextafter(step, T(1))));
    // Squares that underflow or overflow.
    const T least = std::numeric_limits<T>::min();
    CHECK(spread({least, least}).rms == least);
    const T most = std::numeric_limits<T>::max();
    CHECK(spread({most, T(0), T(0), T(0)}).rms == most / 2);
    // Many equal terms: a plain sum in float stops growing.
    const T value = T(0.1);
    CHECK(spread(std::vector<T>(5'000'000, value)).rms == value);

    const std::vector<T> negative{T(1), T(-1)};
    CHECK(metric::check_angles(std::span<const T>(negative)) == MetricOutcome::err_range);
    const std::vector<T> none{T(-1), std::numeric_limits<T>::quiet_NaN()};
    CHECK(metric::check_angles(std::span<const T>(none)) == MetricOutcome::err_nonfinite);
    CHECK(metric::check_angles(std::span<const T>()) == MetricOutcome::ok);
}

TEMPLATE_TEST_CASE("A spread lies between its mean and its largest angle", "", float, double) {
    using T = TestType;
    support::Random random(78);
    for (int i = 0; i < 300; ++i) {
        std::vector<T> angles(1 + random.below(50));
        for (T& angle : angles) {
            angle = std::pow(T(10), random.uniform(T(-6), T(0)));
        }
        const auto of = [](const std::vector<T>& all) {
            return metric::angle_spread_unchecked(std::span<const T>(all));
        };
        const auto spread = of(angles);
        constexpr T kUnit = T(kRoundoff<T>);
        CHECK(spread.rms <= spread.largest * (1 + 8 * kUnit));
        const T count = static_cast<T>(angles.size());
        // No single angle is bounded by the root of the mean square, only by sqrt(n) of it.
        CHECK(spread.largest <= spread.rms * std::sqrt(count) * (1 + 8 * kUnit));
        // Neither order nor unit matters: the root halves what the sums lose, 2 units each, and
        // three more operations are rounded on both ways.
        std::vector<T> turned(angles.rbegin(), angles.rend());
        CHECK(std::abs(of(turned).rms - spread.rms) <= 8 * kUnit * spread.rms);
        for (T& angle : turned) {
            angle = std::ldexp(angle, -60);
        }
        CHECK(of(turned).rms == std::ldexp(of({angles.rbegin(), angles.rend()}).rms, -60));
    }
}
