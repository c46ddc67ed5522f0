#include "support/random.hpp"
#include <farfield/math/triangle_box.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

using namespace farfield;

namespace {

using Whole = glm::vec<3, std::int64_t>;

std::int64_t dot(const Whole& a, const Whole& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

Whole cross(const Whole& a, const Whole& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Segment and closed box in whole numbers: the slabs' parameters compared as fractions.
bool segment_meets(const Whole& lo, const Whole& hi, const Whole& a, const Whole& b) {
    // The entry is the largest, the exit the least of fractions with positive denominators.
    std::pair<std::int64_t, std::int64_t> enter{0, 1};
    std::pair<std::int64_t, std::int64_t> leave{1, 1};
    const auto less = [](const auto& p, const auto& q) {
        return p.first * q.second < q.first * p.second;
    };
    for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t along = b[axis] - a[axis];
        if (along == 0) {
            if (a[axis] < lo[axis] || a[axis] > hi[axis]) {
                return false;
            }
            continue;
        }
        const std::int64_t sign = along > 0 ? 1 : -1;
        const std::int64_t near = (along > 0 ? lo : hi)[axis];
        const std::int64_t far = (along > 0 ? hi : lo)[axis];
        enter = std::max(enter, {sign * (near - a[axis]), sign * along}, less);
        leave = std::min(leave, {sign * (far - a[axis]), sign * along}, less);
    }
    return !less(leave, enter);
}

/// Segment and the inside of a triangle that it crosses, by the signs of volumes.
bool segment_crosses(const std::array<Whole, 3>& t, const Whole& a, const Whole& b) {
    const Whole normal = cross(t[1] - t[0], t[2] - t[0]);
    const std::int64_t side_a = dot(normal, a - t[0]);
    const std::int64_t side_b = dot(normal, b - t[0]);
    if ((side_a > 0 && side_b > 0) || (side_a < 0 && side_b < 0) || side_a == side_b) {
        return false; // on one side, or in the plane, where the edges tell
    }
    int positive = 0;
    int negative = 0;
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const std::int64_t volume = dot(cross(t[corner] - a, t[(corner + 1) % 3] - a), b - a);
        positive += volume > 0 ? 1 : 0;
        negative += volume < 0 ? 1 : 0;
    }
    return positive == 0 || negative == 0;
}

/// A point in the plane of a triangle and inside it.
bool in_triangle(const std::array<Whole, 3>& t, const Whole& point) {
    const Whole normal = cross(t[1] - t[0], t[2] - t[0]);
    if (normal == Whole(0) || dot(normal, point - t[0]) != 0) {
        return false; // without an inside, the edges tell
    }
    for (std::size_t corner = 0; corner < 3; ++corner) {
        const Whole along = t[(corner + 1) % 3] - t[corner];
        if (dot(normal, cross(along, point - t[corner])) < 0) {
            return false;
        }
    }
    return true;
}

/// By another way than axes: what a triangle and a box share has a corner, which lies on an edge of
/// the triangle, or is one of the box, or lies on an edge of the box. Exact.
bool meets(const Whole& lo, const Whole& hi, const std::array<Whole, 3>& t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
        if (segment_meets(lo, hi, t[corner], t[(corner + 1) % 3])) {
            return true;
        }
    }
    for (unsigned from = 0; from < 8; ++from) {
        for (unsigned bit = 1; bit < 8; bit *= 2) {
            const auto at = [&](unsigned index) {
                return Whole(
                    (index & 1U) != 0 ? hi.x : lo.x,
                    (index & 2U) != 0 ? hi.y : lo.y,
                    (index & 4U) != 0 ? hi.z : lo.z
                );
            };
            if (in_triangle(t, at(from)) ||
                ((from & bit) == 0 && segment_crosses(t, at(from), at(from | bit)))) {
                return true;
            }
        }
    }
    return false;
}

Triangle3d moved(const Triangle3d& triangle, const glm::dvec3& by, double scale = 1.0) {
    return {triangle[0] * scale + by, triangle[1] * scale + by, triangle[2] * scale + by};
}

Box3d moved(const Box3d& box, const glm::dvec3& by, double scale = 1.0) {
    return {box.lo * scale + by, box.hi * scale + by};
}

