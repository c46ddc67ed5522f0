#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/pixel_map.hpp>
#include <farfield/image/picture.hpp>

namespace farfield {

/// From where the pictures are looked at.
struct FlipOptions {
    /// Pixels in a degree of the observer's view: pi / 180 times the distance to the screen in
    /// pixels. 67 is a screen of 3840 pixels seen from as far as it is wide. [1, 1000]
    double pixels_per_degree = 67.0;
};

namespace eval {

/// How different each pixel looks to someone who alternates between the pictures: 0 is the same, 1
/// the largest difference that a screen can show. Its `mean` is the figure to quote. Symmetric;
/// alpha is not looked at.
///
/// Both pictures are blurred as the eye blurs them, each of three opponent colour channels by its
/// own contrast sensitivity; the distance of the blurred colours (HyAB, of Hunt-adjusted L*a*b*) is
/// compressed to [0, 1] and raised to the power of 1 less the difference in edges and points found
/// in the unblurred luminance. Filters reach up to 0.135 degrees; pixels beyond an edge repeat it.
///
/// It knows nothing of motion: a difference that only flickers, or that moves with the eye, counts
/// as one that stands still.
/// @return an error where a picture is empty, its bytes do not fill its size, sizes differ, or an
/// option is out of range
/// @par Cost pixels * pixels_per_degree
/// @par Source Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild, FLIP: A
/// difference evaluator for alternating images, 2020, section 4, with its erratum (luminance is
/// brought to [0, 1] by a division by 116). The weights of the two Gaussians of the blue-yellow
/// channel are those of the authors' programs, a sqrt(pi / b) in two dimensions as well.
[[nodiscard]] Result<PixelMap>
flip_map(const Picture& reference, const Picture& picture, const FlipOptions& options = {});

} // namespace eval
} // namespace farfield
