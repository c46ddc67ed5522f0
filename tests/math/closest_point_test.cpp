#include "support/random.hpp"
#include <farfield/math/closest_point.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <array>

using farfield::closest_point;
using glm::dvec3;

TEST_CASE("Triangles without area are their edges") {
    const std::array<dvec3, 3> point = {dvec3(1, 2, 3), dvec3(1, 2, 3), dvec3(1, 2, 3)};
    CHECK(closest_point({9, 9, 9}, point) == dvec3(1, 2, 3));
    const std::array<dvec3, 3> line = {dvec3(0, 0, 0), dvec3(4, 0, 0), dvec3(8, 0, 0)};
    CHECK(closest_point({5, 1, 0}, line) == dvec3(5, 0, 0));
    CHECK(closest_point({-5, 1, 0}, line) == dvec3(0, 0, 0));
}

TEST_CASE("No other point of a triangle is closer") {
    farfield::support::Random random(17);
    for (int trial = 0; trial < 2000; ++trial) {
        std::array<dvec3, 3> triangle{};
        for (dvec3& corner : triangle) {
            corner = random.vector(-1.0, 1.0);
        }
        const dvec3 p = random.vector(-2.0, 2.0);
        const dvec3 found = closest_point(p, triangle);
        const dvec3 normal = glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
        // It lies on the triangle: in its plane and inside of its edges, but for rounding.
        CHECK(std::abs(glm::dot(found - triangle[0], normal)) < 1e-12);
        for (std::size_t k = 0; k < 3; ++k) {
            const dvec3 edge = triangle[(k + 1) % 3] - triangle[k];
            CHECK(glm::dot(glm::cross(edge, found - triangle[k]), normal) > -1e-12);
        }
        for (int i = 0; i < 20; ++i) {
            double u = random.uniform(0.0, 1.0);
            double v = random.uniform(0.0, 1.0);
            if (u + v > 1.0) {
                u = 1.0 - u;
                v = 1.0 - v;
            }
            const dvec3 other =
                triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0]);
            CHECK(glm::distance(p, found) <= glm::distance(p, other) + 1e-12);
        }
    }
}
