#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/plane.hpp>
#include <farfield/math/triangle_box.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <functional>
#include <span>
#include <variant>
#include <vector>

namespace farfield {

/// What a builder needs to know of an object; object i of the span is `ItemId` i.
struct Object {
    Box3d bounds;                 ///< world [m], finite, not empty
    std::uint64_t primitives = 1; ///< triangles it costs to draw
    bool splittable = false;      ///< its primitives may go to several leaves
};

/// World box of primitive `primitive` of object `object`. Called only for splittable objects, in
/// any order.
using PrimitiveBounds = std::function<Box3d(std::uint32_t object, std::uint32_t primitive)>;

/// World corners of primitive `primitive` of object `object`, for builders that ask what it really
/// reaches. Called only for splittable objects, in any order, any number of times.
using PrimitiveTriangle = std::function<Triangle3d(std::uint32_t object, std::uint32_t primitive)>;

/// What an engine tells of its primitives: a callable of either kind is one.
using PrimitiveShape = std::variant<PrimitiveBounds, PrimitiveTriangle>;

/// A run of primitives of one split item: `count` entries of `Hierarchy::primitives` from `first`.
struct Piece {
    ItemId item = kNone<ItemId>;
    std::uint32_t first = 0;
    std::uint32_t count = 0;

    friend bool operator==(const Piece&, const Piece&) = default;
};

/// Node of a `Hierarchy`. The arrays are laid out depth-first, so what lies under a node, at any
/// level, is one range of `items` and one of `pieces`. Children come after their parent in `nodes`:
/// a loop from the back to the front meets children first and needs no recursion. Aligned, so that
/// it is two lines of memory and not three: in large trees that is what a walk costs.
struct alignas(64) HierarchyNode {
    std::uint32_t first_child = 0;      ///< children are first_child and first_child + 1; 0: a leaf
    std::uint32_t parent = 0;           ///< 0 for the root, which is node 0
    std::uint32_t first_item = 0;       ///< into `Hierarchy::items`
    std::uint32_t item_count = 0;       ///< of the whole subtree
    std::uint32_t first_piece = 0;      ///< into `Hierarchy::pieces`
    std::uint32_t piece_count = 0;      ///< of the whole subtree
    std::uint64_t item_primitives = 0;  ///< primitives of the whole items, instances counted
    std::uint64_t piece_primitives = 0; ///< primitives of the pieces
    Plane plane;     ///< interior: separates child 0 (behind it) from child 1 (in front of it)
    Box3f items_box; ///< around the whole items of the subtree; empty when there are none
    /// Around the pieces of the subtree; empty when there are none. With `Hierarchy::clip_leaves`
    /// around the parts of pieces and guests inside the cells.
    Box3f pieces_box;
    std::uint32_t first_guest = 0;      ///< into `Hierarchy::guests`
    std::uint32_t guest_count = 0;      ///< of the whole subtree
    std::uint64_t guest_primitives = 0; ///< primitives of the guests
    /// Another number than before: something under the node looks different. What follows a
    /// changing world (partition/changes.hpp) counts it up along the way to the root.
    std::uint32_t content_version = 0;
    /// False: a step inside a wider branching, such as the halves and quarters between a box and
    /// its eight children; images are made of the others only.
    bool image_level = true;
};

/// An item that has left its place: every technique draws it as geometry, in every frame.
struct MovingItem {
    ItemId item = kNone<ItemId>;
    Box3f box;                    ///< where it is now, relative to the origin; empty: hidden
    std::uint64_t primitives = 0; ///< triangles it costs to draw
    std::uint32_t home = 0;       ///< the place in `Hierarchy::items` that it left
    Box3f home_box;               ///< where it was there
};

/// Binary space partition of objects: flat arrays, plain data. Every float is relative to `origin`.
///
/// Each whole item lies in exactly one leaf; each primitive of a split item lies in exactly one
/// leaf. A splittable object is always held as pieces, even where one leaf holds it all. Back to
/// front from an eye: at every interior node first the child on the far side of `plane`. That order
/// is exact for contents inside their cells; items that a plane had to cut (`quality.cut_items`)
/// and primitives on the rim of a piece may stick out of theirs.
struct Hierarchy {
    glm::dvec3 origin{0.0};
    std::vector<HierarchyNode> nodes; ///< node 0 is the root; never empty
    std::vector<ItemId> items;        ///< whole items, leaf by leaf
    std::vector<Piece> pieces;        ///< parts of split items, leaf by leaf
    /// Primitive numbers of the split items, piece by piece and without gaps: the first piece
    /// starts at 0 and each at the end of the one before, so neighbouring pieces of one item are
    /// one run.
    std::vector<std::uint32_t> primitives;
    /// Boxes around runs of `kBlockPrimitives` entries of `primitives`, the last run shorter: so a
    /// part of a piece can be picked without its geometry. Empty: pieces are drawn whole.
    std::vector<Box3f> block_boxes;
    static constexpr std::uint32_t kBlockPrimitives = 16;
    /// Runs of `primitives` that lie in other leaves and reach into this one, leaf by leaf,
    /// ascending and apart within a leaf; a run may go through several pieces of its item. Only
    /// partitions that clip have them.
    std::vector<Piece> guests;
    /// How the surfaces of leaves are kept apart where images are shown. False: each primitive is
    /// drawn whole, with its leaf. True: with every leaf it reaches into, as a piece or as a guest,
    /// clipped to the `pieces_box` of the leaf, which is then part of its cell. Where nothing is
    /// replaced by images, pieces alone draw everything once.
    bool clip_leaves = false;
    /// Boxes around the pieces of every node, by node, as they are and unclipped: which leaves to
    /// draw where pieces are drawn whole. Empty without `clip_leaves`: `pieces_box` is that box.
    std::vector<Box3f> whole_pieces_boxes;
    /// How far split surfaces reach beyond their cell in images, to hide cracks: a fraction of the
    /// cell's extent, half on each side. [0, 1]
    float inflation = 0.0F;
    /// Box and cost of every whole item, by its place in `items`. Without them items cannot move.
    std::vector<Box3f> item_boxes;
    std::vector<std::uint64_t> item_primitives;
    /// Where each item is, by `ItemId`: its place in `items`, or the size of `items` and its number
    /// in `moving`, or `kNoPlace` for what is no whole item. Comes with `item_boxes`.
    std::vector<std::uint32_t> item_places;
    static constexpr std::uint32_t kNoPlace = UINT32_MAX;
    /// Items that have left their places, where `items` has `kNone<ItemId>` since: there are as
    /// many holes as items that move.
    std::vector<MovingItem> moving;
    /// Another number than before: some split surface looks different.
    std::uint32_t surface_version = 0;

