#include "support/skip.hpp"
#include <farfield/opengl/context.hpp>

#include <catch2/catch.hpp>
#include <epoxy/gl.h>

#include <array>
#include <cstdint>
#include <utility>

using namespace farfield;
using opengl::HeadlessContext;
using opengl::HeadlessPlatform;

namespace {

/// Clears one texel and reads it back: what a context that is not current, or has no device behind
/// it, does not do.
std::uint8_t drawn_red() {
    GLuint color = 0;
    GLuint framebuffer = 0;
    glCreateRenderbuffers(1, &color);
    glNamedRenderbufferStorage(color, GL_RGBA8, 1, 1);
    glCreateFramebuffers(1, &framebuffer);
    glNamedFramebufferRenderbuffer(framebuffer, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
    constexpr std::array<GLfloat, 4> kRed = {1.0F, 0.0F, 0.0F, 1.0F};
    glClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, kRed.data());
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    std::array<std::uint8_t, 4> texel{};
    glReadPixels(0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, texel.data());
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteRenderbuffers(1, &color);
    return texel[0];
}

/// Whether there is a context of this platform; where there is one it has to draw.
bool draws(HeadlessPlatform platform) {
    const auto context = HeadlessContext::create(platform);
    if (!context) {
        INFO(context.error().message);
        CHECK(context.error().message.starts_with("EGL: "));
        return false;
    }
    CHECK(epoxy_gl_version() >= 45);
    CHECK(drawn_red() == 255);
    CHECK(glGetError() == GL_NO_ERROR);
    return true;
}

} // namespace

TEST_CASE("A context comes from any platform that has one") {
    const bool surfaceless = draws(HeadlessPlatform::surfaceless);
    const bool device = draws(HeadlessPlatform::device);
    CHECK(draws(HeadlessPlatform::any) == (surfaceless || device));
    if (!surfaceless && !device) {
        support::skip("neither a surfaceless platform nor a device has a context");
    }
}

TEST_CASE("A context may be made again, and moved") {
    for (const auto platform : {HeadlessPlatform::surfaceless, HeadlessPlatform::device}) {
        if (!draws(platform)) {
            continue;
        }
        auto first = HeadlessContext::create(platform);
        REQUIRE(first.has_value());
        const HeadlessContext second = std::move(*first);
        CHECK(drawn_red() == 255);
    }
}
