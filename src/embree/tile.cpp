#include "embree/tile.hpp"

#include <glm/common.hpp>

#include <algorithm>
#include <limits>

namespace farfield::embree {

namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr float kMixedDepth = -std::numeric_limits<float>::infinity();

Color16 widened(std::uint32_t rgba) noexcept {
    Color16 color{};
    for (std::size_t channel = 0; channel < color.size(); ++channel) {
        color[channel] = static_cast<std::uint16_t>((rgba >> (8 * channel) & 0xFFU) << 8U);
    }
    return color;
}

/// Rounds a channel to 8 bits.
std::uint8_t rounded(std::uint32_t channel) noexcept {
    constexpr std::uint32_t kMost = 0xFF7F; // a step of 16 bits may have come on top of 1
    return static_cast<std::uint8_t>((std::min(channel, kMost) + 0x80U) >> 8U);
}

/// Rounds pixels in a row.
void round_row(const Color16* from, std::size_t count, std::uint32_t* to) noexcept {
    const std::uint16_t* channels = from->data();
    auto* bytes = reinterpret_cast<std::uint8_t*>(to);
    for (std::size_t i = 0; i < count * 4; ++i) {
        bytes[i] = rounded(channels[i]);
    }
}

std::uint32_t mean(std::span<const Color16> colors) noexcept {
    std::array<std::uint32_t, 4> sums{};
    for (const Color16& color : colors) {
        for (std::size_t channel = 0; channel < sums.size(); ++channel) {
            sums[channel] += color[channel];
        }
    }
    // Rounded once: the sum has a step of 8 bits for every sample.
    const auto count = static_cast<std::uint32_t>(colors.size());
    std::uint32_t rgba = 0;
    for (std::size_t channel = 0; channel < sums.size(); ++channel) {
        const std::uint32_t value = (sums[channel] + 0x80U * count) / (0x100U * count);
        rgba |= std::min(value, 0xFFU) << (8 * channel);
    }
    return rgba;
}

/// Position of a pixel of the tile in its target or page.
std::size_t place_of(const Region& region, std::size_t width, std::size_t row) noexcept {
    return (static_cast<std::size_t>(region.y) + row) * width + static_cast<std::size_t>(region.x);
}

void clear_tile(const PassWork& pass, TileBuffer& tile) noexcept {
    Color16 color{};
    const glm::vec4 clear = glm::clamp(pass.clear_color, 0.0F, 1.0F) * kColor16 + 0.5F;
    for (int channel = 0; channel < 4; ++channel) {
        color[static_cast<std::size_t>(channel)] = static_cast<std::uint16_t>(clear[channel]);
    }
    tile.colors.fill(color);
    tile.depths.fill(kNothing);
    if (!tile.positions.empty()) {
        std::fill(tile.positions.begin(), tile.positions.end(), PositionTexel());
    }
}

/// Takes up what the target shows already.
void load_tile(const PassWork& pass, const Region& region, TileBuffer& tile) noexcept {
    const Target& target = *pass.target;
    const auto samples = static_cast<std::size_t>(pass.samples);
    for (std::size_t row = 0; row < static_cast<std::size_t>(region.height); ++row) {
        const std::size_t first = place_of(region, static_cast<std::size_t>(target.width), row);
        for (std::size_t column = 0; column < static_cast<std::size_t>(region.width); ++column) {
            const std::size_t from = first + column;
            const std::size_t pixel = row * kTile + column;
            tile.colors[pixel] = widened(target.colors[from]);
            tile.depths[pixel] = target.depths[from];
            if (!tile.positions.empty()) {
                tile.positions[pixel] = target.positions[from];
            }
            if (target.mixed == nullptr || target.mixed[from] == 0) {
                continue;
            }
            tile.mix(pixel, samples);
            for (std::size_t sample = 0; sample < samples; ++sample) {
                tile.sample_colors[pixel * samples + sample] =
                    widened(target.sample_colors[from * samples + sample]);
                tile.sample_depths[pixel * samples + sample] =
                    target.sample_depths[from * samples + sample];
            }
        }
    }
}

/// What a page keeps of a depth.
std::uint16_t kept(float depth, const Pass& pass) noexcept {
    const float share = (depth - pass.copy_near) / (pass.copy_far - pass.copy_near);
    constexpr float kHalf = 0.5F;
    return static_cast<std::uint16_t>(std::clamp(share, 0.0F, 1.0F) * kNoKeptDepth + kHalf);
}

/// Keeps the depths of a row of pixels: of the nearest sample of those that show something.
void keep_row(
    const PassWork& pass, const TileBuffer& tile, std::size_t first, std::span<std::uint16_t> to
) noexcept {
    constexpr std::uint32_t kLeast = 0x80; // rounds to 1 of 255
    const auto samples = static_cast<std::size_t>(pass.samples);
    for (std::size_t i = 0; i < to.size(); ++i) {
        const std::size_t pixel = first + i;
        float nearest = kNothing;
        if (tile.mixed[pixel] == 0) {
            if (tile.colors[pixel][3] >= kLeast) {
                nearest = tile.depths[pixel];
            }
        } else {
            for (std::size_t sample = pixel * samples; sample < (pixel + 1) * samples; ++sample) {
                if (tile.sample_colors[sample][3] >= kLeast) {
                    nearest = std::min(nearest, tile.sample_depths[sample]);
                }
            }
        }
        to[i] = kept(nearest, *pass.pass);
    }
}

void store_tile(const PassWork& pass, const Region& region, const TileBuffer& tile) noexcept {
    const auto samples = static_cast<std::size_t>(pass.samples);
    const bool frame = pass.target != nullptr;
    const auto width = static_cast<std::size_t>(frame ? pass.target->width : pass.scratch->size);
    std::uint32_t* colors = frame ? pass.target->colors.get() : pass.scratch->colors.get();
    PositionTexel* positions = frame ? pass.target->positions.get() : pass.scratch->positions.get();
    for (std::size_t row = 0; row < static_cast<std::size_t>(region.height); ++row) {
        const std::size_t to = place_of(region, width, row);
        const std::size_t from = row * kTile;
        const auto count = static_cast<std::size_t>(region.width);
        round_row(&tile.colors[from], count, colors + to);
        for (std::size_t pixel = from; tile.any_mixed && pixel < from + count; ++pixel) {
            if (tile.mixed[pixel] != 0) {
                colors[to + pixel - from] =
                    mean(std::span(tile.sample_colors).subspan(pixel * samples, samples));
            }
        }
        if (positions != nullptr) {
            std::copy_n(
                tile.positions.begin() + static_cast<std::ptrdiff_t>(from), count, positions + to
            );
        }
        if (pass.keeps_depth) {
            keep_row(pass, tile, from, {pass.scratch->depths.get() + to, count});
        }
        if (!frame) {
            continue;
        }
        // A frame may be drawn on: its depths last, and so do samples that differ.
        Target& target = *pass.target;
        std::copy_n(
            tile.depths.begin() + static_cast<std::ptrdiff_t>(from), count, target.depths.get() + to
        );
        if (target.mixed == nullptr) {
            continue;
        }
        std::copy_n(
            tile.mixed.begin() + static_cast<std::ptrdiff_t>(from), count, target.mixed.get() + to
        );
        for (std::size_t column = 0; column < count; ++column) {
            if (tile.mixed[from + column] == 0) {
                continue;
            }
            for (std::size_t sample = 0; sample < samples; ++sample) {
                const std::size_t source = (from + column) * samples + sample;
                const std::size_t place = (to + column) * samples + sample;
                round_row(&tile.sample_colors[source], 1, &target.sample_colors[place]);
                target.sample_depths[place] = tile.sample_depths[source];
            }
        }
    }
}

} // namespace

