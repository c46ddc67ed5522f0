#include "core/digest.hpp"
#include <farfield/gpu/frame_plan.hpp>

namespace farfield {

namespace {

/// With what plans are made of.
class PlanDigest : public Digest {
  public:
    using Digest::add;
    void add(const Region& region) noexcept {
        add(region.x);
        add(region.y);
        add(region.width);
        add(region.height);
    }
    void add(const View& view) noexcept {
        add(view.eye);
        for (int column = 0; column < 3; ++column) {
            add(view.camera_to_world[column]);
        }
        add(view.lens.left);
        add(view.lens.right);
        add(view.lens.bottom);
        add(view.lens.top);
        add(view.lens.near_distance);
        add(view.lens.far_distance);
        add(view.width);
        add(view.height);
    }
};

} // namespace

void clear(FramePlan& plan) noexcept {
    plan.pages.clear();
    plan.passes.clear();
    plan.commands.clear();
    plan.items.clear();
    plan.pieces.clear();
    plan.quads.clear();
    plan.clips.clear();
    plan.splats.clear();
    plan.cubes.clear();
    plan.cube_frames.clear();
    plan.selections.clear();
    plan.selected.clear();
    plan.keyframes.clear();
    plan.layered_updates.clear();
    plan.layers.clear();
}

namespace {

/// Splats, cubes and single primitives.
void add_cells(const FramePlan& plan, PlanDigest& digest) noexcept {
    for (const Command& command : plan.commands) {
        digest.add(command.first_selection);
        digest.add(command.selection_count);
    }
    digest.add(std::uint64_t{plan.splats.size()});
    for (const Splat& splat : plan.splats) {
        digest.add(splat.center);
        digest.add(splat.side);
        digest.add(splat.color);
    }
    digest.add(std::uint64_t{plan.cubes.size()});
    for (const ShownCube& cube : plan.cubes) {
        digest.add(cube.center);
        digest.add(cube.size);
        digest.add(cube.frame);
        for (const glm::vec<4, std::uint8_t>& face : cube.faces) {
            digest.add(face);
        }
    }
    digest.add(std::uint64_t{plan.cube_frames.size()});
    for (const glm::mat3& frame : plan.cube_frames) {
        for (int column = 0; column < 3; ++column) {
            digest.add(frame[column]);
        }
    }
    digest.add(std::uint64_t{plan.selections.size()});
    for (const Selection& selection : plan.selections) {
        digest.add(selection.item);
        digest.add(selection.first);
        digest.add(selection.count);
    }
    digest.add(std::uint64_t{plan.selected.size()});
    for (const std::uint32_t primitive : plan.selected) {
        digest.add(primitive);
    }
}

void add_keyframes(const FramePlan& plan, PlanDigest& digest) noexcept {
    for (const Command& command : plan.commands) {
        digest.add(command.first_keyframe);
        digest.add(command.keyframe_count);
        digest.add(command.whole_triangles);
    }
    digest.add(std::uint64_t{plan.keyframes.size()});
    for (const Keyframe& keyframe : plan.keyframes) {
        digest.add(keyframe.page);
        digest.add(keyframe.source);
        digest.add(keyframe.view);
        digest.add(keyframe.copy_near);
        digest.add(keyframe.copy_far);
        digest.add(keyframe.offset_m);
        digest.add(keyframe.max_shift_px);
        digest.add(keyframe.node);
    }
}

/// Layered images by their ids: what they hold is no part of a plan.
void add_layers(const FramePlan& plan, PlanDigest& digest) noexcept {
    digest.add(std::uint64_t{plan.layered_updates.size()});
    for (const LayeredUpdate& update : plan.layered_updates) {
        digest.add(update.action);
        digest.add(update.image);
    }
    digest.add(std::uint64_t{plan.layers.size()});
    for (const ShownLayers& shown : plan.layers) {
        digest.add(shown.image);
        digest.add(shown.node);
    }
}

} // namespace

std::uint64_t digest(const FramePlan& plan) noexcept {
    PlanDigest digest;
    digest.add(plan.cache);
    digest.add(plan.origin);
    digest.add(std::uint64_t{plan.pages.size()});
    for (const PageUpdate& update : plan.pages) {
        digest.add(update.action);
        digest.add(update.page);
        digest.add(update.size);
        digest.add(update.scratch);
        digest.add(update.samples);
        digest.add(update.depth);
    }
    digest.add(std::uint64_t{plan.passes.size()});
    for (const Pass& pass : plan.passes) {
        digest.add(pass.page);
        digest.add(pass.viewport);
        digest.add(pass.scissor);
        digest.add(pass.view);
        digest.add(pass.first_command);
        digest.add(pass.command_count);
        digest.add(pass.batch);
        digest.add(pass.copy_page);
        digest.add(pass.copy);
        digest.add(pass.copy_near);
        digest.add(pass.copy_far);
        digest.add(pass.node);
    }
    digest.add(std::uint64_t{plan.commands.size()});
    for (const Command& command : plan.commands) {
        digest.add(command.kind);
        digest.add(command.first);
        digest.add(command.count);
        digest.add(command.first_piece);
        digest.add(command.piece_count);
        digest.add(command.clip);
        digest.add(command.depth);
    }
    digest.add(std::uint64_t{plan.items.size()});
    for (const ItemId item : plan.items) {
        digest.add(item);
    }
    digest.add(std::uint64_t{plan.pieces.size()});
    for (const Piece& piece : plan.pieces) {
        digest.add(piece.item);
        digest.add(piece.first);
        digest.add(piece.count);
    }
    digest.add(std::uint64_t{plan.quads.size()});
    for (const ImageQuad& quad : plan.quads) {
        digest.add(quad.page);
        digest.add(quad.source);
        digest.add(quad.origin);
        digest.add(quad.edge_u);
        digest.add(quad.edge_v);
        digest.add(quad.depth);
        digest.add(quad.viewpoint);
        digest.add(quad.near_ratio);
        digest.add(quad.far_ratio);
        digest.add(quad.node);
    }
    digest.add(std::uint64_t{plan.clips.size()});
    for (const Box3f& box : plan.clips) {
        digest.add(box.lo);
        digest.add(box.hi);
    }
    // What has none of these keeps the digest that it had before there were any.
    const bool cells = !plan.splats.empty() || !plan.cubes.empty() || !plan.selections.empty();
    if (cells) {
        add_cells(plan, digest);
    }
    if (!plan.keyframes.empty()) {
        add_keyframes(plan, digest);
    }
    if (!plan.layered_updates.empty() || !plan.layers.empty()) {
        add_layers(plan, digest);
    }
    return digest.value();
}

} // namespace farfield
