#include "files.hpp"
#include "run/evaluation.hpp"
#include "support/random.hpp"

#include <catch2/catch.hpp>

#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace {

using farfield::SurfacePlacement;
using farfield::run::ComparedRun;
using farfield::run::ComparedWalk;
using farfield::run::EvaluationPlan;
namespace run = farfield::run;

farfield::Result<EvaluationPlan> parse(std::string_view text) {
    return run::parse_evaluation(text, "plan.json");
}

std::string message_of(std::string_view text) {
    const auto plan = parse(text);
    return plan ? "accepted" : plan.error().message;
}

/// A plan of one walk of one run, each with some more keys.
std::string plan_with(const std::string& walk, const std::string& run) {
    return R"({"walks": [{"name": "w")" + walk + R"(, "runs": [{"name": "r")" + run + "}]}]}";
}

} // namespace

TEST_CASE("what a plan leaves open has its default", "[evaluation]") {
    const auto plan = parse(plan_with("", ""));
    REQUIRE(plan);
    CHECK(plan->title.empty());
    REQUIRE(plan->walks.size() == 1);
    const ComparedWalk& walk = plan->walks[0];
    CHECK(walk.name == "w");
    CHECK(walk.world.scene == run::WorldOptions{}.scene);
    CHECK(walk.world.scene_values.empty());
    CHECK_FALSE(walk.world.frames.has_value());
    CHECK_FALSE(walk.world.whole_path.has_value());
    CHECK_FALSE(walk.world.step_m.has_value());
    CHECK_FALSE(walk.world.fov_deg.has_value());
    CHECK(walk.world.partition == "bsp");
    CHECK_FALSE(walk.world.max_items.has_value());
    CHECK_FALSE(walk.world.levels);
    CHECK(walk.reference_every == ComparedWalk{}.reference_every);
    CHECK(walk.truth_samples == ComparedWalk{}.truth_samples);
    REQUIRE(walk.runs.size() == 1);
    const run::RunOptions defaults;
    CHECK(walk.runs[0].name == "r");
    CHECK_FALSE(walk.runs[0].measure);
    CHECK(walk.runs[0].options.technique == defaults.technique);
    CHECK(walk.runs[0].options.backend == defaults.backend);
    CHECK(walk.runs[0].options.cache.error_px == defaults.cache.error_px);
    CHECK(walk.runs[0].options.budget_mib == defaults.budget_mib);
    CHECK(walk.runs[0].options.samples == 1);
}

