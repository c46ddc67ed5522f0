// Schaufler and Stuerzlinger: A Three Dimensional Image Cache for Virtual Reality, Eurographics
// 1996, section 4.
//
// The halvings of one image level are made together, in a small complete tree of slots; what is
// empty is left out when its nodes are written. References to primitives of cells that wait lie on
// a stack, since cells are visited depth first.
#include "partition/cells.hpp"

#include "partition/assembly.hpp"
#include "partition/checks.hpp"
#include "partition/gap.hpp"
#include "partition/item_tables.hpp"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace farfield::partition::detail {

namespace {

constexpr std::uint32_t kMostHalvings = 3;
constexpr std::size_t kSlots = (2U << kMostHalvings) - 1;
/// Leaves may hold so many references whatever the primitives: a small scene is divided as asked.
constexpr std::uint32_t kFreeReferences = 1U << 16U;
/// What reaches across a plane by less only touches it, over the largest coordinate: two units in
/// the last place of boxes that were rounded outwards, and as much for a plane of a grid that has
/// no exact numbers.
constexpr double kTouch = 0x1p-22;
/// Cells of fewer touching distances are not divided: three halvings leave them well apart.
constexpr double kSmallestCell = 64.0;

template <typename Value>
tl::unexpected<Error>
wrong(const CellRules& rules, const char* option, Value value, const char* expected) {
    return fail(
        ErrorCode::invalid_argument,
        std::string(rules.options) + ": " + option + " is " + text(static_cast<double>(value)) +
            ", expected " + expected
    );
}

Result<void> check_rules(const CellRules& rules) {
    if (rules.max_primitives < 1) {
        return wrong(rules, "max_primitives", rules.max_primitives, "at least 1");
    }
    if (rules.max_depth > 64) {
        return wrong(rules, "max_depth", rules.max_depth, "0 to 64");
    }
    if (!(rules.inflation >= 0.0F && rules.inflation <= 1.0F)) {
        return wrong(rules, "inflation", rules.inflation, "a number in [0, 1]");
    }
    if (rules.max_copies < 1 || rules.max_copies > 1024) {
        return wrong(rules, "max_copies", rules.max_copies, "1 to 1024");
    }
    return {};
}

struct Range {
    std::size_t begin = 0;
    std::size_t end = 0;

    [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
};

/// A whole item. Boxes move with their numbers, so that cells are read from front to back.
struct ItemEntry {
    Box3f box; ///< rounded to nearest, not outwards: boxes that touch in the world still touch
    std::uint32_t object = 0;
};

/// A primitive in a cell.
struct Reference {
    std::uint32_t fragment = 0;
    bool home = false;  ///< its middle is in the cell
    bool meets = false; ///< it reaches into the cell; else only into the enlarged one
};

/// A cell that is being divided.
struct Slot {
    Box3f cell;
    Range items;
    std::vector<Reference> references;
    bool occupied = false; ///< something is in the cell
    bool divided = false;
    Plane plane;
};

/// A node that waits.
struct Task {
    std::uint32_t node = 0;
    std::uint32_t level = 0; ///< how often cells around it were divided
    Box3f cell;
    Range items;
    std::size_t references = 0; ///< how many of them, at the end of the stack
    double share = 0.0;         ///< references that its leaves may have
};

[[nodiscard]] bool holds(const Box3f& outer, const Box3f& inner) noexcept {
    return contains(outer, inner.lo) && contains(outer, inner.hi);
}

[[nodiscard]] Box3d widened(const Box3f& box) noexcept {
    return {glm::dvec3(box.lo), glm::dvec3(box.hi)};
}

[[nodiscard]] int longest_side(const Box3f& cell) noexcept {
    const glm::vec3 sides = extent(cell);
    int longest = 0;
    for (int axis = 1; axis < 3; ++axis) {
        longest = sides[axis] > sides[longest] ? axis : longest;
    }
    return longest;
}

/// The cell as guests see it, never smaller than said.
[[nodiscard]] Box3f enlarged(const Box3f& cell, float inflation) noexcept {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    Box3f box = inflate(cell, extent(cell) * (0.5F * inflation));
    for (int axis = 0; axis < 3; ++axis) {
        box.lo[axis] = std::nextafter(box.lo[axis], -kInfinity);
        box.hi[axis] = std::nextafter(box.hi[axis], kInfinity);
    }
    return box;
}

class CellBuilder {
  public:
    CellBuilder(
        std::span<const Object> objects, const CellRules& rules, const PrimitiveShape& shape
    )
        : objects_(objects), rules_(rules), triangle_of_(std::get_if<PrimitiveTriangle>(&shape)) {}

