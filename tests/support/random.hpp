#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <random>

namespace farfield::support {

/// Random numbers that are the same with every standard library, unlike its distributions.
class Random {
  public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}

    /// Uniform in [lo, hi).
    template <typename T>
    [[nodiscard]] T uniform(T lo, T hi) {
        constexpr int kDroppedBits = 40;
        constexpr T kStep = T(1) / T(1U << 24U);
        return lo + (hi - lo) * (static_cast<T>(engine_() >> kDroppedBits) * kStep);
    }

    /// Each component uniform in [lo, hi).
    template <typename T>
    [[nodiscard]] glm::vec<3, T> vector(T lo, T hi) {
        const T x = uniform(lo, hi);
        const T y = uniform(lo, hi);
        return {x, y, uniform(lo, hi)};
    }

    /// Uniform on the unit sphere.
    template <typename T>
    [[nodiscard]] glm::vec<3, T> direction() {
        for (;;) {
            const glm::vec<3, T> v = vector(T(-1), T(1));
            const T length = glm::length(v);
            if (length > T(0.1) && length <= T(1)) {
                return v / length;
            }
        }
    }

    /// Uniform in 0 .. count - 1. @pre count > 0
    [[nodiscard]] unsigned below(unsigned count) {
        return static_cast<unsigned>(engine_() % count);
    }

  private:
    std::mt19937_64 engine_;
};

} // namespace farfield::support
