#include <farfield/io/paged_images.hpp>

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

namespace farfield::io {
namespace {

constexpr std::uint64_t kMostBudget = std::uint64_t{1} << 63U;

/// An image of the input.
struct Page {
    std::unique_ptr<LayeredDepthImage> image; ///< null: not in memory
    std::uint64_t bytes = 0;                  ///< 0: there is none, or it cannot be read
    std::uint64_t wanted = 0;                 ///< number of the call of `want` that last named it
    std::uint64_t found = 0;                  ///< number of the last one before `find` gave it out
    bool fits = false; ///< of those wanted now: there is room for it beside more urgent ones
};

} // namespace

struct PagedImages::Impl {
    std::function<Result<LayeredDepthImage>(std::uint32_t)> read;
    std::uint64_t budget = 0;

    mutable std::mutex mutex; ///< of all below; never held while a file is read
    mutable std::condition_variable changed;
    std::vector<Page> pages;
    std::vector<std::uint32_t> wanted;  ///< now, the most urgent first; room for all pages
    std::vector<std::uint32_t> present; ///< pages in memory; room for all
    /// Calls of `want`; begins where no page counts as found in the last two.
    std::uint64_t call = 2;
    bool asked = false; ///< since the worker looked
    bool busy = false;
    bool stopped = false;
    PagedImagesStatistics statistics;
    std::optional<Error> error;

    std::vector<std::unique_ptr<LayeredDepthImage>> evicted; ///< of the worker alone
    std::thread worker;

