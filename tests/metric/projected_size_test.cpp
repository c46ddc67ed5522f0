#include "metric/reference.hpp"
#include "support/naive_metrics.hpp"
#include "support/random.hpp"
#include <farfield/metric/pixel_angle.hpp>
#include <farfield/metric/projected_size.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace farfield;
using support::kRoundoff;
using support::Real;
using support::RealVector;

template <typename T>
using Vector = glm::vec<3, T>;

template <typename T>
CameraPose<T> random_pose(support::Random& random) {
    CameraPose<T> pose;
    pose.eye = random.vector(T(-5), T(5));
    pose.forward = random.direction<T>();
    pose.right = glm::normalize(glm::cross(pose.forward, random.direction<T>()));
    pose.up = glm::cross(pose.right, pose.forward);
    return pose;
}

template <typename T>
struct Sight {
    Cube<T> cube;
    CameraPose<T> pose;
};

/// A cube that is seen up to 60 degrees off the axis, 2 to 2000 edges away.
template <typename T>
Sight<T> random_sight(support::Random& random) {
    for (;;) {
        Sight<T> sight;
        sight.pose = random_pose<T>(random);
        const Vector<T> way = random.direction<T>();
        sight.cube.edge = std::pow(T(10), random.uniform(T(-2), T(1)));
        const T distance = sight.cube.edge * std::pow(T(10), random.uniform(T(0.3), T(3.3)));
        sight.cube.center = sight.pose.eye + way * distance;
        const T nearest = distance * glm::dot(way, sight.pose.forward) - sight.cube.edge;
        if (glm::dot(way, sight.pose.forward) > T(0.5) && nearest > T(0)) {
            return sight;
        }
    }
}

/// In extended precision, corner by corner.
template <typename T>
Real reference_diameter(const Sight<T>& sight, T focal_px) {
    return naive::cube_diameter_px(
        RealVector(sight.cube.center),
        Real(sight.cube.edge),
        RealVector(sight.pose.eye),
        RealVector(sight.pose.right),
        RealVector(sight.pose.up),
        RealVector(sight.pose.forward),
        Real(focal_px)
    );
}

} // namespace

TEMPLATE_TEST_CASE("Sizes of cubes at their limits", "", float, double) {
    using T = TestType;
    constexpr T kInfinity = std::numeric_limits<T>::infinity();
    const CameraPose<T> pose;
    const auto measure = [&](const Vector<T>& center, T edge) {
        return metric::projected_size(Cube<T>{center, edge}, pose, T(512));
    };
    // The front face, half a unit before the centre, is one pixel wide.
    const auto one = measure({T(0), T(0), T(-512.5)}, T(1));
    CHECK(one.outcome == MetricOutcome::ok);
    CHECK(one.size.width_px == T(1));
    CHECK(one.size.height_px == T(1));
    CHECK(one.size.diameter_px == Approx(std::numbers::sqrt2));
    const auto none = measure({T(3), T(2), T(-9)}, T(0));
    CHECK(none.outcome == MetricOutcome::ok);
    CHECK(none.size.diameter_px == T(0));
    const Cube<T> point{{T(3), T(2), T(-9)}, T(0)};
    CHECK(metric::sphere_bound_px_unchecked(point, pose, T(512)) == T(0));
    CHECK(metric::jacobian_bound_px_unchecked(point, pose, T(512)) == T(0));
    // Around the eye, across its plane, touching it, behind it.
    for (const Vector<T>& center :
         {Vector<T>(T(0)),
          Vector<T>(T(3), T(0), T(0)),
          Vector<T>(T(3), T(0), T(-0.5)),
          Vector<T>(T(0), T(0), T(5))}) {
        const auto hidden = measure(center, T(1));
        CHECK(hidden.outcome == MetricOutcome::pi_behind);
        CHECK_FALSE(is_error(hidden.outcome));
        CHECK(hidden.size.width_px == kInfinity);
        CHECK(hidden.size.height_px == kInfinity);
        CHECK(hidden.size.diameter_px == kInfinity);
        const Cube<T> cube{center, T(1)};
        CHECK(metric::sphere_bound_px_unchecked(cube, pose, T(512)) == kInfinity);
        CHECK(metric::jacobian_bound_px_unchecked(cube, pose, T(512)) == kInfinity);
    }
    CHECK(measure({T(0), T(0), T(-9)}, T(-1)).outcome == MetricOutcome::err_distance);
    CHECK(measure({T(0), T(0), kInfinity}, T(1)).outcome == MetricOutcome::err_nonfinite);
    const Cube<T> cube{{T(0), T(0), T(-9)}, T(1)};
    CHECK(metric::projected_size(cube, pose, T(0)).outcome == MetricOutcome::err_fov);
    CHECK(std::isnan(metric::projected_size(cube, pose, T(0)).size.diameter_px));

    CHECK(metric::cube_angle_unchecked(T(2), T(0)) == T(0));
    CHECK(metric::cube_angle_unchecked(T(1), T(2)) == std::numbers::pi_v<T>);
    CHECK(metric::cube_angle(T(0), T(1)).outcome == MetricOutcome::err_distance);
    CHECK(metric::cube_angle(T(1), T(-1)).outcome == MetricOutcome::err_distance);
    CHECK(metric::cube_angle(kInfinity, T(1)).outcome == MetricOutcome::err_nonfinite);
}

