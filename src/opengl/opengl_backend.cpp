#include "opengl/cell_drawer.hpp"
#include "opengl/layer_drawer.hpp"
#include "opengl/program.hpp"
#include "opengl/projection_shaders.hpp"
#include "opengl/quad_programs.hpp"
#include "opengl/state_guard.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/gpu/plan_rules.hpp>
#include <farfield/opengl/opengl_backend.hpp>

#include <epoxy/gl.h>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace farfield::opengl {

namespace {

// An image quad has four corners; positions are relative to the eye in camera axes.
struct QuadVertex {
    glm::vec3 position;
    glm::vec2 texel;
    glm::vec2 depths; // as `QuadPrograms` says
    std::uint32_t node = 0;
};
static_assert(sizeof(QuadVertex) == 32);

/// What positions keep beside the colours of a page or target: points with items, layers with
/// nodes.
struct PositionBuffers {
    GLuint points = 0;
    GLuint layers = 0;
};
constexpr GLenum kPointFormat = GL_RGBA32UI;
constexpr GLenum kLayerFormat = GL_RG32UI;
constexpr std::uint64_t kPositionTexelBytes = 24;
// Plans may ask for so many samples; there is one.
constexpr std::int32_t kPositionSamples = 64;
constexpr std::array<GLuint, 4> kNoPoint = {0, 0, 0, UINT32_MAX};
constexpr std::array<GLuint, 4> kNoLayer = {0, UINT32_MAX, 0, 0};
constexpr std::array<GLenum, 3> kDrawBuffers = {
    GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};

/// For what is fetched and never filtered.
GLuint make_plain_texture(GLenum format, std::int32_t size) {
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, 1, format, size, size);
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return texture;
}

GLuint make_sampled_texture(GLenum format, std::int32_t size, std::int32_t samples) {
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_2D_MULTISAMPLE, 1, &texture);
    glTextureStorage2DMultisample(texture, samples, format, size, size, GL_TRUE);
    return texture;
}

/// A framebuffer of one texture.
GLuint make_framebuffer(GLuint texture) {
    GLuint framebuffer = 0;
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, texture, 0);
    return framebuffer;
}

bool is_complete(GLuint framebuffer) {
    return glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

// All buffers of a page are textures: what keeps depths is made from those of a scratch page.
struct Page : gpu::PageFacts {
    std::uint32_t cache = 0;
    PageId id = kNone<PageId>;
    GLuint color = 0;
    GLuint depth_texture = 0;     // of a scratch page, or of a page that keeps depth
    GLuint framebuffer = 0;       // of a scratch page
    GLuint copy_framebuffer = 0;  // of a page: resolves go to it
    GLuint depth_framebuffer = 0; // of a page that keeps depth: drawn to by `DepthCopyProgram`
    PositionBuffers positions;
    std::int32_t samples = 1;
};
constexpr GLenum kKeptDepthFormat = GL_R16UI;

/// Quads of one command that follow each other and show one page: one draw.
struct QuadRun {
    GLuint texture = 0;
    GLuint depth_texture = 0;
    PositionBuffers positions;
    GLfloat texel_size = 0.0F; // of the page, in texture coordinates
    std::uint32_t first = 0;   // into the vertices, in quads
    std::uint32_t count = 0;
};

struct Target {
    GLuint framebuffer = 0;
    GLuint color = 0; // renderbuffers; 0 for a framebuffer of the caller's
    GLuint depth = 0;
    PositionBuffers positions; // renderbuffers
    std::int32_t width = 0;
    std::int32_t height = 0;
    std::int32_t samples = 1;
    bool alive = false;
    bool owned = false;
};

tl::unexpected<Error> no_target(TargetId target) {
    return fail(
        ErrorCode::invalid_argument,
        "OpenGL: target " + std::to_string(index_of(target)) + " does not exist"
    );
}

/// Which buffers are written: colours, and what positions keep beside them.
void set_masks(bool color, bool positions) noexcept {
    for (GLuint buffer = 0; buffer < StateGuard::kBuffers; ++buffer) {
        const GLboolean on = (buffer == 0 ? color : positions) ? GL_TRUE : GL_FALSE;
        glColorMaski(buffer, on, on, on, on);
    }
}

/// Samples of a page: all of its buffers are textures.
std::int32_t most_samples() noexcept {
    GLint most = INT32_MAX;
    for (const GLenum limit :
         {GL_MAX_SAMPLES, GL_MAX_COLOR_TEXTURE_SAMPLES, GL_MAX_DEPTH_TEXTURE_SAMPLES}) {
        GLint samples = 1;
        glGetIntegerv(limit, &samples);
        most = std::min(most, samples);
    }
    return std::clamp(most, 1, CellDrawer::kMostSamples);
}

static_assert(kUnitsWithKeyframes <= StateGuard::kMostUnits);

/// The colours of a framebuffer with several samples. Drivers may resolve by drawing, so that what
/// has nothing to do with copying, such as a discarding rasteriser, leaves nothing of them.
void resolve(GLuint from, GLuint to, std::int32_t width, std::int32_t height) noexcept {
    const StateGuard guard(StateGuard::kUnits);
    const Region whole{0, 0, width, height};
    set_drawing_state(to, whole, whole);
    glBlitNamedFramebuffer(
        from, to, 0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST
    );
}

/// Reads a renderbuffer of 32-bit integers as large as the target, within a `ReadGuard`. It is
/// attached alone and rows are aligned to components: from the target's own framebuffer, by rows of
/// any alignment, NVIDIA's driver took 1.5 us a texel, a hundred times as long.
void read_integers(
    GLuint renderbuffer, const Target& target, GLenum format, void* texels
) noexcept {
    GLuint framebuffer = 0;
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferRenderbuffer(
        framebuffer, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, renderbuffer
    );
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glReadPixels(0, 0, target.width, target.height, format, GL_UNSIGNED_INT, texels);
    glDeleteFramebuffers(1, &framebuffer);
}

/// Errors of the caller's are not ours to report.
void drop_old_errors() noexcept {
    while (glGetError() != GL_NO_ERROR) {
    }
}

} // namespace