TEST_CASE("every key of a plan arrives", "[evaluation]") {
    const auto plan = parse(R"({"title": "All", "walks": [
        {"name": "w", "scene": "hall.obj", "path": "hall.json", "up": "z", "size": "320x200",
         "fov_deg": 47.5, "step_m": 0.25, "frames": 12, "whole_path": 7, "max_items": 3,
         "reference_every": 4, "truth_samples": 0, "parameters": {"trees": 5, "seed": 1.0},
         "runs": [
          {"name": "a", "technique": "image-cache", "preset": "shade1996", "backend": "embree",
           "cost_model": "costs.json", "surfaces": "first", "validity": "bound",
           "orientation": "facing-eye", "policy": "whenever-possible", "quad_depth": "texel",
           "all_around": true, "error_px": 0.5, "samples": 16,
           "image_samples": 4, "image_budget_mib": 128, "measure": true},
          {"name": "b", "technique": "mesh-lod", "levels": "cluster", "backend": "opengl",
           "surfaces": "in-images"},
          {"name": "c", "technique": "lod-sprite", "preset": "chen1999", "proxy": "grid",
           "coarse": 32, "coarse_triangles": 900, "criterion": "largest", "paper_theta": true,
           "guaranteed": true, "own_share": 0.25, "max_texel_px": 3, "keyframes": 5,
           "keyframes_shown": 3, "keyframe_margin": 1.5, "predict_frames": 24,
           "keyframe_tiles": 6, "refine": true, "refine_share": 0.5, "never_slower": false},
          {"name": "d", "technique": "color-cubes", "cell_px": 2, "cube_drawing": "faces",
           "cube_sheets": "opaque", "cube_colors": "composed", "cube_cost": 4,
           "never_slower": false},
          {"name": "e", "technique": "placement", "budget": 5000, "grid": 3, "max_level": 2,
           "cell_depth": 9, "clearance": 0.5, "texels": 0.75, "construction_views": 1}]},
        {"name": "v", "partition": "kdtree", "branching": 4, "max_primitives": 500,
         "max_depth": 5, "runs": [{"name": "a", "technique": "geometry"}]}]})");
    REQUIRE(plan);
    CHECK(plan->title == "All");
    REQUIRE(plan->walks.size() == 2);
    const run::WorldOptions& world = plan->walks[0].world;
    CHECK(world.scene == "hall.obj");
    CHECK(world.path == "hall.json");
    CHECK(world.up == "z");
    CHECK(world.size == "320x200");
    CHECK(world.fov_deg == 47.5);
    CHECK(world.step_m == 0.25);
    CHECK(world.frames == 12);
    CHECK(world.whole_path == 7);
    CHECK(world.max_items == 3U);
    CHECK(plan->walks[1].world.partition == "kdtree");
    CHECK(plan->walks[1].world.cells.branching == 4U);
    CHECK(plan->walks[1].world.cells.max_primitives == 500U);
    CHECK(plan->walks[1].world.cells.max_depth == 5U);
    CHECK(world.scene_values.size() == 2);
    CHECK(world.scene_values.at("trees") == 5.0);
    CHECK(plan->walks[0].reference_every == 4);
    CHECK(plan->walks[0].truth_samples == 0);
    REQUIRE(plan->walks[0].runs.size() == 5);
    const ComparedRun& a = plan->walks[0].runs[0];
    CHECK(a.measure);
    CHECK(a.options.technique == "image-cache");
    CHECK(a.options.preset == "shade1996");
    CHECK(a.options.backend == "embree");
    CHECK(a.options.cost_model == "costs.json");
    CHECK(a.options.cache.surfaces == SurfacePlacement::first);
    CHECK(a.options.validity == farfield::ImageValidity::bound);
    CHECK(a.options.orientation == farfield::ImageOrientation::facing_eye);
    CHECK(a.options.policy == farfield::ImagePolicy::whenever_possible);
    CHECK(a.options.cache.quad_depth == farfield::QuadDepth::texel);
    CHECK(a.options.cache.all_around);
    CHECK(a.options.cache.error_px == 0.5);
    CHECK(a.options.samples == 16);
    CHECK(a.options.cache.image_samples == 4);
    CHECK(a.options.budget_mib == 128);
    const ComparedRun& b = plan->walks[0].runs[1];
    CHECK_FALSE(b.measure);
    CHECK(b.options.technique == "mesh-lod");
    CHECK(b.options.levels == "cluster");
    CHECK(b.options.backend == "opengl");
    CHECK(b.options.cache.surfaces == SurfacePlacement::in_images);
    const run::RunOptions& c = plan->walks[0].runs[2].options;
    CHECK(c.preset == "chen1999");
    CHECK(c.proxy.proxy == "grid");
    CHECK(c.proxy.coarse == 32);
    CHECK(c.proxy.coarse_triangles == 900U);
    CHECK(c.criterion == farfield::SpriteCriterion::largest);
    CHECK(c.sprite.paper_theta);
    CHECK(c.sprite.guaranteed);
    CHECK(c.sprite.max_own_share == 0.25);
    CHECK(c.sprite.max_texel_px == 3.0);
    CHECK(c.sprite.max_keyframes == 5);
    CHECK(c.sprite.keyframes_shown == 3);
    CHECK(c.sprite.keyframe_margin == 1.5);
    CHECK(c.sprite.predict_frames == 24);
    CHECK(c.sprite.keyframe_tiles == 6);
    CHECK(c.sprite.refine);
    CHECK(c.sprite.refine_share == 0.5);
    CHECK_FALSE(c.sprite.never_slower);
    const run::RunOptions& d = plan->walks[0].runs[3].options;
    CHECK(d.cubes.cell_px == 2.0);
    CHECK(d.cubes.drawing == farfield::CubeDrawing::faces);
    CHECK(d.cubes.sheets == farfield::CubeSheets::opaque);
    CHECK(d.cube_model.build.colors == farfield::CubeColors::composed);
    CHECK(d.cube_model.build.cube_cost == 4.0);
    CHECK_FALSE(d.cubes.never_slower);
    const run::PlacementSetup& e = plan->walks[0].runs[4].options.placement;
    CHECK(e.placement.max_primitives == 5000);
    CHECK(e.placement.first_grid == 3);
    CHECK(e.placement.max_level == 2);
    CHECK(e.placement.cell_depth == 9);
    CHECK(e.placement.clearance == 0.5);
    CHECK(e.placement.texels_per_pixel == 0.75);
    CHECK(e.making.views == 1);
    // Levels are made for walks in which something draws them.
    CHECK(plan->walks[0].world.levels);
    CHECK_FALSE(plan->walks[1].world.levels);
}