TEMPLATE_TEST_CASE("Sizes are exact and bounds hold", "", float, double) {
    using T = TestType;
    support::Random random(81);
    Real widest_sphere = 0;
    Real widest_jacobian = 0;
    for (int i = 0; i < 20000; ++i) {
        const Sight<T> sight = random_sight<T>(random);
        const auto size = metric::projected_size_unchecked(sight.cube, sight.pose, T(800));
        const Real sphere = metric::sphere_bound_px_unchecked(sight.cube, sight.pose, T(800));
        const Real jacobian = metric::jacobian_bound_px_unchecked(sight.cube, sight.pose, T(800));
        const Real exact = reference_diameter(sight, T(800));
        // The axes of a float pose are orthonormal to a few units only; the bounds and the size are
        // those of an orthonormal one.
        const Real skew = 16 * kRoundoff<T>;
        CHECK(std::abs(Real(size.diameter_px) - exact) <= 8 * kRoundoff<T> * jacobian);
        CHECK(std::max(size.width_px, size.height_px) <= size.diameter_px);
        if (exact > sphere * (1 + skew) || exact > jacobian * (1 + skew)) {
            FAIL_CHECK("diameter " << exact << " sphere " << sphere << " jacobian " << jacobian);
        }
        const Real distance = glm::length(RealVector(sight.cube.center - sight.pose.eye));
        if (distance > 20 * sight.cube.edge) {
            widest_sphere = std::max(widest_sphere, sphere / exact);
            widest_jacobian = std::max(widest_jacobian, jacobian / exact);
        }
    }
    // As documented, for cubes 20 edges away and more, up to 60 degrees off the axis.
    CHECK(widest_sphere < 1.5L);
    CHECK(widest_jacobian < 1.7L);
}

TEMPLATE_TEST_CASE("Bounds hold for axes without rounding", "", float, double) {
    using T = TestType;
    support::Random random(82);
    const CameraPose<T> pose;
    for (int i = 0; i < 20000; ++i) {
        Sight<T> sight;
        sight.cube.edge = std::pow(T(10), random.uniform(T(-5), T(0)));
        sight.cube.center = {
            random.uniform(T(-3), T(3)), random.uniform(T(-3), T(3)), random.uniform(T(-9), T(-1))};
        const Real exact = reference_diameter(sight, T(800));
        const T sphere = metric::sphere_bound_px_unchecked(sight.cube, pose, T(800));
        const T jacobian = metric::jacobian_bound_px_unchecked(sight.cube, pose, T(800));
        // 1e-13: what the reference loses as a difference of projections, 1e5 units in extended.
        if (exact * (1 - 1e-13L) > sphere || exact * (1 - 1e-13L) > jacobian) {
            FAIL_CHECK("diameter " << exact << " sphere " << sphere << " jacobian " << jacobian);
        }
    }
}

