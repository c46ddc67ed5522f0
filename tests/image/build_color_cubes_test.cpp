#include "image/cube_scenes.hpp"
#include "support/small_scene.hpp"
#include "support/thread_executor.hpp"
#include <farfield/image/build_color_cubes.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr std::uint32_t kLast = ColorCubeTree::kLast;

/// Every cell has as many rays as the options say: the more that small trees share would take long
/// with surfaces that are as slow as those of tests.
ColorCubeModel
build(const ColorCubeInput& input, const SurfaceSampler& sampler, ColorCubeOptions options = {}) {
    options.shared_rays = 0;
    SerialExecutor executor;
    Result<ColorCubeModel> model = build_color_cubes(input, sampler, options, executor);
    INFO((model ? "" : model.error().message));
    REQUIRE(model.has_value());
    const Result<void> valid = validate(*model);
    INFO((valid ? "" : valid.error().message));
    REQUIRE(valid.has_value());
    return std::move(*model);
}

void check_refused(
    const ColorCubeInput& input,
    const std::string& text,
    const ColorCubeOptions& options = {},
    const SurfaceSampler& sampler = EmptySampler()
) {
    SerialExecutor executor;
    const Result<ColorCubeModel> model = build_color_cubes(input, sampler, options, executor);
    INFO(text);
    REQUIRE_FALSE(model.has_value());
    CHECK_THAT(model.error().message, Catch::StartsWith("colour cubes: ") && Catch::Contains(text));
}

/// Where a cell is, worked out from the root down.
struct Place {
    std::uint32_t cell = 0;
    glm::vec3 lo{0.0F};
    float edge = 0.0F;
    std::uint32_t depth = 0;

    [[nodiscard]] Place child(unsigned octant, std::uint32_t child_cell) const {
        const float half = edge * 0.5F;
        const glm::vec3 upper(octant & 1U, octant >> 1U & 1U, octant >> 2U);
        return {child_cell, lo + upper * half, half, depth + 1};
    }
    [[nodiscard]] Box3d box() const { return {lo, lo + edge}; }
};

void for_each_cell(const ColorCubeTree& tree, const std::function<void(const Place&)>& visit) {
    std::vector<Place> open = {{0, tree.lo, tree.edge, 0}};
    while (!open.empty()) {
        const Place place = open.back();
        open.pop_back();
        visit(place);
        std::uint32_t child = tree.cells[place.cell].first;
        for (unsigned octant = 0; octant < 8; ++octant) {
            if ((tree.cells[place.cell].octants >> octant & 1U) != 0) {
                open.push_back(place.child(octant, child++));
            }
        }
    }
}

std::set<std::uint32_t> contents_of(const ColorCubeTree& tree, const CubeCell& leaf) {
    std::set<std::uint32_t> numbers;
    for_each_content(tree, leaf, [&](std::uint32_t number) { numbers.insert(number); });
    return numbers;
}

/// Follows the primitives of a tree down from the outside, and checks where the tree ends.
class RuleCheck {
  public:
    RuleCheck(
        const ColorCubeTree& tree,
        const ColorCubeOptions& options,
        std::vector<double> costs,
        std::function<bool(std::uint32_t, const Box3d&)> reaches
    )
        : tree_(tree), options_(options), costs_(std::move(costs)), reaches_(std::move(reaches)) {
        std::vector<Share> all;
        for (std::uint32_t i = 0; i < costs_.size(); ++i) {
            all.push_back({i, 1.0});
        }
        visit({0, tree.lo, tree.edge, 0}, all);
    }

    std::size_t leaves_by_cost = 0;
    std::size_t leaves_by_copies = 0;
    std::size_t leaves_by_depth = 0;

  private:
    struct Share {
        std::uint32_t number = 0;
        double share = 1.0;
    };

    void visit(const Place& place, const std::vector<Share>& entries) {
        const CubeCell& cell = tree_.cells[place.cell];
        std::array<std::vector<Share>, 8> children;
        unsigned octants = 0;
        double borne = 0.0;
        double whole = 0.0;
        double copies = 0.0;
        for (const Share& entry : entries) {
            unsigned reached = 0;
            for (unsigned octant = 0; octant < 8; ++octant) {
                reached |= reaches_(entry.number, place.child(octant, 0).box()) ? 1U << octant : 0U;
            }
            const double share = entry.share / std::popcount(reached);
            for (unsigned octant = 0; octant < 8; ++octant) {
                if ((reached >> octant & 1U) != 0) {
                    children[octant].push_back({entry.number, share});
                }
            }
            octants |= reached;
            copies += 1.0 / share;
            borne += costs_[entry.number] * entry.share;
            whole += costs_[entry.number];
        }
        const double cubes = options_.cube_cost * std::popcount(octants);
        // Shares are products of at most 16 thirds and the like in float.
        constexpr double kRounding = 1e-5;
        INFO("cell " << place.cell << " of depth " << place.depth << " bears " << borne);
        if (cell.octants == 0) {
            std::set<std::uint32_t> expected;
            for (const Share& entry : entries) {
                expected.insert(entry.number);
            }
            // Which of them are small and are in another leaf is not its matter.
            const std::set<std::uint32_t> held = contents_of(tree_, cell);
            CHECK(std::includes(expected.begin(), expected.end(), held.begin(), held.end()));
            if (borne <= cubes * (1.0 + kRounding)) {
                ++leaves_by_cost;
            } else if (place.depth == options_.max_depth) {
                ++leaves_by_depth;
            } else {
                CHECK(copies > options_.max_copies * whole * (1.0 - kRounding));
                ++leaves_by_copies;
            }
            return;
        }
        CHECK(cell.octants == octants);
        CHECK(borne > cubes * (1.0 - kRounding));
        std::uint32_t child = cell.first;
        for (unsigned octant = 0; octant < 8; ++octant) {
            if ((octants >> octant & 1U) != 0) {
                visit(place.child(octant, child++), children[octant]);
            }
        }
    }

    const ColorCubeTree& tree_;
    const ColorCubeOptions& options_;
    std::vector<double> costs_;
    std::function<bool(std::uint32_t, const Box3d&)> reaches_;
};

/// What `rays` a side may be wrong by in a covered fraction whose rim is convex. A square of the
/// grid that is covered or empty is right, and the rim of a convex shape passes through at most
/// 4 n + 4 of n^2 (two for each row and each column that it enters). The others are independent and
/// in [0, 1], so by Hoeffding the sum of k of them is off by more than sqrt(k ln(2 / p) / 2) with
/// probability p, here 1e-9. Rounding to a byte adds half a step, the margin of the root 1e-5 of it
/// on either side.
double stratified_error(double rays) {
    const double crossed = 4.0 * rays + 4.0;
    return std::sqrt(crossed * std::log(2e9) / 2.0) / (rays * rays) + 0.5 / 255.0 + 1e-4;
}

/// One item in a box, drawn whole.
ColorCubeInput boxed_item(std::vector<Object>& objects, const Box3d& box) {
    objects = {{box, 100, false}};
    ColorCubeInput input;
    input.objects = objects;
    return input;
}

double alpha_of(const ColorCube& cube, std::size_t face) {
    return static_cast<double>(cube.faces[face].a) / 255.0;
}

