#include "scenes/island.hpp"

#include "scenes/island_path.hpp"
#include "scenes/quarter_turn.hpp"
#include "scenes/random.hpp"
#include "scenes/willow.hpp"
#include <farfield/eval/camera_path.hpp>
#include <farfield/math/view.hpp>
#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace {

using farfield::Mesh;
using farfield::Scene;
using farfield::scenes::IslandOptions;
using glm::dvec2;
using glm::dvec3;
namespace scenes = farfield::scenes;

const Scene& canonical() {
    static const Scene scene = scenes::make_island().value();
    return scene;
}

/// Small enough to make many of.
IslandOptions small() {
    return {.trees = 20, .radius_m = 100.0, .terrain_quads = 16, .tree_triangles = 2000};
}

double area(const Mesh& mesh, std::size_t triangle) {
    const glm::vec3& a = mesh.positions[mesh.indices[3 * triangle]];
    const glm::vec3& b = mesh.positions[mesh.indices[3 * triangle + 1]];
    const glm::vec3& c = mesh.positions[mesh.indices[3 * triangle + 2]];
    return 0.5 * static_cast<double>(glm::length(glm::cross(b - a, c - a)));
}

bool same(const Scene& a, const Scene& b) {
    if (a.meshes.size() != b.meshes.size() || a.instances.size() != b.instances.size()) {
        return false;
    }
    for (std::size_t i = 0; i < a.meshes.size(); ++i) {
        if (a.meshes[i].positions != b.meshes[i].positions ||
            a.meshes[i].normals != b.meshes[i].normals ||
            a.meshes[i].colors != b.meshes[i].colors ||
            a.meshes[i].indices != b.meshes[i].indices) {
            return false;
        }
    }
    for (std::size_t i = 0; i < a.instances.size(); ++i) {
        if (a.instances[i].object_to_world != b.instances[i].object_to_world) {
            return false;
        }
    }
    return true;
}

} // namespace

TEST_CASE("random numbers are those of splitmix64", "[island]") {
    // First outputs of the published generator for seed 1234567.
    scenes::Random random(1234567);
    CHECK(random.bits() == 6457827717110365317ULL);
    CHECK(random.bits() == 3203168211198807973ULL);
    CHECK(random.bits() == 9817491932198370423ULL);
    double sum = 0.0;
    for (int i = 0; i < 10'000; ++i) {
        const double value = random.between(-2.0, 4.0);
        REQUIRE(value >= -2.0);
        REQUIRE(value < 4.0);
        sum += value;
    }
    // Mean 1, standard deviation of the mean 6 / sqrt(12) / 100 = 0.017; five of them.
    CHECK(sum / 10'000 == Approx(1.0).margin(0.09));
}

TEST_CASE("island options out of range are refused by name", "[island]") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    const auto message = [](const IslandOptions& options) {
        const auto scene = scenes::make_island(options);
        return scene ? std::string("made") : scene.error().message;
    };
    CHECK(message({.trees = -1}) == "island: trees is -1.000000, expected 0 to 1000000");
    CHECK(message({.radius_m = 0.0}).find("island: radius_m is 0") == 0);
    CHECK(message({.radius_m = nan}).find("island: radius_m is nan") == 0);
    CHECK(message({.height_m = -1.0}).find("island: height_m is -1") == 0);
    CHECK(message({.terrain_quads = 1}).find("island: terrain_quads is 1") == 0);
    CHECK(message({.terrain_quads = 5000}).find("island: terrain_quads is 5000") == 0);
    CHECK(
        message({.tree_triangles = 1999}) == "willow: triangles is 1999, expected 2000 to 10000000"
    );
    CHECK(message({.tree_height_m = infinity}).find("willow: height_m is inf") == 0);
    CHECK(message({.tree_width_m = 0.0}).find("willow: width_m is 0") == 0);
    CHECK(message({.min_spacing_m = nan}).find("island: min_spacing_m is nan") == 0);
    CHECK(message({.min_scale = 0.0}).find("island: min_scale is 0") == 0);
    CHECK(message({.min_scale = 1.2}).find("island: max_scale is 1.1") == 0);
    CHECK_FALSE(scenes::island_path({.radius_m = nan}));
}

