#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/geometry_source.hpp>

#include <cstdint>
#include <memory>
#include <string>

namespace farfield::opengl {

/// Executes frame plans with OpenGL 4.5 core, in the context that is current on the calling thread:
/// a `HeadlessContext`, or the one of an engine. Every state that `execute` touches is restored to
/// what it was before the call.
///
/// Images are rendered in one scratch page with a 32-bit float reverse-z depth buffer, many in a
/// batch, and copied to their pages. Colours are blended as encoded (`GL_FRAMEBUFFER_SRGB` is off).
class OpenGLBackend final : public Backend {
  public:
    /// @param source draws the items; must outlive the backend and use the same context
    /// @return an error when the current context is older than 4.5 or there is none
    [[nodiscard]] static Result<std::unique_ptr<OpenGLBackend>> create(GeometrySource& source);

    ~OpenGLBackend() override;

    [[nodiscard]] Result<void>
    execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept override;
    void finish() noexcept override;
    [[nodiscard]] Result<TargetId>
    create_target(std::int32_t width, std::int32_t height, std::int32_t samples) noexcept override;
    void destroy_target(TargetId target) noexcept override;
    [[nodiscard]] Result<Picture> read_target(TargetId target) override;
    [[nodiscard]] Limits limits() const noexcept override;
    [[nodiscard]] std::string device() const override;
    [[nodiscard]] std::uint64_t image_bytes() const noexcept override;

    /// Draws into a framebuffer of the caller's instead of one of the backend's own. It needs a
    /// depth attachment; `read_target` reads its first colour attachment.
    /// @param framebuffer OpenGL name; 0 is the window
    /// @param width, height [px]
    [[nodiscard]] Result<TargetId>
    wrap_framebuffer(std::uint32_t framebuffer, std::int32_t width, std::int32_t height) noexcept;

  private:
    struct Impl;
    explicit OpenGLBackend(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::opengl