    /// Whether a pointer that `find` gave out must stay valid.
    [[nodiscard]] bool is_pinned(const Page& page) const noexcept { return page.found + 1 >= call; }
    /// Whether a page is to be in memory because it is wanted.
    [[nodiscard]] bool is_needed(const Page& page) const noexcept {
        return page.wanted == call && page.fits;
    }
    [[nodiscard]] bool is_free(const Page& page) const noexcept {
        return !is_pinned(page) && !is_needed(page);
    }
    void share_out() noexcept;
    [[nodiscard]] std::optional<std::uint32_t> next() const noexcept;
    [[nodiscard]] bool has_room(std::uint32_t image) const noexcept;
    void make_room(std::uint64_t bytes);
    void keep(std::uint32_t image, Result<LayeredDepthImage> made);
    void work();
};

/// Gives the budget to what is wanted, the most urgent image first.
void PagedImages::Impl::share_out() noexcept {
    std::uint64_t left = budget;
    bool is_first = true;
    for (const std::uint32_t image : wanted) {
        Page& page = pages[image];
        page.fits = page.bytes > 0 && (is_first || page.bytes <= left);
        if (page.fits) {
            left -= std::min(page.bytes, left);
            is_first = false;
        }
    }
}

/// The most urgent image that is to be read.
std::optional<std::uint32_t> PagedImages::Impl::next() const noexcept {
    const auto missing = std::find_if(wanted.begin(), wanted.end(), [&](std::uint32_t image) {
        return is_needed(pages[image]) && pages[image].image == nullptr;
    });
    return missing == wanted.end() ? std::nullopt : std::optional(*missing);
}

/// Whether an image fits beside all that have to stay, or does not wait for that.
bool PagedImages::Impl::has_room(std::uint32_t image) const noexcept {
    // What is needed first does not wait: what is shown in its place in every frame is never free.
    const auto first = std::find_if(wanted.begin(), wanted.end(), [&](std::uint32_t other) {
        return is_needed(pages[other]);
    });
    std::uint64_t bytes = pages[image].bytes;
    for (const std::uint32_t other : present) {
        bytes += is_free(pages[other]) ? 0 : pages[other].bytes;
    }
    return bytes <= budget || *first == image;
}

/// Drops what was wanted least recently until so many bytes more fit, or nothing is free.
void PagedImages::Impl::make_room(std::uint64_t bytes) {
    while (statistics.bytes + bytes > budget) {
        auto victim = present.end();
        for (auto other = present.begin(); other != present.end(); ++other) {
            const bool is_older =
                victim == present.end() ||
                std::pair(pages[*other].wanted, *other) < std::pair(pages[*victim].wanted, *victim);
            if (is_free(pages[*other]) && is_older) {
                victim = other;
            }
        }
        if (victim == present.end()) {
            return;
        }
        statistics.bytes -= pages[*victim].bytes;
        ++statistics.evictions;
        evicted.push_back(std::move(pages[*victim].image));
        present.erase(victim);
    }
}

/// Takes what was read.
void PagedImages::Impl::keep(std::uint32_t image, Result<LayeredDepthImage> made) {
    Page& page = pages[image];
    if (made && memory_bytes(*made) > page.bytes) {
        made = fail(
            ErrorCode::bad_data,
            "paged images: image " + std::to_string(image) + " takes " +
                std::to_string(memory_bytes(*made)) + " bytes, announced were " +
                std::to_string(page.bytes)
        );
    }
    if (made) {
        page.image = std::make_unique<LayeredDepthImage>(std::move(*made));
        present.push_back(image);
        ++statistics.loads;
        return;
    }
    statistics.bytes -= page.bytes;
    page.bytes = 0;
    error = std::move(made).error();
    ++statistics.failed;
    // The room that it had goes to others.
    share_out();
}

/// Reads what is wanted until the source is destroyed.
void PagedImages::Impl::work() {
    std::unique_lock lock(mutex);
    while (!stopped) {
        asked = false;
        busy = true;
        const std::optional<std::uint32_t> image = next();
        const bool reads = image && has_room(*image);
        const std::uint64_t bytes = reads ? pages[*image].bytes : 0;
        make_room(bytes);
        statistics.bytes += bytes;
        if (reads || !evicted.empty()) {
            lock.unlock();
            evicted.clear();
            std::optional<Result<LayeredDepthImage>> made;
            if (reads) {
                made = read(*image);
            }
            lock.lock();
            if (made) {
                keep(*image, std::move(*made));
            }
            continue;
        }
        busy = false;
        changed.notify_all();
        changed.wait(lock, [&] { return asked || stopped; });
    }
}

PagedImages::PagedImages(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}

Result<std::unique_ptr<PagedImages>>
PagedImages::create(PlacementReader reader, const PagedImagesOptions& options) {
    PagedImagesInput input;
    for (std::uint32_t i = 0; i < reader.image_count(); ++i) {
        input.bytes.push_back(reader.image_bytes(i));
    }
    // A function can be copied, a reader cannot.
    const auto shared = std::make_shared<const PlacementReader>(std::move(reader));
    input.read = [shared](std::uint32_t image) { return shared->read(image); };
    return create(std::move(input), options);
}

Result<std::unique_ptr<PagedImages>>
PagedImages::create(PagedImagesInput input, const PagedImagesOptions& options) {
    if (options.budget_bytes < 1 || options.budget_bytes > kMostBudget) {
        return fail(
            ErrorCode::invalid_argument,
            "paged images: budget_bytes is " + std::to_string(options.budget_bytes) +
                ", expected 1 to 2^63"
        );
    }
    auto impl = std::make_unique<Impl>();
    impl->read = std::move(input.read);
    impl->budget = options.budget_bytes;
    impl->pages.resize(input.bytes.size());
    for (std::size_t i = 0; i < input.bytes.size(); ++i) {
        impl->pages[i].bytes = input.bytes[i];
    }
    impl->wanted.reserve(input.bytes.size());
    impl->present.reserve(input.bytes.size());
    try {
        impl->worker = std::thread([state = impl.get()] { state->work(); });
    } catch (const std::system_error& failure) {
        return fail(ErrorCode::device, std::string("paged images: no thread: ") + failure.what());
    }
    return std::unique_ptr<PagedImages>(new PagedImages(std::move(impl)));
}

PagedImages::~PagedImages() {
    {
        const std::lock_guard lock(impl_->mutex);
        impl_->stopped = true;
    }
    impl_->changed.notify_all();
    impl_->worker.join();
}

void PagedImages::want(std::span<const std::uint32_t> images) noexcept {
    {
        const std::lock_guard lock(impl_->mutex);
        ++impl_->call;
        impl_->wanted.clear();
        for (const std::uint32_t image : images) {
            if (image < impl_->pages.size() && impl_->pages[image].wanted != impl_->call) {
                impl_->pages[image].wanted = impl_->call;
                impl_->wanted.push_back(image);
            }
        }
        impl_->share_out();
        impl_->asked = true;
    }
    impl_->changed.notify_all();
}

const LayeredDepthImage* PagedImages::find(std::uint32_t image) noexcept {
    const std::lock_guard lock(impl_->mutex);
    if (image >= impl_->pages.size() || impl_->pages[image].image == nullptr) {
        ++impl_->statistics.misses;
        return nullptr;
    }
    impl_->pages[image].found = impl_->call;
    ++impl_->statistics.hits;
    return impl_->pages[image].image.get();
}

PagedImagesStatistics PagedImages::statistics() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->statistics;
}

std::optional<Error> PagedImages::last_error() const {
    const std::lock_guard lock(impl_->mutex);
    return impl_->error;
}

void PagedImages::wait_idle() const {
    std::unique_lock lock(impl_->mutex);
    impl_->changed.wait(lock, [&] { return !impl_->asked && !impl_->busy; });
}

} // namespace farfield::io
