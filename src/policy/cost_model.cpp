#include <farfield/policy/cost_model.hpp>

#include <cmath>
#include <string>
#include <utility>

namespace farfield {

Result<void> validate(const CostModel& model) {
    const std::pair<const char*, double> costs[] = {
        {"triangle_s", model.triangle_s},
        {"draw_call_s", model.draw_call_s},
        {"image_quad_s", model.image_quad_s},
        {"image_pixel_s", model.image_pixel_s},
        {"pass_s", model.pass_s},
        {"texel_s", model.texel_s},
        {"geometry_pixel_s", model.geometry_pixel_s},
        {"splat_s", model.splat_s},
        {"cube_s", model.cube_s},
        {"cell_s", model.cell_s}};
    for (const auto& [name, value] : costs) {
        if (!std::isfinite(value) || value < 0.0) {
            return fail(
                ErrorCode::invalid_argument,
                std::string("cost model: ") + name + " is " + std::to_string(value) +
                    ", expected a finite value of at least 0 seconds"
            );
        }
    }
    if (model.triangle_s == 0.0) {
        return fail(
            ErrorCode::invalid_argument, "cost model: triangle_s is 0, expected more than 0 seconds"
        );
    }
    return {};
}

} // namespace farfield
