#pragma once

#include "embree/frame_work.hpp"
#include <farfield/image/position_picture.hpp>

#include <glm/vec2.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace farfield::embree {

inline constexpr std::size_t kTilePixels = static_cast<std::size_t>(kTile) * kTile;

/// Position of a pixel in the arrays of a tile.
[[nodiscard]] constexpr std::size_t tile_pixel(std::int32_t column, std::int32_t row) noexcept {
    return static_cast<std::size_t>(row) * kTile + static_cast<std::size_t>(column);
}

/// RGBA, premultiplied, with 8 bits behind the point: 0xFF00 is 1.
using Color16 = std::array<std::uint16_t, 4>;
inline constexpr float kColor16 = 0xFF00;

/// What a tile shows so far, by `tile_pixel`.
struct TileBuffer {
    alignas(64) std::array<Color16, kTilePixels> colors{};
    /// Distance along the view direction [m]. Of a mixed pixel less than any, so that what goes by
    /// whole pixels leaves it alone.
    alignas(64) std::array<float, kTilePixels> depths{};
    /// Of the quad that is drawn, where its pixels have their own. [m]
    alignas(64) std::array<float, kTilePixels> quad_depths{};
    /// Order of the command that the pixel shows; 0: from before the phase.
    alignas(64) std::array<std::uint32_t, kTilePixels> orders{};
    /// Whether the samples of a pixel differ; then they are what counts.
    std::array<std::uint8_t, kTilePixels> mixed{};
    bool any_mixed = false;
    std::vector<Color16> sample_colors; ///< those of a pixel lie together
    std::vector<float> sample_depths;
    std::vector<std::uint32_t> sample_orders;
    std::vector<PositionTexel> positions; ///< empty: none are kept

    /// Gives each sample of a pixel what the pixel has.
    void mix(std::size_t pixel, std::size_t samples) noexcept;
};

/// What a thread needs to draw tiles.
struct Workspace {
    TileBuffer tile;
    std::vector<std::uint32_t> listed; ///< draws that a tile may show
    std::vector<float> tangents_x;     ///< of every sample of every column
    std::vector<float> tangents_y;     ///< of every sample of every row

    /// Makes room; drawing never allocates.
    void reserve(std::size_t draws, std::size_t samples, bool positions);
};

/// Draws one tile from beginning to end.
/// @param places of the samples of a pixel
void draw_tile(
    const CastScene& scene,
    const FrameWork& work,
    const TileTask& task,
    std::span<const glm::vec2> places,
    Workspace& workspace
) noexcept;

/// The part of a phase's geometry.
void cast_tile(
    const CastScene& scene,
    const FrameWork& work,
    const TileTask& task,
    const Phase& phase,
    std::span<const glm::vec2> places,
    Workspace& workspace
) noexcept;

/// Adds the layered images of a phase to what was cast.
/// @param samples of a pixel
void add_layers(
    const FrameWork& work,
    const TileTask& task,
    const Phase& phase,
    std::size_t samples,
    TileBuffer& tile
) noexcept;

/// The part of a phase's images, splats and cubes.
/// @param next_flat of those that the tile lists: the first that is not yet drawn
void blend_tile(
    const FrameWork& work,
    const TileTask& task,
    const Phase& phase,
    std::span<const glm::vec2> places,
    std::uint32_t& next_flat,
    TileBuffer& tile
) noexcept;

/// Blends a splat or a face over what nothing hides it in. A splat of at least half an alpha owns
/// its pixel, and of its points nothing is known.
void blend_flat(
    const FrameWork& work,
    const TileTask& task,
    const Flat& flat,
    std::span<const glm::vec2> places,
    TileBuffer& tile
) noexcept;

} // namespace farfield::embree
