#pragma once

#include <farfield/core/result.hpp>

#include <cstdint>

namespace farfield {

/// What drawing costs, in seconds of one device. Data, never a clock: plans made with one model are
/// the same everywhere. `gpu::calibrate` measures one.
/// @par Source Shade et al. 1996, section 2: costs are "established experimentally on each platform
/// and are given as input"
struct CostModel {
    double triangle_s = 1.2e-7;    ///< one triangle, transformed and rasterised
    double draw_call_s = 1.0e-5;   ///< one item or run of primitives, apart from its triangles
    double image_quad_s = 5.0e-6;  ///< one image drawn, apart from its pixels
    double image_pixel_s = 4.0e-9; ///< one pixel of an image drawn, filtered and blended
    double pass_s = 5.0e-5;        ///< one image made: state and copy, apart from its texels
    double texel_s = 1.0e-8;       ///< one texel of an image made, clear and copy included
    /// One sample of one pixel that geometry may cover, apart from its triangles. Nothing to speak
    /// of where triangles are rasterised; nearly all there is where rays are cast.
    double geometry_pixel_s = 0.0;
    double splat_s = 1.4e-7; ///< one splat of about a pixel or less, drawn or dropped
    double cube_s = 1.2e-6;  ///< one cube of up to three faces, of that size
    /// One cell of a tree that planning looks at. Planning is done on the processor, whatever
    /// draws: `gpu::calibrate` leaves it as it is.
    double cell_s = 2.5e-8;

    friend bool operator==(const CostModel&, const CostModel&) = default;
};

/// Costs of casting rays into geometry instead of rasterising it: what is drawn hardly matters, how
/// many pixels it may cover does. Measured with the ray-casting backend on two cores.
[[nodiscard]] constexpr CostModel ray_casting_costs() noexcept {
    return {
        .triangle_s = 1e-12,
        .draw_call_s = 1e-6,
        .image_quad_s = 1e-6,
        .image_pixel_s = 3e-9,
        .pass_s = 1e-5,
        .texel_s = 5e-9,
        .geometry_pixel_s = 1e-7,
        .splat_s = 1e-7,
        .cube_s = 7e-7};
}

/// Checks that every cost is finite and not negative, and that triangles cost something.
[[nodiscard]] Result<void> validate(const CostModel& model);

/// Drawing `draws` items with `primitives` triangles in all. [s]
[[nodiscard]] constexpr double
geometry_cost(const CostModel& model, std::uint64_t primitives, std::uint64_t draws) noexcept {
    return model.triangle_s * static_cast<double>(primitives) +
           model.draw_call_s * static_cast<double>(draws);
}

/// Drawing one image that covers `pixels` pixels. [s]
[[nodiscard]] constexpr double image_cost(const CostModel& model, double pixels) noexcept {
    return model.image_quad_s + model.image_pixel_s * pixels;
}

/// Making an image of `texels` texels whose contents cost `contents_s` to draw. [s]
[[nodiscard]] constexpr double
creation_cost(const CostModel& model, double contents_s, std::uint64_t texels) noexcept {
    return contents_s + model.pass_s + model.texel_s * static_cast<double>(texels);
}

} // namespace farfield
