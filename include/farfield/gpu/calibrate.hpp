#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/policy/cost_model.hpp>

#include <cstdint>
#include <functional>
#include <span>

namespace farfield::gpu {

/// How `calibrate` measures.
struct CalibrationOptions {
    /// [s] Time to spend. Once it is over what is left is measured a single time each, so that a
    /// slow device takes longer rather than giving no answer. > 0, finite
    double seconds = 1.5;
    std::uint32_t repeats = 9; ///< of each plan while there is time; their median counts. >= 1
    /// Whose pages to make and drop again: of no technique on that backend.
    std::uint32_t cache_id = UINT32_MAX;
    /// [s] A clock that never goes back; empty: the steady clock of the machine.
    std::function<double()> clock = {};
};

/// Measures what drawing costs on a backend with its own geometry source, by timing plans made for
/// it. A plan is drawn twice before it counts; plans that are compared take turns; medians count.
/// Counts of things are doubled until they take 2 ms, or there are no more. Each figure is a
/// difference:
///
/// - A frame with nothing in it comes off all others.
/// - `image_quad_s`, `image_pixel_s`: as many images of 8 x 8 pixels as of 64 x 64. Their
///   difference is all pixels; what the small ones take beyond theirs is the quads'.
/// - `pass_s`, `texel_s`: as many images made of 16 x 16 texels as of 64 x 64, each of one small
///   image, whose cost comes off.
/// - `splat_s`, `cube_s`: splats, and cubes, of 0.7 pixels all over the frame; half of such splats
///   cover a sample, and three faces of each cube are seen.
/// - `triangle_s`, `draw_call_s`: the items with the fewest triangles, those with the most, one run
///   of primitives of a split item, as many primitives in runs of one; the non-negative least
///   squares of relative errors over these. Where all of them have alike many triangles a draw
///   (less than 10 % apart), the two cannot be told apart, and keep the ratio of the default model.
/// - `geometry_pixel_s`: the whole scene on 512 x 512 pixels and on 128 x 128, over the pixels that
///   its box covers. It is 0 unless pixels take at least half of the time, as where rays are cast;
///   then it comes off first, and triangles and draws are fitted to what is left.
///
/// `cell_s` is not of the backend and stays at its default.
///
/// The whole scene fills a frame of 512 x 512 pixels while items are timed, so a triangle costs
/// what it does at that size.
///
/// This is the one place outside of `eval` that reads a clock: plans are made with the result as
/// data.
/// @param hierarchy over the items of the backend's geometry source
/// @param item_primitives triangles of every item, by `ItemId`
/// @return every figure finite and at least 1e-12 seconds; or an error of the backend, or
/// `invalid_argument` for options out of range, for a scene without anything to draw, and for items
/// that `item_primitives` does not know. Pages and targets made are gone either way.
/// @par Source Shade et al. 1996, section 2, has costs "established experimentally on each
/// platform" and does not say how
[[nodiscard]] Result<CostModel> calibrate(
    Backend& backend,
    const Hierarchy& hierarchy,
    std::span<const std::uint64_t> item_primitives,
    const CalibrationOptions& options = {}
);

} // namespace farfield::gpu
