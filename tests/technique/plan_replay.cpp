#include "technique/plan_replay.hpp"

#include <farfield/math/frustum.hpp>
#include <farfield/metric/angular_discrepancy.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace farfield::support {

namespace {

std::uint64_t bytes_of(const PageUpdate& page) {
    const auto texels =
        static_cast<std::uint64_t>(page.size) * static_cast<std::uint64_t>(page.size);
    const std::uint64_t of_image = page.depth ? 6 : 4;
    return texels * (page.scratch ? 8U * static_cast<std::uint64_t>(page.samples) : of_image);
}

bool within(const Box3f& inner, const Box3f& outer) {
    return contains(outer, inner.lo) && contains(outer, inner.hi);
}

/// The largest box that contents may be clipped to: half as large again on each side, but beyond
/// the cell only on sides that the eye sees, apart from rounding.
Box3f largest_clip(const Box3f& contents, const Box3f& cell, const glm::vec3& eye) {
    const glm::vec3 size = extent(contents);
    const glm::vec3 reach = glm::max(glm::abs(contents.lo), glm::abs(contents.hi));
    const float rounding =
        2e-4F * std::max({size.x, size.y, size.z}) + 1e-5F * std::max({reach.x, reach.y, reach.z});
    Box3f box = inflate(contents, 0.5F * size + rounding);
    for (int axis = 0; axis < 3; ++axis) {
        if (eye[axis] >= cell.lo[axis]) {
            box.lo[axis] = std::max(box.lo[axis], cell.lo[axis] - rounding);
        }
        if (eye[axis] <= cell.hi[axis]) {
            box.hi[axis] = std::min(box.hi[axis], cell.hi[axis] + rounding);
        }
    }
    return box;
}

/// The cell of a node of a tree with planes perpendicular to the axes.
Box3f cell_of(const Hierarchy& tree, std::uint32_t index) {
    constexpr float kFar = std::numeric_limits<float>::max();
    Box3f cell{glm::vec3(-kFar), glm::vec3(kFar)};
    for (; index != 0; index = tree.nodes[index].parent) {
        const HierarchyNode& parent = tree.nodes[tree.nodes[index].parent];
        const glm::vec3& normal = parent.plane.normal;
        const int axis = normal.x != 0.0F ? 0 : normal.y != 0.0F ? 1 : 2;
        if (index == parent.first_child) {
            cell.hi[axis] = std::min(cell.hi[axis], parent.plane.offset);
        } else {
            cell.lo[axis] = std::max(cell.lo[axis], parent.plane.offset);
        }
    }
    return cell;
}

bool all_different(std::vector<std::uint32_t> numbers) {
    std::sort(numbers.begin(), numbers.end());
    return std::adjacent_find(numbers.begin(), numbers.end()) == numbers.end();
}

} // namespace

PlanReplay::PlanReplay(const Hierarchy& hierarchy, const Options& options)
    : hierarchy_(&hierarchy), options_(options), leaf_of_primitive_(hierarchy.primitives.size()),
      ranks_(hierarchy.nodes.size()), last_ranks_(hierarchy.nodes.size()) {
    find_places();
}

void PlanReplay::find_places() {
    known_version_ = hierarchy_->nodes[0].content_version;
    for (std::uint32_t index = 0; index < hierarchy_->nodes.size(); ++index) {
        const HierarchyNode& node = hierarchy_->nodes[index];
        if (!is_leaf(node)) {
            continue;
        }
        for (std::uint32_t i = 0; i < node.item_count; ++i) {
            const ItemId item = hierarchy_->items[node.first_item + i];
            if (item != kNone<ItemId>) {
                leaf_of_item_.resize(std::max(leaf_of_item_.size(), index_of(item) + 1), kMoves);
                leaf_of_item_[index_of(item)] = index;
            }
        }
        for (std::uint32_t i = 0; i < node.piece_count; ++i) {
            const Piece& piece = hierarchy_->pieces[node.first_piece + i];
            std::fill_n(leaf_of_primitive_.begin() + piece.first, piece.count, index);
        }
    }
    for (const MovingItem& mover : hierarchy_->moving) {
        leaf_of_item_.resize(std::max(leaf_of_item_.size(), index_of(mover.item) + 1), kMoves);
        leaf_of_item_[index_of(mover.item)] = kMoves;
    }
}

