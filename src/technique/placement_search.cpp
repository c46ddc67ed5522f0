// The search for a subset of cells of Aliaga, Lastra 1999, section 3.3.2, with one difference: a
// border that cannot be moved half way, since too little would be replaced, is tried by ever
// smaller steps, so that what is left comes as near to the target as cells allow.
#include "technique/placement_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace farfield {

namespace {

constexpr std::size_t kBorders = 5;

// In the order of preference at equal benefit.
constexpr std::size_t kNear = 0;
constexpr std::size_t kTop = 1;
constexpr std::size_t kBottom = 2;
constexpr std::size_t kRight = 3;
constexpr std::size_t kLeft = 4;

/// A place in each of the sorted lists of borders. A cell belongs to the subset if its place in
/// each list is at least that of the subset. Lists of right and top borders are sorted downwards,
/// so that a border moves inwards as its place grows.
using Places = std::array<std::uint16_t, kBorders>;

/// Ranks of cells in each list, with the values at each rank.
class RankedCells {
  public:
    explicit RankedCells(const SubsetTask& task) : task_(task) {
        rank(kNear, [](const SeenCell& cell) { return cell.near_depth; });
        rank(kTop, [](const SeenCell& cell) { return -cell.top; });
        rank(kBottom, [](const SeenCell& cell) { return cell.bottom; });
        rank(kRight, [](const SeenCell& cell) { return -cell.right; });
        rank(kLeft, [](const SeenCell& cell) { return cell.left; });
        primitives_.reserve(task.cells.size());
        for (const SeenCell& cell : task.cells) {
            primitives_.push_back(cell.primitives);
        }
    }

    /// Places that a border can take.
    [[nodiscard]] std::size_t places(std::size_t border) const noexcept {
        return values_[border].size();
    }

    [[nodiscard]] bool contains(const Places& subset, std::size_t cell) const noexcept {
        bool inside = true;
        for (std::size_t border = 0; border < kBorders; ++border) {
            inside = inside && ranks_[border][cell] >= subset[border];
        }
        return inside;
    }

    /// Primitives of a subset.
    [[nodiscard]] std::uint64_t count(const Places& subset) const noexcept {
        const std::size_t cells = primitives_.size();
        const std::uint16_t* const near = ranks_[kNear].data();
        const std::uint16_t* const top = ranks_[kTop].data();
        const std::uint16_t* const bottom = ranks_[kBottom].data();
        const std::uint16_t* const right = ranks_[kRight].data();
        const std::uint16_t* const left = ranks_[kLeft].data();
        std::uint64_t sum = 0;
        for (std::size_t i = 0; i < cells; ++i) {
            const unsigned inside = static_cast<unsigned>(near[i] >= subset[kNear]) &
                                    static_cast<unsigned>(top[i] >= subset[kTop]) &
                                    static_cast<unsigned>(bottom[i] >= subset[kBottom]) &
                                    static_cast<unsigned>(right[i] >= subset[kRight]) &
                                    static_cast<unsigned>(left[i] >= subset[kLeft]);
            sum += primitives_[i] & (0 - std::uint64_t{inside});
        }
        return sum;
    }

    /// What a subset with so many primitives is worth.
    [[nodiscard]] double benefit(const Places& subset, std::uint64_t replaced) const noexcept {
        const Lens& lens = task_.lens;
        const double px_x = task_.width / (lens.right - lens.left);
        const double px_y = task_.height / (lens.top - lens.bottom);
        const double left = std::max(values_[kLeft][subset[kLeft]], lens.left);
        const double right = std::min(-values_[kRight][subset[kRight]], lens.right);
        const double bottom = std::max(values_[kBottom][subset[kBottom]], lens.bottom);
        const double top = std::min(-values_[kTop][subset[kTop]], lens.top);
        Placement<double> placement;
        placement.drawn = task_.total - replaced;
        placement.total = task_.total;
        placement.image_width = std::max(right - left, 0.0) * px_x;
        placement.image_height = std::max(top - bottom, 0.0) * px_y;
        placement.screen_width = task_.width;
        placement.screen_height = task_.height;
        placement.depth = values_[kNear][subset[kNear]];
        placement.model_extent = task_.model_extent;
        return policy::placement_benefit_unchecked(placement, task_.weights).total;
    }

