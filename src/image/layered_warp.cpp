// The order in which samples are drawn is that of McMillan, An image-based approach to
// three-dimensional computer graphics, 1997, in rings around the epipole instead of sheets beside
// it: those order points of one ray, and rings order, but for a texel or two, those of neighbouring
// rays as well, whose squares overlap.
#include <farfield/image/layered_warp.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>

namespace farfield {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr std::uint32_t kNoSample = UINT32_MAX;
/// [texel] Side of the tiles that are skipped as a whole.
constexpr std::int32_t kTile = 16;
/// [px] Rows of the target that one task writes.
constexpr std::int32_t kBand = 48;
/// Samples that are projected in step.
constexpr std::size_t kBatch = 64;
constexpr double kDepthSteps = 65535.0;

/// Pixels that a sample covers, in 32 bits for the sake of caches: the first one's x and y, 14 bits
/// each, then width and height less one, 2 bits each.
using CoverCode = std::uint32_t;
constexpr int kPlaceBits = 14;
constexpr int kSideBits = 2;
constexpr std::int32_t kMostSide = 1 << kSideBits;
constexpr CoverCode kPlaceMask = (1U << kPlaceBits) - 1;
constexpr CoverCode kSideMask = kMostSide - 1;
/// None; and more than there are bits for. Of squares these would leave the largest target.
constexpr CoverCode kNothing = UINT32_MAX;
constexpr CoverCode kLarge = UINT32_MAX - 1;

/// Pixels [x0, x1) x [y0, y1), none where x0 >= x1 or y0 >= y1.
struct Covered {
    std::int32_t x0 = 0;
    std::int32_t x1 = 0;
    std::int32_t y0 = 0;
    std::int32_t y1 = 0;
};

/// Rows [lo, hi) of the target.
struct RowRange {
    std::int32_t lo = INT32_MAX;
    std::int32_t hi = 0;
};

inline void prefetch(const void* address) noexcept {
#if defined(__GNUC__)
    __builtin_prefetch(address);
#else
    static_cast<void>(address);
#endif
}

/// Tangents of one texel, or of one pixel.
dvec2 tangents_per_step(const View& view) noexcept {
    const Lens& lens = view.lens;
    return {
        (lens.right - lens.left) / static_cast<double>(view.width),
        (lens.top - lens.bottom) / static_cast<double>(view.height)};
}

/// The ray through the lower left corner of a view's window, 1 m deep, in the view's own axes.
dvec3 corner_ray(const View& view) noexcept {
    return {view.lens.left, view.lens.bottom, -1.0};
}

/// Where in a layered image another eye is seen.
struct Epipole {
    std::int32_t column = 0;
    std::int32_t row = 0;
    bool outward = false; ///< what is farther is nearer to the epipole: the inner rings come first
};

Epipole find_epipole(const LayeredDepthImage& image, const dvec3& eye) noexcept {
    const View& view = image.view;
    const dvec3 seen = glm::transpose(view.camera_to_world) * (eye - view.eye);
    const double ahead = -seen.z;
    // In texels, times `ahead`.
    const dvec2 place = (dvec2(seen) - dvec2(corner_ray(view)) * ahead) / tangents_per_step(view);
    const double farthest = std::max(std::abs(place.x), std::abs(place.y));
    // From here every ring is a straight line in the image.
    constexpr double kFarTexels = 1 << 24;
    Epipole epipole;
    epipole.outward = ahead < 0.0;
    dvec2 texel(0.0);
    if (std::abs(ahead) * kFarTexels > farthest) {
        texel = place / ahead;
    } else if (farthest > 0.0) {
        texel = place / farthest * (epipole.outward ? -kFarTexels : kFarTexels);
    }
    epipole.column = static_cast<std::int32_t>(std::floor(texel.x));
    epipole.row = static_cast<std::int32_t>(std::floor(texel.y));
    return epipole;
}

/// How much farther a point gets along the view direction of `view` for each metre that it is
/// farther along that of the image: affine in the texels.
struct Recession {
    double per_column = 0.0;
    double per_row = 0.0;
    double corner = 0.0;