TEST_CASE("built-in evaluations are plans", "[evaluation]") {
    for (const bool quick : {false, true}) {
        CAPTURE(quick);
        const auto plan = run::parse_evaluation(run::built_in_evaluation(quick), "built in");
        if (!plan) {
            FAIL(plan.error().message);
        }
        CHECK_FALSE(plan->title.empty());
        std::set<std::string> techniques;
        bool measured = false;
        for (const ComparedWalk& walk : plan->walks) {
            CHECK(walk.world.scene == "island");
            CHECK(walk.world.frames.has_value());
            for (const ComparedRun& one : walk.runs) {
                techniques.insert(one.options.technique);
                measured = measured || one.measure;
                // Levels of detail and plain geometry show no images to measure.
                CHECK((!one.measure || one.options.technique == "image-cache"));
            }
        }
        CHECK(techniques == std::set<std::string>{"geometry", "image-cache", "mesh-lod"});
        CHECK(measured);
    }
    CHECK(run::built_in_evaluation(false) != run::built_in_evaluation(true));
}

TEST_CASE("a plan that is none is refused by name", "[evaluation]") {
    CHECK_THAT(message_of(""), Catch::StartsWith("plan.json: not JSON: "));
    CHECK_THAT(message_of("{"), Catch::StartsWith("plan.json: not JSON: "));
    CHECK_THAT(message_of("{\"title\": \"\xff\"}"), Catch::StartsWith("plan.json: not JSON: "));
    CHECK_THAT(message_of("1e999"), Catch::StartsWith("plan.json: not JSON: "));
    CHECK(message_of("[]") == "plan.json: is [], expected an object");
    CHECK(
        message_of(std::string(200'000, '[') + std::string(200'000, ']')) ==
        "plan.json: is a nested array, expected an object"
    );
    CHECK(message_of("null") == "plan.json: is null, expected an object");
    CHECK(
        message_of(plan_with(R"(, "up": "Z")", "")) ==
        "plan.json: walks[0]: up is \"Z\", expected y or z"
    );
    CHECK(
        message_of(plan_with("", R"(, "backend": "null")")) ==
        "plan.json: walks[0].runs[0]: the backend null draws no pictures to compare"
    );
    const std::string no_walks = "plan.json: no \"walks\", expected an array of at least one";
    for (const char* text : {"{}", R"({"walks": []})", R"({"walks": {}})", R"({"walks": 3})"}) {
        CAPTURE(text);
        CHECK(message_of(text) == no_walks);
    }
    const std::string no_runs =
        "plan.json: walks[0]: no \"runs\", expected an array of at least one";
    for (const char* runs : {"", R"(, "runs": [])", R"(, "runs": "all")"}) {
        CAPTURE(runs);
        CHECK(message_of(std::string(R"({"walks": [{"name": "w")") + runs + "}]}") == no_runs);
    }
    CHECK(message_of(R"({"walks": [7]})") == "plan.json: walks[0]: is 7, expected an object");
    CHECK(
        message_of(R"({"walks": [{"name": "w", "runs": [[]]}]})") ==
        "plan.json: walks[0].runs[0]: is [], expected an object"
    );
}

TEST_CASE("names are there, and there once", "[evaluation]") {
    CHECK(
        message_of(R"({"walks": [{"runs": [{"name": "r"}]}]})") ==
        "plan.json: walks[0]: no \"name\""
    );
    CHECK(
        message_of(R"({"walks": [{"name": "w", "runs": [{"name": "r"}, {"error_px": 2}]}]})") ==
        "plan.json: walks[0].runs[1]: no \"name\""
    );
    CHECK(
        message_of(R"({"walks": [{"name": "w", "runs": [{"name": "r"}, {"name": "r"}]}]})") ==
        "plan.json: walks[0]: two runs are named \"r\""
    );
    CHECK(
        message_of(R"({"walks": [{"name": "w", "runs": [{"name": "r"}]},
                                 {"name": "w", "runs": [{"name": "r"}]}]})") ==
        "plan.json: two walks are named \"w\""
    );
    // Runs of different walks may have one name.
    CHECK(parse(R"({"walks": [{"name": "w", "runs": [{"name": "r"}]},
                              {"name": "v", "runs": [{"name": "r"}]}]})"));
}

