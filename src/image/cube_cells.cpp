#include "image/cube_cells.hpp"

#include <farfield/math/triangle_box.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace farfield::image {

namespace {

/// A primitive in a cell, with the part of its cost that this cell has to bear.
struct Entry {
    std::uint32_t number = 0;
    float share = 1.0F;
};

struct Place {
    glm::vec3 lo{0.0F};
    float edge = 0.0F;
    std::uint32_t depth = 0;

    [[nodiscard]] Place child(unsigned octant) const noexcept {
        const float half = edge * 0.5F;
        const glm::vec3 upper(
            (octant & 1U) != 0U ? half : 0.0F,
            (octant & 2U) != 0U ? half : 0.0F,
            (octant & 4U) != 0U ? half : 0.0F
        );
        return {lo + upper, half, depth + 1};
    }
};

/// Cells of one part of a tree, the root of the part first.
struct Part {
    std::vector<CubeCell> cells;
    std::vector<Box3f> boxes; ///< of the contents of leaves, by cell
    std::vector<std::uint32_t> contents;
    ColorCubeTree::Quality quality;
};

/// A part that is still to be divided.
struct Task {
    Place place;
    std::vector<Entry> entries;
    std::uint32_t cell = 0; ///< of the part above
};

Box3f bounds_of(const Triangle3f& triangle) noexcept {
    return unite(unite(Box3f{triangle[0], triangle[0]}, triangle[1]), triangle[2]);
}

class Divider {
  public:
    Divider(const CellContents& contents, const ColorCubeOptions& options) noexcept
        : contents_(&contents), options_(&options) {}

    /// Divides a cell and what it becomes.
    /// @param tasks where cells are left to others from `leave_at` levels below the root on; null:
    /// nothing is left
    void divide(
        const Place& place,
        std::vector<Entry> entries,
        std::uint32_t cell,
        Part& part,
        std::vector<Task>* tasks,
        std::uint32_t leave_at
    ) const {
        if (tasks != nullptr && place.depth >= leave_at) {
            tasks->push_back({place, std::move(entries), cell});
            return;
        }
        std::array<std::vector<Entry>, 8> children;
        const unsigned octants = part_entries(place, entries, children);
        if (octants == 0) {
            part.cells[cell].first = static_cast<std::uint32_t>(part.contents.size());
            for (const Entry& entry : entries) {
                part.contents.push_back(entry.number);
            }
            part.contents.back() |= ColorCubeTree::kLast;
            part.boxes[cell] = box_of(place, entries);
            ++part.quality.leaves;
            part.quality.depth = std::max(part.quality.depth, place.depth);
            return;
        }
        entries = {};
        const auto first = static_cast<std::uint32_t>(part.cells.size());
        part.cells[cell].first = first;
        part.cells[cell].octants = static_cast<std::uint8_t>(octants);
        part.cells.resize(part.cells.size() + static_cast<std::size_t>(std::popcount(octants)));
        part.boxes.resize(part.cells.size());
        std::uint32_t next = first;
        for (unsigned octant = 0; octant < 8; ++octant) {
            if ((octants >> octant & 1U) != 0U) {
                divide(
                    place.child(octant), std::move(children[octant]), next++, part, tasks, leave_at
                );
            }
        }
    }

  private:
    [[nodiscard]] float cost(std::uint32_t number) const noexcept {
        return number < contents_->costs.size() ? contents_->costs[number] : 1.0F;
    }

    /// [m] Longest side of a reference.
    [[nodiscard]] float size_of(std::uint32_t reference) const noexcept {
        const glm::vec3 size = extent(contents_->references[reference]);
        return std::max({size.x, size.y, size.z});
    }

