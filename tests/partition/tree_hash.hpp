#pragma once

#include <farfield/partition/hierarchy.hpp>

#include <glm/vec3.hpp>

#include <bit>
#include <cstdint>

namespace farfield::support {

/// FNV-1a over numbers.
class Hash {
  public:
    void add(std::uint64_t value) {
        for (int byte = 0; byte < 8; ++byte) {
            state_ = (state_ ^ ((value >> (8 * byte)) & 0xFFU)) * 0x100000001B3U;
        }
    }
    /// Both zeros count as one.
    void add(float value) { add(std::uint64_t{std::bit_cast<std::uint32_t>(value + 0.0F)}); }
    void add(const glm::vec3& value) {
        add(value.x);
        add(value.y);
        add(value.z);
    }
    void add(const Box3f& box) {
        add(box.lo);
        add(box.hi);
    }
    [[nodiscard]] std::uint64_t state() const { return state_; }

  private:
    std::uint64_t state_ = 0xCBF29CE484222325U;
};

/// What lies where, whatever the size of the world.
inline void add_structure(const Hierarchy& tree, Hash& hash) {
    for (const HierarchyNode& node : tree.nodes) {
        for (const std::uint32_t value :
             {node.first_child,
              node.parent,
              node.first_item,
              node.item_count,
              node.first_piece,
              node.piece_count,
              node.first_guest,
              node.guest_count}) {
            hash.add(std::uint64_t{value});
        }
        hash.add(node.item_primitives);
        hash.add(node.piece_primitives);
        hash.add(node.guest_primitives);
        hash.add(std::uint64_t{node.image_level ? 1U : 0U});
        hash.add(node.plane.normal);
    }
    for (const ItemId item : tree.items) {
        hash.add(std::uint64_t{index_of(item)});
    }
    for (const std::uint32_t primitive : tree.primitives) {
        hash.add(std::uint64_t{primitive});
    }
    for (const auto* runs : {&tree.pieces, &tree.guests}) {
        for (const Piece& run : *runs) {
            hash.add(std::uint64_t{index_of(run.item)});
            hash.add(std::uint64_t{run.first});
            hash.add(std::uint64_t{run.count});
        }
    }
}

inline std::uint64_t structure_of(const Hierarchy& tree) {
    Hash hash;
    add_structure(tree, hash);
    return hash.state();
}

/// Of every number of the tree.
inline std::uint64_t hash_of(const Hierarchy& tree) {
    Hash hash;
    add_structure(tree, hash);
    for (int axis = 0; axis < 3; ++axis) {
        hash.add(std::bit_cast<std::uint64_t>(tree.origin[axis]));
    }
    for (const HierarchyNode& node : tree.nodes) {
        hash.add(node.plane.offset);
        hash.add(node.items_box);
        hash.add(node.pieces_box);
    }
    for (const auto* boxes : {&tree.block_boxes, &tree.whole_pieces_boxes, &tree.item_boxes}) {
        for (const Box3f& box : *boxes) {
            hash.add(box);
        }
    }
    return hash.state();
}

} // namespace farfield::support
