#pragma once

#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

/// Where geometry sees the keyframes that are projected onto it, for all that draw them: what
/// `Keyframe` promises is worked out here alone, in double precision. Shaders say the same of these
/// terms in float.
namespace farfield::gpu {

/// The step of depth of a texel that keeps nothing.
inline constexpr std::uint16_t kNothingKept = 0xFFFF;

/// How a pass and a keyframe that it shows see each other.
///
/// A *place* is what a point is to a keyframe: (x z, y z, z), where x and y are its coordinates on
/// the page [texel] and z its distance along the keyframe's view direction [m]. It is linear in the
/// point, so that it may be interpolated over a triangle as any attribute. A *pixel* is likewise
/// what a point is to the pass: (x w, y w, w), with x and y [px] from the lower left corner of the
/// view's window and w the distance along its view direction [m].
struct KeyframeTerms {
    glm::dmat3 to_place{1.0}; ///< of a point relative to the eye of the pass in its camera axes
    glm::dvec3 to_place_offset{0.0};
    glm::dmat3 to_pixel{1.0}; ///< of a place
    glm::dvec3 to_pixel_offset{0.0};
    glm::dvec2 per_tangent{1.0}; ///< [texel]
    glm::dvec2 middle{0.0};      ///< where the view direction meets the page [texel]
    glm::dvec2 low{0.0};         ///< corners of the source [texel]
    glm::dvec2 high{0.0};
    double nearest = 0.0;     ///< [m] of the kept depth 0
    double steps_per_m = 1.0; ///< of kept depths
    double offset_m = 0.0;
    double max_shift_px = 0.0;
};

/// @param view of the pass
/// @par Cost constant, some 100 operations
[[nodiscard]] KeyframeTerms keyframe_terms(const Keyframe& keyframe, const View& view) noexcept;

/// What a keyframe shows a fragment.
struct KeyframeSight {
    bool seen = false;        ///< if the colour's alpha is at least 0.5, which is not looked at
    glm::ivec2 texel{0};      ///< of the page: whose depth and point are the fragment's
    glm::dvec2 color_at{0.0}; ///< [texel] of the page: where the filtered colour is to be taken
};

/// Looks up keyframes.
class KeyframeLookup {
  public:
    explicit KeyframeLookup(const KeyframeTerms& terms) noexcept : terms_(terms) {}

    [[nodiscard]] const KeyframeTerms& terms() const noexcept { return terms_; }

    /// @param point relative to the eye of the pass, in its camera axes [m]
    [[nodiscard]] glm::dvec3 place(const glm::dvec3& point) const noexcept {
        return terms_.to_place * point + terms_.to_place_offset;
    }

    /// The pixel of a place.
    [[nodiscard]] glm::dvec3 pixel(const glm::dvec3& place) const noexcept {
        return terms_.to_pixel * place + terms_.to_pixel_offset;
    }

    /// Normal of a triangle in the space of places, of any length.
    /// @param edge_u, edge_v of the triangle, in camera axes of the pass
    [[nodiscard]] glm::dvec3
    normal(const glm::dvec3& edge_u, const glm::dvec3& edge_v) const noexcept {
        return glm::cross(terms_.to_place * edge_u, terms_.to_place * edge_v);
    }

    /// How far the kept depth of a fragment's texels may be from its own: one step, and along the
    /// ray r = (tx, ty, -1) of the keyframe through it
    ///
    ///     (offset_m + z (|n_x| px + |n_y| py)) / max(|n.r|, |r| / 16)
    ///
    /// with n the normal of its triangle in the keyframe's camera axes, tx and ty tangents, px and
    /// py those of one texel: the slope of z over a texel is z n_x px / n.r. That a distance along
    /// the ray is |r| times that along the view direction is in it.
    /// @param place of the fragment @param normal as `normal` makes it
    /// @return [step] NaN for a normal of no length
    [[nodiscard]] double
    tolerance(const glm::dvec3& place, const glm::dvec3& normal) const noexcept {
        constexpr double kLeastCosine = 1.0 / 16.0;
        const KeyframeTerms& t = terms_;
        const glm::dvec2 tangents = (glm::dvec2(place) / place.z - t.middle) / t.per_tangent;
        // As coordinates of places are to those of the camera, normals are the other way round.
        const glm::dvec3 in_camera(
            t.per_tangent.x * normal.x,
            t.per_tangent.y * normal.y,
            glm::dot(t.middle, glm::dvec2(normal)) + normal.z
        );
        const double length = glm::length(in_camera);
        const double along = std::abs(glm::dot(normal, place)) / place.z; // |n.r| length
        const double ray = std::sqrt(1.0 + glm::dot(tangents, tangents));
        const double slope = place.z * (std::abs(normal.x) + std::abs(normal.y));
        return 1.0 + t.steps_per_m * (t.offset_m * length + slope) /
                         std::max(along, length * ray * kLeastCosine);
    }

    /// All tests of a keyframe but that of alpha.
    /// @param place, normal of the fragment's point and triangle
    /// @param depth_of called with x and y of a texel of the source, returns the step it keeps
    template <typename DepthOf>
    [[nodiscard]] KeyframeSight look(
        const glm::dvec3& place, const glm::dvec3& normal, const DepthOf& depth_of
    ) const noexcept {
        KeyframeSight sight;
        if (!is_inside(place)) {
            return sight;
        }
        const Four four = four_at(place, depth_of);
        if (!four.keeps) {
            return sight;
        }
        const double own = (place.z - terms_.nearest) * terms_.steps_per_m;
        const double most = tolerance(place, normal);
        const auto stands = [&](std::size_t i) { return std::abs(four.depths[i] - own) <= most; };
        bool all = true;
        for (std::size_t i = 0; i < four.depths.size(); ++i) {
            all = all && (four.weights[i] == 0.0 || stands(i));
        }
        sight.texel = four.texels[four.chosen];
        const glm::dvec2 center = glm::dvec2(sight.texel) + 0.5;
        sight.color_at = all ? four.at : center;
        sight.seen = stands(four.chosen) && is_near(center, four.depths[four.chosen], place);
        return sight;
    }

    /// What a fragment of a triangle shows that is shown as a whole: no test but whether there is
    /// anything.
    template <typename DepthOf>
    [[nodiscard]] KeyframeSight
    look_whole(const glm::dvec3& place, const DepthOf& depth_of) const noexcept {
        KeyframeSight sight;
        if (!is_inside(place)) {
            return sight;
        }
        const Four four = four_at(place, depth_of);
        sight.seen = four.keeps;
        sight.texel = four.texels[four.chosen];
        sight.color_at = four.at;
        return sight;
    }

  private:
    /// The texels that are filtered at a place, those outside of the source of no weight.
    struct Four {
        glm::dvec2 at{0.0};
        std::array<glm::ivec2, 4> texels{};
        std::array<double, 4> weights{};
        std::array<double, 4> depths{}; ///< [step]
        std::size_t chosen = 0;         ///< of most weight of those that keep something
        bool keeps = false;             ///< those have at least half of the weight
    };

    [[nodiscard]] bool is_inside(const glm::dvec3& place) const noexcept {
        const glm::dvec2 at = glm::dvec2(place) / place.z;
        return place.z > 0.0 && at.x >= terms_.low.x && at.x < terms_.high.x &&
               at.y >= terms_.low.y && at.y < terms_.high.y;
    }

    template <typename DepthOf>
    [[nodiscard]] Four four_at(const glm::dvec3& place, const DepthOf& depth_of) const noexcept {
        Four four;
        for (int axis = 0; axis < 2; ++axis) {
            four.at[axis] =
                std::clamp(place[axis] / place.z, terms_.low[axis] + 0.5, terms_.high[axis] - 0.5);
        }
        const glm::ivec2 first(four.at - 0.5); // not negative: the source begins at 0 or after it
        const glm::ivec2 last(terms_.high - 1.0);
        const glm::dvec2 share = four.at - 0.5 - glm::dvec2(first);
        double kept = 0.0;
        double most = 0.0;
        for (std::size_t i = 0; i < 4; ++i) {
            const bool right = i == 1 || i == 3;
            const bool up = i >= 2;
            four.texels[i] = {
                std::min(first.x + (right ? 1 : 0), last.x),
                std::min(first.y + (up ? 1 : 0), last.y)};
            four.weights[i] = (right ? share.x : 1.0 - share.x) * (up ? share.y : 1.0 - share.y);
            const std::uint16_t depth = depth_of(four.texels[i].x, four.texels[i].y);
            four.depths[i] = static_cast<double>(depth);
            if (depth != kNothingKept) {
                kept += four.weights[i];
                if (four.weights[i] > most) {
                    most = four.weights[i];
                    four.chosen = i;
                }
            }
        }
        four.keeps = kept >= 0.5;
        return four;
    }

    /// The pass sees the point of a texel no farther from that of a place than it may be.
    [[nodiscard]] bool
    is_near(const glm::dvec2& center, double depth, const glm::dvec3& place) const noexcept {
        if (std::isinf(terms_.max_shift_px)) {
            return true;
        }
        const double z = terms_.nearest + depth / terms_.steps_per_m;
        const glm::dvec3 seen = pixel(glm::dvec3(center * z, z));
        const glm::dvec3 fragment = pixel(place);
        const glm::dvec2 shift = glm::dvec2(seen) * fragment.z - glm::dvec2(fragment) * seen.z;
        const double most = terms_.max_shift_px * seen.z * fragment.z;
        return seen.z > 0.0 && fragment.z > 0.0 && glm::dot(shift, shift) <= most * most;
    }

    KeyframeTerms terms_;
};

} // namespace farfield::gpu
