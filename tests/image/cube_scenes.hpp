#pragma once

#include "support/random.hpp"
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/image/surface_sampler.hpp>
#include <farfield/math/triangle_box.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

/// What colour cubes are built from, by hand: lists of triangles, and surfaces that are formulas.
namespace farfield::support {

/// Lets every ray pass, where colours do not matter.
class EmptySampler final : public SurfaceSampler {
  public:
    explicit EmptySampler(const glm::dvec3& origin = glm::dvec3(0.0)) : origin_(origin) {}
    [[nodiscard]] glm::dvec3 origin() const noexcept override { return origin_; }
    void cast(
        ItemId /*item*/,
        std::span<const SurfaceRay> /*rays*/,
        float /*spacing*/,
        std::span<SurfaceHit> hits
    ) const noexcept override {
        std::fill(hits.begin(), hits.end(), SurfaceHit{});
    }

  private:
    glm::dvec3 origin_;
};

/// Boxes and balls, the same in the world and in the frame of every item.
class ShapeSampler final : public SurfaceSampler {
  public:
    /// A plane is a box that is flat.
    void add_box(const Box3f& box, const glm::vec3& color) { boxes_.push_back({box, color}); }
    void add_ball(const glm::vec3& middle, float radius, const glm::vec3& color) {
        balls_.push_back({middle, radius, color});
    }

    [[nodiscard]] glm::dvec3 origin() const noexcept override { return origin_; }
    void set_origin(const glm::dvec3& origin) { origin_ = origin; }

    void cast(
        ItemId /*item*/,
        std::span<const SurfaceRay> rays,
        float /*spacing*/,
        std::span<SurfaceHit> hits
    ) const noexcept override {
        for (std::size_t i = 0; i < rays.size(); ++i) {
            hits[i] = {};
            for (const Box& box : boxes_) {
                meet(rays[i], box, hits[i]);
            }
            for (const Ball& ball : balls_) {
                meet(rays[i], ball, hits[i]);
            }
        }
    }

  private:
    struct Box {
        Box3f box;
        glm::vec3 color;
    };
    struct Ball {
        glm::vec3 middle;
        float radius;
        glm::vec3 color;
    };

    static void meet(const SurfaceRay& ray, const Box& box, SurfaceHit& hit) noexcept {
        float enter = -std::numeric_limits<float>::infinity();
        float leave = std::numeric_limits<float>::infinity();
        glm::vec3 normal(0.0F);
        for (int axis = 0; axis < 3; ++axis) {
            if (ray.along[axis] == 0.0F) {
                if (ray.from[axis] < box.box.lo[axis] || ray.from[axis] > box.box.hi[axis]) {
                    return;
                }
                continue;
            }
            const float to_lo = (box.box.lo[axis] - ray.from[axis]) / ray.along[axis];
            const float to_hi = (box.box.hi[axis] - ray.from[axis]) / ray.along[axis];
            if (std::min(to_lo, to_hi) > enter) {
                enter = std::min(to_lo, to_hi);
                normal = glm::vec3(0.0F);
                normal[axis] = ray.along[axis] > 0.0F ? -1.0F : 1.0F;
            }
            leave = std::min(leave, std::max(to_lo, to_hi));
        }
        if (enter <= leave && enter >= 0.0F && enter <= 1.0F && enter < hit.t) {
            hit = {enter, box.color, normal};
        }
    }

    static void meet(const SurfaceRay& ray, const Ball& ball, SurfaceHit& hit) noexcept {
        const glm::vec3 offset = ray.from - ball.middle;
        const float a = glm::dot(ray.along, ray.along);
        const float b = glm::dot(offset, ray.along);
        const float c = glm::dot(offset, offset) - ball.radius * ball.radius;
        const float root = b * b - a * c;
        if (root < 0.0F) {
            return;
        }
        for (const float t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a}) {
            if (t >= 0.0F && t <= 1.0F && t < hit.t) {
                hit = {t, ball.color, (offset + ray.along * t) / ball.radius};
                return;
            }
        }
    }

    glm::dvec3 origin_{0.0};
    std::vector<Box> boxes_;
    std::vector<Ball> balls_;
};

/// Triangles as one splittable object.
struct TriangleSoup {
    std::vector<Triangle3d> triangles;
    std::vector<Object> objects; ///< filled by `input`

    [[nodiscard]] ColorCubeInput input() {
        Box3d box;
        for (const Triangle3d& triangle : triangles) {
            box = unite(box, bounds(triangle));
        }
        objects = {{box, triangles.size(), true}};
        ColorCubeInput result;
        result.objects = objects;
        result.triangle = [this](std::uint32_t, std::uint32_t triangle) {
            return triangles[triangle];
        };
        return result;
    }
};

/// A corner in multiples of 2^-16 m, so that moving it to 1e7 m changes no digit.
inline glm::dvec3 on_grid(const glm::dvec3& p) {
    return glm::round(p * 65536.0) / 65536.0;
}

/// Triangles of about `size` in a cube of 100 m about the origin.
inline TriangleSoup random_soup(std::size_t count, double size, std::uint64_t seed) {
    Random random(seed);
    TriangleSoup soup;
    for (std::size_t i = 0; i < count; ++i) {
        const glm::dvec3 middle = random.vector(-50.0, 50.0);
        Triangle3d triangle{};
        for (glm::dvec3& corner_at : triangle) {
            corner_at = on_grid(middle + random.vector(-size, size));
        }
        soup.triangles.push_back(triangle);
    }
    return soup;
}

} // namespace farfield::support