void PlanReplay::broken(const std::string& what) const {
    throw std::runtime_error("plan " + std::to_string(plans_) + ": " + what);
}

void PlanReplay::update_pages(const FramePlan& plan) {
    for (const PageUpdate& update : plan.pages) {
        const std::size_t page = index_of(update.page);
        const auto old = pages_.find(page);
        if (old != pages_.end()) {
            bytes_ -= bytes_of(old->second);
            pages_.erase(old);
            for (auto image = images_.begin(); image != images_.end();) {
                image = std::get<0>(image->first) == page ? images_.erase(image) : ++image;
            }
        }
        if (update.action == PageUpdate::Action::create) {
            if (update.size < 64 || (!update.scratch && update.samples != 1)) {
                broken("a page is smaller than 64 texels, or multisampled");
            }
            pages_[page] = update;
            bytes_ += bytes_of(update);
        }
        if (bytes_ > options_.budget_bytes) {
            broken("pages exceed the budget");
        }
    }
}

void PlanReplay::read_pieces(
    const FramePlan& plan, const Command& command, std::vector<std::uint32_t>& leaves
) const {
    for (std::uint32_t i = 0; i < command.piece_count; ++i) {
        const Piece& piece = plan.pieces[command.first_piece + i];
        for (std::uint32_t primitive = piece.first; primitive < piece.first + piece.count;) {
            // A piece of the plan is a run of whole pieces of leaves.
            const std::uint32_t leaf = leaf_of_primitive_.at(primitive);
            const HierarchyNode& node = hierarchy_->nodes[leaf];
            const auto begin = hierarchy_->pieces.begin() + node.first_piece;
            const auto found =
                std::find_if(begin, begin + node.piece_count, [&](const Piece& candidate) {
                    return candidate.first == primitive && candidate.item == piece.item;
                });
            if (found == begin + node.piece_count ||
                primitive + found->count > piece.first + piece.count) {
                broken("a piece does not consist of whole pieces of leaves");
            }
            if (found == begin) {
                leaves.push_back(leaf);
            } else if (leaves.empty() || leaves.back() != leaf) {
                broken("pieces of a leaf are torn apart");
            }
            primitive += found->count;
        }
    }
}

std::optional<std::uint32_t>
PlanReplay::clipped_leaf(const FramePlan& plan, const Pass& pass, const Command& command) const {
    const glm::vec3 eye(pass.view.eye - hierarchy_->origin);
    const Box3f& clip = plan.clips.at(command.clip);
    std::vector<Piece> drawn(
        plan.pieces.begin() + command.first_piece,
        plan.pieces.begin() + command.first_piece + command.piece_count
    );
    const auto primitives = [](const std::vector<Piece>& runs) {
        std::vector<std::uint32_t> positions;
        for (const Piece& run : runs) {
            for (std::uint32_t i = 0; i < run.count; ++i) {
                positions.push_back(run.first + i);
            }
        }
        std::sort(positions.begin(), positions.end());
        return positions;
    };
    const std::vector<std::uint32_t> positions = primitives(drawn);
    for (std::uint32_t index = 0; index < hierarchy_->nodes.size(); ++index) {
        const HierarchyNode& node = hierarchy_->nodes[index];
        if (!is_leaf(node) || is_empty(node.pieces_box) || !within(node.pieces_box, clip) ||
            !within(clip, largest_clip(node.pieces_box, cell_of(*hierarchy_, index), eye))) {
            continue;
        }
        std::vector<Piece> all(
            hierarchy_->pieces.begin() + node.first_piece,
            hierarchy_->pieces.begin() + node.first_piece + node.piece_count
        );
        all.insert(
            all.end(),
            hierarchy_->guests.begin() + node.first_guest,
            hierarchy_->guests.begin() + node.first_guest + node.guest_count
        );
        if (primitives(all) == positions) {
            return index;
        }
    }
    return std::nullopt;
}

