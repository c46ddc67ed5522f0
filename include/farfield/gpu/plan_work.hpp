#pragma once

#include <farfield/gpu/frame_plan.hpp>

#include <cstdint>
#include <span>

namespace farfield {

/// What executing a plan comes to, images included.
struct PlanWork {
    /// Of items, pieces and selections, in all passes; quads, splats, cubes and samples of layered
    /// images not counted.
    std::uint64_t triangles = 0;
    /// Items, pieces, selections, layered images, and commands of images, depths, splats or cubes.
    std::uint64_t draws = 0;
    std::uint64_t image_quads = 0;    ///< shown in the frame
    std::uint64_t images = 0;         ///< made
    std::uint64_t image_texels = 0;   ///< made, borders included
    std::uint64_t splats = 0;         ///< in all passes, drawn or dropped
    std::uint64_t cubes = 0;          ///< in all passes
    std::uint64_t layered_images = 0; ///< shown, in all passes
};

/// Adds up a plan.
/// @param item_primitives triangles of every item, by `ItemId`
[[nodiscard]] PlanWork
work_of(const FramePlan& plan, std::span<const std::uint64_t> item_primitives) noexcept;

} // namespace farfield
