#pragma once

#include "io/file_bytes.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

/// Files of placed images taken apart and put together again, written from their description alone.
namespace farfield::support {

inline constexpr std::size_t kPlacementOrderAt = 8;
inline constexpr std::size_t kPlacementVersionAt = 12;
inline constexpr std::size_t kPlacementMapAt = 24; ///< content, packed, checksum
inline constexpr std::size_t kPlacementImagesAt = 48;
inline constexpr std::size_t kPlacementTableAt = 56; ///< content, packed, memory, checksum of each

/// A file in pieces: all that it says, and contents unpacked.
struct PlacementPieces {
    std::string head; ///< the first 56 bytes
    std::string map;
    std::vector<std::uint64_t> memory; ///< of images
    std::vector<std::string> images;
};

/// Gives the table of a file the checksum that it should have.
inline void seal_placement(std::string& bytes) {
    const std::size_t end = kPlacementTableAt + 32 * get<std::uint64_t>(bytes, kPlacementImagesAt);
    put(bytes, end, fnv1a({std::string_view(bytes).substr(0, end)}));
}

/// @param bytes of a file that is whole
[[nodiscard]] inline PlacementPieces placement_pieces(const std::string& bytes) {
    const std::string_view all = bytes;
    PlacementPieces pieces;
    pieces.head = bytes.substr(0, kPlacementTableAt);
    const auto images = get<std::uint64_t>(bytes, kPlacementImagesAt);
    std::size_t at = kPlacementTableAt + 32 * images + 8;
    const auto take = [&](std::size_t entry) {
        const auto packed = get<std::uint64_t>(bytes, entry + 8);
        at += packed;
        return zstd_unpacked(all.substr(at - packed, packed), get<std::uint64_t>(bytes, entry));
    };
    pieces.map = take(kPlacementMapAt);
    for (std::size_t i = 0; i < images; ++i) {
        const std::size_t entry = kPlacementTableAt + 32 * i;
        pieces.memory.push_back(get<std::uint64_t>(bytes, entry + 16));
        pieces.images.push_back(take(entry));
    }
    return pieces;
}

/// A file that is whole, whatever its contents are.
[[nodiscard]] inline std::string placement_bytes(const PlacementPieces& pieces) {
    const auto put_entry =
        [](std::string& bytes, std::size_t at, const std::string& content, const std::string& packed
        ) {
            put(bytes, at, std::uint64_t{content.size()});
            put(bytes, at + 8, std::uint64_t{packed.size()});
        };
    std::string bytes = pieces.head;
    std::string rest = zstd_packed(pieces.map);
    put_entry(bytes, kPlacementMapAt, pieces.map, rest);
    put(bytes, kPlacementMapAt + 16, fnv1a({rest}));
    put(bytes, kPlacementImagesAt, std::uint64_t{pieces.images.size()});
    for (std::size_t i = 0; i < pieces.images.size(); ++i) {
        const std::string packed = zstd_packed(pieces.images[i]);
        const std::size_t at = bytes.size();
        bytes.append(32, '\0');
        put_entry(bytes, at, pieces.images[i], packed);
        put(bytes, at + 16, pieces.memory[i]);
        put(bytes, at + 24, fnv1a({packed}));
        rest += packed;
    }
    bytes.append(8, '\0');
    seal_placement(bytes);
    return bytes + rest;
}

} // namespace farfield::support