void PlanReplay::check_current(const ReplayedImage& image) const {
    const bool surfaces_matter =
        !hierarchy_->pieces.empty() &&
        (options_.surfaces == SurfacePlacement::first || !hierarchy_->clip_leaves);
    if (image.content_version != hierarchy_->nodes[image.node].content_version ||
        image.appearance != appearance_ ||
        (surfaces_matter && image.surface_version != hierarchy_->surface_version)) {
        broken("an image of what has changed since");
    }
    for (const ImagePtr& nested : image.nested) {
        check_current(*nested);
    }
}

void PlanReplay::check_movers(const Frustum& frustum, const Contents& contents) const {
    std::vector<std::uint32_t> drawn;
    for (const ItemId item : contents.movers) {
        drawn.push_back(static_cast<std::uint32_t>(index_of(item)));
    }
    if (!all_different(drawn)) {
        broken("an item that moves is drawn twice");
    }
    for (const MovingItem& mover : hierarchy_->moving) {
        if (is_empty(mover.box)) {
            continue;
        }
        const bool seen = classify(frustum, mover.box) != Overlap::outside;
        const bool shown = std::find(contents.movers.begin(), contents.movers.end(), mover.item) !=
                           contents.movers.end();
        if (seen != shown) {
            broken("an item that moves is missing, or drawn where it is not");
        }
        for (const ImagePtr& image : contents.images) {
            if (options_.quad_depth != QuadDepth::texel && seen &&
                !is_empty(intersect(contents_box(image->node), mover.box))) {
                broken("an item moves through an image that has no depth inside");
            }
        }
    }
}

void PlanReplay::check_source(const Place& place, const Region& source) const {
    const auto& [page, x, y, width, height] = place;
    // Filtering reads half a texel beyond the source, and must not reach what lies beside.
    const Region read{source.x - 1, source.y - 1, source.width + 2, source.height + 2};
    if (!contains(Region{x, y, width, height}, read) || source.width + 2 != width ||
        source.height + 2 != height) {
        broken("a quad does not show the whole of its image, or filters more than that");
    }
}

void PlanReplay::check_kept(const ReplayedImage& image) const {
    if (!(image.copy_near > 0.0F && image.copy_near < image.copy_far)) {
        broken("an image keeps depths of no range");
    }
    // Of all of its contents, but for rounding and for what is before the near plane.
    const glm::vec3 forward(-image.pass_view.camera_to_world[2]);
    const auto nearest = static_cast<float>(image.pass_view.lens.near_distance);
    const Box3f box = contents_box(image.node);
    for (unsigned index = 0; index < 8; ++index) {
        const glm::vec3 from_eye = corner(box, index) - image.viewpoint;
        const float depth = std::max(glm::dot(from_eye, forward), nearest);
        const float slack = 1e-4F * glm::length(from_eye);
        if (depth < image.copy_near - slack || depth > image.copy_far + slack) {
            broken("an image shows what is outside the depths that it keeps");
        }
    }
}

void PlanReplay::check_depths(const ReplayedImage& image, const ImageQuad& quad) const {
    const glm::vec3 forward(-image.pass_view.camera_to_world[2]);
    const glm::vec3 from_eye = quad.origin - image.viewpoint;
    const float slack = 1e-4F * glm::length(from_eye);
    const float distance = glm::dot(from_eye, forward);
    const bool parallel = std::abs(glm::dot(quad.edge_u, forward)) <= slack &&
                          std::abs(glm::dot(quad.edge_v, forward)) <= slack;
    if (!parallel || glm::distance(quad.viewpoint, image.viewpoint) > slack ||
        std::abs(quad.near_ratio * distance - image.copy_near) > slack ||
        std::abs(quad.far_ratio * distance - image.copy_far) > slack) {
        broken("an image is shown with other depths than it kept");
    }
}

