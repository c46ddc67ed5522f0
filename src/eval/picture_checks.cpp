#include "picture_checks.hpp"

#include <cstddef>

namespace farfield::eval::detail {

namespace {

/// @param of elements a pixel, @param unit what the elements are called
Result<void> check_size(
    const char* what, int width, int height, std::size_t held, std::size_t of, const char* unit
) {
    if (width < 1 || height < 1) {
        return fail(
            ErrorCode::invalid_argument,
            std::string(what) + " is " + size_text(width, height) + " pixels, expected at least 1x1"
        );
    }
    const std::size_t expected =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * of;
    if (held != expected) {
        return fail(
            ErrorCode::invalid_argument,
            std::string(what) + " of " + size_text(width, height) + " pixels holds " +
                std::to_string(held) + " " + unit + ", expected " + std::to_string(expected)
        );
    }
    return {};
}

} // namespace

std::string size_text(int width, int height) {
    return std::to_string(width) + "x" + std::to_string(height);
}

Result<void> check(const char* what, const Picture& picture) {
    return check_size(what, picture.width, picture.height, picture.rgba.size(), 4, "bytes");
}

Result<void> check(const char* what, const CoverageMask& mask) {
    return check_size(what, mask.width, mask.height, mask.covered.size(), 1, "bytes");
}

Result<void> check(const char* what, const PixelMap& map) {
    return check_size(what, map.width, map.height, map.values.size(), 1, "values");
}

Result<void> check(const char* what, const PositionPicture& picture) {
    return check_size(what, picture.width, picture.height, picture.texels.size(), 1, "texels");
}

} // namespace farfield::eval::detail
