#include "scenes/forest.hpp"

#include "boxes.hpp"
#include "scenes/forest_path.hpp"
#include <farfield/eval/camera_path.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>

namespace {

using farfield::Box3d;
using farfield::Mesh;
using farfield::Scene;
using farfield::scenes::ForestOptions;
namespace scenes = farfield::scenes;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string message_of(const ForestOptions& options) {
    const auto made = scenes::make_forest(options);
    return made ? std::string("made") : made.error().message;
}

const Scene& canonical() {
    static const Scene scene = scenes::make_forest().value();
    return scene;
}

} // namespace

TEST_CASE("a forest out of range is refused by name", "[forest]") {
    CHECK(message_of({.trees = 0}).find("forest: trees is 0.0") == 0);
    CHECK(message_of({.trees = 10'001}).find("forest: trees is 10001") == 0);
    CHECK(message_of({.tree_triangles = 199}).find("forest: tree_triangles is 199") == 0);
    CHECK(message_of({.spacing_m = 0.0}).find("forest: spacing_m is 0.0") == 0);
    CHECK(message_of({.tree_height_m = kNan}).find("forest: tree_height_m is nan") == 0);
    for (const double pace : {0.0, kNan}) {
        CHECK_FALSE(scenes::forest_sideways_path({}, pace));
        CHECK_FALSE(scenes::forest_zoom_path({}, pace));
    }
    CHECK_FALSE(scenes::forest_sideways_path({.trees = 0}));
    CHECK_FALSE(scenes::forest_zoom_path({.trees = 0}));
}

TEST_CASE("trees have exactly the triangles asked for", "[forest]") {
    for (const int triangles : {200, 201, 1050, 5001}) {
        const Scene forest = scenes::make_forest({.trees = 2, .tree_triangles = triangles}).value();
        CHECK(farfield::validate(forest));
        REQUIRE(forest.meshes.size() == 3);
        CHECK(farfield::primitive_count(forest.meshes[0]) == 1800);
        for (const std::size_t tree : {1U, 2U}) {
            CHECK(
                farfield::primitive_count(forest.meshes[tree]) ==
                static_cast<std::uint64_t>(triangles)
            );
        }
    }
}

TEST_CASE("the canonical forest is the scene it has to be", "[forest]") {
    const Scene& forest = canonical();
    REQUIRE(farfield::validate(forest));
    REQUIRE(forest.instances.size() == 101);
    CHECK(farfield::primitive_count(forest) == 105'000 + 1800);
    std::set<double> heights;
    for (std::size_t tree = 1; tree <= 100; ++tree) {
        const Mesh& mesh = forest.meshes[tree];
        CHECK(mesh.splittable);
        // 10 m, a tenth more or less; the topmost spray is up to 0.6 m off the crown.
        CHECK(mesh.bounds.hi.y > 8.0);
        CHECK(mesh.bounds.hi.y < 11.7);
        CHECK(mesh.bounds.lo.y >= 0.0);
        heights.insert(mesh.bounds.hi.y);
    }
    CHECK(heights.size() == 100); // no two are alike
    CHECK(forest.meshes[0].splittable);
    CHECK(forest.meshes[0].bounds == Box3d{{-30.0, 0.0, -30.0}, {30.0, 0.0, 30.0}});
}

TEST_CASE("the crowns close over the whole forest", "[forest]") {
    // 512 leaves of a tree that halves the longest side nine times: 16 along the ground, 2 upwards.
    // All of them, and so all 585 boxes of three levels of eight, have something in them.
    const std::vector<int> counts = farfield::test::triangles_by_cell(canonical(), {16, 2, 16});
    CHECK(counts.size() == 512);
    CHECK(*std::min_element(counts.begin(), counts.end()) >= 1);
    CHECK(farfield::test::boxes_of_kdtree(canonical(), 8, 3) == 1 + 8 + 64 + 512);
}

TEST_CASE("trees stand apart, and each where its neighbours leave it room", "[forest]") {
    std::vector<glm::dvec3> feet;
    for (std::size_t tree = 1; tree <= 100; ++tree) {
        const Mesh& mesh = canonical().meshes[tree];
        glm::dvec3 foot(0.0);
        int count = 0;
        for (const glm::vec3& point : mesh.positions) {
            if (point.y < 0.01F) {
                foot += glm::dvec3(point);
                ++count;
            }
        }
        REQUIRE(count > 0);
        feet.push_back(foot / static_cast<double>(count));
    }
    double nearest = 1e300;
    for (std::size_t i = 0; i < feet.size(); ++i) {
        for (std::size_t j = i + 1; j < feet.size(); ++j) {
            nearest = std::min(nearest, glm::distance(feet[i], feet[j]));
        }
    }
    CHECK(nearest >= 0.6 * 6.0); // both moved by a fifth of the spacing
    CHECK(nearest < 0.8 * 6.0);  // not on a lattice
}

TEST_CASE("the same options grow the same forest, another seed another one", "[forest]") {
    const ForestOptions small = {.trees = 3, .tree_triangles = 300};
    const Scene first = scenes::make_forest(small).value();
    const Scene second = scenes::make_forest(small).value();
    ForestOptions options = small;
    options.seed = 1;
    const Scene other = scenes::make_forest(options).value();
    for (std::size_t mesh = 0; mesh < first.meshes.size(); ++mesh) {
        CHECK(first.meshes[mesh].positions == second.meshes[mesh].positions);
        CHECK(first.meshes[mesh].colors == second.meshes[mesh].colors);
    }
    CHECK(first.meshes[1].positions != other.meshes[1].positions);
}

TEST_CASE("the way along the forest stays in front of it", "[forest]") {
    const auto path = scenes::forest_sideways_path();
    REQUIRE(path);
    REQUIRE(farfield::eval::validate(*path));
    REQUIRE(path->frame_count == 100);
    const Box3d box = farfield::scene_bounds(canonical());
    for (int frame = 0; frame < 100; ++frame) {
        const farfield::PathPose pose = farfield::eval::pose_at(*path, frame);
        REQUIRE(pose.eye.z > box.hi.z + 5.0);
        REQUIRE(pose.eye.x == Approx(0.6 * (frame - 49.5)).margin(1e-9));
        REQUIRE(pose.target.x == Approx(pose.eye.x).margin(1e-9));
        REQUIRE(pose.target.z < pose.eye.z);
    }
}

TEST_CASE("the way into the forest begins at its corner and ends at its middle", "[forest]") {
    const auto path = scenes::forest_zoom_path();
    REQUIRE(path);
    REQUIRE(farfield::eval::validate(*path));
    REQUIRE(path->frame_count == 100);
    const glm::dvec3 begin = farfield::eval::pose_at(*path, 0).eye;
    const glm::dvec3 end = farfield::eval::pose_at(*path, 99).eye;
    CHECK(std::abs(begin.x + 30.0) < 1.0);
    CHECK(begin.x == Approx(begin.z));
    CHECK(std::hypot(end.x, end.z) < 1e-9);
    for (int frame = 1; frame < 100; ++frame) {
        const farfield::PathPose pose = farfield::eval::pose_at(*path, frame);
        const glm::dvec3 before = farfield::eval::pose_at(*path, frame - 1).eye;
        REQUIRE(pose.eye.y > farfield::scene_bounds(canonical()).hi.y);
        REQUIRE(glm::distance(pose.eye, before) == Approx(0.42).epsilon(1e-9));
        // Straight ahead, whatever is below.
        const glm::dvec3 look = pose.target - pose.eye;
        REQUIRE(look.x == Approx(look.z));
        REQUIRE(look.x > 0.0);
    }
}
