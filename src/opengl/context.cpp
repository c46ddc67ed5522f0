#include <farfield/opengl/context.hpp>

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <cstdio>
#include <cstring>
#include <string>
#include <utility>

namespace farfield::opengl {

struct HeadlessContext::Impl {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;

    Impl() = default;
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;
    ~Impl() {
        if (context != EGL_NO_CONTEXT) {
            eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
            eglDestroyContext(display, context);
        }
        // The display stays: it is the process's, and other contexts on it would go with it.
    }
};

namespace {

tl::unexpected<Error> egl_error(const char* step) {
    char code[16];
    std::snprintf(code, sizeof code, "0x%04x", static_cast<unsigned>(eglGetError()));
    return fail(ErrorCode::device, std::string("EGL: ") + step + " failed with " + code);
}

} // namespace

HeadlessContext::HeadlessContext(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
HeadlessContext::HeadlessContext(HeadlessContext&& other) noexcept = default;
HeadlessContext& HeadlessContext::operator=(HeadlessContext&& other) noexcept = default;
HeadlessContext::~HeadlessContext() = default;

Result<HeadlessContext> HeadlessContext::create() {
    auto impl = std::make_unique<Impl>();
    if (!epoxy_has_egl()) {
        return fail(ErrorCode::device, "EGL: no EGL library on this system");
    }
    // Client extensions; asking for a function that is not there ends the process.
    const char* known = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    for (const char* needed : {"EGL_EXT_platform_base", "EGL_MESA_platform_surfaceless"}) {
        if (known == nullptr || std::strstr(known, needed) == nullptr) {
            return fail(
                ErrorCode::unsupported, std::string("EGL: no extension ") + needed + " here"
            );
        }
    }
    impl->display =
        eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (impl->display == EGL_NO_DISPLAY) {
        return egl_error("opening the surfaceless display");
    }
    if (eglInitialize(impl->display, nullptr, nullptr) == EGL_FALSE) {
        return egl_error("initialising the surfaceless display");
    }
    if (eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) {
        return egl_error("choosing OpenGL");
    }
    const EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,
        4,
        EGL_CONTEXT_MINOR_VERSION,
        5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
        EGL_NONE};
    // A surfaceless display announces no configurations; none is needed to draw into framebuffers.
    impl->context = eglCreateContext(impl->display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (impl->context == EGL_NO_CONTEXT) {
        return egl_error("creating an OpenGL 4.5 core context");
    }
    if (eglMakeCurrent(impl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, impl->context) == EGL_FALSE) {
        return egl_error("making the context current");
    }
    return HeadlessContext(std::move(impl));
}

} // namespace farfield::opengl
