#include "support/random.hpp"
#include <farfield/policy/placement_benefit.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <limits>

namespace {

using namespace farfield;

template <typename T>
Placement<T> ordinary() {
    Placement<T> placement;
    placement.drawn = 250;
    placement.total = 1000;
    placement.image_width = T(64);
    placement.image_height = T(160);
    placement.screen_width = T(640);
    placement.screen_height = T(480);
    placement.depth = T(50);
    placement.model_extent = T(100);
    return placement;
}

} // namespace

TEMPLATE_TEST_CASE("The worth of an image by hand", "", float, double) {
    using T = TestType;
    const auto worth = policy::placement_benefit(ordinary<T>());
    CHECK(worth.outcome == MetricOutcome::ok);
    CHECK(worth.cost == T(0.25));
    // 0.1 (1 - 160 / 640) + 0.9 / 2
    CHECK(worth.benefit == Approx(0.525));
    CHECK(worth.total == Approx(0.4 * 0.75 + 0.6 * 0.525));
}

TEMPLATE_TEST_CASE("Ratios beyond their ranges are limited", "", float, double) {
    using T = TestType;
    Placement<T> placement = ordinary<T>();
    placement.depth = T(170);
    CHECK(policy::placement_benefit(placement).benefit == Approx(0.1 * 0.75 + 0.9));
    placement.image_width = T(900);
    CHECK(policy::placement_benefit(placement).benefit == Approx(0.9));
    placement.depth = T(0);
    CHECK(policy::placement_benefit(placement).benefit == T(0));
    // Nothing in view costs nothing, and all still drawn saves nothing.
    placement.drawn = placement.total = 0;
    CHECK(policy::placement_benefit(placement).cost == T(0));
    placement.drawn = placement.total = 7;
    CHECK(policy::placement_benefit(placement).cost == T(1));
    CHECK(policy::placement_benefit(placement).total == T(0));
}

TEMPLATE_TEST_CASE("What is out of range is named", "", float, double) {
    using T = TestType;
    const auto outcome = [](auto change) {
        Placement<T> placement = ordinary<T>();
        PlacementWeights<T> weights;
        change(placement, weights);
        const auto worth = policy::placement_benefit(placement, weights);
        CHECK(std::isnan(worth.total) == is_error(worth.outcome));
        return worth.outcome;
    };
    using Where = Placement<T>;
    using Weights = PlacementWeights<T>;
    constexpr T kInfinity = std::numeric_limits<T>::infinity();
    CHECK(outcome([](Where&, Weights&) {}) == MetricOutcome::ok);
    CHECK(outcome([](Where& p, Weights&) { p.drawn = 1001; }) == MetricOutcome::err_range);
    CHECK(outcome([](Where& p, Weights&) { p.model_extent = 0; }) == MetricOutcome::err_range);
    CHECK(outcome([](Where& p, Weights&) { p.screen_height = 0; }) == MetricOutcome::err_range);
    CHECK(outcome([](Where& p, Weights&) { p.screen_width = -1; }) == MetricOutcome::err_range);
    CHECK(outcome([](Where& p, Weights&) { p.image_width = -1; }) == MetricOutcome::err_range);
    CHECK(outcome([](Where& p, Weights&) { p.depth = -1; }) == MetricOutcome::err_range);
    CHECK(outcome([](Where&, Weights& w) { w.size = -1; }) == MetricOutcome::err_range);
    CHECK(outcome([](Where& p, Weights&) { p.depth = kInfinity; }) == MetricOutcome::err_nonfinite);
    CHECK(outcome([](Where&, Weights& w) { w.cost = kInfinity; }) == MetricOutcome::err_nonfinite);
}

TEMPLATE_TEST_CASE("The worth is between 0 and 1 and grows where it should", "", float, double) {
    using T = TestType;
    support::Random random(95);
    // Rounding of the sum; 0.4 and 0.6 add up to 1 to within a unit.
    constexpr T kSlack = 4 * std::numeric_limits<T>::epsilon();
    for (int i = 0; i < 5000; ++i) {
        Placement<T> placement = ordinary<T>();
        placement.total = 1 + random.below(1U << 30U);
        placement.drawn = random.below(static_cast<unsigned>(placement.total));
        placement.image_width = random.uniform(T(0), T(1000));
        placement.image_height = random.uniform(T(0), T(1000));
        placement.depth = random.uniform(T(0), T(200));
        const auto worth = policy::placement_benefit_unchecked(placement);
        CHECK(worth.total >= T(0));
        CHECK(worth.total <= 1 + kSlack);

        Placement<T> fewer = placement;
        fewer.drawn /= 2;
        CHECK(policy::placement_benefit_unchecked(fewer).total >= worth.total);
        Placement<T> deeper = placement;
        deeper.depth *= T(1.5);
        CHECK(policy::placement_benefit_unchecked(deeper).total >= worth.total);
        Placement<T> wider = placement;
        wider.image_width *= T(1.5);
        CHECK(policy::placement_benefit_unchecked(wider).total <= worth.total);

        // Neither the unit of length nor that of pixels matters.
        Placement<T> scaled = placement;
        scaled.depth *= T(1024);
        scaled.model_extent *= T(1024);
        scaled.image_width *= T(2);
        scaled.image_height *= T(2);
        scaled.screen_width *= T(2);
        scaled.screen_height *= T(2);
        CHECK(policy::placement_benefit_unchecked(scaled).total == worth.total);
    }
}

TEST_CASE("Counts beyond float are not lost") {
    // One primitive of 2^40 less must not look like all of them in float.
    Placement<float> placement = ordinary<float>();
    placement.total = std::uint64_t(1) << 40U;
    placement.drawn = placement.total - (placement.total >> 20U);
    const auto worth = policy::placement_benefit(placement, {1.0F, 0.0F, 0.0F, 0.0F});
    CHECK(worth.total == Approx(std::ldexp(1.0, -20)));
}
