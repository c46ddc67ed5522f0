#include "scenes/trees.hpp"

#include "scenes/dolly.hpp"
#include "scenes/overview.hpp"
#include "scenes/quarter_turn.hpp"
#include <farfield/eval/camera_path.hpp>
#include <farfield/math/view.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>

namespace {

using farfield::Box3d;
using farfield::Mesh;
using farfield::Scene;
using farfield::scenes::BroadleafOptions;
using farfield::scenes::DollyOptions;
using farfield::scenes::Sphere;
using farfield::scenes::TreesOptions;
using glm::dvec3;
namespace scenes = farfield::scenes;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Hardly any leaves, for wholes of many trees.
TreesOptions bare(int count) {
    return {.count = count, .tree = {.triangles = 5000}};
}

template <typename T>
std::string message_of(const farfield::Result<T>& made) {
    return made ? std::string("made") : made.error().message;
}

} // namespace

TEST_CASE("trees out of range are refused by name", "[trees]") {
    for (const int count : {-4, 0, 2, 3, 8, 100, 1 << 23, 1 << 24}) {
        CHECK(
            message_of(scenes::make_trees(bare(count))) ==
            "trees: count is " + std::to_string(count) + ", expected a power of four, 1 to 4194304"
        );
    }
    const auto message = [](const BroadleafOptions& options) {
        return message_of(scenes::make_broadleaf(options));
    };
    CHECK(message({.triangles = 4999}) == "tree: triangles is 4999, expected 5000 to 10000000");
    CHECK(message({.triangles = 10'000'001}).find("tree: triangles is 10000001") == 0);
    CHECK(message({.height_m = 0.0}).find("tree: height_m is 0.0") == 0);
    CHECK(message({.width_m = kNan}).find("tree: width_m is nan") == 0);
    CHECK(message_of(scenes::make_trees({.tree = {.triangles = 1}})).find("tree: triangles") == 0);
}

TEST_CASE("a broad-leaved tree has exactly the triangles, height and width asked for", "[trees]") {
    for (const int triangles : {5000, 5001, 20'000, 52'470, 52'471, 300'000}) {
        const Mesh tree = scenes::make_broadleaf({.triangles = triangles}).value();
        CHECK(farfield::primitive_count(tree) == static_cast<std::uint64_t>(triangles));
    }
    const Mesh tree = scenes::make_broadleaf({.height_m = 20.0, .width_m = 8.0}).value();
    const dvec3 size = extent(tree.bounds);
    // Positions are floats of up to 20 m.
    CHECK(tree.bounds.hi.y == Approx(20.0).epsilon(1e-6));
    CHECK(tree.bounds.lo.y == 0.0);
    CHECK(std::max(size.x, size.z) == Approx(8.0).epsilon(1e-6));
    CHECK(std::min(size.x, size.z) > 0.85 * 8.0); // round, not a hedge
}

TEST_CASE("a broad-leaved tree is a crown on a trunk", "[trees]") {
    const Mesh tree = scenes::make_broadleaf().value();
    std::size_t low = 0;
    double leaf_area = 0.0;
    for (std::size_t i = 0; i < tree.indices.size(); i += 3) {
        const glm::vec3& a = tree.positions[tree.indices[i]];
        const glm::vec3& b = tree.positions[tree.indices[i + 1]];
        const glm::vec3& c = tree.positions[tree.indices[i + 2]];
        if (a.y < 2.0F) {
            ++low;
            REQUIRE(std::hypot(a.x, a.z) < 1.0F); // the trunk alone
        } else {
            leaf_area += 0.5 * static_cast<double>(glm::length(glm::cross(b - a, c - a)));
        }
    }
    CHECK(low > 10);
    // Leaves at all angles show half their area, and the crown's silhouette is about 70 m^2: it is
    // covered more than once, yet no solid block.
    CHECK(leaf_area > 150.0);
    CHECK(leaf_area < 700.0);
}

