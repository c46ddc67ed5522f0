#include "embree/blend.hpp"
#include "embree/quad_depths.hpp"
#include "embree/tile.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace farfield::embree {

namespace {

/// What blends over a sample: always the same, but for how far off it is.
struct Layer {
    Color16 color{};
    std::uint32_t order = 0;
};

Color16 widened(const glm::vec<4, std::uint8_t>& color) noexcept {
    const auto channel = [](std::uint8_t value) {
        return static_cast<std::uint16_t>(std::uint32_t{value} << 8U);
    };
    return {channel(color.r), channel(color.g), channel(color.b), channel(color.a)};
}

/// Depth of a face at a sample, or infinite where the face does not cover it.
/// @param sample [px] of the target
double depth_at(const PassFace& face, const glm::dvec2& sample) noexcept {
    constexpr double kNothing = std::numeric_limits<double>::infinity();
    const auto along = [&](const glm::dvec3& row) {
        return row.x + row.y * sample.x + row.z * sample.y;
    };
    const double w = along(face.w);
    const double u = along(face.u);
    const double v = along(face.v);
    // u / w in [0, 1), without the quotient.
    const bool covered = w > 0.0 && u >= 0.0 && u < w && v >= 0.0 && v < w;
    return covered ? 1.0 / w : kNothing;
}

/// How a flat is met by the samples of one pixel.
class PixelDepths {
  public:
    PixelDepths(const FrameWork& work, const Flat& flat, const Lens& lens) noexcept
        : flat_(&flat), face_(flat.face == Flat::kNoFace ? nullptr : &work.faces[flat.face]),
          nearest_(lens.near_distance), farthest_(lens.far_distance) {}

    /// Whether the flat covers a sample between near and far, and how far off it is there.
    /// @param sample [px] of the target
    [[nodiscard]] bool at(const glm::dvec2& sample, float& depth) const noexcept {
        if (face_ == nullptr) {
            depth = static_cast<float>(flat_->square.depth);
            return flat_->square.covers(sample);
        }
        const double met = depth_at(*face_, sample);
        depth = static_cast<float>(met);
        return met >= nearest_ && met <= farthest_;
    }

  private:
    const Flat* flat_;
    const PassFace* face_;
    double nearest_;
    double farthest_;
};

/// Of one sample a pixel.
void blend_pixel(const Layer& layer, std::size_t pixel, float depth, TileBuffer& tile) noexcept {
    if (!(depth <= tile.depths[pixel] && layer.order > tile.orders[pixel])) {
        return;
    }
    blend(layer.color, tile.colors[pixel]);
    if (!tile.positions.empty() && layer.color[3] >= kHalfAlpha) {
        tile.positions[pixel] = PositionTexel();
    }
}

/// Of several samples a pixel.
/// @param corner [px] of the pixel
void blend_samples(
    const Layer& layer,
    const PixelDepths& depths,
    const glm::dvec2& corner,
    std::size_t pixel,
    std::span<const glm::vec2> places,
    TileBuffer& tile
) noexcept {
    const std::size_t first = pixel * places.size();
    if (tile.mixed[pixel] == 0) {
        // As long as all samples are alike they stay together, if it covers all of them or none.
        std::size_t seen = 0;
        for (const glm::vec2& place : places) {
            float depth = 0.0F;
            const bool covered = depths.at(corner + glm::dvec2(place), depth);
            seen += covered && depth <= tile.depths[pixel] ? 1 : 0;
        }
        if (seen == 0 || layer.order <= tile.orders[pixel]) {
            return;
        }
        if (seen == places.size()) {
            blend(layer.color, tile.colors[pixel]);
            return;
        }
        tile.mix(pixel, places.size());
    }
    for (std::size_t sample = 0; sample < places.size(); ++sample) {
        float depth = 0.0F;
        if (depths.at(corner + glm::dvec2(places[sample]), depth) &&
            depth <= tile.sample_depths[first + sample] &&
            layer.order > tile.sample_orders[first + sample]) {
            blend(layer.color, tile.sample_colors[first + sample]);
        }
    }
}

} // namespace

void blend_flat(
    const FrameWork& work,
    const TileTask& task,
    const Flat& flat,
    std::span<const glm::vec2> places,
    TileBuffer& tile
) noexcept {
    const Region& region = task.region;
    const Region& around = flat.around;
    const std::int32_t left = std::max(around.x - region.x, 0);
    const std::int32_t right = std::min(around.x + around.width - region.x, region.width);
    const std::int32_t bottom = std::max(around.y - region.y, 0);
    const std::int32_t top = std::min(around.y + around.height - region.y, region.height);
    const Layer layer{widened(flat.color), flat.order};
    const PixelDepths depths(work, flat, work.passes[task.pass].pass->view.lens);
    const bool all_covered = places.size() == 1 && flat.face == Flat::kNoFace;
    for (std::int32_t row = bottom; row < top; ++row) {
        for (std::int32_t column = left; column < right; ++column) {
            const std::size_t pixel = tile_pixel(column, row);
            const glm::dvec2 corner(region.x + column, region.y + row);
            if (places.size() > 1) {
                blend_samples(layer, depths, corner, pixel, places, tile);
                continue;
            }
            float depth = static_cast<float>(flat.square.depth);
            if (all_covered || depths.at(corner + glm::dvec2(places[0]), depth)) {
                blend_pixel(layer, pixel, depth, tile);
            }
        }
    }
}

} // namespace farfield::embree
