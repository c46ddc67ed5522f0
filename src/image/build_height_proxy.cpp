#include "image/grid_surface.hpp"
#include <farfield/image/build_proxy.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <string>
#include <unordered_map>
#include <utility>

namespace farfield {

namespace {

constexpr std::uint32_t kNone32 = UINT32_MAX;
/// More triangles than this would be more than posts of any grid are worth.
constexpr std::uint32_t kMostTriangles = 1U << 26U;

tl::unexpected<Error> bad(const std::string& what, const std::string& value) {
    return fail(ErrorCode::invalid_argument, "proxy of heights: " + what + " is " + value);
}

/// The smallest float that is no less.
float rounded_up(double value) noexcept {
    const auto nearest = static_cast<float>(value);
    return double{nearest} < value ? std::nextafter(nearest, std::numeric_limits<float>::infinity())
                                   : nearest;
}

glm::dvec3 middle_of(const HeightGrid& grid) {
    const auto [low, high] = std::minmax_element(grid.heights.begin(), grid.heights.end());
    return grid.origin + glm::dvec3(
                             0.5 * (grid.columns - 1) * grid.spacing_m,
                             0.5 * (double{*low} + double{*high}),
                             0.5 * (grid.rows - 1) * grid.spacing_m
                         );
}

/// Squares along x and z, nearly square, `squares` along the longer side.
struct Squares {
    std::uint32_t columns = 0;
    std::uint32_t rows = 0;
};

Result<Squares> squares_of(const HeightGrid& grid, std::uint32_t squares, const char* name) {
    const std::uint32_t longer = std::max(grid.columns, grid.rows) - 1;
    const std::uint32_t shorter = std::min(grid.columns, grid.rows) - 1;
    if (squares < 1 || squares > longer) {
        return bad(name, std::to_string(squares) + ", expected 1 to " + std::to_string(longer));
    }
    const double share = static_cast<double>(shorter) / longer * squares;
    const std::uint32_t across =
        std::clamp(static_cast<std::uint32_t>(std::lround(share)), std::uint32_t{1}, shorter);
    return grid.columns >= grid.rows ? Squares{squares, across} : Squares{across, squares};
}

Result<void> check(const HeightGrid& grid, const ProxyItems& items) {
    if (items.fine == kNone<ItemId> || items.coarse == kNone<ItemId> ||
        items.fine == items.coarse) {
        return bad(
            "item of the coarse model",
            std::to_string(index_of(items.coarse)) + " and that of the fine one " +
                std::to_string(index_of(items.fine)) + ", expected two"
        );
    }
    return validate(grid);
}

/// Triangles of a choice of the binary tree, in the order in which they came to be.
struct TreeTriangle {
    std::array<std::uint32_t, 3> posts{}; ///< right angle first; the others end the split edge
    std::uint32_t child = kNone32;
    std::uint32_t level = 0;
    MeasuredTriangle measured;
};

std::uint64_t edge_key(std::uint32_t from, std::uint32_t to) noexcept {
    return std::uint64_t{from} << 32U | to;
}

/// The tree, as it is refined.
class TreeBuilder {
  public:
    TreeBuilder(const HeightGrid& grid, const GridSurface& surface)
        : columns_(grid.columns), surface_(&surface) {}

    void add_roots(const HeightGrid& grid, const Squares& squares) {
        const auto post_at = [&](std::uint32_t column, std::uint32_t row) {
            const auto rounded = [](std::uint64_t i, std::uint32_t posts, std::uint32_t parts) {
                return static_cast<std::uint32_t>((i * (posts - 1) * 2 + parts) / (2ULL * parts));
            };
            return static_cast<std::uint32_t>(grid.post(
                rounded(column, grid.columns, squares.columns),
                rounded(row, grid.rows, squares.rows)
            ));
        };
        for (std::uint32_t row = 0; row < squares.rows; ++row) {
            for (std::uint32_t column = 0; column < squares.columns; ++column) {
                const std::uint32_t north_west = post_at(column, row);
                const std::uint32_t south_east = post_at(column + 1, row + 1);
                add({post_at(column, row + 1), south_east, north_west}, 0);
                add({post_at(column + 1, row), north_west, south_east}, 0);
            }
        }
    }

