#pragma once

#include <farfield/image/layered_warp.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

/// What samples of a layered depth image cover of a target, for both ways to draw them.
namespace farfield::detail {

/// [texel] Side of the tiles that are skipped as a whole.
inline constexpr std::int32_t kTile = 16;

/// Pixels that a sample covers, in 32 bits for the sake of caches: the first one's x and y, 14 bits
/// each, then width and height less one, 2 bits each.
using CoverCode = std::uint32_t;
inline constexpr int kPlaceBits = 14;
inline constexpr int kSideBits = 2;
inline constexpr std::int32_t kMostSide = 1 << kSideBits;
inline constexpr CoverCode kPlaceMask = (1U << kPlaceBits) - 1;
inline constexpr CoverCode kSideMask = kMostSide - 1;
/// None; and more than there are bits for. Of squares these would leave the largest target.
inline constexpr CoverCode kNothing = UINT32_MAX;
inline constexpr CoverCode kLarge = UINT32_MAX - 1;

/// Pixels [x0, x1) x [y0, y1), none where x0 >= x1 or y0 >= y1.
struct Covered {
    std::int32_t x0 = 0;
    std::int32_t x1 = 0;
    std::int32_t y0 = 0;
    std::int32_t y1 = 0;
};

/// Rows [lo, hi) of the target.
struct RowRange {
    std::int32_t lo = INT32_MAX;
    std::int32_t hi = 0;
};

inline void prefetch(const void* address) noexcept {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#else
    static_cast<void>(address);
#endif
}

/// A warp, for its tasks.
struct LayeredJob {
    const LayeredDepthImage& image;
    LayeredTerms terms{};
    std::int32_t width = 0; ///< of the target [px]
    std::int32_t height = 0;
    std::int32_t tiles_across = 0;
    std::int32_t tiles_up = 0;
    std::span<CoverCode> covered{};    ///< by sample
    std::span<float> depths{};         ///< by sample [m]; empty where nobody asks
    std::span<std::uint32_t> firsts{}; ///< of the samples of each texel, and their end
    std::span<RowRange> tiles{};       ///< what the samples of each tile reach
};

/// Rows of a target that one task draws.
struct Band {
    std::int32_t lo = 0; ///< first row
    std::int32_t hi = 0;
};

/// True if samples of the tile of a texel reach into a band.
[[nodiscard]] inline bool
reaches(const LayeredJob& job, std::int32_t column, std::int32_t row, const Band& band) noexcept {
    const std::int32_t number = row / kTile * job.tiles_across + column / kTile;
    const RowRange& tile = job.tiles[static_cast<std::size_t>(number)];
    return tile.lo < band.hi && tile.hi > band.lo;
}

/// What a code says. @pre code < kLarge
[[nodiscard]] inline Covered decoded(CoverCode code) noexcept {
    Covered covered;
    covered.x0 = static_cast<std::int32_t>(code & kPlaceMask);
    covered.y0 = static_cast<std::int32_t>(code >> kPlaceBits & kPlaceMask);
    covered.x1 = covered.x0 + 1 + static_cast<std::int32_t>(code >> (2 * kPlaceBits) & kSideMask);
    covered.y1 = covered.y0 + 1 + static_cast<std::int32_t>(code >> (2 * kPlaceBits + kSideBits));
    return covered;
}

/// What one sample covers, whatever its size.
[[nodiscard]] Covered cover(const LayeredJob& job, const LayeredSample& sample) noexcept;

/// Projects the samples of a row of tiles, and finds which rows of the target each tile reaches.
void project_tiles(const LayeredJob& job, std::int32_t tile_row) noexcept;

} // namespace farfield::detail
