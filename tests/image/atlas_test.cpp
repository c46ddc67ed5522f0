#include "support/allocation_counter.hpp"
#include "support/random.hpp"
#include <farfield/image/atlas.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <queue>
#include <vector>

namespace {

using farfield::Atlas;
using farfield::Region;
using farfield::support::Random;

/// Which texels of a page are in use, the slow and certain way.
class Occupancy {
  public:
    explicit Occupancy(std::int32_t size)
        : size_(size), taken_(static_cast<std::size_t>(size) * static_cast<std::size_t>(size)) {}

    /// False when the region leaves the page or meets another.
    [[nodiscard]] bool take(const Region& region) {
        if (!contains(Region{0, 0, size_, size_}, region)) {
            return false;
        }
        return for_all(region, [](std::uint8_t& texel) {
            const bool was_free = texel == 0;
            texel = 1;
            return was_free;
        });
    }
    /// False when a texel of the region was free.
    [[nodiscard]] bool give_back(const Region& region) {
        return for_all(region, [](std::uint8_t& texel) {
            const bool was_taken = texel == 1;
            texel = 0;
            return was_taken;
        });
    }
    [[nodiscard]] std::uint64_t used() const {
        return static_cast<std::uint64_t>(std::count(taken_.begin(), taken_.end(), 1));
    }

  private:
    [[nodiscard]] std::uint8_t& texel_at(std::int32_t x, std::int32_t y) {
        return taken_
            [static_cast<std::size_t>(y) * static_cast<std::size_t>(size_) +
             static_cast<std::size_t>(x)];
    }
    template <typename Visit>
    bool for_all(const Region& region, const Visit& visit) {
        bool all = true;
        for (std::int32_t y = region.y; y < region.y + region.height; ++y) {
            for (std::int32_t x = region.x; x < region.x + region.width; ++x) {
                all = visit(texel_at(x, y)) && all;
            }
        }
        return all;
    }

    std::int32_t size_;
    std::vector<std::uint8_t> taken_;
};

std::int32_t between(Random& random, std::int32_t least, std::int32_t most) {
    return least + static_cast<std::int32_t>(random.below(static_cast<unsigned>(most - least + 1)));
}

double fill(const Atlas& atlas) {
    return static_cast<double>(atlas.used_texels()) /
           (static_cast<double>(atlas.size()) * atlas.size());
}

/// Share of a page of 1024 texels in use when the first rectangle of 5 to 120 texels finds no
/// place. Each lives for a random number of the steps in which one is added; their mean number
/// grows slowly, so that nearly every rectangle has been replaced several times by then.
double fill_under_churn(std::uint64_t seed) {
    struct Living {
        std::uint64_t end;
        Region region;
        bool operator<(const Living& other) const { return end > other.end; }
    };
    Random random(seed);
    Atlas atlas(1024);
    std::priority_queue<Living> living;
    for (std::uint64_t step = 0;; ++step) {
        for (; !living.empty() && living.top().end <= step; living.pop()) {
            atlas.release(living.top().region);
        }
        const std::int32_t width = between(random, 5, 120);
        const std::optional<Region> region = atlas.allocate(width, between(random, 5, 120));
        if (!region) {
            return fill(atlas);
        }
        const double mean_life = 100.0 + static_cast<double>(step) / 30.0;
        const auto life = static_cast<std::uint64_t>(random.uniform(1.0, 2.0 * mean_life));
        living.push({step + life, *region});
    }
}

/// The same when nothing is ever released.
double fill_at_once(std::uint64_t seed) {
    Random random(seed);
    Atlas atlas(1024);
    for (;;) {
        const std::int32_t width = between(random, 5, 120);
        if (!atlas.allocate(width, between(random, 5, 120))) {
            return fill(atlas);
        }
    }
}

/// Random rectangles come and go; each is checked against the grid.
void churn(std::int32_t size, std::int32_t largest, int steps, std::uint64_t seed) {
    CAPTURE(size, largest, seed);
    Random random(seed);
    Atlas atlas(size);
    Occupancy grid(size);
    std::vector<Region> living;
    int refused = 0;
    for (int step = 0; step < steps; ++step) {
        CAPTURE(step);
        // Phases of growth and of decay, so that the page is full at times and empty at times.
        const bool grow = random.below(100) < (step / 500 % 2 == 0 ? 70U : 30U);
        if (grow || living.empty()) {
            const std::int32_t width = between(random, 1, largest);
            const std::int32_t height = between(random, 1, largest);
            const std::optional<Region> region = atlas.allocate(width, height);
            if (!region) {
                ++refused;
                continue;
            }
            const bool as_wanted = region->width == width && region->height == height;
            if (!as_wanted || !grid.take(*region)) {
                CAPTURE(region->x, region->y, region->width, region->height, width, height);
                FAIL("the region has another size, leaves the page or overlaps another");
            }
            living.push_back(*region);
        } else {
            const std::size_t chosen = random.below(static_cast<unsigned>(living.size()));
            if (!grid.give_back(living[chosen])) {
                FAIL("a living region was overwritten");
            }
            atlas.release(living[chosen]);
            living[chosen] = living.back();
            living.pop_back();
        }
        if (step % 100 == 0) {
            REQUIRE(atlas.used_texels() == grid.used());
        }
    }
    CHECK(refused > 0);
    for (const Region& region : living) {
        atlas.release(region);
    }
    CHECK(atlas.empty());
    CHECK(atlas.used_texels() == 0);
    // Whatever its history, an empty page is one piece.
    CHECK(atlas.allocate(size, size) == Region{0, 0, size, size});
}

} // namespace

