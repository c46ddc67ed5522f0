#include "image/analytic_views.hpp"
#include "image/layered_images.hpp"
#include "io/files.hpp"
#include "io/hand_made_placement.hpp"
#include "io/placement_bytes.hpp"
#include <farfield/image/build_layered_image.hpp>
#include <farfield/io/placement_file.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr std::uint64_t kKey = 0x0123456789ABCDEFULL;
constexpr io::PlacementFileOptions kOptions = {.making_key = kKey, .level = 3};

io::PlacementWriter open_writer(
    const std::filesystem::path& path,
    const PlacementMap& map,
    const io::PlacementFileOptions& options = kOptions
) {
    Result<io::PlacementWriter> writer = io::PlacementWriter::open(path, map, options);
    INFO((writer ? "" : writer.error().message));
    REQUIRE(writer.has_value());
    return std::move(*writer);
}

/// The bytes of a file of `hand_made_placement` and `hand_made_layers`.
std::string whole_file(const TemporaryFolder& folder, std::uint32_t images = 3) {
    const std::filesystem::path path = folder.path() / "whole.placed";
    io::PlacementWriter writer = open_writer(path, hand_made_placement(images));
    for (std::uint32_t i = 0; i < images; ++i) {
        REQUIRE(writer.add(i, hand_made_layers(i)).has_value());
    }
    REQUIRE(writer.finish().has_value());
    return read_bytes(path.string());
}

/// The first thing that reading all of a file finds wrong, or no message.
Error first_error(const std::filesystem::path& path) {
    const Result<io::PlacementReader> reader = io::PlacementReader::open(path);
    if (!reader) {
        return reader.error();
    }
    if (const Result<PlacementMap> map = reader->read_map(); !map) {
        return map.error();
    }
    for (std::uint32_t i = 0; i < reader->image_count(); ++i) {
        if (const Result<LayeredDepthImage> image = reader->read(i); !image) {
            return image.error();
        }
    }
    return {};
}

/// Why a file with these bytes is refused.
Error refusal(TemporaryFolder& folder, const std::string& bytes) {
    const auto path = folder.write("a.placed", bytes);
    Error error = first_error(path);
    CHECK_THAT(error.message, Catch::StartsWith(path.string()));
    return error;
}

void check_message(const Error& error, ErrorCode code, const std::string& text) {
    CHECK(error.code == code);
    CHECK_THAT(error.message, Catch::Contains(text));
}

/// Views of balls in a room, as images of a map are made.
LayeredDepthImage room_image() {
    AnalyticScene scene;
    scene.balls = {{{-2.0, 0.5, -10.0}, 1.5}, {{1.5, -0.5, -8.0}, 1.0}, {{0.3, 1.2, -14.0}, 2.0}};
    scene.planes = {{{0.0, 1.0, 0.0}, -3.0}, {{0.0, 0.0, 1.0}, -20.0}};
    View central = straight_view(192, 144);
    central.lens.far_distance = 60.0;
    std::vector<ConstructionView> views;
    for (const double x : {0.0, -0.5, 0.5}) {
        View view = central;
        view.eye.x += x;
        views.push_back(scene.picture(view));
    }
    auto built = build_layered_image(central, views, scene.frames());
    REQUIRE(built.has_value());
    return built->image;
}

} // namespace

