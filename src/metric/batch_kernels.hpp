#pragma once

#include <cstddef>
#include <cstdint>

/// The loops over boxes, one set of functions for each instruction set. Each set is compiled in a
/// translation unit of its own; only plain data crosses the border.
namespace farfield::metric::detail {

/// Columns as addresses.
template <typename T>
struct BatchInput {
    const T* image[9] = {};  ///< x, y, z of viewpoint, point and normal
    const T* box[6] = {};    ///< x, y, z of lo and hi
    const T* viewer[3] = {}; ///< x, y, z of the one viewer
    std::size_t count = 0;
    bool one_image = false; ///< the image columns have one element
};

template <typename T>
struct BatchKernels {
    using Angles = void (*)(const BatchInput<T>&, T* angles);

    Angles corners = nullptr;
    Angles bound_t1 = nullptr;
    Angles bound = nullptr;
    void (*within)(const BatchInput<T>&, T threshold, std::uint8_t* within) = nullptr;
};

/// Null where the compiler does not know the set, or not for this architecture.
const BatchKernels<float>* baseline_kernels(float type) noexcept;
const BatchKernels<double>* baseline_kernels(double type) noexcept;
const BatchKernels<float>* avx2_kernels(float type) noexcept;
const BatchKernels<double>* avx2_kernels(double type) noexcept;
const BatchKernels<float>* avx512_kernels(float type) noexcept;
const BatchKernels<double>* avx512_kernels(double type) noexcept;

} // namespace farfield::metric::detail
