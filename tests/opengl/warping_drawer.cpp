#include "gpu/drawer.hpp"
#include "opengl/device.hpp"

#include <utility>

namespace farfield::support {

namespace {

class WarpingDrawer final : public Drawer {
  public:
    explicit WarpingDrawer(std::unique_ptr<Device> device) : device_(std::move(device)) {}
    [[nodiscard]] Backend& backend() override { return *device_->backend; }
    [[nodiscard]] Result<void>
    set_transform(ItemId item, const glm::dmat4x3& object_to_world) override {
        return device_->source->set_transform(item, object_to_world);
    }

  private:
    std::unique_ptr<Device> device_;
};

} // namespace

std::unique_ptr<Drawer>
make_drawer(const Scene& scene, const Hierarchy* hierarchy, bool positions) {
    auto device = Device::create(
        scene, hierarchy, {.positions = positions, .layers = opengl::LayerDrawing::warped}
    );
    return device == nullptr ? nullptr : std::make_unique<WarpingDrawer>(std::move(device));
}

} // namespace farfield::support
