#include "support/random.hpp"
#include "technique/placement_site.hpp"
#include "technique/yaw_set.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

namespace {

using namespace farfield;
using farfield::support::Random;

constexpr double kPi = std::numbers::pi;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
/// [rad] What `YawSet::add` adds on both sides of an arc.
constexpr double kMargin = 1e-9;

bool contains(const YawSet& set, double yaw) {
    return std::any_of(set.arcs().begin(), set.arcs().end(), [&](const YawArc& arc) {
        return arc.from <= yaw && yaw <= arc.to;
    });
}

/// a cos y + b sin y + c, with the largest of its parts.
struct Wave {
    double a = 0.0;
    double b = 0.0;
    double c = 0.0;

    [[nodiscard]] double at(double yaw) const {
        // Sines and cosines of the angle that is asked for, not of one that is rounded twice.
        const auto y = static_cast<long double>(yaw);
        return static_cast<double>(a * std::cos(y) + b * std::sin(y) + c);
    }
    [[nodiscard]] double scale() const { return std::abs(a) + std::abs(b) + std::abs(c); }
};

/// Even steps from -pi to pi, and both sides of every end of an arc, nearer than any margin and
/// farther than all.
std::vector<double> yaws_around(const YawSet& set, int steps) {
    std::vector<double> yaws;
    for (int i = 0; i <= steps; ++i) {
        yaws.push_back(-kPi + 2.0 * kPi * i / steps);
    }
    yaws.back() = kPi;
    for (const YawArc& arc : set.arcs()) {
        for (const double end : {arc.from, arc.to}) {
            for (const double by : {-3e-9, -1e-9, -1e-12, 0.0, 1e-12, 1e-9, 3e-9}) {
                yaws.push_back(std::clamp(end + by, -kPi, kPi));
            }
        }
    }
    return yaws;
}

/// Arcs ascend, are apart, and lie within a turn.
bool is_in_order(const YawSet& set) {
    double before = -std::numeric_limits<double>::infinity();
    for (const YawArc& arc : set.arcs()) {
        if (!(arc.from > before && arc.from <= arc.to && arc.from >= -kPi && arc.to <= kPi)) {
            return false;
        }
        before = arc.to;
    }
    return true;
}

/// A set holds all yaws at which one of the waves is not negative. Where a wave only just reaches
/// 0, `acos` rounds by more than the margin, though the wave is not above some roundings there.
void check_union(const YawSet& set, const std::vector<Wave>& waves, bool exactly) {
    REQUIRE(is_in_order(set));
    for (const double yaw : yaws_around(set, 720)) {
        bool wanted = false;
        bool allowed = false;
        for (const Wave& wave : waves) {
            const double value = wave.at(yaw);
            wanted = wanted || value > 8.0 * kEpsilon * wave.scale();
            // The slope of a wave is at most its amplitude.
            allowed = allowed || value >= -(1.01 * kMargin + 8.0 * kEpsilon) * wave.scale();
        }
        CAPTURE(yaw);
        if (wanted) {
            REQUIRE(contains(set, yaw));
        }
        if (exactly && !allowed) {
            REQUIRE_FALSE(contains(set, yaw));
        }
    }
}

YawSet set_of(const std::vector<Wave>& waves) {
    YawSet set;
    for (const Wave& wave : waves) {
        set.add(wave.a, wave.b, wave.c);
    }
    return set;
}

/// A set of an arc around `middle`.
YawSet arc_around(double middle, double half) {
    YawSet set;
    set.add(std::cos(middle), std::sin(middle), -std::cos(half));
    return set;
}

double length_of(const YawSet& set) {
    double length = 0.0;
    for (const YawArc& arc : set.arcs()) {
        length += arc.to - arc.from;
    }
    return length;
}

/// How far inside of the planes of a camera at a yaw and pitch the best of a box's corners are: of
/// the plane where that is least, over the length of the longest corner.
double inside_of(const PlacementTask& task, const Box3d& box, double yaw, double pitch) {
    const View view = level_view(task.frame, glm::dvec3(0.0), yaw, pitch, {});
    const glm::dmat3& axes = view.camera_to_world;
    const Lens& lens = task.options.lens;
    std::array<double, 5> most{};
    most.fill(-std::numeric_limits<double>::infinity());
    double longest = 0.0;
    for (unsigned i = 0; i < 8; ++i) {
        const glm::dvec3 at = corner(box, i);
        const double x = glm::dot(at, axes[0]);
        const double y = glm::dot(at, axes[1]);
        const double depth = -glm::dot(at, axes[2]);
        longest = std::max(longest, glm::length(at));
        const std::array<double, 5> inside = {
            (x - lens.left * depth) / std::hypot(1.0, lens.left),
            (lens.right * depth - x) / std::hypot(1.0, lens.right),
            (y - lens.bottom * depth) / std::hypot(1.0, lens.bottom),
            (lens.top * depth - y) / std::hypot(1.0, lens.top),
            depth};
        for (std::size_t plane = 0; plane < most.size(); ++plane) {
            most[plane] = std::max(most[plane], inside[plane]);
        }
    }
    return *std::min_element(most.begin(), most.end()) / std::max(longest, 1e-300);
}

Lens random_lens(Random& random) {
    Lens lens;
    lens.left = random.uniform(-2.0, 0.5);
    lens.right = lens.left + random.uniform(0.2, 3.0);
    lens.bottom = random.uniform(-1.5, 0.5);
    lens.top = lens.bottom + random.uniform(0.2, 2.0);
    return lens;
}

/// Around the eye, beside it, behind it; flat ones and points too.
Box3d random_box(Random& random) {
    const glm::dvec3 middle = random.vector(-20.0, 20.0);
    glm::dvec3 half = random.vector(0.0, random.below(3) == 0 ? 30.0 : 5.0);
    for (int axis = 0; axis < 3; ++axis) {
        if (random.below(5) == 0) {
            half[axis] = 0.0;
        }
    }
    return {middle - half, middle + half};
}

} // namespace

