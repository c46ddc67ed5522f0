#include "embree/blend.hpp"
#include "embree/quad_depths.hpp"
#include "embree/texel_size.hpp"
#include "embree/tile.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace farfield::embree {

namespace {

/// The samples of a pixel reach so far from its centre. [px]
constexpr float kReach = 0.5F;

/// Coordinates of a quad at a place of its tile. [texel]
struct QuadPoint {
    float u = 0.0F;
    float v = 0.0F;
    bool before_eye = false;
};

QuadPoint at(const TileQuad& quad, float x, float y) noexcept {
    const float w = (quad.w + quad.w_y * y) + quad.w_x * x;
    return {
        ((quad.u + quad.u_y * y) + quad.u_x * x) / w,
        ((quad.v + quad.v_y * y) + quad.v_x * x) / w,
        w > 0.0F};
}

bool covers(const TileQuad& quad, const QuadPoint& point) noexcept {
    return point.before_eye && point.u >= 0.0F && point.u < quad.width && point.v >= 0.0F &&
           point.v < quad.height;
}

/// How a quad covers a pixel.
struct PixelCover {
    bool possible = false; ///< some of its samples, perhaps
    bool whole = false;    ///< all of them
    /// Where it is filtered: at the centre, or at the end of the quad that is nearest to it.
    float u = 0.0F;
    float v = 0.0F;
};

PixelCover cover_of(const TileQuad& quad, float x, float y) noexcept {
    const QuadPoint center = at(quad, x, y);
    if (!center.before_eye) {
        return {};
    }
    return {
        true,
        center.u >= quad.rim_u && center.u < quad.width - quad.rim_u && center.v >= quad.rim_v &&
            center.v < quad.height - quad.rim_v,
        std::clamp(center.u, 0.0F, quad.width),
        std::clamp(center.v, 0.0F, quad.height)};
}

bool covers_sample(const TileQuad& quad, float x, float y, const glm::vec2& place) noexcept {
    return covers(quad, at(quad, x + place.x - kReach, y + place.y - kReach));
}

/// What a step of a pixel is in the quad, at a point of it. [texel/px]
struct QuadSteps {
    glm::vec2 dx{0.0F};
    glm::vec2 dy{0.0F};
};

QuadSteps steps_at(const TileQuad& quad, const QuadPoint& point, float x, float y) noexcept {
    const float w = (quad.w + quad.w_y * y) + quad.w_x * x;
    return {
        {(quad.u_x - point.u * quad.w_x) / w, (quad.v_x - point.v * quad.w_x) / w},
        {(quad.u_y - point.u * quad.w_y) / w, (quad.v_y - point.v * quad.w_y) / w}};
}

TileQuad quad_in_tile(const PassQuad& quad, const Region& region) noexcept {
    constexpr double kCenter = 0.5;
    const double x = region.x + kCenter;
    const double y = region.y + kCenter;
    const auto first = [&](const glm::dvec3& of) {
        return static_cast<float>(of.x + of.y * x + of.z * y);
    };
    TileQuad result;
    result.u = first(quad.u);
    result.u_x = static_cast<float>(quad.u.y);
    result.u_y = static_cast<float>(quad.u.z);
    result.v = first(quad.v);
    result.v_x = static_cast<float>(quad.v.y);
    result.v_y = static_cast<float>(quad.v.z);
    result.w = first(quad.w);
    result.w_x = static_cast<float>(quad.w.y);
    result.w_y = static_cast<float>(quad.w.z);
    result.width = static_cast<float>(quad.source.width);
    result.height = static_cast<float>(quad.source.height);
    result.texels = quad.page->colors.get();
    result.page_size = quad.page->size;
    result.first_u = quad.source.x;
    result.first_v = quad.source.y;
    result.stands = quad.stands;
    result.depth = quad.depth;
    result.kept = quad.page->depths.get();
    result.viewpoint_depth = quad.viewpoint_depth;
    result.near_ratio = quad.near_ratio;
    result.far_ratio = quad.far_ratio;
    result.nearest = quad.nearest;
    result.farthest = quad.farthest;
    result.order = quad.order;
    const Region& around = quad.around;
    result.left = std::max(around.x - region.x, 0);
    result.right = std::min(around.x + around.width - region.x, region.width);
    result.bottom = std::max(around.y - region.y, 0);
    result.top = std::min(around.y + around.height - region.y, region.height);
    return result;
}

/// Widens the rim of a quad, within which a pixel's samples may be inside and outside, until it
/// holds for all pixels of the tile: a pixel's step is largest at a corner.
void find_rim(TileQuad& quad) noexcept {
    // The step changes by this much within half a pixel, and by rounding.
    constexpr float kSlack = 1.05F;
    for (const std::int32_t row : {quad.bottom, quad.top}) {
        for (const std::int32_t column : {quad.left, quad.right}) {
            const auto x = static_cast<float>(column);
            const auto y = static_cast<float>(row);
            const QuadPoint point = at(quad, x, y);
            if (!point.before_eye) {
                // Where the quad passes the eye no rim is wide enough: all pixels count as its rim.
                quad.rim_u = quad.width;
                return;
            }
            const QuadSteps steps = steps_at(quad, point, x, y);
            const float rim_u = kReach * (std::abs(steps.dx.x) + std::abs(steps.dy.x)) * kSlack;
            const float rim_v = kReach * (std::abs(steps.dx.y) + std::abs(steps.dy.y)) * kSlack;
            quad.rim_u = std::max(quad.rim_u, rim_u);
            quad.rim_v = std::max(quad.rim_v, rim_v);
        }
    }
}

/// Writes the depths of a quad into pixels whose samples differ, or on its rim.
void write_samples(
    const TileQuad& quad, std::span<const glm::vec2> places, TileBuffer& tile
) noexcept {
    const std::size_t samples = places.size();
    for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
        for (std::int32_t column = quad.left; column < quad.right; ++column) {
            const std::size_t pixel = tile_pixel(column, row);
            const auto x = static_cast<float>(column);
            const auto y = static_cast<float>(row);
            const PixelCover cover = cover_of(quad, x, y);
            const bool is_mixed = tile.mixed[pixel] != 0;
            if (!cover.possible || (cover.whole && !is_mixed)) {
                continue; // not seen, or done with the whole pixels
            }
            if (filtered(quad, texel_place(quad, cover.u, cover.v))[3] < kHalfAlpha) {
                continue;
            }
            const float depth = depth_at(quad, pixel);
            if (!is_mixed) {
                if (!(depth <= tile.depths[pixel])) {
                    continue;
                }
                tile.mix(pixel, samples);
            }
            for (std::size_t sample = 0; sample < samples; ++sample) {
                float& there = tile.sample_depths[pixel * samples + sample];
                if (depth <= there && (cover.whole || covers_sample(quad, x, y, places[sample]))) {
                    there = depth;
                }
            }
        }
    }
}

