#pragma once

#include "support/golden.hpp"
#include <farfield/metric/outcome.hpp>

#include <cstddef>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// One check for each kind of golden file: the metric that it is for, held against its rows within
/// the limits that tests/golden/README.md names.
namespace farfield::golden {

using Real = long double;

template <typename T>
inline constexpr Real kRoundoff = std::numeric_limits<T>::epsilon() / 2;

/// Relative errors of one quantity over the random rows, in units of rounding.
struct Errors {
    std::vector<Real> stable;
    std::vector<Real> naive; ///< of the naive form, where there is one
};

/// What a file's rows came to in one precision.
class Tally {
  public:
    /// Begins a row; what follows is about it.
    void begin(const support::GoldenRow& row) {
        row_ = &row;
        ++rows_;
    }
    /// A row whose inputs are not exact in this precision.
    void skip() { ++skipped_; }

    /// The outcome must be that of the row. @return true where the row's outputs are to be compared
    bool outcome(MetricOutcome outcome);
    /// |value - expected| <= limit, or both infinite.
    void near(std::string_view what, Real value, Real expected, Real limit);
    void holds(bool condition, std::string_view what);
    /// Remembers relative errors of a random row with a result above 0. @param unit of rounding
    void compare(const std::string& quantity, Real expected, Real unit, Real stable);
    void compare(const std::string& quantity, Real expected, Real unit, Real stable, Real naive);
    /// Remembers the ratio of a bound and what it bounds, over random rows.
    void ratio(const std::string& quantity, Real ratio);

    [[nodiscard]] int rows() const { return rows_; }
    [[nodiscard]] int skipped() const { return skipped_; }
    /// Of rows, not of comparisons.
    [[nodiscard]] std::size_t failed_rows() const { return failed_.size(); }
    /// One line for each failed row.
    [[nodiscard]] const std::vector<std::string>& failures() const { return failed_; }
    /// Largest error in units of its limit.
    [[nodiscard]] Real worst() const { return worst_; }
    [[nodiscard]] const std::string& worst_at() const { return worst_at_; }
    [[nodiscard]] const std::map<std::string, Errors>& errors() const { return errors_; }
    [[nodiscard]] const std::map<std::string, std::vector<Real>>& ratios() const { return ratios_; }

  private:
    void fail(const std::string& what);

    const support::GoldenRow* row_ = nullptr;
    const support::GoldenRow* last_failed_ = nullptr;
    int rows_ = 0;
    int skipped_ = 0;
    std::vector<std::string> failed_;
    Real worst_ = 0;
    std::string worst_at_;
    std::map<std::string, Errors> errors_;
    std::map<std::string, std::vector<Real>> ratios_;
};

/// How one kind of file is checked.
struct FileCheck {
    std::string_view name; ///< of the file without ".csv"
    void (*in_float)(const support::GoldenRow&, Tally&) = nullptr;
    void (*in_double)(const support::GoldenRow&, Tally&) = nullptr;
};

[[nodiscard]] std::span<const FileCheck> file_checks();

/// All rows of a file in both precisions.
struct FileReport {
    Tally in_float;
    Tally in_double;
};

/// Throws std::runtime_error for a file that is damaged.
[[nodiscard]] FileReport check_file(const FileCheck& check, const support::GoldenFile& file);

} // namespace farfield::golden
