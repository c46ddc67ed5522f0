// Damaged files of colour cubes. Most damage is found by the checksum alone, so contents are
// damaged as well and packed again as a file that is whole: each must be refused with a message or
// give a model that passes `validate`.
#include "fuzz/mutator.hpp"
#include "image/hand_made_cubes.hpp"
#include "io/color_cube_bytes.hpp"
#include "io/files.hpp"
#include <farfield/io/color_cube_file.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr int kRuns = 6000;

} // namespace

TEST_CASE("Damaged files of colour cubes are refused") {
    TemporaryFolder folder;
    const auto whole_path = folder.path() / "whole.cubes";
    REQUIRE(io::write_color_cubes(whole_path, hand_made_cubes()).has_value());
    const std::string whole = read_bytes(whole_path.string());
    Mutator mutator(7);
    for (int run = 0; run < kRuns; ++run) {
        const std::string bytes = mutator.mutate(whole);
        const auto read = io::read_color_cubes(folder.write("a.cubes", bytes));
        if (read ? bytes != whole : read.error().message.empty()) {
            FAIL("run " << run << " was read, or refused without a message");
        }
    }
    for (int run = 0; run < kRuns / 6; ++run) { // nothing but the beginning of one
        std::string bytes(mutator.below(200), '\0');
        std::generate(bytes.begin(), bytes.end(), [&] {
            return static_cast<char>(mutator.below(256));
        });
        bytes.insert(0, whole, 0, mutator.below(kCubeHeaderBytes + 1));
        REQUIRE_FALSE(io::read_color_cubes(folder.write("a.cubes", bytes)).has_value());
    }
}

TEST_CASE("Damaged contents of whole files are refused or give a valid model") {
    TemporaryFolder folder;
    const auto whole_path = folder.path() / "whole.cubes";
    REQUIRE(io::write_color_cubes(whole_path, hand_made_cubes()).has_value());
    const std::string whole = read_bytes(whole_path.string());
    const std::string content = unpacked(whole);
    Mutator mutator(8);
    int loaded = 0;
    int refused = 0;
    for (int run = 0; run < kRuns; ++run) {
        std::string bytes;
        if (run % 4 == 0) { // what zstd unpacks is damaged, and the checksum fits
            bytes =
                whole.substr(0, kCubeHeaderBytes) + mutator.mutate(whole.substr(kCubeHeaderBytes));
            put(bytes, kPackedBytesAt, std::uint64_t{bytes.size() - kCubeHeaderBytes});
            seal(bytes);
        } else {
            bytes = repacked(whole, mutator.mutate(content));
        }
        const auto read = io::read_color_cubes(folder.write("a.cubes", bytes));
        if (!read) {
            ++refused;
            if (read.error().message.empty()) {
                FAIL("run " << run << " was refused without a message");
            }
            continue;
        }
        ++loaded;
        if (const auto checked = validate(*read); !checked) {
            FAIL("run " << run << ": " << checked.error().message);
        }
    }
    // Both ways must have been taken, or the damage is too small or too great to find anything.
    CHECK(loaded > 100);
    CHECK(refused > 1000);
}
