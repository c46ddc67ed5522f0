#include "opengl/state_guard.hpp"

#include <cstddef>

namespace farfield::opengl {

namespace {

void set_switch(GLenum name, GLboolean on) noexcept {
    if (on == GL_TRUE) {
        glEnable(name);
    } else {
        glDisable(name);
    }
}

void set_first_switch(GLenum name, GLboolean on) noexcept {
    if (on == GL_TRUE) {
        glEnablei(name, 0);
    } else {
        glDisablei(name, 0);
    }
}

GLint integer(GLenum name) noexcept {
    GLint value = 0;
    glGetIntegerv(name, &value);
    return value;
}

GLint first_integer(GLenum name) noexcept {
    GLint value = 0;
    glGetIntegeri_v(name, 0, &value);
    return value;
}

/// Plain rows of bytes, as many as there are pixels.
void set_plain_rows(const std::array<GLenum, 6>& names) noexcept {
    for (const GLenum name : names) {
        glPixelStorei(name, name == GL_PACK_ALIGNMENT || name == GL_UNPACK_ALIGNMENT ? 1 : 0);
    }
}

} // namespace

StateGuard::StateGuard(std::size_t units) noexcept : units_(units) {
    for (std::size_t i = 0; i < kOff.size(); ++i) {
        off_[i] = glIsEnabled(kOff[i]);
    }
    for (std::size_t i = 0; i < kClipDistances; ++i) {
        clip_distances_[i] = glIsEnabled(GL_CLIP_DISTANCE0 + static_cast<GLenum>(i));
    }
    depth_test_ = glIsEnabled(GL_DEPTH_TEST);
    multisample_ = glIsEnabled(GL_MULTISAMPLE);
    blend_ = glIsEnabledi(GL_BLEND, 0);
    scissor_test_ = glIsEnabledi(GL_SCISSOR_TEST, 0);
    glGetFloati_v(GL_VIEWPORT, 0, viewport_.data());
    glGetIntegeri_v(GL_SCISSOR_BOX, 0, scissor_.data());
    for (std::size_t i = 0; i < kBuffers; ++i) {
        glGetBooleani_v(GL_COLOR_WRITEMASK, static_cast<GLuint>(i), color_masks_[i].data());
    }
    glGetDoublei_v(GL_DEPTH_RANGE, 0, depth_range_.data());
    glGetBooleanv(GL_DEPTH_WRITEMASK, &depth_mask_);
    depth_function_ = integer(GL_DEPTH_FUNC);
    blend_source_color_ = first_integer(GL_BLEND_SRC_RGB);
    blend_target_color_ = first_integer(GL_BLEND_DST_RGB);
    blend_source_alpha_ = first_integer(GL_BLEND_SRC_ALPHA);
    blend_target_alpha_ = first_integer(GL_BLEND_DST_ALPHA);
    blend_equation_color_ = first_integer(GL_BLEND_EQUATION_RGB);
    blend_equation_alpha_ = first_integer(GL_BLEND_EQUATION_ALPHA);
    clip_origin_ = integer(GL_CLIP_ORIGIN);
    clip_depth_ = integer(GL_CLIP_DEPTH_MODE);
    provoking_vertex_ = integer(GL_PROVOKING_VERTEX);
    std::array<GLint, 2> polygon_modes{};
    glGetIntegerv(GL_POLYGON_MODE, polygon_modes.data());
    polygon_mode_ = polygon_modes[0];
    glGetFloatv(GL_POINT_SIZE, &point_size_);
    glGetFloatv(GL_POINT_FADE_THRESHOLD_SIZE, &point_fade_threshold_);
    draw_framebuffer_ = integer(GL_DRAW_FRAMEBUFFER_BINDING);
    read_framebuffer_ = integer(GL_READ_FRAMEBUFFER_BINDING);
    program_ = integer(GL_CURRENT_PROGRAM);
    pipeline_ = integer(GL_PROGRAM_PIPELINE_BINDING);
    vertex_array_ = integer(GL_VERTEX_ARRAY_BINDING);
    active_texture_ = integer(GL_ACTIVE_TEXTURE);
    for (std::size_t i = 0; i < units_; ++i) {
        glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
        textures_[i] = integer(GL_TEXTURE_BINDING_2D);
        multisample_textures_[i] = integer(GL_TEXTURE_BINDING_2D_MULTISAMPLE);
        samplers_[i] = integer(GL_SAMPLER_BINDING);
    }
}

StateGuard::~StateGuard() {
    for (std::size_t i = 0; i < kOff.size(); ++i) {
        set_switch(kOff[i], off_[i]);
    }
    for (std::size_t i = 0; i < kClipDistances; ++i) {
        set_switch(GL_CLIP_DISTANCE0 + static_cast<GLenum>(i), clip_distances_[i]);
    }
    set_switch(GL_DEPTH_TEST, depth_test_);
    set_switch(GL_MULTISAMPLE, multisample_);
    set_first_switch(GL_BLEND, blend_);
    set_first_switch(GL_SCISSOR_TEST, scissor_test_);
    glViewportIndexedfv(0, viewport_.data());
    glScissorIndexedv(0, scissor_.data());
    for (std::size_t i = 0; i < kBuffers; ++i) {
        const std::array<GLboolean, 4>& mask = color_masks_[i];
        glColorMaski(static_cast<GLuint>(i), mask[0], mask[1], mask[2], mask[3]);
    }
    glDepthRangeIndexed(0, depth_range_[0], depth_range_[1]);
    glDepthMask(depth_mask_);
    glDepthFunc(static_cast<GLenum>(depth_function_));
    glBlendFuncSeparatei(
        0,
        static_cast<GLenum>(blend_source_color_),
        static_cast<GLenum>(blend_target_color_),
        static_cast<GLenum>(blend_source_alpha_),
        static_cast<GLenum>(blend_target_alpha_)
    );
    glBlendEquationSeparatei(
        0, static_cast<GLenum>(blend_equation_color_), static_cast<GLenum>(blend_equation_alpha_)
    );
    glClipControl(static_cast<GLenum>(clip_origin_), static_cast<GLenum>(clip_depth_));
    glProvokingVertex(static_cast<GLenum>(provoking_vertex_));
    glPolygonMode(GL_FRONT_AND_BACK, static_cast<GLenum>(polygon_mode_));
    glPointSize(point_size_);
    glPointParameterf(GL_POINT_FADE_THRESHOLD_SIZE, point_fade_threshold_);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(draw_framebuffer_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(read_framebuffer_));
    glUseProgram(static_cast<GLuint>(program_));
    glBindProgramPipeline(static_cast<GLuint>(pipeline_));
    glBindVertexArray(static_cast<GLuint>(vertex_array_));
    for (std::size_t i = 0; i < units_; ++i) {
        glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
        glBindTexture(GL_TEXTURE_2D, static_cast<GLuint>(textures_[i]));
        glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, static_cast<GLuint>(multisample_textures_[i]));
        glBindSampler(static_cast<GLuint>(i), static_cast<GLuint>(samplers_[i]));
    }
    glActiveTexture(static_cast<GLenum>(active_texture_));
}

