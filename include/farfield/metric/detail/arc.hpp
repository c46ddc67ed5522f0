#pragma once

#include <farfield/metric/detail/lanes.hpp>

#include <numbers>
#include <type_traits>

/// The arc tangent of a quotient. Bounds over boxes have one of their own, for packs of numbers and
/// so that they are the same with every C library.
namespace farfield::metric::detail {

/// Coefficients of the polynomial p of least relative error in atan(t) = t + t^3 p(t^2) for |t| <=
/// tan(pi/8), found by Remez exchange: 0.011 units of rounding in float, 0.012 in double. Plain
/// arrays, because packs are compiled for machines that not every caller of std::array runs on.
template <typename T>
struct ArcTerms;

template <>
struct ArcTerms<float> {
    static constexpr float kTerms[] = {
        -0.33333315188608303475F,
        0.19998471514954837622F,
        -0.14243533332223117599F,
        0.10593813631256537315F,
        -0.060782211568800958593F};
};

template <>
struct ArcTerms<double> {
    static constexpr double kTerms[] = {
        -0.33333333333333196168,
        0.19999999999953247934,
        -0.14285714280166606585,
        0.11111110782156920336,
        -0.090908977253003253864,
        0.076920597182138854706,
        -0.066630992120006842513,
        0.058478593294314530437,
        -0.050391906653670989278,
        0.038062145705639492587,
        -0.017905045616169519555};
};

/// What the rounded pi/4 lacks, as a part of it; the same for its multiples by powers of two.
template <typename T>
inline constexpr T kTurnRest = std::is_same_v<T, float> ? T(-2.78275351529e-8)
                                                        : T(3.89817183251937545e-17);

/// atan(top / bottom) with a relative error of at most 5 units of rounding; 0 exactly for top = 0.
/// @pre top >= 0, bottom >= 0, one of them positive, their sum finite
/// @par Source The range is reduced by tan(a - pi/4) = (tan a - 1) / (tan a + 1), which takes no
/// division more than the quotient itself.
template <typename Number>
[[nodiscard]] Number arc_tangent(const Number& top, const Number& bottom) noexcept {
    using Lane = Lanes<Number>;
    using T = typename Lane::Scalar;
    constexpr T kSplit = T(0.41421356237309504880L); // tan(pi/8)
    constexpr auto& kTerms = ArcTerms<T>::kTerms;
    const auto flat = top <= bottom * Number(kSplit);
    const auto steep = bottom <= top * Number(kSplit);
    const auto choose = [&](const Number& if_flat, const Number& if_steep, const Number& middle) {
        return Lane::select(flat, if_flat, Lane::select(steep, if_steep, middle));
    };
    const Number t = choose(top, -bottom, top - bottom) / choose(bottom, top, top + bottom);
    const Number square = t * t;
    constexpr int kLast = static_cast<int>(sizeof(kTerms) / sizeof(T)) - 1;
    Number p(kTerms[kLast]);
    for (int i = kLast - 1; i >= 0; --i) {
        p = p * square + Number(kTerms[i]);
    }
    constexpr T kEighthTurn = std::numbers::pi_v<T> / 4;
    const Number turn = choose(Number(T(0)), Number(2 * kEighthTurn), Number(kEighthTurn));
    return turn + (t + (t * (square * p) + turn * Number(kTurnRest<T>)));
}

/// atan2(across, along) for across >= 0, in [0, pi]; pi where both vanish: an angle of 0 would mean
/// "no error".
/// @pre both finite, the sum of their magnitudes too
template <typename Number>
[[nodiscard]] Number arc_of(const Number& across, const Number& along) noexcept {
    using Lane = Lanes<Number>;
    using T = typename Lane::Scalar;
    const Number zero(T(0));
    const Number angle = arc_tangent(across, Lane::magnitude(along));
    const Number turned = Lane::select(along < zero, Number(std::numbers::pi_v<T>) - angle, angle);
    const auto opposite = (across <= zero) & (along <= zero);
    return Lane::select(opposite, Number(std::numbers::pi_v<T>), turned);
}

} // namespace farfield::metric::detail
