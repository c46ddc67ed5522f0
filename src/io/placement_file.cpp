#include "io/binary.hpp"
#include "io/file.hpp"
#include "io/layered_content.hpp"
#include "io/placement_content.hpp"
#include <farfield/io/placement_file.hpp>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

namespace farfield::io {
namespace {

constexpr Signature kSignature = {
    "\x89"
    "FFP\r\n\x1a\n",
    1,
    "file of placed images"};
constexpr Signature kPartSignature = {
    "\x89"
    "FFQ\r\n\x1a\n",
    1,
    "image of a file of placed images"};
constexpr std::string_view kPartExtension = ".image";
/// More than any machine holds, and far from what overflows.
constexpr std::uint64_t kMaxFileBytes = 1ULL << 44U;

/// Something packed.
struct Blob {
    std::uint64_t content_bytes = 0;
    std::uint64_t packed_bytes = 0; ///< 0: it is not there
    std::uint64_t memory_bytes = 0; ///< of an image
    std::uint64_t sum = 0;          ///< of the packed bytes

    friend bool operator==(const Blob&, const Blob&) = default;
};
static_assert(sizeof(Blob) == 32);

/// What is in front of the table.
struct Header {
    std::uint64_t making_key = 0;
    std::uint64_t map_content_bytes = 0;
    std::uint64_t map_packed_bytes = 0;
    std::uint64_t map_sum = 0;
    std::uint64_t images = 0;
};
static_assert(sizeof(Header) == 40);
constexpr std::size_t kHeaderBytes = kSignatureBytes + sizeof(Header);
constexpr std::size_t kSumBytes = 8;

/// What a part says of itself, between its signature and the checksum of both.
struct PartHeader {
    std::uint64_t making_key = 0;
    std::uint64_t map_digest = 0; ///< FNV-1a of the content of the map
    std::int32_t level = 0;
    std::uint32_t image = 0;
    Blob blob;
};
static_assert(sizeof(PartHeader) == 56);
constexpr std::size_t kPartHeaderBytes = kSignatureBytes + sizeof(PartHeader) + kSumBytes;

tl::unexpected<Error> bad(const std::string& name, const std::string& what) {
    return fail(ErrorCode::bad_data, name + ' ' + what);
}

/// An image as it is on its own: header and what is packed.
Result<PartHeader> read_part_header(std::string_view bytes, const std::string& name) {
    Result<ByteReader> reader = after_signature(bytes, kPartSignature, name);
    if (!reader) {
        return tl::unexpected(reader.error());
    }
    PartHeader header;
    std::uint64_t sum = 0;
    if (!reader->take(header) || !reader->take(sum)) {
        return bad(name, "ends in its header, after " + std::to_string(bytes.size()) + " bytes");
    }
    const bool is_whole = sum == checksum(bytes.substr(0, kPartHeaderBytes - kSumBytes)) &&
                          reader->left() == header.blob.packed_bytes &&
                          checksum(reader->rest()) == header.blob.sum;
    if (!is_whole) {
        return bad(name, "is damaged: its checksum is another");
    }
    return header;
}

/// Checks a table against the size of its file.
Result<void>
check_table(const std::vector<Blob>& blobs, std::uint64_t bytes_left, const std::string& name) {
    for (std::size_t i = 0; i < blobs.size(); ++i) {
        const Blob& blob = blobs[i];
        const std::string what = i == 0 ? "its map" : "image " + std::to_string(i - 1);
        if (i > 0 && blob == Blob{}) {
            continue;
        }
        if (blob.packed_bytes == 0 || blob.packed_bytes > bytes_left) {
            return bad(
                name,
                "has " + std::to_string(bytes_left) + " bytes from " + what + " on, which takes " +
                    std::to_string(blob.packed_bytes)
            );
        }
        bytes_left -= blob.packed_bytes;
        if (blob.content_bytes / kMaxPlacementRatio > blob.packed_bytes) {
            return bad(
                name,
                "announces " + std::to_string(blob.content_bytes) + " bytes of " + what + " in " +
                    std::to_string(blob.packed_bytes)
            );
        }
    }
    if (bytes_left != 0) {
        return bad(name, "has " + std::to_string(bytes_left) + " bytes after its last image");
    }
    return {};
}

} // namespace

struct PlacementReader::Impl {
    InputFile file;
    Header header;
    std::vector<Blob> blobs;            ///< the map, then images
    std::vector<std::uint64_t> offsets; ///< of blobs

