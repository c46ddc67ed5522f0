#include "io/files.hpp"
#include "io/hand_made_placement.hpp"
#include "support/allocation_counter.hpp"
#include "support/random.hpp"
#include <farfield/io/paged_images.hpp>
#include <farfield/io/placement_file.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

using Images = std::unique_ptr<io::PagedImages>;
using List = std::vector<std::uint32_t>;

/// An image of a width of its own, so that it can be told from others.
LayeredDepthImage image_of(std::uint32_t image) {
    return layered_image(straight_view(10 + static_cast<int>(image), 10), 1.0, 2.0, [](auto&&...) {
    });
}

/// What `image_of` takes: counts and starts of rows.
std::uint64_t bytes_of(std::uint32_t image) {
    return std::uint64_t{10} * (10 + image) + std::uint64_t{11} * 4;
}

/// Makes images, lets each through a gate where asked to, and notes which were read.
class Library {
  public:
    explicit Library(std::uint32_t count) {
        for (std::uint32_t i = 0; i < count; ++i) {
            bytes_.push_back(bytes_of(i));
        }
    }

    void set_bytes(std::uint32_t image, std::uint64_t bytes) { bytes_[image] = bytes; }
    void break_image(std::uint32_t image) { broken_.push_back(image); }
    void close_gate() {
        const std::lock_guard lock(mutex_);
        is_open_ = false;
    }
    void open_gate() {
        {
            const std::lock_guard lock(mutex_);
            is_open_ = true;
        }
        changed_.notify_all();
    }
    /// Waits until a reading of any image stands at the gate.
    void wait_for_reading() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return is_reading_; });
    }
    [[nodiscard]] List reads() const {
        const std::lock_guard lock(mutex_);
        return reads_;
    }

    [[nodiscard]] io::PagedImagesInput input() {
        return {bytes_, [this](std::uint32_t image) { return read(image); }};
    }

  private:
    Result<LayeredDepthImage> read(std::uint32_t image) {
        std::unique_lock lock(mutex_);
        reads_.push_back(image);
        is_reading_ = true;
        changed_.notify_all();
        changed_.wait(lock, [&] { return is_open_; });
        is_reading_ = false;
        if (std::find(broken_.begin(), broken_.end(), image) != broken_.end()) {
            return fail(ErrorCode::bad_data, "image " + std::to_string(image) + " is broken");
        }
        return image_of(image);
    }

    std::vector<std::uint64_t> bytes_;
    List broken_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    List reads_;
    bool is_open_ = true;
    bool is_reading_ = false;
};

Images open_images(Library& library, std::uint64_t budget) {
    auto images = io::PagedImages::create(library.input(), {.budget_bytes = budget});
    REQUIRE(images.has_value());
    return std::move(*images);
}

void want(io::PagedImages& images, const List& list) {
    images.want(list);
    images.wait_idle();
}

/// Images in memory; asking for them keeps them there.
List present(io::PagedImages& images, std::uint32_t count) {
    List list;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (images.find(i) != nullptr) {
            list.push_back(i);
        }
    }
    return list;
}

} // namespace

