#pragma once

#include <farfield/core/result.hpp>

#include <filesystem>
#include <string>

namespace farfield::eval::detail {

/// Whole file as bytes; the error names the file.
[[nodiscard]] Result<std::string> read_text(const std::filesystem::path& file);

/// Writes beside the file and renames, so that a reader sees the old text or all of the new one,
/// also when the program dies in between. The error names the file.
[[nodiscard]] Result<void> write_text(const std::filesystem::path& file, const std::string& text);

} // namespace farfield::eval::detail
