#include "opengl/cell_drawer.hpp"

#include "opengl/program.hpp"
#include <farfield/gpu/cell_shapes.hpp>
#include <farfield/math/view.hpp>

#include <glm/ext/matrix_float4x4.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cstddef>
#include <string>

namespace farfield::opengl {

namespace {

/// Up to so many pixels of a splat are points each. Beyond, its inner pixels are a quad: a device
/// may take thousands of points, but not a frame full of them for each splat before the eye.
constexpr std::int32_t kMostPoints = 4;
constexpr std::uint32_t kAllSamples = UINT32_MAX;

constexpr const char* kVersion = "#version 450 core\n";

constexpr const char* kVertexShader = R"(
layout(location = 0) in vec4 position;
layout(location = 1) in vec4 color;
layout(location = 2) in uint samples;
layout(location = 0) flat out vec4 shown;
layout(location = 1) flat out uint covered;
void main() {
    gl_Position = position;
    shown = color;
    covered = samples;
}
)";

constexpr const char* kColorShader = R"(
layout(location = 0) flat in vec4 shown;
layout(location = 0) out vec4 result;
void main() {
    result = shown;
}
)";

constexpr const char* kSampledColorShader = R"(
layout(location = 0) flat in vec4 shown;
layout(location = 1) flat in uint covered;
layout(location = 0) out vec4 result;
void main() {
    result = shown;
    gl_SampleMask[0] = int(covered);
}
)";

constexpr const char* kPointShader = R"(
layout(location = 0) flat in vec4 shown;
layout(location = 1) out uvec4 point;
layout(location = 2) out uvec2 layer;
const uint none = 0xFFFFFFFFu;
void main() {
    if (shown.a < 0.5) { discard; }
    point = uvec4(0u, 0u, 0u, none);
    layer = uvec2(0u, none);
}
)";

constexpr std::array<const char*, 3> kFragmentShaders = {
    kColorShader, kSampledColorShader, kPointShader};

/// Reverse-z depth of a distance along the view direction.
class DepthOf {
  public:
    explicit DepthOf(const Lens& lens) noexcept {
        const double depth = lens.far_distance - lens.near_distance;
        scale_ = lens.near_distance * (lens.far_distance / depth);
        offset_ = lens.near_distance / depth;
    }
    [[nodiscard]] float operator()(double distance) const noexcept {
        return static_cast<float>(std::clamp(scale_ / distance - offset_, 0.0, 1.0));
    }

  private:
    double scale_ = 0.0;
    double offset_ = 0.0;
};

/// The viewport of a pass in clip space.
class ClipPlaces {
  public:
    explicit ClipPlaces(const Region& viewport) noexcept
        : corner_(viewport.x, viewport.y),
          scale_(2.0 / glm::dvec2(viewport.width, viewport.height)) {}
    /// @param place [px] of the target
    [[nodiscard]] glm::vec4 operator()(const glm::dvec2& place, float depth) const noexcept {
        const glm::dvec2 at = (place - corner_) * scale_ - 1.0;
        return {static_cast<float>(at.x), static_cast<float>(at.y), depth, 1.0F};
    }

  private:
    glm::dvec2 corner_;
    glm::dvec2 scale_;
};

} // namespace

std::vector<std::uint32_t> quad_indices(std::size_t quads) {
    std::vector<std::uint32_t> indices;
    indices.reserve(quads * 6);
    for (std::size_t quad = 0; quad < quads; ++quad) {
        const auto first = static_cast<std::uint32_t>(quad * 4);
        for (const std::uint32_t corner : {0U, 1U, 2U, 2U, 1U, 3U}) {
            indices.push_back(first + corner);
        }
    }
    return indices;
}

CellDrawer::~CellDrawer() {
    for (const GLuint program : programs_) {
        glDeleteProgram(program);
    }
    glDeleteVertexArrays(1, &array_);
    glDeleteBuffers(1, &vertex_buffer_);
    glDeleteBuffers(1, &index_buffer_);
}

Result<void> CellDrawer::require(CellOutput output) {
    const auto index = static_cast<std::size_t>(output);
    if (programs_[index] != 0) {
        return {};
    }
    const Result<GLuint> linked = link_program(
        "splats and cubes",
        std::string(kVersion) + kVertexShader,
        std::string(kVersion) + kFragmentShaders[index]
    );
    if (!linked) {
        return tl::unexpected(linked.error());
    }
    programs_[index] = *linked;
    if (array_ == 0) {
        make_array();
    }
    return {};
}

