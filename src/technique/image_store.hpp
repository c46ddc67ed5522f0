#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/atlas.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/image_plane.hpp>
#include <farfield/policy/image_budget.hpp>
#include <farfield/technique/image_cache.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace farfield {

/// An image of a node: what it shows, where it is, and for how long it is right.
struct CachedImage {
    ImagePlane<float> plane;  ///< eye that made it, plane of the quad
    Box3f box;                ///< contents
    Box3f zone;               ///< eyes for which it may be shown, by `ImageValidity::zone`
    float baked_rad = 0.0F;   ///< error at the eye that made it of the images nested in it
    float error_rad = 0.0F;   ///< with `baked_rad`, when last measured
    float allowed_rad = 0.0F; ///< threshold that `zone` was made for
    glm::vec2 texel{0.0F};    ///< [m] width and height of its texels on its plane
    float near_ratio = 1.0F;  ///< as in `ImageQuad`
    float far_ratio = 1.0F;
    std::uint64_t pixels = 0;          ///< number of the lens and resolution that it was made for
    std::uint64_t appearance = 0;      ///< as in `ImageCache::set_appearance`
    std::uint32_t content_version = 0; ///< of the node
    std::uint32_t surface_version = 0; ///< of the hierarchy
    glm::vec3 origin{0.0F};            ///< quad, as in `ImageQuad`
    glm::vec3 edge_u{0.0F};
    glm::vec3 edge_v{0.0F};
    PageId page = kNone<PageId>;
    Region region; ///< texels of the page, border included
    std::uint32_t node = UINT32_MAX;
    std::uint64_t made_frame = 0;
    std::uint64_t used_frame = 0;
};

/// Where images live: pages under a budget, the places in them, and who goes first when there is no
/// room. Knows nothing of nodes but their numbers.
class ImageStore {
  public:
    static constexpr std::uint32_t kNoImage = UINT32_MAX;

    struct Options {
        std::uint64_t budget_bytes = 0;
        std::int32_t page_size = 0;
        std::int32_t samples = 1;
        bool depth = false; ///< pages keep depth beside each texel
    };
    explicit ImageStore(const Options& options);

    /// False when the budget does not hold a scratch page and one page of images.
    [[nodiscard]] bool possible() const noexcept { return page_size_ > 0; }
    [[nodiscard]] std::int32_t page_size() const noexcept { return page_size_; }

    /// Scratch pages are at least this wide and high from now on. Call with no images alive.
    void require_scratch(std::int32_t size) noexcept;

    /// A new image of `node` with room for `width` x `height` texels, or `kNoImage`. Evicts images
    /// not used in `frame`, least recently used first; appends pages it makes to `updates`.
    [[nodiscard]] std::uint32_t create(
        std::uint32_t node,
        std::int32_t width,
        std::int32_t height,
        std::uint64_t frame,
        std::vector<PageUpdate>& updates
    ) noexcept;
    void release(std::uint32_t slot) noexcept;
    void touch(std::uint32_t slot, std::uint64_t frame) noexcept;

    /// True when the slot still holds the image of that node.
    [[nodiscard]] bool holds(std::uint32_t slot, std::uint32_t node) const noexcept {
        return images_[slot].node == node;
    }
    [[nodiscard]] CachedImage& image(std::uint32_t slot) noexcept { return images_[slot]; }
    [[nodiscard]] const CachedImage& image(std::uint32_t slot) const noexcept {
        return images_[slot];
    }

    /// Images evicted since the last call.
    [[nodiscard]] std::uint32_t take_evictions() noexcept;

    /// Releases every image and keeps the pages.
    void release_images() noexcept;

    /// Releases every image and drops the pages with the next plan.
    void forget() noexcept;
    void write_pending_updates(std::vector<PageUpdate>& updates) noexcept;

    [[nodiscard]] PageId scratch_page() const noexcept { return kScratch; }
    /// A place in the scratch page, disjoint from all since `clear_scratch`.
    [[nodiscard]] std::optional<Region>
    place_in_scratch(std::int32_t width, std::int32_t height) noexcept;
    /// A given place in the scratch page, if it is disjoint from all since `clear_scratch`.
    [[nodiscard]] std::optional<Region> claim_scratch(const Region& region) noexcept;
    void clear_scratch() noexcept;

    void report(ImageCacheStatistics& statistics) const noexcept;

  private:
    struct Page {
        PageId id = kNone<PageId>;
        Atlas atlas;
    };
    static constexpr PageId kScratch{0};

    [[nodiscard]] std::uint64_t page_bytes() const noexcept;
    [[nodiscard]] std::uint64_t scratch_bytes() const noexcept;
    [[nodiscard]] bool make_page(std::vector<PageUpdate>& updates) noexcept;
    [[nodiscard]] std::size_t evict_oldest() noexcept;
    void fit_page_size() noexcept;

    Options options_;
    std::int32_t page_size_ = 0;
    std::int32_t scratch_size_ = 0;
    std::int32_t required_scratch_ = 1;
    bool scratch_exists_ = false;
    ImageBudget budget_;
    std::vector<Page> pages_;
    std::vector<CachedImage> images_;
    std::vector<std::uint32_t> free_slots_;
    RecencyList recency_; ///< of slots
    std::uint32_t evictions_ = 0;
    std::uint32_t pages_to_drop_ = 0; ///< ids 0.. below this are dropped with the next plan
    std::vector<Region> scratch_claims_;
    std::int32_t shelf_x_ = 0;
    std::int32_t shelf_y_ = 0;
    std::int32_t shelf_height_ = 0;
};

} // namespace farfield
