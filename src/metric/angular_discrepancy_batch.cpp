#include "metric/batch_kernels.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/metric/angular_discrepancy.hpp>
#include <farfield/metric/angular_discrepancy_batch.hpp>
#include <farfield/metric/angular_discrepancy_bound.hpp>

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace farfield::metric {

namespace {

template <typename T>
[[nodiscard]] glm::vec<3, T> row(const PointColumns<T>& columns, std::size_t index) noexcept {
    return {columns.x[index], columns.y[index], columns.z[index]};
}

template <typename T>
[[nodiscard]] Box3<T> row(const BoxColumns<T>& boxes, std::size_t index) noexcept {
    return {row(boxes.lo, index), row(boxes.hi, index)};
}

template <typename T>
[[nodiscard]] ImagePlane<T> row(const ImageColumns<T>& images, std::size_t index) noexcept {
    return {row(images.viewpoint, index), row(images.point, index), row(images.normal, index)};
}

template <typename T>
[[nodiscard]] const ImagePlane<T>& row(const ImagePlane<T>& image, std::size_t /*index*/) noexcept {
    return image;
}

template <typename T>
[[nodiscard]] bool are_equally_long(const PointColumns<T>& columns, std::size_t size) noexcept {
    return columns.x.size() == size && columns.y.size() == size && columns.z.size() == size;
}

template <typename T>
[[nodiscard]] bool fits(const ImagePlane<T>& /*image*/, std::size_t /*size*/) noexcept {
    return true;
}

template <typename T>
[[nodiscard]] bool fits(const ImageColumns<T>& images, std::size_t size) noexcept {
    return are_equally_long(images.viewpoint, size) && are_equally_long(images.point, size) &&
           are_equally_long(images.normal, size);
}

/// What the functions for one box assert of each box.
template <typename T, typename Images>
[[nodiscard]] bool are_sound(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::size_t results
) noexcept {
    const std::size_t count = boxes.size();
    if (results != count || !are_equally_long(boxes.lo, count) ||
        !are_equally_long(boxes.hi, count) || !fits(images, count)) {
        return false;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const MetricOutcome outcome =
            detail::check_image(row(images, i), row(boxes, i), detail::is_measurable(viewer));
        if (outcome != MetricOutcome::ok) {
            return false;
        }
    }
    return true;
}

template <typename T>
void set_columns(const T** columns, const glm::vec<3, T>& point) noexcept {
    columns[0] = &point.x;
    columns[1] = &point.y;
    columns[2] = &point.z;
}

template <typename T>
void set_columns(const T** columns, const PointColumns<T>& points) noexcept {
    columns[0] = points.x.data();
    columns[1] = points.y.data();
    columns[2] = points.z.data();
}

/// All arguments must outlive the result.
template <typename T, typename Images>
[[nodiscard]] detail::BatchInput<T> batch_input(
    const Images& images, const BoxColumns<T>& boxes, const glm::vec<3, T>& viewer
) noexcept {
    detail::BatchInput<T> input;
    set_columns(input.image, images.viewpoint);
    set_columns(input.image + 3, images.point);
    set_columns(input.image + 6, images.normal);
    set_columns(input.box, boxes.lo);
    set_columns(input.box + 3, boxes.hi);
    set_columns(input.viewer, viewer);
    input.count = boxes.size();
    input.one_image = std::is_same_v<Images, ImagePlane<T>>;
    return input;
}

/// Null for scalar.
template <typename T>
[[nodiscard]] const detail::BatchKernels<T>* kernels_of(InstructionSet set) noexcept {
    switch (set) {
    case InstructionSet::baseline:
        return detail::baseline_kernels(T());
    case InstructionSet::avx2:
        return detail::avx2_kernels(T());
    case InstructionSet::avx512:
        return detail::avx512_kernels(T());
    case InstructionSet::scalar:
        break;
    }
    return nullptr;
}

/// @param kernel the field of `BatchKernels` that does it
/// @param one_by_one the function for one box
/// @param before what both take before the results
template <
    typename T,
    typename Images,
    typename Result,
    typename Kernel,
    typename OneByOne,
    typename... Before>
void run(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::span<Result> results,
    InstructionSet set,
    Kernel kernel,
    const OneByOne& one_by_one,
    Before... before
) noexcept {
    FARFIELD_ASSERT(is_supported(set));
    FARFIELD_ASSERT(are_sound(images, boxes, viewer, results.size()));
    if (const auto* const kernels = kernels_of<T>(set)) {
        (kernels->*kernel)(batch_input(images, boxes, viewer), before..., results.data());
        return;
    }
    for (std::size_t i = 0; i < results.size(); ++i) {
        const auto result = one_by_one(row(images, i), row(boxes, i), viewer, before...);
        results[i] = static_cast<Result>(result);
    }
}

} // namespace

template <typename T, typename Images>
requires ImagesOf<Images, T>
void corner_discrepancies_unchecked(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::span<std::type_identity_t<T>> angles,
    InstructionSet set
) noexcept {
    run(images,
        boxes,
        viewer,
        angles,
        set,
        &detail::BatchKernels<T>::corners,
        corner_discrepancy_unchecked<T>);
}

template <typename T, typename Images>
requires ImagesOf<Images, T>
void bounds_t1_unchecked(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::span<std::type_identity_t<T>> angles,
    InstructionSet set
) noexcept {
    run(images,
        boxes,
        viewer,
        angles,
        set,
        &detail::BatchKernels<T>::bound_t1,
        bound_t1_unchecked<T>);
}

template <typename T, typename Images>
requires ImagesOf<Images, T>
void angular_discrepancy_bounds_unchecked(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::span<std::type_identity_t<T>> angles,
    InstructionSet set
) noexcept {
    run(images,
        boxes,
        viewer,
        angles,
        set,
        &detail::BatchKernels<T>::bound,
        angular_discrepancy_bound_unchecked<T>);
}

template <typename T, typename Images>
requires ImagesOf<Images, T>
void are_within_unchecked(
    const Images& images,
    const BoxColumns<T>& boxes,
    const glm::vec<3, T>& viewer,
    std::type_identity_t<T> threshold,
    std::span<std::uint8_t> within,
    InstructionSet set
) noexcept {
    run(images,
        boxes,
        viewer,
        within,
        set,
        &detail::BatchKernels<T>::within,
        is_within_unchecked<T>,
        threshold);
}

template void corner_discrepancies_unchecked(
    const ImagePlane<float>&,
    const BoxColumns<float>&,
    const glm::vec3&,
    std::span<float>,
    InstructionSet
) noexcept;
template void corner_discrepancies_unchecked(
    const ImageColumns<float>&,
    const BoxColumns<float>&,
    const glm::vec3&,
    std::span<float>,
    InstructionSet
) noexcept;
template void corner_discrepancies_unchecked(
    const ImagePlane<double>&,
    const BoxColumns<double>&,
    const glm::dvec3&,
    std::span<double>,
    InstructionSet
) noexcept;
template void corner_discrepancies_unchecked(
    const ImageColumns<double>&,
    const BoxColumns<double>&,
    const glm::dvec3&,
    std::span<double>,
    InstructionSet
) noexcept;
template void bounds_t1_unchecked(
    const ImagePlane<float>&,
    const BoxColumns<float>&,
    const glm::vec3&,
    std::span<float>,
    InstructionSet
) noexcept;
template void bounds_t1_unchecked(
    const ImageColumns<float>&,
    const BoxColumns<float>&,
    const glm::vec3&,
    std::span<float>,
    InstructionSet
) noexcept;
template void bounds_t1_unchecked(
    const ImagePlane<double>&,
    const BoxColumns<double>&,
    const glm::dvec3&,
    std::span<double>,
    InstructionSet
) noexcept;
template void bounds_t1_unchecked(
    const ImageColumns<double>&,
    const BoxColumns<double>&,
    const glm::dvec3&,
    std::span<double>,
    InstructionSet
) noexcept;
template void angular_discrepancy_bounds_unchecked(
    const ImagePlane<float>&,
    const BoxColumns<float>&,
    const glm::vec3&,
    std::span<float>,
    InstructionSet
) noexcept;
template void angular_discrepancy_bounds_unchecked(
    const ImageColumns<float>&,
    const BoxColumns<float>&,
    const glm::vec3&,
    std::span<float>,
    InstructionSet
) noexcept;
template void angular_discrepancy_bounds_unchecked(
    const ImagePlane<double>&,
    const BoxColumns<double>&,
    const glm::dvec3&,
    std::span<double>,
    InstructionSet
) noexcept;
template void angular_discrepancy_bounds_unchecked(
    const ImageColumns<double>&,
    const BoxColumns<double>&,
    const glm::dvec3&,
    std::span<double>,
    InstructionSet
) noexcept;
template void are_within_unchecked(
    const ImagePlane<float>&,
    const BoxColumns<float>&,
    const glm::vec3&,
    float,
    std::span<std::uint8_t>,
    InstructionSet
) noexcept;
template void are_within_unchecked(
    const ImageColumns<float>&,
    const BoxColumns<float>&,
    const glm::vec3&,
    float,
    std::span<std::uint8_t>,
    InstructionSet
) noexcept;
template void are_within_unchecked(
    const ImagePlane<double>&,
    const BoxColumns<double>&,
    const glm::dvec3&,
    double,
    std::span<std::uint8_t>,
    InstructionSet
) noexcept;
template void are_within_unchecked(
    const ImageColumns<double>&,
    const BoxColumns<double>&,
    const glm::dvec3&,
    double,
    std::span<std::uint8_t>,
    InstructionSet
) noexcept;

} // namespace farfield::metric
