#pragma once

#include "technique/image_camera.hpp"
#include "technique/sprite_survey.hpp"
#include <farfield/core/ids.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace farfield {

/// What a place for a keyframe holds.
enum class KeyframeState : std::uint8_t {
    empty,
    building, ///< some of its tiles are made
    ready,
};

/// A place for a keyframe, with a page of its own.
struct KeyframeSlot {
    KeyframeState state = KeyframeState::empty;
    PageId page = kNone<PageId>;
    bool page_exists = false;
    bool whole = false;     ///< made in one pass: it may be shown as an image
    View frame_view;        ///< that it was made for, without margin
    ImageCamera camera;     ///< of its pass
    float copy_near = 0.0F; ///< as of `Pass`
    float copy_far = 0.0F;
    std::uint32_t tiles = 0; ///< made
    std::uint64_t made_frame = 0;
    std::uint64_t used_frame = 0;
    SurveyDepths depths;
    std::uint64_t judged_frame = 0; ///< in which the following were found
    double judged_rad = 0.0;
    float judged_lost = 0.0F;
    bool judged_right = false;
    std::vector<std::uint8_t> lost; ///< by point of the survey: the keyframe does not serve it
};

/// Where keyframes live: as many pages of one size as a budget holds, and who goes first.
class KeyframeStore {
  public:
    struct Options {
        std::uint64_t budget_bytes = 0;
        std::uint32_t most = 1;   ///< keyframes
        std::int32_t limit = 0;   ///< [texel] largest side
        std::int32_t samples = 1; ///< of the scratch page
    };
    explicit KeyframeStore(const Options& options) noexcept : options_(options) {}

    /// Makes pages hold keyframes of this size. [texel]
    /// @return false where all keyframes were lost by that
    bool fit(std::int32_t width, std::int32_t height) noexcept;

    /// Places; 0: none of that size can be.
    [[nodiscard]] std::uint32_t count() const noexcept {
        return static_cast<std::uint32_t>(slots_.size());
    }
    [[nodiscard]] KeyframeSlot& slot(std::uint32_t index) noexcept { return slots_[index]; }
    [[nodiscard]] const KeyframeSlot& slot(std::uint32_t index) const noexcept {
        return slots_[index];
    }

    /// A place for a new keyframe: an empty one, or that of the keyframe whose last use is longest
    /// ago. None where all are used in `frame` or being made. Appends pages it makes to `updates`.
    [[nodiscard]] std::optional<std::uint32_t>
    take(std::uint64_t frame, std::vector<PageUpdate>& updates, std::uint32_t& evicted) noexcept;

    void release(std::uint32_t index) noexcept { slots_[index].state = KeyframeState::empty; }
    void release_all() noexcept;

    /// Releases all and drops the pages with the next plan.
    void forget() noexcept;
    void write_pending_updates(std::vector<PageUpdate>& updates) noexcept;

    [[nodiscard]] static constexpr PageId scratch_page() noexcept { return PageId{0}; }
    [[nodiscard]] std::uint32_t ready() const noexcept;
    [[nodiscard]] std::uint64_t bytes() const noexcept;
    [[nodiscard]] std::uint64_t bytes_peak() const noexcept { return bytes_peak_; }

  private:
    [[nodiscard]] std::uint64_t page_bytes() const noexcept;
    [[nodiscard]] std::uint64_t scratch_bytes() const noexcept;

    Options options_;
    std::int32_t side_ = 0; ///< [texel] of all pages
    bool scratch_exists_ = false;
    std::vector<KeyframeSlot> slots_;
    std::uint32_t pages_to_drop_ = 0; ///< ids 0.. below this are dropped with the next plan
    std::uint64_t bytes_peak_ = 0;
};

} // namespace farfield
