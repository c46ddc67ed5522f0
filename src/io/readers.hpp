#pragma once

#include "io/file.hpp"
#include <farfield/io/scene_file.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace farfield::io {

/// What a reader of one format works on.
struct Input {
    std::string_view bytes;
    std::string name;             ///< of the file, for messages
    std::filesystem::path folder; ///< where the files it names are looked for
    LoadOptions options;
};

/// Each fills scene and warnings; `load_scene` adds what all formats share.
[[nodiscard]] Result<void> read_obj(const Input& input, LoadedScene& loaded);
[[nodiscard]] Result<void> read_off(const Input& input, LoadedScene& loaded);
[[nodiscard]] Result<void> read_ply(const Input& input, LoadedScene& loaded);
[[nodiscard]] Result<void> read_stl(const Input& input, LoadedScene& loaded);
[[nodiscard]] Result<void> read_gltf(const Input& input, LoadedScene& loaded);
[[nodiscard]] Result<void> read_pdb(const Input& input, LoadedScene& loaded);
[[nodiscard]] Result<void> read_height_field(const Input& input, LoadedScene& loaded);

} // namespace farfield::io