struct OpenGLBackend::Impl {
    GeometrySource* source = nullptr;
    QuadPrograms programs;
    DepthCopyProgram depth_copy;
    bool positions = false;
    GLuint quad_array = 0;
    GLuint quad_vertices = 0;
    GLuint quad_indices = 0;
    std::size_t quad_capacity = 0;
    std::vector<Page> pages;
    std::vector<Target> targets; // TargetId is the position plus one
    std::vector<QuadVertex> vertices;
    std::vector<QuadRun> runs; // of the plan being executed, in the order of its passes
    std::size_t next_run = 0;
    CellDrawer cells;
    std::size_t next_cells = 0; // command of those that draw cells
    LayerDrawer layers;
    std::vector<glm::dvec2> places;                         // of the samples of a pixel
    std::array<DeviceKeyframe, kMostKeyframes> keyframes{}; // of the command being drawn
    Limits limits;

    Impl(GeometrySource& geometry, const OpenGLBackendOptions& options)
        : source(&geometry), layers(options) {}
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() {
        for (Page& page : pages) {
            destroy(page);
        }
        for (std::size_t i = 0; i < targets.size(); ++i) {
            destroy_target(targets[i]);
        }
        glDeleteVertexArrays(1, &quad_array);
        glDeleteBuffers(1, &quad_vertices);
        glDeleteBuffers(1, &quad_indices);
    }

    [[nodiscard]] Page* find(std::uint32_t cache, PageId id) noexcept {
        for (Page& page : pages) {
            if (page.cache == cache && page.id == id) {
                return &page;
            }
        }
        return nullptr;
    }

    static void destroy(Page& page) noexcept;
    static void destroy_target(Target& target) noexcept;
    [[nodiscard]] Result<void> update_page(std::uint32_t cache, const PageUpdate& update);
    void reserve_quads(std::size_t count) noexcept;
    [[nodiscard]] Result<void> check_pages(const FramePlan& plan, const Target& frame) noexcept;
    [[nodiscard]] Result<void> upload_quads(const FramePlan& plan);
    [[nodiscard]] Result<void> upload_cells(const FramePlan& plan, const Target& frame);
    [[nodiscard]] Result<void> require_cells(bool sampled);
    void find_places(GLuint framebuffer, std::int32_t samples);
    [[nodiscard]] Result<void>
    add_quads(const FramePlan& plan, std::size_t pass, std::uint32_t command);
    [[nodiscard]] Result<void> require_programs(const Command& command);
    [[nodiscard]] Result<void> require_projections(const FramePlan& plan);
    [[nodiscard]] Result<void> require_layers(const FramePlan& plan, const Target& frame);
    void find_keyframes(const FramePlan& plan, const Command& command) noexcept;
    [[nodiscard]] Result<void> require_depth_copies(const FramePlan& plan);
    void clear_batch(
        const FramePlan& plan, std::size_t first, std::size_t last, const FrameClear& clear
    ) const noexcept;
    void run_pass(
        const FramePlan& plan, const Pass& pass, GLuint framebuffer, std::int32_t samples
    ) noexcept;
    void copy_batch(const FramePlan& plan, std::size_t first, std::size_t last) noexcept;
    void copy_depths(const FramePlan& plan, std::size_t first, std::size_t last) noexcept;
    [[nodiscard]] bool copies_depth(const FramePlan& plan, const Pass& pass) noexcept;
    void draw_quads(const Pass& pass, const Command& command) noexcept;
    void draw_cells(std::int32_t samples) noexcept;
    void draw_runs(
        const Pass& pass, const Command& command, std::size_t run, QuadOutput output
    ) noexcept;
    [[nodiscard]] const Target* target(TargetId id) const noexcept;
    [[nodiscard]] Result<void> keep_positions();
};

const Target* OpenGLBackend::Impl::target(TargetId id) const noexcept {
    const std::size_t index = index_of(id);
    const bool exists = index >= 1 && index <= targets.size() && targets[index - 1].alive;
    return exists ? &targets[index - 1] : nullptr;
}

void OpenGLBackend::Impl::destroy(Page& page) noexcept {
    glDeleteFramebuffers(1, &page.framebuffer);
    glDeleteFramebuffers(1, &page.copy_framebuffer);
    glDeleteFramebuffers(1, &page.depth_framebuffer);
    glDeleteTextures(1, &page.color);
    glDeleteTextures(1, &page.depth_texture);
    glDeleteTextures(1, &page.positions.points);
    glDeleteTextures(1, &page.positions.layers);
}

void OpenGLBackend::Impl::destroy_target(Target& target) noexcept {
    if (target.owned) {
        glDeleteFramebuffers(1, &target.framebuffer);
        glDeleteRenderbuffers(1, &target.color);
        glDeleteRenderbuffers(1, &target.depth);
        glDeleteRenderbuffers(1, &target.positions.points);
        glDeleteRenderbuffers(1, &target.positions.layers);
    }
    target = {};
}

