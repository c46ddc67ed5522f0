#include "scenes/pipes.hpp"

#include "boxes.hpp"
#include "scenes/pipe_network.hpp"
#include "scenes/pipes_path.hpp"
#include "walks.hpp"
#include <farfield/eval/camera_path.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace {

using farfield::Mesh;
using farfield::Scene;
using farfield::scenes::kPipeSpacing;
using farfield::scenes::PipesOptions;
using glm::dvec3;
namespace scenes = farfield::scenes;

std::string message_of(const PipesOptions& options) {
    const auto made = scenes::make_pipes(options);
    return made ? std::string("made") : made.error().message;
}

const Scene& canonical() {
    static const Scene scene = scenes::make_pipes().value();
    return scene;
}

const Mesh& mesh_of(const Scene& scene, const farfield::Instance& instance) {
    return scene.meshes[index_of(instance.mesh)];
}

} // namespace

TEST_CASE("pipes out of range are refused by name", "[pipes]") {
    for (const int triangles : {-1, 0, 19'999, 50'000'001}) {
        CHECK(
            message_of({.triangles = triangles}) ==
            "pipes: triangles is " + std::to_string(triangles) + ", expected 20000 to 50000000"
        );
        CHECK_FALSE(scenes::pipes_path({.triangles = triangles}));
    }
}

TEST_CASE("there are as many triangles of pipes as asked for", "[pipes]") {
    for (const int triangles : {20'000, 100'000, 1'000'000}) {
        const Scene scene = scenes::make_pipes({.triangles = triangles}).value();
        REQUIRE(farfield::validate(scene));
        const auto count = static_cast<double>(farfield::primitive_count(scene));
        INFO(triangles << " asked for, " << count << " made");
        CHECK(count >= triangles);
        // The last pipe ends with one piece more than it may have, a valve and a lid at most.
        CHECK(count <= triangles + 3000);
    }
}

TEST_CASE("pieces of pipes are small, whole items and surfaces may be cut", "[pipes]") {
    const Scene& scene = canonical();
    REQUIRE(scene.meshes.size() == 2 + 54);
    CHECK(scene.meshes[0].splittable);
    CHECK(scene.meshes[1].splittable);
    for (std::size_t mesh = 2; mesh < scene.meshes.size(); ++mesh) {
        CHECK_FALSE(scene.meshes[mesh].splittable);
        CHECK(farfield::primitive_count(scene.meshes[mesh]) <= 3000);
        // In the cell of its node, so that a partition finds them apart; a float at 0.75.
        const farfield::Box3d& box = scene.meshes[mesh].bounds;
        for (int axis = 0; axis < 3; ++axis) {
            CHECK(box.lo[axis] >= -kPipeSpacing / 2.0 - 1e-6);
            CHECK(box.hi[axis] <= kPipeSpacing / 2.0 + 1e-6);
        }
    }
}

TEST_CASE("no two pipes share a node, and pieces of a pipe meet", "[pipes]") {
    const Scene& scene = canonical();
    const int nodes = scenes::pipes_nodes({});
    std::map<std::tuple<int, int, int>, std::string> names;
    std::size_t pieces = 0;
    std::set<std::string> kinds;
    for (std::size_t i = 2; i < scene.instances.size(); ++i) {
        const std::string& name = mesh_of(scene, scene.instances[i]).name;
        kinds.insert(name);
        if (name == "lid of a pipe") {
            continue; // on a piece of its own node
        }
        const dvec3 at = scene.instances[i].object_to_world[3] / kPipeSpacing;
        const auto node = [&](double value, double shift) {
            const double whole = value + shift - 0.5;
            CHECK(whole == std::round(whole)); // multiples of 0.75: exact
            return static_cast<int>(whole);
        };
        const std::tuple<int, int, int> key = {
            node(at.x, nodes / 2.0), node(at.y, 0.0), node(at.z, nodes / 2.0)};
        ++pieces;
        names.emplace(key, name);
    }
    CHECK(names.size() == pieces);
    CHECK(kinds.size() == 6);
    // Two fifths were asked for; the mean piece may differ by a fifth, and nodes are even.
    const double filled = static_cast<double>(pieces) / (6.0 * nodes * nodes);
    CHECK(filled > 0.3);
    CHECK(filled < 0.5);
}

TEST_CASE("pipes fill their space evenly", "[pipes]") {
    // 4 x 4 blocks from the floor to the top: none is empty and none holds a crowd. Aisles take
    // from some, and two fifths of the nodes at random leave less than a third to chance.
    const std::vector<int> counts = farfield::test::triangles_by_cell(canonical(), {4, 1, 4});
    const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
    CHECK(*least > 1'000'000 / 16 / 2);
    CHECK(*most < 1'000'000 / 16 * 2);
}

TEST_CASE("the same options lay the same pipes, another seed others", "[pipes]") {
    const Scene first = scenes::make_pipes({.triangles = 50'000}).value();
    const Scene second = scenes::make_pipes({.triangles = 50'000}).value();
    const Scene other = scenes::make_pipes({.triangles = 50'000, .seed = 7}).value();
    CHECK(farfield::digest(first) == farfield::digest(second));
    CHECK(farfield::digest(first) != farfield::digest(other));
}

TEST_CASE("the walk among pipes is closed, even and level", "[pipes]") {
    const auto path = scenes::pipes_path();
    REQUIRE(path);
    REQUIRE(farfield::eval::validate(*path));
    CHECK(path->frame_count == 300);
    farfield::test::check_level(*path);
    const farfield::PathPose begin = farfield::eval::pose_at(*path, 0);
    const farfield::PathPose end = farfield::eval::pose_at(*path, 300);
    CHECK(glm::distance(begin.eye, end.eye) < 1e-9);
    CHECK(glm::distance(begin.target, end.target) < 1e-9);
    CHECK(begin.eye.y == Approx(1.7));
    // The spline cuts corners by a little, and is as fast as its keys elsewhere.
    const auto [least, most] = farfield::test::paces(*path);
    CHECK(most < 0.5);
    CHECK(least > 0.7 * most);
}

TEST_CASE("the eye is in no pipe", "[pipes]") {
    for (const int triangles : {20'000, 1'000'000}) {
        const Scene scene = scenes::make_pipes({.triangles = triangles}).value();
        const auto path = scenes::pipes_path({.triangles = triangles});
        REQUIRE(path);
        const double clear = farfield::test::clearance(scene, farfield::test::eyes_of(*path), 1.0);
        INFO(triangles << ": " << clear);
        CHECK(clear >= 0.3);
    }
}
