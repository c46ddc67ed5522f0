#include "io/files.hpp"
#include <farfield/io/png.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <tiny_gltf.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <string>

using namespace farfield;
using support::make_glb;
using support::triangle_binary;
using support::triangle_json;

namespace {

const std::string kMeshes =
    R"([{"name":"tri","primitives":[{"attributes":{"POSITION":0},"indices":1}]}])";
const std::string kNodes = R"([{"mesh":0}])";

Result<io::LoadedScene> load(const std::string& json, const std::string& binary) {
    return support::load_bytes("test.glb", make_glb(json, binary));
}

Result<io::LoadedScene> load(const std::string& json) {
    return load(json, triangle_binary());
}

std::string message(const Result<io::LoadedScene>& loaded) {
    return loaded ? "loaded" : loaded.error().message;
}

std::string message(const std::string& json) {
    return message(load(json));
}

std::string replaced(std::string text, const std::string& old, const std::string& by) {
    const std::size_t at = text.find(old);
    REQUIRE(at != std::string::npos);
    return text.replace(at, old.size(), by);
}

std::string joined(const std::vector<std::string>& lines) {
    std::string all;
    for (const std::string& line : lines) {
        all += line + '\n';
    }
    return all;
}

} // namespace

TEST_CASE("glTF: one triangle, binary and as text with a file beside it") {
    const auto binary = load(triangle_json(kMeshes, kNodes));
    REQUIRE(binary.has_value());
    const Mesh& mesh = binary->scene.meshes.front();
    CHECK(mesh.name == "tri");
    CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2});
    CHECK(mesh.normals.front() == glm::vec3(0, 0, 1)); // computed
    CHECK(mesh.bounds == Box3d{{0, 0, 0}, {1, 1, 0}});
    CHECK(binary->warnings.empty());

    support::TemporaryFolder folder;
    folder.write("data.bin", triangle_binary());
    const std::string json = replaced(
        triangle_json(kMeshes, kNodes), R"("byteLength":44)", R"("byteLength":44,"uri":"data.bin")"
    );
    const auto text = io::load_scene(folder.write("test.gltf", json));
    INFO(message(text));
    REQUIRE(text.has_value());
    CHECK(text->scene.meshes.front().positions == mesh.positions);

    const auto lost =
        io::load_scene(folder.write("lost.gltf", replaced(json, "data.bin", "x.bin")));
    CHECK_THAT(message(lost), Catch::Contains("x.bin"));
}

TEST_CASE("glTF: transforms of nodes multiply in double") {
    const auto loaded = load(triangle_json(
        kMeshes,
        R"([{"children":[1,2],"translation":[10000000.125,0,0],"scale":[2,2,2]},
            {"mesh":0,"rotation":[0,0,0.70710678118654752,0.70710678118654752]},
            {"mesh":0,"matrix":[1,0,0,0, 0,1,0,0, 0,0,1,0, 1,2,3,1]}])"
    ));
    REQUIRE(loaded.has_value());
    const Scene& scene = loaded->scene;
    CHECK(scene.meshes.size() == 1); // instanced
    REQUIRE(scene.instances.size() == 2);
    const auto point = [&scene](std::size_t instance, const glm::dvec3& p) {
        return scene.instances[instance].object_to_world * glm::dvec4(p, 1.0);
    };
    // A quarter turn about z, then twice the size, then 10000000.125 to the right. The rotation is
    // rounded by 2^-53, the coordinates by 2^-30 at most.
    CHECK(glm::length(point(0, {1, 0, 0}) - glm::dvec3(10000000.125, 2, 0)) < 1e-8);
    CHECK(point(1, {1, 0, 0}) == glm::dvec3(10000004.125, 4, 6));
}

TEST_CASE("glTF: only the default scene is shown") {
    const std::string nodes = R"([{"mesh":0},{"mesh":0},{"mesh":0}])";
    const auto count = [&nodes](const char* extra) {
        const auto loaded = load(triangle_json(kMeshes, nodes, extra));
        REQUIRE(loaded.has_value());
        return loaded->scene.instances.size();
    };
    CHECK(count("") == 3);
    CHECK(count(R"(,"scenes":[{"nodes":[0]},{"nodes":[1,2]}])") == 1);
    CHECK(count(R"(,"scene":1,"scenes":[{"nodes":[0]},{"nodes":[1,2]}])") == 2);
}

