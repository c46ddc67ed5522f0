#include <farfield/eval/camera_path.hpp>
#include <farfield/farfield.hpp>
#include <farfield/math/view.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace {

using farfield::Box3d;
using farfield::CameraPath;
using farfield::PathKey;
using farfield::PathPose;
using glm::dvec3;
namespace eval = farfield::eval;

const dvec3 kUp(0.0, 1.0, 0.0);

PathKey key(double frame, const dvec3& eye) {
    return {frame, eye, eye + dvec3(0, 0, -10), kUp};
}

/// Some bent path with uneven keys.
CameraPath bent() {
    return {
        101,
        {key(0, {0, 1, 2}),
         key(25, {10, 2, -3}),
         key(50, {15, 8, 4}),
         key(80, {-5, 3, 9}),
         key(100, {2, 2, 2})}};
}

std::string message_of(const std::string& json) {
    const auto path = eval::parse_camera_path(json, "walk.json");
    return path ? "no error" : path.error().message;
}

std::vector<double> steps(const CameraPath& path) {
    std::vector<double> result;
    for (int frame = 1; frame < path.frame_count; ++frame) {
        result.push_back(
            glm::distance(eval::pose_at(path, frame).eye, eval::pose_at(path, frame - 1).eye)
        );
    }
    return result;
}

// Points of a few tens of metres, each a sum of a dozen products.
const double kRounding = 1e-12;

} // namespace

TEST_CASE("one key stands still and two walk a straight line", "[camera_path]") {
    const CameraPath still{50, {key(10, {1, 2, 3})}};
    REQUIRE(eval::validate(still));
    for (const double frame : {-5.0, 0.0, 10.0, 49.0}) {
        CHECK(eval::pose_at(still, frame) == PathPose{{1, 2, 3}, {1, 2, -7}, kUp});
    }

    const CameraPath line{11, {key(0, {0, 0, 0}), key(10, {5, 10, -20})}};
    REQUIRE(eval::validate(line));
    for (const double frame : {0.0, 1.0, 2.5, 5.0, 9.0, 10.0}) {
        const dvec3 expected = dvec3(5, 10, -20) * (frame / 10.0);
        CHECK(glm::distance(eval::pose_at(line, frame).eye, expected) < 20.0 * kRounding);
    }
}

TEST_CASE("the walk begins on the first key and ends on the last", "[camera_path]") {
    const CameraPath path = bent();
    REQUIRE(eval::validate(path));
    CHECK(glm::distance(eval::pose_at(path, 0).eye, path.keys.front().eye) < 10 * kRounding);
    CHECK(glm::distance(eval::pose_at(path, 100).eye, path.keys.back().eye) < 10 * kRounding);
    CHECK(eval::pose_at(path, -3.0) == eval::pose_at(path, 0.0));
    CHECK(eval::pose_at(path, 1e9) == eval::pose_at(path, 100.0));
}

TEST_CASE("between keys it is the uniform cubic B-spline", "[camera_path]") {
    const CameraPath path = bent();
    const auto& keys = path.keys;
    // On an inner key: (1, 4, 1) / 6; half way: (1, 23, 23, 1) / 48.
    const dvec3 on_key = (keys[1].eye + 4.0 * keys[2].eye + keys[3].eye) / 6.0;
    CHECK(glm::distance(eval::pose_at(path, 50).eye, on_key) < 20 * kRounding);
    const dvec3 half = (keys[0].eye + 23.0 * keys[1].eye + 23.0 * keys[2].eye + keys[3].eye) / 48.0;
    CHECK(glm::distance(eval::pose_at(path, 37.5).eye, half) < 20 * kRounding);
    // Targets are splines of their own.
    CHECK(
        glm::distance(eval::pose_at(path, 37.5).target, half + dvec3(0, 0, -10)) < 40 * kRounding
    );
    // In the first segment with the reflected key: P[-1] = 2 P[0] - P[1].
    const dvec3 before = 2.0 * keys[0].eye - keys[1].eye;
    const dvec3 first = (before + 23.0 * keys[0].eye + 23.0 * keys[1].eye + keys[2].eye) / 48.0;
    CHECK(glm::distance(eval::pose_at(path, 12.5).eye, first) < 20 * kRounding);
}

