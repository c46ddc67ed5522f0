#include "eval/picture_checks.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/eval/crop.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace farfield::eval {

Result<PictureWindow>
most_different_window(const Picture& reference, const Picture& picture, int width, int height) {
    if (Result<void> alike = detail::check_pair("reference", reference, "picture", picture);
        !alike) {
        return tl::unexpected(std::move(alike).error());
    }
    if (width < 1 || height < 1) {
        return fail(
            ErrorCode::invalid_argument,
            "window of " + std::to_string(width) + " x " + std::to_string(height) +
                " pixels, expected at least 1 x 1"
        );
    }
    // sums[y][x]: of all squared differences above and to the left.
    const auto columns = static_cast<std::size_t>(picture.width);
    const auto rows = static_cast<std::size_t>(picture.height);
    const std::size_t stride = columns + 1;
    std::vector<std::uint64_t> sums(stride * (rows + 1), 0);
    for (std::size_t y = 0; y < rows; ++y) {
        std::uint64_t row = 0;
        for (std::size_t x = 0; x < columns; ++x) {
            const std::size_t first = (y * columns + x) * 4;
            for (std::size_t channel = first; channel < first + 3; ++channel) {
                const int difference = reference.rgba[channel] - picture.rgba[channel];
                row += static_cast<std::uint64_t>(difference * difference);
            }
            sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + row;
        }
    }
    const std::size_t wide = std::min(static_cast<std::size_t>(width), columns);
    const std::size_t high = std::min(static_cast<std::size_t>(height), rows);
    PictureWindow worst{0, 0, static_cast<int>(wide), static_cast<int>(high)};
    std::uint64_t most = 0;
    for (std::size_t y = 0; y + high <= rows; ++y) {
        for (std::size_t x = 0; x + wide <= columns; ++x) {
            const std::size_t above = y * stride + x;
            const std::size_t below = (y + high) * stride + x;
            const std::uint64_t sum =
                sums[below + wide] - sums[below] - sums[above + wide] + sums[above];
            if (sum > most) {
                most = sum;
                worst.x = static_cast<int>(x);
                worst.y = static_cast<int>(y);
            }
        }
    }
    return worst;
}

Picture crop(const Picture& picture, const PictureWindow& window) {
    FARFIELD_ASSERT(
        window.x >= 0 && window.y >= 0 && window.x + window.width <= picture.width &&
        window.y + window.height <= picture.height
    );
    Picture part{window.width, window.height, {}};
    part.rgba.reserve(
        static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height) * 4
    );
    for (int y = window.y; y < window.y + window.height; ++y) {
        const auto first =
            picture.rgba.begin() + (static_cast<std::ptrdiff_t>(y) * picture.width + window.x) * 4;
        part.rgba.insert(part.rgba.end(), first, first + std::ptrdiff_t{window.width} * 4);
    }
    return part;
}

} // namespace farfield::eval