void PlanReplay::check_mask(const HierarchyNode& node, const std::vector<std::uint32_t>& masked)
    const {
    if (!all_different(masked)) {
        broken("a mask draws a surface twice");
    }
    // What only touches the rim of the contents may be lost by rounding.
    Box3f box = node.items_box;
    const glm::vec3 rim = 0.01F * extent(box) * glm::vec3(1.0F, 0.0F, 1.0F);
    box = inflate(box, -rim);
    for (std::uint32_t index = 0; index < hierarchy_->nodes.size(); ++index) {
        const HierarchyNode& leaf = hierarchy_->nodes[index];
        const bool inside = is_leaf(leaf) && leaf.piece_count > 0 &&
                            leaf.first_piece >= node.first_piece &&
                            leaf.first_piece < node.first_piece + node.piece_count;
        if (inside && !is_empty(intersect(leaf.pieces_box, box)) &&
            std::find(masked.begin(), masked.end(), index) == masked.end()) {
            broken("the mask of an image leaves out a surface among its contents");
        }
    }
}

PlanReplay::Contents PlanReplay::read(const FramePlan& plan, const Pass& pass) {
    const bool frame = pass.page == kNone<PageId>;
    const bool ordered = !frame || [&] {
        // A frame without images is the baseline's and may have the opposite order.
        for (std::uint32_t c = 0; c < pass.command_count; ++c) {
            if (plan.commands[pass.first_command + c].kind == Command::Kind::images) {
                return true;
            }
        }
        return false;
    }();
    std::uint32_t next_rank = 0;
    rank_leaves(0, glm::vec3(pass.view.eye - hierarchy_->origin), next_rank);
    std::int64_t drawn_to = -1;  // greatest rank drawn by the commands before
    std::int64_t images_to = -1; // and by the images among them
    Contents contents;
    std::vector<std::uint32_t> masked;
    std::vector<std::uint32_t> clipped;
    std::vector<std::uint32_t> shown_quads;
    for (std::uint32_t c = 0; c < pass.command_count; ++c) {
        const Command& command = plan.commands[pass.first_command + c];
        if (command.kind == Command::Kind::images) {
            for (std::uint32_t i = 0; i < command.count; ++i) {
                const ImageQuad& quad = plan.quads[command.first + i];
                const Region& source = quad.source;
                const auto found =
                    std::find_if(images_.begin(), images_.end(), [&](const auto& candidate) {
                        const auto& [page, x, y, width, height] = candidate.first;
                        return page == index_of(quad.page) &&
                               contains(Region{x, y, width, height}, source);
                    });
                if (found == images_.end()) {
                    broken("a quad shows texels that are no image, or no longer");
                }
                check_source(found->first, source);
                const ImagePtr& image = found->second;
                check_current(*image);
                if (command.depth != options_.quad_depth) {
                    broken("an image stands in depth as nobody asked for");
                }
                if (command.depth == QuadDepth::texel) {
                    check_depths(*image, quad);
                }
                shown_quads.push_back(command.first + i);
                if (image->view.lens.near_distance > quad.depth) {
                    broken("a quad is before the near plane");
                }
                sampled_.emplace_back(found->first, image);
                contents.images.push_back(image);
                contents.items.insert(
                    contents.items.end(), image->items.begin(), image->items.end()
                );
                contents.pieces.insert(
                    contents.pieces.end(), image->pieces.begin(), image->pieces.end()
                );
                if (ranks_[image->node] <= drawn_to) {
                    broken("an image is drawn after something that is nearer");
                }
                drawn_to = last_ranks_[image->node];
                images_to = drawn_to;
            }
            continue;
        }
        if (command.kind == Command::Kind::image_depths) {
            std::vector<std::uint32_t> quads(command.count);
            std::iota(quads.begin(), quads.end(), command.first);
            if (options_.quad_depth == QuadDepth::none || command.depth != options_.quad_depth ||
                quads != shown_quads) {
                broken("depths of images where none belong, or not of all");
            }
            continue;
        }
        if (command.kind == Command::Kind::mask) {
            if (frame || options_.surfaces != SurfacePlacement::first || command.count > 0) {
                broken("a mask where none belongs");
            }
            read_pieces(plan, command, masked);
            continue;
        }
        if (command.clip != Command::kNoClip) {
            // The overlap with neighbours, which hides cracks.
            if (options_.surfaces != SurfacePlacement::in_images || command.count > 0 ||
                command.clip >= plan.clips.size()) {
                broken("a clipped command where none belongs");
            }
            const std::optional<std::uint32_t> found = clipped_leaf(plan, pass, command);
            if (!hierarchy_->clip_leaves || !found) {
                continue;
            }
            const std::uint32_t leaf = *found;
            // Guests alone may be what the overlap with their homes draws as well.
            if (std::find(clipped.begin(), clipped.end(), leaf) != clipped.end()) {
                continue;
            }
            clipped.push_back(leaf);
            contents.pieces.push_back(leaf);
            // Within a run of geometry the order is free.
            if (ordered && static_cast<std::int64_t>(ranks_[leaf]) <= images_to) {
                broken("clipped geometry is drawn after an image that is nearer");
            }
            drawn_to = std::max(drawn_to, static_cast<std::int64_t>(ranks_[leaf]));
            continue;
        }
        const std::size_t items_before = contents.items.size();
        for (std::uint32_t i = 0; i < command.count;) {
            const ItemId item = plan.items[command.first + i];
            const std::uint32_t leaf = leaf_of_item_.at(index_of(item));
            if (leaf == kMoves) {
                if (!frame) {
                    broken("an image shows an item that moves");
                }
                contents.movers.push_back(item);
                ++i;
                continue;
            }
            // The items of a leaf come together and in their order, without those that have left.
            const HierarchyNode& node = hierarchy_->nodes[leaf];
            for (std::uint32_t place = 0; place < node.item_count; ++place) {
                const ItemId expected = hierarchy_->items[node.first_item + place];
                if (expected == kNone<ItemId>) {
                    continue;
                }
                if (i >= command.count || plan.items[command.first + i] != expected) {
                    broken("the items of a leaf are torn apart");
                }
                ++i;
            }
            contents.items.push_back(leaf);
        }
        const std::size_t pieces_before = contents.pieces.size();
        read_pieces(plan, command, contents.pieces);
        const bool surfaces_apart = frame && options_.surfaces == SurfacePlacement::first;
        std::vector<std::uint32_t> leaves(
            contents.items.begin() + static_cast<std::ptrdiff_t>(items_before), contents.items.end()
        );
        if (!surfaces_apart) {
            leaves.insert(
                leaves.end(),
                contents.pieces.begin() + static_cast<std::ptrdiff_t>(pieces_before),
                contents.pieces.end()
            );
        }
        // Within a command depth is tested and written, so its own order is free.
        const std::int64_t before = drawn_to;
        for (const std::uint32_t leaf : leaves) {
            // A leaf's items may follow its own clipped surfaces.
            if (ordered &&
                (hierarchy_->clip_leaves ? static_cast<std::int64_t>(ranks_[leaf]) <= images_to
                                         : static_cast<std::int64_t>(ranks_[leaf]) <= before)) {
                broken("geometry is drawn after something that is nearer");
            }
            drawn_to = std::max(drawn_to, static_cast<std::int64_t>(ranks_[leaf]));
        }
    }
    if (!all_different(contents.items) || !all_different(contents.pieces)) {
        broken("a leaf is shown twice");
    }
    if (!frame && options_.surfaces == SurfacePlacement::first) {
        check_mask(hierarchy_->nodes[common_node(contents)], masked);
    }
    return contents;
}

