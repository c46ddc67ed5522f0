#include "metric/reference.hpp"
#include "support/random.hpp"
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>
#include <farfield/metric/impostor_angles.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace farfield;
using support::Case;
using support::kRoundoff;
using support::Real;
using support::RealVector;

template <typename T>
using Vector = glm::vec<3, T>;

/// A box of 2 by 2 by 2 whose centre is 5 ahead of the origin.
template <typename T>
Box3<T> box_ahead() {
    return {{T(-1), T(-1), T(-6)}, {T(1), T(1), T(-4)}};
}

/// A box seen from outside its own depth, and a viewer who sees the front of its impostor.
template <typename T>
Case<T> impostor_case(support::Random& random) {
    for (;;) {
        Case<T> c = support::random_case<T>(random, T(0.5), T(50));
        c.image = metric::impostor_plane(c.box, c.image.viewpoint);
        if (metric::check(c.image, c.box, c.viewer) == MetricOutcome::ok) {
            return c;
        }
    }
}

} // namespace

TEMPLATE_TEST_CASE("Impostors of degenerate boxes", "", float, double) {
    using T = TestType;
    const Vector<T> origin(T(0));
    const Vector<T> aside(T(0.5), T(0.25), T(0.1));
    const Box3<T> point{{T(1), T(2), T(-5)}, {T(1), T(2), T(-5)}};
    const auto of_point = metric::impostor_view(point, origin, aside);
    REQUIRE(of_point.outcome == MetricOutcome::ok);
    CHECK(of_point.view.half_depth == T(0));
    CHECK(of_point.view.half_width == T(0));
    CHECK(metric::alpha_trans_unchecked(of_point.view) == T(0));
    CHECK(metric::alpha_size_unchecked(of_point.view) == T(0));
    // A plate that faces the viewpoint lies in its impostor.
    const Box3<T> plate{{T(-1), T(-1), T(-5)}, {T(1), T(1), T(-5)}};
    const auto of_plate = metric::impostor_view(plate, origin, aside);
    CHECK(of_plate.view.half_depth == T(0));
    CHECK(metric::alpha_trans_unchecked(of_plate.view) == T(0));
    CHECK(metric::alpha_trans_corners_unchecked(plate, origin, aside) == T(0));
    CHECK(metric::alpha_size_corners_unchecked(plate, origin, aside) == T(0));
}

TEMPLATE_TEST_CASE("Impostors that cannot be shown are named", "", float, double) {
    using T = TestType;
    const Box3<T> box = box_ahead<T>();
    const Vector<T> origin(T(0));
    const auto outcome = [&](const Vector<T>& viewpoint, const Vector<T>& viewer) {
        const auto measured = metric::impostor_view(box, viewpoint, viewer);
        CHECK(std::isnan(measured.view.sideways) == is_error(measured.outcome));
        return measured.outcome;
    };
    CHECK(outcome(origin, origin) == MetricOutcome::ok);
    CHECK(outcome(center(box), origin) == MetricOutcome::err_v0_plane);
    CHECK(outcome({T(0), T(0), T(-4.5)}, origin) == MetricOutcome::err_behind);
    CHECK(outcome(origin, center(box)) == MetricOutcome::pi_inside);
    CHECK(outcome(origin, {T(3), T(0), T(-7)}) == MetricOutcome::pi_backface);
    CHECK(outcome(origin, {std::nan(""), T(0), T(0)}) == MetricOutcome::err_nonfinite);
    CHECK(metric::impostor_view({}, origin, origin).outcome == MetricOutcome::err_nonfinite);
    CHECK(
        metric::impostor_view({box.hi, box.lo}, origin, origin).outcome == MetricOutcome::err_box
    );
}

