#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <tuple>
#include <vector>

using namespace farfield;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A unit square in the plane z = 0 of two triangles, with every array filled.
Mesh make_square() {
    Mesh mesh;
    mesh.name = "square";
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.normals.assign(4, {0, 0, 1});
    mesh.colors.assign(4, {255, 128, 0, 255});
    mesh.texcoords = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
    mesh.indices = {0, 1, 2, 0, 2, 3};
    mesh.parts = {{0, 6, MaterialId{0}}};
    update_bounds(mesh);
    return mesh;
}

Scene make_scene() {
    Scene scene;
    scene.meshes.push_back(make_square());
    scene.textures.push_back({1, 1, {255, 255, 255, 255}});
    scene.materials.push_back({glm::vec4(1.0F), TextureId{0}, 0.5F});
    scene.instances.push_back({MeshId{0}});
    return scene;
}

/// A strip of `count` triangles along x, as wide as `length`.
Mesh make_strip(std::uint32_t count, float length) {
    Mesh mesh;
    for (std::uint32_t i = 0; i < count + 2; ++i) {
        mesh.positions.emplace_back(
            length * static_cast<float>(i) / static_cast<float>(count + 1),
            static_cast<float>(i % 2),
            0.0F
        );
    }
    for (std::uint32_t i = 0; i < count; ++i) {
        mesh.indices.insert(mesh.indices.end(), {i, i + 1, i + 2});
    }
    mesh.parts = {{0, 3 * count}};
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

using Corner = std::tuple<double, double, double>;

/// Triangles of a scene as sorted world corners.
std::multiset<std::array<Corner, 3>> world_triangles(const Scene& scene) {
    std::multiset<std::array<Corner, 3>> all;
    for (const Instance& instance : scene.instances) {
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
            std::array<Corner, 3> triangle;
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::dvec3 local =
                    mesh.origin + glm::dvec3(mesh.positions[mesh.indices[i + k]]);
                const glm::dvec3 p = instance.object_to_world * glm::dvec4(local, 1.0);
                triangle[k] = {p.x, p.y, p.z};
            }
            std::sort(triangle.begin(), triangle.end());
            all.insert(triangle);
        }
    }
    return all;
}

} // namespace

TEST_CASE("validate accepts the empty scene and a whole one") {
    CHECK(validate(Scene{}).has_value());
    CHECK(validate(make_scene()).has_value());
}

