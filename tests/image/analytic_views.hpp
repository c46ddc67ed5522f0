#pragma once

#include "image/layered_images.hpp"
#include <farfield/image/build_layered_image.hpp>
#include <farfield/math/view.hpp>

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/ext/matrix_double4x3.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace farfield::support {

/// Balls and planes whose pictures are exact. Each shape is an item with a frame of its own.
struct AnalyticScene {
    struct Ball {
        glm::dvec3 middle{0.0};
        double radius = 1.0;
    };
    /// The points p with dot(normal, p) = offset.
    struct Plane {
        glm::dvec3 normal{0.0, 1.0, 0.0};
        double offset = 0.0;
    };
    std::vector<Ball> balls;   ///< items 0 and on
    std::vector<Plane> planes; ///< items that follow

    /// Frames that differ: turned a little more for each item, and moved.
    [[nodiscard]] std::vector<glm::dmat4x3> frames() const {
        std::vector<glm::dmat4x3> all;
        for (std::size_t i = 0; i < balls.size() + planes.size(); ++i) {
            const double angle = 0.3 * static_cast<double>(i);
            glm::dmat4x3 frame(1.0);
            frame[0] = {std::cos(angle), std::sin(angle), 0.0};
            frame[1] = {-std::sin(angle), std::cos(angle), 0.0};
            frame[3] = i < balls.size() ? balls[i].middle : glm::dvec3(1.0, 2.0, 3.0);
            all.push_back(frame);
        }
        return all;
    }

    /// The nearest item along a ray, none without one. @param t how many directions it is away
    [[nodiscard]] ItemId
    first_hit(const glm::dvec3& origin, const glm::dvec3& direction, double& t) const {
        ItemId item = kNone<ItemId>;
        t = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const glm::dvec3 from = origin - balls[i].middle;
            const double a = glm::dot(direction, direction);
            const double b = glm::dot(from, direction);
            const double c = glm::dot(from, from) - balls[i].radius * balls[i].radius;
            const double root = b * b - a * c;
            if (root < 0.0) {
                continue;
            }
            const double hit = (-b - std::sqrt(root)) / a;
            if (hit > 0.0 && hit < t) {
                t = hit;
                item = make_id<ItemId>(i);
            }
        }
        for (std::size_t i = 0; i < planes.size(); ++i) {
            const double hit = (planes[i].offset - glm::dot(planes[i].normal, origin)) /
                               glm::dot(planes[i].normal, direction);
            if (hit > 0.0 && hit < t) {
                t = hit;
                item = make_id<ItemId>(balls.size() + i);
            }
        }
        return item;
    }

    /// What a backend would give. Colours tell items and columns of pixels.
    [[nodiscard]] ConstructionView picture(const View& view) const {
        const std::vector<glm::dmat4x3> all = frames();
        ConstructionView made;
        made.view = view;
        made.colors.width = made.positions.width = view.width;
        made.colors.height = made.positions.height = view.height;
        const auto pixels = pixel_count(view);
        made.colors.rgba.assign(4 * pixels, 0);
        made.positions.texels.resize(pixels);
        std::size_t at = 0;
        for (int row = 0; row < view.height; ++row) {
            for (int column = 0; column < view.width; ++column, ++at) {
                const Lens& lens = view.lens;
                const glm::dvec3 ray(
                    lens.left + (column + 0.5) * (lens.right - lens.left) / view.width,
                    lens.top + (row + 0.5) * (lens.bottom - lens.top) / view.height,
                    -1.0
                );
                const glm::dvec3 direction = view.camera_to_world * ray;
                double t = 0.0;
                const ItemId item = first_hit(view.eye, direction, t);
                if (item == kNone<ItemId> || t > lens.far_distance) {
                    continue;
                }
                const glm::dmat4x3& frame = all[index_of(item)];
                const glm::dmat3 axes(frame[0], frame[1], frame[2]);
                const glm::dvec3 local =
                    glm::transpose(axes) * (view.eye + direction * t - frame[3]);
                made.positions.texels[at].point = glm::vec3(local);
                made.positions.texels[at].item = item;
                made.colors.rgba[4 * at] = static_cast<std::uint8_t>(index_of(item));
                made.colors.rgba[4 * at + 1] = static_cast<std::uint8_t>(column);
            }
        }
        return made;
    }
};

/// The views of the paper: one from the central eye, four half way from it to the middles of the
/// edges of its window at a distance, and four as far behind; all through that window.
inline std::vector<View> construction_views(const View& central, double distance) {
    std::vector<View> views = {central};
    const Lens& lens = central.lens;
    const glm::dvec2 lo(lens.left, lens.bottom);
    const glm::dvec2 hi(lens.right, lens.top);
    const glm::dvec2 middle = (lo + hi) * 0.5;
    const std::array<glm::dvec2, 4> edges = {
        glm::dvec2(lo.x, middle.y),
        glm::dvec2(hi.x, middle.y),
        glm::dvec2(middle.x, lo.y),
        glm::dvec2(middle.x, hi.y)};
    for (const double share : {0.5, -0.5}) {
        for (const glm::dvec2& edge : edges) {
            // In the central view's axes; the window is at `distance` before its eye.
            const glm::dvec3 eye = share * distance * glm::dvec3(edge, -1.0);
            const double left_over = (1.0 - share) * distance;
            View view = central;
            view.eye = central.eye + central.camera_to_world * eye;
            view.lens.left = (lo.x * distance - eye.x) / left_over;
            view.lens.right = (hi.x * distance - eye.x) / left_over;
            view.lens.bottom = (lo.y * distance - eye.y) / left_over;
            view.lens.top = (hi.y * distance - eye.y) / left_over;
            views.push_back(view);
        }
    }
    return views;
}

} // namespace farfield::support
