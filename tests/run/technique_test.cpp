#include "files.hpp"
#include "run/backends.hpp"
#include "run/program.hpp"
#include "run/technique.hpp"
#include "run/world.hpp"
#include <farfield/eval/cost_model_file.hpp>
#include <farfield/gpu/null/null_backend.hpp>

#include <CLI/CLI.hpp>
#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <utility>

namespace {

using farfield::CostModel;
using farfield::FramePlan;
using farfield::Motion;
using farfield::NullBackend;
using farfield::Planner;
using farfield::RunReport;
using farfield::run::Backends;
using farfield::run::RunOptions;
using farfield::run::Technique;
using farfield::run::World;
using farfield::test::TemporaryFile;
namespace run = farfield::run;

/// A small scene from a file, with levels of detail.
const World& world() {
    static const World kWorld = [] {
        const TemporaryFile file("technique.obj", farfield::test::roof_obj());
        run::WorldOptions options;
        options.scene = file.path();
        options.levels = true;
        auto loaded = run::load_world(options);
        REQUIRE(loaded);
        return std::move(*loaded);
    }();
    return kWorld;
}

NullBackend make_backend() {
    return NullBackend(world().item_primitives, &world().hierarchy);
}

RunOptions options_of(const std::string& technique) {
    RunOptions options;
    options.technique = technique;
    return options;
}

std::string message_of(const farfield::Result<void>& result) {
    return result ? "accepted" : result.error().message;
}

} // namespace

TEST_CASE("names of what does not exist are refused with what does", "[technique]") {
    CHECK(run::validate(RunOptions{}));
    RunOptions options;
    SECTION("technique") {
        options.technique = "imagecache";
        CHECK(
            message_of(run::validate(options)) ==
            "technique \"imagecache\" does not exist, expected one of geometry, mesh-lod, "
            "image-cache, color-cubes, lod-sprite, placement"
        );
    }
    SECTION("preset") {
        options.preset = "shade";
        CHECK(
            message_of(run::validate(options)) ==
            "preset \"shade\" does not exist, expected one of shade1996, schaufler1996, "
            "chen1999, guaranteed-sprite"
        );
    }
    SECTION("levels") {
        options.levels = "";
        CHECK(
            message_of(run::validate(options)) ==
            "levels \"\" does not exist, expected one of collapse, cluster"
        );
    }
    SECTION("backend") {
        options.backend = "vulkan";
        CHECK(
            message_of(run::validate(options)) ==
            "backend \"vulkan\" does not exist, expected one of opengl, embree, null"
        );
    }
    // What is not valid is not made either.
    NullBackend backend = make_backend();
    const auto made = Technique::create(world(), options, backend);
    REQUIRE_FALSE(made);
    CHECK(made.error().message == run::validate(options).error().message);
}

TEST_CASE("each technique plans, and promises what it can", "[technique]") {
    NullBackend backend = make_backend();
    const auto target = backend.create_target(world().width, world().height, 1);
    REQUIRE(target);
    for (const char* name : {"geometry", "mesh-lod", "image-cache", "color-cubes"}) {
        CAPTURE(name);
        RunOptions options = options_of(name);
        options.cache.error_px = 3.0;
        auto made = Technique::create(world(), options, backend);
        REQUIRE(made);
        const Planner planner = made->planner();
        // What it hands out stays where it is when the technique moves.
        const Technique technique = std::move(*made);
        const FramePlan& plan = planner.plan(world().view(0), Motion{});
        CHECK(backend.execute(plan, *target, {}));
        CHECK_FALSE(plan.items.empty());
        const bool images = options.technique == "image-cache";
        const bool cubes = options.technique == "color-cubes";
        CHECK((technique.cache() != nullptr) == images);
        CHECK((technique.cubes() != nullptr) == cubes);
        CHECK((technique.cube_model() != nullptr) == cubes);
        CHECK(static_cast<bool>(planner.statistics) == images);
        RunReport report;
        technique.add_to_report(report);
        CHECK(report.technique == name);
        CHECK(report.backend == "opengl");
        CHECK(report.cost_model.has_value() == (images || cubes));
        CHECK(report.error_px.has_value() == (images || options.technique == "mesh-lod"));
        if (cubes) {
            CHECK(*report.memory.hierarchy_bytes == memory_bytes(technique.cube_model()->model));
        }
        CHECK(report.memory.image_budget_bytes.has_value() == images);
        // Levels of detail are kept to the threshold too, but show no images that could be held to
        // it.
        CHECK(technique.promise_px() == (images ? std::optional(3.0) : std::nullopt));
        if (images) {
            CHECK(*report.memory.image_budget_bytes == options.budget_mib << 20U);
        }
    }
}

