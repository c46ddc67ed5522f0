#pragma once

#include <farfield/core/ids.hpp>
#include <farfield/core/result.hpp>
#include <farfield/image/color_cube.hpp>
#include <farfield/math/box3.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_float3x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace farfield {

/// A cell of an octree. 8 bytes.
struct CubeCell {
    /// Interior: its first child; the children follow each other in the order of their octants.
    /// Leaf: its first entry of `ColorCubeTree::contents`, or `kNothing`.
    std::uint32_t first = 0;
    static constexpr std::uint32_t kNothing = UINT32_MAX;
    std::uint8_t octants = 0; ///< bit i: octant i has contents; none: a leaf
    /// By axis, in sixteenths of where the contents of the parent reach into the cell: where its
    /// contents begin (low four bits), and where they end, less one. Their box is what the colours
    /// are of; see `contents_box`.
    std::array<std::uint8_t, 3> extent{0xF0, 0xF0, 0xF0};

    friend bool operator==(const CubeCell&, const CubeCell&) = default;
};
static_assert(sizeof(CubeCell) == 8);

/// What the extent of a cell is told in parts of: its part of a box around it, or a 64th of the
/// cell where that is less, so that what is flat is not measured in ever smaller parts.
/// @param around box of the contents of the parent; of a root: `root_range`
/// @param lo, edge of the cell
[[nodiscard]] inline Box3f
extent_range(const Box3f& around, const glm::vec3& lo, float edge) noexcept {
    const glm::vec3 hi = lo + edge;
    const glm::vec3 first = glm::max(around.lo, lo);
    const glm::vec3 size = glm::max(glm::min(around.hi, hi) - first, edge * (1.0F / 64.0F));
    const glm::vec3 begin = glm::min(first, hi - size);
    return {begin, begin + size};
}

/// Where the contents of a cell are.
/// @param around, lo, edge as `extent_range` has them
[[nodiscard]] inline Box3f
contents_box(const CubeCell& cell, const Box3f& around, const glm::vec3& lo, float edge) noexcept {
    const Box3f range = extent_range(around, lo, edge);
    const glm::vec3 step = (range.hi - range.lo) * (1.0F / 16.0F);
    const auto& of = cell.extent;
    return {
        range.lo + step * glm::vec3(of[0] & 15U, of[1] & 15U, of[2] & 15U),
        range.lo + step * glm::vec3((of[0] >> 4U) + 1U, (of[1] >> 4U) + 1U, (of[2] >> 4U) + 1U)};
}

/// Children of a cell.
[[nodiscard]] constexpr std::uint32_t child_count(const CubeCell& cell) noexcept {
    return static_cast<std::uint32_t>(std::popcount(cell.octants));
}

/// Triangles of one item that a tree holds one by one.
struct CubePrimitives {
    ItemId item = kNone<ItemId>; ///< none: the item of the reference to the tree
    std::uint32_t first = 0;     ///< number of its triangle 0 among the contents of the tree
    std::uint32_t count = 0;

    friend bool operator==(const CubePrimitives&, const CubePrimitives&) = default;
};

/// An octree whose cells have six colours each. Children come after their parent.
///
/// The contents of a leaf are the entries from `CubeCell::first` to the first one with the bit
/// `kLast`. Without that bit an entry is a number: below `reference_count` a reference of the
/// model, from there on a whole item of `items`, from `reference_count + items.size()` on a
/// triangle, of which `primitives` tells. What reaches into several leaves is in all of them, but
/// for triangles no larger than the smallest of these leaves: where some of the leaves are shown
/// by their colours, such a triangle would be drawn and shown at the same time. One leaf alone has
/// it, and the others may have nothing but their colours.
struct ColorCubeTree {
    glm::vec3 lo{0.0F};          ///< [m] lower corner of the cube around everything
    float edge = 0.0F;           ///< [m] > 0
    Box3f bounds;                ///< [m] around all contents; empty: as far as known, the cube
    std::vector<CubeCell> cells; ///< cell 0 is the root; never empty
    /// How cells look, by light set and cell: set s of cell c is `cubes[s * cells.size() + c]`.
    std::vector<ColorCube> cubes;
    std::uint32_t light_sets = 1;
    /// By cell: see `oblique_alpha`. Empty: colours are as published, and faces are shown as they
    /// are from every direction.
    std::vector<CubeGain> gains;
    /// By depth below the root: what makes up for how cells of a level hide each other, which is
    /// not by chance. Sheets do without. Empty: 1.
    std::vector<LevelFactors> level_factors;
    std::vector<std::uint32_t> contents;
    static constexpr std::uint32_t kLast = 1U << 31U;
    std::uint32_t reference_count = 0;
    /// [m] how far triangles reach at most out of the one leaf that has them.
    float overhang = 0.0F;
    std::vector<ItemId> items;
    std::vector<std::uint32_t> item_primitives; ///< triangles that each of `items` costs to draw
    std::vector<CubePrimitives> primitives;

