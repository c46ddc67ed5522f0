#pragma once

#include <farfield/core/result.hpp>
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/technique/placement_map.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>

/// Files of placed images: the map and all of its layered images, each of which can be read
/// without the others.
///
/// Layout, version 1; all numbers are little-endian, without gaps:
///
/// | bytes | what |
/// |---|---|
/// | 8 | 89 "FFP" 0D 0A 1A 0A: no text, and damaged by what takes it for text |
/// | 4 | byte order, 0x01020304 |
/// | 4 | version |
/// | 8 | `making_key` |
/// | 8, 8, 8 | the map: bytes of its content, bytes that it is packed into, FNV-1a of these |
/// | 8 | number of images |
/// | 32 each | an image: bytes of its content, bytes that it is packed into, bytes in memory,
/// FNV-1a of what is packed; all 0 where it is not there | | 8 | FNV-1a of all above | | | the map,
/// packed by zstd, then the images in order |
///
/// Content of the map: the fields of `PlacementMap` in order, each array after its number of
/// elements (64 bits).
///
/// Content of an image: `view`, `near_depth`, `far_depth`, numbers of samples and points (64 bits),
/// `counts`; then of all samples the first byte, of all samples the second, and so on: the place in
/// the texel (x in the lower four bits), depth (2), extent (2), green, red less green, blue less
/// green; then bytes of points as they lie in memory in the same way. All but the place are
/// differences from the sample before in the texel, or for the first from the first of the last
/// texel that has any; those of depth and extent are folded (0, -1, 1, -2, ... are 0, 1, 2, 3,
/// ...). That takes half of what zstd makes of samples as they lie in memory.
namespace farfield::io {

/// Largest size of a content for each byte that it is packed into, as `kMaxColorCubeRatio`.
inline constexpr std::uint64_t kMaxPlacementRatio = 1024;

struct PlacementFileOptions {
    /// Says what images are made of and how, for instance a digest of scene and options: a writer
    /// goes on only where the same was made before.
    std::uint64_t making_key = 0;
    int level = 9;        ///< of zstd: how hard images are packed. [1, 19]
    bool partial = false; ///< `finish` takes images that there are, not only all of them
};

/// Writes a file of placed images, one image at a time, and goes on where it was interrupted.
///
/// Each image is put into the folder `FILE.parts` at once, whole or not at all, so a program that
/// is killed loses the image in flight. `finish` joins them: the same bytes for the same map,
/// images, options and version of zstd, whatever the order in which images came and however often
/// it began anew. One writer at a time.
class PlacementWriter {
  public:
    /// Begins, or goes on: images in the folder that are whole are kept, damaged ones dropped.
    /// @return `invalid_argument` for a level out of range or where the folder has images of
    /// another map, key or level (finish it as it was begun, or remove it); an error of `validate`
    /// or of the file system, which names the file
    /// @par Cost reads all images of the folder, one at a time
    [[nodiscard]] static Result<PlacementWriter> open(
        const std::filesystem::path& path,
        const PlacementMap& map,
        const PlacementFileOptions& options = {}
    );

    PlacementWriter(PlacementWriter&& other) noexcept;
    PlacementWriter& operator=(PlacementWriter&& other) noexcept;
    PlacementWriter(const PlacementWriter&) = delete;
    PlacementWriter& operator=(const PlacementWriter&) = delete;
    ~PlacementWriter();

    /// Images of the map. @pre image < image_count() for all below
    [[nodiscard]] std::uint32_t image_count() const noexcept;

    /// Whether an image is there already.
    [[nodiscard]] bool has(std::uint32_t image) const noexcept;

    /// Keeps an image, in place of one that is there.
    /// @return an error of `validate` or of the file system
    /// @par Cost packing: some 100 to 400 ns a sample at level 9, 10 to 100 at level 3
    [[nodiscard]] Result<void> add(std::uint32_t image, const LayeredDepthImage& content);

    /// Puts the file together, in place of one that is there, and removes the folder.
    /// @return `not_found` where an image is missing and `partial` is not set; an error of the file
    /// system, after which the folder is as it was. Nothing may be called after success.
    [[nodiscard]] Result<void> finish();

  private:
    struct Impl;
    explicit PlacementWriter(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

/// Reads a file of placed images, which stays open. May be used by several threads at a time.
///
/// Errors of all functions: `not_found` for a missing file or image, `unsupported` for another
/// version or byte order, `bad_data` for everything that is not exactly as it was written, as far
/// as it is read: one changed byte suffices. The message names the file and what is wrong. No size
/// in the file is trusted: memory is at most `kMaxPlacementRatio` times twice the bytes of the
/// file.
class PlacementReader {
  public:
    /// Reads the header and the table of images.
    [[nodiscard]] static Result<PlacementReader> open(const std::filesystem::path& path);

    PlacementReader(PlacementReader&& other) noexcept;
    PlacementReader& operator=(PlacementReader&& other) noexcept;
    PlacementReader(const PlacementReader&) = delete;
    PlacementReader& operator=(const PlacementReader&) = delete;
    ~PlacementReader();

    /// `PlacementFileOptions::making_key` of the writer.
    [[nodiscard]] std::uint64_t making_key() const noexcept;

    /// Images of the map. @pre image < image_count() for all below
    [[nodiscard]] std::uint32_t image_count() const noexcept;

    /// `memory_bytes` of an image; 0 where the file does not have it.
    [[nodiscard]] std::uint64_t image_bytes(std::uint32_t image) const noexcept;

    /// @return a map that passes `validate(map)`
    [[nodiscard]] Result<PlacementMap> read_map() const;

    /// @return an image that passes `validate(image)`
    /// @par Cost memory for the packed bytes and twice the image; some 20 ns a sample
    [[nodiscard]] Result<LayeredDepthImage> read(std::uint32_t image) const;

  private:
    struct Impl;
    explicit PlacementReader(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

/// The map of a file alone. Errors as of `PlacementReader`.
[[nodiscard]] Result<PlacementMap> load_placement_map(const std::filesystem::path& path);

} // namespace farfield::io
