#include "gpu/drawer.hpp"

#include "embree/casting.hpp"

#include <utility>

namespace farfield::support {

namespace {

class CastDrawer final : public Drawer {
  public:
    explicit CastDrawer(std::unique_ptr<embree::EmbreeBackend> caster)
        : caster_(std::move(caster)) {}
    [[nodiscard]] Backend& backend() override { return *caster_; }
    [[nodiscard]] Result<void>
    set_transform(ItemId item, const glm::dmat4x3& object_to_world) override {
        return caster_->set_transform(item, object_to_world);
    }

  private:
    std::unique_ptr<embree::EmbreeBackend> caster_;
};

} // namespace

std::unique_ptr<Drawer>
make_drawer(const Scene& scene, const Hierarchy* hierarchy, bool positions) {
    return std::make_unique<CastDrawer>(
        make_caster(scene, hierarchy, {.threads = 2, .positions = positions})
    );
}

} // namespace farfield::support
