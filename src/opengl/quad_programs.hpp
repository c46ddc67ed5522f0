#pragma once

#include <farfield/core/result.hpp>
#include <farfield/gpu/frame_plan.hpp>
#include <farfield/math/view.hpp>

#include <epoxy/gl.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace farfield::opengl {

/// What drawing image quads writes.
enum class QuadOutput : std::uint8_t {
    colors,
    depths, ///< where the filtered alpha is at least one half
    points, ///< what positions keep, likewise
};

/// Programs that draw image quads, each made when it is first asked for. Attributes of a vertex:
///
/// - 0: vec3, place relative to the eye in camera axes [m]
/// - 1: vec2 [texel] of the page
/// - 2: vec2 [m], distances along the view direction: the first is that of the whole quad; with
///   depths of texels, those that the kept depths 0 and 1 stand for at this corner
/// - 3: uint, node of the image
///
/// Texture units: 0 colours of the page, 1 its points, 2 its layers, 3 its depths.
class QuadPrograms {
  public:
    struct Program {
        GLuint name = 0;
        GLint projection = -1; ///< mat4, reverse-z
        GLint texel_size = -1; ///< float, of the page, in texture coordinates
    };
    static constexpr GLuint kColorUnit = 0;
    static constexpr GLuint kPointUnit = 1;
    static constexpr GLuint kLayerUnit = 2;
    static constexpr GLuint kDepthUnit = 3;

    QuadPrograms() = default;
    ~QuadPrograms();
    QuadPrograms(const QuadPrograms&) = delete;
    QuadPrograms& operator=(const QuadPrograms&) = delete;

    /// Makes a program unless it is there.
    [[nodiscard]] Result<void> require(QuadOutput output, QuadDepth depth);

    /// @pre it was required
    [[nodiscard]] const Program& get(QuadOutput output, QuadDepth depth) const noexcept {
        return programs_[place(output, depth)];
    }

  private:
    static constexpr std::size_t kDepths = 3;
    static constexpr std::size_t kOutputs = 3;
    [[nodiscard]] static std::size_t place(QuadOutput output, QuadDepth depth) noexcept {
        return static_cast<std::size_t>(output) * kDepths + static_cast<std::size_t>(depth);
    }

    std::array<Program, kOutputs * kDepths> programs_{};
};

/// The program that turns the depth buffer of a scratch page into depths that a page keeps, as
/// `Pass::copy_near` says: draw three vertices into the texels to be written. Texture units: 0
/// colours, 1 depths of the scratch page.
class DepthCopyProgram {
  public:
    /// Uniforms of one copy.
    struct Copy {
        std::array<GLint, 2> offset{}; ///< from a texel of the page to that of the scratch page
        Lens lens;                     ///< of the pass
        GLfloat nearest = 0.0F;        ///< `Pass::copy_near` [m]
        GLfloat farthest = 0.0F;       ///< `Pass::copy_far` [m]
        GLint samples = 1;             ///< of the scratch page
    };
    static constexpr GLuint kColorUnit = 0;
    static constexpr GLuint kDepthUnit = 1;

    DepthCopyProgram() = default;
    ~DepthCopyProgram();
    DepthCopyProgram(const DepthCopyProgram&) = delete;
    DepthCopyProgram& operator=(const DepthCopyProgram&) = delete;

    /// Makes what copies from pages of one sample, or of several, unless it is there.
    [[nodiscard]] Result<void> require(std::int32_t samples);

    /// Draws, with whatever is bound. @pre what it needs was required
    void draw(const Copy& copy) const noexcept;

  private:
    struct Program {
        GLuint name = 0;
        GLint offset = -1;
        GLint lens = -1;
        GLint range = -1;
        GLint samples = -1;
    };
    std::array<Program, 2> programs_{}; ///< of one sample, of several
};

} // namespace farfield::opengl
