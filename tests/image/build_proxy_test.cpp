#include "image/height_fields.hpp"
#include "support/random.hpp"
#include <farfield/image/build_proxy.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using farfield::support::height_at;
using farfield::support::mesh_of;
using farfield::support::Random;
using farfield::support::wavy_grid;

namespace {

constexpr ProxyItems kItems{ItemId{3}, ItemId{5}};

HeightProxy grid_proxy(const HeightGrid& grid, std::uint32_t squares) {
    auto built = build_grid_proxy(grid, kItems, {.squares = squares});
    INFO((built ? std::string() : built.error().message));
    REQUIRE(built.has_value());
    const Result<void> valid = validate(built->pair);
    INFO((valid ? std::string() : valid.error().message));
    REQUIRE(valid.has_value());
    return std::move(*built);
}

HeightProxy refined_proxy(const HeightGrid& grid, const RefinedProxyOptions& options) {
    auto built = build_refined_proxy(grid, kItems, options);
    INFO((built ? std::string() : built.error().message));
    REQUIRE(built.has_value());
    const Result<void> valid = validate(built->pair);
    INFO((valid ? std::string() : valid.error().message));
    REQUIRE(valid.has_value());
    REQUIRE(is_refinable(built->pair));
    return std::move(*built);
}

using Posts = std::array<std::uint32_t, 3>;

Posts posts_of(const HeightProxy& proxy, std::uint32_t triangle) {
    return {
        proxy.posts[triangle * 3], proxy.posts[triangle * 3 + 1], proxy.posts[triangle * 3 + 2]};
}

/// The triangles of a choice: those that `splits` says no to, or that have no children.
std::vector<std::uint32_t>
chosen(const ProxyPair& pair, const std::function<bool(const ProxySplit&)>& splits) {
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < pair.root_count; ++i) {
        open.push_back(i);
    }
    std::vector<std::uint32_t> choice;
    while (!open.empty()) {
        const std::uint32_t triangle = open.back();
        open.pop_back();
        if (pair.children[triangle] != UINT32_MAX && splits(pair.splits[triangle])) {
            open.push_back(pair.children[triangle]);
            open.push_back(pair.children[triangle] + 1);
        } else {
            choice.push_back(triangle);
        }
    }
    return choice;
}

std::vector<std::uint32_t> everything(const HeightProxy& proxy) {
    std::vector<std::uint32_t> all(proxy.posts.size() / 3);
    for (std::uint32_t i = 0; i < all.size(); ++i) {
        all[i] = i;
    }
    return all;
}

/// That triangles cover the grid once: all face up, their areas add up to all of it, and every edge
/// has a triangle on both sides or lies on the rim.
void check_whole(
    const HeightGrid& grid, const HeightProxy& proxy, const std::vector<std::uint32_t>& choice
) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    std::int64_t doubled_area = 0;
    for (const std::uint32_t triangle : choice) {
        const Posts posts = posts_of(proxy, triangle);
        const auto x = [&](std::size_t k) -> std::int64_t { return posts[k % 3] % grid.columns; };
        const auto z = [&](std::size_t k) -> std::int64_t { return posts[k % 3] / grid.columns; };
        const std::int64_t area = (z(1) - z(0)) * (x(2) - x(0)) - (x(1) - x(0)) * (z(2) - z(0));
        REQUIRE(area > 0);
        doubled_area += area;
        for (std::size_t k = 0; k < 3; ++k) {
            REQUIRE(edges.emplace(posts[k], posts[(k + 1) % 3]).second);
        }
    }
    CHECK(doubled_area == 2 * std::int64_t{grid.columns - 1} * (grid.rows - 1));
    for (const auto& [from, to] : edges) {
        const auto both = [&](std::uint32_t a, std::uint32_t b, std::uint32_t end) {
            return a == b && (a == 0 || a == end);
        };
        const bool on_rim = both(from % grid.columns, to % grid.columns, grid.columns - 1) ||
                            both(from / grid.columns, to / grid.columns, grid.rows - 1);
        const bool has_other_side = edges.count({to, from}) == 1;
        REQUIRE(has_other_side != on_rim);
    }
}

/// The farthest that random points of the surface over a triangle are from its plane, and the
/// farthest that they are from the center of its split. [m]
struct Found {
    double offset = 0.0;
    double reach = 0.0;
};