/// Many balls, each an object of a hundred triangles.
struct Balls {
    std::vector<Object> objects;
    ShapeSampler sampler;

    explicit Balls(double scale = 1.0, int count = 150) {
        Random random(11);
        for (int i = 0; i < count; ++i) {
            const double radius = random.uniform(1.0, 5.0) * scale;
            const glm::dvec3 middle = random.vector(-50.0, 50.0) * scale;
            objects.push_back({{middle - radius, middle + radius}, 100, false});
            sampler.add_ball(
                glm::vec3(middle), static_cast<float>(radius), random.vector(0.0F, 1.0F)
            );
        }
    }
    [[nodiscard]] ColorCubeInput input() const {
        ColorCubeInput result;
        result.objects = objects;
        return result;
    }
};

glm::dmat4x3 turned(int quarters, double scale, const glm::dvec3& at) {
    constexpr std::array<std::pair<double, double>, 4> kTurns = {
        {{1.0, 0.0}, {0.0, 1.0}, {-1.0, 0.0}, {0.0, -1.0}}};
    const auto [c, s] = kTurns[static_cast<std::size_t>(quarters) % 4];
    return {scale * glm::dvec3(c, 0, -s), {0, scale, 0}, scale * glm::dvec3(s, 0, c), at};
}

/// A shape of some triangles that stands in several places.
struct Shared {
    TriangleSoup shape = random_soup(300, 4.0, 21);
    std::vector<Object> objects;
    std::vector<CubePrototype> prototypes;
    std::vector<CubePlacement> placements;

    explicit Shared(const std::vector<glm::dmat4x3>& places) {
        prototypes = {{ItemId{0}, 300, {glm::dvec3(-54.0), glm::dvec3(54.0)}}};
        for (const glm::dmat4x3& place : places) {
            Box3d box;
            for (const Triangle3d& triangle : shape.triangles) {
                for (const glm::dvec3& corner_at : triangle) {
                    box = unite(box, place * glm::dvec4(corner_at, 1.0));
                }
            }
            objects.push_back({box, 300, false});
            placements.push_back({0, place});
        }
    }
    [[nodiscard]] ColorCubeInput input() const {
        ColorCubeInput result;
        result.objects = objects;
        result.prototypes = prototypes;
        result.placements = placements;
        result.prototype_triangle = [this](std::uint32_t, std::uint32_t triangle) {
            return shape.triangles[triangle];
        };
        return result;
    }
};

} // namespace

TEST_CASE("Cells are divided while it pays, and hold what reaches into them") {
    for (const double size : {0.5, 5.0, 40.0}) {
        for (const double cube_cost : {0.7, 1.5, 6.0}) {
            TriangleSoup soup = random_soup(700, size, 1);
            const ColorCubeOptions options = {.cube_cost = cube_cost, .max_depth = 8, .rays = 1};
            const ColorCubeModel model = build(soup.input(), EmptySampler(), options);
            REQUIRE(model.trees.size() == 1);
            const ColorCubeTree& tree = model.trees[0];
            const auto reaches = [&](std::uint32_t number, const Box3d& box) {
                return overlaps(box, soup.triangles[number]);
            };
            INFO("triangles of " << size << " m, cubes cost " << cube_cost);
            const RuleCheck check(tree, options, std::vector<double>(700, 1.0), reaches);
            CHECK(check.leaves_by_cost > 0);
            // Only heaps of large triangles are left because of their copies.
            CHECK((check.leaves_by_copies > 0) == (size > 10.0 && cube_cost < 6.0));
            // Now without what the cells above say.
            std::vector<std::vector<Place>> reached(700);
            for_each_cell(tree, [&](const Place& place) {
                for (std::uint32_t i = 0; tree.cells[place.cell].octants == 0 && i < 700; ++i) {
                    if (reaches(i, place.box())) {
                        reached[i].push_back(place);
                    }
                }
            });
            std::size_t small = 0;
            double overhang = 0.0;
            for (std::uint32_t i = 0; i < 700; ++i) {
                const Box3d box = bounds(soup.triangles[i]);
                const glm::dvec3 sides = extent(box);
                float smallest = std::numeric_limits<float>::infinity();
                std::vector<Place> holders;
                bool has_middle = false;
                for (const Place& place : reached[i]) {
                    smallest = std::min(smallest, place.edge);
                    has_middle = has_middle || contains(place.box(), center(box));
                    if (contents_of(tree, tree.cells[place.cell]).count(i) != 0) {
                        holders.push_back(place);
                    }
                }
                CAPTURE(i);
                if (std::max({sides.x, sides.y, sides.z}) > double{smallest}) {
                    CHECK(holders.size() == reached[i].size());
                    continue;
                }
                ++small;
                REQUIRE(holders.size() == 1);
                CHECK((!has_middle || contains(holders.front().box(), center(box))));
                const Box3d leaf = holders.front().box();
                for (int axis = 0; axis < 3; ++axis) {
                    overhang = std::max(
                        {overhang, leaf.lo[axis] - box.lo[axis], box.hi[axis] - leaf.hi[axis]}
                    );
                }
            }
            CHECK((small > 0 || size == 40.0));
            CHECK(double{tree.overhang} == Approx(overhang).margin(1e-4));
        }
    }
}

TEST_CASE("Triangles of a closed surface are in every leaf that they reach into, torn ones in one"
) {
    // The faces of a box in squares of two triangles each, which share their edges to the bit. An
    // odd number of them, so that planes between cells cut through some.
    constexpr int kSide = 15;
    const auto make_box = [](double shrunk) {
        TriangleSoup soup;
        for (int face = 0; face < 6; ++face) {
            const int axis = face / 2;
            const auto corner_at = [&](int u, int v) {
                glm::dvec3 at(0.0);
                at[axis] = face % 2 == 0 ? -20.0 : 20.0;
                at[(axis + 1) % 3] = 40.0 * u / kSide - 20.0;
                at[(axis + 2) % 3] = 40.0 * v / kSide - 20.0;
                return at;
            };
            for (int i = 0; i < kSide * kSide; ++i) {
                const int u = i % kSide;
                const int v = i / kSide;
                const std::array<glm::dvec3, 4> c = {
                    corner_at(u, v),
                    corner_at(u + 1, v),
                    corner_at(u, v + 1),
                    corner_at(u + 1, v + 1)};
                soup.triangles.push_back({c[0], c[1], c[2]});
                soup.triangles.push_back({c[3], c[2], c[1]});
            }
        }
        for (Triangle3d& triangle : soup.triangles) {
            const glm::dvec3 middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
            for (glm::dvec3& corner_at : triangle) {
                corner_at += (middle - corner_at) * shrunk;
            }
        }
        return soup;
    };
    for (const bool closed : {true, false}) {
        TriangleSoup soup = make_box(closed ? 0.0 : 0.01);
        const ColorCubeModel model =
            build(soup.input(), EmptySampler(), {.cube_cost = 8.0, .rays = 1});
        const ColorCubeTree& tree = model.trees[0];
        std::vector<std::size_t> reached(soup.triangles.size(), 0);
        std::vector<std::size_t> held(soup.triangles.size(), 0);
        std::vector<float> smallest(soup.triangles.size(), std::numeric_limits<float>::infinity());
        for_each_cell(tree, [&](const Place& place) {
            if (tree.cells[place.cell].octants != 0) {
                return;
            }
            const auto contents = contents_of(tree, tree.cells[place.cell]);
            for (std::uint32_t i = 0; i < soup.triangles.size(); ++i) {
                if (overlaps(place.box(), soup.triangles[i])) {
                    ++reached[i];
                    smallest[i] = std::min(smallest[i], place.edge);
                }
                held[i] += contents.count(i);
            }
        });
        std::size_t in_several = 0;
        for (std::size_t i = 0; i < soup.triangles.size(); ++i) {
            const glm::dvec3 sides = extent(bounds(soup.triangles[i]));
            const bool small = std::max({sides.x, sides.y, sides.z}) <= double{smallest[i]};
            CAPTURE(i, closed, small, reached[i]);
            CHECK(held[i] == (closed || !small ? reached[i] : 1));
            in_several += small && reached[i] > 1 ? 1 : 0;
        }
        CHECK(in_several > 50);
        CHECK((tree.overhang == 0.0F) == closed);
    }
}

