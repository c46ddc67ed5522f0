#pragma once

#include <farfield/core/result.hpp>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace farfield::io {

/// A file's bytes.
using Bytes = std::string;

struct CloseFile {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using OpenFile = std::unique_ptr<std::FILE, CloseFile>;

/// A file of which parts are read, by any number of threads at a time. Folders, devices and pipes
/// are refused, so the length is known beforehand.
class InputFile {
  public:
    /// @return `not_found` for a missing file
    [[nodiscard]] static Result<InputFile> open(const std::filesystem::path& path);

    [[nodiscard]] const std::string& name() const noexcept { return name_; }
    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }

    /// @pre offset + count <= size()
    [[nodiscard]] Result<Bytes> read(std::uint64_t offset, std::uint64_t count) const;

  private:
    InputFile(std::string name, OpenFile file, std::uint64_t size) noexcept;
    std::string name_;
    OpenFile file_;
    std::uint64_t size_;
};

/// A file that takes its place when it is whole: readers see the old one or the new one. Without
/// `commit` nothing is left of it.
class OutputFile {
  public:
    [[nodiscard]] static Result<OutputFile> create(const std::filesystem::path& path);

    OutputFile(OutputFile&& other) noexcept;
    OutputFile& operator=(OutputFile&& other) = delete;
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    ~OutputFile();

    [[nodiscard]] Result<void> append(std::string_view bytes);

    /// Nothing can be appended after it.
    [[nodiscard]] Result<void> commit();

  private:
    OutputFile(std::filesystem::path path, std::string part, OpenFile file) noexcept;
    [[nodiscard]] tl::unexpected<Error> failure(const std::string& why) const;
    std::filesystem::path path_;
    std::string part_; ///< what is written; empty once it is not there
    OpenFile file_;
};

/// The whole file.
[[nodiscard]] Result<Bytes> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

/// Writes a file as `OutputFile` does.
[[nodiscard]] Result<void> write_file(const std::filesystem::path& path, std::string_view bytes);

} // namespace farfield::io
