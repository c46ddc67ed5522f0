#include "image/hand_made_cubes.hpp"
#include "io/color_cube_bytes.hpp"
#include "io/files.hpp"
#include <farfield/io/color_cube_file.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <string>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr std::uint64_t kKey = 0x0123456789ABCDEFULL;

/// The bytes of a file of `hand_made_cubes`.
std::string whole_file(const TemporaryFolder& folder) {
    const std::filesystem::path path = folder.path() / "whole.cubes";
    REQUIRE(io::write_color_cubes(path, hand_made_cubes(), kKey).has_value());
    return read_bytes(path.string());
}

/// Why a file with these bytes is refused.
Error refusal(TemporaryFolder& folder, const std::string& bytes) {
    const auto path = folder.write("a.cubes", bytes);
    const Result<ColorCubeModel> read = io::read_color_cubes(path);
    REQUIRE_FALSE(read.has_value());
    CHECK_THAT(read.error().message, Catch::StartsWith(path.string()));
    return read.error();
}

void check_message(const Error& error, ErrorCode code, const std::string& text) {
    CHECK(error.code == code);
    CHECK_THAT(error.message, Catch::Contains(text));
}

/// A model whose `cells` cells all look the same.
ColorCubeModel dull_model(std::uint32_t cells) {
    ColorCubeModel model;
    model.item_count = 1;
    ColorCubeTree& tree = model.trees.emplace_back();
    tree.edge = 1.0F;
    tree.items = {ItemId{0}};
    tree.item_primitives = {1};
    // Light sets take the place of cells, which cannot all be alike.
    tree.cells.resize(1);
    tree.light_sets = cells;
    tree.cubes.resize(cells);
    tree.contents = {ColorCubeTree::kLast};
    tree.quality = {0, 1};
    return model;
}

} // namespace

TEST_CASE("A model is read as it was written, and the same model gives the same bytes") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "a.cubes";
    const ColorCubeModel model = hand_made_cubes();
    REQUIRE(io::write_color_cubes(path, model, kKey).has_value());
    const std::string bytes = read_bytes(path.string());
    const Result<ColorCubeModel> read = io::read_color_cubes(path, kKey);
    INFO((read ? "" : read.error().message));
    REQUIRE(read.has_value());
    CHECK(*read == model);
    REQUIRE(io::write_color_cubes(path, *read, kKey).has_value());
    CHECK(read_bytes(path.string()) == bytes);
    // The layout that the header describes.
    CHECK(
        bytes.substr(0, 8) == "\x89"
                              "FFC\r\n\x1a\n"
    );
    CHECK(bytes.substr(kByteOrderAt, 8) == std::string("\x04\x03\x02\x01\x02\0\0\0", 8));
    CHECK(bytes.substr(16, 8) == "\xEF\xCD\xAB\x89\x67\x45\x23\x01");
    std::string sealed = bytes;
    seal(sealed);
    CHECK(sealed == bytes);
    std::string start;
    append(start, model.origin);
    append(start, model.item_count);
    append(start, std::uint32_t{2});
    append(start, std::uint64_t{2});
    const std::string content = unpacked(bytes);
    CHECK(content.substr(0, start.size()) == start);
    // Model, references; 15 numbers of four bytes and seven of eight for each tree, and its arrays.
    CHECK(
        content.size() == 40 + 2 * 64 + std::size_t{2} * std::size_t{15U * 4U + 56U} +
                              memory_bytes(model) - std::size_t{2} * 64
    );
    CHECK(
        std::distance(
            std::filesystem::directory_iterator(folder.path()),
            std::filesystem::directory_iterator()
        ) == 1
    );
}

TEST_CASE("A model of another scene is told apart") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "a.cubes";
    REQUIRE(io::write_color_cubes(path, hand_made_cubes(), 17).has_value());
    CHECK(io::read_color_cubes(path).has_value());
    CHECK(io::read_color_cubes(path, 17).has_value());
    const Result<ColorCubeModel> read = io::read_color_cubes(path, 18);
    REQUIRE_FALSE(read.has_value());
    check_message(
        read.error(),
        ErrorCode::bad_data,
        path.string() + " is of another scene: its key is 17, expected 18"
    );
}

TEST_CASE("Every changed byte and every missing end is an error") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    for (std::size_t at = 0; at < whole.size(); ++at) {
        for (const int change : {0x01, 0x80, 0xFF}) {
            std::string bytes = whole;
            bytes[at] = static_cast<char>(bytes[at] ^ change);
            INFO("byte " << at << " changed by " << change);
            CHECK_FALSE(refusal(folder, bytes).message.empty());
        }
        INFO("cut to " << at);
        CHECK_FALSE(refusal(folder, whole.substr(0, at)).message.empty());
    }
    check_message(refusal(folder, ""), ErrorCode::bad_data, "is no file of colour cubes");
    check_message(refusal(folder, "v 0 0 0\n"), ErrorCode::bad_data, "is no file of colour cubes");
    check_message(
        refusal(folder, whole.substr(0, 20)), ErrorCode::bad_data, "ends in its header, after 20"
    );
    check_message(refusal(folder, whole + '\0'), ErrorCode::bad_data, "its header says");
    std::string damaged = whole;
    damaged.back() = static_cast<char>(damaged.back() ^ 1);
    check_message(refusal(folder, damaged), ErrorCode::bad_data, "is damaged: its checksum");
}