TEST_CASE("Boxes of contents hold the part of every triangle inside the cell, and little more") {
    TriangleSoup soup = random_soup(500, 3.0, 2);
    const ColorCubeModel model = build(soup.input(), EmptySampler(), {.rays = 1});
    const ColorCubeTree& tree = model.trees[0];
    const std::vector<Box3f> told_boxes = contents_boxes(tree);
    for_each_cell(tree, [&](const Place& place) {
        const Box3f& told = told_boxes[place.cell];
        Box3d expected;
        for (const Triangle3d& triangle : soup.triangles) {
            expected = unite(expected, clipped_bounds(place.box(), triangle));
        }
        INFO("cell " << place.cell);
        // Rounding of the box of an interior cell, which is united from those of its children.
        const double slack = 1e-5 * double{place.edge};
        for (int axis = 0; axis < 3; ++axis) {
            CHECK(told.lo[axis] <= expected.lo[axis] + slack);
            CHECK(told.hi[axis] >= expected.hi[axis] - slack);
            CHECK(told.lo[axis] >= expected.lo[axis] - place.edge / 16.0F - slack);
            CHECK(told.hi[axis] <= expected.hi[axis] + place.edge / 16.0F + slack);
        }
    });
}

TEST_CASE("Items are where their parts are, or everywhere in their boxes") {
    const Balls balls;
    const auto box_of = [&](std::uint32_t item) { return balls.objects[item].bounds; };
    for (const bool with_parts : {false, true}) {
        ColorCubeInput input = balls.input();
        if (with_parts) { // only the lower half of each
            input.part = [&](std::uint32_t item, const Box3d& box) {
                Box3d half = box_of(item);
                half.hi.y = center(half).y;
                return intersect(half, box);
            };
        }
        const ColorCubeModel model = build(input, EmptySampler(), {.rays = 1});
        const ColorCubeTree& tree = model.trees[0];
        CHECK(tree.items.size() == 150);
        CHECK(tree.item_primitives == std::vector<std::uint32_t>(150, 100));
        for_each_cell(tree, [&](const Place& place) {
            if (tree.cells[place.cell].octants != 0) {
                return;
            }
            const std::set<std::uint32_t> held = contents_of(tree, tree.cells[place.cell]);
            for (std::uint32_t i = 0; i < 150; ++i) {
                Box3d box = box_of(i);
                box.hi.y = with_parts ? center(box).y : box.hi.y;
                // Boxes are kept in float, rounded outwards: near a face either is right.
                const Box3d cell = place.box();
                const bool surely = !is_empty(intersect(inflate(box, glm::dvec3(-1e-4)), cell));
                const bool perhaps = !is_empty(intersect(inflate(box, glm::dvec3(1e-4)), cell));
                const bool is_held = held.count(i) != 0;
                if ((surely && !is_held) || (is_held && !perhaps)) {
                    FAIL("item " << i << " and leaf " << place.cell);
                }
            }
        });
    }
}

TEST_CASE("References are in every leaf that their boxes reach into, and in no other") {
    std::vector<glm::dmat4x3> places;
    Random random(31);
    for (int i = 0; i < 60; ++i) {
        const double scale = random.uniform(0.5, 2.0);
        places.push_back(turned(i, scale, random.vector(-2000.0, 2000.0)));
    }
    const Shared shared(places);
    const ColorCubeModel model = build(shared.input(), EmptySampler(), {.rays = 1});
    REQUIRE(model.trees.size() == 2);
    REQUIRE(model.references.size() == 60);
    const ColorCubeTree& scene = model.trees[1];
    CHECK(scene.cells.size() > 1);
    // Floats of some thousand metres, added a few times.
    constexpr double kRounding = 1e-3;
    std::vector<double> held(60, 0.0); // [m^3] of the box of each, in the leaves that have it
    const std::vector<Box3f> boxes = contents_boxes(scene);
    for_each_cell(scene, [&](const Place& place) {
        if (scene.cells[place.cell].octants != 0) {
            return;
        }
        const Box3f& contents = boxes[place.cell];
        for (const std::uint32_t number : contents_of(scene, scene.cells[place.cell])) {
            const Box3d& box = shared.objects[number].bounds;
            const Box3d part = intersect(place.box(), inflate(box, glm::dvec3(kRounding)));
            CAPTURE(number, place.cell);
            CHECK(!is_empty(part));
            const Box3d inside = intersect(place.box(), box);
            if (!is_empty(inside)) {
                const glm::dvec3 size = extent(inside);
                held[number] += size.x * size.y * size.z;
                // The box of the colours is around all that is in the leaf.
                const Box3d colored =
                    inflate(Box3d{contents.lo, contents.hi}, glm::dvec3(kRounding));
                CHECK(contains(colored, inside.lo));
                CHECK(contains(colored, inside.hi));
            }
        }
    });
    for (std::size_t i = 0; i < 60; ++i) {
        const glm::dvec3 size = extent(shared.objects[i].bounds);
        const double whole = size.x * size.y * size.z;
        CAPTURE(i);
        CHECK(held[i] == Approx(whole).epsilon(6.0 * kRounding / size.x));
    }
    for (std::size_t i = 0; i < 60; ++i) {
        const CubeReference& reference = model.references[i];
        CHECK(index_of(reference.item) == i);
        const glm::dmat4x3& place = shared.placements[i].object_to_world;
        CHECK(glm::distance(reference.rotation[0] * reference.scale, glm::vec3(place[0])) < 1e-5F);
        CHECK(reference.translation == glm::vec3(place[3]));
    }
}

