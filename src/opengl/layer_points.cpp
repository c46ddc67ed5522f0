#include "opengl/layer_points.hpp"

#include "opengl/cell_drawer.hpp"
#include "opengl/program.hpp"
#include <farfield/image/layered_warp.hpp>
#include <farfield/math/view.hpp>

#include <glm/ext/matrix_float4x4.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

namespace farfield::opengl {

namespace {

// Uniforms of all programs.
constexpr GLint kColumns = 0;
constexpr GLint kTerms = 1;
constexpr GLint kDepths = 2;
constexpr GLint kWindow = 3;
constexpr GLint kLargest = 4;
constexpr GLint kTilesAcross = 5;
constexpr GLint kNode = 6;                     // of those that write positions
constexpr GLint kPointsKnown = 7;              // likewise
constexpr GLint kSampleCount = 8;              // of those of several samples
constexpr GLint kPlaces = 9;                   // likewise
static_assert(CellDrawer::kMostSamples == 32); // as in the shader

// A point larger than the device has is drawn as tiles of its largest, one for each instance.
constexpr const char* kVertexShader = R"(
layout(location = 0) in vec4 place; // x, y, depth and extent as they are
layout(location = 1) in vec4 color;
layout(location = 0) uniform mat4x3 columns;
layout(location = 1) uniform vec3 terms;  // step and far end of inverse depths, size
layout(location = 2) uniform vec4 depths; // near and far distance; of the depth buffer
layout(location = 3) uniform ivec4 window;
layout(location = 4) uniform int largest;
layout(location = 5) uniform int tiles_across;
layout(location = 0) flat out vec4 shown;
#if SAMPLED
layout(location = 1) flat out vec4 square;
#else
layout(location = 1) flat out ivec4 box;
#endif
#if POSITIONS
layout(location = 2) in uvec4 point;
layout(location = 6) uniform uint node;
layout(location = 7) uniform bool points_known;
layout(location = 2) flat out uvec4 shown_point;
layout(location = 3) flat out uvec2 shown_layer;
const uint none = 0xFFFFFFFFu;
#endif
void main() {
    precise vec3 seen = columns[0] * place.x + columns[1] * place.y + columns[2] * place.z +
                        columns[3];
    precise float z = seen.z / (terms.x * place.z + terms.y);
    precise float side = place.w * terms.z / seen.z;
    precise vec2 middle = seen.xy / seen.z;
    precise vec2 low = middle - 0.5 * side;
    precise vec2 high = middle + 0.5 * side;
    vec2 most = vec2(window.zw);
#if SAMPLED
    // Pixels that it reaches into.
    ivec2 first = ivec2(floor(clamp(low, vec2(0.0), most)));
    ivec2 last = ivec2(ceil(clamp(high, vec2(0.0), most)));
    square = vec4(low, high) + vec4(window.xyxy);
#else
    // Pixels whose centres are inside.
    ivec2 first = ivec2(clamp(ceil(low - 0.5), vec2(0.0), most));
    ivec2 last = ivec2(clamp(ceil(high - 0.5), vec2(0.0), most));
#endif
    first += largest * ivec2(gl_InstanceID % tiles_across, gl_InstanceID / tiles_across);
    last = min(last, first + largest);
    ivec2 pixels = last - first;
    bool drawn = z >= depths.x && z <= depths.y && pixels.x > 0 && pixels.y > 0;
    int size = max(max(pixels.x, pixels.y), 1);
    gl_PointSize = float(size);
    // What a point is longer than its pixels is on both sides of them, so that its centre is among
    // them: where that is out of view there is no point.
    vec2 center = vec2(first - (size - pixels) / 2) + 0.5 * float(size);
    float depth = clamp(depths.w / z - depths.z, 0.0, 1.0);
    gl_Position = drawn ? vec4(clamp(2.0 * center / most - 1.0, -1.0, 1.0), depth, 1.0)
                        : vec4(2.0, 2.0, 2.0, 1.0);
    shown = color;
#if !SAMPLED
    box = ivec4(first, last) + window.xyxy;
#endif
#if POSITIONS
    shown_point = points_known ? point : uvec4(0u, 0u, 0u, none);
    shown_layer = points_known ? uvec2(floatBitsToUint(side), node) : uvec2(0u, none);
#endif
}
)";

constexpr const char* kFragmentShader = R"(
layout(location = 0) flat in vec4 shown;
#if SAMPLED
layout(location = 1) flat in vec4 square;
layout(location = 8) uniform int sample_count;
layout(location = 9) uniform vec2 places[32];
#else
layout(location = 1) flat in ivec4 box;
#endif
layout(location = 0) out vec4 result;
#if POSITIONS
layout(location = 2) flat in uvec4 shown_point;
layout(location = 3) flat in uvec2 shown_layer;
layout(location = 1) out uvec4 point;
layout(location = 2) out uvec2 layer;
#endif
void main() {
#if SAMPLED
    vec2 corner = floor(gl_FragCoord.xy);
    int mask = 0;
    for (int i = 0; i < sample_count; ++i) {
        vec2 at = corner + places[i];
        bool inside = all(lessThanEqual(square.xy, at)) && all(lessThan(at, square.zw));
        mask |= inside ? 1 << i : 0;
    }
    gl_SampleMask[0] = mask;
#else
    ivec2 at = ivec2(gl_FragCoord.xy);
    if (any(lessThan(at, box.xy)) || any(greaterThanEqual(at, box.zw))) { discard; }
#endif
    result = shown;
#if POSITIONS
    point = shown_point;
    layer = shown_layer;
#endif
}
)";

