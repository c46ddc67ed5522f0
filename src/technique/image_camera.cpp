#include "technique/image_camera.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace farfield {

namespace {

// Pixels of the window of a camera that faces a box: any number, as regions reach beyond windows.
constexpr int kFacingPixels = 1024;

} // namespace

ImageCamera make_image_camera(const View& view, const glm::dvec3& origin) noexcept {
    ImageCamera camera;
    camera.view = view;
    camera.eye = local_point(view.eye, origin);
    camera.right = glm::vec3(view.camera_to_world[0]);
    camera.up = glm::vec3(view.camera_to_world[1]);
    camera.forward = -glm::vec3(view.camera_to_world[2]);
    const Lens& lens = view.lens;
    camera.pixels_per_tangent_x = static_cast<float>(view.width / (lens.right - lens.left));
    camera.pixels_per_tangent_y = static_cast<float>(view.height / (lens.top - lens.bottom));
    return camera;
}

TangentBox tangents_of(const Box3f& box, const ImageCamera& camera) noexcept {
    TangentBox tangents{
        glm::vec2(std::numeric_limits<float>::infinity()),
        glm::vec2(-std::numeric_limits<float>::infinity())};
    for (unsigned index = 0; index < 8; ++index) {
        const glm::vec3 offset = corner(box, index) - camera.eye;
        const float depth = glm::dot(offset, camera.forward);
        const glm::vec2 tangent(
            glm::dot(offset, camera.right) / depth, glm::dot(offset, camera.up) / depth
        );
        tangents.lo = glm::min(tangents.lo, tangent);
        tangents.hi = glm::max(tangents.hi, tangent);
    }
    return tangents;
}

float nearest_depth(const Box3f& box, const ImageCamera& camera) noexcept {
    const glm::vec3 nearest =
        glm::mix(box.lo, box.hi, glm::lessThan(camera.forward, glm::vec3(0.0F)));
    return glm::dot(nearest - camera.eye, camera.forward);
}

float farthest_depth(const Box3f& box, const ImageCamera& camera) noexcept {
    const glm::vec3 farthest =
        glm::mix(box.hi, box.lo, glm::lessThan(camera.forward, glm::vec3(0.0F)));
    return glm::dot(farthest - camera.eye, camera.forward);
}

Region project(const Box3f& box, const ImageCamera& camera) noexcept {
    const TangentBox tangents = tangents_of(box, camera);
    const Lens& lens = camera.view.lens;
    // Far outside the image a coordinate may exceed an integer; such an image is too large anyway.
    const auto pixel = [](double value) {
        constexpr double kMost = 1e6;
        return static_cast<std::int32_t>(std::clamp(value, -kMost, kMost));
    };
    const auto x = [&](float tangent) {
        return (double{tangent} - lens.left) * camera.pixels_per_tangent_x;
    };
    const auto y = [&](float tangent) {
        return (double{tangent} - lens.bottom) * camera.pixels_per_tangent_y;
    };
    Region region;
    region.x = pixel(std::floor(x(tangents.lo.x)));
    region.y = pixel(std::floor(y(tangents.lo.y)));
    region.width = std::max(pixel(std::ceil(x(tangents.hi.x))) - region.x, 1);
    region.height = std::max(pixel(std::ceil(y(tangents.hi.y))) - region.y, 1);
    return region;
}

ImageCamera
camera_facing(const Box3f& box, const ImageCamera& from, const glm::dvec3& origin) noexcept {
    const glm::dvec3 forward = glm::normalize(glm::dvec3(center(box)) - glm::dvec3(from.eye));
    const glm::dmat3& axes = from.view.camera_to_world;
    // Seen from straight above its own up, what was behind is up.
    const bool level = std::abs(glm::dot(forward, axes[1])) < 0.999;
    const glm::dvec3 right = glm::normalize(glm::cross(forward, level ? axes[1] : axes[2]));
    View view = from.view;
    view.camera_to_world = glm::dmat3(right, glm::cross(right, forward), -forward);
    view.width = kFacingPixels;
    view.height = kFacingPixels;
    view.lens.left = -1.0;
    view.lens.right = 1.0;
    view.lens.bottom = -1.0;
    view.lens.top = 1.0;
    return make_image_camera(view, origin);
}

void set_pixel_tangent(ImageCamera& camera, float tangent) noexcept {
    const double half = double{tangent} * kFacingPixels / 2.0;
    camera.view.lens.left = -half;
    camera.view.lens.right = half;
    camera.view.lens.bottom = -half;
    camera.view.lens.top = half;
    camera.pixels_per_tangent_x = 1.0F / tangent;
    camera.pixels_per_tangent_y = 1.0F / tangent;
}

} // namespace farfield
