#pragma once

#include <farfield/core/result.hpp>
#include <farfield/policy/cost_model.hpp>

#include <filesystem>
#include <string>
#include <string_view>

namespace farfield::eval {

/// Reads `{"triangle_s": 1.2e-7, "draw_call_s": 1e-5, ...}`: every field of `CostModel` by its
/// name, in seconds. All of it has to be there and nothing else may be.
/// @param name stands for the text in messages
/// @return the model, which is valid; an error that names key and value, "gpu.json: texel_s is
/// null, expected a number"
[[nodiscard]] Result<CostModel> parse_cost_model(std::string_view text, std::string_view name);

/// `parse_cost_model` of a file.
[[nodiscard]] Result<CostModel> load_cost_model(const std::filesystem::path& file);

/// The text that `parse_cost_model` reads back exactly. @pre validate(model)
[[nodiscard]] std::string to_json(const CostModel& model);

/// Writes `to_json`; an existing file is replaced at once or not at all.
/// @return an error of the file, or of a model that is not valid: it could not be read back
[[nodiscard]] Result<void> save(const CostModel& model, const std::filesystem::path& file);

} // namespace farfield::eval