TEST_CASE("speed does not jump at a key", "[camera_path]") {
    CameraPath path = bent();
    for (std::size_t i = 0; i < path.keys.size(); ++i) {
        path.keys[i].frame = 25.0 * static_cast<double>(i);
    }
    const double h = 1e-4;
    for (const double frame : {25.0, 50.0, 75.0}) {
        const dvec3 here = eval::pose_at(path, frame).eye;
        const dvec3 before = (here - eval::pose_at(path, frame - h).eye) / h;
        const dvec3 after = (eval::pose_at(path, frame + h).eye - here) / h;
        // Second differences of neighbouring keys are up to 60 m over 25^2 frames: half of that
        // times 2 h, and rounding of 20 m over h.
        CHECK(glm::distance(before, after) < 60.0 / 625.0 * h + 20.0 * 4e-16 / h + 1e-9);
    }
}

TEST_CASE("frame i is one pose whatever the number of frames", "[camera_path]") {
    const CameraPath whole = bent();
    CameraPath part = whole;
    part.frame_count = 30;
    REQUIRE(eval::validate(part));
    for (int frame = 0; frame < part.frame_count; ++frame) {
        REQUIRE(eval::pose_at(part, frame) == eval::pose_at(whole, frame));
    }
}

TEST_CASE("the whole path can be seen in fewer frames", "[camera_path]") {
    const CameraPath path = bent();
    CHECK(eval::whole_path_frame(path, 0, 1) == 0.0);
    CHECK(eval::whole_path_frame(path, 0, 5) == 0.0);
    CHECK(eval::whole_path_frame(path, 1, 5) == 25.0);
    CHECK(eval::whole_path_frame(path, 4, 5) == 100.0);
    for (int i = 0; i < 101; ++i) {
        CHECK(eval::whole_path_frame(path, i, 101) == i);
    }
}

TEST_CASE("where eye and target meet the camera keeps its direction", "[camera_path]") {
    // Both are 0 half way: the eye goes from -4 to 4, the target from 4 to -4.
    const CameraPath path{11, {{0, {-4, 0, 0}, {4, 0, 0}, kUp}, {10, {4, 0, 0}, {-4, 0, 0}, kUp}}};
    REQUIRE(eval::validate(path));
    const PathPose pose = eval::pose_at(path, 5.0);
    REQUIRE(glm::length(pose.eye) < 4 * kRounding);
    CHECK(glm::distance(pose.target, pose.eye) > 0.0);
}

TEST_CASE("a path far from the origin keeps its digits", "[camera_path]") {
    const CameraPath near_path = bent();
    CameraPath far_path = near_path;
    const dvec3 shift(1e7, 0, -2e7);
    for (PathKey& one : far_path.keys) {
        one.eye += shift;
        one.target += shift;
    }
    for (int i = 0; i <= 142; ++i) {
        const double frame = 0.7 * i;
        const dvec3 moved = eval::pose_at(far_path, frame).eye - shift;
        // Sums at 2e7 m are rounded to 3.7e-9 m, a few of them.
        REQUIRE(glm::distance(moved, eval::pose_at(near_path, frame).eye) < 2e-8);
    }
}