Found search(
    const HeightGrid& grid,
    const HeightProxy& proxy,
    std::uint32_t triangle,
    const glm::vec3& center,
    int points,
    Random& random
) {
    const Posts posts = posts_of(proxy, triangle);
    std::array<glm::dvec3, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
        const double x = posts[k] % grid.columns;
        const double z = posts[k] / grid.columns;
        corners[k] =
            grid.origin - proxy.pair.origin +
            glm::dvec3(x * grid.spacing_m, double{grid.heights[posts[k]]}, z * grid.spacing_m);
    }
    const glm::dvec3 normal =
        glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
    Found found;
    for (int i = 0; i < points; ++i) {
        double u = random.uniform(0.0, 1.0);
        double v = random.uniform(0.0, 1.0);
        if (u + v > 1.0) {
            u = 1.0 - u;
            v = 1.0 - v;
        }
        v = i % 3 == 0 ? 0.0 : v; // edges as well
        const glm::dvec3 flat =
            corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
        const glm::dvec3 place = (flat + proxy.pair.origin - grid.origin) / grid.spacing_m;
        const double height = height_at(grid, place.x, place.z);
        const glm::dvec3 point(flat.x, grid.origin.y - proxy.pair.origin.y + height, flat.z);
        found.offset = std::max(found.offset, std::abs(glm::dot(normal, point - corners[0])));
        found.reach = std::max(found.reach, glm::distance(point, glm::dvec3(center)));
    }
    return found;
}

/// Rounding of coordinates and heights of some hundred metres in double. [m]
constexpr double kRounding = 1e-9;

} // namespace

TEST_CASE("Proxies of heights name what they cannot be made of") {
    const HeightGrid grid = wavy_grid(9, 5);
    const auto refused = [](const auto& built) {
        REQUIRE_FALSE(built.has_value());
        return built.error().message;
    };
    CHECK_THAT(
        refused(build_grid_proxy(grid, {ItemId{1}, ItemId{1}}, {})), Catch::Contains("expected two")
    );
    CHECK_THAT(refused(build_grid_proxy({}, kItems, {})), Catch::Contains("its size is 0 x 0"));
    CHECK_THAT(
        refused(build_grid_proxy(grid, kItems, {.squares = 0})),
        Catch::Contains("squares is 0, expected 1 to 8")
    );
    CHECK_THAT(
        refused(build_grid_proxy(grid, kItems, {.squares = 9})), Catch::Contains("squares is 9")
    );
    CHECK_THAT(
        refused(build_refined_proxy(grid, kItems, {.root_squares = 9})),
        Catch::Contains("root_squares is 9")
    );
    CHECK_THAT(
        refused(build_refined_proxy(grid, kItems, {.root_squares = 2, .max_triangles = 3})),
        Catch::Contains("max_triangles is 3, expected 4 roots")
    );
    CHECK_THAT(
        refused(build_refined_proxy(grid, kItems, {.error_m = -1.0})),
        Catch::Contains("error_m is -1")
    );
}

TEST_CASE("The smallest grid is its own coarse model") {
    const HeightGrid grid = wavy_grid(2, 2);
    const HeightProxy fixed = grid_proxy(grid, 1);
    CHECK(fixed.pair.facets.size() == 2);
    CHECK(fixed.pair.samples.size() == 4);
    CHECK(fixed.pair.nodes.size() == 1);
    // Heights of some metres in float.
    CHECK(fixed.pair.offset_m < 1e-5F);
    CHECK(fixed.pair.quality.hausdorff_m < 1e-12);
    check_whole(grid, fixed, everything(fixed));
    const HeightProxy refined = refined_proxy(grid, {});
    CHECK(refined.pair.facets.size() == 2);
    CHECK(refined.pair.root_count == 2);
}

TEST_CASE("A plane needs no more than its roots") {
    HeightGrid grid = wavy_grid(33, 65);
    for (std::uint32_t row = 0; row < grid.rows; ++row) {
        for (std::uint32_t column = 0; column < grid.columns; ++column) {
            grid.heights[grid.post(column, row)] = 0.5F * static_cast<float>(column);
        }
    }
    const HeightProxy refined = refined_proxy(grid, {.error_m = kRounding});
    CHECK(refined.pair.facets.size() == 2);
    const HeightProxy fixed = grid_proxy(grid, 16);
    CHECK(fixed.pair.facets.size() == 16 * 8 * 2);
    // Coordinates of 100 m in float: 4 units of rounding of 1e-7 each.
    CHECK(fixed.pair.offset_m < 4e-5F);
    for (const ProxyNode& node : fixed.pair.nodes) {
        CHECK(node.axis.x == Approx(fixed.pair.facets[0].normal.x));
        CHECK(node.cosine == Approx(1.0F));
    }
}

