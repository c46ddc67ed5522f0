#pragma once

#include <farfield/metric/detail/scale.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

/// One text of a formula for one box and for several at once. Formulas over boxes are templates
/// over `Number`: float or double here, and in `src/metric` packs of them that the machine computes
/// with in step. They have no branches, and of numbers they ask what `Lanes` offers and + - * / <
/// <=.
namespace farfield::metric::detail {

/// What formulas need of a number. The general template serves float and double.
template <typename Number>
struct Lanes {
    using Scalar = Number; ///< what one lane holds
    using Whole = int;     ///< exponents
    using Mask = bool;     ///< of comparisons

    [[nodiscard]] static Number select(Mask condition, Number yes, Number no) noexcept {
        return condition ? yes : no;
    }
    [[nodiscard]] static Number magnitude(Number x) noexcept { return std::abs(x); }
    /// x, or 0 where it is negative.
    [[nodiscard]] static Number positive_part(Number x) noexcept {
        return x > Number(0) ? x : Number(0);
    }
    [[nodiscard]] static Number square_root(Number x) noexcept { return std::sqrt(x); }
    /// As `exponent_of`. @pre 0 <= x < 2^(kMaxExponent + 1), as differences of measurable
    /// coordinates are
    [[nodiscard]] static Whole exponent(Number x) noexcept { return exponent_of(x); }
    /// As `power_of_two`.
    [[nodiscard]] static Number power(Whole exponent) noexcept {
        return power_of_two<Number>(exponent);
    }
    [[nodiscard]] static Whole limited(Whole exponent, int lo, int hi) noexcept {
        return std::clamp(exponent, lo, hi);
    }
};

template <typename Number>
[[nodiscard]] Number least(const Number& a, const Number& b) noexcept {
    return Lanes<Number>::select(a < b, a, b);
}

template <typename Number>
[[nodiscard]] Number greatest(const Number& a, const Number& b) noexcept {
    return Lanes<Number>::select(b < a, a, b);
}

/// Three coordinates. GLM's own vectors take no packs.
template <typename Number>
struct Triple {
    Number x{};
    Number y{};
    Number z{};

    friend Triple operator+(const Triple& a, const Triple& b) noexcept {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    friend Triple operator-(const Triple& a, const Triple& b) noexcept {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    friend Triple operator-(const Triple& a) noexcept { return {-a.x, -a.y, -a.z}; }
    friend Triple operator*(const Triple& a, const Triple& b) noexcept {
        return {a.x * b.x, a.y * b.y, a.z * b.z};
    }
    friend Triple operator*(const Triple& a, const Number& factor) noexcept {
        return {a.x * factor, a.y * factor, a.z * factor};
    }
};

template <typename T>
[[nodiscard]] Triple<T> triple(const glm::vec<3, T>& v) noexcept {
    return {v.x, v.y, v.z};
}

template <typename Number>
[[nodiscard]] Triple<Number> least(const Triple<Number>& a, const Triple<Number>& b) noexcept {
    return {least(a.x, b.x), least(a.y, b.y), least(a.z, b.z)};
}

template <typename Number>
[[nodiscard]] Triple<Number> greatest(const Triple<Number>& a, const Triple<Number>& b) noexcept {
    return {greatest(a.x, b.x), greatest(a.y, b.y), greatest(a.z, b.z)};
}

template <typename Number>
[[nodiscard]] Triple<Number> magnitude(const Triple<Number>& v) noexcept {
    using Lane = Lanes<Number>;
    return {Lane::magnitude(v.x), Lane::magnitude(v.y), Lane::magnitude(v.z)};
}

template <typename Number>
[[nodiscard]] Triple<Number> positive_part(const Triple<Number>& v) noexcept {
    using Lane = Lanes<Number>;
    return {Lane::positive_part(v.x), Lane::positive_part(v.y), Lane::positive_part(v.z)};
}

template <typename Number>
[[nodiscard]] Number sum(const Triple<Number>& v) noexcept {
    return v.x + v.y + v.z;
}

template <typename Number>
[[nodiscard]] Number largest(const Triple<Number>& v) noexcept {
    return greatest(greatest(v.x, v.y), v.z);
}

template <typename Number>
[[nodiscard]] Number dot(const Triple<Number>& a, const Triple<Number>& b) noexcept {
    return sum(a * b);
}

/// A triple as `direction` * 2^exponent, as `ScaledVector`.
template <typename Number>
struct ScaledTriple {
    Triple<Number> direction;
    typename Lanes<Number>::Whole exponent{};
};

template <typename Number>
[[nodiscard]] ScaledTriple<Number> scaled(const Triple<Number>& v) noexcept {
    using Lane = Lanes<Number>;
    const auto exponent = Lane::exponent(largest(magnitude(v)));
    return {v * Lane::power(-exponent), exponent};
}

} // namespace farfield::metric::detail
