#pragma once

#include <farfield/core/result.hpp>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace farfield::io {

/// 16-bit samples, rows from the top.
struct GreyImage {
    std::uint64_t width = 0;
    std::uint64_t height = 0;
    std::vector<std::uint16_t> samples;
};

/// Exact samples of a 16-bit greyscale PNG; no gamma is applied.
[[nodiscard]] Result<GreyImage>
decode_grey16(std::string_view bytes, const std::string& name, std::uint64_t max_samples);

} // namespace farfield::io