TEST_CASE("Placed images are read as they were written, in the layout that is described") {
    TemporaryFolder folder;
    const std::string bytes = whole_file(folder);
    const std::filesystem::path path = folder.path() / "whole.placed";
    const Result<io::PlacementReader> reader = io::PlacementReader::open(path);
    REQUIRE(reader.has_value());
    CHECK(reader->making_key() == kKey);
    REQUIRE(reader->image_count() == 3);
    const Result<PlacementMap> map = io::load_placement_map(path);
    REQUIRE(map.has_value());
    CHECK(*map == hand_made_placement());
    // In any order, each without the others.
    for (const std::uint32_t image : {2U, 0U, 1U, 2U}) {
        const Result<LayeredDepthImage> read = reader->read(image);
        INFO((read ? "" : read.error().message));
        REQUIRE(read.has_value());
        CHECK(*read == hand_made_layers(image));
        CHECK(reader->image_bytes(image) == memory_bytes(*read));
    }
    const Result<LayeredDepthImage> none = reader->read(3);
    REQUIRE_FALSE(none.has_value());
    check_message(none.error(), ErrorCode::not_found, "does not have image 3 of 3");

    CHECK(
        bytes.substr(0, 8) == "\x89"
                              "FFP\r\n\x1a\n"
    );
    CHECK(bytes.substr(kPlacementOrderAt, 8) == std::string("\x04\x03\x02\x01\x01\0\0\0", 8));
    CHECK(bytes.substr(16, 8) == "\xEF\xCD\xAB\x89\x67\x45\x23\x01");
    const PlacementPieces pieces = placement_pieces(bytes);
    // max_primitives and target_primitives, then the lens.
    CHECK(get<std::uint64_t>(pieces.map, 0) == 1000);
    CHECK(get<std::uint64_t>(pieces.map, 8) == 900);
    CHECK(get<double>(pieces.map, 16) == hand_made_placement().options.lens.left);
    const LayeredDepthImage layers = hand_made_layers(1);
    const std::string& image = pieces.images[1];
    REQUIRE(image.size() == 184 + 48 + layers.samples.size() * (8 + 24));
    CHECK(get<double>(image, 152) == layers.near_depth);
    CHECK(get<std::uint64_t>(image, 168) == layers.samples.size());
    CHECK(get<std::uint8_t>(image, 184) == layers.counts[0]);
    const LayeredSample& first = layers.samples.front();
    CHECK(get<std::uint8_t>(image, 184 + 48) == (first.x % 16 | first.y % 16 << 4));
    // Nothing is left beside it.
    CHECK_FALSE(std::filesystem::exists(path.string() + ".parts"));
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("Images without samples, with one, and with none of a map are kept") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "a.placed";
    const View view = straight_view(3, 2);
    const LayeredDepthImage empty = layered_image(view, 1.0, 2.0, [](int, int, auto&) {});
    const LayeredDepthImage one =
        layered_image(straight_view(1, 1), 1.0, 2.0, [](int column, int row, auto& samples) {
            samples.push_back(sample_in(column, row, 65535, 15, 15));
            samples.back().extent = 65535;
        });
    io::PlacementWriter writer = open_writer(path, hand_made_placement(2));
    REQUIRE(writer.add(0, empty).has_value());
    REQUIRE(writer.add(1, one).has_value());
    REQUIRE(writer.finish().has_value());
    const Result<io::PlacementReader> reader = io::PlacementReader::open(path);
    REQUIRE(reader.has_value());
    CHECK(reader->read(0).value() == empty);
    CHECK(reader->read(1).value() == one);

    io::PlacementWriter none = open_writer(path, hand_made_placement(0));
    REQUIRE(none.finish().has_value());
    CHECK(io::load_placement_map(path).value() == hand_made_placement(0));
}

TEST_CASE("Every changed byte and every missing end of placed images is an error") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder, 2);
    for (std::size_t at = 0; at < whole.size(); ++at) {
        for (const int change : {0x01, 0x80, 0xFF}) {
            std::string bytes = whole;
            bytes[at] = static_cast<char>(bytes[at] ^ change);
            INFO("byte " << at << " changed by " << change);
            CHECK_FALSE(refusal(folder, bytes).message.empty());
        }
        // The table in front tells the length: no image need be read.
        const auto path = folder.write("cut.placed", whole.substr(0, at));
        INFO("cut to " << at);
        CHECK_FALSE(io::PlacementReader::open(path).has_value());
    }
    constexpr ErrorCode kBad = ErrorCode::bad_data;
    check_message(refusal(folder, ""), kBad, "is no file of placed images");
    check_message(refusal(folder, "v 0 0 0\n"), kBad, "is no file of placed images");
    check_message(refusal(folder, whole.substr(0, 20)), kBad, "ends in its header, after 20");
    check_message(refusal(folder, whole + '\0'), kBad, "has 1 bytes after its last image");
    std::string damaged = whole;
    damaged.back() = static_cast<char>(damaged.back() ^ 1);
    check_message(refusal(folder, damaged), kBad, "the checksum of image 1 is another");
}

TEST_CASE("Damage to one image leaves the others") {
    TemporaryFolder folder;
    std::string bytes = whole_file(folder);
    const auto packed_map = get<std::uint64_t>(bytes, kPlacementMapAt + 8);
    const std::size_t image_0 = kPlacementTableAt + std::size_t{3} * 32 + 8 + packed_map;
    bytes[image_0] = static_cast<char>(bytes[image_0] ^ 1);
    const auto reader = io::PlacementReader::open(folder.write("a.placed", bytes));
    REQUIRE(reader.has_value());
    CHECK(reader->read_map().has_value());
    CHECK_FALSE(reader->read(0).has_value());
    CHECK(reader->read(1).value() == hand_made_layers(1));
    CHECK(reader->read(2).value() == hand_made_layers(2));
}

