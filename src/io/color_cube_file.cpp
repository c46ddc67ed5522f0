#include "core/digest.hpp"
#include "io/file.hpp"
#include <farfield/io/color_cube_file.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>
#include <zstd.h>

namespace farfield::io {
namespace {

constexpr std::string_view kMagic = "\x89"
                                    "FFC\r\n\x1a\n";
constexpr std::uint32_t kByteOrder = 0x01020304;
constexpr std::uint32_t kOtherByteOrder = 0x04030201;
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kHeaderBytes = 48;
constexpr std::size_t kChecksumAt = kHeaderBytes - 8;
/// More than any machine holds, and far from what overflows.
constexpr std::uint64_t kMaxFileBytes = 1ULL << 44U;
constexpr bool kLittleEndian = std::endian::native == std::endian::little;

// Elements are copied as they lie in memory, so they must have no gaps.
static_assert(
    sizeof(CubeCell) == 8 && sizeof(ColorCube) == 24 && sizeof(CubeGain) == 3 &&
    sizeof(LevelFactors) == 24
);
static_assert(sizeof(CubePrimitives) == 12 && sizeof(ItemId) == 4 && sizeof(CubeReference) == 64);

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
class Reader {
  public:
    explicit Reader(std::string_view bytes) noexcept : rest_(bytes) {}

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

    [[nodiscard]] std::size_t left() const noexcept { return rest_.size(); }

