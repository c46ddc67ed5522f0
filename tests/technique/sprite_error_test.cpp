#include "support/random.hpp"
#include "technique/scenes.hpp"
#include "technique/sprite_world.hpp"
#include <farfield/metric/sprite_angle.hpp>
#include <farfield/technique/sprite_error.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

namespace {

using namespace farfield;
using farfield::support::make_sprite_world;
using farfield::support::Random;
using farfield::support::SpriteWorld;

// Angles are floats: those at a pixel or so are good to five digits, which is far more than any
// decision hangs on.
constexpr double kRounding = 2e-5;

/// Frusta that see everything.
Frustum everywhere() {
    Frustum frustum;
    for (Plane& plane : frustum.planes) {
        plane = {{0.0F, 1.0F, 0.0F}, -std::numeric_limits<float>::max()};
    }
    return frustum;
}

SpriteEyes eyes_at(const glm::vec3& drawn_from, const glm::vec3& seen_from) {
    return {drawn_from, seen_from, everywhere(), everywhere()};
}

SpriteEyes eyes_of(const ProxyPair& pair, const View& drawn, const View& seen) {
    return {
        local_point(drawn.eye, pair.origin),
        local_point(seen.eye, pair.origin),
        make_frustum(drawn, pair.origin),
        make_frustum(seen, pair.origin)};
}

bool inside(const Frustum& frustum, const glm::vec3& point) {
    return std::all_of(frustum.planes.begin(), frustum.planes.end(), [&](const Plane& plane) {
        return signed_distance(plane, point) >= 0.0F;
    });
}

/// One facet, the ground, and a point over it.
ProxyPair one_sample(const glm::vec3& point) {
    ProxyPair pair;
    pair.fine = ItemId{0};
    pair.coarse = ItemId{1};
    pair.samples = {{point, 0}};
    pair.facets.resize(1);
    pair.nodes.resize(1);
    ProxyNode& node = pair.nodes[0];
    node.bounds = {point, point};
    node.below = point.y;
    node.above = point.y;
    node.cosine = 1.0F;
    node.count = 1;
    pair.offset_m = std::abs(point.y);
    pair.quality = {.facets = 1, .samples = 1, .rms_m = 1.0, .hausdorff_m = 1.0};
    return pair;
}

/// The definition, in double: where the ray meets the plane, and the angle to it from the eye.
double by_hand(const glm::dvec3& point, const glm::dvec3& v1, const glm::dvec3& v2) {
    const glm::dvec3 shown = v1 + (point - v1) * (v1.y / (v1.y - point.y));
    const glm::dvec3 a = point - v2;
    const glm::dvec3 b = shown - v2;
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// All samples, one by one: those that both see.
SpriteError one_by_one(const ProxyPair& pair, const SpriteEyes& eyes) {
    SpriteError error;
    double sum = 0.0;
    for (const ProxySample& sample : pair.samples) {
        if (inside(eyes.drawn, sample.point) && inside(eyes.seen, sample.point)) {
            const double angle = double{sprite_error::of_sample(pair, sample, eyes)};
            sum += angle * angle;
            error.largest_rad = std::max(error.largest_rad, angle);
            ++error.samples;
        }
    }
    error.rms_rad = error.samples == 0 ? 0.0 : std::sqrt(sum / error.samples);
    return error;
}

/// An eye over a terrain, and how it looks.
View random_view(Random& random, const SpriteWorld& world) {
    const double side = world.grid.spacing_m * (world.grid.columns - 1);
    const glm::dvec3 eye =
        world.grid.origin +
        side * glm::dvec3(
                   random.uniform(-0.2, 1.2), random.uniform(0.07, 0.5), random.uniform(-0.2, 1.2)
               );
    const glm::dvec3 target =
        world.grid.origin +
        side * glm::dvec3(random.uniform(0.0, 1.0), 0.0, random.uniform(0.0, 1.0));
    return look_at(eye, target, {0, 1, 0}, {-1.0, 1.0, -0.75, 0.75, 0.25, 1e6}, 640, 480);
}

} // namespace

TEST_CASE("a point over the ground is shown where the ray from the first eye meets it") {
    // Eyes well above, so that no ray grazes.
    Random random(1);
    for (int i = 0; i < 1000; ++i) {
        const glm::vec3 point(
            random.uniform(-20.0F, 20.0F),
            random.uniform(-3.0F, 3.0F),
            random.uniform(-20.0F, 20.0F)
        );
        const glm::vec3 v1(0.0F, random.uniform(10.0F, 30.0F), 0.0F);
        const glm::vec3 v2 = v1 + random.vector(-5.0F, 5.0F);
        const ProxyPair pair = one_sample(point);
        const double angle =
            double{sprite_error::of_sample(pair, pair.samples[0], eyes_at(v1, v2))};
        const double expected = by_hand(glm::dvec3(point), glm::dvec3(v1), glm::dvec3(v2));
        CAPTURE(point.x, point.y, point.z, v1.y, v2.x, v2.y, v2.z);
        // Of the offset, a quotient of lengths of 30 m, and of the angle that it makes.
        CHECK(angle == Approx(expected).epsilon(1e-4).margin(1e-6));
    }
}

TEST_CASE("cases known by hand") {
    // The point (0, 1, 0) from (-1, 2, 0): shown at (1, 0, 0). From above the shown point, at
    // (1, 3, 0), the point is seen at atan(1/2) off the vertical, the shown one right below.
    const ProxyPair pair = one_sample({0.0F, 1.0F, 0.0F});
    const SpriteEyes eyes = eyes_at({-1.0F, 2.0F, 0.0F}, {1.0F, 3.0F, 0.0F});
    CHECK(
        sprite_error::offset_along_ray(pair.facets[0], pair.samples[0].point, eyes.drawn_from) ==
        Approx(std::sqrt(2.0)).epsilon(1e-6)
    );
    CHECK(
        double{sprite_error::of_sample(pair, pair.samples[0], eyes)} ==
        Approx(std::atan(0.5)).epsilon(1e-6)
    );
    SECTION("the eye that drew it is where nothing is off its place") {
        const SpriteEyes same = eyes_at({-1.0F, 2.0F, 0.0F}, {-1.0F, 2.0F, 0.0F});
        CHECK(sprite_error::of_sample(pair, pair.samples[0], same) == 0.0F);
        CHECK(sprite_error::largest(pair, same, 0.0F).largest_rad == 0.0);
    }
    SECTION("an eye at the point, or in it, is as wrong as can be") {
        const float pi = std::numbers::pi_v<float>;
        const SpriteEyes drawn = eyes_at({0.0F, 1.0F, 0.0F}, {1.0F, 3.0F, 0.0F});
        const SpriteEyes seen = eyes_at({1.0F, 3.0F, 0.0F}, {0.0F, 1.0F, 0.0F});
        CHECK(sprite_error::of_sample(pair, pair.samples[0], drawn) == pi);
        CHECK(sprite_error::of_sample(pair, pair.samples[0], seen) == pi);
        CHECK(sprite_error::largest(pair, drawn, 0.0F).largest_rad == double{pi});
        CHECK(sprite_error::largest(pair, seen, 0.0F).largest_rad == double{pi});
    }
    SECTION("a plane behind the eye shows nothing: as wrong as can be") {
        const ProxyPair low = one_sample({0.0F, -1.0F, 0.0F}); // under the ground, so is the eye
        const SpriteEyes below = eyes_at({0.0F, -0.5F, 0.0F}, {0.0F, -0.4F, 0.0F});
        CHECK(sprite_error::of_sample(low, low.samples[0], below) == std::numbers::pi_v<float>);
    }
    SECTION("rays along the ground count as at 1/16") {
        const glm::vec3 along(-100.0F, 1.0F, 0.0F);
        CHECK(
            sprite_error::offset_along_ray(pair.facets[0], pair.samples[0].point, along) ==
            Approx(16.0)
        );
    }
    SECTION("from below, what stands out is before the plane") {
        const glm::vec3 below(0.0F, -2.0F, 0.0F);
        CHECK(
            sprite_error::offset_along_ray(pair.facets[0], pair.samples[0].point, below) ==
            Approx(-1.0)
        );
    }
}

TEST_CASE("the largest error is that of all samples, and no node is more wrong than its bound") {
    const double side = GENERATE(1.0, 1024.0, 100'000.0);
    const auto scaled = [&](double x, double z) { return side / 1024.0 * support::hills(x, z); };
    for (const bool refinable : {false, true}) {
        const SpriteWorld world =
            make_sprite_world({.side_m = side, .refinable = refinable}, scaled);
        const ProxyPair& pair = world.pairs[0];
        Random random(3);
        std::uint64_t measured = 0;
        std::uint64_t all = 0;
        for (int i = 0; i < 60; ++i) {
            const View drawn = random_view(random, world);
            View seen = drawn;
            seen.eye += side * random.uniform(0.0, 0.05) * random.direction<double>();
            const SpriteEyes eyes = eyes_of(pair, drawn, seen);
            const SpriteError expected = one_by_one(pair, eyes);
            const SpriteError found = sprite_error::largest(pair, eyes, 0.0F);
            CAPTURE(side, i, expected.largest_rad, found.largest_rad);
            REQUIRE(found.largest_rad == expected.largest_rad);
            measured += found.samples;
            all += expected.samples;

            // With a floor it is that or the floor.
            const auto floor = static_cast<float>(expected.largest_rad * random.uniform(0.5, 1.5));
            REQUIRE(
                sprite_error::largest(pair, eyes, floor).largest_rad ==
                std::max(expected.largest_rad, double{floor})
            );
            for (const ProxyNode& node : pair.nodes) {
                const float bound = sprite_error::bound_of_node(node, eyes);
                for (std::uint32_t k = node.first; k < node.first + node.count; k += 7) {
                    REQUIRE(sprite_error::of_sample(pair, pair.samples[k], eyes) <= bound);
                }
            }
            const SpriteError rms = sprite_error::rms(pair, eyes, 0);
            REQUIRE(rms.samples == expected.samples);
            REQUIRE(rms.rms_rad == Approx(expected.rms_rad).epsilon(1e-12));
            REQUIRE(rms.largest_rad == expected.largest_rad);
        }
        // Most samples are never looked at.
        CHECK(measured * 2 < all);
    }
}

TEST_CASE("a part of the samples tells the root of their mean square") {
    const SpriteWorld world = make_sprite_world({.posts = 129});
    const ProxyPair& pair = world.pairs[0];
    Random random(5);
    for (int i = 0; i < 20; ++i) {
        const View drawn = random_view(random, world);
        View seen = drawn;
        seen.eye += 20.0 * random.direction<double>();
        const SpriteEyes eyes = eyes_of(pair, drawn, seen);
        const SpriteError all = sprite_error::rms(pair, eyes, 0);
        if (all.samples < 4000) {
            continue;
        }
        const SpriteError part = sprite_error::rms(pair, eyes, 1000);
        CHECK(part.samples >= 900);
        CHECK(part.samples <= 2200);
        // A mean of 1000 squares whose spread is twice the mean is good to 6 %, its root to 3 %;
        // three times that.
        CHECK(part.rms_rad == Approx(all.rms_rad).epsilon(0.1));
    }
}

TEST_CASE("angles do not hang on the scale or on where the world is") {
    const SpriteWorld here = make_sprite_world({});
    const SpriteWorld far_off = make_sprite_world({.offset = {1e7, 0.0, -1e7}});
    // Heights are rounded, so those of half the size are doubled.
    const auto twice = [](double x, double z) {
        return std::round(support::hills(x, z) * 64.0) / 32.0;
    };
    const SpriteWorld large = make_sprite_world({.side_m = 2048.0}, twice);
    Random random(9);
    for (int i = 0; i < 20; ++i) {
        View drawn = random_view(random, here);
        drawn.eye = glm::round(drawn.eye * 16.0) / 16.0;
        View seen = drawn;
        seen.eye += glm::dvec3(2.5, 1.0, -4.0);
        const auto error = [&](const SpriteWorld& world, double scale, const glm::dvec3& offset) {
            View v1 = drawn;
            View v2 = seen;
            for (View* view : {&v1, &v2}) {
                view->eye = view->eye * scale + offset;
                view->lens.near_distance *= scale;
                view->lens.far_distance *= scale;
            }
            const SpriteEyes eyes = eyes_of(world.pairs[0], v1, v2);
            return sprite_error::rms(world.pairs[0], eyes, 0);
        };
        const SpriteError base = error(here, 1.0, {});
        const SpriteError moved = error(far_off, 1.0, {1e7, 0.0, -1e7});
        const SpriteError scaled = error(large, 2.0, {});
        CHECK(moved.samples == base.samples);
        CHECK(moved.rms_rad == Approx(base.rms_rad).epsilon(kRounding));
        CHECK(moved.largest_rad == Approx(base.largest_rad).epsilon(kRounding));
        CHECK(scaled.rms_rad == Approx(base.rms_rad).epsilon(kRounding));
        CHECK(scaled.largest_rad == Approx(base.largest_rad).epsilon(kRounding));
    }
}

TEST_CASE("a flat field is never wrong, and a spike is found among all that is flat") {
    const auto flat = make_sprite_world({}, [](double, double) { return 5.0; });
    const auto spiked = make_sprite_world({.posts = 65, .squares = 8}, [](double x, double z) {
        return std::abs(x - 0.484375) < 1e-9 && std::abs(z - 0.53125) < 1e-9 ? 80.0 : 5.0;
    });
    const View drawn = support::view_at({0, 200, 900}, {0, 0, 0});
    View seen = drawn;
    seen.eye.x += 30.0;
    const SpriteEyes eyes = eyes_of(flat.pairs[0], drawn, seen);
    CHECK(sprite_error::largest(flat.pairs[0], eyes, 0.0F).largest_rad == 0.0);
    CHECK(sprite_error::rms(flat.pairs[0], eyes, 0).rms_rad == 0.0);

    const SpriteError spike = sprite_error::largest(spiked.pairs[0], eyes, 0.0F);
    CHECK(spike.largest_rad == one_by_one(spiked.pairs[0], eyes).largest_rad);
    CHECK(spike.largest_rad > 0.001);
    CHECK(spike.samples < 100); // of 4225
}

TEST_CASE("the paper's error takes one sample a facet and one turn for all") {
    const SpriteWorld world = make_sprite_world({.squares = 8});
    const ProxyPair& pair = world.pairs[0];
    const std::vector<std::uint32_t> middles = sprite_error::middle_samples(pair);
    REQUIRE(middles.size() == 128);
    std::vector<bool> seen(pair.facets.size());
    for (const std::uint32_t index : middles) {
        CHECK_FALSE(seen[pair.samples[index].facet]);
        seen[pair.samples[index].facet] = true;
    }
    const glm::vec3 v1 = center(pair.nodes[0].bounds) + glm::vec3(0.0F, 300.0F, 800.0F);
    const glm::vec3 v2 = v1 + glm::vec3(25.0F, 0.0F, 0.0F);
    const SpriteEyes eyes = eyes_at(v1, v2);
    const float turn = metric::sprite_turn_unchecked(v1, v2, center(pair.nodes[0].bounds));
    double sum = 0.0;
    for (const std::uint32_t index : middles) {
        const ProxySample& sample = pair.samples[index];
        const double a = double{glm::distance(sample.point, v2)};
        const double b = double{height_over(pair.facets[sample.facet], sample.point)};
        const double angle =
            std::atan2(std::abs(b) * std::sin(double{turn}), a + b * std::cos(double{turn}));
        sum += angle * angle;
    }
    const SpriteError paper = sprite_error::paper(pair, eyes, middles);
    CHECK(paper.samples == 128);
    CHECK(paper.rms_rad == Approx(std::sqrt(sum / 128)).epsilon(kRounding));
    CHECK(sprite_error::paper(pair, eyes_at(v1, v1), middles).rms_rad == 0.0);
}

TEST_CASE("an eye is near where the coarse surface may be on its other side") {
    const auto world = make_sprite_world({.posts = 65, .squares = 4}, [](double x, double z) {
        return x > 0.5 && z > 0.5 ? support::hills(x, z) : 0.0;
    });
    const ProxyPair& pair = world.pairs[0];
    const auto near = [&](const glm::dvec3& eye, float margin) {
        return sprite_error::is_near(pair, local_point(eye, pair.origin), margin);
    };
    // Over what is flat, coarse and fine are one: two metres are enough.
    CHECK_FALSE(near({-300, 2, -300}, 0.5F));
    CHECK(near({-300, 2, -300}, 2.5F));
    CHECK(near({-300, 0, -300}, 0.0F));
    // Among hills on squares of 256 m, two metres over the ground are not.
    CHECK(near({256, support::hills(0.75, 0.75) + 2.0, 256}, 0.5F));
    CHECK_FALSE(near({256, 500, 256}, 0.5F));
}
