#include "io/files.hpp"
#include <farfield/io/png.hpp>

#include <catch2/catch.hpp>

#include <fstream>
#include <iterator>
#include <random>

using namespace farfield;

namespace {

Picture make_picture(int width, int height, bool opaque) {
    Picture picture{width, height, {}};
    std::mt19937 random(11);
    picture.rgba.resize(
        std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)
    );
    for (std::size_t i = 0; i < picture.rgba.size(); ++i) {
        picture.rgba[i] =
            opaque && i % 4 == 3 ? std::uint8_t{255} : static_cast<std::uint8_t>(random());
    }
    return picture;
}

std::string read(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Color type in the header: 2 for RGB, 6 for RGBA.
int color_type(const std::filesystem::path& path) {
    return read(path).at(25);
}

} // namespace

TEST_CASE("a picture comes back as it was written, with alpha only where it is needed") {
    const bool opaque = GENERATE(true, false);
    const auto [width, height] = GENERATE(std::pair{1, 1}, std::pair{37, 5}, std::pair{3, 64});
    support::TemporaryFolder folder;
    const auto path = folder.path() / "picture.png";
    const Picture picture = make_picture(width, height, opaque);
    REQUIRE(io::write_png(path, picture).has_value());
    const auto again = io::read_png(path);
    REQUIRE(again.has_value());
    CHECK(*again == picture);
    if (opaque || width * height > 1) {
        CHECK(color_type(path) == (opaque ? 2 : 6));
    }
    REQUIRE(io::write_png(path, make_picture(2, 2, true)).has_value()); // over the old one
    CHECK(io::read_png(path)->width == 2);
    // Nothing else is left in the folder.
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("write_png refuses what is no picture and leaves the old file alone") {
    support::TemporaryFolder folder;
    const auto path = folder.write("picture.png", "old");
    for (const Picture& picture :
         {Picture{},
          Picture{1, -1, {}},
          Picture{2, 2, std::vector<std::uint8_t>(15)},
          Picture{20000, 1, std::vector<std::uint8_t>(80000)}}) {
        const auto written = io::write_png(path, picture);
        REQUIRE_FALSE(written.has_value());
        CHECK(written.error().code == ErrorCode::invalid_argument);
    }
    CHECK(read(path) == "old");
}

TEST_CASE("write_png says when there is no place to write") {
    support::TemporaryFolder folder;
    const auto nowhere = io::write_png(folder.path() / "none" / "a.png", make_picture(1, 1, true));
    REQUIRE_FALSE(nowhere.has_value());
    CHECK(nowhere.error().code == ErrorCode::device);
    std::filesystem::create_directories(folder.path() / "taken.png" / "full");
    CHECK_FALSE(io::write_png(folder.path() / "taken.png", make_picture(1, 1, true)).has_value());
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("read_png refuses what is no whole PNG before it allocates for it") {
    support::TemporaryFolder folder;
    CHECK(io::read_png(folder.path() / "none.png").error().code == ErrorCode::not_found);
    CHECK_FALSE(io::read_png(folder.write("empty.png", "")).has_value());
    CHECK_FALSE(io::read_png(folder.write("text.png", std::string(100, 'x'))).has_value());
    const auto path = folder.path() / "whole.png";
    REQUIRE(io::write_png(path, make_picture(16, 16, false)).has_value());
    const std::string whole = read(path);
    for (std::size_t length = 0; length + 12 < whole.size(); length += 7) {
        CHECK_FALSE(io::read_png(folder.write("cut.png", whole.substr(0, length))).has_value());
    }
    std::string huge = whole;
    huge.replace(16, 4, std::string("\x00\x00\x40\x00", 4)); // 16384 wide
    huge.replace(20, 4, std::string("\x00\x00\x40\x00", 4));
    const auto refused = io::read_png(folder.write("huge.png", huge));
    REQUIRE_FALSE(refused.has_value());
    CHECK_THAT(refused.error().message, Catch::Contains("announces 16384 x 16384 texels"));
}
