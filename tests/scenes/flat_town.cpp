#include "scenes/flat_town.hpp"

#include "boxes.hpp"
#include "scenes/flat_town_path.hpp"
#include <farfield/eval/camera_path.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace {

using farfield::Box3d;
using farfield::Mesh;
using farfield::Scene;
using farfield::scenes::FlatTownOptions;
namespace scenes = farfield::scenes;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string message_of(const FlatTownOptions& options) {
    const auto made = scenes::make_flat_town(options);
    return made ? std::string("made") : made.error().message;
}

const Scene& canonical() {
    static const Scene scene = scenes::make_flat_town().value();
    return scene;
}

} // namespace

TEST_CASE("a flat town out of range is refused by name", "[flat_town]") {
    CHECK(message_of({.blocks = 0}) == "flat: blocks is 0, expected 1 to 128");
    CHECK(message_of({.blocks = 129}) == "flat: blocks is 129, expected 1 to 128");
    CHECK(message_of({.block_m = 0.0}).find("flat: block_m is 0.0") == 0);
    CHECK(message_of({.block_m = kNan}).find("flat: block_m is nan") == 0);
    for (const double pace : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()}) {
        const auto path = scenes::flat_town_path({}, pace);
        REQUIRE_FALSE(path);
        CHECK(path.error().message.find("flat: pace_m is ") == 0);
    }
    CHECK_FALSE(scenes::flat_town_path({.blocks = 0}));
}

TEST_CASE("a town of one block is whole", "[flat_town]") {
    const Scene town = scenes::make_flat_town({.blocks = 1}).value();
    CHECK(farfield::validate(town));
    CHECK(town.meshes[0].bounds == Box3d{{-20.0, 0.0, -20.0}, {20.0, 0.0, 20.0}});
    for (const Mesh& mesh : town.meshes) {
        CHECK(mesh.splittable);
        CHECK(mesh.bounds.lo.x >= -20.0);
        CHECK(mesh.bounds.lo.z >= -20.0);
        CHECK(mesh.bounds.hi.x <= 20.0);
        CHECK(mesh.bounds.hi.z <= 20.0);
    }
}

TEST_CASE("the town is as flat as its blocks are wide", "[flat_town]") {
    // Or a tree that halves the longest side would halve the height as well.
    const Box3d box = farfield::scene_bounds(canonical());
    CHECK(box.lo == glm::dvec3(-320.0, 0.0, -320.0));
    CHECK(box.hi.x == 320.0);
    CHECK(box.hi.z == 320.0);
    CHECK(box.hi.y > 10.0);
    CHECK(box.hi.y < scenes::flat_town_height({}));
    CHECK(scenes::flat_town_height({}) < 40.0);
    CHECK(scenes::flat_town_height({.block_m = 4.0}) == Approx(1.3));
}

TEST_CASE("every block is about as rich as every other one", "[flat_town]") {
    const std::vector<int> counts = farfield::test::triangles_by_cell(canonical(), {16, 1, 16});
    const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
    CHECK(*least > 1000);
    // Houses of three storeys have half as many windows more than those of two.
    CHECK(*most < 2 * *least);
    CHECK(farfield::primitive_count(canonical()) > 350'000);
    CHECK(farfield::primitive_count(canonical()) < 500'000);
}

TEST_CASE("a k-d tree over the town has the boxes of the paper", "[flat_town]") {
    CHECK(farfield::test::boxes_of_kdtree(canonical(), 4, 4) == 1 + 4 + 16 + 64 + 256);
}

TEST_CASE("nothing reaches over the border of its block", "[flat_town]") {
    int crossing = 0;
    farfield::test::for_each_triangle(canonical(), [&](const Mesh& /*mesh*/, const Box3d& box) {
        for (const int axis : {0, 2}) {
            // A thousandth of a millimetre: coordinates are float, of up to 320 m.
            const double slack = 1e-6 * 320.0;
            const double block = std::floor((box.lo[axis] + slack) / 40.0);
            crossing += box.hi[axis] > (block + 1.0) * 40.0 + slack ? 1 : 0;
        }
    });
    CHECK(crossing == 0);
}

TEST_CASE("walls and roofs of the town face outwards", "[flat_town]") {
    // A wall that is turned in would take its share from the volume of the houses.
    const Mesh& houses = canonical().meshes[1];
    double volume = 0.0;
    int bad = 0;
    for (std::size_t i = 0; i < houses.indices.size(); i += 3) {
        const glm::dvec3 a(houses.positions[houses.indices[i]]);
        const glm::dvec3 b(houses.positions[houses.indices[i + 1]]);
        const glm::dvec3 c(houses.positions[houses.indices[i + 2]]);
        volume += glm::dot(a, glm::cross(b, c)) / 6.0; // floors lie in y = 0 and add nothing
        const glm::dvec3 normal = glm::cross(b - a, c - a);
        const double along = glm::dot(normal, glm::dvec3(houses.normals[houses.indices[i]]));
        // None without an area, none turned away from its normal, none that faces down.
        bad += glm::length(normal) > 1e-3 && along > 0.0 && normal.y >= -1e-3 ? 0 : 1;
    }
    CHECK(bad == 0);
    // 1024 houses of 9.5 x 8.5 m, 2.4 storeys of 2.9 m and roofs of half their height; the means of
    // so many vary by less than a twentieth.
    const double expected = 1024.0 * 9.5 * 8.5 * (2.4 * 2.9 + 0.5 * 0.4 * 8.1);
    CHECK(volume == Approx(expected).epsilon(0.05));
}

TEST_CASE("the same options build the same town, another seed another one", "[flat_town]") {
    const FlatTownOptions small = {.blocks = 2};
    const Scene first = scenes::make_flat_town(small).value();
    const Scene second = scenes::make_flat_town(small).value();
    const Scene other = scenes::make_flat_town({.blocks = 2, .seed = 1}).value();
    for (std::size_t mesh = 0; mesh < 3; ++mesh) {
        CHECK(first.meshes[mesh].positions == second.meshes[mesh].positions);
        CHECK(first.meshes[mesh].colors == second.meshes[mesh].colors);
    }
    CHECK(first.meshes[1].positions != other.meshes[1].positions);
}

TEST_CASE("the walk through the town is straight, even and above its roofs", "[flat_town]") {
    const auto path = scenes::flat_town_path();
    REQUIRE(path);
    REQUIRE(farfield::eval::validate(*path));
    REQUIRE(path->frame_count == 120);
    glm::dvec3 before = farfield::eval::pose_at(*path, 0).eye;
    // From one corner to the other, not beyond.
    CHECK(glm::length(before - glm::dvec3(-320.0, before.y, -320.0)) < 10.0);
    for (int frame = 1; frame < 120; ++frame) {
        const farfield::PathPose pose = farfield::eval::pose_at(*path, frame);
        REQUIRE(pose.eye.y > scenes::flat_town_height({}));
        REQUIRE(std::abs(pose.eye.x) < 320.0);
        REQUIRE(pose.eye.x == Approx(pose.eye.z).margin(1e-9));
        REQUIRE(glm::length(pose.eye - before) == Approx(7.5).epsilon(1e-9));
        before = pose.eye;
    }
    CHECK(before.x == Approx(-farfield::eval::pose_at(*path, 0).eye.x));
}
