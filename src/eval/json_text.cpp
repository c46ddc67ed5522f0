#include "eval/json_text.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>

namespace farfield::eval::detail {

std::string shown(const nlohmann::ordered_json& value) {
    using nlohmann::ordered_json;
    const bool nested = std::any_of(value.begin(), value.end(), [](const ordered_json& child) {
        return child.is_structured();
    });
    if (value.is_structured() && nested) {
        return value.is_array() ? "a nested array" : "a nested object";
    }
    constexpr std::size_t kLongest = 40;
    std::string text = value.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
    return text.size() > kLongest ? text.substr(0, kLongest) + "..." : text;
}

} // namespace farfield::eval::detail
