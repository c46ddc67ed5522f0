#include "io/file.hpp"

#include <farfield/core/assert.hpp>

#include <atomic>
#include <cerrno>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace farfield::io {
namespace {

std::string last_error() {
    return std::generic_category().message(errno);
}

} // namespace

InputFile::InputFile(std::string name, OpenFile file, std::uint64_t size) noexcept
    : name_(std::move(name)), file_(std::move(file)), size_(size) {}

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
    std::string name = path.string();
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
    OpenFile file(std::fopen(name.c_str(), "rb"));
    if (!file) {
        return fail(ErrorCode::device, name + " cannot be opened: " + last_error());
    }
    return InputFile(std::move(name), std::move(file), size);
}

Result<Bytes> InputFile::read(std::uint64_t offset, std::uint64_t count) const {
    FARFIELD_ASSERT(offset <= size_ && count <= size_ - offset);
    Bytes bytes(count, '\0');
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t more = ::pread(
            ::fileno(file_.get()),
            bytes.data() + done,
            bytes.size() - done,
            static_cast<off_t>(offset + done)
        );
        if (more <= 0) {
            return fail(
                ErrorCode::device,
                name_ + " cannot be read: " +
                    (more < 0 ? last_error()
                              : "it has become shorter than " + std::to_string(size_) + " bytes")
            );
        }
        done += static_cast<std::size_t>(more);
    }
    return bytes;
}

OutputFile::OutputFile(std::filesystem::path path, std::string part, OpenFile file) noexcept
    : path_(std::move(path)), part_(std::move(part)), file_(std::move(file)) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)), part_(std::exchange(other.part_, {})),
      file_(std::move(other.file_)) {}

OutputFile::~OutputFile() {
    if (!part_.empty()) {
        std::error_code ignored;
        std::filesystem::remove(part_, ignored);
    }
}

tl::unexpected<Error> OutputFile::failure(const std::string& why) const {
    return fail(ErrorCode::device, path_.string() + " cannot be written: " + why);
}

Result<OutputFile> OutputFile::create(const std::filesystem::path& path) {
    static std::atomic<unsigned> counter{0};
    // Unlike any name of another thread or process that writes the same file.
    std::string part = path.string() + '.' + std::to_string(::getpid()) + '.' +
                       std::to_string(counter++) + ".part";
    OpenFile file(std::fopen(part.c_str(), "wb"));
    if (!file) {
        return fail(ErrorCode::device, path.string() + " cannot be written: " + last_error());
    }
    return OutputFile(path, std::move(part), std::move(file));
}

Result<void> OutputFile::append(std::string_view bytes) {
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) {
        return failure(last_error());
    }
    return {};
}

Result<void> OutputFile::commit() {
    if (std::fclose(file_.release()) != 0) { // a full disk may show only here
        return failure(last_error());
    }
    std::error_code failed;
    std::filesystem::rename(part_, path_, failed);
    if (failed) {
        return failure(failed.message());
    }
    part_.clear();
    return {};
}

Result<Bytes> read_file(const std::filesystem::path& path, std::uint64_t max_bytes) {
    const Result<InputFile> file = InputFile::open(path);
    if (!file) {
        return tl::unexpected(file.error());
    }
    if (file->size() > max_bytes) {
        return fail(
            ErrorCode::out_of_memory,
            file->name() + " has " + std::to_string(file->size()) + " bytes, more than the " +
                std::to_string(max_bytes) + " that are allowed"
        );
    }
    return file->read(0, file->size());
}

Result<void> write_file(const std::filesystem::path& path, std::string_view bytes) {
    Result<OutputFile> file = OutputFile::create(path);
    if (!file) {
        return tl::unexpected(file.error());
    }
    if (Result<void> written = file->append(bytes); !written) {
        return written;
    }
    return file->commit();
}

} // namespace farfield::io
