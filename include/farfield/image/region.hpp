#pragma once

#include <cstdint>

namespace farfield {

/// Rectangle of texels or pixels; origin at the lower left, y up, as in OpenGL.
struct Region {
    std::int32_t x = 0;
    std::int32_t y = 0;
    std::int32_t width = 0;
    std::int32_t height = 0;

    friend bool operator==(const Region&, const Region&) = default;
};

/// Texels covered.
[[nodiscard]] constexpr std::uint64_t area(const Region& region) noexcept {
    return static_cast<std::uint64_t>(region.width) * static_cast<std::uint64_t>(region.height);
}

/// True when the two share a texel.
[[nodiscard]] constexpr bool overlaps(const Region& a, const Region& b) noexcept {
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height &&
           b.y < a.y + a.height;
}

/// True when `inner` lies within `outer`.
[[nodiscard]] constexpr bool contains(const Region& outer, const Region& inner) noexcept {
    return inner.x >= outer.x && inner.y >= outer.y &&
           inner.x + inner.width <= outer.x + outer.width &&
           inner.y + inner.height <= outer.y + outer.height;
}

/// What both share; of no width or height where they share nothing.
[[nodiscard]] constexpr Region intersect(const Region& a, const Region& b) noexcept {
    const std::int32_t x = a.x > b.x ? a.x : b.x;
    const std::int32_t y = a.y > b.y ? a.y : b.y;
    const std::int32_t right = a.x + a.width < b.x + b.width ? a.x + a.width : b.x + b.width;
    const std::int32_t top = a.y + a.height < b.y + b.height ? a.y + a.height : b.y + b.height;
    return {x, y, right > x ? right - x : 0, top > y ? top - y : 0};
}

/// Smallest region around both.
[[nodiscard]] constexpr Region unite(const Region& a, const Region& b) noexcept {
    const std::int32_t x = a.x < b.x ? a.x : b.x;
    const std::int32_t y = a.y < b.y ? a.y : b.y;
    const std::int32_t right = a.x + a.width > b.x + b.width ? a.x + a.width : b.x + b.width;
    const std::int32_t top = a.y + a.height > b.y + b.height ? a.y + a.height : b.y + b.height;
    return {x, y, right - x, top - y};
}

} // namespace farfield