void PlanReplay::rank_leaves(std::uint32_t index, const glm::vec3& eye, std::uint32_t& next) {
    const HierarchyNode& node = hierarchy_->nodes[index];
    ranks_[index] = next;
    if (is_leaf(node)) {
        ++next;
    } else {
        const unsigned far = far_child(node, eye);
        rank_leaves(node.first_child + far, eye, next);
        rank_leaves(node.first_child + 1 - far, eye, next);
    }
    last_ranks_[index] = next - 1;
}

std::uint32_t PlanReplay::common_node(const Contents& contents) const {
    std::vector<std::uint32_t> nodes = contents.items;
    nodes.insert(nodes.end(), contents.pieces.begin(), contents.pieces.end());
    if (nodes.empty()) {
        broken("an image of nothing");
    }
    // Parents have smaller numbers: replacing the greatest by its parent ends at the common one.
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    while (nodes.size() > 1) {
        const std::uint32_t parent = hierarchy_->nodes[nodes.back()].parent;
        nodes.pop_back();
        const auto place = std::lower_bound(nodes.begin(), nodes.end(), parent);
        if (place == nodes.end() || *place != parent) {
            nodes.insert(place, parent);
        }
    }
    return nodes[0];
}

void PlanReplay::make_image(const FramePlan& plan, const Pass& pass, Contents contents) {
    const auto scratch = pages_.find(index_of(pass.page));
    const auto page = pages_.find(index_of(pass.copy_page));
    if (scratch == pages_.end() || !scratch->second.scratch || page == pages_.end() ||
        page->second.scratch) {
        broken("an image is made in, or copied to, a page that does not exist or is of no use");
    }
    const auto whole = [](const PageUpdate& update) {
        return Region{0, 0, update.size, update.size};
    };
    if (!contains(whole(scratch->second), pass.scissor) ||
        !contains(whole(page->second), pass.copy) || pass.copy.width != pass.scissor.width ||
        pass.copy.height != pass.scissor.height || area(pass.copy) == 0) {
        broken("an image leaves its page, or changes its size");
    }
    auto image = std::make_shared<ReplayedImage>();
    image->node = common_node(contents);
    image->frame = plans_;
    image->view = plan.passes.back().view;
    image->pass_view = pass.view;
    image->copy_near = pass.copy_near;
    image->copy_far = pass.copy_far;
    image->surface_version = hierarchy_->surface_version;
    image->appearance = appearance_;
    image->viewpoint = glm::vec3(pass.view.eye - hierarchy_->origin);
    image->items = std::move(contents.items);
    image->pieces = std::move(contents.pieces);
    image->nested = std::move(contents.images);
    for (const ImagePtr& nested : image->nested) {
        image->baked_rad = std::max(image->baked_rad, error_rad(*nested, image->viewpoint));
    }
    std::uint64_t item_primitives = 0;
    std::uint64_t piece_primitives = 0;
    for (const std::uint32_t leaf : image->items) {
        item_primitives += hierarchy_->nodes[leaf].item_primitives;
    }
    for (const std::uint32_t leaf : image->pieces) {
        piece_primitives += hierarchy_->nodes[leaf].piece_primitives;
    }
    const HierarchyNode& node = hierarchy_->nodes[image->node];
    image->content_version = node.content_version;
    const bool with_pieces = options_.surfaces == SurfacePlacement::in_images;
    if (item_primitives != node.item_primitives ||
        piece_primitives != (with_pieces ? node.piece_primitives : 0U)) {
        broken("an image does not show the whole of its node");
    }
    if (page->second.depth != (options_.quad_depth == QuadDepth::texel)) {
        broken("a page keeps depth that nobody asked for, or none");
    }
    if (page->second.depth) {
        check_kept(*image);
    }
    const Place place{
        index_of(pass.copy_page), pass.copy.x, pass.copy.y, pass.copy.width, pass.copy.height};
    for (auto old = images_.begin(); old != images_.end();) {
        const auto& [id, x, y, width, height] = old->first;
        const bool overwritten =
            id == index_of(pass.copy_page) && overlaps(Region{x, y, width, height}, pass.copy);
        old = overwritten ? images_.erase(old) : ++old;
    }
    place_of_node_[image->node] = place;
    images_[place] = std::move(image);
}

