#pragma once

#include <farfield/image/region.hpp>

#include <epoxy/gl.h>

#include <array>

namespace farfield::opengl {

/// Remembers every OpenGL state that executing a plan changes, and puts it back when it goes. All
/// changes go through states listed here; a test compares the whole context before and after. Of
/// states that exist once for each viewport or draw buffer only the first is touched, but for the
/// colour masks of the buffers that positions are kept in.
class StateGuard {
  public:
    /// @param units of textures that are touched, `kUnits` to `kMostUnits`
    explicit StateGuard(std::size_t units) noexcept;
    ~StateGuard();
    StateGuard(const StateGuard&) = delete;
    StateGuard& operator=(const StateGuard&) = delete;

    /// Switches that drawing a plan needs off. Offsets of lines and points should not matter, but
    /// llvmpipe moves triangles with several samples by them.
    static constexpr std::array<GLenum, 19> kOff = {
        GL_COLOR_LOGIC_OP,
        GL_CULL_FACE,
        GL_DEPTH_CLAMP,
        GL_DITHER,
        GL_FRAMEBUFFER_SRGB,
        GL_POLYGON_OFFSET_FILL,
        GL_POLYGON_OFFSET_LINE,
        GL_POLYGON_OFFSET_POINT,
        GL_POLYGON_SMOOTH,
        GL_PRIMITIVE_RESTART,
        GL_PRIMITIVE_RESTART_FIXED_INDEX,
        GL_PROGRAM_POINT_SIZE,
        GL_RASTERIZER_DISCARD,
        GL_SAMPLE_ALPHA_TO_COVERAGE,
        GL_SAMPLE_ALPHA_TO_ONE,
        GL_SAMPLE_COVERAGE,
        GL_SAMPLE_MASK,
        GL_SAMPLE_SHADING,
        GL_STENCIL_TEST,
    };
    static constexpr std::size_t kClipDistances = 8;

    /// Draw buffers: colours, and with positions points and layers.
    static constexpr std::size_t kBuffers = 3;

    /// Texture units: what is in those buffers, and depths.
    static constexpr std::size_t kUnits = 4;
    static constexpr std::size_t kMostUnits = 17; ///< with those of keyframes

  private:
    std::array<GLboolean, kOff.size()> off_{};
    std::array<GLboolean, kClipDistances> clip_distances_{};
    GLboolean depth_test_ = GL_FALSE;
    GLboolean multisample_ = GL_TRUE;
    GLboolean blend_ = GL_FALSE;
    GLboolean scissor_test_ = GL_FALSE;
    std::array<GLfloat, 4> viewport_{};
    std::array<GLint, 4> scissor_{};
    std::array<std::array<GLboolean, 4>, kBuffers> color_masks_{};
    std::array<GLdouble, 2> depth_range_{};
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
    GLint provoking_vertex_ = GL_LAST_VERTEX_CONVENTION;
    GLint polygon_mode_ = GL_FILL;
    GLfloat point_size_ = 1.0F;
    GLfloat point_fade_threshold_ = 1.0F;
    GLint draw_framebuffer_ = 0;
    GLint read_framebuffer_ = 0;
    GLint program_ = 0;
    GLint pipeline_ = 0;
    GLint vertex_array_ = 0;
    GLint active_texture_ = GL_TEXTURE0;
    std::size_t units_ = kUnits;
    std::array<GLint, kMostUnits> textures_{};
    std::array<GLint, kMostUnits> multisample_textures_{};
    std::array<GLint, kMostUnits> samplers_{};
};

/// Sets every state above to what geometry of a plan is drawn with: depth tested and written,
/// reverse-z, scissored, opaque, filled, both sides; points of one pixel. Blending is off, and
/// premultiplied once on.
void set_drawing_state(GLuint framebuffer, const Region& viewport, const Region& scissor) noexcept;

/// Of the above, only where to draw.
void set_place(GLuint framebuffer, const Region& viewport, const Region& scissor) noexcept;

/// Sets what reading pixels into memory depends on, and puts it back when it goes.
class ReadGuard {
  public:
    ReadGuard() noexcept;
    ~ReadGuard();
    ReadGuard(const ReadGuard&) = delete;
    ReadGuard& operator=(const ReadGuard&) = delete;

  private:
    static constexpr std::array<GLenum, 6> kPack = {
        GL_PACK_SWAP_BYTES,
        GL_PACK_LSB_FIRST,
        GL_PACK_ROW_LENGTH,
        GL_PACK_SKIP_ROWS,
        GL_PACK_SKIP_PIXELS,
        GL_PACK_ALIGNMENT,
    };
    std::array<GLint, kPack.size()> pack_{};
    GLint pack_buffer_ = 0;
    GLint framebuffer_ = 0;
    GLboolean scissor_test_ = GL_FALSE;
};

/// Sets what uploading textures from memory depends on, and puts it back when it goes.
class UploadGuard {
  public:
    UploadGuard() noexcept;
    ~UploadGuard();
    UploadGuard(const UploadGuard&) = delete;
    UploadGuard& operator=(const UploadGuard&) = delete;

  private:
    static constexpr std::array<GLenum, 6> kUnpack = {
        GL_UNPACK_SWAP_BYTES,
        GL_UNPACK_LSB_FIRST,
        GL_UNPACK_ROW_LENGTH,
        GL_UNPACK_SKIP_ROWS,
        GL_UNPACK_SKIP_PIXELS,
        GL_UNPACK_ALIGNMENT,
    };
    std::array<GLint, kUnpack.size()> unpack_{};
    GLint unpack_buffer_ = 0;
};

} // namespace farfield::opengl
