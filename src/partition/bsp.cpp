// Shade, Lischinski, Salesin, DeRose, Snyder: Hierarchical Image Caching for Accelerated
// Walkthroughs of Complex Environments, SIGGRAPH 1996, section 4.
//
// Every node owns one range of each sorted list. A split marks the side of everything in the node,
// then parts all lists by a stable pass, which keeps them sorted; no list is sorted twice.
#include "partition/assembly.hpp"
#include "partition/checks.hpp"
#include "partition/gap.hpp"
#include "partition/item_tables.hpp"
#include <farfield/partition/bsp.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace farfield::partition {

namespace {

using detail::Entry;
using detail::Extent;
using detail::Gap;

template <typename Value>
tl::unexpected<Error> wrong(const char* option, Value value, const char* expected) {
    return fail(
        ErrorCode::invalid_argument,
        std::string("BspOptions: ") + option + " is " + detail::text(static_cast<double>(value)) +
            ", expected " + expected
    );
}

Result<void> check_options(const BspOptions& options) {
    if (options.directions < 1 || options.directions > 64) {
        return wrong("directions", options.directions, "1 to 64");
    }
    double longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(options.up[axis])) {
            return wrong("up", options.up[axis], "a finite vector");
        }
        longest = std::max(longest, std::abs(options.up[axis]));
    }
    if (longest == 0.0) {
        return wrong("up", longest, "a vector that is not zero");
    }
    if (!(options.inflation >= 0.0F && options.inflation <= 1.0F)) {
        return wrong("inflation", options.inflation, "a number in [0, 1]");
    }
    if (options.max_items < 1 || options.max_items > 1U << 20U) {
        return wrong("max_items", options.max_items, "1 to 2^20");
    }
    if (options.max_piece_primitives < 1) {
        return wrong("max_piece_primitives", options.max_piece_primitives, "at least 1");
    }
    if (options.max_depth > 64) {
        return wrong("max_depth", options.max_depth, "0 to 64");
    }
    if (!(options.balance_weight >= 0.0F) || !std::isfinite(options.balance_weight)) {
        return wrong("balance_weight", options.balance_weight, "a finite number from 0 on");
    }
    return {};
}

/// Unit vectors that evenly divide the half circle around `up`, then `up` itself where asked for.
/// The first is as near as can be to the world axis that is least parallel to `up`, so that an
/// upright scene gets x and z.
std::vector<glm::vec3> plane_normals(const BspOptions& options) {
    const glm::dvec3 magnitude = glm::abs(options.up);
    // Scaled first: the square of a very long or short vector is not a number that one can use.
    const glm::dvec3 up =
        glm::normalize(options.up / std::max(magnitude.x, std::max(magnitude.y, magnitude.z)));
    int least = 0;
    for (int axis = 1; axis < 3; ++axis) {
        least = std::abs(up[axis]) < std::abs(up[least]) ? axis : least;
    }
    glm::dvec3 axis(0.0);
    axis[least] = 1.0;
    const glm::dvec3 first = glm::normalize(axis - up * glm::dot(axis, up));
    const glm::dvec3 second = glm::cross(first, up);

    std::vector<glm::dvec3> directions;
    for (std::uint32_t index = 0; index < options.directions; ++index) {
        const double angle = std::numbers::pi * index / options.directions;
        directions.push_back(first * std::cos(angle) + second * std::sin(angle));
    }
    if (options.split_vertically) {
        directions.push_back(up);
    }
    std::vector<glm::vec3> normals;
    for (glm::dvec3& direction : directions) {
        // The cosine of a right angle is 6e-17 in floating point; left in, it would make the axes
        // oblique and the extents along them inexact.
        constexpr double kNoise = 1e-15;
        for (int component = 0; component < 3; ++component) {
            if (std::abs(direction[component]) < kNoise) {
                direction[component] = 0.0;
            }
        }
        normals.emplace_back(glm::normalize(direction));
    }
    return normals;
}

