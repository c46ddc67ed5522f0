#pragma once

#include "gpu/drawing.hpp"
#include <farfield/embree/embree_backend.hpp>
#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>

#include <memory>
#include <utility>

namespace farfield::support {

inline std::unique_ptr<embree::EmbreeBackend> make_caster(
    const Scene& scene,
    const Hierarchy* hierarchy = nullptr,
    const embree::EmbreeBackendOptions& options = {.threads = 2}
) {
    auto backend = embree::EmbreeBackend::create(scene, hierarchy, options);
    if (!backend) {
        FAIL(backend.error().message);
    }
    return std::move(*backend);
}

} // namespace farfield::support
