#pragma once

#include <cstdint>

namespace farfield::support {

/// Calls of operator new since the program began, from all threads. Programs that link
/// allocation_counter.cpp replace the global operators by counting ones.
[[nodiscard]] std::uint64_t allocation_count() noexcept;

} // namespace farfield::support