  private:
    std::string_view rest_;
};

/// Numbers of the elements of a tree, as they are stored.
struct Counts {
    std::uint64_t cells = 0;
    std::uint64_t cubes = 0;
    std::uint64_t gains = 0;
    std::uint64_t level_factors = 0;
    std::uint64_t contents = 0;
    std::uint64_t items = 0;
    std::uint64_t primitives = 0;
};
static_assert(sizeof(Counts) == 56);

std::string content_of(const ColorCubeModel& model) {
    std::string bytes;
    // Arrays and, generously, the numbers between them.
    bytes.reserve(memory_bytes(model) + 128 * (model.trees.size() + 1));
    append(bytes, model.origin);
    append(bytes, model.item_count);
    append(bytes, static_cast<std::uint32_t>(model.trees.size()));
    append(bytes, std::uint64_t{model.references.size()});
    append(bytes, model.references);
    for (const ColorCubeTree& tree : model.trees) {
        append(bytes, tree.lo);
        append(bytes, tree.edge);
        append(bytes, tree.bounds);
        append(bytes, tree.light_sets);
        append(bytes, tree.reference_count);
        append(bytes, tree.overhang);
        append(bytes, tree.quality.depth);
        append(bytes, tree.quality.leaves);
        const Counts counts = {
            tree.cells.size(),
            tree.cubes.size(),
            tree.gains.size(),
            tree.level_factors.size(),
            tree.contents.size(),
            tree.items.size(),
            tree.primitives.size()};
        append(bytes, counts);
        append(bytes, tree.cells);
        append(bytes, tree.cubes);
        append(bytes, tree.gains);
        append(bytes, tree.level_factors);
        append(bytes, tree.contents);
        append(bytes, tree.items);
        append(bytes, tree.item_primitives);
        append(bytes, tree.primitives);
    }
    return bytes;
}

bool take_tree(Reader& reader, ColorCubeTree& tree) {
    Counts counts;
    return reader.take(tree.lo) && reader.take(tree.edge) && reader.take(tree.bounds) &&
           reader.take(tree.light_sets) && reader.take(tree.reference_count) &&
           reader.take(tree.overhang) && reader.take(tree.quality.depth) &&
           reader.take(tree.quality.leaves) && reader.take(counts) &&
           reader.take(tree.cells, counts.cells) && reader.take(tree.cubes, counts.cubes) &&
           reader.take(tree.gains, counts.gains) &&
           reader.take(tree.level_factors, counts.level_factors) &&
           reader.take(tree.contents, counts.contents) && reader.take(tree.items, counts.items) &&
           reader.take(tree.item_primitives, counts.items) &&
           reader.take(tree.primitives, counts.primitives);
}

/// @return what is wrong with the content, or nothing
std::optional<std::string> take_content(std::string_view content, ColorCubeModel& model) {
    Reader reader(content);
    std::uint32_t trees = 0;
    std::uint64_t references = 0;
    if (!reader.take(model.origin) || !reader.take(model.item_count) || !reader.take(trees) ||
        !reader.take(references) || !reader.take(model.references, references)) {
        return "ends in its " + std::to_string(references) + " references";
    }
    // One by one: what a damaged number announces is not there.
    for (std::uint32_t i = 0; i < trees; ++i) {
        if (!take_tree(reader, model.trees.emplace_back())) {
            return "ends in tree " + std::to_string(i) + " of " + std::to_string(trees);
        }
    }
    if (reader.left() != 0) {
        return "has " + std::to_string(reader.left()) + " bytes after the last tree";
    }
    return std::nullopt;
}

std::uint64_t checksum(std::string_view packed, std::string_view header) noexcept {
    Digest digest;
    digest.add(std::as_bytes(std::span(packed)));
    digest.add(std::as_bytes(std::span(header)));
    return digest.value();
}

/// Packs content and fills it up to what `kMaxColorCubeRatio` asks for.
Result<std::string> packed(const std::string& content) {
    struct Free {
        void operator()(ZSTD_CCtx* context) const noexcept { ZSTD_freeCCtx(context); }
    };
    const std::unique_ptr<ZSTD_CCtx, Free> context(ZSTD_createCCtx());
    if (!context) {
        return fail(ErrorCode::out_of_memory, "no memory for zstd");
    }
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
    std::string bytes(ZSTD_compressBound(content.size()), '\0');
    const std::size_t size =
        ZSTD_compress2(context.get(), bytes.data(), bytes.size(), content.data(), content.size());
    if (ZSTD_isError(size) != 0U) {
        return fail(ErrorCode::out_of_memory, std::string("zstd: ") + ZSTD_getErrorName(size));
    }
    bytes.resize(size);
    if (content.size() / kMaxColorCubeRatio >= size) {
        // A frame that zstd skips, of at least one byte after its own header.
        const auto filling =
            static_cast<std::uint32_t>(content.size() / kMaxColorCubeRatio - size + 1);
        append(bytes, std::uint32_t{ZSTD_MAGIC_SKIPPABLE_START});
        append(bytes, filling);
        bytes.append(filling, '\0');
    }
    return bytes;
}

/// What is in front of the content.
struct Header {
    std::uint64_t scene_key = 0;
    std::uint64_t content_bytes = 0;
};

/// Checks all of a file but what its content says.
Result<Header> read_header(std::string_view bytes, const std::string& name) {
    const auto bad = [&name](std::string what) {
        return fail(ErrorCode::bad_data, name + ' ' + std::move(what));
    };
    if (bytes.substr(0, kMagic.size()) != kMagic) {
        return bad("is no file of colour cubes");
    }
    Reader reader(bytes.substr(kMagic.size()));
    std::uint32_t byte_order = 0;
    std::uint32_t version = 0;
    std::uint64_t packed_bytes = 0;
    std::uint64_t sum = 0;
    Header header;
    if (!reader.take(byte_order) || !reader.take(version) || !reader.take(header.scene_key) ||
        !reader.take(header.content_bytes) || !reader.take(packed_bytes) || !reader.take(sum)) {
        return bad("ends in its header, after " + std::to_string(bytes.size()) + " bytes");
    }
    if (byte_order == kOtherByteOrder) {
        return fail(ErrorCode::unsupported, name + " has the other byte order");
    }
    if (byte_order != kByteOrder) {
        return bad("has a damaged header: its byte order is " + std::to_string(byte_order));
    }
    if (version != kVersion) {
        return fail(
            ErrorCode::unsupported,
            name + " has version " + std::to_string(version) + " of the format, expected " +
                std::to_string(kVersion)
        );
    }
    if (packed_bytes != reader.left()) {
        return bad(
            "has " + std::to_string(reader.left()) + " bytes of content, its header says " +
            std::to_string(packed_bytes)
        );
    }
    if (header.content_bytes / kMaxColorCubeRatio > packed_bytes) {
        return bad(
            "announces " + std::to_string(header.content_bytes) + " bytes of content in " +
            std::to_string(packed_bytes)
        );
    }
    if (checksum(bytes.substr(kHeaderBytes), bytes.substr(0, kChecksumAt)) != sum) {
        return bad("is damaged: its checksum is another");
    }
    return header;
}

Result<ColorCubeModel>
read(const std::filesystem::path& path, std::optional<std::uint64_t> expected_key) {
    const std::string name = path.string();
    if (!kLittleEndian) {
        return fail(ErrorCode::unsupported, name + ": no colour cubes on big-endian machines");
    }
    const Result<Bytes> bytes = read_file(path, kMaxFileBytes);
    if (!bytes) {
        return tl::unexpected(bytes.error());
    }
    const Result<Header> header = read_header(*bytes, name);
    if (!header) {
        return tl::unexpected(header.error());
    }
    if (expected_key && *expected_key != header->scene_key) {
        return fail(
            ErrorCode::bad_data,
            name + " is of another scene: its key is " + std::to_string(header->scene_key) +
                ", expected " + std::to_string(*expected_key)
        );
    }
    std::string content(header->content_bytes, '\0');
    const std::size_t size = ZSTD_decompress(
        content.data(), content.size(), bytes->data() + kHeaderBytes, bytes->size() - kHeaderBytes
    );
    if (ZSTD_isError(size) != 0U) {
        return fail(ErrorCode::bad_data, name + " cannot be unpacked: " + ZSTD_getErrorName(size));
    }
    if (size != content.size()) {
        return fail(
            ErrorCode::bad_data,
            name + " has " + std::to_string(size) + " bytes of content, its header says " +
                std::to_string(content.size())
        );
    }
    ColorCubeModel model;
    if (const std::optional<std::string> wrong = take_content(content, model)) {
        return fail(ErrorCode::bad_data, name + ": its content " + *wrong);
    }
    if (const Result<void> valid = validate(model); !valid) {
        return fail(valid.error().code, name + ": " + valid.error().message);
    }
    return model;
}

} // namespace

Result<void> write_color_cubes(
    const std::filesystem::path& path, const ColorCubeModel& model, std::uint64_t scene_key
) {
    const std::string name = path.string();
    if (!kLittleEndian) {
        return fail(ErrorCode::unsupported, name + ": no colour cubes on big-endian machines");
    }
    if (const Result<void> valid = validate(model); !valid) {
        return fail(valid.error().code, name + " is not written: " + valid.error().message);
    }
    std::string content = content_of(model);
    const std::uint64_t content_bytes = content.size();
    const Result<std::string> rest = packed(content);
    content = {};
    if (!rest) {
        return fail(rest.error().code, name + " is not written: " + rest.error().message);
    }
    std::string bytes(kMagic);
    append(bytes, kByteOrder);
    append(bytes, kVersion);
    append(bytes, scene_key);
    append(bytes, content_bytes);
    append(bytes, std::uint64_t{rest->size()});
    append(bytes, checksum(*rest, bytes));
    bytes += *rest;
    return write_file(path, bytes);
}

Result<ColorCubeModel> read_color_cubes(const std::filesystem::path& path) {
    return read(path, std::nullopt);
}

Result<ColorCubeModel>
read_color_cubes(const std::filesystem::path& path, std::uint64_t expected_key) {
    return read(path, expected_key);
}

} // namespace farfield::io
