#include <farfield/eval/pixel_map.hpp>

#include <cmath>
#include <cstdint>

namespace farfield::eval {

std::optional<double> mean(const PixelMap& map) noexcept {
    double sum = 0.0;
    std::uint64_t measured = 0;
    for (const float value : map.values) {
        if (!std::isnan(value)) {
            sum += static_cast<double>(value);
            ++measured;
        }
    }
    if (measured == 0) {
        return std::nullopt;
    }
    return sum / static_cast<double>(measured);
}

} // namespace farfield::eval
