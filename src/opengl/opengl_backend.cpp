#include "opengl/program.hpp"
#include "opengl/state_guard.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/opengl/opengl_backend.hpp>

#include <epoxy/gl.h>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace farfield::opengl {

namespace {

constexpr std::int32_t kMostPixels = 16384;

// An image quad has four corners; positions are relative to the eye in camera axes.
struct QuadVertex {
    glm::vec3 position;
    glm::vec2 texel;
    float depth = 0.0F;
};
static_assert(sizeof(QuadVertex) == 24);

constexpr const char* kQuadVertexShader = R"(#version 450 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 texel;
layout(location = 2) in float depth;
uniform mat4 projection;
uniform float texel_size;
layout(location = 0) out vec2 uv;
void main() {
    gl_Position = projection * vec4(position, 1.0);
    // The whole quad stands at one depth.
    float z = projection[2][2] * -depth + projection[3][2];
    gl_Position.z = z / depth * gl_Position.w;
    uv = texel * texel_size;
}
)";

constexpr const char* kQuadFragmentShader = R"(#version 450 core
layout(location = 0) in vec2 uv;
layout(binding = 0) uniform sampler2D page;
layout(location = 0) out vec4 result;
void main() {
    result = texture(page, uv);
}
)";

struct Page {
    std::uint32_t cache = 0;
    PageId id = kNone<PageId>;
    std::int32_t size = 0;
    GLuint color = 0;            // texture, or renderbuffer of a scratch page with several samples
    GLuint depth = 0;            // renderbuffer of a scratch page
    GLuint framebuffer = 0;      // of a scratch page
    GLuint copy_framebuffer = 0; // of a page: resolves go to it
    std::int32_t samples = 1;
    bool scratch = false;
};

std::uint64_t page_bytes(const Page& page) {
    const std::uint64_t texels =
        static_cast<std::uint64_t>(page.size) * static_cast<std::uint64_t>(page.size);
    return page.scratch ? texels * 8U * static_cast<std::uint64_t>(page.samples) : texels * 4U;
}

struct Target {
    GLuint framebuffer = 0;
    GLuint color = 0; // renderbuffers; 0 for a framebuffer of the caller's
    GLuint depth = 0;
    std::int32_t width = 0;
    std::int32_t height = 0;
    std::int32_t samples = 1;
    bool alive = false;
    bool owned = false;
};

} // namespace

struct OpenGLBackend::Impl {
    GeometrySource* source = nullptr;
    GLuint quad_program = 0;
    GLint quad_projection = -1;
    GLint quad_texel_size = -1;
    GLuint quad_array = 0;
    GLuint quad_vertices = 0;
    GLuint quad_indices = 0;
    std::size_t quad_capacity = 0;
    std::vector<Page> pages;
    std::vector<Target> targets; // TargetId is the position plus one
    std::vector<QuadVertex> vertices;