    Result<Hierarchy> build(const PrimitiveShape& shape) {
        Box3d everything;
        for (const Object& object : objects_) {
            everything = unite(everything, object.bounds);
        }
        if (!objects_.empty()) {
            hierarchy_.origin = center(everything);
        }
        hierarchy_.inflation = rules_.inflation;
        hierarchy_.clip_leaves = true;
        auto gathered = gather_fragments(objects_, shape, hierarchy_.origin);
        if (!gathered) {
            return tl::unexpected(std::move(gathered.error()));
        }
        fragments_ = std::move(*gathered);
        gather_items();
        grow();
        write_guests();
        write_whole_boxes();
        sum_up(hierarchy_, objects_.size());
        hierarchy_.quality.cut_items =
            static_cast<std::uint32_t>(std::count(item_cut_.begin(), item_cut_.end(), char{1}));
        fill_item_tables(hierarchy_, objects_);
        return std::move(hierarchy_);
    }

  private:
    void gather_items() {
        for (std::size_t index = 0; index < objects_.size(); ++index) {
            const Object& object = objects_[index];
            if (!object.splittable) {
                items_.push_back(
                    {{local_point(object.bounds.lo, hierarchy_.origin),
                      local_point(object.bounds.hi, hierarchy_.origin)},
                     static_cast<std::uint32_t>(index)}
                );
            }
        }
        item_cut_.resize(objects_.size());
        item_scratch_.resize(items_.size());
        hierarchy_.items.reserve(items_.size());
        const std::size_t primitives = fragments_.boxes.size();
        hierarchy_.primitives.reserve(primitives);
        order_.reserve(primitives);
        constexpr std::size_t kBlock = Hierarchy::kBlockPrimitives;
        hierarchy_.block_boxes.reserve((primitives + kBlock - 1) / kBlock);
    }

    /// Around all contents; a cube where cells are to be cubes.
    [[nodiscard]] Box3f root_cell() const noexcept {
        Box3f cell;
        for (const ItemEntry& item : items_) {
            cell = unite(cell, item.box);
        }
        for (const Box3f& box : fragments_.boxes) {
            cell = unite(cell, box);
        }
        if (rules_.shape == CellShape::cube && !is_empty(cell)) {
            const glm::vec3 middle = center(cell);
            const glm::vec3 reach = glm::max(cell.hi - middle, middle - cell.lo);
            const float half = std::max(reach.x, std::max(reach.y, reach.z));
            cell = unite(cell, Box3f{middle - half, middle + half});
        }
        return cell;
    }

    void grow() {
        Task root;
        root.cell = root_cell();
        root.items = {0, items_.size()};
        root.references = fragments_.boxes.size();
        root.share = std::clamp(
            static_cast<double>(rules_.max_copies) * static_cast<double>(root.references),
            static_cast<double>(kFreeReferences),
            static_cast<double>(UINT32_MAX)
        );
        double largest = 0.0;
        for (int axis = 0; axis < 3 && !is_empty(root.cell); ++axis) {
            const float reach =
                std::max(std::abs(root.cell.lo[axis]), std::abs(root.cell.hi[axis]));
            largest = std::max(largest, static_cast<double>(reach));
        }
        touch_ = kTouch * largest;
        stack_.reserve(root.references);
        for (std::uint32_t fragment = 0; fragment < root.references; ++fragment) {
            stack_.push_back({fragment, true, true});
        }
        hierarchy_.nodes.emplace_back();
        std::vector<Task> tasks{root};
        while (!tasks.empty()) {
            Task task = tasks.back();
            tasks.pop_back();
            Slot& whole = slots_[0];
            whole.cell = task.cell;
            whole.items = task.items;
            whole.references.assign(
                stack_.end() - static_cast<std::ptrdiff_t>(task.references), stack_.end()
            );
            stack_.resize(stack_.size() - task.references);
            if (divide_until_apart(task)) {
                write_nodes(task, tasks);
            } else {
                make_leaf(task.node);
            }
        }
    }

