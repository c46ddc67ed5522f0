#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/io/placement_file.hpp>
#include <farfield/technique/image_placement.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace farfield::io {

struct PagedImagesOptions {
    /// Memory of images that are held. [1, 2^63]
    std::uint64_t budget_bytes = std::uint64_t{256} << 20U;
};

/// What became of images since the beginning.
struct PagedImagesStatistics {
    std::uint64_t hits = 0;      ///< calls of `find` that gave an image
    std::uint64_t misses = 0;    ///< those that gave none
    std::uint64_t loads = 0;     ///< images read
    std::uint64_t evictions = 0; ///< images dropped for others
    std::uint64_t failed = 0;    ///< images that could not be read; see `last_error`
    std::uint64_t bytes = 0;     ///< held now, with the image that is being read
};

/// Where images are read from.
struct PagedImagesInput {
    std::vector<std::uint64_t> bytes; ///< `memory_bytes` of each image; 0: there is none
    /// Reads one; called by one thread at a time, which is not the one that asks for images.
    std::function<Result<LayeredDepthImage>(std::uint32_t image)> read;
};

/// Layered images of a file, of which as many are in memory as a budget allows. A thread of its own
/// reads what was asked for last, the most urgent image first, and drops what was wanted least
/// recently where it needs room. `want` and `find` never wait for a file and allocate nothing.
///
/// What `find` gave out stays until the second call of `want` after it, and what is wanted now
/// stays as far as the budget goes, the most urgent first; what does not fit beside these is passed
/// over. The budget is exceeded for one image alone, the first that is wanted: where it is larger
/// than the budget, which then is all that is held, or where what `find` gave out leaves no room
/// for it and goes later.
///
/// An image that cannot be read is missing from then on: it is not tried again.
///
/// `want` and `find` are called by one thread, the others by any.
class PagedImages final : public LayeredImageSource {
  public:
    /// @return an error where the budget is out of range, or no thread can be started
    [[nodiscard]] static Result<std::unique_ptr<PagedImages>>
    create(PlacementReader reader, const PagedImagesOptions& options = {});

    /// For images from elsewhere.
    [[nodiscard]] static Result<std::unique_ptr<PagedImages>>
    create(PagedImagesInput input, const PagedImagesOptions& options = {});

    /// Waits for the image that is being read.
    ~PagedImages() override;

    /// Images that the input does not have are passed over.
    /// @par Cost linear in `images`
    void want(std::span<const std::uint32_t> images) noexcept override;

    [[nodiscard]] const LayeredDepthImage* find(std::uint32_t image) noexcept override;

    [[nodiscard]] PagedImagesStatistics statistics() const;

    /// Why the last image that failed could not be read.
    [[nodiscard]] std::optional<Error> last_error() const;

    /// Waits until no image is read and none is about to be. For tools and tests.
    void wait_idle() const;

  private:
    struct Impl;
    explicit PagedImages(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::io
