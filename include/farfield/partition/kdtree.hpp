#pragma once

#include <farfield/core/result.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <cstdint>
#include <span>

namespace farfield::partition {

/// How `build_kdtree` partitions.
struct KdTreeOptions {
    /// Boxes that one box is divided into between two levels of images: 2, 4 or 8. 8 for scenes
    /// that fill space, 4 for flat ones.
    std::uint32_t branching = 8;
    /// A cell with no more primitives than this, those of pieces, guests and whole items together,
    /// is a leaf. >= 1
    std::uint32_t max_primitives = 4096;
    /// How often a cell is divided into `branching` at most; what is left there is a leaf. At 8
    /// and a branching of 8, cells are as small as 1/256 of the scene on each axis. [0, 64]
    std::uint32_t max_depth = 8;
    /// How much larger than a leaf's cell the box is that guests are gathered for, and so the box
    /// that images may be clipped to: a fraction of the cell's extent, half on each side. 0.02 is 2
    /// to 3 texels of an image of 256, enough to hide cracks. [0, 1]
    float inflation = 0.02F;
    /// Leaves hold at most this many times the primitives of all splittable objects, guests
    /// counted, or 65,536 if that is more: each cell has a share, in proportion to what it holds,
    /// and one that would exceed it is not divided. Stops what dividing only multiplies, such as
    /// large triangles heaped on each other. [1, 1024]
    std::uint32_t max_copies = 8;
};

/// Builds a k-d tree of nearly cubic cells, for images of their contents.
///
/// The cell around everything is halved across its longest side (of equal ones x before y before
/// z), over and over: log2(branching) halvings make one level of images, and only nodes at the end
/// of such a group are `image_level`. Halving keeps cells near cubes: once the first cuts have made
/// the longest side no more than twice the shortest it stays so, and cubes have the smallest error
/// and the squarest images for their contents. Planes that follow the contents would balance
/// primitives better and do neither. Cells do not depend on where the contents lie inside them.
///
/// Nothing is there of a cell without contents: where one half is empty the other takes the node's
/// place, and where a whole group leaves only one cell that holds something, no node is made for
/// it. So every interior node has two children that hold something, an image has 2 to `branching`
/// images below it, and `quality.depth` counts halvings that told contents apart.
///
/// A splittable object's primitive is a piece in exactly one leaf, whose cell holds its middle: the
/// centroid of a triangle, or the centre of a box where only boxes are told; on a plane, the side
/// that the primitive reaches into, else the front. It is a guest of every other leaf whose
/// enlarged cell it meets, touching included; rounding never loses one. A leaf's `pieces_box` is
/// around the parts of pieces and guests inside its cell, and `clip_leaves` is set. Cells that
/// primitives merely touch, to within 2^-22 of the largest coordinate (from the middle of all
/// objects), hold nothing of them; cells of 64 times that and less are not divided.
///
/// Whole items go to one leaf, that of the middle of their box, and stick out of its cell:
/// `quality.cut_items` counts those that a plane of the tree cuts. A cell with a single item is
/// divided for the sake of its surfaces only.
///
/// An item that no plane cuts lies on its own side exactly, as with `build_bsp`.
///
/// @param objects as of `build_bsp`
/// @param shape needed when a splittable object has primitives: a `PrimitiveTriangle`, called once
/// for each primitive in order, then again where one lies across the side of a cell; or a
/// `PrimitiveBounds`, called once for each, and then a box is taken for all that it holds, with
/// more guests than need be. The limits of boxes hold for corners.
/// @return the tree, or an error that names the object or the option and the value. The same tree
/// on every run.
/// @par Cost O((n + r) depth) time for n items and r primitives with their copies; memory beside
/// the tree 44 bytes a primitive, 8 to 40 for each copy of one, 56 bytes an item
/// @par Source Schaufler and Stuerzlinger 1996, section 4. Departures: a primitive is stored once
/// and named where it is a guest; empty cells make no nodes; copies are limited.
[[nodiscard]] Result<Hierarchy> build_kdtree(
    std::span<const Object> objects,
    const KdTreeOptions& options = {},
    const PrimitiveShape& shape = {}
);

} // namespace farfield::partition
