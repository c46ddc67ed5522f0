#include "support/random.hpp"
#include <farfield/math/view.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

using namespace farfield;

namespace {

View good_view() {
    return look_at(
        {1, 2, 3}, {4, 5, 9}, {0, 1, 0}, perspective_lens(1.0, 4.0 / 3.0, 0.1, 100.0), 640, 480
    );
}

/// The message of a view that must not pass.
std::string reason(const View& view) {
    const Result<void> result = validate(view);
    REQUIRE_FALSE(result.has_value());
    CHECK(result.error().code == ErrorCode::invalid_argument);
    return result.error().message;
}

bool mentions(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

} // namespace

TEST_CASE("A good view is valid") {
    CHECK(validate(good_view()).has_value());
}

TEST_CASE("Each damage to a view is named with its value") {
    const double nan = std::nan("");
    const double infinity = std::numeric_limits<double>::infinity();
    View view = good_view();
    for (int axis = 0; axis < 3; ++axis) {
        view = good_view();
        view.eye[axis] = nan;
        CHECK(mentions(reason(view), "eye is nan"));
        view.eye[axis] = -infinity;
        CHECK(mentions(reason(view), "eye is -inf"));
    }
    view = good_view();
    view.camera_to_world *= 1.001;
    CHECK(mentions(reason(view), "camera_to_world"));
    view.camera_to_world[1] = view.camera_to_world[0];
    CHECK(mentions(reason(view), "camera_to_world"));
    view.camera_to_world[1][1] = nan;
    CHECK(mentions(reason(view), "camera_to_world"));

    const auto with_lens = [](auto&& change) {
        View changed = good_view();
        change(changed.lens);
        return changed;
    };
    CHECK(mentions(reason(with_lens([](Lens& l) { l.left = l.right; })), "field of view"));
    CHECK(mentions(reason(with_lens([](Lens& l) { l.bottom = l.top; })), "field of view"));
    CHECK(mentions(reason(with_lens([&](Lens& l) { l.top = nan; })), "field of view"));
    CHECK(mentions(reason(with_lens([&](Lens& l) { l.right = infinity; })), "field of view"));
    CHECK(mentions(reason(with_lens([](Lens& l) { l.right = 2e6; })), "field of view"));
    CHECK(mentions(reason(with_lens([](Lens& l) { l.near_distance = 0; })), "near distance is 0"));
    CHECK(mentions(reason(with_lens([&](Lens& l) { l.near_distance = nan; })), "near distance"));
    CHECK(mentions(
        reason(with_lens([](Lens& l) { l.far_distance = l.near_distance; })), "far distance is 0.1"
    ));
    CHECK(mentions(reason(with_lens([&](Lens& l) { l.far_distance = infinity; })), "far distance"));

    for (const int pixels : {0, -1, 16385}) {
        view = good_view();
        view.width = pixels;
        CHECK(mentions(reason(view), "width is " + std::to_string(pixels)));
        view = good_view();
        view.height = pixels;
        CHECK(mentions(reason(view), "height is " + std::to_string(pixels)));
    }
    view = good_view();
    view.width = 1;
    view.height = 16384;
    CHECK(validate(view).has_value());
}

TEST_CASE("A view looks at its target, whatever the direction") {
    support::Random random(1);
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 eye = random.vector(-1e6, 1e6);
        const glm::dvec3 target = eye + random.direction<double>() * random.uniform(1.0, 1e4);
        const glm::dvec3 up = random.direction<double>() * random.uniform(0.1, 10.0);
        const View view = look_at(eye, target, up, good_view().lens, 640, 480);
        CHECK(validate(view).has_value());
        CHECK(glm::determinant(view.camera_to_world) == Approx(1.0));
        const glm::dvec3 forward = -view.camera_to_world[2];
        CHECK(glm::length(forward - glm::normalize(target - eye)) < 1e-12);
        // Up leans forward or back, never to a side: no roll.
        CHECK(std::abs(glm::dot(view.camera_to_world[0], glm::normalize(up))) < 1e-6);
        CHECK(glm::dot(view.camera_to_world[1], up) >= 0);
    }
}

TEST_CASE("Looking along up is a valid view, the same on every run") {
    for (const double sign : {-1.0, 1.0}) {
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 up(0);
            up[axis] = 1;
            const View view =
                look_at({5, 6, 7}, glm::dvec3(5, 6, 7) + up * sign, up, good_view().lens, 64, 48);
            CHECK(validate(view).has_value());
            CHECK(glm::length(-view.camera_to_world[2] - up * sign) < 1e-15);
            CHECK(
                view ==
                look_at({5, 6, 7}, glm::dvec3(5, 6, 7) + up * sign, up, good_view().lens, 64, 48)
            );
        }
    }
}

TEST_CASE("A perspective lens has the vertical field of view") {
    const double fov_y = std::numbers::pi / 2;
    const Lens lens = perspective_lens(fov_y, 2.0, 0.5, 50.0);
    CHECK(lens.top == Approx(1.0));
    CHECK(lens.bottom == -lens.top);
    CHECK(lens.right == Approx(2.0));
    CHECK(lens.left == -lens.right);
    CHECK(lens.near_distance == 0.5);
    CHECK(lens.far_distance == 50.0);
    View view = good_view();
    view.lens = lens;
    view.height = 300;
    CHECK(focal_length_px(view) == Approx(150.0));
}

