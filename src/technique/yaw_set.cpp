#include "technique/yaw_set.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farfield {

namespace {

constexpr double kPi = std::numbers::pi;
/// [rad] Far more than `atan2` and `acos` round where the answer is not on an end of its range;
/// there the callers' own margins count, which are lengths.
constexpr double kMargin = 1e-9;

} // namespace

YawSet YawSet::full() noexcept {
    YawSet set;
    set.arcs_[0] = {-kPi, kPi};
    set.count_ = 1;
    return set;
}

void YawSet::add(double a, double b, double c) noexcept {
    const double amplitude = std::hypot(a, b);
    if (c >= amplitude) {
        *this = full();
        return;
    }
    if (c < -amplitude) {
        return;
    }
    const double middle = std::atan2(b, a);
    const double half = std::acos(-c / amplitude) + kMargin;
    if (half >= kPi) {
        *this = full();
        return;
    }
    const double from = middle - half;
    const double to = middle + half;
    if (from < -kPi) {
        add({from + 2.0 * kPi, kPi});
        add({-kPi, std::min(to, kPi)});
    } else if (to > kPi) {
        add({from, kPi});
        add({-kPi, to - 2.0 * kPi});
    } else {
        add({from, to});
    }
}

void YawSet::add(const YawArc& arc) noexcept {
    // All that touch the new arc become one with it.
    YawArc joined = arc;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
        const YawArc& old = arcs_[i];
        if (old.to < joined.from || old.from > joined.to) {
            arcs_[kept++] = old;
        } else {
            joined = {std::min(joined.from, old.from), std::max(joined.to, old.to)};
        }
    }
    std::size_t place = 0;
    while (place < kept && arcs_[place].from < joined.from) {
        ++place;
    }
    if (kept == arcs_.size()) {
        // No room: the gap before the new arc goes.
        YawArc& neighbour = arcs_[place == 0 ? 0 : place - 1];
        neighbour = {std::min(neighbour.from, joined.from), std::max(neighbour.to, joined.to)};
        count_ = kept;
        return;
    }
    std::copy_backward(
        arcs_.begin() + static_cast<std::ptrdiff_t>(place),
        arcs_.begin() + static_cast<std::ptrdiff_t>(kept),
        arcs_.begin() + static_cast<std::ptrdiff_t>(kept) + 1
    );
    arcs_[place] = joined;
    count_ = kept + 1;
}

void YawSet::intersect(const YawSet& other) noexcept {
    YawSet both;
    std::size_t i = 0;
    std::size_t j = 0;
    while (i < count_ && j < other.count_) {
        const YawArc& mine = arcs_[i];
        const YawArc& its = other.arcs_[j];
        const YawArc common{std::max(mine.from, its.from), std::min(mine.to, its.to)};
        if (common.from <= common.to) {
            both.add(common);
        }
        if (mine.to < its.to) {
            ++i;
        } else {
            ++j;
        }
    }
    *this = both;
}

} // namespace farfield
