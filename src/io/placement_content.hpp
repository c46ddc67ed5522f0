#pragma once

#include <farfield/technique/placement_map.hpp>

#include <optional>
#include <string>
#include <string_view>

/// Maps of placed images as bytes; `placement_file.hpp` has the layout.
namespace farfield::io {

/// @pre validate(map)
[[nodiscard]] std::string placement_content(const PlacementMap& map);

/// @param map as default; valid (`validate`) where nothing is wrong
/// @return what is wrong with the content, or nothing
[[nodiscard]] std::optional<std::string>
take_placement_content(std::string_view content, PlacementMap& map);

} // namespace farfield::io
