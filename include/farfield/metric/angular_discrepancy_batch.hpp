#pragma once

#include <farfield/metric/image_plane.hpp>
#include <farfield/metric/instruction_set.hpp>

#include <glm/vec3.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace farfield {

/// Points by coordinate: three columns of equal length, of any alignment.
template <typename T>
struct PointColumns {
    std::span<const T> x;
    std::span<const T> y;
    std::span<const T> z;
};

/// Boxes by coordinate.
template <typename T>
struct BoxColumns {
    PointColumns<T> lo;
    PointColumns<T> hi; ///< as long as `lo`

    [[nodiscard]] std::size_t size() const noexcept { return lo.x.size(); }
};

/// Image planes by coordinate: the fields of `ImagePlane`.
template <typename T>
struct ImageColumns {
    PointColumns<T> viewpoint;
    PointColumns<T> point;  ///< as long as `viewpoint`
    PointColumns<T> normal; ///< as long as `viewpoint`

    [[nodiscard]] std::size_t size() const noexcept { return viewpoint.x.size(); }
};

/// The angular discrepancies of many boxes for one viewer, with the vector instructions of the
/// machine. Element `i` of a result is to the last digit what the function for one box returns, for
/// every instruction set, every length and every place in the columns: both are made from one text,
/// and there is no other rounding than that of IEEE 754.
///
/// `images` is one `ImagePlane` for all boxes, or `ImageColumns` with one for each; the first saves
/// a quarter to a half of the time of the cheap bound. Columns may begin anywhere, but 64-byte
/// instructions are up to twice as fast where columns begin at multiples of 64 bytes. What each
/// costs is in docs/numerics.md.
namespace metric {

/// One image for all boxes, or one for each.
template <typename Images, typename T>
concept ImagesOf = std::same_as<Images, ImagePlane<T>> || std::same_as<Images, ImageColumns<T>>;

/// `corner_discrepancy_unchecked` of each box: an estimate, **not a bound**.
/// @param images one, or as many as boxes
/// @param angles [rad] results, as many as boxes
/// @param set one that `is_supported`
/// @pre check(image, box) == MetricOutcome::ok for each box and its image; the viewer is finite
template <typename T, typename Images>
requires ImagesOf<Images, T>
void corner_discrepancies_unchecked(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::span<std::type_identity_t<T>> angles,
    InstructionSet set = widest_instruction_set()
) noexcept;

/// `bound_t1_unchecked` of each box: a bound from distances alone.
/// @param images, angles, set as for `corner_discrepancies_unchecked`
/// @pre as for `corner_discrepancies_unchecked`
template <typename T, typename Images>
requires ImagesOf<Images, T>
void bounds_t1_unchecked(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::span<std::type_identity_t<T>> angles,
    InstructionSet set = widest_instruction_set()
) noexcept;

/// `angular_discrepancy_bound_unchecked` of each box: the smaller of both bounds.
/// @param images, angles, set as for `corner_discrepancies_unchecked`
/// @pre as for `corner_discrepancies_unchecked`
template <typename T, typename Images>
requires ImagesOf<Images, T>
void angular_discrepancy_bounds_unchecked(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::span<std::type_identity_t<T>> angles,
    InstructionSet set = widest_instruction_set()
) noexcept;

/// `is_within_unchecked` of each box: what a frame asks. The costly bound is evaluated only where
/// the cheap one leaves a box of a pack undecided, so neighbours in the columns should be
/// neighbours in space.
/// @param threshold [rad] >= 0, see `pixel_angle`
/// @param within results, as many as boxes: 1 where the bound is at most the threshold, else 0
/// @param images, set as for `corner_discrepancies_unchecked`
/// @pre as for `corner_discrepancies_unchecked`
template <typename T, typename Images>
requires ImagesOf<Images, T>
void are_within_unchecked(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::type_identity_t<T> threshold,
    std::span<std::uint8_t> within,
    InstructionSet set = widest_instruction_set()
) noexcept;

} // namespace metric

} // namespace farfield
