#include "technique/plan_writer.hpp"

#include <algorithm>
#include <cstddef>

namespace farfield {

void PlanWriter::close(Pass pass) noexcept {
    pass.first_command = first_command_;
    pass.command_count = static_cast<std::uint32_t>(plan_->commands.size()) - first_command_;
    plan_->passes.push_back(pass);
}

Command& PlanWriter::command(Command::Kind kind, std::uint32_t clip) noexcept {
    if (plan_->commands.size() > first_command_) {
        Command& last = plan_->commands.back();
        if (last.kind == kind && last.clip == clip) {
            return last;
        }
    }
    Command next;
    next.kind = kind;
    next.clip = clip;
    next.first = static_cast<std::uint32_t>(
        kind == Command::Kind::images ? plan_->quads.size() : plan_->items.size()
    );
    next.first_piece = static_cast<std::uint32_t>(plan_->pieces.size());
    plan_->commands.push_back(next);
    return plan_->commands.back();
}

void PlanWriter::items(std::uint32_t first, std::uint32_t count) noexcept {
    auto begin = hierarchy_->items.begin() + first;
    const auto end = begin + count;
    // There are as many holes as items that move: mostly none.
    const bool may_have_holes = !hierarchy_->moving.empty();
    if (may_have_holes) {
        begin = std::find_if(begin, end, [](ItemId item) { return item != kNone<ItemId>; });
    }
    if (begin == end) {
        return;
    }
    Command& target = command(Command::Kind::geometry, Command::kNoClip);
    const std::size_t before = plan_->items.size();
    plan_->items.insert(plan_->items.end(), begin, end);
    if (may_have_holes) {
        const auto added = plan_->items.begin() + static_cast<std::ptrdiff_t>(before);
        const auto kept = std::remove(added, plan_->items.end(), kNone<ItemId>);
        plan_->items.erase(kept, plan_->items.end());
    }
    target.count += static_cast<std::uint32_t>(plan_->items.size() - before);
}

void PlanWriter::item(ItemId id) noexcept {
    ++command(Command::Kind::geometry, Command::kNoClip).count;
    plan_->items.push_back(id);
}

void PlanWriter::pieces(
    Command::Kind kind, std::uint32_t first, std::uint32_t count, std::uint32_t clip
) noexcept {
    if (count == 0) {
        return;
    }
    Command& target = command(kind, clip);
    for (std::uint32_t i = first; i < first + count; ++i) {
        append(target, hierarchy_->pieces[i]);
    }
}

void PlanWriter::piece(const Piece& run, std::uint32_t clip) noexcept {
    append(command(Command::Kind::geometry, clip), run);
}

void PlanWriter::append(Command& target, const Piece& run) noexcept {
    if (target.piece_count > 0) {
        Piece& last = plan_->pieces.back();
        if (last.item == run.item && last.first + last.count == run.first) {
            last.count += run.count;
            return;
        }
    }
    plan_->pieces.push_back(run);
    ++target.piece_count;
}

void PlanWriter::image(const ImageQuad& quad, QuadDepth depth) noexcept {
    Command& target = command(Command::Kind::images, Command::kNoClip);
    target.depth = depth;
    ++target.count;
    plan_->quads.push_back(quad);
}

void PlanWriter::image_depths(std::size_t first_quad, QuadDepth depth) noexcept {
    Command& target = command(Command::Kind::image_depths, Command::kNoClip);
    target.depth = depth;
    target.first = static_cast<std::uint32_t>(first_quad);
    target.count = static_cast<std::uint32_t>(plan_->quads.size() - first_quad);
}

} // namespace farfield
