#pragma once

#include <farfield/core/result.hpp>

#include <memory>

namespace farfield::opengl {

/// An OpenGL 4.5 core context without a window, through EGL's surfaceless platform. It is current
/// on the thread that made it until it is destroyed; one at a time per thread.
class HeadlessContext {
  public:
    /// Makes a context and makes it current.
    /// @return an error that says which step failed where no such context can be had
    [[nodiscard]] static Result<HeadlessContext> create();

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
