#pragma once

#include <farfield/gpu/frame_plan.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <cstdint>

namespace farfield {

/// Appends to a plan and joins what can be drawn in one go: neighbouring items, pieces and quads.
/// Commands belong to the pass that is open. Passes may be nested: what one needs is made, and
/// closed, before its own first command.
class PlanWriter {
  public:
    PlanWriter(FramePlan& plan, const Hierarchy& hierarchy) noexcept
        : plan_(&plan), hierarchy_(&hierarchy) {}

    /// Begins a run of commands.
    void open() noexcept { first_command_ = static_cast<std::uint32_t>(plan_->commands.size()); }

    /// Ends it and appends the pass that they belong to.
    void close(Pass pass) noexcept;

    /// Whole items `first`..`first + count` of `Hierarchy::items`, but for those that have left.
    void items(std::uint32_t first, std::uint32_t count) noexcept;

    /// One whole item.
    void item(ItemId id) noexcept;

    /// Pieces `first`..`first + count` of `Hierarchy::pieces`, as geometry or as a mask.
    /// @param clip index into `FramePlan::clips` or `Command::kNoClip`
    void pieces(
        Command::Kind kind, std::uint32_t first, std::uint32_t count, std::uint32_t clip
    ) noexcept;

    /// A run of primitives as geometry.
    void piece(const Piece& run, std::uint32_t clip) noexcept;

    /// One image.
    void image(const ImageQuad& quad, QuadDepth depth) noexcept;

    /// The depths of all images since the one at `first_quad`.
    void image_depths(std::size_t first_quad, QuadDepth depth) noexcept;

  private:
    void append(Command& target, const Piece& run) noexcept;
    [[nodiscard]] Command& command(Command::Kind kind, std::uint32_t clip) noexcept;

    FramePlan* plan_;
    const Hierarchy* hierarchy_;
    std::uint32_t first_command_ = 0;
};

} // namespace farfield
