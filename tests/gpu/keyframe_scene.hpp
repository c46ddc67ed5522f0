#pragma once

#include "gpu/drawing.hpp"
#include "gpu/flat_scene.hpp"
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

/// Plans that make keyframes of some items and project them onto others, and surfaces on which
/// every point has a colour of its own, so that what is shown can be told in advance.
namespace farfield::support {

/// A picture of `items` through `view`.
struct Shot {
    std::vector<ItemId> items;
    View view = flat_view();
    float copy_near = 1.0F;
    float copy_far = 33.0F;
    float offset_m = 0.25F;
    float max_shift_px = std::numeric_limits<float>::infinity();
    std::int32_t samples = 1;
};

inline constexpr std::int32_t kKeyframePageSize = 256; ///< [texel]
/// Where keyframes are on their pages: not at an edge, so that neighbours would be noticed.
inline constexpr glm::ivec2 kKeyframeCorner{5, 9};
inline constexpr std::uint32_t kKeyframeNode = 70; ///< of the first keyframe, and so on

/// Makes a keyframe of each shot, on pages from 1 on, and projects all of them, in that order, onto
/// `onto`. The last pass is the frame; its only command projects.
inline FramePlan projecting_plan(
    const std::vector<Shot>& shots, const std::vector<ItemId>& onto, const View& view = flat_view()
) {
    FramePlan plan;
    plan.pages = {{.page = PageId{0}, .size = kKeyframePageSize, .scratch = true}};
    for (const Shot& shot : shots) {
        const auto index = static_cast<std::uint32_t>(plan.keyframes.size());
        plan.pages[0].samples = shot.samples;
        const auto page = static_cast<PageId>(index + 1);
        plan.pages.push_back({.page = page, .size = kKeyframePageSize, .depth = true});
        Command fine;
        fine.first = static_cast<std::uint32_t>(plan.items.size());
        fine.count = static_cast<std::uint32_t>(shot.items.size());
        plan.items.insert(plan.items.end(), shot.items.begin(), shot.items.end());
        Pass pass;
        pass.page = PageId{0};
        pass.view = shot.view;
        pass.viewport = {3, 7, shot.view.width, shot.view.height};
        pass.scissor = pass.viewport;
        pass.first_command = static_cast<std::uint32_t>(plan.commands.size());
        pass.command_count = 1;
        pass.batch = index;
        pass.copy_page = page;
        pass.copy = {kKeyframeCorner.x, kKeyframeCorner.y, shot.view.width, shot.view.height};
        pass.copy_near = shot.copy_near;
        pass.copy_far = shot.copy_far;
        plan.commands.push_back(fine);
        plan.passes.push_back(pass);
        Keyframe keyframe;
        keyframe.page = page;
        keyframe.source = pass.copy;
        keyframe.view = shot.view;
        keyframe.copy_near = shot.copy_near;
        keyframe.copy_far = shot.copy_far;
        keyframe.offset_m = shot.offset_m;
        keyframe.max_shift_px = shot.max_shift_px;
        keyframe.node = kKeyframeNode + index;
        plan.keyframes.push_back(keyframe);
    }
    Command coarse;
    coarse.kind = Command::Kind::projected;
    coarse.first = static_cast<std::uint32_t>(plan.items.size());
    coarse.count = static_cast<std::uint32_t>(onto.size());
    coarse.keyframe_count = static_cast<std::uint32_t>(plan.keyframes.size());
    plan.items.insert(plan.items.end(), onto.begin(), onto.end());
    Pass frame;
    frame.view = view;
    frame.viewport = {0, 0, view.width, view.height};
    frame.scissor = frame.viewport;
    frame.first_command = static_cast<std::uint32_t>(plan.commands.size());
    frame.command_count = 1;
    frame.batch = coarse.keyframe_count;
    plan.commands.push_back(coarse);
    plan.passes.push_back(frame);
    return plan;
}

/// Direction through the centre of a pixel from the top left, of unit depth.
inline glm::dvec3 ray_through(const View& view, int x, int y) {
    const Lens& lens = view.lens;
    const double right = lens.left + (x + 0.5) / view.width * (lens.right - lens.left);
    const double up = lens.top - (y + 0.5) / view.height * (lens.top - lens.bottom);
    return view.camera_to_world * glm::dvec3(right, up, -1.0);
}

/// Where a view sees a point [px] of its window from the lower left; infinite: behind it.
inline glm::dvec2 seen_at(const View& view, const glm::dvec3& point) {
    const glm::dvec3 camera = glm::transpose(view.camera_to_world) * (point - view.eye);
    if (!(camera.z < 0.0)) {
        return glm::dvec2(std::numeric_limits<double>::infinity());
    }
    const Lens& lens = view.lens;
    const glm::dvec2 tangent = glm::dvec2(camera) / -camera.z;
    return {
        (tangent.x - lens.left) / (lens.right - lens.left) * view.width,
        (tangent.y - lens.bottom) / (lens.top - lens.bottom) * view.height};
}

/// Far enough inside of a window that rounding does not matter. [px]
inline bool is_well_inside(const View& view, const glm::dvec2& at, double margin = 0.01) {
    return at.x > margin && at.x < view.width - margin && at.y > margin &&
           at.y < view.height - margin;
}
inline bool is_well_outside(const View& view, const glm::dvec2& at, double margin = 0.01) {
    return !(
        at.x > -margin && at.x < view.width + margin && at.y > -margin &&
        at.y < view.height + margin
    );
}

/// A square in a plane z = const whose green grows with x and whose blue grows with y, so that a
/// colour says which point is shown.
struct Gradient {
    ItemId item = kNone<ItemId>;
    glm::dvec3 at{0.0};
    double half = 1.0; ///< [m]
    static constexpr double kLeast = 40.0;
    static constexpr double kMost = 255.0;

    /// Of the point above or below `x` and `y`.
    [[nodiscard]] glm::dvec2 green_and_blue(const glm::dvec2& point) const {
        return kLeast + (kMost - kLeast) * ((point - glm::dvec2(at)) / half * 0.5 + 0.5);
    }
    [[nodiscard]] bool holds(const glm::dvec2& point, double margin) const {
        return std::abs(point.x - at.x) < half - margin && std::abs(point.y - at.y) < half - margin;
    }
};

inline Gradient add_gradient(Scene& scene, const glm::dvec3& at, double half) {
    Mesh mesh = quad_mesh();
    constexpr auto kLow = static_cast<std::uint8_t>(Gradient::kLeast);
    constexpr auto kHigh = static_cast<std::uint8_t>(Gradient::kMost);
    mesh.colors = {
        {0, kLow, kLow, 255}, {0, kHigh, kLow, 255}, {0, kLow, kHigh, 255}, {0, kHigh, kHigh, 255}};
    add_instance(scene, add_mesh(scene, std::move(mesh), kNone<MaterialId>), at, 0.0, half);
    return {make_id<ItemId>(scene.instances.size() - 1), at, half};
}

} // namespace farfield::support
