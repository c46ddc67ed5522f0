#pragma once

#include <farfield/metric/detail/lanes.hpp>

#include <cstdint>
#include <limits>
#include <type_traits>

/// Numbers that are computed in step, as vectors of the compiler: GCC and Clang turn their
/// operators into the instructions that the translation unit is compiled for.
#if defined(__GNUC__)
#define FARFIELD_HAS_PACKS 1

namespace farfield::metric::detail {

template <typename T, int kBytes>
struct PackTypes {
    using Int = std::conditional_t<sizeof(T) == sizeof(std::int32_t), std::int32_t, std::int64_t>;
    typedef T Values __attribute__((vector_size(kBytes)));     // NOLINT(modernize-use-using)
    typedef Int Integers __attribute__((vector_size(kBytes))); // NOLINT(modernize-use-using)
};

/// Whole numbers beside a pack: exponents and masks. A mask is all ones or zero in each lane.
template <typename T, int kBytes>
struct WholePack {
    using Values = typename PackTypes<T, kBytes>::Integers;
    Values values;

    friend WholePack operator+(WholePack a, WholePack b) noexcept { return {a.values + b.values}; }
    friend WholePack operator-(WholePack a, WholePack b) noexcept { return {a.values - b.values}; }
    friend WholePack operator-(WholePack a) noexcept { return {-a.values}; }
    friend WholePack operator&(WholePack a, WholePack b) noexcept { return {a.values & b.values}; }
    friend WholePack operator|(WholePack a, WholePack b) noexcept { return {a.values | b.values}; }
    friend WholePack operator<=(WholePack a, WholePack b) noexcept {
        return {a.values <= b.values};
    }
};

/// `kBytes` full of numbers. The width is part of the type, so that no function compiled for one
/// machine has the name of another's.
template <typename T, int kBytes>
struct Pack {
    using Values = typename PackTypes<T, kBytes>::Values;
    static constexpr int kLanes = kBytes / static_cast<int>(sizeof(T));
    Values values;

    Pack() noexcept : values{} {}
    explicit Pack(T x) noexcept : values(x - Values{}) {}
    explicit Pack(Values v) noexcept : values(v) {}

    /// From any address.
    [[nodiscard]] static Pack load(const T* from) noexcept {
        Pack pack;
        __builtin_memcpy(&pack.values, from, sizeof(Values));
        return pack;
    }
    void store(T* to) const noexcept { __builtin_memcpy(to, &values, sizeof(Values)); }

    friend Pack operator+(Pack a, Pack b) noexcept { return Pack(a.values + b.values); }
    friend Pack operator-(Pack a, Pack b) noexcept { return Pack(a.values - b.values); }
    friend Pack operator-(Pack a) noexcept { return Pack(-a.values); }
    friend Pack operator*(Pack a, Pack b) noexcept { return Pack(a.values * b.values); }
    friend Pack operator/(Pack a, Pack b) noexcept { return Pack(a.values / b.values); }
    friend WholePack<T, kBytes> operator<(Pack a, Pack b) noexcept { return {a.values < b.values}; }
    friend WholePack<T, kBytes> operator<=(Pack a, Pack b) noexcept {
        return {a.values <= b.values};
    }
};

template <typename T, int kBytes>
struct Lanes<Pack<T, kBytes>> {
    using Number = Pack<T, kBytes>;
    using Scalar = T;
    using Whole = WholePack<T, kBytes>;
    using Mask = WholePack<T, kBytes>;
    using Values = typename PackTypes<T, kBytes>::Values;
    using Integers = typename PackTypes<T, kBytes>::Integers;
    static constexpr int kBias = std::numeric_limits<T>::max_exponent - 1;
    static constexpr int kFractionBits = std::numeric_limits<T>::digits - 1;

    [[nodiscard]] static Number select(Mask condition, Number yes, Number no) noexcept {
        return Number(condition.values ? yes.values : no.values);
    }
    [[nodiscard]] static Number magnitude(Number x) noexcept {
        const Integers all_but_sign =
            std::numeric_limits<typename PackTypes<T, kBytes>::Int>::max() - Integers{};
        return Number(reinterpret_cast<Values>(reinterpret_cast<Integers>(x.values) & all_but_sign)
        );
    }
    /// As whole numbers, negative numbers are below zero too, and the larger of two whole numbers
    /// takes one instruction.
    [[nodiscard]] static Number positive_part(Number x) noexcept {
        const auto bits = reinterpret_cast<Integers>(x.values);
        return Number(reinterpret_cast<Values>(bits > Integers{} ? bits : Integers{}));
    }
    /// The loop becomes one instruction where the unit is compiled with -fno-math-errno.
    [[nodiscard]] static Number square_root(Number x) noexcept {
        Number root;
        for (int lane = 0; lane < Number::kLanes; ++lane) {
            if constexpr (std::is_same_v<T, float>) {
                root.values[lane] = __builtin_sqrtf(x.values[lane]);
            } else {
                root.values[lane] = __builtin_sqrt(x.values[lane]);
            }
        }
        return root;
    }
    /// @pre 0 <= x < 2^(kMaxExponent + 1), as the difference of measurable coordinates is
    [[nodiscard]] static Whole exponent(Number x) noexcept {
        const Integers biased = reinterpret_cast<Integers>(x.values) >> kFractionBits;
        const Integers least = 1 - Integers{};
        return {(biased > least ? biased : least) - kBias};
    }
    [[nodiscard]] static Number power(Whole exponent) noexcept {
        return Number(reinterpret_cast<Values>((exponent.values + kBias) << kFractionBits));
    }
    [[nodiscard]] static Whole limited(Whole exponent, int lo, int hi) noexcept {
        const Integers least = lo - Integers{};
        const Integers most = hi - Integers{};
        const Integers raised = exponent.values < least ? least : exponent.values;
        return {raised > most ? most : raised};
    }
    /// True where the condition holds in every lane.
    [[nodiscard]] static bool all(Mask condition) noexcept {
        typename PackTypes<T, kBytes>::Int both = -1;
        for (int lane = 0; lane < Number::kLanes; ++lane) {
            both &= condition.values[lane];
        }
        return both != 0;
    }
};

} // namespace farfield::metric::detail

#endif
