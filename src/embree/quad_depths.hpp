#pragma once

#include "embree/blend.hpp"
#include "embree/tile.hpp"

#include <cstdint>

namespace farfield::embree {

/// A quad owns pixels of at least this alpha.
inline constexpr std::uint32_t kHalfAlpha = 0xFF00 / 2;

/// What is done with the depths of a quad over the pixels of a tile. The results do not depend on
/// the instructions used.
struct QuadDepthWork {
    /// Finds `TileBuffer::quad_depths` for all pixels of a quad that stands by its plane or by its
    /// texels, at their centres.
    void (*find)(const TileQuad& quad, TileBuffer& tile) noexcept;

    /// Writes them into the depths of the tile where the whole pixel is covered and owned and
    /// nothing is before it. @pre `find` and `TileQuad::depths`
    void (*write)(const TileQuad& quad, TileBuffer& tile) noexcept;
};

/// One pixel after the other.
[[nodiscard]] QuadDepthWork portable_depth_work() noexcept;

/// The fastest one that this machine has.
[[nodiscard]] QuadDepthWork fastest_depth_work() noexcept;

} // namespace farfield::embree
