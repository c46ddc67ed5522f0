#include "run/contact_sheet.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using farfield::Picture;
using farfield::run::contact_sheet;

constexpr int kGap = 8; // of the sheet, around and between

Picture plain(int width, int height, std::uint8_t shade) {
    return {
        width,
        height,
        std::vector<std::uint8_t>(
            static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4, shade
        )};
}

int red_at(const Picture& picture, int x, int y) {
    return picture.rgba
        [(static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
          static_cast<std::size_t>(x)) *
         4];
}

} // namespace

TEST_CASE("one picture has a white rim") {
    const std::array<Picture, 1> tiles = {plain(3, 2, 10)};
    const Picture sheet = contact_sheet(tiles, 1);
    REQUIRE(sheet.width == 3 + 2 * kGap);
    REQUIRE(sheet.height == 2 + 2 * kGap);
    REQUIRE(sheet.rgba.size() == std::size_t{19} * 18 * 4);
    for (int y = 0; y < sheet.height; ++y) {
        for (int x = 0; x < sheet.width; ++x) {
            const bool inside = x >= kGap && x < kGap + 3 && y >= kGap && y < kGap + 2;
            REQUIRE(red_at(sheet, x, y) == (inside ? 10 : 255));
        }
    }
}

TEST_CASE("pictures go row by row, and the last row may have gaps") {
    const std::array<Picture, 3> tiles = {plain(2, 5, 1), plain(2, 5, 2), plain(2, 5, 3)};
    const Picture sheet = contact_sheet(tiles, 2);
    REQUIRE(sheet.width == 2 * (2 + kGap) + kGap);
    REQUIRE(sheet.height == 2 * (5 + kGap) + kGap);
    const int right = 2 * kGap + 2;
    const int below = 2 * kGap + 5;
    CHECK(red_at(sheet, kGap, kGap) == 1);
    CHECK(red_at(sheet, kGap + 1, kGap + 4) == 1);
    CHECK(red_at(sheet, right, kGap) == 2);
    CHECK(red_at(sheet, kGap, below) == 3);
    CHECK(red_at(sheet, right, below) == 255);
}

TEST_CASE("more columns than pictures leave white to the right") {
    const std::array<Picture, 1> tiles = {plain(1, 1, 0)};
    const Picture sheet = contact_sheet(tiles, 3);
    CHECK(sheet.width == 3 * (1 + kGap) + kGap);
    CHECK(sheet.height == 1 + 2 * kGap);
    CHECK(red_at(sheet, kGap, kGap) == 0);
    CHECK(red_at(sheet, 2 * kGap + 1, kGap) == 255);
}
