#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>

#include <cstdint>

namespace farfield::gpu {

/// Checks what a plan says about itself, whatever pages, targets and items there are:
///
/// - there are passes; the last, and no other, is the frame; it copies nothing;
/// - batches ascend, the frame is a batch of its own, and the passes of a batch write one page;
/// - a pass has a valid view of the size of its viewport, a scissor inside the viewport, and copies
///   as many texels as its scissor has, to another page;
/// - commands lie within `commands`, what they draw within `items`, `pieces`, `quads` and `clips`;
///   images are neither clipped nor have pieces.
///
/// A backend that checks this, and what it looks up anyway, reads nothing out of range. The rest
/// of the rules is checked by `NullBackend`.
/// @return an error that names the pass, the command and the value
/// @par Cost linear in passes and commands; allocates only for an error
[[nodiscard]] Result<void> check_structure(const FramePlan& plan);

/// Checks a page that is to be made.
/// @param largest [texel] and @param most_samples what the backend can do
/// @return `invalid_argument` for what no backend can make, `unsupported` beyond these limits
[[nodiscard]] Result<void>
check_page(const PageUpdate& update, std::int32_t largest, std::int32_t most_samples);

/// Checks a target that is to be made, likewise. The largest is 16384 pixels a side.
[[nodiscard]] Result<void> check_target(
    std::int32_t width, std::int32_t height, std::int32_t samples, std::int32_t most_samples
);

} // namespace farfield::gpu
