#pragma once

#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_double3x3.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>

/// Where geometry sees the keyframes that are projected onto it, for all that draw them: what
/// `Keyframe` promises is worked out here alone, in double precision. Shaders say the same of these
/// terms in float.
namespace farfield::gpu {

/// The step of depth of a texel that keeps nothing.
inline constexpr std::uint16_t kNothingKept = 0xFFFF;

/// How a pass and a keyframe that it shows see each other. Points are relative to the eye of the
/// one or the other, in its camera axes: x to the right, y up, -z where it looks.
///
/// A *pixel* is what a point is to the pass: (x w, y w, w), with x and y [px] from the lower left
/// corner of the view's window and w the distance along its view direction [m].
struct KeyframeTerms {
    glm::dmat3 rotation{1.0}; ///< from axes of the pass to those of the keyframe
    glm::dvec3 offset{0.0};   ///< the eye of the pass, seen from the keyframe's [m]
    /// Of (x z, y z, z), with x and y on the page [texel] and z the distance along the keyframe's
    /// view direction [m]: the pixel.
    glm::dmat3 to_pixel{1.0};
    glm::dvec3 to_pixel_offset{0.0}; ///< the keyframe's eye: the pixel of z = 0
    glm::dvec2 per_tangent{1.0};     ///< [texel]
    glm::dvec2 middle{0.0};          ///< where the keyframe's view direction meets the page [texel]
    glm::ivec2 low{0};               ///< first and last texel of the source
    glm::ivec2 last{0};
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

/// Looks up one keyframe.
class KeyframeLookup {
  public:
    explicit KeyframeLookup(const KeyframeTerms& terms) noexcept : terms_(terms) {}

    [[nodiscard]] const KeyframeTerms& terms() const noexcept { return terms_; }

    /// To the keyframe what a point is to the pass. [m]
    [[nodiscard]] glm::dvec3 point(const glm::dvec3& of_pass) const noexcept {
        return terms_.rotation * of_pass + terms_.offset;
    }

    /// How far the kept depth of a fragment's texels may be from its own: one step, and along the
    /// ray r = (x, y, -1) of the keyframe through it
    ///
    ///     (offset_m + z (|n_x| p_x + |n_y| p_y)) / max(|n.r|, |r| / 16)
    ///
    /// with z its distance along the view direction, n the normal of its triangle and p the
    /// tangents of a texel: the slope of z over one is z n_x p_x / n.r. Distances along the ray are
    /// |r| times those along the view direction.
    /// @param point of the fragment, to the keyframe
    /// @param normal of its triangle, to the keyframe; unit
    /// @return [step]
    [[nodiscard]] double
    tolerance(const glm::dvec3& point, const glm::dvec3& normal) const noexcept {
        constexpr double kLeastCosine = 1.0 / 16.0;
        const double z = -point.z;
        const glm::dvec3 ray = point / z;
        const glm::dvec2 slope = glm::abs(glm::dvec2(normal)) / terms_.per_tangent;
        return 1.0 + terms_.steps_per_m * (terms_.offset_m + z * (slope.x + slope.y)) /
                         std::max(std::abs(glm::dot(normal, ray)), glm::length(ray) * kLeastCosine);
    }

    /// All tests of a keyframe but that of alpha.
    /// @param point of the fragment, to the keyframe
    /// @param normal of its triangle, to the keyframe; unit
    /// @param depth_of called with x and y of a texel of the source, returns the step it keeps
    template <typename DepthOf>
    [[nodiscard]] KeyframeSight look(
        const glm::dvec3& point, const glm::dvec3& normal, const DepthOf& depth_of
    ) const noexcept {
        KeyframeSight sight;
        const glm::dvec2 at = on_page(point);
        if (!is_inside(point, at)) {
            return sight;
        }
        sight.texel = glm::ivec2(at);
        const std::uint16_t depth = depth_of(sight.texel.x, sight.texel.y);
        const double own = (-point.z - terms_.nearest) * terms_.steps_per_m;
        const double most = tolerance(point, normal);
        const auto stands = [&](std::uint16_t kept) {
            return std::abs(static_cast<double>(kept) - own) <= most;
        };
        sight.seen = depth != kNothingKept && stands(depth) && is_near(depth, point);
        // Of the four that are filtered, all are of the source.
        const glm::dvec2 filtered = filtered_at(at);
        const glm::ivec2 first = glm::clamp(
            glm::ivec2(filtered - 0.5), terms_.low, glm::max(terms_.low, terms_.last - 1)
        );
        const glm::ivec2 next = glm::min(first + 1, terms_.last);
        const bool all = stands(depth_of(first.x, first.y)) && stands(depth_of(next.x, first.y)) &&
                         stands(depth_of(first.x, next.y)) && stands(depth_of(next.x, next.y));
        sight.color_at = all ? filtered : glm::dvec2(sight.texel) + 0.5;
        return sight;
    }

    /// What a fragment of a triangle shows that is shown as a whole: no test but whether there is
    /// anything.
    template <typename DepthOf>
    [[nodiscard]] KeyframeSight
    look_whole(const glm::dvec3& point, const DepthOf& depth_of) const noexcept {
        KeyframeSight sight;
        const glm::dvec2 at = on_page(point);
        if (is_inside(point, at)) {
            sight.texel = glm::ivec2(at);
            sight.color_at = filtered_at(at);
            sight.seen = depth_of(sight.texel.x, sight.texel.y) != kNothingKept;
        }
        return sight;
    }

    /// Where on the page a point is. [texel] @pre it is before the keyframe's eye
    [[nodiscard]] glm::dvec2 on_page(const glm::dvec3& point) const noexcept {
        return glm::dvec2(point) / -point.z * terms_.per_tangent + terms_.middle;
    }

  private:
    [[nodiscard]] bool is_inside(const glm::dvec3& point, const glm::dvec2& at) const noexcept {
        return point.z < 0.0 && at.x >= terms_.low.x && at.x < terms_.last.x + 1 &&
               at.y >= terms_.low.y && at.y < terms_.last.y + 1;
    }

    /// Without what lies beyond the source.
    [[nodiscard]] glm::dvec2 filtered_at(const glm::dvec2& at) const noexcept {
        return glm::clamp(at, glm::dvec2(terms_.low) + 0.5, glm::dvec2(terms_.last) + 0.5);
    }

    /// The pass sees what the keyframe saw on the ray through a point no farther from it than it
    /// may be. With e = (x w, y w, w) the keyframe's eye and p the point, pixels both, and the kept
    /// depth so many times farther than the point's, 1 + t, what was seen is at p + t (p - e).
    [[nodiscard]] bool is_near(std::uint16_t depth, const glm::dvec3& point) const noexcept {
        if (std::isinf(terms_.max_shift_px)) {
            return true;
        }
        const double z = -point.z;
        const double kept = terms_.nearest + static_cast<double>(depth) / terms_.steps_per_m;
        const double beyond = (kept - z) / z;
        const glm::dvec3& eye = terms_.to_pixel_offset;
        const glm::dvec3 own = terms_.to_pixel * glm::dvec3(on_page(point) * z, z) + eye;
        const double shown_w = own.z + beyond * (own.z - eye.z);
        const glm::dvec2 shift = beyond * (glm::dvec2(own) * eye.z - glm::dvec2(eye) * own.z);
        const double most = terms_.max_shift_px * shown_w * own.z;
        return shown_w > 0.0 && own.z > 0.0 && glm::dot(shift, shift) <= most * most;
    }

    KeyframeTerms terms_;
};

} // namespace farfield::gpu
