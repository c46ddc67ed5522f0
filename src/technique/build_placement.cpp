#include "technique/placement_site.hpp"
#include <farfield/technique/build_placement.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace farfield {

namespace {

/// Subsets are found by places in lists of 16 bits.
constexpr std::size_t kMostCells = 65535;
constexpr std::size_t kMostSites = 1U << 22U;
/// Sites that are placed before those of the next level are known.
constexpr std::size_t kMostRoots = 1U << 20U;
/// Of the largest number of the model: frusta and boxes of run time are float, relative to the
/// origin, and some ten of their roundings add up.
constexpr double kMargin = 4e-6;
constexpr double kMostTangent = 16.0;
constexpr double kMostPitch = 1.2;

tl::unexpected<Error>
bad_option(const char* name, const std::string& value, const std::string& expected) {
    return fail(
        ErrorCode::invalid_argument,
        std::string("placement: ") + name + " is " + value + ", expected " + expected
    );
}

Result<void> check_number(const char* name, double value, double least, double most) {
    if (!(value >= least && value <= most)) {
        return bad_option(
            name, std::to_string(value), std::to_string(least) + " to " + std::to_string(most)
        );
    }
    return {};
}

Result<void> check(const PlacementOptions& options) {
    View screen;
    screen.lens = options.lens;
    screen.width = options.width;
    screen.height = options.height;
    if (Result<void> valid = validate(screen); !valid) {
        return fail(valid.error().code, "placement: " + valid.error().message);
    }
    const std::array<Result<void>, 9> checks = {
        check_number("max_primitives", static_cast<double>(options.max_primitives), 1.0, 0x1p53),
        check_number(
            "target_primitives",
            static_cast<double>(options.target_primitives.value_or(1)),
            1.0,
            static_cast<double>(options.max_primitives)
        ),
        check_number("texels_per_pixel", options.texels_per_pixel, 1.0 / 16.0, 4.0),
        check_number("max_pitch", options.max_pitch, 0.0, kMostPitch),
        check_number("first_grid", options.first_grid, 1.0, 64.0),
        check_number("max_level", options.max_level, 0.0, 12.0),
        check_number("cell_depth", options.cell_depth, 0.0, 24.0),
        check_number("clearance", options.clearance, 0.01, 16.0),
        check_number("lookahead", options.lookahead, 1.0, 4.0)};
    for (const Result<void>& valid : checks) {
        if (!valid) {
            return valid;
        }
    }
    const Lens& lens = options.lens;
    for (const double tangent : {lens.left, lens.right, lens.bottom, lens.top}) {
        if (std::abs(tangent) > kMostTangent) {
            return bad_option("a tangent of lens", std::to_string(tangent), "within 16");
        }
    }
    const double up = glm::length(options.up);
    if (!(up > 0.0) || !std::isfinite(up)) {
        return bad_option("length of up", std::to_string(up), "finite and above 0");
    }
    if (!is_empty(options.eyes) && !is_finite(options.eyes)) {
        return bad_option(
            "eyes", "not finite", "a finite box, or an empty one for all of the model"
        );
    }
    const PlacementWeights<double>& weights = options.weights;
    for (const double weight : {weights.cost, weights.benefit, weights.size, weights.depth}) {
        if (!(weight >= 0.0) || !std::isfinite(weight)) {
            return bad_option("a weight", std::to_string(weight), "finite and not negative");
        }
    }
    return {};
}

/// What is below a node at the depth of cells, or a leaf above it.
std::vector<PlacementCell> cells_of(const Hierarchy& hierarchy, std::uint32_t depth) {
    std::vector<PlacementCell> cells;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> stack = {{0, 0}};
    while (!stack.empty()) {
        const auto [index, level] = stack.back();
        stack.pop_back();
        const HierarchyNode& node = hierarchy.nodes[index];
        if (level < depth && !is_leaf(node)) {
            stack.emplace_back(node.first_child + 1, level + 1);
            stack.emplace_back(node.first_child, level + 1);
            continue;
        }
        PlacementCell cell;
        cell.node = index;
        cell.box = unite(node.items_box, whole_pieces_box(hierarchy, index));
        cell.primitives = primitive_count(node);
        if (cell.primitives > 0) {
            cells.push_back(cell);
        }
    }
    return cells;
}

double longest_side(const Box3d& box) noexcept {
    const glm::dvec3 size = extent(box);
    return std::max({size.x, size.y, size.z});
}

/// A box of eyes that has to be placed, and where it hangs.
struct PendingSite {
    Box3d eyes;
    std::uint32_t node = 0;
};

/// Roots: equal boxes, as near to cubes as fills the eyes' box.
std::vector<PendingSite> add_roots(PlacementMap& map) {
    const Box3d& eyes = map.options.eyes;
    const glm::dvec3 size = extent(eyes);
    const double longest = std::max(longest_side(eyes), 1e-9);
    for (int axis = 0; axis < 3; ++axis) {
        const double roots =
            std::max(std::round(size[axis] / longest * map.options.first_grid), 1.0);
        map.grid[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(roots);
        map.spacing[axis] = size[axis] / roots;
    }
    std::vector<PendingSite> pending;
    map.nodes.resize(std::size_t{map.grid[0]} * map.grid[1] * map.grid[2]);
    for (std::uint32_t z = 0; z < map.grid[2]; ++z) {
        for (std::uint32_t y = 0; y < map.grid[1]; ++y) {
            for (std::uint32_t x = 0; x < map.grid[0]; ++x) {
                const glm::dvec3 lo = eyes.lo + glm::dvec3(x, y, z) * map.spacing;
                pending.push_back(
                    {{lo, lo + map.spacing}, static_cast<std::uint32_t>(pending.size())}
                );
            }
        }
    }
    return pending;
}

/// Halves of a box along every axis on which it is at least half as long as on any.
/// @pre the box is no point
void halve(const PendingSite& site, PlacementMap& map, std::vector<PendingSite>& pending) {
    const glm::dvec3 size = extent(site.eyes);
    const glm::dvec3 middle = center(site.eyes);
    const double longest = longest_side(site.eyes);
    std::vector<Box3d> parts = {site.eyes};
    std::uint32_t axes = 0;
    for (int axis = 0; axis < 3; ++axis) {
        if (size[axis] < 0.5 * longest) {
            continue;
        }
        axes |= 1U << static_cast<unsigned>(axis);
        const std::size_t count = parts.size();
        for (std::size_t i = 0; i < count; ++i) {
            Box3d upper = parts[i];
            upper.lo[axis] = middle[axis];
            parts[i].hi[axis] = middle[axis];
            parts.push_back(upper);
        }
    }
    const auto first = static_cast<std::uint32_t>(map.nodes.size());
    map.nodes[site.node].first_child = first;
    map.nodes[site.node].axes = axes;
    map.nodes.resize(map.nodes.size() + parts.size());
    for (std::size_t i = 0; i < parts.size(); ++i) {
        pending.push_back({parts[i], first + static_cast<std::uint32_t>(i)});
    }
}

std::string text(const glm::dvec3& at) {
    return "(" + std::to_string(at.x) + ", " + std::to_string(at.y) + ", " + std::to_string(at.z) +
           ")";
}

/// Takes over what was placed for a box of eyes.
void add_site(
    const PendingSite& pending, std::uint32_t level, SitePlacement& placed, PlacementMap& map
) {
    const auto index = static_cast<std::uint32_t>(map.sites.size());
    const auto first_image = static_cast<std::uint32_t>(map.images.size());
    const auto first_cell = static_cast<std::uint32_t>(map.replaced.size());
    map.nodes[pending.node].site = index;
    map.sites.push_back(
        {pending.eyes,
         level,
         static_cast<std::uint32_t>(map.ranges.size()),
         static_cast<std::uint32_t>(placed.ranges.size())}
    );
    for (PlacementRange& range : placed.ranges) {
        if (range.image != UINT32_MAX) {
            range.image += first_image;
        }
        map.ranges.push_back(range);
    }
    for (PlacedImage& image : placed.images) {
        image.site = index;
        image.first_cell += first_cell;
        map.images.push_back(image);
    }
    map.replaced.insert(map.replaced.end(), placed.replaced.begin(), placed.replaced.end());
    map.quality.views += placed.views;
    map.quality.level = std::max(map.quality.level, level);
    map.quality.worst = std::max(map.quality.worst, placed.worst);
    map.quality.worst_before = std::max(map.quality.worst_before, placed.worst_before);
    map.quality.miss += placed.miss;
}

} // namespace

Result<PlacementMap> build_placement(
    const Hierarchy& hierarchy,
    const PlacementOptions& options,
    Executor& executor,
    const PlacementProgress& progress
) {
    if (Result<void> valid = check(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    PlacementMap map;
    map.options = options;
    map.origin = hierarchy.origin;
    map.cells = cells_of(hierarchy, options.cell_depth);
    if (map.cells.empty() || map.cells.size() > kMostCells) {
        return bad_option(
            "cell_depth",
            std::to_string(options.cell_depth) + ", which makes " +
                std::to_string(map.cells.size()) + " cells",
            "1 to 65535 cells"
        );
    }
    map.model_digest = model_digest(map.cells);
    Box3f model;
    for (const PlacementCell& cell : map.cells) {
        model = unite(model, cell.box);
        map.primitives += cell.primitives;
    }
    const Box3d world{
        glm::dvec3(model.lo) + hierarchy.origin, glm::dvec3(model.hi) + hierarchy.origin};
    if (is_empty(options.eyes)) {
        map.options.eyes = world;
    }
    if (!options.target_primitives) {
        const std::uint64_t most = options.max_primitives;
        const std::uint64_t room = map.primitives / 20;
        map.options.target_primitives =
            std::max({most - std::min(room, most), most / 2, std::uint64_t{1}});
    }
    const glm::vec3 largest = glm::max(glm::abs(model.lo), glm::abs(model.hi));
    const glm::dvec3 eyes_at = glm::max(
        glm::abs(map.options.eyes.lo - map.origin), glm::abs(map.options.eyes.hi - map.origin)
    );
    const PlacementTask task{
        .options = map.options,
        .cells = map.cells,
        .origin = map.origin,
        .frame = yaw_frame(options.up),
        .model_extent = std::max(longest_side(world), 1e-9),
        .margin = kMargin * std::max(
                                {double{largest.x},
                                 double{largest.y},
                                 double{largest.z},
                                 eyes_at.x,
                                 eyes_at.y,
                                 eyes_at.z}
                            )};

    std::vector<PendingSite> pending = add_roots(map);
    if (pending.size() > kMostRoots) {
        return bad_option(
            "first_grid", std::to_string(options.first_grid), "fewer than a million roots"
        );
    }
    std::size_t known = pending.size();
    std::size_t placed_before = 0;
    for (std::uint32_t level = 0; !pending.empty(); ++level) {
        std::vector<SitePlacement> placed(pending.size());
        std::vector<Box3d> smallest(pending.size());
        std::vector<std::uint8_t> hopeless(pending.size(), 0);
        // In runs, so that who watches is told in between, on this thread.
        constexpr std::size_t kRun = 64;
        for (std::size_t first = 0; first < pending.size(); first += kRun) {
            const std::size_t count = std::min(kRun, pending.size() - first);
            executor.run(count, [&](std::size_t i) {
                const Box3d& eyes = pending[first + i].eyes;
                SitePlacement& site = placed[first + i];
                site = place_site(task, eyes);
                smallest[first + i] = eyes;
                if (site.feasible || level == options.max_level) {
                    return;
                }
                // Rather than after all levels it is told at once where no halving will help.
                const glm::dvec3 middle = center(eyes);
                const double share = std::ldexp(1.0, -static_cast<int>(options.max_level - level));
                smallest[first + i] = {middle, middle + extent(eyes) * share};
                SitePlacement last = place_site(task, smallest[first + i]);
                if (!last.feasible) {
                    site = std::move(last);
                    hopeless[first + i] = 1;
                }
            });
            if (progress) {
                progress(placed_before + first + count, known);
            }
        }
        placed_before += pending.size();
        std::vector<PendingSite> next;
        for (std::size_t i = 0; i < pending.size(); ++i) {
            if (placed[i].feasible) {
                add_site(pending[i], level, placed[i], map);
            } else if (level == options.max_level || hopeless[i] != 0 || longest_side(pending[i].eyes) == 0.0) {
                return fail(
                    ErrorCode::unsupported,
                    "placement: around " + text(center(smallest[i])) + " m, looking at yaw " +
                        std::to_string(placed[i].yaw) + " rad, " +
                        std::to_string(placed[i].nearby) +
                        " primitives are too near for an image, " + "more than max_primitives of " +
                        std::to_string(options.max_primitives) + ", even for eyes in a box of " +
                        std::to_string(longest_side(smallest[i])) + " m (max_level " +
                        std::to_string(options.max_level) + ")"
                );
            } else {
                halve(pending[i], map, next);
            }
        }
        known += next.size();
        if (known > kMostSites) {
            return fail(
                ErrorCode::unsupported,
                "placement: more than " + std::to_string(kMostSites) +
                    " sites for max_primitives of " + std::to_string(options.max_primitives)
            );
        }
        pending = std::move(next);
    }
    if (!map.images.empty()) {
        map.quality.miss /= static_cast<double>(map.images.size());
    }
    return map;
}

} // namespace farfield
