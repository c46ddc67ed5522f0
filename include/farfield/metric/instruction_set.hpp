#pragma once

#include <cstdint>

namespace farfield::metric {

/// With what a batch of boxes is computed. The results are the same to the last digit.
enum class InstructionSet : std::uint8_t {
    scalar,   ///< one box at a time: the code of the functions for one box
    baseline, ///< 16 bytes at a time, with what every machine of the architecture has (SSE2, NEON)
    avx2,     ///< 32 bytes at a time, x86 only
    avx512,   ///< 64 bytes at a time, x86 only
};

/// True where the compiler knew the set when the library was built, and this machine has it.
[[nodiscard]] bool is_supported(InstructionSet set) noexcept;

/// The widest set that is supported. Found once.
[[nodiscard]] InstructionSet widest_instruction_set() noexcept;

/// "scalar", "baseline", "avx2" or "avx512".
[[nodiscard]] const char* name(InstructionSet set) noexcept;

} // namespace farfield::metric
