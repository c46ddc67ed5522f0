#include <farfield/image/region.hpp>

#include <catch2/catch.hpp>

#include <cstdint>

namespace {

using farfield::Region;

/// Texel by texel, on regions within -4 .. 11.
bool holds(const Region& region, std::int32_t x, std::int32_t y) {
    return x >= region.x && x < region.x + region.width && y >= region.y &&
           y < region.y + region.height;
}

/// Every region of up to 4 x 4 texels at -4 .. 4, empty ones included.
template <typename Visit>
void for_each_region(const Visit& visit) {
    for (std::int32_t code = 0; code < 9 * 9 * 5 * 5; code += 7) {
        visit(Region{code % 9 - 4, code / 9 % 9 - 4, code / 81 % 5, code / 405});
    }
}

} // namespace

TEST_CASE("area counts texels in 64 bits") {
    CHECK(area(Region{}) == 0);
    CHECK(area(Region{5, 5, 0, 7}) == 0);
    CHECK(area(Region{-3, 2, 4, 5}) == 20);
    CHECK(area(Region{0, 0, 2'000'000'000, 2'000'000'000}) == 4'000'000'000'000'000'000ULL);
}

TEST_CASE("regions that share an edge or a corner do not overlap") {
    const Region region{2, 3, 4, 5};
    CHECK(overlaps(region, region));
    CHECK_FALSE(overlaps(region, {6, 3, 4, 5}));
    CHECK_FALSE(overlaps(region, {2, 8, 4, 5}));
    CHECK_FALSE(overlaps(region, {6, 8, 1, 1}));
    CHECK(overlaps(region, {5, 7, 1, 1}));
    CHECK(contains(region, region));
    CHECK(contains(region, {3, 4, 2, 2}));
    CHECK_FALSE(contains(region, {3, 4, 4, 2}));
    CHECK_FALSE(contains({3, 4, 2, 2}, region));
    CHECK(unite(region, {-1, 20, 1, 2}) == Region{-1, 3, 7, 19});
    CHECK(area(intersect(region, {-1, 20, 1, 2})) == 0);
}

TEST_CASE("overlap, containment, union and what is shared agree with their texels") {
    for_each_region([](const Region& a) {
        for_each_region([&](const Region& b) {
            if (area(a) == 0 || area(b) == 0) {
                return;
            }
            const Region both = unite(a, b);
            bool shared = false;
            std::uint64_t shared_texels = 0;
            bool b_in_a = true;
            std::int32_t left = 100;
            std::int32_t right = -100;
            std::int32_t bottom = 100;
            std::int32_t top = -100;
            for (std::int32_t y = -4; y < 12; ++y) {
                for (std::int32_t x = -4; x < 12; ++x) {
                    const bool in_a = holds(a, x, y);
                    const bool in_b = holds(b, x, y);
                    shared = shared || (in_a && in_b);
                    shared_texels += in_a && in_b ? 1U : 0U;
                    b_in_a = b_in_a && (in_a || !in_b);
                    if (in_a || in_b) {
                        left = x < left ? x : left;
                        right = x > right ? x : right;
                        bottom = y < bottom ? y : bottom;
                        top = y > top ? y : top;
                    }
                }
            }
            const bool right_answers =
                overlaps(a, b) == shared && overlaps(b, a) == shared && contains(a, b) == b_in_a &&
                both == Region{left, bottom, right - left + 1, top - bottom + 1} &&
                area(intersect(a, b)) == shared_texels &&
                (!shared || (contains(a, intersect(a, b)) && contains(b, intersect(a, b))));
            if (!right_answers) {
                CAPTURE(a.x, a.y, a.width, a.height, b.x, b.y, b.width, b.height);
                REQUIRE(right_answers);
            }
        });
    });
}
