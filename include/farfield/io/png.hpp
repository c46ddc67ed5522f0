#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/picture.hpp>

#include <cstdint>
#include <filesystem>
#include <vector>

namespace farfield::io {

/// Largest side that `read_png` accepts. [px]
inline constexpr int kMaxPictureSide = 16384;

/// Reads a PNG of any kind as 8-bit RGBA; missing alpha is 255.
/// @return `not_found` for a missing file, `unsupported` for a side beyond `kMaxPictureSide`,
/// `bad_data` for everything that is no whole PNG. Sizes are checked against the length of the file
/// before anything is allocated.
[[nodiscard]] Result<Picture> read_png(const std::filesystem::path& path);

/// The bytes of a PNG file: RGB when every alpha is 255, RGBA otherwise.
/// @return `invalid_argument` for an array that does not fit the size
[[nodiscard]] Result<std::vector<std::uint8_t>> encode_png(const Picture& picture);

/// Writes `encode_png`. The file appears under its name whole or not at all: it is written beside
/// it and renamed.
/// @return errors as `encode_png`, `device` when the file system fails
[[nodiscard]] Result<void> write_png(const std::filesystem::path& path, const Picture& picture);

} // namespace farfield::io