TEST_CASE("validate names what is wrong, where and which value") {
    struct Fault {
        const char* words;
        void (*make)(Scene&);
    };
    const auto fault = GENERATE(
        Fault{"mesh 0 (square) has no triangles", [](Scene& s) { s.meshes[0].indices.clear(); }},
        Fault{"has 5 indices", [](Scene& s) { s.meshes[0].indices.pop_back(); }},
        Fault{"index 1 is 4, beyond the 4", [](Scene& s) { s.meshes[0].indices[1] = 4; }},
        Fault{"3 normals for 4", [](Scene& s) { s.meshes[0].normals.pop_back(); }},
        Fault{"3 colours for 4", [](Scene& s) { s.meshes[0].colors.pop_back(); }},
        Fault{"3 texcoords for 4", [](Scene& s) { s.meshes[0].texcoords.pop_back(); }},
        Fault{"position 2.y is nan", [](Scene& s) { s.meshes[0].positions[2].y = kNan; }},
        Fault{"texcoord 1.x is nan", [](Scene& s) { s.meshes[0].texcoords[1].x = kNan; }},
        Fault{"origin.z is inf", [](Scene& s) { s.meshes[0].origin.z = INFINITY; }},
        Fault{
            "normal 3 has length 2",
            [](Scene& s) {
                s.meshes[0].normals[3] = {0, 2, 0};
            }},
        Fault{"normal 3 has length nan", [](Scene& s) { s.meshes[0].normals[3].x = kNan; }},
        Fault{"bounds are not finite", [](Scene& s) { s.meshes[0].bounds = {}; }},
        Fault{"position 1 is outside the bounds", [](Scene& s) { s.meshes[0].bounds.hi.x = 0.5; }},
        Fault{"parts cover 0 of 6", [](Scene& s) { s.meshes[0].parts.clear(); }},
        Fault{"parts cover 3 of 6", [](Scene& s) { s.meshes[0].parts[0].index_count = 3; }},
        Fault{"4 indices, not a multiple", [](Scene& s) { s.meshes[0].parts[0].index_count = 4; }},
        Fault{"starts at index 3", [](Scene& s) { s.meshes[0].parts[0].first_index = 3; }},
        Fault{"material 7 of 1", [](Scene& s) { s.meshes[0].parts[0].material = MaterialId{7}; }},
        Fault{
            "is splittable and has 2 parts",
            [](Scene& s) {
                s.meshes[0].splittable = true;
                s.meshes[0].parts = {{0, 3}, {3, 3}};
            }},
        Fault{"texture 0 is 0 x 1", [](Scene& s) { s.textures[0].width = 0; }},
        Fault{"has 3 bytes instead of 4", [](Scene& s) { s.textures[0].pixels.pop_back(); }},
        Fault{"base_color[2] is 1.5", [](Scene& s) { s.materials[0].base_color.b = 1.5F; }},
        Fault{"alpha_cutoff is nan", [](Scene& s) { s.materials[0].alpha_cutoff = kNan; }},
        Fault{"texture 3 of 1", [](Scene& s) { s.materials[0].texture = TextureId{3}; }},
        Fault{"instance 0 has mesh 9 of 1", [](Scene& s) { s.instances[0].mesh = MeshId{9}; }},
        Fault{"column 1.z is nan", [](Scene& s) { s.instances[0].object_to_world[1].z = NAN; }},
        Fault{
            "world box is not finite",
            [](Scene& s) {
                s.instances[0].object_to_world[0].x = 1e308;
                s.instances[0].object_to_world[1].x = 1e308;
            }},
        Fault{"to_light is zero", [](Scene& s) { s.light.to_light = glm::vec3(0.0F); }},
        Fault{"to_light.x is nan", [](Scene& s) { s.light.to_light.x = kNan; }},
        Fault{"ambient is 2", [](Scene& s) { s.light.ambient = 2.0F; }},
        Fault{"sky[1] is -1", [](Scene& s) { s.sky.g = -1.0F; }},
        Fault{"up has length 0", [](Scene& s) { s.up = glm::dvec3(0.0); }}
    );
    Scene scene = make_scene();
    fault.make(scene);
    const auto checked = validate(scene);
    INFO(fault.words);
    REQUIRE_FALSE(checked.has_value());
    CHECK(checked.error().code == ErrorCode::bad_data);
    CHECK_THAT(checked.error().message, Catch::Contains(fault.words));
}

TEST_CASE("item_bounds holds every transformed point and is exact for translations") {
    CHECK(is_empty(scene_bounds(Scene{})));
    Scene scene = make_scene();
    scene.instances[0].object_to_world[3] = {1e7, -2.0, 3.0};
    CHECK(item_bounds(scene, ItemId{0}) == Box3d{{1e7, -2, 3}, {1e7 + 1, -1, 3}});
    CHECK(scene_bounds(scene) == item_bounds(scene, ItemId{0}));

    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-2.0, 2.0);
    for (int run = 0; run < 200; ++run) {
        glm::dmat4x3& matrix = scene.instances[0].object_to_world;
        for (int column = 0; column < 4; ++column) {
            matrix[column] = {uniform(random), uniform(random), uniform(random)};
        }
        // Each side adds three rounded products of at most 2 to a translation of at most 2: six
        // roundings of numbers below 8 are below 6 * 8 * 2^-53.
        const Box3d box = inflate(item_bounds(scene, ItemId{0}), glm::dvec3(48.0 * 0x1.0p-53));
        for (const glm::vec3& position : scene.meshes[0].positions) {
            CHECK(contains(box, glm::dvec3(matrix * glm::dvec4(glm::dvec3(position), 1.0))));
        }
    }
}

