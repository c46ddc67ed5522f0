#include "cell_checks.hpp"
#include "scenes.hpp"
#include "tree_checks.hpp"
#include "tree_hash.hpp"
#include <farfield/partition/kdtree.hpp>
#include <farfield/partition/octree.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace {

using namespace farfield;
using partition::build_octree;
using partition::OctreeOptions;
using support::Surfaces;

Hierarchy built(const Surfaces& scene, const OctreeOptions& options = {}) {
    auto tree = build_octree(scene.objects, options, scene.shape());
    INFO((tree ? std::string("built") : tree.error().message));
    REQUIRE(tree.has_value());
    support::require_valid(*tree);
    support::require_items_in_place(*tree, scene.objects);
    support::require_item_tables(*tree, scene.objects);
    support::require_image_levels(*tree, 8);
    REQUIRE(tree->clip_leaves);
    REQUIRE(tree->inflation == options.inflation);
    return *tree;
}

} // namespace

TEST_CASE("nothing, one thing, and all at one point", "[octree]") {
    CHECK(built({}).nodes.size() == 1);
    Surfaces scene;
    scene.add_whole(support::cube({1, 2, 3}, 1.0));
    CHECK(built(scene).nodes.size() == 1);
    Surfaces points;
    points.add(
        std::vector<Triangle3d>(20, Triangle3d{glm::dvec3(5.0), glm::dvec3(5.0), glm::dvec3(5.0)})
    );
    CHECK(built(points, {.max_primitives = 1, .max_depth = 64}).nodes.size() == 1);
}

TEST_CASE("cells are halves of one cube in x, y and z", "[octree]") {
    // A long and flat scene, dense in itself: in a cube of 64 about it, planes lie at multiples of
    // its parts, in every direction alike.
    support::Random random(1);
    std::vector<Triangle3d> triangles = support::random_triangles(4000, 1.0, 0.1, random);
    triangles.push_back({{{-1.05, -1, -1}, {1.05, 1, 1}, {0, 0, 0}}});
    for (Triangle3d& triangle : triangles) {
        for (glm::dvec3& corner : triangle) {
            corner = glm::clamp(corner, -1.0, 1.0) * glm::dvec3(32.0, 4.0, 16.0);
        }
    }
    Surfaces scene;
    scene.add(std::move(triangles));
    const Hierarchy tree = built(scene, {.max_primitives = 50, .max_depth = 4});
    CHECK(tree.quality.leaves > 50);
    for (const HierarchyNode& node : tree.nodes) {
        if (!is_leaf(node)) {
            // 64 / 2^4 is the smallest cell; half of the next one up is a plane's offset.
            CHECK(std::fmod(node.plane.offset, 4.0F) == 0.0F);
        }
    }
    // Into the directions in turn: where all octants are occupied, three halvings of three kinds.
    const HierarchyNode& root = tree.nodes[0];
    CHECK(root.plane == Plane{{1.0F, 0.0F, 0.0F}, 0.0F});
    const HierarchyNode& half = tree.nodes[root.first_child];
    CHECK_FALSE(half.image_level);
    CHECK(half.plane == Plane{{0.0F, 1.0F, 0.0F}, 0.0F});
    const HierarchyNode& quarter = tree.nodes[half.first_child];
    CHECK_FALSE(quarter.image_level);
    CHECK(quarter.plane == Plane{{0.0F, 0.0F, 1.0F}, 0.0F});
    CHECK(tree.nodes[quarter.first_child].image_level);
}

TEST_CASE("in a cube of space an octree is the k-d tree of branching 8", "[octree]") {
    // The longest side of a cube, then of its half and its quarter, are x, y and z in turn.
    Surfaces scene;
    for (int z = 0; z < 8; ++z) {
        for (int y = 0; y < 8; ++y) {
            for (int x = 0; x < 8; ++x) {
                const glm::dvec3 lo(x + 0.2, y + 0.2, z + 0.2);
                scene.add(support::block({lo, lo + 0.6}));
            }
        }
    }
    const Hierarchy tree = built(scene, {.max_primitives = 12, .max_depth = 3});
    CHECK(support::image_nodes(tree) == 585);
    const auto kdtree = partition::build_kdtree(
        scene.objects, {.max_primitives = 12, .max_depth = 3}, scene.shape()
    );
    REQUIRE(kdtree.has_value());
    CHECK(support::hash_of(tree) == support::hash_of(*kdtree));
}

TEST_CASE("a flat scene: empty octants are not there", "[octree]") {
    // On ground that no plane halves, 4 of 8 octants are empty at every level.
    Surfaces scene;
    for (int z = 0; z < 16; ++z) {
        for (int x = 0; x < 16; ++x) {
            const glm::dvec3 lo(x + 0.1, 0.0, z + 0.1);
            scene.add_whole({{lo, lo + glm::dvec3(0.8, 0.1, 0.8)}, 12, false});
        }
    }
    const Hierarchy tree = built(scene, {.max_primitives = 12, .max_depth = 4});
    CHECK(support::image_nodes(tree) == 341);
    CHECK(tree.quality.leaves == 256);
}

TEST_CASE("the same tree on every run, at 1e7 m as well", "[octree]") {
    support::Random random(2);
    Surfaces scene;
    std::vector<Triangle3d> triangles = support::random_triangles(500, 20.0, 4.0, random);
    for (Triangle3d& triangle : triangles) {
        for (glm::dvec3& corner : triangle) {
            corner = glm::floor(corner * 64.0) / 64.0;
        }
    }
    scene.add(std::move(triangles));
    const OctreeOptions options{.max_primitives = 20};
    Hierarchy here = built(scene, options);
    CHECK(support::hash_of(here) == support::hash_of(built(scene, options)));
    scene.transform(1.0, glm::dvec3(1e7, -1e7, 1e7));
    const Hierarchy there = built(scene, options);
    here.origin = there.origin;
    CHECK(support::hash_of(here) == support::hash_of(there));
}

TEST_CASE("options out of range are named with their value", "[octree]") {
    CHECK(OctreeOptions{.max_primitives = 4}.max_depth == 8);
    CHECK(OctreeOptions{.max_depth = 4}.max_primitives == 4096);
    CHECK(OctreeOptions{.inflation = 0.5F}.max_depth == 8);
    CHECK(OctreeOptions{.max_copies = 4}.max_depth == 8);
    struct Case {
        OctreeOptions options;
        const char* message;
    };
    const std::vector<Case> cases{
        {{.max_primitives = 0}, "OctreeOptions: max_primitives is 0"},
        {{.max_depth = 65}, "OctreeOptions: max_depth is 65"},
        {{.inflation = std::nanf("")}, "OctreeOptions: inflation is nan"},
        {{.max_copies = 0}, "OctreeOptions: max_copies is 0"}};
    for (const Case& wrong : cases) {
        const auto tree = build_octree({}, wrong.options);
        REQUIRE_FALSE(tree.has_value());
        CHECK(tree.error().code == ErrorCode::invalid_argument);
        CHECK_THAT(tree.error().message, Catch::Contains(wrong.message));
    }
    const std::vector<Object> objects{{{{0, 0, 0}, {-1, 1, 1}}, 1, false}};
    const auto tree = build_octree(objects);
    REQUIRE_FALSE(tree.has_value());
    CHECK_THAT(tree.error().message, Catch::Contains("object 0: bounds: inverted, lo.x is 0"));
}