    /// Which octants of a cell that it is in a box reaches into: at least one.
    [[nodiscard]] static unsigned octants_of(const Box3f& box, const Place& place) noexcept {
        const glm::vec3 middle = place.lo + place.edge * 0.5F;
        unsigned octants = 0xFFU;
        constexpr std::array<unsigned, 3> kUpper = {0xAAU, 0xCCU, 0xF0U};
        for (int axis = 0; axis < 3; ++axis) {
            const unsigned upper = kUpper[static_cast<std::size_t>(axis)];
            // What only touches the plane from below stays below.
            if (box.hi[axis] <= middle[axis] && box.lo[axis] < middle[axis]) {
                octants &= ~upper;
            } else if (box.lo[axis] >= middle[axis]) {
                octants &= upper;
            }
        }
        return octants;
    }

    /// The same of one of the contents.
    [[nodiscard]] unsigned octants_of(std::uint32_t number, const Place& place) const {
        if (number < contents_->references.size()) {
            return octants_of(contents_->references[number], place);
        }
        const std::size_t index = number - contents_->references.size();
        const bool is_item = index < contents_->items.size();
        const Triangle3f* triangle =
            is_item ? nullptr : &contents_->triangles[index - contents_->items.size()];
        const Box3f box = is_item ? contents_->items[index] : bounds_of(*triangle);
        const unsigned octants = octants_of(box, place);
        if (std::has_single_bit(octants) || (is_item && !contents_->part)) {
            return octants;
        }
        unsigned reached = 0;
        for (unsigned octant = 0; octant < 8; ++octant) {
            if ((octants >> octant & 1U) == 0U) {
                continue;
            }
            const Place child = place.child(octant);
            const Box3f cell{child.lo, child.lo + child.edge};
            const bool meets = is_item
                                   ? !is_empty(contents_->part(index, cell))
                                   : overlaps(
                                         Box3d{cell.lo, cell.hi},
                                         Triangle3d{(*triangle)[0], (*triangle)[1], (*triangle)[2]}
                                     );
            reached |= meets ? 1U << octant : 0U;
        }
        // Rounding may have it miss all of the cells that it is between.
        return reached != 0 ? reached : octants;
    }

    [[nodiscard]] Box3f box_of(std::uint32_t number, const Box3f& cell) const {
        std::size_t index = number;
        if (index < contents_->references.size()) {
            return intersect(contents_->references[index], cell);
        }
        index -= contents_->references.size();
        if (index < contents_->items.size()) {
            return contents_->part ? contents_->part(index, cell)
                                   : intersect(contents_->items[index], cell);
        }
        const Triangle3f& triangle = contents_->triangles[index - contents_->items.size()];
        const Box3d clipped =
            clipped_bounds({cell.lo, cell.hi}, Triangle3d{triangle[0], triangle[1], triangle[2]});
        return local_box(clipped, glm::dvec3(0.0));
    }

    /// Box around what is in a leaf; the leaf itself where rounding leaves nothing in it.
    [[nodiscard]] Box3f box_of(const Place& place, const std::vector<Entry>& entries) const {
        const Box3f cell{place.lo, place.lo + place.edge};
        Box3f box;
        for (const Entry& entry : entries) {
            box = unite(box, box_of(entry.number, cell));
        }
        return is_empty(box) ? cell : box;
    }

