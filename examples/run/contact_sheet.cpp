#include "run/contact_sheet.hpp"

#include <algorithm>
#include <cstddef>

namespace farfield::run {

Picture contact_sheet(std::span<const Picture> tiles, int columns) {
    constexpr int kGap = 8;
    const int width = tiles.front().width + kGap;
    const int height = tiles.front().height + kGap;
    const int rows = (static_cast<int>(tiles.size()) + columns - 1) / columns;
    Picture sheet{columns * width + kGap, rows * height + kGap, {}};
    sheet.rgba.assign(
        static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height) * 4, 255
    );
    for (std::size_t tile = 0; tile < tiles.size(); ++tile) {
        const int left = kGap + static_cast<int>(tile) % columns * width;
        const int top = kGap + static_cast<int>(tile) / columns * height;
        const std::ptrdiff_t row_bytes = std::ptrdiff_t{4} * tiles[tile].width;
        for (int y = 0; y < tiles[tile].height; ++y) {
            std::copy_n(
                tiles[tile].rgba.begin() + y * row_bytes,
                row_bytes,
                sheet.rgba.begin() + ((top + y) * std::ptrdiff_t{sheet.width} + left) * 4
            );
        }
    }
    return sheet;
}

} // namespace farfield::run
