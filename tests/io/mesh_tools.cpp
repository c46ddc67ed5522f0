#include "support/random.hpp"
#include "support/small_scene.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/io/mesh_tools.hpp>
#include <farfield/technique/mesh_lod.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>

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

/// A closed ball around 0: 2 x (`rows` - 1) x `columns` triangles.
Mesh make_ball(float radius, std::uint32_t rows, std::uint32_t columns) {
    Mesh mesh;
    mesh.name = "ball";
    mesh.positions = {{0, radius, 0}, {0, -radius, 0}};
    for (std::uint32_t row = 1; row < rows; ++row) {
        const double polar = std::numbers::pi * row / rows;
        for (std::uint32_t column = 0; column < columns; ++column) {
            const double turn = 2.0 * std::numbers::pi * column / columns;
            mesh.positions.push_back(
                radius * glm::vec3(
                             std::sin(polar) * std::cos(turn),
                             std::cos(polar),
                             std::sin(polar) * std::sin(turn)
                         )
            );
        }
    }
    for (std::uint32_t column = 0; column < columns; ++column) {
        const std::uint32_t next = (column + 1) % columns;
        for (std::uint32_t row = 0; row + 2 < rows; ++row) {
            const std::uint32_t a = 2 + row * columns;
            const std::uint32_t b = a + columns;
            for (const std::uint32_t vertex :
                 {a + column, a + next, b + column, a + next, b + next, b + column}) {
                mesh.indices.push_back(vertex);
            }
        }
        const std::uint32_t last = 2 + (rows - 2) * columns;
        for (const std::uint32_t vertex :
             {0U, 2 + next, 2 + column, 1U, last + column, last + next}) {
            mesh.indices.push_back(vertex);
        }
    }
    mesh.parts = {{0, static_cast<std::uint32_t>(mesh.indices.size())}};
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

Mesh make_tree(std::uint32_t leaves) {
    Mesh mesh = support::tree_mesh(leaves);
    mesh.parts = {{0, static_cast<std::uint32_t>(mesh.indices.size())}};
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

/// A square of edge 1 in the plane z = `z`, `cells` x `cells` cells.
Mesh make_square(float z, std::uint32_t cells = 4) {
    Mesh mesh;
    for (std::uint32_t row = 0; row <= cells; ++row) {
        for (std::uint32_t column = 0; column <= cells; ++column) {
            const auto side = static_cast<float>(cells);
            mesh.positions.emplace_back(
                static_cast<float>(column) / side, static_cast<float>(row) / side, z
            );
        }
    }
    for (std::uint32_t row = 0; row < cells; ++row) {
        for (std::uint32_t column = 0; column < cells; ++column) {
            const std::uint32_t a = row * (cells + 1) + column;
            const std::uint32_t b = a + cells + 1;
            mesh.indices.insert(mesh.indices.end(), {a, a + 1, b, b, a + 1, b + 1});
        }
    }
    mesh.parts = {{0, static_cast<std::uint32_t>(mesh.indices.size())}};
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

/// Adds a small triangle of its own.
Mesh with_loose_triangle(Mesh mesh, const glm::vec3& at) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const glm::vec3& step :
         {glm::vec3(0.0F), glm::vec3(0.01F, 0, 0), glm::vec3(0, 0.01F, 0)}) {
        mesh.positions.push_back(at + step);
        mesh.indices.push_back(first + static_cast<std::uint32_t>(mesh.indices.size() % 3));
    }
    mesh.parts.back().index_count += 3;
    compute_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

std::vector<io::MeshLevel> levels_of(const Mesh& mesh, const io::LevelOptions& options) {
    auto levels = io::make_levels(mesh, options);
    INFO((levels ? std::string("made") : levels.error().message));
    REQUIRE(levels.has_value());
    return std::move(*levels);
}

/// What holds for every chain of levels.
void check_levels(
    const Mesh& mesh, const io::LevelOptions& options, const std::vector<io::MeshLevel>& levels
) {
    Scene scene;
    scene.materials.resize(4);
    scene.meshes.push_back(mesh);
    REQUIRE(validate(scene).has_value());
    double count = static_cast<double>(primitive_count(mesh));
    double error_m = 0.0;
    for (const io::MeshLevel& level : levels) {
        CAPTURE(level.mesh.name);
        REQUIRE(std::isfinite(level.error_m));
        REQUIRE(level.error_m >= error_m);
        error_m = level.error_m;
        // At least half of the reduction asked for.
        const auto left = static_cast<double>(primitive_count(level.mesh));
        REQUIRE(left <= (1.0 + options.ratio) / 2.0 * count);
        count = left;
        REQUIRE(level.mesh.origin == mesh.origin);
        REQUIRE_FALSE(level.mesh.splittable);
        REQUIRE(level.mesh.colors.empty() == mesh.colors.empty());
        REQUIRE(level.mesh.texcoords.empty() == mesh.texcoords.empty());
        REQUIRE(unite(level.mesh.bounds, mesh.bounds) == mesh.bounds);
        scene.meshes.push_back(level.mesh);
    }
    const auto valid = validate(scene);
    INFO((valid ? std::string("valid") : valid.error().message));
    REQUIRE(valid.has_value());
}

constexpr std::array kMethods = {io::Simplification::collapse, io::Simplification::cluster};

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

TEST_CASE("surface_distance: the same surface, otherwise divided, moved, turned inside out") {
    const Mesh square = make_square(0.0F);
    // Rounding of the foot of a perpendicular, at coordinates of 1 m.
    constexpr double kRounding = 1e-15;
    CHECK(io::surface_distance(square, square, 1000) <= kRounding);
    CHECK(io::surface_distance(square, make_square(0.0F, 1), 1000) <= kRounding);
    CHECK(io::surface_distance(square, make_square(0.25F), 1000) == Approx(0.25).epsilon(1e-15));

    Mesh moved = square;
    moved.origin = {0, 0, 3.0};
    update_bounds(moved);
    CHECK(io::surface_distance(square, moved, 100) == Approx(3.0).epsilon(1e-15));
    moved.origin = {1e9, 0, 0};
    // From the vertices at x = 0 to the edge at x = 1e9, in either direction.
    CHECK(io::surface_distance(square, moved, 100) == Approx(1e9).epsilon(1e-12));

    Mesh inside_out = square;
    for (std::size_t i = 0; i < inside_out.indices.size(); i += 3) {
        std::swap(inside_out.indices[i], inside_out.indices[i + 1]);
    }
    CHECK(io::surface_distance(square, inside_out, 1000) <= kRounding);
}

TEST_CASE("surface_distance sees what is there once only, whichever has it") {
    const Mesh square = make_square(0.0F);
    const Mesh more = with_loose_triangle(square, {0.5F, 0.5F, 2.0F});
    CHECK(io::surface_distance(square, more, 100) == Approx(2.0).epsilon(1e-7));
    CHECK(io::surface_distance(more, square, 100) == Approx(2.0).epsilon(1e-7));
}

TEST_CASE("surface_distance: one sample, degenerate and coincident triangles, sizes") {
    const float size = GENERATE(1e-30F, 1.0F, 1e30F);
    Mesh flat = make_square(0.0F, 1);
    for (glm::vec3& position : flat.positions) {
        position *= size;
    }
    Mesh line = flat; // all triangles on the edge y = 0
    for (glm::vec3& position : line.positions) {
        position.y = 0.0F;
    }
    Mesh point = flat;
    for (glm::vec3& position : point.positions) {
        position = glm::vec3(0.0F);
    }
    const double edge = double{size};
    CHECK(io::surface_distance(flat, line, 4) == Approx(edge).epsilon(1e-12));
    CHECK(io::surface_distance(flat, point, 4) == Approx(std::sqrt(2.0) * edge).epsilon(1e-12));
    CHECK(io::surface_distance(line, point, 4) == Approx(edge).epsilon(1e-12));
    CHECK(io::surface_distance(point, point, 1) == 0.0);
    // One sample and one vertex: less is found, never more.
    CHECK(io::surface_distance(flat, point, 1) <= std::sqrt(2.0) * edge);
}

TEST_CASE("surface_distance agrees with a search through all triangles") {
    // An independent way to the distance of a point and a triangle: the least over a fine grid on
    // the triangle, which is too large by less than the grid's step.
    support::Random random(5);
    for (int round = 0; round < 20; ++round) {
        Mesh soup;
        for (std::uint32_t i = 0; i < 60; ++i) {
            const glm::vec3 middle = random.vector(-1.0F, 1.0F);
            for (int k = 0; k < 3; ++k) {
                soup.indices.push_back(static_cast<std::uint32_t>(soup.positions.size()));
                soup.positions.push_back(middle + random.vector(-0.3F, 0.3F));
            }
        }
        soup.parts = {{0, 180}};
        compute_normals(soup);
        update_bounds(soup);
        // A speck that is a single point: its distance from the soup is that of the soup's nearest
        // point; what the soup is from the speck is the distance of its farthest vertex.
        const glm::vec3 at = random.vector(-4.0F, 4.0F);
        Mesh speck;
        speck.positions = {at};
        speck.indices = {0, 0, 0};
        speck.parts = {{0, 3}};
        compute_normals(speck);
        update_bounds(speck);
        double farthest = 0.0;
        for (const glm::vec3& position : soup.positions) {
            farthest = std::max(farthest, glm::distance(glm::dvec3(position), glm::dvec3(at)));
        }
        CHECK(io::surface_distance(soup, speck, 1000) == Approx(farthest).epsilon(1e-12));

        // With the speck part of a mesh that else is the soup, only its own distance is left.
        Mesh both = soup;
        both.positions.push_back(at);
        both.indices.insert(both.indices.end(), {180, 180, 180});
        both.parts.back().index_count += 3;
        compute_normals(both);
        update_bounds(both);
        constexpr int kGrid = 100;
        double nearest = std::numeric_limits<double>::infinity();
        double step = 0.0;
        for (std::size_t i = 0; i < soup.positions.size(); i += 3) {
            const glm::dvec3 a(soup.positions[i]);
            const glm::dvec3 u = glm::dvec3(soup.positions[i + 1]) - a;
            const glm::dvec3 v = glm::dvec3(soup.positions[i + 2]) - a;
            step = std::max(step, (glm::length(u) + glm::length(v)) / kGrid);
            for (int row = 0; row <= kGrid; ++row) {
                for (int column = 0; row + column <= kGrid; ++column) {
                    const glm::dvec3 point =
                        a + u * (row / double{kGrid}) + v * (column / double{kGrid});
                    nearest = std::min(nearest, glm::distance(point, glm::dvec3(at)));
                }
            }
        }
        const double found = io::surface_distance(both, soup, 1000);
        CHECK(found <= nearest + 1e-12);
        CHECK(found >= nearest - step);
    }
}

TEST_CASE("levels of detail: options out of range are refused by name") {
    const Mesh ball = make_ball(1.0F, 8, 8);
    const auto message = [&](const io::LevelOptions& options) {
        Scene scene;
        scene.meshes.push_back(ball);
        scene.instances.push_back({MeshId{0}});
        const auto table = io::add_levels_of_detail(scene, {.levels = options});
        REQUIRE_FALSE(table.has_value());
        CHECK(scene.meshes.size() == 1);
        CHECK(scene.instances.size() == 1);
        const auto levels = io::make_levels(ball, options);
        REQUIRE_FALSE(levels.has_value());
        CHECK(levels.error().code == ErrorCode::invalid_argument);
        CHECK(levels.error().message == table.error().message);
        return levels.error().message;
    };
    using Catch::Matchers::Contains;
    CHECK_THAT(message({.ratio = 0.0}), Contains("ratio is 0"));
    CHECK_THAT(message({.ratio = 0.95}), Contains("ratio is 0.95"));
    CHECK_THAT(message({.ratio = std::numeric_limits<double>::quiet_NaN()}), Contains("nan"));
    CHECK_THAT(message({.least_triangles = 0}), Contains("least_triangles is 0"));
}

TEST_CASE("levels of detail: a triangle, coincident ones, 1e-30 to 1e30 m") {
    const float size = GENERATE(0.0F, 1e-30F, 1.0F, 1e30F);
    for (const io::Simplification method : kMethods) {
        for (const std::uint32_t error_samples : {0U, 100U}) {
            const io::LevelOptions options{
                .method = method, .least_triangles = 1, .error_samples = error_samples};
            Mesh ball = make_ball(1.0F, 8, 8);
            for (glm::vec3& position : ball.positions) {
                position *= size;
            }
            update_bounds(ball);
            CAPTURE(size, static_cast<int>(method), error_samples);
            check_levels(ball, options, levels_of(ball, options));

            Mesh triangle = make_square(0.0F, 1);
            triangle.indices.resize(3);
            triangle.parts = {{0, 3}};
            for (glm::vec3& position : triangle.positions) {
                position *= size;
            }
            update_bounds(triangle);
            CHECK(levels_of(triangle, options).empty()); // half a triangle is less than one
        }
    }
}

TEST_CASE("levels of detail halve a closed surface down to the floor, with errors that rise") {
    const Mesh ball = make_ball(2.0F, 32, 64); // 3968 triangles
    for (const io::Simplification method : kMethods) {
        const double ratio = GENERATE(0.5, 0.25);
        const io::LevelOptions options{
            .method = method, .ratio = ratio, .least_triangles = 100, .error_samples = 2000};
        CAPTURE(static_cast<int>(method), ratio);
        const auto levels = levels_of(ball, options);
        check_levels(ball, options, levels);
        // 1984, 992, 496, 248, 124 triangles, or 992 and 248.
        CHECK(levels.size() == (ratio == 0.5 ? 5 : 2));
        double asked = static_cast<double>(primitive_count(ball));
        for (const io::MeshLevel& level : levels) {
            CAPTURE(level.mesh.name);
            asked *= ratio;
            // A target is met to a triangle or two that go together.
            CHECK(static_cast<double>(primitive_count(level.mesh)) <= asked + 2.0);
            // Nothing is farther from the surface than its middle is.
            CHECK(level.error_m > 0.0);
            CHECK(level.error_m < 2.0);
            // The error covers what was measured, with the same samples.
            CHECK(level.error_m >= io::surface_distance(ball, level.mesh, 2000));
        }
    }
}

TEST_CASE("levels of detail collapse a flat surface at no error") {
    const Mesh square = make_square(0.0F, 16);
    const auto levels = levels_of(square, {.least_triangles = 2, .error_samples = 1000});
    REQUIRE(levels.size() >= 5);
    for (const io::MeshLevel& level : levels) {
        // Borders stay, so does the plane. Quadrics are kept in float, of an extent of 1 m; the
        // root of their rounding is 3e-4.
        CHECK(level.error_m < 1e-3);
    }
}

TEST_CASE("levels of detail: leaves vanish at a small reported error, and are measured") {
    const Mesh tree = make_tree(2000);
    const std::uint32_t samples = 2000;
    for (const io::Simplification method : kMethods) {
        const auto believed = levels_of(tree, {.method = method});
        const auto measured = levels_of(tree, {.method = method, .error_samples = samples});
        check_levels(tree, {}, believed);
        check_levels(tree, {}, measured);
        REQUIRE(believed.size() == measured.size());
        REQUIRE(believed.size() >= 3);
        for (std::size_t i = 0; i < believed.size(); ++i) {
            CHECK(measured[i].error_m >= believed[i].error_m);
            CHECK(measured[i].error_m >= io::surface_distance(tree, measured[i].mesh, samples));
        }
    }
    // The trap that `error_samples` is there for: it must be there, or the docs are wrong.
    const auto believed = levels_of(tree, {.method = io::Simplification::collapse});
    CHECK(
        io::surface_distance(tree, believed.back().mesh, samples) > 3.0 * believed.back().error_m
    );
}

TEST_CASE("levels of detail keep materials and attributes of every part") {
    Mesh mesh = make_ball(1.0F, 16, 32);
    const auto half = static_cast<std::uint32_t>(mesh.indices.size() / 6) * 3;
    const auto all = static_cast<std::uint32_t>(mesh.indices.size());
    mesh.parts = {{0, half, MaterialId{2}}, {half, 0, MaterialId{1}}, {half, all - half}};
    for (const glm::vec3& position : mesh.positions) {
        mesh.colors.emplace_back(
            static_cast<std::uint8_t>(100.0F + 100.0F * position.y), 1, 2, 255
        );
        mesh.texcoords.emplace_back(position.x, position.z);
    }
    for (const io::Simplification method : kMethods) {
        const io::LevelOptions options{.method = method, .least_triangles = 60};
        const auto levels = levels_of(mesh, options);
        check_levels(mesh, options, levels);
        REQUIRE(levels.size() >= 3);
        for (const io::MeshLevel& level : levels) {
            // The part without triangles is gone.
            REQUIRE(level.mesh.parts.size() == 2);
            CHECK(level.mesh.parts[0].material == MaterialId{2});
            CHECK(level.mesh.parts[1].material == kNone<MaterialId>);
            for (std::size_t v = 0; v < level.mesh.positions.size(); ++v) {
                const glm::vec3& position = level.mesh.positions[v];
                REQUIRE(level.mesh.texcoords[v] == glm::vec2(position.x, position.z));
                REQUIRE(
                    level.mesh.colors[v].r ==
                    static_cast<std::uint8_t>(100.0F + 100.0F * position.y)
                );
            }
        }
    }
}

TEST_CASE("levels of detail are the same on every run") {
    const Mesh tree = make_tree(500);
    for (const io::Simplification method : kMethods) {
        const io::LevelOptions options{.method = method, .error_samples = 100};
        const auto a = levels_of(tree, options);
        const auto b = levels_of(tree, options);
        REQUIRE(a.size() == b.size());
        for (std::size_t i = 0; i < a.size(); ++i) {
            CHECK(a[i].error_m == b[i].error_m);
            CHECK(a[i].mesh.indices == b[i].mesh.indices);
            CHECK(a[i].mesh.positions == b[i].mesh.positions);
        }
    }
}

TEST_CASE("add_levels_of_detail: an empty scene, meshes that get no levels") {
    Scene scene;
    auto table = io::add_levels_of_detail(scene);
    REQUIRE(table.has_value());
    CHECK(table->items.empty());

    const auto ball = make_ball(1.0F, 16, 32); // 960 triangles
    scene.meshes = {ball, ball, ball, make_ball(1.0F, 8, 8)};
    scene.meshes[2].splittable = true;
    // Used twice, once, once but splittable, twice but small; and one that nothing uses.
    for (const std::uint32_t mesh : {0U, 0U, 1U, 2U, 3U, 3U}) {
        scene.instances.push_back({make_id<MeshId>(mesh)});
    }
    scene.meshes.push_back(ball);
    const Scene before = scene;
    table = io::add_levels_of_detail(scene, {.min_instances = 2});
    REQUIRE(table.has_value());
    REQUIRE(table->items.size() == 6);
    const std::uint32_t levels = table->items[0].level_count;
    CHECK(levels >= 4); // 480, 240, 120, 60 triangles
    CHECK(table->items[1].level_count == levels);
    for (std::size_t item = 2; item < 6; ++item) {
        CHECK(table->items[item].level_count == 0);
    }
    CHECK(scene.meshes.size() == before.meshes.size() + levels);
    CHECK(scene.instances.size() == before.instances.size() + 2 * std::size_t{levels});

    scene = before;
    table = io::add_levels_of_detail(scene, {.min_triangles = 1000});
    REQUIRE(table.has_value());
    CHECK(scene.meshes.size() == before.meshes.size());

    scene = before;
    table = io::add_levels_of_detail(scene);
    REQUIRE(table.has_value());
    CHECK(table->items[2].level_count == levels);
    CHECK(table->items[3].level_count == 0);
}

TEST_CASE("add_levels_of_detail twice: levels get no levels of their own") {
    Scene scene;
    scene.meshes = {make_ball(1.0F, 16, 32)};
    scene.instances = {{MeshId{0}}, {MeshId{0}}};
    const auto first = io::add_levels_of_detail(scene);
    REQUIRE(first.has_value());
    const std::size_t with_first = scene.instances.size();
    io::SceneLevelOptions options;
    options.levels.method = io::Simplification::cluster;
    options.items = 2;
    const auto second = io::add_levels_of_detail(scene, options);
    REQUIRE(second.has_value());
    REQUIRE(second->items.size() == 2);
    REQUIRE_FALSE(second->levels.empty());
    CHECK(index_of(second->levels[0].item) == with_first);
    CHECK(scene.instances.size() == with_first + second->levels.size());
    options.items = scene.instances.size() + 1;
    const auto refused = io::add_levels_of_detail(scene, options);
    REQUIRE_FALSE(refused.has_value());
    CHECK(refused.error().code == ErrorCode::invalid_argument);
}

TEST_CASE("add_levels_of_detail scales errors by the largest that an instance stretches") {
    support::Random random(9);
    Scene scene;
    scene.meshes = {make_ball(1.0F, 16, 32)};
    const auto plain = levels_of(scene.meshes[0], {});
    scene.instances.push_back({MeshId{0}});
    Instance squeezed{MeshId{0}};
    squeezed.object_to_world = glm::dmat4x3(
        glm::dvec3(0.0, 0.5, 0.0),
        glm::dvec3(-3.0, 0.0, 0.0),
        glm::dvec3(0.0, 0.0, -2.0),
        glm::dvec3(1e6, 2.0, 3.0)
    );
    scene.instances.push_back(squeezed);
    for (int i = 0; i < 50; ++i) {
        Instance sheared{MeshId{0}};
        for (int column = 0; column < 4; ++column) {
            sheared.object_to_world[column] = random.vector(-2.0, 2.0);
        }
        scene.instances.push_back(sheared);
    }
    const auto table = io::add_levels_of_detail(scene);
    REQUIRE(table.has_value());
    // In float, rounded up.
    constexpr double kUlp = 1.2e-7;
    for (std::size_t i = 0; i < table->items.size(); ++i) {
        const LodItem& item = table->items[i];
        REQUIRE(item.level_count == plain.size());
        const glm::dmat3 linear(
            scene.instances[i].object_to_world[0],
            scene.instances[i].object_to_world[1],
            scene.instances[i].object_to_world[2]
        );
        for (std::uint32_t k = 0; k < item.level_count; ++k) {
            const double error_m = double{table->levels[item.first_level + k].error_m};
            if (i < 2) {
                const double scale = i == 0 ? 1.0 : 3.0;
                CHECK(error_m > scale * plain[k].error_m);
                CHECK(error_m <= scale * plain[k].error_m * (1.0 + 2.0 * kUlp));
            }
            for (int sample = 0; sample < 50; ++sample) {
                const auto off = plain[k].error_m * glm::normalize(random.direction<double>());
                REQUIRE(glm::length(linear * off) <= error_m);
            }
        }
    }
}

TEST_CASE("add_levels_of_detail gives mesh lod what it draws") {
    Scene scene = support::small_scene();
    const Scene before = scene;
    support::SmallWorld world = support::make_world(scene);
    const auto table = io::add_levels_of_detail(scene, {.min_triangles = 10});
    REQUIRE(table.has_value());
    const auto valid = validate(scene);
    INFO((valid ? std::string("valid") : valid.error().message));
    REQUIRE(valid.has_value());
    REQUIRE(validate(*table).has_value());
    REQUIRE(table->items.size() == before.instances.size());
    REQUIRE(scene.instances.size() == before.instances.size() + table->levels.size());
    REQUIRE_FALSE(table->levels.empty());
    for (std::size_t i = 0; i < before.instances.size(); ++i) {
        const LodItem& item = table->items[i];
        CHECK(scene.instances[i].mesh == before.instances[i].mesh);
        CHECK(item.bounds == item_bounds(before, make_id<ItemId>(i)));
        CHECK(item.primitives == world.item_primitives[i]);
        for (std::uint32_t k = 0; k < item.level_count; ++k) {
            const ItemLevel& level = table->levels[item.first_level + k];
            const Instance& instance = scene.instances[index_of(level.item)];
            CHECK(instance.object_to_world == before.instances[i].object_to_world);
            CHECK(level.primitives == primitive_count(scene.meshes[index_of(instance.mesh)]));
        }
    }
    auto technique = MeshLod::create(world.hierarchy, *table, {.error_px = 8.0});
    REQUIRE(technique.has_value());
    const auto item_primitives = support::item_primitives_of(scene);
    NullBackend backend(item_primitives, &world.hierarchy);
    const TargetId target = backend.create_target(160, 120, 1).value();
    std::uint64_t full_triangles = 0;
    for (int frame = 0; frame < 60; ++frame) {
        const View view = support::small_walk(frame, 160, 120);
        const auto executed = backend.execute(technique->plan(view), target, {});
        INFO((executed ? std::string("executed") : executed.error().message));
        REQUIRE(executed.has_value());
        full_triangles += technique->statistics().full_triangles;
    }
    CHECK(backend.total_work().triangles < full_triangles);

    // A hierarchy over the enlarged scene would draw items and levels at once.
    const support::SmallWorld wrong = support::make_world(scene);
    CHECK_FALSE(MeshLod::create(wrong.hierarchy, *table).has_value());
}
