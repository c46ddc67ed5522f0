#include "opengl/state_guard.hpp"

namespace farfield::opengl {

namespace {

void set_switch(GLenum name, GLboolean on) noexcept {
    if (on == GL_TRUE) {
        glEnable(name);
    } else {
        glDisable(name);
    }
}

GLint integer(GLenum name) noexcept {
    GLint value = 0;
    glGetIntegerv(name, &value);
    return value;
}

} // namespace

StateGuard::StateGuard() noexcept {
    for (std::size_t i = 0; i < kSwitches.size(); ++i) {
        switches_[i] = glIsEnabled(kSwitches[i]);
    }
    for (std::size_t i = 0; i < kClipDistances; ++i) {
        clip_distances_[i] = glIsEnabled(GL_CLIP_DISTANCE0 + static_cast<GLenum>(i));
    }
    glGetIntegerv(GL_VIEWPORT, viewport_.data());
    glGetIntegerv(GL_SCISSOR_BOX, scissor_.data());
    glGetFloatv(GL_COLOR_CLEAR_VALUE, clear_color_.data());
    glGetBooleanv(GL_COLOR_WRITEMASK, color_mask_.data());
    glGetDoublev(GL_DEPTH_RANGE, depth_range_.data());
    glGetDoublev(GL_DEPTH_CLEAR_VALUE, &clear_depth_);
    glGetBooleanv(GL_DEPTH_WRITEMASK, &depth_mask_);
    depth_function_ = integer(GL_DEPTH_FUNC);
    blend_source_color_ = integer(GL_BLEND_SRC_RGB);
    blend_target_color_ = integer(GL_BLEND_DST_RGB);
    blend_source_alpha_ = integer(GL_BLEND_SRC_ALPHA);
    blend_target_alpha_ = integer(GL_BLEND_DST_ALPHA);
    blend_equation_color_ = integer(GL_BLEND_EQUATION_RGB);
    blend_equation_alpha_ = integer(GL_BLEND_EQUATION_ALPHA);
    clip_origin_ = integer(GL_CLIP_ORIGIN);
    clip_depth_ = integer(GL_CLIP_DEPTH_MODE);
    std::array<GLint, 2> polygon_modes{};
    glGetIntegerv(GL_POLYGON_MODE, polygon_modes.data());
    polygon_mode_ = polygon_modes[0];
    draw_framebuffer_ = integer(GL_DRAW_FRAMEBUFFER_BINDING);
    read_framebuffer_ = integer(GL_READ_FRAMEBUFFER_BINDING);
    program_ = integer(GL_CURRENT_PROGRAM);
    pipeline_ = integer(GL_PROGRAM_PIPELINE_BINDING);
    vertex_array_ = integer(GL_VERTEX_ARRAY_BINDING);
    active_texture_ = integer(GL_ACTIVE_TEXTURE);
    glActiveTexture(GL_TEXTURE0);
    texture_ = integer(GL_TEXTURE_BINDING_2D);
    sampler_ = integer(GL_SAMPLER_BINDING);
}

StateGuard::~StateGuard() {
    for (std::size_t i = 0; i < kSwitches.size(); ++i) {
        set_switch(kSwitches[i], switches_[i]);
    }
    for (std::size_t i = 0; i < kClipDistances; ++i) {
        set_switch(GL_CLIP_DISTANCE0 + static_cast<GLenum>(i), clip_distances_[i]);
    }
    glViewport(viewport_[0], viewport_[1], viewport_[2], viewport_[3]);
    glScissor(scissor_[0], scissor_[1], scissor_[2], scissor_[3]);
    glClearColor(clear_color_[0], clear_color_[1], clear_color_[2], clear_color_[3]);
    glColorMask(color_mask_[0], color_mask_[1], color_mask_[2], color_mask_[3]);
    glDepthRange(depth_range_[0], depth_range_[1]);
    glClearDepth(clear_depth_);
    glDepthMask(depth_mask_);
    glDepthFunc(static_cast<GLenum>(depth_function_));
    glBlendFuncSeparate(
        static_cast<GLenum>(blend_source_color_),
        static_cast<GLenum>(blend_target_color_),
        static_cast<GLenum>(blend_source_alpha_),
        static_cast<GLenum>(blend_target_alpha_)
    );
    glBlendEquationSeparate(
        static_cast<GLenum>(blend_equation_color_), static_cast<GLenum>(blend_equation_alpha_)
    );
    glClipControl(static_cast<GLenum>(clip_origin_), static_cast<GLenum>(clip_depth_));
    glPolygonMode(GL_FRONT_AND_BACK, static_cast<GLenum>(polygon_mode_));
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(draw_framebuffer_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(read_framebuffer_));
    glUseProgram(static_cast<GLuint>(program_));
    glBindProgramPipeline(static_cast<GLuint>(pipeline_));
    glBindVertexArray(static_cast<GLuint>(vertex_array_));
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(texture_));
    glBindSampler(0, static_cast<GLuint>(sampler_));
    glActiveTexture(static_cast<GLenum>(active_texture_));
}

void set_drawing_state() noexcept {
    for (const GLenum name :
         {GL_COLOR_LOGIC_OP,
          GL_CULL_FACE,
          GL_DEPTH_CLAMP,
          GL_DITHER,
          GL_FRAMEBUFFER_SRGB,
          GL_POLYGON_OFFSET_FILL,
          GL_PRIMITIVE_RESTART,
          GL_PRIMITIVE_RESTART_FIXED_INDEX,
          GL_RASTERIZER_DISCARD,
          GL_SAMPLE_ALPHA_TO_COVERAGE,
          GL_SAMPLE_ALPHA_TO_ONE,
          GL_SAMPLE_COVERAGE,
          GL_SAMPLE_MASK,
          GL_SAMPLE_SHADING,
          GL_STENCIL_TEST}) {
        glDisable(name);
    }
    for (GLenum plane = 0; plane < 8; ++plane) {
        glDisable(GL_CLIP_DISTANCE0 + plane);
    }
    glEnable(GL_SCISSOR_TEST);
    glEnable(GL_DEPTH_TEST);
    glEnable(GL_MULTISAMPLE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glDepthRange(0.0, 1.0);
    glClearDepth(0.0);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glBindProgramPipeline(0);
    glActiveTexture(GL_TEXTURE0);
    glBindSampler(0, 0);
}

} // namespace farfield::opengl
