#include <farfield/gpu/cell_shapes.hpp>

#include <glm/geometric.hpp>

#include <cmath>

namespace farfield::gpu {

SplatView::SplatView(const Pass& pass, const glm::dvec3& origin) noexcept {
    const View& view = pass.view;
    const Lens& lens = view.lens;
    eye_ = view.eye - origin;
    focal_ = {view.width / (lens.right - lens.left), view.height / (lens.top - lens.bottom)};
    across_ = view.camera_to_world[0] * focal_.x;
    up_ = view.camera_to_world[1] * focal_.y;
    forward_ = -view.camera_to_world[2];
    middle_ = {pass.viewport.x - lens.left * focal_.x, pass.viewport.y - lens.bottom * focal_.y};
    const Region& scissor = pass.scissor;
    low_ = {scissor.x, scissor.y};
    high_ = {scissor.x + scissor.width, scissor.y + scissor.height};
    nearest_ = lens.near_distance;
    farthest_ = lens.far_distance;
}

SeenFaces
seen_faces(const ShownCube& cube, const glm::mat3& frame, const glm::dvec3& eye) noexcept {
    SeenFaces seen;
    const glm::dvec3 center = glm::dvec3(cube.center) - eye;
    const glm::dvec3 half = 0.5 * glm::dvec3(cube.size);
    for (int axis = 0; axis < 3; ++axis) {
        const glm::vec<4, std::uint8_t>& color = cube.faces[static_cast<std::size_t>(axis)];
        const glm::dvec3 normal(frame[axis]);
        const double side = -glm::dot(normal, center); // of the centre that the eye is on
        if (color.a == 0 || !(std::abs(side) > half[axis])) {
            continue;
        }
        const int next = (axis + 1) % 3;
        const int last = (axis + 2) % 3;
        const glm::dvec3 u = glm::dvec3(frame[next]) * half[next];
        const glm::dvec3 v = glm::dvec3(frame[last]) * half[last];
        if (half[next] == 0.0 || half[last] == 0.0) {
            continue;
        }
        const glm::dvec3 middle = center + normal * (side > 0.0 ? half[axis] : -half[axis]);
        seen.faces[seen.count++] = {middle - u - v, 2.0 * u, 2.0 * v, color};
    }
    return seen;
}

} // namespace farfield::gpu