TEST_CASE("References side by side leave no gap between their leaves") {
    // Shapes of 108 m, 100 m apart, in one layer.
    constexpr int kSide = 9;
    std::vector<glm::dmat4x3> places;
    for (int i = 0; i < kSide * kSide; ++i) {
        glm::dmat4x3 place(1.0);
        const int row = i / kSide;
        place[3] = glm::dvec3(i % kSide * 100.0, 0.0, row * 100.0);
        places.push_back(place);
    }
    const Shared shared(places);
    const ColorCubeModel model = build(shared.input(), EmptySampler(), {.rays = 1});
    const ColorCubeTree& scene = model.trees.back();
    std::vector<Box3d> leaves;
    const std::vector<Box3f> boxes = contents_boxes(scene);
    for_each_cell(scene, [&](const Place& place) {
        if (scene.cells[place.cell].octants == 0) {
            const Box3f& box = boxes[place.cell];
            leaves.push_back({box.lo, box.hi});
        }
    });
    CHECK(leaves.size() >= 16);
    Random random(77);
    for (int i = 0; i < 2000; ++i) {
        const glm::dvec3 point(
            random.uniform(0.0, 800.0), random.uniform(-45.0, 45.0), random.uniform(0.0, 800.0)
        );
        CAPTURE(point.x, point.y, point.z);
        REQUIRE(std::any_of(leaves.begin(), leaves.end(), [&](const Box3d& leaf) {
            return contains(leaf, point);
        }));
    }
}

TEST_CASE("Faces of analytic shapes are covered as much as they should be") {
    constexpr std::uint32_t kRays = 64;
    const double error = stratified_error(kRays);
    const Box3d unit{glm::dvec3(0.0), glm::dvec3(1.0)};
    std::vector<Object> objects;
    const ColorCubeInput input = boxed_item(objects, unit);
    const ColorCubeOptions options = {.max_depth = 0, .rays = kRays};
    SECTION("a ball is a disc from all sides") {
        ShapeSampler sampler;
        sampler.add_ball(glm::vec3(0.5F), 0.4F, glm::vec3(1.0F));
        const ColorCubeModel model = build(input, sampler, options);
        for (std::size_t face = 0; face < 6; ++face) {
            const double expected = std::numbers::pi * 0.16;
            CHECK(std::abs(alpha_of(model.trees[0].cubes[0], face) - expected) <= error);
        }
        // Aslant it is the same disc in a larger silhouette, which the gain knows.
        const ColorCubeTree& tree = model.trees[0];
        const glm::vec3 gains = gain_of(tree.gains[0]);
        double covered = 0.0;
        Random random(3);
        constexpr int kDirections = 2000;
        for (int i = 0; i < kDirections; ++i) {
            const glm::vec3 d = random.direction<float>();
            const float silhouette = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
            const glm::vec3 depths(-std::log1p(-std::numbers::pi_v<float> * 0.16F));
            const float factor = level_factor(tree.level_factors[0], d, level_scale(tree));
            covered += double{silhouette} *
                       double{oblique_alpha(depths, d, glm::vec3(1.0F), gains, factor)} /
                       kDirections;
        }
        // It is measured with 48 rays, of which a third meets: 3 sigma are 0.2 of silhouettes of
        // 1.5 in the mean.
        CHECK(std::abs(covered - std::numbers::pi * 0.16) <= 0.3);
        CHECK_FALSE(is_sheet(model.trees[0].gains[0]));
    }
    SECTION("a box is a rectangle, in its colour as it is lit") {
        const Box3f box{{0.25F, 0.1F, 0.0F}, {0.75F, 0.6F, 0.3F}};
        const glm::vec3 color(0.9F, 0.5F, 0.1F);
        ShapeSampler sampler;
        sampler.add_box(box, color);
        const ColorCubeModel model = build(input, sampler, options);
        const ColorCube& cube = model.trees[0].cubes[0];
        const glm::vec3 to_light = glm::normalize(input.light.to_light);
        const glm::vec3 size = extent(box);
        for (int axis = 0; axis < 3; ++axis) {
            const double area = double{size[(axis + 1) % 3]} * double{size[(axis + 2) % 3]};
            for (const bool positive : {false, true}) {
                const std::size_t face = face_of(static_cast<std::size_t>(axis), positive);
                INFO("face " << face);
                CHECK(std::abs(alpha_of(cube, face) - area) <= error);
                const float towards = to_light[axis] * (positive ? 1.0F : -1.0F);
                const float lit =
                    input.light.ambient + (1.0F - input.light.ambient) * (0.5F + 0.5F * towards);
                for (int i = 0; i < 3; ++i) {
                    // Colour and alpha are rounded, each by half a step.
                    const float expected = color[i] * lit * static_cast<float>(cube.faces[face].a);
                    CHECK(std::abs(static_cast<float>(cube.faces[face][i]) - expected) <= 1.01F);
                }
            }
        }
    }
    SECTION("a plane is covered from two sides and empty from four, and a sheet") {
        ShapeSampler sampler;
        sampler.add_box({{0.0F, 0.5F, 0.0F}, {1.0F, 0.5F, 1.0F}}, glm::vec3(1.0F));
        const ColorCubeModel model = build(input, sampler, options);
        const ColorCube& cube = model.trees[0].cubes[0];
        for (const std::size_t face : {0U, 1U, 4U, 5U}) {
            CHECK(cube.faces[face] == glm::u8vec4(0));
        }
        // But for the margin of the root, which rays may pass through.
        CHECK(alpha_of(cube, face_of(1, false)) >= 1.0 - error);
        CHECK(alpha_of(cube, face_of(1, true)) >= 1.0 - error);
        CHECK(is_sheet(model.trees[0].gains[0]));
    }
    SECTION("what is near hides what is far") {
        ShapeSampler sampler;
        sampler.add_box({{-1.0F, -1.0F, 0.7F}, {2.0F, 2.0F, 0.8F}}, {1.0F, 0.0F, 0.0F});
        sampler.add_box({{-1.0F, -1.0F, 0.2F}, {2.0F, 2.0F, 0.3F}}, {0.0F, 1.0F, 0.0F});
        const ColorCubeModel model = build(input, sampler, options);
        const ColorCube& cube = model.trees[0].cubes[0];
        CHECK(cube.faces[face_of(2, true)].a == 255);
        CHECK(cube.faces[face_of(2, true)].g == 0);
        CHECK(cube.faces[face_of(2, false)].a == 255);
        CHECK(cube.faces[face_of(2, false)].r == 0);
    }
}

TEST_CASE("Interior cubes of the published kind are composed of those below") {
    const Balls balls;
    const ColorCubeModel model =
        build(balls.input(), balls.sampler, {.colors = CubeColors::composed});
    const ColorCubeTree& tree = model.trees[0];
    CHECK(tree.gains.empty());
    REQUIRE(tree.cells.size() > 50);
    for (std::size_t i = 0; i < tree.cells.size(); ++i) {
        if (tree.cells[i].octants == 0) {
            continue;
        }
        std::array<ColorCube, 8> octants{};
        std::uint32_t child = tree.cells[i].first;
        for (std::size_t octant = 0; octant < 8; ++octant) {
            if ((tree.cells[i].octants >> octant & 1U) != 0) {
                octants[octant] = tree.cubes[child++];
            }
        }
        CHECK(tree.cubes[i] == composed(octants));
    }
}

