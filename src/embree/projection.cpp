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

/// How far one pixel of the pass moves a point of a triangle on the page. [texel]
/// @param normal of the triangle in camera axes
/// @param step of the ray (x, y, -1) to the next pixel
glm::vec2 page_step(
    const gpu::KeyframeTerms& terms,
    const MetPoint& met,
    const glm::dvec3& place,
    const glm::dvec3& normal,
    const glm::dvec3& step
) noexcept {
    // The ray goes on to where it meets the plane.
    const double depth = -met.point.z;
    const glm::dvec3 ray = met.point / depth;
    const double farther = -depth * glm::dot(normal, step) / glm::dot(normal, ray);
    const glm::dvec3 moved = terms.to_place * (step * depth + ray * farther);
    const glm::dvec2 at = glm::dvec2(place) / place.z;
    return glm::vec2((glm::dvec2(moved) - at * moved.z) / place.z);
}

class Projector {
    [[nodiscard]] auto depths() const noexcept {
        return [page = keyframe_->page](std::int32_t x, std::int32_t y) {
            return page->depths[texel_index(*page, x, y)];
        };
    }

  public:
    Projector(const PassKeyframe& keyframe, const Pass& pass, const MetPoint& met) noexcept
        : keyframe_(&keyframe), pass_(&pass), met_(&met), place_(keyframe.lookup.place(met.point)),
          normal_(keyframe.lookup.normal(
              met.corners[1] - met.corners[0], met.corners[2] - met.corners[0]
          )) {}

    [[nodiscard]] bool sees_corners() const noexcept {
        return std::all_of(
            met_->corners.begin(),
            met_->corners.end(),
            [&](const glm::dvec3& corner) {
                return show(keyframe_->lookup.look(
                                keyframe_->lookup.place(corner), normal_, depths()
                            ))
                    .has_value();
            }
        );
    }

    [[nodiscard]] gpu::KeyframeSight look(bool whole) const noexcept {
        return whole ? keyframe_->lookup.look_whole(place_, depths())
                     : keyframe_->lookup.look(place_, normal_, depths());
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

    [[nodiscard]] PositionTexel position(const gpu::KeyframeSight& sight) const noexcept {
        const Page& page = *keyframe_->page;
        PositionTexel texel = page.positions[texel_index(page, sight.texel.x, sight.texel.y)];
        if (texel.item == kNone<ItemId>) {
            return {};
        }
        const View& view = pass_->view;
        const glm::dvec3 normal =
            glm::cross(met_->corners[1] - met_->corners[0], met_->corners[2] - met_->corners[0]);
        const gpu::KeyframeTerms& terms = keyframe_->lookup.terms();
        const glm::dvec3 right((view.lens.right - view.lens.left) / view.width, 0.0, 0.0);
        const glm::dvec3 up(0.0, (view.lens.top - view.lens.bottom) / view.height, 0.0);
        const glm::dvec2 at = glm::dvec2(place_) / place_.z;
        texel.texel_px = seen_texel_px(
            page_step(terms, *met_, place_, normal, right),
            page_step(terms, *met_, place_, normal, up),
            glm::vec2(glm::dvec2(sight.texel) + 0.5 - at),
            texel.texel_px
        );
        texel.node = keyframe_->node;
        return texel;
    }

  private:
    const PassKeyframe* keyframe_;
    const Pass* pass_;
    const MetPoint* met_;
    glm::dvec3 place_;
    glm::dvec3 normal_;
};

} // namespace

std::optional<Projected> project(
    std::span<const PassKeyframe> keyframes,
    const Pass& pass,
    const MetPoint& met,
    bool whole,
    bool positions
) noexcept {
    for (const PassKeyframe& keyframe : keyframes) {
        const Projector projector(keyframe, pass, met);
        if (whole && !projector.sees_corners()) {
            continue;
        }
        const gpu::KeyframeSight sight = projector.look(whole);
        std::optional<Projected> shown = projector.show(sight);
        if (shown && positions) {
            shown->position = projector.position(sight);
        }
        if (shown || whole) {
            return shown;
        }
    }
    return std::nullopt;
}

} // namespace farfield::embree