    /// Deals the entries of a cell out to the octants.
    /// @return which octants have some; none where the cell is to be a leaf
    unsigned part_entries(
        const Place& place,
        const std::vector<Entry>& entries,
        std::array<std::vector<Entry>, 8>& children
    ) const {
        // What a reference shows is no smaller in a smaller cell. But where more of them overlap
        // than stand around one place side by side, one cell stands for all.
        constexpr std::ptrdiff_t kSideBySide = 4;
        const auto references = std::count_if(entries.begin(), entries.end(), [&](const Entry& e) {
            return e.number < contents_->references.size();
        });
        const float largest = references > kSideBySide ? 2.0F * place.edge : place.edge;
        double whole = 0.0;
        double borne = 0.0;
        for (const Entry& entry : entries) {
            const double full = cost(entry.number);
            whole += full;
            const bool divisible =
                entry.number >= contents_->references.size() || size_of(entry.number) < largest;
            borne += divisible ? full * entry.share : 0.0;
        }
        if (place.depth >= options_->max_depth || borne <= options_->cube_cost) {
            return 0;
        }
        double copies = 0.0;
        unsigned octants = 0;
        for (const Entry& entry : entries) {
            const unsigned reached = octants_of(entry.number, place);
            const float share = entry.share / static_cast<float>(std::popcount(reached));
            copies += 1.0 / share;
            octants |= reached;
            for (unsigned rest = reached; rest != 0; rest &= rest - 1) {
                children[static_cast<std::size_t>(std::countr_zero(rest))].push_back(
                    {entry.number, share}
                );
            }
        }
        const bool pays = borne > options_->cube_cost * std::popcount(octants);
        return pays && copies <= options_->max_copies * whole ? octants : 0U;
    }

