#include "support/random.hpp"
#include <farfield/eval/crop.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

using farfield::Picture;
using farfield::PictureWindow;
namespace eval = farfield::eval;

namespace {

Picture black(int width, int height) {
    Picture picture{width, height, {}};
    picture.rgba.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4);
    return picture;
}

std::uint8_t& red(Picture& picture, int x, int y) {
    return picture.rgba
        [(static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
          static_cast<std::size_t>(x)) *
         4];
}

} // namespace

TEST_CASE("the window in which pictures differ most", "[crop]") {
    const Picture reference = black(20, 10);
    CHECK(eval::most_different_window(reference, reference, 4, 3) == PictureWindow{0, 0, 4, 3});

    Picture picture = reference;
    red(picture, 13, 6) = 255;
    red(picture, 2, 2) = 100;
    // The first window that holds the brightest pixel, from the top and then from the left.
    CHECK(eval::most_different_window(reference, picture, 4, 3) == PictureWindow{10, 4, 4, 3});
    CHECK(eval::most_different_window(picture, reference, 1, 1) == PictureWindow{13, 6, 1, 1});
    // Alpha is not looked at.
    picture.rgba[3] = 255;
    CHECK(eval::most_different_window(reference, picture, 4, 3)->x == 10);
    // Pictures that are smaller than the window.
    CHECK(eval::most_different_window(reference, picture, 50, 3) == PictureWindow{0, 4, 20, 3});
    CHECK(eval::most_different_window(reference, picture, 50, 60) == PictureWindow{0, 0, 20, 10});
}

TEST_CASE("the window agrees with a search through all of them", "[crop]") {
    farfield::support::Random random(5);
    for (int repeat = 0; repeat < 20; ++repeat) {
        const int width = 1 + static_cast<int>(random.below(12));
        const int height = 1 + static_cast<int>(random.below(12));
        Picture a = black(width, height);
        Picture b = a;
        for (std::size_t i = 0; i < a.rgba.size(); ++i) {
            a.rgba[i] = static_cast<std::uint8_t>(random.below(256));
            b.rgba[i] = static_cast<std::uint8_t>(random.below(256));
        }
        const int wide = 1 + static_cast<int>(random.below(static_cast<unsigned>(width)));
        const int high = 1 + static_cast<int>(random.below(static_cast<unsigned>(height)));
        const auto sum = [&](int left, int top) {
            long total = 0;
            for (int y = top; y < top + high; ++y) {
                for (int x = left; x < left + wide; ++x) {
                    for (int channel = 0; channel < 3; ++channel) {
                        const std::size_t pixel =
                            static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                            static_cast<std::size_t>(x);
                        const std::size_t at = pixel * 4 + static_cast<std::size_t>(channel);
                        const long difference = a.rgba[at] - b.rgba[at];
                        total += difference * difference;
                    }
                }
            }
            return total;
        };
        long most = 0;
        for (int y = 0; y + high <= height; ++y) {
            for (int x = 0; x + wide <= width; ++x) {
                most = std::max(most, sum(x, y));
            }
        }
        const auto found = eval::most_different_window(a, b, wide, high);
        REQUIRE(found);
        CHECK(sum(found->x, found->y) == most);
    }
}

TEST_CASE("a part of a picture", "[crop]") {
    Picture picture = black(6, 5);
    for (int y = 0; y < 5; ++y) {
        for (int x = 0; x < 6; ++x) {
            red(picture, x, y) = static_cast<std::uint8_t>(10 * y + x);
        }
    }
    Picture part = eval::crop(picture, {2, 1, 3, 2});
    REQUIRE(part.width == 3);
    REQUIRE(part.height == 2);
    REQUIRE(part.rgba.size() == 24);
    CHECK(red(part, 0, 0) == 12);
    CHECK(red(part, 2, 1) == 24);
    CHECK(eval::crop(picture, {0, 0, 6, 5}) == picture);
}

TEST_CASE("windows without pixels and pictures that do not match are refused", "[crop]") {
    const Picture picture = black(6, 5);
    CHECK_FALSE(eval::most_different_window(picture, picture, 0, 3).has_value());
    CHECK_FALSE(eval::most_different_window(picture, picture, 3, -1).has_value());
    CHECK_FALSE(eval::most_different_window(picture, black(5, 6), 3, 3).has_value());
    CHECK_FALSE(eval::most_different_window({}, {}, 3, 3).has_value());
}
