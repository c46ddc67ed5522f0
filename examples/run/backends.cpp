#include "run/backends.hpp"

#include <farfield/embree/embree_backend.hpp>
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/opengl/opengl_backend.hpp>
#include <farfield/parallel/parallel_executor.hpp>

#include <utility>

namespace farfield::run {

Result<std::unique_ptr<Backend>> Backends::make_opengl(bool positions) {
    if (!context_) {
        auto context = opengl::HeadlessContext::create();
        if (!context) {
            return tl::unexpected(context.error());
        }
        context_.emplace(std::move(*context));
    }
    if (!source_) {
        auto source = opengl::SceneSource::create(world_->scene, &world_->hierarchy);
        if (!source) {
            return tl::unexpected(source.error());
        }
        source_ = std::move(*source);
    }
    if (!executor_) {
        executor_ = std::make_unique<parallel::ParallelExecutor>();
    }
    auto backend = opengl::OpenGLBackend::create(
        *source_, {.positions = positions, .layers = layers_, .executor = executor_.get()}
    );
    if (!backend) {
        return tl::unexpected(backend.error());
    }
    return std::unique_ptr<Backend>(std::move(*backend));
}

Result<Backend*> Backends::make(const std::string& name, bool positions) {
    std::unique_ptr<Backend> made;
    if (name == "opengl") {
        auto backend = make_opengl(positions);
        if (!backend) {
            return tl::unexpected(backend.error());
        }
        made = std::move(*backend);
    } else if (name == "embree") {
        auto backend = embree::EmbreeBackend::create(
            world_->scene, &world_->hierarchy, {.threads = 0, .positions = positions}
        );
        if (!backend) {
            return tl::unexpected(backend.error());
        }
        casting_.push_back(backend->get());
        made = std::move(*backend);
    } else if (name == "null") {
        Backend::Limits limits = NullBackend::kDefaultLimits;
        limits.positions = positions;
        made = std::make_unique<NullBackend>(world_->item_primitives, &world_->hierarchy, limits);
    } else {
        return fail(
            ErrorCode::invalid_argument,
            "backend \"" + name + "\" does not exist, expected opengl, embree or null"
        );
    }
    backends_.push_back(std::move(made));
    return backends_.back().get();
}

Result<void> Backends::move() {
    for (const Mover& mover : world_->movers) {
        const glm::dmat4x3& place = world_->scene.instances[index_of(mover.item)].object_to_world;
        if (source_) {
            if (Result<void> moved = source_->set_transform(mover.item, place); !moved) {
                return moved;
            }
        }
        for (embree::EmbreeBackend* backend : casting_) {
            if (Result<void> moved = backend->set_transform(mover.item, place); !moved) {
                return moved;
            }
        }
    }
    return {};
}

} // namespace farfield::run