TEMPLATE_TEST_CASE("Sizes depend on shapes, not on units or places", "", float, double) {
    using T = TestType;
    support::Random random(83);
    const auto on_grid = [](T x) { return std::round(x * 64) / 64; };
    for (int i = 0; i < 300; ++i) {
        const Sight<T> sight = random_sight<T>(random);
        const auto size = metric::projected_size_unchecked(sight.cube, sight.pose, T(800));
        const T sphere = metric::sphere_bound_px_unchecked(sight.cube, sight.pose, T(800));
        const T jacobian = metric::jacobian_bound_px_unchecked(sight.cube, sight.pose, T(800));
        for (const int exponent : {-60, -20, 7, 90}) {
            const T unit = metric::detail::power_of_two<T>(exponent);
            const Cube<T> cube{sight.cube.center * unit, sight.cube.edge * unit};
            CameraPose<T> pose = sight.pose;
            pose.eye *= unit;
            const auto scaled = metric::projected_size_unchecked(cube, pose, T(800));
            CHECK(scaled.width_px == size.width_px);
            CHECK(scaled.height_px == size.height_px);
            CHECK(scaled.diameter_px == size.diameter_px);
            CHECK(metric::sphere_bound_px_unchecked(cube, pose, T(800)) == sphere);
            CHECK(metric::jacobian_bound_px_unchecked(cube, pose, T(800)) == jacobian);
        }
        // Twice the pixels, twice the size.
        CHECK(
            metric::projected_size_unchecked(sight.cube, sight.pose, T(1600)).diameter_px ==
            2 * size.diameter_px
        );
        // Rolled by a quarter, width and height change places.
        CameraPose<T> rolled = sight.pose;
        rolled.right = sight.pose.up;
        rolled.up = -sight.pose.right;
        const auto turned = metric::projected_size_unchecked(sight.cube, rolled, T(800));
        CHECK(turned.width_px == size.height_px);
        CHECK(turned.height_px == size.width_px);
        CHECK(metric::sphere_bound_px_unchecked(sight.cube, rolled, T(800)) == sphere);
        // A cyclic change of axes changes the order of sums only.
        const auto cycled = [](const Vector<T>& v) { return Vector<T>(v.y, v.z, v.x); };
        const CameraPose<T> other{
            cycled(sight.pose.eye),
            cycled(sight.pose.right),
            cycled(sight.pose.up),
            cycled(sight.pose.forward)};
        const Cube<T> moved{cycled(sight.cube.center), sight.cube.edge};
        const auto after = metric::projected_size_unchecked(moved, other, T(800));
        CHECK(std::abs(after.diameter_px - size.diameter_px) <= 16 * T(kRoundoff<T>) * jacobian);
        // Moved by what is exact on a grid.
        Sight<T> here = sight;
        for (int axis = 0; axis < 3; ++axis) {
            here.cube.center[axis] = on_grid(std::fmod(here.cube.center[axis], T(64)));
            here.pose.eye[axis] = on_grid(here.pose.eye[axis]);
        }
        Sight<T> there = here;
        const Vector<T> shift(T(1024), T(-512), T(2048));
        there.cube.center += shift;
        there.pose.eye += shift;
        CHECK(
            metric::projected_size_unchecked(here.cube, here.pose, T(800)).diameter_px ==
            metric::projected_size_unchecked(there.cube, there.pose, T(800)).diameter_px
        );
    }
}

TEST_CASE("A cube within the angle of a pixel is at most a pixel wherever it is shown") {
    support::Random random(84);
    const auto scale = metric::pixel_scale(1.2, 1920, 1080).scale;
    const double epsilon = metric::angle_of_pixels_unchecked(scale, 1.0);
    double largest = 0;
    for (int i = 0; i < 20000; ++i) {
        CameraPose<double> pose = random_pose<double>(random);
        // On the image, half of them in a corner.
        const bool in_corner = random.below(2) == 0;
        const double x = in_corner ? 960.0 : random.uniform(-960.0, 960.0);
        const double y = in_corner ? 540.0 : random.uniform(-540.0, 540.0);
        const glm::dvec3 way = glm::normalize(
            pose.forward + pose.right * (x / scale.focal_px) + pose.up * (y / scale.focal_px)
        );
        const double edge = random.uniform(0.01, 10.0);
        // As near as the angle allows.
        const double distance = edge * std::numbers::sqrt3 / 2 / std::sin(epsilon / 2) * 1.0000001;
        REQUIRE(metric::cube_angle_unchecked(distance, edge) <= epsilon);
        const Cube<double> cube{pose.eye + way * distance, edge};
        const auto size = metric::projected_size_unchecked(cube, pose, scale.focal_px);
        largest = std::max(largest, size.diameter_px);
    }
    CHECK(largest <= 1.0);
    // Found, not guessed: cubes whose diagonal lies radially in a corner come near.
    CHECK(largest > 0.95);
}

TEMPLATE_TEST_CASE("Cubes look larger from nearer", "", float, double) {
    using T = TestType;
    T before = 0;
    for (int step = 40; step >= 0; --step) {
        const T distance = std::pow(T(1.5), static_cast<T>(step));
        const T angle = metric::cube_angle_unchecked(distance, T(1));
        CHECK(angle > before);
        before = angle;
    }
}
