#include "support/random.hpp"
#include <farfield/policy/image_budget.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdint>
#include <list>
#include <vector>

namespace {

using farfield::ImageBudget;
using farfield::RecencyList;
using farfield::support::Random;

} // namespace

TEST_CASE("a budget of nothing gives nothing") {
    ImageBudget budget(0);
    CHECK_FALSE(budget.take(1));
    CHECK_FALSE(budget.take(UINT64_MAX));
    CHECK(budget.take(0));
    CHECK(budget.used_bytes() == 0);
    CHECK(budget.peak_bytes() == 0);
}

TEST_CASE("a budget is used up to its last byte and no further") {
    ImageBudget budget(100);
    CHECK(budget.limit_bytes() == 100);
    CHECK(budget.take(60));
    CHECK_FALSE(budget.take(41));
    CHECK(budget.used_bytes() == 60); // a refusal takes nothing
    CHECK(budget.take(40));
    CHECK_FALSE(budget.take(1));
    CHECK(budget.used_bytes() == 100);
    budget.give_back(70);
    CHECK(budget.used_bytes() == 30);
    CHECK(budget.peak_bytes() == 100);
    CHECK(budget.take(70));
}

TEST_CASE("a budget does not overflow") {
    ImageBudget budget(UINT64_MAX);
    CHECK(budget.take(UINT64_MAX - 1));
    CHECK_FALSE(budget.take(2));
    CHECK_FALSE(budget.take(UINT64_MAX));
    CHECK(budget.take(1));
    CHECK_FALSE(budget.take(1));
    CHECK(budget.used_bytes() == UINT64_MAX);

    ImageBudget small(10);
    CHECK(small.take(5));
    CHECK_FALSE(small.take(UINT64_MAX));
    CHECK_FALSE(small.take(UINT64_MAX - 4)); // 5 + (2^64 - 5) would wrap to 0
    CHECK(small.used_bytes() == 5);
}

TEST_CASE("a budget stays under its limit and remembers its peak") {
    Random random(1);
    constexpr std::uint64_t kLimit = 10'000;
    ImageBudget budget(kLimit);
    std::vector<std::uint64_t> taken;
    std::uint64_t used = 0;
    std::uint64_t peak = 0;
    int refusals = 0;
    for (int step = 0; step < 20'000; ++step) {
        if (random.below(2) == 0) {
            const std::uint64_t bytes = random.below(2'000);
            const bool fits = used + bytes <= kLimit;
            REQUIRE(budget.take(bytes) == fits);
            refusals += fits ? 0 : 1;
            if (fits) {
                taken.push_back(bytes);
                used += bytes;
                peak = std::max(peak, used);
            }
        } else if (!taken.empty()) {
            const std::size_t chosen = random.below(static_cast<unsigned>(taken.size()));
            budget.give_back(taken[chosen]);
            used -= taken[chosen];
            taken.erase(taken.begin() + static_cast<std::ptrdiff_t>(chosen));
        }
        REQUIRE(budget.used_bytes() == used);
        REQUIRE(budget.peak_bytes() == peak);
    }
    CHECK(refusals > 100);
}

TEST_CASE("an empty list has no oldest entry") {
    RecencyList list;
    CHECK(list.oldest() == RecencyList::kNothing);
    list.remove(0); // never seen
    list.remove(1'000);
    CHECK(list.oldest() == RecencyList::kNothing);
    list.touch(5);
    CHECK(list.oldest() == 5);
    list.remove(4); // known by number, not in the list
    CHECK(list.oldest() == 5);
    list.remove(5);
    CHECK(list.oldest() == RecencyList::kNothing);
    list.remove(5);
    CHECK(list.oldest() == RecencyList::kNothing);
}

TEST_CASE("touching moves an entry behind all others") {
    RecencyList list;
    list.reserve(3);
    list.touch(0);
    list.touch(1);
    list.touch(2);
    list.touch(0);
    CHECK(list.oldest() == 1);
    list.touch(1);
    CHECK(list.oldest() == 2);
    list.touch(2);
    CHECK(list.oldest() == 0);
    list.touch(0);
    list.touch(0); // the newest again
    CHECK(list.oldest() == 1);
    list.remove(2);
    list.remove(1);
    CHECK(list.oldest() == 0);
}

TEST_CASE("a recency list does what a list of entries does") {
    Random random(2);
    RecencyList list;
    std::list<std::uint32_t> model;
    for (int step = 0; step < 50'000; ++step) {
        // Numbers grow in use, and phases of removal empty the list.
        const unsigned entries = 1 + static_cast<unsigned>(step) / 250;
        const std::uint32_t entry = random.below(entries);
        if (random.below(100) < (step / 5'000 % 2 == 0 ? 70U : 20U)) {
            model.remove(entry);
            model.push_back(entry);
            list.touch(entry);
        } else {
            model.remove(entry);
            list.remove(entry);
        }
        REQUIRE(list.oldest() == (model.empty() ? RecencyList::kNothing : model.front()));
    }
    // The whole order, not its end alone.
    REQUIRE(model.size() > 20);
    while (!model.empty()) {
        REQUIRE(list.oldest() == model.front());
        list.remove(model.front());
        model.pop_front();
    }
    CHECK(list.oldest() == RecencyList::kNothing);
}
