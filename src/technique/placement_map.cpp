#include "core/digest.hpp"
#include <farfield/math/frustum.hpp>
#include <farfield/technique/placement_map.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

namespace farfield {

namespace {

constexpr double kPi = std::numbers::pi;
/// Beyond the window of a map by so much counts as within it: tangents of a view that is level and
/// has the same lens are worked out anew. [tangent, rad] Cells are counted with a far larger
/// margin.
constexpr double kWindowMargin = 1e-9;

std::size_t child_count(const PlacementNode& node) noexcept {
    return std::size_t{1} << static_cast<unsigned>(std::popcount(node.axes));
}

tl::unexpected<Error> bad(const std::string& what) {
    return fail(ErrorCode::bad_data, "placement: " + what);
}

/// Cells are as the hierarchy has them, and together all that it draws, once.
Result<void> check_cells(const PlacementMap& map, const Hierarchy& hierarchy) {
    std::vector<bool> is_cell(hierarchy.nodes.size(), false);
    for (std::size_t i = 0; i < map.cells.size(); ++i) {
        const PlacementCell& cell = map.cells[i];
        const bool same =
            cell.node < hierarchy.nodes.size() && !is_cell[cell.node] &&
            primitive_count(hierarchy.nodes[cell.node]) == cell.primitives &&
            cell.box ==
                unite(hierarchy.nodes[cell.node].items_box, whole_pieces_box(hierarchy, cell.node));
        if (!same) {
            return bad(
                "cell " + std::to_string(i) + " is node " + std::to_string(cell.node) + " with " +
                std::to_string(cell.primitives) +
                " primitives, which the hierarchy does not have, or has elsewhere or only once"
            );
        }
        is_cell[cell.node] = true;
    }
    std::size_t met = 0;
    std::vector<std::uint32_t> stack = {0};
    while (!stack.empty()) {
        const std::uint32_t index = stack.back();
        stack.pop_back();
        const HierarchyNode& node = hierarchy.nodes[index];
        if (is_cell[index]) {
            ++met;
        } else if (!is_leaf(node)) {
            stack.push_back(node.first_child);
            stack.push_back(node.first_child + 1);
        } else if (primitive_count(node) > 0) {
            return bad("no cell has node " + std::to_string(index) + " or is above it");
        }
    }
    if (met != map.cells.size()) {
        return bad(
            std::to_string(map.cells.size() - met) + " cells are below others, of " +
            std::to_string(map.cells.size())
        );
    }
    return {};
}

Result<void> check_site(const PlacementMap& map, std::size_t index) {
    const PlacementSite& site = map.sites[index];
    const std::string name = "site " + std::to_string(index);
    if (!is_finite(site.eyes) || is_empty(site.eyes)) {
        return bad(name + " has a box that is empty or not finite");
    }
    const std::size_t end = std::size_t{site.first_range} + site.range_count;
    if (site.range_count == 0 || end > map.ranges.size()) {
        return bad(
            name + " has ranges " + std::to_string(site.first_range) + " to " +
            std::to_string(end) + " of " + std::to_string(map.ranges.size())
        );
    }
    double before = -kPi;
    for (std::size_t i = site.first_range; i < end; ++i) {
        const PlacementRange& range = map.ranges[i];
        const bool first = i == site.first_range;
        const bool ordered = first ? range.yaw == -kPi : range.yaw > before && range.yaw < kPi;
        if (!ordered) {
            return bad(
                "range " + std::to_string(i) + " of " + name + " begins at " +
                std::to_string(range.yaw) + " rad, after " + std::to_string(before)
            );
        }
        before = range.yaw;
        if (range.image != UINT32_MAX &&
            (range.image >= map.images.size() || map.images[range.image].site != index)) {
            return bad(
                "range " + std::to_string(i) + " of " + name + " shows image " +
                std::to_string(range.image) + ", which is not of that site"
            );
        }
        if (range.primitives > map.options.max_primitives) {
            return bad(
                "range " + std::to_string(i) + " of " + name + " renders " +
                std::to_string(range.primitives) + " primitives, more than " +
                std::to_string(map.options.max_primitives)
            );
        }
    }
    return {};
}

Result<void> check_image(const PlacementMap& map, std::size_t index) {
    const PlacedImage& image = map.images[index];
    const std::string name = "image " + std::to_string(index);
    if (image.site >= map.sites.size()) {
        return bad(name + " is of site " + std::to_string(image.site));
    }
    if (Result<void> valid = validate(image.view); !valid) {
        return bad(name + ": " + valid.error().message);
    }
    if (!(image.near_depth > 0.0 && image.far_depth > image.near_depth) ||
        !std::isfinite(image.far_depth)) {
        return bad(
            name + " has depths of " + std::to_string(image.near_depth) + " to " +
            std::to_string(image.far_depth) + " m"
        );
    }
    const std::size_t end = std::size_t{image.first_cell} + image.cell_count;
    if (image.cell_count == 0 || end > map.replaced.size()) {
        return bad(
            name + " replaces " + std::to_string(image.first_cell) + " to " + std::to_string(end) +
            " of " + std::to_string(map.replaced.size())
        );
    }
    for (std::size_t i = image.first_cell; i < end; ++i) {
        const bool ascending = i == image.first_cell || map.replaced[i] > map.replaced[i - 1];
        if (!ascending || map.replaced[i] >= map.cells.size()) {
            return bad(name + " replaces cell " + std::to_string(map.replaced[i]));
        }
    }
    return {};
}

/// What views are found by.
Result<void> check_options(const PlacementOptions& options) {
    if (!options.target_primitives) {
        return bad("target_primitives is not filled in");
    }
    if (!is_finite(options.eyes) || is_empty(options.eyes)) {
        return bad("the box of eyes is empty or not finite");
    }
    const double up = glm::length(options.up);
    if (!(up > 0.0) || !std::isfinite(up)) {
        return bad("up has a length of " + std::to_string(up));
    }
    if (!(options.max_pitch >= 0.0) || !std::isfinite(options.max_pitch)) {
        return bad("max_pitch is " + std::to_string(options.max_pitch) + " rad");
    }
    View screen;
    screen.lens = options.lens;
    screen.width = options.width;
    screen.height = options.height;
    if (Result<void> valid = validate(screen); !valid) {
        return bad(valid.error().message);
    }
    return {};
}

Result<void> check_nodes(const PlacementMap& map) {
    std::uint64_t roots = 1;
    for (const std::uint32_t side : map.grid) {
        // One side at a time, so that no product overflows.
        roots = roots <= map.nodes.size() ? roots * side : roots;
    }
    if (roots == 0 || roots > map.nodes.size()) {
        return bad(
            "a grid of " + std::to_string(map.grid[0]) + " x " + std::to_string(map.grid[1]) +
            " x " + std::to_string(map.grid[2]) + " roots has " + std::to_string(map.nodes.size()) +
            " nodes"
        );
    }
    for (int axis = 0; axis < 3; ++axis) {
        const double spacing = map.spacing[axis];
        if (!(spacing >= 0.0) || !std::isfinite(spacing)) {
            return bad("spacing of " + std::to_string(spacing) + " m");
        }
    }
    for (std::size_t i = 0; i < map.nodes.size(); ++i) {
        const PlacementNode& node = map.nodes[i];
        const bool leaf = node.first_child == 0;
        // Children come later, so that no descent goes round.
        const bool right = leaf ? node.site < map.sites.size()
                                : node.first_child > i && node.axes > 0 && node.axes < 8 &&
                                      node.first_child + child_count(node) <= map.nodes.size();
        if (!right) {
            return bad(
                "node " + std::to_string(i) + " has child " + std::to_string(node.first_child) +
                " and site " + std::to_string(node.site)
            );
        }
    }
    return {};
}

/// There is something, and its cells are those of its digest.
Result<void> check_model(const PlacementMap& map) {
    if (map.cells.empty() || map.sites.empty() || map.ranges.empty()) {
        return bad("no cells, sites or ranges");
    }
    if (map.model_digest != model_digest(map.cells)) {
        return bad("cells are not those that images were placed for");
    }
    return {};
}

/// Options, sites and images, over cells that are right.
Result<void> check_placement(const PlacementMap& map) {
    if (Result<void> valid = check_options(map.options); !valid) {
        return valid;
    }
    if (Result<void> valid = check_nodes(map); !valid) {
        return valid;
    }
    for (std::size_t i = 0; i < map.sites.size(); ++i) {
        if (Result<void> valid = check_site(map, i); !valid) {
            return valid;
        }
    }
    for (std::size_t i = 0; i < map.images.size(); ++i) {
        if (Result<void> valid = check_image(map, i); !valid) {
            return valid;
        }
    }
    return {};
}

} // namespace

YawFrame yaw_frame(const glm::dvec3& up) noexcept {
    YawFrame frame;
    frame.up = up / glm::length(up);
    // Right is x, or y where that is up.
    const glm::dvec3 side =
        std::abs(frame.up.x) < 0.9 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
    frame.forward = glm::normalize(glm::cross(frame.up, side));
    frame.right = glm::cross(frame.forward, frame.up);
    return frame;
}

View level_view(
    const YawFrame& frame, const glm::dvec3& eye, double yaw, double pitch, const View& like
) noexcept {
    const glm::dvec3 level = std::cos(yaw) * frame.forward + std::sin(yaw) * frame.right;
    const glm::dvec3 right = std::cos(yaw) * frame.right - std::sin(yaw) * frame.forward;
    const glm::dvec3 forward = std::cos(pitch) * level + std::sin(pitch) * frame.up;
    const glm::dvec3 up = std::cos(pitch) * frame.up - std::sin(pitch) * level;
    View view = like;
    view.eye = eye;
    view.camera_to_world = glm::dmat3(right, up, -forward);
    return view;
}

PlacedView find(const PlacementMap& map, const View& view) noexcept {
    PlacedView found;
    const PlacementOptions& options = map.options;
    if (!contains(options.eyes, view.eye)) {
        found.refusal = PlacementRefusal::outside;
        return found;
    }
    const YawFrame frame = yaw_frame(options.up);
    const glm::dvec3 forward = -view.camera_to_world[2];
    const double ahead = glm::dot(forward, frame.forward);
    const double aside = glm::dot(forward, frame.right);
    const double pitch = std::atan2(glm::dot(forward, frame.up), std::hypot(ahead, aside));
    if (std::abs(pitch) > options.max_pitch + kWindowMargin) {
        found.refusal = PlacementRefusal::pitch;
        return found;
    }
    const double yaw = std::clamp(std::atan2(aside, ahead), -kPi, kPi);
    found.around = level_view(frame, view.eye, yaw, pitch, view);
    Lens& lens = found.around.lens;
    lens = options.lens;
    lens.near_distance = view.lens.near_distance;
    lens.far_distance = view.lens.far_distance;
    // Each corner of the window, in the axes of the level view.
    const glm::dmat3 to_level = glm::transpose(found.around.camera_to_world) * view.camera_to_world;
    for (unsigned i = 0; i < 4; ++i) {
        const glm::dvec3 corner = to_level * glm::dvec3(
                                                 (i & 1U) != 0U ? view.lens.right : view.lens.left,
                                                 (i & 2U) != 0U ? view.lens.top : view.lens.bottom,
                                                 -1.0
                                             );
        const double x = corner.x / -corner.z;
        const double y = corner.y / -corner.z;
        if (corner.z >= 0.0 || x < lens.left - kWindowMargin || x > lens.right + kWindowMargin ||
            y < lens.bottom - kWindowMargin || y > lens.top + kWindowMargin) {
            found.refusal = PlacementRefusal::window;
            return found;
        }
    }

    std::array<std::uint32_t, 3> cell{};
    glm::dvec3 at{0.0};
    for (int axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<std::size_t>(axis);
        // A side of no length has one site.
        at[axis] = map.spacing[axis] > 0.0
                       ? (view.eye[axis] - options.eyes.lo[axis]) / map.spacing[axis]
                       : 0.0;
        cell[k] = static_cast<std::uint32_t>(
            std::clamp(std::floor(at[axis]), 0.0, static_cast<double>(map.grid[k] - 1))
        );
        at[axis] = std::clamp(at[axis] - cell[k], 0.0, 1.0);
    }
    std::uint32_t node = (cell[2] * map.grid[1] + cell[1]) * map.grid[0] + cell[0];
    while (map.nodes[node].first_child != 0) {
        std::uint32_t child = 0;
        std::uint32_t bit = 1;
        for (int axis = 0; axis < 3; ++axis) {
            if ((map.nodes[node].axes >> static_cast<unsigned>(axis) & 1U) != 0U) {
                const bool upper = at[axis] >= 0.5;
                child |= upper ? bit : 0U;
                bit <<= 1U;
                at[axis] = 2.0 * at[axis] - (upper ? 1.0 : 0.0);
            }
        }
        node = map.nodes[node].first_child + child;
    }
    found.site = map.nodes[node].site;
    const PlacementSite& site = map.sites[found.site];
    const auto first = map.ranges.begin() + static_cast<std::ptrdiff_t>(site.first_range);
    const auto after = std::upper_bound(
        first,
        first + static_cast<std::ptrdiff_t>(site.range_count),
        yaw,
        [](double value, const PlacementRange& range) { return value < range.yaw; }
    );
    found.range = site.first_range + static_cast<std::uint32_t>(after - first) - 1;
    return found;
}

std::uint64_t model_digest(const std::vector<PlacementCell>& cells) noexcept {
    Digest digest;
    digest.add(std::uint64_t{cells.size()});
    for (const PlacementCell& cell : cells) {
        digest.add(cell.node);
        digest.add(cell.box.lo);
        digest.add(cell.box.hi);
        digest.add(cell.primitives);
    }
    return digest.value();
}

Result<void> validate(const PlacementMap& map) {
    if (Result<void> valid = check_model(map); !valid) {
        return valid;
    }
    return check_placement(map);
}

Result<void> validate(const PlacementMap& map, const Hierarchy& hierarchy) {
    if (Result<void> valid = check_model(map); !valid) {
        return valid;
    }
    if (map.origin != hierarchy.origin) {
        return bad("cells are not those that images were placed for");
    }
    if (Result<void> valid = check_cells(map, hierarchy); !valid) {
        return valid;
    }
    return check_placement(map);
}

} // namespace farfield
