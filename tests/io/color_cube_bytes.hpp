#pragma once

#include "io/file_bytes.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

/// Files of colour cubes taken apart and put together again, written from their description alone.
namespace farfield::support {

inline constexpr std::size_t kCubeHeaderBytes = 48;
inline constexpr std::size_t kByteOrderAt = 8;
inline constexpr std::size_t kVersionAt = 12;
inline constexpr std::size_t kContentBytesAt = 24;
inline constexpr std::size_t kPackedBytesAt = 32;
inline constexpr std::size_t kChecksumAt = 40;

/// Gives a file the checksum that it should have.
inline void seal(std::string& bytes) {
    const std::string_view all = bytes;
    const std::uint64_t sum = fnv1a({all.substr(kCubeHeaderBytes), all.substr(0, kChecksumAt)});
    put(bytes, kChecksumAt, sum);
}

/// What is in a file that is whole.
inline std::string unpacked(const std::string& bytes) {
    std::uint64_t size = 0;
    std::memcpy(&size, bytes.data() + kContentBytesAt, sizeof(size));
    return zstd_unpacked(std::string_view(bytes).substr(kCubeHeaderBytes), size);
}

/// A file with the header of `bytes` and another content.
inline std::string repacked(const std::string& bytes, const std::string& content) {
    const std::string packed = zstd_packed(content);
    std::string result = bytes.substr(0, kCubeHeaderBytes) + packed;
    put(result, kContentBytesAt, std::uint64_t{content.size()});
    put(result, kPackedBytesAt, std::uint64_t{packed.size()});
    seal(result);
    return result;
}

} // namespace farfield::support
