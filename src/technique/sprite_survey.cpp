#include "technique/sprite_survey.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield {

namespace {

// Parts are looked at as a whole where they are no larger than this share of the window's height.
constexpr float kPartShare = 1.0F / 20.0F;
// Slopes beyond this are taken for as steep: their areas are those of boxes, not of surfaces.
constexpr float kLeastSlope = 0.125F;
// Depths of parts are those of their middles; a hidden one has to stand this much farther.
constexpr float kDepthSlack = 1.02F;

/// Area of the surface in a box: its face across the axis that the normal is nearest to, as much
/// larger as the surface leans.
float area_within(const Box3f& box, const glm::vec3& normal) noexcept {
    const glm::vec3 size = extent(box);
    const glm::vec3 slope = glm::abs(normal);
    const int axis = slope.x > slope.y ? (slope.x > slope.z ? 0 : 2) : (slope.y > slope.z ? 1 : 2);
    const float across = size[(axis + 1) % 3] * size[(axis + 2) % 3];
    return across / std::max(slope[axis], kLeastSlope);
}

/// The cells of a window that something may cover.
struct Cells {
    int x0 = 0;
    int y0 = 0;
    int x1 = -1;
    int y1 = -1;
};

Cells cells_of(
    const glm::vec3& point, const ImageCamera& camera, float depth, int side, float reach
) noexcept {
    const glm::vec3 offset = point - camera.eye;
    const Lens& lens = camera.view.lens;
    const float to_x = static_cast<float>(side / (lens.right - lens.left));
    const float to_y = static_cast<float>(side / (lens.top - lens.bottom));
    const float x = (glm::dot(offset, camera.right) / depth - static_cast<float>(lens.left)) * to_x;
    const float y = (glm::dot(offset, camera.up) / depth - static_cast<float>(lens.bottom)) * to_y;
    const float across = reach / depth;
    const auto cell = [&](float at) {
        return static_cast<int>(std::floor(std::clamp(at, -1.0F, static_cast<float>(side))));
    };
    Cells cells;
    cells.x0 = std::max(cell(x - across * to_x), 0);
    cells.y0 = std::max(cell(y - across * to_y), 0);
    cells.x1 = std::min(cell(x + across * to_x), side - 1);
    cells.y1 = std::min(cell(y + across * to_y), side - 1);
    return cells;
}

} // namespace

void SurveyDepths::clear() noexcept {
    nearest_.fill(std::numeric_limits<float>::infinity());
}

void SurveyDepths::add(const SurveyPoint& point, const ImageCamera& camera) noexcept {
    const float depth = glm::dot(point.point - camera.eye, camera.forward);
    if (depth <= point.radius) {
        return;
    }
    // A part covers what is around its middle; half of its radius is what boxes are full of.
    const Cells cells = cells_of(point.point, camera, depth, kSide, 0.5F * point.radius);
    for (int y = cells.y0; y <= cells.y1; ++y) {
        for (int x = cells.x0; x <= cells.x1; ++x) {
            float& nearest =
                nearest_[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)];
            nearest = std::min(nearest, depth + point.radius);
        }
    }
}

bool SurveyDepths::hides(const SurveyPoint& point, const ImageCamera& camera) const noexcept {
    const float depth = glm::dot(point.point - camera.eye, camera.forward);
    if (depth <= point.radius) {
        return false;
    }
    const Cells middle = cells_of(point.point, camera, depth, kSide, 0.0F);
    float farthest = 0.0F;
    for (int y = std::max(middle.y0 - 1, 0); y <= std::min(middle.y1 + 1, kSide - 1); ++y) {
        for (int x = std::max(middle.x0 - 1, 0); x <= std::min(middle.x1 + 1, kSide - 1); ++x) {
            farthest = std::max(
                farthest,
                nearest_[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)]
            );
        }
    }
    return (depth - point.radius) > farthest * kDepthSlack;
}

