#include "io/files.hpp"

#include <catch2/catch.hpp>

#include <string>

using namespace farfield;

namespace {

Result<io::LoadedScene> load(const std::string& text) {
    return support::load_bytes("test.off", text);
}

std::string message(const std::string& text) {
    const auto loaded = load(text);
    return loaded ? "loaded" : loaded.error().message;
}

const std::string kBody = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

} // namespace

TEST_CASE("OFF: every header that is about") {
    const auto* const header = GENERATE(
        "OFF\n3 1 0\n",
        "OFF 3 1 0\n",
        "OFF3 1 0\n",
        "OFF\n3 1\n",
        "3 1 0\n",
        "# c\n\n OFF # c\n # c\n\t3 1 0 # c\n\n",
        "OFF\r\n3 1 0\r\n",
        "COFF\n3 1 0\n",
        "STOFF\n3 1 0\n"
    );
    INFO(header);
    const auto loaded = load(header + kBody);
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2});
    CHECK(mesh.bounds == Box3d{{0, 0, 0}, {1, 1, 0}});
}

TEST_CASE("OFF: polygons, face colours and numbers across lines") {
    const auto loaded = load("OFF 4 1 0\n0 0 0 1\n0 0 1\n1 0 0 1 0\n4 0 1\n2 3 255 0 0\n");
    // The fourth number of a line is nothing we read, so the vertices are (0,0,0), (0,0,1), (1,0,0)
    // and (0..., which takes its missing numbers from the line of the face.
    CHECK_FALSE(loaded.has_value());
    const auto whole = load("OFF 4 1 0\n0 0\n0\n1 0 0\n1 1 0 0.5\n0 1 0\n4 0 1\n2 3 255 0 0\n");
    REQUIRE(whole.has_value());
    CHECK(primitive_count(whole->scene) == 2);
}

TEST_CASE("OFF: colours in bytes or fractions, normals") {
    const auto bytes =
        load("COFF 3 1 0\n0 0 0 255 0 0\n1 0 0 0 128 0 64\n0 1 0 nan 0 0\n3 0 1 2\n");
    REQUIRE(bytes.has_value());
    const auto& colors = bytes->scene.meshes.front().colors;
    CHECK(colors[0] == glm::u8vec4(255, 0, 0, 255));
    CHECK(colors[1] == glm::u8vec4(0, 128, 0, 64));
    CHECK(colors[2] == glm::u8vec4(255));
    REQUIRE(bytes->warnings.size() == 1);

    const auto fractions = load(
        "CNOFF 3 1 0\n0 0 0 0 1 0 1 0.5 0 1\n1 0 0 0 2 0 1 1 1 1\n0 1 0 0 0 0 0 0 0 1\n3 0 1 2\n"
    );
    REQUIRE(fractions.has_value());
    const Mesh& mesh = fractions->scene.meshes.front();
    CHECK(mesh.colors[0] == glm::u8vec4(255, 128, 0, 255));
    CHECK(mesh.normals[0] == glm::vec3(0, 1, 0));
    CHECK(mesh.normals[1] == glm::vec3(0, 1, 0));
    CHECK(mesh.normals[2] == glm::vec3(0, 0, 1)); // zero in the file, so computed
}

TEST_CASE("OFF: errors name the line and the value") {
    CHECK_THAT(message("hello\n"), Catch::Contains("begins with 'hello'"));
    CHECK_THAT(message("OFF\n"), Catch::Contains("number of vertices is ''"));
    CHECK_THAT(message("OFF -3 1 0\n" + kBody), Catch::Contains("number of vertices is '-3'"));
    CHECK_THAT(message("OFF BINARY\n"), Catch::Contains("binary OFF"));
    CHECK_THAT(message("4OFF 3 1 0\n" + kBody), Catch::Contains("not three-dimensional"));
    CHECK_THAT(message("XOFF 3 1 0\n" + kBody), Catch::Contains("begins with 'XOFF'"));
    CHECK_THAT(message("OFF 3000000000 1 0\n" + kBody), Catch::Contains("announces 3000000000"));
    CHECK_THAT(
        message("OFF 3 3000000000 0\n" + kBody), Catch::Contains("announces 3 vertices and")
    );
    CHECK(
        message("OFF 3 1 0\n0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n") ==
        "test.off:3: vertex coordinate x is nan"
    );
    CHECK_THAT(
        message("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
        Catch::Contains(":5: face index '3' is not one of 3 vertices")
    );
    CHECK_THAT(
        message("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"), Catch::Contains("face index '-1'")
    );
    CHECK_THAT(
        message("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n"),
        Catch::Contains("a face has '2' vertices")
    );
    CHECK_THAT(message("OFF 3 2 0\n" + kBody), Catch::Contains("ends after 1 of 2 faces"));
    CHECK_THAT(
        message("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n"), Catch::Contains("ends in a face")
    );
    CHECK(message("OFF 3 0 0\n0 0 0\n1 0 0\n0 1 0\n") == "test.off: no triangles");
}
