#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>

#include <cstddef>
#include <cstdint>

namespace farfield::gpu {

/// Checks what a plan says about itself, whatever pages, targets and items there are:
///
/// - there are passes; the last, and no other, is the frame; it copies nothing;
/// - batches ascend, the frame is a batch of its own, and the passes of a batch write one page;
/// - a pass has a valid view of the size of its viewport, a scissor inside the viewport, and copies
///   as many texels as its scissor has, to another page;
/// - commands lie within `commands`, and what they draw within the lists they name; only geometry,
///   masks and projected geometry are clipped and have pieces and selections; depths of images are
///   those of planes or texels, and everything else names none;
/// - projected geometry has 1 to `kMostKeyframes` keyframes, everything else has none, and no pass
///   of its batch copies to their pages;
/// - selections lie within `selected`;
/// - places, sides and edges of splats and cubes are finite, sides and edges not negative, their
///   colours premultiplied (no channel exceeds alpha), and the axes of a cube a frame of the plan;
/// - a keyframe has a valid view of the size of its source, depths in order, and an offset and a
///   shift that are not negative; only the shift may be infinite;
/// - layered updates name an image, and those that create one have a content.
///
/// A backend that checks this, and what it looks up anyway, reads nothing out of range. The rest
/// of the rules is checked by `NullBackend`.
/// @return an error that names the pass, the command and the value
/// @par Cost linear in passes, commands, selections, splats, cubes, keyframes and layered updates,
/// and for every command of projected geometry in the passes of its batch; allocates only for an
/// error
[[nodiscard]] Result<void> check_structure(const FramePlan& plan);

/// What a backend knows of a page that exists.
struct PageFacts {
    std::int32_t size = 0; ///< [texel] width and height
    bool scratch = false;
    bool depth = false; ///< keeps 16 bits beside each texel
};

/// Bytes of a page as `Backend::image_bytes` counts them, on every device alike: RGBA8, 16 bits a
/// texel where it keeps depth, and 32 bits of depth for each sample of a scratch page.
[[nodiscard]] std::uint64_t page_bytes(const PageFacts& page, std::int32_t samples) noexcept;

/// Checks where one pass draws and copies to: into the frame or a scratch page, the viewport within
/// it; to a page that is none, within it, and between which distances where that keeps depth.
/// @param frame [px] the target
/// @param page, copy_page what `Pass::page` and `Pass::copy_page` are; null: they do not exist. Not
/// looked at where the pass names none
/// @pre check_structure(plan)
/// @return an error that names the pass, the page and the region
/// @par Cost constant; allocates only for an error
[[nodiscard]] Result<void> check_places(
    const FramePlan& plan,
    std::size_t pass,
    const Region& frame,
    const PageFacts* page,
    const PageFacts* copy_page
);

/// Checks the page that one image shows: it exists, is no scratch page, and keeps depth if the
/// command asks for that of texels.
/// @param pass, command, quad indices that the error names
/// @param page what `ImageQuad::page` of the quad is, or null
/// @return an error that names the pass, the command, the quad and the page
/// @par Cost constant; allocates only for an error
[[nodiscard]] Result<void> check_image_page(
    const FramePlan& plan,
    std::size_t pass,
    std::uint32_t command,
    std::uint32_t quad,
    const PageFacts* page
);

/// Checks the page that a keyframe shows: it exists, is no scratch page, keeps depth, and the
/// keyframe's source lies within it.
/// @param pass, command, keyframe indices that the error names
/// @param page what `Keyframe::page` of the keyframe is, or null
/// @return an error that names the pass, the command, the keyframe and the page
/// @par Cost constant; allocates only for an error
[[nodiscard]] Result<void> check_keyframe_page(
    const FramePlan& plan,
    std::size_t pass,
    std::uint32_t command,
    std::uint32_t keyframe,
    const PageFacts* page
);

/// Checks a page that is to be made.
/// @param largest [texel] and @param most_samples what the backend can do
/// @return `invalid_argument` for what no backend can make, `unsupported` beyond these limits
[[nodiscard]] Result<void>
check_page(const PageUpdate& update, std::int32_t largest, std::int32_t most_samples);

/// Checks a layered depth image that is to be handed over: all that `validate` checks, so that
/// warping it reads nothing out of range.
/// @pre check_structure(plan) of the update's plan
/// @return an error that names the image and what is wrong with it
/// @par Cost linear in texels and samples of an image that is created
[[nodiscard]] Result<void> check_layered_update(const LayeredUpdate& update);

/// Checks one layered image that a command shows: it exists.
/// @param pass, command, shown indices that the error names; the last into `FramePlan::layers`
/// @return an error that names the pass, the command, the element and the image
/// @par Cost constant; allocates only for an error
[[nodiscard]] Result<void> check_shown_layers(
    const FramePlan& plan, std::size_t pass, std::uint32_t command, std::uint32_t shown, bool exists
);

/// Bytes of a layered depth image as `Backend::image_bytes` counts them, on every device alike: its
/// samples, counts and rows. Points count as positions.
[[nodiscard]] std::uint64_t layered_bytes(const LayeredDepthImage& image) noexcept;

/// Checks a target that is to be made, likewise. The largest is 16384 pixels a side.
[[nodiscard]] Result<void> check_target(
    std::int32_t width, std::int32_t height, std::int32_t samples, std::int32_t most_samples
);

} // namespace farfield::gpu
