#include "io/files.hpp"
#include <farfield/io/png.hpp>

#include <catch2/catch.hpp>

#include <string>

using namespace farfield;
using support::load_bytes;

namespace {

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

Result<io::LoadedScene> load(const std::string& text) {
    return load_bytes("test.obj", text);
}

std::string message(const std::string& text) {
    const auto loaded = load(text);
    return loaded ? "loaded" : loaded.error().message;
}

} // namespace

TEST_CASE("OBJ: a polygon becomes a fan") {
    const auto loaded = load(kSquare + "f 1 2 3 4\n");
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
    CHECK(mesh.name == "test");
    CHECK(mesh.bounds == Box3d{{0, 0, 0}, {1, 1, 0}});
    CHECK(mesh.normals.front() == glm::vec3(0, 0, 1));
    CHECK(loaded->scene.instances.size() == 1);
    CHECK(loaded->warnings.empty());
}

TEST_CASE("OBJ: every way of writing a corner") {
    const std::string arrays = kSquare + "vt 0.25 0.75\nvn 0 1 0\n";
    const auto face = GENERATE(
        "f 1 2 3",
        "f 1/ 2/ 3/",
        "f 1// 2// 3//",
        "f 1/1 2/1 3/1",
        "f 1//1 2//1 3//1",
        "f 1/1/1 2/1/1 3/1/1",
        "f -4 -3 -2",
        "f -4/-1/-1 -3/-1/-1 -2/-1/-1",
        "f 1 \\\n2 \\\r\n3",
        "f 1 2 3 # 4 5",
        "  f\t1  2\t3  "
    );
    INFO(face);
    const auto loaded = load(arrays + face + "\n");
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    REQUIRE(mesh.indices.size() == 3);
    const std::string word(face);
    if (word.find("/1/1") != std::string::npos || word.find("/-1") != std::string::npos) {
        CHECK(mesh.texcoords.front() == glm::vec2(0.25F, 0.25F)); // from the top
    }
    const bool has_normal = word.find("/1/1") != std::string::npos ||
                            word.find("//1") != std::string::npos ||
                            word.find("/-1/-1") != std::string::npos;
    CHECK(mesh.normals.front() == (has_normal ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 1)));
}

TEST_CASE("OBJ: corners that differ in one index are different vertices") {
    const auto loaded = load(kSquare + "vt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 3/1 4/1\n");
    REQUIRE(loaded.has_value());
    CHECK(loaded->scene.meshes.front().positions.size() == 5);
}

TEST_CASE("OBJ: line ends, comments, groups and elements defined later") {
    const auto loaded =
        load("# comment \\\r\no f 1 2 3\r\ng a f b\r\ns off\r\nf 1 2 3\r\nv 0 0 0\r\nv 1 0 0\r\n"
             "v 1 1 0");
    REQUIRE(loaded.has_value());
    CHECK(primitive_count(loaded->scene) == 1);
}

TEST_CASE("OBJ: errors name the line and the value") {
    CHECK(message("v 0 0 nan\n") == "test.obj:1: vertex coordinate z is nan");
    CHECK(message("\nv 0 -inf 0\n") == "test.obj:2: vertex coordinate y is -inf");
    CHECK(message("v 1e999 0 0\n") == "test.obj:1: vertex coordinate x is inf");
    CHECK(message("v 0 0\n") == "test.obj:1: a vertex has 2 numbers instead of 3");
    CHECK(message("v 0 zero 0\n") == "test.obj:1: a vertex has 'zero' where a number should be");
    CHECK(message("vt nan 0\n") == "test.obj:1: a texture vertex is nan 0");
    CHECK(message(kSquare + "f 1 2\n") == "test.obj:5: a face has 2 indices instead of 3 or more");
    CHECK(
        message(kSquare + "f 0 1 2\n") == "test.obj:5: vertex index is '0', outside the 4 so far"
    );
    CHECK(
        message(kSquare + "f -5 1 2\n") == "test.obj:5: vertex index is '-5', outside the 4 so far"
    );
    CHECK(message(kSquare + "f 1 2 99\n\n") == "test.obj:5: vertex index is 99 of 4");
    CHECK(message(kSquare + "f 1/1 2/1 3/1\n") == "test.obj:5: texture vertex index is 1 of 0");
    CHECK(message(kSquare + "f 1//2 2//2 3//2") == "test.obj:5: vertex normal index is 2 of 0");
    CHECK_THAT(message(kSquare + "f 1 2 2147483648\n"), Catch::Contains("'2147483648'"));
    CHECK_THAT(
        message(kSquare + "f 1 2 99999999999999999999\n"), Catch::Contains("not a whole number")
    );
    CHECK(message(kSquare) == "test.obj: no triangles");
    CHECK_THAT(
        message("v 0 0 0\nv 1e39 0 0\nv 0 1 0\nf 1 2 3\n"),
        Catch::Contains("too far from the others")
    );
}

