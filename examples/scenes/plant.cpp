#include "plant.hpp"

#include "pipe_network.hpp"
#include "plant_parts.hpp"
#include "plant_site.hpp"
#include "random.hpp"

#include <glm/vec3.hpp>

#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

constexpr int kMaxPanels = 120;

} // namespace

Result<void> validate(const PlantOptions& options) {
    if (options.panels < 1 || options.panels > kMaxPanels) {
        return fail(
            ErrorCode::invalid_argument,
            "plant: panels is " + std::to_string(options.panels) + ", expected 1 to " +
                std::to_string(kMaxPanels)
        );
    }
    return {};
}

Result<Scene> make_plant(const PlantOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    plant::Site site{
        .scene = {},
        .random = Random(options.seed),
        .seed = options.seed,
        .panels = options.panels};
    site.scene.name = "plant";
    site.scene.sky = glm::vec3(0.72F, 0.80F, 0.88F);
    plant::add_yard(site);
    site.panel = site.add_part(plant::tube_panel(), "tube panel");
    site.pump = site.add_part(plant::pump(), "pump");
    const PipeLayer pipes(site.scene, site.random);
    plant::add_rack(site);
    plant::add_boiler_house(site, pipes);
    plant::add_turbine_hall(site, pipes);
    return std::move(site.scene);
}

} // namespace farfield::scenes