TEST_CASE("trees that do not fit are an error with the numbers", "[island]") {
    // 60 m across less the shore: 20 discs of 12 m cover 80 % of it, and darts reach 55 %.
    IslandOptions options = small();
    options.radius_m = 30.0;
    const auto scene = scenes::make_island(options);
    REQUIRE_FALSE(scene);
    CHECK(
        scene.error().message == "island: 20 trees at least 12.000000 m apart do not fit on an "
                                 "island of 30.000000 m radius"
    );
    options.trees = 5;
    CHECK(scenes::make_island(options));
}

TEST_CASE("islands at the ends of their ranges are sound", "[island]") {
    IslandOptions bare = small();
    bare.trees = 0;
    bare.terrain_quads = 2;
    const auto empty = scenes::make_island(bare);
    REQUIRE(empty);
    CHECK(empty->instances.size() == 1);
    CHECK(farfield::primitive_count(*empty) == 8);
    CHECK(farfield::validate(*empty));

    IslandOptions flat = small();
    flat.height_m = 0.0;
    flat.min_spacing_m = 0.0;
    const auto plain = scenes::make_island(flat);
    REQUIRE(plain);
    CHECK(farfield::validate(*plain));
    CHECK(plain->meshes[0].bounds.lo.y == 0.0);
    CHECK(plain->meshes[0].bounds.hi.y == 0.0);

    IslandOptions large = small();
    large.radius_m = 1e6;
    const auto wide = scenes::make_island(large);
    REQUIRE(wide);
    CHECK(farfield::validate(*wide));
}

