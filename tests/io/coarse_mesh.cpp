#include <farfield/io/coarse_mesh.hpp>
#include <farfield/io/mesh_tools.hpp>
#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

using namespace farfield;
using farfield::io::CoarseMeshOptions;

namespace {

Mesh coarse_of(const Mesh& fine, const CoarseMeshOptions& options = {}) {
    auto made = io::make_coarse_mesh(fine, options);
    INFO((made ? std::string() : made.error().message));
    REQUIRE(made.has_value());
    Scene scene;
    scene.materials.resize(4);
    scene.meshes = {*made};
    const auto valid = validate(scene);
    INFO((valid ? std::string() : valid.error().message));
    REQUIRE(valid.has_value());
    REQUIRE(made->origin == fine.origin);
    for (std::size_t i = 0; i < made->indices.size(); i += 3) {
        const auto corner = [&](std::size_t k) {
            return glm::dvec3(made->positions[made->indices[i + k]]);
        };
        const glm::dvec3 across = glm::cross(corner(1) - corner(0), corner(2) - corner(0));
        REQUIRE(glm::length(across) > 0.0);
    }
    return std::move(*made);
}

std::string refusal(const Mesh& fine, const CoarseMeshOptions& options = {}) {
    const auto made = io::make_coarse_mesh(fine, options);
    return made ? std::string("made") : made.error().message;
}

void finish(Mesh& mesh, MaterialId material = kNone<MaterialId>) {
    mesh.parts = {{0, static_cast<std::uint32_t>(mesh.indices.size()), material}};
    compute_normals(mesh);
    update_bounds(mesh);
}

/// A ball of radius 1 of `rows` bands, closed at both poles.
Mesh ball(std::uint32_t rows) {
    Mesh mesh;
    mesh.name = "ball";
    mesh.origin = {1e6, 0.0, 0.0};
    const std::uint32_t columns = 2 * rows;
    mesh.positions.emplace_back(0.0F, 1.0F, 0.0F);
    for (std::uint32_t row = 1; row < rows; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            const double down = std::numbers::pi * row / rows;
            const double around = 2.0 * std::numbers::pi * column / columns;
            mesh.positions.emplace_back(
                std::sin(down) * std::cos(around), std::cos(down), std::sin(down) * std::sin(around)
            );
        }
    }
    mesh.positions.emplace_back(0.0F, -1.0F, 0.0F);
    const auto last = static_cast<std::uint32_t>(mesh.positions.size() - 1);
    for (std::uint32_t column = 0; column < columns; ++column) {
        const std::uint32_t next = (column + 1) % columns;
        mesh.indices.insert(mesh.indices.end(), {0, 1 + next, 1 + column});
        for (std::uint32_t row = 1; row + 1 < rows; ++row) {
            const std::uint32_t here = 1 + (row - 1) * columns;
            mesh.indices.insert(
                mesh.indices.end(),
                {here + column,
                 here + next,
                 here + columns + column,
                 here + columns + column,
                 here + next,
                 here + columns + next}
            );
        }
        const std::uint32_t ring = last - columns;
        mesh.indices.insert(mesh.indices.end(), {last, ring + column, ring + next});
    }
    finish(mesh);
    return mesh;
}

/// A flat square of side 1 of `quads` a side.
Mesh sheet(std::uint32_t quads) {
    Mesh mesh;
    mesh.name = "sheet";
    for (std::uint32_t row = 0; row <= quads; ++row) {
        for (std::uint32_t column = 0; column <= quads; ++column) {
            mesh.positions.emplace_back(
                static_cast<float>(column) / static_cast<float>(quads),
                0.0F,
                static_cast<float>(row) / static_cast<float>(quads)
            );
        }
    }
    for (std::uint32_t row = 0; row < quads; ++row) {
        for (std::uint32_t column = 0; column < quads; ++column) {
            const std::uint32_t a = row * (quads + 1) + column;
            const std::uint32_t c = a + quads + 1;
            mesh.indices.insert(mesh.indices.end(), {a, c, c + 1, a, c + 1, a + 1});
        }
    }
    finish(mesh);
    return mesh;
}

double area(const Mesh& mesh) {
    double sum = 0.0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const auto corner = [&](std::size_t k) {
            return glm::dvec3(mesh.positions[mesh.indices[i + k]]);
        };
        sum += glm::length(glm::cross(corner(1) - corner(0), corner(2) - corner(0))) / 2.0;
    }
    return sum;
}

