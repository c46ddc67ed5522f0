#include "io/files.hpp"

#include <catch2/catch.hpp>

#include <cmath>
#include <string>
#include <vector>

using namespace farfield;

namespace {

Result<io::LoadedScene> load(const std::string& bytes) {
    return support::load_bytes("test.stl", bytes);
}

std::string message(const std::string& bytes) {
    const auto loaded = load(bytes);
    return loaded ? "loaded" : loaded.error().message;
}

std::string binary(const std::string& title, const std::vector<float>& corners) {
    std::string bytes = title;
    bytes.resize(80, '\0');
    support::append(bytes, static_cast<std::uint32_t>(corners.size() / 9));
    for (std::size_t i = 0; i < corners.size(); ++i) {
        if (i % 9 == 0) {
            bytes.append(12, '\0');
        }
        support::append(bytes, corners[i]);
        if (i % 9 == 8) {
            bytes.append(2, '\0');
        }
    }
    return bytes;
}

const std::vector<float> kSquare = {0, 0, 0, 1, 0, 0, 1, 1, 0, -0.0F, 0, 0, 1, 1, 0, 0, 1, 0};

} // namespace

TEST_CASE("STL: binary, also when its title begins with solid") {
    const auto loaded = load(binary(GENERATE("made by hand", "solid part"), kSquare));
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    CHECK(mesh.positions.size() == 4); // -0 and 0 are one corner
    CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
}

TEST_CASE("STL: text, in any case and on any lines' ends") {
    const auto loaded =
        load("SOLID vertex 1 2\r\n  FACET NORMAL 0 0 1\r\n outer loop\r\n vertex 0 0 0\r\n"
             "vertex 1 0 0\r\nvertex 0 1e0 0\r\nendloop\r\nendfacet\r\nendsolid vertex 1 2\r\n");
    REQUIRE(loaded.has_value());
    CHECK(primitive_count(loaded->scene) == 1);
}

TEST_CASE("STL: errors name the place and the value") {
    CHECK_THAT(message("x"), Catch::Contains("has 1 bytes instead of 84"));
    CHECK_THAT(message(binary("", kSquare).substr(0, 180)), Catch::Contains("announces 2 facets"));
    std::string huge = binary("", kSquare);
    huge.replace(80, 4, "\xff\xff\xff\xff");
    CHECK_THAT(message(huge), Catch::Contains("announces 4294967295 facets"));
    std::vector<float> corners = kSquare;
    corners[10] = NAN;
    CHECK_THAT(message(binary("", corners)), Catch::Contains("facet 1 is nan"));
    CHECK(message(binary("", {})) == "test.stl: no triangles");
    CHECK(message("solid x\nendsolid x\n") == "test.stl: no triangles");
    CHECK_THAT(message("solid\nhello\n"), Catch::Contains(":2: 'hello' is no word"));
    CHECK_THAT(
        message("solid\nfacet normal 0 0 1\nvertex 0 0 inf\n"),
        Catch::Contains(":3: a vertex coordinate is 'inf'")
    );
    CHECK_THAT(
        message("solid\nfacet normal 0 0 1\nvertex 0 0 0\nendfacet\n"),
        Catch::Contains(":4: a facet has 1 vertices")
    );
    CHECK_THAT(message("solid\nfacet\nvertex 0 0 0\n"), Catch::Contains("ends in a facet"));
}