TEST_CASE("quarter turns are exact", "[trees]") {
    for (const std::uint64_t turns : {0U, 1U, 2U, 3U, 4U, 7U}) {
        const glm::dmat4x3 matrix = scenes::quarter_turned(turns, 1.5, {1.0, 2.0, 3.0});
        const double angle = static_cast<double>(turns) * std::numbers::pi / 2.0;
        CHECK(matrix[3] == dvec3(1.0, 2.0, 3.0));
        CHECK(matrix[1] == dvec3(0.0, 1.5, 0.0));
        for (const int column : {0, 2}) {
            for (int row = 0; row < 3; ++row) {
                const double entry = matrix[column][row];
                CHECK((entry == 0.0 || std::abs(entry) == 1.5));
                CHECK_FALSE((entry == 0.0 && std::signbit(entry)));
            }
        }
        // Turns by at most 5.5 radians, whose sine and cosine are right to 1e-15.
        CHECK(matrix[2].x == Approx(1.5 * std::sin(angle)).margin(1e-14));
        CHECK(matrix[2].z == Approx(1.5 * std::cos(angle)).margin(1e-14));
        CHECK(glm::dot(glm::cross(matrix[0], matrix[1]), matrix[2]) == 1.5 * 1.5 * 1.5);
    }
}

