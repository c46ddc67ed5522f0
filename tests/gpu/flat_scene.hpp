#pragma once

#include "support/small_scene.hpp"
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <vector>

/// Scenes of quads in flat colours whose pixels can be told in advance.
namespace farfield::support {

inline constexpr int kSize = 64; ///< [px] of the frame

/// From (0, 0, 8) along -z, 90 degrees either way: in the plane z = 0 a pixel is a quarter of a
/// metre, and pixel edges are its multiples.
inline View flat_view(const glm::dvec3& offset = {}, int size = kSize) {
    const glm::dvec3 eye(0.0, 0.0, 8.0);
    return look_at(offset + eye, offset, {0.0, 1.0, 0.0}, {-1, 1, -1, 1, 0.5, 100.0}, size, size);
}

/// An empty scene lit so that colours are what materials say.
inline Scene flat_scene() {
    Scene scene;
    scene.light.ambient = 1.0F;
    return scene;
}

/// Adds a quad of `half` metres to either side of `at`.
inline ItemId add_quad(
    Scene& scene,
    const glm::vec4& color,
    const glm::dvec3& at,
    double half = 1.0,
    double yaw_rad = 0.0
) {
    const MaterialId material = add_material(scene, {.base_color = color});
    add_instance(scene, add_mesh(scene, quad_mesh(), material), at, yaw_rad, half);
    return make_id<ItemId>(scene.instances.size() - 1);
}

/// A frame that draws items in one command.
inline FramePlan flat_plan(const std::vector<ItemId>& items, const View& view = flat_view()) {
    FramePlan plan;
    plan.items = items;
    Command command;
    command.count = static_cast<std::uint32_t>(items.size());
    plan.commands = {command};
    Pass pass;
    pass.view = view;
    pass.viewport = {0, 0, view.width, view.height};
    pass.scissor = pass.viewport;
    pass.command_count = 1;
    plan.passes = {pass};
    return plan;
}

inline const glm::vec4 kRedPaint{1.0F, 0.0F, 0.0F, 1.0F};
inline const glm::vec4 kGreenPaint{0.0F, 1.0F, 0.0F, 1.0F};
inline const glm::vec4 kBluePaint{0.0F, 0.0F, 1.0F, 1.0F};
inline constexpr std::array<int, 4> kRed = {255, 0, 0, 255};
inline constexpr std::array<int, 4> kGreen = {0, 255, 0, 255};
inline constexpr std::array<int, 4> kBlue = {0, 0, 255, 255};
inline constexpr std::array<int, 4> kBlack = {0, 0, 0, 255};

} // namespace farfield::support
