#include <farfield/eval/run_report.hpp>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <vector>

namespace {

using farfield::RunReport;
using farfield::SampledTime;
using nlohmann::ordered_json;
namespace eval = farfield::eval;

std::vector<std::string> keys_of(const ordered_json& object) {
    std::vector<std::string> keys;
    for (const auto& [key, value] : object.items()) {
        keys.push_back(key);
    }
    return keys;
}

using Keys = std::vector<std::string>;

} // namespace

TEST_CASE("percentiles are linear between order statistics", "[run_report]") {
    const std::array<double, 1> one = {7.0};
    CHECK(eval::percentile(one, 0.0) == 7.0);
    CHECK(eval::percentile(one, 0.95) == 7.0);
    const std::array<double, 4> four = {4.0, 1.0, 3.0, 2.0};
    CHECK(eval::percentile(four, 0.0) == 1.0);
    CHECK(eval::percentile(four, 0.5) == 2.5);
    CHECK(eval::percentile(four, 1.0) == 4.0);
    CHECK(eval::percentile(four, 0.95) == Approx(3.85).epsilon(1e-15)); // position 2.85
    std::vector<double> hundred_and_one;
    for (int i = 100; i >= 0; --i) {
        hundred_and_one.push_back(i);
    }
    CHECK(eval::percentile(hundred_and_one, 0.95) == Approx(95.0).epsilon(1e-15));
    CHECK(eval::percentile(hundred_and_one, 0.99) == Approx(99.0).epsilon(1e-15));
}

TEST_CASE("a series is summarised", "[run_report]") {
    CHECK_FALSE(eval::summarize({}).has_value());
    const std::array<double, 5> times = {10.0, 2.0, 4.0, 1.0, 3.0};
    const auto figures = eval::summarize(times);
    REQUIRE(figures);
    CHECK(figures->first == 10.0);
    CHECK(figures->mean == 4.0);
    CHECK(figures->median == 3.0);
    CHECK(figures->p95 == Approx(8.8).epsilon(1e-15));  // position 3.8 between 4 and 10
    CHECK(figures->p99 == Approx(9.76).epsilon(1e-15)); // position 3.96
    CHECK(figures->max == 10.0);
    CHECK(figures->total == 20.0);
}

TEST_CASE("reference frames are sampled in every stretch, first and last always", "[run_report]") {
    CHECK(eval::sampled_frames(0, 5, 1).empty());
    CHECK(eval::sampled_frames(100, 0, 1).empty());
    CHECK(eval::sampled_frames(1, 5, 1) == std::vector<int>{0});
    CHECK(eval::sampled_frames(2, 5, 1) == std::vector<int>{0, 1});
    CHECK(eval::sampled_frames(5, 1, 1) == std::vector<int>{0, 1, 2, 3, 4});

    std::set<int> phases;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const std::vector<int> frames = eval::sampled_frames(1200, 24, seed);
        REQUIRE(frames.front() == 0);
        REQUIRE(frames.back() == 1199);
        // One in each of the stretches 1 .. 49 of 24 frames; the last may fall onto frame 1199.
        REQUIRE(frames.size() >= 50);
        REQUIRE(frames.size() <= 51);
        for (std::size_t i = 1; i + 1 < frames.size(); ++i) {
            REQUIRE(frames[i] / 24 == static_cast<int>(i));
            phases.insert(frames[i] % 24);
        }
    }
    CHECK(phases.size() == 24); // no phase is left out
    CHECK(eval::sampled_frames(1200, 24, 3) == eval::sampled_frames(1200, 24, 3));
    CHECK(eval::sampled_frames(1200, 24, 3) != eval::sampled_frames(1200, 24, 4));
}

TEST_CASE("reference times are linear between sampled frames", "[run_report]") {
    const std::array<SampledTime, 3> samples = {{{0, 10.0}, {2, 20.0}, {6, 12.0}}};
    const auto times = eval::reference_times(samples, 7);
    REQUIRE(times);
    CHECK(*times == std::vector<double>{10.0, 15.0, 20.0, 18.0, 16.0, 14.0, 12.0});
    const std::array<SampledTime, 1> single = {{{0, 3.0}}};
    CHECK(*eval::reference_times(single, 1) == std::vector<double>{3.0});

    CHECK(
        eval::reference_times(samples, 8).error().message ==
        "reference times: frames 0 to 6 were sampled, expected 0 to 7"
    );
    CHECK(
        eval::reference_times({}, 3).error().message ==
        "reference times: frames none were sampled, expected 0 to 2"
    );
    CHECK_FALSE(eval::reference_times(samples, 0));
    const std::array<SampledTime, 4> unordered = {{{0, 1.0}, {500, 1.0}, {1, 1.0}, {2, 1.0}}};
    CHECK(
        eval::reference_times(unordered, 3).error().message ==
        "reference times: frame 1 follows frame 500"
    );
    std::array<SampledTime, 3> bad = samples;
    bad[1].ms = 0.0;
    CHECK_FALSE(eval::reference_times(bad, 7));
    bad[1].ms = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(eval::reference_times(bad, 7));
}

