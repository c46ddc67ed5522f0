// Damaged files of placed images. Most damage is found by checksums alone, so contents are damaged
// as well and packed again as a file that is whole: each must be refused with a message or give a
// map and images that pass `validate`.
#include "fuzz/mutator.hpp"
#include "io/files.hpp"
#include "io/hand_made_placement.hpp"
#include "io/placement_bytes.hpp"
#include <farfield/io/placement_file.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <type_traits>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr int kRuns = 6000;
constexpr std::uint32_t kImages = 2;

std::string whole_file(const TemporaryFolder& folder) {
    const auto path = folder.path() / "whole.placed";
    auto writer = io::PlacementWriter::open(path, hand_made_placement(kImages), {.level = 1});
    REQUIRE(writer.has_value());
    for (std::uint32_t i = 0; i < kImages; ++i) {
        REQUIRE(writer->add(i, hand_made_layers(i)).has_value());
    }
    REQUIRE(writer->finish().has_value());
    return read_bytes(path.string());
}

/// What became of a map and of images that were read.
struct Tally {
    int loaded = 0;
    int refused = 0;

    template <typename T>
    void add(const Result<T>& read) {
        ++(read ? loaded : refused);
        if (!read && read.error().message.empty()) {
            FAIL("refused without a message");
        }
        if constexpr (!std::is_same_v<T, io::PlacementReader>) {
            if (const auto valid = read ? validate(*read) : Result<void>(); !valid) {
                FAIL("read, but " << valid.error().message);
            }
        }
    }
};

/// Reads all of a file.
Tally read_all(const std::filesystem::path& path) {
    Tally tally;
    const Result<io::PlacementReader> reader = io::PlacementReader::open(path);
    if (!reader) {
        tally.add(reader);
        return tally;
    }
    tally.add(reader->read_map());
    for (std::uint32_t i = 0; i < reader->image_count(); ++i) {
        tally.add(reader->read(i));
    }
    return tally;
}

} // namespace

TEST_CASE("Damaged files of placed images are refused") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    Mutator mutator(7);
    for (int run = 0; run < kRuns; ++run) {
        const std::string bytes = mutator.mutate(whole);
        INFO("run " << run);
        CHECK((read_all(folder.write("a.placed", bytes)).refused > 0 || bytes == whole));
    }
}

TEST_CASE("Damaged contents of whole files are refused or give valid maps and images") {
    TemporaryFolder folder;
    const PlacementPieces whole = placement_pieces(whole_file(folder));
    Mutator mutator(8);
    Tally all;
    for (int run = 0; run < kRuns; ++run) {
        PlacementPieces pieces = whole;
        if (run % 4 == 0) {
            pieces.map = mutator.mutate(pieces.map);
        } else {
            const std::size_t image = mutator.below(kImages);
            pieces.images[image] = mutator.mutate(pieces.images[image]);
        }
        std::string bytes = placement_bytes(pieces);
        if (run % 8 == 7) { // sizes of the table, and the checksum fits
            put(bytes,
                kPlacementMapAt + 8 * mutator.below(12),
                std::uint64_t{1} << mutator.below(64));
            if (get<std::uint64_t>(bytes, kPlacementImagesAt) == kImages) {
                seal_placement(bytes);
            }
        }
        INFO("run " << run);
        const Tally tally = read_all(folder.write("a.placed", bytes));
        all.loaded += tally.loaded;
        all.refused += tally.refused;
    }
    // Of three things at most one is damaged, so most are loaded; but enough of the damage must
    // have been found for it to be any.
    CHECK(all.loaded > kRuns);
    CHECK(all.refused > kRuns / 4);
}
