#include "text_file.hpp"

#include <fstream>
#include <iterator>
#include <system_error>

namespace farfield::eval::detail {

Result<std::string> read_text(const std::filesystem::path& file) {
    // A folder opens as a stream without complaint and then reads as empty.
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) {
        return fail(ErrorCode::not_found, file.string() + ": no such file");
    }
    std::ifstream stream(file, std::ios::binary);
    if (!stream || std::filesystem::is_directory(file, ignored)) {
        return fail(ErrorCode::device, file.string() + ": cannot be opened for reading");
    }
    std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    if (stream.bad()) {
        return fail(ErrorCode::device, file.string() + ": cannot be read");
    }
    return text;
}

Result<void> write_text(const std::filesystem::path& file, const std::string& text) {
    std::filesystem::path partial = file;
    partial += ".partial";
    std::error_code error;
    {
        std::ofstream stream(partial, std::ios::binary | std::ios::trunc);
        if (!stream) {
            return fail(ErrorCode::device, partial.string() + ": cannot be opened for writing");
        }
        stream.write(text.data(), static_cast<std::streamsize>(text.size()));
        stream.close();
        if (!stream) {
            std::filesystem::remove(partial, error);
            return fail(ErrorCode::device, partial.string() + ": cannot be written");
        }
    }
    std::filesystem::rename(partial, file, error);
    if (error) {
        const std::string reason = error.message();
        std::filesystem::remove(partial, error);
        return fail(ErrorCode::device, file.string() + ": cannot be replaced: " + reason);
    }
    return {};
}

} // namespace farfield::eval::detail