TEMPLATE_TEST_CASE("Motions along the axes of an impostor", "", float, double) {
    using T = TestType;
    const Box3<T> box = box_ahead<T>();
    const Vector<T> origin(T(0));
    const auto still = metric::impostor_view_unchecked(box, origin, origin);
    CHECK(still.distance == T(5));
    CHECK(still.half_depth == T(1));
    CHECK(still.half_width == Approx(std::numbers::sqrt2));
    CHECK(metric::alpha_trans_unchecked(still) == T(0));
    CHECK(metric::alpha_spread_unchecked(still) == T(0));
    CHECK(metric::alpha_size_unchecked(still) == T(0));

    const Vector<T> aside(T(0.5), T(0), T(0));
    const auto sideways = metric::impostor_view_unchecked(box, origin, aside);
    CHECK(sideways.inwards == T(0));
    CHECK(sideways.sideways == T(0.5));
    CHECK(metric::alpha_trans_unchecked(sideways) == Approx(std::atan2(0.5, 20.25)));
    CHECK(metric::alpha_spread_unchecked(sideways) == Approx(std::atan2(1.0, 24.25)));
    CHECK(metric::alpha_size_unchecked(sideways) == T(0));
    CHECK(metric::alpha_size_corners_unchecked(box, origin, aside) == T(0));

    const Vector<T> nearer(T(0), T(0), T(-1));
    const auto inwards = metric::impostor_view_unchecked(box, origin, nearer);
    CHECK(inwards.inwards == T(1));
    CHECK(inwards.sideways == T(0));
    CHECK(metric::alpha_trans_unchecked(inwards) == T(0));
    // All eight corners are equally far from the axis, so the closed form is theirs.
    const T corners = metric::alpha_size_corners_unchecked(box, origin, nearer);
    CHECK(
        std::abs(metric::alpha_size_unchecked(inwards) - corners) <= 64 * T(kRoundoff<T>) * corners
    );
    CHECK(metric::alpha_trans_corners_unchecked(box, origin, nearer) == T(0));
    // At the front of the box, and in it.
    ImpostorView<T> view = still;
    view.inwards = T(4);
    CHECK(metric::alpha_size_unchecked(view) == std::numbers::pi_v<T>);
    view.inwards = T(4.5);
    CHECK(metric::alpha_size_unchecked(view) == std::numbers::pi_v<T>);
}

TEMPLATE_TEST_CASE("Closed forms are angles of their points", "", float, double) {
    using T = TestType;
    support::Random random(61);
    for (int i = 0; i < 1000; ++i) {
        // The axis is -z, so that the points which the forms speak of can be named.
        const T distance = random.uniform(T(2), T(50));
        const Vector<T> half(random.uniform(T(0.1), T(1)));
        const Vector<T> middle(T(0), T(0), -distance);
        const Box3<T> box{middle - half, middle + half};
        const Vector<T> origin(T(0));
        const T x = distance * std::pow(T(10), random.uniform(T(-4), T(-0.3)));
        const ImagePlane<T> image = metric::impostor_plane(box, origin);
        const Vector<T> viewer(T(0), x, T(0));
        const auto view = metric::impostor_view_unchecked(box, origin, viewer);
        const Vector<T> front(T(0), T(0), box.hi.z);
        const Vector<T> back(T(0), T(0), box.lo.z);
        const T trans = metric::alpha_trans_unchecked(view);
        const T angle = metric::angular_discrepancy_unchecked(image, viewer, front);
        // Both are within their limits of 64 and 8 units, of f rounded to units of D / f.
        const T limit = 64 * T(kRoundoff<T>) * (1 + distance / half.z) * angle;
        CHECK(std::abs(trans - angle) <= limit);
        CHECK(metric::angular_discrepancy_unchecked(image, viewer, back) <= trans + limit);
        // The other reading: twice at most, and never less.
        const T spread = metric::alpha_spread_unchecked(view);
        CHECK(spread >= trans * (1 - 16 * T(kRoundoff<T>)));
        CHECK(spread <= 2 * trans * (1 + 16 * T(kRoundoff<T>)));
    }
}

