#pragma once

#include <farfield/gpu/frame_plan.hpp>

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

/// Where splats and cubes are seen, for all that draw them: what `Splat` and `ShownCube` promise is
/// worked out here alone, in double precision.
namespace farfield::gpu {

/// A splat on its target.
struct SplatSquare {
    glm::dvec2 lo{0.0}; ///< [px] of the target, y up; included
    glm::dvec2 hi{0.0}; ///< [px] not included
    double depth = 0.0; ///< of its centre along the view direction [m]

    [[nodiscard]] bool covers(const glm::dvec2& sample) const noexcept {
        return lo.x <= sample.x && sample.x < hi.x && lo.y <= sample.y && sample.y < hi.y;
    }
};

/// Projects the splats of one pass.
class SplatView {
  public:
    /// @param origin `FramePlan::origin`
    SplatView(const Pass& pass, const glm::dvec3& origin) noexcept;

    /// @param square where the splat is
    /// @return false where it is not drawn: its centre is before the near plane or beyond the far
    /// one, it has no side, or it lies outside the scissor
    /// @par Cost constant, a few nanoseconds
    [[nodiscard]] bool place(const Splat& splat, SplatSquare& square) const noexcept {
        const double x = double{splat.center.x} - eye_.x;
        const double y = double{splat.center.y} - eye_.y;
        const double z = double{splat.center.z} - eye_.z;
        const double depth = forward_.x * x + forward_.y * y + forward_.z * z;
        if (!(depth >= nearest_ && depth <= farthest_)) {
            return false;
        }
        const double scale = 1.0 / depth;
        const double center_x = (across_.x * x + across_.y * y + across_.z * z) * scale + middle_.x;
        const double center_y = (up_.x * x + up_.y * y + up_.z * z) * scale + middle_.y;
        const double half = 0.5 * double{splat.side} * scale;
        square.lo = {center_x - half * focal_.x, center_y - half * focal_.y};
        square.hi = {center_x + half * focal_.x, center_y + half * focal_.y};
        square.depth = depth;
        return square.lo.x < square.hi.x && square.lo.x < high_.x && square.hi.x > low_.x &&
               square.lo.y < high_.y && square.hi.y > low_.y;
    }

    /// Pixels of the scissor whose sample at `place` the square covers.
    /// @param place within the pixel, in [0, 1]^2
    [[nodiscard]] Region
    covered(const SplatSquare& square, const glm::dvec2& place) const noexcept {
        const auto [x, width] = pixels(square.lo.x, square.hi.x, place.x, low_.x, high_.x);
        const auto [y, height] = pixels(square.lo.y, square.hi.y, place.y, low_.y, high_.y);
        return {x, y, width, height};
    }

    /// Pixels of the scissor that the square reaches into.
    [[nodiscard]] Region touched(const SplatSquare& square) const noexcept {
        const Region lower = covered(square, {1.0, 1.0});
        const auto [right, width] = pixels(square.lo.x, square.hi.x, 0.0, low_.x, high_.x);
        const auto [top, height] = pixels(square.lo.y, square.hi.y, 0.0, low_.y, high_.y);
        return {lower.x, lower.y, right + width - lower.x, top + height - lower.y};
    }

  private:
    struct Run {
        std::int32_t first = 0;
        std::int32_t count = 0;
    };
    /// Whole numbers i in [from, to) with lo <= i + place < hi. @pre 0 <= from
    [[nodiscard]] static Run
    pixels(double lo, double hi, double place, double from, double to) noexcept {
        const auto ceiling = [&](double value) {
            const double inside = std::clamp(value, from, to);
            const auto whole = static_cast<std::int32_t>(inside);
            return whole + (whole < inside ? 1 : 0);
        };
        const std::int32_t first = ceiling(lo - place);
        return {first, ceiling(hi - place) - first};
    }

    glm::dvec3 eye_{0.0};
    glm::dvec3 across_{0.0}; ///< the view's right, times the focal length [px]
    glm::dvec3 up_{0.0};
    glm::dvec3 forward_{0.0};
    glm::dvec2 focal_{1.0};  ///< [px]
    glm::dvec2 middle_{0.0}; ///< where the view direction meets the target [px]
    glm::dvec2 low_{0.0};    ///< corners of the scissor [px]
    glm::dvec2 high_{0.0};
    double nearest_ = 0.0; ///< [m]
    double farthest_ = 0.0;
};

/// A face of a cube that an eye is in front of: the corners are `origin`, `origin + edge_u`,
/// `origin + edge_v`, and the one across.
struct CubeFace {
    glm::dvec3 origin{0.0}; ///< [m] relative to the eye, in the world's axes
    glm::dvec3 edge_u{0.0}; ///< [m]
    glm::dvec3 edge_v{0.0}; ///< [m]
    glm::vec<4, std::uint8_t> color{0};
};

/// The faces of one cube that show something.
struct SeenFaces {
    std::array<CubeFace, 3> faces{};
    std::size_t count = 0;
};

/// Finds the faces that an eye is in front of; those without a colour are left out.
/// @param frame axes of the cube
/// @param eye relative to `FramePlan::origin` [m]
[[nodiscard]] SeenFaces
seen_faces(const ShownCube& cube, const glm::mat3& frame, const glm::dvec3& eye) noexcept;

} // namespace farfield::gpu
