#include "io/readers.hpp"
#include "io/text.hpp"
#include <farfield/io/height_field.hpp>
#include <farfield/io/scene_file.hpp>

#include <array>
#include <exception>
#include <new>
#include <string_view>
#include <utility>

namespace farfield::io {
namespace {

using Reader = Result<void> (*)(const Input& input, LoadedScene& loaded);

struct Format {
    std::string_view extension;
    Reader reader;
    bool says_up; ///< up is +y whatever the options say
};

constexpr std::array<Format, 8> kFormats = {{
    {".obj", read_obj, false},
    {".off", read_off, false},
    {".ply", read_ply, false},
    {".stl", read_stl, false},
    {".gltf", read_gltf, true},
    {".glb", read_gltf, true},
    {".pdb", read_pdb, true},
    {".png", read_height_field, true},
}};

Result<LoadedScene>
load(const std::filesystem::path& path, const Format& format, const LoadOptions& options) {
    const auto bytes = read_file(path, options.max_file_bytes);
    if (!bytes) {
        return tl::unexpected(bytes.error());
    }
    if (bytes->empty()) {
        return fail(ErrorCode::bad_data, path.string() + " is empty");
    }
    const Input input{*bytes, path.filename().string(), path.parent_path(), options};
    LoadedScene loaded;
    if (auto done = format.reader(input, loaded); !done) {
        return tl::unexpected(std::move(done.error()));
    }
    loaded.scene.name = path.stem().string();
    if (options.up == UpAxis::z && !format.says_up) {
        loaded.scene.up = {0.0, 0.0, 1.0};
    }
    if (auto checked = validate(loaded.scene); !checked) {
        return fail(checked.error().code, input.name + ": " + checked.error().message);
    }
    if (options.flag_splittable) {
        flag_splittable(loaded.scene);
    }
    return loaded;
}

/// The one place where what libraries throw ends: memory that is not there, and whatever tinygltf,
/// its JSON parser or the file system's library make of a broken file.
Result<LoadedScene>
load_safely(const std::filesystem::path& path, const Format& format, const LoadOptions& options) {
    try {
        return load(path, format, options);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::out_of_memory, path.string() + ": not enough memory");
    } catch (const std::exception& exception) {
        return fail(ErrorCode::bad_data, path.string() + ": " + exception.what());
    }
}

} // namespace

Result<LoadedScene> load_scene(const std::filesystem::path& path, const LoadOptions& options) {
    const std::string extension = lower_case(path.extension().string());
    for (const Format& format : kFormats) {
        if (extension == format.extension) {
            return load_safely(path, format, options);
        }
    }
    return fail(
        ErrorCode::unsupported,
        path.string() + ": extension " + quote(extension) +
            " is none of .obj, .off, .ply, .stl, .gltf, .glb, .pdb and .png"
    );
}

Result<LoadedScene>
load_height_field(const std::filesystem::path& path, const LoadOptions& options) {
    return load_safely(path, kFormats.back(), options);
}

} // namespace farfield::io
