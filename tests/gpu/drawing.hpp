#pragma once

#include <farfield/gpu/backend.hpp>
#include <farfield/image/picture.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <utility>

/// Pictures that a backend draws, and what their pixels are.
namespace farfield::support {

/// The frame as the backend draws it, over black unless told otherwise.
inline Picture draw(
    Backend& backend,
    const FramePlan& plan,
    int width,
    int height,
    int samples = 1,
    const FrameClear& clear = {}
) {
    const auto target = backend.create_target(width, height, samples);
    REQUIRE(target.has_value());
    const auto executed = backend.execute(plan, *target, clear);
    if (!executed) {
        FAIL(executed.error().message);
    }
    auto picture = backend.read_target(*target);
    REQUIRE(picture.has_value());
    backend.destroy_target(*target);
    return std::move(*picture);
}

using Color = std::array<int, 4>;

/// @param x, y [px] from the top left
inline Color color_at(const Picture& picture, int x, int y) {
    const auto first = (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                        static_cast<std::size_t>(x)) *
                       4;
    return {
        picture.rgba[first],
        picture.rgba[first + 1],
        picture.rgba[first + 2],
        picture.rgba[first + 3]};
}

/// Largest difference of a channel.
inline int distance(const Color& a, const Color& b) {
    int largest = 0;
    for (std::size_t channel = 0; channel < a.size(); ++channel) {
        largest = std::max(largest, std::abs(a[channel] - b[channel]));
    }
    return largest;
}

/// Pixels that differ by more than `tolerance` in some channel.
inline int count_different(const Picture& a, const Picture& b, int tolerance = 0) {
    REQUIRE(a.width == b.width);
    REQUIRE(a.height == b.height);
    int count = 0;
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            count += distance(color_at(a, x, y), color_at(b, x, y)) > tolerance ? 1 : 0;
        }
    }
    return count;
}

} // namespace farfield::support