    [[nodiscard]] std::uint64_t item_primitives(const Range& range) const noexcept {
        std::uint64_t sum = 0;
        for (std::size_t index = range.begin; index < range.end; ++index) {
            sum += objects_[items_[index].object].primitives;
        }
        return sum;
    }

    /// Whether a cell is a leaf, whatever dividing it would give.
    [[nodiscard]] bool is_final(const Task& task) const noexcept {
        const Slot& whole = slots_[0];
        const std::uint64_t surfaces = whole.references.size();
        const std::uint64_t most = rules_.max_primitives;
        if (task.level >= rules_.max_depth) {
            return true;
        }
        if (surfaces <= most &&
            (whole.items.size() <= 1 || item_primitives(whole.items) <= most - surfaces)) {
            return true;
        }
        const float side = extent(whole.cell)[longest_side(whole.cell)];
        return !(static_cast<double>(side) > kSmallestCell * touch_);
    }

    /// Divides the cell of slot 0, level after level, until something lies in two of its cells, and
    /// leaves those in the slots.
    /// @return false: it is a leaf, which slot 0 holds
    bool divide_until_apart(Task& task) {
        const std::size_t first_end = (std::size_t{1} << rules_.halvings) - 1;
        while (!is_final(task)) {
            for (std::size_t index = 0; index < first_end; ++index) {
                slots_.at(index).divided = false;
                slots_.at(2 * index + 1).occupied = false;
                slots_.at(2 * index + 2).occupied = false;
                if (index == 0 || slots_.at(index).occupied) {
                    halve(index);
                }
            }
            for (std::size_t index = first_end; index-- > 0;) {
                Slot& slot = slots_.at(index);
                slot.occupied = slot.divided && (slots_.at(2 * index + 1).occupied ||
                                                 slots_.at(2 * index + 2).occupied);
            }
            std::size_t occupied = 0;
            std::size_t last = 0;
            double references = 0.0;
            for (std::size_t index = first_end; index <= 2 * first_end; ++index) {
                if (slots_.at(index).occupied) {
                    ++occupied;
                    last = index;
                    references += static_cast<double>(slots_.at(index).references.size());
                }
            }
            // None at all: a cell that was merely touched, to within rounding.
            if (occupied != 1) {
                return occupied > 1 && references <= task.share;
            }
            // The only cell that holds anything takes the place of the node.
            Slot& whole = slots_[0];
            Slot& only = slots_.at(last);
            whole.cell = only.cell;
            whole.items = only.items;
            std::swap(whole.references, only.references);
            ++task.level;
        }
        return false;
    }

    void halve(std::size_t index) {
        Slot& slot = slots_.at(index);
        Slot& behind = slots_.at(2 * index + 1);
        Slot& front = slots_.at(2 * index + 2);
        const int axis = rules_.shape == CellShape::cube ? (index == 0  ? 0
                                                            : index < 3 ? 1
                                                                        : 2)
                                                         : longest_side(slot.cell);
        const float offset =
            halfway(slot.cell.lo[axis], slot.cell.hi[axis]) + 0.0F; // no negative zero
        slot.divided = true;
        slot.plane = Plane{glm::vec3(0.0F), offset};
        slot.plane.normal[axis] = 1.0F;
        behind.cell = slot.cell;
        behind.cell.hi[axis] = offset;
        front.cell = slot.cell;
        front.cell.lo[axis] = offset;
        part_items(slot, behind, front);
        part_references(slot, axis, behind, front);
    }