TEST_CASE("OBJ: positions far from 0 keep their digits") {
    const auto loaded =
        load("v 10000000.125 0 0\nv 10000001.125 0 0\nv 10000000.125 1.0009765625 0\nf 1 2 3\n");
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    // All numbers are multiples of 2^-10, so nothing is rounded.
    CHECK(mesh.origin.x + static_cast<double>(mesh.positions[0].x) == 10000000.125);
    CHECK(mesh.origin.y + static_cast<double>(mesh.positions[2].y) == 1.0009765625);
}

TEST_CASE("OBJ: tiny and huge numbers") {
    const auto loaded = load("v 1e-400 0 0\nv 1e30 0 0\nv +1 1e-30 0\nf 1 2 3\n");
    REQUIRE(loaded.has_value());
    CHECK(loaded->scene.meshes.front().bounds.hi.x == Approx(1e30));
}

TEST_CASE("OBJ: vertex colours, NaN among them") {
    const auto loaded =
        load("v 0 0 0 1 0.5 0\nv 1 0 0 nan 0 0\nv 0 1 0 2 -1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n");
    REQUIRE(loaded.has_value());
    const auto& colors = loaded->scene.meshes.front().colors;
    REQUIRE(colors.size() == 4);
    CHECK(colors[0] == glm::u8vec4(255, 128, 0, 255));
    CHECK(colors[1] == glm::u8vec4(255));
    CHECK(colors[2] == glm::u8vec4(255, 0, 0, 255));
    CHECK(colors[3] == glm::u8vec4(255));
    REQUIRE(loaded->warnings.size() == 1);
    CHECK_THAT(loaded->warnings[0], Catch::StartsWith("1 vertex colours are not numbers"));
}

TEST_CASE("OBJ: normals of no length or of no number are computed") {
    const auto loaded = load(kSquare + "vn 0 0 0\nvn nan 0 0\nvn 0 0 -5\nf 1//1 2//2 3//3\n");
    REQUIRE(loaded.has_value());
    const auto& normals = loaded->scene.meshes.front().normals;
    CHECK(normals[0] == glm::vec3(0, 0, 1));
    CHECK(normals[1] == glm::vec3(0, 0, 1));
    CHECK(normals[2] == glm::vec3(0, 0, -1));
}

TEST_CASE("OBJ: materials make parts in the order of first use") {
    support::TemporaryFolder folder;
    REQUIRE(io::write_png(folder.path() / "brick wall.png", {1, 1, {9, 8, 7, 255}}).has_value());
    REQUIRE(io::write_png(folder.path() / "leaf.png", {1, 1, {9, 8, 7, 100}}).has_value());
    folder.write(
        "the colours.mtl",
        "# comment\nnewmtl red\nKd 1 0 0.5\nd 0.25\nnewmtl wall\nmap_Kd brick wall.png\n"
        "newmtl leaf\nmap_Kd -s 1 1 1 .\\leaf.png\nnewmtl odd\nKd nan x\nTr 0\nmap_Kd none.png\n"
    );
    const auto path = folder.write(
        "test.obj",
        kSquare + "mtllib the colours.mtl\nf 1 2 3\nusemtl wall\nf 1 2 3\nusemtl red\nf 1 2 3\n"
                  "usemtl wall\nf 2 3 4\nusemtl leaf\nf 1 2 3\nusemtl odd\nf 1 2 3\n"
                  "usemtl lost\nf 1 2 3\n"
    );
    const auto loaded = io::load_scene(path);
    REQUIRE(loaded.has_value());
    const Scene& scene = loaded->scene;
    const auto& parts = scene.meshes.front().parts;
    REQUIRE(parts.size() == 6);
    const auto material_of = [&scene](const MeshPart& part) {
        REQUIRE(part.material != kNone<MaterialId>);
        return scene.materials[index_of(part.material)];
    };
    CHECK(parts[0].index_count == 6); // wall, both runs
    CHECK(material_of(parts[0]).alpha_cutoff == 0.0F);
    REQUIRE(material_of(parts[0]).texture != kNone<TextureId>);
    CHECK(
        scene.textures[index_of(material_of(parts[0]).texture)].pixels ==
        std::vector<std::uint8_t>{9, 8, 7, 255}
    );
    CHECK(material_of(parts[1]).base_color == glm::vec4(1, 0, 0.5, 0.25));
    CHECK(material_of(parts[1]).alpha_cutoff == 0.5F);
    CHECK(material_of(parts[2]).alpha_cutoff == 0.5F); // leaf
    CHECK(material_of(parts[3]).base_color == glm::vec4(1.0F));
    CHECK(material_of(parts[3]).texture == kNone<TextureId>);
    CHECK(parts[4].material == kNone<MaterialId>); // lost
    CHECK(parts[5].material == kNone<MaterialId>); // before the first usemtl
    std::string all;
    for (const std::string& warning : loaded->warnings) {
        all += warning + '\n';
    }
    CHECK_THAT(all, Catch::Contains("none.png does not exist"));
    CHECK_THAT(all, Catch::Contains("'lost'"));
    CHECK_THAT(all, Catch::Contains("'red' is translucent"));
    CHECK_THAT(all, Catch::Contains("'leaf' is translucent"));
}

