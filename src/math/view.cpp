#include <farfield/math/view.hpp>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <string>

namespace farfield {

namespace {

constexpr int kMaxPixels = 16384;

Error wrong(const char* field, double value, const char* expected) {
    return {
        ErrorCode::invalid_argument,
        std::string("view: ") + field + " is " + std::to_string(value) + ", expected " + expected};
}

} // namespace

Lens perspective_lens(
    double fov_y, double aspect, double near_distance, double far_distance
) noexcept {
    const double top = std::tan(fov_y / 2.0);
    const double right = top * aspect;
    return {-right, right, -top, top, near_distance, far_distance};
}

View look_at(
    const glm::dvec3& eye,
    const glm::dvec3& target,
    const glm::dvec3& up,
    const Lens& lens,
    int width,
    int height
) noexcept {
    const glm::dvec3 backward = glm::normalize(eye - target);
    glm::dvec3 right = glm::cross(up, backward);
    // Below this the direction is parallel to up within rounding and the cross product is noise.
    constexpr double kParallel = 1e-9;
    if (glm::length(right) <= kParallel * glm::length(up)) {
        const glm::dvec3 other =
            std::abs(backward.x) < 0.9 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0);
        right = glm::cross(backward, glm::cross(other, backward));
    }
    right = glm::normalize(right);
    View view;
    view.eye = eye;
    view.camera_to_world = glm::dmat3(right, glm::cross(backward, right), backward);
    view.lens = lens;
    view.width = width;
    view.height = height;
    return view;
}

Result<void> validate(const View& view) {
    for (int axis = 0; axis < 3; ++axis) {
        if (!std::isfinite(view.eye[axis])) {
            return tl::unexpected(wrong("eye", view.eye[axis], "a finite position"));
        }
    }
    constexpr double kOrthonormal = 1e-6;
    const glm::dmat3 product = glm::transpose(view.camera_to_world) * view.camera_to_world;
    for (int column = 0; column < 3; ++column) {
        for (int row = 0; row < 3; ++row) {
            const double expected = column == row ? 1.0 : 0.0;
            if (!(std::abs(product[column][row] - expected) <= kOrthonormal)) {
                return tl::unexpected(
                    wrong("camera_to_world", product[column][row], "an orthonormal matrix")
                );
            }
        }
    }
    if (view.width < 1 || view.width > kMaxPixels) {
        return tl::unexpected(wrong("width", view.width, "1 to 16384 pixels"));
    }
    if (view.height < 1 || view.height > kMaxPixels) {
        return tl::unexpected(wrong("height", view.height, "1 to 16384 pixels"));
    }
    const Lens& lens = view.lens;
    const bool ordered = lens.left < lens.right && lens.bottom < lens.top;
    const bool finite = std::isfinite(lens.left) && std::isfinite(lens.right) &&
                        std::isfinite(lens.bottom) && std::isfinite(lens.top);
    if (!ordered || !finite) {
        return tl::unexpected(wrong(
            "field of view (tangent of the upper edge)",
            lens.top,
            "left < right and bottom < top, all finite"
        ));
    }
    // A tangent of 1e6 is a field of view of 180 degrees less 0.4 seconds of arc.
    constexpr double kMaxTangent = 1e6;
    if (lens.top - lens.bottom > kMaxTangent || lens.right - lens.left > kMaxTangent) {
        return tl::unexpected(wrong("field of view (tangent)", lens.top, "under 180 degrees"));
    }
    if (!(lens.near_distance > 0.0) || !std::isfinite(lens.near_distance)) {
        return tl::unexpected(wrong("near distance", lens.near_distance, "a finite value above 0"));
    }
    if (!(lens.far_distance > lens.near_distance) || !std::isfinite(lens.far_distance)) {
        return tl::unexpected(
            wrong("far distance", lens.far_distance, "a finite value above the near distance")
        );
    }
    return {};
}

double focal_length_px(const View& view) noexcept {
    return view.height / (view.lens.top - view.lens.bottom);
}

glm::mat4 projection_matrix(const Lens& lens) noexcept {
    const double width = lens.right - lens.left;
    const double height = lens.top - lens.bottom;
    const double depth = lens.far_distance - lens.near_distance;
    glm::mat4 matrix(0.0F);
    matrix[0][0] = static_cast<float>(2.0 / width);
    matrix[1][1] = static_cast<float>(2.0 / height);
    matrix[2][0] = static_cast<float>((lens.right + lens.left) / width);
    matrix[2][1] = static_cast<float>((lens.top + lens.bottom) / height);
    matrix[2][2] = static_cast<float>(lens.near_distance / depth);
    matrix[2][3] = -1.0F;
    matrix[3][2] = static_cast<float>(lens.near_distance * (lens.far_distance / depth));
    return matrix;
}

Lens sub_lens(const View& view, double x0, double y0, double x1, double y1) noexcept {
    const double per_pixel_x = (view.lens.right - view.lens.left) / view.width;
    const double per_pixel_y = (view.lens.top - view.lens.bottom) / view.height;
    Lens lens = view.lens;
    lens.left = view.lens.left + x0 * per_pixel_x;
    lens.right = view.lens.left + x1 * per_pixel_x;
    lens.bottom = view.lens.bottom + y0 * per_pixel_y;
    lens.top = view.lens.bottom + y1 * per_pixel_y;
    return lens;
}

Motion estimate_motion(
    const glm::dvec3& now, const glm::dvec3& before, const glm::dvec3& earlier, double frame_seconds
) noexcept {
    const glm::dvec3 last = (now - before) / frame_seconds;
    const glm::dvec3 previous = (before - earlier) / frame_seconds;
    Motion motion;
    motion.acceleration = (last - previous) / frame_seconds;
    // (now - before) / dt is the velocity half a frame ago.
    motion.velocity = last + motion.acceleration * (frame_seconds / 2.0);
    motion.frame_seconds = frame_seconds;
    return motion;
}

} // namespace farfield
