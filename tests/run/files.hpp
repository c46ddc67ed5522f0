#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

namespace farfield::test {

/// A file of one test, which goes away with it.
class TemporaryFile {
  public:
    /// @param name with the extension by which readers know the format
    TemporaryFile(const std::string& name, const std::string& text)
        : path_(
              std::filesystem::temp_directory_path() /
              ("farfield_test_" + std::to_string(::getpid()) + "_" + name)
          ) {
        std::ofstream(path_, std::ios::binary) << text;
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
    ~TemporaryFile() { std::filesystem::remove(path_); }

    [[nodiscard]] std::string path() const { return path_.string(); }

  private:
    std::filesystem::path path_;
};

/// A roof: four triangles in a box of 4 x 3 x 2 m.
inline std::string roof_obj() {
    return "v 0 0 0\nv 4 0 0\nv 4 3 1\nv 0 3 1\nv 0 0 2\nv 4 0 2\n"
           "f 1 2 3\nf 1 3 4\nf 4 3 6\nf 4 6 5\n";
}

} // namespace farfield::test
