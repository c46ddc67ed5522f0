#pragma once

#include <farfield/core/result.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace farfield::io {

/// A file's bytes.
using Bytes = std::string;

/// The whole file. Folders, devices and pipes are refused, so the length is known beforehand.
[[nodiscard]] Result<Bytes> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

/// Writes a file beside `path` and renames it: readers see the old file or the new one whole.
[[nodiscard]] Result<void> write_file(const std::filesystem::path& path, std::string_view bytes);

} // namespace farfield::io