TEST_CASE("glTF: primitives become parts and share their vertices") {
    const auto loaded = load(triangle_json(
        R"([{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":1},
                           {"attributes":{"POSITION":0},"material":0},
                           {"attributes":{"POSITION":0},"mode":5},
                           {"attributes":{"POSITION":0},"mode":6},
                           {"attributes":{"POSITION":0},"mode":1},
                           {"attributes":{"POSITION":0},"mode":0}]}])",
        kNodes,
        R"(,"materials":[{},{}])"
    ));
    INFO(message(loaded));
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    REQUIRE(mesh.parts.size() == 4);
    CHECK(mesh.positions.size() == 3);
    CHECK(mesh.parts[0].material == MaterialId{1});
    CHECK(mesh.parts[1].material == MaterialId{0});
    CHECK(mesh.parts[2].material == kNone<MaterialId>);
    CHECK_THAT(joined(loaded->warnings), Catch::Contains("2 primitives are points or lines"));
}

TEST_CASE("glTF: a strip turns every other triangle around") {
    std::string binary;
    for (const int value : {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0}) {
        support::append(binary, static_cast<float>(value));
    }
    const auto loaded = load(
        R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":60}],
            "bufferViews":[{"buffer":0,"byteLength":60}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":5}]}],
            "nodes":[{"mesh":0}]})",
        binary
    );
    INFO(message(loaded));
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2, 1, 3, 2, 2, 3, 4});
    for (const glm::vec3& normal : mesh.normals) {
        CHECK(normal == glm::vec3(0, 0, 1));
    }
}

TEST_CASE("glTF: attributes of any kind of number, interleaved") {
    // Three vertices of 20 bytes: position as three shorts (normalised), a pad, a normal as three
    // signed bytes, a pad, colour as four bytes, texcoord as two shorts.
    std::string binary;
    for (int v = 0; v < 3; ++v) {
        support::append(binary, static_cast<std::int16_t>(v == 1 ? 32767 : 0));
        support::append(binary, static_cast<std::int16_t>(v == 2 ? -32768 : 0));
        binary.append(4, '\0');
        binary += std::string("\x00\x7f\x00\x00", 4);
        binary += std::string("\xff\x37\x00\x80", 4);
        support::append(binary, static_cast<std::uint16_t>(65535));
        support::append(binary, static_cast<std::uint16_t>(0));
    }
    const std::string json =
        R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_mesh_quantization"],
            "buffers":[{"byteLength":60}],
            "bufferViews":[{"buffer":0,"byteLength":60,"byteStride":20}],
            "accessors":[
              {"bufferView":0,"componentType":5122,"normalized":true,"count":3,"type":"VEC3"},
              {"bufferView":0,"byteOffset":8,"componentType":5120,"normalized":true,"count":3,
               "type":"VEC3"},
              {"bufferView":0,"byteOffset":12,"componentType":5121,"normalized":true,"count":3,
               "type":"VEC4"},
              {"bufferView":0,"byteOffset":16,"componentType":5123,"normalized":true,"count":3,
               "type":"VEC2"}],
            "meshes":[{"primitives":[{"attributes":
              {"POSITION":0,"NORMAL":1,"COLOR_0":2,"TEXCOORD_0":3}}]}],
            "nodes":[{"mesh":0}]})";
    const auto loaded = load(json, binary);
    INFO(message(loaded));
    REQUIRE(loaded.has_value());
    const Mesh& mesh = loaded->scene.meshes.front();
    CHECK(mesh.positions[1] == glm::vec3(1, 0, 0));
    CHECK(mesh.positions[2] == glm::vec3(0, -1, 0)); // -32768 is -1 as well
    CHECK(mesh.normals[0] == glm::vec3(0, 1, 0));
    // 0x37 / 255 linear is 0.2157, encoded 0.5019 by the formula of IEC 61966-2-1: 128 of 255.
    CHECK(mesh.colors[0] == glm::u8vec4(255, 128, 0, 128));
    CHECK(mesh.texcoords[0] == glm::vec2(1, 0));
}