    const CellContents* contents_;
    const ColorCubeOptions* options_;
};

/// Sixteenths of a range between which a box lies, rounded outwards.
std::array<std::uint8_t, 3> extent_of(const Box3f& box, const Box3f& range) noexcept {
    std::array<std::uint8_t, 3> extent{};
    for (int axis = 0; axis < 3; ++axis) {
        const float per_size = 16.0F / (range.hi[axis] - range.lo[axis]);
        const float lo = std::floor((box.lo[axis] - range.lo[axis]) * per_size);
        const float hi = std::ceil((box.hi[axis] - range.lo[axis]) * per_size) - 1.0F;
        const float first = std::clamp(lo, 0.0F, 15.0F);
        const float last = std::clamp(hi, first, 15.0F);
        extent[static_cast<std::size_t>(axis)] = static_cast<std::uint8_t>(
            static_cast<unsigned>(first) | static_cast<unsigned>(last) << 4U
        );
    }
    return extent;
}

/// @param boxes of the contents of leaves; becomes those of all cells
void set_extents(ColorCubeTree& tree, std::vector<Box3f>& boxes) {
    for (std::size_t i = tree.cells.size(); i-- > 0;) {
        const CubeCell& cell = tree.cells[i];
        for (std::uint32_t k = 0; cell.octants != 0 && k < child_count(cell); ++k) {
            boxes[i] = unite(boxes[i], boxes[cell.first + k]);
        }
    }
    const std::vector<CellPlace> places = places_of(tree);
    // As they are told: children are told in parts of these.
    std::vector<Box3f> around(tree.cells.size(), root_range(tree));
    for (std::size_t i = 0; i < tree.cells.size(); ++i) {
        CubeCell& cell = tree.cells[i];
        const CellPlace& place = places[i];
        cell.extent = extent_of(boxes[i], extent_range(around[i], place.lo, place.edge));
        const Box3f box = contents_box(cell, around[i], place.lo, place.edge);
        for (std::uint32_t k = 0; cell.octants != 0 && k < child_count(cell); ++k) {
            around[cell.first + k] = box;
        }
    }
}

/// Puts the cells of each level side by side: a distant view reads the upper levels and no other.
/// @param boxes of the contents of leaves, by cell
void order_by_levels(ColorCubeTree& tree, std::vector<Box3f>& boxes) {
    std::vector<CubeCell> cells;
    std::vector<std::uint32_t> old = {0}; // by new number
    cells.reserve(tree.cells.size());
    old.reserve(tree.cells.size());
    for (std::size_t i = 0; i < tree.cells.size(); ++i) {
        CubeCell cell = tree.cells[old[i]];
        if (cell.octants != 0) {
            const auto first = static_cast<std::uint32_t>(old.size());
            for (std::uint32_t k = 0; k < child_count(cell); ++k) {
                old.push_back(cell.first + k);
            }
            cell.first = first;
        }
        cells.push_back(cell);
    }
    std::vector<Box3f> ordered;
    ordered.reserve(boxes.size());
    for (const std::uint32_t cell : old) {
        ordered.push_back(boxes[cell]);
    }
    tree.cells = std::move(cells);
    boxes = std::move(ordered);
}

/// The same for an edge in both of its directions, else different with near certainty.
std::uint64_t key_of_edge(const glm::vec3& a, const glm::vec3& b) noexcept {
    const auto key = [](const glm::vec3& point) {
        std::uint64_t hash = 0;
        for (int axis = 0; axis < 3; ++axis) {
            // Zero has two representations.
            hash = (hash ^ std::bit_cast<std::uint32_t>(point[axis] + 0.0F)) * 0x9E3779B97F4A7C15U;
            hash ^= hash >> 29U;
        }
        return hash;
    };
    return key(a) + key(b);
}

/// By triangle: whether there is an edge that no other triangle has. Of a closed surface none has,
/// of leaves and blades all.
std::vector<std::uint8_t> have_free_edges(const std::vector<Triangle3f>& triangles) {
    std::vector<std::uint64_t> keys;
    keys.reserve(triangles.size() * 3);
    for (const Triangle3f& triangle : triangles) {
        for (std::size_t i = 0; i < 3; ++i) {
            keys.push_back(key_of_edge(triangle[i], triangle[(i + 1) % 3]));
        }
    }
    std::vector<std::uint64_t> sorted = keys;
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::uint8_t> free(triangles.size(), 0);
    for (std::size_t i = 0; i < keys.size(); ++i) {
        const auto at = std::lower_bound(sorted.begin(), sorted.end(), keys[i]);
        if (at + 1 == sorted.end() || at[1] != keys[i]) {
            free[i / 3] = 1;
        }
    }
    return free;
}

/// Leaves triangles with a free edge that are no larger than any leaf that they reach into to one
/// of these, the one with their middle if rounding allows, and sets how far they reach out of it.
void keep_small_triangles_once(const CellContents& contents, ColorCubeTree& tree) {
    const std::size_t others = contents.references.size() + contents.items.size();
    const std::vector<CellPlace> places = places_of(tree);
    struct Holder {
        float smallest = std::numeric_limits<float>::infinity(); ///< [m] edge of the leaves
        std::uint32_t cell = CubeCell::kNothing;                 ///< the one that is to have it
        bool has_middle = false;
    };
    std::vector<Holder> holders(contents.triangles.size());
    for (std::size_t i = 0; i < tree.cells.size(); ++i) {
        if (tree.cells[i].octants != 0) {
            continue;
        }
        const CellPlace& place = places[i];
        for_each_content(tree, tree.cells[i], [&](std::uint32_t number) {
            if (number < others) {
                return;
            }
            Holder& holder = holders[number - others];
            holder.smallest = std::min(holder.smallest, place.edge);
            const glm::vec3 at = center(bounds_of(contents.triangles[number - others])) - place.lo;
            const bool has_middle =
                std::min({at.x, at.y, at.z}) >= 0.0F && std::max({at.x, at.y, at.z}) < place.edge;
            if (holder.cell == CubeCell::kNothing || (has_middle && !holder.has_middle)) {
                holder.cell = static_cast<std::uint32_t>(i);
                holder.has_middle = has_middle;
            }
        });
    }
    const std::vector<std::uint8_t> free = have_free_edges(contents.triangles);
    std::vector<std::uint32_t> kept;
    kept.reserve(tree.contents.size());
    for (std::size_t i = 0; i < tree.cells.size(); ++i) {
        if (tree.cells[i].octants != 0) {
            continue;
        }
        const CellPlace& place = places[i];
        const std::size_t first = kept.size();
        for_each_content(tree, tree.cells[i], [&](std::uint32_t number) {
            if (number >= others) {
                const Box3f box = bounds_of(contents.triangles[number - others]);
                const glm::vec3 size = extent(box);
                const Holder& holder = holders[number - others];
                if (free[number - others] != 0 &&
                    std::max({size.x, size.y, size.z}) <= holder.smallest) {
                    if (holder.cell != i) {
                        return;
                    }
                    const glm::vec3 out =
                        glm::max(place.lo - box.lo, box.hi - (place.lo + place.edge));
                    tree.overhang = std::max({tree.overhang, out.x, out.y, out.z});
                }
            }
            kept.push_back(number);
        });
        const bool any = kept.size() > first;
        tree.cells[i].first = any ? static_cast<std::uint32_t>(first) : CubeCell::kNothing;
        if (any) {
            kept.back() |= ColorCubeTree::kLast;
        }
    }
    tree.contents = std::move(kept);
}

} // namespace