TEST_CASE("pairs are made for the technique that shows them, and for no other", "[technique]") {
    run::WorldOptions small;
    small.scene = "terrain";
    small.scene_values["posts"] = 65;
    auto loaded = run::load_world(small);
    REQUIRE(loaded);
    World& terrain = *loaded;
    const std::size_t items = terrain.item_primitives.size();
    REQUIRE(run::prepare(terrain, options_of("image-cache")));
    CHECK(terrain.pairs.empty());
    CHECK(terrain.item_primitives.size() == items);

    RunOptions options = options_of("lod-sprite");
    options.proxy.proxy = "grid";
    options.proxy.coarse = 4;
    REQUIRE(run::prepare(terrain, options));
    REQUIRE(terrain.pairs.size() == 1);
    CHECK(terrain.item_primitives.size() == items + 1);
    CHECK(terrain.item_primitives.back() == 32);
    REQUIRE(run::prepare(terrain, options)); // they are there
    CHECK(terrain.item_primitives.size() == items + 1);

    NullBackend backend(terrain.item_primitives, &terrain.hierarchy);
    const auto target = backend.create_target(terrain.width, terrain.height, 1);
    REQUIRE(target);
    for (const char* preset : {"shade1996", "chen1999", "guaranteed-sprite"}) {
        CAPTURE(preset);
        options.preset = preset;
        options.cache.error_px = 3.0;
        options.criterion = farfield::SpriteCriterion::rms;
        options.sprite.never_slower = false;
        auto made = Technique::create(terrain, options, backend);
        REQUIRE(made);
        const Planner planner = made->planner();
        const Technique technique = std::move(*made);
        REQUIRE(technique.sprite() != nullptr);
        CHECK(backend.execute(planner.plan(terrain.view(0), Motion{}), *target, {}));
        REQUIRE(planner.keyframes);
        CHECK(planner.keyframes().keyframes_made == 1);
        CHECK_FALSE(static_cast<bool>(planner.statistics));
        const bool guaranteed = options.preset == "guaranteed-sprite";
        CHECK(technique.promise_px() == (guaranteed ? std::optional(3.0) : std::nullopt));
        RunReport report;
        technique.add_to_report(report);
        CHECK(report.technique == "lod-sprite");
        CHECK(report.preset == (options.preset == "shade1996" ? "" : preset));
        CHECK(report.error_px == 3.0);
        CHECK(*report.memory.image_budget_bytes == options.budget_mib << 20U);
    }
    options.technique = "image-cache";
    options.preset = "chen1999";
    CHECK(
        message_of(run::validate(options)) ==
        "preset \"chen1999\" is one of lod-sprite, not of image-cache"
    );
}

TEST_CASE("what techniques themselves refuse comes through", "[technique]") {
    NullBackend backend = make_backend();
    for (const char* name : {"mesh-lod", "image-cache"}) {
        CAPTURE(name);
        RunOptions options = options_of(name);
        options.cache.error_px = -1.0;
        const auto made = Technique::create(world(), options, backend);
        REQUIRE_FALSE(made);
        CHECK_THAT(made.error().message, Catch::Contains("error_px is -1"));
    }
}

TEST_CASE("what colour cubes refuse comes through", "[technique]") {
    NullBackend backend = make_backend();
    RunOptions options = options_of("color-cubes");
    const auto message = [&] {
        const auto made = Technique::create(world(), options, backend);
        return made ? "made" : made.error().message;
    };
    CHECK(message() == "made");
    options.cubes.cell_px = -1.0;
    CHECK_THAT(message(), Catch::Contains("cell_px is -1"));
    options.cubes.cell_px = 1.0;
    options.cube_model.build.rays = 0;
    CHECK_THAT(message(), Catch::Contains("rays is 0"));
}

TEST_CASE("a cost model is the backend's stored one, a file's, or measured", "[technique]") {
    NullBackend backend = make_backend();
    const auto costs_of = [&](const RunOptions& options) {
        auto technique = Technique::create(world(), options, backend);
        REQUIRE(technique);
        RunReport report;
        technique->add_to_report(report);
        REQUIRE(report.cost_model);
        return *report.cost_model;
    };
    RunOptions options = options_of("image-cache");
    CHECK(costs_of(options) == CostModel{});
    options.backend = "embree";
    CHECK(costs_of(options) == farfield::ray_casting_costs());
    CostModel costs;
    costs.triangle_s = 1.25e-7;
    const TemporaryFile file("costs.json", farfield::eval::to_json(costs));
    options.cost_model = file.path();
    CHECK(costs_of(options) == costs);
    options.cost_model = "/nonexistent/costs.json";
    const auto missing = Technique::create(world(), options, backend);
    REQUIRE_FALSE(missing);
    CHECK_THAT(missing.error().message, Catch::Contains("/nonexistent/costs.json"));
}

