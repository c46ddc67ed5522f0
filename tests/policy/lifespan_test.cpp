#include "support/random.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/policy/lifespan.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

namespace {

using namespace farfield;
using Real = long double;

template <typename T>
using Vector = glm::vec<3, T>;

template <typename T>
Box3<T> unit_box() {
    return {Vector<T>(T(-1)), Vector<T>(T(1))};
}

} // namespace

TEMPLATE_TEST_CASE("Life spans of empty and degenerate zones", "", float, double) {
    using T = TestType;
    const FrameCount<T> count{T(1), 100};
    const Vector<T> rest(T(0));
    const Vector<T> right(T(1), T(0), T(0));
    // Two zones that do not meet: no frame, and no error.
    const Box3<T> apart = intersect(
        Box3<T>{Vector<T>(T(0)), Vector<T>(T(1))}, Box3<T>{Vector<T>(T(2)), Vector<T>(T(3))}
    );
    const Lifespan<T> none = policy::extrapolated_lifespan(apart, rest, rest, rest, count);
    CHECK(none.frames == 0);
    CHECK(none.outcome == MetricOutcome::ok);
    // Two that do: the nearer wall counts.
    const Box3<T> common = intersect(
        Box3<T>{Vector<T>(T(-4)), Vector<T>(T(4))}, Box3<T>{Vector<T>(T(-9)), Vector<T>(T(2))}
    );
    CHECK(policy::extrapolated_lifespan(common, rest, right, rest, count).frames == 3);

    const Box3<T> point{rest, rest};
    CHECK(policy::extrapolated_lifespan(point, rest, rest, rest, count).frames == 100);
    CHECK(policy::extrapolated_lifespan(point, rest, right, rest, count).frames == 1);
    const Ball<T> ball{rest, T(0)};
    CHECK(policy::extrapolated_lifespan(ball, rest, rest, count).frames == 100);
    CHECK(policy::extrapolated_lifespan(ball, rest, right, count).frames == 1);
    CHECK(policy::guaranteed_lifespan(ball, rest, rest, {T(1)}, count).frames == 1);
    CHECK(policy::extrapolated_lifespan(ball, right, rest, count).frames == 0);
}

TEMPLATE_TEST_CASE("Motion that cannot be judged is named", "", float, double) {
    using T = TestType;
    const FrameCount<T> count{T(1), 100};
    const Box3<T> box = unit_box<T>();
    const Ball<T> ball{Vector<T>(T(0)), T(1)};
    const Vector<T> rest(T(0));
    const Vector<T> wrong(T(0), std::numeric_limits<T>::quiet_NaN(), T(0));
    const auto extrapolated = [&](const Vector<T>& p, const Vector<T>& v, const Vector<T>& a) {
        return policy::extrapolated_lifespan(box, p, v, a, count).outcome;
    };
    CHECK(extrapolated(rest, rest, rest) == MetricOutcome::ok);
    CHECK(extrapolated(wrong, rest, rest) == MetricOutcome::err_nonfinite);
    CHECK(extrapolated(rest, wrong, rest) == MetricOutcome::err_nonfinite);
    CHECK(extrapolated(rest, rest, wrong) == MetricOutcome::err_nonfinite);
    const FrameCount<T> still{T(0), 100};
    CHECK(policy::extrapolated_lifespan(ball, rest, rest, still).outcome == MetricOutcome::err_dt);
    const auto guaranteed = [&](const MotionBound<T>& bound) {
        const Vector<T> velocity(T(1), T(0), T(0));
        return policy::guaranteed_lifespan(box, rest, velocity, bound, count).outcome;
    };
    CHECK(guaranteed({T(1)}) == MetricOutcome::ok);
    CHECK(guaranteed({T(-1)}) == MetricOutcome::err_bound);
    CHECK(guaranteed({T(1), T(0.5)}) == MetricOutcome::err_bound);
    CHECK(guaranteed({T(1), T(1)}) == MetricOutcome::ok);
    CHECK(guaranteed({T(1), T(2), T(-1)}) == MetricOutcome::err_dt);
    CHECK(guaranteed({wrong.y}) == MetricOutcome::err_nonfinite);
    // The first of several errors, in the order of MetricOutcome.
    const Ball<T> inverted{rest, T(-1)};
    CHECK(
        policy::guaranteed_lifespan(inverted, rest, rest, {T(-1)}, still).outcome ==
        MetricOutcome::err_dt
    );
    CHECK(
        policy::guaranteed_lifespan(inverted, rest, rest, {T(-1)}, count).outcome ==
        MetricOutcome::err_bound
    );
    CHECK(
        policy::guaranteed_lifespan(inverted, wrong, rest, {T(1)}, count).outcome ==
        MetricOutcome::err_nonfinite
    );
}