    /// The content of a blob.
    [[nodiscard]] Result<std::string> content(std::size_t index, const std::string& what) const {
        const Blob& blob = blobs[index];
        const Result<Bytes> packed = file.read(offsets[index], blob.packed_bytes);
        if (!packed) {
            return tl::unexpected(packed.error());
        }
        if (checksum(*packed) != blob.sum) {
            return bad(file.name(), "is damaged: the checksum of " + what + " is another");
        }
        return unpack(*packed, blob.content_bytes, file.name() + ": " + what);
    }
};

PlacementReader::PlacementReader(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
PlacementReader::PlacementReader(PlacementReader&& other) noexcept = default;
PlacementReader& PlacementReader::operator=(PlacementReader&& other) noexcept = default;
PlacementReader::~PlacementReader() = default;

Result<PlacementReader> PlacementReader::open(const std::filesystem::path& path) {
    const std::string name = path.string();
    if (const Result<void> readable = check_byte_order(kSignature, name); !readable) {
        return tl::unexpected(readable.error());
    }
    Result<InputFile> file = InputFile::open(path);
    if (!file) {
        return tl::unexpected(file.error());
    }
    const std::uint64_t size = file->size();
    Result<Bytes> head = file->read(0, std::min<std::uint64_t>(size, kHeaderBytes));
    if (!head) {
        return tl::unexpected(head.error());
    }
    Result<ByteReader> reader = after_signature(*head, kSignature, name);
    if (!reader) {
        return tl::unexpected(reader.error());
    }
    Header header;
    if (!reader->take(header) || size - kHeaderBytes < kSumBytes) {
        return bad(name, "ends in its header, after " + std::to_string(size) + " bytes");
    }
    const bool fits = header.images <= (size - kHeaderBytes - kSumBytes) / sizeof(Blob) &&
                      header.images < UINT32_MAX;
    if (!fits) {
        return bad(
            name,
            "has " + std::to_string(size) + " bytes, too few for a table of " +
                std::to_string(header.images) + " images"
        );
    }
    const std::size_t table_bytes = header.images * sizeof(Blob) + kSumBytes;
    Result<Bytes> table = file->read(kHeaderBytes, table_bytes);
    if (!table) {
        return tl::unexpected(table.error());
    }
    ByteReader rest(*table);
    std::vector<Blob> images;
    std::uint64_t sum = 0;
    const bool is_whole =
        rest.take(images, header.images) && rest.take(sum) &&
        sum == checksum(*head, std::string_view(*table).substr(0, table_bytes - kSumBytes));
    if (!is_whole) {
        return bad(name, "is damaged: the checksum of its table is another");
    }
    std::vector<Blob> blobs = {
        {header.map_content_bytes, header.map_packed_bytes, 0, header.map_sum}};
    blobs.insert(blobs.end(), images.begin(), images.end());
    const std::uint64_t begin = kHeaderBytes + table_bytes;
    if (const Result<void> valid = check_table(blobs, size - begin, name); !valid) {
        return tl::unexpected(valid.error());
    }
    std::vector<std::uint64_t> offsets = {begin};
    for (const Blob& blob : blobs) {
        offsets.push_back(offsets.back() + blob.packed_bytes);
    }
    return PlacementReader(std::make_unique<Impl>(Impl{
        std::move(*file), header, std::move(blobs), std::move(offsets)}));
}

std::uint64_t PlacementReader::making_key() const noexcept {
    return impl_->header.making_key;
}

std::uint32_t PlacementReader::image_count() const noexcept {
    return static_cast<std::uint32_t>(impl_->header.images);
}

std::uint64_t PlacementReader::image_bytes(std::uint32_t image) const noexcept {
    return impl_->blobs[std::size_t{image} + 1].memory_bytes;
}

Result<PlacementMap> PlacementReader::read_map() const {
    const std::string& name = impl_->file.name();
    const Result<std::string> content = impl_->content(0, "its map");
    if (!content) {
        return tl::unexpected(content.error());
    }
    PlacementMap map;
    if (const std::optional<std::string> wrong = take_placement_content(*content, map)) {
        return bad(name + ": its map", *wrong);
    }
    if (map.images.size() != image_count()) {
        return bad(
            name,
            "has " + std::to_string(image_count()) + " images, its map " +
                std::to_string(map.images.size())
        );
    }
    return map;
}

Result<LayeredDepthImage> PlacementReader::read(std::uint32_t image) const {
    const std::string& name = impl_->file.name();
    const std::string what = "image " + std::to_string(image);
    if (image >= image_count() || impl_->blobs[std::size_t{image} + 1] == Blob{}) {
        return fail(
            ErrorCode::not_found,
            name + " does not have " + what + " of " + std::to_string(image_count())
        );
    }
    const Result<std::string> content = impl_->content(std::size_t{image} + 1, what);
    if (!content) {
        return tl::unexpected(content.error());
    }
    LayeredDepthImage read;
    if (const std::optional<std::string> wrong = take_layered_content(*content, read)) {
        return bad(name + ": " + what, *wrong);
    }
    if (memory_bytes(read) != image_bytes(image)) {
        return bad(
            name,
            "announces " + std::to_string(image_bytes(image)) + " bytes in memory of " + what +
                ", which takes " + std::to_string(memory_bytes(read))
        );
    }
    return read;
}

Result<PlacementMap> load_placement_map(const std::filesystem::path& path) {
    const Result<PlacementReader> reader = PlacementReader::open(path);
    if (!reader) {
        return tl::unexpected(reader.error());
    }
    return reader->read_map();
}

struct PlacementWriter::Impl {
    std::filesystem::path path;
    PlacementFileOptions options;
    std::uint64_t map_digest = 0;
    std::uint64_t map_content_bytes = 0;
    std::string packed_map;
    std::vector<Blob> images;

    [[nodiscard]] std::filesystem::path folder() const { return path.string() + ".parts"; }
    [[nodiscard]] std::filesystem::path part(std::size_t image) const {
        return folder() / (std::to_string(image) + std::string(kPartExtension));
    }
    [[nodiscard]] Result<void> keep_part(const std::filesystem::path& file);
    [[nodiscard]] Result<void> keep_parts();
    [[nodiscard]] Result<void> join() const;
};

/// Takes a part into account, or removes it where it is damaged.
Result<void> PlacementWriter::Impl::keep_part(const std::filesystem::path& file) {
    const std::string name = file.string();
    const Result<Bytes> bytes = read_file(file, kMaxFileBytes);
    if (!bytes) {
        return tl::unexpected(bytes.error());
    }
    const Result<PartHeader> header = read_part_header(*bytes, name);
    if (!header && header.error().code == ErrorCode::unsupported) {
        return tl::unexpected(header.error());
    }
    const auto other = [&](const std::string& what) {
        return fail(
            ErrorCode::invalid_argument,
            name + " is of " + what + ": finish that file as it was begun, or remove " +
                folder().string()
        );
    };
    if (header && header->map_digest != map_digest) {
        return other("another map");
    }
    if (header && header->making_key != options.making_key) {
        return other(
            "another making: its key is " + std::to_string(header->making_key) + ", expected " +
            std::to_string(options.making_key)
        );
    }
    if (header && header->level != options.level) {
        return other(
            "another level: " + std::to_string(header->level) + ", expected " +
            std::to_string(options.level)
        );
    }
    // A part of another name is a copy by someone else.
    if (header && header->image < images.size() && file == part(header->image)) {
        images[header->image] = header->blob;
        return {};
    }
    std::error_code failure;
    std::filesystem::remove(file, failure);
    if (failure) {
        return fail(ErrorCode::device, name + " cannot be removed: " + failure.message());
    }
    return {};
}

/// Looks through the folder.
Result<void> PlacementWriter::Impl::keep_parts() {
    std::error_code failure;
    std::filesystem::create_directory(folder(), failure);
    std::vector<std::filesystem::path> files;
    if (!failure) {
        std::filesystem::directory_iterator entry(folder(), failure);
        for (; !failure && entry != std::filesystem::directory_iterator();
             entry.increment(failure)) {
            files.push_back(entry->path());
        }
    }
    if (failure) {
        return fail(ErrorCode::device, folder().string() + " cannot be used: " + failure.message());
    }
    std::sort(files.begin(), files.end());
    for (const std::filesystem::path& file : files) {
        const std::string name = file.filename().string();
        const bool is_left_over = // of a writer that was killed
            name.find(std::string(kPartExtension) + '.') != std::string::npos &&
            file.extension() == ".part";
        if (is_left_over) {
            std::filesystem::remove(file, failure);
        } else if (file.extension() == kPartExtension) {
            if (Result<void> kept = keep_part(file); !kept) {
                return kept;
            }
        }
    }
    return {};
}

/// Writes the file.
Result<void> PlacementWriter::Impl::join() const {
    std::string head;
    append(head, kSignature);
    append(
        head,
        Header{
            options.making_key,
            map_content_bytes,
            packed_map.size(),
            checksum(packed_map),
            images.size()}
    );
    append(head, images);
    append(head, checksum(head));
    Result<OutputFile> file = OutputFile::create(path);
    if (!file) {
        return tl::unexpected(file.error());
    }
    for (const std::string_view bytes : {std::string_view(head), std::string_view(packed_map)}) {
        if (Result<void> written = file->append(bytes); !written) {
            return written;
        }
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
        if (images[i] == Blob{}) {
            continue;
        }
        const Result<Bytes> bytes = read_file(part(i), kMaxFileBytes);
        if (!bytes) {
            return tl::unexpected(bytes.error());
        }
        const Result<PartHeader> header = read_part_header(*bytes, part(i).string());
        if (!header) {
            return tl::unexpected(header.error());
        }
        if (header->blob != images[i]) {
            return bad(part(i).string(), "was changed by another program");
        }
        if (Result<void> written = file->append(std::string_view(*bytes).substr(kPartHeaderBytes));
            !written) {
            return written;
        }
    }
    return file->commit();
}

PlacementWriter::PlacementWriter(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
PlacementWriter::PlacementWriter(PlacementWriter&& other) noexcept = default;
PlacementWriter& PlacementWriter::operator=(PlacementWriter&& other) noexcept = default;
PlacementWriter::~PlacementWriter() = default;

Result<PlacementWriter> PlacementWriter::open(
    const std::filesystem::path& path, const PlacementMap& map, const PlacementFileOptions& options
) {
    const std::string name = path.string();
    if (const Result<void> writable = check_byte_order(kSignature, name); !writable) {
        return tl::unexpected(writable.error());
    }
    if (options.level < 1 || options.level > 19) {
        return fail(
            ErrorCode::invalid_argument,
            name + ": level is " + std::to_string(options.level) + ", expected 1 to 19"
        );
    }
    if (const Result<void> valid = validate(map); !valid) {
        return fail(valid.error().code, name + " is not written: " + valid.error().message);
    }
    const std::string content = placement_content(map);
    Result<std::string> packed = pack(content, kMaxPlacementRatio, options.level);
    if (!packed) {
        return fail(packed.error().code, name + " is not written: " + packed.error().message);
    }
    auto impl = std::make_unique<Impl>();
    impl->path = path;
    impl->options = options;
    impl->map_digest = checksum(content);
    impl->map_content_bytes = content.size();
    impl->packed_map = std::move(*packed);
    impl->images.resize(map.images.size());
    if (const Result<void> kept = impl->keep_parts(); !kept) {
        return tl::unexpected(kept.error());
    }
    return PlacementWriter(std::move(impl));
}

std::uint32_t PlacementWriter::image_count() const noexcept {
    return static_cast<std::uint32_t>(impl_->images.size());
}

bool PlacementWriter::has(std::uint32_t image) const noexcept {
    return impl_->images[image] != Blob{};
}

Result<void> PlacementWriter::add(std::uint32_t image, const LayeredDepthImage& content) {
    const std::string name = impl_->path.string() + ": image " + std::to_string(image);
    if (image >= image_count()) {
        return fail(
            ErrorCode::invalid_argument,
            name + " is not of the map, which has " + std::to_string(image_count())
        );
    }
    if (const Result<void> valid = validate(content); !valid) {
        return fail(valid.error().code, name + " is not written: " + valid.error().message);
    }
    const std::string bytes = layered_content(content);
    const Result<std::string> packed = pack(bytes, kMaxPlacementRatio, impl_->options.level);
    if (!packed) {
        return fail(packed.error().code, name + " is not written: " + packed.error().message);
    }
    const Blob blob = {bytes.size(), packed->size(), memory_bytes(content), checksum(*packed)};
    std::string part;
    append(part, kPartSignature);
    append(
        part,
        PartHeader{impl_->options.making_key, impl_->map_digest, impl_->options.level, image, blob}
    );
    append(part, checksum(part));
    part += *packed;
    if (Result<void> written = write_file(impl_->part(image), part); !written) {
        return written;
    }
    impl_->images[image] = blob;
    return {};
}

Result<void> PlacementWriter::finish() {
    const auto missing = std::count(impl_->images.begin(), impl_->images.end(), Blob{});
    if (missing > 0 && !impl_->options.partial) {
        const auto first = std::find(impl_->images.begin(), impl_->images.end(), Blob{});
        return fail(
            ErrorCode::not_found,
            impl_->path.string() + " cannot be finished: " + std::to_string(missing) + " of " +
                std::to_string(image_count()) + " images are missing, the first is " +
                std::to_string(first - impl_->images.begin())
        );
    }
    if (Result<void> joined = impl_->join(); !joined) {
        return joined;
    }
    // What cannot be removed is found again, and does no harm.
    std::error_code ignored;
    for (std::size_t i = 0; i < impl_->images.size(); ++i) {
        std::filesystem::remove(impl_->part(i), ignored);
    }
    std::filesystem::remove(impl_->folder(), ignored);
    return {};
}

} // namespace farfield::io
