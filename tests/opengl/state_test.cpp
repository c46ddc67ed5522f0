#include "gpu/hand_made_plan.hpp"
#include "gpu/layered_scene.hpp"
#include "opengl/device.hpp"
#include "support/small_scene.hpp"
#include <farfield/technique/image_cache.hpp>

#include <catch2/catch.hpp>
#include <epoxy/gl.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 64;
constexpr GLuint kUnits = 4;
constexpr GLuint kTextureUnits = 18; // one more than is ever touched

struct Name {
    const char* text;
    GLenum value;
};
#define NAME(value)                                                                                \
    { #value, value }

constexpr std::array kSwitches = {
    Name NAME(GL_BLEND),
    Name NAME(GL_COLOR_LOGIC_OP),
    Name NAME(GL_CULL_FACE),
    Name NAME(GL_DEPTH_CLAMP),
    Name NAME(GL_DEPTH_TEST),
    Name NAME(GL_DITHER),
    Name NAME(GL_FRAMEBUFFER_SRGB),
    Name NAME(GL_LINE_SMOOTH),
    Name NAME(GL_MULTISAMPLE),
    Name NAME(GL_POLYGON_OFFSET_FILL),
    Name NAME(GL_POLYGON_OFFSET_LINE),
    Name NAME(GL_POLYGON_OFFSET_POINT),
    Name NAME(GL_POLYGON_SMOOTH),
    Name NAME(GL_PRIMITIVE_RESTART),
    Name NAME(GL_PRIMITIVE_RESTART_FIXED_INDEX),
    Name NAME(GL_PROGRAM_POINT_SIZE),
    Name NAME(GL_RASTERIZER_DISCARD),
    Name NAME(GL_SAMPLE_ALPHA_TO_COVERAGE),
    Name NAME(GL_SAMPLE_ALPHA_TO_ONE),
    Name NAME(GL_SAMPLE_COVERAGE),
    Name NAME(GL_SAMPLE_MASK),
    Name NAME(GL_SAMPLE_SHADING),
    Name NAME(GL_SCISSOR_TEST),
    Name NAME(GL_STENCIL_TEST),
    Name NAME(GL_TEXTURE_CUBE_MAP_SEAMLESS),
    Name NAME(GL_CLIP_DISTANCE0),
    Name NAME(GL_CLIP_DISTANCE1),
    Name NAME(GL_CLIP_DISTANCE2),
    Name NAME(GL_CLIP_DISTANCE3),
    Name NAME(GL_CLIP_DISTANCE4),
    Name NAME(GL_CLIP_DISTANCE5),
    Name NAME(GL_CLIP_DISTANCE6),
    Name NAME(GL_CLIP_DISTANCE7),
};

/// Every value that exists once; at most four numbers each.
constexpr std::array kValues = {
    Name NAME(GL_ACTIVE_TEXTURE),
    Name NAME(GL_ARRAY_BUFFER_BINDING),
    Name NAME(GL_BLEND_COLOR),
    Name NAME(GL_CLIP_DEPTH_MODE),
    Name NAME(GL_CLIP_ORIGIN),
    Name NAME(GL_COLOR_CLEAR_VALUE),
    Name NAME(GL_COPY_READ_BUFFER_BINDING),
    Name NAME(GL_COPY_WRITE_BUFFER_BINDING),
    Name NAME(GL_CULL_FACE_MODE),
    Name NAME(GL_CURRENT_PROGRAM),
    Name NAME(GL_DEPTH_CLEAR_VALUE),
    Name NAME(GL_DEPTH_FUNC),
    Name NAME(GL_DEPTH_WRITEMASK),
    Name NAME(GL_DISPATCH_INDIRECT_BUFFER_BINDING),
    Name NAME(GL_DRAW_FRAMEBUFFER_BINDING),
    Name NAME(GL_DRAW_INDIRECT_BUFFER_BINDING),
    Name NAME(GL_ELEMENT_ARRAY_BUFFER_BINDING),
    Name NAME(GL_FRONT_FACE),
    Name NAME(GL_LINE_SMOOTH_HINT),
    Name NAME(GL_LINE_WIDTH),
    Name NAME(GL_LOGIC_OP_MODE),
    Name NAME(GL_MIN_SAMPLE_SHADING_VALUE),
    Name NAME(GL_PACK_ALIGNMENT),
    Name NAME(GL_PACK_LSB_FIRST),
    Name NAME(GL_PACK_ROW_LENGTH),
    Name NAME(GL_PACK_SKIP_PIXELS),
    Name NAME(GL_PACK_SKIP_ROWS),
    Name NAME(GL_PACK_SWAP_BYTES),
    Name NAME(GL_PATCH_VERTICES),
    Name NAME(GL_PIXEL_PACK_BUFFER_BINDING),
    Name NAME(GL_PIXEL_UNPACK_BUFFER_BINDING),
    Name NAME(GL_POINT_FADE_THRESHOLD_SIZE),
    Name NAME(GL_POINT_SIZE),
    Name NAME(GL_POLYGON_MODE),
    Name NAME(GL_POLYGON_OFFSET_FACTOR),
    Name NAME(GL_POLYGON_OFFSET_UNITS),
    Name NAME(GL_PRIMITIVE_RESTART_INDEX),
    Name NAME(GL_PROGRAM_PIPELINE_BINDING),
    Name NAME(GL_PROVOKING_VERTEX),
    Name NAME(GL_READ_FRAMEBUFFER_BINDING),
    Name NAME(GL_READ_BUFFER),
    Name NAME(GL_RENDERBUFFER_BINDING),
    Name NAME(GL_SAMPLE_COVERAGE_INVERT),
    Name NAME(GL_SAMPLE_COVERAGE_VALUE),
    Name NAME(GL_SHADER_STORAGE_BUFFER_BINDING),
    Name NAME(GL_STENCIL_BACK_FAIL),
    Name NAME(GL_STENCIL_BACK_FUNC),
    Name NAME(GL_STENCIL_BACK_PASS_DEPTH_FAIL),
    Name NAME(GL_STENCIL_BACK_PASS_DEPTH_PASS),
    Name NAME(GL_STENCIL_BACK_REF),
    Name NAME(GL_STENCIL_BACK_VALUE_MASK),
    Name NAME(GL_STENCIL_BACK_WRITEMASK),
    Name NAME(GL_STENCIL_CLEAR_VALUE),
    Name NAME(GL_STENCIL_FAIL),
    Name NAME(GL_STENCIL_FUNC),
    Name NAME(GL_STENCIL_PASS_DEPTH_FAIL),
    Name NAME(GL_STENCIL_PASS_DEPTH_PASS),
    Name NAME(GL_STENCIL_REF),
    Name NAME(GL_STENCIL_VALUE_MASK),
    Name NAME(GL_STENCIL_WRITEMASK),
    Name NAME(GL_TRANSFORM_FEEDBACK_BINDING),
    Name NAME(GL_UNIFORM_BUFFER_BINDING),
    Name NAME(GL_UNPACK_ALIGNMENT),
    Name NAME(GL_UNPACK_LSB_FIRST),
    Name NAME(GL_UNPACK_ROW_LENGTH),
    Name NAME(GL_UNPACK_SKIP_PIXELS),
    Name NAME(GL_UNPACK_SKIP_ROWS),
    Name NAME(GL_UNPACK_SWAP_BYTES),
    Name NAME(GL_VERTEX_ARRAY_BINDING),
};

/// Values that exist once a draw buffer, viewport, or binding point.
constexpr std::array kOfDrawBuffers = {
    Name NAME(GL_BLEND_SRC_RGB),
    Name NAME(GL_BLEND_DST_RGB),
    Name NAME(GL_BLEND_SRC_ALPHA),
    Name NAME(GL_BLEND_DST_ALPHA),
    Name NAME(GL_BLEND_EQUATION_RGB),
    Name NAME(GL_BLEND_EQUATION_ALPHA),
    Name NAME(GL_COLOR_WRITEMASK),
};
constexpr std::array kOfViewports = {
    Name NAME(GL_VIEWPORT),
    Name NAME(GL_SCISSOR_BOX),
    Name NAME(GL_DEPTH_RANGE),
};
constexpr std::array kOfBindingPoints = {
    Name NAME(GL_UNIFORM_BUFFER_BINDING),
    Name NAME(GL_SHADER_STORAGE_BUFFER_BINDING),
    Name NAME(GL_ATOMIC_COUNTER_BUFFER_BINDING),
    Name NAME(GL_IMAGE_BINDING_NAME),
};
constexpr std::array kOfTextureUnits = {
    Name NAME(GL_TEXTURE_BINDING_1D),
    Name NAME(GL_TEXTURE_BINDING_2D),
    Name NAME(GL_TEXTURE_BINDING_3D),
    Name NAME(GL_TEXTURE_BINDING_1D_ARRAY),
    Name NAME(GL_TEXTURE_BINDING_2D_ARRAY),
    Name NAME(GL_TEXTURE_BINDING_CUBE_MAP),
    Name NAME(GL_TEXTURE_BINDING_RECTANGLE),
    Name NAME(GL_TEXTURE_BINDING_BUFFER),
    Name NAME(GL_TEXTURE_BINDING_2D_MULTISAMPLE),
    Name NAME(GL_SAMPLER_BINDING),
};
#undef NAME

/// Most values of one state.
using Values = std::array<double, 4>;

struct State {
    std::string name;
    Values values{};
};

GLint integer(GLenum name) {
    GLint value = 0;
    glGetIntegerv(name, &value);
    return value;
}

/// All that OpenGL tells about its state.
std::vector<State> snapshot() {
    std::vector<State> states;
    const auto add = [&](const std::string& name, const Values& values) {
        states.push_back({name, values});
        // A misspelt query would compare equal for ever.
        const GLenum error = glGetError();
        INFO(name);
        REQUIRE(error == GL_NO_ERROR);
    };
    const auto add_indexed = [&](const auto& names, GLuint count) {
        for (const Name& name : names) {
            for (GLuint index = 0; index < count; ++index) {
                Values values{};
                glGetDoublei_v(name.value, index, values.data());
                add(std::string(name.text) + "[" + std::to_string(index) + "]", values);
            }
        }
    };
    for (const Name& name : kSwitches) {
        add(name.text, {static_cast<double>(glIsEnabled(name.value))});
    }
    for (GLuint index = 0; index < kUnits; ++index) {
        const std::string suffix = "[" + std::to_string(index) + "]";
        add("GL_BLEND" + suffix, {static_cast<double>(glIsEnabledi(GL_BLEND, index))});
        add("GL_SCISSOR_TEST" + suffix,
            {static_cast<double>(glIsEnabledi(GL_SCISSOR_TEST, index))});
        GLint mask = 0;
        glGetIntegeri_v(GL_SAMPLE_MASK_VALUE, 0, &mask);
        add("GL_SAMPLE_MASK_VALUE", {static_cast<double>(mask)});
    }
    for (const Name& name : kValues) {
        Values values{};
        glGetDoublev(name.value, values.data());
        add(name.text, values);
    }
    add_indexed(kOfDrawBuffers, kUnits);
    add_indexed(kOfViewports, kUnits);
    add_indexed(kOfBindingPoints, kUnits);
    const GLint active = integer(GL_ACTIVE_TEXTURE);
    for (GLuint unit = 0; unit < kTextureUnits; ++unit) {
        glActiveTexture(GL_TEXTURE0 + unit);
        for (const Name& name : kOfTextureUnits) {
            add(std::string(name.text) + " of unit " + std::to_string(unit),
                {static_cast<double>(integer(name.value))});
        }
    }
    glActiveTexture(static_cast<GLenum>(active));
    return states;
}

/// Names of the states that differ, each printed with its values.
std::set<std::string> differences(const std::vector<State>& a, const std::vector<State>& b) {
    REQUIRE(a.size() == b.size());
    std::set<std::string> names;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (a[i].values != b[i].values) {
            names.insert(a[i].name);
            UNSCOPED_INFO(
                a[i].name << " was " << a[i].values[0] << ", " << a[i].values[1] << ", "
                          << a[i].values[2] << ", " << a[i].values[3] << " and is "
                          << b[i].values[0] << ", " << b[i].values[1] << ", " << b[i].values[2]
                          << ", " << b[i].values[3]
            );
        }
    }
    return names;
}