TEMPLATE_TEST_CASE("Counting frames does not overflow", "", float, double) {
    using T = TestType;
    const Vector<T> rest(T(0));
    const Vector<T> slow(T(1e-30), T(0), T(0));
    constexpr std::uint32_t kMost = std::numeric_limits<std::uint32_t>::max();
    for (const std::uint32_t max_frames : {1U, 2U, 100U, 16777217U, kMost - 1, kMost}) {
        const FrameCount<T> count{T(0.01), max_frames};
        const auto life = policy::extrapolated_lifespan(unit_box<T>(), rest, slow, rest, count);
        CHECK(life.frames == max_frames);
        CHECK(
            policy::extrapolated_lifespan(unit_box<T>(), rest, rest, rest, count).frames ==
            max_frames
        );
    }
}

TEMPLATE_TEST_CASE("Exit times do not depend on the unit of length", "", float, double) {
    using T = TestType;
    support::Random random(41);
    const FrameCount<T> count{T(0.125), 1000};
    for (int i = 0; i < 300; ++i) {
        const Vector<T> position = random.vector(T(-0.9), T(0.9));
        const Vector<T> velocity = random.vector(T(-1), T(1));
        const Vector<T> acceleration = random.vector(T(-1), T(1));
        const MotionBound<T> bound{random.uniform(T(0), T(1)), T(2)};
        const Box3<T> box = unit_box<T>();
        const Ball<T> ball{Vector<T>(T(0)), T(1.7)};
        const auto lives = [&](T unit) {
            const Box3<T> big{box.lo * unit, box.hi * unit};
            const Ball<T> round{ball.center, ball.radius * unit};
            const MotionBound<T> limit{
                bound.max_acceleration * unit, bound.max_speed * unit, T(0.125)};
            const Vector<T> p = position * unit;
            const Vector<T> v = velocity * unit;
            return std::array<T, 4>{
                policy::extrapolated_lifespan(big, p, v, acceleration * unit, count).exit_seconds,
                policy::guaranteed_lifespan(big, p, v, limit, count).exit_seconds,
                policy::extrapolated_lifespan(round, p, v, count).exit_seconds,
                policy::guaranteed_lifespan(round, p, v, limit, count).exit_seconds};
        };
        const auto expected = lives(T(1));
        for (const int exponent : {-100, -70, 20, 100}) {
            const auto scaled = lives(metric::detail::power_of_two<T>(exponent));
            for (std::size_t kind = 0; kind < expected.size(); ++kind) {
                INFO("kind " << kind << " exponent " << exponent);
                CHECK(scaled[kind] == expected[kind]);
            }
        }
    }
}

TEMPLATE_TEST_CASE(
    "A guaranteed life span is never longer than any motion allows", "", float, double
) {
    using T = TestType;
    support::Random random(42);
    // A sample of motion is a random path of constant accelerations within the bound, one a
    // quarter of a frame, followed exactly in double precision.
    constexpr int kPieces = 4;
    int left_early = 0;
    for (int i = 0; i < 2000; ++i) {
        const FrameCount<T> count{T(0.0625), 400};
        const bool limited = random.below(2) == 0;
        const Vector<T> position = random.vector(T(-0.5), T(0.5));
        const Vector<T> velocity = random.direction<T>() * random.uniform(T(0), T(0.8));
        MotionBound<T> bound;
        bound.max_acceleration = random.uniform(T(0.01), T(2));
        bound.max_speed = limited ? T(1) : bound.max_speed;
        const Box3<T> box = unit_box<T>();
        const Ball<T> ball{Vector<T>(T(0)), T(1)};
        const auto box_life = policy::guaranteed_lifespan(box, position, velocity, bound, count);
        const auto ball_life = policy::guaranteed_lifespan(ball, position, velocity, bound, count);
        glm::dvec3 p(position);
        glm::dvec3 v(velocity);
        const double dt = static_cast<double>(count.frame_seconds) / kPieces;
        // Now and then the worst case itself: straight along an axis.
        const glm::dvec3 bias =
            random.below(3) == 0 ? glm::dvec3(0, 1, 0) : random.direction<double>();
        std::uint32_t box_frames = 0;
        std::uint32_t ball_frames = 0;
        bool in_box = true;
        bool in_ball = true;
        for (std::uint32_t frame = 0; frame < 400 && (in_box || in_ball); ++frame) {
            // Rounding of the exact worst case: 1e-9 of the box, more than 8 u in double; in float
            // the positions are exact, so the life spans may be one step of rounding off.
            const double tolerance = 16 * static_cast<double>(std::numeric_limits<T>::epsilon());
            in_box = in_box && glm::all(glm::lessThanEqual(glm::abs(p), glm::dvec3(1 + tolerance)));
            in_ball = in_ball && glm::length(p) <= 1 + tolerance;
            box_frames += in_box ? 1 : 0;
            ball_frames += in_ball ? 1 : 0;
            for (int piece = 0; piece < kPieces; ++piece) {
                const glm::dvec3 wish = glm::normalize(bias * 3.0 + random.direction<double>());
                glm::dvec3 a = wish * static_cast<double>(bound.max_acceleration);
                const double speed_limit = static_cast<double>(bound.max_speed);
                if (glm::length(v + a * dt) > speed_limit) {
                    a = glm::dvec3(0.0);
                }
                p += v * dt + a * (dt * dt / 2);
                v += a * dt;
            }
        }
        CHECK(box_life.frames <= box_frames);
        CHECK(ball_life.frames <= ball_frames);
        left_early += box_frames < 400 ? 1 : 0;
    }
    CHECK(left_early > 1000);
}