TEST_CASE("a tree alone may be cut and is not turned", "[trees]") {
    TreesOptions options;
    options.count = 1;
    const Scene scene = scenes::make_trees(options).value();
    REQUIRE(farfield::validate(scene));
    CHECK(farfield::primitive_count(scene) == 52'470);
    CHECK(scene.meshes[0].splittable);
    CHECK(scene.instances[0].object_to_world == glm::dmat4x3(1.0));
}

TEST_CASE("four blocks are the next larger block", "[trees]") {
    const Scene large = scenes::make_trees(bare(256)).value();
    REQUIRE(farfield::validate(large));
    REQUIRE(large.instances.size() == 256);
    CHECK(farfield::primitive_count(large) == 1'280'000);
    CHECK_FALSE(large.meshes[0].splittable);
    const double spacing = scenes::trees_spacing(bare(256));
    CHECK(spacing < 10.0); // crowns touch
    std::set<std::pair<double, double>> places;
    std::array<int, 4> turns{};
    for (const farfield::Instance& tree : large.instances) {
        const glm::dmat4x3& matrix = tree.object_to_world;
        CHECK(places.emplace(matrix[3].x, matrix[3].z).second);
        CHECK(matrix[3].y == 0.0);
        std::size_t turn = 0;
        while (turn < 4 && matrix != scenes::quarter_turned(turn, 1.0, matrix[3])) {
            ++turn;
        }
        REQUIRE(turn < 4); // entries are exactly 0, 1 and -1
        ++turns[turn];
    }
    // Of 256, 64 each with a standard deviation of 6.9; four of them.
    for (const int count : turns) {
        CHECK(std::abs(count - 64) < 28);
    }
    // The block is square around 0, its blocks of 64, 16 and 4 are square themselves.
    for (const std::size_t block : {4U, 16U, 64U, 256U}) {
        const double side = std::sqrt(static_cast<double>(block));
        for (std::size_t first = 0; first < 256; first += block) {
            Box3d box;
            for (std::size_t i = first; i < first + block; ++i) {
                box = unite(
                    box,
                    Box3d{
                        large.instances[i].object_to_world[3],
                        large.instances[i].object_to_world[3]}
                );
            }
            CHECK(extent(box).x == Approx((side - 1.0) * spacing));
            CHECK(extent(box).z == Approx((side - 1.0) * spacing));
        }
    }
    const Box3d all = scene_bounds(large);
    CHECK(std::abs(center(all).x) < spacing / 2.0);
    // A smaller wood is the first block of a larger one.
    const Scene small = scenes::make_trees(bare(16)).value();
    const dvec3 moved =
        small.instances[0].object_to_world[3] - large.instances[0].object_to_world[3];
    for (std::size_t i = 0; i < 16; ++i) {
        glm::dmat4x3 expected = large.instances[i].object_to_world;
        expected[3] += moved;
        CHECK(glm::distance(small.instances[i].object_to_world[3], expected[3]) < 1e-9);
        CHECK(small.instances[i].object_to_world[0] == expected[0]);
    }
}

TEST_CASE("ground lies below all trees when it is asked for", "[trees]") {
    TreesOptions options = bare(16);
    options.ground = true;
    const Scene scene = scenes::make_trees(options).value();
    REQUIRE(farfield::validate(scene));
    REQUIRE(scene.instances.size() == 17);
    const Box3d& ground = scene.meshes[1].bounds;
    CHECK(farfield::primitive_count(scene.meshes[1]) == 2);
    CHECK(ground.lo.y == 0.0);
    CHECK(ground.hi.y == 0.0);
    for (std::size_t i = 0; i < 16; ++i) {
        const Box3d tree = item_bounds(scene, farfield::make_id<farfield::ItemId>(i));
        CHECK(tree.lo.x > ground.lo.x);
        CHECK(tree.lo.z > ground.lo.z);
        CHECK(tree.hi.x < ground.hi.x);
        CHECK(tree.hi.z < ground.hi.z);
    }
}

TEST_CASE("the same options grow the same trees, another seed other ones", "[trees]") {
    const Scene first = scenes::make_trees(bare(16)).value();
    const Scene second = scenes::make_trees(bare(16)).value();
    TreesOptions options = bare(16);
    options.seed = 5;
    const Scene turned = scenes::make_trees(options).value();
    options = bare(16);
    options.tree.seed = 5;
    const Scene other = scenes::make_trees(options).value();
    CHECK(first.meshes[0].positions == second.meshes[0].positions);
    CHECK(first.meshes[0].colors == second.meshes[0].colors);
    CHECK(first.meshes[0].positions == turned.meshes[0].positions);
    CHECK(first.meshes[0].positions != other.meshes[0].positions);
    bool same = true;
    bool all_as_before = true;
    for (std::size_t i = 0; i < 16; ++i) {
        const glm::dmat4x3& matrix = first.instances[i].object_to_world;
        same = same && matrix == second.instances[i].object_to_world;
        all_as_before = all_as_before && matrix == turned.instances[i].object_to_world;
    }
    CHECK(same);
    CHECK_FALSE(all_as_before);
}

TEST_CASE("a ball around a scene reaches to its farthest vertex", "[trees]") {
    const Scene scene = scenes::make_trees(bare(4)).value();
    const Sphere sphere = scenes::bounding_sphere(scene);
    CHECK(sphere.middle == center(scene_bounds(scene)));
    double farthest = 0.0;
    for (const farfield::Instance& instance : scene.instances) {
        for (const glm::vec3& position : scene.meshes[0].positions) {
            const dvec3 point = instance.object_to_world * glm::dvec4(dvec3(position), 1.0);
            farthest = std::max(farthest, glm::distance(point, sphere.middle));
        }
    }
    CHECK(sphere.radius == Approx(farthest).epsilon(1e-14));
    CHECK(sphere.radius < 0.5 * glm::length(extent(scene_bounds(scene))));
}

TEST_CASE("a dolly out of range is refused by name", "[trees]") {
    const Sphere ball = {{1.0, 2.0, 3.0}, 5.0};
    const auto message = [&](const DollyOptions& options) {
        return message_of(scenes::dolly_path(ball, options));
    };
    CHECK(message({.angle_deg = kNan}).find("dolly: angle_deg is nan") == 0);
    CHECK(message({.elevation_deg = 81.0}).find("dolly: elevation_deg is 81") == 0);
    CHECK(message({.nearest = 0.0}).find("dolly: nearest is 0") == 0);
    CHECK(message({.nearest = 15.0}).find("dolly: farthest is 14") == 0);
    CHECK(message({.farthest = kInfinity}).find("dolly: farthest is inf") == 0);
    for (const double radius : {0.0, -1.0, kNan, kInfinity}) {
        CHECK(message_of(scenes::dolly_path({{}, radius})).find("dolly: radius is ") == 0);
    }
}

TEST_CASE("a dolly keeps its direction and its distances", "[trees]") {
    const Sphere ball = {{1.0, 2.0, 3.0}, 5.0};
    const auto path = scenes::dolly_path(ball, {.angle_deg = 30.0});
    REQUIRE(path);
    REQUIRE(farfield::eval::validate(*path));
    REQUIRE(path->frame_count == 121);
    const dvec3 direction(0.5, 0.0, std::sqrt(3.0) / 2.0);
    for (int frame = 0; frame < 121; ++frame) {
        const farfield::PathPose pose = farfield::eval::pose_at(*path, frame);
        const dvec3 off = (pose.eye - ball.middle) / ball.radius;
        const double expected = 1.75 * std::pow(8.0, frame / 120.0);
        // Beside an end, whose key is not made smaller, a spline of step s is too far by
        // ((s + 1 / s - 2) / 6) / 6 = 8.3e-6 of the distance, less elsewhere.
        REQUIRE(glm::length(off) == Approx(expected).epsilon(1e-5));
        REQUIRE(glm::distance(off / glm::length(off), direction) < 1e-12);
        REQUIRE(glm::distance(pose.target, ball.middle) < 1e-12);
    }
    for (const auto& [frame, distance] : {std::pair(0, 1.75), {40, 3.5}, {80, 7.0}, {120, 14.0}}) {
        const farfield::PathPose pose = farfield::eval::pose_at(*path, frame);
        CHECK(glm::distance(pose.eye, ball.middle) == Approx(5.0 * distance).epsilon(1e-12));
    }
    const auto above = scenes::dolly_path(ball, {.elevation_deg = 30.0, .farthest = 1.75});
    REQUIRE(above);
    CHECK(
        glm::distance(
            farfield::eval::pose_at(*above, 60).eye,
            dvec3(1.0, 2.0, 3.0) + 8.75 * dvec3(0.0, 0.5, std::sqrt(3.0) / 2.0)
        ) < 1e-12
    );
}

TEST_CASE("an overview shows a whole box below the sky", "[trees]") {
    for (const int count : {1, 4, 256, 16384}) {
        const double side = std::sqrt(static_cast<double>(count)) * 9.0;
        const Box3d box = {{-side / 2.0, 0.0, -side / 2.0}, {side / 2.0, 12.0, side / 2.0}};
        const auto path = scenes::overview_path(box);
        REQUIRE(path);
        const farfield::PathPose pose = farfield::eval::pose_at(*path, 17);
        CHECK(pose == farfield::eval::pose_at(*path, 0)); // at rest
        const farfield::Lens lens =
            farfield::perspective_lens(std::numbers::pi / 3.0, 1.0, 0.1, 1e5);
        const farfield::View view =
            farfield::look_at(pose.eye, pose.target, pose.up, lens, 512, 512);
        double widest = 0.0;
        double highest = -1.0;
        for (int corner = 0; corner < 8; ++corner) {
            const dvec3 point(
                corner % 2 == 0 ? box.lo.x : box.hi.x,
                corner / 2 % 2 == 0 ? box.lo.y : box.hi.y,
                corner / 4 == 0 ? box.lo.z : box.hi.z
            );
            const dvec3 local = (point - view.eye) * view.camera_to_world;
            const double reach = std::tan(std::numbers::pi / 6.0) * -local.z;
            widest = std::max({widest, std::abs(local.x) / reach, std::abs(local.y) / reach});
            highest = std::max(highest, local.y / reach);
        }
        CHECK(widest == Approx(0.97).epsilon(1e-12));
        CHECK((count == 1 || highest < 0.6)); // a fifth of the picture is sky
    }
    const Box3d unit = {dvec3(0.0), dvec3(1.0)};
    CHECK(message_of(scenes::overview_path(unit, 0.0)).find("overview: fov_deg is 0") == 0);
    CHECK(message_of(scenes::overview_path(unit, 60.0, -1.0)).find("overview: down_deg is") == 0);
    CHECK_FALSE(scenes::overview_path(Box3d{}));
}