void check_unchanged(const std::vector<State>& before, const char* what) {
    const std::vector<State> after = snapshot();
    INFO(what);
    const std::set<std::string> changed = differences(before, after);
    CHECK(changed.empty());
}

GLuint make_program() {
    constexpr const char* kText = "#version 450 core\nvoid main() { gl_Position = vec4(0.0); }\n";
    const GLuint shader = glCreateShader(GL_VERTEX_SHADER);
    glShaderSource(shader, 1, &kText, nullptr);
    glCompileShader(shader);
    const GLuint program = glCreateProgram();
    glAttachShader(program, shader);
    glLinkProgram(program);
    glDeleteShader(shader);
    GLint linked = GL_FALSE;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    REQUIRE(linked == GL_TRUE);
    return program;
}

/// Sets everything above to what nobody would expect. Objects live as long as the context.
void set_unusual_state() {
    for (const Name& name : kSwitches) {
        if (glIsEnabled(name.value) == GL_TRUE) {
            glDisable(name.value);
        } else {
            glEnable(name.value);
        }
    }
    glDisablei(GL_BLEND, 1);
    glDisablei(GL_SCISSOR_TEST, 2);
    const std::array<GLenum, kUnits> factors = {
        GL_DST_COLOR, GL_ONE_MINUS_SRC_COLOR, GL_SRC_ALPHA_SATURATE, GL_CONSTANT_ALPHA};
    for (GLuint i = 0; i < kUnits; ++i) {
        const auto f = static_cast<GLfloat>(i);
        glBlendFuncSeparatei(i, factors[i], GL_ZERO, GL_DST_ALPHA, factors[(i + 1) % kUnits]);
        glBlendEquationSeparatei(i, GL_FUNC_REVERSE_SUBTRACT, GL_MIN);
        glColorMaski(i, GL_FALSE, i % 2 == 0 ? GL_TRUE : GL_FALSE, GL_FALSE, GL_TRUE);
        glViewportIndexedf(i, 1.5F + f, 2.25F, 17.5F, 19.0F + f);
        glScissorIndexed(i, 3 + static_cast<GLint>(i), 1, 2, 5);
        glDepthRangeIndexed(i, 0.75, 0.25 + 0.125 * i);
    }
    glBlendColor(0.125F, 0.25F, 0.5F, 0.75F);
    glClearColor(0.25F, 0.5F, 0.75F, 0.125F);
    glClearDepth(0.375);
    glClearStencil(5);
    glDepthFunc(GL_NOTEQUAL);
    glDepthMask(GL_FALSE);
    glStencilFuncSeparate(GL_FRONT, GL_NEVER, 3, 0x55U);
    glStencilFuncSeparate(GL_BACK, GL_LESS, 4, 0x33U);
    glStencilOpSeparate(GL_FRONT, GL_INVERT, GL_INCR, GL_DECR);
    glStencilOpSeparate(GL_BACK, GL_ZERO, GL_REPLACE, GL_INCR_WRAP);
    glStencilMaskSeparate(GL_FRONT, 0x0FU);
    glStencilMaskSeparate(GL_BACK, 0xF0U);
    glLogicOp(GL_NAND);
    glCullFace(GL_FRONT_AND_BACK);
    glFrontFace(GL_CW);
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    glPolygonOffset(3.0F, 7.0F);
    glLineWidth(1.0F);
    glPointSize(3.0F);
    glPointParameterf(GL_POINT_FADE_THRESHOLD_SIZE, 5.0F);
    glHint(GL_LINE_SMOOTH_HINT, GL_NICEST);
    glSampleCoverage(0.25F, GL_TRUE);
    glSampleMaski(0, 0x2U);
    glMinSampleShading(0.5F);
    glPrimitiveRestartIndex(2);
    glProvokingVertex(GL_FIRST_VERTEX_CONVENTION);
    glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
    glPatchParameteri(GL_PATCH_VERTICES, 4);
    for (const GLenum name : {GL_PACK_ALIGNMENT, GL_UNPACK_ALIGNMENT}) {
        glPixelStorei(name, 8);
    }
    for (const GLenum name :
         {GL_PACK_ROW_LENGTH,
          GL_PACK_SKIP_PIXELS,
          GL_PACK_SKIP_ROWS,
          GL_UNPACK_ROW_LENGTH,
          GL_UNPACK_SKIP_PIXELS,
          GL_UNPACK_SKIP_ROWS}) {
        glPixelStorei(name, 1000);
    }
    for (const GLenum name :
         {GL_PACK_LSB_FIRST, GL_PACK_SWAP_BYTES, GL_UNPACK_LSB_FIRST, GL_UNPACK_SWAP_BYTES}) {
        glPixelStorei(name, GL_TRUE);
    }

    GLuint array = 0;
    glCreateVertexArrays(1, &array);
    glBindVertexArray(array);
    for (const GLenum target :
         {GL_ARRAY_BUFFER,
          GL_COPY_READ_BUFFER,
          GL_COPY_WRITE_BUFFER,
          GL_DISPATCH_INDIRECT_BUFFER,
          GL_DRAW_INDIRECT_BUFFER,
          GL_ELEMENT_ARRAY_BUFFER,
          GL_PIXEL_PACK_BUFFER,
          GL_PIXEL_UNPACK_BUFFER,
          GL_SHADER_STORAGE_BUFFER,
          GL_UNIFORM_BUFFER}) {
        GLuint buffer = 0;
        glCreateBuffers(1, &buffer);
        glNamedBufferStorage(buffer, 1024, nullptr, 0);
        glBindBuffer(target, buffer);
    }
    for (GLuint i = 0; i < kUnits; ++i) {
        GLuint buffer = 0;
        glCreateBuffers(1, &buffer);
        glNamedBufferStorage(buffer, 1024, nullptr, 0);
        glBindBufferBase(GL_UNIFORM_BUFFER, i, buffer);
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, i, buffer);
        glBindBufferBase(GL_ATOMIC_COUNTER_BUFFER, i, buffer);
    }
    for (GLuint i = 0; i < kTextureUnits; ++i) {
        for (const GLenum target :
             {GL_TEXTURE_1D,
              GL_TEXTURE_2D,
              GL_TEXTURE_3D,
              GL_TEXTURE_1D_ARRAY,
              GL_TEXTURE_2D_ARRAY,
              GL_TEXTURE_CUBE_MAP,
              GL_TEXTURE_RECTANGLE,
              GL_TEXTURE_BUFFER,
              GL_TEXTURE_2D_MULTISAMPLE}) {
            GLuint texture = 0;
            glCreateTextures(target, 1, &texture);
            if (target == GL_TEXTURE_2D) {
                glTextureStorage2D(texture, 1, GL_RGBA8, 4, 4);
                if (i < kUnits) {
                    glBindImageTexture(i, texture, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA8);
                }
            }
            glBindTextureUnit(i, texture);
        }
        GLuint sampler = 0;
        glCreateSamplers(1, &sampler);
        // It would spoil every texture read through it.
        glSamplerParameteri(sampler, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
        glSamplerParameteri(sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
        glBindSampler(i, sampler);
    }
    glActiveTexture(GL_TEXTURE2);
    std::array<GLuint, 2> framebuffers{};
    glCreateFramebuffers(2, framebuffers.data());
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, 1, GL_RGBA8, 4, 4);
    glNamedFramebufferTexture(framebuffers[1], GL_COLOR_ATTACHMENT1, texture, 0);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffers[0]);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffers[1]);
    glReadBuffer(GL_COLOR_ATTACHMENT1);
    GLuint renderbuffer = 0;
    glCreateRenderbuffers(1, &renderbuffer);
    glBindRenderbuffer(GL_RENDERBUFFER, renderbuffer);
    GLuint feedback = 0;
    glCreateTransformFeedbacks(1, &feedback);
    glBindTransformFeedback(GL_TRANSFORM_FEEDBACK, feedback);
    GLuint pipeline = 0;
    glCreateProgramPipelines(1, &pipeline);
    glBindProgramPipeline(pipeline);
    glUseProgram(make_program());
    const GLenum error = glGetError();
    REQUIRE(error == GL_NO_ERROR);
}

