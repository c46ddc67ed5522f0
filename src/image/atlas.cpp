#include <farfield/core/assert.hpp>
#include <farfield/image/atlas.hpp>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

namespace farfield {

namespace {

// A shelf takes rectangles of at least this share of its height; lower ones would waste it.
constexpr double kShelfFit = 0.7;
// Heights of shelves are multiples of this, so that images of similar height share one.
constexpr std::int32_t kShelfStep = 4;
// Storage is reserved for this many shelves and rectangles a shelf, which pages of real images do
// not reach; a page that does is as good as full.
constexpr std::int32_t kTexelsPerShelf = 16;
constexpr std::int32_t kTexelsPerRectangle = 8;

} // namespace

Atlas::Atlas(std::int32_t size)
    : size_(size), most_shelves_(static_cast<std::size_t>(size / kTexelsPerShelf + 2)),
      most_rectangles_(static_cast<std::uint32_t>(size / kTexelsPerRectangle + 2)) {
    shelves_.reserve(most_shelves_);
    spare_runs_.resize(most_shelves_);
    for (std::vector<Run>& runs : spare_runs_) {
        // Rectangles leave at most one free run more than there are of them.
        runs.reserve(most_rectangles_ + 1);
    }
    clear();
}

void Atlas::clear() noexcept {
    while (!shelves_.empty()) {
        erase_shelf(shelves_.size() - 1);
    }
    used_texels_ = 0;
    insert_shelf(0, 0, size_);
}

void Atlas::insert_shelf(std::size_t position, std::int32_t y, std::int32_t height) noexcept {
    Shelf shelf;
    shelf.y = y;
    shelf.height = height;
    shelf.free_runs = std::move(spare_runs_.back());
    spare_runs_.pop_back();
    shelf.free_runs.clear();
    shelf.free_runs.push_back({0, size_});
    shelves_.insert(shelves_.begin() + static_cast<std::ptrdiff_t>(position), std::move(shelf));
}

void Atlas::erase_shelf(std::size_t position) noexcept {
    spare_runs_.push_back(std::move(shelves_[position].free_runs));
    shelves_.erase(shelves_.begin() + static_cast<std::ptrdiff_t>(position));
}

std::int32_t Atlas::widest_run(const Shelf& shelf) const noexcept {
    std::int32_t widest = 0;
    for (const Run& run : shelf.free_runs) {
        widest = std::max(widest, run.width);
    }
    return widest;
}

std::optional<Region> Atlas::allocate(std::int32_t width, std::int32_t height) noexcept {
    FARFIELD_ASSERT(width >= 1 && height >= 1);
    if (width > size_ || height > size_) {
        return std::nullopt;
    }
    // The lowest shelf in use that fits wastes least; failing that, the lowest free one.
    constexpr std::size_t kNoShelf = std::numeric_limits<std::size_t>::max();
    std::size_t chosen = kNoShelf;
    std::size_t free_shelf = kNoShelf;
    for (std::size_t i = 0; i < shelves_.size(); ++i) {
        const Shelf& shelf = shelves_[i];
        if (shelf.height < height || shelf.rectangles == most_rectangles_) {
            continue;
        }
        if (shelf.rectangles == 0) {
            if (free_shelf == kNoShelf || shelf.height < shelves_[free_shelf].height) {
                free_shelf = i;
            }
        } else if (
            (chosen == kNoShelf || shelf.height < shelves_[chosen].height) &&
            static_cast<double>(height) >= kShelfFit * static_cast<double>(shelf.height) &&
            widest_run(shelf) >= width
        ) {
            chosen = i;
        }
    }
    if (chosen == kNoShelf) {
        if (free_shelf == kNoShelf) {
            // Last resort: any shelf with room, however high.
            for (std::size_t i = 0; i < shelves_.size(); ++i) {
                const Shelf& shelf = shelves_[i];
                if (shelf.height >= height && shelf.rectangles < most_rectangles_ &&
                    widest_run(shelf) >= width &&
                    (chosen == kNoShelf || shelf.height < shelves_[chosen].height)) {
                    chosen = i;
                }
            }
            if (chosen == kNoShelf) {
                return std::nullopt;
            }
        } else {
            const std::int32_t rounded = (height + kShelfStep - 1) / kShelfStep * kShelfStep;
            const std::int32_t rest = shelves_[free_shelf].height - rounded;
            if (rest >= kShelfStep && shelves_.size() < most_shelves_) {
                const std::int32_t y = shelves_[free_shelf].y;
                shelves_[free_shelf].height = rounded;
                insert_shelf(free_shelf + 1, y + rounded, rest);
            }
            chosen = free_shelf;
        }
    }

    Shelf& shelf = shelves_[chosen];
    // Best fit: the narrowest run that holds the rectangle.
    std::size_t best = kNoShelf;
    for (std::size_t i = 0; i < shelf.free_runs.size(); ++i) {
        if (shelf.free_runs[i].width >= width &&
            (best == kNoShelf || shelf.free_runs[i].width < shelf.free_runs[best].width)) {
            best = i;
        }
    }
    FARFIELD_ASSERT(best != kNoShelf);
    Run& run = shelf.free_runs[best];
    const Region region{run.x, shelf.y, width, height};
    run.x += width;
    run.width -= width;
    if (run.width == 0) {
        shelf.free_runs.erase(shelf.free_runs.begin() + static_cast<std::ptrdiff_t>(best));
    }
    ++shelf.rectangles;
    used_texels_ += area(region);
    return region;
}

void Atlas::release(const Region& region) noexcept {
    const auto found = std::lower_bound(
        shelves_.begin(),
        shelves_.end(),
        region.y,
        [](const Shelf& shelf, std::int32_t y) { return shelf.y < y; }
    );
    FARFIELD_ASSERT(found != shelves_.end() && found->y == region.y && found->rectangles > 0);
    std::vector<Run>& runs = found->free_runs;
    auto next =
        std::lower_bound(runs.begin(), runs.end(), region.x, [](const Run& run, std::int32_t x) {
            return run.x < x;
        });
    const bool joins_next = next != runs.end() && region.x + region.width == next->x;
    const bool joins_before = next != runs.begin() && (next - 1)->x + (next - 1)->width == region.x;
    if (joins_before && joins_next) {
        (next - 1)->width += region.width + next->width;
        runs.erase(next);
    } else if (joins_before) {
        (next - 1)->width += region.width;
    } else if (joins_next) {
        next->x = region.x;
        next->width += region.width;
    } else {
        runs.insert(next, {region.x, region.width});
    }
    used_texels_ -= area(region);
    --found->rectangles;
    if (found->rectangles > 0) {
        return;
    }
    auto position = static_cast<std::size_t>(found - shelves_.begin());
    if (position + 1 < shelves_.size() && shelves_[position + 1].rectangles == 0) {
        shelves_[position].height += shelves_[position + 1].height;
        erase_shelf(position + 1);
    }
    if (position > 0 && shelves_[position - 1].rectangles == 0) {
        shelves_[position - 1].height += shelves_[position].height;
        erase_shelf(position);
    }
}

} // namespace farfield
