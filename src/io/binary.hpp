#pragma once

#include "core/digest.hpp"
#include <farfield/core/result.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

/// What Farfield's own file formats share: numbers as they lie in memory of little-endian machines,
/// a signature in front, contents packed by zstd.
namespace farfield::io {

inline constexpr bool kLittleEndian = std::endian::native == std::endian::little;

/// Elements are copied as they lie in memory, so they must have no gaps.
template <typename T>
concept Plain = std::is_trivially_copyable_v<T>;

void append(std::string& bytes, const Plain auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

template <Plain T>
void append(std::string& bytes, const std::vector<T>& array) {
    if (!array.empty()) {
        bytes.append(reinterpret_cast<const char*>(array.data()), array.size() * sizeof(T));
    }
}

/// Takes numbers and arrays from the front of bytes; never more than there are.
class ByteReader {
  public:
    explicit ByteReader(std::string_view bytes) noexcept : rest_(bytes) {}

    /// False, and nothing taken, where less is left.
    [[nodiscard]] bool take(Plain auto& value) noexcept {
        if (rest_.size() < sizeof(value)) {
            return false;
        }
        std::memcpy(&value, rest_.data(), sizeof(value));
        rest_.remove_prefix(sizeof(value));
        return true;
    }

    template <Plain T>
    [[nodiscard]] bool take(std::vector<T>& array, std::uint64_t count) {
        if (rest_.size() / sizeof(T) < count) {
            return false;
        }
        array.resize(count);
        if (count > 0) {
            std::memcpy(array.data(), rest_.data(), count * sizeof(T));
            rest_.remove_prefix(count * sizeof(T));
        }
        return true;
    }

    [[nodiscard]] std::string_view rest() const noexcept { return rest_; }
    [[nodiscard]] std::size_t left() const noexcept { return rest_.size(); }

  private:
    std::string_view rest_;
};

/// FNV-1a of all parts, one after the other.
template <typename... Parts>
[[nodiscard]] std::uint64_t checksum(const Parts&... parts) noexcept {
    Digest digest;
    (digest.add(std::as_bytes(std::span(std::string_view(parts)))), ...);
    return digest.value();
}

/// A file format as its first 16 bytes tell it: magic, byte order, version.
struct Signature {
    std::string_view magic; ///< 8 bytes
    std::uint32_t version = 0;
    std::string_view what; ///< for instance "file of colour cubes"
};
inline constexpr std::size_t kSignatureBytes = 16;

void append(std::string& bytes, const Signature& signature);

/// @return what follows the signature; `unsupported` for another version or byte order, `bad_data`
/// for another magic
[[nodiscard]] Result<ByteReader>
after_signature(std::string_view bytes, const Signature& signature, const std::string& name);

/// @return `unsupported` on big-endian machines
[[nodiscard]] Result<void> check_byte_order(const Signature& signature, const std::string& name);

/// Packs by zstd and fills up to at least 1 / `max_ratio` of the content, so that a file bounds the
/// memory that reading it takes.
/// @param level of zstd
[[nodiscard]] Result<std::string>
pack(std::string_view content, std::uint64_t max_ratio, int level);

/// The content of `pack`. @return an error that begins with `name`
[[nodiscard]] Result<std::string>
unpack(std::string_view packed, std::uint64_t content_bytes, const std::string& name);

} // namespace farfield::io