TEST_CASE("paths that cannot be walked are refused by key and value", "[camera_path]") {
    CameraPath path = bent();
    path.frame_count = 0;
    CHECK_FALSE(eval::validate(path));
    path.frame_count = 102;
    CHECK(
        eval::validate(path).error().message ==
        "frame_count is 102, but the last key is at frame 100"
    );
    path = bent();
    path.keys[0].frame = 1.0;
    CHECK(eval::validate(path).error().message == "keys[0].frame is 1, expected 0 or before");
    path = bent();
    path.keys[3].frame = 50.0;
    CHECK(
        eval::validate(path).error().message ==
        "keys[3].frame is 50, expected more than 50 of the key before"
    );
    path = bent();
    path.keys[2].target.z = std::numeric_limits<double>::infinity();
    CHECK(
        eval::validate(path).error().message == "keys[2].target[2] is inf, expected a finite number"
    );
    path = bent();
    path.keys[4].frame = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(eval::validate(path));
    path = bent();
    path.keys[1].target = path.keys[1].eye;
    CHECK(
        eval::validate(path).error().message ==
        "keys[1].target is (10, 2, -3), which is the eye itself"
    );
    path = bent();
    path.keys[1].up = dvec3(0.0);
    CHECK_FALSE(eval::validate(path));
    path.keys.clear();
    CHECK(eval::validate(path).error().message == "keys is empty, expected one at least");
}

TEST_CASE("a path survives its file", "[camera_path]") {
    const auto folder = std::filesystem::temp_directory_path() / "farfield_test_camera_path";
    std::filesystem::create_directories(folder);
    const auto file = folder / "walk.json";
    CameraPath path = bent();
    path.keys[1].eye = {0.1, -1e-300, 12345678.901234567};
    path.keys[2].up = {0.3, 0.9, -0.1};
    REQUIRE(eval::save(path, file));
    const auto loaded = eval::load_camera_path(file);
    REQUIRE(loaded);
    CHECK(*loaded == path);
    // Over an existing file, and without leaving another beside it.
    path.frame_count = 7;
    REQUIRE(eval::save(path, file));
    CHECK(eval::load_camera_path(file)->frame_count == 7);
    CHECK(std::distance(std::filesystem::directory_iterator(folder), {}) == 1);

    path.keys[0].up = dvec3(0.0);
    CHECK_FALSE(eval::save(path, file));
    CHECK(eval::load_camera_path(file)->frame_count == 7);

    const auto missing = eval::load_camera_path(folder / "none.json");
    REQUIRE_FALSE(missing);
    CHECK(missing.error().code == farfield::ErrorCode::not_found);
    CHECK_FALSE(eval::load_camera_path(folder));
    const auto unwritable = eval::save(bent(), folder / "none" / "walk.json");
    REQUIRE_FALSE(unwritable);
    CHECK(unwritable.error().message.find("walk.json") != std::string::npos);
    std::filesystem::remove_all(folder);
}

TEST_CASE("bad path files are refused by key and value", "[camera_path]") {
    const std::string good =
        R"({"frame": 0, "eye": [0, 0, 0], "target": [0, 0, 1], "up": [0, 1, 0]})";
    CHECK(message_of(R"({"frame_count": 5, "keys": [)" + good + "]}") == "no error");

    CHECK(message_of("").find("walk.json: not JSON") == 0);
    CHECK(message_of("{").find("walk.json: not JSON") == 0);
    CHECK(message_of("[1]") == "walk.json: the file is [1], expected an object");
    // Deeper than the stack: named, not printed.
    CHECK(
        message_of(std::string(200'000, '[') + std::string(200'000, ']')) ==
        "walk.json: the file is a nested array, expected an object"
    );
    CHECK(message_of(R"({"keys": []})") == "walk.json: the file has no \"frame_count\"");
    CHECK(
        message_of(R"({"frame_count": 2.5, "keys": []})") ==
        "walk.json: frame_count is 2.5, expected a whole number from 1 to 10000000"
    );
    CHECK(message_of(R"({"frame_count": 99999999999999999999, "keys": []})") != "no error");
    CHECK(message_of(R"({"frame_count": -1, "keys": []})") != "no error");
    CHECK(
        message_of(R"({"frame_count": 1, "keys": 3})") == "walk.json: keys is 3, expected an array"
    );
    CHECK(
        message_of(R"({"frame_count": 1, "keys": []})") ==
        "walk.json: keys is empty, expected one at least"
    );
    CHECK(
        message_of(R"({"frame_count": 1, "keys": [)" + good + R"(], "speed": 3})") ==
        "walk.json: the file has an unknown member \"speed\": 3"
    );
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string one = good;
        one.replace(one.find(from), from.size(), to);
        return message_of(R"({"frame_count": 1, "keys": [)" + one + "]}");
    };
    CHECK(
        with("[0, 0, 1]", "[0, null, 1]") ==
        "walk.json: keys[0].target[1] is null, expected a number"
    );
    CHECK(
        with("[0, 0, 1]", "[0, 1]") == "walk.json: keys[0].target is [0,1], expected three numbers"
    );
    CHECK(
        with("[0, 0, 1]", "\"x\"") == "walk.json: keys[0].target is \"x\", expected three numbers"
    );
    CHECK(with("[0, 0, 1]", "[0, 0, 1e999]") != "no error");
    CHECK(with("\"up\"", "\"upp\"") == "walk.json: keys[0] has no \"up\"");
    CHECK(
        with("\"frame\": 0", "\"frame\": \"0\"") ==
        "walk.json: keys[0].frame is \"0\", expected a number"
    );
    CHECK(
        with("[0, 0, 1]", "[0, 0, 0]") ==
        "walk.json: keys[0].target is (0, 0, 0), which is the eye itself"
    );
}