TEMPLATE_TEST_CASE("A guaranteed life span holds for engines that step", "", float, double) {
    using T = TestType;
    support::Random random(43);
    int exact = 0;
    constexpr int kCases = 2000;
    for (int i = 0; i < kCases; ++i) {
        const T dt = T(0.0625);
        const FrameCount<T> count{dt, 400};
        const bool limited = random.below(2) == 0;
        const T start = random.uniform(T(-0.5), T(0.5));
        const T speed = random.uniform(T(-0.5), T(0.5));
        MotionBound<T> bound{random.uniform(T(0.01), T(2))};
        bound.max_speed = limited ? T(0.75) : bound.max_speed;
        bound.step_seconds = dt;
        const auto life = policy::guaranteed_lifespan(
            unit_box<T>(), {start, T(0), T(0)}, {speed, T(0), T(0)}, bound, count
        );
        // The worst: full acceleration towards either wall from the first step on.
        std::uint32_t frames = 400;
        for (const double side : {-1.0, 1.0}) {
            double p = side * static_cast<double>(start);
            double v = side * static_cast<double>(speed);
            std::uint32_t in_zone = 0;
            while (in_zone < 400 && p <= 1.0) {
                ++in_zone;
                v = std::min(
                    v + static_cast<double>(bound.max_acceleration) * static_cast<double>(dt),
                    static_cast<double>(bound.max_speed)
                );
                p += v * static_cast<double>(dt);
            }
            frames = std::min(frames, in_zone);
        }
        // Other axes, at rest in the middle, leave later or at the same time, except where the box
        // is left along x by braking only.
        CHECK(life.frames <= frames);
        exact += life.frames == frames ? 1 : 0;
    }
    // Exact without a speed limit but for accelerated axes at rest; a frame less at times with one.
    CHECK(exact > kCases / 2);
}

TEMPLATE_TEST_CASE("Steps that just pass the boundary are not counted", "", float, double) {
    using T = TestType;
    support::Random random(45);
    for (int i = 0; i < 4000; ++i) {
        // Multiples of 2^-10 and a step of 2^-4: positions after each step are exact in T.
        const T dt = T(0.0625);
        const T speed = static_cast<T>(random.below(256)) / 1024;
        const T acceleration = static_cast<T>(1 + random.below(64)) / 1024;
        const std::uint32_t steps = 1 + random.below(24);
        const auto k = static_cast<T>(steps);
        const T reach = k * speed * dt + acceleration * dt * dt * k * (k + 1) / 2;
        // Ahead of the origin by so little that the distance to the boundary is rounded to reach.
        const Vector<T> position(reach * std::numeric_limits<T>::epsilon() / 8, T(0), T(0));
        const Box3<T> zone{Vector<T>(T(-1000)), {reach, T(1000), T(1000)}};
        const MotionBound<T> bound{acceleration, std::numeric_limits<T>::infinity(), dt};
        const auto life = policy::guaranteed_lifespan(
            zone, position, {speed, T(0), T(0)}, bound, FrameCount<T>{dt, 1000}
        );
        INFO("speed " << speed << " acceleration " << acceleration << " steps " << steps);
        CHECK(life.frames == steps);
    }
}