void set_place(GLuint framebuffer, const Region& viewport, const Region& scissor) noexcept {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewportIndexedf(
        0,
        static_cast<GLfloat>(viewport.x),
        static_cast<GLfloat>(viewport.y),
        static_cast<GLfloat>(viewport.width),
        static_cast<GLfloat>(viewport.height)
    );
    glScissorIndexed(0, scissor.x, scissor.y, scissor.width, scissor.height);
}

void set_drawing_state(GLuint framebuffer, const Region& viewport, const Region& scissor) noexcept {
    for (const GLenum name : StateGuard::kOff) {
        glDisable(name);
    }
    for (std::size_t i = 0; i < StateGuard::kClipDistances; ++i) {
        glDisable(GL_CLIP_DISTANCE0 + static_cast<GLenum>(i));
    }
    glEnable(GL_DEPTH_TEST);
    glEnable(GL_MULTISAMPLE);
    glDisablei(GL_BLEND, 0);
    glEnablei(GL_SCISSOR_TEST, 0);
    set_place(framebuffer, viewport, scissor);
    for (GLuint buffer = 0; buffer < StateGuard::kBuffers; ++buffer) {
        glColorMaski(buffer, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    }
    glDepthRangeIndexed(0, 0.0, 1.0);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
    glBlendFunci(0, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glBlendEquationi(0, GL_FUNC_ADD);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    // Nothing is flat-shaded, but drivers turn triangles by it, and rounding turns with them.
    glProvokingVertex(GL_LAST_VERTEX_CONVENTION);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    // With several samples, points smaller than the threshold may be faded instead.
    glPointSize(1.0F);
    glPointParameterf(GL_POINT_FADE_THRESHOLD_SIZE, 1.0F);
    glBindProgramPipeline(0);
    glActiveTexture(GL_TEXTURE0);
    for (GLuint unit = 0; unit < StateGuard::kUnits; ++unit) {
        glBindSampler(unit, 0);
    }
}

ReadGuard::ReadGuard() noexcept {
    for (std::size_t i = 0; i < kPack.size(); ++i) {
        pack_[i] = integer(kPack[i]);
    }
    pack_buffer_ = integer(GL_PIXEL_PACK_BUFFER_BINDING);
    framebuffer_ = integer(GL_READ_FRAMEBUFFER_BINDING);
    scissor_test_ = glIsEnabledi(GL_SCISSOR_TEST, 0);
    set_plain_rows(kPack);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    // It would cut the resolve of a target with several samples.
    glDisablei(GL_SCISSOR_TEST, 0);
}

ReadGuard::~ReadGuard() {
    for (std::size_t i = 0; i < kPack.size(); ++i) {
        glPixelStorei(kPack[i], pack_[i]);
    }
    glBindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(pack_buffer_));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(framebuffer_));
    set_first_switch(GL_SCISSOR_TEST, scissor_test_);
}

UploadGuard::UploadGuard() noexcept {
    for (std::size_t i = 0; i < kUnpack.size(); ++i) {
        unpack_[i] = integer(kUnpack[i]);
    }
    unpack_buffer_ = integer(GL_PIXEL_UNPACK_BUFFER_BINDING);
    set_plain_rows(kUnpack);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
}

UploadGuard::~UploadGuard() {
    for (std::size_t i = 0; i < kUnpack.size(); ++i) {
        glPixelStorei(kUnpack[i], unpack_[i]);
    }
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, static_cast<GLuint>(unpack_buffer_));
}

} // namespace farfield::opengl