TEST_CASE("the default path refuses boxes without a radius", "[camera_path]") {
    CHECK_FALSE(eval::default_path(Box3d{}));
    CHECK_FALSE(eval::default_path({{1, 1, 1}, {1, 1, 1}}));
    CHECK_FALSE(eval::default_path({{0, 0, 0}, {1, 1, std::numeric_limits<double>::infinity()}}));
    const Box3d box{{0, 0, 0}, {1, 1, 1}};
    CHECK_FALSE(eval::default_path(box, {.frames = 1}));
    CHECK_FALSE(eval::default_path(box, {.step_m = 0.0}));
    CHECK_FALSE(eval::default_path(box, {.step_m = 1.0}));
    CHECK_FALSE(eval::default_path(box, {.up = dvec3(0.0)}));
    CHECK(eval::default_path({{0, 0, 0}, {1, 0, 0}})); // a flat thing has a radius
}

TEST_CASE("the default path goes around and then in, at one speed", "[camera_path]") {
    const std::array<dvec3, 3> ups = {kUp, dvec3(0, 0, 2), glm::normalize(dvec3(1, 2, 3))};
    for (const dvec3& up : ups) {
        const Box3d box{{100, -3, 7}, {140, 9, 27}};
        const double radius = 0.5 * glm::length(dvec3(40, 12, 20));
        const auto path = eval::default_path(box, {.up = up});
        REQUIRE(path);
        REQUIRE(eval::validate(*path));
        CHECK(path->frame_count == 1200);
        const dvec3 middle(120, 3, 17);
        const dvec3 axis = glm::normalize(up);
        double ground = 1e300;
        for (unsigned i = 0; i < 8; ++i) {
            ground = std::min(ground, glm::dot(corner(box, i), axis));
        }
        for (int frame = 0; frame < 1200; ++frame) {
            const PathPose pose = eval::pose_at(*path, frame);
            REQUIRE(glm::distance(pose.target, middle) < 1e-9 * radius);
            const double above = glm::dot(pose.eye, axis) - ground;
            REQUIRE(above == Approx(0.06 * radius).epsilon(1e-9));
            const dvec3 flat = (pose.eye - middle) - axis * glm::dot(pose.eye - middle, axis);
            // Ten steps of R / 500 turn by 0.0174 rad at 1.15 R; the spline shrinks the circle by
            // a third of 1 - cos of that, 5e-5. The corner begins one and a half keys before.
            if (frame <= 700) {
                REQUIRE(glm::length(flat) == Approx(1.15 * radius).epsilon(6e-5));
            } else if (frame >= 740) {
                const double expected = 1.15 * radius - (frame - 0.6 * 1199) * radius / 500.0;
                REQUIRE(glm::length(flat) == Approx(expected).epsilon(1e-6));
            }
        }
        const std::vector<double> all = steps(*path);
        for (std::size_t i = 0; i < all.size(); ++i) {
            const bool corner = i > 690 && i < 740;
            REQUIRE(all[i] <= radius / 500.0 * (1.0 + 1e-9));
            // A right angle is cut to 1 / sqrt(2) of the speed at its sharpest.
            REQUIRE(all[i] >= radius / 500.0 * (corner ? 0.70 : 0.9999));
        }
    }
}