    /// Moves what is behind before what is in front, order kept on both sides.
    void part_items(const Slot& slot, Slot& behind, Slot& front) {
        std::size_t kept = slot.items.begin;
        std::size_t moved = 0;
        for (std::size_t index = slot.items.begin; index < slot.items.end; ++index) {
            const ItemEntry item = items_[index];
            if (middle(extent_along(slot.plane.normal, item.box)) < slot.plane.offset) {
                items_[kept++] = item;
            } else {
                item_scratch_[moved++] = item;
            }
        }
        std::copy_n(
            item_scratch_.begin(), moved, items_.begin() + static_cast<std::ptrdiff_t>(kept)
        );
        behind.items = {slot.items.begin, kept};
        front.items = {kept, slot.items.end};
        behind.occupied = behind.items.size() > 0;
        front.occupied = front.items.size() > 0;
    }

    void part_references(const Slot& slot, int axis, Slot& behind, Slot& front) {
        behind.references.clear();
        front.references.clear();
        const Box3f behind_box = enlarged(behind.cell, rules_.inflation);
        const Box3f front_box = enlarged(front.cell, rules_.inflation);
        const auto plane = static_cast<double>(slot.plane.offset);
        for (const Reference& reference : slot.references) {
            const Box3f& box = fragments_.boxes[reference.fragment];
            const bool middle_behind =
                fragments_.middles[reference.fragment][axis] < slot.plane.offset;
            bool reaches_behind = static_cast<double>(box.lo[axis]) < plane - touch_;
            bool reaches_front = static_cast<double>(box.hi[axis]) > plane + touch_;
            if (!reaches_behind && !reaches_front) { // flat, in the plane
                (middle_behind ? reaches_behind : reaches_front) = true;
            }
            const bool home_behind = reaches_behind && (middle_behind || !reaches_front);
            // In a cell that holds all of it a primitive reaches what its box reaches.
            triangle_ = {};
            const bool by_box = triangle_of_ == nullptr || holds(slot.cell, box);
            Reference part = reference;
            part.home = reference.home && home_behind;
            part.meets = reference.meets && reaches_behind;
            keep(part, by_box, behind_box, behind);
            part.home = reference.home && !home_behind;
            part.meets = reference.meets && reaches_front;
            keep(part, by_box, front_box, front);
        }
    }

    /// Adds a reference to a cell if the primitive meets it, or at least the enlarged one.
    void keep(Reference reference, bool by_box, const Box3f& wide_cell, Slot& slot) {
        const Box3f& box = fragments_.boxes[reference.fragment];
        if (is_empty(intersect(box, wide_cell))) {
            return;
        }
        if (!by_box && !holds(slot.cell, box)) {
            if (reference.meets && !reference.home) {
                reference.meets = overlaps(widened(slot.cell), triangle_once(reference.fragment));
            }
            if (!reference.meets && !holds(wide_cell, box) &&
                !overlaps(widened(wide_cell), triangle_once(reference.fragment))) {
                return;
            }
        }
        slot.occupied = slot.occupied || reference.meets;
        slot.references.push_back(reference);
    }

    /// `triangle` of the reference that is being kept.
    const Triangle3d& triangle_once(std::uint32_t fragment) {
        if (!triangle_) {
            triangle_ = triangle(fragment);
        }
        return *triangle_;
    }

    /// Corners of a primitive relative to the origin.
    [[nodiscard]] Triangle3d triangle(std::uint32_t fragment) const {
        const std::size_t owner = fragments_.owner(fragment);
        Triangle3d corners =
            (*triangle_of_)(fragments_.objects[owner], fragment - fragments_.starts[owner]);
        for (glm::dvec3& corner : corners) {
            corner -= hierarchy_.origin;
        }
        return corners;
    }

    /// The slot that stands for a slot once what is empty is left out: an end, or one with contents
    /// on both sides.
    [[nodiscard]] std::size_t standing(std::size_t index) const noexcept {
        while (slots_.at(index).divided) {
            const bool behind = slots_.at(2 * index + 1).occupied;
            const bool front = slots_.at(2 * index + 2).occupied;
            if (behind && front) {
                break;
            }
            index = 2 * index + (behind ? 1 : 2);
        }
        return index;
    }