void SurveyMask::clear() noexcept {
    bits_.fill(0);
    everywhere_ = 0;
    any_ = 0;
}

void SurveyMask::add(
    const SurveyPoint& point, std::uint8_t bits, const ImageCamera& camera
) noexcept {
    any_ |= bits;
    const float depth = glm::dot(point.point - camera.eye, camera.forward);
    if (depth <= point.radius) {
        everywhere_ |= bits;
        return;
    }
    const Cells cells = cells_of(point.point, camera, depth, kSide, 0.5F * point.radius);
    for (int y = cells.y0; y <= cells.y1; ++y) {
        for (int x = cells.x0; x <= cells.x1; ++x) {
            bits_[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)] |= bits;
        }
    }
}

std::uint8_t
SurveyMask::bits(const glm::vec3& center, float radius, const ImageCamera& camera) const noexcept {
    const float depth = glm::dot(center - camera.eye, camera.forward);
    if (depth <= radius) {
        return any_;
    }
    std::uint8_t found = everywhere_;
    const Cells cells = cells_of(center, camera, depth, kSide, radius);
    for (int y = cells.y0; y <= cells.y1; ++y) {
        for (int x = cells.x0; x <= cells.x1; ++x) {
            found |= bits_[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)];
        }
    }
    return found;
}

SpriteSurvey::SpriteSurvey() {
    points_.reserve(kMostPoints);
}

void SpriteSurvey::look(std::span<const SurveyModel> models, const ImageCamera& camera) noexcept {
    points_.clear();
    depths_.clear();
    total_weight_ = 0.0F;
    for (const SurveyModel& model : models) {
        frustum_ = make_frustum(camera.view, model.pair->origin);
        visit(model, 0, camera, false);
    }
    for (const SurveyPoint& point : points_) {
        depths_.add(point, camera);
    }
    for (SurveyPoint& point : points_) {
        if (depths_.hides(point, camera)) {
            point.weight = 0.0F;
        }
        total_weight_ += point.weight;
    }
}

void SpriteSurvey::visit(
    const SurveyModel& model, std::uint32_t index, const ImageCamera& camera, bool inside
) noexcept {
    const ProxyNode& node = model.pair->nodes[index];
    if (!inside) {
        const Overlap overlap = classify(frustum_, node.bounds);
        if (overlap == Overlap::outside) {
            return;
        }
        inside = overlap == Overlap::inside;
    }
    const glm::vec3 middle = center(node.bounds) + model.offset;
    const glm::vec3 offset = middle - camera.eye;
    const float distance = glm::length(offset);
    const float radius = 0.5F * glm::length(extent(node.bounds));
    const auto window = static_cast<float>(camera.view.lens.top - camera.view.lens.bottom);
    const bool small = 2.0F * radius <= kPartShare * window * distance;
    if (node.first_child != 0 && !small && points_.size() + 2 <= kMostPoints) {
        visit(model, node.first_child, camera, inside);
        visit(model, node.first_child + 1, camera, inside);
        return;
    }
    if (!(distance > 0.0F) || points_.size() == kMostPoints ||
        (!inside &&
         !std::all_of(frustum_.planes.begin(), frustum_.planes.end(), [&](const Plane& plane) {
             return signed_distance(plane, center(node.bounds)) >= 0.0F;
         }))) {
        return;
    }
    SurveyPoint point;
    point.point = middle;
    point.normal = node.axis;
    point.radius = radius;
    // Heights are spread between both ends; half of the greater is what most are about.
    point.height = 0.5F * std::max({node.above, -node.below, 0.0F});
    const float facing = std::abs(glm::dot(node.axis, offset)) / distance;
    const float pixels = camera.pixels_per_tangent_x * camera.pixels_per_tangent_y;
    point.weight = area_within(node.bounds, node.axis) * facing * pixels / (distance * distance);
    points_.push_back(point);
}

} // namespace farfield
