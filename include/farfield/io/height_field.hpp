#pragma once

#include <farfield/core/result.hpp>
#include <farfield/io/scene_file.hpp>

#include <cstdint>
#include <filesystem>

namespace farfield::io {

/// Most samples of a height field; more would not fit 32-bit index counts with room to spare.
inline constexpr std::uint64_t kMaxHeightSamples = 1ULL << 25U;

/// Reads a 16-bit greyscale PNG as terrain of one splittable mesh.
///
/// A .json of the same name has the numbers `width`, `height`, `spacing_m` (> 0), `height_scale`
/// and `height_offset`; height [m] = value * height_scale + height_offset. The first row is north
/// (-z), the first column west (-x), y is up; the field is centred on the origin in x and z, and
/// `Mesh::origin` lies at its middle height. Each square is cut from its north-west to its
/// south-east corner. A picture beside it, NAME_colour or NAME_ortho with .png, .jpg or .jpeg,
/// becomes its texture and covers the samples' squares: sample i of n lies at (i + 0.5) / n.
///
/// @return `not_found` when one of the two files is missing, `bad_data` when they contradict each
/// other or the format, `unsupported` for fewer than 2 x 2 or more than `kMaxHeightSamples` samples
[[nodiscard]] Result<LoadedScene>
load_height_field(const std::filesystem::path& path, const LoadOptions& options = {});

} // namespace farfield::io
