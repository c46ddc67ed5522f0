#pragma once

#include <farfield/core/result.hpp>

#include <cstdint>
#include <memory>

namespace farfield::opengl {

/// Where a context without a window is made, of what EGL offers.
enum class HeadlessPlatform : std::uint8_t {
    any,         ///< `surfaceless` first, then `device`
    surfaceless, ///< Mesa's surfaceless platform: the driver chooses the device
    device,      ///< devices by themselves, in the driver's order: the first one that will do
};

/// An OpenGL 4.5 core context without a window, through EGL. It is current on the thread that made
/// it until it is destroyed; one at a time per thread.
///
/// Mesa offers both platforms; where a driver offers devices alone, as older ones of NVIDIA do,
/// `any` takes those. Where Mesa stands beside another driver its surfaceless platform may be a
/// software one: `device`, or glvnd's choice of vendors, reaches the card.
class HeadlessContext {
  public:
    /// Makes a context and makes it current.
    /// @return `device` with all that was tried and which step of it failed, `unsupported` where
    /// EGL offers no such platform
    [[nodiscard]] static Result<HeadlessContext>
    create(HeadlessPlatform platform = HeadlessPlatform::any);

    HeadlessContext(HeadlessContext&& other) noexcept;
    HeadlessContext& operator=(HeadlessContext&& other) noexcept;
    HeadlessContext(const HeadlessContext&) = delete;
    HeadlessContext& operator=(const HeadlessContext&) = delete;
    ~HeadlessContext();

  private:
    struct Impl;
    explicit HeadlessContext(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::opengl