/// Place of a point on a Morton curve through a box, ten bits an axis.
std::uint32_t place_code(const glm::dvec3& point, const Box3d& box) noexcept {
    constexpr std::uint32_t kBits = 10;
    constexpr double kCells = 1U << kBits;
    std::uint32_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double size = box.hi[axis] - box.lo[axis];
        const double place = size > 0.0 ? (point[axis] - box.lo[axis]) / size : 0.0;
        const auto cell = static_cast<std::uint32_t>(std::clamp(place, 0.0, 1.0) * (kCells - 1.0));
        for (std::uint32_t bit = 0; bit < kBits; ++bit) {
            code |= ((cell >> bit) & 1U) << (3U * bit + static_cast<std::uint32_t>(axis));
        }
    }
    return code;
}

/// A range of the sorted lists.
struct Range {
    std::size_t begin = 0;
    std::size_t end = 0;

    [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
};

std::span<const Entry> part(const std::vector<Entry>& list, const Range& range) noexcept {
    return std::span(list).subspan(range.begin, range.size());
}

/// A node that waits to be split or to become a leaf.
struct Task {
    std::uint32_t node = 0;
    std::uint32_t depth = 0;
    Range items;
    Range fragments;
    double item_weight = 0.0; ///< sum over the items
};

/// Where a node is split.
struct Split {
    std::size_t direction = 0;
    float offset = 0.0F;
};

class BspBuilder {
  public:
    BspBuilder(std::span<const Object> objects, const BspOptions& options)
        : objects_(objects), options_(options) {}

    Result<Hierarchy> build(const PrimitiveBounds& primitive_bounds) {
        gather_items();
        if (auto gathered = gather_fragments(primitive_bounds); !gathered) {
            return tl::unexpected(std::move(gathered.error()));
        }
        sort_lists();
        grow();
        detail::sum_up(hierarchy_, objects_.size());
        hierarchy_.quality.cut_items =
            static_cast<std::uint32_t>(std::count(item_cut_.begin(), item_cut_.end(), char{1}));
        detail::fill_item_tables(hierarchy_, objects_);
        return std::move(hierarchy_);
    }

  private:
    /// Everything that is sorted along one plane normal.
    struct Direction {
        glm::vec3 normal{0.0F};
        std::vector<Entry> lowers;
        std::vector<Entry> uppers;
        std::vector<Entry> fragments;
    };

    void gather_items() {
        Box3d everything;
        std::size_t items = 0;
        for (const Object& object : objects_) {
            everything = unite(everything, object.bounds);
            items += object.splittable ? 0U : 1U;
        }
        if (!objects_.empty()) {
            hierarchy_.origin = center(everything);
        }
        hierarchy_.inflation = options_.inflation;
        hierarchy_.items.reserve(items);
        // Items are numbered along a space-filling curve: what a node holds then lies in few
        // stretches of memory. A million boxes in random order take a quarter longer without this.
        std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
        order.reserve(items);
        for (std::size_t index = 0; index < objects_.size(); ++index) {
            if (!objects_[index].splittable) {
                order.emplace_back(
                    place_code(center(objects_[index].bounds), everything),
                    static_cast<std::uint32_t>(index)
                );
            }
        }
        std::sort(order.begin(), order.end());
        item_objects_.reserve(items);
        item_boxes_.reserve(items);
        weights_.reserve(items);
        for (const auto& [code, index] : order) {
            const Object& object = objects_[index];
            item_objects_.push_back(index);
            // Rounded to nearest, not outwards: boxes that touch in the world still touch.
            item_boxes_.push_back(
                {local_point(object.bounds.lo, hierarchy_.origin),
                 local_point(object.bounds.hi, hierarchy_.origin)}
            );
            // One more for the draw call; it also keeps the balance defined for empty objects.
            weights_.push_back(static_cast<float>(object.primitives) + 1.0F);
        }
    }

