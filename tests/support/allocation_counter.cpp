#include "support/allocation_counter.hpp"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace farfield::support {

namespace {

std::atomic<std::uint64_t> count{0};

void* allocate(std::size_t size) {
    count.fetch_add(1, std::memory_order_relaxed);
    void* memory = std::malloc(size > 0 ? size : 1);
    if (memory == nullptr) {
        throw std::bad_alloc();
    }
    return memory;
}

void* allocate(std::size_t size, std::align_val_t alignment) {
    count.fetch_add(1, std::memory_order_relaxed);
    const auto bytes = static_cast<std::size_t>(alignment);
    // The size must be a multiple of the alignment.
    void* memory = std::aligned_alloc(bytes, (size / bytes + 1) * bytes);
    if (memory == nullptr) {
        throw std::bad_alloc();
    }
    return memory;
}

} // namespace

std::uint64_t allocation_count() noexcept {
    return count.load(std::memory_order_relaxed);
}

} // namespace farfield::support

// The array forms of the standard library call these; so does its nothrow form, but that of
// AddressSanitizer does not, and Catch2 uses it.
void* operator new(std::size_t size) {
    return farfield::support::allocate(size);
}
void* operator new(std::size_t size, const std::nothrow_t& /*tag*/) noexcept {
    return farfield::support::allocate(size); // ends the program where there is no memory
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    return farfield::support::allocate(size, alignment);
}
void operator delete(void* memory) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::align_val_t /*alignment*/) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
    std::free(memory);
}
