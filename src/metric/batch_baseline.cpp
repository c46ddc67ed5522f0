// src/CMakeLists.txt gives this unit the compiler options of its instruction set.
#include "metric/batch_kernels.hpp"
#include "metric/batch_loops.hpp"

namespace farfield::metric::detail {

#if defined(FARFIELD_HAS_PACKS)

const BatchKernels<float>* baseline_kernels(float /*type*/) noexcept {
    return &kBatchKernels<float, 16>;
}

const BatchKernels<double>* baseline_kernels(double /*type*/) noexcept {
    return &kBatchKernels<double, 16>;
}

#else

const BatchKernels<float>* baseline_kernels(float /*type*/) noexcept {
    return nullptr;
}

const BatchKernels<double>* baseline_kernels(double /*type*/) noexcept {
    return nullptr;
}

#endif

} // namespace farfield::metric::detail
