#pragma once

#include <farfield/image/picture.hpp>

#include <span>

namespace farfield::run {

/// Pictures of one size side by side, row by row, white between them.
/// @param tiles at least one @param columns >= 1
[[nodiscard]] Picture contact_sheet(std::span<const Picture> tiles, int columns);

} // namespace farfield::run
