#include "files.hpp"
#include "run/proxy.hpp"
#include "run/world.hpp"
#include <farfield/image/proxy_pair.hpp>

#include <catch2/catch.hpp>

#include <string>
#include <utility>
#include <vector>

namespace {

using farfield::index_of;
using farfield::ProxyPair;
using farfield::run::ProxyOptions;
using farfield::run::World;
using farfield::run::WorldOptions;
using farfield::test::TemporaryFile;
namespace run = farfield::run;

World load(const WorldOptions& options) {
    auto loaded = run::load_world(options);
    if (!loaded) {
        FAIL(loaded.error().message);
    }
    return std::move(*loaded);
}

WorldOptions small_terrain() {
    WorldOptions options;
    options.scene = "terrain";
    options.scene_values = {{"posts", 65.0}};
    return options;
}

std::vector<ProxyPair> make(World& world, const ProxyOptions& options) {
    auto pairs = run::make_proxies(world, options);
    if (!pairs) {
        FAIL(pairs.error().message);
    }
    return std::move(*pairs);
}

std::string message_of(World& world, const ProxyOptions& options) {
    const auto pairs = run::make_proxies(world, options);
    return pairs ? "made" : pairs.error().message;
}

/// That pairs are whole, and coarse items are what backends and counts take them for.
void check_pairs(const World& world, const std::vector<ProxyPair>& pairs) {
    const auto valid_scene = validate(world.scene);
    INFO((valid_scene ? std::string() : valid_scene.error().message));
    CHECK(valid_scene.has_value());
    CHECK(world.item_primitives.size() == world.scene.instances.size());
    CHECK(world.item_frames.size() == world.scene.instances.size());
    for (const ProxyPair& pair : pairs) {
        const auto valid = validate(pair);
        INFO((valid ? std::string() : valid.error().message));
        REQUIRE(valid.has_value());
        REQUIRE(index_of(pair.coarse) < world.scene.instances.size());
        CHECK(index_of(pair.coarse) >= world.instances);
        CHECK(index_of(pair.fine) < world.instances);
        CHECK(world.item_primitives[index_of(pair.coarse)] == pair.facets.size());
        CHECK(
            world.scene.instances[index_of(pair.coarse)].object_to_world ==
            world.scene.instances[index_of(pair.fine)].object_to_world
        );
    }
}

} // namespace

TEST_CASE("terrain gets a grid or a tree of triangles", "[proxy]") {
    World world = load(small_terrain());
    const std::vector<ProxyPair> grid = make(world, {.proxy = "grid", .coarse = 8});
    REQUIRE(grid.size() == 1);
    check_pairs(world, grid);
    CHECK(grid[0].facets.size() == 2UL * 8UL * 8UL);
    CHECK(grid[0].samples.size() == 65UL * 65UL);
    CHECK_FALSE(is_refinable(grid[0]));

    World other = load(small_terrain());
    const std::vector<ProxyPair> refined = make(other, {.coarse_triangles = 500});
    REQUIRE(refined.size() == 1);
    check_pairs(other, refined);
    CHECK(is_refinable(refined[0]));
    CHECK(refined[0].quality.facets <= 500);
    CHECK(refined[0].quality.facets > 400);
}

TEST_CASE("any mesh gets one of fewer triangles", "[proxy]") {
    World world = load(small_terrain());
    const std::vector<ProxyPair> mesh = make(world, {.proxy = "mesh", .coarse_triangles = 300});
    REQUIRE(mesh.size() == 1);
    check_pairs(world, mesh);
    CHECK_FALSE(is_refinable(mesh[0]));
    CHECK(mesh[0].quality.facets <= 300);
    CHECK(mesh[0].quality.facets > 290);
    CHECK(mesh[0].samples.size() == 65UL * 65UL);
    CHECK(mesh[0].quality.hausdorff_m > 0.0);
    CHECK(mesh[0].quality.hausdorff_m < 1200.0 / 4.0); // of the relief

    // Trees on an island: heights of neither are a grid.
    WorldOptions options;
    options.scene_values = {{"trees", 3.0}, {"terrain-quads", 8.0}, {"tree-triangles", 2000.0}};
    World island = load(options);
    const std::vector<ProxyPair> pairs = make(island, {});
    REQUIRE(pairs.size() == 4);
    check_pairs(island, pairs);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        CHECK(index_of(pairs[i].fine) == i);
    }
    CHECK(pairs[1].facets.size() == pairs[3].facets.size());
    CHECK(pairs[1].origin != pairs[3].origin);
}

TEST_CASE("what moves has no coarse model", "[proxy]") {
    WorldOptions options = small_terrain();
    options.movers = 3;
    World world = load(options);
    const std::vector<ProxyPair> pairs = make(world, {.proxy = "grid"});
    REQUIRE(pairs.size() == 1);
    check_pairs(world, pairs);
    CHECK(index_of(pairs[0].fine) == 0);
}

TEST_CASE("worlds that cannot have pairs say why", "[proxy]") {
    World world = load(small_terrain());
    CHECK(message_of(world, {.proxy = "none"}).find("proxy \"none\" does not exist") == 0);
    CHECK(
        message_of(world, {.proxy = "grid", .coarse = 0}).find("squares is 0") != std::string::npos
    );
    CHECK(
        message_of(world, {.coarse_triangles = 1}).find("max_triangles is 1") != std::string::npos
    );
    CHECK(world.scene.instances.size() == 1);
    WorldOptions forest;
    forest.scene = "trees";
    World trees = load(forest);
    CHECK(message_of(trees, {}).find("too many for pairs: at most 16000000") != std::string::npos);
    const TemporaryFile file("roof.obj", farfield::test::roof_obj());
    WorldOptions options;
    options.scene = file.path();
    World roof = load(options);
    CHECK(message_of(roof, {.proxy = "grid"}).find("is no grid of heights") != std::string::npos);
}