TEST_CASE("Nothing is there before it is wanted, and images beyond the file never") {
    Library library(3);
    const Images images = open_images(library, 10'000);
    images->wait_idle();
    CHECK(images->find(0) == nullptr);
    CHECK(images->find(3) == nullptr);
    CHECK(images->find(UINT32_MAX) == nullptr);
    want(*images, {});
    want(*images, {3, UINT32_MAX, 1, 1});
    CHECK(images->find(3) == nullptr);
    REQUIRE(images->find(1) != nullptr);
    CHECK(*images->find(1) == image_of(1));
    CHECK(library.reads() == List{1});
    const io::PagedImagesStatistics statistics = images->statistics();
    CHECK(statistics.hits == 2);
    CHECK(statistics.misses == 4);
    CHECK(statistics.loads == 1);
    CHECK(statistics.evictions == 0);
    CHECK(statistics.failed == 0);
    CHECK(statistics.bytes == bytes_of(1));
    CHECK_FALSE(images->last_error().has_value());
}

TEST_CASE("A budget out of range is an error, and no images are none") {
    Library library(0);
    for (const std::uint64_t budget : {std::uint64_t{0}, UINT64_MAX}) {
        const auto images = io::PagedImages::create(library.input(), {.budget_bytes = budget});
        REQUIRE_FALSE(images.has_value());
        CHECK(images.error().code == ErrorCode::invalid_argument);
        CHECK_THAT(images.error().message, Catch::Contains(std::to_string(budget)));
    }
    const Images none = open_images(library, 1);
    want(*none, {0, 1});
    CHECK(none->find(0) == nullptr);
}

TEST_CASE("The most urgent images are read first, as many as fit") {
    Library library(10);
    const Images images = open_images(library, bytes_of(7) + bytes_of(3) + bytes_of(5));
    want(*images, {7, 3, 5, 1});
    CHECK(library.reads() == List{7, 3, 5});
    // What is smaller than what is left comes in place of what does not fit.
    Library other(10);
    other.set_bytes(3, 100'000);
    const Images two = open_images(other, bytes_of(7) + bytes_of(5));
    want(*two, {7, 3, 5});
    CHECK(other.reads() == List{7, 5});
    // One that is more urgent goes before those that are waiting.
    Library gated(10);
    gated.close_gate();
    const Images third = open_images(gated, 10'000);
    third->want(List{1, 2, 3});
    gated.wait_for_reading();
    third->want(List{4, 2, 1});
    gated.open_gate();
    third->wait_idle();
    CHECK(gated.reads() == List{1, 4, 2});
}

TEST_CASE("Neither asking nor finding waits for what is read") {
    Library library(4);
    const Images images = open_images(library, 10'000);
    want(*images, {0});
    library.close_gate();
    images->want(List{1});
    library.wait_for_reading();
    // The gate is closed: whatever waited for it would wait forever.
    for (int i = 0; i < 10; ++i) {
        CHECK(images->find(0) != nullptr);
        CHECK(images->find(1) == nullptr);
        images->want(List{1, 2});
        CHECK(images->statistics().loads == 1);
    }
    library.open_gate();
    images->wait_idle();
    CHECK(present(*images, 4) == List{0, 1, 2});
}

TEST_CASE("What was wanted least recently is dropped first") {
    Library library(6);
    const Images images = open_images(library, bytes_of(0) + bytes_of(1) + bytes_of(2));
    want(*images, {0});
    want(*images, {1});
    want(*images, {2});
    want(*images, {0, 1}); // so that 2 was wanted least recently, then 0 and 1 alike
    want(*images, {});
    want(*images, {});
    CHECK(images->statistics().evictions == 0);
    want(*images, {3});
    CHECK(images->statistics().evictions >= 1);
    want(*images, {});
    // 3 is larger than each of them, so two had to go.
    CHECK(present(*images, 6) == List{1, 3});
    CHECK(images->statistics().bytes == bytes_of(1) + bytes_of(3));
}

TEST_CASE("What is wanted with others stays until they take its room") {
    Library library(6);
    const Images images = open_images(library, bytes_of(5) * 2);
    want(*images, {0, 1});
    // 1 is wanted still, but 2 is more urgent, and both do not fit beside 0.
    want(*images, {0, 2, 1});
    CHECK(present(*images, 6) == List{0, 2});
    CHECK(images->statistics().evictions == 1);
    // Here it is the other way round: 1 does not come.
    want(*images, {2, 0, 1});
    CHECK(present(*images, 6) == List{0, 2});
}

TEST_CASE("What was found stays until the second time that others are wanted") {
    Library library(6);
    const Images images = open_images(library, bytes_of(5) * 2);
    want(*images, {0, 1});
    const LayeredDepthImage* const zero = images->find(0);
    REQUIRE(zero != nullptr);
    // 1 makes room at once. Of 0 nothing may change.
    want(*images, {2, 3});
    CHECK(images->find(2) != nullptr);
    CHECK(images->find(3) == nullptr);
    CHECK(*zero == image_of(0));
    want(*images, {2, 3});
    CHECK(present(*images, 6) == List{2, 3});
    CHECK(images->statistics().bytes == bytes_of(2) + bytes_of(3));
}

TEST_CASE("An image that is needed now comes however long another one is shown in its place") {
    Library library(3);
    const Images images = open_images(library, bytes_of(2));
    want(*images, {0});
    REQUIRE(images->find(0) != nullptr);
    library.close_gate();
    images->want(List{1});
    REQUIRE(images->find(0) != nullptr); // in place of 1, which is not there
    library.open_gate();
    images->wait_idle();
    REQUIRE(images->find(1) != nullptr);
    CHECK(images->statistics().bytes == bytes_of(0) + bytes_of(1));
    // Once 0 is shown no more it goes, although nothing else needs its room.
    want(*images, {1});
    CHECK(images->statistics().bytes == bytes_of(0) + bytes_of(1));
    want(*images, {1});
    CHECK(images->statistics().bytes == bytes_of(1));
}

TEST_CASE("An image that is larger than the budget is held alone") {
    Library library(4);
    const Images images = open_images(library, bytes_of(1));
    want(*images, {0});
    want(*images, {3, 0});
    CHECK(present(*images, 4) == List{3});
    CHECK(images->statistics().bytes == bytes_of(3));
    // But not where it is not the most urgent one.
    want(*images, {});
    want(*images, {});
    want(*images, {0, 3});
    CHECK(present(*images, 4) == List{0});
}

TEST_CASE("What cannot be read is told, and not tried again") {
    Library library(4);
    library.break_image(2);
    library.set_bytes(3, bytes_of(3) - 1);
    const Images images = open_images(library, 10'000);
    want(*images, {2, 0});
    CHECK(images->find(2) == nullptr);
    CHECK(images->find(0) != nullptr);
    CHECK(images->statistics().failed == 1);
    REQUIRE(images->last_error().has_value());
    CHECK(images->last_error()->message == "image 2 is broken");
    want(*images, {2, 3});
    CHECK(library.reads() == List{2, 0, 3});
    CHECK(images->find(3) == nullptr);
    CHECK(images->statistics().failed == 2);
    CHECK(
        images->last_error()->message ==
        "paged images: image 3 takes " + std::to_string(bytes_of(3)) + " bytes, announced were " +
            std::to_string(bytes_of(3) - 1)
    );
    CHECK(images->statistics().bytes == bytes_of(0));
}

TEST_CASE("Images that a file does not have are passed over") {
    Library library(3);
    library.set_bytes(1, 0);
    const Images images = open_images(library, bytes_of(2));
    want(*images, {1, 2});
    CHECK(images->find(1) == nullptr);
    CHECK(images->find(2) != nullptr);
    CHECK(images->statistics().failed == 0);
    CHECK(library.reads() == List{2});
}

TEST_CASE("It ends while an image is read and others are wanted") {
    Library library(3);
    library.close_gate();
    Images images = open_images(library, 10'000);
    images->want(List{0, 1, 2});
    library.wait_for_reading();
    library.open_gate();
    images.reset();
    CHECK(library.reads().size() <= 3);
}

TEST_CASE("A walk among ten images of a file with memory for two") {
    TemporaryFolder folder;
    const auto path = folder.path() / "ten.placed";
    constexpr std::uint32_t kCount = 10;
    std::vector<LayeredDepthImage> made;
    std::uint64_t largest = 0;
    auto writer = io::PlacementWriter::open(path, hand_made_placement(kCount), {.level = 1});
    REQUIRE(writer.has_value());
    for (std::uint32_t i = 0; i < kCount; ++i) {
        made.push_back(hand_made_layers(i));
        largest = std::max(largest, memory_bytes(made.back()));
        REQUIRE(writer->add(i, made.back()).has_value());
    }
    REQUIRE(writer->finish().has_value());
    auto reader = io::PlacementReader::open(path);
    REQUIRE(reader.has_value());
    auto created = io::PagedImages::create(std::move(*reader), {.budget_bytes = 2 * largest});
    REQUIRE(created.has_value());
    io::PagedImages& images = **created;

    Random random(11);
    std::uint32_t at = 0;
    // What was found in this step and in the one before must be there still.
    std::deque<std::vector<std::pair<const LayeredDepthImage*, std::uint32_t>>> found(2);
    std::uint64_t finds = 0;
    for (int step = 0; step < 3000; ++step) {
        at = (at + random.below(3) + kCount - 1) % kCount;
        const std::array<std::uint32_t, 3> wanted{
            at, (at + 1) % kCount, (at + kCount - 1) % kCount};
        images.want(wanted);
        found.pop_front();
        found.emplace_back();
        // Sometimes the frame is slower than the disk.
        if (random.below(2) == 0) {
            images.wait_idle();
            CHECK(images.statistics().bytes <= 5 * largest);
            REQUIRE(images.find(at) != nullptr);
            ++finds;
        }
        for (std::uint32_t i = 0; i < kCount; i += 1 + random.below(3)) {
            ++finds;
            if (const LayeredDepthImage* const image = images.find(i)) {
                found.back().emplace_back(image, i);
            }
        }
        for (const auto& of_step : found) {
            for (const auto& [image, i] : of_step) {
                if (!(*image == made[i])) {
                    FAIL("image " << i << " is another in step " << step);
                }
            }
        }
    }
    const io::PagedImagesStatistics statistics = images.statistics();
    CHECK(statistics.hits + statistics.misses == finds);
    CHECK(statistics.loads > 100);
    CHECK(statistics.evictions > 100);
    CHECK(statistics.failed == 0);
    // Nothing is pinned any more, so that the budget holds.
    for (int i = 0; i < 3; ++i) {
        images.want(List{at});
        images.wait_idle();
    }
    want(images, {(at + 5) % kCount});
    CHECK(images.statistics().bytes <= 2 * largest);
}

TEST_CASE("Asking and finding allocate nothing") {
    Library library(10);
    const Images images = open_images(library, 10'000);
    const List all = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
    want(*images, all);
    const std::uint64_t before = allocation_count();
    for (std::uint32_t i = 0; i < 100; ++i) {
        images->want({all.data(), i % 10});
        (void)images->find(i % 10);
    }
    images->wait_idle();
    CHECK(allocation_count() == before);
}
