#pragma once

#include "support/random.hpp"
#include <farfield/eval/pixel_map.hpp>
#include <farfield/image/picture.hpp>

#include <cstddef>
#include <cstdint>

/// Pictures that tests of image errors share.
namespace farfield::test {

/// Place of a pixel in an array of rows from the top.
inline std::size_t pixel_at(int width, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
}

inline float at(const PixelMap& map, int x, int y) {
    return map.values[pixel_at(map.width, x, y)];
}

inline Picture filled(int width, int height, std::uint8_t r, std::uint8_t g, std::uint8_t b) {
    Picture picture{width, height, {}};
    picture.rgba.resize(4 * pixel_at(width, 0, height), 255);
    for (std::size_t i = 0; i < picture.rgba.size(); i += 4) {
        picture.rgba[i] = r;
        picture.rgba[i + 1] = g;
        picture.rgba[i + 2] = b;
    }
    return picture;
}

inline std::uint8_t& channel(Picture& picture, int x, int y, int index) {
    return picture.rgba[4 * pixel_at(picture.width, x, y) + static_cast<std::size_t>(index)];
}

inline std::uint8_t channel(const Picture& picture, int x, int y, int index) {
    return picture.rgba[4 * pixel_at(picture.width, x, y) + static_cast<std::size_t>(index)];
}

/// Every channel of every pixel on its own, alpha too.
inline Picture noise(int width, int height, std::uint64_t seed) {
    support::Random random(seed);
    Picture picture = filled(width, height, 0, 0, 0);
    for (std::uint8_t& value : picture.rgba) {
        value = static_cast<std::uint8_t>(random.below(256));
    }
    return picture;
}

/// A gradient with a bright disc and a thin dark line, all moved by `shift` pixels to the right.
inline Picture structured(int width, int height, int shift) {
    Picture picture = filled(width, height, 0, 0, 0);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const int u = x - shift;
            const bool disc =
                4 * ((u - width / 3) * (u - width / 3) + (y - height / 2) * (y - height / 2)) <
                height * height / 4;
            const bool line = u == 2 * width / 3;
            const int level = disc ? 230 : line ? 5 : 60 + 2 * u + y;
            channel(picture, x, y, 0) = static_cast<std::uint8_t>(level);
            channel(picture, x, y, 1) = static_cast<std::uint8_t>(disc ? 180 : level / 2 + 30);
            channel(picture, x, y, 2) = static_cast<std::uint8_t>(disc ? 20 : 255 - level);
        }
    }
    return picture;
}

} // namespace farfield::test