TEST_CASE("a set of yaws begins empty and may be full") {
    const YawSet none;
    CHECK(none.arcs().empty());
    CHECK_FALSE(contains(none, 0.0));
    const YawSet all = YawSet::full();
    REQUIRE(all.arcs().size() == 1);
    CHECK(contains(all, -kPi));
    CHECK(contains(all, 0.0));
    CHECK(contains(all, kPi));
}

TEST_CASE("a wave that does not wave is always or never") {
    CHECK(length_of(set_of({{0.0, 0.0, 1.0}})) == 2.0 * kPi);
    CHECK(length_of(set_of({{0.0, 0.0, 0.0}})) == 2.0 * kPi);
    CHECK(set_of({{0.0, 0.0, -1.0}}).arcs().empty());
    CHECK(length_of(set_of({{3.0, 4.0, 5.0}})) == 2.0 * kPi);
    CHECK(set_of({{3.0, 4.0, -5.5}}).arcs().empty());
    // Just touched: a point, which has to be there.
    const YawSet point = set_of({{3.0, 4.0, -5.0}});
    CHECK(contains(point, std::atan2(4.0, 3.0)));
    CHECK(length_of(point) <= 1e-7);
    // All but little is not all.
    CHECK(length_of(set_of({{1.0, 0.0, 1.0 - 1e-10}})) < 2.0 * kPi);
}

TEST_CASE("half a turn has its two ends") {
    const YawSet ahead = set_of({{1.0, 0.0, 0.0}});
    REQUIRE(ahead.arcs().size() == 1);
    CHECK(ahead.arcs()[0].from == Approx(-kPi / 2.0).margin(2.0 * kMargin));
    CHECK(ahead.arcs()[0].to == Approx(kPi / 2.0).margin(2.0 * kMargin));
    CHECK(ahead.arcs()[0].from < -kPi / 2.0);
    CHECK(ahead.arcs()[0].to > kPi / 2.0);
}

TEST_CASE("an arc through pi is two, and holds pi from both sides") {
    for (const double middle : {kPi, -kPi, kPi - 0.3, -kPi + 0.3}) {
        const YawSet behind = arc_around(middle, 0.5);
        CAPTURE(middle);
        REQUIRE(behind.arcs().size() == 2);
        CHECK(behind.arcs()[0].from == -kPi);
        CHECK(behind.arcs()[1].to == kPi);
        CHECK(length_of(behind) == Approx(1.0).margin(4.0 * kMargin));
        CHECK_FALSE(contains(behind, 0.0));
    }
    // One that ends at pi: that is -pi too.
    for (const double side : {1.0, -1.0}) {
        const YawSet to_pi = arc_around(side * (kPi - 0.5), 0.5);
        CHECK(contains(to_pi, kPi));
        CHECK(contains(to_pi, -kPi));
    }
}

TEST_CASE("a wave's set misses nothing and holds no more than its margin") {
    Random random(1);
    for (int run = 0; run < 600; ++run) {
        const double turn = random.uniform(-kPi, kPi);
        const double size = std::pow(10.0, random.uniform(-6.0, 7.0));
        // Some nearly touch, or nearly hold all.
        double share = random.uniform(-1.1, 1.1);
        if (run % 3 == 0) {
            const double little = std::pow(10.0, random.uniform(-16.0, -1.0));
            share = (run % 2 == 0 ? 1.0 : -1.0) * (1.0 - little);
        }
        const Wave wave{size * std::cos(turn), size * std::sin(turn), size * share};
        CAPTURE(wave.a, wave.b, wave.c);
        check_union(set_of({wave}), {wave}, true);
    }
}