constexpr Box3d kUnit{{0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}};

} // namespace

TEST_CASE("points, segments and slivers against a box") {
    const auto point = [](double x, double y, double z) -> Triangle3d {
        const glm::dvec3 p(x, y, z);
        return {p, p, p};
    };
    CHECK(overlaps(kUnit, point(0.5, 0.5, 0.5)));
    CHECK(overlaps(kUnit, point(1.0, 1.0, 1.0)));
    CHECK_FALSE(overlaps(kUnit, point(1.0, std::nextafter(1.0, 2.0), 1.0)));
    CHECK_FALSE(overlaps(kUnit, point(-1e-300, 0.5, 0.5)));

    // Past an edge of the box, inside all three slabs of their own boxes; any two of the corners
    // may be the double ones.
    const glm::dvec3 a(-0.5, 0.4, 0.5);
    const glm::dvec3 misses(0.4, 1.5, 0.5);
    const glm::dvec3 hits(0.7, 1.5, 0.5);
    for (const auto& [end, expected] : {std::pair{misses, false}, std::pair{hits, true}}) {
        CHECK(overlaps(kUnit, {a, a, end}) == expected);
        CHECK(overlaps(kUnit, {a, end, end}) == expected);
        CHECK(overlaps(kUnit, {end, a, end}) == expected);
        CHECK(overlaps(kUnit, {a, (a + end) * 0.5, end}) == expected); // collinear, three corners
        // A sliver, a millionth as wide as it is long.
        CHECK(overlaps(kUnit, {a, end, end + glm::dvec3(0.0, 0.0, 1e-6)}) == expected);
    }
}

TEST_CASE("a box without thickness, and one that is a point") {
    const Box3d flat{{0.0, 0.0, 0.0}, {1.0, 0.0, 1.0}};
    CHECK(overlaps(flat, {{{0.2, -1.0, 0.2}, {0.3, 1.0, 0.2}, {0.2, 1.0, 0.9}}}));
    CHECK_FALSE(overlaps(flat, {{{0.2, 0.5, 0.2}, {0.3, 1.0, 0.2}, {0.2, 1.0, 0.9}}}));
    const Box3d point{{0.25, 0.25, 0.5}, {0.25, 0.25, 0.5}};
    CHECK(overlaps(point, {{{0.0, 0.0, 0.5}, {1.0, 0.0, 0.5}, {0.0, 1.0, 0.5}}}));
    CHECK(overlaps(point, {{{0.5, 0.0, 0.5}, {0.0, 0.5, 0.5}, {1.0, 1.0, 0.5}}})); // on its edge
    CHECK_FALSE(overlaps(point, {{{0.6, 0.0, 0.5}, {0.0, 0.6, 0.5}, {1.0, 1.0, 0.5}}}));
}

TEST_CASE("touching counts") {
    // On a face, along an edge, at a corner; then as little apart as double can say.
    const Triangle3d wall{{{1.0, -2.0, -2.0}, {1.0, 4.0, -2.0}, {1.0, -2.0, 4.0}}};
    CHECK(overlaps(kUnit, wall));
    CHECK_FALSE(overlaps(kUnit, moved(wall, {1e-15, 0.0, 0.0})));
    // The plane x + y + z = 3 through the corner (1, 1, 1) alone.
    const Triangle3d corner{{{3.0, 0.0, 0.0}, {0.0, 3.0, 0.0}, {0.0, 0.0, 3.0}}};
    CHECK(overlaps(kUnit, corner));
    CHECK_FALSE(overlaps(kUnit, moved(corner, {1e-12, 0.0, 0.0})));
    // An edge of the triangle across an edge of the box, at one point.
    const Triangle3d edge{{{2.0, 0.0, 0.5}, {0.0, 2.0, 0.5}, {3.0, 3.0, 0.9}}};
    CHECK(overlaps(kUnit, edge));
    CHECK_FALSE(overlaps(kUnit, moved(edge, {1e-12, 0.0, 0.0})));
}

