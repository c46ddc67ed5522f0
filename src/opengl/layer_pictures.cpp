#include "opengl/layer_pictures.hpp"

#include "opengl/program.hpp"
#include "opengl/state_guard.hpp"
#include <farfield/gpu/layered_drawing.hpp>
#include <farfield/math/view.hpp>

#include <glm/common.hpp>
#include <glm/ext/matrix_float4x4.hpp>

#include <bit>
#include <cstddef>
#include <string>

namespace farfield::opengl {

namespace {

constexpr GLuint kColorUnit = 0;
constexpr GLuint kPointUnit = 1;
constexpr GLuint kLayerUnit = 2;
constexpr GLuint kDepthUnit = 3;

// Uniforms of all programs.
constexpr GLint kCorner = 0;
constexpr GLint kDepths = 1;
constexpr GLint kSample = 2; // of those of several samples

constexpr const char* kVertexShader = R"(
void main() {
    // One triangle that covers the viewport.
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(4.0 * corner - 1.0, 0.5, 1.0);
}
)";

constexpr const char* kFragmentShader = R"(
layout(binding = 0) uniform sampler2D colors;
layout(binding = 3) uniform sampler2D distances;
layout(location = 0) uniform ivec2 corner;
layout(location = 1) uniform vec2 depths; // of the depth buffer
layout(location = 0) out vec4 result;
#if SAMPLED
layout(location = 2) uniform int drawn_sample;
#endif
#if POSITIONS
layout(binding = 1) uniform usampler2D points;
layout(binding = 2) uniform usampler2D layers;
layout(location = 1) out uvec4 point;
layout(location = 2) out uvec2 layer;
#endif
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - corner;
    result = texelFetch(colors, at, 0);
    if (result.a == 0.0) { discard; }
    gl_FragDepth = clamp(depths.y / texelFetch(distances, at, 0).x - depths.x, 0.0, 1.0);
#if SAMPLED
    gl_SampleMask[0] = 1 << drawn_sample;
#endif
#if POSITIONS
    point = texelFetch(points, at, 0);
    layer = texelFetch(layers, at, 0).xy;
#endif
}
)";

/// For what is fetched and never filtered.
GLuint make_texture(GLenum format, const glm::ivec2& size) noexcept {
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, 1, format, size.x, size.y);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

} // namespace

LayerPictures::~LayerPictures() {
    for (const GLuint program : programs_) {
        glDeleteProgram(program);
    }
    glDeleteVertexArrays(1, &array_);
    for (const GLuint texture : {colors_, depths_, points_, layers_}) {
        glDeleteTextures(1, &texture);
    }
}

Result<void> LayerPictures::require(LayerOutput output) {
    GLuint& program = programs_[static_cast<std::size_t>(output)];
    if (program != 0) {
        return {};
    }
    const Result<GLuint> linked = link_program(
        "warped layered images",
        layer_head(output) + kVertexShader,
        layer_head(output) + kFragmentShader
    );
    if (!linked) {
        return tl::unexpected(linked.error());
    }
    program = *linked;
    if (array_ == 0) {
        glCreateVertexArrays(1, &array_);
    }
    return {};
}

void LayerPictures::reserve(const View& view, bool positions) noexcept {
    const bool fits = view.width <= size_.x && view.height <= size_.y;
    if (fits && (points_ != 0 || !positions)) {
        return;
    }
    size_ = glm::max(size_, glm::ivec2(view.width, view.height));
    for (const GLuint texture : {colors_, depths_, points_, layers_}) {
        glDeleteTextures(1, &texture);
    }
    colors_ = make_texture(GL_RGBA8, size_);
    depths_ = make_texture(GL_R32F, size_);
    points_ = positions ? make_texture(GL_RGBA32UI, size_) : 0;
    layers_ = positions ? make_texture(GL_RG32UI, size_) : 0;
}

void LayerPictures::upload() const noexcept {
    const auto fill = [&](GLuint texture, GLenum format, GLenum type, const void* texels) {
        glTextureSubImage2D(texture, 0, 0, 0, warped_.width, warped_.height, format, type, texels);
    };
    fill(colors_, GL_RGBA, GL_UNSIGNED_BYTE, warped_.colors.data());
    fill(depths_, GL_RED, GL_FLOAT, warped_.depths.data());
    if (!layer_texels_.empty()) {
        fill(points_, GL_RGBA_INTEGER, GL_UNSIGNED_INT, point_texels_.data());
        fill(layers_, GL_RG_INTEGER, GL_UNSIGNED_INT, layer_texels_.data());
    }
}

void LayerPictures::find_points(
    const LayeredDepthImage& image, const View& view, std::uint32_t node
) {
    const LayeredTerms terms = layered_terms(image, view);
    point_texels_.clear();
    layer_texels_.clear();
    for (const std::uint32_t sample : warped_.samples) {
        const PositionTexel texel = gpu::shown_point(image, terms, sample, node);
        point_texels_.emplace_back(
            std::bit_cast<std::uint32_t>(texel.point.x),
            std::bit_cast<std::uint32_t>(texel.point.y),
            std::bit_cast<std::uint32_t>(texel.point.z),
            static_cast<std::uint32_t>(index_of(texel.item))
        );
        layer_texels_.emplace_back(std::bit_cast<std::uint32_t>(texel.texel_px), texel.node);
    }
}

void LayerPictures::draw(
    const LayeredDepthImage& image,
    std::uint32_t node,
    const Pass& pass,
    std::span<const glm::dvec2> places,
    LayerOutput output
) {
    const bool positions = output == LayerOutput::positions;
    const glm::mat4 projection = projection_matrix(pass.view.lens);
    reserve(pass.view, positions);
    glUseProgram(programs_[static_cast<std::size_t>(output)]);
    glUniform2i(kCorner, pass.viewport.x, pass.viewport.y);
    glUniform2f(kDepths, projection[2][2], projection[3][2]);
    glBindVertexArray(array_);
    glBindTextureUnit(kColorUnit, colors_);
    glBindTextureUnit(kDepthUnit, depths_);
    if (positions) {
        glBindTextureUnit(kPointUnit, points_);
        glBindTextureUnit(kLayerUnit, layers_);
    }
    Executor& executor = executor_ == nullptr ? serial_ : *executor_;
    const UploadGuard guard;
    for (std::size_t sample = 0; sample < places.size(); ++sample) {
        const View view =
            places.size() == 1 ? pass.view : gpu::view_of_sample(pass.view, places[sample]);
        warper_.warp(image, view, executor, warped_, positions, LayeredFront::depth);
        if (positions) {
            find_points(image, view, node);
        }
        upload();
        if (output == LayerOutput::sampled_colors) {
            glUniform1i(kSample, static_cast<GLint>(sample));
        }
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
}

} // namespace farfield::opengl