    explicit Impl(GeometrySource& geometry) : source(&geometry) {}
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() {
        for (Page& page : pages) {
            destroy(page);
        }
        for (std::size_t i = 0; i < targets.size(); ++i) {
            destroy_target(targets[i]);
        }
        glDeleteProgram(quad_program);
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
    void upload_quads(const FramePlan& plan);
    [[nodiscard]] Result<void> run_pass(const FramePlan& plan, const Pass& pass);
    [[nodiscard]] Result<void>
    copy_batch(const FramePlan& plan, std::size_t first, std::size_t last);
    [[nodiscard]] Result<void>
    draw_quads(const FramePlan& plan, const Pass& pass, const Command& command);
};

void OpenGLBackend::Impl::destroy(Page& page) noexcept {
    glDeleteFramebuffers(1, &page.framebuffer);
    glDeleteFramebuffers(1, &page.copy_framebuffer);
    glDeleteRenderbuffers(1, &page.depth);
    if (page.scratch && page.samples > 1) {
        glDeleteRenderbuffers(1, &page.color);
    } else {
        glDeleteTextures(1, &page.color);
    }
}

void OpenGLBackend::Impl::destroy_target(Target& target) noexcept {
    if (target.owned) {
        glDeleteFramebuffers(1, &target.framebuffer);
        glDeleteRenderbuffers(1, &target.color);
        glDeleteRenderbuffers(1, &target.depth);
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
    Page page;
    page.cache = cache;
    page.id = update.page;
    page.size = update.size;
    page.samples = update.samples;
    page.scratch = update.scratch;
    if (page.scratch && page.samples > 1) {
        glCreateRenderbuffers(1, &page.color);
        glNamedRenderbufferStorageMultisample(
            page.color, page.samples, GL_RGBA8, page.size, page.size
        );
    } else {
        glCreateTextures(GL_TEXTURE_2D, 1, &page.color);
        glTextureStorage2D(page.color, 1, GL_RGBA8, page.size, page.size);
        glTextureParameteri(page.color, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        glTextureParameteri(page.color, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        glTextureParameteri(page.color, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        glTextureParameteri(page.color, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    }
    bool complete = true;
    if (page.scratch) {
        glCreateRenderbuffers(1, &page.depth);
        glNamedRenderbufferStorageMultisample(
            page.depth,
            page.samples > 1 ? page.samples : 0,
            GL_DEPTH_COMPONENT32F,
            page.size,
            page.size
        );
        glCreateFramebuffers(1, &page.framebuffer);
        if (page.samples > 1) {
            glNamedFramebufferRenderbuffer(
                page.framebuffer, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, page.color
            );
        } else {
            glNamedFramebufferTexture(page.framebuffer, GL_COLOR_ATTACHMENT0, page.color, 0);
        }
        glNamedFramebufferRenderbuffer(
            page.framebuffer, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, page.depth
        );
        complete = glCheckNamedFramebufferStatus(page.framebuffer, GL_FRAMEBUFFER) ==
                   GL_FRAMEBUFFER_COMPLETE;
    } else {
        glCreateFramebuffers(1, &page.copy_framebuffer);
        glNamedFramebufferTexture(page.copy_framebuffer, GL_COLOR_ATTACHMENT0, page.color, 0);
        complete = glCheckNamedFramebufferStatus(page.copy_framebuffer, GL_FRAMEBUFFER) ==
                   GL_FRAMEBUFFER_COMPLETE;
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
    std::vector<std::uint32_t> indices;
    indices.reserve(quad_capacity * 6);
    for (std::size_t quad = 0; quad < quad_capacity; ++quad) {
        const auto first = static_cast<std::uint32_t>(quad * 4);
        for (const std::uint32_t corner : {0U, 1U, 2U, 2U, 1U, 3U}) {
            indices.push_back(first + corner);
        }
    }
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

void OpenGLBackend::Impl::upload_quads(const FramePlan& plan) {
    reserve_quads(plan.quads.size());
    vertices.resize(plan.quads.size() * 4);
    for (const Pass& pass : plan.passes) {
        // Differences first: the eye and the quads may both be far from the plan's origin.
        const glm::vec3 eye = local_point(pass.view.eye, plan.origin);
        const glm::mat3 world_to_camera(glm::transpose(pass.view.camera_to_world));
        for (std::uint32_t c = 0; c < pass.command_count; ++c) {
            const Command& command = plan.commands[pass.first_command + c];
            if (command.kind != Command::Kind::images) {
                continue;
            }
            for (std::uint32_t q = command.first; q < command.first + command.count; ++q) {
                const ImageQuad& quad = plan.quads[q];
                const glm::vec3 origin = world_to_camera * (quad.origin - eye);
                const glm::vec3 u = world_to_camera * quad.edge_u;
                const glm::vec3 v = world_to_camera * quad.edge_v;
                const auto x0 = static_cast<float>(quad.source.x);
                const auto y0 = static_cast<float>(quad.source.y);
                const auto x1 = static_cast<float>(quad.source.x + quad.source.width);
                const auto y1 = static_cast<float>(quad.source.y + quad.source.height);
                QuadVertex* corners = &vertices[std::size_t{q} * 4];
                corners[0] = {origin, {x0, y0}, quad.depth};
                corners[1] = {origin + u, {x1, y0}, quad.depth};
                corners[2] = {origin + v, {x0, y1}, quad.depth};
                corners[3] = {origin + u + v, {x1, y1}, quad.depth};
            }
        }
    }
    if (!vertices.empty()) {
        glInvalidateBufferData(quad_vertices);
        glNamedBufferSubData(
            quad_vertices,
            0,
            static_cast<GLsizeiptr>(vertices.size() * sizeof(QuadVertex)),
            vertices.data()
        );
    }
}

Result<void>
OpenGLBackend::Impl::draw_quads(const FramePlan& plan, const Pass& pass, const Command& command) {
    glUseProgram(quad_program);
    const glm::mat4 projection = projection_matrix(pass.view.lens);
    glUniformMatrix4fv(quad_projection, 1, GL_FALSE, &projection[0][0]);
    glBindVertexArray(quad_array);
    glEnable(GL_BLEND);
    glDepthFunc(GL_GEQUAL);
    glDepthMask(GL_FALSE);
    // One draw for each run of quads on one page.
    for (std::uint32_t first = command.first; first < command.first + command.count;) {
        const PageId id = plan.quads[first].page;
        std::uint32_t end = first + 1;
        while (end < command.first + command.count && plan.quads[end].page == id) {
            ++end;
        }
        const Page* page = find(plan.cache, id);
        if (page == nullptr) {
            return fail(
                ErrorCode::invalid_argument,
                "plan: quad " + std::to_string(first) + " shows page " +
                    std::to_string(index_of(id)) + ", which does not exist"
            );
        }
        glBindTextureUnit(0, page->color);
        glUniform1f(quad_texel_size, 1.0F / static_cast<float>(page->size));
        glDrawElements(
            GL_TRIANGLES,
            static_cast<GLsizei>((end - first) * 6),
            GL_UNSIGNED_INT,
            reinterpret_cast<const void*>(std::size_t{first} * 6 * sizeof(std::uint32_t))
        );
        first = end;
    }
    glDisable(GL_BLEND);
    return {};
}

Result<void> OpenGLBackend::Impl::run_pass(const FramePlan& plan, const Pass& pass) {
    glViewport(pass.viewport.x, pass.viewport.y, pass.viewport.width, pass.viewport.height);
    glScissor(pass.scissor.x, pass.scissor.y, pass.scissor.width, pass.scissor.height);
    for (std::uint32_t c = 0; c < pass.command_count; ++c) {
        const Command& command = plan.commands[pass.first_command + c];
        if (command.kind == Command::Kind::images) {
            if (Result<void> drawn = draw_quads(plan, pass, command); !drawn) {
                return drawn;
            }
            continue;
        }
        const bool color = command.kind == Command::Kind::geometry;
        glDepthFunc(GL_GREATER);
        glDepthMask(GL_TRUE);
        if (!color) {
            glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        }
        PassContext context{.view = pass.view, .origin = plan.origin, .clip = {}, .color = color};
        if (command.clip != Command::kNoClip) {
            context.clip = plan.clips[command.clip];
        }
        source->draw(
            {std::span(plan.items).subspan(command.first, command.count),
             std::span(plan.pieces).subspan(command.first_piece, command.piece_count)},
            context
        );
        if (!color) {
            glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        }
    }
    return {};
}

Result<void>
OpenGLBackend::Impl::copy_batch(const FramePlan& plan, std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
        const Pass& pass = plan.passes[i];
        if (pass.copy_page == kNone<PageId>) {
            continue;
        }
        const Page* from = find(plan.cache, pass.page);
        const Page* to = find(plan.cache, pass.copy_page);
        if (from == nullptr || to == nullptr) {
            return fail(
                ErrorCode::invalid_argument,
                "plan: pass " + std::to_string(i) + " copies from or to a page that does not exist"
            );
        }
        const Region& source_region = pass.scissor;
        const Region& target_region = pass.copy;
        if (from->samples == 1) {
            glCopyImageSubData(
                from->color,
                GL_TEXTURE_2D,
                0,
                source_region.x,
                source_region.y,
                0,
                to->color,
                GL_TEXTURE_2D,
                0,
                target_region.x,
                target_region.y,
                0,
                source_region.width,
                source_region.height,
                1
            );
        } else {
            glDisable(GL_SCISSOR_TEST);
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
            glEnable(GL_SCISSOR_TEST);
        }
    }
    return {};
}

OpenGLBackend::OpenGLBackend(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
OpenGLBackend::~OpenGLBackend() = default;

Result<std::unique_ptr<OpenGLBackend>> OpenGLBackend::create(GeometrySource& source) {
    constexpr int kVersion = 45;
    if (epoxy_gl_version() < kVersion) {
        return fail(
            ErrorCode::unsupported,
            "OpenGL: the current context has version " + std::to_string(epoxy_gl_version() / 10) +
                "." + std::to_string(epoxy_gl_version() % 10) + ", 4.5 or later is needed"
        );
    }
    auto impl = std::make_unique<Impl>(source);
    const Result<GLuint> program =
        link_program("image quads", kQuadVertexShader, kQuadFragmentShader);
    if (!program) {
        return tl::unexpected(program.error());
    }
    impl->quad_program = *program;
    impl->quad_projection = glGetUniformLocation(*program, "projection");
    impl->quad_texel_size = glGetUniformLocation(*program, "texel_size");
    glCreateVertexArrays(1, &impl->quad_array);
    const std::array<std::pair<GLint, std::size_t>, 3> attributes = {
        {{3, offsetof(QuadVertex, position)},
         {2, offsetof(QuadVertex, texel)},
         {1, offsetof(QuadVertex, depth)}}};
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
    impl->reserve_quads(1024);
    return std::unique_ptr<OpenGLBackend>(new OpenGLBackend(std::move(impl)));
}

Result<void>
OpenGLBackend::execute(const FramePlan& plan, TargetId target, const FrameClear& clear) noexcept {
    Impl& impl = *impl_;
    const std::size_t index = index_of(target);
    if (index == 0 || index > impl.targets.size() || !impl.targets[index - 1].alive) {
        return fail(
            ErrorCode::invalid_argument,
            "OpenGL: target " + std::to_string(index) + " does not exist"
        );
    }
    const Target& frame = impl.targets[index - 1];
    const StateGuard guard;
    set_drawing_state();
    while (glGetError() != GL_NO_ERROR) {
        // Errors of the caller's are not ours to report.
    }
    for (const PageUpdate& update : plan.pages) {
        if (Result<void> updated = impl.update_page(plan.cache, update); !updated) {
            return updated;
        }
    }
    impl.upload_quads(plan);

    for (std::size_t first = 0; first < plan.passes.size();) {
        std::size_t last = first + 1;
        while (last < plan.passes.size() && plan.passes[last].batch == plan.passes[first].batch) {
            ++last;
        }
        const PageId id = plan.passes[first].page;
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        glDepthMask(GL_TRUE);
        if (id == kNone<PageId>) {
            glBindFramebuffer(GL_FRAMEBUFFER, frame.framebuffer);
            const Region& scissor = plan.passes[first].scissor;
            glScissor(scissor.x, scissor.y, scissor.width, scissor.height);
            if (clear.enabled) {
                glClearColor(clear.color.r, clear.color.g, clear.color.b, clear.color.a);
                glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
            }
        } else {
            const Page* page = impl.find(plan.cache, id);
            if (page == nullptr || !page->scratch) {
                return fail(
                    ErrorCode::invalid_argument,
                    "plan: pass " + std::to_string(first) + " draws into page " +
                        std::to_string(index_of(id)) + ", which is no scratch page"
                );
            }
            glBindFramebuffer(GL_FRAMEBUFFER, page->framebuffer);
            // The regions of a batch are disjoint, so one clear around them serves all.
            Region around = plan.passes[first].scissor;
            for (std::size_t i = first + 1; i < last; ++i) {
                around = unite(around, plan.passes[i].scissor);
            }
            glScissor(around.x, around.y, around.width, around.height);
            glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
            glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        }
        for (std::size_t i = first; i < last; ++i) {
            if (Result<void> run = impl.run_pass(plan, plan.passes[i]); !run) {
                return run;
            }
        }
        if (Result<void> copied = impl.copy_batch(plan, first, last); !copied) {
            return copied;
        }
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
    if (width < 1 || height < 1 || width > kMostPixels || height > kMostPixels) {
        return fail(
            ErrorCode::invalid_argument,
            "OpenGL: target of " + std::to_string(width) + " x " + std::to_string(height) +
                " pixels, expected 1 to 16384 a side"
        );
    }
    if (samples < 1 || samples > limits().samples) {
        return fail(
            ErrorCode::unsupported,
            "OpenGL: " + std::to_string(samples) + " samples a pixel, the device takes 1 to " +
                std::to_string(limits().samples)
        );
    }
    Target target;
    target.width = width;
    target.height = height;
    target.samples = samples;
    target.alive = true;
    target.owned = true;
    glCreateRenderbuffers(1, &target.color);
    glCreateRenderbuffers(1, &target.depth);
    const GLsizei stored = samples > 1 ? samples : 0;
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
    if (glCheckNamedFramebufferStatus(target.framebuffer, GL_FRAMEBUFFER) !=
        GL_FRAMEBUFFER_COMPLETE) {
        Impl::destroy_target(target);
        return fail(
            ErrorCode::device,
            "OpenGL: cannot make a target of " + std::to_string(width) + " x " +
                std::to_string(height) + " pixels"
        );
    }
    impl_->targets.push_back(target);
    return make_id<TargetId>(impl_->targets.size());
}

Result<TargetId> OpenGLBackend::wrap_framebuffer(
    std::uint32_t framebuffer, std::int32_t width, std::int32_t height
) noexcept {
    if (width < 1 || height < 1 || width > kMostPixels || height > kMostPixels) {
        return fail(
            ErrorCode::invalid_argument,
            "OpenGL: framebuffer of " + std::to_string(width) + " x " + std::to_string(height) +
                " pixels, expected 1 to 16384 a side"
        );
    }
    Target target;
    target.framebuffer = framebuffer;
    target.width = width;
    target.height = height;
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
    const std::size_t index = index_of(target);
    if (index == 0 || index > impl_->targets.size() || !impl_->targets[index - 1].alive) {
        return fail(
            ErrorCode::invalid_argument,
            "OpenGL: target " + std::to_string(index) + " does not exist"
        );
    }
    const Target& frame = impl_->targets[index - 1];
    Result<TargetId> resolved = TargetId{};
    GLuint framebuffer = frame.framebuffer;
    if (frame.samples > 1) {
        resolved = create_target(frame.width, frame.height, 1);
        if (!resolved) {
            return tl::unexpected(resolved.error());
        }
        const Target& samples = impl_->targets[index - 1];
        framebuffer = impl_->targets[index_of(*resolved) - 1].framebuffer;
        glBlitNamedFramebuffer(
            samples.framebuffer,
            framebuffer,
            0,
            0,
            samples.width,
            samples.height,
            0,
            0,
            samples.width,
            samples.height,
            GL_COLOR_BUFFER_BIT,
            GL_NEAREST
        );
    }
    const Target& read = impl_->targets[index - 1];
    Picture picture;
    picture.width = read.width;
    picture.height = read.height;
    picture.rgba.resize(
        static_cast<std::size_t>(read.width) * static_cast<std::size_t>(read.height) * 4
    );
    GLint old_framebuffer = 0;
    GLint old_alignment = 0;
    GLint old_buffer = 0;
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &old_framebuffer);
    glGetIntegerv(GL_PACK_ALIGNMENT, &old_alignment);
    glGetIntegerv(GL_PIXEL_PACK_BUFFER_BINDING, &old_buffer);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, read.width, read.height, GL_RGBA, GL_UNSIGNED_BYTE, picture.rgba.data());
    glPixelStorei(GL_PACK_ALIGNMENT, old_alignment);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, static_cast<GLuint>(old_buffer));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(old_framebuffer));
    // OpenGL's rows go up, a picture's go down.
    const std::size_t row = static_cast<std::size_t>(picture.width) * 4;
    for (std::size_t top = 0, bottom = static_cast<std::size_t>(picture.height) - 1; top < bottom;
         ++top, --bottom) {
        std::swap_ranges(
            picture.rgba.begin() + static_cast<std::ptrdiff_t>(top * row),
            picture.rgba.begin() + static_cast<std::ptrdiff_t>((top + 1) * row),
            picture.rgba.begin() + static_cast<std::ptrdiff_t>(bottom * row)
        );
    }
    if (resolved && *resolved != TargetId{}) {
        Impl::destroy_target(impl_->targets.back());
        impl_->targets.pop_back();
    }
    return picture;
}

Backend::Limits OpenGLBackend::limits() const noexcept {
    GLint size = 0;
    GLint samples = 1;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &size);
    glGetIntegerv(GL_MAX_SAMPLES, &samples);
    return {.page_size = size, .samples = std::max(samples, 1)};
}

std::string OpenGLBackend::device() const {
    const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    return renderer == nullptr ? "unknown OpenGL renderer" : renderer;
}

std::uint64_t OpenGLBackend::image_bytes() const noexcept {
    std::uint64_t bytes = 0;
    for (const Page& page : impl_->pages) {
        bytes += page_bytes(page);
    }
    return bytes;
}

} // namespace farfield::opengl
