#pragma once

#include <farfield/image/layered_depth_image.hpp>

#include <optional>
#include <string>
#include <string_view>

/// Layered depth images as bytes that zstd packs well; `placement_file.hpp` has the layout.
namespace farfield::io {

/// @pre validate(image)
[[nodiscard]] std::string layered_content(const LayeredDepthImage& image);

/// @param image empty; valid (`validate`) where nothing is wrong
/// @return what is wrong with the content, or nothing
[[nodiscard]] std::optional<std::string>
take_layered_content(std::string_view content, LayeredDepthImage& image);

} // namespace farfield::io