TEST_CASE("A peak is as far as it stands out, wherever it stands") {
    // One post 5 m over a plane at height 0: over the middle of a square, a corner, an edge that
    // the surface is cut along, and one that it is not.
    const auto offset_of = [](std::uint32_t column, std::uint32_t row) {
        HeightGrid grid = wavy_grid(9, 9);
        std::fill(grid.heights.begin(), grid.heights.end(), 0.0F);
        grid.heights[grid.post(column, row)] = 5.0F;
        const HeightProxy proxy = grid_proxy(grid, 2);
        return proxy.pair.offset_m;
    };
    CHECK(offset_of(3, 1) == Approx(5.0F));
    CHECK(offset_of(2, 2) == Approx(5.0F)); // on the cut of a square
    CHECK(offset_of(4, 3) == Approx(5.0F)); // between squares
    // A corner of the coarse grid bends its facets: they are nowhere as far off as the posts around
    // it, one post away of 4 and so 3/4 of 5 m up, but for the slope.
    const float at_corner = offset_of(4, 4);
    CHECK(at_corner > 3.0F);
    CHECK(at_corner < 3.75F);
}

TEST_CASE("Fixed grids of any size cover the heights and measure them") {
    Random random(7);
    for (const auto& [columns, rows, squares] :
         {std::array{33U, 33U, 4U},
          {65U, 33U, 16U},
          {34U, 21U, 5U},
          {20U, 71U, 13U},
          {3U, 2U, 2U}}) {
        INFO(columns << " x " << rows << ", " << squares << " squares");
        const HeightGrid grid = wavy_grid(columns, rows, columns);
        const HeightProxy proxy = grid_proxy(grid, squares);
        CHECK_FALSE(is_refinable(proxy.pair));
        check_whole(grid, proxy, everything(proxy));
        const auto shorter = static_cast<double>(std::min(columns, rows) - 1);
        const auto longer = static_cast<double>(std::max(columns, rows) - 1);
        const auto across = std::max(std::lround(squares * shorter / longer), 1L);
        CHECK(proxy.pair.facets.size() == 2UL * squares * static_cast<std::size_t>(across));
        double farthest = 0.0;
        for (const std::uint32_t triangle : everything(proxy)) {
            const Found found = search(grid, proxy, triangle, glm::vec3(0.0F), 300, random);
            REQUIRE(found.offset <= double{proxy.pair.offset_m} + kRounding);
            farthest = std::max(farthest, found.offset);
        }
        // What is measured is there: noise of 0.3 m from post to post hides a little of it.
        CHECK(farthest >= 0.8 * double{proxy.pair.offset_m} - 0.3);
        CHECK(proxy.pair.quality.rms_m <= double{proxy.pair.offset_m});
        CHECK(proxy.pair.quality.hausdorff_m >= double{proxy.pair.offset_m} - 1e-4);
    }
}

TEST_CASE("Every choice of a refinable model meets without cracks and is as good as it says") {
    Random random(11);
    for (const auto& [columns, rows, roots] :
         {std::array{33U, 33U, 1U},
          {65U, 33U, 2U},
          {38U, 21U, 2U},
          {20U, 71U, 4U},
          {3U, 2U, 1U},
          {129U, 129U, 1U}}) {
        INFO(columns << " x " << rows << ", " << roots << " roots along the longer side");
        const HeightGrid grid = wavy_grid(columns, rows, rows);
        const HeightProxy proxy =
            refined_proxy(grid, {.root_squares = roots, .max_triangles = 3000});
        const ProxyPair& pair = proxy.pair;
        const glm::dvec3 size(columns * 3.0, 40.0, rows * 3.0);
        for (int trial = 0; trial < 24; ++trial) {
            const glm::dvec3 eye = random.vector(-0.6, 0.6) * size;
            const double threshold = std::exp(random.uniform(-7.0, 0.0));
            const bool by_distance = trial % 4 != 0;
            const auto choice = chosen(pair, [&](const ProxySplit& split) {
                const double distance =
                    glm::distance(eye, glm::dvec3(split.center)) - double{split.radius};
                return by_distance ? double{split.offset} > threshold * std::max(distance, 0.0)
                                   : double{split.offset} > 20.0 * threshold;
            });
            check_whole(grid, proxy, choice);
            for (const std::uint32_t triangle : choice) {
                const ProxySplit& split = pair.splits[triangle];
                const Found found = search(grid, proxy, triangle, split.center, 12, random);
                REQUIRE(found.offset <= double{split.offset} + kRounding);
                REQUIRE(found.reach <= double{split.radius} + kRounding);
            }
        }
    }
}

