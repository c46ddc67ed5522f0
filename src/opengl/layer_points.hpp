#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/layered_depth_image.hpp>

#include <epoxy/gl.h>
#include <glm/vec2.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace farfield::opengl {

/// What drawing layered images writes.
enum class LayerOutput : std::uint8_t {
    colors,
    sampled_colors, ///< into a target of several samples
    positions,      ///< colours, points and layers
};
inline constexpr std::size_t kLayerOutputs = 3;

/// Version and definitions that the shaders of an output begin with.
[[nodiscard]] std::string layer_head(LayerOutput output);

/// Draws layered depth images as points on the device, one for each sample.
///
/// A point has a whole number of pixels a side and stands on whole pixels, so that what a sample
/// covers is decided in the shader, by the formulas of `LayeredTerms`, and not by how a device
/// rounds or clamps points. Pixels of a point that its sample does not cover are discarded.
class LayerPoints {
  public:
    /// What the device has of an image.
    struct Buffers {
        GLuint array = 0;
        GLuint samples = 0;
        GLuint points = 0; ///< 0: none are kept
        GLsizei count = 0;
        std::uint16_t most_extent = 0; ///< of its samples [1/256]
        std::uint16_t nearest = 0;     ///< greatest depth of its samples [step]
    };

    LayerPoints() = default;
    ~LayerPoints();
    LayerPoints(const LayerPoints&) = delete;
    LayerPoints& operator=(const LayerPoints&) = delete;

    /// Makes what draws, unless it is there.
    [[nodiscard]] Result<void> require(LayerOutput output);

    /// @param positions uploads the points as well, if there are any
    [[nodiscard]] static Result<Buffers> upload(const LayeredDepthImage& image, bool positions);
    static void destroy(Buffers& buffers) noexcept;

    /// Draws into what is bound, where the drawing state is that of geometry.
    /// @param image of which only the view and the depths are looked at
    /// @param places of the samples of a pixel, within it, at most `CellDrawer::kMostSamples`
    /// @pre the output was required
    void draw(
        const LayeredDepthImage& image,
        const Buffers& buffers,
        std::uint32_t node,
        const Pass& pass,
        std::span<const glm::dvec2> places,
        LayerOutput output
    ) const noexcept;

  private:
    std::array<GLuint, kLayerOutputs> programs_{}; ///< by output
    std::int32_t largest_ = 0;                     ///< point of the device [px]
};

} // namespace farfield::opengl
