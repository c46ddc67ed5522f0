#include "metric/reference.hpp"
#include "support/random.hpp"
#include <farfield/math/view.hpp>
#include <farfield/metric/star_shape.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace farfield;
using support::kRoundoff;

template <typename T>
using Vector = glm::vec<3, T>;

constexpr double radians(double degrees) {
    return degrees * std::numbers::pi / 180;
}

template <typename T>
CameraPose<T> random_pose(support::Random& random) {
    CameraPose<T> pose;
    pose.eye = random.vector(T(-5), T(5));
    pose.forward = random.direction<T>();
    pose.right = glm::normalize(glm::cross(pose.forward, random.direction<T>()));
    pose.up = glm::cross(pose.right, pose.forward);
    return pose;
}

/// Distance of the nearest point of a cubic grid of spacing 1 that serves a pose; infinite where
/// there is none within `reach`.
template <typename T, typename IsOfGrid>
T nearest_serving(
    const CameraPose<T>& pose, const glm::vec<2, T>& tangents, T step, T reach, IsOfGrid is_of_grid
) {
    T nearest = std::numeric_limits<T>::infinity();
    const auto first = [&](T x) { return static_cast<int>(std::floor((x - reach) / step)); };
    const auto last = [&](T x) { return static_cast<int>(std::ceil((x + reach) / step)); };
    for (int x = first(pose.eye.x); x <= last(pose.eye.x); ++x) {
        for (int y = first(pose.eye.y); y <= last(pose.eye.y); ++y) {
            for (int z = first(pose.eye.z); z <= last(pose.eye.z); ++z) {
                const Vector<T> point(
                    static_cast<T>(x) * step, static_cast<T>(y) * step, static_cast<T>(z) * step
                );
                if (is_of_grid(x, y, z) && metric::serves_unchecked(pose, tangents, point)) {
                    nearest = std::min(nearest, glm::length(point - pose.eye));
                }
            }
        }
    }
    return nearest;
}

} // namespace

TEMPLATE_TEST_CASE("Reversed frusta are closed", "", float, double) {
    using T = TestType;
    const CameraPose<T> pose;
    const glm::vec<2, T> tangents(T(0.5), T(0.25));
    const auto margin = [&](const Vector<T>& point) {
        return metric::reverse_frustum_margin_unchecked(pose, tangents, point);
    };
    CHECK(margin(Vector<T>(T(0))) == T(0));
    CHECK(margin({T(1), T(0), T(2)}) == T(0));
    CHECK(margin({T(0), T(0.5), T(2)}) == T(0));
    CHECK(margin({T(1), T(0.5), T(2)}) == T(0));
    CHECK(margin({std::nextafter(T(1), T(2)), T(0), T(2)}) < T(0));
    CHECK(margin({T(0), std::nextafter(T(-0.5), T(-1)), T(2)}) < T(0));
    CHECK(margin({T(0), T(0), T(2)}) == T(0.5));
    // Before the eye and beside it.
    CHECK(margin({T(0), T(0), T(-2)}) == T(-2));
    CHECK(margin({T(1), T(0), T(0)}) == T(-1));
    CHECK(metric::serves_unchecked(pose, tangents, pose.eye));

    using metric::reverse_frustum_margin;
    const Vector<T> origin(T(0));
    CHECK(reverse_frustum_margin(pose, tangents, origin).outcome == MetricOutcome::ok);
    CHECK(reverse_frustum_margin(pose, {T(0), T(1)}, origin).outcome == MetricOutcome::err_fov);
    CHECK(reverse_frustum_margin(pose, {T(1), T(-1)}, origin).outcome == MetricOutcome::err_fov);
    const Vector<T> nowhere(std::numeric_limits<T>::infinity(), T(0), T(0));
    CHECK(reverse_frustum_margin(pose, tangents, nowhere).outcome == MetricOutcome::err_nonfinite);
}

TEST_CASE("The pose of a view looks where the view looks") {
    const View view = look_at({1, 2, 3}, {4, 1, -5}, {0, 1, 0}, {}, 640, 480);
    const CameraPose<double> pose = metric::camera_pose(view);
    CHECK(pose.eye == view.eye);
    const glm::dvec3 ahead = glm::normalize(glm::dvec3(3, -1, -8));
    CHECK(glm::length(pose.forward - ahead) < 1e-15);
    CHECK(glm::length(glm::cross(pose.right, pose.up) + pose.forward) < 1e-15);
}