/// Blends the quad over pixels whose samples differ, or on its rim.
void blend_samples(
    const TileQuad& quad, std::span<const glm::vec2> places, TileBuffer& tile
) noexcept {
    const std::size_t samples = places.size();
    for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
        for (std::int32_t column = quad.left; column < quad.right; ++column) {
            const std::size_t pixel = tile_pixel(column, row);
            const auto x = static_cast<float>(column);
            const auto y = static_cast<float>(row);
            const PixelCover cover = cover_of(quad, x, y);
            const bool is_mixed = tile.mixed[pixel] != 0;
            if (!cover.possible || (cover.whole && !is_mixed)) {
                continue; // not seen, or done with the whole pixels
            }
            const Color16 color = filtered(quad, texel_place(quad, cover.u, cover.v));
            if (color == Color16{}) {
                continue;
            }
            const float depth = depth_at(quad, pixel);
            if (!is_mixed) {
                if (!(depth <= tile.depths[pixel] && quad.order > tile.orders[pixel])) {
                    continue;
                }
                tile.mix(pixel, samples);
            }
            const std::size_t first = pixel * samples;
            for (std::size_t sample = 0; sample < samples; ++sample) {
                const bool seen = depth <= tile.sample_depths[first + sample] &&
                                  quad.order > tile.sample_orders[first + sample];
                if (seen && (cover.whole || covers_sample(quad, x, y, places[sample]))) {
                    blend(color, tile.sample_colors[first + sample]);
                }
            }
        }
    }
}