ImageCacheOptions eager_options(int samples) {
    ImageCacheOptions options = presets::shade1996();
    options.costs.triangle_s = 1e-6;
    options.page_size = 256;
    options.image_samples = samples;
    options.surfaces = SurfacePlacement::in_images;
    return options;
}

/// Frames of a cache, so that pages are made, images are made from images, and clipped ones too;
/// then images with depths; then splats, cubes and single primitives; then a layered image among
/// geometry; then projected keyframes.
std::vector<Picture> walk_pictures(
    Backend& backend, const SmallWorld& world, int samples, const std::function<void()>& before
) {
    std::vector<Picture> pictures;
    auto cache = ImageCache::create(world.hierarchy, eager_options(samples));
    REQUIRE(cache.has_value());
    before();
    const auto target = backend.create_target(kWidth, kHeight, samples);
    REQUIRE(target.has_value());
    for (int frame = 0; frame < 40; frame += 8) {
        const FramePlan& plan =
            cache->plan(small_walk(frame, kWidth, kHeight), small_walk_motion());
        const auto executed = backend.execute(plan, *target, {});
        if (!executed) {
            FAIL(executed.error().message);
        }
        pictures.push_back(backend.read_target(*target).value());
    }
    CHECK(cache->statistics().images_shown > 0);
    for (const QuadDepth depth : {QuadDepth::plane, QuadDepth::texel}) {
        FramePlan plan = plan_with_depths(depth);
        plan.cache = 1;
        plan.pages[0].samples = samples;
        const auto executed = backend.execute(plan, *target, {});
        if (!executed) {
            FAIL(executed.error().message);
        }
        pictures.push_back(backend.read_target(*target).value());
        CHECK(pictures.back() != pictures.front());
    }
    const auto cells = backend.execute(plan_with_cells(), *target, {});
    if (!cells) {
        FAIL(cells.error().message);
    }
    pictures.push_back(backend.read_target(*target).value());
    const LayeredDepthImage image = flat_layers(6.0, {90, 160, 30, 255});
    FramePlan layered = plan_with_layers(image);
    layered.items = {ItemId{0}};
    layered.commands.push_back(items_command(0, 1));
    layered.commands.push_back(layered.commands[0]);
    layered.passes[0].command_count = 3;
    const auto layers = backend.execute(layered, *target, {});
    if (!layers) {
        FAIL(layers.error().message);
    }
    pictures.push_back(backend.read_target(*target).value());
    CHECK(pictures.back() != pictures[pictures.size() - 2]);
    for (const bool whole_triangles : {false, true}) {
        FramePlan plan = plan_with_keyframe();
        plan.cache = 2;
        plan.pages[0].samples = samples;
        plan.commands[0].count = 0; // sees nothing: geometry has its own colours
        constexpr double kAboveGround = 2.0;
        plan.passes[0].view.eye.y = kAboveGround;
        plan.passes[1].view.eye.y = kAboveGround;
        plan.keyframes[0].view.eye.y = kAboveGround;
        plan.keyframes.resize(kMostKeyframes, plan.keyframes[0]);
        plan.commands[1].keyframe_count = kMostKeyframes;
        plan.commands[1].whole_triangles = whole_triangles;
        for (int i = 0; i < 2; ++i) {
            const auto executed = backend.execute(plan, *target, {});
            if (!executed) {
                FAIL(executed.error().message);
            }
            pictures.push_back(backend.read_target(*target).value());
            plan.commands[0].count = 1;
        }
    }
    backend.destroy_target(*target);
    return pictures;
}