TEST_CASE("a willow has exactly the triangles, height and width asked for", "[island]") {
    for (const int triangles : {2000, 2001, 5000, 36229, 36230, 36231, 100'000}) {
        const auto willow = scenes::make_willow({.triangles = triangles});
        REQUIRE(willow);
        CHECK(farfield::primitive_count(*willow) == static_cast<std::uint64_t>(triangles));
        for (std::size_t i = 0; i < willow->indices.size() / 3; ++i) {
            REQUIRE(area(*willow, i) > 0.0);
        }
    }
    const auto willow = scenes::make_willow({.height_m = 20.0, .width_m = 8.0});
    REQUIRE(willow);
    // Positions are floats of up to 20 m.
    const dvec3 size = extent(willow->bounds);
    CHECK(willow->bounds.hi.y == Approx(20.0).epsilon(1e-6));
    CHECK(willow->bounds.lo.y < 0.0); // the foot
    CHECK(willow->bounds.lo.y > -0.06 * 20.0);
    CHECK(std::max(size.x, size.z) == Approx(8.0).epsilon(1e-6));
    CHECK(std::min(size.x, size.z) > 0.85 * 8.0); // round, not a hedge
}

TEST_CASE("a willow is mostly hanging leaves that reach far down", "[island]") {
    const Mesh willow = scenes::make_willow().value();
    // Above half its height the crown is wide, near the ground only its ends hang.
    double leaf_area = 0.0;
    std::size_t low = 0;
    std::size_t wide = 0;
    for (std::size_t i = 0; i < willow.indices.size() / 3; ++i) {
        const glm::vec3& p = willow.positions[willow.indices[3 * i]];
        const float outward = std::hypot(p.x, p.z);
        leaf_area += outward > 1.0F ? area(willow, i) : 0.0;
        low += p.y < 3.0F && outward > 1.5F ? 1 : 0;
        wide += outward > 3.0F ? 1 : 0;
    }
    // Leaves at all angles show half their area, and the silhouette is about 100 m^2: it is covered
    // once and a quarter at least, yet no solid block.
    CHECK(leaf_area > 250.0);
    CHECK(leaf_area < 1000.0);
    CHECK(low > 1000);
    CHECK(wide > willow.indices.size() / 3 / 4);
    // Light falls from above: colours are brighter at the top than below.
    double top = 0.0;
    double bottom = 0.0;
    int top_count = 0;
    int bottom_count = 0;
    for (std::size_t i = 0; i < willow.positions.size(); ++i) {
        if (willow.positions[i].y > 11.0F) {
            top += willow.colors[i].y;
            ++top_count;
        } else if (willow.positions[i].y < 5.0F) {
            bottom += willow.colors[i].y;
            ++bottom_count;
        }
    }
    CHECK(top / top_count > 1.2 * bottom / bottom_count);
}

TEST_CASE("the ground is smooth, as high as asked and 0 at the shore", "[island]") {
    const IslandOptions options;
    CHECK(scenes::island_height(options, 0.0, 0.0) == 20.0);
    CHECK(scenes::island_height(options, 500.0, 0.0) == 0.0);
    double highest = 0.0;
    double lowest = 1e300;
    double middle_low = 1e300;
    double middle_high = 0.0;
    for (int i = 0; i < 3600; ++i) {
        const double angle = i * std::numbers::pi / 1800.0;
        const dvec2 direction(std::cos(angle), std::sin(angle));
        CHECK(scenes::island_height(options, 400.0 * direction.x, 400.0 * direction.y) < 1e-9);
        for (const double radius : {1.0, 40.0, 123.0, 200.0, 310.0, 399.0}) {
            const double height =
                scenes::island_height(options, radius * direction.x, radius * direction.y);
            highest = std::max(highest, height);
            lowest = std::min(lowest, height);
            if (radius == 200.0) {
                middle_low = std::min(middle_low, height);
                middle_high = std::max(middle_high, height);
            }
            // No step: a millimetre aside it is as high, to a slope of 1.
            const double aside =
                scenes::island_height(options, radius * direction.x + 1e-3, radius * direction.y);
            REQUIRE(std::abs(aside - height) < 1e-3);
        }
    }
    CHECK(lowest >= 0.0);
    CHECK(highest < 30.0);
    CHECK(middle_high - middle_low > 4.0); // there are hills
}

TEST_CASE("the canonical island is the scene it has to be", "[island]") {
    const Scene& scene = canonical();
    REQUIRE(farfield::validate(scene));
    REQUIRE(scene.meshes.size() == 2);
    CHECK(farfield::primitive_count(scene.meshes[0]) == 131'072);
    CHECK(farfield::primitive_count(scene.meshes[1]) == 36'230);
    REQUIRE(scene.instances.size() == 1118);
    CHECK(farfield::primitive_count(scene) == 131'072 + 1117ULL * 36'230);
    CHECK(scene.meshes[0].splittable);
    CHECK_FALSE(scene.meshes[1].splittable);
    CHECK(scene.instances[0].mesh == farfield::make_id<farfield::MeshId>(0));
    CHECK(scene.meshes[1].bounds.hi.y == Approx(14.0).epsilon(1e-6));
    const dvec3 tree = extent(scene.meshes[1].bounds);
    CHECK(std::max(tree.x, tree.z) == Approx(11.0).epsilon(1e-6));
    const auto& ground = scene.meshes[0].bounds;
    CHECK(ground.hi.x == Approx(400.0).epsilon(1e-6));
    CHECK(ground.lo.z == Approx(-400.0).epsilon(1e-6));
    CHECK(ground.lo.y >= 0.0);
}

TEST_CASE("all triangles of the terrain are useful and face up", "[island]") {
    const Mesh& terrain = canonical().meshes[0];
    double total = 0.0;
    const double mean = std::numbers::pi * 400.0 * 400.0 / 131'072.0;
    for (std::size_t i = 0; i < terrain.indices.size() / 3; ++i) {
        const glm::vec3& a = terrain.positions[terrain.indices[3 * i]];
        const glm::vec3& b = terrain.positions[terrain.indices[3 * i + 1]];
        const glm::vec3& c = terrain.positions[terrain.indices[3 * i + 2]];
        const double flat = 0.5 * static_cast<double>(glm::cross(b - a, c - a).y);
        REQUIRE(flat > 0.5 * mean); // the map keeps areas; its bends at the diagonals do not quite
        REQUIRE(flat < 1.5 * mean);
        total += flat;
    }
    // The rim is a polygon of 1024 sides: smaller by (2 pi / 1024)^2 / 6; floats add 1e-6.
    CHECK(total == Approx(std::numbers::pi * 400.0 * 400.0).epsilon(2e-5));
    for (const glm::vec3& normal : terrain.normals) {
        REQUIRE(normal.y > 0.5F);
    }
}

TEST_CASE("trees stand on the ground, inland and apart", "[island]") {
    const Scene& scene = canonical();
    std::vector<dvec2> trunks;
    double least_scale = 10.0;
    double most_scale = 0.0;
    dvec2 facing(0.0);
    for (std::size_t i = 1; i < scene.instances.size(); ++i) {
        const auto& placement = scene.instances[i].object_to_world;
        const dvec3 at = placement[3];
        REQUIRE(at.y == scenes::island_height(IslandOptions{}, at.x, at.z));
        REQUIRE(std::hypot(at.x, at.z) <= 0.97 * 400.0);
        const double scale = glm::length(placement[1]);
        REQUIRE(glm::length(placement[0]) == Approx(scale).epsilon(1e-14));
        REQUIRE(glm::length(placement[2]) == Approx(scale).epsilon(1e-14));
        REQUIRE(glm::dot(glm::cross(placement[0], placement[1]), placement[2]) > 0.0);
        REQUIRE(placement[1].x == 0.0); // upright
        REQUIRE(placement[1].z == 0.0);
        least_scale = std::min(least_scale, scale);
        most_scale = std::max(most_scale, scale);
        facing += dvec2(placement[0].x, placement[0].z) / scale;
        trunks.emplace_back(at.x, at.z);
    }
    double nearest = 1e300;
    for (std::size_t i = 0; i < trunks.size(); ++i) {
        for (std::size_t j = i + 1; j < trunks.size(); ++j) {
            nearest = std::min(nearest, glm::distance(trunks[i], trunks[j]));
        }
    }
    CHECK(nearest >= 12.0);
    CHECK(nearest < 13.0); // not on a lattice
    CHECK(least_scale >= 0.9);
    CHECK(least_scale < 0.905);
    CHECK(most_scale <= 1.1);
    CHECK(most_scale > 1.095);
    // Directions at random: their mean is about 1 / sqrt(1117) = 0.03 long; four times that.
    CHECK(glm::length(facing) / 1117.0 < 0.12);
    // The feet reach into the ground all around the trunk: 0.5 m at least at the smallest scale,
    // against a slope that the trunk of 1.3 m across meets.
    CHECK(scene.meshes[1].bounds.lo.y * 0.9 < -0.5);
}

TEST_CASE("quarter turns change nothing but turns, to the nearest exact ones", "[island]") {
    const Scene any = scenes::make_island(small()).value();
    IslandOptions options = small();
    options.quarter_turns = true;
    const Scene quarters = scenes::make_island(options).value();
    CHECK(quarters.meshes[0].positions == any.meshes[0].positions);
    REQUIRE(quarters.instances.size() == any.instances.size());
    bool turned = false;
    for (std::size_t i = 1; i < any.instances.size(); ++i) {
        const glm::dmat4x3& before = any.instances[i].object_to_world;
        const glm::dmat4x3& after = quarters.instances[i].object_to_world;
        const double scale = before[1].y;
        std::uint64_t turns = 0;
        while (turns < 4 && after != scenes::quarter_turned(turns, scale, before[3])) {
            ++turns;
        }
        REQUIRE(turns < 4); // entries are exactly 0, scale or -scale
        turned = turned || turns != 0;
        // At most 45 degrees from where it was.
        CHECK(glm::dot(before[2], after[2]) > scale * scale * (std::sqrt(0.5) - 1e-12));
    }
    CHECK(turned);
}

TEST_CASE("options make the same island on every run and another one when changed", "[island]") {
    const Scene first = scenes::make_island(small()).value();
    CHECK(same(first, scenes::make_island(small()).value()));
    IslandOptions other = small();
    other.seed = 2;
    CHECK_FALSE(same(first, scenes::make_island(other).value()));
    other = small();
    other.tree_seed = 2;
    const Scene replanted = scenes::make_island(other).value();
    CHECK_FALSE(same(first, replanted));
    CHECK(replanted.meshes[0].positions == first.meshes[0].positions);
    CHECK(replanted.instances[1].object_to_world == first.instances[1].object_to_world);
}

TEST_CASE("the canonical walk has its length, steps and heights", "[island]") {
    const IslandOptions options;
    const auto path = scenes::island_path();
    REQUIRE(path);
    REQUIRE(farfield::eval::validate(*path));
    REQUIRE(path->frame_count == 1200);
    std::vector<double> steps;
    double length = 0.0;
    double arc = 0.0;
    for (int frame = 0; frame < 1200; ++frame) {
        const auto pose = farfield::eval::pose_at(*path, frame);
        const dvec3 eye = pose.eye;
        REQUIRE(eye.y >= scenes::island_height(options, eye.x, eye.z) + 2.0);
        const double distance = std::hypot(eye.x, eye.z);
        if (frame <= 700) { // the spline begins to round the corner a key and a half before it
            REQUIRE(distance == Approx(460.0).epsilon(1e-3));
            REQUIRE(eye.y == Approx(25.0).epsilon(1e-9));
            // Looking at the middle.
            REQUIRE(std::hypot(pose.target.x, pose.target.z) < 1.0);
        }
        if (frame > 0) {
            steps.push_back(glm::distance(eye, farfield::eval::pose_at(*path, frame - 1).eye));
            length += steps.back();
        }
    }
    const dvec3 begin = farfield::eval::pose_at(*path, 0).eye;
    const dvec3 corner = path->keys[65].eye; // frame 715
    arc = std::atan2(corner.z, corner.x) - std::atan2(begin.z, begin.x);
    CHECK(arc * 180.0 / std::numbers::pi == Approx(63.0).margin(1.0));
    CHECK(length == Approx(960.0).epsilon(0.05));
    CHECK(*std::max_element(steps.begin(), steps.end()) < 1.6);
    std::nth_element(steps.begin(), steps.begin() + 600, steps.end());
    CHECK(steps[600] == Approx(0.8).epsilon(0.05));

    // It ends at the centre at tree-top height, turned away by 120 degrees.
    const auto end = farfield::eval::pose_at(*path, 1199);
    CHECK(std::hypot(end.eye.x, end.eye.z) < 1.0);
    CHECK(end.eye.y > 20.0 + 12.0);
    CHECK(end.eye.y < 20.0 + 17.0);
    const auto heading = [&](int frame) {
        const auto pose = farfield::eval::pose_at(*path, frame);
        return std::atan2(pose.target.z - pose.eye.z, pose.target.x - pose.eye.x);
    };
    const double turned = std::remainder(heading(1199) - heading(1000), 2.0 * std::numbers::pi);
    CHECK(turned * 180.0 / std::numbers::pi == Approx(120.0).margin(1.0));
    // No cut anywhere: the view turns by less than 3 degrees a frame.
    for (int frame = 1; frame < 1200; ++frame) {
        const double turn =
            std::remainder(heading(frame) - heading(frame - 1), 2.0 * std::numbers::pi);
        REQUIRE(std::abs(turn) < 3.0 * std::numbers::pi / 180.0);
    }
}

TEST_CASE("the walk of any island stays above its ground", "[island]") {
    for (const double radius : {50.0, 400.0, 3000.0}) {
        for (const double height : {0.0, 20.0, 90.0}) {
            IslandOptions options;
            options.radius_m = radius;
            options.height_m = height;
            const auto path = scenes::island_path(options);
            REQUIRE(path);
            REQUIRE(farfield::eval::validate(*path));
            for (int frame = 0; frame < path->frame_count; ++frame) {
                const dvec3 eye = farfield::eval::pose_at(*path, frame).eye;
                INFO("radius " << radius << " height " << height << " frame " << frame);
                REQUIRE(eye.y >= scenes::island_height(options, eye.x, eye.z) + 2.0);
            }
        }
    }
}
