// golden_check DIR [FILE...]: holds every golden file of a folder, or those that are named, against
// the metrics in float and double, and says how much of the limits they need.
//
//     golden_check DIR           one line for each file and precision; failed rows below it
//     golden_check --table DIR   Markdown tables of errors in units of rounding, the stable forms
//                                beside the naive ones, and of how tight the bounds are
//
// Exit status: 0 all rows hold, 1 a row fails, 2 a file or folder cannot be read.
#include "golden_check/golden_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;
using namespace farfield::golden;

constexpr int kFailed = 1;
constexpr int kUnreadable = 2;

struct NamedReport {
    std::string name;
    FileReport report;
};

const FileCheck* find_check(std::string_view name) {
    for (const FileCheck& check : file_checks()) {
        if (check.name == name) {
            return &check;
        }
    }
    return nullptr;
}

/// Files named on the command line, or all CSV files of the folder, in order.
std::vector<fs::path> find_files(const fs::path& folder, const std::vector<std::string>& names) {
    std::vector<fs::path> files;
    for (const std::string& name : names) {
        const fs::path path = folder / name;
        files.push_back(path.extension() == ".csv" ? path : fs::path(path.string() + ".csv"));
    }
    if (names.empty()) {
        for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
            if (entry.path().extension() == ".csv") {
                files.push_back(entry.path());
            }
        }
        std::sort(files.begin(), files.end());
    }
    return files;
}

void print_tally(const std::string& name, const char* precision, const Tally& tally) {
    std::printf(
        "%-20s %-6s rows %4d  skipped %3d  failures %3zu  worst %6.3Lf %s\n",
        name.c_str(),
        precision,
        tally.rows(),
        tally.skipped(),
        tally.failed_rows(),
        tally.worst(),
        tally.worst_at().c_str()
    );
    for (const std::string& failure : tally.failures()) {
        std::printf("    %s\n", failure.c_str());
    }
}

/// The value that a part of all are no more than.
Real quantile(std::vector<Real> values, double part) {
    std::sort(values.begin(), values.end());
    const auto last = static_cast<double>(values.size() - 1);
    return values[static_cast<std::size_t>(std::lround(part * last))];
}

void print_errors(const std::vector<NamedReport>& reports) {
    std::puts("| quantity | precision | rows | stable: median, worst | naive: median, worst |");
    std::puts("|---|---|---|---|---|");
    for (const NamedReport& named : reports) {
        const auto print = [](const Tally& tally, const char* precision) {
            for (const auto& [quantity, errors] : tally.errors()) {
                std::printf(
                    "| `%s` | %s | %zu | %.2Lg, %.2Lg |",
                    quantity.c_str(),
                    precision,
                    errors.stable.size(),
                    quantile(errors.stable, 0.5),
                    quantile(errors.stable, 1)
                );
                if (errors.naive.empty()) {
                    std::puts(" |");
                    continue;
                }
                std::vector<Real> numbers;
                std::copy_if(
                    errors.naive.begin(),
                    errors.naive.end(),
                    std::back_inserter(numbers),
                    [](Real error) { return error == error; }
                );
                std::printf(" %.2Lg, %.2Lg", quantile(numbers, 0.5), quantile(numbers, 1));
                if (numbers.size() < errors.naive.size()) {
                    std::printf("; %zu NaN", errors.naive.size() - numbers.size());
                }
                std::puts(" |");
            }
        };
        print(named.report.in_float, "float");
        print(named.report.in_double, "double");
    }
}

void print_ratios(const std::vector<NamedReport>& reports) {
    std::puts("\n| ratio | precision | rows | least | median | 95 % | largest |");
    std::puts("|---|---|---|---|---|---|---|");
    for (const NamedReport& named : reports) {
        const auto print = [](const Tally& tally, const char* precision) {
            for (const auto& [quantity, ratios] : tally.ratios()) {
                std::printf(
                    "| %s | %s | %zu | %.7Lg | %.7Lg | %.7Lg | %.7Lg |\n",
                    quantity.c_str(),
                    precision,
                    ratios.size(),
                    quantile(ratios, 0),
                    quantile(ratios, 0.5),
                    quantile(ratios, 0.95),
                    quantile(ratios, 1)
                );
            }
        };
        print(named.report.in_float, "float");
        print(named.report.in_double, "double");
    }
}

int run(bool as_table, const fs::path& folder, const std::vector<std::string>& names) {
    std::vector<NamedReport> reports;
    bool all_hold = true;
    for (const fs::path& path : find_files(folder, names)) {
        const std::string name = path.stem().string();
        const FileCheck* const check = find_check(name);
        if (check == nullptr) {
            std::fprintf(stderr, "%s: not known, skipped\n", name.c_str());
            continue;
        }
        const farfield::support::GoldenFile file(path.parent_path(), name);
        try {
            reports.push_back({name, check_file(*check, file)});
        } catch (const std::exception& error) {
            std::fprintf(stderr, "golden_check: %s: %s\n", path.c_str(), error.what());
            return kUnreadable;
        }
        const FileReport& report = reports.back().report;
        all_hold =
            all_hold && report.in_float.failures().empty() && report.in_double.failures().empty();
        if (!as_table) {
            print_tally(name, "float", report.in_float);
            print_tally(name, "double", report.in_double);
        }
    }
    if (reports.empty()) {
        std::fprintf(stderr, "golden_check: no known file in %s\n", folder.c_str());
        return kUnreadable;
    }
    if (as_table) {
        print_errors(reports);
        print_ratios(reports);
    }
    return all_hold ? 0 : kFailed;
}

} // namespace

int main(int argc, char** argv) {
    std::vector<std::string> arguments(argv + 1, argv + argc);
    const bool as_table = !arguments.empty() && arguments.front() == "--table";
    if (as_table) {
        arguments.erase(arguments.begin());
    }
    if (arguments.empty()) {
        std::fputs("usage: golden_check [--table] DIR [FILE...]\n", stderr);
        return kUnreadable;
    }
    const fs::path folder = arguments.front();
    arguments.erase(arguments.begin());
    try {
        return run(as_table, folder, arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "golden_check: %s\n", error.what());
        return kUnreadable;
    }
}