    /// Splits triangles, the farthest off first, until none is off by more than `error_m` or the
    /// next would be one too many.
    void refine(std::uint32_t max_triangles, double error_m) {
        using Entry = std::pair<double, std::uint32_t>; // offset and triangle
        const auto later = [](const Entry& a, const Entry& b) {
            return a.first != b.first ? a.first < b.first : a.second > b.second;
        };
        std::priority_queue<Entry, std::vector<Entry>, decltype(later)> queue(later);
        std::uint32_t queued = 0;
        for (;;) {
            for (; queued < triangles_.size(); ++queued) {
                queue.emplace(triangles_[queued].measured.offset_m, queued);
            }
            if (queue.empty() || !(queue.top().first > error_m)) {
                return;
            }
            const std::uint32_t triangle = queue.top().second;
            queue.pop();
            if (triangles_[triangle].child != kNone32) {
                continue; // split for the sake of another
            }
            if (leaves_ + cost_of(triangle) > max_triangles) {
                return;
            }
            // What cannot be split, posts being as close as they are, stays as it is.
            static_cast<void>(split(triangle));
        }
    }

    [[nodiscard]] const std::vector<TreeTriangle>& triangles() const noexcept { return triangles_; }
    [[nodiscard]] std::uint32_t leaves() const noexcept { return leaves_; }

  private:
    [[nodiscard]] GridTriangle places_of(const std::array<std::uint32_t, 3>& posts) const noexcept {
        return {
            surface_->place_of(posts[0]),
            surface_->place_of(posts[1]),
            surface_->place_of(posts[2])};
    }

    void add(const std::array<std::uint32_t, 3>& posts, std::uint32_t level) {
        const auto number = static_cast<std::uint32_t>(triangles_.size());
        TreeTriangle& made = triangles_.emplace_back();
        made.posts = posts;
        made.level = level;
        const GridTriangle places = places_of(posts);
        const glm::dvec3 middle =
            (surface_->point_at(places[1]) + surface_->point_at(places[2])) / 2.0;
        made.measured = surface_->measure(places, middle);
        for (std::size_t k = 0; k < 3; ++k) {
            owners_[edge_key(posts[k], posts[(k + 1) % 3])] = number;
        }
        ++leaves_;
    }

    /// The triangle on the other side of the split edge; none at the rim.
    [[nodiscard]] std::uint32_t partner_of(std::uint32_t triangle) const {
        const auto& posts = triangles_[triangle].posts;
        const auto found = owners_.find(edge_key(posts[2], posts[1]));
        return found == owners_.end() ? kNone32 : found->second;
    }

    [[nodiscard]] bool share_split_edge(std::uint32_t a, std::uint32_t b) const noexcept {
        return triangles_[a].posts[1] == triangles_[b].posts[2] &&
               triangles_[a].posts[2] == triangles_[b].posts[1];
    }

    /// How many triangles more there are when one is split, at most.
    [[nodiscard]] std::uint32_t cost_of(std::uint32_t triangle) const {
        std::uint32_t cost = 0;
        for (;;) {
            const std::uint32_t partner = partner_of(triangle);
            if (partner == kNone32) {
                return cost + 1;
            }
            cost += 2;
            if (share_split_edge(triangle, partner)) {
                return cost;
            }
            triangle = partner;
        }
    }

    /// The post nearest to the middle of the split edge, the same from either side.
    [[nodiscard]] std::uint32_t middle_of_edge(std::uint32_t triangle) const noexcept {
        const auto& posts = triangles_[triangle].posts;
        const GridPlace a = surface_->place_of(posts[1]);
        const GridPlace b = surface_->place_of(posts[2]);
        const std::int64_t x = (a.x + b.x) / 2;
        const std::int64_t z = (a.z + b.z) / 2;
        return static_cast<std::uint32_t>(z * std::int64_t{columns_} + x);
    }

    using Halves = std::array<std::array<std::uint32_t, 3>, 2>;

    [[nodiscard]] Halves halves_of(std::uint32_t triangle, std::uint32_t middle) const noexcept {
        const auto& [apex, left, right] = triangles_[triangle].posts;
        return {{{middle, apex, left}, {middle, right, apex}}};
    }

    [[nodiscard]] bool can_halve(std::uint32_t triangle, std::uint32_t middle) const noexcept {
        const Halves halves = halves_of(triangle, middle);
        return doubled_area(places_of(halves[0])) > 0 && doubled_area(places_of(halves[1])) > 0;
    }

