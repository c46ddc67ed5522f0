#include "image/layered_cover.hpp"
#include "image/layered_order.hpp"
#include "image/layered_rays.hpp"
#include <farfield/image/layered_warp.hpp>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <limits>
#include <span>

namespace farfield {

namespace {

using detail::Band;
using detail::corner_ray;
using detail::CoverCode;
using detail::Covered;
using detail::kTile;
using detail::LayeredJob;
using detail::RowRange;
using detail::tangents_per_step;
using glm::dvec2;
using glm::dvec3;

constexpr std::uint32_t kNoSample = UINT32_MAX;
/// [px] Rows of the target that one task draws.
constexpr std::int32_t kBand = 48;
constexpr double kDepthSteps = 65535.0;

/// What a pixel shows, the less the nearer: the bits of a depth, which are in the order of depths
/// as these are above 0, then the number of the sample.
using PixelKey = std::uint64_t;
constexpr int kSampleBits = 32;

PixelKey pixel_key(float depth, std::uint32_t sample) noexcept {
    return PixelKey{std::bit_cast<std::uint32_t>(depth)} << kSampleBits | sample;
}

/// Draws all samples into some rows of the target, in the order in which they are stored: the least
/// key of a pixel stays.
class KeyWriter {
  public:
    KeyWriter(const LayeredJob& job, const Band& band, std::span<PixelKey> keys) noexcept
        : job_(job), band_(band), keys_(keys) {}

    void write() const noexcept {
        const LayeredDepthImage& image = job_.image;
        for (std::int32_t row = 0; row < image.view.height; ++row) {
            for (std::int32_t column = 0; column < image.view.width; column += kTile) {
                if (!detail::reaches(job_, column, row, band_)) {
                    continue;
                }
                const std::size_t texel =
                    static_cast<std::size_t>(row) * static_cast<std::size_t>(image.view.width) +
                    static_cast<std::size_t>(column);
                const std::int32_t count = std::min(kTile, image.view.width - column);
                const std::uint32_t end = job_.firsts[texel + static_cast<std::size_t>(count)];
                for (std::uint32_t i = job_.firsts[texel]; i < end; ++i) {
                    draw(i);
                }
            }
        }
    }

  private:
    void draw(std::uint32_t sample) const noexcept {
        const CoverCode code = job_.covered[sample];
        if (code >= detail::kLarge) {
            if (code == detail::kLarge) {
                fill(detail::cover(job_, job_.image.samples[sample]), sample);
            }
            return;
        }
        const Covered covered = detail::decoded(code);
        const std::int32_t y0 = std::max(covered.y0, band_.lo);
        const std::int32_t y1 = std::min(covered.y1, band_.hi);
        if (y0 >= y1) {
            return;
        }
        if (covered.x1 - covered.x0 > 2 || y1 - y0 > 2) {
            fill(covered, sample);
            return;
        }
        // As with rings: most are so small, and to write twice is faster than to ask how small.
        const PixelKey key = pixel_key(job_.depths[sample], sample);
        PixelKey* first = row_at(y0);
        PixelKey* last = row_at(y1 - 1);
        for (PixelKey* pixel :
             {first + covered.x0,
              first + covered.x1 - 1,
              last + covered.x0,
              last + covered.x1 - 1}) {
            *pixel = std::min(*pixel, key);
        }
    }

    void fill(const Covered& covered, std::uint32_t sample) const noexcept {
        const PixelKey key = pixel_key(job_.depths[sample], sample);
        const std::int32_t y1 = std::min(covered.y1, band_.hi);
        for (std::int32_t y = std::max(covered.y0, band_.lo); y < y1; ++y) {
            PixelKey* row = row_at(y);
            for (std::int32_t x = covered.x0; x < covered.x1; ++x) {
                row[x] = std::min(row[x], key);
            }
        }
    }

    [[nodiscard]] PixelKey* row_at(std::int32_t y) const noexcept {
        return keys_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(job_.width);
    }

