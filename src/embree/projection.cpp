#include "embree/projection.hpp"

#include "embree/texel_size.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace farfield::embree {

namespace {

std::size_t texel_index(const Page& page, std::int32_t x, std::int32_t y) noexcept {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(page.size) +
           static_cast<std::size_t>(x);
}

glm::vec4 color_of(const Page& page, std::int32_t x, std::int32_t y) noexcept {
    const std::uint32_t rgba = page.colors[texel_index(page, x, y)];
    constexpr float kMost = 255.0F;
    const auto channel = [&](unsigned shift) {
        return static_cast<float>(rgba >> shift & 0xFFU) / kMost;
    };
    return {channel(0), channel(8), channel(16), channel(24)};
}

/// Bilinear. What is looked up is at least half a texel inside of the page.
glm::vec4 filtered_color(const Page& page, const glm::dvec2& at) noexcept {
    const glm::ivec2 first(at - 0.5);
    const glm::vec2 share(at - 0.5 - glm::dvec2(first));
    const glm::ivec2 next = glm::min(first + 1, glm::ivec2(page.size - 1));
    const glm::vec4 lower =
        glm::mix(color_of(page, first.x, first.y), color_of(page, next.x, first.y), share.x);
    const glm::vec4 upper =
        glm::mix(color_of(page, first.x, next.y), color_of(page, next.x, next.y), share.x);
    return glm::mix(lower, upper, share.y);
}

class Projector {
  public:
    /// @param normal of the triangle in camera axes of the pass, unit
    Projector(const PassKeyframe& keyframe, const MetPoint& met, const glm::dvec3& normal) noexcept
        : keyframe_(&keyframe), met_(&met), point_(keyframe.lookup.point(met.point)),
          normal_(keyframe.lookup.terms().rotation * normal) {}

    [[nodiscard]] bool sees_corners() const noexcept {
        const gpu::KeyframeLookup& lookup = keyframe_->lookup;
        return std::all_of(
            met_->corners.begin(),
            met_->corners.end(),
            [&](const glm::dvec3& corner) {
                return show(lookup.look(lookup.point(corner), normal_, Depths{keyframe_->page}))
                    .has_value();
            }
        );
    }

    [[nodiscard]] gpu::KeyframeSight look(bool whole) const noexcept {
        const Depths depths{keyframe_->page};
        return whole ? keyframe_->lookup.look_whole(point_, depths)
                     : keyframe_->lookup.look(point_, normal_, depths);
    }

    /// The colour that is seen, if it is more than background.
    [[nodiscard]] std::optional<Projected> show(const gpu::KeyframeSight& sight) const noexcept {
        if (!sight.seen) {
            return std::nullopt;
        }
        const glm::vec4 color = filtered_color(*keyframe_->page, sight.color_at);
        if (!(color.a >= 0.5F)) {
            return std::nullopt;
        }
        const glm::vec4 opaque = glm::min(color / color.a, glm::vec4(1.0F)) * kColor16 + 0.5F;
        Projected shown;
        for (int channel = 0; channel < 4; ++channel) {
            shown.color[static_cast<std::size_t>(channel)] =
                static_cast<std::uint16_t>(opaque[channel]);
        }
        return shown;
    }

    /// What positions keep of it.
    /// @param steps of the point to those of the neighbouring pixels, in camera axes of the pass
    [[nodiscard]] PositionTexel position(
        const gpu::KeyframeSight& sight, const std::array<glm::dvec3, 2>& steps
    ) const noexcept {
        const Page& page = *keyframe_->page;
        PositionTexel texel = page.positions[texel_index(page, sight.texel.x, sight.texel.y)];
        if (texel.item == kNone<ItemId>) {
            return {};
        }
        const gpu::KeyframeTerms& terms = keyframe_->lookup.terms();
        const glm::dvec3 ray = point_ / -point_.z;
        const auto on_page = [&](const glm::dvec3& step) {
            const glm::dvec3 moved = terms.rotation * step;
            return glm::vec2(
                (glm::dvec2(moved) + glm::dvec2(ray) * moved.z) / -point_.z * terms.per_tangent
            );
        };
        const glm::dvec2 at = keyframe_->lookup.on_page(point_);
        texel.texel_px = seen_texel_px(
            on_page(steps[0]),
            on_page(steps[1]),
            glm::vec2(glm::dvec2(sight.texel) + 0.5 - at),
            texel.texel_px
        );
        texel.node = keyframe_->node;
        return texel;
    }

  private:
    struct Depths {
        const Page* page = nullptr;
        std::uint16_t operator()(std::int32_t x, std::int32_t y) const noexcept {
            return page->depths[texel_index(*page, x, y)];
        }
    };

    const PassKeyframe* keyframe_;
    const MetPoint* met_;
    glm::dvec3 point_;
    glm::dvec3 normal_;
};

/// From a point to where the rays of the next pixels, to the right and up, meet its triangle's
/// plane.
std::array<glm::dvec3, 2>
steps_of(const View& view, const glm::dvec3& point, const glm::dvec3& normal) noexcept {
    const double depth = -point.z;
    const glm::dvec3 ray = point / depth;
    const auto step = [&](const glm::dvec3& turn) {
        const double farther = -depth * glm::dot(normal, turn) / glm::dot(normal, ray);
        return turn * depth + ray * farther;
    };
    const Lens& lens = view.lens;
    return {
        step({(lens.right - lens.left) / view.width, 0.0, 0.0}),
        step({0.0, (lens.top - lens.bottom) / view.height, 0.0})};
}

} // namespace

std::optional<Projected> project(
    std::span<const PassKeyframe> keyframes,
    const Pass& pass,
    const MetPoint& met,
    bool whole,
    bool positions
) noexcept {
    const glm::dvec3 normal =
        glm::normalize(glm::cross(met.corners[1] - met.corners[0], met.corners[2] - met.corners[0])
        );
    for (const PassKeyframe& keyframe : keyframes) {
        const Projector projector(keyframe, met, normal);
        if (whole && !projector.sees_corners()) {
            continue;
        }
        const gpu::KeyframeSight sight = projector.look(whole);
        std::optional<Projected> shown = projector.show(sight);
        if (shown && positions) {
            shown->position = projector.position(sight, steps_of(pass.view, met.point, normal));
        }
        if (shown || whole) {
            return shown;
        }
    }
    return std::nullopt;
}

} // namespace farfield::embree
