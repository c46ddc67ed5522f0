#include "technique/image_store.hpp"

#include <farfield/core/assert.hpp>

#include <algorithm>
#include <utility>

namespace farfield {

namespace {

constexpr std::int32_t kSmallestPage = 64;
// Images not shown for this long make room before another page is made.
constexpr std::uint64_t kIdleFrames = 120;
// Colour, the depth that a page may keep beside it, and colour with the depth of a scratch page.
constexpr std::uint64_t kPageTexelBytes = 4;
constexpr std::uint64_t kPageDepthBytes = 2;
constexpr std::uint64_t kScratchTexelBytes = 8;

std::uint64_t square(std::int32_t size) noexcept {
    return static_cast<std::uint64_t>(size) * static_cast<std::uint64_t>(size);
}

} // namespace

ImageStore::ImageStore(const Options& options) : options_(options), budget_(options.budget_bytes) {
    fit_page_size();
}

std::uint64_t ImageStore::page_bytes() const noexcept {
    return square(page_size_) * (kPageTexelBytes + (options_.depth ? kPageDepthBytes : 0U));
}

std::uint64_t ImageStore::scratch_bytes() const noexcept {
    return square(scratch_size_) * kScratchTexelBytes *
           static_cast<std::uint64_t>(options_.samples);
}

void ImageStore::fit_page_size() noexcept {
    // A small budget gets small pages: scratch and two of them must fit.
    for (page_size_ = options_.page_size; page_size_ >= kSmallestPage; page_size_ /= 2) {
        scratch_size_ = std::max(page_size_, required_scratch_);
        if (scratch_bytes() + 2 * page_bytes() <= options_.budget_bytes) {
            return;
        }
    }
    page_size_ = 0;
    scratch_size_ = 0;
}

void ImageStore::require_scratch(std::int32_t size) noexcept {
    if (size <= required_scratch_) {
        return;
    }
    required_scratch_ = size;
    forget();
    fit_page_size();
}

bool ImageStore::make_page(std::vector<PageUpdate>& updates) noexcept {
    if (!scratch_exists_) {
        if (!budget_.take(scratch_bytes())) {
            return false;
        }
        scratch_exists_ = true;
        updates.push_back(
            {.action = PageUpdate::Action::create,
             .page = kScratch,
             .size = scratch_size_,
             .scratch = true,
             .samples = options_.samples}
        );
    }
    if (!budget_.take(page_bytes())) {
        return false;
    }
    const auto id = make_id<PageId>(pages_.size() + 1);
    pages_.push_back({id, Atlas(page_size_)});
    updates.push_back(
        {.action = PageUpdate::Action::create,
         .page = id,
         .size = page_size_,
         .scratch = false,
         .samples = 1,
         .depth = options_.depth}
    );
    return true;
}

std::size_t ImageStore::evict_oldest() noexcept {
    const std::uint32_t slot = recency_.oldest();
    const std::size_t page = index_of(images_[slot].page) - 1;
    release(slot);
    ++evictions_;
    return page;
}

std::uint32_t ImageStore::create(
    std::uint32_t node,
    std::int32_t width,
    std::int32_t height,
    std::uint64_t frame,
    std::vector<PageUpdate>& updates
) noexcept {
    FARFIELD_ASSERT(possible());
    std::size_t chosen = 0;
    std::optional<Region> region;
    const auto try_page = [&](std::size_t page) {
        chosen = page;
        region = pages_[page].atlas.allocate(width, height);
    };
    const auto evict_before = [&](std::uint64_t limit) {
        while (!region && recency_.oldest() != RecencyList::kNothing &&
               images_[recency_.oldest()].used_frame < limit) {
            try_page(evict_oldest());
        }
    };
    for (std::size_t page = 0; page < pages_.size() && !region; ++page) {
        try_page(page);
    }
    evict_before(frame > kIdleFrames ? frame - kIdleFrames : 0);
    if (!region && make_page(updates)) {
        try_page(pages_.size() - 1);
    }
    evict_before(frame);
    if (!region) {
        return kNoImage;
    }
    std::uint32_t slot = 0;
    if (free_slots_.empty()) {
        slot = static_cast<std::uint32_t>(images_.size());
        images_.emplace_back();
    } else {
        slot = free_slots_.back();
        free_slots_.pop_back();
    }
    CachedImage& image = images_[slot];
    image = {};
    image.page = pages_[chosen].id;
    image.region = *region;
    image.node = node;
    image.made_frame = frame;
    touch(slot, frame);
    return slot;
}

void ImageStore::release(std::uint32_t slot) noexcept {
    CachedImage& image = images_[slot];
    pages_[index_of(image.page) - 1].atlas.release(image.region);
    image.node = UINT32_MAX;
    recency_.remove(slot);
    free_slots_.push_back(slot);
}

void ImageStore::touch(std::uint32_t slot, std::uint64_t frame) noexcept {
    images_[slot].used_frame = frame;
    recency_.touch(slot);
}

std::uint32_t ImageStore::take_evictions() noexcept {
    return std::exchange(evictions_, 0U);
}

void ImageStore::release_images() noexcept {
    while (recency_.oldest() != RecencyList::kNothing) {
        release(recency_.oldest());
    }
}

void ImageStore::forget() noexcept {
    release_images();
    if (scratch_exists_) {
        budget_.give_back(scratch_bytes() + pages_.size() * page_bytes());
        pages_to_drop_ = std::max(pages_to_drop_, static_cast<std::uint32_t>(pages_.size()) + 1U);
    }
    scratch_exists_ = false;
    pages_.clear();
}

void ImageStore::write_pending_updates(std::vector<PageUpdate>& updates) noexcept {
    for (std::uint32_t id = 0; id < pages_to_drop_; ++id) {
        updates.push_back({.action = PageUpdate::Action::destroy, .page = make_id<PageId>(id)});
    }
    pages_to_drop_ = 0;
}

void ImageStore::clear_scratch() noexcept {
    scratch_claims_.clear();
    shelf_x_ = 0;
    shelf_y_ = 0;
    shelf_height_ = 0;
}

std::optional<Region>
ImageStore::place_in_scratch(std::int32_t width, std::int32_t height) noexcept {
    // Shelves below the claims: what is placed and what is claimed must not meet.
    if (!scratch_claims_.empty()) {
        return std::nullopt;
    }
    if (shelf_x_ + width > scratch_size_) {
        shelf_x_ = 0;
        shelf_y_ += shelf_height_;
        shelf_height_ = 0;
    }
    if (shelf_y_ + height > scratch_size_) {
        return std::nullopt;
    }
    const Region region{shelf_x_, shelf_y_, width, height};
    shelf_x_ += width;
    shelf_height_ = std::max(shelf_height_, height);
    return region;
}

std::optional<Region> ImageStore::claim_scratch(const Region& region) noexcept {
    const bool taken =
        shelf_height_ > 0 ||
        std::any_of(scratch_claims_.begin(), scratch_claims_.end(), [&](const Region& claimed) {
            return overlaps(claimed, region);
        });
    if (taken) {
        return std::nullopt;
    }
    scratch_claims_.push_back(region);
    return region;
}

void ImageStore::report(ImageCacheStatistics& statistics) const noexcept {
    statistics.pages = static_cast<std::uint32_t>(pages_.size());
    for (const Page& page : pages_) {
        statistics.texels_used += page.atlas.used_texels();
        statistics.texels_allocated += square(page.atlas.size());
    }
    statistics.image_bytes = budget_.used_bytes();
    statistics.image_bytes_peak = budget_.peak_bytes();
}

} // namespace farfield