    /// What the builder achieved.
    struct Quality {
        std::uint32_t depth = 0; ///< levels below the root
        std::uint32_t leaves = 0;

        friend bool operator==(const Quality&, const Quality&) = default;
    } quality;

    friend bool operator==(const ColorCubeTree&, const ColorCubeTree&) = default;
};

/// One appearance of a tree.
struct CubeReference {
    ItemId item = kNone<ItemId>; ///< what is drawn where geometry is
    std::uint32_t tree = 0;      ///< into `ColorCubeModel::trees`, not the last
    std::uint32_t light_set = 0; ///< of the tree: as the light falls on it here
    float scale = 1.0F;          ///< > 0
    glm::mat3 rotation{1.0F};    ///< proper
    glm::vec3 translation{0.0F}; ///< [m] a point p of the tree is at translation + scale rotation p

    friend bool operator==(const CubeReference&, const CubeReference&) = default;
};

/// A scene as octrees of colour cubes: one tree for every shape that is there several times, and
/// the last one for the whole scene. Plain data, made by `build_color_cubes` or read from a file.
struct ColorCubeModel {
    glm::dvec3 origin{0.0}; ///< world position that the last tree and translations are relative to
    std::vector<ColorCubeTree> trees;
    std::vector<CubeReference> references; ///< of the last tree
    std::uint32_t item_count = 0;          ///< of the scene that it is of

    friend bool operator==(const ColorCubeModel&, const ColorCubeModel&) = default;
};

/// Bytes held by the arrays.
[[nodiscard]] std::uint64_t memory_bytes(const ColorCubeTree& tree) noexcept;
[[nodiscard]] std::uint64_t memory_bytes(const ColorCubeModel& model) noexcept;

/// What the extent of the root is told in parts of.
[[nodiscard]] inline Box3f root_range(const ColorCubeTree& tree) noexcept {
    return is_empty(tree.bounds) ? Box3f{tree.lo, tree.lo + tree.edge} : tree.bounds;
}

/// By which directions are scaled for `level_factor`: 1 / sqrt(side) of what is around the
/// contents, in sides of the cube and no less than a 64th.
[[nodiscard]] inline glm::vec3 level_scale(const ColorCubeTree& tree) noexcept {
    const glm::vec3 size = extent(root_range(tree)) / tree.edge;
    return 1.0F / glm::sqrt(glm::clamp(size, 1.0F / 64.0F, 1.0F));
}

/// Where the contents of all cells are, by cell. [m] in the frame of the tree
[[nodiscard]] std::vector<Box3f> contents_boxes(const ColorCubeTree& tree);

/// Calls `visit(number)` for each of the contents of a leaf.
template <typename Visit>
void for_each_content(const ColorCubeTree& tree, const CubeCell& leaf, Visit&& visit) {
    for (std::size_t i = leaf.first; leaf.first != CubeCell::kNothing; ++i) {
        visit(tree.contents[i] & ~ColorCubeTree::kLast);
        if ((tree.contents[i] & ColorCubeTree::kLast) != 0U) {
            return;
        }
    }
}

/// Checks all that a technique relies on: links, children after parents, each cell in one place,
/// at most 20 levels below a root; numbers that exist, lists that end, each entry of the contents
/// in one of them, each number in a leaf, in none twice; groups of primitives without gaps, one
/// without an item in trees that are referred to; each item of the scene in one place of the model;
/// extents, finite boxes and transforms, proper rotations, colours no larger than their alpha,
/// sizes of arrays, `quality`. For models from files and engines.
/// @return an error that names the tree, the cell or reference, the field and the value
/// @par Cost linear in time and memory, both bounded by the arrays and not by what they announce
[[nodiscard]] Result<void> validate(const ColorCubeModel& model);

} // namespace farfield
