#include <farfield/math/frustum.hpp>

#include <glm/geometric.hpp>

namespace farfield {

Frustum make_frustum(const View& view, const glm::dvec3& origin) noexcept {
    const glm::dvec3& right = view.camera_to_world[0];
    const glm::dvec3& up = view.camera_to_world[1];
    const glm::dvec3 forward = -view.camera_to_world[2];
    const Lens& lens = view.lens;
    const glm::dvec3 eye = view.eye - origin;

    Frustum frustum;
    const auto set = [&](std::size_t index, const glm::dvec3& inward, const glm::dvec3& point) {
        const glm::dvec3 unit = glm::normalize(inward);
        frustum.planes[index] = {glm::vec3(unit), static_cast<float>(glm::dot(unit, point))};
    };
    set(0, right - forward * lens.left, eye);
    set(1, forward * lens.right - right, eye);
    set(2, up - forward * lens.bottom, eye);
    set(3, forward * lens.top - up, eye);
    set(4, forward, eye + forward * lens.near_distance);
    set(5, -forward, eye + forward * lens.far_distance);
    return frustum;
}

Overlap classify(const Frustum& frustum, const Box3f& box) noexcept {
    const glm::vec3 middle = center(box);
    const glm::vec3 half = extent(box) * 0.5F;
    Overlap overlap = Overlap::inside;
    for (const Plane& plane : frustum.planes) {
        const float distance = signed_distance(plane, middle);
        const float reach = glm::dot(glm::abs(plane.normal), half);
        if (distance < -reach) {
            return Overlap::outside;
        }
        if (distance < reach) {
            overlap = Overlap::partial;
        }
    }
    return overlap;
}

} // namespace farfield
