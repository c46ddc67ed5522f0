#pragma once

#include <farfield/eval/evaluation_report.hpp>

#include <string>

namespace farfield::eval::detail {

/// One line a run, as RFC 4180 has it but for bare line feeds. Columns: walk, name, then the leaves
/// of the JSON of a run, in its order.
[[nodiscard]] std::string results_csv(const Evaluation& evaluation);

/// One line a node that was beyond its promise.
[[nodiscard]] std::string overshoots_csv(const Evaluation& evaluation);

} // namespace farfield::eval::detail