TEST_CASE("speed-up counts every frame of the technique", "[run_report]") {
    // R = 10 + 15 + 20 + 18 + 16 + 14 + 12 = 105; T = 21 + 1 + 2 + 5 + 2 + 1 + 3 = 35.
    const std::array<SampledTime, 3> samples = {{{0, 10.0}, {2, 20.0}, {6, 12.0}}};
    const std::array<double, 7> times = {21.0, 1.0, 2.0, 5.0, 2.0, 1.0, 3.0};
    const auto result = eval::speedup(times, samples);
    REQUIRE(result);
    CHECK(*result->overall == Approx(3.0).epsilon(1e-15));
    CHECK(*result->without_first == Approx(95.0 / 14.0).epsilon(1e-15));
    CHECK(*result->min == Approx(10.0 / 21.0).epsilon(1e-15));
    CHECK(*result->max == Approx(10.0).epsilon(1e-15)); // frame 1, 15 times, was not sampled

    const std::array<double, 1> one = {4.0};
    const auto single = eval::speedup(one, std::array<SampledTime, 1>{{{0, 10.0}}});
    REQUIRE(single);
    CHECK(*single->overall == 2.5);
    CHECK_FALSE(single->without_first.has_value());
    CHECK(single->min == single->max);

    CHECK_FALSE(eval::speedup({}, samples));
    std::array<double, 7> bad = times;
    bad[3] = 0.0;
    CHECK(
        eval::speedup(bad, samples).error().message ==
        "speed-up: frame 3 took 0.000000 ms, expected more than 0"
    );
}

TEST_CASE("times become the figures of the report", "[run_report]") {
    const std::array<SampledTime, 3> samples = {{{0, 10.0}, {2, 20.0}, {6, 12.0}}};
    const auto reference = eval::reference_figures(samples, 7);
    REQUIRE(reference);
    CHECK(reference->first == 10.0);
    CHECK(reference->mean == 14.0);
    CHECK(reference->median == 12.0);
    CHECK(*reference->p95 == Approx(19.2).epsilon(1e-15));
    CHECK(reference->max == 20.0);
    CHECK(reference->sampled == 3U);
    CHECK(reference->total == 105.0);
    CHECK_FALSE(eval::reference_figures({}, 7)->total.has_value());
    CHECK_FALSE(eval::reference_figures(samples, 9));

    CHECK_FALSE(eval::frame_times({}).mean.has_value());
    const std::array<double, 2> times = {4.0, 2.0};
    const auto frame = eval::frame_times(times);
    CHECK(frame.first == 4.0);
    CHECK(frame.mean == 3.0);
    CHECK(frame.median == 3.0);
    CHECK(frame.max == 4.0);
    CHECK(frame.total == 6.0);
}

TEST_CASE("the JSON of a run has exactly its keys", "[run_report]") {
    const ordered_json json = ordered_json::parse(eval::to_json(RunReport{}));
    CHECK(keys_of(json) == Keys{"scene",    "technique", "preset",       "backend",
                                "device",   "width",     "height",       "fov_deg",
                                "error_px", "frames",    "frame_ms",     "reference_frame_ms",
                                "speedup",  "plan_ms",   "disparity_px", "image",
                                "truth",    "work",      "memory",       "cost_model"});
    CHECK(
        keys_of(json["scene"]) ==
        Keys{"name", "triangles", "instances", "build_ms", "nodes", "depth"}
    );
    CHECK(
        keys_of(json["frame_ms"]) == Keys{"first", "mean", "median", "p95", "p99", "max", "total"}
    );
    CHECK(
        keys_of(json["reference_frame_ms"]) ==
        Keys{"first", "mean", "median", "p95", "max", "sampled", "total"}
    );
    CHECK(keys_of(json["speedup"]) == Keys{"overall", "without_first", "min", "max"});
    CHECK(keys_of(json["plan_ms"]) == Keys{"mean", "p95", "max"});
    CHECK(
        keys_of(json["disparity_px"]) ==
        Keys{"median", "p99", "max", "bound", "over_bound", "tightness"}
    );
    const Keys image = {
        "psnr_db_min",
        "psnr_db_median",
        "ssim_median",
        "flip_mean",
        "missing_fraction",
        "extra_fraction"};
    CHECK(keys_of(json["image"]) == image);
    Keys truth = image;
    truth.emplace_back("reference_psnr_db_median");
    CHECK(keys_of(json["truth"]) == truth);
    CHECK(
        keys_of(json["work"]) ==
        Keys{
            "triangles_per_frame",
            "draw_calls_per_frame",
            "image_quads_per_frame",
            "splats_per_frame",
            "cubes_per_frame",
            "images_created",
            "images_reused",
            "texels_created",
            "deferred",
            "evicted",
            "stale",
            "new",
            "combined",
            "reused",
            "impossible",
            "keyframes",
            "budget_misses"}
    );
    CHECK(
        keys_of(json["memory"]) ==
        Keys{
            "image_bytes_peak", "image_budget_bytes", "aov_bytes", "hierarchy_bytes", "scene_bytes"}
    );
}

