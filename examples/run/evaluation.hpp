#pragma once

#include "run/technique.hpp"
#include "run/world.hpp"
#include <farfield/core/result.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace farfield::run {

/// One technique among those that are compared.
struct ComparedRun {
    std::string name; ///< one of its kind within the walk
    RunOptions options;
    bool measure = false; ///< its disparity as well
};

/// One walk, with all that is compared on it.
struct ComparedWalk {
    std::string name;
    WorldOptions world;
    int reference_every = 40;
    int truth_samples = 16; ///< 0: no truth
    std::vector<ComparedRun> runs;
};

/// What `evaluate` is to measure.
struct EvaluationPlan {
    std::string title;
    std::vector<ComparedWalk> walks;
};

/// The JSON text of the evaluation that is built in.
/// @param quick one that takes two minutes instead of a quarter of an hour
[[nodiscard]] std::string_view built_in_evaluation(bool quick) noexcept;

/// Reads an evaluation. Keys that do not exist are errors, so that a typing error never leaves an
/// option at its default.
/// @param name stands for the text in messages
/// @return an error that names walk, run, key and value
[[nodiscard]] Result<EvaluationPlan> parse_evaluation(std::string_view text, std::string_view name);

/// `parse_evaluation` of a file.
[[nodiscard]] Result<EvaluationPlan> load_evaluation(const std::filesystem::path& file);

} // namespace farfield::run
