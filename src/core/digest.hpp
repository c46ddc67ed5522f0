#pragma once

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace farfield {

/// FNV-1a over bytes: quick, the same on every machine, and good enough to tell data apart. Two
/// runs of equal length that differ in one byte never have the same digest: every step is one to
/// one.
class Digest {
  public:
    void add(std::byte byte) noexcept {
        constexpr std::uint64_t kPrime = 1099511628211ULL;
        state_ = (state_ ^ std::to_integer<std::uint64_t>(byte)) * kPrime;
    }
    /// Bytes as they lie in memory.
    void add(std::span<const std::byte> bytes) noexcept {
        for (const std::byte byte : bytes) {
            add(byte);
        }
    }
    void add(std::uint64_t word) noexcept {
        for (unsigned byte = 0; byte < 8; ++byte) {
            add(static_cast<std::byte>((word >> (8U * byte)) & 0xFFU));
        }
    }
    void add(double value) noexcept { add(std::bit_cast<std::uint64_t>(value)); }
    void add(float value) noexcept { add(std::uint64_t{std::bit_cast<std::uint32_t>(value)}); }
    void add(std::int32_t value) noexcept { add(std::uint64_t{static_cast<std::uint32_t>(value)}); }
    void add(std::uint32_t value) noexcept { add(std::uint64_t{value}); }
    void add(bool value) noexcept { add(std::uint64_t{value ? 1U : 0U}); }
    template <typename Id>
    requires std::is_enum_v<Id>
    void add(Id id) noexcept { add(static_cast<std::uint64_t>(id)); }
    void add(const glm::vec3& v) noexcept {
        add(v.x);
        add(v.y);
        add(v.z);
    }
    void add(const glm::dvec3& v) noexcept {
        add(v.x);
        add(v.y);
        add(v.z);
    }
    void add(const glm::u8vec4& color) noexcept {
        add(std::bit_cast<std::uint32_t>(std::array{color.r, color.g, color.b, color.a}));
    }

    [[nodiscard]] std::uint64_t value() const noexcept { return state_; }

  private:
    std::uint64_t state_ = 14695981039346656037ULL;
};

} // namespace farfield
