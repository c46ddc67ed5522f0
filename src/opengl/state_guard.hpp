#pragma once

#include <epoxy/gl.h>

#include <array>

namespace farfield::opengl {

/// Remembers every OpenGL state that executing a plan changes, and puts it back when it goes. All
/// changes go through states listed here; a test compares the whole context before and after.
class StateGuard {
  public:
    StateGuard() noexcept;
    ~StateGuard();
    StateGuard(const StateGuard&) = delete;
    StateGuard& operator=(const StateGuard&) = delete;

  private:
    static constexpr std::array<GLenum, 20> kSwitches = {
        GL_BLEND,
        GL_COLOR_LOGIC_OP,
        GL_CULL_FACE,
        GL_DEPTH_CLAMP,
        GL_DEPTH_TEST,
        GL_DITHER,
        GL_FRAMEBUFFER_SRGB,
        GL_MULTISAMPLE,
        GL_POLYGON_OFFSET_FILL,
        GL_PRIMITIVE_RESTART,
        GL_PRIMITIVE_RESTART_FIXED_INDEX,
        GL_RASTERIZER_DISCARD,
        GL_SAMPLE_ALPHA_TO_COVERAGE,
        GL_SAMPLE_ALPHA_TO_ONE,
        GL_SAMPLE_COVERAGE,
        GL_SAMPLE_MASK,
        GL_SAMPLE_SHADING,
        GL_SCISSOR_TEST,
        GL_STENCIL_TEST,
        GL_CLIP_DISTANCE0,
    };
    static constexpr std::size_t kClipDistances = 8;

    std::array<GLboolean, kSwitches.size()> switches_{};
    std::array<GLboolean, kClipDistances> clip_distances_{};
    std::array<GLint, 4> viewport_{};
    std::array<GLint, 4> scissor_{};
    std::array<GLfloat, 4> clear_color_{};
    std::array<GLboolean, 4> color_mask_{};
    std::array<GLdouble, 2> depth_range_{};
    GLdouble clear_depth_ = 1.0;
    GLboolean depth_mask_ = GL_TRUE;
    GLint depth_function_ = GL_LESS;
    GLint blend_source_color_ = GL_ONE;
    GLint blend_target_color_ = GL_ZERO;
    GLint blend_source_alpha_ = GL_ONE;
    GLint blend_target_alpha_ = GL_ZERO;
    GLint blend_equation_color_ = GL_FUNC_ADD;
    GLint blend_equation_alpha_ = GL_FUNC_ADD;
    GLint clip_origin_ = GL_LOWER_LEFT;
    GLint clip_depth_ = GL_NEGATIVE_ONE_TO_ONE;
    GLint polygon_mode_ = GL_FILL;
    GLint draw_framebuffer_ = 0;
    GLint read_framebuffer_ = 0;
    GLint program_ = 0;
    GLint pipeline_ = 0;
    GLint vertex_array_ = 0;
    GLint active_texture_ = GL_TEXTURE0;
    GLint texture_ = 0;
    GLint sampler_ = 0;
};

/// Sets every switch above to what drawing a plan needs: everything off but the scissor and depth
/// tests, multisampling on, filled polygons, reverse-z clip conventions.
void set_drawing_state() noexcept;

} // namespace farfield::opengl