void CellDrawer::make_array() noexcept {
    glCreateVertexArrays(1, &array_);
    constexpr GLuint kPosition = 0;
    constexpr GLuint kColor = 1;
    constexpr GLuint kSamples = 2;
    glVertexArrayAttribFormat(
        array_, kPosition, 4, GL_FLOAT, GL_FALSE, static_cast<GLuint>(offsetof(Vertex, position))
    );
    glVertexArrayAttribFormat(
        array_, kColor, 4, GL_UNSIGNED_BYTE, GL_TRUE, static_cast<GLuint>(offsetof(Vertex, color))
    );
    glVertexArrayAttribIFormat(
        array_, kSamples, 1, GL_UNSIGNED_INT, static_cast<GLuint>(offsetof(Vertex, samples))
    );
    for (const GLuint attribute : {kPosition, kColor, kSamples}) {
        glEnableVertexArrayAttrib(array_, attribute);
        glVertexArrayAttribBinding(array_, attribute, 0);
    }
}

void CellDrawer::clear() noexcept {
    vertices_.clear();
    runs_.clear();
    added_.clear();
}

void CellDrawer::begin_command() {
    added_.push_back({runs_.size(), 0});
}

/// Takes vertices that were added into the last run, or a new one.
void CellDrawer::grow_run(bool quads, std::uint32_t vertices) {
    Added& command = added_.back();
    if (command.run_count == 0 || runs_.back().quads != quads) {
        runs_.push_back({quads, static_cast<std::uint32_t>(vertices_.size()) - vertices, 0});
        ++command.run_count;
    }
    runs_.back().count += vertices;
}

void CellDrawer::add_splats(
    const FramePlan& plan,
    const Pass& pass,
    const Command& command,
    std::span<const glm::dvec2> places
) {
    begin_command();
    const gpu::SplatView view(pass, plan.origin);
    const DepthOf depth_of(pass.view.lens);
    const ClipPlaces clip_place(pass.viewport);
    const bool sampled = places.size() > 1;
    gpu::SplatSquare square;
    const auto add_point =
        [&](std::int32_t x, std::int32_t y, std::uint32_t samples, const Splat& splat) {
            const glm::dvec2 center(x + 0.5, y + 0.5);
            vertices_.push_back({clip_place(center, depth_of(square.depth)), splat.color, samples});
            grow_run(false, 1);
        };
    const auto add_quad = [&](const Region& pixels, const Splat& splat) {
        const float depth = depth_of(square.depth);
        for (const int corner : {0, 1, 2, 3}) {
            const glm::dvec2 place(
                pixels.x + (corner % 2 == 0 ? 0 : pixels.width),
                pixels.y + (corner / 2 == 0 ? 0 : pixels.height)
            );
            vertices_.push_back({clip_place(place, depth), splat.color, kAllSamples});
        }
        grow_run(true, 4);
    };
    const auto mask_of = [&](std::int32_t x, std::int32_t y) {
        std::uint32_t mask = 0;
        for (std::size_t sample = 0; sample < places.size(); ++sample) {
            const bool covered = square.covers(glm::dvec2(x, y) + places[sample]);
            mask |= (covered ? 1U : 0U) << sample;
        }
        return mask;
    };
    for (const Splat& splat : std::span(plan.splats).subspan(command.first, command.count)) {
        if (splat.color.a == 0 || !view.place(splat, square)) {
            continue;
        }
        const Region pixels = sampled ? view.touched(square) : view.covered(square, places[0]);
        if (pixels.width <= 0 || pixels.height <= 0) {
            continue;
        }
        // All samples of these pixels are inside.
        Region inner = pixels;
        if (sampled) {
            inner = view.covered(square, {0.0, 0.0});
            const Region upper = view.covered(square, {1.0, 1.0});
            inner.width = std::max(upper.x + upper.width - inner.x, 0);
            inner.height = std::max(upper.y + upper.height - inner.y, 0);
        }
        if (std::int64_t{inner.width} * inner.height > kMostPoints) {
            add_quad(inner, splat);
        } else {
            inner.width = 0;
        }
        for (std::int32_t y = pixels.y; y < pixels.y + pixels.height; ++y) {
            const bool row_has_inner =
                inner.width > 0 && y >= inner.y && y < inner.y + inner.height;
            for (std::int32_t x = pixels.x; x < pixels.x + pixels.width; ++x) {
                if (row_has_inner && x == inner.x) {
                    x += inner.width - 1;
                    continue;
                }
                const std::uint32_t samples = sampled ? mask_of(x, y) : kAllSamples;
                if (samples != 0) {
                    add_point(x, y, samples, splat);
                }
            }
        }
    }
}

