#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/picture.hpp>

namespace farfield {

/// A part of a picture; x and y [px] from the top left.
struct PictureWindow {
    int x = 0;
    int y = 0;
    int width = 0;
    int height = 0;

    friend bool operator==(const PictureWindow&, const PictureWindow&) = default;
};

namespace eval {

/// The window of a given size in which two pictures differ most, by the sum of squared differences
/// of R, G and B; the uppermost and then leftmost of several. Where the pictures are smaller, the
/// window is.
/// @param width, height [px] >= 1
/// @return an error where a picture is empty, its bytes do not fill its size, sizes differ, or the
/// window has no pixel
/// @par Cost linear in pixels
[[nodiscard]] Result<PictureWindow>
most_different_window(const Picture& reference, const Picture& picture, int width, int height);

/// That part of a picture. @pre the window lies in the picture, whose bytes fill its size
[[nodiscard]] Picture crop(const Picture& picture, const PictureWindow& window);

} // namespace eval
} // namespace farfield