    const LayeredJob& job_;
    Band band_;
    std::span<PixelKey> keys_;
};

/// Colours and depths of the pixels [first, end).
/// @param shown_at says which sample a pixel shows
template <typename ShownAt>
void resolve(
    const LayeredJob& job,
    std::size_t first,
    std::size_t end,
    WarpedLayers& warped,
    ShownAt shown_at
) noexcept {
    constexpr std::size_t kAhead = 24;
    const LayeredTerms& terms = job.terms;
    const glm::mat4x3& columns = terms.columns;
    for (std::size_t pixel = first; pixel < end; ++pixel) {
        const std::uint32_t shown = shown_at(pixel);
        if (shown == kNoSample) {
            warped.colors[pixel] = glm::vec<4, std::uint8_t>(0);
            warped.depths[pixel] = std::numeric_limits<float>::infinity();
            continue;
        }
        const std::uint32_t later = shown_at(std::min(pixel + kAhead, end - 1));
        detail::prefetch(job.image.samples.data() + (later == kNoSample ? 0 : later));
        const LayeredSample& sample = job.image.samples[shown];
        const auto x = static_cast<float>(sample.x);
        const auto y = static_cast<float>(sample.y);
        const auto depth = static_cast<float>(sample.depth);
        // As it was projected, so that it is between near and far plane for certain.
        const float w = columns[0].z * x + columns[1].z * y + columns[2].z * depth + columns[3].z;
        warped.colors[pixel] = sample.color;
        warped.depths[pixel] = w / (terms.inverse_step * depth + terms.inverse_far);
    }
}

} // namespace

LayeredTerms layered_terms(const LayeredDepthImage& image, const View& view) noexcept {
    const View& from = image.view;
    const dvec2 texel = tangents_per_step(from);
    const dvec2 pixel = tangents_per_step(view);
    const glm::dmat3 world_to_camera = glm::transpose(view.camera_to_world);
    const glm::dmat3 turn = world_to_camera * from.camera_to_world;
    const dvec3 shift = world_to_camera * (from.eye - view.eye);
    const double inverse_far = 1.0 / image.far_depth;
    const double inverse_step = (1.0 / image.near_depth - inverse_far) / kDepthSteps;
    // A point over its depth from the image's eye, in the axes of the view, is affine in texels and
    // inverse depth.
    const std::array<dvec3, 4> seen = {
        turn[0] * (texel.x / kLayeredSteps),
        turn[1] * (texel.y / kLayeredSteps),
        shift * inverse_step,
        turn * corner_ray(from) + shift * inverse_far};
    LayeredTerms terms;
    for (int i = 0; i < 4; ++i) {
        const dvec3& column = seen[static_cast<std::size_t>(i)];
        terms.columns[i] = glm::vec3(
            (column.x + view.lens.left * column.z) / pixel.x,
            (column.y + view.lens.bottom * column.z) / pixel.y,
            -column.z
        );
    }
    constexpr double kExtentSteps = 256.0;
    terms.inverse_step = static_cast<float>(inverse_step);
    terms.inverse_far = static_cast<float>(inverse_far);
    terms.size =
        static_cast<float>(std::max(texel.x, texel.y) / std::min(pixel.x, pixel.y) / kExtentSteps);
    terms.near_distance = static_cast<float>(view.lens.near_distance);
    terms.far_distance = static_cast<float>(view.lens.far_distance);
    return terms;
}

struct LayeredWarper::Impl {
    std::vector<CoverCode> covered;
    std::vector<float> depths;
    std::vector<std::uint32_t> firsts;
    std::vector<RowRange> tiles;
    std::vector<std::uint32_t> shown; ///< in order, where samples are not kept
    std::vector<PixelKey> keys;       ///< by depth

