#pragma once

#include <farfield/math/box3.hpp>
#include <farfield/metric/detail/box_terms.hpp>
#include <farfield/metric/image_plane.hpp>
#include <farfield/metric/outcome.hpp>

#include <glm/vec3.hpp>

/// Upper bounds of the angular discrepancy over a whole box. Never too small, rounding included;
/// without the allowance for rounding 0.8 % of random boxes would be under-estimated in float.
namespace farfield::metric {

/// Bound from distances alone, about 60 operations.
///
///     theta <= asin(E |m| / (D rho)) where E |m| < D rho, else pi
///
/// with E the largest |e| in the box and rho the distance of the viewer from it (e, m and D as in
/// `angular_discrepancy`). About 1.3 times the truth in the median, 5 to 10 times at worst, and the
/// only bound that still holds something closer than half a diagonal.
/// @return [rad] in [0, pi], never too small; pi where the viewer is in the box or does not see the
/// image's front; 0 where the whole box is in the image plane
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] T bound_t1_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    const auto terms = detail::image_terms(image, box, viewer);
    return detail::bound_t1(terms, detail::box_terms(terms, box));
}

/// Tight bound, about 950 operations.
///
/// Both arguments of the arc tangent are quadratics over the box, so each lies between its
/// Bernstein coefficients, 26 of which can matter; the bound is the arc tangent of the largest
/// quotient of coefficients, pi where a denominator is not positive. It *is* the truth where the
/// largest quotient is at a corner, which beyond two diagonals it nearly always is: at most 1.03
/// times the truth in 99 of 100 cases there, 1.6 times at one diagonal.
/// @return as `bound_t1_unchecked`
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] T bound_t2_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    const auto terms = detail::image_terms(image, box, viewer);
    return detail::bound_t2(terms, detail::box_terms(terms, box));
}

/// The smaller of both bounds: what to compare with a threshold.
/// @return as `bound_t1_unchecked`
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] T angular_discrepancy_bound_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    const auto image_terms = detail::image_terms(image, box, viewer);
    const auto box_terms = detail::box_terms(image_terms, box);
    return detail::least(
        detail::bound_t1(image_terms, box_terms), detail::bound_t2(image_terms, box_terms)
    );
}

/// Whether an image may stand for a box seen by `viewer`: exactly
/// `angular_discrepancy_bound_unchecked(image, box, viewer) <= threshold`, but the costly bound is
/// evaluated only where the cheap one is above the threshold.
/// @param threshold [rad] >= 0, see `pixel_angle`
/// @pre check(image, box) == MetricOutcome::ok and the viewer is finite
template <typename T>
[[nodiscard]] bool is_within_unchecked(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer, T threshold
) noexcept {
    const auto image_terms = detail::image_terms(image, box, viewer);
    const auto box_terms = detail::box_terms(image_terms, box);
    return detail::bound_t1(image_terms, box_terms) <= threshold ||
           detail::bound_t2(image_terms, box_terms) <= threshold;
}

/// `bound_t1_unchecked` with all input judged.
/// @return [rad] the bound with ok, pi_inside or pi_backface, or the error of `check`
template <typename T>
[[nodiscard]] Measured<T>
bound_t1(const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer) noexcept {
    return detail::judged<T>(check(image, box, viewer), [&] {
        return bound_t1_unchecked(image, box, viewer);
    });
}

/// `bound_t2_unchecked` with all input judged.
/// @return as `bound_t1`
template <typename T>
[[nodiscard]] Measured<T>
bound_t2(const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer) noexcept {
    return detail::judged<T>(check(image, box, viewer), [&] {
        return bound_t2_unchecked(image, box, viewer);
    });
}

/// `angular_discrepancy_bound_unchecked` with all input judged.
/// @return as `bound_t1`
template <typename T>
[[nodiscard]] Measured<T> angular_discrepancy_bound(
    const ImagePlane<T>& image, const Box3<T>& box, const glm::vec<3, T>& viewer
) noexcept {
    return detail::judged<T>(check(image, box, viewer), [&] {
        return angular_discrepancy_bound_unchecked(image, box, viewer);
    });
}

} // namespace farfield::metric
