#pragma once

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace farfield::eval::detail {

/// A value for a message. Long ones are cut; nested ones are named only, since they may be nested
/// deeper than the stack is.
[[nodiscard]] std::string shown(const nlohmann::ordered_json& value);

} // namespace farfield::eval::detail