/// Leaves every state as unusual as it can after each draw, as an engine's renderer might.
class RudeSource final : public GeometrySource {
  public:
    explicit RudeSource(GeometrySource& source) : source_(&source) {}
    [[nodiscard]] Capabilities capabilities() const noexcept override {
        return source_->capabilities();
    }
    [[nodiscard]] Result<void> prepare_projection(
        std::size_t keyframes, bool whole_triangles, bool positions
    ) noexcept override {
        return source_->prepare_projection(keyframes, whole_triangles, positions);
    }
    void draw(const DrawList& list, const PassContext& context) noexcept override {
        source_->draw(list, context);
        set_unusual_state();
    }

  private:
    GeometrySource* source_;
};

} // namespace

TEST_CASE("Whatever the state is, frames are the same and the state is as before") {
    const SmallWorld world = make_world(small_scene());
    const opengl::OpenGLBackendOptions options = {
        .layers = GENERATE(opengl::LayerDrawing::points, opengl::LayerDrawing::warped)};
    const auto device = Device::create(world.scene, &world.hierarchy, options);
    if (device == nullptr) {
        return;
    }
    const int samples = GENERATE(1, 4);
    if (samples > device->backend->limits().samples) {
        return;
    }
    const std::vector<State> start = snapshot();
    const std::vector<Picture> usual = walk_pictures(*device->backend, world, samples, [] {});
    check_unchanged(start, "in the state that a context begins with");
    set_unusual_state();
    std::vector<State> before = snapshot();
    {
        // The test itself must have set what it looks at. Lines have one width, and references are
        // told modulo the stencil bits of the framebuffer, which has none.
        const std::set<std::string> changed = differences(start, before);
        const std::set<std::string> constant = {
            "GL_LINE_WIDTH", "GL_STENCIL_REF", "GL_STENCIL_BACK_REF"};
        for (const State& state : start) {
            const bool per_unit = state.name.find('[') != std::string::npos;
            INFO(state.name);
            CHECK((changed.count(state.name) == 1 || constant.count(state.name) == 1 || per_unit));
        }
    }
    const std::vector<Picture> unusual =
        walk_pictures(*device->backend, world, samples, [&] { before = snapshot(); });
    check_unchanged(before, "targets, plans and reading");
    CHECK(usual == unusual);

    // Creating sources and backends, and destroying them.
    {
        const auto source = opengl::SceneSource::create(world.scene, &world.hierarchy);
        REQUIRE(source.has_value());
        check_unchanged(before, "creating a scene source");
        const auto backend = opengl::OpenGLBackend::create(**source, options);
        REQUIRE(backend.has_value());
        check_unchanged(before, "creating a backend");
        CHECK(walk_pictures(**backend, world, samples, [] {}) == usual);
        check_unchanged(before, "another backend's plans");
    }
    check_unchanged(before, "destroying both");

    // Plans that are refused.
    const auto target = device->backend->create_target(kFrameSize, kFrameSize, 1);
    FramePlan wrong = plan_with_image();
    wrong.quads[0].page = PageId{33};
    REQUIRE_FALSE(device->backend->execute(wrong, *target, {}).has_value());
    check_unchanged(before, "a plan that is refused");
}

