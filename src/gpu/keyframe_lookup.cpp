#include <farfield/gpu/keyframe_lookup.hpp>

#include <glm/matrix.hpp>

namespace farfield::gpu {

namespace {

/// A window as coordinates with a weight, (x w, y w, w) with w the distance along the view
/// direction, from camera axes and back.
struct Window {
    glm::dvec2 per_tangent{1.0};
    glm::dvec2 middle{0.0};

    /// @param corner where the lower left of the view's window is
    Window(const View& view, const glm::dvec2& corner) noexcept {
        const Lens& lens = view.lens;
        per_tangent = {
            view.width / (lens.right - lens.left), view.height / (lens.top - lens.bottom)};
        middle = corner - glm::dvec2(lens.left, lens.bottom) * per_tangent;
    }
    [[nodiscard]] glm::dmat3 from_camera() const noexcept {
        return glm::dmat3(
            {per_tangent.x, 0.0, 0.0}, {0.0, per_tangent.y, 0.0}, {-middle.x, -middle.y, -1.0}
        );
    }
    [[nodiscard]] glm::dmat3 to_camera() const noexcept {
        return glm::dmat3(
            {1.0 / per_tangent.x, 0.0, 0.0},
            {0.0, 1.0 / per_tangent.y, 0.0},
            {-middle.x / per_tangent.x, -middle.y / per_tangent.y, -1.0}
        );
    }
};

} // namespace

KeyframeTerms keyframe_terms(const Keyframe& keyframe, const View& view) noexcept {
    const View& made_by = keyframe.view;
    const Region& source = keyframe.source;
    const Window page(made_by, {source.x, source.y});
    const Window frame(view, glm::dvec2(0.0));
    // Differences first: both eyes may be far from zero.
    const glm::dvec3 between = view.eye - made_by.eye;
    const glm::dmat3 world_to_keyframe = glm::transpose(made_by.camera_to_world);
    const glm::dmat3 world_to_pixel = frame.from_camera() * glm::transpose(view.camera_to_world);
    KeyframeTerms terms;
    terms.rotation = world_to_keyframe * view.camera_to_world;
    terms.offset = world_to_keyframe * between;
    terms.to_pixel = world_to_pixel * made_by.camera_to_world * page.to_camera();
    terms.to_pixel_offset = world_to_pixel * -between;
    terms.per_tangent = page.per_tangent;
    terms.middle = page.middle;
    terms.low = {source.x, source.y};
    terms.last = {source.x + source.width - 1, source.y + source.height - 1};
    constexpr double kSteps = kNothingKept;
    terms.nearest = double{keyframe.copy_near};
    terms.steps_per_m = kSteps / (double{keyframe.copy_far} - double{keyframe.copy_near});
    terms.offset_m = double{keyframe.offset_m};
    terms.max_shift_px = double{keyframe.max_shift_px};
    return terms;
}

} // namespace farfield::gpu
