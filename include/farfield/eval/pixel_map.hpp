#pragma once

#include <optional>
#include <vector>

namespace farfield {

/// One number a pixel: a local error, a disparity. Not a number where nothing was measured;
/// infinity is a measured value.
struct PixelMap {
    int width = 0;             ///< [px]
    int height = 0;            ///< [px]
    std::vector<float> values; ///< width * height, rows from the top
};

namespace eval {

/// Mean of what was measured; none where nothing was.
[[nodiscard]] std::optional<double> mean(const PixelMap& map) noexcept;

} // namespace eval
} // namespace farfield