TEST_CASE("Other versions and the other byte order of placed images are named") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    std::string bytes = whole;
    put(bytes, kPlacementVersionAt, std::uint32_t{2});
    check_message(
        refusal(folder, bytes), ErrorCode::unsupported, "has version 2 of the format, expected 1"
    );
    bytes = whole;
    put(bytes, kPlacementOrderAt, std::uint32_t{0x04030201});
    check_message(refusal(folder, bytes), ErrorCode::unsupported, "has the other byte order");
}

TEST_CASE("What a file of placed images announces is bounded by its own size") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    constexpr std::size_t kImage1 = kPlacementTableAt + 32;
    const auto with = [&](std::size_t at, std::uint64_t value) {
        std::string bytes = whole;
        put(bytes, at, value);
        if (at != kPlacementImagesAt) {
            seal_placement(bytes);
        }
        return refusal(folder, bytes);
    };
    const ErrorCode bad = ErrorCode::bad_data;
    constexpr std::uint64_t kHuge = std::uint64_t{1} << 60U;
    check_message(with(kPlacementMapAt, kHuge), bad, "announces 1152921504606846976 bytes of its");
    check_message(with(kPlacementMapAt + 8, UINT64_MAX), bad, "which takes 18446744073709551615");
    check_message(with(kPlacementImagesAt, kHuge), bad, "too few for a table of 11529215046");
    check_message(with(kPlacementImagesAt, UINT64_MAX), bad, "too few for a table of 1844674407");
    check_message(with(kImage1, kHuge), bad, "announces 1152921504606846976 bytes of image 1");
    check_message(with(kImage1 + 8, UINT64_MAX), bad, "which takes 18446744073709551615");
    check_message(with(kImage1 + 8, 0), bad, "image 1 on, which takes 0");
    const auto memory = get<std::uint64_t>(whole, kImage1 + 16);
    check_message(
        with(kImage1 + 16, memory + 1),
        bad,
        "announces " + std::to_string(memory + 1) + " bytes in memory of image 1, which takes " +
            std::to_string(memory)
    );
    const auto content = get<std::uint64_t>(whole, kImage1);
    check_message(with(kImage1, content - 1), bad, "image 1 cannot be unpacked");
    check_message(with(kImage1, content + 1), bad, "image 1 has " + std::to_string(content));
}

TEST_CASE("Whole files with wrong contents are refused by what is wrong with them") {
    TemporaryFolder folder;
    const PlacementPieces whole = placement_pieces(whole_file(folder));
    const auto refused = [&](auto change) {
        PlacementPieces pieces = whole;
        change(pieces);
        return refusal(folder, placement_bytes(pieces));
    };
    CHECK(placement_pieces(placement_bytes(whole)).images == whole.images);
    const ErrorCode bad = ErrorCode::bad_data;
    check_message(refused([](auto& p) { p.map.pop_back(); }), bad, "ends in its replaced cells");
    check_message(refused([](auto& p) { p.map += "more"; }), bad, "has 4 bytes too many");
    check_message(refused([](auto& p) { p.map.resize(50); }), bad, "its map ends after 50 bytes");
    check_message(refused([](auto& p) { p.images.pop_back(); }), bad, "has 2 images, its map 3");
    // A map that says what `validate` refuses.
    check_message(
        refused([](auto& p) { put(p.map, 0, std::uint64_t{700}); }), bad, "more than 700"
    );
    check_message(refused([](auto& p) { p.images[1].resize(100); }), bad, "ends after 100 bytes");
    check_message(refused([](auto& p) { p.images[1].resize(200); }), bad, "ends in the counts");
    check_message(refused([](auto& p) { p.images[1].pop_back(); }), bad, "and counts");
    check_message(refused([](auto& p) { ++p.images[1][184]; }), bad, "and counts");
    check_message(
        refused([](auto& p) { put(p.images[1], 144, std::int32_t{-8}); }), bad, "has a wrong view"
    );
    check_message(
        refused([](auto& p) { put(p.images[1], 152, -1.0); }), bad, "is wrong: layered depth image"
    );
    check_message(
        refused([](auto& p) { put(p.images[1], 168, UINT64_MAX / 8 + 1); }), bad, "and counts"
    );
}