TEST_CASE("a longer default walk goes further around, never through the model", "[camera_path]") {
    const Box3d box{{-1, -1, -1}, {1, 1, 1}};
    const double radius = std::sqrt(3.0);
    for (const int frames : {2, 3, 17, 300, 5000}) {
        for (const double step : {radius / 500.0, radius / 20.0}) {
            const auto path = eval::default_path(box, {.frames = frames, .step_m = step});
            REQUIRE(path);
            REQUIRE(eval::validate(*path));
            CHECK(path->frame_count == frames);
            double least = 1e300;
            for (int frame = 0; frame < frames; ++frame) {
                const dvec3 eye = eval::pose_at(*path, frame).eye;
                least = std::min(least, std::hypot(eye.x, eye.z));
            }
            CHECK(least >= 0.15 * radius * (1.0 - 1e-9));
        }
    }
    // The last frame of 5000 is R nearer than the arc; at that length no more than R is walked in.
    const auto path = eval::default_path(box, {.frames = 5000});
    const dvec3 end = eval::pose_at(*path, 4999).eye;
    CHECK(std::hypot(end.x, end.z) == Approx(0.15 * radius).epsilon(1e-9));
}

TEST_CASE("the height field path has its four parts", "[camera_path]") {
    CHECK_FALSE(eval::height_field_path(Box3d{}));
    CHECK_FALSE(eval::height_field_path({{1, 0, 1}, {1, 5, 1}}));
    const Box3d box{{-500, 20, 0}, {500, 140, 2000}};
    const auto path = eval::height_field_path(box);
    REQUIRE(path);
    REQUIRE(eval::validate(*path));
    CHECK(path->frame_count == 460);
    const dvec3 middle(0, 140, 1000);
    const double reach = 0.5 * std::hypot(1000.0, 2000.0);
    const auto elevation = [&](int frame) {
        const dvec3 out = eval::pose_at(*path, frame).eye - middle;
        return std::asin(out.y / glm::length(out));
    };
    const auto azimuth = [&](int frame) {
        const dvec3 out = eval::pose_at(*path, frame).eye - middle;
        return std::atan2(out.z, out.x);
    };
    const double degree = std::numbers::pi / 180.0;
    // A key and a half around each change of part is blended.
    CHECK(elevation(0) == Approx(90.0 * degree).epsilon(1e-9));
    CHECK(elevation(50) == Approx(90.0 * degree).epsilon(1e-9));
    // Keys 5.6 degrees apart on a circle: the spline runs a third of 1 - cos of that inside it.
    CHECK(elevation(130) == Approx(14.0 * degree).epsilon(2e-3));
    double turned = 0.0;
    for (int frame = 1; frame < 460; ++frame) {
        const dvec3 eye = eval::pose_at(*path, frame).eye;
        REQUIRE(eye.y > box.hi.y);
        REQUIRE(glm::distance(eval::pose_at(*path, frame).target, middle) < 1e-9 * reach);
        if (frame > 90) { // before, the eye is above the middle and has no azimuth to speak of
            turned += std::remainder(azimuth(frame) - azimuth(frame - 1), 2.0 * std::numbers::pi);
        }
    }
    CHECK(turned == Approx(270.0 * degree).epsilon(1e-9));
    CHECK(glm::distance(eval::pose_at(*path, 459).eye, middle) == Approx(0.25 * reach));
    // Every pose makes a view, the one that looks straight down too.
    for (int frame = 0; frame < 460; ++frame) {
        const PathPose pose = eval::pose_at(*path, frame);
        const auto view = farfield::look_at(
            pose.eye, pose.target, pose.up, farfield::perspective_lens(1.0, 1.0, 0.1, 1e4), 512, 512
        );
        REQUIRE(farfield::validate(view));
    }
}