void PlanReplay::check_frame(const FramePlan& plan, const Pass& pass, const Contents& contents)
    const {
    if (pass.viewport != Region{0, 0, pass.view.width, pass.view.height} ||
        pass.scissor != pass.viewport || pass.copy_page != kNone<PageId>) {
        broken("the frame pass does not cover the frame");
    }
    std::vector<bool> items(hierarchy_->nodes.size());
    std::vector<bool> pieces(hierarchy_->nodes.size());
    for (const std::uint32_t leaf : contents.items) {
        items[leaf] = true;
    }
    for (const std::uint32_t leaf : contents.pieces) {
        pieces[leaf] = true;
    }
    // Culled as a part of a larger box, a leaf may be lost by the rounding of distances from
    // planes: a few units in the last place of the numbers that are added up.
    Frustum frustum = make_frustum(pass.view, plan.origin);
    const Box3f all = bounds(hierarchy_->nodes[0]);
    const float reach = glm::length(glm::max(glm::abs(all.lo), glm::abs(all.hi)));
    for (Plane& plane : frustum.planes) {
        constexpr float kUnits = 8.0F * std::numeric_limits<float>::epsilon();
        plane.offset += kUnits * (std::abs(plane.offset) + reach);
    }
    for (std::size_t index = 0; index < hierarchy_->nodes.size(); ++index) {
        const HierarchyNode& node = hierarchy_->nodes[index];
        if (!is_leaf(node)) {
            continue;
        }
        const bool items_missing = !items[index] && !is_empty(node.items_box) &&
                                   classify(frustum, node.items_box) != Overlap::outside;
        const bool clipped = options_.surfaces == SurfacePlacement::in_images &&
                             hierarchy_->clip_leaves && !contents.images.empty();
        const bool has_pieces = node.piece_count > 0 || (clipped && node.guest_count > 0);
        const bool pieces_missing =
            !pieces[index] && has_pieces && classify(frustum, node.pieces_box) != Overlap::outside;
        if (items_missing || pieces_missing) {
            broken("leaf " + std::to_string(index) + " is in the frustum and not shown");
        }
    }
    check_movers(make_frustum(pass.view, plan.origin), contents);
    for (const ImagePtr& image : contents.images) {
        const View& view = image->view;
        if (view.lens == pass.view.lens && view.width == pass.view.width &&
            view.height == pass.view.height) {
            continue;
        }
        if (view.lens.near_distance != pass.view.lens.near_distance ||
            view.lens.far_distance != pass.view.lens.far_distance) {
            broken("an image was made between other distances");
        }
        const glm::dvec2 texels = texel_px(*image, pass.view);
        constexpr double kRounding = 1e-3;
        if (std::min(texels.x, texels.y) < 0.5 - kRounding ||
            std::max(texels.x, texels.y) > 1.0 + 2.0 * kRounding) {
            broken("an image was made for another lens or resolution, and its texels do not fit");
        }
    }
}

