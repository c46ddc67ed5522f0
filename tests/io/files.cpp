#include "io/files.hpp"

#include <atomic>
#include <fstream>
#include <system_error>
#include <unistd.h>

namespace farfield::support {

TemporaryFolder::TemporaryFolder() {
    static std::atomic<unsigned> counter{0};
    path_ = std::filesystem::temp_directory_path() /
            ("farfield_test_" + std::to_string(::getpid()) + "_" + std::to_string(counter++));
    std::filesystem::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path TemporaryFolder::write(const std::string& name, std::string_view bytes) {
    std::filesystem::path path = path_ / name;
    // Some file systems flush a file to the disk when it is cut to nothing and written again.
    std::filesystem::remove(path);
    std::ofstream(path, std::ios::binary)
        .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return path;
}

Result<io::LoadedScene>
load_bytes(const std::string& name, std::string_view bytes, const io::LoadOptions& options) {
    TemporaryFolder folder;
    return io::load_scene(folder.write(name, bytes), options);
}

std::string make_glb(std::string json, std::string binary) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    const std::size_t length = 20 + json.size() + (binary.empty() ? 0 : 8 + binary.size());
    std::string bytes = "glTF";
    append(bytes, std::uint32_t{2});
    append(bytes, static_cast<std::uint32_t>(length));
    append(bytes, static_cast<std::uint32_t>(json.size()));
    bytes += "JSON" + json;
    if (!binary.empty()) {
        append(bytes, static_cast<std::uint32_t>(binary.size()));
        bytes += std::string("BIN\0", 4) + binary;
    }
    return bytes;
}

std::string triangle_json(std::string_view meshes, std::string_view nodes, std::string_view extra) {
    std::string json = R"({"asset":{"version":"2.0"},
        "buffers":[{"byteLength":44}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
        "accessors":[
            {"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
            {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
        "meshes":)";
    json += meshes;
    json += ",\"nodes\":";
    json += nodes;
    json += extra;
    json += '}';
    return json;
}

std::string triangle_binary() {
    std::string bytes;
    for (const float value : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F}) {
        append(bytes, value);
    }
    for (const int index : {0, 1, 2}) {
        append(bytes, static_cast<std::uint16_t>(index));
    }
    bytes.resize(44, '\0');
    return bytes;
}

} // namespace farfield::support
