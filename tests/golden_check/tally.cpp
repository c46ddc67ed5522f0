#include "golden_check/golden_checks.hpp"

#include <cmath>
#include <sstream>

namespace farfield::golden {

namespace {

/// Hard cases are judged by their limits; medians are of ordinary ones.
bool is_ordinary(const support::GoldenRow& row) {
    const std::string& label = row.label();
    return label.empty() || label.front() != 'H';
}

Real relative_error(Real expected, Real unit, Real value) {
    return std::abs(value - expected) / (unit * expected);
}

template <typename T>
void check_rows(
    void (*check)(const support::GoldenRow&, Tally&), const support::GoldenFile& file, Tally& tally
) {
    for (const support::GoldenRow& row : file.rows()) {
        if (row.serves<T>()) {
            tally.begin(row);
            check(row, tally);
        } else {
            tally.skip();
        }
    }
}

} // namespace

void Tally::fail(const std::string& what) {
    if (last_failed_ != row_) {
        failed_.push_back(row_->name() + ":");
        last_failed_ = row_;
    }
    failed_.back() += " " + what + ";";
}

bool Tally::outcome(MetricOutcome outcome) {
    if (outcome != row_->status()) {
        fail(
            "outcome " + std::to_string(static_cast<int>(outcome)) + " where " +
            row_->text("status") + " is due"
        );
        return false;
    }
    return !is_error(outcome);
}

void Tally::near(std::string_view what, Real value, Real expected, Real limit) {
    if (std::isinf(expected)) {
        holds(value == expected, std::string(what) + " is infinite");
        return;
    }
    const Real error = std::abs(value - expected);
    const Real part = error == 0 ? 0 : error / limit;
    if (part > worst_) {
        worst_ = part;
        worst_at_ = row_->name() + " " + std::string(what);
    }
    if (!(part <= 1)) {
        std::ostringstream text;
        text.precision(20);
        text << what << " is " << value << " where " << expected << " is due, " << part
             << " of the limit";
        fail(text.str());
    }
}

void Tally::holds(bool condition, std::string_view what) {
    if (!condition) {
        fail("not so: " + std::string(what));
    }
}

void Tally::compare(const std::string& quantity, Real expected, Real unit, Real stable) {
    if (is_ordinary(*row_) && expected > 0 && std::isfinite(expected)) {
        errors_[quantity].stable.push_back(relative_error(expected, unit, stable));
    }
}

void Tally::compare(
    const std::string& quantity, Real expected, Real unit, Real stable, Real naive
) {
    if (is_ordinary(*row_) && expected > 0 && std::isfinite(expected)) {
        compare(quantity, expected, unit, stable);
        errors_[quantity].naive.push_back(relative_error(expected, unit, naive));
    }
}

void Tally::ratio(const std::string& quantity, Real ratio) {
    if (is_ordinary(*row_) && std::isfinite(ratio)) {
        ratios_[quantity].push_back(ratio);
    }
}

FileReport check_file(const FileCheck& check, const support::GoldenFile& file) {
    FileReport report;
    check_rows<float>(check.in_float, file, report.in_float);
    check_rows<double>(check.in_double, file, report.in_double);
    return report;
}

} // namespace farfield::golden
