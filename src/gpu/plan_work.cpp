#include <farfield/gpu/plan_work.hpp>

namespace farfield {

PlanWork work_of(const FramePlan& plan, std::span<const std::uint64_t> item_primitives) noexcept {
    PlanWork work;
    for (const Pass& pass : plan.passes) {
        const bool final = pass.page == kNone<PageId>;
        if (!final) {
            ++work.images;
            work.image_texels += area(pass.scissor);
        }
        for (std::uint32_t c = 0; c < pass.command_count; ++c) {
            const Command& command = plan.commands[pass.first_command + c];
            if (draws_images(command)) {
                const bool shown = final && command.kind == Command::Kind::images;
                ++work.draws;
                work.image_quads += shown ? command.count : 0U;
                continue;
            }
            if (command.kind == Command::Kind::layers) {
                work.draws += command.count;
                work.layered_images += command.count;
                continue;
            }
            if (!draws_geometry(command)) {
                const bool splats = command.kind == Command::Kind::splats;
                ++work.draws;
                (splats ? work.splats : work.cubes) += command.count;
                continue;
            }
            work.draws += std::uint64_t{command.count} + command.piece_count;
            work.draws += command.selection_count;
            for (std::uint32_t i = 0; i < command.count; ++i) {
                work.triangles += item_primitives[index_of(plan.items[command.first + i])];
            }
            for (std::uint32_t i = 0; i < command.piece_count; ++i) {
                work.triangles += plan.pieces[command.first_piece + i].count;
            }
            for (std::uint32_t i = 0; i < command.selection_count; ++i) {
                work.triangles += plan.selections[command.first_selection + i].count;
            }
        }
    }
    return work;
}

} // namespace farfield