TEST_CASE("Triangles on both sides of a split edge have one split") {
    const HeightGrid grid = wavy_grid(70, 51);
    const HeightProxy proxy = refined_proxy(grid, {.max_triangles = 1000});
    std::vector<std::pair<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>> edges;
    for (const std::uint32_t triangle : everything(proxy)) {
        const Posts posts = posts_of(proxy, triangle);
        edges.push_back({std::minmax(posts[1], posts[2]), triangle}); // the right angle comes first
    }
    std::sort(edges.begin(), edges.end());
    int shared = 0;
    for (std::size_t i = 1; i < edges.size(); ++i) {
        if (edges[i].first == edges[i - 1].first) {
            ++shared;
            const std::uint32_t a = edges[i - 1].second;
            const std::uint32_t b = edges[i].second;
            CHECK(proxy.pair.splits[a] == proxy.pair.splits[b]);
            CHECK((proxy.pair.children[a] == UINT32_MAX) == (proxy.pair.children[b] == UINT32_MAX));
        }
    }
    CHECK(shared > 500);
}

TEST_CASE("Budgets and errors of the finest choice are kept") {
    const HeightGrid grid = wavy_grid(129, 97);
    double last_rms = 1e30;
    for (const std::uint32_t budget : {2U, 3U, 16U, 100U, 1000U, 5000U}) {
        const HeightProxy proxy = refined_proxy(grid, {.max_triangles = budget});
        CHECK(proxy.pair.quality.facets <= budget);
        CHECK(proxy.pair.quality.facets + 40 >= budget); // what one split may need at once
        CHECK(proxy.pair.quality.rms_m <= last_rms);
        last_rms = proxy.pair.quality.rms_m;
    }
    const HeightProxy good = refined_proxy(grid, {.max_triangles = 1U << 20U, .error_m = 0.5});
    CHECK(good.pair.quality.facets < 10000);
    const auto finest = chosen(good.pair, [](const ProxySplit&) { return true; });
    CHECK(finest.size() == good.pair.quality.facets);
    // What is off by more has posts so close together that its split edge cannot be halved.
    Random random(3);
    std::size_t stuck = 0;
    for (const std::uint32_t triangle : finest) {
        const Posts posts = posts_of(good, triangle);
        const auto apart = [&](std::uint32_t a, std::uint32_t b) {
            const auto across = [](std::uint32_t i, std::uint32_t j) {
                return i < j ? j - i : i - j;
            };
            return std::max(
                across(a % grid.columns, b % grid.columns),
                across(a / grid.columns, b / grid.columns)
            );
        };
        if (search(grid, good, triangle, glm::vec3(0.0F), 20, random).offset > 0.5 + kRounding) {
            ++stuck;
            CHECK(apart(posts[1], posts[2]) <= 2);
        }
    }
    CHECK(stuck < finest.size() / 20);
    // A better model for as many triangles is what refining is for.
    const HeightProxy fixed = grid_proxy(grid, 16);
    const HeightProxy same = refined_proxy(grid, {.max_triangles = fixed.pair.quality.facets});
    CHECK(same.pair.quality.hausdorff_m < fixed.pair.quality.hausdorff_m);
    // All posts, at last.
    const HeightProxy all = refined_proxy(wavy_grid(33, 20), {.max_triangles = 1U << 20U});
    CHECK(all.pair.quality.facets > 19 * 32);
    CHECK(all.pair.quality.facets <= 2 * 19 * 32);
}

