#include "pictures.hpp"
#include <farfield/eval/image_errors.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace {

using farfield::CoverageMask;
using farfield::Picture;
using farfield::test::channel;
using farfield::test::filled;
namespace eval = farfield::eval;

CoverageMask mask_of(int width, int height, const std::string& cells) {
    CoverageMask mask{width, height, {}};
    for (const char cell : cells) {
        mask.covered.push_back(cell == '#' ? 1 : 0);
    }
    return mask;
}

// Logarithms and quotients of exact integers are rounded a few times.
const double kRounding = 1e-12;

} // namespace

TEST_CASE("pictures that cannot be compared are refused by name", "[image_errors]") {
    const Picture good = filled(4, 3, 1, 2, 3);
    const auto empty = eval::psnr_db(Picture{}, good);
    REQUIRE_FALSE(empty);
    CHECK(empty.error().message == "reference is 0x0 pixels, expected at least 1x1");

    const auto sizes = eval::psnr_db(good, filled(3, 4, 1, 2, 3));
    REQUIRE_FALSE(sizes);
    CHECK(sizes.error().message == "picture is 3x4 pixels, reference is 4x3");

    Picture cut = good;
    cut.rgba.pop_back();
    const auto bytes = eval::psnr_db(good, cut);
    REQUIRE_FALSE(bytes);
    CHECK(bytes.error().message == "picture of 4x3 pixels holds 47 bytes, expected 48");

    CHECK_FALSE(eval::compare(good, cut, 0));
    CHECK_FALSE(eval::compare(good, good, -1));
    CHECK_FALSE(eval::compare(good, good, 256));
    const CoverageMask other = mask_of(1, 1, "#");
    CHECK_FALSE(eval::compare(good, good, 0, &other));
    CHECK_FALSE(eval::difference_picture(good, cut, 1.0));
    CHECK_FALSE(eval::difference_picture(good, good, -1.0));
    CHECK_FALSE(eval::difference_picture(good, good, std::numeric_limits<double>::quiet_NaN()));
    CHECK_FALSE(eval::coverage_by_background(cut, {0, 0, 0}));
    CHECK_FALSE(eval::coverage_by_background(good, {0, 0, 0}, 300));
    CHECK_FALSE(eval::coverage_by_alpha(cut));
    CHECK_FALSE(eval::compare_coverage(other, mask_of(2, 1, "##")));
    CHECK_FALSE(eval::compare_coverage(mask_of(2, 1, "#"), mask_of(2, 1, "##")));
    CHECK_FALSE(eval::find_sky_holes(other, CoverageMask{}));
}

TEST_CASE("psnr follows its closed form", "[image_errors]") {
    const Picture gray = filled(8, 5, 100, 100, 100);
    CHECK(*eval::psnr_db(gray, gray) == eval::kMaxPsnrDb);

    // Everything off by d: 20 log10(255 / d).
    for (const int d : {1, 2, 10, 155}) {
        const auto level = static_cast<std::uint8_t>(100 + d);
        const Picture other = filled(8, 5, level, level, level);
        CHECK(
            *eval::psnr_db(gray, other) == Approx(20.0 * std::log10(255.0 / d)).epsilon(kRounding)
        );
        CHECK(*eval::psnr_db(other, gray) == *eval::psnr_db(gray, other));
    }
    CHECK(*eval::psnr_db(filled(2, 2, 0, 0, 0), filled(2, 2, 255, 255, 255)) == 0.0);

    // One channel of one pixel of 40, off by 30: mean square 900 / 120.
    Picture spot = gray;
    channel(spot, 7, 4, 2) = 130;
    CHECK(
        *eval::psnr_db(gray, spot) ==
        Approx(10.0 * std::log10(255.0 * 255.0 / 7.5)).epsilon(kRounding)
    );

    // Alpha is not looked at.
    Picture clear = gray;
    channel(clear, 0, 0, 3) = 0;
    CHECK(*eval::psnr_db(gray, clear) == eval::kMaxPsnrDb);
}

TEST_CASE("psnr of an almost equal picture stops at the cap", "[image_errors]") {
    const Picture black = filled(640, 480, 0, 0, 0);
    Picture five = black;
    for (int x = 0; x < 5; ++x) {
        channel(five, x, 0, 0) = 1;
    }
    CHECK(*eval::psnr_db(black, five) == eval::kMaxPsnrDb);
    Picture seven = black;
    for (int x = 0; x < 7; ++x) {
        channel(seven, x, 0, 0) = 1;
    }
    const double expected = 10.0 * std::log10(255.0 * 255.0 * 640.0 * 480.0 * 3.0 / 7.0);
    CHECK(*eval::psnr_db(black, seven) == Approx(expected).epsilon(kRounding));
    CHECK(expected < eval::kMaxPsnrDb);
}

TEST_CASE("differences are counted per pixel and averaged per channel", "[image_errors]") {
    const Picture base = filled(10, 10, 50, 60, 70);
    Picture other = base;
    channel(other, 0, 0, 0) = 53; // by 3
    channel(other, 1, 0, 1) = 58; // by 2, which a threshold of 2 allows
    channel(other, 2, 0, 0) = 60; // by 10 and 20, but one pixel
    channel(other, 2, 0, 2) = 90;
    const auto all = eval::compare(base, other, 2);
    REQUIRE(all);
    CHECK(all->mean == Approx(35.0 / 300.0).epsilon(kRounding));
    CHECK(all->max == 20);
    CHECK(all->over_fraction == 0.02);
    CHECK(eval::compare(base, other, 1)->over_fraction == 0.03);
    CHECK(eval::compare(base, other, 20)->over_fraction == 0.0);
    const auto same = eval::compare(base, base, 0);
    CHECK(same->mean == 0.0);
    CHECK(same->max == 0);
    CHECK(same->over_fraction == 0.0);

    // Only the first two pixels of the first row.
    CoverageMask looked{10, 10, std::vector<std::uint8_t>(100, 0)};
    CHECK_FALSE(eval::compare(base, other, 2, &looked)->over_fraction.has_value());
    looked.covered[0] = 1;
    looked.covered[1] = 7; // any value but 0 covers
    const auto some = eval::compare(base, other, 2, &looked);
    REQUIRE(some);
    CHECK(some->mean == Approx(5.0 / 6.0).epsilon(kRounding));
    CHECK(some->max == 3);
    CHECK(some->over_fraction == 0.5);
}

