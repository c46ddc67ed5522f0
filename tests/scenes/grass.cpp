#include "scenes/grass.hpp"

#include "scenes/grass_path.hpp"
#include "scenes/quarter_turn.hpp"
#include <farfield/eval/camera_path.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace {

using farfield::Mesh;
using farfield::Scene;
using farfield::scenes::GrassOptions;
using glm::dvec3;
namespace scenes = farfield::scenes;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string message_of(const GrassOptions& options) {
    const auto made = scenes::make_grass(options);
    return made ? std::string("made") : made.error().message;
}

/// [m^2] Shown to a viewer who looks along z, over all triangles.
double area_along_z(const Mesh& mesh) {
    double area = 0.0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const dvec3 a(mesh.positions[mesh.indices[i]]);
        const dvec3 b(mesh.positions[mesh.indices[i + 1]]);
        const dvec3 c(mesh.positions[mesh.indices[i + 2]]);
        area += 0.5 * std::abs(glm::cross(b - a, c - a).z);
    }
    return area;
}

} // namespace

TEST_CASE("grass out of range is refused by name", "[grass]") {
    for (const int triangles : {-1250, 0, 1, 1249, 1251, 400'001, 2'000'000'500}) {
        CHECK(
            message_of({.triangles = triangles}) ==
            "grass: triangles is " + std::to_string(triangles) +
                ", expected a multiple of 1250, 1250 to 2000000000"
        );
    }
    CHECK(message_of({.field_m = 0.0}).find("grass: field_m is 0.0") == 0);
    CHECK(message_of({.field_m = kNan}).find("grass: field_m is nan") == 0);
    CHECK_FALSE(scenes::grass_flight({.triangles = 1}));
    CHECK_FALSE(scenes::grass_dolly({.triangles = 1}, 2.0));
    for (const double distance : {-1.0, 0.5, 1000.5, kNan}) {
        const auto path = scenes::grass_dolly({}, distance);
        REQUIRE_FALSE(path);
        CHECK(path.error().message.find("grass: distance is ") == 0);
    }
}

TEST_CASE("the canonical field is the scene it has to be", "[grass]") {
    const Scene scene = scenes::make_grass().value();
    REQUIRE(farfield::validate(scene));
    REQUIRE(scene.instances.size() == 626);
    CHECK(farfield::primitive_count(scene) == 400'000 + 3200);
    CHECK(farfield::primitive_count(scene.meshes[0]) == 640);
    CHECK_FALSE(scene.meshes[0].splittable);
    CHECK(scene.meshes[1].splittable);
    CHECK(scene.meshes[1].bounds == farfield::Box3d{{-50.0, 0.0, -50.0}, {50.0, 0.0, 50.0}});
    CHECK(scene.meshes[0].bounds.lo.y == 0.0);
    CHECK(scene.meshes[0].bounds.hi.y > 0.65);
    CHECK(scene.meshes[0].bounds.hi.y <= 0.70F);
    std::array<int, 4> turns{};
    for (std::size_t i = 0; i < 625; ++i) {
        const glm::dmat4x3& matrix = scene.instances[i].object_to_world;
        // Patch beside patch, 4 m each; -50 + 2 + 4 i is exact.
        CHECK(matrix[3].x == -48.0 + 4.0 * static_cast<double>(i % 25));
        const std::size_t row = i / 25;
        CHECK(matrix[3].z == -48.0 + 4.0 * static_cast<double>(row));
        std::size_t turn = 0;
        while (turn < 4 && matrix != scenes::quarter_turned(turn, 1.0, matrix[3])) {
            ++turn;
        }
        REQUIRE(turn < 4); // entries are exactly 0, 1 and -1
        ++turns[turn];
    }
    // Of 625, 156 each with a standard deviation of 10.8; four of them.
    for (const int count : turns) {
        CHECK(std::abs(count - 156) < 44);
    }
}

TEST_CASE("without soil only blades are left, and they are the same", "[grass]") {
    const Scene with = scenes::make_grass().value();
    const Scene without = scenes::make_grass({.ground = false}).value();
    REQUIRE(farfield::validate(without));
    CHECK(without.meshes.size() == 1);
    CHECK(farfield::primitive_count(without) == 400'000);
    CHECK(without.meshes[0].positions == with.meshes[0].positions);
}

TEST_CASE("more blades are narrower and cover as much", "[grass]") {
    const Mesh few = scenes::make_grass({.triangles = 200'000}).value().meshes[0];
    const Mesh many = scenes::make_grass({.triangles = 1'600'000}).value().meshes[0];
    CHECK(farfield::primitive_count(few) == 320);
    CHECK(farfield::primitive_count(many) == 2560);
    // Sums of 160 random areas vary by about their spread, 0.7, over sqrt(160) = 6 %; three of
    // them.
    CHECK(area_along_z(few) == Approx(area_along_z(many)).epsilon(0.17));
    for (const Mesh* mesh : {&few, &many}) {
        for (std::size_t i = 0; i < mesh->normals.size(); ++i) {
            REQUIRE(glm::length(mesh->normals[i]) == Approx(1.0F).epsilon(1e-6));
        }
    }
}

TEST_CASE("the same options sow the same field, another seed another one", "[grass]") {
    const GrassOptions small = {.triangles = 1250};
    const Scene first = scenes::make_grass(small).value();
    const Scene second = scenes::make_grass(small).value();
    const Scene other = scenes::make_grass({.triangles = 1250, .seed = 1}).value();
    CHECK(first.meshes[0].positions == second.meshes[0].positions);
    CHECK(first.meshes[1].colors == second.meshes[1].colors);
    CHECK(first.meshes[0].positions != other.meshes[0].positions);
    bool same = true;
    for (std::size_t i = 0; i < first.instances.size(); ++i) {
        same = same && first.instances[i].object_to_world == second.instances[i].object_to_world;
    }
    CHECK(same);
}

TEST_CASE("the flight stays low over the field and looks 10 degrees down", "[grass]") {
    const auto path = scenes::grass_flight();
    REQUIRE(path);
    REQUIRE(farfield::eval::validate(*path));
    REQUIRE(path->frame_count == 120);
    for (int frame = 0; frame < 120; ++frame) {
        const farfield::PathPose pose = farfield::eval::pose_at(*path, frame);
        REQUIRE(pose.eye.y == Approx(1.7).epsilon(1e-12));
        REQUIRE(pose.eye.z == Approx(45.0 - 50.0 * frame / 119.0).margin(1e-9));
        const dvec3 look = glm::normalize(pose.target - pose.eye);
        REQUIRE(std::asin(-look.y) == Approx(10.0 * std::numbers::pi / 180.0).epsilon(1e-9));
        REQUIRE(look.z < 0.0);
    }
}

TEST_CASE("the field is left from 1 radius to as many as asked for", "[grass]") {
    const auto path = scenes::grass_dolly({}, 30.0);
    REQUIRE(path);
    const double radius = 100.0 / std::sqrt(2.0);
    const dvec3 begin = farfield::eval::pose_at(*path, 0).eye;
    const dvec3 end = farfield::eval::pose_at(*path, path->frame_count - 1).eye;
    CHECK(glm::length(begin) == Approx(radius).epsilon(1e-12));
    CHECK(glm::length(end) == Approx(30.0 * radius).epsilon(1e-12));
    CHECK(begin.y == Approx(radius * std::sin(10.0 * std::numbers::pi / 180.0)).epsilon(1e-12));
}
