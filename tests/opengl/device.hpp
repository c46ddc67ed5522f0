#pragma once

#include "gpu/drawing.hpp"
#include "support/skip.hpp"
#include <farfield/gpu/backend.hpp>
#include <farfield/opengl/context.hpp>
#include <farfield/opengl/opengl_backend.hpp>
#include <farfield/opengl/scene_source.hpp>
#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>

#include <memory>
#include <optional>
#include <utility>

namespace farfield::support {

/// A context, or a skipped test.
inline std::optional<opengl::HeadlessContext> make_context() {
    auto context = opengl::HeadlessContext::create();
    if (!context) {
        skip(context.error().message.c_str());
        return std::nullopt;
    }
    return std::move(*context);
}

/// A scene on a device, ready to be drawn. Members go in the reverse order.
struct Device {
    opengl::HeadlessContext context;
    std::unique_ptr<opengl::SceneSource> source;
    std::unique_ptr<opengl::OpenGLBackend> backend;

    /// Null where the test is skipped.
    static std::unique_ptr<Device> create(
        const Scene& scene,
        const Hierarchy* hierarchy = nullptr,
        const opengl::OpenGLBackendOptions& options = {}
    ) {
        auto context = make_context();
        if (!context) {
            return nullptr;
        }
        auto source = opengl::SceneSource::create(scene, hierarchy);
        REQUIRE(source.has_value());
        auto backend = opengl::OpenGLBackend::create(**source, options);
        REQUIRE(backend.has_value());
        return std::make_unique<Device>(Device{
            std::move(*context), std::move(*source), std::move(*backend)});
    }
};

} // namespace farfield::support