TEST_CASE("A file is the same however its images came, and goes on where it was interrupted") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    const std::filesystem::path path = folder.path() / "a.placed";
    const PlacementMap map = hand_made_placement();
    std::array<std::uint32_t, 3> order{0, 1, 2};
    do {
        // Without interruption, and begun anew before every image.
        for (const bool is_interrupted : {false, true}) {
            io::PlacementWriter writer = open_writer(path, map);
            for (std::size_t i = 0; i < order.size(); ++i) {
                if (is_interrupted) {
                    writer = open_writer(path, map);
                }
                for (std::size_t k = 0; k < order.size(); ++k) {
                    CHECK(writer.has(order[k]) == (k < i));
                }
                REQUIRE(writer.add(order[i], hand_made_layers(order[i])).has_value());
            }
            if (is_interrupted) {
                writer = open_writer(path, map);
            }
            REQUIRE(writer.finish().has_value());
            CHECK(read_bytes(path.string()) == whole);
        }
    } while (std::next_permutation(order.begin(), order.end()));
    // An image that is there is replaced.
    io::PlacementWriter writer = open_writer(path, map);
    REQUIRE(writer.add(0, hand_made_layers(2)).has_value());
    for (const std::uint32_t image : order) {
        REQUIRE(writer.add(image, hand_made_layers(image)).has_value());
    }
    REQUIRE(writer.finish().has_value());
    CHECK(read_bytes(path.string()) == whole);
}

TEST_CASE("Parts that a killed writer left damaged are made again") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder, 2);
    const std::filesystem::path path = folder.path() / "a.placed";
    const std::filesystem::path parts = path.string() + ".parts";
    const PlacementMap map = hand_made_placement(2);
    {
        io::PlacementWriter writer = open_writer(path, map);
        REQUIRE(writer.add(0, hand_made_layers(0)).has_value());
        REQUIRE(writer.add(1, hand_made_layers(1)).has_value());
    }
    const std::string part = read_bytes((parts / "1.image").string());
    // Begun, but never renamed; copied by hand; not ours.
    REQUIRE(folder.write("a.placed.parts/1.image.7.0.part", "begun") == parts / "1.image.7.0.part");
    const auto copy = folder.write("a.placed.parts/0.image", part);
    for (std::size_t at = 0; at < part.size(); at += 7) {
        std::string bytes = part;
        bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
        if (at >= 8 && at < 16) {
            continue; // another version or byte order: below
        }
        const auto damaged = folder.write("a.placed.parts/1.image", bytes);
        INFO("byte " << at);
        CHECK_FALSE(open_writer(path, map).has(1));
        CHECK_FALSE(std::filesystem::exists(damaged));
    }
    CHECK_FALSE(std::filesystem::exists(copy));
    CHECK(std::filesystem::is_empty(parts));
    io::PlacementWriter writer = open_writer(path, map);
    REQUIRE(writer.add(1, hand_made_layers(1)).has_value());
    REQUIRE(writer.add(0, hand_made_layers(0)).has_value());
    REQUIRE(writer.finish().has_value());
    CHECK(read_bytes(path.string()) == whole);
}

TEST_CASE("Parts of another map, making, level or version are refused, and stay") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "a.placed";
    const PlacementMap map = hand_made_placement();
    REQUIRE(open_writer(path, map).add(1, hand_made_layers(1)).has_value());
    const auto refused = [&](const PlacementMap& with, const io::PlacementFileOptions& options) {
        const auto writer = io::PlacementWriter::open(path, with, options);
        REQUIRE_FALSE(writer.has_value());
        CHECK_THAT(writer.error().message, Catch::StartsWith(path.string() + ".parts/1.image"));
        return writer.error();
    };
    PlacementMap other = map;
    other.quality.views = 18;
    const ErrorCode invalid = ErrorCode::invalid_argument;
    check_message(refused(other, kOptions), invalid, "is of another map");
    check_message(
        refused(map, {.making_key = 5, .level = 3}),
        invalid,
        "its key is " + std::to_string(kKey) + ", expected 5"
    );
    check_message(
        refused(map, {.making_key = kKey, .level = 4}), invalid, "another level: 3, expected 4"
    );
    CHECK(open_writer(path, map).has(1));
    std::string bytes = read_bytes(path.string() + ".parts/1.image");
    put(bytes, 12, std::uint32_t{9});
    REQUIRE(std::filesystem::exists(folder.write("a.placed.parts/1.image", bytes)));
    check_message(refused(map, kOptions), ErrorCode::unsupported, "has version 9");
}

