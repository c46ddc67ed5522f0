#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <type_traits>

namespace farfield::embree {

struct MemoryRelease {
    void operator()(void* memory) const noexcept { std::free(memory); }
};

/// An array of plain values, all zero at first, that may not be there. What is never touched costs
/// next to nothing.
template <typename T>
using Memory = std::unique_ptr<T[], MemoryRelease>;

/// @return null where there is no memory
template <typename T>
[[nodiscard]] Memory<T> allocate(std::size_t count) noexcept {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);
    return Memory<T>(static_cast<T*>(std::calloc(count, sizeof(T))));
}

} // namespace farfield::embree