TEMPLATE_TEST_CASE("Impostor angles depend on shapes, not on units", "", float, double) {
    using T = TestType;
    support::Random random(62);
    for (int i = 0; i < 300; ++i) {
        const Case<T> c = impostor_case<T>(random);
        INFO(c);
        const Vector<T>& viewpoint = c.image.viewpoint;
        const auto view = metric::impostor_view_unchecked(c.box, viewpoint, c.viewer);
        const T by_corners = metric::alpha_trans_corners_unchecked(c.box, viewpoint, c.viewer);
        for (const int exponent : {-60, -20, 7, 100}) {
            const T unit = metric::detail::power_of_two<T>(exponent);
            const Box3<T> box{c.box.lo * unit, c.box.hi * unit};
            const auto scaled =
                metric::impostor_view_unchecked<T>(box, viewpoint * unit, c.viewer * unit);
            CHECK(scaled.distance == view.distance * unit);
            CHECK(scaled.half_depth == view.half_depth * unit);
            CHECK(scaled.half_width == view.half_width * unit);
            CHECK(scaled.inwards == view.inwards * unit);
            CHECK(scaled.sideways == view.sideways * unit);
            CHECK(metric::alpha_trans_unchecked(scaled) == metric::alpha_trans_unchecked(view));
            CHECK(metric::alpha_size_unchecked(scaled) == metric::alpha_size_unchecked(view));
            CHECK(
                metric::alpha_trans_corners_unchecked<T>(box, viewpoint * unit, c.viewer * unit) ==
                by_corners
            );
        }
    }
}

TEMPLATE_TEST_CASE("Impostor angles depend on shapes, not on places", "", float, double) {
    using T = TestType;
    support::Random random(63);
    // On a grid of 1/256 with coordinates below 64, sums with 4096 are exact even in float.
    const auto on_grid = [](const Vector<T>& v) { return glm::round(v * T(256)) / T(256); };
    const Vector<T> shift(T(4096), T(-1024), T(2048));
    for (int i = 0; i < 300; ++i) {
        const Case<T> c = impostor_case<T>(random);
        const Box3<T> box{on_grid(c.box.lo), on_grid(c.box.hi)};
        const Vector<T> viewpoint = on_grid(c.image.viewpoint);
        const Vector<T> viewer = on_grid(c.viewer);
        const auto here = metric::impostor_view(box, viewpoint, viewer);
        const auto there = metric::impostor_view<T>(
            {box.lo + shift, box.hi + shift}, viewpoint + shift, viewer + shift
        );
        CHECK(here.outcome == there.outcome);
        if (here.outcome == MetricOutcome::ok) {
            CHECK(here.view.distance == there.view.distance);
            CHECK(here.view.half_depth == there.view.half_depth);
            CHECK(here.view.sideways == there.view.sideways);
        }
    }
}

TEMPLATE_TEST_CASE("The parts of a motion are those of the axis", "", float, double) {
    using T = TestType;
    support::Random random(64);
    for (int i = 0; i < 1000; ++i) {
        const Case<T> c = impostor_case<T>(random);
        INFO(c);
        const auto view = metric::impostor_view_unchecked(c.box, c.image.viewpoint, c.viewer);
        const RealVector motion = RealVector(c.viewer) - RealVector(c.image.viewpoint);
        const Real moved = glm::length(motion);
        const Real both = std::hypot(Real(view.inwards), Real(view.sideways));
        CHECK(std::abs(both - moved) <= 16 * kRoundoff<T> * moved);
        CHECK(view.half_depth < view.distance);
    }
}

