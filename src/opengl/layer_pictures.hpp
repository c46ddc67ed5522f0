#pragma once

#include "opengl/layer_points.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/image/layered_warp.hpp>

#include <epoxy/gl.h>
#include <glm/ext/vector_int2.hpp>
#include <glm/ext/vector_uint2.hpp>
#include <glm/ext/vector_uint4.hpp>
#include <glm/vec2.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace farfield::opengl {

/// Draws layered depth images that the processor warps, as pictures with depth. Of several samples
/// a pixel each has a picture of its own.
class LayerPictures {
  public:
    /// @param executor shares the work of warping; must outlive this. Null: it is done alone
    explicit LayerPictures(Executor* executor) noexcept : executor_(executor) {}
    ~LayerPictures();
    LayerPictures(const LayerPictures&) = delete;
    LayerPictures& operator=(const LayerPictures&) = delete;

    /// Makes what draws, unless it is there.
    [[nodiscard]] Result<void> require(LayerOutput output);

    /// Warps and draws into what is bound, where the drawing state is that of geometry.
    /// @param places of the samples of a pixel, within it, at most `CellDrawer::kMostSamples`
    /// @pre the output was required
    void draw(
        const LayeredDepthImage& image,
        std::uint32_t node,
        const Pass& pass,
        std::span<const glm::dvec2> places,
        LayerOutput output
    );

  private:
    void reserve(const View& view, bool positions) noexcept;
    void upload() const noexcept;
    void find_points(const LayeredDepthImage& image, const View& view, std::uint32_t node);

    Executor* executor_; ///< or null
    SerialExecutor serial_;
    LayeredWarper warper_;
    WarpedLayers warped_;
    std::array<GLuint, kLayerOutputs> programs_{}; ///< by output
    GLuint array_ = 0;                             ///< of no attributes
    GLuint colors_ = 0;
    GLuint depths_ = 0; ///< [m]
    GLuint points_ = 0;
    GLuint layers_ = 0;
    glm::ivec2 size_{0}; ///< of the textures [texel]
    std::vector<glm::uvec4> point_texels_;
    std::vector<glm::uvec2> layer_texels_;
};

} // namespace farfield::opengl