TEMPLATE_TEST_CASE("Extrapolation meets the simulated path", "", double) {
    support::Random random(44);
    const FrameCount<double> count{0.01, 100000};
    for (int i = 0; i < 500; ++i) {
        const glm::dvec3 p = random.vector(-0.9, 0.9);
        const glm::dvec3 v = random.vector(-1.0, 1.0);
        const glm::dvec3 a = random.vector(-1.0, 1.0);
        const Box3<double> box{glm::dvec3(-1), glm::dvec3(1)};
        const auto life = policy::extrapolated_lifespan(box, p, v, a, count);
        REQUIRE(life.frames > 0);
        const auto at = [&](double t) { return p + v * t + a * (t * t / 2); };
        // In the zone in the last counted frame, out of it in the next; 1e-12: rounding of the
        // path.
        const double last = (life.frames - 1) * count.frame_seconds;
        CHECK(contains(inflate(box, glm::dvec3(1e-12)), at(last)));
        CHECK_FALSE(contains(inflate(box, glm::dvec3(-1e-12)), at(life.exit_seconds)));
        CHECK(life.exit_seconds >= last);
        CHECK(life.exit_seconds < last + count.frame_seconds);
        const Ball<double> ball{glm::dvec3(0.1), 2.0};
        const auto round = policy::extrapolated_lifespan(ball, p, v, count);
        const glm::dvec3 exit = p + v * round.exit_seconds;
        CHECK(glm::distance(exit, ball.center) == Approx(ball.radius).epsilon(1e-12));
    }
}

TEST_CASE("the life span of a test is that of the zone it tests for", "[lifespan]") {
    support::Random random(31);
    for (int repeat = 0; repeat < 2000; ++repeat) {
        const glm::dvec3 half(
            random.uniform(0.1, 3.0), random.uniform(0.1, 3.0), random.uniform(0.1, 3.0)
        );
        const farfield::Box3d zone{-half, half};
        const glm::dvec3 position(
            random.uniform(-1.0, 1.0) * half.x,
            random.uniform(-1.0, 1.0) * half.y,
            random.uniform(-1.0, 1.0) * half.z
        );
        const glm::dvec3 velocity = random.direction<double>() * random.uniform(0.01, 30.0);
        const farfield::FrameCount<double> count{.frame_seconds = 1.0 / 60, .max_frames = 600};
        const auto expected = policy::extrapolated_lifespan_unchecked(
            zone, position, velocity, glm::dvec3(0.0), count
        );
        const std::uint32_t frames = policy::extrapolated_lifespan_where(
            [&](const glm::dvec3& eye) { return contains(zone, eye); },
            position,
            velocity,
            glm::dvec3(0.0),
            count
        );
        // Where the exit lies on a frame but for rounding, either answer is right.
        const double exit_frames = expected.exit_seconds / count.frame_seconds;
        if (std::abs(exit_frames - std::round(exit_frames)) > 1e-9) {
            CHECK(frames == expected.frames);
        }
    }
}

TEST_CASE("the life span of a test: at once, never, at rest, turning back", "[lifespan]") {
    const farfield::FrameCount<double> count{.frame_seconds = 1.0, .max_frames = 100};
    const glm::dvec3 none(0.0);
    const glm::dvec3 along(1.0, 0.0, 0.0);
    const auto frames_before = [&](double limit, const glm::dvec3& velocity) {
        return policy::extrapolated_lifespan_where(
            [&](const glm::dvec3& eye) { return eye.x < limit; }, none, velocity, none, count
        );
    };
    CHECK(frames_before(0.5, along) == 1);
    CHECK(frames_before(1.0, along) == 1);
    CHECK(frames_before(1.5, along) == 2);
    for (const double limit : {6.5, 32.5, 63.5, 98.5}) {
        CHECK(frames_before(limit, along) == static_cast<std::uint32_t>(limit + 1.0));
    }
    CHECK(frames_before(99.5, along) == 100);
    CHECK(frames_before(1e9, along) == 100);
    CHECK(frames_before(0.5, none) == 100);
    CHECK(frames_before(0.5, -along) == 100);
    const farfield::FrameCount<double> one{.frame_seconds = 1.0, .max_frames = 1};
    CHECK(
        policy::extrapolated_lifespan_where(
            [](const glm::dvec3&) { return true; }, none, along, none, one
        ) == 1
    );
    // Position 5 t - t^2 / 2: beyond 10 from frame 3 to 7, and seen to be so.
    const std::uint32_t turning = policy::extrapolated_lifespan_where(
        [](const glm::dvec3& eye) { return eye.x < 10.0; }, none, 5.0 * along, -along, count
    );
    CHECK(turning == 3);
}