/// Edges that only one triangle has, vertices in one place being one.
std::size_t open_edges(const Mesh& mesh) {
    using Place = std::tuple<float, float, float>;
    std::map<std::pair<Place, Place>, int> edges;
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
        const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
        const auto place = [&](std::size_t k) {
            const glm::vec3& p = mesh.positions[mesh.indices[k]];
            return Place(p.x, p.y, p.z);
        };
        const std::pair<Place, Place> edge = std::minmax(place(i), place(next));
        ++edges[edge];
    }
    std::size_t open = 0;
    for (const auto& [edge, count] : edges) {
        open += count == 1 ? 1 : 0;
    }
    return open;
}

} // namespace

TEST_CASE("Coarse models name what they cannot be made of") {
    CHECK_THAT(
        refusal(sheet(2), {.triangles = 0}),
        Catch::Contains("coarse model of mesh \"sheet\": triangles is 0")
    );
    CHECK_THAT(refusal(sheet(2), {.error_m = -1.0}), Catch::Contains("error_m is -1"));
    CHECK_THAT(
        refusal(sheet(2), {.error_m = std::numeric_limits<double>::quiet_NaN()}),
        Catch::Contains("error_m is ")
    );
    CHECK_THAT(refusal(Mesh{}), Catch::Contains("no triangle has an area"));
    Mesh point = sheet(1);
    std::fill(point.positions.begin(), point.positions.end(), glm::vec3(3.0F));
    update_bounds(point);
    CHECK_THAT(refusal(point), Catch::Contains("no triangle has an area"));
    Mesh line = sheet(1);
    for (glm::vec3& position : line.positions) {
        position.x = 0.0F;
    }
    update_bounds(line);
    CHECK_THAT(refusal(line), Catch::Contains("no triangle has an area"));
}

TEST_CASE("A mesh with no more triangles than asked for stays as it is") {
    const Mesh fine = sheet(4);
    const Mesh coarse = coarse_of(fine, {.triangles = 32});
    CHECK(primitive_count(coarse) == 32);
    CHECK(area(coarse) == Approx(1.0));
    Mesh one = sheet(1);
    one.indices.resize(3);
    finish(one);
    CHECK(primitive_count(coarse_of(one, {.triangles = 1})) == 1);
}

TEST_CASE("A flat sheet keeps its rim and loses the rest") {
    const Mesh fine = sheet(32);
    const Mesh coarse = coarse_of(fine, {.triangles = 2});
    CHECK(primitive_count(coarse) <= 8);
    CHECK(area(coarse) == Approx(1.0).epsilon(1e-5));
    CHECK(coarse.bounds == fine.bounds);
}

TEST_CASE("A ball stays closed and near itself") {
    const Mesh fine = ball(48); // 9024 triangles
    CHECK(open_edges(fine) == 0);
    double last = 0.0;
    for (const std::uint32_t triangles : {2000U, 500U, 100U}) {
        const Mesh coarse = coarse_of(fine, {.triangles = triangles});
        CHECK(primitive_count(coarse) <= triangles);
        CHECK(primitive_count(coarse) >= triangles - 2);
        CHECK(open_edges(coarse) == 0);
        const double error = io::surface_distance(fine, coarse, 2000);
        // A cap over an edge of the mean length is (length / 2)^2 / 2 high; edges of a mesh of n
        // triangles on the ball are about sqrt(4 pi / n * 4 / sqrt(3)) long, and some twice that.
        const double edge = std::sqrt(4.0 * std::numbers::pi / triangles * 4.0 / std::sqrt(3.0));
        CHECK(error < edge * edge / 8.0 * 4.0);
        CHECK(error > last);
        last = error;
        for (std::size_t i = 0; i < coarse.positions.size(); ++i) {
            // Vertices are those of the original, normals too.
            CHECK(glm::length(coarse.positions[i]) == Approx(1.0F));
            CHECK(glm::dot(coarse.normals[i], coarse.positions[i]) > 0.99F);
        }
    }
}

TEST_CASE("An error ends the reduction as well") {
    const Mesh fine = ball(32);
    const Mesh near = coarse_of(fine, {.triangles = 1, .error_m = 0.02});
    const Mesh far = coarse_of(fine, {.triangles = 1, .error_m = 0.2});
    CHECK(primitive_count(near) > primitive_count(far));
    CHECK(primitive_count(near) < primitive_count(fine));
    // Vertices taken away are no farther from what took their place; between vertices a triangle
    // may be, by as much again.
    CHECK(io::surface_distance(fine, near, 2000) < 2.0 * 0.02);
    CHECK(io::surface_distance(fine, far, 2000) < 2.0 * 0.2);
}