TEST_CASE("A scene source changes only what it says") {
    const SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    set_unusual_state();
    const View view = small_walk(0, kWidth, kHeight);
    std::vector<ItemId> items;
    for (std::size_t i = 1; i < world.scene.instances.size(); ++i) {
        items.push_back(make_id<ItemId>(i));
    }
    PassContext context{.view = view, .origin = {}, .clip = {}, .color = true};
    const Keyframe keyframe = plan_with_keyframe().keyframes[0];
    std::array<DeviceKeyframe, 2> keyframes{};
    for (DeviceKeyframe& shown : keyframes) {
        shown.keyframe = &keyframe;
        shown.page_size = 1;
        glCreateTextures(GL_TEXTURE_2D, 1, &shown.colors);
        glTextureStorage2D(shown.colors, 1, GL_RGBA8, 1, 1);
        glCreateTextures(GL_TEXTURE_2D, 1, &shown.depths);
        glTextureStorage2D(shown.depths, 1, GL_R16UI, 1, 1);
    }
    for (const bool projects : {false, true}) {
        for (const bool whole : {false, true}) {
            const std::vector<State> before = snapshot();
            REQUIRE(device->source->prepare_projection(2, whole, projects).has_value());
            CHECK(differences(before, snapshot()).empty());
        }
        if (projects) {
            context.clip = Box3f{glm::vec3(-20.0F), glm::vec3(20.0F)};
            context.keyframes = keyframes;
        }
        // Onto nothing: of interest is what is left.
        const std::vector<State> before = snapshot();
        const std::array<std::uint32_t, 3> selected = {5, 0, 8};
        const std::array<Selection, 2> selections = {
            {{ItemId{0}, 0, 3}, {make_id<ItemId>(world.scene.instances.size() - 1), 1, 2}}};
        device->source->draw({items, world.hierarchy.pieces, selections, selected}, context);
        while (glGetError() != GL_NO_ERROR) {
        }
        std::set<std::string> changed = differences(before, snapshot());
        for (const char* allowed :
             {"GL_CURRENT_PROGRAM",
              "GL_VERTEX_ARRAY_BINDING",
              "GL_ELEMENT_ARRAY_BUFFER_BINDING",
              "GL_TEXTURE_BINDING_2D of unit 0",
              "GL_CLIP_DISTANCE0",
              "GL_CLIP_DISTANCE1",
              "GL_CLIP_DISTANCE2",
              "GL_CLIP_DISTANCE3",
              "GL_CLIP_DISTANCE4",
              "GL_CLIP_DISTANCE5"}) {
            changed.erase(allowed);
        }
        const std::set<std::string> projecting = {
            "GL_TEXTURE_BINDING_2D of unit 1",
            "GL_TEXTURE_BINDING_2D of unit 2",
            "GL_TEXTURE_BINDING_2D of unit 5",
            "GL_TEXTURE_BINDING_2D of unit 6"};
        CHECK(changed == (projects ? projecting : std::set<std::string>()));
    }
}