    Result<void> gather_fragments(const PrimitiveBounds& primitive_bounds) {
        auto gathered = detail::gather_fragments(objects_, primitive_bounds, hierarchy_.origin);
        if (!gathered) {
            return tl::unexpected(std::move(gathered.error()));
        }
        fragments_ = std::move(*gathered);
        for (const glm::vec3& normal : plane_normals(options_)) {
            Direction& direction = directions_.emplace_back();
            direction.normal = normal;
            direction.fragments.reserve(fragments_.middles.size());
            for (std::uint32_t fragment = 0; fragment < fragments_.middles.size(); ++fragment) {
                direction.fragments.push_back(
                    {glm::dot(normal, fragments_.middles[fragment]), fragment}
                );
            }
        }
        fragments_.middles = {}; // told by the lists from here on
        return {};
    }

    void sort_lists() {
        const std::size_t items = item_boxes_.size();
        for (Direction& direction : directions_) {
            direction.lowers.reserve(items);
            direction.uppers.reserve(items);
            for (std::uint32_t item = 0; item < items; ++item) {
                const Extent extent = detail::extent_along(direction.normal, item_boxes_[item]);
                direction.lowers.push_back({extent.lower, item});
                direction.uppers.push_back({extent.upper, item});
            }
            std::sort(direction.lowers.begin(), direction.lowers.end());
            std::sort(direction.uppers.begin(), direction.uppers.end());
            std::sort(direction.fragments.begin(), direction.fragments.end());
        }
        item_sides_.resize(items);
        item_cut_.resize(items);
        fragment_sides_.resize(fragments_.boxes.size());
        hierarchy_.primitives.reserve(fragments_.boxes.size());
        constexpr std::size_t kBlock = Hierarchy::kBlockPrimitives;
        hierarchy_.block_boxes.reserve((fragments_.boxes.size() + kBlock - 1) / kBlock);
        scratch_.resize(std::max(items, fragments_.boxes.size()));
    }

    /// Splits nodes until all are leaves, depth first and child 0 first: leaves come out in the
    /// order of the arrays.
    void grow() {
        Task root{0, 0, {0, item_boxes_.size()}, {0, fragments_.boxes.size()}, 0.0};
        for (const float weight : weights_) {
            root.item_weight += static_cast<double>(weight);
        }
        hierarchy_.nodes.emplace_back();
        std::vector<Task> tasks{root};
        while (!tasks.empty()) {
            const Task task = tasks.back();
            tasks.pop_back();
            hierarchy_.quality.depth = std::max(hierarchy_.quality.depth, task.depth);
            if (const std::optional<Split> split = choose_split(task)) {
                const auto [behind, front] = apply(task, *split);
                tasks.push_back(front);
                tasks.push_back(behind);
            } else {
                make_leaf(task);
            }
        }
    }

    [[nodiscard]] detail::SortedContents
    contents(const Task& task, const Direction& direction) const noexcept {
        return {
            part(direction.lowers, task.items),
            part(direction.uppers, task.items),
            part(direction.fragments, task.fragments)};
    }

    /// Most items that a child may keep. A tree that only peels off outliers is deep and finds
    /// nothing: each node may spend twice the levels that halving needs, plus a few.
    [[nodiscard]] double max_side(std::uint32_t child_depth) const noexcept {
        constexpr double kSpareLevels = 8.0;
        const double leaf = options_.max_items;
        const double halvings =
            std::log2(std::max(static_cast<double>(weights_.size()) / leaf, 1.0));
        const double left = 2.0 * halvings + kSpareLevels - child_depth;
        return leaf * std::exp2(std::max(left, 0.0) / 2.0);
    }