void TileBuffer::mix(std::size_t pixel, std::size_t samples) noexcept {
    const auto first = static_cast<std::ptrdiff_t>(pixel * samples);
    std::fill_n(sample_colors.begin() + first, samples, colors[pixel]);
    std::fill_n(sample_depths.begin() + first, samples, depths[pixel]);
    std::fill_n(sample_orders.begin() + first, samples, orders[pixel]);
    depths[pixel] = kMixedDepth;
    mixed[pixel] = 1;
    any_mixed = true;
}

void Workspace::reserve(std::size_t draws, std::size_t samples, bool positions) {
    listed.reserve(draws);
    const std::size_t tangents = static_cast<std::size_t>(kTile) * samples;
    if (tangents_x.size() < tangents) {
        tangents_x.resize(tangents);
        tangents_y.resize(tangents);
    }
    const std::size_t stored = samples > 1 ? kTilePixels * samples : 0;
    if (tile.sample_colors.size() < stored) {
        tile.sample_colors.resize(stored);
        tile.sample_depths.resize(stored);
        tile.sample_orders.resize(stored);
    }
    if (positions && tile.positions.empty()) {
        tile.positions.resize(kTilePixels);
    }
}

void draw_tile(
    const CastScene& scene,
    const FrameWork& work,
    const TileTask& task,
    std::span<const glm::vec2> places,
    Workspace& workspace
) noexcept {
    const PassWork& pass = work.passes[task.pass];
    TileBuffer& tile = workspace.tile;
    tile.orders.fill(0);
    tile.mixed.fill(0);
    tile.any_mixed = false;
    if (pass.clear) {
        clear_tile(pass, tile);
    } else {
        load_tile(pass, task.region, tile);
    }
    std::uint32_t next_flat = 0;
    for (std::uint32_t i = 0; i < pass.phase_count; ++i) {
        const Phase& phase = work.phases[pass.first_phase + i];
        cast_tile(scene, work, task, phase, places, workspace);
        add_layers(work, task, phase, places.size(), tile);
        blend_tile(work, task, phase, places, next_flat, tile);
        if (i + 1 < pass.phase_count) {
            tile.orders.fill(0);
            std::fill(tile.sample_orders.begin(), tile.sample_orders.end(), 0U);
        }
    }
    store_tile(pass, task.region, tile);
}

} // namespace farfield::embree