TEST_CASE("Few rays are as far from many as their number says") {
    const Balls balls(1.0, 40);
    const ColorCubeModel few =
        build(balls.input(), balls.sampler, {.max_depth = 2, .rays = 4, .shared_rays = 0});
    const ColorCubeModel many =
        build(balls.input(), balls.sampler, {.max_depth = 2, .rays = 64, .shared_rays = 0});
    REQUIRE(few.trees[0].cells == many.trees[0].cells);
    double alpha_sum = 0.0;
    double color_sum = 0.0;
    std::size_t faces = 0;
    for (std::size_t i = 0; i < few.trees[0].cubes.size(); ++i) {
        for (std::size_t face = 0; face < 6; ++face, ++faces) {
            const glm::dvec4 difference = glm::dvec4(few.trees[0].cubes[i].faces[face]) -
                                          glm::dvec4(many.trees[0].cubes[i].faces[face]);
            alpha_sum += difference.a * difference.a;
            color_sum += glm::dot(glm::dvec3(difference), glm::dvec3(difference)) / 3.0;
        }
    }
    const double alpha_error = std::sqrt(alpha_sum / static_cast<double>(faces)) / 255.0;
    const double color_error = std::sqrt(color_sum / static_cast<double>(faces)) / 255.0;
    CAPTURE(alpha_error, color_error, faces);
    // Each of 16 squares is wrong by 1/2 at the most, and independent: 1/2 / sqrt(16).
    CHECK(alpha_error <= 0.125);
    CHECK(color_error <= 0.125);
    CHECK(alpha_error > 0.0);
}

TEST_CASE("Turned shapes have sets of light, as many as they may") {
    std::vector<glm::dmat4x3> places;
    places.reserve(16);
    for (int i = 0; i < 16; ++i) {
        places.push_back(turned(i, 1.0, {200.0 * i, 0.0, 0.0}));
    }
    const Shared shared(places);
    ColorCubeInput input = shared.input();
    input.light.to_light = {0.8F, 0.5F, 0.1F};
    ShapeSampler sampler;
    sampler.add_box({glm::vec3(-60.0F), glm::vec3(60.0F)}, glm::vec3(1.0F));
    sampler.add_box({glm::vec3(-20.0F), glm::vec3(20.0F)}, glm::vec3(1.0F));
    const glm::vec3 to_light = glm::normalize(input.light.to_light);
    for (const std::uint32_t most : {1U, 2U, 3U, 8U}) {
        const ColorCubeModel model =
            build(input, sampler, {.max_depth = 0, .max_light_sets = most});
        const ColorCubeTree& shape = model.trees[0];
        REQUIRE(shape.light_sets == std::min(most, 4U));
        for (std::size_t i = 0; i < 16; ++i) {
            const CubeReference& reference = model.references[i];
            if (most >= 4) { // its own turn
                CHECK(reference.light_set == model.references[i % 4].light_set);
                const glm::vec3 seen = glm::transpose(reference.rotation) * to_light;
                const ColorCube& cube = shape.cubes[reference.light_set];
                for (int axis = 0; axis < 3; ++axis) {
                    const glm::u8vec4& face =
                        cube.faces[face_of(static_cast<std::size_t>(axis), true)];
                    const float lit = 0.25F + 0.75F * (0.5F + 0.5F * seen[axis]);
                    // The inner box is what rays from the faces of the root meet.
                    const float expected = lit * static_cast<float>(face.a);
                    CHECK(face.a > 0);
                    CHECK(std::abs(static_cast<float>(face.r) - expected) <= 1.01F);
                }
            }
        }
    }
    // Light along the axis that they are turned about is the same for all.
    input.light.to_light = {0.0F, 2.0F, 0.0F};
    CHECK(build(input, sampler).trees[0].light_sets == 1);
}

TEST_CASE("Models are the same for every executor and on every run") {
    const Balls balls;
    TriangleSoup soup = random_soup(2000, 3.0, 4);
    const ColorCubeModel serial_balls = build(balls.input(), balls.sampler);
    const ColorCubeModel serial_soup = build(soup.input(), balls.sampler);
    for (const unsigned threads : {1U, 2U, 5U}) {
        ThreadExecutor executor(threads);
        const auto of_balls =
            build_color_cubes(balls.input(), balls.sampler, {.shared_rays = 0}, executor);
        REQUIRE(of_balls.has_value());
        CHECK(*of_balls == serial_balls);
        const auto of_soup =
            build_color_cubes(soup.input(), balls.sampler, {.shared_rays = 0}, executor);
        REQUIRE(of_soup.has_value());
        CHECK(*of_soup == serial_soup);
    }
}

TEST_CASE("A scene that is larger by a power of two has the same model, larger") {
    const ColorCubeModel model = build(Balls().input(), Balls().sampler);
    const ColorCubeModel larger = build(Balls(64.0).input(), Balls(64.0).sampler);
    CHECK(larger.trees[0].edge == model.trees[0].edge * 64.0F);
    CHECK(larger.trees[0].lo == model.trees[0].lo * 64.0F);
    CHECK(larger.trees[0].cells == model.trees[0].cells);
    CHECK(larger.trees[0].contents == model.trees[0].contents);
    CHECK(larger.trees[0].cubes == model.trees[0].cubes);
    CHECK(larger.trees[0].gains == model.trees[0].gains);
}

TEST_CASE("A scene far from the origin has the same model there") {
    TriangleSoup soup = random_soup(1000, 2.0, 5);
    const Balls balls;
    const ColorCubeModel model = build(soup.input(), balls.sampler);
    // Corners are multiples of 2^-16 m, so that neither offset rounds them.
    for (const double offset : {8388608.0, 1e7}) {
        TriangleSoup far_soup = soup;
        for (Triangle3d& triangle : far_soup.triangles) {
            for (glm::dvec3& corner_at : triangle) {
                corner_at += glm::dvec3(offset, 0.0, -offset);
            }
        }
        Balls there;
        there.sampler.set_origin({offset, 0.0, -offset});
        ColorCubeModel moved = build(far_soup.input(), there.sampler);
        CHECK(moved.origin == glm::dvec3(offset, 0.0, -offset));
        moved.origin = model.origin;
        CHECK(moved == model);
        // Of an origin that far away little is left in float, but the model is one.
        CHECK(build(far_soup.input(), EmptySampler()).trees[0].cells.size() > 1);
    }
}

