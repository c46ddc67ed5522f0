#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/color_cube_model.hpp>

#include <cstdint>
#include <filesystem>

/// Files of colour cubes, so that a model is built once.
///
/// Layout, version 1; all numbers are little-endian, without gaps:
///
/// | bytes | what |
/// |---|---|
/// | 8 | 89 "FFC" 0D 0A 1A 0A: no text, and damaged by what takes it for text |
/// | 4 | byte order, 0x01020304 |
/// | 4 | version |
/// | 8 | `scene_key` |
/// | 8 | size of the content |
/// | 8 | size of the rest of the file after the header, where the content is packed by zstd |
/// | 8 | FNV-1a of the packed content and then of the 40 bytes above |
///
/// Content: `origin`, `item_count`, the numbers of trees (32 bits) and of references (64 bits), the
/// references, the trees. A tree: `lo`, `edge`, `light_sets`, `reference_count`, `overhang`,
/// `quality`, the numbers (64 bits each) of cells, cubes, gains, contents, items and primitives,
/// and these arrays with `item_primitives` after `items`. Elements are as in memory, their fields
/// one after the other; matrices by column.
namespace farfield::io {

/// Largest size of the content of a file for each byte that it is packed into. Files that would be
/// smaller are filled up, so a file bounds the memory that reading it takes.
inline constexpr std::uint64_t kMaxColorCubeRatio = 1024;

/// Writes a model. The same model gives the same bytes with the same version of zstd. An existing
/// file is replaced at once or not at all.
/// @param scene_key says what the model is of, for instance `digest(scene, options)`
/// @return an error of `validate` or of the file system, which names the file
/// @par Cost memory for the model twice; some 5 ns a byte of it
[[nodiscard]] Result<void> write_color_cubes(
    const std::filesystem::path& path, const ColorCubeModel& model, std::uint64_t scene_key = 0
);

/// Reads a model, which then passes `validate`.
/// @return `not_found` for a missing file, `unsupported` for another version or byte order,
/// `bad_data` for every other file that is not exactly as it was written: one changed byte
/// suffices. The message names the file and what is wrong.
/// @par Cost memory for the file and for twice the model, which has at most `kMaxColorCubeRatio`
/// times the bytes of the file; some 2 ns a byte of the model
[[nodiscard]] Result<ColorCubeModel> read_color_cubes(const std::filesystem::path& path);

/// The same, and `bad_data` where the model has another key: it is of another scene, or of other
/// options.
[[nodiscard]] Result<ColorCubeModel>
read_color_cubes(const std::filesystem::path& path, std::uint64_t expected_key);

} // namespace farfield::io