    [[nodiscard]] double at(double x, double y) const noexcept {
        return per_column * x + per_row * y + corner;
    }
};

Recession find_recession(const LayeredDepthImage& image, const View& view) noexcept {
    const View& from = image.view;
    const dvec3 forward = glm::transpose(from.camera_to_world) * -view.camera_to_world[2];
    const dvec2 step = tangents_per_step(from);
    return {forward.x * step.x, forward.y * step.y, glm::dot(forward, corner_ray(from))};
}

/// What a warp is of, for its tasks.
struct Job {
    const LayeredDepthImage& image;
    LayeredTerms terms{};
    std::int32_t width = 0; ///< of the target [px]
    std::int32_t height = 0;
    Epipole epipole{};
    Recession recession{};
    bool recedes = true; ///< in every texel what is farther from one eye is so from the other
    std::int32_t tiles_across = 0;
    std::int32_t tiles_up = 0;
    std::span<CoverCode> covered{};    ///< by sample
    std::span<std::uint32_t> firsts{}; ///< of the samples of each texel, and their end
    std::span<RowRange> tiles{};       ///< what the samples of each tile reach
    std::span<std::uint32_t> shown{};  ///< by pixel
    std::span<glm::vec<4, std::uint8_t>> colors{};
    std::span<float> depths{};
};

// The loops over batches are written for vectors: no branches, numbers of one size in each.

/// The first whole number not below `edge`, of those in [0, end].
inline std::int32_t first_pixel(float edge, float end) noexcept {
    // In this form what is not a number becomes 0.
    const float inside = std::min(edge > 0.0F ? edge : 0.0F, end);
    const auto whole = static_cast<std::int32_t>(inside);
    return whole + static_cast<std::int32_t>(static_cast<float>(whole) < inside);
}

/// What a sample covers; that which is not between the planes has x1 = 0.
inline Covered cover(
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
        first_pixel(center_x - half, end.x),
        first_pixel(center_x + half, end.x) & -is_between,
        first_pixel(center_y - half, end.y),
        first_pixel(center_y + half, end.y)};
}

glm::vec2 target_size(const Job& job) noexcept {
    return {static_cast<float>(job.width), static_cast<float>(job.height)};
}

Covered cover(const Job& job, const LayeredSample& sample) noexcept {
    return cover(
        job.terms,
        target_size(job),
        static_cast<float>(sample.x),
        static_cast<float>(sample.y),
        static_cast<float>(sample.depth),
        static_cast<float>(sample.extent)
    );
}

/// Works out what `count` samples cover, and adds their rows to `rows`. @pre count <= kBatch
void cover_batch(
    const Job& job,
    const LayeredSample* samples,
    CoverCode* covered,
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
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t place = pairs[2 * i];
        const std::uint32_t rest = pairs[2 * i + 1];
        const Covered square = cover(
            terms,
            end,
            number(place, kFirst),
            number(place, kSecond),
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
    }
    for (std::size_t i = 0; i < count; ++i) {
        rows.lo = std::min(rows.lo, lo[i]);
        rows.hi = std::max(rows.hi, hi[i]);
    }
}

/// Projects the samples of a row of tiles, and finds which rows of the target each tile reaches.
void project_tiles(const Job& job, std::int32_t tile_row) noexcept {
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
                cover_batch(job, &image.samples[i], &job.covered[i], count, tile);
            }
        }
    }
}

/// Draws all samples into some rows of the target.
class BandWriter {
  public:
    BandWriter(const Job& job, std::int32_t band) noexcept
        : job_(job), columns_(job.image.view.width), rows_(job.image.view.height),
          lo_(band * kBand), hi_(std::min(lo_ + kBand, job.height)) {}

    void write() const noexcept {
        const auto first = static_cast<std::size_t>(lo_) * static_cast<std::size_t>(job_.width);
        const auto end = static_cast<std::size_t>(hi_) * static_cast<std::size_t>(job_.width);
        std::fill(&job_.shown[0] + first, &job_.shown[0] + end, kNoSample);
        draw_rings();
        resolve(first, end);
    }

  private:
    void draw_rings() const noexcept {
        const Epipole& epipole = job_.epipole;
        // How far the image's first and last texel are from the epipole, along each axis.
        const std::int32_t left = -epipole.column;
        const std::int32_t right = columns_ - 1 - epipole.column;
        const std::int32_t bottom = -epipole.row;
        const std::int32_t top = rows_ - 1 - epipole.row;
        const std::int32_t least = std::max({0, left, -right, bottom, -top});
        const std::int32_t most = std::max({-left, right, -bottom, top});
        if (epipole.outward) {
            for (std::int32_t radius = least; radius <= most; ++radius) {
                draw_ring(radius);
            }
        } else {
            for (std::int32_t radius = most; radius >= least; --radius) {
                draw_ring(radius);
            }
        }
    }

