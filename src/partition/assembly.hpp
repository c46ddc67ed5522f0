#pragma once

#include <farfield/core/result.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

/// What all builders do alike with primitives and with finished leaves.
namespace farfield::partition::detail {

/// Primitives of the splittable objects, object after object, relative to the origin.
struct Fragments {
    std::vector<std::uint32_t> objects; ///< the splittable ones that have primitives
    std::vector<std::uint32_t> starts;  ///< first fragment of each of `objects`
    std::vector<Box3f> boxes;           ///< rounded outwards
    /// A point of each, which says where it is at home: the centre of its box, or the centroid of
    /// a triangle, which may not reach the centre of its box.
    std::vector<glm::vec3> middles;

    /// Which of `objects` a fragment belongs to.
    [[nodiscard]] std::size_t owner(std::uint32_t fragment) const noexcept;
};

/// Asks for every primitive once, in order.
/// @return an error that names object and primitive
[[nodiscard]] Result<Fragments> gather_fragments(
    std::span<const Object> objects, const PrimitiveShape& shape, const glm::dvec3& origin
);

/// Appends pieces of a leaf: their primitives, block boxes and runs, and what the node says of
/// them but for `pieces_box`.
/// @param sorted ascending: an object's primitives follow each other, in the order of its mesh
void append_pieces(
    const Fragments& fragments,
    std::span<const std::uint32_t> sorted,
    HierarchyNode& node,
    Hierarchy& hierarchy
);

/// Fills interior nodes from their children, which come after them, and counts split objects.
void sum_up(Hierarchy& hierarchy, std::size_t objects);

} // namespace farfield::partition::detail
