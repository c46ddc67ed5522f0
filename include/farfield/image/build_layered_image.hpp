#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/image/position_picture.hpp>
#include <farfield/math/view.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <cstdint>
#include <span>

namespace farfield {

/// One of the pictures that a layered depth image is made of, as backends with positions give it.
struct ConstructionView {
    View view;
    Picture colors;            ///< of the size of the view, rows from the top
    PositionPicture positions; ///< likewise; where no surface is, there are no samples
};

/// The defaults, for nine views, placed as those of the paper, of balls in a room: from eyes up to
/// a fifth of the nearest depth away less than 0.1 % of the pixels are holes, 2.6 % with one view,
/// and silhouettes grow by half a texel. A texel has 1.8 samples.
struct LayeredImageOptions {
    /// How far a sample may be from one that is kept, for both to be taken for one: along both axes
    /// of the image in pixels of the view that the kept one is from, along its ray in sides of its
    /// square, less `overlap`. From 1 on a view would merge its own. [0, 0.75]
    float merge_distance = 0.5F;
    /// Sides of squares, over the distance of neighbours. 1 leaves gaps where the view is turned
    /// against the texels; larger ones grow silhouettes by half of what they add. [1, 4]
    float overlap = 1.125F;
    /// Of a surface that a view sees at a slant, neighbours are farther apart than pixels are wide:
    /// squares grow by as much, but by no more than this factor. Of what is steeper more samples
    /// are kept, of views that see it better. Larger ones need fewer samples, and grow silhouettes,
    /// for there all round things are steep. [1, 16]
    float most_stretch = 1.25F;
    /// Fills `LayeredDepthImage::points`.
    bool keep_points = false;
};

/// What became of the pixels of the construction views: `seen` is the sum of the next four.
struct LayeredImageQuality {
    std::uint64_t seen = 0;    ///< pixels that show a surface
    std::uint64_t samples = 0; ///< of them, in the image
    std::uint64_t merged = 0;  ///< explained by a sample that is
    std::uint64_t outside = 0; ///< not in the window of the central view, or not between its planes
    std::uint64_t crowded = 0; ///< left out of texels that had 255, the farthest ones
    std::uint32_t most_layers = 0; ///< in one texel
    double mean_layers = 0.0;      ///< of the texels that have any
};

struct BuiltLayeredImage {
    LayeredDepthImage image;
    LayeredImageQuality quality;
};

/// Brings pictures of several eyes together in the texels of one.
///
/// Views are taken by the distance of their eyes from the central one, the nearest first, ties as
/// listed. Each pixel that shows a surface is a sample, unless one that is kept already explains
/// it: one in the same texel, or in one of the three that are nearest, no farther off than
/// `merge_distance` says. So what the central view sees stays as it sees it, and others add what is
/// hidden from it, or slanted too much.
///
/// The square of a sample is as wide as neighbours on its surface are apart in its own view (the
/// larger of both axes, by points that lie on a straight line nearly), but at least a pixel and at
/// most `most_stretch` pixels; times `overlap`.
///
/// @param central eye and window of the image, at most 4096 texels a side; what is not between its
/// near and far plane is left out. Depths of the image reach as far as its samples do.
/// @param item_frames where points of every item are in the world, as `farfield::item_frames`
/// @return an image that passes `validate`, the same on every run; an error that names the view,
/// the pixel or the option and its value
/// @par Cost linear in pixels, some 50 ns each
/// @par Source Aliaga and Lastra 1999, section 4.1, for the views and their order
[[nodiscard]] Result<BuiltLayeredImage> build_layered_image(
    const View& central,
    std::span<const ConstructionView> views,
    std::span<const glm::dmat4x3> item_frames,
    const LayeredImageOptions& options = {}
);

} // namespace farfield