TEST_CASE("OBJ: libraries that are not there, lines and curves become warnings") {
    const auto loaded = load(kSquare + "mtllib a.mtl b.mtl\nl 1 2\np 1\ncurv 0 1 1 2\nf 1 2 3\n");
    REQUIRE(loaded.has_value());
    REQUIRE(loaded->warnings.size() == 4);
    CHECK_THAT(loaded->warnings[0], Catch::Contains("a.mtl does not exist"));
    CHECK_THAT(loaded->warnings[1], Catch::Contains("b.mtl does not exist"));
    CHECK_THAT(loaded->warnings[2], Catch::Contains("2 lines and points"));
    CHECK_THAT(loaded->warnings[3], Catch::Contains("1 free-form"));
}

TEST_CASE("load_scene: files that are no files") {
    support::TemporaryFolder folder;
    const auto missing = io::load_scene(folder.path() / "missing.obj");
    REQUIRE_FALSE(missing.has_value());
    CHECK(missing.error().code == ErrorCode::not_found);

    std::filesystem::create_directory(folder.path() / "folder.ply");
    const auto directory = io::load_scene(folder.path() / "folder.ply");
    REQUIRE_FALSE(directory.has_value());
    CHECK_THAT(directory.error().message, Catch::Contains("is not a file"));

    for (const char* const name :
         {"e.obj", "e.off", "e.ply", "e.stl", "e.gltf", "e.glb", "e.pdb", "e.png"}) {
        const auto empty = io::load_scene(folder.write(name, ""));
        REQUIRE_FALSE(empty.has_value());
        CHECK_THAT(empty.error().message, Catch::EndsWith("is empty"));
    }
    const auto other = io::load_scene(folder.write("model.fbx", "x"));
    REQUIRE_FALSE(other.has_value());
    CHECK(other.error().code == ErrorCode::unsupported);
    CHECK_THAT(other.error().message, Catch::Contains("'.fbx'"));

    const auto large = io::load_scene(folder.write("a.obj", kSquare), {.max_file_bytes = 10});
    REQUIRE_FALSE(large.has_value());
    CHECK(large.error().code == ErrorCode::out_of_memory);
}

TEST_CASE("load_scene: options and the upper case") {
    std::string strip;
    for (int i = 0; i < 1100; ++i) {
        strip += "v " + std::to_string(i) + " " + std::to_string(i % 2) + " 0\n";
    }
    for (int i = 1; i < 1099; ++i) {
        strip += "f -" + std::to_string(i) + " -" + std::to_string(i + 1) + " -" +
                 std::to_string(i + 2) + "\n";
    }
    const auto plain = load_bytes("Strip.OBJ", strip, {.flag_splittable = false});
    REQUIRE(plain.has_value());
    CHECK_FALSE(plain->scene.meshes.front().splittable);
    CHECK(plain->scene.up == glm::dvec3(0, 1, 0));
    CHECK(plain->scene.name == "Strip");
    const auto split = load_bytes("strip.obj", strip, {.up = io::UpAxis::z});
    REQUIRE(split.has_value());
    CHECK(split->scene.meshes.front().splittable);
    CHECK(split->scene.up == glm::dvec3(0, 0, 1));
}
