#include "scenes/scene_catalog.hpp"

#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>

#include <limits>
#include <map>
#include <set>
#include <string>

namespace {

namespace scenes = farfield::scenes;

std::string message_of(std::string_view name, const scenes::SceneValues& values) {
    const auto scene = scenes::make_scene(name, values);
    return scene ? std::string("made") : scene.error().message;
}

/// Hardly anything of each scene.
const std::map<std::string_view, scenes::SceneValues> kSmall = {
    {"island",
     {{"trees", 3.0}, {"radius", 60.0}, {"terrain-quads", 8.0}, {"tree-triangles", 2000.0}}},
    {"flat", {{"blocks", 1.0}}},
    {"forest", {{"trees", 2.0}, {"tree-triangles", 200.0}}},
    {"forest-zoom", {{"trees", 2.0}, {"tree-triangles", 200.0}}},
    {"tree", {{"triangles", 5000.0}}},
    {"molecule", {{"atoms", 50.0}}},
    {"grass", {{"triangles", 1250.0}}},
    {"knot", {{"along", 24.0}, {"around", 3.0}}},
    {"terrain", {{"posts", 9.0}}},
    {"trees", {{"count", 4.0}, {"triangles", 5000.0}}},
    {"pipes", {{"triangles", 20000.0}}},
    {"plant", {{"panels", 1.0}}}};

} // namespace

TEST_CASE("what the catalog does not have is refused by name", "[scene_catalog]") {
    const std::string atlantis = message_of("atlantis", {});
    CHECK(atlantis.find("scene \"atlantis\" does not exist, expected one of island, flat, ") == 0);
    for (const scenes::CatalogEntry& entry : scenes::scene_catalog()) {
        CHECK(atlantis.find(entry.name) != std::string::npos);
    }
    CHECK(message_of("", {}) != "made");
    CHECK(
        message_of(
            "island", {{"forest", 3.0}}
        ).find("island: forest is no parameter, expected one of trees, ") == 0
    );
    CHECK(
        message_of("island", {{"trees", 2.5}}) ==
        "island: trees is 2.500000, expected a whole number"
    );
    CHECK(
        message_of("island", {{"radius", std::numeric_limits<double>::quiet_NaN()}}) ==
        "island: radius is nan, expected a finite number"
    );
    // Beyond every int: the scene's own check still sees it.
    CHECK(message_of("island", {{"trees", 1e18}}).find("island: trees is 2147483647") == 0);
    CHECK(message_of("island", {{"trees", -1e18}}).find("island: trees is -2147483648") == 0);
    CHECK(
        message_of("island", {{"quarter-turns", 0.5}}) ==
        "island: quarter-turns is 0.500000, expected a whole number"
    );
    CHECK(
        message_of("island", {{"quarter-turns", -1.0}}) ==
        "island: quarter-turns is -1.000000, expected 0 or 1"
    );
    CHECK(message_of("trees", {{"ground", 2.0}}) == "trees: ground is 2.000000, expected 0 or 1");
    CHECK(message_of("island", {{"tree-triangles", 7.0}}).find("willow: triangles is 7") == 0);
}

TEST_CASE("every scene can be listed", "[scene_catalog]") {
    std::set<std::string_view> names;
    for (const scenes::CatalogEntry& entry : scenes::scene_catalog()) {
        CHECK(names.insert(entry.name).second);
        CHECK_FALSE(entry.help.empty());
        REQUIRE(entry.make != nullptr);
        std::set<std::string_view> parameters;
        for (const scenes::SceneParameter& parameter : entry.parameters) {
            INFO(entry.name << " " << parameter.name);
            CHECK(parameters.insert(parameter.name).second);
            CHECK_FALSE(parameter.help.empty());
        }
    }
    CHECK(names.count("island") == 1);
}

TEST_CASE("a scene comes with its parameters, walk and picture", "[scene_catalog]") {
    const auto made = scenes::make_scene("island", kSmall.at("island"));
    REQUIRE(made);
    CHECK(farfield::validate(made->scene));
    CHECK(made->scene.instances.size() == 4);
    CHECK(farfield::primitive_count(made->scene) == 2 * 8 * 8 + 3 * 2000);
    CHECK(made->scene.meshes[0].bounds.hi.x == Approx(60.0).epsilon(1e-6));
    CHECK(farfield::eval::validate(made->path));
    CHECK(made->path.frame_count == 1200);
    CHECK(made->fov_deg == 60.0);
    CHECK(made->width == 640);
    CHECK(made->height == 480);
}

TEST_CASE("every scene comes with a walk that fits it", "[scene_catalog]") {
    for (const scenes::CatalogEntry& entry : scenes::scene_catalog()) {
        INFO(entry.name);
        const auto made = scenes::make_scene(entry.name, kSmall.at(entry.name));
        REQUIRE(made);
        CHECK(farfield::validate(made->scene));
        CHECK(farfield::eval::validate(made->path));
        CHECK(made->fov_deg > 0.0);
        CHECK(made->width >= 1);
        CHECK(made->height >= 1);
    }
}

TEST_CASE("every parameter does something", "[scene_catalog]") {
    const auto differs = [](const farfield::Scene& a, const farfield::Scene& b) {
        if (a.instances.size() != b.instances.size()) {
            return true;
        }
        for (std::size_t i = 0; i < a.instances.size(); ++i) {
            if (a.instances[i].object_to_world != b.instances[i].object_to_world) {
                return true;
            }
        }
        for (std::size_t i = 0; i < a.meshes.size(); ++i) {
            if (a.meshes[i].positions != b.meshes[i].positions) {
                return true;
            }
        }
        return false;
    };
    for (const scenes::CatalogEntry& entry : scenes::scene_catalog()) {
        const scenes::SceneValues& small = kSmall.at(entry.name);
        const auto base = scenes::make_scene(entry.name, small);
        REQUIRE(base);
        for (const scenes::SceneParameter& parameter : entry.parameters) {
            INFO(entry.name << " " << parameter.name);
            scenes::SceneValues values = small;
            const auto given = values.find(parameter.name);
            double value = given != values.end() ? given->second : parameter.default_value;
            if (parameter.name == "min-spacing") {
                value = 70.0; // so far that some first darts no longer stick
            } else if (parameter.name == "min-scale" || parameter.name == "max-scale") {
                value += parameter.name == "min-scale" ? 0.1 : 0.2;
            } else if (entry.name == "grass" && parameter.name == "triangles") {
                value *= 2.0; // a multiple of 1250
            } else if (entry.name == "pipes" && parameter.name == "triangles") {
                value *= 2.0; // more than a piece of a pipe
            } else if (entry.name == "grass" && parameter.name == "ground") {
                value = 0.0;
            } else if (parameter.name == "count") {
                value *= 4.0; // a power of four
            } else {
                value += 1.0;
            }
            values.insert_or_assign(std::string(parameter.name), value);
            const auto changed = scenes::make_scene(entry.name, values);
            REQUIRE(changed);
            CHECK((differs(changed->scene, base->scene) || changed->path != base->path));
        }
    }
}
