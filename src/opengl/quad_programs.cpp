#include "opengl/quad_programs.hpp"

#include "opengl/program.hpp"
#include <farfield/math/view.hpp>

#include <glm/ext/matrix_float4x4.hpp>

#include <string>

namespace farfield::opengl {

namespace {

// Every text follows a head that defines DEPTH as one of these.
constexpr const char* kNames = R"(
#define NONE 0
#define PLANE 1
#define TEXEL 2
)";

constexpr const char* kVertexShader = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 texel;
layout(location = 2) in vec2 depths;
layout(location = 3) in uint node;
uniform mat4 projection;
uniform float texel_size;
layout(location = 0) out vec2 uv;
layout(location = 1) out vec2 at; // in texels
layout(location = 2) out vec2 ends;
layout(location = 3) flat out uint shown_node;
void main() {
    gl_Position = projection * vec4(position, 1.0);
#if DEPTH == NONE
    // The whole quad stands at one depth.
    float z = projection[2][2] * -depths.x + projection[3][2];
    // At the near or far distance rounding must not take it beyond.
    gl_Position.z = clamp(z / depths.x, 0.0, 1.0) * gl_Position.w;
#elif DEPTH == TEXEL
    // Neither the near plane nor the far one cuts the quad: where it is drawn its texels tell.
    gl_Position.z = 0.5 * gl_Position.w;
#endif
    uv = texel * texel_size;
    at = texel;
    ends = depths;
    shown_node = node;
}
)";

constexpr const char* kFragmentInputs = R"(
layout(location = 0) in vec2 uv;
layout(location = 1) in vec2 at;
layout(location = 2) in vec2 ends;
layout(location = 3) flat in uint shown_node;
uniform mat4 projection;
uniform float texel_size;
layout(binding = 0) uniform sampler2D page;
#if DEPTH == TEXEL
layout(binding = 3) uniform usampler2D kept;
const uint nothing = 65535u;
// The depth of the texel of most weight that keeps one.
float kept_depth() {
    vec2 corner = at - 0.5;
    vec2 share = corner - floor(corner);
    // Of the four texels around this point, whatever a device rounds.
    uvec4 depths = textureGather(kept, (floor(corner) + 1.0) * texel_size);
    vec2 rest = 1.0 - share;
    vec4 weights = vec4(rest.x, share.x, share.x, rest.x) * vec4(share.y, share.y, rest.y, rest.y);
    weights *= vec4(notEqual(depths, uvec4(nothing)));
    float most = max(max(weights.x, weights.y), max(weights.z, weights.w));
    uint found = weights.x == most ? depths.x
               : weights.y == most ? depths.y
               : weights.z == most ? depths.z : depths.w;
    return float(found) / 65535.0;
}
void stand() {
    float distance = mix(ends.x, ends.y, kept_depth());
    float depth = projection[3][2] / distance - projection[2][2];
    gl_FragDepth = distance > 0.0 ? clamp(depth, 0.0, 1.0) : 1.0;
}
#else
void stand() {}
#endif
)";

constexpr const char* kColorShader = R"(
layout(location = 0) out vec4 result;
void main() {
    result = texture(page, uv);
#if DEPTH == TEXEL
    // What is clear changes nothing: its depth need not be looked up.
    if (result == vec4(0.0)) { discard; }
#endif
    stand();
}
)";

constexpr const char* kDepthShader = R"(
void main() {
    if (texture(page, uv).a < 0.5) { discard; }
    stand();
}
)";

// With positions, the image's points are drawn after its colours.
constexpr const char* kPointShader = R"(
layout(binding = 1) uniform usampler2D points;
layout(binding = 2) uniform usampler2D layers;
layout(location = 1) out uvec4 point;
layout(location = 2) out uvec2 layer;
const uint none = 0xFFFFFFFFu;
const float sqrt_half = 0.70710678;
void main() {
    // Pixels per texel, from texels per pixel.
    mat2 to_texels = mat2(dFdx(at), dFdy(at));
    // A fragment owns its pixel where the filtered alpha is at least one half.
    if (texture(page, at * texel_size).a < 0.5) { discard; }
    mat2 to_pixels = inverse(to_texels);
    ivec2 last = textureSize(points, 0) - 1;
    vec2 corner = at - 0.5;
    ivec2 first = ivec2(floor(corner));
    vec2 share = corner - floor(corner);
    ivec2 nearest = ivec2(greaterThanEqual(share, vec2(0.5)));
    // The nearest of the texels that are filtered, or the one of most weight that shows something.
    ivec2 chosen = first;
    uvec4 found = uvec4(none);
    float best = -1.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 offset = ivec2(i & 1, i >> 1);
        ivec2 texel = clamp(first + offset, ivec2(0), last);
        uvec4 candidate = texelFetch(points, texel, 0);
        vec2 weights = mix(1.0 - share, share, vec2(offset));
        float weight = offset == nearest ? 2.0 : weights.x * weights.y;
        if (candidate.w != none && weight > best) {
            best = weight;
            found = candidate;
            chosen = texel;
        }
    }
    if (found.w == none) { discard; }
    float half_diagonal = 0.5 * max(length(to_pixels[0] + to_pixels[1]),
                                    length(to_pixels[0] - to_pixels[1]));
    float moved = length(to_pixels * (vec2(chosen) + 0.5 - at));
    // Errors of the image's own sampling are seen enlarged at most by the largest singular value.
    float squares = dot(to_pixels[0], to_pixels[0]) + dot(to_pixels[1], to_pixels[1]);
    float area = determinant(to_pixels);
    float scale = sqrt(0.5 * (squares + sqrt(max(squares * squares - 4.0 * area * area, 0.0))));
    float nested = uintBitsToFloat(texelFetch(layers, chosen, 0).x);
    point = found;
    layer = uvec2(floatBitsToUint(max(half_diagonal, moved) / sqrt_half + nested * scale),
                  shown_node);
    stand();
}
)";