TEMPLATE_TEST_CASE("One motion alone gives the estimate of the corners", "", float, double) {
    using T = TestType;
    support::Random random(65);
    for (int i = 0; i < 1000; ++i) {
        const T distance = random.uniform(T(2), T(50));
        const Vector<T> half = random.vector(T(0.1), T(1));
        const Vector<T> middle(T(0), T(0), -distance);
        const Box3<T> box{middle - half, middle + half};
        const Vector<T> origin(T(0));
        const ImagePlane<T> image = metric::impostor_plane(box, origin);
        // Across the axis, which is -z exactly: nothing else is left of the motion.
        const Vector<T> aside(random.uniform(T(-1), T(1)), random.uniform(T(-1), T(1)), T(0));
        CHECK(
            metric::alpha_trans_corners_unchecked(box, origin, aside) ==
            Approx(metric::corner_discrepancy_unchecked(image, box, aside))
                .epsilon(64 * static_cast<double>(kRoundoff<T>))
        );
        const Vector<T> along(T(0), T(0), random.uniform(T(-1), T(0.5)));
        CHECK(
            metric::alpha_size_corners_unchecked(box, origin, along) ==
            Approx(metric::corner_discrepancy_unchecked(image, box, along))
                .epsilon(64 * static_cast<double>(kRoundoff<T>))
        );
    }
}

TEST_CASE("Both estimates together miss most of a diagonal motion") {
    // Why the bound exists: found by search, a viewer who comes nearer and goes aside at once.
    support::Random random(66);
    double least = 1;
    for (int i = 0; i < 5000; ++i) {
        const Case<double> c = impostor_case<double>(random);
        const glm::dvec3& viewpoint = c.image.viewpoint;
        const auto view = metric::impostor_view_unchecked(c.box, viewpoint, c.viewer);
        const double estimate =
            std::max(metric::alpha_trans_unchecked(view), metric::alpha_size_unchecked(view));
        const double corners = metric::corner_discrepancy_unchecked(c.image, c.box, c.viewer);
        const double bound = metric::angular_discrepancy_bound_unchecked(c.image, c.box, c.viewer);
        CHECK(bound >= corners);
        least = std::min(least, estimate / corners);
    }
    CHECK(least < 0.6);
}

TEMPLATE_TEST_CASE("Texels are never seen under more than alpha_tex", "", float, double) {
    using T = TestType;
    support::Random random(67);
    Real most = 0;
    for (int i = 0; i < 20000; ++i) {
        const T distance = random.uniform(T(0.1), T(10));
        const T texel = distance * std::pow(T(10), random.uniform(T(-4), T(0.5)));
        const Real bound = metric::alpha_tex_unchecked(texel, distance);
        // A texel on a plane at least so far away, seen from the origin; half of them right ahead.
        const Real depth = Real(distance) * random.uniform(Real(1), Real(1.2));
        const Real turn = random.uniform(Real(0), 2 * std::numbers::pi_v<Real>);
        const RealVector way =
            RealVector(std::cos(turn), std::sin(turn), Real(0)) * (Real(texel) / 2);
        const Real off = random.below(2) == 0 ? Real(0) : Real(distance);
        const RealVector middle(off * random.uniform(Real(-1), Real(1)), off, depth);
        const RealVector a = middle - way;
        const RealVector b = middle + way;
        const Real seen = std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
        // The bound is rounded to nearest: three roundings.
        CHECK(seen <= bound * (1 + 8 * kRoundoff<T>));
        most = std::max(most, seen / bound);
    }
    CHECK(most > 0.999L);
    CHECK(metric::alpha_tex(T(0), T(2)) == Measured<T>{T(0), MetricOutcome::ok});
    CHECK(metric::alpha_tex(T(1), T(0)).value == std::numbers::pi_v<T>);
    CHECK(metric::alpha_tex(T(-1), T(1)).outcome == MetricOutcome::err_distance);
    CHECK(metric::alpha_tex(T(1), T(-1)).outcome == MetricOutcome::err_distance);
    CHECK(
        metric::alpha_tex(std::numeric_limits<T>::infinity(), T(1)).outcome ==
        MetricOutcome::err_nonfinite
    );
    T before = std::numbers::pi_v<T>;
    for (int step = -20; step <= 20; ++step) {
        const T angle = metric::alpha_tex_unchecked(T(1), std::ldexp(T(1), step));
        CHECK(angle < before);
        before = angle;
    }
}
