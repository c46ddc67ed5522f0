#include "image/layered_order.hpp"

#include "image/layered_rays.hpp"

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace farfield::detail {

namespace {

using glm::dvec2;
using glm::dvec3;

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

Recession find_recession(const LayeredDepthImage& image, const View& view) noexcept {
    const View& from = image.view;
    const dvec3 forward = glm::transpose(from.camera_to_world) * -view.camera_to_world[2];
    const dvec2 step = tangents_per_step(from);
    return {forward.x * step.x, forward.y * step.y, glm::dot(forward, corner_ray(from))};
}

/// Draws all samples into some rows of the target.
class RingWriter {
  public:
    RingWriter(
        const LayeredJob& job,
        const RingOrder& order,
        const Band& band,
        std::span<std::uint32_t> shown
    ) noexcept
        : job_(job), order_(order), band_(band), shown_(shown), columns_(job.image.view.width),
          rows_(job.image.view.height) {}

    void write() const noexcept {
        const Epipole& epipole = order_.epipole;
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

  private:
    /// The texels whose larger distance along an axis is `radius`.
    void draw_ring(std::int32_t radius) const noexcept {
        const Epipole& epipole = order_.epipole;
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
            if (reaches(job_, column, row, band_)) {
                const std::size_t texel = texel_at(column, row);
                const auto count = static_cast<std::size_t>(tile_end - column);
                if (order_.recedes) {
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
            if (reaches(job_, column, row, band_)) {
                for (; row < tile_end; ++row) {
                    const std::size_t texel = texel_at(column, row);
                    constexpr std::int32_t kAhead = 8;
                    if (row + kAhead < rows_) {
                        const std::size_t later =
                            texel + static_cast<std::size_t>(kAhead * columns_);
                        prefetch(job_.covered.data() + job_.firsts[later]);
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
        if (order_.recedes) {
            draw_back_to_front(begin, end);
            return;
        }
        if (begin == end) {
            return;
        }
        const LayeredSample& sample = job_.image.samples[begin];
        const double x = static_cast<double>(sample.x) / kLayeredSteps;
        const double y = static_cast<double>(sample.y) / kLayeredSteps;
        if (order_.recession.at(x, y) >= 0.0) {
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
        const Covered covered = decoded(code);
        const std::int32_t y0 = std::max(covered.y0, band_.lo);
        const std::int32_t y1 = std::min(covered.y1, band_.hi);
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
        const std::int32_t y1 = std::min(covered.y1, band_.hi);
        for (std::int32_t y = std::max(covered.y0, band_.lo); y < y1; ++y) {
            std::fill(row_at(y) + covered.x0, row_at(y) + covered.x1, sample);
        }
    }

    [[nodiscard]] std::uint32_t* row_at(std::int32_t y) const noexcept {
        return shown_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(job_.width);
    }

    [[nodiscard]] std::size_t texel_at(std::int32_t column, std::int32_t row) const noexcept {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column);
    }

    const LayeredJob& job_;
    const RingOrder& order_;
    Band band_;
    std::span<std::uint32_t> shown_;
    std::int32_t columns_ = 0; ///< of the image
    std::int32_t rows_ = 0;
};

} // namespace

RingOrder ring_order(const LayeredDepthImage& image, const View& view) noexcept {
    RingOrder order;
    order.epipole = find_epipole(image, view.eye);
    order.recession = find_recession(image, view);
    const double right = image.view.width;
    const double top = image.view.height;
    order.recedes = order.recession.at(0.0, 0.0) >= 0.0 && order.recession.at(right, 0.0) >= 0.0 &&
                    order.recession.at(0.0, top) >= 0.0 && order.recession.at(right, top) >= 0.0;
    return order;
}

void draw_rings(
    const LayeredJob& job, const RingOrder& order, const Band& band, std::span<std::uint32_t> shown
) noexcept {
    RingWriter(job, order, band, shown).write();
}

} // namespace farfield::detail
