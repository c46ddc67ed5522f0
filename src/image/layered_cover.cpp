#include "image/layered_cover.hpp"

#include <glm/mat4x3.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace farfield::detail {

namespace {

/// Samples that are projected in step.
constexpr std::size_t kBatch = 64;

// The loops over batches are written for vectors: no branches, numbers of one size in each.

/// The first whole number not below `edge`, of those in [0, end].
inline std::int32_t first_pixel(float edge, float end) noexcept {
    // In this form what is not a number becomes 0.
    const float inside = std::min(edge > 0.0F ? edge : 0.0F, end);
    const auto whole = static_cast<std::int32_t>(inside);
    return whole + static_cast<std::int32_t>(static_cast<float>(whole) < inside);
}

struct Placed {
    Covered covered;
    float depth = 0.0F; ///< [m] along the view direction
};

/// Where a sample is seen; of that which is not between the planes x1 is 0.
inline Placed place(
    const LayeredTerms& terms, const glm::vec2& end, float x, float y, float depth, float extent
) noexcept {
    const glm::mat4x3& columns = terms.columns;
    const float window_x =
        columns[0].x * x + columns[1].x * y + columns[2].x * depth + columns[3].x;
    const float window_y =
        columns[0].y * x + columns[1].y * y + columns[2].y * depth + columns[3].y;
    const float window_w =
        columns[0].z * x + columns[1].z * y + columns[2].z * depth + columns[3].z;
    const float z = window_w / (terms.inverse_step * depth + terms.inverse_far);
    const float inverse = 1.0F / window_w;
    const float half = extent * (0.5F * terms.size) * inverse;
    // A pixel's centre is half a pixel above its number.
    const float center_x = window_x * inverse - 0.5F;
    const float center_y = window_y * inverse - 0.5F;
    const auto is_between =
        static_cast<std::int32_t>((z >= terms.near_distance) & (z <= terms.far_distance));
    return {
        {first_pixel(center_x - half, end.x),
         first_pixel(center_x + half, end.x) & -is_between,
         first_pixel(center_y - half, end.y),
         first_pixel(center_y + half, end.y)},
        z};
}

glm::vec2 target_size(const LayeredJob& job) noexcept {
    return {static_cast<float>(job.width), static_cast<float>(job.height)};
}

/// Works out what `count` samples cover, and adds their rows to `rows`. @pre count <= kBatch
/// @param depths of the samples, or null
void cover_batch(
    const LayeredJob& job,
    const LayeredSample* samples,
    CoverCode* covered,
    float* depths,
    std::size_t count,
    RowRange& rows
) noexcept {
    // x and y, depth and extent of each sample, as they stand in memory.
    static_assert(offsetof(LayeredSample, x) == 0 && offsetof(LayeredSample, y) == 2);
    static_assert(offsetof(LayeredSample, depth) == 4 && offsetof(LayeredSample, extent) == 6);
    constexpr bool kLittle = std::endian::native == std::endian::little;
    constexpr int kFirst = kLittle ? 0 : 16;
    constexpr int kSecond = kLittle ? 16 : 0;
    constexpr std::uint32_t kMask = 0xFFFF;
    std::array<std::uint32_t, 2 * kBatch> pairs; // NOLINT(cppcoreguidelines-pro-type-member-init)
    for (std::size_t i = 0; i < count; ++i) {
        std::memcpy(&pairs[2 * i], &samples[i], 2 * sizeof(std::uint32_t));
    }
    // Whole numbers with a sign are turned into float with one instruction.
    const auto number = [&](std::uint32_t pair, int shift) {
        return static_cast<float>(static_cast<std::int32_t>((pair >> shift) & kMask));
    };
    const LayeredTerms terms = job.terms;
    const glm::vec2 end = target_size(job);
    std::array<std::int32_t, kBatch> lo; // NOLINT(cppcoreguidelines-pro-type-member-init)
    std::array<std::int32_t, kBatch> hi; // NOLINT(cppcoreguidelines-pro-type-member-init)
    std::array<float, kBatch> along;     // NOLINT(cppcoreguidelines-pro-type-member-init)
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t where = pairs[2 * i];
        const std::uint32_t rest = pairs[2 * i + 1];
        const auto [square, z] = place(
            terms,
            end,
            number(where, kFirst),
            number(where, kSecond),
            number(rest, kFirst),
            number(rest, kSecond)
        );
        const std::int32_t width = square.x1 - square.x0;
        const std::int32_t height = square.y1 - square.y0;
        const std::int32_t least = std::min(width, height);
        const std::int32_t most = std::max(width, height);
        const auto fine = static_cast<CoverCode>(square.x0) |
                          static_cast<CoverCode>(square.y0) << kPlaceBits |
                          static_cast<CoverCode>(width - 1) << (2 * kPlaceBits) |
                          static_cast<CoverCode>(height - 1) << (2 * kPlaceBits + kSideBits);
        const CoverCode shown = most > kMostSide ? kLarge : fine;
        covered[i] = least > 0 ? shown : kNothing;
        lo[i] = least > 0 ? square.y0 : INT32_MAX;
        hi[i] = least > 0 ? square.y1 : 0;
        along[i] = z;
    }
    if (depths != nullptr) {
        std::memcpy(depths, along.data(), count * sizeof(float));
    }
    for (std::size_t i = 0; i < count; ++i) {
        rows.lo = std::min(rows.lo, lo[i]);
        rows.hi = std::max(rows.hi, hi[i]);
    }
}

} // namespace

Covered cover(const LayeredJob& job, const LayeredSample& sample) noexcept {
    const Placed placed = place(
        job.terms,
        target_size(job),
        static_cast<float>(sample.x),
        static_cast<float>(sample.y),
        static_cast<float>(sample.depth),
        static_cast<float>(sample.extent)
    );
    return placed.covered;
}

void project_tiles(const LayeredJob& job, std::int32_t tile_row) noexcept {
    const LayeredDepthImage& image = job.image;
    const std::int32_t columns = image.view.width;
    const std::int32_t row_end = std::min((tile_row + 1) * kTile, image.view.height);
    const auto first_tile =
        static_cast<std::size_t>(tile_row) * static_cast<std::size_t>(job.tiles_across);
    const std::span<RowRange> tiles =
        job.tiles.subspan(first_tile, static_cast<std::size_t>(job.tiles_across));
    std::fill(tiles.begin(), tiles.end(), RowRange{});
    for (std::int32_t row = tile_row * kTile; row < row_end; ++row) {
        const auto at = static_cast<std::size_t>(row);
        std::uint32_t next = image.rows[at];
        std::size_t texel = at * static_cast<std::size_t>(columns);
        for (RowRange& tile : tiles) {
            const std::uint32_t begin = next;
            const std::size_t texel_end =
                std::min(texel + kTile, (at + 1) * static_cast<std::size_t>(columns));
            for (; texel < texel_end; ++texel) {
                job.firsts[texel] = next;
                next += image.counts[texel];
            }
            for (std::size_t i = begin; i < next; i += kBatch) {
                const std::size_t count = std::min<std::size_t>(kBatch, next - i);
                float* depths = job.depths.empty() ? nullptr : &job.depths[i];
                cover_batch(job, &image.samples[i], &job.covered[i], depths, count, tile);
            }
        }
    }
}

} // namespace farfield::detail
