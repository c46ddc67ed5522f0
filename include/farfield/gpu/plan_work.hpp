#pragma once

#include <farfield/gpu/frame_plan.hpp>

#include <cstdint>
#include <span>

namespace farfield {

/// What executing a plan comes to, images included.
struct PlanWork {
    std::uint64_t triangles = 0;    ///< of items and pieces, in all passes; quads not counted
    std::uint64_t draws = 0;        ///< items, pieces and runs of images or depths
    std::uint64_t image_quads = 0;  ///< shown in the frame
    std::uint64_t images = 0;       ///< made
    std::uint64_t image_texels = 0; ///< made, borders included
};

/// Adds up a plan.
/// @param item_primitives triangles of every item, by `ItemId`
[[nodiscard]] PlanWork
work_of(const FramePlan& plan, std::span<const std::uint64_t> item_primitives) noexcept;

} // namespace farfield
