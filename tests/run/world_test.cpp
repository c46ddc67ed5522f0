#include "files.hpp"
#include "run/program.hpp"
#include "run/world.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace {

using farfield::run::World;
using farfield::run::WorldOptions;
using farfield::test::TemporaryFile;
namespace run = farfield::run;

/// Loads a small file, so that only what is asked for is tested.
class Loader {
  public:
    Loader() : file_("world.obj", farfield::test::roof_obj()) { options.scene = file_.path(); }

    [[nodiscard]] World world() const {
        auto loaded = run::load_world(options);
        if (!loaded) {
            FAIL(loaded.error().message);
        }
        return std::move(*loaded);
    }
    [[nodiscard]] std::string message() const {
        const auto loaded = run::load_world(options);
        return loaded ? "loaded" : loaded.error().message;
    }

    WorldOptions options;

  private:
    TemporaryFile file_;
};

/// The island with hardly anything on it.
WorldOptions bare_island() {
    WorldOptions options;
    options.scene_values = {{"trees", 3.0}, {"terrain-quads", 8.0}, {"tree-triangles", 2000.0}};
    return options;
}

} // namespace

TEST_CASE("a world of a file has a hierarchy and a walk", "[world]") {
    const World world = Loader().world();
    CHECK(world.triangles == 4);
    CHECK(world.instances == world.scene.instances.size());
    CHECK(world.item_primitives.size() == world.scene.instances.size());
    CHECK(world.item_frames.size() == world.scene.instances.size());
    CHECK(farfield::validate(world.scene));
    CHECK(farfield::validate(world.hierarchy));
    CHECK(world.frames == 1200);
    CHECK(world.radius == Approx(std::sqrt(16.0 + 9.0 + 4.0) / 2.0));
    CHECK(world.collapsed.items.empty());
    CHECK(world.clustered.items.empty());
    for (const int frame : {0, 600, 1199}) {
        CAPTURE(frame);
        CHECK(farfield::validate(world.view(frame)));
    }
}

TEST_CASE("atoms of a file are shown as the molecule of the catalogue is", "[world]") {
    const TemporaryFile file(
        "world.pdb",
        "HETATM    1  C                  10.000   0.000   0.000\n"
        "HETATM    2  O                  12.000   0.000   0.000\n"
    );
    Loader loader;
    loader.options.scene = file.path();
    const World world = loader.world();
    CHECK(world.instances == 2);
    CHECK(world.triangles == 1600);
    CHECK(world.frames == 121);
    CHECK(world.width == 124);
    CHECK(world.height == 124);
    CHECK(farfield::validate(world.view(120)));
    loader.options.scene_values["angle"] = 7.0;
    CHECK_THAT(loader.message(), Catch::EndsWith(": a file has no parameter \"angle\""));
}

TEST_CASE("an eye far off still sees all of the scene", "[world]") {
    Loader loader;
    loader.options.scene = "grass";
    loader.options.scene_values = {{"triangles", 1250.0}, {"distance", 30.0}};
    const World world = loader.world();
    for (const int frame : {0, 120}) {
        const farfield::View view = world.view(frame);
        const double away = glm::distance(view.eye, world.middle);
        CHECK(view.lens.far_distance > away + world.radius);
    }
}

TEST_CASE("a scene that is not there is refused", "[world]") {
    Loader loader;
    loader.options.scene = "/nonexistent/hall.obj";
    CHECK_THAT(loader.message(), Catch::Contains("/nonexistent/hall.obj"));
    // Neither of the catalogue nor a file.
    loader.options.scene = "atlantis";
    CHECK_THAT(loader.message(), Catch::Contains("atlantis"));
    Loader lost;
    lost.options.path = "/nonexistent/walk.json";
    CHECK_THAT(lost.message(), Catch::Contains("/nonexistent/walk.json"));
}

TEST_CASE("parameters belong to scenes of the catalogue", "[world]") {
    Loader loader;
    loader.options.scene_values["trees"] = 7.0;
    CHECK_THAT(loader.message(), Catch::EndsWith(": a file has no parameter \"trees\""));
    loader.options = bare_island();
    const World world = loader.world();
    CHECK(world.scene.name == "island");
    CHECK(world.instances == 4); // three trees and the ground
    loader.options.scene_values["bushes"] = 7.0;
    CHECK_THAT(loader.message(), Catch::Contains("bushes"));
}

