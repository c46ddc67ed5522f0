#include <farfield/eval/cost_model_file.hpp>
#include <farfield/eval/run_report.hpp>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <string>

namespace {

using farfield::CostModel;
using farfield::ErrorCode;
using nlohmann::ordered_json;
namespace eval = farfield::eval;

constexpr CostModel kModel = {
    .triangle_s = 1.0 / 3.0 * 1e-8, // no short decimal number
    .draw_call_s = 2e-6,
    .image_quad_s = 3e-6,
    .image_pixel_s = 0.0,
    .pass_s = 5e-5,
    .texel_s = 6e-300,
    .geometry_pixel_s = 7e-9,
    .splat_s = 8e-8,
    .cube_s = 9e-8,
    .cell_s = 9e-9};

void check_refused(const std::string& text, const std::string& reason) {
    const auto model = eval::parse_cost_model(text, "gpu.json");
    REQUIRE_FALSE(model);
    CHECK(model.error().code == ErrorCode::bad_data);
    CHECK_THAT(model.error().message, Catch::StartsWith("gpu.json: "));
    CHECK_THAT(model.error().message, Catch::Contains(reason));
}

/// The text of a good file with one value replaced.
std::string with(const char* key, const ordered_json& value) {
    ordered_json root = ordered_json::parse(eval::to_json(kModel));
    root[key] = value;
    return root.dump();
}

} // namespace

TEST_CASE("what is no object of numbers is no cost model", "[cost_model_file]") {
    check_refused("", "not JSON");
    check_refused("{\"triangle_s\": 1e-7", "not JSON");
    check_refused("{\"triangle_s\": nan}", "not JSON");
    check_refused("null", "the file is null, expected an object");
    check_refused("[1, 2, 3, 4, 5, 6]", "the file is [1,2,3,4,5,6], expected an object");
    check_refused("{}", "no \"triangle_s\"");
    check_refused(with("texel_s", nullptr), "texel_s is null, expected a number");
    check_refused(with("pass_s", "5e-5"), "pass_s is \"5e-5\", expected a number");
    check_refused(with("pass_s", true), "pass_s is true, expected a number");
}

TEST_CASE("costs that cannot be are refused by name and value", "[cost_model_file]") {
    check_refused(with("draw_call_s", -1.0), "draw_call_s is -1.0");
    check_refused(with("triangle_s", 0), "triangle_s is 0");
    check_refused("{\"triangle_s\": 1e999}", "1e999"); // no double holds it
}

TEST_CASE("every key has to be there and no other may be", "[cost_model_file]") {
    const ordered_json whole = ordered_json::parse(eval::to_json(kModel));
    REQUIRE(whole.size() == 10);
    for (const auto& [key, value] : whole.items()) {
        ordered_json without = whole;
        without.erase(key);
        check_refused(without.dump(), "no \"" + key + "\"");
    }
    check_refused(with("triangles_s", 1e-7), "unknown key \"triangles_s\": 1e-07");
    check_refused(
        with("note", std::string(100, 'x')),
        "unknown key \"note\": \"" + std::string(39, 'x') + "..."
    );
}

TEST_CASE("a cost model is read back as it was written", "[cost_model_file]") {
    const auto back = eval::parse_cost_model(eval::to_json(kModel), "");
    REQUIRE(back);
    CHECK(*back == kModel);
    CHECK(eval::to_json(CostModel{}) != eval::to_json(kModel));
    CHECK(eval::parse_cost_model(eval::to_json(CostModel{}), "") == CostModel{});
    // Whole numbers are numbers.
    const auto whole = eval::parse_cost_model(with("pass_s", 2), "");
    REQUIRE(whole);
    CHECK(whole->pass_s == 2.0);
}

TEST_CASE("cost models go through files", "[cost_model_file]") {
    const auto file = std::filesystem::temp_directory_path() / "farfield_cost_model_test.json";
    REQUIRE(eval::save(kModel, file));
    const auto back = eval::load_cost_model(file);
    REQUIRE(back);
    CHECK(*back == kModel);

    // What could not be read back is not written, and the file stays.
    CostModel bad = kModel;
    bad.texel_s = -2.0;
    const auto saved = eval::save(bad, file);
    REQUIRE_FALSE(saved);
    CHECK_THAT(saved.error().message, Catch::Contains("texel_s is -2"));
    CHECK(eval::load_cost_model(file) == kModel);

    std::ofstream(file) << "{}";
    const auto empty = eval::load_cost_model(file);
    REQUIRE_FALSE(empty);
    CHECK_THAT(empty.error().message, Catch::Contains(file.string() + ": no \"triangle_s\""));
    std::filesystem::remove(file);
    const auto missing = eval::load_cost_model(file);
    REQUIRE_FALSE(missing);
    CHECK(missing.error().code == ErrorCode::not_found);
}

TEST_CASE("a run report names costs as the file does", "[cost_model_file]") {
    farfield::RunReport report;
    report.cost_model = kModel;
    const ordered_json reported = ordered_json::parse(eval::to_json(report))["cost_model"];
    const ordered_json written = ordered_json::parse(eval::to_json(kModel));
    REQUIRE_FALSE(reported.empty());
    for (const auto& [key, value] : reported.items()) {
        CAPTURE(key);
        REQUIRE(written.contains(key));
        CHECK(written[key] == value);
    }
}
