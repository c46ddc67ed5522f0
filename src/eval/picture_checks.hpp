#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/pixel_map.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/image/position_picture.hpp>

#include <string>

namespace farfield::eval::detail {

/// "640x480"
[[nodiscard]] std::string size_text(int width, int height);

/// Not empty, and the array fills the size. @param what names it in the message
[[nodiscard]] Result<void> check(const char* what, const Picture& picture);
[[nodiscard]] Result<void> check(const char* what, const CoverageMask& mask);
[[nodiscard]] Result<void> check(const char* what, const PixelMap& map);
[[nodiscard]] Result<void> check(const char* what, const PositionPicture& picture);

/// Both are sound and of one size.
template <typename A, typename B>
[[nodiscard]] Result<void>
check_pair(const char* a_name, const A& a, const char* b_name, const B& b) {
    if (auto checked = check(a_name, a); !checked) {
        return checked;
    }
    if (auto checked = check(b_name, b); !checked) {
        return checked;
    }
    if (a.width != b.width || a.height != b.height) {
        return fail(
            ErrorCode::invalid_argument,
            std::string(b_name) + " is " + size_text(b.width, b.height) + " pixels, " + a_name +
                " is " + size_text(a.width, a.height)
        );
    }
    return {};
}

} // namespace farfield::eval::detail
