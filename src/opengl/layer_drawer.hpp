#pragma once

#include "opengl/layer_pictures.hpp"
#include "opengl/layer_points.hpp"
#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/opengl/opengl_backend.hpp>

#include <glm/vec2.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace farfield::opengl {

/// Keeps layered depth images and draws them, in the way that the options say.
class LayerDrawer {
  public:
    explicit LayerDrawer(const OpenGLBackendOptions& options) noexcept;
    ~LayerDrawer();
    LayerDrawer(const LayerDrawer&) = delete;
    LayerDrawer& operator=(const LayerDrawer&) = delete;

    /// Takes over a copy, in the place of one that is there, or drops one.
    [[nodiscard]] Result<void> update(std::uint32_t cache, const LayeredUpdate& update);

    [[nodiscard]] bool has(std::uint32_t cache, LayeredImageId image) noexcept {
        return find(cache, image) != nullptr;
    }

    /// Makes what draws into a target of one sample or of several, unless it is there.
    [[nodiscard]] Result<void> require(bool sampled);

    /// Draws a command into what is bound, where the drawing state is that of geometry.
    /// @param places of the samples of a pixel
    /// @pre its images are there, and what the target needs was required
    void draw(
        const FramePlan& plan,
        const Pass& pass,
        const Command& command,
        std::span<const glm::dvec2> places
    );

    [[nodiscard]] std::uint64_t bytes() const noexcept;
    [[nodiscard]] std::uint64_t position_bytes() const noexcept;

  private:
    struct Image {
        std::uint32_t cache = 0;
        LayeredImageId id = kNone<LayeredImageId>;
        std::uint64_t bytes = 0;
        std::uint64_t position_bytes = 0;
        LayerPoints::Buffers buffers; ///< drawing points, and then
        LayeredDepthImage content;    ///< has no arrays
    };

    [[nodiscard]] Image* find(std::uint32_t cache, LayeredImageId image) noexcept;
    [[nodiscard]] LayerOutput output(bool sampled) const noexcept;

    bool positions_ = false;
    bool warps_ = false;
    LayerPoints points_;
    LayerPictures pictures_;
    std::vector<Image> images_;
};

} // namespace farfield::opengl