TEST_CASE("where a wave is steep not even rounding loses its zero") {
    Random random(2);
    for (int run = 0; run < 2000; ++run) {
        const Wave wave{
            random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-0.9, 0.9)};
        const double amplitude = std::hypot(wave.a, wave.b);
        if (std::abs(wave.c) > 0.99 * amplitude) {
            continue;
        }
        const YawSet set = set_of({wave});
        const double half = std::acos(-wave.c / amplitude);
        for (const double side : {-1.0, 1.0}) {
            const double zero = std::remainder(std::atan2(wave.b, wave.a) + side * half, 2.0 * kPi);
            CAPTURE(wave.a, wave.b, wave.c, zero);
            REQUIRE(contains(set, zero));
            const double inwards = std::remainder(zero - side * 2e-9, 2.0 * kPi);
            const double outwards = std::remainder(zero + side * 2e-9, 2.0 * kPi);
            REQUIRE(contains(set, inwards));
            REQUIRE_FALSE(contains(set, outwards));
        }
    }
}

TEST_CASE("a union is that of its waves, in any order") {
    Random random(3);
    for (int run = 0; run < 400; ++run) {
        std::vector<Wave> waves(1 + random.below(8));
        for (Wave& wave : waves) {
            const double turn = random.uniform(-kPi, kPi);
            wave = {std::cos(turn), std::sin(turn), -std::cos(random.uniform(0.01, 0.6))};
        }
        const YawSet set = set_of(waves);
        check_union(set, waves, true);
        std::reverse(waves.begin(), waves.end());
        const YawSet other = set_of(waves);
        REQUIRE(other.arcs().size() == set.arcs().size());
        for (std::size_t i = 0; i < set.arcs().size(); ++i) {
            REQUIRE(other.arcs()[i].from == set.arcs()[i].from);
            REQUIRE(other.arcs()[i].to == set.arcs()[i].to);
        }
    }
}

TEST_CASE("what is in both sets is in the common one, and nothing else") {
    Random random(4);
    for (int run = 0; run < 400; ++run) {
        std::array<YawSet, 2> sets;
        for (YawSet& set : sets) {
            const unsigned arcs = random.below(7);
            for (unsigned i = 0; i < arcs; ++i) {
                const double turn = random.uniform(-kPi, kPi);
                set.add(std::cos(turn), std::sin(turn), -std::cos(random.uniform(0.0, 0.7)));
            }
        }
        YawSet both = sets[0];
        both.intersect(sets[1]);
        REQUIRE(is_in_order(both));
        YawSet turned = sets[1];
        turned.intersect(sets[0]);
        std::vector<double> yaws = yaws_around(sets[0], 720);
        const std::vector<double> more = yaws_around(sets[1], 1);
        yaws.insert(yaws.end(), more.begin(), more.end());
        for (const double yaw : yaws) {
            CAPTURE(run, yaw);
            REQUIRE(contains(both, yaw) == (contains(sets[0], yaw) && contains(sets[1], yaw)));
            REQUIRE(contains(turned, yaw) == contains(both, yaw));
        }
        YawSet same = sets[0];
        same.intersect(YawSet::full());
        REQUIRE(length_of(same) == length_of(sets[0]));
        same.intersect(YawSet());
        REQUIRE(same.arcs().empty());
    }
}

TEST_CASE("what there is no room for only makes a set larger") {
    Random random(5);
    for (int run = 0; run < 100; ++run) {
        std::vector<Wave> waves;
        YawSet set;
        std::size_t most = 0;
        for (int i = 0; i < 80; ++i) {
            const double turn = random.uniform(-kPi, kPi);
            waves.push_back({std::cos(turn), std::sin(turn), -std::cos(0.012)});
            set.add(waves.back().a, waves.back().b, waves.back().c);
            most = std::max(most, set.arcs().size());
            if (i % 8 == 7) {
                check_union(set, waves, set.arcs().size() < 24 && most < 24);
            }
        }
        // 80 arcs of 0.024 in a turn of 6.3 leave more gaps than there is room for.
        CHECK(most == 24);
    }
}

