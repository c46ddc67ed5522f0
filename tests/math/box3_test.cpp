#include "support/random.hpp"
#include <farfield/math/box3.hpp>

#include <catch2/catch.hpp>
#include <glm/vec3.hpp>

#include <cmath>
#include <limits>

using namespace farfield;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The world coordinate minus the origin is compared in extended precision: a comparison of doubles
/// could not tell whether the difference itself was rounded.
bool holds(const Box3f& local, const Box3d& world, const glm::dvec3& origin) {
    for (int axis = 0; axis < 3; ++axis) {
        using Real = long double;
        if (Real(local.lo[axis]) > Real(world.lo[axis]) - Real(origin[axis]) ||
            Real(local.hi[axis]) < Real(world.hi[axis]) - Real(origin[axis])) {
            return false;
        }
    }
    return true;
}

} // namespace

TEST_CASE("The default box is empty and neutral") {
    const Box3d nothing;
    const Box3d box{{1, 2, 3}, {4, 5, 6}};
    CHECK(is_empty(nothing));
    CHECK_FALSE(is_finite(nothing));
    CHECK(unite(nothing, box) == box);
    CHECK(unite(nothing, glm::dvec3(1, 2, 3)) == Box3d{{1, 2, 3}, {1, 2, 3}});
    CHECK(intersect(nothing, box) == nothing);
    CHECK_FALSE(contains(nothing, glm::dvec3(0)));
}

TEST_CASE("Flat, segment and point boxes are not empty") {
    CHECK_FALSE(is_empty(Box3d{{0, 0, 0}, {1, 1, 0}}));
    CHECK_FALSE(is_empty(Box3d{{0, 0, 0}, {1, 0, 0}}));
    const Box3d point{{1, 2, 3}, {1, 2, 3}};
    CHECK_FALSE(is_empty(point));
    CHECK(contains(point, {1, 2, 3}));
    CHECK(extent(point) == glm::dvec3(0));
    CHECK(distance(point, {1, 2, 7}) == 4);
}

TEST_CASE("A NaN makes a box empty, an infinity not finite") {
    const double nan = std::nan("");
    for (int axis = 0; axis < 3; ++axis) {
        Box3d box{{0, 0, 0}, {1, 1, 1}};
        box.lo[axis] = nan;
        CHECK(is_empty(box));
        CHECK_FALSE(is_finite(box));
        CHECK_FALSE(contains(box, {0.5, 0.5, 0.5}));
        box.lo[axis] = -kInfinity;
        CHECK_FALSE(is_empty(box));
        CHECK_FALSE(is_finite(box));
        box.lo[axis] = 2;
        CHECK(is_empty(box));
        CHECK(is_finite(box));
    }
}

TEST_CASE("Boxes are closed") {
    const Box3d box{{-1, -2, -3}, {1, 2, 3}};
    for (unsigned index = 0; index < 8; ++index) {
        const glm::dvec3 point = corner(box, index);
        CHECK(point.x == ((index & 1U) != 0U ? 1 : -1));
        CHECK(point.y == ((index & 2U) != 0U ? 2 : -2));
        CHECK(point.z == ((index & 4U) != 0U ? 3 : -3));
        CHECK(contains(box, point));
        CHECK(distance(box, point) == 0);
        CHECK_FALSE(contains(box, point * (1 + 1e-15)));
    }
    CHECK(distance(box, {4, 6, 0}) == 5);
    CHECK(distance(box, {0, 0, -5}) == 2);
}

TEST_CASE("Intersections may be empty, flat or nested") {
    const Box3d box{{0, 0, 0}, {2, 2, 2}};
    CHECK(is_empty(intersect(box, Box3d{{3, 0, 0}, {4, 2, 2}})));
    CHECK(intersect(box, Box3d{{2, 0, 0}, {4, 2, 2}}) == Box3d{{2, 0, 0}, {2, 2, 2}});
    CHECK(intersect(box, Box3d{{1, 1, 1}, {1.5, 1.5, 1.5}}) == Box3d{{1, 1, 1}, {1.5, 1.5, 1.5}});
    CHECK(inflate(box, glm::dvec3(1, 0, 2)) == Box3d{{-1, 0, -2}, {3, 2, 4}});
}

TEST_CASE("The centre of the largest box does not overflow") {
    constexpr double kMost = std::numeric_limits<double>::max();
    const Box3d box{glm::dvec3(kMost / 2), glm::dvec3(kMost)};
    CHECK(center(box).x == kMost * 0.75);
    CHECK(center(Box3d{glm::dvec3(-kMost), glm::dvec3(kMost)}) == glm::dvec3(0));
}

TEST_CASE("Local boxes lose no point of the world box") {
    support::Random random(1);
    for (int i = 0; i < 20000; ++i) {
        const double reach = std::pow(10.0, random.uniform(-3.0, 7.0));
        const glm::dvec3 origin = random.vector(-reach, reach);
        Box3d world;
        world = unite(world, origin + random.vector(-1.0, 1.0) * random.uniform(0.0, 1e4));
        world = unite(world, origin + random.vector(-1.0, 1.0) * random.uniform(0.0, 1e4));
        const Box3f local = local_box(world, origin);
        // The difference from the origin may itself be rounded in double; that is far below one
        // step of a float, except where it is itself a float.
        INFO("origin " << origin.x << ' ' << origin.y << ' ' << origin.z);
        for (int axis = 0; axis < 3; ++axis) {
            CHECK(static_cast<double>(local.lo[axis]) <= world.lo[axis] - origin[axis]);
            CHECK(static_cast<double>(local.hi[axis]) >= world.hi[axis] - origin[axis]);
            // And no more than one step larger than need be.
            CHECK(
                static_cast<double>(std::nextafter(local.lo[axis], 1e30F)) >
                world.lo[axis] - origin[axis]
            );
            CHECK(
                static_cast<double>(std::nextafter(local.hi[axis], -1e30F)) <
                world.hi[axis] - origin[axis]
            );
        }
    }
}

TEST_CASE("Local boxes of representable boxes are exact") {
    const glm::dvec3 origin(1e7, -1e7, 5e6);
    const Box3d world{origin + glm::dvec3(-1.5, 0.25, 3), origin + glm::dvec3(1.5, 8, 3)};
    const Box3f local = local_box(world, origin);
    CHECK(local == Box3f{{-1.5F, 0.25F, 3.0F}, {1.5F, 8.0F, 3.0F}});
    CHECK(holds(local, world, origin));
    CHECK(local_point(origin + glm::dvec3(0.5, -2, 0), origin) == glm::vec3(0.5F, -2.0F, 0.0F));
}

TEST_CASE("Local boxes round outwards at every scale") {
    const glm::dvec3 origin(0.0);
    for (const double x : {1e-45, 1e-42, 1e-38, 0.1, 1.0 / 3.0, 16777217.0, 1e38}) {
        const Box3d world{glm::dvec3(-x), glm::dvec3(x)};
        const Box3f local = local_box(world, origin);
        INFO(x);
        CHECK(holds(local, world, origin));
        CHECK(local.hi == -local.lo);
    }
    // What no float can hold becomes infinite, not smaller.
    const Box3f huge = local_box({glm::dvec3(-1e39), glm::dvec3(1e39)}, origin);
    CHECK(holds(huge, {glm::dvec3(-1e39), glm::dvec3(1e39)}, origin));
}
