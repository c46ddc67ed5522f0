#include "technique/geometry_pass.hpp"
#include <farfield/technique/culled_geometry.hpp>

namespace farfield {

namespace {

/// One walk over the hierarchy for both kinds of contents.
struct GeometryWalk {
    const Hierarchy& hierarchy;
    const Frustum& frustum;
    glm::vec3 eye;
    GeometryOrder order;
    bool with_items;
    Command::Kind surfaces; ///< how pieces are drawn
    PlanWriter& writer;

    void visit(std::uint32_t index) noexcept {
        const HierarchyNode& node = hierarchy.nodes[index];
        const Overlap items = with_items && !is_empty(node.items_box)
                                  ? classify(frustum, node.items_box)
                                  : Overlap::outside;
        // Pieces are drawn whole here, whether leaves clip or not.
        const Overlap pieces = node.piece_count > 0
                                   ? classify(frustum, whole_pieces_box(hierarchy, index))
                                   : Overlap::outside;
        const bool seen = items != Overlap::outside || pieces != Overlap::outside;
        if (!seen) {
            return;
        }
        // Below a node that is seen as a whole there is nothing to cull; only order may ask for
        // more.
        const bool whole = items != Overlap::partial && pieces != Overlap::partial;
        if (is_leaf(node) || (whole && order == GeometryOrder::stored)) {
            if (items != Overlap::outside) {
                writer.items(node.first_item, node.item_count);
            }
            if (pieces != Overlap::outside) {
                writer.pieces(surfaces, node.first_piece, node.piece_count, Command::kNoClip);
            }
            return;
        }
        const unsigned first =
            order == GeometryOrder::front_to_back ? 1U - far_child(node, eye) : 0U;
        visit(node.first_child + first);
        visit(node.first_child + 1U - first);
    }
};

} // namespace

Pass frame_pass(const View& view, std::uint32_t batch) noexcept {
    Pass pass;
    pass.viewport = {0, 0, view.width, view.height};
    pass.scissor = pass.viewport;
    pass.view = view;
    pass.batch = batch;
    return pass;
}

void write_moving(const Hierarchy& hierarchy, const Frustum& frustum, PlanWriter& writer) noexcept {
    for (const MovingItem& moving : hierarchy.moving) {
        if (!is_empty(moving.box) && classify(frustum, moving.box) != Overlap::outside) {
            writer.item(moving.item);
        }
    }
}

void write_geometry(
    const Hierarchy& hierarchy,
    const Frustum& frustum,
    const glm::vec3& eye,
    GeometryOrder order,
    PlanWriter& writer
) noexcept {
    GeometryWalk{hierarchy, frustum, eye, order, true, Command::Kind::geometry, writer}.visit(0);
    write_moving(hierarchy, frustum, writer);
}

void write_surfaces(
    const Hierarchy& hierarchy,
    const Frustum& frustum,
    const glm::vec3& eye,
    GeometryOrder order,
    Command::Kind kind,
    PlanWriter& writer
) noexcept {
    GeometryWalk{hierarchy, frustum, eye, order, false, kind, writer}.visit(0);
}

CulledGeometry::CulledGeometry(const Hierarchy& hierarchy, GeometryOrder order)
    : hierarchy_(&hierarchy), order_(order) {}

const FramePlan& CulledGeometry::plan(const View& view) noexcept {
    clear(plan_);
    plan_.origin = hierarchy_->origin;
    PlanWriter writer(plan_, *hierarchy_);
    writer.open();
    write_geometry(
        *hierarchy_,
        make_frustum(view, hierarchy_->origin),
        local_point(view.eye, hierarchy_->origin),
        order_,
        writer
    );
    writer.close(frame_pass(view, 0));
    return plan_;
}

} // namespace farfield