void CellDrawer::add_cubes(const FramePlan& plan, const Pass& pass, const Command& command) {
    begin_command();
    const glm::dvec3 eye = pass.view.eye - plan.origin;
    const glm::dmat3 world_to_camera = glm::transpose(pass.view.camera_to_world);
    const glm::mat4 projection = projection_matrix(pass.view.lens);
    for (const ShownCube& cube : std::span(plan.cubes).subspan(command.first, command.count)) {
        const gpu::SeenFaces seen = gpu::seen_faces(cube, plan.cube_frames[cube.frame], eye);
        for (std::size_t i = 0; i < seen.count; ++i) {
            const gpu::CubeFace& face = seen.faces[i];
            const glm::vec3 origin(world_to_camera * face.origin);
            const glm::vec3 u(world_to_camera * face.edge_u);
            const glm::vec3 v(world_to_camera * face.edge_v);
            for (const glm::vec3& corner : {origin, origin + u, origin + v, origin + u + v}) {
                vertices_.push_back({projection * glm::vec4(corner, 1.0F), face.color, kAllSamples}
                );
            }
            grow_run(true, 4);
        }
    }
}

void CellDrawer::reserve(std::size_t vertex_count, std::size_t quad_count) {
    if (vertex_count > vertex_capacity_) {
        vertex_capacity_ = std::max(vertex_count, vertex_capacity_ * 2);
        glDeleteBuffers(1, &vertex_buffer_);
        glCreateBuffers(1, &vertex_buffer_);
        glNamedBufferStorage(
            vertex_buffer_,
            static_cast<GLsizeiptr>(vertex_capacity_ * sizeof(Vertex)),
            nullptr,
            GL_DYNAMIC_STORAGE_BIT
        );
        glVertexArrayVertexBuffer(array_, 0, vertex_buffer_, 0, sizeof(Vertex));
    }
    if (quad_count > quad_capacity_) {
        quad_capacity_ = std::max(quad_count, quad_capacity_ * 2);
        const std::vector<std::uint32_t> indices = quad_indices(quad_capacity_);
        glDeleteBuffers(1, &index_buffer_);
        glCreateBuffers(1, &index_buffer_);
        glNamedBufferStorage(
            index_buffer_,
            static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)),
            indices.data(),
            0
        );
        glVertexArrayElementBuffer(array_, index_buffer_);
    }
}

void CellDrawer::upload() {
    if (vertices_.empty()) {
        return;
    }
    std::uint32_t most_quads = 0;
    for (const Run& run : runs_) {
        most_quads = std::max(most_quads, run.quads ? run.count / 4 : 0U);
    }
    reserve(vertices_.size(), most_quads);
    glInvalidateBufferData(vertex_buffer_);
    glNamedBufferSubData(
        vertex_buffer_,
        0,
        static_cast<GLsizeiptr>(vertices_.size() * sizeof(Vertex)),
        vertices_.data()
    );
}

void CellDrawer::draw(std::size_t index, CellOutput output) const noexcept {
    const Added& command = added_[index];
    if (command.run_count == 0) {
        return;
    }
    glUseProgram(programs_[static_cast<std::size_t>(output)]);
    glBindVertexArray(array_);
    for (std::size_t i = 0; i < command.run_count; ++i) {
        const Run& run = runs_[command.first_run + i];
        if (run.quads) {
            glDrawElementsBaseVertex(
                GL_TRIANGLES,
                static_cast<GLsizei>(run.count / 4 * 6),
                GL_UNSIGNED_INT,
                buffer_offset(0),
                static_cast<GLint>(run.first)
            );
        } else {
            glDrawArrays(GL_POINTS, static_cast<GLint>(run.first), static_cast<GLsizei>(run.count));
        }
    }
}

} // namespace farfield::opengl