TEST_CASE("Missing images are an error, unless a part is enough") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "a.placed";
    io::PlacementWriter writer = open_writer(path, hand_made_placement());
    CHECK(writer.image_count() == 3);
    REQUIRE(writer.add(0, hand_made_layers(0)).has_value());
    const Result<void> unfinished = writer.finish();
    REQUIRE_FALSE(unfinished.has_value());
    check_message(
        unfinished.error(), ErrorCode::not_found, "2 of 3 images are missing, the first is 1"
    );
    CHECK_FALSE(std::filesystem::exists(path));
    io::PlacementFileOptions partial = kOptions;
    partial.partial = true;
    REQUIRE(open_writer(path, hand_made_placement(), partial).finish().has_value());
    const Result<io::PlacementReader> reader = io::PlacementReader::open(path);
    REQUIRE(reader.has_value());
    CHECK(reader->read_map().has_value());
    CHECK(reader->read(0).value() == hand_made_layers(0));
    CHECK(reader->image_bytes(1) == 0);
    const Result<LayeredDepthImage> missing = reader->read(1);
    REQUIRE_FALSE(missing.has_value());
    check_message(missing.error(), ErrorCode::not_found, "does not have image 1 of 3");
}

TEST_CASE("What is wrong is not written, and what was there stays") {
    TemporaryFolder folder;
    const std::string whole = whole_file(folder);
    const std::filesystem::path path = folder.path() / "whole.placed";
    PlacementMap wrong = hand_made_placement();
    wrong.ranges[1].image = 1;
    const auto refused = [&](const PlacementMap& map, const io::PlacementFileOptions& options) {
        const auto writer = io::PlacementWriter::open(path, map, options);
        REQUIRE_FALSE(writer.has_value());
        return writer.error();
    };
    check_message(
        refused(wrong, kOptions), ErrorCode::bad_data, path.string() + " is not written: placement"
    );
    for (const int level : {0, 20}) {
        check_message(
            refused(hand_made_placement(), {.level = level}),
            ErrorCode::invalid_argument,
            "level is " + std::to_string(level) + ", expected 1 to 19"
        );
    }
    io::PlacementWriter writer = open_writer(path, hand_made_placement());
    LayeredDepthImage image = hand_made_layers(0);
    image.samples[0].extent = 0;
    const Result<void> added = writer.add(0, image);
    REQUIRE_FALSE(added.has_value());
    check_message(added.error(), ErrorCode::bad_data, "image 0 is not written: layered depth");
    const Result<void> beyond = writer.add(3, hand_made_layers(0));
    REQUIRE_FALSE(beyond.has_value());
    check_message(beyond.error(), ErrorCode::invalid_argument, "image 3 is not of the map");
    CHECK(read_bytes(path.string()) == whole);
}

TEST_CASE("Placed images that are not there, and places that cannot be written") {
    TemporaryFolder folder;
    const auto missing = io::PlacementReader::open(folder.path() / "none.placed");
    REQUIRE_FALSE(missing.has_value());
    CHECK(missing.error().code == ErrorCode::not_found);
    CHECK_FALSE(io::load_placement_map(folder.path()).has_value());
    const auto path = folder.path() / "none" / "a.placed";
    const auto writer = io::PlacementWriter::open(path, hand_made_placement(), kOptions);
    REQUIRE_FALSE(writer.has_value());
    check_message(writer.error(), ErrorCode::device, path.string() + ".parts cannot be used");
}

TEST_CASE("Images that pack too well are filled up, so that they can be read") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "dull.placed";
    const LayeredDepthImage dull =
        layered_image(straight_view(1024, 1024), 1.0, 2.0, [](int, int, auto&) {});
    io::PlacementWriter writer = open_writer(path, hand_made_placement(1));
    REQUIRE(writer.add(0, dull).has_value());
    REQUIRE(writer.finish().has_value());
    CHECK(std::filesystem::file_size(path) * io::kMaxPlacementRatio >= dull.counts.size());
    CHECK(io::PlacementReader::open(path).value().read(0).value() == dull);
}

TEST_CASE("Samples are packed into less than zstd makes of them as they lie in memory") {
    TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "room.placed";
    const LayeredDepthImage image = room_image();
    io::PlacementWriter writer = open_writer(path, hand_made_placement(1), {.level = 9});
    REQUIRE(writer.add(0, image).has_value());
    REQUIRE(writer.finish().has_value());
    CHECK(io::PlacementReader::open(path).value().read(0).value() == image);
    std::string plain(reinterpret_cast<const char*>(image.counts.data()), image.counts.size());
    plain.append(
        reinterpret_cast<const char*>(image.samples.data()),
        image.samples.size() * sizeof(LayeredSample)
    );
    const auto packed = get<std::uint64_t>(read_bytes(path.string()), kPlacementTableAt + 8);
    const std::size_t as_it_lies = zstd_packed(plain, 9).size();
    // Less than half on this scene, which is smooth but for its outlines.
    CHECK(2 * packed < as_it_lies);
}