TEST_CASE("an atlas takes single texels, the whole page and nothing larger") {
    for (const std::int32_t size : {1, 2, 3, 4, 5, 63, 64, 65, 255, 256, 257, 1000, 1024}) {
        CAPTURE(size);
        Atlas atlas(size);
        CHECK(atlas.size() == size);
        CHECK(atlas.empty());
        CHECK_FALSE(atlas.allocate(size + 1, 1));
        CHECK_FALSE(atlas.allocate(1, size + 1));
        CHECK_FALSE(atlas.allocate(size + 1, size + 1));
        CHECK(atlas.empty());

        const auto page = atlas.allocate(size, size);
        REQUIRE(page == Region{0, 0, size, size});
        CHECK(atlas.used_texels() == area(*page));
        CHECK_FALSE(atlas.allocate(1, 1));
        atlas.release(*page);
        CHECK(atlas.empty());

        const auto texel = atlas.allocate(1, 1);
        REQUIRE(texel.has_value());
        CHECK(contains(Region{0, 0, size, size}, *texel));
        CHECK(area(*texel) == 1);
        CHECK_FALSE(atlas.allocate(size, size));
        atlas.release(*texel);
        CHECK(atlas.allocate(size, size).has_value());
        atlas.clear();
        CHECK(atlas.empty());
        CHECK(atlas.allocate(size, size).has_value());
    }
}

TEST_CASE("full rows, full columns and equal tiles use a page up") {
    Atlas atlas(256);
    for (int row = 0; row < 8; ++row) {
        CHECK(atlas.allocate(256, 32).has_value());
    }
    CHECK(atlas.used_texels() == std::uint64_t{256} * 256);
    CHECK_FALSE(atlas.allocate(1, 1));
    atlas.clear();
    for (int column = 0; column < 4; ++column) {
        CHECK(atlas.allocate(64, 256).has_value());
    }
    CHECK(atlas.used_texels() == std::uint64_t{256} * 256);
    atlas.clear();
    for (int tile = 0; tile < 256; ++tile) {
        REQUIRE(atlas.allocate(16, 16).has_value());
    }
    CHECK(atlas.used_texels() == std::uint64_t{256} * 256);
}

TEST_CASE("what neighbours leave behind joins, whichever goes first") {
    // Four tiles in a square are released in each of the 24 orders.
    std::vector<std::size_t> order{0, 1, 2, 3};
    do {
        Atlas atlas(128);
        std::vector<Region> tiles;
        tiles.reserve(4);
        for (int tile = 0; tile < 4; ++tile) {
            tiles.push_back(atlas.allocate(64, 64).value());
        }
        REQUIRE_FALSE(atlas.allocate(1, 1));
        for (const std::size_t tile : order) {
            atlas.release(tiles[tile]);
        }
        REQUIRE(atlas.allocate(128, 128).has_value());
    } while (std::next_permutation(order.begin(), order.end()));
}

TEST_CASE("a page that is used up but for one hole fills the hole") {
    for (std::size_t hole = 0; hole < 64; ++hole) {
        Atlas atlas(256);
        std::vector<Region> tiles;
        tiles.reserve(64);
        for (int tile = 0; tile < 64; ++tile) {
            tiles.push_back(atlas.allocate(32, 32).value());
        }
        atlas.release(tiles[hole]);
        REQUIRE_FALSE(atlas.allocate(33, 1));
        REQUIRE_FALSE(atlas.allocate(1, 33));
        REQUIRE(atlas.allocate(32, 32) == tiles[hole]);
    }
}

TEST_CASE("regions never overlap and never leave the page") {
    churn(64, 70, 4000, 1); // some are larger than the page
    churn(67, 20, 4000, 2); // cells at the border are cut off
    churn(256, 60, 6000, 3);
    churn(300, 130, 4000, 4);
    churn(250, 45, 6000, 5);
    churn(49, 9, 6000, 6);
}

TEST_CASE("a page is well used when the first rectangle finds no place") {
    // Measured over 40 seeds: 0.58 to 0.72, median 0.67. Trying every place for every rectangle
    // does no better: it is what rectangles that cannot be moved come to.
    std::vector<double> fills;
    for (std::uint64_t seed = 1; seed <= 15; ++seed) {
        fills.push_back(fill_under_churn(seed));
        CHECK(fills.back() >= 0.5);
    }
    std::sort(fills.begin(), fills.end());
    CAPTURE(fills);
    CHECK(fills[7] >= 0.63);

    std::vector<double> at_once;
    for (std::uint64_t seed = 1; seed <= 15; ++seed) {
        at_once.push_back(fill_at_once(seed));
    }
    std::sort(at_once.begin(), at_once.end());
    CAPTURE(at_once);
    CHECK(at_once[7] >= 0.75);
}

TEST_CASE("an atlas does not touch the heap once it exists") {
    Random random(7);
    Atlas atlas(256);
    std::vector<Region> living;
    living.reserve(10'000);
    const std::uint64_t before = farfield::support::allocation_count();
    REQUIRE(before > 0); // the counter counts
    for (int step = 0; step < 3000; ++step) {
        const std::int32_t width = between(random, 1, 40);
        if (const auto region = atlas.allocate(width, between(random, 1, 40))) {
            living.push_back(*region);
        }
        if (living.size() > 50) {
            const std::size_t chosen = random.below(static_cast<unsigned>(living.size()));
            atlas.release(living[chosen]);
            living[chosen] = living.back();
            living.pop_back();
        }
    }
    atlas.clear();
    const std::uint64_t after = farfield::support::allocation_count();
    CHECK(after == before);
}
