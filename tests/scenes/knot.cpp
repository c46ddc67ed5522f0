#include "scenes/knot.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace {

using farfield::Mesh;
using farfield::Scene;
using farfield::scenes::KnotOptions;
using glm::dvec3;
namespace scenes = farfield::scenes;

std::string message_of(const KnotOptions& options) {
    const auto made = scenes::make_knot(options);
    return made ? std::string("made") : made.error().message;
}

} // namespace

TEST_CASE("knots out of range are refused by name", "[knot]") {
    CHECK(message_of({.along = 23}) == "knot: along is 23, expected 24 to 10000");
    CHECK(message_of({.along = 10'001}) == "knot: along is 10001, expected 24 to 10000");
    CHECK(message_of({.around = 2}) == "knot: around is 2, expected 3 to 2000");
    CHECK(message_of({.around = 2001}) == "knot: around is 2001, expected 3 to 2000");
    CHECK(message_of({.along = 24, .around = 3}) == "made");
}

TEST_CASE("a knot is one closed surface that faces outwards", "[knot]") {
    const Scene scene = scenes::make_knot().value();
    REQUIRE(farfield::validate(scene));
    CHECK(farfield::primitive_count(scene) == 100'000);
    const Mesh& mesh = scene.meshes[0];
    CHECK(mesh.splittable);
    CHECK(mesh.positions.size() == 50'000); // no seam
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    double volume = 0.0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const dvec3 a(mesh.positions[mesh.indices[i]]);
        const dvec3 b(mesh.positions[mesh.indices[i + 1]]);
        const dvec3 c(mesh.positions[mesh.indices[i + 2]]);
        volume += glm::dot(a, glm::cross(b, c)) / 6.0;
        // Corners are turned by 3.6 degrees around the tube and less along it.
        REQUIRE(
            glm::dot(
                glm::normalize(glm::cross(b - a, c - a)), dvec3(mesh.normals[mesh.indices[i]])
            ) > 0.99
        );
        for (std::size_t k = 0; k < 3; ++k) {
            edges.emplace(mesh.indices[i + k], mesh.indices[i + (k + 1) % 3]);
        }
    }
    REQUIRE(edges.size() == 300'000); // each once in one direction
    for (const auto& [from, to] : edges) {
        REQUIRE(edges.count({to, from}) == 1);
    }
    // By Pappus, the section of radius 0.62 times the length of the curve, which is 32 and some.
    CHECK(volume > 30.0 * 0.62 * 0.62 * 3.14);
    CHECK(volume < 36.0 * 0.62 * 0.62 * 3.14);
}

TEST_CASE("a knot is light towards its viewer and dark away from it", "[knot]") {
    const Scene scene = scenes::make_knot().value();
    const Mesh& mesh = scene.meshes[0];
    std::map<int, int> reds;
    for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
        const float facing = mesh.normals[i].x + mesh.normals[i].z;
        const int red = mesh.colors[i].r;
        ++reds[red];
        // Normals are rounded to floats after the tone was chosen.
        if (std::abs(facing) > 1e-6F) {
            REQUIRE((red > 128) == (facing > 0.0F));
        }
    }
    REQUIRE(reds.size() == 2);
    CHECK(std::abs(reds.begin()->second - 25'000) < 1000); // a closed tube is both in halves
}
