#pragma once

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <string>
#include <string_view>
#include <zstd.h>

/// Bytes of files, for tests that take Farfield's own formats apart and put them together again.
namespace farfield::support {

/// @pre at + sizeof(T) <= bytes.size()
template <typename T>
void put(std::string& bytes, std::size_t at, T value) {
    bytes.replace(at, sizeof(T), reinterpret_cast<const char*>(&value), sizeof(T));
}

/// @pre at + sizeof(T) <= bytes.size()
template <typename T>
[[nodiscard]] T get(std::string_view bytes, std::size_t at) {
    T value{};
    std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
}

/// The checksum of files.
[[nodiscard]] inline std::uint64_t fnv1a(std::initializer_list<std::string_view> parts) {
    std::uint64_t sum = 14695981039346656037ULL;
    for (const std::string_view part : parts) {
        for (const char byte : part) {
            sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211ULL;
        }
    }
    return sum;
}

inline std::string read_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

inline std::string zstd_packed(std::string_view content, int level = 1) {
    std::string packed(ZSTD_compressBound(content.size()), '\0');
    const std::size_t size =
        ZSTD_compress(packed.data(), packed.size(), content.data(), content.size(), level);
    REQUIRE(ZSTD_isError(size) == 0U);
    packed.resize(size);
    return packed;
}

inline std::string zstd_unpacked(std::string_view packed, std::size_t size) {
    std::string content(size, '\0');
    REQUIRE(ZSTD_decompress(content.data(), size, packed.data(), packed.size()) == size);
    return content;
}

} // namespace farfield::support