    /// Nodes of one image level, from the slots; cells at its end wait as tasks.
    void write_nodes(const Task& task, std::vector<Task>& tasks) {
        const std::size_t first_end = (std::size_t{1} << rules_.halvings) - 1;
        struct Place {
            std::size_t slot = 0;
            std::uint32_t node = 0;
        };
        double references = 0.0;
        for (std::size_t index = first_end; index <= 2 * first_end; ++index) {
            const Slot& end = slots_.at(index);
            references += end.occupied ? static_cast<double>(end.references.size()) : 0.0;
        }
        // Ends are met in front first: the last to be put on the stack is the first to be built.
        std::vector<Place> places{{standing(0), task.node}};
        while (!places.empty()) {
            const Place place = places.back();
            places.pop_back();
            const Slot& slot = slots_.at(place.slot);
            if (!slot.divided) {
                const std::vector<Reference>& own = slot.references;
                stack_.insert(stack_.end(), own.begin(), own.end());
                const auto count = static_cast<double>(own.size());
                const double share = own.empty() ? 0.0 : task.share * (count / references);
                tasks.push_back(
                    {place.node, task.level + 1, slot.cell, slot.items, own.size(), share}
                );
                continue;
            }
            mark_cut_items(slot);
            const auto first_child = static_cast<std::uint32_t>(hierarchy_.nodes.size());
            hierarchy_.nodes[place.node].first_child = first_child;
            hierarchy_.nodes[place.node].plane = slot.plane;
            for (std::uint32_t side = 0; side < 2; ++side) {
                const std::size_t child = standing(2 * place.slot + 1 + side);
                HierarchyNode node;
                node.parent = place.node;
                node.image_level = !slots_.at(child).divided;
                hierarchy_.nodes.push_back(node);
                places.push_back({child, first_child + side});
            }
        }
    }

    void mark_cut_items(const Slot& slot) {
        for (std::size_t index = slot.items.begin; index < slot.items.end; ++index) {
            const Extent extent = extent_along(slot.plane.normal, items_[index].box);
            if (extent.lower < slot.plane.offset && slot.plane.offset < extent.upper) {
                item_cut_[items_[index].object] = 1;
            }
        }
    }

    /// The leaf that slot 0 holds.
    void make_leaf(std::uint32_t index) {
        HierarchyNode& node = hierarchy_.nodes[index];
        const Slot& slot = slots_[0];
        node.first_item = static_cast<std::uint32_t>(hierarchy_.items.size());
        node.item_count = static_cast<std::uint32_t>(slot.items.size());
        node.item_primitives = item_primitives(slot.items);
        for (std::size_t position = slot.items.begin; position < slot.items.end; ++position) {
            const std::uint32_t object = items_[position].object;
            hierarchy_.items.push_back(make_id<ItemId>(object));
            node.items_box =
                unite(node.items_box, local_box(objects_[object].bounds, hierarchy_.origin));
        }
        std::sort(hierarchy_.items.begin() + node.first_item, hierarchy_.items.end());

        node.pieces_box = clipped_contents(slot);
        own_.clear();
        node.first_guest = static_cast<std::uint32_t>(guests_.size());
        for (const Reference& reference : slot.references) {
            // Guests of nothing but the rim of a cell without a surface are of no use.
            if (reference.home) {
                own_.push_back(reference.fragment);
            } else if (!is_empty(node.pieces_box)) {
                guests_.push_back(reference.fragment);
            }
        }
        node.guest_primitives = guests_.size() - node.first_guest;
        std::sort(own_.begin(), own_.end());
        order_.insert(order_.end(), own_.begin(), own_.end());
        append_pieces(fragments_, own_, node, hierarchy_);
        leaves_.push_back(index);
        ++hierarchy_.quality.leaves;
    }

    /// Box around what is inside a cell of the surfaces that meet it.
    [[nodiscard]] Box3f clipped_contents(const Slot& slot) const {
        Box3f inside;
        Box3f reach; // of boxes, for cells that are only touched, to within rounding
        for (const Reference& reference : slot.references) {
            if (!reference.meets) {
                continue;
            }
            const Box3f& box = fragments_.boxes[reference.fragment];
            const Box3f part = intersect(box, slot.cell);
            reach = unite(reach, part);
            if (triangle_of_ == nullptr || holds(slot.cell, box)) {
                inside = unite(inside, part);
                continue;
            }
            const Box3d clipped = clipped_bounds(widened(slot.cell), triangle(reference.fragment));
            if (!is_empty(clipped)) {
                inside = unite(inside, intersect(local_box(clipped, glm::dvec3(0.0)), part));
            }
        }
        return is_empty(inside) ? reach : inside;
    }

