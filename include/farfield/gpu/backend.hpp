#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/image/position_picture.hpp>

#include <glm/vec4.hpp>

#include <cstdint>
#include <string>

namespace farfield {

/// A frame that a backend draws into; zero is none.
enum class TargetId : std::uint32_t {};

/// How a frame pass begins.
struct FrameClear {
    bool enabled = true;                     ///< false: the caller has cleared, or drawn, already
    glm::vec4 color{0.0F, 0.0F, 0.0F, 1.0F}; ///< sRGB-encoded
};

/// Interprets frame plans on one device. Every implementation passes the same conformance test.
///
/// Not thread-safe: one thread at a time, the one that owns the device.
class Backend {
  public:
    Backend() = default;
    Backend(const Backend&) = delete;
    Backend& operator=(const Backend&) = delete;
    virtual ~Backend() = default;

    /// Draws a plan into `target`. Each plan of a technique is executed once, in order. After an
    /// error the images are in no defined state: tell the technique (`forget_images`).
    [[nodiscard]] virtual Result<void>
    execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept = 0;

    /// Waits until everything asked for is drawn.
    virtual void finish() noexcept = 0;

    /// A frame of the backend's own to draw into and read from.
    /// @param width, height [px] 1 to 16384 @param samples per pixel, at most `limits().samples`
    [[nodiscard]] virtual Result<TargetId>
    create_target(std::int32_t width, std::int32_t height, std::int32_t samples) noexcept = 0;
    virtual void destroy_target(TargetId target) noexcept = 0;

    /// Colours of a target, rows from the top; waits for drawing to end.
    [[nodiscard]] virtual Result<Picture> read_target(TargetId target) = 0;

    /// Which surface point each pixel of a target shows; waits for drawing to end.
    /// @return `unsupported` from a backend that keeps no positions
    [[nodiscard]] virtual Result<PositionPicture> read_positions(TargetId target) = 0;

    struct Limits {
        std::int32_t page_size = 0; ///< [texel] largest width and height of a page
        std::int32_t samples = 1;   ///< most samples per pixel
        /// Keeps, beside the colour of every page and target, the surface points that it shows: for
        /// measuring. Pages and targets then have one sample whatever is asked for.
        bool positions = false;
    };
    [[nodiscard]] virtual Limits limits() const noexcept = 0;

    /// Name of the device, for reports.
    [[nodiscard]] virtual std::string device() const = 0;

    /// Bytes of all pages as allocated, with depth and samples, and of all layered images.
    [[nodiscard]] virtual std::uint64_t image_bytes() const noexcept = 0;

    /// Bytes that positions take beside the colours of all pages and layered images: 0 where none
    /// are kept.
    [[nodiscard]] virtual std::uint64_t position_bytes() const noexcept = 0;
};

} // namespace farfield
