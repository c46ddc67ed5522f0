#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace farfield {

/// Counts of numbers from 0 up, in bins that grow with the number: percentiles of any number of
/// samples in 25 KB.
///
/// The first bin is [0, 1/1024); then every octave up to 16384 has 128 bins of equal width; the
/// last bin is [16384, infinity]. So a bin in between is at most 1/128 of the numbers in it wide.
class LogHistogram {
  public:
    static constexpr int kBinsPerOctave = 128;
    static constexpr int kFirstExponent = -10; ///< of the end of the first bin, a power of 2
    static constexpr int kLastExponent = 14;   ///< of the beginning of the last bin
    static constexpr std::size_t kBins =
        2 + static_cast<std::size_t>((kLastExponent - kFirstExponent) * kBinsPerOctave);

    /// @param value >= 0; infinity is a value like others
    void add(double value);

    /// All samples of another one.
    void add(const LogHistogram& other);

    [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

    /// Largest sample, exactly; none without samples.
    [[nodiscard]] std::optional<double> max() const noexcept;

    /// What `eval::percentile` says of the samples, to within the width of a bin; beyond 16384 it
    /// is the largest sample. None without samples.
    /// @param fraction [0, 1]
    [[nodiscard]] std::optional<double> percentile(double fraction) const noexcept;

    /// Samples of each bin: `kBins` of them, or none before the first sample.
    [[nodiscard]] std::span<const std::uint64_t> bins() const noexcept { return bins_; }

    /// Where a bin begins; it ends where the next one begins. @pre bin < kBins
    [[nodiscard]] static double lower_edge(std::size_t bin) noexcept;

    friend bool operator==(const LogHistogram&, const LogHistogram&) = default;

  private:
    [[nodiscard]] double sample(std::uint64_t rank) const noexcept;

    std::vector<std::uint64_t> bins_;
    std::uint64_t count_ = 0;
    double max_ = 0.0;
};

} // namespace farfield
