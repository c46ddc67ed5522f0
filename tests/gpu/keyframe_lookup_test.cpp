#include "gpu/hand_made_plan.hpp"
#include "support/random.hpp"
#include <farfield/gpu/keyframe_lookup.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

using namespace farfield;
using gpu::KeyframeLookup;
using gpu::KeyframeSight;

namespace {

constexpr std::int32_t kTexels = 16;

/// Of the hand-made view: 90 degrees, 16 texels; depths of 10 to 30 m in 65535 steps.
Keyframe keyframe_at(std::int32_t x, std::int32_t y) {
    Keyframe keyframe;
    keyframe.page = PageId{1};
    keyframe.source = {x, y, kTexels, kTexels};
    keyframe.view = support::hand_made_view(kTexels);
    keyframe.copy_near = 10.0F;
    keyframe.copy_far = 30.0F;
    return keyframe;
}

/// Depths of a page, of one step but where they were set, that looks at nothing else.
struct Depths {
    Region source;
    std::uint16_t all = 0;
    std::map<std::pair<std::int32_t, std::int32_t>, std::uint16_t> set;

    std::uint16_t operator()(std::int32_t x, std::int32_t y) const {
        CHECK(contains(source, {x, y, 1, 1}));
        const auto found = set.find({x, y});
        return found == set.end() ? all : found->second;
    }
};

/// Step of a distance along the view direction [m].
std::uint16_t step_of(double distance) {
    return static_cast<std::uint16_t>(std::lround((distance - 10.0) / 20.0 * 65535.0));
}

/// A point at a place of the page [texel] and so far off, to the keyframe.
glm::dvec3 point_at(const Keyframe& keyframe, const glm::dvec2& place, double distance) {
    const glm::dvec2 share = (place - glm::dvec2(keyframe.source.x, keyframe.source.y)) / 16.0;
    return glm::dvec3(share * 2.0 - 1.0, -1.0) * distance;
}

const glm::dvec3 kFacing{0.0, 0.0, 1.0};

} // namespace

TEST_CASE("A place on the page has the texel it is in, and colours filtered within the source") {
    const Keyframe keyframe = keyframe_at(5, 9);
    const KeyframeLookup lookup(gpu::keyframe_terms(keyframe, keyframe.view));
    const Depths depths{keyframe.source, step_of(20.0), {}};
    for (const auto& [place, texel, filtered] :
         {std::tuple{glm::dvec2(12.3, 15.9), glm::ivec2(12, 15), glm::dvec2(12.3, 15.9)},
          {glm::dvec2(5.0, 9.0), glm::ivec2(5, 9), glm::dvec2(5.5, 9.5)},
          {glm::dvec2(20.999, 24.999), glm::ivec2(20, 24), glm::dvec2(20.5, 24.5)}}) {
        const KeyframeSight sight = lookup.look(point_at(keyframe, place, 20.0), kFacing, depths);
        CHECK(sight.seen);
        CHECK(sight.texel == texel);
        CHECK(glm::distance(sight.color_at, filtered) < 1e-9);
    }
    for (const glm::dvec2& place :
         {glm::dvec2(4.999, 12.0),
          glm::dvec2(21.0, 12.0),
          glm::dvec2(12.0, 8.999),
          glm::dvec2(12.0, 25.0)}) {
        CHECK_FALSE(lookup.look(point_at(keyframe, place, 20.0), kFacing, depths).seen);
        CHECK_FALSE(lookup.look_whole(point_at(keyframe, place, 20.0), depths).seen);
    }
    // Behind the eye, in it, and nowhere.
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    for (const glm::dvec3& point :
         {-point_at(keyframe, {12.0, 15.0}, 20.0), glm::dvec3(0.0), glm::dvec3(kNone)}) {
        CHECK_FALSE(lookup.look(point, kFacing, depths).seen);
        CHECK_FALSE(lookup.look_whole(point, depths).seen);
    }
}

TEST_CASE("A source of one texel is looked up and never left") {
    Keyframe keyframe = keyframe_at(0, 0);
    keyframe.source = {7, 3, 1, 1};
    keyframe.view = support::hand_made_view(1);
    const KeyframeLookup lookup(gpu::keyframe_terms(keyframe, keyframe.view));
    const Depths depths{keyframe.source, step_of(20.0), {}};
    const KeyframeSight sight = lookup.look({3.0, -4.0, -20.0}, kFacing, depths);
    CHECK(sight.seen);
    CHECK(sight.texel == glm::ivec2(7, 3));
    CHECK(glm::distance(sight.color_at, glm::dvec2(7.5, 3.5)) < 1e-9);
}

