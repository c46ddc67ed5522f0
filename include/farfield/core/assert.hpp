#pragma once

/// `FARFIELD_ASSERT(condition)` states what only a programmer's error can break. It is on where
/// `FARFIELD_ASSERTIONS` is 1: in Debug builds and in the `checked` preset. Bad data is never
/// asserted, it is returned as an `Error`.
#if defined(FARFIELD_ASSERTIONS) && FARFIELD_ASSERTIONS

namespace farfield::detail {
/// Prints the broken condition and aborts.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line) noexcept;
} // namespace farfield::detail

#define FARFIELD_ASSERT(condition)                                                                 \
    (static_cast<bool>(condition)                                                                  \
         ? static_cast<void>(0)                                                                    \
         : ::farfield::detail::assertion_failed(#condition, __FILE__, __LINE__))
#else
#define FARFIELD_ASSERT(condition) static_cast<void>(0)
#endif