TEST_CASE("whole numbers: equal to an exact test by another way") {
    // Up to 20: all that the test computes is exact in double, and its allowance for rounding,
    // 1e-15 of sums below 1e5, far below the least number that is not zero. Small numbers make
    // every kind of degeneracy often.
    support::Random random(1);
    int hits = 0;
    int boxes_alone = 0; ///< cases that the boxes would get wrong
    for (int round = 0; round < 60'000; ++round) {
        const int reach = round % 3 == 0 ? 2 : round % 3 == 1 ? 6 : 20;
        const auto point = [&] {
            const auto one = [&] {
                return static_cast<std::int64_t>(random.below(2U * static_cast<unsigned>(reach) + 1)
                       ) -
                       reach;
            };
            const std::int64_t x = one();
            const std::int64_t y = one();
            return Whole(x, y, one());
        };
        const Whole one = point();
        const Whole other = point();
        const Whole lo = glm::min(one, other);
        const Whole hi = glm::max(one, other);
        const std::array<Whole, 3> t{point(), point(), point()};
        const Box3d box{glm::dvec3(lo), glm::dvec3(hi)};
        const Triangle3d triangle{glm::dvec3(t[0]), glm::dvec3(t[1]), glm::dvec3(t[2])};
        const bool expected = meets(lo, hi, t);
        CAPTURE(round, lo.x, lo.y, lo.z, hi.x, hi.y, hi.z);
        REQUIRE(overlaps(box, triangle) == expected);
        const Box3d clipped = clipped_bounds(box, triangle);
        // Clipping rounds where it cuts, so it may lose what only touches.
        REQUIRE((is_empty(clipped) || expected));
        hits += expected ? 1 : 0;
        boxes_alone += !expected && !is_empty(intersect(box, bounds(triangle))) ? 1 : 0;
    }
    CHECK(hits > 10'000);
    CHECK(boxes_alone > 1'000);
}

TEST_CASE("a point of the triangle in the box is never missed, wherever both are") {
    support::Random random(2);
    for (const double far_off : {0.0, 1e3, 1e7}) {
        for (const double scale : {1e-3, 1.0, 1e4}) {
            const glm::dvec3 offset(far_off, -far_off, 0.5 * far_off);
            for (int round = 0; round < 3000; ++round) {
                Triangle3d triangle;
                for (glm::dvec3& corner : triangle) {
                    corner = offset + scale * random.vector(-1.0, 1.0);
                }
                if (round % 4 == 0) { // a sliver, down to a segment after rounding
                    triangle[2] = triangle[0] +
                                  (triangle[1] - triangle[0]) * random.uniform(-1.0, 2.0) +
                                  scale * 1e-12 * random.vector(-1.0, 1.0);
                }
                const double u = random.uniform(0.0, 1.0);
                const double v = random.uniform(0.0, 1.0 - u);
                // Rounded: off the triangle by some units in the last place of its coordinates.
                const glm::dvec3 p =
                    triangle[0] + (triangle[1] - triangle[0]) * u + (triangle[2] - triangle[0]) * v;
                const double off = 4.0 * 2.3e-16 * (far_off + 4.0 * scale);
                // The point at a corner of the box, so that the box hardly meets the triangle.
                const double size = 2.0 * off + scale * std::pow(10.0, random.uniform(-6.0, 0.0));
                Box3d box{p - off, p - off + size};
                for (int axis = 0; axis < 3; ++axis) {
                    if (random.below(2) == 0) {
                        box.lo[axis] = p[axis] + off - size;
                        box.hi[axis] = p[axis] + off;
                    }
                }
                CAPTURE(far_off, scale, round);
                REQUIRE(overlaps(box, triangle));
            }
        }
    }
}

TEST_CASE("what a plane separates clearly is never called a hit") {
    // A box on one side of a random plane and a triangle on the other, a billionth of the scene
    // apart: a million times what rounding may do.
    support::Random random(3);
    for (int round = 0; round < 20'000; ++round) {
        const auto normal = random.direction<double>();
        const auto box_middle = random.vector(-1.0, 1.0);
        const glm::dvec3 half = glm::abs(random.vector(-1.0, 1.0));
        const Box3d box{box_middle - half, box_middle + half};
        const double reach = glm::dot(normal, box_middle) + glm::dot(glm::abs(normal), half);
        Triangle3d triangle;
        for (glm::dvec3& corner : triangle) {
            corner = random.vector(-3.0, 3.0);
            const double short_of = reach + 1e-9 - glm::dot(normal, corner);
            corner += normal * std::max(short_of, 0.0);
        }
        CAPTURE(round);
        REQUIRE_FALSE(overlaps(box, triangle));
        REQUIRE(is_empty(clipped_bounds(box, triangle)));
    }
}

TEST_CASE("the box around a clipped triangle, by hand") {
    // Half of the unit square, z = 0.5, clipped to the middle of it.
    const Triangle3d triangle{{{0.0, 0.0, 0.5}, {1.0, 0.0, 0.5}, {0.0, 1.0, 0.5}}};
    CHECK(clipped_bounds(kUnit, triangle) == Box3d{{0.0, 0.0, 0.5}, {1.0, 1.0, 0.5}});
    CHECK(
        clipped_bounds({{0.25, 0.25, 0.0}, {1.0, 1.0, 1.0}}, triangle) ==
        Box3d{{0.25, 0.25, 0.5}, {0.75, 0.75, 0.5}}
    );
    CHECK(
        clipped_bounds({{0.0, 0.75, 0.0}, {1.0, 1.0, 1.0}}, triangle) ==
        Box3d{{0.0, 0.75, 0.5}, {0.25, 1.0, 0.5}}
    );
    CHECK(is_empty(clipped_bounds({{0.75, 0.75, 0.0}, {1.0, 1.0, 1.0}}, triangle)));
    // A box inside a large triangle cuts out its own cross-section.
    const Triangle3d large{{{-99.0, 0.5, -99.0}, {99.0, 0.5, -99.0}, {0.0, 0.5, 99.0}}};
    CHECK(clipped_bounds(kUnit, large) == Box3d{{0.0, 0.5, 0.0}, {1.0, 0.5, 1.0}});
    const Triangle3d point{glm::dvec3(0.5), glm::dvec3(0.5), glm::dvec3(0.5)};
    CHECK(clipped_bounds(kUnit, point) == Box3d{glm::dvec3(0.5), glm::dvec3(0.5)});
}

TEST_CASE("a clipped triangle's box lies in the box and holds every sample inside") {
    support::Random random(4);
    for (int round = 0; round < 3000; ++round) {
        Triangle3d triangle;
        for (glm::dvec3& corner : triangle) {
            corner = random.vector(-1.5, 2.5);
        }
        const Box3d clipped = clipped_bounds(kUnit, triangle);
        if (!is_empty(clipped)) {
            REQUIRE((contains(kUnit, clipped.lo) && contains(kUnit, clipped.hi)));
        }
        for (int sample = 0; sample < 30; ++sample) {
            const double u = random.uniform(0.0, 1.0);
            const double v = random.uniform(0.0, 1.0 - u);
            const glm::dvec3 p =
                triangle[0] + (triangle[1] - triangle[0]) * u + (triangle[2] - triangle[0]) * v;
            if (contains(kUnit, p)) {
                CAPTURE(round, p.x, p.y, p.z);
                // The sample and the cut corners round, by some 1e-16 of coordinates below 3 each.
                REQUIRE(contains(inflate(clipped, glm::dvec3(1e-14)), p));
            }
        }
    }
}

TEST_CASE("scale and place change nothing") {
    // Powers of two and multiples of them: both are exact.
    support::Random random(5);
    for (int round = 0; round < 5000; ++round) {
        const auto point = [&] { return glm::floor(random.vector(-16.0, 16.0)) / 4.0; };
        const glm::dvec3 one = point();
        const glm::dvec3 other = point();
        const Box3d box{glm::min(one, other), glm::max(one, other)};
        const Triangle3d triangle{point(), point(), point()};
        const bool expected = overlaps(box, triangle);
        const glm::dvec3 by(16'777'216.0, -8'388'608.0, 4'194'304.0);
        REQUIRE(overlaps(moved(box, by), moved(triangle, by)) == expected);
        for (const double scale : {std::ldexp(1.0, -100), std::ldexp(1.0, 100)}) {
            REQUIRE(overlaps(moved(box, {}, scale), moved(triangle, {}, scale)) == expected);
        }
    }
}
