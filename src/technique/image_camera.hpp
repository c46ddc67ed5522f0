#pragma once

#include <farfield/image/region.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/view.hpp>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

namespace farfield {

/// A view as the decisions about images need it: floats relative to the hierarchy's origin.
struct ImageCamera {
    View view;
    glm::vec3 eye{0.0F};
    glm::vec3 right{0.0F};
    glm::vec3 up{0.0F};
    glm::vec3 forward{0.0F};
    float pixels_per_tangent_x = 0.0F;
    float pixels_per_tangent_y = 0.0F;
};

[[nodiscard]] ImageCamera make_image_camera(const View& view, const glm::dvec3& origin) noexcept;

/// The extent of a box on the plane at distance 1 before a camera.
struct TangentBox {
    glm::vec2 lo{0.0F};
    glm::vec2 hi{0.0F};
};

/// @pre the whole box is before the eye
[[nodiscard]] TangentBox tangents_of(const Box3f& box, const ImageCamera& camera) noexcept;

/// Distance along the view direction of the nearest point of a box. [m]
[[nodiscard]] float nearest_depth(const Box3f& box, const ImageCamera& camera) noexcept;

/// Distance along the view direction of the farthest point of a box. [m]
[[nodiscard]] float farthest_depth(const Box3f& box, const ImageCamera& camera) noexcept;

/// Pixels of the camera's own grid that the box may touch, rounded outwards; y up.
/// @pre the whole box is before the eye
[[nodiscard]] Region project(const Box3f& box, const ImageCamera& camera) noexcept;

/// A camera at the same eye that looks at the centre of a box, upright as the other is and with the
/// same depths. Its pixels are square, of a size that `set_pixel_tangent` says; its window is of no
/// account, since regions may reach beyond it.
/// @pre the eye is not the centre of the box
[[nodiscard]] ImageCamera
camera_facing(const Box3f& box, const ImageCamera& from, const glm::dvec3& origin) noexcept;

/// Makes the pixels of a camera that faces a box `tangent` wide and high, at distance 1.
void set_pixel_tangent(ImageCamera& camera, float tangent) noexcept;

} // namespace farfield