    /// The texels whose larger distance along an axis is `radius`.
    void draw_ring(std::int32_t radius) const noexcept {
        const Epipole& epipole = job_.epipole;
        const std::int32_t left = epipole.column - radius;
        const std::int32_t right = epipole.column + radius;
        const std::int32_t bottom = epipole.row - radius;
        const std::int32_t top = epipole.row + radius;
        draw_row(bottom, left, right);
        if (radius > 0) {
            draw_row(top, left, right);
            draw_column(left, bottom + 1, top - 1);
            draw_column(right, bottom + 1, top - 1);
        }
    }

    void draw_row(std::int32_t row, std::int32_t first, std::int32_t last) const noexcept {
        if (row < 0 || row >= rows_) {
            return;
        }
        const std::int32_t end = std::min(last + 1, columns_);
        std::int32_t column = std::max(first, 0);
        while (column < end) {
            const std::int32_t tile_end = std::min((column / kTile + 1) * kTile, end);
            if (reaches(column, row)) {
                const std::size_t texel = texel_at(column, row);
                const auto count = static_cast<std::size_t>(tile_end - column);
                if (job_.recedes) {
                    // Of texels of one ring any may be the first.
                    draw_back_to_front(job_.firsts[texel], job_.firsts[texel + count]);
                } else {
                    for (std::size_t i = 0; i < count; ++i) {
                        draw_texel(texel + i);
                    }
                }
            }
            column = tile_end;
        }
    }

    void draw_column(std::int32_t column, std::int32_t first, std::int32_t last) const noexcept {
        if (column < 0 || column >= columns_) {
            return;
        }
        const std::int32_t end = std::min(last + 1, rows_);
        std::int32_t row = std::max(first, 0);
        while (row < end) {
            const std::int32_t tile_end = std::min((row / kTile + 1) * kTile, end);
            if (reaches(column, row)) {
                for (; row < tile_end; ++row) {
                    const std::size_t texel = texel_at(column, row);
                    constexpr std::int32_t kAhead = 8;
                    if (row + kAhead < rows_) {
                        prefetch(
                            &job_.covered
                                 [job_.firsts[texel + static_cast<std::size_t>(kAhead * columns_)]]
                        );
                    }
                    draw_texel(texel);
                }
            }
            row = tile_end;
        }
    }

    void draw_texel(std::size_t texel) const noexcept {
        const std::uint32_t begin = job_.firsts[texel];
        const std::uint32_t end = job_.firsts[texel + 1];
        if (job_.recedes) {
            draw_back_to_front(begin, end);
            return;
        }
        if (begin == end) {
            return;
        }
        const LayeredSample& sample = job_.image.samples[begin];
        const double x = static_cast<double>(sample.x) / kLayeredSteps;
        const double y = static_cast<double>(sample.y) / kLayeredSteps;
        if (job_.recession.at(x, y) >= 0.0) {
            draw_back_to_front(begin, end);
        } else {
            for (std::uint32_t i = begin; i < end; ++i) {
                draw(i);
            }
        }
    }

    void draw_back_to_front(std::uint32_t begin, std::uint32_t end) const noexcept {
        for (std::uint32_t i = end; i > begin; --i) {
            draw(i - 1);
        }
    }

    void draw(std::uint32_t sample) const noexcept {
        const CoverCode code = job_.covered[sample];
        if (code >= kLarge) {
            if (code == kLarge) {
                fill(cover(job_, job_.image.samples[sample]), sample);
            }
            return;
        }
        Covered covered;
        covered.x0 = static_cast<std::int32_t>(code & kPlaceMask);
        covered.y0 = static_cast<std::int32_t>(code >> kPlaceBits & kPlaceMask);
        covered.x1 =
            covered.x0 + 1 + static_cast<std::int32_t>(code >> (2 * kPlaceBits) & kSideMask);
        covered.y1 =
            covered.y0 + 1 + static_cast<std::int32_t>(code >> (2 * kPlaceBits + kSideBits));
        const std::int32_t y0 = std::max(covered.y0, lo_);
        const std::int32_t y1 = std::min(covered.y1, hi_);
        if (y0 >= y1) {
            return;
        }
        if (covered.x1 - covered.x0 > 2 || y1 - y0 > 2) {
            fill(covered, sample);
            return;
        }
        // Nearly all are so small, and no guess of how small is right often enough: without a
        // branch some pixels are written twice.
        std::uint32_t* first = row_at(y0);
        std::uint32_t* last = row_at(y1 - 1);
        first[covered.x0] = sample;
        first[covered.x1 - 1] = sample;
        last[covered.x0] = sample;
        last[covered.x1 - 1] = sample;
    }