TEST_CASE("Projection maps the frustum's corners to clip space, near to 1 and far to 0") {
    Lens lens;
    lens.left = -0.25;
    lens.right = 1.0;
    lens.bottom = -0.5;
    lens.top = 2.0;
    lens.near_distance = 0.5;
    lens.far_distance = 2000.0;
    const glm::mat4 projection = projection_matrix(lens);
    for (const double z : {lens.near_distance, lens.far_distance}) {
        for (const bool at_right : {false, true}) {
            for (const bool at_top : {false, true}) {
                const double x = at_right ? lens.right : lens.left;
                const double y = at_top ? lens.top : lens.bottom;
                const glm::vec4 clip = projection * glm::vec4(glm::dvec3(x * z, y * z, -z), 1.0);
                // Entries and products are rounded to float, coordinates are at most 4000.
                CHECK(clip.x / clip.w == Approx(at_right ? 1.0 : -1.0).margin(1e-6));
                CHECK(clip.y / clip.w == Approx(at_top ? 1.0 : -1.0).margin(1e-6));
                CHECK(clip.z / clip.w == Approx(z < 1.0 ? 1.0 : 0.0).margin(1e-6));
                CHECK(clip.w == Approx(z));
            }
        }
    }
    // Depth falls with distance.
    float before = 2.0F;
    for (int step = 0; step <= 20; ++step) {
        const float z = 0.5F * std::pow(1.5F, static_cast<float>(step));
        const glm::vec4 clip = projection * glm::vec4(0.0F, 0.0F, -z, 1.0F);
        CHECK(clip.z / clip.w < before);
        before = clip.z / clip.w;
    }
}

TEST_CASE("Lenses of parts tile the lens of the whole") {
    const View view = good_view();
    CHECK(sub_lens(view, 0, 0, 0, 0).left == view.lens.left);
    const Lens whole = sub_lens(view, 0, 0, 640, 480);
    CHECK(whole.right == Approx(view.lens.right).epsilon(1e-14));
    CHECK(whole.top == Approx(view.lens.top).epsilon(1e-14));
    CHECK(whole.near_distance == view.lens.near_distance);
    CHECK(whole.far_distance == view.lens.far_distance);
    const Lens left = sub_lens(view, 0, 0, 320, 480);
    const Lens right = sub_lens(view, 320, 0, 640, 480);
    CHECK(left.right == right.left);
    CHECK(left.right == Approx(0.0).margin(1e-15));
    const Lens lower = sub_lens(view, 0, 0, 640, 120);
    CHECK(lower.top == Approx(view.lens.bottom / 2));
    // Beyond the image: the border of an image page.
    const Lens wide = sub_lens(view, -32, -24, 672, 504);
    CHECK(wide.left == Approx(view.lens.left * 1.1));
    CHECK(wide.top == Approx(view.lens.top * 1.1));
}

TEST_CASE("A pixel of a part is the same pixel of the whole") {
    support::Random random(2);
    const View view = good_view();
    for (int i = 0; i < 500; ++i) {
        const double x0 = random.uniform(-100.0, 600.0);
        const double y0 = random.uniform(-100.0, 400.0);
        const double width = random.uniform(1.0, 300.0);
        const double height = random.uniform(1.0, 300.0);
        View part = view;
        part.lens = sub_lens(view, x0, y0, x0 + width, y0 + height);
        const double x = random.uniform(0.0, 1.0);
        const double y = random.uniform(0.0, 1.0);
        const double part_x = part.lens.left + x * (part.lens.right - part.lens.left);
        const double part_y = part.lens.bottom + y * (part.lens.top - part.lens.bottom);
        const Lens here = sub_lens(view, x0 + x * width, y0 + y * height, 0, 0);
        CHECK(part_x == Approx(here.left).margin(1e-12));
        CHECK(part_y == Approx(here.bottom).margin(1e-12));
    }
}

TEST_CASE("Motion is estimated exactly for constant acceleration") {
    const glm::dvec3 start(10, -20, 30);
    const glm::dvec3 velocity(1, 2, -3);
    const glm::dvec3 acceleration(0.5, -0.25, 2);
    const double dt = 0.125;
    const auto at = [&](double t) { return start + velocity * t + acceleration * (t * t / 2); };
    const Motion motion = estimate_motion(at(2 * dt), at(dt), at(0), dt);
    // All numbers here are multiples of a power of two: no rounding at all.
    CHECK(motion.velocity == velocity + acceleration * (2 * dt));
    CHECK(motion.acceleration == acceleration);
    CHECK(motion.frame_seconds == dt);
    const Motion rest = estimate_motion(start, start, start, dt);
    CHECK(rest.velocity == glm::dvec3(0));
    CHECK(rest.acceleration == glm::dvec3(0));
}
