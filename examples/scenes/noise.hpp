#pragma once

#include "random.hpp"

#include <cmath>
#include <cstdint>

namespace farfield::scenes {

/// Gradient noise on the integer lattice, about [-0.8, 0.8], wavelength about 2.
[[nodiscard]] inline double noise(double x, double z, std::uint64_t seed) noexcept {
    const double floor_x = std::floor(x);
    const double floor_z = std::floor(z);
    const double u = x - floor_x;
    const double v = z - floor_z;
    const auto corner = [&](int dx, int dz) {
        const auto ix = static_cast<std::uint64_t>(static_cast<std::int64_t>(floor_x) + dx);
        const auto iz = static_cast<std::uint64_t>(static_cast<std::int64_t>(floor_z) + dz);
        const std::uint64_t bits = mix(mix(ix + seed) ^ (iz * 0x9E3779B97F4A7C15ULL));
        const double slope_x = static_cast<double>(bits >> 32U) * 0x1p-31 - 1.0;
        const double slope_z = static_cast<double>(bits & 0xFFFFFFFFULL) * 0x1p-31 - 1.0;
        return slope_x * (u - dx) + slope_z * (v - dz);
    };
    // Second derivatives are continuous across cells.
    const auto ease = [](double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); };
    const double left = std::lerp(corner(0, 0), corner(0, 1), ease(v));
    const double right = std::lerp(corner(1, 0), corner(1, 1), ease(v));
    return std::lerp(left, right, ease(u));
}

} // namespace farfield::scenes
