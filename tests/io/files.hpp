#pragma once

#include <farfield/io/scene_file.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace farfield::support {

/// A folder of its own for one test, gone with it.
class TemporaryFolder {
  public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

    /// Writes a file and returns its path.
    std::filesystem::path write(const std::string& name, std::string_view bytes);

  private:
    std::filesystem::path path_;
};

/// Writes a file of its own and loads it.
[[nodiscard]] Result<io::LoadedScene>
load_bytes(const std::string& name, std::string_view bytes, const io::LoadOptions& options = {});

/// Appends a number as it lies in memory; tests run on little-endian machines only.
template <typename T>
void append(std::string& bytes, T value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// A binary glTF of a JSON text and a binary chunk (none when empty), both padded.
[[nodiscard]] std::string make_glb(std::string json, std::string binary);

/// A glTF with the accessors of one indexed triangle: 0 is its positions, 1 its indices. `extra` is
/// appended to the members of the top level and begins with a comma.
[[nodiscard]] std::string
triangle_json(std::string_view meshes, std::string_view nodes, std::string_view extra = "");

/// The binary chunk of `triangle_json`: (0,0,0), (1,0,0), (0,1,0) and 0, 1, 2.
[[nodiscard]] std::string triangle_binary();

} // namespace farfield::support
