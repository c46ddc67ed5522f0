#include "support/random.hpp"
#include <farfield/math/frustum.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include <cmath>

using namespace farfield;

namespace {

/// How far inside the frustum a world point is: the least distance from the six planes, each in the
/// units of the lens; negative outside. By the definition of a view, not by planes.
double inside_by(const View& view, const glm::dvec3& point) {
    const glm::dvec3 p = glm::transpose(view.camera_to_world) * (point - view.eye);
    const double depth = -p.z;
    const Lens& lens = view.lens;
    double least = std::min(depth - lens.near_distance, lens.far_distance - depth);
    least = std::min(least, p.x - lens.left * depth);
    least = std::min(least, lens.right * depth - p.x);
    least = std::min(least, p.y - lens.bottom * depth);
    return std::min(least, lens.top * depth - p.y);
}

View random_view(support::Random& random, const glm::dvec3& around) {
    Lens lens;
    lens.left = random.uniform(-2.0, 0.5);
    lens.right = lens.left + random.uniform(0.1, 2.0);
    lens.bottom = random.uniform(-2.0, 0.5);
    lens.top = lens.bottom + random.uniform(0.1, 2.0);
    lens.near_distance = random.uniform(0.1, 2.0);
    lens.far_distance = lens.near_distance + random.uniform(1.0, 50.0);
    const glm::dvec3 eye = around + random.vector(-5.0, 5.0);
    return look_at(eye, eye + random.direction<double>(), random.direction<double>(), lens, 64, 48);
}

} // namespace

TEST_CASE("Outside and inside are certain, at the origin and far from it") {
    support::Random random(1);
    for (const double far_off : {0.0, 1e7}) {
        const glm::dvec3 origin(far_off, -far_off, far_off);
        int outside = 0;
        int inside = 0;
        for (int i = 0; i < 4000; ++i) {
            const View view = random_view(random, origin);
            const Frustum frustum = make_frustum(view, origin);
            const glm::dvec3 middle = origin + random.vector(-20.0, 20.0);
            const glm::dvec3 half = random.vector(0.0, 4.0);
            const Box3d world{middle - half, middle + half};
            const Overlap overlap = classify(frustum, local_box(world, origin));
            outside += overlap == Overlap::outside ? 1 : 0;
            inside += overlap == Overlap::inside ? 1 : 0;
            // Plane distances are rounded in float: coordinates of 30 to 2e-6, seven terms.
            constexpr double kRounding = 2e-5;
            for (int sample = 0; sample < 30; ++sample) {
                const glm::dvec3 weight = random.vector(0.0, 1.0);
                const glm::dvec3 point = world.lo + (world.hi - world.lo) * weight;
                const double by = inside_by(view, point);
                if (overlap == Overlap::outside) {
                    CHECK(by <= kRounding);
                }
                if (overlap == Overlap::inside) {
                    CHECK(by >= -kRounding);
                }
            }
        }
        // The search must have met both.
        CHECK(outside > 500);
        CHECK(inside > 20);
    }
}

TEST_CASE("Only boxes that straddle a plane are partial") {
    support::Random random(2);
    for (int i = 0; i < 2000; ++i) {
        const View view = random_view(random, glm::dvec3(0));
        const Frustum frustum = make_frustum(view, glm::dvec3(0));
        const glm::dvec3 point = random.vector(-20.0, 20.0);
        const double by = inside_by(view, point);
        if (std::abs(by) < 1e-3) {
            continue;
        }
        // A point box is never partial, but for rounding.
        const Overlap overlap = classify(frustum, local_box({point, point}, glm::dvec3(0)));
        CHECK(overlap == (by > 0 ? Overlap::inside : Overlap::outside));
    }
}

TEST_CASE("Planes point inwards and pass through their part of the frustum") {
    View view;
    view.eye = {10, 20, 30};
    view.lens.left = -0.5;
    view.lens.right = 1.5;
    view.lens.bottom = -1.0;
    view.lens.top = 0.25;
    view.lens.near_distance = 1.0;
    view.lens.far_distance = 9.0;
    const Frustum frustum = make_frustum(view, {10, 20, 25});
    // Relative to the origin the eye is at (0, 0, 5) and looks down -z.
    const auto distance = [&](std::size_t plane, float x, float y, float depth) {
        return signed_distance(frustum.planes[plane], glm::vec3(x, y, 5.0F - depth));
    };
    CHECK(distance(0, -2.0F, 0.0F, 4.0F) == Approx(0.0).margin(1e-6));
    CHECK(distance(1, 6.0F, 0.0F, 4.0F) == Approx(0.0).margin(1e-6));
    CHECK(distance(2, 0.0F, -4.0F, 4.0F) == Approx(0.0).margin(1e-6));
    CHECK(distance(3, 0.0F, 1.0F, 4.0F) == Approx(0.0).margin(1e-6));
    CHECK(distance(4, 0.0F, 0.0F, 3.0F) == Approx(2.0));
    CHECK(distance(5, 0.0F, 0.0F, 3.0F) == Approx(6.0));
    for (std::size_t plane = 0; plane < 6; ++plane) {
        CHECK(glm::length(frustum.planes[plane].normal) == Approx(1.0));
        CHECK(distance(plane, 0.0F, 0.0F, 4.0F) > 0.0F);
    }
}

TEST_CASE("A box around the eye is partial and the frustum's own box holds it") {
    View view;
    view.lens.near_distance = 0.5;
    view.lens.far_distance = 4.0;
    const Frustum frustum = make_frustum(view, glm::dvec3(0));
    CHECK(classify(frustum, {{-1, -1, -1}, {1, 1, 1}}) == Overlap::partial);
    CHECK(classify(frustum, {{-100, -100, -100}, {100, 100, 100}}) == Overlap::partial);
    CHECK(classify(frustum, {{-0.5F, -0.5F, -2}, {0.5F, 0.5F, -1}}) == Overlap::inside);
    CHECK(classify(frustum, {{-1, -1, 0}, {1, 1, 1}}) == Overlap::outside);
    CHECK(classify(frustum, {{-1, -1, -9}, {1, 1, -5}}) == Overlap::outside);
    CHECK(classify(frustum, {{5, -1, -3}, {6, 1, -2}}) == Overlap::outside);
}
