#include "io/files.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <string>

using namespace farfield;

namespace {

Result<io::LoadedScene> load(const std::string& bytes) {
    return support::load_bytes("test.ply", bytes);
}

std::string message(const std::string& bytes) {
    const auto loaded = load(bytes);
    return loaded ? "loaded" : loaded.error().message;
}

std::string
header(const std::string& format, const std::string& vertices, const std::string& faces = "1") {
    return "ply\nformat " + format + " 1.0\ncomment made by hand\nelement vertex " + vertices +
           "\nproperty double x\nproperty double y\nproperty double z\nelement face " + faces +
           "\nproperty list uchar int vertex_indices\nend_header\n";
}

template <typename T>
void append(std::string& bytes, T value, bool big_endian) {
    std::string number;
    support::append(number, value);
    if (big_endian) {
        std::reverse(number.begin(), number.end());
    }
    bytes += number;
}

const std::string kBody = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

} // namespace

TEST_CASE("PLY: text and both byte orders give one mesh, in double") {
    const std::string format = GENERATE("ascii", "binary_little_endian", "binary_big_endian");
    INFO(format);
    std::string bytes = header(format, "4", "2");
    const bool big = format == "binary_big_endian";
    if (format == "ascii") {
        bytes +=
            "10000000.125 0 0\n10000001 0 0\n10000001 1 0\n10000000.125 1 0\n3 0 1 2\n4 0 1 2 3\n";
    } else {
        for (const double value :
             {10000000.125, 0., 0., 10000001., 0., 0., 10000001., 1., 0., 10000000.125, 1., 0.}) {
            append(bytes, value, big);
        }
        for (const auto& face : {std::vector{0, 1, 2}, std::vector{0, 1, 2, 3}}) {
            append(bytes, static_cast<std::uint8_t>(face.size()), big);
            for (const int index : face) {
                append(bytes, index, big);
            }
        }
    }
    const auto loaded = load(bytes);
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2, 0, 1, 2, 0, 2, 3});
    CHECK(mesh.origin.x + static_cast<double>(mesh.positions[0].x) == 10000000.125);
}

TEST_CASE("PLY: attributes, unknown properties and elements") {
    const auto loaded = load(
        "ply\r\nformat ascii 1.0\r\nelement camera 1\r\nproperty float focus\r\n"
        "property list uchar float distortion\r\n"
        "element vertex 3\r\nproperty float confidence\r\nproperty float x\r\nproperty float y\r\n"
        "property float z\r\nproperty float nx\r\nproperty float ny\r\nproperty float nz\r\n"
        "property uchar red\r\nproperty uchar green\r\nproperty uchar blue\r\nproperty float s\r\n"
        "property float t\r\nelement face 1\r\nproperty uchar flags\r\n"
        "property list uchar int vertex_index\r\nproperty list uchar float texcoord\r\n"
        "end_header\r\n35 2 0.1 0.2\r\n"
        "0.5 0 0 0 0 2 0 255 128 0 0.25 0.75\r\n"
        "0.5 1 0 0 0 0 0 nan 0 0 0 0\r\n"
        "0.5 0 1 0 0 1 0 300 0 0 0 0\r\n"
        "7 3 0 1 2 2 0.5 0.5\r\n"
    );
    INFO((loaded ? "" : loaded.error().message));
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    CHECK(mesh.normals[0] == glm::vec3(0, 1, 0));
    CHECK(mesh.normals[1] == glm::vec3(0, 0, 1)); // zero in the file
    CHECK(mesh.colors[0] == glm::u8vec4(255, 128, 0, 255));
    CHECK(mesh.colors[1] == glm::u8vec4(255));
    CHECK(mesh.colors[2] == glm::u8vec4(255, 0, 0, 255));
    CHECK(mesh.texcoords[0] == glm::vec2(0.25F, 0.25F));
    CHECK(loaded->warnings.size() == 1);
}

TEST_CASE("PLY: faces may come before vertices") {
    const auto loaded =
        load("ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n"
             "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
             "3 0 1 2\n0 0 0\n1 0 0\n0 1 0");
    CHECK(loaded.has_value());
}

TEST_CASE("PLY: errors name the place and the value") {
    CHECK_THAT(message("plx\n"), Catch::Contains(":1: the file does not begin with 'ply'"));
    CHECK_THAT(message("ply\nformat ascii 1.0\n"), Catch::Contains("the header has no end"));
    CHECK_THAT(message("ply\nend_header\n"), Catch::Contains("names no format"));
    CHECK_THAT(message(header("middle_endian", "3")), Catch::Contains("format is 'middle_endian'"));
    CHECK_THAT(message(header("ascii", "-3")), Catch::Contains("'-3'"));
    CHECK_THAT(message("ply\nproperty float x\n"), Catch::Contains("before the first element"));
    CHECK_THAT(message("ply\nelement vertex 1\nproperty half x\n"), Catch::Contains("type 'half'"));
    CHECK_THAT(
        message("ply\nelement face 1\nproperty list float int i\n"),
        Catch::Contains("count of a list has type 'float'")
    );
    CHECK_THAT(message("ply\nhello\n"), Catch::Contains(":2: 'hello' is no word"));
    CHECK_THAT(
        message("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1 1 1 1\n"),
        Catch::Contains("without x, y and z")
    );
    CHECK_THAT(
        message(header("ascii", "3") + "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"),
        Catch::Contains(":12: coordinate y of vertex 1 is nan")
    );
    CHECK_THAT(
        message(header("ascii", "3") + "0 0 0\n1 a 0\n0 1 0\n3 0 1 2\n"), Catch::Contains("'a'")
    );
    CHECK_THAT(
        message(header("ascii", "3") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
        Catch::Contains("face 0 has index 3 of 3 vertices")
    );
    CHECK_THAT(
        message(header("ascii", "3") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"),
        Catch::Contains("face 0 has index -1")
    );
    CHECK_THAT(
        message(header("ascii", "3") + "0 0 0\n1 0 0\n0 1 0\n2 0 1\n"),
        Catch::Contains("face 0 has 2 indices")
    );
    CHECK(message(header("ascii", "3", "0") + "0 0 0\n1 0 0\n0 1 0\n") == "test.ply: no triangles");
    CHECK(message(header("ascii", "0", "0")) == "test.ply: no triangles");
}

TEST_CASE("PLY: announced sizes are checked against the file") {
    CHECK_THAT(
        message(header("ascii", "4000000000") + kBody),
        Catch::Contains("announces 4000000000 elements 'vertex'")
    );
    CHECK_THAT(
        message(header("binary_little_endian", "3", "2147483648") + std::string(200, '\0')),
        Catch::Contains("announces 2147483648 elements 'face'")
    );
    // A list that is longer than the file.
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement face 1\n"
                        "property list uint int vertex_indices\nend_header\n";
    support::append(bytes, std::uint32_t{4000000000U});
    CHECK_THAT(message(bytes), Catch::Contains("list 'vertex_indices' announces 4e+09"));
    CHECK_THAT(
        message(header("ascii", "3") + "0 0 0\n1 0 0\n0 1 0\n99 0 1 2\n"),
        Catch::Contains("list 'vertex_indices' announces 99 numbers")
    );
    CHECK_THAT(
        message(header("ascii", "3") + "0 0 0\n1 0 0\n0 1 0\n3 0 1"),
        Catch::Contains("announces 3 numbers, the file ends after 5 bytes")
    );
    CHECK_THAT(
        message(header("ascii", "3") + "0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n"),
        Catch::Contains("the length of list 'vertex_indices' is -3")
    );
}