TEST_CASE("What serves a camera shows all that it sees") {
    support::Random random(91);
    int served = 0;
    for (int i = 0; i < 3000; ++i) {
        const CameraPose<double> pose = random_pose<double>(random);
        const glm::dvec2 tangents(random.uniform(0.2, 2.0), random.uniform(0.2, 2.0));
        const glm::dvec3 point = pose.eye + random.vector(-3.0, 3.0);
        const double margin = metric::reverse_frustum_margin_unchecked(pose, tangents, point);
        served += margin >= 0 ? 1 : 0;
        // Rays along the edges of the frustum, where both frusta differ most.
        bool all_shown = true;
        for (unsigned edge = 0; edge < 4; ++edge) {
            const double x = (edge & 1U) != 0U ? tangents.x : -tangents.x;
            const double y = (edge & 2U) != 0U ? tangents.y : -tangents.y;
            const glm::dvec3 ray = pose.forward + pose.right * x + pose.up * y;
            for (const double depth : {0.0, 1.0, 1e3}) {
                const glm::dvec3 seen = pose.eye + ray * depth - point;
                const double z = glm::dot(seen, pose.forward);
                // Rounding of coordinates of 1e3 and 1e4.
                constexpr double kSlack = 1e-11;
                all_shown = all_shown && z >= -kSlack &&
                            std::abs(glm::dot(seen, pose.right)) <= tangents.x * z + kSlack &&
                            std::abs(glm::dot(seen, pose.up)) <= tangents.y * z + kSlack;
            }
        }
        if (std::abs(margin) > 1e-10) {
            CHECK(all_shown == (margin > 0));
        }
    }
    CHECK(served > 100);
}

TEMPLATE_TEST_CASE("Margins depend on shapes, not on units, places or frames", "", float, double) {
    using T = TestType;
    support::Random random(92);
    const auto on_grid = [](const Vector<T>& v) { return glm::round(v * T(64)) / T(64); };
    for (int i = 0; i < 300; ++i) {
        CameraPose<T> pose = random_pose<T>(random);
        pose.eye = on_grid(pose.eye);
        const glm::vec<2, T> tangents(random.uniform(T(0.2), T(2)), random.uniform(T(0.2), T(2)));
        const Vector<T> point = on_grid(random.vector(T(-9), T(9)));
        const T margin = metric::reverse_frustum_margin_unchecked(pose, tangents, point);
        for (const int exponent : {-60, 7, 90}) {
            const T unit = metric::detail::power_of_two<T>(exponent);
            CameraPose<T> scaled = pose;
            scaled.eye *= unit;
            CHECK(
                metric::reverse_frustum_margin_unchecked<T>(scaled, tangents, point * unit) ==
                margin * unit
            );
        }
        const Vector<T> shift(T(4096), T(-1024), T(2048));
        CameraPose<T> moved = pose;
        moved.eye += shift;
        CHECK(
            metric::reverse_frustum_margin_unchecked<T>(moved, tangents, point + shift) == margin
        );
        const auto cycled = [](const Vector<T>& v) { return Vector<T>(v.y, v.z, v.x); };
        const CameraPose<T> other{
            cycled(pose.eye), cycled(pose.right), cycled(pose.up), cycled(pose.forward)};
        const T after = metric::reverse_frustum_margin_unchecked(other, tangents, cycled(point));
        const T apart = glm::length(point - pose.eye);
        const T limit = 8 * T(kRoundoff<T>) * apart * (2 + tangents.x + tangents.y);
        CHECK(std::abs(after - margin) <= limit);
    }
}

TEST_CASE("Star radii by field of view") {
    struct Row {
        double degrees;
        double planar;
        double guaranteed;
        double guaranteed_odd;
    };
    for (const Row& row :
         {Row{54, 2.0434, 2.774, 1.60},
          Row{60, 1.9319, 2.598, 1.50},
          Row{75, 1.7257, 2.289, 1.32},
          Row{90, 1.5811, 2.091, 1.21}}) {
        INFO(row.degrees);
        const HalfAngles<double> angles{radians(row.degrees / 2), radians(row.degrees / 2)};
        const auto shape = metric::star_shape_unchecked(angles, 1.0);
        REQUIRE(shape.planar_radius.has_value());
        CHECK(*shape.planar_radius == Approx(row.planar).margin(1e-4));
        CHECK(shape.guaranteed_radius == Approx(row.guaranteed).margin(6e-4));
        CHECK(shape.paper_radius == 2.0);
        const double odd = metric::guaranteed_star_radius_unchecked(
            angles, metric::odd_level_covering_radius(1.0)
        );
        CHECK(odd == Approx(row.guaranteed_odd).margin(6e-3));
    }
    // From 53.1301 degrees on, and what is narrower has no planar radius.
    const auto has_planar = [](double degrees) {
        const HalfAngles<double> angles{radians(degrees / 2), radians(degrees / 2)};
        return metric::star_shape_unchecked(angles, 1.0).planar_radius.has_value();
    };
    CHECK(has_planar(53.1302));
    CHECK_FALSE(has_planar(53.13));
    // The smaller of both angles decides.
    const HalfAngles<double> wide{radians(50), radians(30)};
    CHECK(metric::guaranteed_star_radius_unchecked(wide, 1.0) == Approx(3.0));
}

