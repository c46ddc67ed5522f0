#pragma once

#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

/// Plans written by hand, for what no technique plans.
namespace farfield::support {

inline constexpr PageId kScratchPage{0};
inline constexpr PageId kImagePage{1};
inline constexpr std::int32_t kPageSize = 64;  ///< [texel]
inline constexpr std::int32_t kImageSize = 16; ///< [texel]
inline constexpr std::int32_t kFrameSize = 32; ///< [px]

/// From (0, 0, 5) to the origin, 90 degrees either way: a pixel in the middle of a frame of 32 sees
/// 5 / 16 of a metre.
inline View hand_made_view(int size) {
    return look_at(
        {0.0, 0.0, 5.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {-1, 1, -1, 1, 0.5, 50.0}, size, size
    );
}

inline Pass hand_made_pass(int size) {
    Pass pass;
    pass.view = hand_made_view(size);
    pass.viewport = {0, 0, size, size};
    pass.scissor = pass.viewport;
    return pass;
}

inline Command items_command(std::uint32_t first, std::uint32_t count) {
    Command command;
    command.first = first;
    command.count = count;
    return command;
}

inline Command images_command(std::uint32_t first, std::uint32_t count) {
    Command command = items_command(first, count);
    command.kind = Command::Kind::images;
    return command;
}

/// The whole image of `plan_with_image`, across the view at a distance of 5.
inline ImageQuad hand_made_quad() {
    ImageQuad quad;
    quad.page = kImagePage;
    quad.source = {0, 0, kImageSize, kImageSize};
    quad.origin = {-5.0F, -5.0F, 0.0F};
    quad.edge_u = {10.0F, 0.0F, 0.0F};
    quad.edge_v = {0.0F, 10.0F, 0.0F};
    quad.depth = 5.0F;
    return quad;
}

/// Draws item 0 into the frame.
inline FramePlan plan_with_item() {
    FramePlan plan;
    plan.items = {ItemId{0}};
    plan.commands = {items_command(0, 1)};
    plan.passes = {hand_made_pass(kFrameSize)};
    plan.passes[0].command_count = 1;
    return plan;
}

/// Makes pages, an image of item 0, and shows it.
inline FramePlan plan_with_image() {
    FramePlan plan;
    plan.pages = {
        {.page = kScratchPage, .size = kPageSize, .scratch = true},
        {.page = kImagePage, .size = kPageSize}};
    plan.items = {ItemId{0}};
    plan.quads = {hand_made_quad()};
    plan.commands = {items_command(0, 1), images_command(0, 1)};
    Pass image = hand_made_pass(kImageSize);
    image.page = kScratchPage;
    image.command_count = 1;
    image.copy_page = kImagePage;
    image.copy = {0, 0, kImageSize, kImageSize};
    Pass frame = hand_made_pass(kFrameSize);
    frame.first_command = 1;
    frame.command_count = 1;
    frame.batch = 1;
    plan.passes = {image, frame};
    return plan;
}

/// Makes the same image, and shows it and writes its depths before item 0 is drawn once more.
inline FramePlan plan_with_depths(QuadDepth depth) {
    FramePlan plan = plan_with_image();
    plan.pages[1].depth = depth == QuadDepth::texel;
    plan.passes[0].copy_near = 0.5F;
    plan.passes[0].copy_far = 50.0F;
    plan.quads[0].viewpoint = {0.0F, 0.0F, 5.0F};
    plan.quads[0].near_ratio = 0.1F;
    plan.quads[0].far_ratio = 10.0F;
    plan.commands[1].depth = depth;
    plan.commands.push_back(plan.commands[1]);
    plan.commands[2].kind = Command::Kind::image_depths;
    plan.commands.push_back(plan.commands[0]);
    plan.passes[1].command_count = 3;
    return plan;
}

/// Draws two primitives of item 0, then splats over them, small ones and a large one, then a cube.
inline FramePlan plan_with_cells() {
    FramePlan plan;
    plan.selected = {0, 2};
    plan.selections = {{ItemId{0}, 0, 2}};
    for (int i = 0; i < 40; ++i) {
        const float x = 0.07F * static_cast<float>(i - 20);
        plan.splats.push_back({{x, 0.3F + x, 0.0F}, 0.15F, {0, 100, 50, 200}});
    }
    plan.splats.push_back({{-1.0F, 1.0F, 0.0F}, 2.0F, {90, 0, 60, 128}});
    plan.cube_frames = {glm::mat3(1.0F)};
    ShownCube cube;
    cube.center = {1.0F, -1.0F, 0.0F};
    cube.size = glm::vec3(1.3F);
    cube.faces = {{{200, 0, 0, 255}, {0, 150, 0, 255}, {0, 0, 100, 150}}};
    plan.cubes = {cube};
    plan.commands.resize(3);
    plan.commands[0].selection_count = 1;
    plan.commands[1].kind = Command::Kind::splats;
    plan.commands[1].count = static_cast<std::uint32_t>(plan.splats.size());
    plan.commands[2].kind = Command::Kind::cubes;
    plan.commands[2].count = 1;
    plan.passes = {hand_made_pass(kFrameSize)};
    plan.passes[0].command_count = 3;
    return plan;
}

/// Makes a keyframe of item 0, and projects it onto item 0, from where it was made.
inline FramePlan plan_with_keyframe() {
    FramePlan plan = plan_with_image();
    plan.quads.clear();
    plan.pages[1].depth = true;
    plan.passes[0].copy_near = 0.5F;
    plan.passes[0].copy_far = 50.0F;
    Keyframe keyframe;
    keyframe.page = kImagePage;
    keyframe.source = plan.passes[0].copy;
    keyframe.view = plan.passes[0].view;
    keyframe.copy_near = plan.passes[0].copy_near;
    keyframe.copy_far = plan.passes[0].copy_far;
    keyframe.offset_m = 0.125F;
    keyframe.max_shift_px = 2.0F;
    plan.keyframes = {keyframe};
    plan.commands[1] = plan.commands[0];
    plan.commands[1].kind = Command::Kind::projected;
    plan.commands[1].keyframe_count = 1;
    return plan;
}

/// Shows the image that `plan_with_image` made.
inline FramePlan plan_showing_image() {
    FramePlan plan;
    plan.quads = {hand_made_quad()};
    plan.commands = {images_command(0, 1)};
    plan.passes = {hand_made_pass(kFrameSize)};
    plan.passes[0].command_count = 1;
    return plan;
}

} // namespace farfield::support
