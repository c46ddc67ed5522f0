#include <farfield/opengl/context.hpp>

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

std::string failed_step(const char* step) {
    char code[16];
    std::snprintf(code, sizeof code, "0x%04x", static_cast<unsigned>(eglGetError()));
    return std::string(step) + " failed with " + code;
}

/// Whether a list of extensions has this one; none has it where there is no list.
bool offers(const char* extensions, std::string_view name) {
    std::string_view rest(extensions == nullptr ? "" : extensions);
    while (!rest.empty()) {
        const std::size_t end = rest.find(' ');
        if (rest.substr(0, end) == name) {
            return true;
        }
        rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    }
    return false;
}

/// A place where a context may be made, and what it is called in messages.
struct Place {
    EGLenum platform = 0;
    void* native = nullptr; // display or device
    std::string name;
};

/// The places to try, in order. Asking EGL for a function that it does not have ends the process,
/// so extensions are looked at first.
std::vector<Place> places(HeadlessPlatform platform) {
    std::vector<Place> found;
    const char* known = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS); // of the client
    if (!offers(known, "EGL_EXT_platform_base")) {
        return found;
    }
    if (platform != HeadlessPlatform::device && offers(known, "EGL_MESA_platform_surfaceless")) {
        found.push_back({EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, "surfaceless"});
    }
    const bool lists_devices =
        offers(known, "EGL_EXT_device_enumeration") || offers(known, "EGL_EXT_device_base");
    if (platform != HeadlessPlatform::surfaceless && lists_devices &&
        offers(known, "EGL_EXT_platform_device")) {
        EGLint count = 0;
        if (eglQueryDevicesEXT(0, nullptr, &count) == EGL_FALSE) {
            return found;
        }
        std::vector<EGLDeviceEXT> devices(static_cast<std::size_t>(count));
        if (eglQueryDevicesEXT(count, devices.data(), &count) == EGL_FALSE) {
            return found;
        }
        for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
            found.push_back({EGL_PLATFORM_DEVICE_EXT, devices[i], "device " + std::to_string(i)});
        }
    }
    return found;
}

/// Makes a context there and makes it current.
/// @return which step failed; empty where none did
std::string make_context(const Place& place, EGLDisplay& display, EGLContext& context) {
    display = eglGetPlatformDisplayEXT(place.platform, place.native, nullptr);
    if (display == EGL_NO_DISPLAY) {
        return failed_step("opening the display");
    }
    if (eglInitialize(display, nullptr, nullptr) == EGL_FALSE) {
        return failed_step("initialising the display");
    }
    if (eglBindAPI(EGL_OPENGL_API) == EGL_FALSE) {
        return failed_step("choosing OpenGL");
    }
    constexpr std::array<EGLint, 7> kAttributes = {
        EGL_CONTEXT_MAJOR_VERSION,
        4,
        EGL_CONTEXT_MINOR_VERSION,
        5,
        EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
        EGL_NONE};
    // Such displays need not announce configurations; none is needed to draw into framebuffers.
    context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kAttributes.data());
    if (context == EGL_NO_CONTEXT) {
        return failed_step("creating an OpenGL 4.5 core context");
    }
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) == EGL_FALSE) {
        std::string failed = failed_step("making the context current");
        eglDestroyContext(display, context);
        context = EGL_NO_CONTEXT;
        return failed;
    }
    return {};
}

} // namespace

HeadlessContext::HeadlessContext(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
HeadlessContext::HeadlessContext(HeadlessContext&& other) noexcept = default;
HeadlessContext& HeadlessContext::operator=(HeadlessContext&& other) noexcept = default;
HeadlessContext::~HeadlessContext() = default;

Result<HeadlessContext> HeadlessContext::create(HeadlessPlatform platform) {
    if (!epoxy_has_egl()) {
        return fail(ErrorCode::device, "EGL: no EGL library on this system");
    }
    const std::vector<Place> tried = places(platform);
    if (tried.empty()) {
        constexpr std::array<const char*, 3> kNames = {
            "surfaceless platform and no device", "surfaceless platform", "device"};
        return fail(
            ErrorCode::unsupported,
            std::string("EGL: offers no ") + kNames[static_cast<std::size_t>(platform)] + " here"
        );
    }
    auto impl = std::make_unique<Impl>();
    std::string failures;
    for (const Place& place : tried) {
        const std::string failed = make_context(place, impl->display, impl->context);
        if (failed.empty()) {
            return HeadlessContext(std::move(impl));
        }
        failures += (failures.empty() ? "" : "; ") + place.name + ": " + failed;
    }
    return fail(ErrorCode::device, "EGL: " + failures);
}

} // namespace farfield::opengl
