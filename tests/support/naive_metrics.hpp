#pragma once

#include <farfield/metric/image_plane.hpp>

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

/// The metrics as papers and first thoughts write them: right, but not in floating point. They
/// stand beside the stable forms in benchmarks and in the table of golden_check.
namespace farfield::naive {

template <typename T>
[[nodiscard]] T angle_between(const glm::vec<3, T>& a, const glm::vec<3, T>& b) noexcept {
    return std::acos(glm::dot(a, b) / (glm::length(a) * glm::length(b)));
}

/// Forms the image of the point, then takes the arc cosine of a dot product.
template <typename T>
[[nodiscard]] T angular_discrepancy(
    const ImagePlane<T>& image, const glm::vec<3, T>& viewer, const glm::vec<3, T>& point
) noexcept {
    const glm::vec<3, T> ray = point - image.viewpoint;
    const T ratio =
        glm::dot(image.normal, image.point - image.viewpoint) / glm::dot(image.normal, ray);
    return angle_between<T>(point - viewer, image.viewpoint + ray * ratio - viewer);
}

/// Equation 4 as it is found: the difference of nearly equal numbers for small angles.
template <typename T>
[[nodiscard]] T safety_distance(T to_point, T to_image, T epsilon) noexcept {
    const T r = std::abs(to_point - to_image) / (2 * std::sin(epsilon));
    return std::sqrt(to_point * to_image + r * r) - r;
}

/// A difference of arc tangents.
template <typename T>
[[nodiscard]] T angle_of_pixels(T focal_px, T corner_tangent, T pixels) noexcept {
    return std::atan(corner_tangent + pixels / focal_px) - std::atan(corner_tangent);
}

/// A difference of tangents.
template <typename T>
[[nodiscard]] T pixels_of_angle(T focal_px, T corner_tangent, T angle) noexcept {
    return focal_px * (std::tan(std::atan(corner_tangent) + angle) - corner_tangent);
}

/// A difference of arc tangents, of the point and of its image on the axis.
template <typename T>
[[nodiscard]] T alpha_trans(T distance, T half_depth, T sideways) noexcept {
    return std::atan(sideways / (distance - half_depth)) - std::atan(sideways / distance);
}

/// The law of cosines, equation 1 of the LOD-sprite technique.
template <typename T>
[[nodiscard]] T sprite_angle(
    const glm::vec<3, T>& drawn_from,
    const glm::vec<3, T>& seen_from,
    const glm::vec<3, T>& point,
    T offset
) noexcept {
    const glm::vec<3, T> ray = point - drawn_from;
    const glm::vec<3, T> sight = point - seen_from;
    const T a = glm::length(sight);
    // The angle at the point between the ways to the viewer and to the image.
    const T cosine =
        -glm::dot(sight, ray) / (a * glm::length(ray)) * (offset < T(0) ? T(-1) : T(1));
    const T b = std::abs(offset);
    const T c = std::sqrt(a * a + b * b - 2 * a * b * cosine);
    return std::acos((a - b * cosine) / c);
}

/// The root of a quadratic equation as school has it: first passage of a face `gap` away.
template <typename T>
[[nodiscard]] T first_passage(T gap, T speed, T acceleration) noexcept {
    return (-speed + std::sqrt(speed * speed + 2 * acceleration * gap)) / acceleration;
}

/// Largest distance of two of the eight corners, each projected from the world.
template <typename T>
[[nodiscard]] T cube_diameter_px(
    const glm::vec<3, T>& center,
    T edge,
    const glm::vec<3, T>& eye,
    const glm::vec<3, T>& right,
    const glm::vec<3, T>& up,
    const glm::vec<3, T>& forward,
    T focal_px
) noexcept {
    T x[8];
    T y[8];
    for (unsigned i = 0; i < 8; ++i) {
        const glm::vec<3, T> sign(
            (i & 1U) != 0U ? T(1) : T(-1),
            (i & 2U) != 0U ? T(1) : T(-1),
            (i & 4U) != 0U ? T(1) : T(-1)
        );
        const glm::vec<3, T> offset = center + sign * (edge / 2) - eye;
        x[i] = focal_px * glm::dot(offset, right) / glm::dot(offset, forward);
        y[i] = focal_px * glm::dot(offset, up) / glm::dot(offset, forward);
    }
    T diameter = 0;
    for (unsigned i = 0; i < 8; ++i) {
        for (unsigned j = 0; j < i; ++j) {
            diameter = std::max(diameter, std::hypot(x[i] - x[j], y[i] - y[j]));
        }
    }
    return diameter;
}

} // namespace farfield::naive
