#pragma once

#include <farfield/math/view.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace farfield::detail {

/// Tangents of one texel, or of one pixel.
[[nodiscard]] inline glm::dvec2 tangents_per_step(const View& view) noexcept {
    const Lens& lens = view.lens;
    return {
        (lens.right - lens.left) / static_cast<double>(view.width),
        (lens.top - lens.bottom) / static_cast<double>(view.height)};
}

/// The ray through the lower left corner of a view's window, 1 m deep, in the view's own axes.
[[nodiscard]] inline glm::dvec3 corner_ray(const View& view) noexcept {
    return {view.lens.left, view.lens.bottom, -1.0};
}

} // namespace farfield::detail