TEST_CASE("Samples are the posts, matched to the triangle that they are over") {
    const HeightGrid grid = wavy_grid(41, 30);
    const HeightProxy proxy = refined_proxy(grid, {.max_triangles = 200});
    const ProxyPair& pair = proxy.pair;
    REQUIRE(pair.samples.size() == grid.heights.size());
    std::set<std::size_t> met;
    for (const ProxySample& sample : pair.samples) {
        const glm::dvec3 place =
            (glm::dvec3(sample.point) + pair.origin - grid.origin) / grid.spacing_m;
        const auto column = static_cast<std::uint32_t>(std::lround(place.x));
        const auto row = static_cast<std::uint32_t>(std::lround(place.z));
        met.insert(grid.post(column, row));
        CHECK(pair.children[sample.facet] == UINT32_MAX);
        const Posts posts = posts_of(proxy, sample.facet);
        for (std::size_t k = 0; k < 3; ++k) {
            const auto x = [&](std::size_t i) { return std::int64_t{posts[i % 3] % grid.columns}; };
            const auto z = [&](std::size_t i) { return std::int64_t{posts[i % 3] / grid.columns}; };
            REQUIRE((z(k + 1) - z(k)) * (column - x(k)) - (x(k + 1) - x(k)) * (row - z(k)) >= 0);
        }
    }
    CHECK(met.size() == grid.heights.size());
}

TEST_CASE("The same grid gives the same pair") {
    const HeightGrid grid = wavy_grid(100, 64);
    const HeightProxy first = refined_proxy(grid, {.max_triangles = 500});
    const HeightProxy second = refined_proxy(grid, {.max_triangles = 500});
    CHECK(first.pair == second.pair);
    CHECK(first.posts == second.posts);
}

TEST_CASE("Far from 0 a pair is what it is near") {
    HeightGrid grid = wavy_grid(65, 65);
    const HeightProxy here = refined_proxy(grid, {.max_triangles = 500});
    // Multiples of large powers of two: coordinates lose no digits.
    grid.origin += glm::dvec3(0x1p24, 0x1p20, -0x1p24);
    const HeightProxy far = refined_proxy(grid, {.max_triangles = 500});
    CHECK(here.posts == far.posts);
    CHECK(here.pair.samples == far.pair.samples);
    CHECK(far.pair.origin == here.pair.origin + glm::dvec3(0x1p24, 0x1p20, -0x1p24));
}

TEST_CASE("Coarse meshes of heights are made of vertices of the fine one") {
    const HeightGrid grid = wavy_grid(50, 33);
    Mesh fine = mesh_of(grid);
    fine.colors.resize(fine.positions.size(), glm::u8vec4(1, 2, 3, 255));
    const auto gridded = height_grid_of(fine);
    REQUIRE(gridded.has_value());
    for (const HeightProxy& proxy :
         {grid_proxy(gridded->grid, 8), refined_proxy(gridded->grid, {.max_triangles = 300})}) {
        const Mesh coarse = make_coarse_mesh(fine, *gridded, proxy);
        Scene scene;
        scene.meshes = {fine, coarse};
        CHECK(validate(scene).has_value());
        REQUIRE(primitive_count(coarse) == proxy.pair.facets.size());
        for (std::size_t i = 0; i < coarse.indices.size(); ++i) {
            const std::uint32_t vertex = coarse.indices[i];
            const std::uint32_t post = proxy.posts[i];
            REQUIRE(coarse.positions[vertex] == fine.positions[post]);
            REQUIRE(coarse.texcoords[vertex] == fine.texcoords[post]);
            REQUIRE(coarse.colors[vertex] == fine.colors[post]);
            REQUIRE(glm::length(coarse.normals[vertex]) == Approx(1.0F));
            REQUIRE(coarse.normals[vertex].y > 0.0F);
        }
        CHECK(coarse.bounds.lo.x == fine.bounds.lo.x);
        CHECK(coarse.bounds.hi.z == fine.bounds.hi.z);
    }
    // Normals are means over what a vertex stands for: of all posts, where it stands for all.
    const HeightProxy whole = grid_proxy(gridded->grid, 1);
    const Mesh coarse = make_coarse_mesh(fine, *gridded, whole);
    glm::dvec3 sum(0.0); // the corner at post 0, with half of the shorter side around it
    for (std::uint32_t row = 0; row <= 16; ++row) {
        for (std::uint32_t column = 0; column <= 16; ++column) {
            sum += glm::dvec3(fine.normals[grid.post(column, row)]);
        }
    }
    for (std::size_t i = 0; i < coarse.indices.size(); ++i) {
        if (whole.posts[i] == 0) {
            const glm::vec3 mean(glm::normalize(sum));
            CHECK(glm::distance(coarse.normals[coarse.indices[i]], mean) < 1e-6F);
        }
    }
}