TEST_CASE("A texel that keeps nothing shows nothing, and colours are not filtered with another") {
    const Keyframe keyframe = keyframe_at(0, 0);
    const KeyframeLookup lookup(gpu::keyframe_terms(keyframe, keyframe.view));
    Depths depths{keyframe.source, step_of(20.0), {}};
    const glm::dvec3 point = point_at(keyframe, {6.4, 6.8}, 20.0);
    depths.set[{6, 6}] = gpu::kNothingKept;
    CHECK_FALSE(lookup.look(point, kFacing, depths).seen);
    CHECK_FALSE(lookup.look_whole(point, depths).seen);
    depths.set.clear();
    for (const auto& neighbour : {std::pair{5, 6}, {5, 7}, {6, 7}}) {
        depths.set = {{neighbour, step_of(12.0)}};
        const KeyframeSight sight = lookup.look(point, kFacing, depths);
        CHECK(sight.seen);
        CHECK(sight.color_at == glm::dvec2(6.5, 6.5));
        CHECK(
            glm::distance(lookup.look_whole(point, depths).color_at, glm::dvec2(6.4, 6.8)) < 1e-9
        );
    }
    // Not one of the four.
    depths.set = {{{7, 6}, step_of(12.0)}};
    CHECK(glm::distance(lookup.look(point, kFacing, depths).color_at, glm::dvec2(6.4, 6.8)) < 1e-9);
    // At the end of the slab, a texel of nothing is none that stands there.
    depths = {keyframe.source, gpu::kNothingKept, {}};
    CHECK_FALSE(lookup.look(point_at(keyframe, {6.4, 6.8}, 30.0), kFacing, depths).seen);
}

TEST_CASE("Surfaces as far apart as the offset says are taken for one, at any slant") {
    support::Random random(5);
    for (int trial = 0; trial < 2000; ++trial) {
        Keyframe keyframe = keyframe_at(0, 0);
        keyframe.offset_m = static_cast<float>(random.uniform(0.0, 0.3));
        const KeyframeLookup lookup(gpu::keyframe_terms(keyframe, keyframe.view));
        const glm::dvec2 place(random.uniform(0.0, 16.0), random.uniform(0.0, 16.0));
        const double distance = random.uniform(12.0, 28.0);
        const glm::dvec3 point = point_at(keyframe, place, distance);
        const glm::dvec3 direction = glm::normalize(point);
        glm::dvec3 normal = kFacing;
        do {
            normal = glm::dvec3(random.vector(-1.0F, 1.0F));
        } while (glm::length(normal) < 0.1 ||
                 std::abs(glm::dot(glm::normalize(normal), direction)) < 1.0 / 16.0);
        normal = glm::normalize(normal);
        // The plane moved along its normal, met by the ray of the centre of the fragment's texel.
        const double moved = random.uniform(-1.0, 1.0) * double{keyframe.offset_m};
        const glm::dvec3 center = point_at(keyframe, glm::floor(place) + 0.5, 1.0);
        const double met = (glm::dot(normal, point) + moved) / glm::dot(normal, center);
        if (!(met > 10.0 && met < 30.0)) {
            continue; // the ray goes the other way, or out of the slab
        }
        // The slope over a texel is that at the fragment; a plane's is a little more where it is
        // farther, so that texels that far off may be lost: 1/10 of the slope is not tried.
        const double slope = distance * (std::abs(normal.x) + std::abs(normal.y)) / 8.0 /
                             std::abs(glm::dot(normal, point / distance));
        INFO("trial " << trial << ", slope " << slope << ", met " << met << " at " << distance);
        const Depths depths{keyframe.source, step_of(met), {}};
        if (slope < 0.1 * distance) {
            CHECK(lookup.look(point, normal, depths).seen);
        }
        const double tolerance = lookup.tolerance(point, normal) / 65535.0 * 20.0;
        // It never is more than all of these together.
        const double most = 20.0 / 65535.0 + slope +
                            double{keyframe.offset_m} / std::abs(glm::dot(normal, direction));
        CHECK(tolerance <= most * (1.0 + 1e-9));
        // Beyond it nothing is seen.
        for (const double side : {-1.0, 1.0}) {
            const double beyond = distance + side * (tolerance + 0.001);
            if (beyond > 10.0 && beyond < 30.0) {
                const Depths hidden{keyframe.source, step_of(beyond), {}};
                CHECK_FALSE(lookup.look(point, normal, hidden).seen);
            }
        }
    }
}

