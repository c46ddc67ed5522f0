#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

/// Lengths are brought to about 1 by powers of two before they are squared, so that no metric
/// depends on the unit of length. Powers of two only, because multiplying by them is exact.
namespace farfield::metric::detail {

/// Half the distance from 1 to the next larger number: the largest relative error of one operation.
template <typename T>
inline constexpr T kUnitRoundoff = std::numeric_limits<T>::epsilon() / 2;

/// Largest exponent whose power of two and its inverse are both normal numbers: 126 or 1022.
template <typename T>
inline constexpr int kMaxExponent = std::numeric_limits<T>::max_exponent - 2;

template <typename T>
using FloatBits =
    std::conditional_t<sizeof(T) == sizeof(std::uint32_t), std::uint32_t, std::uint64_t>;

/// 2^exponent. @pre |exponent| <= kMaxExponent
template <typename T>
[[nodiscard]] constexpr T power_of_two(int exponent) noexcept {
    constexpr int kBias = std::numeric_limits<T>::max_exponent - 1;
    constexpr int kFractionBits = std::numeric_limits<T>::digits - 1;
    return std::bit_cast<T>(static_cast<FloatBits<T>>(exponent + kBias) << kFractionBits);
}

/// e with 2^e <= |x| < 2^(e+1), limited to +-kMaxExponent; zero and denormal numbers give the lower
/// limit. The bits are read because std::ilogb is a call into the C library. @pre x is finite
template <typename T>
[[nodiscard]] constexpr int exponent_of(T x) noexcept {
    constexpr int kBias = std::numeric_limits<T>::max_exponent - 1;
    constexpr int kFractionBits = std::numeric_limits<T>::digits - 1;
    const auto biased = (std::bit_cast<FloatBits<T>>(x) << 1U) >> (kFractionBits + 1);
    return std::clamp(static_cast<int>(biased) - kBias, -kMaxExponent<T>, kMaxExponent<T>);
}

/// x * 2^exponent for every exponent, rounded once.
template <typename T>
[[nodiscard]] T times_power_of_two(T x, int exponent) noexcept {
    if (std::abs(exponent) <= kMaxExponent<T>) {
        return x * power_of_two<T>(exponent);
    }
    return std::ldexp(x, exponent);
}

/// Largest magnitude of the components.
template <typename T>
[[nodiscard]] T largest_component(const glm::vec<3, T>& v) noexcept {
    return std::max(std::max(std::abs(v.x), std::abs(v.y)), std::abs(v.z));
}

/// A vector as `direction` * 2^exponent. The largest component of `direction` is in [1, 2), next to
/// overflow below 4; for a vector of denormal numbers it is at least the unit roundoff, and zero
/// for none but the zero vector.
template <typename T>
struct ScaledVector {
    glm::vec<3, T> direction{T(0)};
    int exponent = 0;
};

template <typename T>
[[nodiscard]] ScaledVector<T> scaled(const glm::vec<3, T>& v) noexcept {
    const int exponent = exponent_of(largest_component(v));
    return {v * power_of_two<T>(-exponent), exponent};
}

/// Euclidean length, whatever the unit.
template <typename T>
[[nodiscard]] T length(const glm::vec<3, T>& v) noexcept {
    const ScaledVector<T> s = scaled(v);
    return times_power_of_two(glm::length(s.direction), s.exponent);
}

/// True when the difference of two such coordinates, and half the difference of two differences,
/// cannot overflow.
template <typename T>
[[nodiscard]] bool is_measurable(T x) noexcept {
    return std::abs(x) <= std::numeric_limits<T>::max() / 4;
}

template <typename T>
[[nodiscard]] bool is_measurable(const glm::vec<3, T>& v) noexcept {
    return is_measurable(v.x) && is_measurable(v.y) && is_measurable(v.z);
}

} // namespace farfield::metric::detail