    /// No value: the node is a leaf.
    [[nodiscard]] std::optional<Split> choose_split(const Task& task) {
        const bool many_items = task.items.size() > options_.max_items;
        const bool many_fragments = task.fragments.size() > options_.max_piece_primitives;
        const bool too_large = many_items || many_fragments;
        if (task.depth >= options_.max_depth || (task.items.size() <= 1 && !too_large)) {
            return std::nullopt;
        }

        lengths_.clear();
        for (const Direction& direction : directions_) {
            lengths_.push_back(detail::length(contents(task, direction)));
        }
        const float longest = *std::max_element(lengths_.begin(), lengths_.end());
        if (longest == 0.0F) {
            return std::nullopt;
        }
        detail::GapRules rules;
        rules.weights = weights_;
        rules.item_weight = task.item_weight;
        rules.balance_weight = static_cast<double>(options_.balance_weight);
        rules.max_side = max_side(task.depth + 1);
        rules.must_not_cut = !too_large;
        rules.between_fragments = many_fragments;
        Gap best;
        Split split;
        for (std::size_t index = 0; index < directions_.size(); ++index) {
            rules.shape_penalty =
                rules.balance_weight * static_cast<double>(1.0F - lengths_[index] / longest);
            const Gap gap = detail::best_gap(contents(task, directions_[index]), rules);
            if (gap.found && (!best.found || gap.cost < best.cost)) {
                best = gap;
                split = {index, gap.offset};
            }
        }
        if (best.found) {
            return split;
        }
        return too_large ? halve(task, many_items, many_fragments) : std::nullopt;
    }

    /// Through the median, along the longest direction that tells the contents apart.
    [[nodiscard]] std::optional<Split>
    halve(const Task& task, bool many_items, bool many_fragments) {
        std::vector<std::size_t> order(directions_.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
            return lengths_[a] > lengths_[b];
        });
        if (many_items) {
            std::vector<Entry> middles(task.items.size());
            for (const std::size_t index : order) {
                const Direction& direction = directions_[index];
                const auto to_middle = [&](const Entry& entry) -> Entry {
                    const Box3f& box = item_boxes_[entry.index];
                    return {
                        detail::middle(detail::extent_along(direction.normal, box)), entry.index};
                };
                const auto lowers = part(direction.lowers, task.items);
                std::transform(lowers.begin(), lowers.end(), middles.begin(), to_middle);
                std::sort(middles.begin(), middles.end());
                if (const Gap gap = detail::median_gap(middles); gap.found) {
                    return Split{index, gap.offset};
                }
            }
        }
        if (many_fragments) {
            for (const std::size_t index : order) {
                const auto fragments = part(directions_[index].fragments, task.fragments);
                if (const Gap gap = detail::median_gap(fragments); gap.found) {
                    return Split{index, gap.offset};
                }
            }
        }
        return std::nullopt;
    }

    /// Moves what is behind before what is in front, order kept on both sides. Both places are
    /// written each time and one of them counts: a branch here would be guessed wrong half the
    /// time.
    void part_list(std::vector<Entry>& list, const Range& range, const std::vector<char>& sides) {
        std::size_t behind = range.begin;
        std::size_t front = 0;
        for (std::size_t position = range.begin; position < range.end; ++position) {
            const Entry entry = list[position];
            const bool in_front = sides[entry.index] != 0;
            list[behind] = entry;
            scratch_[front] = entry;
            behind += in_front ? 0U : 1U;
            front += in_front ? 1U : 0U;
        }
        std::copy_n(scratch_.begin(), front, list.begin() + static_cast<std::ptrdiff_t>(behind));
    }