TEST_CASE("the bars of an image's first frame can be told apart", "[image_errors]") {
    // 500 pixels, one of them beyond 2 / 255: 0.2 % exactly; a second is too many.
    const Picture base = filled(25, 20, 90, 90, 90);
    Picture one = filled(25, 20, 92, 90, 88);
    channel(one, 3, 3, 1) = 93;
    CHECK(*eval::compare(base, one, 2)->over_fraction <= 0.002);
    channel(one, 4, 4, 1) = 87;
    CHECK(*eval::compare(base, one, 2)->over_fraction > 0.002);
}

TEST_CASE("a difference picture is the amplified absolute difference", "[image_errors]") {
    const Picture a = filled(3, 2, 100, 0, 200);
    const Picture b = filled(3, 2, 90, 7, 255);
    CHECK(*eval::difference_picture(a, b, 1.0) == filled(3, 2, 10, 7, 55));
    CHECK(*eval::difference_picture(b, a, 4.0) == filled(3, 2, 40, 28, 220));
    CHECK(*eval::difference_picture(a, b, 8.0) == filled(3, 2, 80, 56, 255)); // 440 is clamped
    CHECK(*eval::difference_picture(a, b, 0.25) == filled(3, 2, 3, 2, 14));   // 2.5, 1.75, 13.75
    CHECK(*eval::difference_picture(a, b, 0.0) == filled(3, 2, 0, 0, 0));
    CHECK(*eval::difference_picture(a, a, 1e30) == filled(3, 2, 0, 0, 0));
}

TEST_CASE("coverage comes from a background colour or from alpha", "[image_errors]") {
    Picture picture = filled(4, 1, 10, 20, 30);
    channel(picture, 1, 0, 2) = 33;
    channel(picture, 2, 0, 0) = 6;
    channel(picture, 3, 0, 3) = 100;
    CHECK(*eval::coverage_by_background(picture, {10, 20, 30}) == mask_of(4, 1, ".##."));
    CHECK(*eval::coverage_by_background(picture, {10, 20, 30}, 3) == mask_of(4, 1, "..#."));
    CHECK(*eval::coverage_by_background(picture, {10, 20, 30}, 4) == mask_of(4, 1, "...."));
    CHECK(*eval::coverage_by_alpha(picture) == mask_of(4, 1, "###."));
    CHECK(*eval::coverage_by_alpha(picture, 100) == mask_of(4, 1, "####"));
    CHECK(*eval::coverage_by_alpha(picture, 101) == mask_of(4, 1, "###."));
}

TEST_CASE("missing and extra are shares of what the reference covers", "[image_errors]") {
    const auto errors = eval::compare_coverage(
        mask_of(
            5,
            2,
            "####."
            "....."
        ),
        mask_of(
            5,
            2,
            "#...#"
            "####."
        )
    );
    REQUIRE(errors);
    CHECK(errors->covered_pixels == 4);
    CHECK(errors->missing_pixels == 3);
    CHECK(errors->extra_pixels == 5);
    CHECK(errors->missing_fraction == 0.75);
    CHECK(errors->extra_fraction == 1.25);

    const auto nothing = eval::compare_coverage(mask_of(2, 1, ".."), mask_of(2, 1, "#."));
    REQUIRE(nothing);
    CHECK(nothing->extra_pixels == 1);
    CHECK_FALSE(nothing->missing_fraction.has_value());
    CHECK_FALSE(nothing->extra_fraction.has_value());
}

TEST_CASE("sky is found inside geometry but not on its border", "[image_errors]") {
    const CoverageMask reference = mask_of(
        6,
        5,
        "......"
        ".#####"
        ".#####"
        ".#####"
        ".#####"
    );
    // Inside: x in 2..5, y in 2..4, since nothing lies beyond the right and the lower edge.
    const auto none = eval::find_sky_holes(reference, reference);
    REQUIRE(none);
    CHECK(none->inside_pixels == 12);
    CHECK(none->pixels == 0);
    CHECK(none->first_x == -1);

    CoverageMask border = reference;
    for (const std::size_t pixel : {7U, 8U, 11U, 13U, 25U}) { // all next to the reference's sky
        border.covered[pixel] = 0;
    }
    CHECK(eval::find_sky_holes(reference, border)->pixels == 0);

    CoverageMask holes = border;
    holes.covered[2 * 6 + 3] = 0;
    holes.covered[4 * 6 + 5] = 0;
    const auto found = eval::find_sky_holes(reference, holes);
    REQUIRE(found);
    CHECK(found->pixels == 2);
    CHECK(found->first_x == 3);
    CHECK(found->first_y == 2);

    // A pixel of sky in the reference itself excuses all its neighbours.
    CoverageMask leafy = reference;
    leafy.covered[2 * 6 + 4] = 0;
    CHECK(eval::find_sky_holes(leafy, holes)->pixels == 1);
    // A picture of nothing but sky shows every inside pixel.
    CHECK(
        eval::find_sky_holes(reference, CoverageMask{6, 5, std::vector<std::uint8_t>(30)})
            ->pixels == 12
    );
}
