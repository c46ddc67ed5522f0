#pragma once

#include <farfield/image/region.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace farfield {

/// Packs rectangles into one square page and takes them back.
///
/// Rectangles stand on shelves; a shelf is as high as the first rectangle that opened it, rounded
/// up to a few texels, and prefers rectangles that use most of that height. Free runs of a shelf
/// join their neighbours; shelves that become empty join theirs. All storage is reserved at
/// construction: `allocate` and `release` never touch the heap.
///
/// @par Cost allocate: linear in shelves plus the runs of the chosen one; release: the same
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
    struct Run {
        std::int32_t x = 0;
        std::int32_t width = 0;
    };
    struct Shelf {
        std::int32_t y = 0;
        std::int32_t height = 0;
        std::uint32_t rectangles = 0; ///< standing on it; 0: the shelf is free
        std::vector<Run> free_runs;   ///< ordered by x, never adjacent
    };

    [[nodiscard]] std::int32_t widest_run(const Shelf& shelf) const noexcept;
    void insert_shelf(std::size_t position, std::int32_t y, std::int32_t height) noexcept;
    void erase_shelf(std::size_t position) noexcept;

    std::int32_t size_ = 0;
    std::size_t most_shelves_ = 0;
    std::uint32_t most_rectangles_ = 0; ///< on one shelf
    std::uint64_t used_texels_ = 0;
    std::vector<Shelf> shelves_;               ///< ordered by y, together the whole page
    std::vector<std::vector<Run>> spare_runs_; ///< storage of erased shelves, for reuse
};

} // namespace farfield
