#pragma once

#include <farfield/core/assert.hpp>
#include <farfield/metric/outcome.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace farfield {

/// What counts how much when images are placed. All >= 0; with cost + benefit = 1 and size + depth
/// = 1 the sum is in [0, 1].
template <typename T>
struct PlacementWeights {
    T cost = T(0.4);    ///< of the primitives that are saved
    T benefit = T(0.6); ///< of the image
    T size = T(0.1);    ///< within the benefit: of an image that is small on the screen
    T depth = T(0.9);   ///< within the benefit: of an image that is far away

    friend bool operator==(const PlacementWeights&, const PlacementWeights&) = default;
};

/// A candidate for an image.
template <typename T>
struct Placement {
    std::uint64_t drawn = 0; ///< primitives that are still drawn with the image, <= total
    std::uint64_t total = 0; ///< primitives of the model
    T image_width = 0;       ///< [px] >= 0
    T image_height = 0;      ///< [px] >= 0
    T screen_width = 0;      ///< [px] > 0
    T screen_height = 0;     ///< [px] > 0
    T depth = 0;             ///< [length] of the image from the eye, >= 0
    T model_extent = 0;      ///< [length] of the model along one axis, > 0
};

/// Cost and benefit of a candidate, each in [0, 1], and their weighted sum.
template <typename T>
struct PlacementBenefit {
    T cost = 0;    ///< part of the primitives that is still drawn
    T benefit = 0; ///< weighted sum of smallness and depth
    T total = 0;   ///< the larger, the better
    MetricOutcome outcome = MetricOutcome::ok;
};

namespace policy {

/// How much a candidate is worth: few primitives left, a small image, far away.
///
///     cost    = g / G                                                          0 for G = 0
///     benefit = size (1 - max(Iw, Ih) / max(Sw, Sh)) + depth d / A             ratios at most 1
///     total   = cost weight (1 - cost) + benefit weight benefit
///
/// Both ratios are limited to 1: an image may be wider than the screen and, as A is one axis of the
/// model and not its diagonal, deeper than A. The paper leaves that open and the sum then leaves
/// [0, 1].
/// @pre drawn <= total, screen and model_extent > 0, the others >= 0
/// @par Source Aliaga and Lastra 1999, section 3.3.2
template <typename T>
[[nodiscard]] PlacementBenefit<T> placement_benefit_unchecked(
    const Placement<T>& placement, const PlacementWeights<T>& weights = {}
) noexcept {
    FARFIELD_ASSERT(placement.drawn <= placement.total && placement.model_extent > T(0));
    PlacementBenefit<T> result;
    // In double, where counts of primitives are exact.
    const double part = placement.total == 0 ? 0.0
                                             : static_cast<double>(placement.drawn) /
                                                   static_cast<double>(placement.total);
    result.cost = static_cast<T>(part);
    const T image = std::max(placement.image_width, placement.image_height);
    const T screen = std::max(placement.screen_width, placement.screen_height);
    const T smallness = std::max(1 - image / screen, T(0));
    const T depth = std::min(placement.depth / placement.model_extent, T(1));
    result.benefit = weights.size * smallness + weights.depth * depth;
    result.total = weights.cost * static_cast<T>(1.0 - part) + weights.benefit * result.benefit;
    return result;
}

/// The same with all input judged.
/// @return the benefit with ok, or NaN with err_nonfinite or err_range
template <typename T>
[[nodiscard]] PlacementBenefit<T>
placement_benefit(const Placement<T>& placement, const PlacementWeights<T>& weights = {}) noexcept {
    constexpr T kNone = std::numeric_limits<T>::quiet_NaN();
    const T not_negative[] = {
        placement.image_width,
        placement.image_height,
        placement.depth,
        weights.cost,
        weights.benefit,
        weights.size,
        weights.depth};
    const T positive[] = {placement.screen_width, placement.screen_height, placement.model_extent};
    const auto is_finite = [](T x) { return std::isfinite(x); };
    if (!std::all_of(std::begin(not_negative), std::end(not_negative), is_finite) ||
        !std::all_of(std::begin(positive), std::end(positive), is_finite)) {
        return {kNone, kNone, kNone, MetricOutcome::err_nonfinite};
    }
    const auto is_negative = [](T x) { return x < T(0); };
    const auto is_not_positive = [](T x) { return x <= T(0); };
    if (placement.drawn > placement.total ||
        std::any_of(std::begin(not_negative), std::end(not_negative), is_negative) ||
        std::any_of(std::begin(positive), std::end(positive), is_not_positive)) {
        return {kNone, kNone, kNone, MetricOutcome::err_range};
    }
    return placement_benefit_unchecked(placement, weights);
}

} // namespace policy

} // namespace farfield
