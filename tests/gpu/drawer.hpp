#pragma once

#include <farfield/gpu/backend.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <memory>

namespace farfield::support {

/// A scene on the backend that a test program is about.
class Drawer {
  public:
    Drawer() = default;
    Drawer(const Drawer&) = delete;
    Drawer& operator=(const Drawer&) = delete;
    virtual ~Drawer() = default;

    [[nodiscard]] virtual Backend& backend() = 0;
    /// Of what draws the scene.
    [[nodiscard]] virtual Result<void>
    set_transform(ItemId item, const glm::dmat4x3& object_to_world) = 0;
};

/// Defined by each program that what every backend draws alike is tested in. Null where its tests
/// are skipped.
/// @param positions the backend keeps them
[[nodiscard]] std::unique_ptr<Drawer>
make_drawer(const Scene& scene, const Hierarchy* hierarchy = nullptr, bool positions = false);

} // namespace farfield::support