TEST_CASE("a key that does not exist is refused where it stands", "[evaluation]") {
    CHECK(
        message_of(R"({"walks": [{"name": "w", "runs": [{"name": "r"}]}], "walk": []})") ==
        "plan.json: \"walk\" is no key of it"
    );
    CHECK(
        message_of(plan_with(R"(, "frame": 3)", "")) ==
        "plan.json: walks[0]: \"frame\" is no key of it"
    );
    CHECK(
        message_of(plan_with("", R"(, "error-px": 3)")) ==
        "plan.json: walks[0].runs[0]: \"error-px\" is no key of it"
    );
}

TEST_CASE("a partition takes its own options only", "[evaluation]") {
    CHECK(
        message_of(plan_with(R"(, "partition": "quadtree")", "")) ==
        "plan.json: walks[0]: partition is \"quadtree\", expected bsp, kdtree or octree"
    );
    CHECK(
        message_of(plan_with(R"(, "max_depth": 4)", "")) ==
        "plan.json: walks[0]: \"max_depth\" is no key of it"
    );
    CHECK(
        message_of(plan_with(R"(, "partition": "octree", "branching": 4)", "")) ==
        "plan.json: walks[0]: \"branching\" is no key of it"
    );
    CHECK(
        message_of(plan_with(R"(, "partition": "kdtree", "max_items": 4)", "")) ==
        "plan.json: walks[0]: \"max_items\" is no key of it"
    );
    CHECK(
        message_of(plan_with(R"(, "partition": "kdtree", "branching": 9)", "")) ==
        "plan.json: walks[0]: branching is 9, expected a whole number from 2 to 8"
    );
    CHECK(
        message_of(plan_with(R"(, "partition": "octree", "max_depth": 65)", "")) ==
        "plan.json: walks[0]: max_depth is 65, expected a whole number from 0 to 64"
    );
    CHECK(
        message_of(plan_with(R"(, "partition": "octree", "max_primitives": 0)", "")) ==
        "plan.json: walks[0]: max_primitives is 0, expected a whole number from 1 to 1073741824"
    );
}