TEST_CASE("what was not measured is null, never zero", "[run_report]") {
    const ordered_json json = ordered_json::parse(eval::to_json(RunReport{}));
    for (const char* group :
         {"frame_ms",
          "reference_frame_ms",
          "speedup",
          "plan_ms",
          "disparity_px",
          "image",
          "truth",
          "work",
          "memory"}) {
        for (const auto& [key, value] : json[group].items()) {
            INFO(group << "." << key);
            CHECK(value.is_null());
        }
    }
    CHECK(json["scene"]["triangles"].is_null());
    CHECK(json["error_px"].is_null());
    CHECK(json["cost_model"].is_null());

    RunReport report;
    report.frame_ms.mean = std::numeric_limits<double>::quiet_NaN();
    report.frame_ms.max = std::numeric_limits<double>::infinity();
    report.frame_ms.median = 0.0;
    const ordered_json odd = ordered_json::parse(eval::to_json(report));
    CHECK(odd["frame_ms"]["mean"].is_null());
    CHECK(odd["frame_ms"]["max"].is_null());
    CHECK(odd["frame_ms"]["median"] == 0.0);
}

TEST_CASE("every figure of a report arrives under its key", "[run_report]") {
    RunReport report;
    report.scene = {"island \"a\"\n", 40'600'000, 1118, 3.25, 1800, 13};
    report.technique = "image-cache";
    report.preset = "shade1996";
    report.backend = "opengl";
    report.device = "caf\xC3\xA9 \xFF"; // the last byte is not UTF-8
    report.width = 640;
    report.height = 480;
    report.fov_deg = 60.0;
    report.error_px = 2.0;
    report.frames = 1200;
    report.frame_ms = {1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
    report.reference_frame_ms = {11.0, 12.0, 13.0, 14.0, 15.0, 16, 17.0};
    report.speedup = {21.0, 22.0, 23.0, 24.0};
    report.plan_ms = {31.0, 32.0, 33.0};
    report.disparity_px = {41.0, 42.0, 43.0, 44.0, 45, 46.0};
    report.image = {51.0, 52.0, 53.0, 54.0, 55.0, 56.0};
    static_cast<RunReport::ImageErrors&>(report.truth) = {61.0, 62.0, 63.0, 64.0, 65.0, 66.0};
    report.truth.reference_psnr_db_median = 67.0;
    report.work = {71.0, 72.0, 73.0, 74.0, 75.0, 76, 77, 78, 79, 80, 81, 82, 83, 84, 85, 86, 87};
    report.memory = {91, 92, 93, 94, UINT64_MAX};
    report.cost_model = farfield::CostModel{
        .triangle_s = 1e-7,
        .draw_call_s = 2e-7,
        .image_quad_s = 3e-7,
        .pass_s = 4e-7,
        .texel_s = 5e-7};

    const ordered_json json = ordered_json::parse(eval::to_json(report));
    CHECK(json["scene"]["name"] == "island \"a\"\n");
    CHECK(json["scene"]["triangles"] == 40'600'000);
    CHECK(json["scene"]["depth"] == 13);
    CHECK(json["technique"] == "image-cache");
    CHECK(json["device"] == "caf\xC3\xA9 \xEF\xBF\xBD");
    CHECK(json["error_px"] == 2.0);
    CHECK(json["frames"] == 1200);
    // Figures were numbered in the order of the keys, so each group counts upwards.
    const std::vector<std::pair<const char*, int>> groups = {
        {"frame_ms", 1},
        {"reference_frame_ms", 11},
        {"speedup", 21},
        {"plan_ms", 31},
        {"disparity_px", 41},
        {"image", 51},
        {"truth", 61},
        {"work", 71}};
    for (const auto& [group, first] : groups) {
        int expected = first;
        for (const auto& [key, value] : json[group].items()) {
            INFO(group << "." << key);
            CHECK(value == expected);
            ++expected;
        }
    }
    CHECK(json["memory"]["image_bytes_peak"] == 91);
    CHECK(json["memory"]["hierarchy_bytes"] == 94);
    CHECK(json["memory"]["scene_bytes"].get<std::uint64_t>() == UINT64_MAX);
    CHECK(json["cost_model"]["triangle_s"] == 1e-7);
    CHECK(json["cost_model"]["texel_s"] == 5e-7);
}

TEST_CASE("a report's file is replaced whole", "[run_report]") {
    const auto folder = std::filesystem::temp_directory_path() / "farfield_test_run_report";
    std::filesystem::create_directories(folder);
    const auto file = folder / "run.json";
    { std::ofstream(file) << std::string(100'000, 'x'); }
    RunReport report;
    report.technique = "geometry";
    REQUIRE(eval::save(report, file));
    std::ifstream stream(file);
    const std::string text{
        std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
    CHECK(text == eval::to_json(report));
    CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 1);

    // A folder in the way cannot be replaced; nothing is left behind.
    std::filesystem::create_directories(folder / "taken" / "inside");
    const auto refused = eval::save(report, folder / "taken");
    REQUIRE_FALSE(refused);
    CHECK(refused.error().message.find("taken: cannot be replaced") != std::string::npos);
    CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 2);
    std::filesystem::remove_all(folder);
}