TEST_CASE("glTF: alpha modes and colours of materials") {
    const auto loaded = load(triangle_json(
        kMeshes,
        kNodes,
        R"(,"materials":[
            {"pbrMetallicRoughness":{"baseColorFactor":[1,0.2158605,0,0.5]}},
            {"alphaMode":"MASK"},{"alphaMode":"MASK","alphaCutoff":0.75},{"alphaMode":"BLEND"},
            {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}])"
    ));
    INFO(message(loaded));
    REQUIRE(loaded.has_value());
    const auto& materials = loaded->scene.materials;
    REQUIRE(materials.size() == 5);
    CHECK(materials[0].base_color.r == 1.0F);
    CHECK(materials[0].base_color.g == Approx(0.50196).margin(1e-4)); // 128 of 255 encoded
    CHECK(materials[0].base_color.b == 0.0F);
    CHECK(materials[0].base_color.a == 0.5F);
    CHECK(materials[0].alpha_cutoff == 0.0F);
    CHECK(materials[1].alpha_cutoff == 0.5F);
    CHECK(materials[2].alpha_cutoff == 0.75F);
    CHECK(materials[3].alpha_cutoff == 0.5F);
    CHECK(materials[4].texture == kNone<TextureId>);
    CHECK_THAT(joined(loaded->warnings), Catch::Contains("1 materials have alpha mode BLEND"));
    CHECK_THAT(joined(loaded->warnings), Catch::Contains("material 4 loses its texture"));
}

TEST_CASE("glTF: textures from a file, a buffer and a data URI, PNG and JPEG") {
    support::TemporaryFolder folder;
    const auto png = folder.path() / "colour.png";
    REQUIRE(io::write_png(png, {1, 1, {10, 20, 30, 40}}).has_value());
    std::ifstream file(png, std::ios::binary);
    const std::string png_bytes{std::istreambuf_iterator<char>(file), {}};
    // A flat colour survives JPEG but for its rounding.
    tinygltf::Image jpeg;
    jpeg.width = jpeg.height = 8;
    jpeg.component = 3;
    jpeg.bits = 8;
    jpeg.image.assign(192, 200);
    const std::string jpeg_name = "colour.jpg";
    std::string jpeg_uri;
    REQUIRE(tinygltf::WriteImageData(nullptr, &jpeg_name, &jpeg, true, &jpeg_uri, nullptr));

    std::string binary = triangle_binary() + png_bytes;
    std::string json = triangle_json(
        kMeshes,
        kNodes,
        R"(,"images":[{"uri":"colour.png"},{"bufferView":2,"mimeType":"image/png"},{"uri":")" +
            jpeg_uri +
            R"("},{"uri":"none.png"}],
            "textures":[{"source":0},{"source":1},{"source":2},{"source":3},{"source":0}],
            "materials":[
             {"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}},
             {"pbrMetallicRoughness":{"baseColorTexture":{"index":1}}},
             {"pbrMetallicRoughness":{"baseColorTexture":{"index":2}}},
             {"pbrMetallicRoughness":{"baseColorTexture":{"index":3}}},
             {"pbrMetallicRoughness":{"baseColorTexture":{"index":4}}}])"
    );
    json = replaced(
        json,
        R"("byteLength":6})",
        R"("byteLength":6},{"buffer":0,"byteOffset":44,"byteLength":)" +
            std::to_string(png_bytes.size()) + "}"
    );
    json = replaced(json, R"("byteLength":44)", R"("byteLength":)" + std::to_string(binary.size()));
    const auto path = folder.write("test.glb", make_glb(json, binary));
    const auto loaded = io::load_scene(path);
    INFO(message(loaded));
    REQUIRE(loaded.has_value());
    const Scene& scene = loaded->scene;
    REQUIRE(scene.textures.size() == 3);
    CHECK(scene.textures[0].pixels == std::vector<std::uint8_t>{10, 20, 30, 40});
    CHECK(scene.textures[1].pixels == std::vector<std::uint8_t>{10, 20, 30, 40});
    REQUIRE(scene.textures[2].pixels.size() == 256);
    CHECK(std::abs(scene.textures[2].pixels[0] - 200) <= 2);
    CHECK(scene.textures[2].pixels[3] == 255);
    CHECK(scene.materials[3].texture == kNone<TextureId>);
    CHECK(scene.materials[4].texture == scene.materials[0].texture); // decoded once
    CHECK_THAT(joined(loaded->warnings), Catch::Contains("image 3"));

    const auto small = io::load_scene(path, {.max_texture_side = 4});
    REQUIRE(small.has_value());
    CHECK(small->scene.textures.size() == 2);
    CHECK_THAT(joined(small->warnings), Catch::Contains("8 x 8 texels, more than 4 a side"));
    const auto few = io::load_scene(path, {.max_texture_bytes = 7});
    REQUIRE(few.has_value());
    CHECK(few->scene.textures.size() == 1);
    CHECK_THAT(joined(few->warnings), Catch::Contains("more than 7 bytes of textures"));
}

