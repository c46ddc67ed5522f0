// src/CMakeLists.txt gives this unit the compiler options of its instruction set.
#include "metric/batch_kernels.hpp"
#include "metric/batch_loops.hpp"

namespace farfield::metric::detail {

#if defined(FARFIELD_HAS_PACKS) && defined(__AVX2__)

const BatchKernels<float>* avx2_kernels(float /*type*/) noexcept {
    return &kBatchKernels<float, 32>;
}

const BatchKernels<double>* avx2_kernels(double /*type*/) noexcept {
    return &kBatchKernels<double, 32>;
}

#else

const BatchKernels<float>* avx2_kernels(float /*type*/) noexcept {
    return nullptr;
}

const BatchKernels<double>* avx2_kernels(double /*type*/) noexcept {
    return nullptr;
}

#endif

} // namespace farfield::metric::detail
