#pragma once

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <zstd.h>

/// Files of colour cubes taken apart and put together again, written from their description alone.
namespace farfield::support {

inline constexpr std::size_t kCubeHeaderBytes = 48;
inline constexpr std::size_t kByteOrderAt = 8;
inline constexpr std::size_t kVersionAt = 12;
inline constexpr std::size_t kContentBytesAt = 24;
inline constexpr std::size_t kPackedBytesAt = 32;
inline constexpr std::size_t kChecksumAt = 40;

template <typename T>
void put(std::string& bytes, std::size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof(T));
}

/// Gives a file the checksum that it should have.
inline void seal(std::string& bytes) {
    std::uint64_t sum = 14695981039346656037ULL;
    const auto add = [&sum](std::string_view part) {
        for (const char byte : part) {
            sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211ULL;
        }
    };
    add(std::string_view(bytes).substr(kCubeHeaderBytes));
    add(std::string_view(bytes).substr(0, kChecksumAt));
    put(bytes, kChecksumAt, sum);
}

inline std::string read_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// What is in a file that is whole.
inline std::string unpacked(const std::string& bytes) {
    std::uint64_t size = 0;
    std::memcpy(&size, bytes.data() + kContentBytesAt, sizeof(size));
    std::string content(size, '\0');
    REQUIRE(
        ZSTD_decompress(
            content.data(),
            content.size(),
            bytes.data() + kCubeHeaderBytes,
            bytes.size() - kCubeHeaderBytes
        ) == size
    );
    return content;
}

/// A file with the header of `bytes` and another content.
inline std::string repacked(const std::string& bytes, const std::string& content) {
    std::string packed(ZSTD_compressBound(content.size()), '\0');
    const std::size_t size =
        ZSTD_compress(packed.data(), packed.size(), content.data(), content.size(), 1);
    REQUIRE(ZSTD_isError(size) == 0U);
    std::string result = bytes.substr(0, kCubeHeaderBytes) + packed.substr(0, size);
    put(result, kContentBytesAt, std::uint64_t{content.size()});
    put(result, kPackedBytesAt, std::uint64_t{size});
    seal(result);
    return result;
}

} // namespace farfield::support