/// Largest side of a square before the near plane. [px] Infinite: it may be any.
double
largest_side(const LayeredTerms& terms, const View& made_by, const LayerPoints::Buffers& of) {
    // W is linear, so that it is least in a corner of all places and depths that there are; and
    // what is drawn is not before the near plane.
    const auto right = static_cast<double>(made_by.width) * kLayeredSteps;
    const auto top = static_cast<double>(made_by.height) * kLayeredSteps;
    double least = std::numeric_limits<double>::infinity();
    for (const double x : {0.0, right}) {
        for (const double y : {0.0, top}) {
            for (const double depth : {0.0, static_cast<double>(of.nearest)}) {
                const double w = static_cast<double>(terms.columns[0].z) * x +
                                 static_cast<double>(terms.columns[1].z) * y +
                                 static_cast<double>(terms.columns[2].z) * depth +
                                 static_cast<double>(terms.columns[3].z);
                least = std::min(least, w);
            }
        }
    }
    const double before_near =
        static_cast<double>(terms.near_distance) * static_cast<double>(terms.inverse_far);
    return static_cast<double>(of.most_extent) * static_cast<double>(terms.size) /
           std::max(least, before_near);
}

} // namespace

std::string layer_head(LayerOutput output) {
    const auto defined = [](const char* name, bool value) {
        return std::string("#define ") + name + (value ? " 1\n" : " 0\n");
    };
    return "#version 450 core\n" + defined("SAMPLED", output == LayerOutput::sampled_colors) +
           defined("POSITIONS", output == LayerOutput::positions);
}

LayerPoints::~LayerPoints() {
    for (const GLuint program : programs_) {
        glDeleteProgram(program);
    }
}

Result<void> LayerPoints::require(LayerOutput output) {
    GLuint& program = programs_[static_cast<std::size_t>(output)];
    if (program != 0) {
        return {};
    }
    const Result<GLuint> linked = link_program(
        "layered images", layer_head(output) + kVertexShader, layer_head(output) + kFragmentShader
    );
    if (!linked) {
        return tl::unexpected(linked.error());
    }
    program = *linked;
    std::array<GLfloat, 2> sizes{};
    glGetFloatv(GL_POINT_SIZE_RANGE, sizes.data());
    largest_ = std::max(static_cast<std::int32_t>(sizes[1]), 1);
    return {};
}