TEST_CASE("Seams of textures, borders of colours and of materials stay") {
    // Two halves of a sheet: x below and above 1/2, each with vertices of its own along the middle.
    const auto halves = [](bool texcoords, bool colors, bool materials) {
        const Mesh whole = sheet(16);
        Mesh mesh;
        mesh.name = "halves";
        std::map<std::pair<std::uint32_t, bool>, std::uint32_t> numbers;
        std::array<std::vector<std::uint32_t>, 2> indices;
        for (std::size_t i = 0; i < whole.indices.size(); i += 3) {
            float middle = 0.0F;
            for (std::size_t k = 0; k < 3; ++k) {
                middle += whole.positions[whole.indices[i + k]].x / 3.0F;
            }
            const bool right = middle > 0.5F;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t index = whole.indices[i + k];
                const auto [found, is_new] = numbers.try_emplace(
                    {index, right}, static_cast<std::uint32_t>(mesh.positions.size())
                );
                if (is_new) {
                    const glm::vec3& p = whole.positions[index];
                    mesh.positions.push_back(p);
                    if (texcoords) {
                        mesh.texcoords.emplace_back(right ? p.x + 5.0F : p.x, p.z);
                    }
                    if (colors) {
                        mesh.colors.emplace_back(right ? 255 : 0, 0, 0, 255);
                    }
                }
                indices[right ? 1 : 0].push_back(found->second);
            }
        }
        for (const std::uint32_t half : {0U, 1U}) {
            mesh.parts.push_back(
                {static_cast<std::uint32_t>(mesh.indices.size()),
                 static_cast<std::uint32_t>(indices[half].size()),
                 materials ? make_id<MaterialId>(half) : MaterialId{0}}
            );
            mesh.indices.insert(mesh.indices.end(), indices[half].begin(), indices[half].end());
        }
        if (!materials) {
            mesh.parts = {{0, static_cast<std::uint32_t>(mesh.indices.size()), MaterialId{0}}};
        }
        compute_normals(mesh);
        update_bounds(mesh);
        return mesh;
    };
    for (int kind = 0; kind < 3; ++kind) {
        const Mesh fine = halves(kind == 0, kind == 1, kind == 2);
        const Mesh coarse = coarse_of(fine, {.triangles = 4});
        INFO("kind " << kind);
        CHECK(primitive_count(coarse) <= 24);
        CHECK(area(coarse) == Approx(1.0).epsilon(1e-5));
        double right = 0.0;
        for (std::size_t i = 0; i < coarse.indices.size(); i += 3) {
            // No triangle reaches across.
            float lo = 1.0F;
            float hi = 0.0F;
            std::set<bool> sides;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t vertex = coarse.indices[i + k];
                lo = std::min(lo, coarse.positions[vertex].x);
                hi = std::max(hi, coarse.positions[vertex].x);
                if (kind == 0) {
                    sides.insert(coarse.texcoords[vertex].x > 2.0F);
                } else if (kind == 1) {
                    sides.insert(coarse.colors[vertex].r > 0);
                } else {
                    sides.insert(i >= coarse.parts[1].first_index);
                }
            }
            REQUIRE(sides.size() == 1);
            CHECK((hi <= 0.5F || lo >= 0.5F));
            CHECK(*sides.begin() == (hi > 0.5F));
            right += *sides.begin() ? 1.0 : 0.0;
        }
        CHECK(right >= 2.0);
        CHECK(coarse.parts.size() == (kind == 2 ? 2 : 1));
    }
}

TEST_CASE("Corners of hard edges take the normal of their side") {
    // A roof of two slopes with a vertex for either slope along its ridge.
    Mesh mesh;
    mesh.name = "roof";
    constexpr std::uint32_t kSteps = 16;
    for (const float side : {-1.0F, 1.0F}) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (std::uint32_t i = 0; i <= kSteps; ++i) {
            for (const float out : {0.0F, 0.5F, 1.0F}) {
                mesh.positions.emplace_back(side * out, 1.0F - out, static_cast<float>(i) / kSteps);
                mesh.normals.push_back(glm::normalize(glm::vec3(side, 1.0F, 0.0F)));
            }
        }
        for (std::uint32_t i = 0; i < kSteps; ++i) {
            for (std::uint32_t k = 0; k < 2; ++k) {
                const std::uint32_t a = first + i * 3 + k;
                if (side > 0.0F) {
                    mesh.indices.insert(mesh.indices.end(), {a, a + 3, a + 1, a + 1, a + 3, a + 4});
                } else {
                    mesh.indices.insert(mesh.indices.end(), {a, a + 1, a + 3, a + 1, a + 4, a + 3});
                }
            }
        }
    }
    mesh.parts = {{0, static_cast<std::uint32_t>(mesh.indices.size())}};
    update_bounds(mesh);
    const Mesh coarse = coarse_of(mesh, {.triangles = 4});
    CHECK(primitive_count(coarse) < 20);
    for (std::size_t i = 0; i < coarse.indices.size(); i += 3) {
        float x = 0.0F;
        for (std::size_t k = 0; k < 3; ++k) {
            x += coarse.positions[coarse.indices[i + k]].x;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            CHECK(coarse.normals[coarse.indices[i + k]].x * x > 0.0F);
        }
    }
}