void PlanReplay::execute(const FramePlan& plan, std::uint64_t appearance) {
    ++plans_;
    appearance_ = appearance;
    if (known_version_ != hierarchy_->nodes[0].content_version) {
        find_places();
    }
    if (plan.origin != hierarchy_->origin || plan.passes.empty()) {
        broken("no pass, or another origin");
    }
    update_pages(plan);
    sampled_.clear();
    std::vector<std::pair<const Pass*, Contents>> batch;
    const auto end_batch = [&] {
        for (auto& [pass, contents] : batch) {
            make_image(plan, *pass, std::move(contents));
        }
        batch.clear();
    };
    for (std::size_t index = 0; index < plan.passes.size(); ++index) {
        const Pass& pass = plan.passes[index];
        if (!validate(pass.view)) {
            broken("a pass has no valid view");
        }
        if (!batch.empty()) {
            const std::uint32_t running = batch.back().first->batch;
            if (pass.batch < running) {
                broken("batches go backwards");
            }
            if (pass.batch > running) {
                end_batch();
            }
        }
        const bool frame = pass.page == kNone<PageId>;
        if (frame != (index + 1 == plan.passes.size()) || (frame && !batch.empty())) {
            broken("the frame is not the last pass, in a batch of its own");
        }
        Contents contents = read(plan, pass);
        if (frame) {
            check_frame(plan, pass, contents);
            shown_ = std::move(contents.images);
            break;
        }
        for (const auto& [other, unused] : batch) {
            if (overlaps(other->scissor, pass.scissor)) {
                broken("passes of one batch overlap");
            }
        }
        batch.emplace_back(&pass, std::move(contents));
    }
    for (const auto& [place, image] : sampled_) {
        const auto now = images_.find(place);
        if (now == images_.end() || now->second != image) {
            broken("an image was overwritten by the plan that samples it");
        }
    }
}