Result<LayerPoints::Buffers> LayerPoints::upload(const LayeredDepthImage& image, bool positions) {
    Buffers buffers;
    buffers.count = static_cast<GLsizei>(image.samples.size());
    for (const LayeredSample& sample : image.samples) {
        buffers.most_extent = std::max(buffers.most_extent, sample.extent);
        buffers.nearest = std::max(buffers.nearest, sample.depth);
    }
    if (image.samples.empty()) {
        return buffers;
    }
    const auto make = [](const auto& values) {
        GLuint buffer = 0;
        glCreateBuffers(1, &buffer);
        glNamedBufferStorage(
            buffer, static_cast<GLsizeiptr>(values.size() * sizeof(values[0])), values.data(), 0
        );
        return buffer;
    };
    constexpr GLuint kPlace = 0;
    constexpr GLuint kColor = 1;
    constexpr GLuint kPoint = 2;
    static_assert(offsetof(LayeredSample, x) == 0 && offsetof(LayeredSample, y) == 2);
    static_assert(offsetof(LayeredSample, depth) == 4 && offsetof(LayeredSample, extent) == 6);
    glCreateVertexArrays(1, &buffers.array);
    buffers.samples = make(image.samples);
    glVertexArrayVertexBuffer(buffers.array, 0, buffers.samples, 0, sizeof(LayeredSample));
    glVertexArrayAttribFormat(buffers.array, kPlace, 4, GL_UNSIGNED_SHORT, GL_FALSE, 0);
    glVertexArrayAttribFormat(
        buffers.array,
        kColor,
        4,
        GL_UNSIGNED_BYTE,
        GL_TRUE,
        static_cast<GLuint>(offsetof(LayeredSample, color))
    );
    for (const GLuint attribute : {kPlace, kColor}) {
        glEnableVertexArrayAttrib(buffers.array, attribute);
        glVertexArrayAttribBinding(buffers.array, attribute, 0);
    }
    if (positions && !image.points.empty()) {
        static_assert(offsetof(PositionTexel, point) == 0 && offsetof(PositionTexel, item) == 12);
        buffers.points = make(image.points);
        glVertexArrayVertexBuffer(buffers.array, 1, buffers.points, 0, sizeof(PositionTexel));
        glVertexArrayAttribIFormat(buffers.array, kPoint, 4, GL_UNSIGNED_INT, 0);
        glEnableVertexArrayAttrib(buffers.array, kPoint);
        glVertexArrayAttribBinding(buffers.array, kPoint, 1);
    }
    const GLenum error = glGetError();
    if (error != GL_NO_ERROR) {
        destroy(buffers);
        return fail(
            error == GL_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::device,
            "OpenGL: cannot make buffers of " + std::to_string(image.samples.size()) +
                " samples of a layered image"
        );
    }
    return buffers;
}

void LayerPoints::destroy(Buffers& buffers) noexcept {
    glDeleteVertexArrays(1, &buffers.array);
    glDeleteBuffers(1, &buffers.samples);
    glDeleteBuffers(1, &buffers.points);
    buffers = {};
}

void LayerPoints::draw(
    const LayeredDepthImage& image,
    const Buffers& buffers,
    std::uint32_t node,
    const Pass& pass,
    std::span<const glm::dvec2> places,
    LayerOutput output
) const noexcept {
    if (buffers.count == 0) {
        return;
    }
    const LayeredTerms terms = layered_terms(image, pass.view);
    const glm::mat4 projection = projection_matrix(pass.view.lens);
    const Region& window = pass.viewport;
    // A square may reach into so many pixels at most.
    const double across = std::min(
        largest_side(terms, image.view, buffers) + 2.0,
        static_cast<double>(std::max(window.width, window.height))
    );
    const auto tiles = static_cast<GLint>(std::ceil(across / static_cast<double>(largest_)));
    glUseProgram(programs_[static_cast<std::size_t>(output)]);
    glUniformMatrix4x3fv(kColumns, 1, GL_FALSE, &terms.columns[0][0]);
    glUniform3f(kTerms, terms.inverse_step, terms.inverse_far, terms.size);
    glUniform4f(
        kDepths, terms.near_distance, terms.far_distance, projection[2][2], projection[3][2]
    );
    glUniform4i(kWindow, window.x, window.y, window.width, window.height);
    glUniform1i(kLargest, largest_);
    glUniform1i(kTilesAcross, tiles);
    if (output == LayerOutput::positions) {
        glUniform1ui(kNode, node);
        glUniform1i(kPointsKnown, buffers.points != 0 ? 1 : 0);
    }
    if (output == LayerOutput::sampled_colors) {
        std::array<glm::vec2, CellDrawer::kMostSamples> within{};
        std::transform(places.begin(), places.end(), within.begin(), [](const glm::dvec2& place) {
            return glm::vec2(place);
        });
        const auto count = static_cast<GLsizei>(places.size());
        glUniform1i(kSampleCount, count);
        glUniform2fv(kPlaces, count, &within[0].x);
    }
    glBindVertexArray(buffers.array);
    glEnable(GL_PROGRAM_POINT_SIZE);
    glDrawArraysInstanced(GL_POINTS, 0, buffers.count, tiles * tiles);
    glDisable(GL_PROGRAM_POINT_SIZE);
}

} // namespace farfield::opengl