TEST_CASE("glTF: vertices that a mesh does not use do not widen it") {
    std::string binary = triangle_binary();
    const float far = 1000.0F;
    std::string vertices = binary.substr(0, 36);
    for (int i = 0; i < 3; ++i) {
        support::append(vertices, far);
    }
    const auto loaded = load(
        R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":56}],
            "bufferViews":[{"buffer":0,"byteLength":48},
                           {"buffer":0,"byteOffset":48,"byteLength":6}],
            "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
                         {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
            "meshes":)" +
            kMeshes + R"(,"nodes":[{"mesh":0}]})",
        vertices + binary.substr(36)
    );
    INFO(message(loaded));
    REQUIRE(loaded.has_value());
    CHECK(loaded->scene.meshes.front().bounds.hi.x == 1.0);
}

TEST_CASE("glTF: what points beyond its array is refused with its number") {
    const std::string whole = triangle_json(kMeshes, kNodes);
    const auto with = [&whole](const std::string& old, const std::string& by) {
        return message(replaced(whole, old, by));
    };
    CHECK_THAT(with(R"("POSITION":0)", R"("POSITION":9)"), Catch::Contains("accessor 9 of 2"));
    CHECK_THAT(
        with(R"("indices":1)", R"("indices":7)"), Catch::Contains("indices accessor out of bounds")
    );
    CHECK_THAT(
        with(R"("bufferView":0,"comp)", R"("bufferView":5,"comp)"),
        Catch::Contains("buffer view 5 of 2")
    );
    CHECK_THAT(
        with(R"({"buffer":0,"byteLength":36)", R"({"buffer":3,"byteLength":36)"),
        Catch::Contains("buffer 3 of 1")
    );
    CHECK_THAT(
        with(R"("byteLength":36)", R"("byteLength":3600)"),
        Catch::Contains("takes 3600 bytes from 0 of a buffer of 44")
    );
    CHECK_THAT(
        with(R"("byteOffset":36)", R"("byteOffset":4294967290)"), Catch::Contains("from 4294967290")
    );
    CHECK_THAT(
        with(R"("count":3,"type":"VEC3")", R"("count":4,"type":"VEC3")"),
        Catch::Contains("has 4 elements of 12 bytes")
    );
    CHECK_THAT(
        with(R"("count":3,"type":"VEC3")", R"("count":2147483648,"type":"VEC3")"),
        Catch::Contains("has 2147483648 elements")
    );
    CHECK_THAT(
        with(R"("count":3,"type":"VEC3")", R"("count":2,"type":"VEC3")"),
        Catch::Contains("index 2 is 2 of 2 vertices")
    );
    CHECK_THAT(
        with(R"("count":3,"type":"SCALAR")", R"("count":2,"type":"SCALAR")"),
        Catch::Contains("2 corners, not a multiple of 3")
    );
    CHECK_THAT(with(R"("VEC3")", R"("VEC2")"), Catch::Contains("POSITION has 2 components"));
    CHECK_THAT(
        with(R"("componentType":5123)", R"("componentType":5126)"), Catch::Contains("elements of 4")
    );
    CHECK_THAT(with(R"("mesh":0)", R"("mesh":4)"), Catch::Contains("node 0 has mesh 4 of 1"));
    CHECK_THAT(with(R"("mesh":0)", R"("children":[8])"), Catch::Contains("node 8 of 1"));
    CHECK_THAT(with(R"("indices":1)", R"("material":0)"), Catch::Contains("material 0 of 0"));
    CHECK_THAT(
        with(R"("indices":1)", R"("attributes2":0)"), Catch::Equals("loaded")
    ); // without indices, and an unknown member
    CHECK_THAT(with(R"("byteLength":44)", R"("byteLength":45)"), Catch::Contains("test.glb: "));
}

TEST_CASE("glTF: positions that are not finite are refused with their place") {
    std::string binary = triangle_binary();
    const float inf = INFINITY;
    binary.replace(16, 4, reinterpret_cast<const char*>(&inf), 4);
    const auto loaded = load(triangle_json(kMeshes, kNodes), binary);
    CHECK_THAT(message(loaded), Catch::Contains("mesh 0 primitive 0 POSITION 1[1] is inf"));
}