TEST_CASE("a placement is checked by itself as with its scene") {
    Scene scene = make_scene();
    const Box3d& bounds = scene.meshes[0].bounds;
    glm::dmat4x3& matrix = scene.instances[0].object_to_world;
    CHECK(check_placement(ItemId{0}, bounds, matrix).has_value());
    CHECK(placed_bounds(bounds, matrix) == item_bounds(scene, ItemId{0}));
    for (int column = 0; column < 4; ++column) {
        for (int row = 0; row < 3; ++row) {
            for (const double value :
                 {std::numeric_limits<double>::quiet_NaN(),
                  std::numeric_limits<double>::infinity(),
                  -std::numeric_limits<double>::infinity()}) {
                matrix = glm::dmat4x3(1.0);
                matrix[column][row] = value;
                CAPTURE(column, row, value);
                const Result<void> alone = check_placement(ItemId{0}, bounds, matrix);
                const Result<void> whole = validate(scene);
                REQUIRE_FALSE(alone.has_value());
                REQUIRE_FALSE(whole.has_value());
                CHECK(alone.error().message == whole.error().message);
                CHECK_THAT(
                    alone.error().message,
                    Catch::StartsWith(
                        "instance 0: column " + std::to_string(column) + '.' + "xyz"[row] + " is "
                    )
                );
            }
        }
    }
}

TEST_CASE("the box of a mesh without vertices stays empty in the world") {
    Scene scene = make_scene();
    scene.meshes[0].positions.clear();
    update_bounds(scene.meshes[0]);
    CHECK(is_empty(scene.meshes[0].bounds));
    CHECK(is_empty(item_bounds(scene, ItemId{0})));
}

TEST_CASE("primitives count every instance, memory every mesh once") {
    Scene scene = make_scene();
    const std::uint64_t one = memory_bytes(scene);
    scene.instances.push_back({MeshId{0}});
    CHECK(primitive_count(scene.meshes[0]) == 2);
    CHECK(primitive_count(scene) == 4);
    CHECK(memory_bytes(scene) == one + sizeof(Instance));
    scene.meshes[0].indices.push_back(0);
    CHECK(memory_bytes(scene) == one + sizeof(Instance) + sizeof(std::uint32_t));
}

TEST_CASE("update_bounds includes the origin") {
    Mesh mesh = make_square();
    mesh.origin = {1e7, 0.0, -5.0};
    update_bounds(mesh);
    CHECK(mesh.bounds == Box3d{{1e7, 0, -5}, {1e7 + 1, 1, -5}});
}

TEST_CASE("compute_normals weighs by area and survives degenerate triangles") {
    Mesh mesh;
    // Two triangles at vertex 0: area 2 facing +z and area 1 facing +x; one of no area, and a
    // vertex that nothing uses.
    mesh.positions = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 1, 0}, {0, 0, 2}, {5, 5, 5}};
    mesh.indices = {0, 1, 2, 0, 3, 4, 0, 1, 1};
    compute_normals(mesh);
    REQUIRE(mesh.normals.size() == 6);
    const glm::dvec3 expected = glm::normalize(glm::dvec3(1.0, 0.0, 2.0));
    // The weights are exact, one rounding to float remains in each coordinate.
    CHECK(glm::length(glm::dvec3(mesh.normals[0]) - expected) < 2e-7);
    CHECK(mesh.normals[1] == glm::vec3(0, 0, 1));
    CHECK(mesh.normals[4] == glm::vec3(1, 0, 0));
    CHECK(mesh.normals[5] == glm::vec3(0, 1, 0));
}

TEST_CASE("compute_normals neither overflows nor vanishes") {
    const float size = GENERATE(1e-30F, 1.0F, 1e30F);
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}};
    mesh.indices = {0, 1, 2};
    compute_normals(mesh);
    CHECK(mesh.normals[0] == glm::vec3(0, 0, 1));
}

TEST_CASE("flag_splittable flags what is large, wide and used once") {
    Scene scene;
    scene.meshes = {
        make_strip(1024, 100.0F), // terrain
        make_strip(1023, 100.0F), // too few triangles
        make_strip(1024, 24.0F),  // too small
        make_strip(1024, 100.0F), // used twice
    };
    for (const unsigned mesh : {0U, 1U, 2U, 3U, 3U}) {
        scene.instances.push_back({MeshId{mesh}});
    }
    flag_splittable(scene);
    CHECK(scene.meshes[0].splittable);
    CHECK_FALSE(scene.meshes[1].splittable);
    CHECK_FALSE(scene.meshes[2].splittable);
    CHECK_FALSE(scene.meshes[3].splittable);
    CHECK(scene.meshes.size() == 4);
    CHECK(scene.instances.size() == 5);
}