    void fill(const Covered& covered, std::uint32_t sample) const noexcept {
        const std::int32_t y1 = std::min(covered.y1, hi_);
        for (std::int32_t y = std::max(covered.y0, lo_); y < y1; ++y) {
            std::fill(row_at(y) + covered.x0, row_at(y) + covered.x1, sample);
        }
    }

    [[nodiscard]] std::uint32_t* row_at(std::int32_t y) const noexcept {
        return job_.shown.data() +
               static_cast<std::size_t>(y) * static_cast<std::size_t>(job_.width);
    }

    /// Colours and depths of the samples that are shown in the pixels [first, end).
    void resolve(std::size_t first, std::size_t end) const noexcept {
        const LayeredTerms& terms = job_.terms;
        const glm::mat4x3& columns = terms.columns;
        for (std::size_t pixel = first; pixel < end; ++pixel) {
            const std::uint32_t shown = job_.shown[pixel];
            if (shown == kNoSample) {
                job_.colors[pixel] = glm::vec<4, std::uint8_t>(0);
                job_.depths[pixel] = std::numeric_limits<float>::infinity();
                continue;
            }
            const std::uint32_t later = job_.shown[std::min(pixel + 24, end - 1)];
            prefetch(job_.image.samples.data() + (later == kNoSample ? 0 : later));
            const LayeredSample& sample = job_.image.samples[shown];
            const auto x = static_cast<float>(sample.x);
            const auto y = static_cast<float>(sample.y);
            const auto depth = static_cast<float>(sample.depth);
            // As it was projected, so that it is between near and far plane for certain.
            const float w =
                columns[0].z * x + columns[1].z * y + columns[2].z * depth + columns[3].z;
            job_.colors[pixel] = sample.color;
            job_.depths[pixel] = w / (terms.inverse_step * depth + terms.inverse_far);
        }
    }

    [[nodiscard]] bool reaches(std::int32_t column, std::int32_t row) const noexcept {
        const RowRange& tile =
            job_.tiles[static_cast<std::size_t>(row / kTile * job_.tiles_across + column / kTile)];
        return tile.lo < hi_ && tile.hi > lo_;
    }

    [[nodiscard]] std::size_t texel_at(std::int32_t column, std::int32_t row) const noexcept {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column);
    }

    const Job& job_;
    std::int32_t columns_ = 0; ///< of the image
    std::int32_t rows_ = 0;
    std::int32_t lo_ = 0; ///< first row of the band
    std::int32_t hi_ = 0;
};

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
    std::vector<std::uint32_t> firsts;
    std::vector<RowRange> tiles;
    std::vector<std::uint32_t> shown; ///< where samples are not kept
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
    bool keep_samples
) noexcept {
    const auto pixels =
        static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    warped.width = view.width;
    warped.height = view.height;
    warped.colors.resize(pixels);
    warped.depths.resize(pixels);
    warped.samples.resize(keep_samples ? pixels : 0);
    if (!keep_samples) {
        impl_->shown.resize(pixels);
    }
    Job job{.image = image, .terms = layered_terms(image, view)};
    job.width = view.width;
    job.height = view.height;
    job.epipole = find_epipole(image, view.eye);
    job.recession = find_recession(image, view);
    const double right = image.view.width;
    const double top = image.view.height;
    job.recedes = job.recession.at(0.0, 0.0) >= 0.0 && job.recession.at(right, 0.0) >= 0.0 &&
                  job.recession.at(0.0, top) >= 0.0 && job.recession.at(right, top) >= 0.0;
    job.tiles_across = (image.view.width + kTile - 1) / kTile;
    job.tiles_up = (image.view.height + kTile - 1) / kTile;
    impl_->covered.resize(image.samples.size());
    impl_->firsts.resize(image.counts.size() + 1);
    impl_->firsts.back() = static_cast<std::uint32_t>(image.samples.size());
    impl_->tiles.resize(
        static_cast<std::size_t>(job.tiles_across) * static_cast<std::size_t>(job.tiles_up)
    );
    job.covered = impl_->covered;
    job.firsts = impl_->firsts;
    job.tiles = impl_->tiles;
    job.shown = keep_samples ? warped.samples : impl_->shown;
    job.colors = warped.colors;
    job.depths = warped.depths;
    // Functions that keep one reference need no memory of their own.
    executor.run(static_cast<std::size_t>(job.tiles_up), [&job](std::size_t i) {
        project_tiles(job, static_cast<std::int32_t>(i));
    });
    executor.run(
        static_cast<std::size_t>((view.height + kBand - 1) / kBand),
        [&job](std::size_t i) { BandWriter(job, static_cast<std::int32_t>(i)).write(); }
    );
}

} // namespace farfield
