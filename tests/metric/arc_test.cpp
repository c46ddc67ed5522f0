#include "support/random.hpp"
#include <farfield/metric/detail/arc.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace farfield;
using Real = long double;

template <typename T>
inline constexpr Real kRoundoff = std::numeric_limits<T>::epsilon() / 2;

/// Relative error in units of rounding; T's own extended precision has 11 bits more than double.
template <typename T>
Real arc_error(T top, T bottom) {
    const Real exact = std::atan2(Real(top), Real(bottom));
    return std::abs(Real(metric::detail::arc_tangent(top, bottom)) - exact) /
           (kRoundoff<T> * exact);
}

} // namespace

TEMPLATE_TEST_CASE("Arc tangents are within five units of rounding", "", float, double) {
    using T = TestType;
    support::Random random(41);
    Real worst = 0;
    for (int i = 0; i < 300000; ++i) {
        // Half of the quotients about 1, where the ranges of the reduction meet.
        const T spread = random.below(2) == 0 ? T(0.6) : T(10);
        const T top = std::pow(T(10), random.uniform(-spread, spread));
        const T bottom = random.uniform(T(0.5), T(2));
        worst = std::max(worst, arc_error(top, bottom));
    }
    CHECK(worst <= 5);
    // The bound is not idle.
    CHECK(worst > 1.5);
}

TEMPLATE_TEST_CASE("Arc tangents next to the ends of their ranges", "", float, double) {
    using T = TestType;
    for (const T split : {std::numbers::sqrt2_v<T> - 1, T(1), std::numbers::sqrt2_v<T> + 1}) {
        T quotient = split * (1 - 64 * std::numeric_limits<T>::epsilon());
        for (int step = 0; step < 256; ++step) {
            CHECK(arc_error(quotient, T(1)) <= 5);
            CHECK(arc_error(T(1), quotient) <= 5);
            quotient = std::nextafter(quotient, T(8));
        }
    }
}

TEMPLATE_TEST_CASE("Arc tangents at their limits", "", float, double) {
    using T = TestType;
    using metric::detail::arc_of;
    using metric::detail::arc_tangent;
    constexpr T kPi = std::numbers::pi_v<T>;
    constexpr T kTiny = std::numeric_limits<T>::min();
    CHECK(arc_tangent(T(0), T(1)) == T(0));
    CHECK(arc_tangent(T(1), T(0)) == kPi / 2);
    CHECK(arc_tangent(T(1), T(1)) == kPi / 4);
    CHECK(arc_tangent(kTiny, T(1)) == kTiny);
    CHECK(arc_tangent(T(1), kTiny) == kPi / 2);
    CHECK(arc_of(T(0), T(1)) == T(0));
    CHECK(arc_of(T(0), T(-1)) == kPi);
    CHECK(arc_of(T(0), T(0)) == kPi);
    CHECK(arc_of(T(1), T(0)) == kPi / 2);
    CHECK(arc_of(T(1), T(-1)) == Approx(3 * kPi / 4));
    CHECK(arc_of(kTiny, T(-1)) == kPi);
}

TEMPLATE_TEST_CASE("Arcs in all directions are those of the C library", "", float, double) {
    using T = TestType;
    support::Random random(42);
    for (int i = 0; i < 100000; ++i) {
        const T angle = random.uniform(T(0), std::numbers::pi_v<T>);
        const T across = std::max(std::sin(angle), T(0)) * T(3);
        const T along = std::cos(angle) * T(3);
        const Real exact = std::atan2(Real(across), Real(along));
        // Beyond pi/2 the arc is subtracted from pi: 5 units of the arc, one of pi and one of the
        // difference, none of them larger than those of twice the result.
        const Real limit = 14 * kRoundoff<T> * exact;
        CHECK(std::abs(Real(metric::detail::arc_of(across, along)) - exact) <= limit);
    }
}
