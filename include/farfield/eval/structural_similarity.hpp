#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/pixel_map.hpp>
#include <farfield/image/picture.hpp>

namespace farfield::eval {

/// Side of the window that the similarity is measured in. [px]
inline constexpr int kSsimWindow = 11;

/// Structural similarity of two pictures around each pixel:
///
///     (2 mx my + C1) (2 sxy + C2) / ((mx^2 + my^2 + C1) (sxx + syy + C2))
///
/// with means, variances and covariance of luma in a window of 11x11 pixels weighted by a Gaussian
/// of 1.5 pixels, C1 = (0.01 * 255)^2 and C2 = (0.03 * 255)^2. Luma is 0.299 R + 0.587 G + 0.114 B
/// of the encoded colours, not rounded; alpha is not looked at. Symmetric. 1 where windows are
/// equal, and at most 1; near 0 where they have nothing in common; below where one is the negative
/// of the other.
///
/// Only windows that lie in the picture are measured: the 5 pixels along each edge are not a
/// number, and the figure that papers quote is `mean` of the rest.
///
/// It does not see colour: hues of equal luma are equal. In dark, flat areas differences far below
/// what can be seen lower it.
/// @return an error where a picture is smaller than the window on a side, its bytes do not fill its
/// size, or sizes differ
/// @par Source Wang, Bovik, Sheikh, Simoncelli, Image quality assessment: from error visibility to
/// structural similarity, 2004, section III.
[[nodiscard]] Result<PixelMap> ssim_map(const Picture& reference, const Picture& picture);

} // namespace farfield::eval
