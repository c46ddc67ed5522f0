#pragma once

#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/image_cache.hpp>

#include <glm/ext/vector_uint3_sized.hpp>
#include <glm/vec3.hpp>

#include <span>

namespace farfield {

/// Colours of both pictures, 8-bit sRGB.
struct OverlayColors {
    glm::u8vec3 image{206, 24, 32};    ///< nodes that show their image
    glm::u8vec3 geometry{255, 212, 0}; ///< leaves drawn as geometry
    glm::u8vec3 culled{116, 52, 166};
    glm::u8vec3 recursed{104, 112, 120}; ///< nodes left to their children
    glm::u8vec3 quad{0, 0, 0};           ///< what images are shown on
    glm::u8vec3 frustum{0, 128, 52};
    glm::u8vec3 path{255, 255, 255};
    glm::u8vec3 background{184, 192, 198};
    glm::u8vec3 text{24, 28, 32};
};

/// What `birds_eye` shows, and how.
struct BirdsEyeOptions {
    int width = 800;              ///< [px] at least 1; a legend needs about 200
    int height = 800;             ///< [px] at least 1
    glm::dvec3 up{0.0, 1.0, 0.0}; ///< seen along its reverse; not zero, need not be unit
    /// Boxes hold split surfaces as well (`SurfacePlacement::in_images`), or whole items alone
    /// (`SurfacePlacement::first`); a node that then holds nothing is not drawn.
    bool with_surfaces = true;
    float line_px = 2.0F; ///< [px] width of outlines, more than 0; recursed nodes have half of it
    /// Eyes of the walk. [m] world
    std::span<const glm::dvec3> path = {};
    /// The plan that the statuses belong to, for the quads of the images that it shows; null: none.
    const FramePlan* plan = nullptr;
    bool legend = true; ///< what each colour means, how many nodes have it, and a scale bar
    OverlayColors colors = {};
};

/// What `draw_status` draws, and how.
struct StatusOptions {
    bool with_surfaces = true; ///< as in `BirdsEyeOptions`
    float line_px = 1.5F;      ///< [px] width of outlines, more than 0
    OverlayColors colors = {};
};

namespace eval {

/// What each node did in the last plan, on a map: boxes of nodes outlined in the colour of their
/// status, untouched ones left out; the frustum and the eye; the walk; a legend.
///
/// The map holds the root's box, the eye and the path, centred, with a margin of 4 % of its sides.
/// With +y up, x points right and z down; in general right is the first of the axes x and z that is
/// not parallel to up, made level, and the top of the picture is up x right. Outlines are moved
/// onto pixels and inwards, so that neighbours do not cover each other. The legend is a band at the
/// bottom, left out where it would take more than a third of the picture. Drawn by the processor,
/// the same on every run.
/// @param statuses `ImageCache::statuses` for this hierarchy; what it lacks counts as untouched
/// @param view that of the plan
/// @return an opaque picture of the size asked for
/// @pre width and height are at least 1, `up` is not zero, the eye is finite
[[nodiscard]] Picture birds_eye(
    const Hierarchy& hierarchy,
    std::span<const NodeStatus> statuses,
    const View& view,
    const BirdsEyeOptions& options = {}
);

/// Outlines, over a rendered frame, the boxes of the nodes that show an image or geometry, far ones
/// first; what lies behind others shines through. Edges end at the near plane; a box behind the eye
/// is not drawn.
/// @param frame picture of the view, of any size: the view's window fills it
/// @param statuses `ImageCache::statuses` for this hierarchy; what it lacks counts as untouched
/// @pre validate(view)
void draw_status(
    Picture& frame,
    const Hierarchy& hierarchy,
    std::span<const NodeStatus> statuses,
    const View& view,
    const StatusOptions& options = {}
);

} // namespace eval
} // namespace farfield