    void halve(std::uint32_t triangle, std::uint32_t middle) {
        const Halves halves = halves_of(triangle, middle);
        const std::uint32_t level = triangles_[triangle].level + 1;
        const auto& posts = triangles_[triangle].posts;
        owners_.erase(edge_key(posts[1], posts[2])); // its other edges are the children's now
        triangles_[triangle].child = static_cast<std::uint32_t>(triangles_.size());
        --leaves_;
        add(halves[0], level);
        add(halves[1], level);
    }

    /// Splits a triangle and the one that shares its split edge, and before them what is coarser.
    /// @return false where posts are too close
    [[nodiscard]] bool split(std::uint32_t triangle) {
        std::uint32_t partner = partner_of(triangle);
        if (partner != kNone32 && !share_split_edge(triangle, partner)) {
            if (!split(partner)) {
                return false;
            }
            partner = partner_of(triangle);
        }
        const std::uint32_t middle = middle_of_edge(triangle);
        if (!can_halve(triangle, middle) || (partner != kNone32 && !can_halve(partner, middle))) {
            return false;
        }
        halve(triangle, middle);
        if (partner != kNone32) {
            halve(partner, middle);
        }
        return true;
    }

    std::uint32_t columns_;
    const GridSurface* surface_;
    std::vector<TreeTriangle> triangles_;
    /// By directed edge: the triangle without children that has it.
    std::unordered_map<std::uint64_t, std::uint32_t> owners_;
    std::uint32_t leaves_ = 0;
};

/// Splits of all triangles, made from the finest ones up.
std::vector<ProxySplit>
nested_splits(const std::vector<TreeTriangle>& triangles, const GridSurface& surface) {
    // Triangles with one split edge are one group. An edge is split by triangles of one level only.
    std::unordered_map<std::uint64_t, std::uint32_t> group_of_edge;
    std::vector<std::uint32_t> group_of(triangles.size());
    std::vector<ProxySplit> groups;
    std::vector<std::uint32_t> order(triangles.size());
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        order[i] = i;
        const auto& posts = triangles[i].posts;
        const auto [low, high] = std::minmax(posts[1], posts[2]);
        const auto [found, is_new] = group_of_edge.try_emplace(
            edge_key(low, high), static_cast<std::uint32_t>(groups.size())
        );
        group_of[i] = found->second;
        if (is_new) {
            ProxySplit& group = groups.emplace_back();
            const glm::dvec3 middle = (surface.point_at(surface.place_of(low)) +
                                       surface.point_at(surface.place_of(high))) /
                                      2.0;
            group.center = glm::vec3(middle);
        }
    }
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return triangles[a].level > triangles[b].level;
    });
    for (const std::uint32_t i : order) {
        const TreeTriangle& triangle = triangles[i];
        ProxySplit& group = groups[group_of[i]];
        const auto& posts = triangle.posts;
        const glm::dvec3 middle = (surface.point_at(surface.place_of(posts[1])) +
                                   surface.point_at(surface.place_of(posts[2]))) /
                                  2.0;
        const double rounding = glm::distance(middle, glm::dvec3(group.center));
        const auto hold = [&group](double radius, double offset) {
            group.radius = std::max(group.radius, rounded_up(radius));
            group.offset = std::max(group.offset, rounded_up(offset));
        };
        hold(triangle.measured.reach_m + rounding, triangle.measured.offset_m);
        for (std::uint32_t k = 0; k < 2 && triangle.child != kNone32; ++k) {
            const ProxySplit& below = groups[group_of[triangle.child + k]];
            const double apart = glm::distance(glm::dvec3(below.center), glm::dvec3(group.center));
            hold(apart + double{below.radius}, double{below.offset});
        }
    }
    std::vector<ProxySplit> splits;
    splits.reserve(triangles.size());
    for (const std::uint32_t group : group_of) {
        splits.push_back(groups[group]);
    }
    return splits;
}

