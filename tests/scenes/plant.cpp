#include "scenes/plant.hpp"

#include "boxes.hpp"
#include "scenes/plant_layout.hpp"
#include "scenes/plant_parts.hpp"
#include "scenes/plant_path.hpp"
#include "walks.hpp"
#include <farfield/eval/camera_path.hpp>

#include <catch2/catch.hpp>
#include <glm/ext/vector_int3.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <string>
#include <vector>

namespace {

using farfield::Mesh;
using farfield::Scene;
using farfield::scenes::PlantOptions;
using glm::dvec3;
namespace scenes = farfield::scenes;
namespace plant = farfield::scenes::plant;

std::string message_of(const PlantOptions& options) {
    const auto made = scenes::make_plant(options);
    return made ? std::string("made") : made.error().message;
}

const Scene& canonical() {
    static const Scene scene = scenes::make_plant().value();
    return scene;
}

} // namespace

TEST_CASE("a plant out of range is refused by name", "[plant]") {
    for (const int panels : {-1, 0, 121}) {
        CHECK(
            message_of({.panels = panels}) ==
            "plant: panels is " + std::to_string(panels) + ", expected 1 to 120"
        );
        CHECK_FALSE(scenes::plant_path({.panels = panels}));
    }
}

TEST_CASE("the canonical plant is the scene it has to be", "[plant]") {
    const Scene& scene = canonical();
    REQUIRE(farfield::validate(scene));
    const auto count = static_cast<double>(farfield::primitive_count(scene));
    INFO(count);
    CHECK(std::abs(count - 2e6) <= 0.02 * 2e6);
    CHECK(scene.meshes[0].name == "ground");
    // Whole items are small; what is larger may be cut.
    for (const Mesh& mesh : scene.meshes) {
        INFO(mesh.name);
        CHECK((mesh.splittable || farfield::primitive_count(mesh) <= 6000));
    }
}

TEST_CASE("no triangle of the plant is without an area", "[plant]") {
    for (const Mesh& mesh : canonical().meshes) {
        int bad = 0;
        for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
            const dvec3 a(mesh.positions[mesh.indices[i]]);
            const dvec3 b(mesh.positions[mesh.indices[i + 1]]);
            const dvec3 c(mesh.positions[mesh.indices[i + 2]]);
            // The least is that of keys and needles, some millimetres by as many.
            bad += glm::length(glm::cross(b - a, c - a)) > 1e-6 ? 0 : 1;
        }
        INFO(mesh.name);
        CHECK(bad == 0);
    }
}

TEST_CASE("panels of bundles are as many as asked for", "[plant]") {
    const auto one = farfield::primitive_count(scenes::make_plant({.panels = 1}).value());
    const auto three = farfield::primitive_count(scenes::make_plant({.panels = 3}).value());
    const auto panel = static_cast<std::uint64_t>(plant::tube_panel().count());
    CHECK(three - one == panel * 5 * 2);
}

TEST_CASE("the plant is crowded in places and empty in others", "[plant]") {
    // Cells of 5 m. Evenly filled, a hundredth of them would hold a hundredth of the triangles, and
    // if all stood evenly on the ground, below 20 m, a twentieth. Five bundles of tubes are in a
    // dozen cells and hold a third of the plant.
    const farfield::Box3d box = farfield::scene_bounds(canonical());
    const glm::ivec3 cells = glm::max(glm::ivec3((box.hi - box.lo) / 5.0), 1);
    std::vector<int> counts = farfield::test::triangles_by_cell(canonical(), cells);
    std::sort(counts.begin(), counts.end(), std::greater<>());
    const auto share_of = [&](std::size_t first) {
        const auto end = counts.begin() + static_cast<std::ptrdiff_t>(first);
        return std::accumulate(counts.begin(), end, 0.0) /
               static_cast<double>(farfield::primitive_count(canonical()));
    };
    const double densest = share_of(counts.size() / 100);
    const auto empty = std::count(counts.begin(), counts.end(), 0);
    INFO("densest hundredth " << densest << ", empty cells " << empty << " of " << counts.size());
    CHECK(densest > 0.6);
    CHECK(empty > static_cast<std::ptrdiff_t>(counts.size() / 2));
}

TEST_CASE("the same options build the same plant, another seed another one", "[plant]") {
    const Scene first = scenes::make_plant({.panels = 1}).value();
    const Scene second = scenes::make_plant({.panels = 1}).value();
    const Scene other = scenes::make_plant({.panels = 1, .seed = 7}).value();
    CHECK(farfield::digest(first) == farfield::digest(second));
    CHECK(farfield::digest(first) != farfield::digest(other));
}

TEST_CASE("the walk through the plant is even and level, up and down again", "[plant]") {
    const auto path = scenes::plant_path();
    REQUIRE(path);
    REQUIRE(farfield::eval::validate(*path));
    CHECK(path->frame_count == 400);
    farfield::test::check_level(*path);
    const std::vector<dvec3> eyes = farfield::test::eyes_of(*path);
    CHECK(eyes.front().y == Approx(1.7));
    CHECK(eyes.back().y == Approx(1.7));
    const auto highest =
        std::max_element(eyes.begin(), eyes.end(), [](const auto& a, const auto& b) {
            return a.y < b.y;
        });
    CHECK(highest->y == Approx(plant::kStorey + 1.7));
    // The spline cuts corners by a little, and is as fast as its keys elsewhere.
    const auto [least, most] = farfield::test::paces(*path);
    CHECK(most < 0.8);
    CHECK(least > 0.7 * most);
}

TEST_CASE("the eye touches nothing in the plant", "[plant]") {
    const auto path = scenes::plant_path();
    REQUIRE(path);
    const double clear =
        farfield::test::clearance(canonical(), farfield::test::eyes_of(*path), 1.0);
    INFO(clear);
    CHECK(clear >= 0.3);
}
