#include <farfield/metric/detail/scale.hpp>

#include <catch2/catch.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <limits>

using namespace farfield::metric;

TEMPLATE_TEST_CASE("Exponents and powers of two", "", float, double) {
    using T = TestType;
    constexpr int kMax = detail::kMaxExponent<T>;
    for (int exponent = -kMax; exponent <= kMax; ++exponent) {
        const T power = detail::power_of_two<T>(exponent);
        CHECK(power == std::ldexp(T(1), exponent));
        CHECK(detail::exponent_of(power) == exponent);
        CHECK(detail::exponent_of(-power * T(1.75)) == exponent);
    }
    CHECK(detail::exponent_of(T(0)) == -kMax);
    CHECK(detail::exponent_of(std::numeric_limits<T>::denorm_min()) == -kMax);
    CHECK(detail::exponent_of(std::numeric_limits<T>::max()) == kMax);
}

TEMPLATE_TEST_CASE("Scaling reaches beyond the normal range", "", float, double) {
    using T = TestType;
    constexpr int kMax = detail::kMaxExponent<T>;
    for (const int exponent : {-2 * kMax, -kMax - 20, -kMax, -1, 0, 1, kMax, kMax + 1, 2 * kMax}) {
        CHECK(detail::times_power_of_two(T(1.5), exponent) == std::ldexp(T(1.5), exponent));
        CHECK(detail::times_power_of_two(T(0), exponent) == T(0));
    }
}

TEMPLATE_TEST_CASE("Scaled vectors are about 1 and lose nothing", "", float, double) {
    using T = TestType;
    using Vector = glm::vec<3, T>;
    constexpr T kLeast = std::numeric_limits<T>::denorm_min();
    constexpr T kMost = std::numeric_limits<T>::max();
    for (const Vector& v :
         {Vector(T(3), T(-4), T(0)),
          Vector(T(0), T(0), T(1e-30)),
          Vector(kLeast, T(0), -3 * kLeast),
          Vector(kMost, -kMost, T(1)),
          Vector(T(0))}) {
        const auto scaled = detail::scaled(v);
        const T largest = detail::largest_component(scaled.direction);
        if (v == Vector(T(0))) {
            CHECK(largest == T(0));
            continue;
        }
        CHECK(largest >= detail::kUnitRoundoff<T>);
        CHECK(largest < T(4));
        for (int axis = 0; axis < 3; ++axis) {
            CHECK(std::ldexp(scaled.direction[axis], scaled.exponent) == v[axis]);
        }
    }
}

TEMPLATE_TEST_CASE("Lengths neither overflow nor vanish", "", float, double) {
    using T = TestType;
    using Vector = glm::vec<3, T>;
    for (const int exponent : {-140, -100, 0, 100, 120}) {
        const T unit = std::ldexp(T(1), exponent);
        CHECK(detail::length(Vector(T(3), T(0), T(-4)) * unit) == T(5) * unit);
    }
    CHECK(detail::length(Vector(T(0))) == T(0));
}

TEMPLATE_TEST_CASE("Coordinates whose differences overflow are not measurable", "", float, double) {
    using T = TestType;
    constexpr T kMost = std::numeric_limits<T>::max();
    CHECK(detail::is_measurable(T(0)));
    CHECK(detail::is_measurable(kMost / 4));
    CHECK_FALSE(detail::is_measurable(kMost / 2));
    CHECK_FALSE(detail::is_measurable(std::numeric_limits<T>::infinity()));
    CHECK_FALSE(detail::is_measurable(std::numeric_limits<T>::quiet_NaN()));
}
