#include "technique/plan_writer.hpp"

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
    if (count == 0) {
        return;
    }
    command(Command::Kind::geometry, Command::kNoClip).count += count;
    const auto begin = hierarchy_->items.begin() + first;
    plan_->items.insert(plan_->items.end(), begin, begin + count);
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

void PlanWriter::image(const ImageQuad& quad) noexcept {
    ++command(Command::Kind::images, Command::kNoClip).count;
    plan_->quads.push_back(quad);
}

} // namespace farfield
