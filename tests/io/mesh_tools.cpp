#include <farfield/io/mesh_tools.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <set>
#include <tuple>

using namespace farfield;

namespace {

using Corner = std::tuple<float, float, float, float, float, int>;
using Triangle = std::array<Corner, 3>;

/// Triangles of one part as their corners' attributes, turned so that the smallest comes first,
/// which keeps the orientation.
std::multiset<Triangle> triangles(const Mesh& mesh, const MeshPart& part) {
    std::multiset<Triangle> all;
    for (std::size_t i = part.first_index; i < part.first_index + part.index_count; i += 3) {
        Triangle triangle;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t v = mesh.indices[i + k];
            const glm::vec3& p = mesh.positions[v];
            const glm::vec2& t = mesh.texcoords[v];
            triangle[k] = {p.x, p.y, p.z, t.x, t.y, mesh.colors[v].r};
        }
        std::rotate(
            triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end()
        );
        all.insert(triangle);
    }
    return all;
}

/// A grid whose triangles have corners of their own, in an order that is bad for any cache, in two
/// parts, with one vertex that nothing uses.
Mesh make_soup(std::uint32_t side) {
    Mesh mesh;
    const std::uint32_t squares = side * side;
    for (std::uint32_t i = 0; i < squares; ++i) {
        const std::uint32_t square = i * 7919U % squares; // 7919 is prime, so every square once
        const auto x = static_cast<float>(square % side);
        const std::uint32_t row = square / side;
        const auto y = static_cast<float>(row);
        for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}) {
            mesh.indices.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
            mesh.positions.emplace_back(x + static_cast<float>(dx), y + static_cast<float>(dy), 0);
            mesh.texcoords.emplace_back(0.5F, 0.25F);
            mesh.colors.emplace_back(y < 3 ? 10 : 20, 0, 0, 255);
        }
    }
    mesh.positions.emplace_back(1000, 0, 0);
    mesh.texcoords.emplace_back(0);
    mesh.colors.emplace_back(0);
    mesh.parts = {{0, 3 * squares, MaterialId{1}}, {3 * squares, 0}, {3 * squares, 3 * squares}};
    mesh.splittable = false;
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

/// Vertices that a first-in first-out cache of 16 would have to transform, per triangle.
double cache_misses(const Mesh& mesh) {
    std::vector<std::uint32_t> cache;
    std::size_t misses = 0;
    for (const std::uint32_t index : mesh.indices) {
        if (std::find(cache.begin(), cache.end(), index) == cache.end()) {
            ++misses;
            cache.insert(cache.begin(), index);
            cache.resize(std::min<std::size_t>(cache.size(), 16));
        }
    }
    return 3.0 * static_cast<double>(misses) / static_cast<double>(mesh.indices.size());
}

} // namespace

TEST_CASE("optimize_for_drawing keeps triangles and parts and drops needless vertices") {
    Mesh mesh = make_soup(20);
    const Mesh before = mesh;
    io::optimize_for_drawing(mesh);
    REQUIRE(mesh.parts.size() == 3);
    for (std::size_t p = 0; p < 3; ++p) {
        CHECK(mesh.parts[p].first_index == before.parts[p].first_index);
        CHECK(mesh.parts[p].index_count == before.parts[p].index_count);
        CHECK(mesh.parts[p].material == before.parts[p].material);
        CHECK(triangles(mesh, mesh.parts[p]) == triangles(before, before.parts[p]));
    }
    // 21 x 21 grid points; those between rows of two colours are there twice.
    CHECK(mesh.positions.size() == 21 * 21 + 21);
    CHECK(mesh.bounds.hi.x == 20.0); // the unused vertex no longer counts
    Scene scene;
    scene.materials.resize(2);
    scene.meshes.push_back(mesh);
    CHECK(validate(scene).has_value());
}

TEST_CASE("optimize_for_drawing makes the vertex cache work") {
    Mesh mesh = make_soup(40);
    CHECK(cache_misses(mesh) == 3.0); // no corner is shared
    io::optimize_for_drawing(mesh);
    // 0.5 is the bound for an endless cache on a grid, 0.5 + 1/16 a good strip order for this one;
    // 1.0 leaves room for the clusters that the overdraw order may cut.
    CHECK(cache_misses(mesh) < 1.0);
}

TEST_CASE("optimize_for_drawing: a splittable mesh, one triangle, coincident ones, 1e30 m") {
    const float size = GENERATE(0.0F, 1e-30F, 1.0F, 1e30F);
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {0, 0, 0}};
    mesh.indices = {0, 1, 2, 3, 1, 2};
    mesh.parts = {{0, 6}};
    mesh.splittable = true;
    compute_normals(mesh);
    update_bounds(mesh);
    const Box3d bounds = mesh.bounds;
    io::optimize_for_drawing(mesh);
    CHECK(mesh.indices.size() == 6);
    CHECK(mesh.splittable);
    CHECK(mesh.bounds == bounds);
    Scene scene;
    scene.meshes.push_back(mesh);
    CHECK(validate(scene).has_value());
}
