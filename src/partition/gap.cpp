#include "partition/gap.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace farfield::partition::detail {

namespace {

/// Keeps the better of two gaps, judges one after the other.
class Judge {
  public:
    Judge(const SortedContents& contents, const GapRules& rules) noexcept
        : rules_(rules), fragments_(contents.fragments),
          items_(static_cast<double>(contents.lowers.size())),
          total_(rules.item_weight + static_cast<double>(contents.fragments.size())) {}

    /// A plane with `behind_count` items of weight `behind_weight` behind it, active ones by half.
    void consider(float offset, double active, double behind_count, double behind_weight) noexcept {
        if (rules_.must_not_cut && active > 0.0) {
            return;
        }
        if (std::max(behind_count, items_ - behind_count) > rules_.max_side) {
            return;
        }
        const double behind = behind_weight + static_cast<double>(fragments_before(offset));
        const double imbalance = 2.0 * behind / total_ - 1.0;
        const double cost =
            active / items_ + rules_.balance_weight * imbalance * imbalance + rules_.shape_penalty;
        if (!best_.found || cost < best_.cost) {
            best_ = {cost, offset, true};
        }
    }

    [[nodiscard]] const Gap& best() const noexcept { return best_; }

  private:
    /// Offsets come in ascending order: one walk over the fragments serves all gaps.
    [[nodiscard]] std::size_t fragments_before(float offset) noexcept {
        while (passed_ < fragments_.size() && fragments_[passed_].value < offset) {
            ++passed_;
        }
        return passed_;
    }

    const GapRules& rules_;
    std::span<const Entry> fragments_;
    double items_;
    double total_;
    std::size_t passed_ = 0;
    Gap best_;
};

} // namespace

float length(const SortedContents& contents) noexcept {
    float low = std::numeric_limits<float>::infinity();
    float high = -low;
    if (!contents.lowers.empty()) {
        low = contents.lowers.front().value;
        high = contents.uppers.back().value;
    }
    if (!contents.fragments.empty()) {
        low = std::min(low, contents.fragments.front().value);
        high = std::max(high, contents.fragments.back().value);
    }
    return low < high ? high - low : 0.0F;
}

Gap best_gap(const SortedContents& contents, const GapRules& rules) noexcept {
    const std::span<const Entry> lowers = contents.lowers;
    const std::span<const Entry> uppers = contents.uppers;
    const std::span<const Entry> fragments = contents.fragments;
    if (lowers.empty()) {
        return {};
    }
    Judge judge(contents, rules);
    const bool beside = rules.between_fragments && !fragments.empty();
    if (const float first = lowers.front().value; beside && fragments.front().value < first) {
        const float half = fragments[fragments.size() / 2].value;
        judge.consider(half > fragments.front().value ? std::min(half, first) : first, 0.0, 0, 0);
    }

    double started_weight = 0.0;
    double ended_weight = 0.0;
    std::size_t ended = 0;
    bool falling = false;
    for (std::size_t started = 0; started < lowers.size();) {
        // Ends before starts: boxes that touch leave a gap of no width between them.
        if (uppers[ended].value <= lowers[started].value) {
            ended_weight += static_cast<double>(rules.weights[uppers[ended].index]);
            ++ended;
            falling = true;
            continue;
        }
        if (falling) {
            judge.consider(
                halfway(uppers[ended - 1].value, lowers[started].value),
                static_cast<double>(started - ended),
                0.5 * static_cast<double>(started + ended),
                0.5 * (started_weight + ended_weight)
            );
        }
        started_weight += static_cast<double>(rules.weights[lowers[started].index]);
        ++started;
        falling = false;
    }

    if (const float last = uppers.back().value; beside && fragments.back().value >= last) {
        const float half = fragments[fragments.size() / 2].value;
        judge.consider(
            std::max(half, last), 0.0, static_cast<double>(lowers.size()), rules.item_weight
        );
    }
    return judge.best();
}

Gap median_gap(std::span<const Entry> sorted) noexcept {
    if (sorted.empty() || !(sorted.front().value < sorted.back().value)) {
        return {};
    }
    const float half = sorted[sorted.size() / 2].value;
    const auto less = [](const Entry& a, const Entry& b) { return a.value < b.value; };
    const auto equal = std::equal_range(sorted.begin(), sorted.end(), Entry{half, 0}, less);
    // Equal values stay together: the plane goes before or behind their run, nearer the middle.
    const auto before = equal.first - sorted.begin();
    const auto after = sorted.end() - equal.second;
    const bool front = equal.first == sorted.begin() || (after > 0 && after > before);
    return {0.0, front ? equal.second->value : half, true};
}

} // namespace farfield::partition::detail
