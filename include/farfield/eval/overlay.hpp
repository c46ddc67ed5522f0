#pragma once

#include <farfield/gpu/frame_plan.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/image_cache.hpp>

#include <glm/ext/vector_uint3_sized.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace farfield {

/// What the debug views of a cache show of its nodes.
enum class OverlayShow : std::uint8_t {
    /// What each node did in the frame: by `NodeStatus`, outlined and tinted.
    statuses,
    /// What became of the image of each node: by `ImageEvent`, filled. Images nearest the root have
    /// the outline `OverlayColors::in_use`: they are what the frame shows where it looks. What lies
    /// under an image is drawn smaller within it, so a new child of a combined parent is seen.
    /// Geometry that could have been an image is drawn as by `statuses`.
    events,
    /// How far off the images may be that are shown: by `ImageFacts::error_px` on the ramp of heat
    /// maps. Geometry, which is not off, is drawn as by `statuses`.
    errors,
};

/// Colours of the debug views, 8-bit sRGB.
struct OverlayColors {
    glm::u8vec3 image{206, 24, 32};    ///< nodes that show their image
    glm::u8vec3 geometry{255, 212, 0}; ///< leaves drawn as geometry
    glm::u8vec3 culled{116, 52, 166};
    glm::u8vec3 recursed{104, 112, 120}; ///< nodes left to their children
    glm::u8vec3 made{206, 24, 32};       ///< images made from primitives
    glm::u8vec3 combined{46, 160, 67};   ///< images made from images of children
    glm::u8vec3 reused{255, 255, 255};   ///< images of earlier frames
    glm::u8vec3 impossible{16, 16, 16};  ///< nodes that can have no image
    glm::u8vec3 in_use{0, 0, 0};         ///< outlines of the images nearest the root
    glm::u8vec3 beyond{0, 255, 160};     ///< errors beyond the scale
    glm::u8vec3 zone{0, 96, 160};        ///< where images are valid, and where they were made
    glm::u8vec3 quad{0, 0, 0};           ///< what images are shown on
    glm::u8vec3 frustum{0, 128, 52};
    glm::u8vec3 path{255, 255, 255};
    glm::u8vec3 background{184, 192, 198};
    glm::u8vec3 text{24, 28, 32};
};

/// What a cache did with its nodes in a plan, by node. Nodes beyond the end of a span are
/// untouched, without an event, without an image.
struct OverlayNodes {
    std::span<const NodeStatus> statuses = {};              ///< `ImageCache::statuses`
    std::span<const ImageEvent> events = {};                ///< `ImageCache::events`
    std::span<const std::optional<ImageFacts>> images = {}; ///< `eval::images_of`
};

/// What `birds_eye` shows, and how.
struct BirdsEyeOptions {
    int width = 800;              ///< [px] at least 1; a legend needs about 200
    int height = 800;             ///< [px] at least 1
    glm::dvec3 up{0.0, 1.0, 0.0}; ///< seen along its reverse; not zero, need not be unit
    OverlayShow show = OverlayShow::statuses;
    double error_scale_px = 2.0; ///< [px] of `OverlayShow::errors`: the end of the ramp; > 0
    /// Boxes hold split surfaces as well (`SurfacePlacement::in_images`), or whole items alone
    /// (`SurfacePlacement::first`); a node that then holds nothing is not drawn.
    bool with_surfaces = true;
    float line_px = 2.0F; ///< [px] width of outlines, more than 0; recursed nodes have half of it
    /// Of the images that the frame shows: the eyes that made them, as crosses, and outlines of
    /// their `ImageFacts::zone`, where the metric of the cache has zones.
    bool zones = false;
    /// Eyes of the walk. [m] world
    std::span<const glm::dvec3> path = {};
    /// The plan that the nodes belong to, for the quads of the images that it shows; null: none.
    const FramePlan* plan = nullptr;
    bool legend = true; ///< what each colour means, how many nodes have it, and a scale bar
    OverlayColors colors = {};
};

/// What `draw_nodes` draws, and how.
struct NodeOverlayOptions {
    OverlayShow show = OverlayShow::statuses;
    double error_scale_px = 2.0; ///< as in `BirdsEyeOptions`
    bool with_surfaces = true;   ///< as in `BirdsEyeOptions`
    float line_px = 1.5F;        ///< [px] width of outlines, more than 0
    bool legend = false;         ///< a band below the picture, which grows by it
    OverlayColors colors = {};
};

namespace eval {

/// The images that a cache holds, by node, for `OverlayNodes::images`.
[[nodiscard]] std::vector<std::optional<ImageFacts>> images_of(const ImageCache& cache);

/// What a cache did with each node in the last plan, on a map: boxes of nodes in the colours of
/// what is shown, untouched ones left out; the frustum and the eye; the walk; zones; a legend.
///
/// The map holds the root's box, the eye and the path, centred, with a margin of 4 % of its sides.
/// With +y up, x points right and z down; in general right is the first of the axes x and z that is
/// not parallel to up, made level, and the top of the picture is up x right. Outlines are moved
/// onto pixels and inwards, so that neighbours do not cover each other. The legend is a band at the
/// bottom, left out where it would take more than a third of the picture. Drawn by the processor,
/// the same on every run.
/// @param nodes of this hierarchy
/// @param view that of the plan
/// @return an opaque picture of the size asked for
/// @pre width and height are at least 1, `up` is not zero, the eye is finite, the scale above 0
[[nodiscard]] Picture birds_eye(
    const Hierarchy& hierarchy,
    const OverlayNodes& nodes,
    const View& view,
    const BirdsEyeOptions& options = {}
);

/// Outlines, over a rendered frame, the boxes of nodes, far ones first; what lies behind others
/// shines through. Edges end at the near plane; a box behind the eye is not drawn.
///
/// Drawn are nodes that show an image or geometry; by events also those whose images were made in
/// this frame to be combined, at half the width; by errors their outlines are filled as well.
/// @param frame picture of the view, of any size: the view's window fills it
/// @param nodes of this hierarchy
/// @pre validate(view), the scale is above 0
void draw_nodes(
    Picture& frame,
    const Hierarchy& hierarchy,
    const OverlayNodes& nodes,
    const View& view,
    const NodeOverlayOptions& options = {}
);

} // namespace eval
} // namespace farfield
