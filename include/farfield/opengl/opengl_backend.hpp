#pragma once

#include <farfield/core/executor.hpp>
#include <farfield/core/result.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/geometry_source.hpp>

#include <cstdint>
#include <memory>
#include <string>

namespace farfield::opengl {

/// How layered depth images are drawn.
enum class LayerDrawing : std::uint8_t {
    points, ///< by the device, a point for each sample
    /// By the processor, with `LayeredWarper`, as a picture with depth that is uploaded each time:
    /// for devices that are slow with points, as those that are none but software.
    warped,
};

struct OpenGLBackendOptions {
    /// Keeps surface points beside the colours of every page and target: see
    /// `Backend::read_positions`. For measuring: pages take seven times the memory, images are
    /// drawn twice, and whatever the plan says there is one sample a pixel.
    bool positions = false;
    LayerDrawing layers = LayerDrawing::points;
    /// Shares the work of warping; must outlive the backend. Null: the calling thread does it
    /// alone.
    Executor* executor = nullptr;
};

/// Executes frame plans with OpenGL 4.5 core, in the context that is current on the calling thread:
/// a `HeadlessContext`, or the one of an engine.
///
/// Every state that `execute`, `read_target` or a `SceneSource` touches is restored to what it was
/// before the call. A source of the engine's own may leave what it likes behind between its draws,
/// the backend sets its own state again; after `execute` only what it changed beyond that of a
/// `SceneSource` is left.
///
/// Plans are checked as far as that costs next to nothing: `gpu::check_structure`, and that pages
/// exist, are of the right kind, and hold what is drawn or copied to them. Whether items exist and
/// images were ever made only `NullBackend` checks.
///
/// Layered depth images are exact, sample by sample of the target, in whichever way they are drawn.
///
/// Images are rendered in one scratch page with a 32-bit float reverse-z depth buffer, many in a
/// batch, and copied to their pages. Colours are blended as encoded (`GL_FRAMEBUFFER_SRGB` is off).
///
/// With positions, `PassContext::positions` asks the source for two more outputs: at location 1 a
/// uvec4 of the bits of the object-space point and the item's number, at location 2 a uvec2 of 0
/// and 0xFFFFFFFF. Framebuffers of the caller's have colours alone.
class OpenGLBackend final : public Backend {
  public:
    /// @param source draws the items; must outlive the backend and use the same context
    /// @return `device` where no context is current, `unsupported` where it is older than 4.5, or
    /// where positions are asked for that the source does not give
    [[nodiscard]] static Result<std::unique_ptr<OpenGLBackend>>
    create(GeometrySource& source, const OpenGLBackendOptions& options = {});

    ~OpenGLBackend() override;

    [[nodiscard]] Result<void>
    execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept override;
    void finish() noexcept override;
    [[nodiscard]] Result<TargetId>
    create_target(std::int32_t width, std::int32_t height, std::int32_t samples) noexcept override;
    void destroy_target(TargetId target) noexcept override;
    [[nodiscard]] Result<Picture> read_target(TargetId target) override;
    [[nodiscard]] Result<PositionPicture> read_positions(TargetId target) override;
    [[nodiscard]] Limits limits() const noexcept override;
    [[nodiscard]] std::string device() const override;
    [[nodiscard]] std::uint64_t image_bytes() const noexcept override;
    [[nodiscard]] std::uint64_t position_bytes() const noexcept override;

    /// Draws into a framebuffer of the caller's instead of one of the backend's own. It needs a
    /// depth attachment, which is reverse-z: cleared to 0, nearer is greater. Its first draw buffer
    /// is drawn to; `read_target` reads its first colour attachment, of the window the read buffer.
    /// @param framebuffer OpenGL name; 0 is the window; must outlive its use as a target
    /// @param width, height [px] its size
    /// @return `invalid_argument` for one that does not exist, is not complete or has no depth
    [[nodiscard]] Result<TargetId>
    wrap_framebuffer(std::uint32_t framebuffer, std::int32_t width, std::int32_t height) noexcept;

  private:
    struct Impl;
    explicit OpenGLBackend(std::unique_ptr<Impl> impl) noexcept;
    std::unique_ptr<Impl> impl_;
};

} // namespace farfield::opengl
