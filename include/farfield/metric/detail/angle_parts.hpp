#pragma once

#include <cmath>
#include <numbers>

namespace farfield::metric::detail {

/// An angle as the two arguments of atan2, up to a common positive factor.
template <typename T>
struct AngleParts {
    T across = 0; ///< proportional to the sine, >= 0
    T along = 0;  ///< proportional to the cosine
};

/// pi where both parts vanish: atan2(0, 0) is 0 and would mean "no error".
template <typename T>
[[nodiscard]] T angle(const AngleParts<T>& parts) noexcept {
    const bool opposite = parts.across == T(0) && parts.along <= T(0);
    return opposite ? std::numbers::pi_v<T> : std::atan2(parts.across, parts.along);
}

} // namespace farfield::metric::detail
