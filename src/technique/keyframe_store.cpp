#include "technique/keyframe_store.hpp"

#include <farfield/gpu/plan_rules.hpp>

#include <algorithm>

namespace farfield {

std::uint64_t KeyframeStore::page_bytes() const noexcept {
    return gpu::page_bytes({.size = side_, .scratch = false, .depth = true}, 1);
}

std::uint64_t KeyframeStore::scratch_bytes() const noexcept {
    return gpu::page_bytes({.size = side_, .scratch = true, .depth = false}, options_.samples);
}

bool KeyframeStore::fit(std::int32_t width, std::int32_t height) noexcept {
    const std::int32_t side = std::max(width, height);
    // Pages that are larger than needed serve as well, unless they are too large to be.
    if (side == side_ || (side < side_ && count() > 0)) {
        return true;
    }
    forget();
    side_ = side;
    std::uint64_t most = 0;
    if (side <= options_.limit && scratch_bytes() < options_.budget_bytes) {
        most = std::min<std::uint64_t>(
            options_.most, (options_.budget_bytes - scratch_bytes()) / page_bytes()
        );
    }
    slots_.resize(most);
    for (std::size_t i = 0; i < slots_.size(); ++i) {
        slots_[i].page = make_id<PageId>(i + 1);
        slots_[i].lost.reserve(SpriteSurvey::kMostPoints);
    }
    return false;
}

std::optional<std::uint32_t> KeyframeStore::take(
    std::uint64_t frame, std::vector<PageUpdate>& updates, std::uint32_t& evicted
) noexcept {
    std::optional<std::uint32_t> best;
    for (std::uint32_t i = 0; i < count(); ++i) {
        const KeyframeSlot& one = slots_[i];
        if (one.state == KeyframeState::empty) {
            best = i;
            break;
        }
        if (one.state == KeyframeState::ready && one.used_frame != frame &&
            (!best || one.used_frame < slots_[*best].used_frame)) {
            best = i;
        }
    }
    if (!best) {
        return best;
    }
    KeyframeSlot& chosen = slots_[*best];
    evicted += chosen.state == KeyframeState::ready ? 1U : 0U;
    chosen.state = KeyframeState::empty;
    if (!scratch_exists_) {
        updates.push_back(
            {PageUpdate::Action::create, scratch_page(), side_, true, options_.samples, false}
        );
        scratch_exists_ = true;
    }
    if (!chosen.page_exists) {
        updates.push_back({PageUpdate::Action::create, chosen.page, side_, false, 1, true});
        chosen.page_exists = true;
    }
    bytes_peak_ = std::max(bytes_peak_, bytes());
    return best;
}

void KeyframeStore::release_all() noexcept {
    for (KeyframeSlot& one : slots_) {
        one.state = KeyframeState::empty;
    }
}

void KeyframeStore::forget() noexcept {
    release_all();
    for (KeyframeSlot& one : slots_) {
        one.page_exists = false;
    }
    if (scratch_exists_) {
        pages_to_drop_ = std::max(pages_to_drop_, count() + 1);
        scratch_exists_ = false;
    }
}

void KeyframeStore::write_pending_updates(std::vector<PageUpdate>& updates) noexcept {
    for (std::uint32_t i = 0; i < pages_to_drop_; ++i) {
        PageUpdate update;
        update.action = PageUpdate::Action::destroy;
        update.page = make_id<PageId>(i);
        updates.push_back(update);
    }
    pages_to_drop_ = 0;
}

std::uint32_t KeyframeStore::ready() const noexcept {
    return static_cast<std::uint32_t>(std::count_if(
        slots_.begin(),
        slots_.end(),
        [](const KeyframeSlot& one) { return one.state == KeyframeState::ready; }
    ));
}

std::uint64_t KeyframeStore::bytes() const noexcept {
    std::uint64_t bytes = scratch_exists_ ? scratch_bytes() : 0;
    for (const KeyframeSlot& one : slots_) {
        bytes += one.page_exists ? page_bytes() : 0;
    }
    return bytes;
}

} // namespace farfield
