#pragma once

#include <farfield/gpu/backend.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/scene/scene.hpp>

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
};

/// Defined by each program that what every backend draws alike is tested in. Null where its tests
/// are skipped.
[[nodiscard]] std::unique_ptr<Drawer>
make_drawer(const Scene& scene, const Hierarchy* hierarchy = nullptr);

} // namespace farfield::support
