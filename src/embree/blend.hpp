#pragma once

#include "embree/tile.hpp"

#include <cstddef>
#include <cstdint>

namespace farfield::embree {

/// An image quad over one tile. With x and y [px] from the centre of the tile's first pixel, its
/// own coordinates [texel] are (u + u_x x + u_y y) / (w + w_x x + w_y y), and likewise v.
struct TileQuad {
    float u = 0.0F;
    float u_x = 0.0F;
    float u_y = 0.0F;
    float v = 0.0F;
    float v_x = 0.0F;
    float v_y = 0.0F;
    float w = 0.0F;
    float w_x = 0.0F;
    float w_y = 0.0F;
    float width = 0.0F;  ///< of the source [texel]
    float height = 0.0F; ///< [texel]
    /// Pixels so far from an end of the quad are left out: none of their samples is beyond it.
    float rim_u = 0.0F;                    ///< [texel]
    float rim_v = 0.0F;                    ///< [texel]
    const std::uint32_t* texels = nullptr; ///< of the page; a texel beyond each end may be read
    std::int32_t page_size = 0;            ///< [texel]
    std::int32_t first_u = 0;              ///< of the source in the page [texel]
    std::int32_t first_v = 0;
    QuadDepth stands = QuadDepth::none;
    float depth = 0.0F; ///< of the whole quad, standing by none, or
    /// of its pixels, by `tile_pixel`; null: of the whole quad.
    const float* depths = nullptr;
    /// Standing by its texels: of the page; a texel beyond each end may be read.
    const std::uint16_t* kept = nullptr;
    float viewpoint_depth = 0.0F; ///< of the eye that made the image [m]
    float near_ratio = 1.0F;      ///< as of `ImageQuad`
    float far_ratio = 1.0F;
    float nearest = 0.0F; ///< depths that count, unless it stands by none [m]
    float farthest = 0.0F;
    std::uint32_t order = 0;
    std::int32_t left = 0; ///< [px] of the tile
    std::int32_t right = 0;
    std::int32_t bottom = 0;
    std::int32_t top = 0;
};

/// Where a quad stands at a pixel.
[[nodiscard]] inline float depth_at(const TileQuad& quad, std::size_t pixel) noexcept {
    return quad.depths == nullptr ? quad.depth : quad.depths[pixel];
}

/// Place of a filtered texel: the lower left of the four and the weights of the others, of 65536.
struct TexelPlace {
    std::int32_t x = 0;
    std::int32_t y = 0;
    std::uint32_t share_x = 0;
    std::uint32_t share_y = 0;
};

/// @param u, v [texel] of the quad's source
[[nodiscard]] TexelPlace texel_place(const TileQuad& quad, float u, float v) noexcept;

/// Bilinear, with weights of 8 bits.
[[nodiscard]] Color16 filtered(const TileQuad& quad, const TexelPlace& place) noexcept;

/// Premultiplied over.
void blend(const Color16& source, Color16& target) noexcept;

/// Blends a quad over the pixels of a tile that it covers and nothing hides. The result does not
/// depend on the instructions used.
using BlendQuad = void (*)(const TileQuad& quad, TileBuffer& tile) noexcept;

/// One pixel after the other.
void blend_quad_portable(const TileQuad& quad, TileBuffer& tile) noexcept;

/// The fastest one that this machine has.
[[nodiscard]] BlendQuad fastest_blend_quad() noexcept;

} // namespace farfield::embree
