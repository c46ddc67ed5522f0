#include "io/files.hpp"
#include <farfield/io/height_field.hpp>
#include <farfield/io/png.hpp>

#include <catch2/catch.hpp>
#include <png.h>

#include <cstring>
#include <string>
#include <vector>

using namespace farfield;

namespace {

/// A 16-bit greyscale PNG. It says that its samples are linear, which must not change them.
std::string grey_png(unsigned width, unsigned height, const std::vector<std::uint16_t>& samples) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = width;
    image.height = height;
    image.format = PNG_FORMAT_LINEAR_Y;
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string bytes(size, '\0');
    REQUIRE(
        png_image_write_to_memory(&image, bytes.data(), &size, 0, samples.data(), 0, nullptr) != 0
    );
    bytes.resize(size);
    return bytes;
}

const std::string kLayout =
    R"({"width":3,"height":2,"spacing_m":10,"height_scale":0.5,"height_offset":-100,"x":[]})";
const std::vector<std::uint16_t> kSamples = {0, 256, 1, 65535, 2, 3};

} // namespace

TEST_CASE("a height field has its samples where the layout puts them") {
    support::TemporaryFolder folder;
    folder.write("hill.json", kLayout);
    const auto path = folder.write("hill.png", grey_png(3, 2, kSamples));
    const auto loaded = io::load_scene(path, {.up = io::UpAxis::z});
    REQUIRE(loaded.has_value());
    const Scene& scene = loaded->scene;
    CHECK(scene.up == glm::dvec3(0, 1, 0)); // a height field says what is up
    const Mesh& mesh = scene.meshes.front();
    CHECK(mesh.splittable);
    REQUIRE(mesh.positions.size() == 6);
    for (std::size_t i = 0; i < 6; ++i) {
        const glm::dvec3 p = mesh.origin + glm::dvec3(mesh.positions[i]);
        const double column = static_cast<double>(i % 3);
        const double row = i < 3 ? 0.0 : 1.0;
        CHECK(p.x == 10.0 * (column - 1.0)); // west to east
        CHECK(p.z == 10.0 * (row - 0.5));    // north, which is -z, first
        // Every height is a multiple of a quarter metre below 2^15, which a float holds.
        CHECK(p.y == 0.5 * kSamples[i] - 100.0);
        CHECK(mesh.texcoords[i].x == Approx((column + 0.5) / 3.0));
        CHECK(mesh.texcoords[i].y == Approx((row + 0.5) / 2.0));
    }
    CHECK(primitive_count(mesh) == 4);
    for (const glm::vec3& normal : mesh.normals) {
        CHECK(normal.y > 0.0F);
    }
    CHECK(scene.materials.empty());
    CHECK(loaded->warnings.empty());
}

TEST_CASE("a picture beside a height field becomes its texture") {
    const auto* const suffix = GENERATE("_colour.png", "_ortho.png");
    support::TemporaryFolder folder;
    folder.write("hill.json", kLayout);
    REQUIRE(io::write_png(
                folder.path() / (std::string("hill") + suffix), {1, 1, {1, 2, 3, 255}}
    ).has_value());
    const auto loaded = io::load_height_field(folder.write("hill.png", grey_png(3, 2, kSamples)));
    REQUIRE(loaded.has_value());
    REQUIRE(loaded->scene.textures.size() == 1);
    CHECK(loaded->scene.textures[0].pixels == std::vector<std::uint8_t>{1, 2, 3, 255});
    CHECK(loaded->scene.meshes[0].parts[0].material == MaterialId{0});

    folder.write(std::string("hill") + suffix, "broken");
    const auto without = io::load_height_field(folder.path() / "hill.png");
    REQUIRE(without.has_value());
    CHECK(without->scene.textures.empty());
    CHECK(without->scene.meshes[0].parts[0].material == kNone<MaterialId>);
    CHECK(without->warnings.size() == 1);
}

TEST_CASE("a height field that contradicts its layout is refused") {
    support::TemporaryFolder folder;
    const auto load = [&folder](const std::string& layout, const std::string& png) {
        folder.write("hill.json", layout);
        const auto loaded = io::load_height_field(folder.write("hill.png", png));
        return loaded ? std::string("loaded") : loaded.error().message;
    };
    const std::string png = grey_png(3, 2, kSamples);
    CHECK(load(kLayout, png) == "loaded");
    CHECK_THAT(load("[]", png), Catch::Contains("is not a JSON object"));
    CHECK_THAT(load("{\"width\":", png), Catch::Contains("is not a JSON object"));
    CHECK_THAT(load(R"({"width":"3"})", png), Catch::Contains("has no number 'width'"));
    CHECK_THAT(
        load(R"({"width":4,"height":2,"spacing_m":1,"height_scale":1,"height_offset":0})", png),
        Catch::Contains("3 x 2 samples, hill.json announces 4 x 2")
    );
    CHECK_THAT(
        load(R"({"width":3,"height":2,"spacing_m":0,"height_scale":1,"height_offset":0})", png),
        Catch::Contains("spacing_m is 0")
    );
    CHECK_THAT(
        load(R"({"width":3,"height":2,"spacing_m":1,"height_scale":1e300,"height_offset":0})", png),
        Catch::Contains("inf")
    );
    CHECK_THAT(load(kLayout, grey_png(6, 1, kSamples)), Catch::Contains("6 x 1 samples"));
    CHECK_THAT(load(kLayout, png.substr(0, png.size() / 2)), Catch::Contains("hill.png: "));
    CHECK_THAT(load(kLayout, "x"), Catch::Contains("is not a PNG"));
    std::string huge = png;
    huge.replace(16, 4, std::string("\x7f\xff\xff\xff", 4));
    CHECK_THAT(load(kLayout, huge), Catch::Contains("announces 2147483647 x 2"));
    REQUIRE(io::write_png(folder.path() / "hill.png", {1, 1, {1, 2, 3, 255}}).has_value());
    CHECK_THAT(
        io::load_height_field(folder.path() / "hill.png").error().message,
        Catch::Contains("3 channels of 8 bits")
    );

    folder.write("lone.png", png);
    const auto lone = io::load_height_field(folder.path() / "lone.png");
    REQUIRE_FALSE(lone.has_value());
    CHECK(lone.error().code == ErrorCode::not_found);
    CHECK_THAT(lone.error().message, Catch::Contains("lone.json"));
}