TEST_CASE("Grazing rays take no more than sixteen times the offset") {
    Keyframe keyframe = keyframe_at(0, 0);
    keyframe.offset_m = 0.5F;
    const KeyframeLookup lookup(gpu::keyframe_terms(keyframe, keyframe.view));
    const glm::dvec3 point = point_at(keyframe, {8.0, 8.0}, 20.0);
    // The slope of a plane along the ray is cut in the same way: 20 m, an eighth a texel, 16 times.
    const double most = 16.0 * (0.5 + 20.0 / 8.0) / 20.0 * 65535.0 + 1.0;
    CHECK(lookup.tolerance(point, {1.0, 0.0, 0.0}) == Approx(most));
    CHECK(lookup.tolerance(point, {0.0, 1.0, 0.0}) == Approx(most));
    CHECK(lookup.tolerance(point, kFacing) == Approx(0.5 / 20.0 * 65535.0 + 1.0));
}

TEST_CASE("What is shifted too far on the pass's target is not seen") {
    support::Random random(9);
    int seen = 0;
    int refused = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        Keyframe keyframe = keyframe_at(3, 4);
        keyframe.offset_m = 100.0F;
        keyframe.max_shift_px = static_cast<float>(random.uniform(0.0, 30.0));
        // A pass from elsewhere, turned, with a window that is not square; both far from zero.
        const glm::dvec3 origin(1e7, -2e6, 4e6);
        keyframe.view.eye += origin;
        const glm::dvec3 eye = keyframe.view.eye + glm::dvec3(random.vector(-3.0F, 3.0F));
        const View view = look_at(
            eye,
            origin + glm::dvec3(random.vector(-2.0F, 2.0F)) - glm::dvec3(0.0, 0.0, 15.0),
            {0.1, 1.0, 0.0},
            {-0.9, 1.1, -0.7, 0.4, 0.5, 100.0},
            300,
            200
        );
        const KeyframeLookup lookup(gpu::keyframe_terms(keyframe, view));
        const glm::dvec2 place(random.uniform(3.0, 19.0), random.uniform(4.0, 20.0));
        const double distance = random.uniform(12.0, 28.0);
        const double other = random.uniform(12.0, 28.0);
        const glm::dvec3 at = point_at(keyframe, place, distance);
        // On the fragment's own ray, as far off as the texel keeps.
        const glm::dvec3 shown = point_at(keyframe, place, 10.0 + step_of(other) / 65535.0 * 20.0);
        const auto seen_from_pass = [&](const glm::dvec3& point) {
            const glm::dvec3 world = keyframe.view.camera_to_world * point + keyframe.view.eye;
            const glm::dvec3 camera = glm::transpose(view.camera_to_world) * (world - view.eye);
            REQUIRE(camera.z < 0.0);
            return glm::dvec2(camera) / -camera.z * glm::dvec2(300.0 / 2.0, 200.0 / 1.1);
        };
        const double shift = glm::distance(seen_from_pass(at), seen_from_pass(shown));
        const double bound = double{keyframe.max_shift_px};
        if (std::abs(shift - bound) < 1e-5) {
            continue; // 1e7 m away, a double is good for 2e-9 m
        }
        // As a fragment comes: relative to the eye of the pass.
        const glm::dvec3 of_pass =
            glm::transpose(view.camera_to_world) *
            (keyframe.view.camera_to_world * at + (keyframe.view.eye - view.eye));
        CHECK(glm::distance(lookup.point(of_pass), at) < 1e-7);
        const Depths depths{keyframe.source, step_of(other), {}};
        const bool is_seen = lookup.look(lookup.point(of_pass), kFacing, depths).seen;
        CHECK(is_seen == (shift < bound));
        (is_seen ? seen : refused) += 1;
    }
    CHECK(seen > 200);
    CHECK(refused > 200);
}