    std::pair<Task, Task> apply(const Task& task, const Split& split) {
        const Direction& chosen = directions_[split.direction];
        std::size_t behind_items = 0;
        double behind_weight = 0.0;
        double front_weight = 0.0; // summed, not subtracted: one heavy item would swallow the rest
        for (const Entry& entry : part(chosen.lowers, task.items)) {
            const Extent extent = detail::extent_along(chosen.normal, item_boxes_[entry.index]);
            const bool behind = detail::middle(extent) < split.offset;
            item_sides_[entry.index] = behind ? 0 : 1;
            if (extent.lower < split.offset && split.offset < extent.upper) {
                item_cut_[entry.index] = 1;
            }
            behind_items += behind ? 1U : 0U;
            (behind ? behind_weight : front_weight) += static_cast<double>(weights_[entry.index]);
        }
        std::size_t behind_fragments = 0;
        for (const Entry& entry : part(chosen.fragments, task.fragments)) {
            const bool behind = entry.value < split.offset;
            fragment_sides_[entry.index] = behind ? 0 : 1;
            behind_fragments += behind ? 1U : 0U;
        }
        for (Direction& direction : directions_) {
            part_list(direction.lowers, task.items, item_sides_);
            part_list(direction.uppers, task.items, item_sides_);
            part_list(direction.fragments, task.fragments, fragment_sides_);
        }

        const auto first_child = static_cast<std::uint32_t>(hierarchy_.nodes.size());
        HierarchyNode& node = hierarchy_.nodes[task.node];
        node.first_child = first_child;
        node.plane = {chosen.normal, split.offset + 0.0F}; // no negative zero: one plane, one form
        HierarchyNode child;
        child.parent = task.node;
        hierarchy_.nodes.insert(hierarchy_.nodes.end(), 2, child);
        const std::size_t items_middle = task.items.begin + behind_items;
        const std::size_t fragments_middle = task.fragments.begin + behind_fragments;
        return {
            Task{
                first_child,
                task.depth + 1,
                {task.items.begin, items_middle},
                {task.fragments.begin, fragments_middle},
                behind_weight},
            Task{
                first_child + 1,
                task.depth + 1,
                {items_middle, task.items.end},
                {fragments_middle, task.fragments.end},
                front_weight}};
    }

    void make_leaf(const Task& task) {
        HierarchyNode& node = hierarchy_.nodes[task.node];
        node.first_item = static_cast<std::uint32_t>(hierarchy_.items.size());
        node.item_count = static_cast<std::uint32_t>(task.items.size());
        for (const Entry& entry : part(directions_.front().lowers, task.items)) {
            const std::uint32_t index = item_objects_[entry.index];
            hierarchy_.items.push_back(make_id<ItemId>(index));
            node.item_primitives += objects_[index].primitives;
            node.items_box =
                unite(node.items_box, local_box(objects_[index].bounds, hierarchy_.origin));
        }
        std::sort(hierarchy_.items.begin() + node.first_item, hierarchy_.items.end());

        scratch_indices_.clear();
        for (const Entry& entry : part(directions_.front().fragments, task.fragments)) {
            scratch_indices_.push_back(entry.index);
            node.pieces_box = unite(node.pieces_box, fragments_.boxes[entry.index]);
        }
        std::sort(scratch_indices_.begin(), scratch_indices_.end());
        detail::append_pieces(fragments_, scratch_indices_, node, hierarchy_);
        ++hierarchy_.quality.leaves;
    }

    std::span<const Object> objects_;
    const BspOptions& options_;
    Hierarchy hierarchy_;
    std::vector<Direction> directions_;
    std::vector<float> lengths_; ///< of the node in hand, by direction

    // Whole items, by their place among the whole items.
    std::vector<std::uint32_t> item_objects_;
    std::vector<Box3f> item_boxes_;
    std::vector<float> weights_;
    std::vector<char> item_sides_; ///< 0 behind, 1 in front of the plane in hand
    std::vector<char> item_cut_;   ///< 1: some plane goes through it

    detail::Fragments fragments_;
    std::vector<char> fragment_sides_;

    std::vector<Entry> scratch_;
    std::vector<std::uint32_t> scratch_indices_;
};

} // namespace

Result<Hierarchy> build_bsp(
    std::span<const Object> objects,
    const BspOptions& options,
    const PrimitiveBounds& primitive_bounds
) {
    if (auto checked = check_options(options); !checked) {
        return tl::unexpected(std::move(checked.error()));
    }
    if (auto checked = detail::check_objects(objects, primitive_bounds); !checked) {
        return tl::unexpected(std::move(checked.error()));
    }
    return BspBuilder(objects, options).build(primitive_bounds);
}

} // namespace farfield::partition