    /// Guests of every leaf as runs of the finished list of primitives.
    void write_guests() {
        std::vector<std::uint32_t> places(order_.size());
        for (std::size_t place = 0; place < order_.size(); ++place) {
            places[order_[place]] = static_cast<std::uint32_t>(place);
        }
        std::vector<std::uint32_t> own;
        for (const std::uint32_t leaf : leaves_) {
            HierarchyNode& node = hierarchy_.nodes[leaf];
            const auto first = guests_.begin() + node.first_guest;
            own.assign(first, first + static_cast<std::ptrdiff_t>(node.guest_primitives));
            std::transform(own.begin(), own.end(), own.begin(), [&](std::uint32_t fragment) {
                return places[fragment];
            });
            std::sort(own.begin(), own.end());
            node.first_guest = static_cast<std::uint32_t>(hierarchy_.guests.size());
            for (std::size_t index = 0; index < own.size();) {
                const std::size_t owner = fragments_.owner(order_[own[index]]);
                Piece run{make_id<ItemId>(fragments_.objects[owner]), own[index], 0};
                do {
                    ++run.count;
                    ++index;
                } while (index < own.size() && own[index] == run.first + run.count &&
                         fragments_.owner(order_[own[index]]) == owner);
                hierarchy_.guests.push_back(run);
            }
            node.guest_count =
                static_cast<std::uint32_t>(hierarchy_.guests.size()) - node.first_guest;
        }
        hierarchy_.guests.shrink_to_fit();
    }

    /// Of the leaves; those of other nodes are summed up.
    void write_whole_boxes() {
        hierarchy_.whole_pieces_boxes.resize(hierarchy_.nodes.size());
        std::uint32_t depth = 0;
        for (const std::uint32_t leaf : leaves_) {
            const HierarchyNode& node = hierarchy_.nodes[leaf];
            Box3f& box = hierarchy_.whole_pieces_boxes[leaf];
            if (node.piece_count > 0) {
                const std::uint32_t first = hierarchy_.pieces[node.first_piece].first;
                for (std::uint64_t place = 0; place < node.piece_primitives; ++place) {
                    box = unite(box, fragments_.boxes[order_[first + place]]);
                }
            }
            std::uint32_t ways = 0;
            for (std::uint32_t above = leaf; above != 0; above = hierarchy_.nodes[above].parent) {
                ++ways;
            }
            depth = std::max(depth, ways);
        }
        hierarchy_.quality.depth = depth;
    }

    std::span<const Object> objects_;
    const CellRules& rules_;
    const PrimitiveTriangle* triangle_of_; ///< null: boxes are all there is
    Hierarchy hierarchy_;
    Fragments fragments_;
    double touch_ = 0.0; ///< [m] what reaches across a plane by less only touches it

    std::vector<ItemEntry> items_;
    std::vector<ItemEntry> item_scratch_;
    std::vector<char> item_cut_; ///< by object; 1: some plane of the tree goes through it

    std::optional<Triangle3d> triangle_; ///< of the reference in hand, once it was needed
    std::vector<Reference> stack_;       ///< of the tasks, in their order
    std::array<Slot, kSlots> slots_;
    std::vector<std::uint32_t> leaves_; ///< nodes, in the order of the arrays
    std::vector<std::uint32_t> guests_; ///< fragments, leaf by leaf
    std::vector<std::uint32_t> order_;  ///< fragment of each of `Hierarchy::primitives`
    std::vector<std::uint32_t> own_;    ///< of the leaf in hand
};

} // namespace

Result<Hierarchy>
build_cells(std::span<const Object> objects, const CellRules& rules, const PrimitiveShape& shape) {
    if (auto checked = check_rules(rules); !checked) {
        return tl::unexpected(std::move(checked.error()));
    }
    if (auto checked = check_objects(objects, shape); !checked) {
        return tl::unexpected(std::move(checked.error()));
    }
    return CellBuilder(objects, rules, shape).build(shape);
}

} // namespace farfield::partition::detail
