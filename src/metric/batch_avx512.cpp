// src/CMakeLists.txt gives this unit the compiler options of its instruction set.
#include "metric/batch_kernels.hpp"
#include "metric/batch_loops.hpp"

namespace farfield::metric::detail {

#if defined(FARFIELD_HAS_PACKS) && defined(__AVX512F__)

const BatchKernels<float>* avx512_kernels(float /*type*/) noexcept {
    return &kBatchKernels<float, 64>;
}

const BatchKernels<double>* avx512_kernels(double /*type*/) noexcept {
    return &kBatchKernels<double, 64>;
}

#else

const BatchKernels<float>* avx512_kernels(float /*type*/) noexcept {
    return nullptr;
}

const BatchKernels<double>* avx512_kernels(double /*type*/) noexcept {
    return nullptr;
}

#endif

} // namespace farfield::metric::detail