TEST_CASE("a box is in the directions in which every plane lets it through") {
    Random random(6);
    // A camera's axes, dot products and tangents round by some of these; directions have a margin
    // of kMargin, which is as much of the length of a corner as of the angle.
    constexpr double kRounding = 64.0 * kEpsilon;
    std::size_t in = 0;
    std::size_t out = 0;
    for (int run = 0; run < 400; ++run) {
        PlacementOptions options;
        options.lens = random_lens(random);
        const glm::dvec3 up =
            run % 2 == 0 ? glm::dvec3(0.0, 1.0, 0.0) : 3.0 * random.direction<double>();
        const PlacementTask task{.options = options, .cells = {}, .frame = yaw_frame(up)};
        const Box3d box = random_box(random);
        const YawSet set = directions_of(task, box.lo, box.hi);
        CAPTURE(run, box.lo.x, box.lo.y, box.lo.z, box.hi.x, box.hi.y, box.hi.z);
        REQUIRE(is_in_order(set));
        for (const double yaw : yaws_around(set, 360)) {
            const double least = inside_of(task, box, yaw, 0.0);
            CAPTURE(yaw, least);
            if (least > kRounding) {
                REQUIRE(contains(set, yaw));
                ++in;
            } else if (least < -1.01 * kMargin - kRounding) {
                REQUIRE_FALSE(contains(set, yaw));
                ++out;
            }
        }
    }
    CHECK(in > 30'000);
    CHECK(out > 30'000);
}

TEST_CASE("directions hold what any pitch lets through") {
    Random random(7);
    std::size_t in = 0;
    std::size_t out = 0;
    std::size_t needless = 0;
    for (int run = 0; run < 400; ++run) {
        PlacementOptions options;
        options.lens = random_lens(random);
        options.max_pitch = random.below(4) == 0 ? 1.2 : random.uniform(0.01, 1.0);
        const PlacementTask task{.options = options, .cells = {}, .frame = yaw_frame(options.up)};
        const Box3d box = random_box(random);
        const YawSet set = directions_of(task, box.lo, box.hi);
        REQUIRE(is_in_order(set));
        for (const double yaw : yaws_around(set, 180)) {
            bool seen = false;
            for (int step = -8; step <= 8; ++step) {
                const double pitch = options.max_pitch * step / 8.0;
                seen = seen || inside_of(task, box, yaw, pitch) > 64.0 * kEpsilon;
            }
            CAPTURE(run, yaw, options.max_pitch);
            if (seen) {
                REQUIRE(contains(set, yaw));
                ++in;
            } else {
                ++out;
                needless += contains(set, yaw) ? 1U : 0U;
            }
        }
    }
    CHECK(in > 15'000);
    CHECK(out > 15'000);
    // Planes are taken one by one, each at the pitch that is best for it.
    CHECK(static_cast<double>(needless) < 0.3 * static_cast<double>(out));
}

TEST_CASE("a small box at eye level is in as many directions as the lens is wide, at any pitch") {
    for (const double max_pitch : {0.0, 0.5, 1.2}) {
        PlacementOptions options;
        options.lens = {-1.0, 0.5, -0.75, 0.75, 0.1, 100.0};
        options.max_pitch = max_pitch;
        const PlacementTask task{.options = options, .cells = {}, .frame = yaw_frame(options.up)};
        for (int i = 0; i < 32; ++i) {
            const double yaw = -kPi + 2.0 * kPi * i / 32.0;
            const glm::dvec3 at =
                100.0 * (std::cos(yaw) * task.frame.forward + std::sin(yaw) * task.frame.right);
            const YawSet set = directions_of(task, at - 1e-6, at + 1e-6);
            // Seen by a camera that has turned from 1/2 tangent to its left to 1 to its right.
            // A box of 1e-6 m is 1e-8 rad, and its planes are as far apart.
            CHECK(length_of(set) == Approx(std::atan(1.0) + std::atan(0.5)).margin(1e-7));
            for (const double turn : {-0.4636, 0.0, 0.7853}) {
                CHECK(contains(set, std::remainder(yaw + turn, 2.0 * kPi)));
            }
            for (const double turn : {-0.4637, 0.7855}) {
                CHECK_FALSE(contains(set, std::remainder(yaw + turn, 2.0 * kPi)));
            }
        }
    }
}

TEST_CASE("a box around the eye is in all directions") {
    Random random(8);
    for (const double max_pitch : {0.0, 0.7}) {
        PlacementOptions options;
        options.max_pitch = max_pitch;
        const PlacementTask task{.options = options, .cells = {}, .frame = yaw_frame(options.up)};
        for (int run = 0; run < 50; ++run) {
            const Box3d box{random.vector(-5.0, -0.01), random.vector(0.01, 5.0)};
            CHECK(length_of(directions_of(task, box.lo, box.hi)) == 2.0 * kPi);
        }
        CHECK(length_of(directions_of(task, glm::dvec3(0.0), glm::dvec3(0.0))) == 2.0 * kPi);
    }
}