std::vector<CellPlace> places_of(const ColorCubeTree& tree) {
    std::vector<CellPlace> places(tree.cells.size());
    places[0] = {tree.lo, tree.edge};
    for (std::size_t i = 0; i < tree.cells.size(); ++i) {
        std::uint32_t child = tree.cells[i].first;
        const float half = places[i].edge * 0.5F;
        for (unsigned rest = tree.cells[i].octants; rest != 0; rest &= rest - 1) {
            const auto octant = static_cast<unsigned>(std::countr_zero(rest));
            const glm::vec3 upper(octant & 1U, octant >> 1U & 1U, octant >> 2U);
            places[child++] = {places[i].lo + upper * half, half};
        }
    }
    return places;
}

void divide_cells(
    const CellContents& contents,
    const ColorCubeOptions& options,
    Executor& executor,
    ColorCubeTree& tree
) {
    const Divider divider(contents, options);
    std::vector<Entry> all(contents.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
        all[i].number = static_cast<std::uint32_t>(i);
    }
    // What is above is divided first, so that there is enough to do at the same time.
    constexpr std::uint32_t kLeaveAt = 3;
    Part top;
    top.cells.resize(1);
    top.boxes.resize(1);
    std::vector<Task> tasks;
    divider.divide({tree.lo, tree.edge, 0}, std::move(all), 0, top, &tasks, kLeaveAt);
    std::vector<Part> parts(tasks.size());
    executor.run(tasks.size(), [&](std::size_t i) {
        parts[i].cells.resize(1);
        parts[i].boxes.resize(1);
        divider.divide(tasks[i].place, std::move(tasks[i].entries), 0, parts[i], nullptr, 0);
    });
    // The root of a part takes the place that was kept for it; what is below follows.
    for (std::size_t i = 0; i < parts.size(); ++i) {
        Part& part = parts[i];
        const auto cell_offset = static_cast<std::uint32_t>(top.cells.size()) - 1;
        const auto content_offset = static_cast<std::uint32_t>(top.contents.size());
        for (CubeCell& cell : part.cells) {
            cell.first += cell.octants != 0 ? cell_offset : content_offset;
        }
        top.cells[tasks[i].cell] = part.cells.front();
        top.cells.insert(top.cells.end(), part.cells.begin() + 1, part.cells.end());
        top.boxes[tasks[i].cell] = part.boxes.front();
        top.boxes.insert(top.boxes.end(), part.boxes.begin() + 1, part.boxes.end());
        top.contents.insert(top.contents.end(), part.contents.begin(), part.contents.end());
        top.quality.depth = std::max(top.quality.depth, part.quality.depth);
        top.quality.leaves += part.quality.leaves;
        part = {};
    }
    tree.cells = std::move(top.cells);
    tree.contents = std::move(top.contents);
    order_by_levels(tree, top.boxes);
    keep_small_triangles_once(contents, tree);
    tree.contents.shrink_to_fit();
    tree.quality = top.quality;
    if (options.colors == CubeColors::sampled) {
        set_extents(tree, top.boxes);
    }
}

} // namespace farfield::image