TEST_CASE("A source that leaves any state behind spoils nothing") {
    const SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    RudeSource rude(*device->source);
    const auto backend = opengl::OpenGLBackend::create(rude);
    REQUIRE(backend.has_value());
    const auto expected = walk_pictures(*device->backend, world, 1, [] {});
    CHECK(walk_pictures(**backend, world, 1, [] {}) == expected);
}

TEST_CASE("A framebuffer of the caller's is drawn into and read") {
    const SmallWorld world = make_world(small_scene());
    const auto device = Device::create(world.scene, &world.hierarchy);
    if (device == nullptr) {
        return;
    }
    opengl::OpenGLBackend& backend = *device->backend;
    const int samples = GENERATE(1, 4);
    const int stored = samples > 1 ? samples : 0;
    std::array<GLuint, 2> buffers{};
    glCreateRenderbuffers(2, buffers.data());
    glNamedRenderbufferStorageMultisample(buffers[0], stored, GL_RGBA8, kWidth, kHeight);
    glNamedRenderbufferStorageMultisample(
        buffers[1], stored, GL_DEPTH_COMPONENT32F, kWidth, kHeight
    );
    GLuint framebuffer = 0;
    glCreateFramebuffers(1, &framebuffer);

    const auto refused = [&](GLuint name, const char* why) {
        const auto wrapped = backend.wrap_framebuffer(name, kWidth, kHeight);
        REQUIRE_FALSE(wrapped.has_value());
        CHECK(wrapped.error().code == ErrorCode::invalid_argument);
        CHECK(wrapped.error().message.find(why) != std::string::npos);
    };
    refused(framebuffer, "not complete");
    refused(12345, "does not exist");
    refused(0, "not complete"); // there is no window here
    glNamedFramebufferRenderbuffer(framebuffer, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffers[0]);
    refused(framebuffer, "no depth attachment");
    glNamedFramebufferRenderbuffer(framebuffer, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, buffers[1]);
    CHECK_FALSE(backend.wrap_framebuffer(framebuffer, 0, kHeight).has_value());

    const auto wrapped = backend.wrap_framebuffer(framebuffer, kWidth, kHeight);
    REQUIRE(wrapped.has_value());
    CulledGeometry geometry(world.hierarchy);
    const FramePlan& plan = geometry.plan(small_walk(0, kWidth, kHeight));
    REQUIRE(backend.execute(plan, *wrapped, {}).has_value());
    // Its read buffer is the caller's affair.
    glNamedFramebufferReadBuffer(framebuffer, GL_NONE);
    const auto read = backend.read_target(*wrapped);
    REQUIRE(read.has_value());
    CHECK(*read == draw(backend, plan, kWidth, kHeight, samples));
    FramePlan cell_plan = plan_with_cells();
    cell_plan.passes[0].view.width = kWidth;
    cell_plan.passes[0].view.height = kHeight;
    cell_plan.passes[0].viewport = {0, 0, kWidth, kHeight};
    cell_plan.passes[0].scissor = cell_plan.passes[0].viewport;
    REQUIRE(backend.execute(cell_plan, *wrapped, {}).has_value());
    const auto cells = backend.read_target(*wrapped);
    REQUIRE(cells.has_value());
    CHECK(*cells == draw(backend, cell_plan, kWidth, kHeight, samples));
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    CHECK(integer(GL_READ_BUFFER) == GL_NONE);
    backend.destroy_target(*wrapped);
    CHECK(glIsFramebuffer(framebuffer) == GL_TRUE);
    CHECK_FALSE(backend.read_target(*wrapped).has_value());
}