TEST_CASE("Surfaces that are none are taken apart, not refused") {
    SECTION("every triangle three times, one of them turned") {
        Mesh mesh = sheet(8);
        const std::vector<std::uint32_t> once = mesh.indices;
        mesh.indices.insert(mesh.indices.end(), once.begin(), once.end());
        mesh.indices.insert(mesh.indices.end(), once.rbegin(), once.rend());
        finish(mesh);
        CHECK(area(coarse_of(mesh, {.triangles = 10})) == Approx(1.0).epsilon(1e-5));
    }
    SECTION("three sheets that share an edge") {
        Mesh mesh;
        for (const double angle : {0.0, 2.0, 4.0}) {
            const Mesh one = sheet(8);
            const auto first = static_cast<std::uint32_t>(mesh.positions.size());
            for (const glm::vec3& p : one.positions) {
                mesh.positions.emplace_back(p.x * std::cos(angle), p.x * std::sin(angle), p.z);
            }
            for (const std::uint32_t index : one.indices) {
                mesh.indices.push_back(first + index);
            }
        }
        finish(mesh);
        const Mesh coarse = coarse_of(mesh, {.triangles = 20});
        CHECK(primitive_count(coarse) < 100);
        CHECK(area(coarse) == Approx(3.0).epsilon(0.02));
    }
    SECTION("forty triangles around an edge") {
        Mesh mesh;
        mesh.positions = {{0, 0, 0}, {0, 1, 0}};
        for (std::uint32_t i = 0; i < 40; ++i) {
            mesh.positions.emplace_back(std::cos(i * 0.15), 0.5, std::sin(i * 0.15));
            mesh.indices.insert(mesh.indices.end(), {0, 1, 2 + i});
        }
        finish(mesh);
        CHECK(primitive_count(coarse_of(mesh, {.triangles = 3})) == 40);
    }
    SECTION("triangles of no area among others") {
        Mesh mesh = sheet(6);
        mesh.indices.insert(mesh.indices.end(), {0, 1, 2, 3, 3, 4, 5, 5, 5});
        finish(mesh);
        CHECK(area(coarse_of(mesh, {.triangles = 2})) == Approx(1.0).epsilon(1e-5));
    }
    SECTION("a soup of triangles that touch nowhere") {
        Mesh mesh;
        for (std::uint32_t i = 0; i < 50; ++i) {
            const auto x = static_cast<float>(3 * i);
            mesh.positions.insert(mesh.positions.end(), {{x, 0, 0}, {x, 1, 0}, {x + 1, 0, 0}});
            mesh.indices.insert(mesh.indices.end(), {3 * i, 3 * i + 1, 3 * i + 2});
        }
        finish(mesh);
        CHECK(primitive_count(coarse_of(mesh, {.triangles = 3})) == 50);
    }
}

TEST_CASE("Size and place of a mesh make no difference") {
    const Mesh fine = ball(16);
    const std::uint64_t triangles = primitive_count(coarse_of(fine, {.triangles = 100}));
    for (const float scale : {1e-20F, 1e-3F, 1e15F}) {
        Mesh scaled = fine;
        for (glm::vec3& position : scaled.positions) {
            position *= scale;
        }
        update_bounds(scaled);
        CHECK(primitive_count(coarse_of(scaled, {.triangles = 100})) == triangles);
    }
}

TEST_CASE("The same mesh gives the same coarse model") {
    const Mesh fine = ball(24);
    const Mesh first = coarse_of(fine, {.triangles = 300});
    const Mesh second = coarse_of(fine, {.triangles = 300});
    CHECK(first.positions == second.positions);
    CHECK(first.indices == second.indices);
}