TEST_CASE("Flat, small and empty scenes") {
    SECTION("nothing") {
        check_refused({}, "there are no objects");
    }
    SECTION("one triangle") {
        TriangleSoup soup = random_soup(1, 1.0, 6);
        const ColorCubeModel model = build(soup.input(), EmptySampler());
        CHECK(model.trees[0].cells.size() == 1);
        CHECK(model.trees[0].contents == std::vector<std::uint32_t>{kLast});
    }
    SECTION("a plane") {
        TriangleSoup soup = random_soup(1000, 2.0, 7);
        for (Triangle3d& triangle : soup.triangles) {
            for (glm::dvec3& corner_at : triangle) {
                corner_at.y = 3.0;
            }
        }
        ShapeSampler sampler;
        sampler.add_box({{-60.0F, 3.0F, -60.0F}, {60.0F, 3.0F, 60.0F}}, glm::vec3(1.0F));
        const ColorCubeModel model = build(soup.input(), sampler);
        const ColorCubeTree& tree = model.trees[0];
        CHECK(tree.cells.size() > 200);
        const std::vector<Box3f> boxes = contents_boxes(tree);
        for_each_cell(tree, [&](const Place& place) {
            const Box3f& box = boxes[place.cell];
            CHECK(box.lo.y <= 3.0F);
            CHECK(box.hi.y >= 3.0F);
            // A sixteenth, or two where it is between them.
            CHECK(extent(box).y <= place.edge / 8.0F * 1.001F);
        });
    }
    SECTION("triangles without area: points and lines") {
        TriangleSoup soup = random_soup(300, 5.0, 8);
        for (std::size_t i = 0; i < soup.triangles.size(); ++i) {
            Triangle3d& triangle = soup.triangles[i];
            triangle[2] = triangle[1];
            triangle[1] = i % 2 == 0 ? triangle[0] : triangle[1];
            triangle[2] = i % 2 == 0 ? triangle[0] : triangle[2];
        }
        CHECK(build(soup.input(), EmptySampler()).trees[0].cells.size() > 50);
    }
    SECTION("all in one point") {
        TriangleSoup soup = random_soup(100, 1.0, 9);
        for (Triangle3d& triangle : soup.triangles) {
            triangle = {glm::dvec3(7.0), glm::dvec3(7.0), glm::dvec3(7.0)};
        }
        const ColorCubeModel model = build(soup.input(), EmptySampler());
        CHECK(model.trees[0].quality.depth <= 16);
    }
    SECTION("objects without primitives") {
        TriangleSoup soup = random_soup(0, 1.0, 9);
        soup.objects = {{{glm::dvec3(0.0), glm::dvec3(1.0)}, 0, true}};
        ColorCubeInput input = soup.input();
        soup.objects = {{{glm::dvec3(0.0), glm::dvec3(1.0)}, 0, true}};
        input.objects = soup.objects;
        check_refused(input, "no object has a primitive");
        // Beside one that has some they are nothing.
        soup.objects.push_back({{glm::dvec3(0.0), glm::dvec3(1.0)}, 0, false});
        input.objects = soup.objects;
        const ColorCubeModel model = build(input, EmptySampler());
        CHECK(model.trees[0].primitives == std::vector<CubePrimitives>{{ItemId{0}, 1, 0}});
    }
}

TEST_CASE("Heaps of triangles take bounded memory") {
    for (const std::uint32_t most : {1U, 8U, 32U}) {
        TriangleSoup soup = random_soup(1, 30.0, 10);
        soup.triangles.resize(1000, soup.triangles[0]);
        const ColorCubeModel model =
            build(soup.input(), EmptySampler(), {.max_copies = most, .rays = 1});
        const ColorCubeTree& tree = model.trees[0];
        // Shares of a cell and the cells beside it add up to its triangles, and the sum of 1 /
        // share over a cell that is divided is at most `most` a triangle; with Cauchy, and at most
        // eight octants for each, there are at most sqrt(8) times that many entries.
        INFO(most << " copies");
        CHECK(static_cast<double>(tree.contents.size()) <= std::sqrt(8.0) * most * 1000.0);
        // A level has less cells than what is borne above it pays for.
        CHECK(static_cast<double>(tree.cells.size()) <= 1.0 + 16.0 * 1000.0 / 1.5);
    }
}

TEST_CASE("A triangle as large as the scene does not cost what the dust around it does") {
    constexpr std::size_t kDust = 100'000;
    TriangleSoup soup = random_soup(kDust, 0.05, 11);
    const ColorCubeOptions options = {.rays = 1, .colors = CubeColors::composed};
    const std::uint64_t without = memory_bytes(build(soup.input(), EmptySampler(), options));
    soup.triangles.push_back({glm::dvec3(-50, -50, -50), {50, 50, -50}, {50, -50, 50}});
    const std::uint64_t with = memory_bytes(build(soup.input(), EmptySampler(), options));
    CAPTURE(without, with);
    // It is in the leaves along its plane alone, some n^(2/3) of n: the entry and the cells that
    // are divided for it.
    CHECK(with < without + without / 4);
}

TEST_CASE("What is no number is refused by name") {
    const double nan = std::nan("");
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double value : {nan, kInfinity, -kInfinity}) {
        for (std::size_t corner_index = 0; corner_index < 3; ++corner_index) {
            TriangleSoup soup = random_soup(20, 1.0, 12);
            const ColorCubeInput input = soup.input();
            soup.triangles[7][corner_index].y = value;
            check_refused(input, "triangle 7 of object 0 has the corners");
            Shared shared({turned(0, 1.0, glm::dvec3(0.0))});
            shared.shape.triangles[17][corner_index].z = value;
            check_refused(shared.input(), "triangle 17 of prototype 0 has the corners");
        }
        std::vector<Object> objects(3, {{glm::dvec3(0.0), glm::dvec3(1.0)}});
        ColorCubeInput input;
        input.objects = objects;
        objects[2].bounds.hi.x = value;
        check_refused(input, "box of object 2 is 0.000000 0.000000 0.000000 ");
        Shared shared({turned(0, 1.0, glm::dvec3(0.0)), turned(1, 1.0, glm::dvec3(0.0))});
        shared.placements[1].object_to_world[1].x = value;
        check_refused(shared.input(), "placement of item 1 has the columns");
        shared.placements[1].object_to_world = turned(0, 1.0, {0.0, value, 0.0});
        check_refused(shared.input(), "placement of item 1 has the columns");
        shared.placements[1].object_to_world = turned(0, 1.0, {0.0, 0.0, 0.0});
        shared.prototypes[0].bounds.lo.z = value;
        check_refused(shared.input(), "box of prototype 0 is");
        check_refused(
            Balls().input(), "origin of the sampler is", {}, EmptySampler({0.0, value, 0.0})
        );
    }
    std::vector<Object> inverted = {{{glm::dvec3(1.0), glm::dvec3(0.0)}}};
    ColorCubeInput input;
    input.objects = inverted;
    check_refused(input, "box of object 0 is 1.0");
    std::vector<Object> large = {{{glm::dvec3(-1e300), glm::dvec3(1e300)}}};
    input.objects = large;
    check_refused(input, "too large for float");
}

TEST_CASE("Placements have to be similarities") {
    const auto refused = [](const glm::dmat4x3& place) {
        check_refused(
            Shared({turned(0, 1.0, glm::dvec3(0.0)), turned(1, 2.0, glm::dvec3(50.0)), place})
                .input(),
            "placement of item 2 has the columns"
        );
    };
    const glm::dvec3 x(1, 0, 0);
    const glm::dvec3 y(0, 1, 0);
    const glm::dvec3 z(0, 0, 1);
    const glm::dvec3 at(0.0);
    refused({x, y, -z, at});           // a mirror image
    refused({x, y + 0.01 * x, z, at}); // a shear
    refused({x, y * 1.01, z, at});     // two scales
    refused({at, at, at, at});         // a point
    refused(turned(0, 1e-60, at));     // smaller than a float
    refused(turned(0, 1e60, at));      // and larger
    const Shared small({turned(3, 1e-3, at), turned(2, 1e3, at)});
    CHECK(build(small.input(), EmptySampler(), {.rays = 1}).references.size() == 2);
}

