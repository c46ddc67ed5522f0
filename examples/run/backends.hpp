#pragma once

#include "run/world.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/core/result.hpp>
#include <farfield/embree/embree_backend.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/opengl/context.hpp>
#include <farfield/opengl/opengl_backend.hpp>
#include <farfield/opengl/scene_source.hpp>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace farfield::run {

/// Makes backends over one world by name, and keeps them. What they share, an OpenGL context and
/// the scene on the device, is made when it is first needed.
class Backends {
  public:
    /// @param world must outlive the backends
    /// @param layers how OpenGL draws layered images
    explicit Backends(
        const World& world, opengl::LayerDrawing layers = opengl::LayerDrawing::warped
    )
        : world_(&world), layers_(layers) {}

    /// @param name opengl, embree or null @param positions keeps positions, for measuring
    [[nodiscard]] Result<Backend*> make(const std::string& name, bool positions = false);

    /// Tells all of them where the world's movers are now.
    [[nodiscard]] Result<void> move();

  private:
    [[nodiscard]] Result<std::unique_ptr<Backend>> make_opengl(bool positions);

    const World* world_;
    opengl::LayerDrawing layers_;
    std::unique_ptr<Executor> executor_; ///< that warps, where there is one
    std::optional<opengl::HeadlessContext> context_;
    std::unique_ptr<opengl::SceneSource> source_;
    std::vector<std::unique_ptr<Backend>> backends_;
    std::vector<embree::EmbreeBackend*> casting_; ///< of `backends_`
};

} // namespace farfield::run
