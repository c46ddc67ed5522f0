#pragma once

#include <cstdint>

namespace farfield::scenes {

/// Mixes 64 bits so that neighbouring inputs give unrelated outputs (the finaliser of splitmix64).
[[nodiscard]] constexpr std::uint64_t mix(std::uint64_t value) noexcept {
    value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    value = (value ^ (value >> 27U)) * 0x94D049BB133111EBULL;
    return value ^ (value >> 31U);
}

/// Random numbers that are the same on every platform: the distributions of the standard library
/// are not.
/// @par Source Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014
class Random {
  public:
    explicit constexpr Random(std::uint64_t seed) noexcept : state_(seed) {}

    /// 64 uniform bits.
    constexpr std::uint64_t bits() noexcept {
        state_ += 0x9E3779B97F4A7C15ULL;
        return mix(state_);
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    constexpr double unit() noexcept { return static_cast<double>(bits() >> 11U) * 0x1p-53; }

    /// Uniform in [low, high).
    constexpr double between(double low, double high) noexcept {
        return low + (high - low) * unit();
    }

  private:
    std::uint64_t state_;
};

} // namespace farfield::scenes