  private:
    template <typename ValueOf>
    void rank(std::size_t border, const ValueOf& value_of) {
        std::vector<double>& values = values_[border];
        values.reserve(task_.cells.size());
        for (const SeenCell& cell : task_.cells) {
            values.push_back(value_of(cell));
        }
        std::sort(values.begin(), values.end());
        values.erase(std::unique(values.begin(), values.end()), values.end());
        ranks_[border].reserve(task_.cells.size());
        for (const SeenCell& cell : task_.cells) {
            const auto place = std::lower_bound(values.begin(), values.end(), value_of(cell));
            ranks_[border].push_back(static_cast<std::uint16_t>(place - values.begin()));
        }
    }

    const SubsetTask& task_;
    std::array<std::vector<double>, kBorders> values_;
    std::array<std::vector<std::uint16_t>, kBorders> ranks_;
    std::vector<std::uint64_t> primitives_;
};

class Search {
  public:
    Search(const SubsetTask& task, const RankedCells& cells) : task_(task), cells_(cells) {}

    [[nodiscard]] Places run() const noexcept {
        Places now{};
        // Halvings after the first of each step.
        unsigned fineness = 0;
        while (fineness < kMostHalvings) {
            std::optional<std::size_t> best;
            double most = -1.0;
            for (std::size_t border = 0; border < kBorders; ++border) {
                const std::optional<Places> next = moved(now, border, fineness);
                if (next) {
                    const double benefit = ahead(*next, fineness, task_.lookahead - 1);
                    if (benefit > most) {
                        most = benefit;
                        best = border;
                    }
                }
            }
            if (best) {
                now = *moved(now, *best, fineness);
            } else {
                ++fineness;
            }
        }
        return now;
    }

  private:
    static constexpr unsigned kMostHalvings = 16; ///< places are 16 bits

    /// The subset with a border moved inwards, or none where it cannot be, or would leave too much.
    [[nodiscard]] std::optional<Places>
    moved(const Places& from, std::size_t border, unsigned fineness) const noexcept {
        const std::size_t room = cells_.places(border) - 1 - from[border];
        const std::size_t step = (room + 1) / 2 >> fineness;
        if (step == 0) {
            return std::nullopt;
        }
        Places to = from;
        to[border] = static_cast<std::uint16_t>(to[border] + step);
        if (!replaces_enough(cells_.count(to))) {
            return std::nullopt;
        }
        return to;
    }

    [[nodiscard]] bool replaces_enough(std::uint64_t replaced) const noexcept {
        return task_.total - replaced <= task_.target;
    }

    /// The largest benefit that some steps lead to; of the subset itself where none is possible.
    [[nodiscard]] double
    ahead(const Places& from, unsigned fineness, std::uint32_t steps) const noexcept {
        double most = -1.0;
        if (steps > 0) {
            for (std::size_t border = 0; border < kBorders; ++border) {
                const std::optional<Places> next = moved(from, border, fineness);
                if (next) {
                    most = std::max(most, ahead(*next, fineness, steps - 1));
                }
            }
        }
        return most >= 0.0 ? most : cells_.benefit(from, cells_.count(from));
    }

    const SubsetTask& task_;
    const RankedCells& cells_;
};

} // namespace

Subset search_subset(const SubsetTask& task) {
    const RankedCells cells(task);
    const Places places = Search(task, cells).run();
    Subset subset;
    for (std::size_t i = 0; i < task.cells.size(); ++i) {
        if (cells.contains(places, i)) {
            subset.cells.push_back(static_cast<std::uint32_t>(i));
            subset.primitives += task.cells[i].primitives;
        }
    }
    return subset;
}

} // namespace farfield
