#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace farfield {

/// Executes plans without a device: draws nothing, checks everything, counts the work. Techniques
/// are tested with it, and so is what an engine plans before it draws for the first time.
///
/// A plan is refused, with an error that names pass, command, element and value, when it breaks
/// one of these rules:
///
/// - all of `gpu::check_structure`;
/// - pages to make have a size and samples within the limits; only scratch pages have several;
/// - passes draw into scratch pages, or into the target; viewports lie within them;
/// - passes of one batch have disjoint scissors;
/// - copies go to pages that are no scratch pages, and lie within them;
/// - an image shows a region that was copied as a whole in an earlier batch or plan, and that no
///   later copy overwrote; the page was not made anew or dropped since;
/// - a keyframe shows regions that were copied so, and nothing else;
/// - images with `QuadDepth::none` stand at the near distance or behind it; those of the frame not
///   beyond the far distance; ratios of depths are in order;
/// - items, pieces and the primitives of selections exist, and no selection names one twice;
/// - frames of cubes are rotations;
/// - layered images that are handed over pass `validate`, and one that is shown was handed over in
///   this plan or an earlier one and not dropped since;
/// - all numbers are finite, and clip boxes are not empty.
///
/// After an error the images of that cache, layered ones too, count as never made, so that a
/// technique that does not start over is found out.
///
/// @par Cost linear in the plan and in what layered images hold that it hands over, selections
/// sorted, plus the images of a page for each image copied to it. Allocates nothing once warm.
class NullBackend final : public Backend {
  public:
    static constexpr Limits kDefaultLimits{.page_size = 16384, .samples = 16};

    /// @param item_primitives triangles of every item, by `ItemId`; copied
    /// @param hierarchy over the same items: pieces must be runs of its primitives that belong to
    /// their item. Null: pieces are held against the number of primitives of their item alone. Not
    /// needed afterwards.
    explicit NullBackend(
        std::span<const std::uint64_t> item_primitives,
        const Hierarchy* hierarchy = nullptr,
        const Limits& limits = kDefaultLimits
    );
    ~NullBackend() override;

    [[nodiscard]] Result<void>
    execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept override;
    void finish() noexcept override {}
    [[nodiscard]] Result<TargetId>
    create_target(std::int32_t width, std::int32_t height, std::int32_t samples) noexcept override;
    void destroy_target(TargetId target) noexcept override;

    /// @return always an error: `unsupported` for a target that exists, since nothing was drawn
    [[nodiscard]] Result<Picture> read_target(TargetId target) override;
    /// @return always an error, as `read_target`
    [[nodiscard]] Result<PositionPicture> read_positions(TargetId target) override;
    [[nodiscard]] Limits limits() const noexcept override;
    [[nodiscard]] std::string device() const override { return "null"; }
    [[nodiscard]] std::uint64_t image_bytes() const noexcept override;
    /// What a backend with `Limits::positions` would need.
    [[nodiscard]] std::uint64_t position_bytes() const noexcept override;

    /// Sum over all plans executed.
    [[nodiscard]] const PlanWork& total_work() const noexcept;
    [[nodiscard]] std::uint64_t plans_executed() const noexcept;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield
