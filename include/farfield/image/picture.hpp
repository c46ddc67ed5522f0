#pragma once

#include <cstdint>
#include <vector>

namespace farfield {

/// 8-bit sRGB-encoded RGBA picture in memory, not premultiplied: what is read from and written to
/// picture files and what image errors are measured on.
struct Picture {
    int width = 0;                  ///< [px]
    int height = 0;                 ///< [px]
    std::vector<std::uint8_t> rgba; ///< width * height * 4 bytes, rows from the top

    friend bool operator==(const Picture&, const Picture&) = default;
};

} // namespace farfield
