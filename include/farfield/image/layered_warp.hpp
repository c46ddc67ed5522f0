#pragma once

#include <farfield/core/executor.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/math/view.hpp>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <memory>
#include <vector>

namespace farfield {

/// How samples of a layered depth image look from another eye: worked out in double once for an
/// image and a view, and said alike by all that warp.
///
/// A sample (x, y, depth, extent) is seen at (X / W, Y / W) [px from the lower left corner of the
/// view's window], `z` along the view direction, as a square with sides of `side`:
///
///     (X, Y, W) = columns[0] x + columns[1] y + columns[2] depth + columns[3]
///     z = W / (inverse_step depth + inverse_far)  [m]
///     side = extent size / W                      [px]
///
/// It covers the pixels whose centres are inside of the square, its left and lower edges included.
/// What is nearer than the near plane of the view or farther than the far one is not drawn.
struct LayeredTerms {
    glm::mat4x3 columns{0.0F};
    float inverse_step = 0.0F; ///< [1/m] a step of depth
    float inverse_far = 0.0F;  ///< [1/m] of step 0
    /// [px m] of one step of extent: where texels or pixels are not square, of their longer sides.
    float size = 0.0F;
    float near_distance = 0.0F; ///< [m] of the view
    float far_distance = 0.0F;  ///< [m]
};

/// @par Cost constant, some 100 operations
[[nodiscard]] LayeredTerms layered_terms(const LayeredDepthImage& image, const View& view) noexcept;

/// What warping gives: colours and depths, rows from below.
struct WarpedLayers {
    std::int32_t width = 0;
    std::int32_t height = 0;
    std::vector<glm::vec<4, std::uint8_t>> colors; ///< alpha 0 where nothing is
    std::vector<float> depths;          ///< [m] along the view direction; infinite where nothing is
    std::vector<std::uint32_t> samples; ///< which one is shown, `UINT32_MAX`: none; or empty
};

/// How a warp tells which sample of a pixel is in front.
enum class LayeredFront : std::uint8_t {
    /// By the order in which texels are drawn, that of McMillan in another form: no depths are kept
    /// or compared.
    ///
    /// The eye of the view is seen somewhere in the image, at the epipole. Along every ray of that
    /// eye what is farther is farther from the epipole too, or nearer to it where the eye is behind
    /// that of the image. So square rings of texels around the epipole are drawn one after the
    /// other.
    ///
    /// Of two samples of one pixel the nearer one is shown unless they are nearly as far: unless
    /// the points at their depths on the ray of the pixel are, seen from the image's eye, no more
    /// than 2 texels farther apart than either point is from its sample, both added up. Distances
    /// here are the larger of those along x and y. Of samples on one ray of the image's eye, in a
    /// texel that has no others, the nearer one is shown.
    ///
    /// Blind spot: for eyes that see less than 2 texels of parallax, what is hidden may show
    /// through at every pixel of what hides it, if it is of views from elsewhere: then it does not
    /// stand in the middle of its texel, and overlaps all neighbours.
    /// @par Source McMillan 1997, An image-based approach to three-dimensional computer graphics,
    /// chapter 3. The sheets there, parted by row and column of the epipole, order points; but of
    /// squares on neighbouring rays, which overlap, they may show either, whatever the depths.
    order,
    /// By depths: the nearest sample is shown, of equals the first in the image. As fast.
    depth,
};

/// Warps layered depth images on the processor.
class LayeredWarper {
  public:
    LayeredWarper();
    ~LayeredWarper();
    LayeredWarper(LayeredWarper&&) noexcept;
    LayeredWarper& operator=(LayeredWarper&&) noexcept;

    /// @param executor shares the work; the result does not depend on it
    /// @param keep_samples fills `WarpedLayers::samples`
    /// @param front how what is in front is told
    /// @pre validate(image), validate(view)
    /// @par Cost linear in samples, texels and pixels; allocates nothing once warm
    void warp(
        const LayeredDepthImage& image,
        const View& view,
        Executor& executor,
        WarpedLayers& warped,
        bool keep_samples = false,
        LayeredFront front = LayeredFront::depth
    ) noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield
