#include "scenes/solids.hpp"

#include "scenes/pipe_network.hpp"
#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cmath>
#include <numbers>

namespace {

using farfield::Mesh;
using farfield::scenes::Solids;
using glm::dvec2;
using glm::dvec3;

constexpr double kPi = std::numbers::pi;
const dvec3 kColor(100.0, 120.0, 140.0);

/// [m^3] Enclosed, positive where triangles are anticlockwise as seen from outside.
double volume_of(const Mesh& mesh) {
    double volume = 0.0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const dvec3 a(mesh.positions[mesh.indices[i]]);
        const dvec3 b(mesh.positions[mesh.indices[i + 1]]);
        const dvec3 c(mesh.positions[mesh.indices[i + 2]]);
        volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    }
    return volume;
}

/// Triangles without an area or turned away from one of their normals, and normals that are not
/// unit.
int bad_triangles(const Mesh& mesh) {
    int bad = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const dvec3 a(mesh.positions[mesh.indices[i]]);
        const dvec3 b(mesh.positions[mesh.indices[i + 1]]);
        const dvec3 c(mesh.positions[mesh.indices[i + 2]]);
        const dvec3 normal = glm::cross(b - a, c - a);
        bool good = glm::length(normal) > 1e-9;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const dvec3 stored(mesh.normals[mesh.indices[i + corner]]);
            good = good && std::abs(glm::length(stored) - 1.0) < 1e-5;
            good = good && glm::dot(stored, normal) > 0.0;
        }
        bad += good ? 0 : 1;
    }
    return bad;
}

/// Area of a regular polygon over that of its circle of radius 1.
double polygon_area(int sides) {
    return sides / 2.0 * std::sin(2.0 * kPi / sides);
}

} // namespace

TEST_CASE("boxes and bars enclose what they should", "[solids]") {
    Solids solids;
    SECTION("a box, in one piece and in many") {
        solids.add_box({1.0, 2.0, 3.0}, {2.0, 4.0, 6.0}, kColor);
        CHECK(solids.count() == 12);
        solids.add_box({1.0, 2.0, 3.0}, {2.0, 4.0, 6.0}, kColor, 1.0);
        CHECK(solids.count() == 12 + 2 * 2 * (1 * 2 + 2 * 3 + 3 * 1));
        const Mesh mesh = solids.finish("boxes", true);
        CHECK(volume_of(mesh) == Approx(2.0 * 6.0));
        CHECK(bad_triangles(mesh) == 0);
        CHECK(mesh.bounds == farfield::Box3d{{1.0, 2.0, 3.0}, {2.0, 4.0, 6.0}});
        CHECK(mesh.splittable);
        CHECK(solids.count() == 0);
    }
    SECTION("bars and girders, level, standing, slanted and upside down") {
        for (const dvec3& to :
             {dvec3(3.0, 0.0, 0.0),
              dvec3(0.0, 3.0, 0.0),
              dvec3(0.0, -3.0, 0.0),
              dvec3(2.0, 1.0, 2.0)}) {
            solids.add_bar({0.0, 0.0, 0.0}, to, 0.2, 0.5, kColor);
            Mesh bar = solids.finish("bar", false);
            CHECK(volume_of(bar) == Approx(3.0 * 0.2 * 0.5));
            CHECK(bad_triangles(bar) == 0);
            solids.add_girder({0.0, 0.0, 0.0}, to, 0.2, 0.4, kColor, 1.0);
            bar = solids.finish("girder", false);
            // Two flanges and the web between them, of 0.09 x 0.2 m.
            const double section = 0.018 * (0.2 + 0.2 + 0.4 - 2.0 * 0.018);
            CHECK(volume_of(bar) == Approx(3.0 * section).epsilon(1e-4));
            CHECK(bad_triangles(bar) == 0);
        }
    }
}

TEST_CASE("what is turned on a lathe is closed and faces outwards", "[solids]") {
    Solids solids;
    constexpr std::array<dvec2, 5> kTank = {
        {{0.0, 0.0}, {2.0, 0.0}, {2.0, 3.0}, {1.0, 3.5}, {0.0, 3.6}}};
    // A cylinder, a frustum and a cone.
    const double expected = 4.0 * 3.0 + 0.5 / 3.0 * (4.0 + 2.0 + 1.0) + 0.1 / 3.0;
    for (const dvec3& axis : {dvec3(0.0, 1.0, 0.0), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 0.0, -1.0)}) {
        solids.add_lathe({5.0, 6.0, 7.0}, axis, kTank, 24, kColor);
        CHECK(solids.count() == 24 * (1 + 2 + 2 + 1));
        const Mesh mesh = solids.finish("tank", false);
        CHECK(volume_of(mesh) == Approx(expected * polygon_area(24)).epsilon(1e-5));
        CHECK(bad_triangles(mesh) == 0);
        solids.add_cylinder({1.0, 2.0, 3.0}, axis, 0.5, 2.0, 12, kColor);
        CHECK(solids.count() == 2 * 12 + 2 * 10);
        const Mesh cylinder = solids.finish("cylinder", false);
        CHECK(volume_of(cylinder) == Approx(0.5 * polygon_area(12)).epsilon(1e-5));
        CHECK(bad_triangles(cylinder) == 0);
    }
}

TEST_CASE("tubes go around corners", "[solids]") {
    Solids solids;
    constexpr std::array<dvec3, 5> kPoints = {
        {{0.0, 0.0, 0.0}, {4.0, 0.0, 0.0}, {6.0, 0.0, 0.0}, {6.0, 5.0, 0.0}, {6.0, 5.0, -4.0}}};
    solids.add_tube(
        kPoints,
        {.radius = 0.25, .bend = 1.0, .sides = 16, .arc_segments = 32, .longest = 1.0},
        kColor
    );
    const Mesh mesh = solids.finish("tube", false);
    CHECK(bad_triangles(mesh) == 0);
    // Pappus: the section times the way of its middle. A point that the line goes straight
    // through changes nothing. An arc of 32 chords is shorter by a 20000th.
    const double way = 15.0 - 2.0 * (2.0 - kPi / 2.0);
    CHECK(volume_of(mesh) == Approx(0.0625 * polygon_area(16) * way).epsilon(1e-3));
    CHECK(mesh.bounds.hi.x == Approx(6.25));
    CHECK(mesh.bounds.lo.z == Approx(-4.0));
    solids.add_ring({0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, 2.0, 0.5, 64, 16, kColor);
    const Mesh ring = solids.finish("ring", false);
    CHECK(bad_triangles(ring) == 0);
    CHECK(
        volume_of(ring) ==
        Approx(0.25 * polygon_area(16) * 2.0 * polygon_area(64) * 2.0).epsilon(1e-2)
    );
}

TEST_CASE("a tube of sides that 4 divides is the same after a quarter turn", "[solids]") {
    Solids solids;
    constexpr std::array<dvec3, 2> kPoints = {{{0.0, 0.0, -0.75}, {0.0, 0.0, 0.75}}};
    solids.add_tube(kPoints, {.radius = 0.3, .sides = 20, .capped = false}, kColor);
    const Mesh mesh = solids.finish("tube", false);
    for (std::size_t i = 0; i < 20; ++i) {
        const glm::vec3& here = mesh.positions[i];
        const glm::vec3& turned = mesh.positions[(i + 5) % 20];
        CHECK(std::abs(here.x) == std::abs(turned.y));
        CHECK(std::abs(here.y) == std::abs(turned.x));
    }
}

TEST_CASE("flanges stay within the reach of pipes", "[solids]") {
    for (const auto& service : farfield::scenes::pipe_services()) {
        CHECK(service.sides % 4 == 0);
        Solids solids;
        farfield::scenes::add_flanges(
            solids, dvec3(0.0), {0.0, 0.0, 1.0}, service.radius, service.sides, service.color
        );
        const Mesh mesh = solids.finish("flanges", false);
        CHECK(bad_triangles(mesh) == 0);
        CHECK(mesh.bounds.hi.x <= farfield::scenes::kPipeReach);
        CHECK(mesh.bounds.hi.y <= farfield::scenes::kPipeReach);
    }
}
