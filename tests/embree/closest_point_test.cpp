#include "support/random.hpp"
#include <farfield/embree/closest_point.hpp>
#include <farfield/math/closest_point.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

using namespace farfield;
using farfield::embree::ClosestPointFinder;
using farfield::support::Random;

namespace {

Mesh mesh_of(std::vector<glm::vec3> corners, const glm::dvec3& origin = glm::dvec3(0.0)) {
    Mesh mesh;
    mesh.name = "some triangles";
    mesh.origin = origin;
    mesh.positions = std::move(corners);
    mesh.normals.resize(mesh.positions.size(), glm::vec3(0.0F, 1.0F, 0.0F));
    for (std::uint32_t i = 0; i < mesh.positions.size(); ++i) {
        mesh.indices.push_back(i);
    }
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size())});
    update_bounds(mesh);
    return mesh;
}

std::unique_ptr<ClosestPointFinder> finder_of(const Mesh& mesh) {
    auto finder = ClosestPointFinder::create(mesh);
    REQUIRE(finder.has_value());
    return std::move(*finder);
}

SurfacePoint find(const ClosestPointFinder& finder, const glm::vec3& point) {
    SurfacePoint found;
    finder.find(std::span(&point, 1), std::span(&found, 1));
    return found;
}

} // namespace

TEST_CASE("A mesh without triangles has no closest point") {
    const auto finder = ClosestPointFinder::create(mesh_of({}));
    REQUIRE_FALSE(finder.has_value());
    CHECK(finder.error().message == "closest points: mesh \"some triangles\" has no triangles");
}

TEST_CASE("Triangles without area have closest points") {
    const auto point = finder_of(mesh_of({{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}));
    CHECK(find(*point, {1, 2, 8}).distance == Approx(5.0F));
    CHECK(find(*point, {1, 2, 8}).point == glm::vec3(1, 2, 3));
    const auto line = finder_of(mesh_of({{0, 0, 0}, {4, 0, 0}, {2, 0, 0}}));
    CHECK(find(*line, {3, 2, 0}).distance == Approx(2.0F));
    CHECK(find(*line, {3, 2, 0}).point.x == Approx(3.0F));
}

TEST_CASE("Closest points are inside, on edges or at corners") {
    const auto finder = finder_of(mesh_of({{0, 0, 0}, {4, 0, 0}, {0, 0, 4}}, {1e7, 0.0, 0.0}));
    const SurfacePoint inside = find(*finder, {1, 3, 1});
    CHECK(inside.point.x == Approx(1.0F));
    CHECK(inside.point.y == Approx(0.0F).margin(1e-6));
    CHECK(inside.distance == Approx(3.0F));
    CHECK(find(*finder, {1, 0, -2}).point.x == Approx(1.0F));
    CHECK(find(*finder, {1, 0, -2}).distance == Approx(2.0F));
    CHECK(find(*finder, {-3, 4, 0}).distance == Approx(5.0F));
    CHECK(find(*finder, {-3, 4, 0}).triangle == 0);
}

TEST_CASE("Nothing is closer than what is found, at any scale") {
    for (const float scale : {1.0F, 1e-30F, 1e25F}) {
        Random random(5);
        std::vector<glm::vec3> corners;
        for (int i = 0; i < 300; ++i) {
            const glm::vec3 middle = random.vector(-1.0F, 1.0F);
            for (int k = 0; k < 3; ++k) {
                corners.push_back(scale * (middle + random.vector(-0.2F, 0.2F)));
            }
        }
        const Mesh mesh = mesh_of(corners);
        const auto finder = finder_of(mesh);
        std::vector<glm::vec3> points;
        for (int i = 0; i < 500; ++i) {
            points.push_back(scale * random.vector(-2.0F, 2.0F));
        }
        std::vector<SurfacePoint> found(points.size());
        finder->find(points, found);
        // Squares of such lengths are no floats; those of double are.
        const double unit = double{scale};
        for (std::size_t i = 0; i < points.size(); ++i) {
            const auto distance_of = [&](std::size_t triangle) {
                std::array<glm::dvec3, 3> placed{};
                for (std::size_t k = 0; k < 3; ++k) {
                    placed[k] = glm::dvec3(mesh.positions[triangle * 3 + k]);
                }
                const glm::dvec3 point(points[i]);
                return glm::distance(point, closest_point(point, placed));
            };
            double least = std::numeric_limits<double>::infinity();
            for (std::size_t triangle = 0; triangle < 300; ++triangle) {
                least = std::min(least, distance_of(triangle));
            }
            // As announced, of an extent of up to 2.4.
            REQUIRE(distance_of(found[i].triangle) <= least + 1e-6 * unit);
            REQUIRE(double{found[i].distance} == Approx(least).margin(1e-6 * unit));
            REQUIRE(
                glm::distance(glm::dvec3(points[i]), glm::dvec3(found[i].point)) ==
                Approx(least).margin(1e-6 * unit)
            );
        }
    }
}