TEST_CASE("glTF: nodes must be a forest of finite depth") {
    CHECK_THAT(
        message(
            triangle_json(kMeshes, R"([{"mesh":0,"children":[0]}])", R"(,"scenes":[{"nodes":[0]}])")
        ),
        Catch::Contains("node 0 is reached twice")
    );
    CHECK_THAT(
        message(triangle_json(
            kMeshes,
            R"([{"children":[1]},{"children":[0],"mesh":0}])",
            R"(,"scenes":[{"nodes":[0]}])"
        )),
        Catch::Contains("node 0 is reached twice")
    );
    // Without the check two children each, thirty levels deep, would make 2^30 instances.
    CHECK_THAT(
        message(triangle_json(kMeshes, R"([{"children":[1,1]},{"mesh":0}])")),
        Catch::Contains("node 1 is reached twice")
    );
    const auto chain = [](int length) {
        std::string nodes = "[";
        for (int i = 0; i + 1 < length; ++i) {
            nodes += R"({"children":[)" + std::to_string(i + 1) + "]},";
        }
        return nodes + R"({"mesh":0}])";
    };
    CHECK(message(triangle_json(kMeshes, chain(1000))) == "loaded");
    CHECK_THAT(
        message(triangle_json(kMeshes, chain(1100))), Catch::Contains("more than 1024 levels")
    );
}

TEST_CASE("glTF: what tinygltf would read without looking is refused before") {
    const std::string whole = make_glb(triangle_json(kMeshes, kNodes), triangle_binary());
    const auto refused = [](const std::string& bytes) {
        return message(support::load_bytes("test.glb", bytes));
    };
    CHECK_THAT(refused(whole.substr(0, 19)), Catch::Contains("not a binary glTF"));
    std::string changed = whole;
    changed[4] = 1;
    CHECK_THAT(refused(changed), Catch::Contains("version 1"));
    changed = whole;
    changed[11] = 1;
    CHECK_THAT(refused(changed), Catch::Contains("the header announces"));
    changed = whole;
    changed[15] = 1;
    CHECK_THAT(refused(changed), Catch::Contains("the JSON chunk has"));
    changed = whole;
    changed[whole.size() - 44 - 8] += 8; // the binary chunk is 8 bytes longer than the file
    CHECK_THAT(refused(changed), Catch::Contains("the binary chunk has 52 bytes"));

    const std::string deep = R"(,"extras":)" + std::string(200000, '[') + std::string(200000, ']');
    CHECK_THAT(
        message(triangle_json(kMeshes, kNodes, deep)), Catch::Contains("nested 200001 deep")
    );
    CHECK_THAT(
        message(replaced(
            triangle_json(kMeshes, kNodes),
            R"({"byteLength":44})",
            R"({"byteLength":44},{"byteLength":44})"
        )),
        Catch::Contains("2 buffers have no uri")
    );
    CHECK_THAT(
        message(triangle_json(
            kMeshes, kNodes, R"(,"extensionsRequired":["KHR_draco_mesh_compression"])"
        )),
        Catch::Contains("'KHR_draco_mesh_compression'")
    );
    CHECK_THAT(message(std::string("{\"asset\":")), Catch::Contains("not JSON"));
}

TEST_CASE("glTF: a file may not unfold without bound") {
    // Every mesh has vertices of its own, though all share three accessors.
    std::string meshes = "[";
    for (int i = 0; i < 20000; ++i) {
        meshes += R"({"primitives":[{"attributes":{"POSITION":0},"indices":1}]},)";
    }
    meshes.back() = ']';
    // 20000 meshes of 60 characters of text: honest, each stands in the file.
    CHECK(message(triangle_json(meshes, kNodes)) == "loaded");

    std::string json = triangle_json(meshes, kNodes);
    std::string binary(360000, '\0');
    json = replaced(json, R"("byteLength":44)", R"("byteLength":)" + std::to_string(binary.size()));
    json = replaced(
        json, R"("byteLength":36})", R"("byteLength":)" + std::to_string(binary.size()) + "}"
    );
    json = replaced(json, R"("count":3,"type":"VEC3")", R"("count":30000,"type":"VEC3")");
    const auto bomb = load(json, binary);
    REQUIRE_FALSE(bomb.has_value());
    CHECK(bomb.error().code == ErrorCode::out_of_memory);
    CHECK_THAT(bomb.error().message, Catch::Contains("64 times"));
}

TEST_CASE("glTF: no triangles is an error of its own") {
    CHECK(message(triangle_json("[]", "[{}]")) == "test.glb: no triangles");
    CHECK(
        message(
            triangle_json(R"([{"primitives":[{"attributes":{"POSITION":0},"mode":0}]}])", kNodes)
        ) == "test.glb: no triangles"
    );
}
