#include "metric/batch_kernels.hpp"
#include <farfield/metric/instruction_set.hpp>

namespace farfield::metric {

namespace {

bool machine_has_avx2() noexcept {
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__i386__))
    return __builtin_cpu_supports("avx2") != 0;
#else
    return false;
#endif
}

bool machine_has_avx512() noexcept {
#if defined(__GNUC__) && (defined(__x86_64__) || defined(__i386__))
    return __builtin_cpu_supports("avx512f") != 0;
#else
    return false;
#endif
}

} // namespace

bool is_supported(InstructionSet set) noexcept {
    switch (set) {
    case InstructionSet::scalar:
        return true;
    case InstructionSet::baseline:
        return detail::baseline_kernels(0.0F) != nullptr;
    case InstructionSet::avx2:
        return detail::avx2_kernels(0.0F) != nullptr && machine_has_avx2();
    case InstructionSet::avx512:
        return detail::avx512_kernels(0.0F) != nullptr && machine_has_avx512();
    }
    return false;
}

InstructionSet widest_instruction_set() noexcept {
    static const InstructionSet kWidest =
        is_supported(InstructionSet::avx512)     ? InstructionSet::avx512
        : is_supported(InstructionSet::avx2)     ? InstructionSet::avx2
        : is_supported(InstructionSet::baseline) ? InstructionSet::baseline
                                                 : InstructionSet::scalar;
    return kWidest;
}

const char* name(InstructionSet set) noexcept {
    switch (set) {
    case InstructionSet::scalar:
        return "scalar";
    case InstructionSet::baseline:
        return "baseline";
    case InstructionSet::avx2:
        return "avx2";
    case InstructionSet::avx512:
        return "avx512";
    }
    return "unknown";
}

} // namespace farfield::metric