    /// Makes room for what an image and a view need.
    LayeredJob prepare(const LayeredDepthImage& image, const View& view, bool by_depth) {
        LayeredJob job{.image = image, .terms = layered_terms(image, view)};
        job.width = view.width;
        job.height = view.height;
        job.tiles_across = (image.view.width + kTile - 1) / kTile;
        job.tiles_up = (image.view.height + kTile - 1) / kTile;
        covered.resize(image.samples.size());
        depths.resize(by_depth ? image.samples.size() : 0);
        firsts.resize(image.counts.size() + 1);
        firsts.back() = static_cast<std::uint32_t>(image.samples.size());
        tiles.resize(
            static_cast<std::size_t>(job.tiles_across) * static_cast<std::size_t>(job.tiles_up)
        );
        job.covered = covered;
        job.depths = depths;
        job.firsts = firsts;
        job.tiles = tiles;
        return job;
    }
};

LayeredWarper::LayeredWarper() : impl_(std::make_unique<Impl>()) {}
LayeredWarper::~LayeredWarper() = default;
LayeredWarper::LayeredWarper(LayeredWarper&&) noexcept = default;
LayeredWarper& LayeredWarper::operator=(LayeredWarper&&) noexcept = default;

void LayeredWarper::warp(
    const LayeredDepthImage& image,
    const View& view,
    Executor& executor,
    WarpedLayers& warped,
    bool keep_samples,
    LayeredFront front
) noexcept {
    const auto across = static_cast<std::size_t>(view.width);
    const std::size_t pixels = across * static_cast<std::size_t>(view.height);
    const bool by_depth = front == LayeredFront::depth;
    warped.width = view.width;
    warped.height = view.height;
    warped.colors.resize(pixels);
    warped.depths.resize(pixels);
    warped.samples.resize(keep_samples ? pixels : 0);
    const LayeredJob job = impl_->prepare(image, view, by_depth);
    // Functions that keep one reference need no memory of their own.
    executor.run(static_cast<std::size_t>(job.tiles_up), [&job](std::size_t i) {
        detail::project_tiles(job, static_cast<std::int32_t>(i));
    });
    const auto bands = static_cast<std::size_t>((view.height + kBand - 1) / kBand);
    const auto band_of = [&](std::size_t i) {
        const auto lo = static_cast<std::int32_t>(i) * kBand;
        return Band{lo, std::min(lo + kBand, view.height)};
    };
    if (by_depth) {
        std::vector<PixelKey>& keys = impl_->keys;
        keys.resize(pixels);
        const auto draw = [&](std::size_t i) {
            const Band band = band_of(i);
            const std::size_t first = static_cast<std::size_t>(band.lo) * across;
            const std::size_t end = static_cast<std::size_t>(band.hi) * across;
            const PixelKey none = pixel_key(std::numeric_limits<float>::infinity(), kNoSample);
            std::fill(keys.data() + first, keys.data() + end, none);
            KeyWriter(job, band, keys).write();
            const auto shown_at = [&](std::size_t pixel) {
                return static_cast<std::uint32_t>(keys[pixel]);
            };
            if (keep_samples) {
                for (std::size_t pixel = first; pixel < end; ++pixel) {
                    warped.samples[pixel] = shown_at(pixel);
                }
            }
            resolve(job, first, end, warped, shown_at);
        };
        executor.run(bands, [&draw](std::size_t i) { draw(i); });
        return;
    }
    std::vector<std::uint32_t>& shown = keep_samples ? warped.samples : impl_->shown;
    shown.resize(pixels);
    const detail::RingOrder order = detail::ring_order(image, view);
    const auto draw = [&](std::size_t i) {
        const Band band = band_of(i);
        const std::size_t first = static_cast<std::size_t>(band.lo) * across;
        const std::size_t end = static_cast<std::size_t>(band.hi) * across;
        std::fill(shown.data() + first, shown.data() + end, kNoSample);
        detail::draw_rings(job, order, band, shown);
        resolve(job, first, end, warped, [&](std::size_t pixel) { return shown[pixel]; });
    };
    executor.run(bands, [&draw](std::size_t i) { draw(i); });
}

} // namespace farfield