    /// What the builder achieved.
    struct Quality {
        std::uint32_t depth = 0; ///< longest way from the root to a leaf; 0 for a lone root
        std::uint32_t leaves = 0;
        std::uint32_t cut_items = 0;     ///< items whose box crosses a plane above their leaf
        std::uint64_t split_objects = 0; ///< objects whose primitives lie in more than one leaf
    } quality;
};

/// True when a node has no children.
[[nodiscard]] inline bool is_leaf(const HierarchyNode& node) noexcept {
    return node.first_child == 0;
}

/// Box around everything under a node. Empty only where nothing was, or all items have left.
[[nodiscard]] inline Box3f bounds(const HierarchyNode& node) noexcept {
    return unite(node.items_box, node.pieces_box);
}

/// Box around the pieces of a node as they are, unclipped; empty when there are none.
[[nodiscard]] inline const Box3f&
whole_pieces_box(const Hierarchy& hierarchy, std::size_t node) noexcept {
    return hierarchy.clip_leaves ? hierarchy.whole_pieces_boxes[node]
                                 : hierarchy.nodes[node].pieces_box;
}

/// Everything under a node, guests apart [primitives].
[[nodiscard]] inline std::uint64_t primitive_count(const HierarchyNode& node) noexcept {
    return node.item_primitives + node.piece_primitives;
}

/// The child (0 or 1) to draw first for an eye in the hierarchy's frame. An eye on the plane sees
/// neither child before the other; child 0 is first then.
[[nodiscard]] inline unsigned far_child(const HierarchyNode& node, const glm::vec3& eye) noexcept {
    return signed_distance(node.plane, eye) < 0.0F ? 1U : 0U;
}

/// Bytes held by the arrays.
[[nodiscard]] std::uint64_t memory_bytes(const Hierarchy& hierarchy) noexcept;

/// Checks all that a technique relies on: child and parent links, children after parents,
/// depth-first ranges that nest, counts that add up, unit normals, boxes that hold those of the
/// children and are empty exactly without contents, a finite box for every block where there are
/// any, no item in two places, boxes, costs and places of items that fit each other and their
/// leaves, `moving` included, and holes only where items can move, the primitives of each split
/// item 0 to n - 1 in exactly one leaf each, guests that lie in other leaves and once in a leaf,
/// clipped leaves on their sides of all planes above them, image levels at the root and at leaves,
/// and `quality` but for `cut_items`, which the tree alone does not tell. For hierarchies that did
/// not come from one of our builders, and for tests.
/// @return an error that names the node, piece or item, the field and the value
/// @par Cost O(n log n) time, O(n) memory
[[nodiscard]] Result<void> validate(const Hierarchy& hierarchy);

} // namespace farfield