TEST_CASE("backends are made by name", "[backends]") {
    Backends backends(world());
    const auto none = backends.make("vulkan");
    REQUIRE_FALSE(none);
    CHECK(
        none.error().message == "backend \"vulkan\" does not exist, expected opengl, embree or null"
    );
    for (const char* name : {"null", "embree"}) {
        CAPTURE(name);
        const auto plain = backends.make(name);
        const auto positions = backends.make(name, true);
        REQUIRE(plain);
        REQUIRE(positions);
        CHECK(*plain != *positions);
        CHECK_FALSE((*plain)->limits().positions);
        CHECK((*positions)->limits().positions);
    }
}

TEST_CASE("colour cubes are kept in a file and read again", "[technique]") {
    const TemporaryFile file("cubes.ffc", "");
    std::filesystem::remove(file.path());
    NullBackend backend = make_backend();
    RunOptions options = options_of("color-cubes");
    const auto parse = [&](const std::string& arguments) {
        CLI::App app;
        run::add_cube_options(app, options);
        app.parse(arguments);
    };
    parse("--cubes " + file.path());
    const auto message = [&](const World& of) {
        const auto made = Technique::create(of, options, backend);
        return made ? "made" : made.error().message;
    };

    const auto built = Technique::create(world(), options, backend);
    REQUIRE(built);
    CHECK(built->cube_model()->build_s > 0.0);
    CHECK(built->cube_model()->read_s == 0.0);
    REQUIRE(std::filesystem::exists(file.path()));
    const auto read = Technique::create(world(), options, backend);
    REQUIRE(read);
    CHECK(read->cube_model()->build_s == 0.0);
    CHECK(read->cube_model()->read_s > 0.0);
    CHECK(read->cube_model()->model == built->cube_model()->model);

    SECTION("of other options") {
        parse("--cube-rays 2");
        CHECK_THAT(message(world()), Catch::Contains(file.path() + " is of another scene"));
        parse("--cube-rays 4");
        CHECK(message(world()) == "made");
        parse("--cube-colors composed");
        CHECK_THAT(message(world()), Catch::Contains(file.path() + " is of another scene"));
    }
    SECTION("shown otherwise, which is no matter") {
        parse("--cell-px 3 --cube-drawing faces --always-cubes");
        CHECK(message(world()) == "made");
    }
    SECTION("of another scene") {
        const TemporaryFile scene("cubes.obj", "v 0 0 0\nv 4 0 0\nv 4 3 1\nf 1 2 3\n");
        run::WorldOptions of;
        of.scene = scene.path();
        const auto other = run::load_world(of);
        REQUIRE(other);
        CHECK_THAT(message(*other), Catch::Contains(file.path() + " is of another scene"));
    }
    SECTION("damaged") {
        const auto size = std::filesystem::file_size(file.path());
        std::fstream bytes(file.path(), std::ios::binary | std::ios::in | std::ios::out);
        bytes.seekg(static_cast<std::streamoff>(size / 2));
        const int byte = bytes.get();
        bytes.seekp(static_cast<std::streamoff>(size / 2));
        bytes.put(static_cast<char>(byte ^ 1));
        bytes.close();
        CHECK_THAT(
            message(world()), Catch::Contains(file.path()) && !Catch::Contains("another scene")
        );
        std::filesystem::resize_file(file.path(), size / 2);
        CHECK_THAT(
            message(world()), Catch::Contains(file.path()) && !Catch::Contains("another scene")
        );
        std::filesystem::resize_file(file.path(), 0);
        CHECK_THAT(message(world()), Catch::Contains(file.path()));
    }
    SECTION("where none can be written") {
        options.cube_model.file = "/nonexistent/cubes.ffc";
        CHECK_THAT(message(world()), Catch::Contains("/nonexistent/cubes.ffc"));
    }
}

TEST_CASE("a report begins with what is known of the world", "[technique]") {
    const RunReport report = run::report_of(world());
    CHECK(*report.scene.triangles == 4);
    CHECK(*report.scene.instances == world().instances);
    CHECK(*report.scene.nodes == world().hierarchy.nodes.size());
    CHECK(report.width == world().width);
    CHECK(report.height == world().height);
    CHECK(report.fov_deg == world().fov_deg);
    CHECK(*report.memory.scene_bytes == world().scene_bytes);
    CHECK_FALSE(report.frame_ms.total.has_value());
}