TEST_CASE("a value of the wrong kind is refused with its key", "[evaluation]") {
    struct Wrong {
        const char* key;
        std::vector<const char*> values;
        const char* expected;
    };
    const std::vector<Wrong> walks = {
        {"scene", {"1", "null", "[]"}, "a text"},
        {"path", {"1"}, "a text"},
        {"up", {"true"}, "a text"},
        {"size", {"640"}, "a text"},
        {"fov_deg", {"\"60\"", "null"}, "a number"},
        {"step_m", {"{}"}, "a number"},
        {"frames", {"0", "-3", "2.5", "1e8", "\"2\"", "null"}, "a whole number from 1 to 10000000"},
        {"whole_path", {"0"}, "a whole number from 1 to 10000000"},
        {"max_items", {"0"}, "a whole number from 1 to 1073741824"},
        {"partition", {"1", "[]"}, "a text"},
        {"reference_every", {"0"}, "a whole number from 1 to 10000000"},
        {"truth_samples", {"-1", "65"}, "a whole number from 0 to 64"},
        {"parameters", {"[]", "3"}, "an object of numbers"}};
    for (const Wrong& wrong : walks) {
        for (const char* value : wrong.values) {
            const std::string key = wrong.key;
            CAPTURE(key, value);
            CHECK_THAT(
                message_of(plan_with(", \"" + key + "\": " + value, "")),
                Catch::StartsWith("plan.json: walks[0]: " + key + " is ") &&
                    Catch::EndsWith(std::string(", expected ") + wrong.expected)
            );
        }
    }
    const std::vector<Wrong> runs = {
        {"technique", {"1"}, "a text"},
        {"preset", {"1"}, "a text"},
        {"levels", {"1"}, "a text"},
        {"backend", {"null"}, "a text"},
        {"cost_model", {"{}"}, "a text"},
        {"surfaces", {"1"}, "one of automatic, first, in-images"},
        {"error_px", {"\"2\"", "null", "true"}, "a number"},
        {"samples", {"0", "65", "1.5"}, "a whole number from 1 to 64"},
        {"image_samples", {"0"}, "a whole number from 1 to 64"},
        {"image_budget_mib", {"-1", "1048577"}, "a whole number from 0 to 1048576"},
        {"measure", {"1", "\"true\"", "null"}, "true or false"}};
    for (const Wrong& wrong : runs) {
        for (const char* value : wrong.values) {
            const std::string key = wrong.key;
            CAPTURE(key, value);
            CHECK_THAT(
                message_of(plan_with("", ", \"" + key + "\": " + value)),
                Catch::StartsWith("plan.json: walks[0].runs[0]: " + key + " is ") &&
                    Catch::EndsWith(std::string(", expected ") + wrong.expected)
            );
        }
    }
    CHECK(
        message_of(plan_with(R"(, "parameters": {"trees": "7"})", "")) ==
        "plan.json: walks[0]: trees is \"7\", expected a number"
    );
    // Long values are cut short.
    CHECK(
        message_of(plan_with(", \"frames\": \"" + std::string(500, 'x') + "\"", "")) ==
        "plan.json: walks[0]: frames is \"" + std::string(39, 'x') +
            "..., expected a whole number from 1 to 10000000"
    );
}

