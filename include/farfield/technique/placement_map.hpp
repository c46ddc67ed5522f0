#pragma once

#include <farfield/core/result.hpp>
#include <farfield/math/box3.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/policy/placement_benefit.hpp>

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace farfield {

/// Which views are to be served, and how well.
struct PlacementOptions {
    /// Most primitives that a frame may render. [1, 2^53]
    std::uint64_t max_primitives = 250'000;
    /// What is left where an image replaces something: the more room there is below
    /// `max_primitives`, the fewer images and the more sites. None: `max_primitives` less a
    /// twentieth of the model, at least half of `max_primitives`. [1, max_primitives]
    std::optional<std::uint64_t> target_primitives;
    /// The widest that is served: windows of run time lie within this one. Near and far do not
    /// count. Tangents within 16.
    Lens lens = perspective_lens(1.0471975511965976, 4.0 / 3.0, 0.1, 1e4);
    /// [px] of a frame: images get as many texels for the same angle, times `texels_per_pixel`.
    std::int32_t width = 640;
    std::int32_t height = 480;
    double texels_per_pixel = 1.0; ///< [1/16, 4]
    /// Most that the view direction is turned up or down from the horizon. [rad] [0, 1.2]
    double max_pitch = 0.0;
    glm::dvec3 up{0.0, 1.0, 0.0}; ///< about which views turn; any length but 0
    /// Where eyes are. Empty: the box of the model. [m]
    Box3d eyes;
    std::uint32_t first_grid = 5; ///< sites along the longest side of `eyes`. [1, 64]
    std::uint32_t max_level = 6;  ///< how often a site may be halved. [0, 12]
    /// Steps down from the root of the hierarchy to the cells that are replaced or drawn as a
    /// whole; three of them are one of an octree. [0, 24]
    std::uint32_t cell_depth = 15;
    /// Images stand off the places of their site's eyes by at least so many times half the diagonal
    /// of these, so that no eye sees their texels more than `1 + 1 / clearance` times as large as
    /// they were made. [0.01, 16]
    double clearance = 1.0;
    std::uint32_t lookahead = 2; ///< steps that the search for a subset looks ahead. [1, 4]
    PlacementWeights<double> weights;

    friend bool operator==(const PlacementOptions&, const PlacementOptions&) = default;
};

/// A part of the model that is drawn or replaced as a whole.
struct PlacementCell {
    std::uint32_t node = 0; ///< of the hierarchy
    Box3f box;              ///< around all that it draws, relative to the origin
    std::uint64_t primitives = 0;

    friend bool operator==(const PlacementCell&, const PlacementCell&) = default;
};

/// An image that replaces cells for the eyes of a site.
struct PlacedImage {
    std::uint32_t site = 0;
    /// From the middle of the site, a window around the cells: what its layered image has for a
    /// view. The image plane is at `near_depth`.
    View view;
    double near_depth = 0.0;      ///< [m] along the view direction, of the nearest of the cells
    double far_depth = 0.0;       ///< [m] of the farthest
    std::uint64_t primitives = 0; ///< replaced
    std::uint32_t first_cell = 0; ///< into `PlacementMap::replaced`
    std::uint32_t cell_count = 0;

    friend bool operator==(const PlacedImage&, const PlacedImage&) = default;
};

/// View directions of one site that are served alike: from `yaw` on, to the next range.
struct PlacementRange {
    double yaw = 0.0;                 ///< [rad] [-pi, pi), ascending in a site; the first is -pi
    std::uint32_t image = UINT32_MAX; ///< into `PlacementMap::images`; none: all is drawn
    std::uint64_t primitives = 0;     ///< rendered at most

    friend bool operator==(const PlacementRange&, const PlacementRange&) = default;
};

/// A box of eyes that share images.
struct PlacementSite {
    Box3d eyes; ///< world [m]
    std::uint32_t level = 0;
    std::uint32_t first_range = 0; ///< into `PlacementMap::ranges`
    std::uint32_t range_count = 0; ///< >= 1

    friend bool operator==(const PlacementSite&, const PlacementSite&) = default;
};

/// Node of the octrees over sites.
struct PlacementNode {
    std::uint32_t first_child = 0; ///< 0: a leaf
    /// Axes that are halved: bit 0 is x, bit 1 y, bit 2 z. Children are two for one axis, four for
    /// two, eight for three; a bit of their number for each, lower axes first, says which half.
    std::uint32_t axes = 0;
    std::uint32_t site = UINT32_MAX;

    friend bool operator==(const PlacementNode&, const PlacementNode&) = default;
};

/// The plan of all images that keep every frame within a budget: which cells of a hierarchy an
/// image replaces, for which eyes and view directions. Plain data; made once by `build_placement`.
struct PlacementMap {
    PlacementOptions options;       ///< with `target_primitives` and `eyes` filled in
    glm::dvec3 origin{0.0};         ///< that of the hierarchy
    std::uint64_t model_digest = 0; ///< of the hierarchy's cells: tells that it is the same
    std::uint64_t primitives = 0;   ///< of the model
    std::vector<PlacementCell> cells;
    std::array<std::uint32_t, 3> grid{1, 1, 1}; ///< root sites along x, y, z
    glm::dvec3 spacing{0.0};                    ///< [m] of root sites, from `options.eyes.lo` on
    std::vector<PlacementNode> nodes;           ///< roots first, x fastest
    std::vector<PlacementSite> sites;
    std::vector<PlacementRange> ranges;
    std::vector<PlacedImage> images;
    std::vector<std::uint32_t> replaced; ///< cells, ascending within an image

    /// What the builder achieved.
    struct Quality {
        std::uint64_t views = 0; ///< ranges of yaw in which the same cells are in view, all sites
        std::uint32_t level = 0; ///< deepest of the sites
        std::uint64_t worst = 0; ///< primitives of the worst view, <= max_primitives
        std::uint64_t worst_before = 0; ///< the same without images
        /// Mean over images of |left - sought| / sought: what the view that an image was made for
        /// still renders, and the target, or the least that can be left where that is more.
        double miss = 0.0;

        friend bool operator==(const Quality&, const Quality&) = default;
    } quality;

    friend bool operator==(const PlacementMap&, const PlacementMap&) = default;
};

/// Directions of views that turn about an axis: columns are right and forward at yaw 0, and up.
/// Forward at yaw is `cos(yaw) forward + sin(yaw) right`: clockwise seen from above.
struct YawFrame {
    glm::dvec3 right{1.0, 0.0, 0.0};
    glm::dvec3 up{0.0, 1.0, 0.0};
    glm::dvec3 forward{0.0, 0.0, -1.0};
};

/// @pre up is finite and not 0
[[nodiscard]] YawFrame yaw_frame(const glm::dvec3& up) noexcept;

/// A level view at `yaw`, with the lens and size of another. @param yaw [rad]
[[nodiscard]] View level_view(
    const YawFrame& frame, const glm::dvec3& eye, double yaw, double pitch, const View& like
) noexcept;

/// Why a view is not served by a map.
enum class PlacementRefusal : std::uint8_t {
    none,    ///< it is
    outside, ///< the eye is not in `PlacementOptions::eyes`
    pitch,   ///< it looks higher or lower than `max_pitch`
    window,  ///< it sees more than `lens`, or is rolled so that it does
};

/// A view as a map sees it.
struct PlacedView {
    PlacementRefusal refusal = PlacementRefusal::none;
    std::uint32_t site = UINT32_MAX;
    std::uint32_t range = UINT32_MAX; ///< into `PlacementMap::ranges`
    View around; ///< level, with the lens of the map: sees all that the view sees
};

/// Finds what serves a view. @pre validate(view)
/// @par Cost a step for every level of the site, and for every halving of its ranges
[[nodiscard]] PlacedView find(const PlacementMap& map, const View& view) noexcept;

/// Checks all that finding relies on, of the map alone: for maps from files.
/// @return an error that names the site, range, image or option, the field and the value
[[nodiscard]] Result<void> validate(const PlacementMap& map);

/// Checks all that a technique relies on, and that the hierarchy is the one it was built over.
/// @return an error that names the site, range or image, the field and the value
[[nodiscard]] Result<void> validate(const PlacementMap& map, const Hierarchy& hierarchy);

/// Digest of what placements depend on: cells, their boxes and costs.
[[nodiscard]] std::uint64_t model_digest(const std::vector<PlacementCell>& cells) noexcept;

} // namespace farfield
