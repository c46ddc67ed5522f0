#include <farfield/core/assert.hpp>
#include <farfield/image/atlas.hpp>

#include <algorithm>
#include <bit>

namespace farfield {

namespace {

constexpr std::int32_t kCell = 4; // [texel]
constexpr std::int32_t kWordBits = 64;

constexpr std::int32_t cells_for(std::int32_t texels) noexcept {
    return (texels + kCell - 1) / kCell;
}

/// Bits `first` to `last` of a word, both included.
constexpr std::uint64_t bit_range(std::int32_t first, std::int32_t last) noexcept {
    return (~std::uint64_t{0} << static_cast<unsigned>(first)) &
           (~std::uint64_t{0} >> static_cast<unsigned>(kWordBits - 1 - last));
}

/// Calls `visit(word index, mask)` for the words that hold bits `x` to `x + width - 1` of a row.
template <typename Visit>
void for_each_word(std::int32_t x, std::int32_t width, const Visit& visit) noexcept {
    const std::int32_t last = x + width - 1;
    for (std::int32_t word = x / kWordBits; word <= last / kWordBits; ++word) {
        const std::int32_t begin = word * kWordBits;
        visit(
            static_cast<std::size_t>(word),
            bit_range(std::max(x - begin, 0), std::min(last - begin, kWordBits - 1))
        );
    }
}

/// bits |= bits moved by `step` towards bit 0, all words taken as one number.
void smear(std::vector<std::uint64_t>& bits, std::int32_t step) noexcept {
    const auto jump = static_cast<std::size_t>(step / kWordBits);
    const auto shift = static_cast<unsigned>(step % kWordBits);
    const std::size_t words = bits.size() - jump;
    // What is read has not been changed yet: it is at or above what is written.
    if (shift == 0) {
        for (std::size_t i = 0; i < words; ++i) {
            bits[i] |= bits[i + jump];
        }
        return;
    }
    for (std::size_t i = 0; i + 1 < words; ++i) {
        bits[i] |= bits[i + jump] >> shift | bits[i + jump + 1] << (kWordBits - shift);
    }
    bits[words - 1] |= bits.back() >> shift;
}

} // namespace

Atlas::Atlas(std::int32_t size)
    : size_(size), side_(cells_for(size)),
      words_(static_cast<std::size_t>((side_ + kWordBits - 1) / kWordBits)),
      taken_(words_ * static_cast<std::size_t>(side_)), blocked_(taken_.size()) {
    FARFIELD_ASSERT(size >= 1);
    clear();
}

void Atlas::clear() noexcept {
    std::fill(taken_.begin(), taken_.end(), 0U);
    used_texels_ = 0;
    refused_count_ = 0;
    free_cells_ = static_cast<std::uint64_t>(side_) * static_cast<std::uint64_t>(side_);
}

Atlas::Cells Atlas::cells_of(const Region& region) noexcept {
    return {region.x / kCell, region.y / kCell, cells_for(region.width), cells_for(region.height)};
}

/// Marks in `blocked_` each cell where a rectangle of `wanted`'s size would meet a taken cell: an
/// OR over its rows, then over its columns, of twice as many with every step. Cells from where it
/// would leave the page hold nothing of use; only there do rows run into each other.
void Atlas::find_blocked(const Cells& wanted) noexcept {
    std::copy(taken_.begin(), taken_.end(), blocked_.begin());
    const auto row_bits = static_cast<std::int32_t>(words_) * kWordBits;
    for (std::int32_t done = 1; done < wanted.height; done *= 2) {
        smear(blocked_, std::min(done, wanted.height - done) * row_bits);
    }
    for (std::int32_t done = 1; done < wanted.width; done *= 2) {
        smear(blocked_, std::min(done, wanted.width - done));
    }
}

std::int32_t
Atlas::taken_in_row(std::int32_t y, std::int32_t x, std::int32_t width) const noexcept {
    const std::uint64_t* row = taken_.data() + static_cast<std::size_t>(y) * words_;
    std::int32_t count = 0;
    for_each_word(x, width, [&](std::size_t word, std::uint64_t mask) {
        count += std::popcount(row[word] & mask);
    });
    return count;
}

/// Length of the rim that touches taken cells or the border, or something less than `enough` where
/// it is less. [cell]
std::int32_t Atlas::touching(const Cells& cells, std::int32_t enough) const noexcept {
    const std::int32_t right = cells.x + cells.width;
    const std::int32_t top = cells.y + cells.height;
    std::int32_t count = 0;
    count += cells.y == 0 ? cells.width : taken_in_row(cells.y - 1, cells.x, cells.width);
    count += top == side_ ? cells.width : taken_in_row(top, cells.x, cells.width);
    if (count + 2 * cells.height < enough) {
        return count;
    }
    const auto column = [&](std::int32_t x) {
        const auto shift = static_cast<unsigned>(x % kWordBits);
        std::size_t word =
            static_cast<std::size_t>(cells.y) * words_ + static_cast<std::size_t>(x / kWordBits);
        std::uint64_t sum = 0;
        for (std::int32_t y = cells.y; y < top; ++y, word += words_) {
            sum += (taken_[word] >> shift) & 1U;
        }
        return static_cast<std::int32_t>(sum);
    };
    count += cells.x == 0 ? cells.height : column(cells.x - 1);
    count += right == side_ ? cells.height : column(right);
    return count;
}

/// Flips cells that must all be in the other state.
/// @param taken their new state
void Atlas::mark(const Cells& cells, [[maybe_unused]] bool taken) noexcept {
    for (std::int32_t y = cells.y; y < cells.y + cells.height; ++y) {
        std::uint64_t* row = taken_.data() + static_cast<std::size_t>(y) * words_;
        for_each_word(cells.x, cells.width, [&](std::size_t word, std::uint64_t mask) {
            FARFIELD_ASSERT((row[word] & mask) == (taken ? 0U : mask));
            row[word] ^= mask;
        });
    }
}

std::optional<Region> Atlas::allocate(std::int32_t width, std::int32_t height) noexcept {
    FARFIELD_ASSERT(width >= 1 && height >= 1);
    if (width > size_ || height > size_) {
        return std::nullopt;
    }
    Cells cells{0, 0, cells_for(width), cells_for(height)};
    const auto count =
        static_cast<std::uint64_t>(cells.width) * static_cast<std::uint64_t>(cells.height);
    const bool hopeless =
        std::any_of(refused_.begin(), refused_.begin() + refused_count_, [&](const Size& refused) {
            return width >= refused.width && height >= refused.height;
        });
    if (hopeless || count > free_cells_) {
        return std::nullopt;
    }
    find_blocked(cells);
    // The last cells of a page may be cut off by its border; the rectangle may not.
    const std::int32_t columns = (size_ - width) / kCell + 1;
    const std::int32_t rows = (size_ - height) / kCell + 1;
    Cells best;
    std::int32_t most = -1;
    for (std::int32_t y = 0; y < rows; ++y) {
        const std::uint64_t* row = blocked_.data() + static_cast<std::size_t>(y) * words_;
        for_each_word(0, columns, [&](std::size_t word, std::uint64_t mask) {
            // A place from which it could slide both ways along either axis touches less than one
            // at the end of a slide. Beyond the ends of a word, and of the page, is no way.
            const std::uint64_t room = ~row[word] & mask;
            const std::uint64_t above = y + 1 < rows ? ~row[word + words_] : 0U;
            const std::uint64_t below = y > 0 ? ~*(row + word - words_) : 0U;
            std::uint64_t ends = room & ~((room << 1U) & (room >> 1U)) & ~(above & below);
            for (; ends != 0; ends &= ends - 1) {
                cells.x = static_cast<std::int32_t>(word) * kWordBits + std::countr_zero(ends);
                cells.y = y;
                const std::int32_t touched = touching(cells, most + 1);
                if (touched > most) {
                    most = touched;
                    best = cells;
                }
            }
        });
    }
    if (most < 0) {
        remember_refusal({width, height});
        return std::nullopt;
    }
    mark(best, true);
    free_cells_ -= count;
    const Region region{best.x * kCell, best.y * kCell, width, height};
    used_texels_ += area(region);
    return region;
}

void Atlas::remember_refusal(const Size& size) noexcept {
    // What is at least as large says nothing more.
    const auto kept =
        std::remove_if(refused_.begin(), refused_.begin() + refused_count_, [&](const Size& other) {
            return other.width >= size.width && other.height >= size.height;
        });
    refused_count_ = kept - refused_.begin();
    if (refused_count_ < static_cast<std::ptrdiff_t>(refused_.size())) {
        refused_[static_cast<std::size_t>(refused_count_++)] = size;
    }
}

void Atlas::release(const Region& region) noexcept {
    refused_count_ = 0;
    const Cells cells = cells_of(region);
    mark(cells, false);
    free_cells_ +=
        static_cast<std::uint64_t>(cells.width) * static_cast<std::uint64_t>(cells.height);
    used_texels_ -= area(region);
}

} // namespace farfield
