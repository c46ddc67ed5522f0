#include <farfield/eval/item_agreement.hpp>

#include <catch2/catch.hpp>

#include <string>

namespace {

using farfield::ItemId;
using farfield::PositionPicture;
namespace eval = farfield::eval;

/// '.' is background, a letter an item.
PositionPicture items(int width, int height, const std::string& cells) {
    PositionPicture picture{width, height, {}};
    for (const char cell : cells) {
        picture.texels.emplace_back().item =
            cell == '.' ? farfield::kNone<ItemId> : farfield::make_id<ItemId>(cell - 'a' + 0U);
    }
    return picture;
}

} // namespace

TEST_CASE("items of pictures that do not match are not compared", "[item_agreement]") {
    const PositionPicture good = items(2, 1, "ab");
    CHECK(eval::compare_items(good, good));
    CHECK_FALSE(eval::compare_items(PositionPicture{}, PositionPicture{}));
    CHECK_FALSE(eval::compare_items(good, items(1, 2, "ab")));
    const auto refused = eval::compare_items(good, items(2, 1, "a"));
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message == "second picture of 2x1 pixels holds 1 texels, expected 2");
}

TEST_CASE("background in both pictures counts nowhere", "[item_agreement]") {
    const auto nothing = eval::compare_items(items(3, 1, "..."), items(3, 1, "..."));
    REQUIRE(nothing);
    CHECK(nothing->pixels == 0);
    CHECK_FALSE(nothing->settled_fraction.has_value());
    CHECK_FALSE(nothing->equal_fraction.has_value());

    const auto some = eval::compare_items(items(5, 1, "...aa"), items(5, 1, "...aa"));
    REQUIRE(some);
    CHECK(some->pixels == 2);
    CHECK(some->settled_pixels == 1); // the other one has background beside it
    CHECK(some->equal_pixels == 1);
    CHECK(some->settled_fraction == 0.5);
    CHECK(some->equal_fraction == 1.0);

    const auto dot = eval::compare_items(items(1, 1, "a"), items(1, 1, "b"));
    REQUIRE(dot);
    CHECK(dot->settled_pixels == 1);
    CHECK(dot->equal_fraction == 0.0);

    const auto unsettled = eval::compare_items(items(2, 1, "ab"), items(2, 1, "ab"));
    REQUIRE(unsettled);
    CHECK(unsettled->settled_fraction == 0.0);
    CHECK_FALSE(unsettled->equal_fraction.has_value());
}

TEST_CASE("pixels are compared where both pictures are settled", "[item_agreement]") {
    const PositionPicture a = items(
        6,
        5,
        "aaabbb"
        "aaabbb"
        "aaabbb"
        "aaabbb"
        "aaabbb"
    );
    // The border has moved by one to the right, and one corner shows another item.
    const PositionPicture b = items(
        6,
        5,
        "aaaabb"
        "aaaabb"
        "aaaabb"
        "ccaabb"
        "ccaabb"
    );
    const auto same = eval::compare_items(a, a);
    REQUIRE(same);
    CHECK(same->pixels == 30);
    CHECK(same->settled_pixels == 20); // columns 2 and 3 are not
    CHECK(same->equal_pixels == 20);

    // Settled in a: columns 0, 1, 4 and 5; in b column 4 is not. Of columns 0 and 1 of b, rows 0
    // and 1 are settled on a, row 2 is not; rows 3 and 4 of column 0 are settled on c, of column 1
    // not. Column 5 is settled in both.
    const auto moved = eval::compare_items(a, b);
    const auto reversed = eval::compare_items(b, a);
    REQUIRE(moved);
    REQUIRE(reversed);
    CHECK(moved->settled_pixels == 4 + 1 + 5);
    CHECK(moved->equal_pixels == 4 + 5);
    CHECK(moved->equal_fraction == 0.9);
    CHECK(reversed->settled_pixels == moved->settled_pixels);
    CHECK(reversed->equal_pixels == moved->equal_pixels);

    // Background against an item counts as disagreement.
    PositionPicture hole = a;
    for (auto& texel : hole.texels) {
        texel.item = farfield::kNone<ItemId>;
    }
    const auto missing = eval::compare_items(a, hole);
    REQUIRE(missing);
    CHECK(missing->pixels == 30);
    CHECK(missing->settled_pixels == 20);
    CHECK(missing->equal_pixels == 0);
}