TEST_CASE("Other versions and the other byte order are named") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    std::string bytes = whole;
    put(bytes, kVersionAt, std::uint32_t{1});
    check_message(
        refusal(folder, bytes), ErrorCode::unsupported, "has version 1 of the format, expected 2"
    );
    bytes = whole;
    put(bytes, kByteOrderAt, std::uint32_t{0x04030201});
    check_message(refusal(folder, bytes), ErrorCode::unsupported, "has the other byte order");
}

TEST_CASE("What a file announces is bounded by its own size") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    std::string bytes = whole;
    put(bytes, kContentBytesAt, std::uint64_t{1} << 60U);
    seal(bytes);
    check_message(
        refusal(folder, bytes), ErrorCode::bad_data, "announces 1152921504606846976 bytes"
    );
    bytes = whole;
    put(bytes, kPackedBytesAt, UINT64_MAX);
    seal(bytes);
    check_message(refusal(folder, bytes), ErrorCode::bad_data, "says 18446744073709551615");
    // More is packed than announced, and less.
    const std::string content = unpacked(whole);
    bytes = whole;
    put(bytes, kContentBytesAt, std::uint64_t{content.size() - 1});
    seal(bytes);
    check_message(refusal(folder, bytes), ErrorCode::bad_data, "cannot be unpacked");
    bytes = whole;
    put(bytes, kContentBytesAt, std::uint64_t{content.size() + 1});
    seal(bytes);
    check_message(refusal(folder, bytes), ErrorCode::bad_data, "bytes of content, its header says");
    // Numbers inside: trees (at 28), references (at 32), cells of the first tree.
    std::string other = content;
    put(other, 28, UINT32_MAX);
    check_message(
        refusal(folder, repacked(whole, other)), ErrorCode::bad_data, "ends in tree 2 of 4294967295"
    );
    other = content;
    put(other, 32, std::uint64_t{1} << 60U);
    check_message(refusal(folder, repacked(whole, other)), ErrorCode::bad_data, "references");
    constexpr std::size_t kCellsAt = 40 + 2 * 64 + 15 * 4;
    for (std::size_t number = 0; number < 7; ++number) {
        other = content;
        put(other, kCellsAt + number * 8, std::uint64_t{1} << 62U);
        check_message(
            refusal(folder, repacked(whole, other)), ErrorCode::bad_data, "ends in tree 0 of 2"
        );
    }
    other = content + "more";
    check_message(
        refusal(folder, repacked(whole, other)), ErrorCode::bad_data, "4 bytes after the last tree"
    );
}

TEST_CASE("A whole file with a wrong model is refused by what is wrong with it") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    std::string content = unpacked(whole);
    put(content, 24, std::uint32_t{6});
    check_message(
        refusal(folder, repacked(whole, content)), ErrorCode::bad_data, "item_count is 6, but 5"
    );
}

TEST_CASE("Models that pack too well are filled up, so that they can be read") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "dull.cubes";
    constexpr std::uint32_t kCells = 1U << 18U;
    const ColorCubeModel model = dull_model(kCells);
    REQUIRE(io::write_color_cubes(path, model).has_value());
    const std::uint64_t bytes = std::filesystem::file_size(path);
    CHECK(bytes * io::kMaxColorCubeRatio >= memory_bytes(model));
    // What zstd makes of zeros is far less, so that the file is as small as it may be.
    CHECK(bytes * io::kMaxColorCubeRatio < memory_bytes(model) + 100 * io::kMaxColorCubeRatio);
    const Result<ColorCubeModel> read = io::read_color_cubes(path);
    REQUIRE(read.has_value());
    CHECK(*read == model);
}

TEST_CASE("What cannot be read back is not written, and what was there stays") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "a.cubes";
    ColorCubeModel model = hand_made_cubes();
    REQUIRE(io::write_color_cubes(path, model).has_value());
    model.trees[0].contents[1] = 5;
    const Result<void> written = io::write_color_cubes(path, model);
    REQUIRE_FALSE(written.has_value());
    check_message(
        written.error(),
        ErrorCode::bad_data,
        path.string() + " is not written: colour cubes: tree 0, cell 1: entry 1"
    );
    CHECK(io::read_color_cubes(path).has_value());
}

TEST_CASE("Files that are not there, and places that cannot be written") {
    TemporaryFolder folder;
    const auto missing = io::read_color_cubes(folder.path() / "none.cubes");
    REQUIRE_FALSE(missing.has_value());
    CHECK(missing.error().code == ErrorCode::not_found);
    CHECK_FALSE(io::read_color_cubes(folder.path()).has_value());
    const auto path = folder.path() / "none" / "a.cubes";
    const Result<void> written = io::write_color_cubes(path, hand_made_cubes());
    REQUIRE_FALSE(written.has_value());
    check_message(written.error(), ErrorCode::device, path.string());
}
