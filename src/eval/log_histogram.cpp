#include <farfield/core/assert.hpp>
#include <farfield/eval/log_histogram.hpp>

#include <algorithm>
#include <cmath>

namespace farfield {

namespace {

std::size_t bin_of(double value) noexcept {
    if (value < std::ldexp(1.0, LogHistogram::kFirstExponent)) {
        return 0;
    }
    if (value >= std::ldexp(1.0, LogHistogram::kLastExponent)) {
        return LogHistogram::kBins - 1;
    }
    int exponent = 0;
    const double half_to_one = std::frexp(value, &exponent); // value is this times 2^exponent
    constexpr std::size_t kPerOctave = LogHistogram::kBinsPerOctave;
    const auto octave = static_cast<std::size_t>(exponent - 1 - LogHistogram::kFirstExponent);
    const auto within = static_cast<std::size_t>((2.0 * half_to_one - 1.0) * kPerOctave);
    return 1 + octave * kPerOctave + within;
}

} // namespace

void LogHistogram::add(double value) {
    FARFIELD_ASSERT(value >= 0.0);
    bins_.resize(kBins);
    ++bins_[bin_of(value)];
    ++count_;
    max_ = std::max(max_, value);
}

void LogHistogram::add(const LogHistogram& other) {
    if (other.count_ == 0) {
        return;
    }
    bins_.resize(kBins);
    for (std::size_t bin = 0; bin < kBins; ++bin) {
        bins_[bin] += other.bins_[bin];
    }
    count_ += other.count_;
    max_ = std::max(max_, other.max_);
}

std::optional<double> LogHistogram::max() const noexcept {
    return count_ == 0 ? std::nullopt : std::optional(max_);
}

double LogHistogram::lower_edge(std::size_t bin) noexcept {
    FARFIELD_ASSERT(bin < kBins);
    if (bin == 0) {
        return 0.0;
    }
    const int steps = static_cast<int>(bin) - 1;
    const double within = static_cast<double>(steps % kBinsPerOctave) / kBinsPerOctave;
    return std::ldexp(1.0 + within, kFirstExponent + steps / kBinsPerOctave);
}

/// The sample of a rank as far as the bins tell: those of one bin are taken to lie evenly in it.
double LogHistogram::sample(std::uint64_t rank) const noexcept {
    std::size_t bin = 0;
    while (rank >= bins_[bin]) {
        rank -= bins_[bin];
        ++bin;
    }
    if (bin == kBins - 1) {
        return max_;
    }
    const double share = (static_cast<double>(rank) + 0.5) / static_cast<double>(bins_[bin]);
    const double low = lower_edge(bin);
    return std::min(low + share * (lower_edge(bin + 1) - low), max_);
}

std::optional<double> LogHistogram::percentile(double fraction) const noexcept {
    FARFIELD_ASSERT(fraction >= 0.0 && fraction <= 1.0);
    if (count_ == 0) {
        return std::nullopt;
    }
    const double position = fraction * static_cast<double>(count_ - 1);
    const double rank = std::floor(position);
    const double low = sample(static_cast<std::uint64_t>(rank));
    const double weight = position - rank;
    if (weight == 0.0) {
        return low; // the next sample may be infinite, or not exist
    }
    return (1.0 - weight) * low + weight * sample(static_cast<std::uint64_t>(rank) + 1);
}

} // namespace farfield