TEST_CASE("a world is divided by the partition of that name", "[world]") {
    Loader loader;
    loader.options = bare_island();
    CHECK_FALSE(loader.world().hierarchy.clip_leaves);
    for (const char* name : {"kdtree", "octree"}) {
        CAPTURE(name);
        loader.options.partition = name;
        loader.options.cells.max_primitives = 20;
        loader.options.cells.max_depth = 2;
        loader.options.cells.inflation = 0.25F;
        const World world = loader.world();
        CHECK(farfield::validate(world.hierarchy));
        CHECK(world.hierarchy.clip_leaves);
        CHECK(world.hierarchy.inflation == 0.25F);
        CHECK(world.hierarchy.primitives.size() == 128); // the ground's
        CHECK(world.hierarchy.items.size() == 3);
        CHECK(world.hierarchy.quality.leaves > 1);
        CHECK(world.hierarchy.quality.depth <= 6);
    }
    loader.options.partition = "kdtree";
    loader.options.cells.branching = 2;
    loader.options.cells.max_primitives = 1;
    loader.options.cells.max_depth = 1;
    CHECK(loader.world().hierarchy.quality.leaves == 2);
    loader.options.cells.branching = 5;
    CHECK_THAT(loader.message(), Catch::Contains("branching is 5"));
}

TEST_CASE("options of another partition are refused", "[world]") {
    const auto status = [](std::vector<const char*> arguments) {
        WorldOptions options;
        CLI::App app("", "test");
        farfield::run::add_partition_options(app, options);
        arguments.insert(arguments.begin(), "test");
        std::ostringstream out;
        std::ostringstream err;
        try {
            app.parse(static_cast<int>(arguments.size()), arguments.data());
        } catch (const CLI::ParseError& error) {
            app.exit(error, out, err);
        }
        return err.str();
    };
    CHECK(status({}).empty());
    CHECK(status({"--directions", "3", "--split-vertically", "--max-items", "2"}).empty());
    CHECK(status({"--max-piece-primitives", "9", "--inflation", "0.5"}).empty());
    CHECK(status({"--partition", "kdtree", "--branching", "4", "--max-depth", "3"}).empty());
    CHECK(status({"--partition", "octree", "--max-primitives", "4"}).empty());
    CHECK_THAT(
        status({"--branching", "4"}), Catch::Contains("--branching: no option of the partition bsp")
    );
    CHECK_THAT(
        status({"--partition", "octree", "--branching", "4"}),
        Catch::Contains("--branching: no option of the partition octree")
    );
    for (const char* name : {"--directions", "--max-items", "--max-piece-primitives"}) {
        CHECK_THAT(
            status({"--partition", "kdtree", name, "3"}),
            Catch::Contains(std::string(name) + ": no option of the partition kdtree")
        );
    }
    CHECK_FALSE(status({"--partition", "quadtree"}).empty());
    Loader loader;
    loader.options.partition = "quadtree";
    CHECK_THAT(loader.message(), Catch::Contains("quadtree"));
}

TEST_CASE("the size of the picture is two whole numbers", "[world]") {
    Loader loader;
    loader.options.size = "320x200";
    const World world = loader.world();
    CHECK(world.width == 320);
    CHECK(world.height == 200);
    CHECK(world.view(0).width == 320);
    for (const char* size : {"640", "x", "640x", "x480", "640x480x", "640 x480", "a", "6.4x4"}) {
        CAPTURE(size);
        loader.options.size = size;
        CHECK(
            loader.message() ==
            "--size is '" + std::string(size) + "', expected WIDTHxHEIGHT, as 640x480"
        );
    }
    for (const char* size : {"0x480", "640x0", "-640x480"}) {
        CAPTURE(size);
        loader.options.size = size;
        CHECK(
            loader.message() ==
            "--size is '" + std::string(size) + "', expected at least 1x1 pixels"
        );
    }
    loader.options.size = "16385x1"; // wider than a view may be
    CHECK_THAT(loader.message(), Catch::Contains("16385"));
}

