#include "embree/texture.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace farfield::embree {

namespace {

/// The two texels on either side of a place, and the weight of the second.
struct Pair {
    int first = 0;
    int second = 0;
    float share = 0.0F;
};

/// @param at [texel] from the edge of the first texel; clamped to the centres of the outer ones
Pair clamped_pair(float at, int size) noexcept {
    const float place = std::clamp(at - 0.5F, 0.0F, static_cast<float>(size - 1));
    const auto first = static_cast<int>(place);
    return {first, std::min(first + 1, size - 1), place - static_cast<float>(first)};
}

/// @param coordinate 1 is the whole size
Pair repeated_pair(float coordinate, int size) noexcept {
    const float wrapped = coordinate - std::floor(coordinate);
    const float place = wrapped * static_cast<float>(size) - 0.5F;
    const float floor = std::floor(place);
    // A coordinate just below a whole number may be wrapped to 1.
    const int first = (static_cast<int>(floor) + size) % size;
    return {first, first + 1 == size ? 0 : first + 1, place - floor};
}

} // namespace

MipTexture::MipTexture(const Texture& texture) {
    const auto pixels =
        static_cast<std::size_t>(texture.width) * static_cast<std::size_t>(texture.height);
    texels_.reserve(pixels * 4 / 3 + 1);
    levels_.push_back({texture.width, texture.height, 0});
    for (std::size_t i = 0; i < pixels; ++i) {
        const std::uint8_t* from = &texture.pixels[i * 4];
        texels_.emplace_back(from[0], from[1], from[2], from[3]);
    }
    while (levels_.back().width > 1 || levels_.back().height > 1) {
        const Level from = levels_.back();
        const Level to{std::max(from.width / 2, 1), std::max(from.height / 2, 1), texels_.size()};
        // Filtered at the centre of the new texel: the mean of four wherever sizes are even.
        const float step_x = static_cast<float>(from.width) / static_cast<float>(to.width);
        const float step_y = static_cast<float>(from.height) / static_cast<float>(to.height);
        for (int y = 0; y < to.height; ++y) {
            const Pair rows = clamped_pair((static_cast<float>(y) + 0.5F) * step_y, from.height);
            for (int x = 0; x < to.width; ++x) {
                const Pair columns =
                    clamped_pair((static_cast<float>(x) + 0.5F) * step_x, from.width);
                const auto texel = [&](int column, int row) {
                    return glm::vec4(
                        texels_[from.first + static_cast<std::size_t>(row * from.width + column)]
                    );
                };
                const glm::vec4 upper = glm::mix(
                    texel(columns.first, rows.first),
                    texel(columns.second, rows.first),
                    columns.share
                );
                const glm::vec4 lower = glm::mix(
                    texel(columns.first, rows.second),
                    texel(columns.second, rows.second),
                    columns.share
                );
                texels_.emplace_back(glm::u8vec4(glm::mix(upper, lower, rows.share) + 0.5F));
            }
        }
        levels_.push_back(to);
    }
}

glm::vec4 MipTexture::sample_level(const Level& level, const glm::vec2& uv) const noexcept {
    const Pair columns = repeated_pair(uv.x, level.width);
    const Pair rows = repeated_pair(uv.y, level.height);
    const glm::u8vec4* upper =
        &texels_[level.first + static_cast<std::size_t>(rows.first * level.width)];
    const glm::u8vec4* lower =
        &texels_[level.first + static_cast<std::size_t>(rows.second * level.width)];
    return glm::mix(
        glm::mix(glm::vec4(upper[columns.first]), glm::vec4(upper[columns.second]), columns.share),
        glm::mix(glm::vec4(lower[columns.first]), glm::vec4(lower[columns.second]), columns.share),
        rows.share
    );
}

glm::vec4 MipTexture::sample(const glm::vec2& uv, const glm::vec2& uv_dx, const glm::vec2& uv_dy)
    const noexcept {
    const glm::vec2 size(levels_[0].width, levels_[0].height);
    const glm::vec2 step_x = uv_dx * size;
    const glm::vec2 step_y = uv_dy * size;
    const float longest_sq = std::max(glm::dot(step_x, step_x), glm::dot(step_y, step_y));
    // Not for a texel larger than a pixel, nor for steps that are not finite at the horizon.
    if (!(longest_sq > 1.0F)) {
        return sample_level(levels_[0], uv);
    }
    const auto last = static_cast<float>(levels_.size() - 1);
    const float level = std::min(0.5F * std::log2(longest_sq), last);
    const auto finer = static_cast<std::size_t>(level);
    const std::size_t coarser = std::min(finer + 1, levels_.size() - 1);
    return glm::mix(
        sample_level(levels_[finer], uv),
        sample_level(levels_[coarser], uv),
        level - static_cast<float>(finer)
    );
}

} // namespace farfield::embree