constexpr const char* kCopyVertexShader = R"(
void main() {
    // One triangle that covers the viewport.
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = vec4(4.0 * corner - 1.0, 0.5, 1.0);
}
)";

constexpr const char* kCopyFragmentShader = R"(
#if SEVERAL
layout(binding = 0) uniform sampler2DMS colors;
layout(binding = 1) uniform sampler2DMS depths;
#else
layout(binding = 0) uniform sampler2D colors;
layout(binding = 1) uniform sampler2D depths;
#endif
uniform ivec2 offset;
uniform vec2 lens;
uniform vec2 range;
uniform int samples;
layout(location = 0) out uint kept;
// Without samples, the last number is the level. A mask has depth and shows nothing.
float shown_depth(ivec2 texel, int part) {
    return texelFetch(colors, texel, part).a > 0.0 ? texelFetch(depths, texel, part).x : 0.0;
}
void main() {
    ivec2 texel = ivec2(gl_FragCoord.xy) + offset;
    // Depth is reversed: the greatest of the samples is the nearest, and 0 was never written.
    float nearest = 0.0;
#if SEVERAL
    for (int i = 0; i < samples; ++i) {
        nearest = max(nearest, shown_depth(texel, i));
    }
#else
    nearest = shown_depth(texel, 0);
#endif
    float share = 1.0;
    if (nearest > 0.0) {
        share = (lens.y / (nearest + lens.x) - range.x) / (range.y - range.x);
    }
    kept = uint(clamp(share, 0.0, 1.0) * 65535.0 + 0.5);
}
)";

constexpr const char* kVersion = "#version 450 core\n";

const char* text_of(QuadOutput output) noexcept {
    switch (output) {
    case QuadOutput::colors:
        return kColorShader;
    case QuadOutput::depths:
        return kDepthShader;
    case QuadOutput::points:
        return kPointShader;
    }
    return "";
}

const char* name_of(QuadOutput output) noexcept {
    switch (output) {
    case QuadOutput::colors:
        return "image quads";
    case QuadOutput::depths:
        return "depths of image quads";
    case QuadOutput::points:
        return "positions of image quads";
    }
    return "";
}

/// Depths of the matrix `projection_matrix`: a surface at the distance d has y / d - x.
std::array<GLfloat, 2> depth_terms(const Lens& lens) noexcept {
    const glm::mat4 projection = projection_matrix(lens);
    return {projection[2][2], projection[3][2]};
}

} // namespace

QuadPrograms::~QuadPrograms() {
    for (const Program& program : programs_) {
        glDeleteProgram(program.name);
    }
}

Result<void> QuadPrograms::require(QuadOutput output, QuadDepth depth) {
    Program& program = programs_[place(output, depth)];
    if (program.name != 0) {
        return {};
    }
    const std::string head = std::string(kVersion) + kNames + "#define DEPTH " +
                             std::to_string(static_cast<unsigned>(depth)) + "\n";
    const Result<GLuint> linked = link_program(
        name_of(output), head + kVertexShader, head + kFragmentInputs + text_of(output)
    );
    if (!linked) {
        return tl::unexpected(linked.error());
    }
    program.name = *linked;
    program.projection = glGetUniformLocation(*linked, "projection");
    program.texel_size = glGetUniformLocation(*linked, "texel_size");
    return {};
}

DepthCopyProgram::~DepthCopyProgram() {
    for (const Program& program : programs_) {
        glDeleteProgram(program.name);
    }
}

Result<void> DepthCopyProgram::require(std::int32_t samples) {
    const bool several = samples > 1;
    Program& program = programs_[several ? 1 : 0];
    if (program.name != 0) {
        return {};
    }
    const std::string head = std::string(kVersion) + "#define SEVERAL " + (several ? "1" : "0");
    const Result<GLuint> linked = link_program(
        "kept depths", kVersion + std::string(kCopyVertexShader), head + kCopyFragmentShader
    );
    if (!linked) {
        return tl::unexpected(linked.error());
    }
    program.name = *linked;
    program.offset = glGetUniformLocation(*linked, "offset");
    program.lens = glGetUniformLocation(*linked, "lens");
    program.range = glGetUniformLocation(*linked, "range");
    program.samples = glGetUniformLocation(*linked, "samples");
    return {};
}

void DepthCopyProgram::draw(const Copy& copy) const noexcept {
    const Program& program = programs_[copy.samples > 1 ? 1 : 0];
    const std::array<GLfloat, 2> lens = depth_terms(copy.lens);
    glUseProgram(program.name);
    glUniform2i(program.offset, copy.offset[0], copy.offset[1]);
    glUniform2f(program.lens, lens[0], lens[1]);
    glUniform2f(program.range, copy.nearest, copy.farthest);
    glUniform1i(program.samples, copy.samples);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

} // namespace farfield::opengl