Result<void> OpenGLBackend::Impl::update_page(std::uint32_t cache, const PageUpdate& update) {
    if (Page* old = find(cache, update.page)) {
        destroy(*old);
        *old = pages.back();
        pages.pop_back();
    }
    if (update.action == PageUpdate::Action::destroy) {
        return {};
    }
    if (Result<void> valid = gpu::check_page(update, limits.page_size, limits.samples); !valid) {
        return valid;
    }
    Page page;
    page.cache = cache;
    page.id = update.page;
    page.size = update.size;
    page.samples = positions ? 1 : update.samples;
    page.scratch = update.scratch;
    page.depth = update.depth;
    const bool sampled = page.samples > 1;
    if (sampled) {
        page.color = make_sampled_texture(GL_RGBA8, page.size, page.samples);
    } else {
        glCreateTextures(GL_TEXTURE_2D, 1, &page.color);
        glTextureStorage2D(page.color, 1, GL_RGBA8, page.size, page.size);
        glTextureParameteri(page.color, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        glTextureParameteri(page.color, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        glTextureParameteri(page.color, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTextureParameteri(page.color, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    if (positions) {
        page.positions = {
            make_plain_texture(kPointFormat, page.size),
            make_plain_texture(kLayerFormat, page.size)};
    }
    bool complete = true;
    if (page.scratch) {
        page.depth_texture =
            sampled ? make_sampled_texture(GL_DEPTH_COMPONENT32F, page.size, page.samples)
                    : make_plain_texture(GL_DEPTH_COMPONENT32F, page.size);
        page.framebuffer = make_framebuffer(page.color);
        glNamedFramebufferTexture(page.framebuffer, GL_DEPTH_ATTACHMENT, page.depth_texture, 0);
        if (positions) {
            glNamedFramebufferTexture(
                page.framebuffer, GL_COLOR_ATTACHMENT1, page.positions.points, 0
            );
            glNamedFramebufferTexture(
                page.framebuffer, GL_COLOR_ATTACHMENT2, page.positions.layers, 0
            );
            glNamedFramebufferDrawBuffers(
                page.framebuffer, static_cast<GLsizei>(kDrawBuffers.size()), kDrawBuffers.data()
            );
        }
        complete = is_complete(page.framebuffer);
    } else {
        page.copy_framebuffer = make_framebuffer(page.color);
        complete = is_complete(page.copy_framebuffer);
        if (page.depth) {
            page.depth_texture = make_plain_texture(kKeptDepthFormat, page.size);
            page.depth_framebuffer = make_framebuffer(page.depth_texture);
            complete = complete && is_complete(page.depth_framebuffer);
        }
    }
    const GLenum error = glGetError();
    if (error != GL_NO_ERROR || !complete) {
        destroy(page);
        return fail(
            error == GL_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::device,
            "OpenGL: cannot make an image page of " + std::to_string(page.size) + " x " +
                std::to_string(page.size) + " texels with " + std::to_string(page.samples) +
                " samples"
        );
    }
    pages.push_back(page);
    return {};
}

void OpenGLBackend::Impl::reserve_quads(std::size_t count) noexcept {
    if (count <= quad_capacity) {
        return;
    }
    quad_capacity = std::max(count, quad_capacity * 2);
    const std::vector<std::uint32_t> indices = opengl::quad_indices(quad_capacity);
    glDeleteBuffers(1, &quad_vertices);
    glDeleteBuffers(1, &quad_indices);
    glCreateBuffers(1, &quad_vertices);
    glCreateBuffers(1, &quad_indices);
    glNamedBufferStorage(
        quad_vertices,
        static_cast<GLsizeiptr>(quad_capacity * 4 * sizeof(QuadVertex)),
        nullptr,
        GL_DYNAMIC_STORAGE_BIT
    );
    glNamedBufferStorage(
        quad_indices,
        static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)),
        indices.data(),
        0
    );
    glVertexArrayVertexBuffer(quad_array, 0, quad_vertices, 0, sizeof(QuadVertex));
    glVertexArrayElementBuffer(quad_array, quad_indices);
}

Result<void> OpenGLBackend::Impl::check_pages(const FramePlan& plan, const Target& frame) noexcept {
    const Region whole{0, 0, frame.width, frame.height};
    for (std::size_t i = 0; i < plan.passes.size(); ++i) {
        const Pass& pass = plan.passes[i];
        if (Result<void> valid = gpu::check_places(
                plan, i, whole, find(plan.cache, pass.page), find(plan.cache, pass.copy_page)
            );
            !valid) {
            return valid;
        }
    }
    return {};
}

Result<void> OpenGLBackend::Impl::require_programs(const Command& command) {
    const bool shows = command.kind == Command::Kind::images;
    Result<void> made =
        programs.require(shows ? QuadOutput::colors : QuadOutput::depths, command.depth);
    if (made && shows && positions) {
        made = programs.require(QuadOutput::points, command.depth);
    }
    return made;
}

Result<void> OpenGLBackend::Impl::add_quads(
    const FramePlan& plan, std::size_t pass_index, std::uint32_t command_index
) {
    const Pass& pass = plan.passes[pass_index];
    const Command& command = plan.commands[command_index];
    if (Result<void> made = require_programs(command); !made) {
        return made;
    }
    // Differences first: the eye and the quads may both be far from the plan's origin.
    const glm::vec3 eye = local_point(pass.view.eye, plan.origin);
    const glm::mat3 world_to_camera(glm::transpose(pass.view.camera_to_world));
    PageId shown = kNone<PageId>;
    for (std::uint32_t q = command.first; q < command.first + command.count; ++q) {
        const ImageQuad& quad = plan.quads[q];
        if (q == command.first || quad.page != shown) {
            const Page* page = find(plan.cache, quad.page);
            if (Result<void> valid =
                    gpu::check_image_page(plan, pass_index, command_index, q, page);
                !valid) {
                return valid;
            }
            shown = quad.page;
            runs.push_back(
                {page->color,
                 page->depth_texture,
                 page->positions,
                 1.0F / static_cast<float>(page->size),
                 static_cast<std::uint32_t>(vertices.size() / 4),
                 0}
            );
        }
        ++runs.back().count;
        const glm::vec3 origin = world_to_camera * (quad.origin - eye);
        const glm::vec3 u = world_to_camera * quad.edge_u;
        const glm::vec3 v = world_to_camera * quad.edge_v;
        const auto x0 = static_cast<float>(quad.source.x);
        const auto y0 = static_cast<float>(quad.source.y);
        const float x1 = x0 + static_cast<float>(quad.source.width);
        const float y1 = y0 + static_cast<float>(quad.source.height);
        // What a texel stands for lies on its ray from the viewpoint, so distances along the view
        // direction are linear over the quad.
        const float viewpoint = command.depth == QuadDepth::texel
                                    ? -(world_to_camera * (quad.viewpoint - eye)).z
                                    : 0.0F;
        const auto add = [&](const glm::vec3& position, const glm::vec2& texel) {
            const float beyond = -position.z - viewpoint;
            const glm::vec2 depths =
                command.depth == QuadDepth::texel
                    ? viewpoint + beyond * glm::vec2(quad.near_ratio, quad.far_ratio)
                    : glm::vec2(quad.depth, 0.0F);
            vertices.push_back({position, texel, depths, quad.node});
        };
        add(origin, {x0, y0});
        add(origin + u, {x1, y0});
        add(origin + v, {x0, y1});
        add(origin + u + v, {x1, y1});
    }
    return {};
}

Result<void> OpenGLBackend::Impl::upload_quads(const FramePlan& plan) {
    vertices.clear();
    runs.clear();
    next_run = 0;
    for (std::size_t i = 0; i < plan.passes.size(); ++i) {
        const Pass& pass = plan.passes[i];
        for (std::uint32_t c = 0; c < pass.command_count; ++c) {
            if (!draws_images(plan.commands[pass.first_command + c])) {
                continue;
            }
            if (Result<void> added = add_quads(plan, i, pass.first_command + c); !added) {
                return added;
            }
        }
    }
    reserve_quads(vertices.size() / 4);
    if (!vertices.empty()) {
        glInvalidateBufferData(quad_vertices);
        glNamedBufferSubData(
            quad_vertices,
            0,
            static_cast<GLsizeiptr>(vertices.size() * sizeof(QuadVertex)),
            vertices.data()
        );
    }
    return {};
}

/// Asks the device where the samples of a pixel are. There may be more of them than were asked for,
/// and a framebuffer of the caller's may have others each time.
void OpenGLBackend::Impl::find_places(GLuint framebuffer, std::int32_t samples) {
    constexpr glm::dvec2 kCenter(0.5);
    places.assign(1, kCenter);
    if (samples == 1) {
        return;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    GLint made = samples;
    glGetIntegerv(GL_SAMPLES, &made);
    places.resize(static_cast<std::size_t>(std::clamp(made, 2, CellDrawer::kMostSamples)));
    for (std::size_t sample = 0; sample < places.size(); ++sample) {
        std::array<GLfloat, 2> place{};
        glGetMultisamplefv(GL_SAMPLE_POSITION, static_cast<GLuint>(sample), place.data());
        places[sample] = {place[0], place[1]};
    }
}

Result<void> OpenGLBackend::Impl::require_cells(bool sampled) {
    Result<void> made = cells.require(sampled ? CellOutput::sampled_colors : CellOutput::colors);
    if (made && positions) {
        made = cells.require(CellOutput::points);
    }
    return made;
}

Result<void> OpenGLBackend::Impl::upload_cells(const FramePlan& plan, const Target& frame) {
    cells.clear();
    next_cells = 0;
    for (const Pass& pass : plan.passes) {
        bool known = false;
        for (std::uint32_t c = 0; c < pass.command_count; ++c) {
            const Command& command = plan.commands[pass.first_command + c];
            if (!draws_cells(command)) {
                continue;
            }
            if (!known) {
                const Page* page = find(plan.cache, pass.page);
                const std::int32_t samples = page == nullptr ? frame.samples : page->samples;
                find_places(page == nullptr ? frame.framebuffer : page->framebuffer, samples);
                if (Result<void> made = require_cells(samples > 1); !made) {
                    return made;
                }
                known = true;
            }
            if (command.kind == Command::Kind::splats) {
                cells.add_splats(plan, pass, command, places);
            } else {
                cells.add_cubes(plan, pass, command);
            }
        }
    }
    cells.upload();
    return {};
}

void OpenGLBackend::Impl::draw_cells(std::int32_t samples) noexcept {
    const std::size_t index = next_cells++;
    glDepthFunc(GL_GEQUAL);
    glDepthMask(GL_FALSE);
    if (positions) {
        set_masks(true, false);
    }
    glEnablei(GL_BLEND, 0);
    cells.draw(index, samples > 1 ? CellOutput::sampled_colors : CellOutput::colors);
    glDisablei(GL_BLEND, 0);
    if (positions) {
        set_masks(false, true);
        cells.draw(index, CellOutput::points);
        set_masks(true, true);
    }
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
}

void OpenGLBackend::Impl::draw_quads(const Pass& pass, const Command& command) noexcept {
    const std::size_t first_run = next_run;
    glBindVertexArray(quad_array);
    glDepthFunc(GL_GEQUAL);
    if (command.depth == QuadDepth::plane) {
        glEnable(GL_DEPTH_CLAMP);
    }
    if (command.kind == Command::Kind::image_depths) {
        set_masks(false, false);
        draw_runs(pass, command, first_run, QuadOutput::depths);
        set_masks(true, true);
    } else {
        glDepthMask(GL_FALSE);
        if (positions) {
            set_masks(true, false);
        }
        glEnablei(GL_BLEND, 0);
        draw_runs(pass, command, first_run, QuadOutput::colors);
        // Geometry may follow, with its own depth.
        glDisablei(GL_BLEND, 0);
        if (positions) {
            set_masks(false, true);
            draw_runs(pass, command, first_run, QuadOutput::points);
            set_masks(true, true);
        }
        glDepthMask(GL_TRUE);
    }
    if (command.depth == QuadDepth::plane) {
        glDisable(GL_DEPTH_CLAMP);
    }
    glDepthFunc(GL_GREATER);
}

void OpenGLBackend::Impl::draw_runs(
    const Pass& pass, const Command& command, std::size_t run_index, QuadOutput output
) noexcept {
    const QuadPrograms::Program& program = programs.get(output, command.depth);
    glUseProgram(program.name);
    const glm::mat4 projection = projection_matrix(pass.view.lens);
    glUniformMatrix4fv(program.projection, 1, GL_FALSE, &projection[0][0]);
    for (std::uint32_t drawn = 0; drawn < command.count;) {
        const QuadRun& run = runs[run_index++];
        glBindTextureUnit(QuadPrograms::kColorUnit, run.texture);
        if (output == QuadOutput::points) {
            glBindTextureUnit(QuadPrograms::kPointUnit, run.positions.points);
            glBindTextureUnit(QuadPrograms::kLayerUnit, run.positions.layers);
        }
        if (command.depth == QuadDepth::texel) {
            glBindTextureUnit(QuadPrograms::kDepthUnit, run.depth_texture);
        }
        glUniform1f(program.texel_size, run.texel_size);
        glDrawElements(
            GL_TRIANGLES,
            static_cast<GLsizei>(run.count * 6),
            GL_UNSIGNED_INT,
            buffer_offset(std::size_t{run.first} * 6 * sizeof(std::uint32_t))
        );
        drawn += run.count;
    }
    next_run = run_index;
}

Result<void> OpenGLBackend::Impl::require_projections(const FramePlan& plan) {
    for (std::size_t i = 0; i < plan.passes.size(); ++i) {
        const Pass& pass = plan.passes[i];
        for (std::uint32_t c = 0; c < pass.command_count; ++c) {
            const std::uint32_t index = pass.first_command + c;
            const Command& command = plan.commands[index];
            if (command.kind != Command::Kind::projected) {
                continue;
            }
            if (!source->capabilities().projection) {
                return fail(
                    ErrorCode::unsupported,
                    "plan: pass " + std::to_string(i) + ", command " + std::to_string(index) +
                        ": projects keyframes, and the geometry source does not"
                );
            }
            for (std::uint32_t k = 0; k < command.keyframe_count; ++k) {
                const std::uint32_t keyframe = command.first_keyframe + k;
                const Page* page = find(plan.cache, plan.keyframes[keyframe].page);
                if (Result<void> valid = gpu::check_keyframe_page(plan, i, index, keyframe, page);
                    !valid) {
                    return valid;
                }
            }
            if (Result<void> made = source->prepare_projection(
                    command.keyframe_count, command.whole_triangles, positions
                );
                !made) {
                return made;
            }
        }
    }
    return {};
}

Result<void> OpenGLBackend::Impl::require_layers(const FramePlan& plan, const Target& frame) {
    for (std::size_t i = 0; i < plan.passes.size(); ++i) {
        const Pass& pass = plan.passes[i];
        for (std::uint32_t c = 0; c < pass.command_count; ++c) {
            const std::uint32_t index = pass.first_command + c;
            const Command& command = plan.commands[index];
            if (command.kind != Command::Kind::layers) {
                continue;
            }
            for (std::uint32_t k = command.first; k < command.first + command.count; ++k) {
                const bool exists = layers.has(plan.cache, plan.layers[k].image);
                if (Result<void> valid = gpu::check_shown_layers(plan, i, index, k, exists);
                    !valid) {
                    return valid;
                }
            }
            const Page* page = find(plan.cache, pass.page);
            const std::int32_t samples = page == nullptr ? frame.samples : page->samples;
            if (Result<void> made = layers.require(samples > 1); !made) {
                return made;
            }
        }
    }
    return {};
}

/// What the device has of the keyframes of a command.
void OpenGLBackend::Impl::find_keyframes(const FramePlan& plan, const Command& command) noexcept {
    for (std::uint32_t i = 0; i < command.keyframe_count; ++i) {
        const Keyframe& keyframe = plan.keyframes[command.first_keyframe + i];
        const Page& page = *find(plan.cache, keyframe.page);
        keyframes[i] = {
            .keyframe = &keyframe,
            .page_size = page.size,
            .colors = page.color,
            .depths = page.depth_texture,
            .points = page.positions.points,
            .layers = page.positions.layers};
    }
}

void OpenGLBackend::Impl::clear_batch(
    const FramePlan& plan, std::size_t first, std::size_t last, const FrameClear& clear
) const noexcept {
    const bool frame = plan.passes[first].page == kNone<PageId>;
    if (frame && !clear.enabled) {
        return;
    }
    // The regions of a batch are disjoint, so one clear around them serves all.
    Region around = plan.passes[first].scissor;
    for (std::size_t i = first + 1; i < last; ++i) {
        around = unite(around, plan.passes[i].scissor);
    }
    glScissorIndexed(0, around.x, around.y, around.width, around.height);
    const glm::vec4 color = frame ? clear.color : glm::vec4(0.0F);
    constexpr float kFar = 0.0F;
    glClearBufferfv(GL_COLOR, 0, &color[0]);
    glClearBufferfv(GL_DEPTH, 0, &kFar);
    if (positions) {
        // Where there is no such buffer, as in a framebuffer of the caller's, nothing happens.
        glClearBufferuiv(GL_COLOR, 1, kNoPoint.data());
        glClearBufferuiv(GL_COLOR, 2, kNoLayer.data());
    }
}

void OpenGLBackend::Impl::run_pass(
    const FramePlan& plan, const Pass& pass, GLuint framebuffer, std::int32_t samples
) noexcept {
    bool state_is_ours = false;
    for (std::uint32_t c = 0; c < pass.command_count; ++c) {
        const Command& command = plan.commands[pass.first_command + c];
        if (!state_is_ours) {
            set_drawing_state(framebuffer, pass.viewport, pass.scissor);
        }
        if (draws_images(command)) {
            state_is_ours = true;
            draw_quads(pass, command);
            continue;
        }
        if (draws_cells(command)) {
            state_is_ours = true;
            draw_cells(samples);
            continue;
        }
        if (command.kind == Command::Kind::layers) {
            state_is_ours = true;
            find_places(framebuffer, samples);
            layers.draw(plan, pass, command, places);
            continue;
        }
        // A source may leave any state behind.
        state_is_ours = false;
        const bool color = command.kind != Command::Kind::mask;
        if (!color) {
            set_masks(false, false);
        }
        PassContext context{
            .view = pass.view,
            .origin = plan.origin,
            .clip = {},
            .color = color,
            .positions = positions,
            .keyframes = std::span(keyframes).first(command.keyframe_count),
            .whole_triangles = command.whole_triangles};
        if (command.keyframe_count > 0) {
            find_keyframes(plan, command);
            for (GLuint unit = StateGuard::kUnits; unit < kUnitsWithKeyframes; ++unit) {
                glBindSampler(unit, 0);
            }
        }
        if (command.clip != Command::kNoClip) {
            context.clip = plan.clips[command.clip];
        }
        source->draw(
            {std::span(plan.items).subspan(command.first, command.count),
             std::span(plan.pieces).subspan(command.first_piece, command.piece_count),
             std::span(plan.selections).subspan(command.first_selection, command.selection_count),
             plan.selected},
            context
        );
    }
}

void OpenGLBackend::Impl::copy_batch(
    const FramePlan& plan, std::size_t first, std::size_t last
) noexcept {
    glDisablei(GL_SCISSOR_TEST, 0);
    for (std::size_t i = first; i < last; ++i) {
        const Pass& pass = plan.passes[i];
        if (pass.copy_page == kNone<PageId>) {
            continue;
        }
        const Page* from = find(plan.cache, pass.page);
        const Page* to = find(plan.cache, pass.copy_page);
        const Region& source_region = pass.scissor;
        const Region& target_region = pass.copy;
        const auto copy_texture = [&](GLuint source_texture, GLuint target_texture) {
            glCopyImageSubData(
                source_texture,
                GL_TEXTURE_2D,
                0,
                source_region.x,
                source_region.y,
                0,
                target_texture,
                GL_TEXTURE_2D,
                0,
                target_region.x,
                target_region.y,
                0,
                source_region.width,
                source_region.height,
                1
            );
        };
        if (positions) {
            copy_texture(from->positions.points, to->positions.points);
            copy_texture(from->positions.layers, to->positions.layers);
        }
        if (from->samples == 1) {
            copy_texture(from->color, to->color);
        } else {
            glBlitNamedFramebuffer(
                from->framebuffer,
                to->copy_framebuffer,
                source_region.x,
                source_region.y,
                source_region.x + source_region.width,
                source_region.y + source_region.height,
                target_region.x,
                target_region.y,
                target_region.x + target_region.width,
                target_region.y + target_region.height,
                GL_COLOR_BUFFER_BIT,
                GL_NEAREST
            );
        }
    }
    copy_depths(plan, first, last);
}

bool OpenGLBackend::Impl::copies_depth(const FramePlan& plan, const Pass& pass) noexcept {
    return pass.copy_page != kNone<PageId> && find(plan.cache, pass.copy_page)->depth;
}

Result<void> OpenGLBackend::Impl::require_depth_copies(const FramePlan& plan) {
    for (const Pass& pass : plan.passes) {
        if (!copies_depth(plan, pass)) {
            continue;
        }
        if (Result<void> made = depth_copy.require(find(plan.cache, pass.page)->samples); !made) {
            return made;
        }
    }
    return {};
}

void OpenGLBackend::Impl::copy_depths(
    const FramePlan& plan, std::size_t first, std::size_t last
) noexcept {
    bool state_is_set = false;
    for (std::size_t i = first; i < last; ++i) {
        const Pass& pass = plan.passes[i];
        if (!copies_depth(plan, pass)) {
            continue;
        }
        const Page* from = find(plan.cache, pass.page);
        const Page* to = find(plan.cache, pass.copy_page);
        if (!state_is_set) {
            set_drawing_state(to->depth_framebuffer, pass.copy, pass.copy);
            glBindVertexArray(quad_array);
            glBindTextureUnit(DepthCopyProgram::kColorUnit, from->color);
            glBindTextureUnit(DepthCopyProgram::kDepthUnit, from->depth_texture);
            state_is_set = true;
        } else {
            set_place(to->depth_framebuffer, pass.copy, pass.copy);
        }
        depth_copy.draw(
            {.offset = {pass.scissor.x - pass.copy.x, pass.scissor.y - pass.copy.y},
             .lens = pass.view.lens,
             .nearest = pass.copy_near,
             .farthest = pass.copy_far,
             .samples = from->samples}
        );
    }
}

OpenGLBackend::OpenGLBackend(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
OpenGLBackend::~OpenGLBackend() = default;

Result<void> OpenGLBackend::Impl::keep_positions() {
    if (!source->capabilities().position_output) {
        return fail(
            ErrorCode::unsupported,
            "OpenGL: positions are asked for, and the geometry source does not write them"
        );
    }
    positions = true;
    limits.samples = kPositionSamples;
    limits.positions = true;
    return programs.require(QuadOutput::points, QuadDepth::none);
}

Result<std::unique_ptr<OpenGLBackend>>
OpenGLBackend::create(GeometrySource& source, const OpenGLBackendOptions& options) {
    constexpr int kVersion = 45;
    const int version = epoxy_gl_version();
    if (version == 0) {
        return fail(ErrorCode::device, "OpenGL: no context is current on this thread");
    }
    if (version < kVersion) {
        return fail(
            ErrorCode::unsupported,
            "OpenGL: the current context has version " + std::to_string(version / 10) + "." +
                std::to_string(version % 10) + ", 4.5 or later is needed"
        );
    }
    auto impl = std::make_unique<Impl>(source, options);
    GLint size = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &size);
    impl->limits = {.page_size = size, .samples = most_samples()};
    if (Result<void> made = impl->programs.require(QuadOutput::colors, QuadDepth::none); !made) {
        return tl::unexpected(std::move(made).error());
    }
    if (options.positions) {
        if (Result<void> made = impl->keep_positions(); !made) {
            return tl::unexpected(std::move(made).error());
        }
    }
    glCreateVertexArrays(1, &impl->quad_array);
    const std::array<std::pair<GLint, std::size_t>, 3> attributes = {
        {{3, offsetof(QuadVertex, position)},
         {2, offsetof(QuadVertex, texel)},
         {2, offsetof(QuadVertex, depths)}}};
    for (GLuint index = 0; index < attributes.size(); ++index) {
        glEnableVertexArrayAttrib(impl->quad_array, index);
        glVertexArrayAttribFormat(
            impl->quad_array,
            index,
            attributes[index].first,
            GL_FLOAT,
            GL_FALSE,
            static_cast<GLuint>(attributes[index].second)
        );
        glVertexArrayAttribBinding(impl->quad_array, index, 0);
    }
    constexpr GLuint kNode = 3;
    glEnableVertexArrayAttrib(impl->quad_array, kNode);
    glVertexArrayAttribIFormat(
        impl->quad_array, kNode, 1, GL_UNSIGNED_INT, static_cast<GLuint>(offsetof(QuadVertex, node))
    );
    glVertexArrayAttribBinding(impl->quad_array, kNode, 0);
    impl->reserve_quads(1024);
    return std::unique_ptr<OpenGLBackend>(new OpenGLBackend(std::move(impl)));
}

Result<void>
OpenGLBackend::execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept {
    Impl& impl = *impl_;
    const Target* frame = impl.target(target);
    if (frame == nullptr) {
        return no_target(target);
    }
    if (Result<void> valid = gpu::check_structure(plan); !valid) {
        return valid;
    }
    const StateGuard guard(plan.keyframes.empty() ? StateGuard::kUnits : kUnitsWithKeyframes);
    drop_old_errors();
    for (const PageUpdate& update : plan.pages) {
        if (Result<void> updated = impl.update_page(plan.cache, update); !updated) {
            return updated;
        }
    }
    for (const LayeredUpdate& update : plan.layered_updates) {
        if (Result<void> updated = impl.layers.update(plan.cache, update); !updated) {
            return updated;
        }
    }
    if (Result<void> valid = impl.check_pages(plan, *frame); !valid) {
        return valid;
    }
    if (Result<void> uploaded = impl.upload_quads(plan); !uploaded) {
        return uploaded;
    }
    if (Result<void> uploaded = impl.upload_cells(plan, *frame); !uploaded) {
        return uploaded;
    }
    if (Result<void> made = impl.require_depth_copies(plan); !made) {
        return made;
    }
    if (Result<void> made = impl.require_projections(plan); !made) {
        return made;
    }
    if (Result<void> made = impl.require_layers(plan, *frame); !made) {
        return made;
    }
    for (std::size_t first = 0; first < plan.passes.size();) {
        std::size_t last = first + 1;
        while (last < plan.passes.size() && plan.passes[last].batch == plan.passes[first].batch) {
            ++last;
        }
        const Pass& head = plan.passes[first];
        const Page* page = head.page == kNone<PageId> ? nullptr : impl.find(plan.cache, head.page);
        const GLuint framebuffer = page == nullptr ? frame->framebuffer : page->framebuffer;
        const std::int32_t samples = page == nullptr ? frame->samples : page->samples;
        set_drawing_state(framebuffer, head.viewport, head.scissor);
        impl.clear_batch(plan, first, last, clear);
        for (std::size_t i = first; i < last; ++i) {
            impl.run_pass(plan, plan.passes[i], framebuffer, samples);
        }
        impl.copy_batch(plan, first, last);
        first = last;
    }
    const GLenum error = glGetError();
    if (error != GL_NO_ERROR) {
        return fail(
            error == GL_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::device,
            "OpenGL: error " + std::to_string(error) + " while executing a plan"
        );
    }
    return {};
}

void OpenGLBackend::finish() noexcept {
    glFinish();
}

Result<TargetId> OpenGLBackend::create_target(
    std::int32_t width, std::int32_t height, std::int32_t samples
) noexcept {
    if (Result<void> valid = gpu::check_target(width, height, samples, impl_->limits.samples);
        !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    drop_old_errors();
    Target target;
    target.width = width;
    target.height = height;
    target.samples = impl_->positions ? 1 : samples;
    target.alive = true;
    target.owned = true;
    glCreateRenderbuffers(1, &target.color);
    glCreateRenderbuffers(1, &target.depth);
    const GLsizei stored = target.samples > 1 ? target.samples : 0;
    glNamedRenderbufferStorageMultisample(target.color, stored, GL_RGBA8, width, height);
    glNamedRenderbufferStorageMultisample(
        target.depth, stored, GL_DEPTH_COMPONENT32F, width, height
    );
    glCreateFramebuffers(1, &target.framebuffer);
    glNamedFramebufferRenderbuffer(
        target.framebuffer, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, target.color
    );
    glNamedFramebufferRenderbuffer(
        target.framebuffer, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, target.depth
    );
    if (impl_->positions) {
        const std::array<std::pair<GLuint*, GLenum>, 2> buffers = {
            {{&target.positions.points, kPointFormat}, {&target.positions.layers, kLayerFormat}}};
        for (std::size_t i = 0; i < buffers.size(); ++i) {
            glCreateRenderbuffers(1, buffers[i].first);
            glNamedRenderbufferStorage(*buffers[i].first, buffers[i].second, width, height);
            glNamedFramebufferRenderbuffer(
                target.framebuffer, kDrawBuffers[i + 1], GL_RENDERBUFFER, *buffers[i].first
            );
        }
        glNamedFramebufferDrawBuffers(
            target.framebuffer, static_cast<GLsizei>(kDrawBuffers.size()), kDrawBuffers.data()
        );
    }
    const bool complete = glCheckNamedFramebufferStatus(target.framebuffer, GL_FRAMEBUFFER) ==
                          GL_FRAMEBUFFER_COMPLETE;
    const GLenum error = glGetError();
    if (error != GL_NO_ERROR || !complete) {
        Impl::destroy_target(target);
        return fail(
            error == GL_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::device,
            "OpenGL: cannot make a target of " + std::to_string(width) + " x " +
                std::to_string(height) + " pixels with " + std::to_string(samples) + " samples"
        );
    }
    impl_->targets.push_back(target);
    return make_id<TargetId>(impl_->targets.size());
}

Result<TargetId> OpenGLBackend::wrap_framebuffer(
    std::uint32_t framebuffer, std::int32_t width, std::int32_t height
) noexcept {
    if (Result<void> valid = gpu::check_target(width, height, 1, 1); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    const auto refused = [&](const char* why) {
        return fail(
            ErrorCode::invalid_argument,
            "OpenGL: framebuffer " + std::to_string(framebuffer) + " " + why
        );
    };
    if (framebuffer != 0 && glIsFramebuffer(framebuffer) == GL_FALSE) {
        return refused("does not exist");
    }
    if (glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) !=
        GL_FRAMEBUFFER_COMPLETE) {
        return refused("is not complete");
    }
    GLint depth = GL_NONE;
    glGetNamedFramebufferAttachmentParameteriv(
        framebuffer,
        framebuffer == 0 ? GL_DEPTH : GL_DEPTH_ATTACHMENT,
        GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE,
        &depth
    );
    if (depth == GL_NONE) {
        return refused("has no depth attachment");
    }
    GLint samples = 0;
    glGetNamedFramebufferParameteriv(framebuffer, GL_SAMPLES, &samples);
    Target target;
    target.framebuffer = framebuffer;
    target.width = width;
    target.height = height;
    target.samples = std::max(samples, 1);
    target.alive = true;
    impl_->targets.push_back(target);
    return make_id<TargetId>(impl_->targets.size());
}

void OpenGLBackend::destroy_target(TargetId target) noexcept {
    const std::size_t index = index_of(target);
    if (index >= 1 && index <= impl_->targets.size()) {
        Impl::destroy_target(impl_->targets[index - 1]);
    }
}

Result<Picture> OpenGLBackend::read_target(TargetId target) {
    const Target* read = impl_->target(target);
    if (read == nullptr) {
        return no_target(target);
    }
    drop_old_errors();
    const ReadGuard guard;
    Picture picture;
    picture.width = read->width;
    picture.height = read->height;
    const std::size_t row = static_cast<std::size_t>(picture.width) * 4;
    picture.rgba.resize(row * static_cast<std::size_t>(picture.height));

    GLuint resolved = 0;
    GLuint resolved_color = 0;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, read->framebuffer);
    const bool choose_buffer = read->framebuffer != 0; // a window's is what it is
    GLint old_buffer = GL_NONE;
    if (choose_buffer) {
        glGetIntegerv(GL_READ_BUFFER, &old_buffer);
        glReadBuffer(GL_COLOR_ATTACHMENT0);
    }
    if (read->samples > 1) {
        glCreateRenderbuffers(1, &resolved_color);
        glNamedRenderbufferStorage(resolved_color, GL_RGBA8, read->width, read->height);
        glCreateFramebuffers(1, &resolved);
        glNamedFramebufferRenderbuffer(
            resolved, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, resolved_color
        );
        resolve(read->framebuffer, resolved, read->width, read->height);
        if (choose_buffer) {
            glReadBuffer(static_cast<GLenum>(old_buffer));
        }
        glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved);
    }
    glReadPixels(0, 0, read->width, read->height, GL_RGBA, GL_UNSIGNED_BYTE, picture.rgba.data());
    if (read->samples == 1 && choose_buffer) {
        glReadBuffer(static_cast<GLenum>(old_buffer));
    }
    glDeleteFramebuffers(1, &resolved);
    glDeleteRenderbuffers(1, &resolved_color);
    const GLenum error = glGetError();
    if (error != GL_NO_ERROR) {
        return fail(
            error == GL_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::device,
            "OpenGL: error " + std::to_string(error) + " while reading target " +
                std::to_string(index_of(target))
        );
    }
    // OpenGL's rows go up, a picture's go down.
    for (std::size_t top = 0, bottom = static_cast<std::size_t>(picture.height) - 1; top < bottom;
         ++top, --bottom) {
        std::swap_ranges(
            picture.rgba.begin() + static_cast<std::ptrdiff_t>(top * row),
            picture.rgba.begin() + static_cast<std::ptrdiff_t>((top + 1) * row),
            picture.rgba.begin() + static_cast<std::ptrdiff_t>(bottom * row)
        );
    }
    return picture;
}

Result<PositionPicture> OpenGLBackend::read_positions(TargetId target) {
    const Target* read = impl_->target(target);
    if (read == nullptr) {
        return no_target(target);
    }
    if (read->positions.points == 0) {
        return fail(
            ErrorCode::unsupported,
            "OpenGL: target " + std::to_string(index_of(target)) + " keeps no positions"
        );
    }
    drop_old_errors();
    const ReadGuard guard;
    const std::size_t pixels =
        static_cast<std::size_t>(read->width) * static_cast<std::size_t>(read->height);
    std::vector<std::array<std::uint32_t, 4>> points(pixels);
    std::vector<std::array<std::uint32_t, 2>> layers(pixels);
    read_integers(read->positions.points, *read, GL_RGBA_INTEGER, points.data());
    read_integers(read->positions.layers, *read, GL_RG_INTEGER, layers.data());
    const GLenum error = glGetError();
    if (error != GL_NO_ERROR) {
        return fail(
            error == GL_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::device,
            "OpenGL: error " + std::to_string(error) + " while reading positions of target " +
                std::to_string(index_of(target))
        );
    }
    PositionPicture picture;
    picture.width = read->width;
    picture.height = read->height;
    picture.texels.resize(pixels);
    const auto width = static_cast<std::size_t>(read->width);
    for (std::size_t i = 0; i < pixels; ++i) {
        // OpenGL's rows go up, a picture's go down.
        const std::size_t from = pixels - width - i / width * width + i % width;
        PositionTexel& texel = picture.texels[i];
        for (int axis = 0; axis < 3; ++axis) {
            texel.point[axis] = std::bit_cast<float>(points[from][static_cast<std::size_t>(axis)]);
        }
        texel.item = static_cast<ItemId>(points[from][3]);
        texel.texel_px = std::bit_cast<float>(layers[from][0]);
        texel.node = layers[from][1];
    }
    return picture;
}

Backend::Limits OpenGLBackend::limits() const noexcept {
    return impl_->limits;
}

std::string OpenGLBackend::device() const {
    const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    return renderer == nullptr ? "unknown OpenGL renderer" : renderer;
}

std::uint64_t OpenGLBackend::image_bytes() const noexcept {
    std::uint64_t bytes = impl_->layers.bytes();
    for (const Page& page : impl_->pages) {
        bytes += gpu::page_bytes(page, page.samples);
    }
    return bytes;
}

std::uint64_t OpenGLBackend::position_bytes() const noexcept {
    std::uint64_t texels = 0;
    for (const Page& page : impl_->pages) {
        texels += static_cast<std::uint64_t>(page.size) * static_cast<std::uint64_t>(page.size);
    }
    return impl_->positions ? texels * kPositionTexelBytes + impl_->layers.position_bytes() : 0;
}

} // namespace farfield::opengl
