#pragma once

#include <farfield/image/region.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace farfield {

/// Packs rectangles into one square page and takes them back.
///
/// The page is a bitmap of cells of 4 x 4 texels. A rectangle goes to the free place where most of
/// its rim touches others or the border of the page, the lowest and then leftmost of several.
/// Nothing else is remembered, so whatever was released is free again in whichever shape. All
/// storage is reserved at construction: `allocate` and `release` never touch the heap.
///
/// Sizes are rounded up to whole cells. Rectangles of 5 to 120 texels that come and go at random
/// fill about two thirds of a page of 1024 before the first one finds no place, those of 5 to 30
/// texels more than three quarters.
///
/// @par Cost allocate: size^2 log(width height) / 1024 word operations, some microseconds at 1024
/// texels; release: the rows of the rectangle
class Atlas {
  public:
    /// @param size [texel] width and height of the page, 1 to 16384
    explicit Atlas(std::int32_t size);

    /// A free place for a rectangle, or nothing when the page has none.
    /// @param width, height [texel] at least 1
    [[nodiscard]] std::optional<Region> allocate(std::int32_t width, std::int32_t height) noexcept;

    /// Gives a rectangle back. @pre it came from `allocate` and was not released since
    void release(const Region& region) noexcept;

    /// Forgets every rectangle.
    void clear() noexcept;

    [[nodiscard]] std::int32_t size() const noexcept { return size_; }
    [[nodiscard]] std::uint64_t used_texels() const noexcept { return used_texels_; }
    [[nodiscard]] bool empty() const noexcept { return used_texels_ == 0; }

  private:
    /// A rectangle of cells.
    struct Cells {
        std::int32_t x = 0;
        std::int32_t y = 0;
        std::int32_t width = 0;
        std::int32_t height = 0;
    };

    struct Size {
        std::int32_t width = 0;
        std::int32_t height = 0;
    };

    [[nodiscard]] static Cells cells_of(const Region& region) noexcept;
    void find_blocked(const Cells& wanted) noexcept;
    [[nodiscard]] std::int32_t touching(const Cells& cells, std::int32_t enough) const noexcept;
    [[nodiscard]] std::int32_t
    taken_in_row(std::int32_t y, std::int32_t x, std::int32_t width) const noexcept;
    void mark(const Cells& cells, bool taken) noexcept;
    void remember_refusal(const Size& size) noexcept;

    std::int32_t size_ = 0;
    std::int32_t side_ = 0; ///< [cell] of the page
    std::size_t words_ = 0; ///< of a row of cells
    std::uint64_t used_texels_ = 0;
    std::uint64_t free_cells_ = 0;
    /// Sizes that found no place since the last release; what is as large in both ways will not
    /// either. A full page is asked for every image before another one is.
    std::array<Size, 8> refused_;
    std::ptrdiff_t refused_count_ = 0;
    std::vector<std::uint64_t> taken_;   ///< a bit a cell, row by row
    std::vector<std::uint64_t> blocked_; ///< scratch: lower left cells where there is no room
};

} // namespace farfield
