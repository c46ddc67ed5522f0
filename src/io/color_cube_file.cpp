#include "io/binary.hpp"
#include "io/file.hpp"
#include <farfield/io/color_cube_file.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace farfield::io {
namespace {

constexpr Signature kSignature = {
    "\x89"
    "FFC\r\n\x1a\n",
    2,
    "file of colour cubes"};
constexpr std::size_t kHeaderBytes = 48;
constexpr std::size_t kChecksumAt = kHeaderBytes - 8;
/// More than any machine holds, and far from what overflows.
constexpr std::uint64_t kMaxFileBytes = 1ULL << 44U;
/// Of zstd: its default.
constexpr int kLevel = 3;

// Elements are copied as they lie in memory, so they must have no gaps.
static_assert(
    sizeof(CubeCell) == 8 && sizeof(ColorCube) == 24 && sizeof(CubeGain) == 3 &&
    sizeof(LevelFactors) == 24
);
static_assert(sizeof(CubePrimitives) == 12 && sizeof(ItemId) == 4 && sizeof(CubeReference) == 64);

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

bool take_tree(ByteReader& reader, ColorCubeTree& tree) {
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
    ByteReader reader(content);
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
    Result<ByteReader> reader = after_signature(bytes, kSignature, name);
    if (!reader) {
        return tl::unexpected(reader.error());
    }
    std::uint64_t packed_bytes = 0;
    std::uint64_t sum = 0;
    Header header;
    if (!reader->take(header.scene_key) || !reader->take(header.content_bytes) ||
        !reader->take(packed_bytes) || !reader->take(sum)) {
        return bad("ends in its header, after " + std::to_string(bytes.size()) + " bytes");
    }
    if (packed_bytes != reader->left()) {
        return bad(
            "has " + std::to_string(reader->left()) + " bytes of content, its header says " +
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
    if (const Result<void> readable = check_byte_order(kSignature, name); !readable) {
        return tl::unexpected(readable.error());
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
    const Result<std::string> content =
        unpack(std::string_view(*bytes).substr(kHeaderBytes), header->content_bytes, name);
    if (!content) {
        return tl::unexpected(content.error());
    }
    ColorCubeModel model;
    if (const std::optional<std::string> wrong = take_content(*content, model)) {
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
    if (Result<void> writable = check_byte_order(kSignature, name); !writable) {
        return writable;
    }
    if (const Result<void> valid = validate(model); !valid) {
        return fail(valid.error().code, name + " is not written: " + valid.error().message);
    }
    std::string content = content_of(model);
    const std::uint64_t content_bytes = content.size();
    const Result<std::string> rest = pack(content, kMaxColorCubeRatio, kLevel);
    content = {};
    if (!rest) {
        return fail(rest.error().code, name + " is not written: " + rest.error().message);
    }
    std::string bytes;
    append(bytes, kSignature);
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
