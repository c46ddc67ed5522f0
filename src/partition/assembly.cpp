#include "partition/assembly.hpp"

#include "partition/checks.hpp"

#include <glm/common.hpp>

#include <algorithm>
#include <string>
#include <utility>

namespace farfield::partition::detail {

namespace {

/// Box and middle of one primitive, in the world.
struct Place {
    Box3d box;
    glm::dvec3 middle{0.0};
};

Result<Place> place_of(const PrimitiveShape& shape, std::uint32_t object, std::uint32_t primitive) {
    const auto name = [&] {
        return "object " + std::to_string(object) + ": primitive " + std::to_string(primitive);
    };
    if (const auto* bounds_of = std::get_if<PrimitiveBounds>(&shape)) {
        const Box3d box = (*bounds_of)(object, primitive);
        if (auto checked = check_box(box, [&] { return name() + ": bounds"; }); !checked) {
            return tl::unexpected(std::move(checked.error()));
        }
        return Place{box, center(box)};
    }
    const Triangle3d triangle = std::get<PrimitiveTriangle>(shape)(object, primitive);
    for (std::size_t corner = 0; corner < triangle.size(); ++corner) {
        const auto corner_name = [&] { return name() + ": corner " + std::to_string(corner); };
        if (auto checked = check_point(triangle.at(corner), corner_name); !checked) {
            return tl::unexpected(std::move(checked.error()));
        }
    }
    const Box3d box = bounds(triangle);
    const glm::dvec3 centroid = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    return Place{box, glm::clamp(centroid, box.lo, box.hi)};
}

} // namespace

std::size_t Fragments::owner(std::uint32_t fragment) const noexcept {
    const auto next = std::upper_bound(starts.begin(), starts.end(), fragment);
    return static_cast<std::size_t>(next - starts.begin()) - 1;
}

Result<Fragments> gather_fragments(
    std::span<const Object> objects, const PrimitiveShape& shape, const glm::dvec3& origin
) {
    Fragments fragments;
    std::size_t total = 0;
    for (const Object& object : objects) {
        total += object.splittable ? static_cast<std::size_t>(object.primitives) : 0U;
    }
    fragments.boxes.reserve(total);
    fragments.middles.reserve(total);
    for (std::size_t index = 0; index < objects.size(); ++index) {
        const Object& object = objects[index];
        if (!object.splittable || object.primitives == 0) {
            continue;
        }
        fragments.objects.push_back(static_cast<std::uint32_t>(index));
        fragments.starts.push_back(static_cast<std::uint32_t>(fragments.boxes.size()));
        const auto count = static_cast<std::uint32_t>(object.primitives);
        for (std::uint32_t primitive = 0; primitive < count; ++primitive) {
            const auto place = place_of(shape, static_cast<std::uint32_t>(index), primitive);
            if (!place) {
                return tl::unexpected(place.error());
            }
            fragments.boxes.push_back(local_box(place->box, origin));
            fragments.middles.push_back(local_point(place->middle, origin));
        }
    }
    return fragments;
}

void append_pieces(
    const Fragments& fragments,
    std::span<const std::uint32_t> sorted,
    HierarchyNode& node,
    Hierarchy& hierarchy
) {
    node.first_piece = static_cast<std::uint32_t>(hierarchy.pieces.size());
    node.piece_primitives = sorted.size();
    for (std::size_t position = 0; position < sorted.size();) {
        const std::size_t owner = fragments.owner(sorted[position]);
        const std::size_t end = owner + 1 == fragments.starts.size() ? fragments.boxes.size()
                                                                     : fragments.starts[owner + 1];
        Piece piece;
        piece.item = make_id<ItemId>(fragments.objects[owner]);
        piece.first = static_cast<std::uint32_t>(hierarchy.primitives.size());
        for (; position < sorted.size() && sorted[position] < end; ++position) {
            if (hierarchy.primitives.size() % Hierarchy::kBlockPrimitives == 0) {
                hierarchy.block_boxes.emplace_back();
            }
            Box3f& block = hierarchy.block_boxes.back();
            block = unite(block, fragments.boxes[sorted[position]]);
            hierarchy.primitives.push_back(sorted[position] - fragments.starts[owner]);
            ++piece.count;
        }
        hierarchy.pieces.push_back(piece);
    }
    node.piece_count = static_cast<std::uint32_t>(hierarchy.pieces.size()) - node.first_piece;
}

void sum_up(Hierarchy& hierarchy, std::size_t objects) {
    for (std::size_t index = hierarchy.nodes.size(); index-- > 0;) {
        HierarchyNode& node = hierarchy.nodes[index];
        if (is_leaf(node)) {
            continue;
        }
        const HierarchyNode& behind = hierarchy.nodes[node.first_child];
        const HierarchyNode& front = hierarchy.nodes[node.first_child + 1];
        node.first_item = behind.first_item;
        node.item_count = behind.item_count + front.item_count;
        node.first_piece = behind.first_piece;
        node.piece_count = behind.piece_count + front.piece_count;
        node.first_guest = behind.first_guest;
        node.guest_count = behind.guest_count + front.guest_count;
        node.item_primitives = behind.item_primitives + front.item_primitives;
        node.piece_primitives = behind.piece_primitives + front.piece_primitives;
        node.guest_primitives = behind.guest_primitives + front.guest_primitives;
        node.items_box = unite(behind.items_box, front.items_box);
        node.pieces_box = unite(behind.pieces_box, front.pieces_box);
        if (hierarchy.clip_leaves) {
            hierarchy.whole_pieces_boxes[index] = unite(
                hierarchy.whole_pieces_boxes[node.first_child],
                hierarchy.whole_pieces_boxes[node.first_child + 1]
            );
        }
    }
    hierarchy.nodes.shrink_to_fit();
    hierarchy.pieces.shrink_to_fit();
    // A leaf has one piece of an object at most, so an object with two pieces is split.
    std::vector<std::uint32_t> piece_counts(objects, 0);
    for (const Piece& piece : hierarchy.pieces) {
        hierarchy.quality.split_objects += ++piece_counts[index_of(piece.item)] == 2 ? 1U : 0U;
    }
}

} // namespace farfield::partition::detail