TEST_CASE("keys of another technique are refused", "[evaluation]") {
    for (const char* key : {"cell_px", "predict_frames", "budget"}) {
        CHECK(
            message_of(plan_with("", std::string(R"(, ")") + key + R"(": 8)")) ==
            std::string("plan.json: walks[0].runs[0]: \"") + key + "\" is no key of it"
        );
    }
}

TEST_CASE("all LOD-sprites of a walk are of one coarse model", "[evaluation]") {
    const auto walk = [](const std::string& other) {
        return message_of(
            R"({"title": "t", "walks": [{"name": "w", "runs": [
                {"name": "a", "technique": "lod-sprite", "coarse": 8},
                {"name": "b", "technique": "lod-sprite", "coarse": )" +
            other + "}]}]}"
        );
    };
    CHECK(walk("8") == "accepted");
    CHECK_THAT(walk("9"), Catch::Contains("run \"b\" has another proxy"));
}

TEST_CASE("what there is none of is refused with what there is", "[evaluation]") {
    CHECK(
        message_of(plan_with("", R"(, "technique": "magic")")) ==
        "plan.json: walks[0].runs[0]: technique \"magic\" does not exist, expected one of "
        "geometry, mesh-lod, image-cache, color-cubes, lod-sprite, placement"
    );
    CHECK(
        message_of(plan_with("", R"(, "preset": "")")) ==
        "plan.json: walks[0].runs[0]: preset \"\" does not exist, expected one of shade1996, "
        "schaufler1996, chen1999, guaranteed-sprite"
    );
    CHECK_THAT(
        message_of(plan_with("", R"(, "levels": "magic")")),
        Catch::StartsWith("plan.json: walks[0].runs[0]: levels \"magic\" does not exist")
    );
    CHECK_THAT(
        message_of(plan_with("", R"(, "backend": "Opengl")")),
        Catch::StartsWith("plan.json: walks[0].runs[0]: backend \"Opengl\" does not exist")
    );
    CHECK(
        message_of(plan_with("", R"(, "surfaces": "last")")) ==
        "plan.json: walks[0].runs[0]: surfaces is \"last\", expected one of automatic, first, "
        "in-images"
    );
}

TEST_CASE("plans are read from files", "[evaluation]") {
    const farfield::test::TemporaryFile file("plan.json", plan_with("", ""));
    CHECK(run::load_evaluation(file.path()));
    const auto missing = run::load_evaluation("/nonexistent/plan.json");
    REQUIRE_FALSE(missing);
    CHECK(missing.error().code == farfield::ErrorCode::not_found);
    CHECK(missing.error().message == "/nonexistent/plan.json cannot be opened");
    const farfield::test::TemporaryFile broken("broken.json", "[");
    const auto refused = run::load_evaluation(broken.path());
    REQUIRE_FALSE(refused);
    CHECK_THAT(refused.error().message, Catch::StartsWith(broken.path() + ": not JSON: "));
}

TEST_CASE("damaged plans are refused or read, whatever the damage", "[evaluation]") {
    // Pieces of a plan in wrong places find more than noise does.
    const std::vector<std::string> pieces = {
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        "\"",
        "null",
        "true",
        "-1",
        "1e308",
        "1e-400",
        "0.5",
        "\"name\"",
        "\"runs\"",
        "\\u0000",
        "\xC3\x28",
        "[[[[]]]]",
        "{}",
        "\"\"",
        "\"frames\": ",
        "18446744073709551616"};
    farfield::support::Random random(20);
    int read = 0;
    int refused = 0;
    for (int turn = 0; turn < 4000; ++turn) {
        std::string text(run::built_in_evaluation(turn % 2 == 0));
        const unsigned changes = 1 + random.below(3);
        for (unsigned change = 0; change < changes; ++change) {
            const auto size = static_cast<unsigned>(text.size());
            const unsigned at = random.below(size);
            switch (random.below(4)) {
            case 0:
                text[at] = static_cast<char>(random.below(256));
                break;
            case 1:
                text.erase(at, 1 + random.below(40));
                break;
            case 2:
                text.insert(at, pieces[random.below(static_cast<unsigned>(pieces.size()))]);
                break;
            default:
                text.insert(at, text.substr(random.below(size), random.below(200)));
            }
        }
        const auto plan = parse(text);
        if (plan) {
            ++read;
            REQUIRE_FALSE(plan->walks.empty());
        } else {
            ++refused;
            REQUIRE_THAT(plan.error().message, Catch::StartsWith("plan.json: "));
        }
    }
    // Both happen, or the damage is too small or too great to find anything.
    CHECK(read > 40);
    CHECK(refused > 1000);
}
