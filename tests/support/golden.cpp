#include "support/golden.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace farfield::support {

namespace {

/// Cells between commas; golden files have no quotes.
std::vector<std::string> split(const std::string& line) {
    std::vector<std::string> cells;
    std::size_t begin = 0;
    for (std::size_t end = line.find(','); end != std::string::npos; end = line.find(',', begin)) {
        cells.push_back(line.substr(begin, end - begin));
        begin = end + 1;
    }
    cells.push_back(line.substr(begin));
    return cells;
}

constexpr std::array<std::pair<std::string_view, MetricOutcome>, 17> kOutcomes{{
    {"ok", MetricOutcome::ok},
    {"err_nonfinite", MetricOutcome::err_nonfinite},
    {"err_box", MetricOutcome::err_box},
    {"err_normal", MetricOutcome::err_normal},
    {"err_v0_plane", MetricOutcome::err_v0_plane},
    {"err_behind", MetricOutcome::err_behind},
    {"err_eps", MetricOutcome::err_eps},
    {"err_distance", MetricOutcome::err_distance},
    {"err_fov", MetricOutcome::err_fov},
    {"err_range", MetricOutcome::err_range},
    {"err_dt", MetricOutcome::err_dt},
    {"err_bound", MetricOutcome::err_bound},
    {"err_zone", MetricOutcome::err_zone},
    {"pi_inside", MetricOutcome::pi_inside},
    {"pi_backface", MetricOutcome::pi_backface},
    {"pi_degenerate", MetricOutcome::pi_degenerate},
    {"pi_behind", MetricOutcome::pi_behind},
}};

float parse(const char* text, char** end, float /*type*/) {
    return std::strtof(text, end);
}
double parse(const char* text, char** end, double /*type*/) {
    return std::strtod(text, end);
}
long double parse(const char* text, char** end, long double /*type*/) {
    return std::strtold(text, end);
}

} // namespace

GoldenRow::GoldenRow(
    const std::vector<std::string>& columns, std::vector<std::string> cells, int line
)
    : columns_(&columns), cells_(std::move(cells)), line_(line) {
    if (cells_.size() != columns.size()) {
        throw std::runtime_error(
            "line " + std::to_string(line) + " has " + std::to_string(cells_.size()) +
            " cells, not " + std::to_string(columns.size())
        );
    }
}

const std::string& GoldenRow::text(const std::string& column) const {
    const auto found = std::find(columns_->begin(), columns_->end(), column);
    if (found == columns_->end()) {
        throw std::runtime_error("golden file has no column " + column);
    }
    return cells_[static_cast<std::size_t>(found - columns_->begin())];
}

bool GoldenRow::has(const std::string& column) const {
    return !text(column).empty();
}

template <typename T>
T GoldenRow::number(const std::string& column) const {
    const std::string& cell = text(column);
    char* end = nullptr;
    const T value = parse(cell.c_str(), &end, T());
    if (cell.empty() || *end != '\0') {
        throw std::runtime_error("row " + name() + ": no number in " + column);
    }
    return value;
}

template float GoldenRow::number<float>(const std::string&) const;
template double GoldenRow::number<double>(const std::string&) const;
template long double GoldenRow::number<long double>(const std::string&) const;

MetricOutcome GoldenRow::status() const {
    const std::string& status = text("status");
    const auto* const found =
        std::find_if(kOutcomes.begin(), kOutcomes.end(), [&](const auto& outcome) {
            return outcome.first == status;
        });
    if (found == kOutcomes.end()) {
        throw std::runtime_error("row " + name() + ": unknown status " + status);
    }
    return found->second;
}

std::string GoldenRow::name() const {
    return text("id") + " " + label() + " (line " + std::to_string(line_) + ")";
}

GoldenFile::GoldenFile(const std::string& name)
    : GoldenFile(std::filesystem::path(FARFIELD_TEST_DATA) / "golden", name) {}

GoldenFile::GoldenFile(const std::filesystem::path& folder, const std::string& name) {
    const std::filesystem::path path = folder / (name + ".csv");
    std::ifstream file(path);
    std::string line;
    if (!std::getline(file, line)) {
        throw std::runtime_error("cannot read " + path.string());
    }
    columns_ = split(line);
    try {
        for (int number = 2; std::getline(file, line); ++number) {
            rows_.emplace_back(columns_, split(line), number);
        }
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(path.string() + ": " + error.what());
    }
    if (rows_.empty()) {
        throw std::runtime_error("no rows in " + path.string());
    }
}

} // namespace farfield::support