std::shared_ptr<const ReplayedImage> PlanReplay::image_of(std::uint32_t node) const {
    const auto place = place_of_node_.find(node);
    if (place == place_of_node_.end()) {
        return nullptr;
    }
    const auto image = images_.find(place->second);
    return image != images_.end() && image->second->node == node ? image->second : nullptr;
}

Box3f PlanReplay::contents_box(std::uint32_t node) const {
    const HierarchyNode& of = hierarchy_->nodes[node];
    return options_.surfaces == SurfacePlacement::first ? of.items_box : bounds(of);
}

double PlanReplay::own_error_rad(const ReplayedImage& image, const glm::vec3& eye) const {
    const Box3f box = contents_box(image.node);
    const ImagePlane<double> plane{
        .viewpoint = glm::dvec3(image.viewpoint),
        .point = glm::dvec3(center(box)),
        .normal = image.pass_view.camera_to_world[2]};
    const Box3d wide{glm::dvec3(box.lo), glm::dvec3(box.hi)};
    return metric::corner_discrepancy_unchecked(plane, wide, glm::dvec3(eye));
}

glm::dvec2 PlanReplay::texel_px(const ReplayedImage& image, const View& view) const {
    const glm::dvec3 normal = -image.pass_view.camera_to_world[2];
    const glm::dvec3 middle(center(contents_box(image.node)));
    const glm::dvec3 eye = view.eye - hierarchy_->origin;
    const double ratio =
        glm::dot(middle - glm::dvec3(image.viewpoint), normal) / glm::dot(middle - eye, normal);
    const auto tangents = [](const View& of) {
        return glm::dvec2(
            (of.lens.right - of.lens.left) / of.width, (of.lens.top - of.lens.bottom) / of.height
        );
    };
    if (image.pass_view.camera_to_world == image.view.camera_to_world) {
        return tangents(image.pass_view) / tangents(view) * ratio;
    }
    // An image that faces the eye is nowhere in the view, so its texels are held to a mean pixel.
    const double fov_y = std::atan(view.lens.top) - std::atan(view.lens.bottom);
    return tangents(image.pass_view) / (fov_y / view.height) * ratio;
}

double PlanReplay::error_rad(const ReplayedImage& image, const glm::vec3& eye) const {
    return own_error_rad(image, eye) + image.baked_rad;
}

} // namespace farfield::support