TEST_CASE("the field of view is an angle that a picture can have", "[world]") {
    Loader loader;
    loader.options.fov_deg = 30.0;
    CHECK(loader.world().fov_deg == 30.0);
    for (const double fov_deg :
         {0.0, -1.0, 180.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
        CAPTURE(fov_deg);
        loader.options.fov_deg = fov_deg;
        CHECK_THAT(loader.message(), Catch::StartsWith("--fov-deg is "));
    }
}

TEST_CASE("a walk is as long as its path, or shorter", "[world]") {
    Loader loader;
    loader.options = bare_island();
    const World whole = loader.world();
    loader.options.frames = 5;
    const World few = loader.world();
    CHECK(few.frames == 5);
    CHECK(few.view(4) == whole.view(4)); // a shorter way, never a faster one
    loader.options.frames = whole.frames + 1;
    CHECK(
        loader.message() == "--frames is " + std::to_string(whole.frames + 1) + ", the path has " +
                                std::to_string(whole.frames) +
                                " (--whole-path walks all of it in any number of frames)"
    );
    loader.options.frames.reset();
    loader.options.whole_path = 3;
    const World fast = loader.world();
    CHECK(fast.frames == 3);
    CHECK(fast.view(0) == whole.view(0));
    CHECK(fast.view(2) == whole.view(whole.frames - 1));
    loader.options.whole_path = 1;
    CHECK(loader.world().view(0) == whole.view(0));
}

TEST_CASE("the path of a file goes round what is up in it", "[world]") {
    Loader loader;
    for (const auto& [up, axis] :
         {std::pair{"", glm::dvec3(0, 1, 0)},
          std::pair{"y", glm::dvec3(0, 1, 0)},
          std::pair{"z", glm::dvec3(0, 0, 1)}}) {
        CAPTURE(up);
        loader.options.up = up;
        const World world = loader.world();
        CHECK(world.scene.up == axis);
        // It stays at one height; the eyes are about 2.7 m off, so rounding is far below a
        // nanometre.
        const double first = glm::dot(world.view(0).eye, axis);
        const double later = glm::dot(world.view(300).eye, axis);
        CHECK(later == Approx(first).epsilon(0.0).margin(1e-9));
        CHECK(glm::distance(world.view(0).eye, world.view(300).eye) > 0.5);
    }
}

TEST_CASE("a path of its own replaces that of the scene", "[world]") {
    const TemporaryFile path(
        "world_path.json",
        R"({"frame_count": 2, "keys": [{"frame": 0, "eye": [9, 8, 7], "target": [0, 0, 0],
            "up": [0, 1, 0]}]})"
    );
    Loader loader;
    loader.options.path = path.path();
    const World world = loader.world();
    CHECK(world.frames == 2);
    CHECK(world.view(1).eye == glm::dvec3(9.0, 8.0, 7.0));
}

TEST_CASE("levels of detail come after the items of the hierarchy", "[world]") {
    WorldOptions options = bare_island();
    const auto plain = run::load_world(options);
    options.levels = true;
    const auto world = run::load_world(options);
    REQUIRE(plain);
    REQUIRE(world);
    CHECK(world->instances == plain->instances);
    CHECK(world->triangles == plain->triangles);
    CHECK(world->scene_bytes == plain->scene_bytes);
    CHECK(world->scene.instances.size() > plain->scene.instances.size());
    CHECK(world->item_primitives.size() == world->scene.instances.size());
    CHECK(world->item_frames.size() == world->scene.instances.size());
    CHECK(world->hierarchy.nodes.size() == plain->hierarchy.nodes.size());
    for (const farfield::LodTable* table : {&world->collapsed, &world->clustered}) {
        CHECK(farfield::validate(*table));
        CHECK(table->items.size() == world->instances);
        CHECK_FALSE(table->levels.empty());
        for (const farfield::ItemLevel& level : table->levels) {
            CHECK(index_of(level.item) >= world->instances);
            CHECK(index_of(level.item) < world->scene.instances.size());
        }
    }
}