TEMPLATE_TEST_CASE("Star shapes out of range are named", "", float, double) {
    using T = TestType;
    constexpr T kRightAngle = std::numbers::pi_v<T> / 2;
    const auto outcome = [](T x, T y, T spacing) {
        const auto measured = metric::star_shape(HalfAngles<T>{x, y}, spacing);
        CHECK(std::isnan(measured.shape.guaranteed_radius) == is_error(measured.outcome));
        return measured.outcome;
    };
    CHECK(outcome(T(0.5), T(0.5), T(1)) == MetricOutcome::ok);
    CHECK(outcome(T(0), T(0.5), T(1)) == MetricOutcome::err_fov);
    CHECK(outcome(T(0.5), kRightAngle, T(1)) == MetricOutcome::err_fov);
    CHECK(outcome(T(0.5), T(0.5), T(0)) == MetricOutcome::err_distance);
    CHECK(outcome(T(0.5), T(0.5), std::nanf("")) == MetricOutcome::err_nonfinite);
}

TEMPLATE_TEST_CASE("Every pose is served within the guaranteed radius", "", float, double) {
    using T = TestType;
    support::Random random(93);
    const auto every = [](int, int, int) { return true; };
    // Of the half grid, points with two odd coordinates are the middles of faces.
    const auto no_faces = [](int x, int y, int z) { return (x & 1) + (y & 1) + (z & 1) != 2; };
    T largest = 0;
    T largest_odd = 0;
    for (int i = 0; i < 400; ++i) {
        const CameraPose<T> pose = random_pose<T>(random);
        const T half = static_cast<T>(radians(random.uniform(27.0, 50.0)));
        const T wider = half + random.uniform(T(0), T(0.3));
        const HalfAngles<T> angles =
            random.below(2) == 0 ? HalfAngles<T>{half, wider} : HalfAngles<T>{wider, half};
        const glm::vec<2, T> tangents(std::tan(angles.x), std::tan(angles.y));
        const T radius =
            metric::guaranteed_star_radius_unchecked(angles, metric::cubic_covering_radius(T(1)));
        const T nearest = nearest_serving(pose, tangents, T(1), radius, every);
        CHECK(nearest <= radius);
        largest = std::max(largest, nearest / radius);
        const T odd_radius = metric::guaranteed_star_radius_unchecked(
            angles, metric::odd_level_covering_radius(T(1))
        );
        const T odd = nearest_serving(pose, tangents, T(0.5), odd_radius, no_faces);
        CHECK(odd <= odd_radius);
        largest_odd = std::max(largest_odd, odd / odd_radius);
    }
    // The search comes near enough for the bound to mean something.
    CHECK(largest > T(0.6));
    CHECK(largest_odd > T(0.6));
}

TEST_CASE("The paper's radius misses poses at 54 degrees, even in a plane of the grid") {
    const double half = radians(27);
    const glm::dvec2 tangents(std::tan(half), std::tan(half));
    const HalfAngles<double> angles{half, half};
    const auto shape = metric::star_shape_unchecked(angles, 1.0);
    REQUIRE(shape.planar_radius.has_value());
    double largest = 0;
    for (int i = 0; i < 400; ++i) {
        for (int j = 0; j < 40; ++j) {
            CameraPose<double> pose;
            // Turned to look along an axis of the grid, the eye just past a pair of its points.
            const double yaw = radians(90.0 * j / 40);
            pose.forward = {std::sin(yaw), 0, -std::cos(yaw)};
            pose.right = {std::cos(yaw), 0, std::sin(yaw)};
            pose.eye = {0.5, 0, -i / 400.0};
            const auto in_plane = [](int, int y, int) { return y == 0; };
            largest = std::max(largest, nearest_serving(pose, tangents, 1.0, 2.1, in_plane));
        }
    }
    CHECK(largest > shape.paper_radius);
    CHECK(largest <= *shape.planar_radius * (1 + 1e-12));
}

TEMPLATE_TEST_CASE("Star radii grow with the spacing and fall with the angle", "", float, double) {
    using T = TestType;
    T before = std::numeric_limits<T>::infinity();
    for (int step = 1; step < 30; ++step) {
        const T half = static_cast<T>(step) / 20;
        const HalfAngles<T> angles{half, half};
        const T radius = metric::guaranteed_star_radius_unchecked(angles, T(1));
        CHECK(radius < before);
        before = radius;
        const auto shape = metric::star_shape_unchecked(angles, T(3));
        const auto scaled = metric::star_shape_unchecked(angles, T(96));
        CHECK(scaled.guaranteed_radius == 32 * shape.guaranteed_radius);
        CHECK(scaled.half_spacing == 32 * shape.half_spacing);
        CHECK(scaled.planar_radius.has_value() == shape.planar_radius.has_value());
    }
}