TEST_CASE("Input that contradicts itself is refused by name") {
    TriangleSoup soup = random_soup(5, 1.0, 13);
    ColorCubeInput input = soup.input();
    input.triangle = nullptr;
    check_refused(input, "object 0 is splittable, but no triangles are told");
    soup.objects[0].primitives = 1ULL << 40U;
    input.triangle = [](std::uint32_t, std::uint32_t) { return Triangle3d{}; };
    check_refused(input, "1099511627776 primitives, at most");

    const Shared good({turned(0, 1.0, glm::dvec3(0.0)), turned(1, 1.0, glm::dvec3(0.0))});
    Shared shared = good;
    shared.placements.pop_back();
    check_refused(shared.input(), "1 placements of 2 objects");
    shared = good;
    shared.placements[1].prototype = 1;
    check_refused(shared.input(), "placement of item 1 has prototype 1 of 1");
    shared = good;
    shared.prototypes[0].item = ItemId{2};
    check_refused(shared.input(), "prototype 0 is sampled as item 2");
    shared = good;
    shared.prototypes[0].primitives = 0;
    check_refused(shared.input(), "prototype 0 has 0 primitives");
    shared.prototypes[0].primitives = 1U << 30U;
    check_refused(shared.input(), "prototype 0 has 1073741824 primitives");
    input = good.input();
    input.prototype_triangle = nullptr;
    check_refused(input, "none of their triangles are told");
    for (const glm::vec3& light : {glm::vec3(0.0F), glm::vec3(std::nanf(""), 0.0F, 1.0F)}) {
        input = good.input();
        input.light.to_light = light;
        check_refused(input, "light from ");
    }
    for (const float ambient : {-0.1F, 1.1F, std::nanf("")}) {
        input = good.input();
        input.light.ambient = ambient;
        check_refused(input, "ambient ");
    }
    // A prototype that stands nowhere is a tree that nothing refers to.
    shared = good;
    shared.prototypes.push_back(shared.prototypes[0]);
    CHECK(build(shared.input(), EmptySampler(), {.rays = 1}).trees.size() == 3);
}

