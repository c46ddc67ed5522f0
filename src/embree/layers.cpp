#include "embree/tile.hpp"
#include <farfield/gpu/layered_drawing.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace farfield::embree {

namespace {

Color16 widened(const glm::vec<4, std::uint8_t>& color) noexcept {
    constexpr unsigned kBits = 8;
    Color16 wide{};
    for (std::size_t channel = 0; channel < wide.size(); ++channel) {
        wide[channel] = static_cast<std::uint16_t>(color[static_cast<int>(channel)] << kBits);
    }
    return wide;
}

/// Adds one layered image.
class LayerAdder {
  public:
    LayerAdder(
        const FrameWork& work, const Pass& pass, const PassLayers& layers, TileBuffer& tile
    ) noexcept
        : layers_(&layers), viewport_(&pass.viewport), tile_(&tile),
          warped_(std::span(work.warped).subspan(layers.first_warped)) {}

    /// Of one sample a pixel.
    void add_pixels(const Region& region) const noexcept {
        const WarpedLayers& warped = warped_[0];
        for_pixels(region, [&](std::size_t from, std::size_t pixel) {
            const float depth = warped.depths[from];
            if (!shown_before(depth, tile_->depths[pixel], tile_->orders[pixel])) {
                return;
            }
            tile_->colors[pixel] = widened(warped.colors[from]);
            tile_->depths[pixel] = depth;
            tile_->orders[pixel] = layers_->order;
            if (!tile_->positions.empty()) {
                tile_->positions[pixel] = gpu::shown_point(
                    *layers_->image, layers_->terms, warped.samples[from], layers_->node
                );
            }
        });
    }

    void add_samples(const Region& region, std::size_t samples) const noexcept {
        for_pixels(region, [&](std::size_t from, std::size_t pixel) {
            for (std::size_t sample = 0; sample < samples; ++sample) {
                const WarpedLayers& warped = warped_[sample];
                const float depth = warped.depths[from];
                const std::size_t place = pixel * samples + sample;
                const bool mixed = tile_->mixed[pixel] != 0;
                const bool shown =
                    mixed ? shown_before(
                                depth, tile_->sample_depths[place], tile_->sample_orders[place]
                            )
                          : shown_before(depth, tile_->depths[pixel], tile_->orders[pixel]);
                if (!shown) {
                    continue;
                }
                if (!mixed) {
                    tile_->mix(pixel, samples);
                }
                tile_->sample_colors[place] = widened(warped.colors[from]);
                tile_->sample_depths[place] = depth;
                tile_->sample_orders[place] = layers_->order;
            }
        });
    }

  private:
    /// Where nothing is, the depth is infinite and so never nearer; what is drawn first stays where
    /// depths are equal.
    [[nodiscard]] bool shown_before(float depth, float other, std::uint32_t order) const noexcept {
        return depth < other || (depth == other && layers_->order < order);
    }

    /// Calls `visit` with the places of pixels in the warped image and in the tile.
    template <typename Visit>
    void for_pixels(const Region& region, const Visit& visit) const noexcept {
        const auto width = static_cast<std::size_t>(viewport_->width);
        for (std::int32_t row = 0; row < region.height; ++row) {
            const auto up = static_cast<std::size_t>(region.y + row - viewport_->y);
            const std::size_t from = up * width + static_cast<std::size_t>(region.x - viewport_->x);
            for (std::int32_t column = 0; column < region.width; ++column) {
                visit(from + static_cast<std::size_t>(column), tile_pixel(column, row));
            }
        }
    }

    const PassLayers* layers_;
    const Region* viewport_;
    TileBuffer* tile_;
    std::span<const WarpedLayers> warped_; ///< by sample of a pixel
};

} // namespace

void add_layers(
    const FrameWork& work,
    const TileTask& task,
    const Phase& phase,
    std::size_t samples,
    TileBuffer& tile
) noexcept {
    const Pass& pass = *work.passes[task.pass].pass;
    for (const PassLayers& layers :
         std::span(work.layers).subspan(phase.first_layer, phase.layer_count)) {
        const LayerAdder adder(work, pass, layers, tile);
        if (samples == 1) {
            adder.add_pixels(task.region);
        } else {
            adder.add_samples(task.region, samples);
        }
    }
}

} // namespace farfield::embree
