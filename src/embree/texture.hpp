#pragma once

#include <farfield/scene/scene.hpp>

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace farfield::embree {

/// A texture with its chain of halved levels, down to one texel.
class MipTexture {
  public:
    /// Levels are made by averaging as encoded.
    explicit MipTexture(const Texture& texture);

    /// Trilinear, repeating.
    /// @param uv (0, 0) is the corner of the top left texel, (1, 1) of the bottom right one
    /// @param uv_dx, uv_dy steps of `uv` from a pixel to the next: their longer one, in texels,
    /// chooses the level
    /// @return [0, 255] each
    [[nodiscard]] glm::vec4
    sample(const glm::vec2& uv, const glm::vec2& uv_dx, const glm::vec2& uv_dy) const noexcept;

    [[nodiscard]] std::uint64_t bytes() const noexcept { return texels_.size() * 4; }

  private:
    struct Level {
        int width = 0;
        int height = 0;
        std::size_t first = 0; ///< into `texels_`
    };

    [[nodiscard]] glm::vec4 sample_level(const Level& level, const glm::vec2& uv) const noexcept;

    std::vector<Level> levels_;
    std::vector<glm::u8vec4> texels_;
};

} // namespace farfield::embree