TEST_CASE("Options are refused outside their ranges") {
    const Balls balls;
    const ColorCubeInput input = balls.input();
    for (const double cost : {0.0, -1.0, 1.1e6, std::nan("")}) {
        check_refused(input, "cube_cost is ", {.cube_cost = cost});
    }
    check_refused(input, "max_depth is 21, expected [0, 20]", {.max_depth = 21});
    check_refused(input, "max_copies is 0, expected [1, 1024]", {.max_copies = 0});
    check_refused(input, "max_copies is 1025", {.max_copies = 1025});
    check_refused(input, "rays is 0, expected [1, 64]", {.rays = 0});
    check_refused(input, "rays is 65", {.rays = 65});
    check_refused(input, "colors is 2", {.colors = static_cast<CubeColors>(2)});
    check_refused(input, "max_light_sets is 0, expected [1, 64]", {.max_light_sets = 0});
    check_refused(input, "max_light_sets is 65", {.max_light_sets = 65});
    check_refused(
        input, "shared_rays is 1000000001, expected [0, 1e9]", {.shared_rays = 1'000'000'001}
    );
}

TEST_CASE("Cells of a surface are sheets, those of a carpet of tiles are not") {
    // A square of 100 m in triangles of 3 m, in no plane that halves a cell.
    TriangleSoup soup;
    constexpr int kSide = 32;
    constexpr double kStep = 100.0 / kSide;
    for (int i = 0; i < kSide * kSide; ++i) {
        const int row = i / kSide;
        const glm::dvec3 lo(i % kSide * kStep - 50.0, 0.3, row * kStep - 50.0);
        const glm::dvec3 x(kStep, 0.0, 0.0);
        const glm::dvec3 z(0.0, 0.0, kStep);
        soup.triangles.push_back({lo, lo + x, lo + z});
        soup.triangles.push_back({lo + x, lo + z, lo + x + z});
    }
    ShapeSampler surface;
    surface.add_box({{-50.0F, 0.3F, -50.0F}, {50.0F, 0.3F, 50.0F}}, glm::vec3(0.5F));
    // Every other square metre.
    ShapeSampler carpet;
    for (int i = 0; i < 100 * 50; ++i) {
        const int row = i / 50;
        const auto left = static_cast<float>(i % 50 * 2 + row % 2 - 50);
        const auto front = static_cast<float>(row - 50);
        carpet.add_box({{left, 0.3F, front}, {left + 1.0F, 0.3F, front + 1.0F}}, glm::vec3(0.5F));
    }
    const auto sheets = [&](const SurfaceSampler& sampler) {
        const ColorCubeModel model = build(soup.input(), sampler, {.max_depth = 4, .rays = 8});
        const std::vector<CubeGain>& gains = model.trees[0].gains;
        REQUIRE(gains.size() > 100);
        return std::pair(std::count_if(gains.begin(), gains.end(), is_sheet), gains.size());
    };
    const auto [of_surface, cells] = sheets(surface);
    CHECK(static_cast<std::size_t>(of_surface) == cells);
    const auto [of_carpet, same_cells] = sheets(carpet);
    CHECK(same_cells == cells);
    CHECK(of_carpet == 0);
}

TEST_CASE("Shown by the cells of one level, a field covers what rays find") {
    // Splinters in a slab of 24 m by 3 m, dense below: what is looked at aslant hides itself, less
    // than by chance from one cell to the next.
    Random random(91);
    TriangleSoup soup;
    ShapeSampler sampler;
    for (int i = 0; i < 200; ++i) {
        const double height = random.uniform(0.0, 1.0);
        const glm::dvec3 middle(
            random.uniform(-12.0, 12.0), 3.0 * height * height, random.uniform(-12.0, 12.0)
        );
        const glm::dvec3 half(0.2, 0.6, 0.2);
        sampler.add_box({glm::vec3(middle - half), glm::vec3(middle + half)}, glm::vec3(0.5F));
        const glm::dvec3 lo = middle - half;
        const glm::dvec3 hi = middle + half;
        soup.triangles.push_back({lo, hi, glm::dvec3(hi.x, lo.y, lo.z)});
        soup.triangles.push_back({lo, hi, glm::dvec3(lo.x, hi.y, hi.z)});
    }
    const ColorCubeModel model = build(soup.input(), sampler, {.rays = 8, .shared_rays = 200'000});
    const ColorCubeTree& tree = model.trees[0];
    const std::vector<Box3f> boxes = contents_boxes(tree);
    REQUIRE(tree.level_factors.size() == tree.quality.depth + 1U);
    REQUIRE(tree.quality.depth >= 2);
    const auto meets = [](const SurfaceRay& ray, const Box3f& box) {
        glm::vec2 range(0.0F, 1.0F);
        for (int axis = 0; axis < 3; ++axis) {
            const float to_lo = (box.lo[axis] - ray.from[axis]) / ray.along[axis];
            const float to_hi = (box.hi[axis] - ray.from[axis]) / ray.along[axis];
            range.x = std::max(range.x, std::min(to_lo, to_hi));
            range.y = std::min(range.y, std::max(to_lo, to_hi));
        }
        return range.x < range.y;
    };
    double found = 0.0;
    std::array<double, 2> modelled{}; // without factors, with them
    std::array<double, 2> off{};      // of directions, in the mean
    for (const float height : {5.0F, 15.0F, 30.0F, 50.0F, 75.0F}) {
        double found_here = 0.0;
        std::array<double, 2> here{};
        for (int i = 0; i < 40000; ++i) {
            const float elevation = height * std::numbers::pi_v<float> / 180.0F;
            const auto turn = random.uniform(0.0F, 2.0F * std::numbers::pi_v<float>);
            const glm::vec3 direction(
                std::cos(turn) * std::cos(elevation),
                -std::sin(elevation),
                std::sin(turn) * std::cos(elevation)
            );
            const glm::vec3 across = glm::normalize(glm::cross(direction, glm::vec3(0, 1, 0)));
            const glm::vec3 through = center(boxes[0]) + across * random.uniform(-18.0F, 18.0F) +
                                      glm::cross(across, direction) * random.uniform(-18.0F, 18.0F);
            const SurfaceRay ray{through - direction * 60.0F, direction * 120.0F};
            if (!meets(ray, boxes[0])) {
                continue;
            }
            SurfaceHit hit;
            sampler.cast(kNone<ItemId>, std::span(&ray, 1), 0.0F, std::span(&hit, 1));
            found_here += hit.t <= 1.0F ? 1.0 : 0.0;
            for (const bool with : {false, true}) {
                double passed = 1.0;
                std::vector<std::pair<std::uint32_t, std::uint32_t>> open = {{0, 0}};
                while (!open.empty()) {
                    const auto [index, depth] = open.back();
                    open.pop_back();
                    const CubeCell& cell = tree.cells[index];
                    if (!meets(ray, boxes[index])) {
                        continue;
                    }
                    if (cell.octants != 0 && depth < 2) {
                        for (std::uint32_t k = 0; k < child_count(cell); ++k) {
                            open.emplace_back(cell.first + k, depth + 1);
                        }
                        continue;
                    }
                    glm::vec3 depths;
                    for (int axis = 0; axis < 3; ++axis) {
                        const auto a = static_cast<std::size_t>(axis);
                        const auto& faces = tree.cubes[index].faces;
                        depths[axis] = optical_depth(faces[face_of(a, direction[axis] < 0.0F)].a);
                    }
                    const float factor =
                        with ? level_factor(tree.level_factors[depth], direction, level_scale(tree))
                             : 1.0F;
                    const glm::vec3 gains = gain_of(tree.gains[index]);
                    const glm::vec3 cell_size = extent(boxes[index]);
                    passed *=
                        1.0 - double{oblique_alpha(depths, direction, cell_size, gains, factor)};
                }
                here[with ? 1 : 0] += 1.0 - passed;
            }
        }
        found += found_here;
        for (std::size_t i = 0; i < 2; ++i) {
            modelled[i] += here[i];
            off[i] += std::abs(here[i] / found_here - 1.0) / 5.0;
        }
        CHECK(found_here > 300.0);
    }
    CAPTURE(modelled[0] / found, modelled[1] / found, off[0], off[1]);
    // About 2500 of the rays of each height meet, which makes 2 %, and the factors were fitted to
    // no more. They are six for all directions.
    CHECK(std::abs(modelled[1] / found - 1.0) <= 0.04);
    CHECK(off[1] <= 0.06);
    CHECK(off[1] < off[0]);
}

TEST_CASE("Small trees and upper cells have more rays") {
    /// Counts what is cast.
    class CountingSampler final : public SurfaceSampler {
      public:
        [[nodiscard]] glm::dvec3 origin() const noexcept override { return glm::dvec3(0.0); }
        void cast(
            ItemId /*item*/,
            std::span<const SurfaceRay> rays,
            float /*spacing*/,
            std::span<SurfaceHit> hits
        ) const noexcept override {
            std::fill(hits.begin(), hits.end(), SurfaceHit{});
            most = std::max(most, rays.size());
            all += rays.size();
        }
        mutable std::size_t most = 0;
        mutable std::size_t all = 0;
    };
    const auto cast_with = [](std::uint32_t shared_rays, std::size_t triangles) {
        TriangleSoup soup = random_soup(triangles, 3.0, 5);
        CountingSampler sampler;
        SerialExecutor executor;
        const auto model = build_color_cubes(
            soup.input(), sampler, {.rays = 4, .shared_rays = shared_rays}, executor
        );
        REQUIRE(model.has_value());
        return std::tuple(sampler.most, sampler.all, model->trees[0].cells.size());
    };
    // Six faces of 4 x 4 and eight directions of six; into the whole tree 128 directions of 64.
    const auto [most, all, cells] = cast_with(0, 200);
    CHECK(most == 96);
    CHECK(all == cells * (96 + 48) + std::size_t{128} * 64);
    const auto [shared_most, shared_all, same_cells] = cast_with(20'000, 200);
    CHECK(same_cells == cells);
    CHECK(shared_most > 96);
    CHECK(shared_most <= std::size_t{6} * 64 * 64);
    // What leaves share is of each of six directions; upper levels cost no more than half of what
    // is below each, so twice that is all, and oblique rays are half as many again.
    CHECK(shared_all > std::size_t{6} * 20'000);
    // One cell that has all of them still has no more than 64 a side.
    CHECK(std::get<0>(cast_with(1'000'000, 1)) == std::size_t{6} * 64 * 64);
}

TEST_CASE("A scene has its shared meshes as trees, its ground by triangles, the rest whole") {
    for (const glm::dvec3& offset : {glm::dvec3(0.0), glm::dvec3(1e7, 0.0, -1e7)}) {
        const Scene scene = small_scene(offset);
        SerialExecutor executor;
        const auto model = build_color_cubes(
            scene, EmptySampler(offset), {.rays = 1, .shared_rays = 0}, executor, 100
        );
        REQUIRE(model.has_value());
        CHECK(validate(*model).has_value());
        REQUIRE(model->trees.size() == 2);
        CHECK(model->references.size() == 64); // trees
        const ColorCubeTree& top = model->trees.back();
        REQUIRE(top.primitives.size() == 1); // ground
        CHECK(top.primitives[0].item == ItemId{0});
        CHECK(top.primitives[0].count == primitive_count(scene.meshes[0]));
        CHECK(top.items.size() == 6); // boxes and a sign
        CHECK(model->item_count == scene.instances.size());
        const auto whole = build_color_cubes(
            scene, EmptySampler(offset), {.rays = 1, .shared_rays = 0}, executor, 1000
        );
        REQUIRE(whole.has_value());
        CHECK(validate(*whole).has_value());
        CHECK(whole->trees.size() == 1);
        CHECK(whole->trees[0].items.size() == 70);
        const auto refused = build_color_cubes(scene, EmptySampler(offset), {}, executor, 0);
        REQUIRE_FALSE(refused.has_value());
        CHECK_THAT(refused.error().message, Catch::Contains("min_shared is 0"));
    }
}

TEST_CASE("The digest of a build tells scene and options apart") {
    const Scene scene = small_scene();
    const std::vector<ColorCubeOptions> options = {
        {},
        {.cube_cost = 2.0},
        {.max_depth = 15},
        {.max_copies = 9},
        {.rays = 5},
        {.colors = CubeColors::composed},
        {.max_light_sets = 7},
        {.shared_rays = 5}};
    std::set<std::uint64_t> digests;
    for (const ColorCubeOptions& each : options) {
        CHECK(digest(scene, each) == digest(scene, each));
        CHECK(digests.insert(digest(scene, each)).second);
    }
    CHECK(digests.insert(digest(scene, {}, 1000)).second);
    CHECK(digests.insert(digest(small_scene(glm::dvec3(1.0)), {})).second);
}
