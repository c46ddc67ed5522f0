#include "plot_axis.hpp"

#include "page_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace farfield::eval::detail {

namespace {

constexpr std::array<double, 3> kSteps = {1.0, 2.0, 5.0};

/// A round value of a logarithmic axis: a step times a power of ten.
struct RoundValue {
    int decade = 0;
    std::size_t step = 0;

    [[nodiscard]] double log10() const noexcept { return decade + std::log10(kSteps[step]); }

    [[nodiscard]] RoundValue above() const noexcept {
        return step + 1 < kSteps.size() ? RoundValue{decade, step + 1} : RoundValue{decade + 1, 0};
    }

    [[nodiscard]] RoundValue below() const noexcept {
        return step > 0 ? RoundValue{decade, step - 1} : RoundValue{decade - 1, kSteps.size() - 1};
    }

    [[nodiscard]] std::string label() const {
        constexpr int kFewDigits = 5;
        constexpr int kMillion = 6;
        if (decade >= kMillion && decade < kMillion + 3) {
            return tick_text(kSteps[step] * std::pow(10.0, decade - kMillion)) + " M";
        }
        if (decade < -kFewDigits || decade > kFewDigits) {
            return fixed_text(kSteps[step], 0) + "e" + std::to_string(decade);
        }
        return tick_text(kSteps[step] * std::pow(10.0, decade));
    }
};

} // namespace

Axis::Axis(PlotScale scale, std::span<const double> values)
    : logarithmic_(scale == PlotScale::logarithmic) {
    double least = std::numeric_limits<double>::infinity();
    double most = 0.0;
    for (const double value : values) {
        if (has_place(scale, value)) {
            least = std::min(least, value);
            most = std::max(most, value);
        }
    }
    if (logarithmic_) {
        fit_logarithmic(most > 0.0 ? least : 1.0, most > 0.0 ? most : 1.0);
    } else {
        fit_linear(most, scale == PlotScale::linear_tight);
    }
}

bool Axis::has_place(PlotScale scale, double value) noexcept {
    return std::isfinite(value) && (scale == PlotScale::logarithmic ? value > 0.0 : value >= 0.0);
}

double Axis::share(double value) const noexcept {
    const double place = logarithmic_ ? std::log10(value) : value;
    return std::clamp((place - low_) / (high_ - low_), 0.0, 1.0);
}

void Axis::fit_linear(double most, bool tight) {
    // Beyond these a step could be lost to underflow or overflow; no figure comes near them.
    constexpr double kSmallest = 1e-290;
    constexpr double kLargest = 1e290;
    if (most < kSmallest || most > kLargest) {
        high_ = most < kSmallest ? 1.0 : most;
        ticks_ = {{0.0, "0"}, {1.0, tick_text(high_)}};
        return;
    }
    constexpr double kLeastTicks = 4.0;
    const double decade = std::pow(10.0, std::floor(std::log10(most / kLeastTicks)));
    double step = decade;
    for (const double factor : kSteps) {
        if (kLeastTicks * factor * decade <= most) {
            step = factor * decade;
        }
    }
    // Rounding must not add a step to a value that is a multiple of it already.
    constexpr double kSlack = 1e-9;
    high_ = tight ? most : std::ceil(most / step - kSlack) * step;
    high_ = std::max(high_, most);
    for (int index = 0; index * step <= high_ * (1.0 + kSlack); ++index) {
        ticks_.push_back({share(index * step), tick_text(index * step)});
    }
}

void Axis::fit_logarithmic(double least, double most) {
    // A value that is round itself may lie a rounding beside its logarithm.
    constexpr double kSlack = 1e-9;
    RoundValue first{static_cast<int>(std::floor(std::log10(least))), 0};
    while (first.above().log10() <= std::log10(least) + kSlack) {
        first = first.above();
    }
    RoundValue last{static_cast<int>(std::floor(std::log10(most))), 0};
    while (last.log10() < std::log10(most) - kSlack) {
        last = last.above();
    }
    if (last.log10() <= first.log10()) {
        first = first.below();
        last = last.above();
    }
    low_ = first.log10();
    high_ = last.log10();
    constexpr int kMostTicks = 9;
    constexpr double kFineDecades = 3.0;
    const bool fine = high_ - low_ <= kFineDecades;
    const int every = std::max(1, (last.decade - first.decade + kMostTicks) / kMostTicks);
    for (RoundValue value = first; value.log10() <= high_ + kSlack; value = value.above()) {
        if (fine || (value.step == 0 && (value.decade - first.decade) % every == 0)) {
            ticks_.push_back({(value.log10() - low_) / (high_ - low_), value.label()});
        }
    }
}

} // namespace farfield::eval::detail