/// Writes the points of a quad's image where it owns pixels.
void show_positions(const PassQuad& shown, const TileQuad& quad, TileBuffer& tile) noexcept {
    const PositionTexel* points = shown.page->positions.get();
    const std::int32_t last = quad.page_size - 1;
    for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
        for (std::int32_t column = quad.left; column < quad.right; ++column) {
            const std::size_t pixel = tile_pixel(column, row);
            const auto x = static_cast<float>(column);
            const auto y = static_cast<float>(row);
            const QuadPoint center = at(quad, x, y);
            if (!covers(quad, center) || !(depth_at(quad, pixel) <= tile.depths[pixel]) ||
                !(quad.order > tile.orders[pixel])) {
                continue;
            }
            if (filtered(quad, texel_place(quad, center.u, center.v))[3] < kHalfAlpha) {
                continue;
            }
            const glm::vec2 here(
                center.u + static_cast<float>(quad.first_u),
                center.v + static_cast<float>(quad.first_v)
            );
            const glm::vec2 corner = here - 0.5F;
            const glm::vec2 floor(std::floor(corner.x), std::floor(corner.y));
            const glm::vec2 share = corner - floor;
            // The nearest of the texels that are filtered, or the one of most weight that shows
            // something.
            const PositionTexel* found = nullptr;
            glm::vec2 found_center(0.0F);
            float most = -1.0F;
            for (int i = 0; i < 4; ++i) {
                const glm::ivec2 step(i & 1, i >> 1);
                const glm::ivec2 texel =
                    glm::clamp(glm::ivec2(floor) + step, glm::ivec2(0), glm::ivec2(last));
                const PositionTexel& candidate =
                    points[static_cast<std::ptrdiff_t>(texel.y) * quad.page_size + texel.x];
                const bool nearest =
                    (step.x == 1) == (share.x >= 0.5F) && (step.y == 1) == (share.y >= 0.5F);
                const float weight = nearest ? 2.0F
                                             : (step.x == 1 ? share.x : 1.0F - share.x) *
                                                   (step.y == 1 ? share.y : 1.0F - share.y);
                if (candidate.item != kNone<ItemId> && weight > most) {
                    most = weight;
                    found = &candidate;
                    found_center = glm::vec2(texel) + 0.5F;
                }
            }
            if (found == nullptr) {
                continue;
            }
            const QuadSteps steps = steps_at(quad, center, x, y);
            PositionTexel& texel = tile.positions[pixel];
            texel = *found;
            texel.texel_px =
                seen_texel_px(steps.dx, steps.dy, found_center - here, found->texel_px);
            texel.node = shown.node;
        }
    }
}

} // namespace

void blend_tile(
    const FrameWork& work,
    const TileTask& task,
    const Phase& phase,
    std::span<const glm::vec2> places,
    std::uint32_t& next_flat,
    TileBuffer& tile
) noexcept {
    const auto flats = std::span(work.listed_flats).subspan(task.first_flat, task.flat_count);
    const std::uint32_t flats_end = phase.first_flat + phase.flat_count;
    const auto blend_flats_before = [&](std::uint32_t order) {
        for (; next_flat < flats.size() && flats[next_flat] < flats_end; ++next_flat) {
            const Flat& flat = work.flats[flats[next_flat]];
            if (flat.order >= order) {
                return;
            }
            blend_flat(work, task, flat, places, tile);
        }
    };
    const BlendQuad blend_quad = fastest_blend_quad();
    const QuadDepthWork depth_work = fastest_depth_work();
    for (std::uint32_t i = phase.first_quad; i < phase.first_quad + phase.quad_count; ++i) {
        const PassQuad& shown = work.quads[i];
        if (!overlaps(shown.around, task.region)) {
            continue;
        }
        blend_flats_before(shown.order);
        TileQuad quad = quad_in_tile(shown, task.region);
        if (places.size() > 1) {
            find_rim(quad);
        }
        if (quad.stands != QuadDepth::none) {
            depth_work.find(quad, tile);
            quad.depths = tile.quad_depths.data();
        }
        if (shown.writes_depth) {
            depth_work.write(quad, tile);
            if (places.size() > 1) {
                write_samples(quad, places, tile);
            }
            continue;
        }
        blend_quad(quad, tile);
        if (places.size() > 1) {
            blend_samples(quad, places, tile);
        }
        if (!tile.positions.empty()) {
            show_positions(shown, quad, tile);
        }
    }
    blend_flats_before(UINT32_MAX);
}

} // namespace farfield::embree