/// Facets of all triangles, samples matched to those without children, and what can be said of
/// them.
HeightProxy with_samples(
    const HeightGrid& grid,
    const GridSurface& surface,
    const TreeBuilder& tree,
    const ProxyItems& items,
    const glm::dvec3& origin
) {
    HeightProxy proxy;
    ProxyPair& pair = proxy.pair;
    pair.fine = items.fine;
    pair.coarse = items.coarse;
    pair.origin = origin;
    std::vector<std::uint32_t> facet_of(grid.heights.size(), kNone32);
    double offset = 0.0;
    double upright = 0.0;
    const std::vector<TreeTriangle>& triangles = tree.triangles();
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
        const TreeTriangle& triangle = triangles[i];
        proxy.posts.insert(proxy.posts.end(), triangle.posts.begin(), triangle.posts.end());
        ProxyFacet& facet = pair.facets.emplace_back();
        facet.normal = glm::vec3(triangle.measured.normal);
        const glm::dvec3 corner = surface.point_at(surface.place_of(triangle.posts[0]));
        facet.plane = static_cast<float>(glm::dot(glm::dvec3(facet.normal), corner));
        offset = std::max(offset, triangle.measured.offset_m);
        if (triangle.child != kNone32) {
            continue;
        }
        upright = std::max(upright, triangle.measured.upright_m);
        const GridTriangle places = {
            surface.place_of(triangle.posts[0]),
            surface.place_of(triangle.posts[1]),
            surface.place_of(triangle.posts[2])};
        surface.for_posts(places, [&](const GridPlace& place) {
            std::uint32_t& facet_there = facet_of
                [static_cast<std::size_t>(place.z) * grid.columns +
                 static_cast<std::size_t>(place.x)];
            facet_there = std::min(facet_there, i);
        });
    }
    double sum_sq = 0.0;
    pair.offset_m = rounded_up(offset);
    pair.samples.reserve(grid.heights.size());
    for (std::uint32_t post = 0; post < grid.heights.size(); ++post) {
        const glm::vec3 point(surface.point_at(surface.place_of(post)));
        pair.samples.push_back({point, facet_of[post]});
        const float height = height_over(pair.facets[facet_of[post]], point);
        sum_sq += double{height} * double{height};
        pair.offset_m = std::max(pair.offset_m, std::abs(height));
    }
    build_proxy_nodes(pair);
    pair.quality.facets = tree.leaves();
    pair.quality.samples = static_cast<std::uint32_t>(pair.samples.size());
    pair.quality.rms_m = std::sqrt(sum_sq / static_cast<double>(pair.samples.size()));
    pair.quality.hausdorff_m = upright; // from each point the other surface is as near, up or down
    return proxy;
}

} // namespace

Result<HeightProxy>
build_grid_proxy(const HeightGrid& grid, const ProxyItems& items, const GridProxyOptions& options) {
    if (Result<void> checked = check(grid, items); !checked) {
        return tl::unexpected(std::move(checked).error());
    }
    const Result<Squares> squares = squares_of(grid, options.squares, "squares");
    if (!squares) {
        return tl::unexpected(squares.error());
    }
    const glm::dvec3 origin = middle_of(grid);
    const GridSurface surface(grid, origin);
    TreeBuilder tree(grid, surface);
    tree.add_roots(grid, *squares);
    return with_samples(grid, surface, tree, items, origin);
}

Result<HeightProxy> build_refined_proxy(
    const HeightGrid& grid, const ProxyItems& items, const RefinedProxyOptions& options
) {
    if (Result<void> checked = check(grid, items); !checked) {
        return tl::unexpected(std::move(checked).error());
    }
    const Result<Squares> squares = squares_of(grid, options.root_squares, "root_squares");
    if (!squares) {
        return tl::unexpected(squares.error());
    }
    const std::uint64_t roots = 2ULL * squares->columns * squares->rows;
    if (options.max_triangles < roots || options.max_triangles > kMostTriangles) {
        return bad(
            "max_triangles",
            std::to_string(options.max_triangles) + ", expected " + std::to_string(roots) +
                " roots to 2^26"
        );
    }
    if (!(options.error_m >= 0.0) || !std::isfinite(options.error_m)) {
        return bad("error_m", std::to_string(options.error_m));
    }
    const glm::dvec3 origin = middle_of(grid);
    const GridSurface surface(grid, origin);
    TreeBuilder tree(grid, surface);
    tree.add_roots(grid, *squares);
    tree.refine(options.max_triangles, options.error_m);
    HeightProxy proxy = with_samples(grid, surface, tree, items, origin);
    ProxyPair& pair = proxy.pair;
    pair.splits = nested_splits(tree.triangles(), surface);
    pair.root_count = static_cast<std::uint32_t>(roots);
    for (const TreeTriangle& triangle : tree.triangles()) {
        pair.children.push_back(triangle.child);
    }
    for (const ProxySplit& split : pair.splits) {
        pair.offset_m = std::max(pair.offset_m, split.offset);
    }
    return proxy;
}

} // namespace farfield
