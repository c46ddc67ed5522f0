#include "io/file.hpp"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>
#include <unistd.h>

namespace farfield::io {
namespace {

struct CloseFile {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

std::string last_error() {
    return std::generic_category().message(errno);
}

} // namespace

Result<Bytes> read_file(const std::filesystem::path& path, std::uint64_t max_bytes) {
    const std::string name = path.string();
    std::error_code failure;
    const std::filesystem::file_status status = std::filesystem::status(path, failure);
    if (!std::filesystem::exists(status)) {
        return fail(ErrorCode::not_found, name + " does not exist");
    }
    if (!std::filesystem::is_regular_file(status)) {
        return fail(ErrorCode::bad_data, name + " is not a file");
    }
    const std::uint64_t size = std::filesystem::file_size(path, failure);
    if (failure) {
        return fail(ErrorCode::device, name + ": " + failure.message());
    }
    if (size > max_bytes) {
        return fail(
            ErrorCode::out_of_memory,
            name + " has " + std::to_string(size) + " bytes, more than the " +
                std::to_string(max_bytes) + " that are allowed"
        );
    }
    const File file(std::fopen(name.c_str(), "rb"));
    if (!file) {
        return fail(ErrorCode::device, name + " cannot be opened: " + last_error());
    }
    Bytes bytes(size, '\0');
    if (std::fread(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) {
        return fail(ErrorCode::device, name + " cannot be read: " + last_error());
    }
    return bytes;
}

Result<void> write_file(const std::filesystem::path& path, std::string_view bytes) {
    static std::atomic<unsigned> counter{0};
    const std::string name = path.string();
    // Unlike any name of another thread or process that writes the same file.
    const std::string part =
        name + '.' + std::to_string(::getpid()) + '.' + std::to_string(counter++) + ".part";
    File file(std::fopen(part.c_str(), "wb"));
    if (!file) {
        return fail(ErrorCode::device, name + " cannot be written: " + last_error());
    }
    bool written = std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
    written = std::fclose(file.release()) == 0 && written; // a full disk may show only here
    std::error_code failure(written ? 0 : errno, std::generic_category());
    if (written) {
        std::filesystem::rename(part, path, failure);
    }
    if (failure) {
        std::error_code ignored;
        std::filesystem::remove(part, ignored);
        return fail(ErrorCode::device, name + " cannot be written: " + failure.message());
    }
    return {};
}

} // namespace farfield::io