TEST_CASE("flag_splittable gives every part a mesh and an instance of its own") {
    Scene scene;
    scene.materials.resize(2);
    Mesh mesh = make_strip(3000, 100.0F);
    mesh.colors.assign(mesh.positions.size(), {1, 2, 3, 4});
    mesh.texcoords.assign(mesh.positions.size(), {0.5F, 0.25F});
    mesh.parts = {{0, 3000, MaterialId{1}}, {3000, 0, MaterialId{1}}, {3000, 6000, MaterialId{0}}};
    scene.meshes = {mesh, make_strip(10, 1.0F)};
    scene.instances = {{MeshId{0}}, {MeshId{1}}};
    scene.instances[0].object_to_world[3] = {1.0, 2.0, 3.0};
    const auto before = world_triangles(scene);
    flag_splittable(scene);

    REQUIRE(scene.meshes.size() == 3);
    REQUIRE(scene.instances.size() == 3);
    CHECK(validate(scene).has_value());
    CHECK(world_triangles(scene) == before);
    CHECK(index_of(scene.instances[0].mesh) == 0);
    CHECK(index_of(scene.instances[1].mesh) == 1); // the ids of others stay
    CHECK(index_of(scene.instances[2].mesh) == 2);
    for (const std::size_t part : {0U, 2U}) {
        CHECK(scene.meshes[part].splittable);
        CHECK(scene.meshes[part].parts.size() == 1);
        CHECK(scene.meshes[part].colors.front() == glm::u8vec4(1, 2, 3, 4));
        CHECK(scene.meshes[part].texcoords.front() == glm::vec2(0.5F, 0.25F));
    }
    CHECK(scene.meshes[0].parts[0].material == MaterialId{1});
    CHECK(scene.meshes[2].parts[0].material == MaterialId{0});
    CHECK(scene.meshes[0].indices.size() == 3000);
    CHECK(scene.meshes[2].indices.size() == 6000);
    // 1000 triangles of a strip have 1002 vertices: none is kept that the part does not use.
    CHECK(scene.meshes[0].positions.size() == 1002);
}

TEST_CASE("The digest of a scene tells what is drawn, and nothing else") {
    const Scene scene = make_scene();
    CHECK(digest(scene) == digest(make_scene()));
    Scene renamed = scene;
    renamed.name = "another";
    renamed.meshes[0].name = "another";
    renamed.sky = glm::vec3(0.0F);
    CHECK(digest(renamed) == digest(scene));
    const std::vector<std::function<void(Scene&)>> changes = {
        [](Scene& s) { s.meshes[0].origin.y = 1.0; },
        [](Scene& s) { s.meshes[0].positions[3].z = 1e-6F; },
        [](Scene& s) {
            s.meshes[0].normals[0] = {0, 1, 0};
        },
        [](Scene& s) { s.meshes[0].colors[2].a = 254; },
        [](Scene& s) { s.meshes[0].colors.clear(); },
        [](Scene& s) { s.meshes[0].texcoords[1].x = 0.5F; },
        [](Scene& s) { std::swap(s.meshes[0].indices[1], s.meshes[0].indices[2]); },
        [](Scene& s) { s.meshes[0].parts[0].material = kNone<MaterialId>; },
        [](Scene& s) { s.meshes[0].splittable = true; },
        [](Scene& s) { s.meshes.push_back(make_strip(1, 1.0F)); },
        [](Scene& s) { s.materials[0].base_color.w = 0.5F; },
        [](Scene& s) { s.materials[0].texture = kNone<TextureId>; },
        [](Scene& s) { s.materials[0].alpha_cutoff = 0.25F; },
        [](Scene& s) { s.textures[0].pixels[0] = 0; },
        [](Scene& s) { s.instances[0].object_to_world[3].x = 1e-9; },
        [](Scene& s) { s.instances.push_back({MeshId{0}}); },
        [](Scene& s) { s.light.to_light.x = 0.0F; },
        [](Scene& s) { s.light.ambient = 0.5F; },
    };
    std::set<std::uint64_t> digests = {digest(scene)};
    for (std::size_t i = 0; i < changes.size(); ++i) {
        Scene changed = scene;
        changes[i](changed);
        INFO("change " << i);
        CHECK(digests.insert(digest(changed)).second);
    }
}
