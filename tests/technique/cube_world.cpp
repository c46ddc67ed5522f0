#include "technique/cube_world.hpp"

#include "support/random.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/image/surface_sampler.hpp>
#include <farfield/partition/bsp.hpp>

#include <catch2/catch.hpp>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

namespace farfield::support {

namespace {

/// Shapes are leafy balls of this radius. [m]
constexpr double kShapeRadius = 3.0;

/// Lets every ray pass: the colours are filled in later.
class EmptySampler final : public SurfaceSampler {
  public:
    [[nodiscard]] glm::dvec3 origin() const noexcept override { return glm::dvec3(0.0); }
    void cast(
        ItemId /*item*/,
        std::span<const SurfaceRay> /*rays*/,
        float /*spacing*/,
        std::span<SurfaceHit> hits
    ) const noexcept override {
        std::fill(hits.begin(), hits.end(), SurfaceHit{});
    }
};

glm::dvec3 on_grid(const glm::dvec3& point) {
    return glm::round(point * 1024.0) / 1024.0;
}

std::vector<Triangle3d> make_shape(std::uint32_t triangles, Random& random) {
    std::vector<Triangle3d> shape;
    for (std::uint32_t i = 0; i < triangles; ++i) {
        const glm::dvec3 middle =
            random.direction<double>() * random.uniform(0.3, 1.0) * kShapeRadius;
        Triangle3d triangle{};
        for (glm::dvec3& corner_at : triangle) {
            corner_at = on_grid(middle + random.vector(-0.2, 0.2));
        }
        shape.push_back(triangle);
    }
    return shape;
}

std::vector<Triangle3d> make_ground(std::uint32_t cells, double radius, Random& random) {
    const double step = 2.0 * radius / std::max(cells, 1U);
    std::vector<glm::dvec3> grid;
    for (std::uint32_t i = 0; i < (cells + 1) * (cells + 1); ++i) {
        const std::uint32_t column = i % (cells + 1);
        const std::uint32_t row = i / (cells + 1);
        grid.push_back(on_grid(
            {column * step - radius, random.uniform(-1.0, 1.0) - kShapeRadius, row * step - radius}
        ));
    }
    std::vector<Triangle3d> ground;
    for (std::uint32_t i = 0; i < cells * cells; ++i) {
        const std::uint32_t a = i / cells * (cells + 1) + i % cells;
        const std::uint32_t b = a + cells + 1;
        ground.push_back({grid[a], grid[b], grid[a + 1]});
        ground.push_back({grid[a + 1], grid[b], grid[b + 1]});
    }
    return ground;
}

/// From a random quaternion: square roots alone, so the same with every mathematics library.
glm::dmat3 random_rotation(Random& random) {
    const glm::dvec3 axis = random.direction<double>();
    const double w = random.uniform(-1.0, 1.0);
    const double s = std::sqrt(1.0 - w * w);
    const glm::dvec3 v = axis * s;
    return {
        {1 - 2 * (v.y * v.y + v.z * v.z), 2 * (v.x * v.y + w * v.z), 2 * (v.x * v.z - w * v.y)},
        {2 * (v.x * v.y - w * v.z), 1 - 2 * (v.x * v.x + v.z * v.z), 2 * (v.y * v.z + w * v.x)},
        {2 * (v.x * v.z + w * v.y), 2 * (v.y * v.z - w * v.x), 1 - 2 * (v.x * v.x + v.y * v.y)}};
}

glm::dmat3 rotation_of(Turns turns, Random& random) {
    if (turns == Turns::none) {
        return glm::dmat3(1.0);
    }
    return turns == Turns::any ? random_rotation(random) : axis_rotations()[random.below(24)];
}

void fill_colors(ColorCubeModel& model, bool gains, Random& random) {
    for (ColorCubeTree& tree : model.trees) {
        for (ColorCube& cube : tree.cubes) {
            for (glm::u8vec4& face : cube.faces) {
                face.a = static_cast<std::uint8_t>(1 + random.below(255));
                for (int i = 0; i < 3; ++i) {
                    face[i] = static_cast<std::uint8_t>(random.below(face.a + 1U));
                }
            }
        }
        tree.gains.clear();
        for (std::size_t i = 0; gains && i < tree.cells.size(); ++i) {
            const unsigned sheet = random.below(3) == 0 ? 0x80U : 0U;
            CubeGain& gain = tree.gains.emplace_back();
            for (std::uint8_t& stored : gain.stored) {
                stored = static_cast<std::uint8_t>(40U + random.below(48));
            }
            gain.stored[0] = static_cast<std::uint8_t>(gain.stored[0] | sheet);
        }
        if (!gains) {
            tree.level_factors.clear();
        }
    }
}

} // namespace

std::vector<glm::dmat3> axis_rotations() {
    std::vector<glm::dmat3> rotations;
    for (int x = 0; x < 3; ++x) {
        for (int y = 0; y < 3; ++y) {
            for (int signs = 0; x != y && signs < 8; ++signs) {
                glm::dmat3 rotation(0.0);
                rotation[0][x] = (signs & 1) != 0 ? -1.0 : 1.0;
                rotation[1][y] = (signs & 2) != 0 ? -1.0 : 1.0;
                rotation[2][3 - x - y] = (signs & 4) != 0 ? -1.0 : 1.0;
                if (glm::determinant(rotation) > 0.0) {
                    rotations.push_back(rotation);
                }
            }
        }
    }
    return rotations;
}

CubeWorld make_cube_world(const CubeWorldOptions& options) {
    Random random(options.seed);
    CubeWorld world;
    std::vector<CubePrototype> prototypes;
    for (std::uint32_t i = 0; i < 2; ++i) {
        world.shapes.push_back(make_shape(options.shape_triangles, random));
        CubePrototype& prototype = prototypes.emplace_back();
        prototype.item = make_id<ItemId>(i);
        prototype.primitives = options.shape_triangles;
        for (const Triangle3d& triangle : world.shapes.back()) {
            prototype.bounds = unite(prototype.bounds, bounds(triangle));
        }
    }
    for (std::size_t i = 0; i < options.references; ++i) {
        CubePlacement placement;
        placement.prototype = static_cast<std::uint32_t>(i % 2);
        const glm::dmat3 rotation = rotation_of(options.turns, random);
        const double scale = options.turns == Turns::any ? random.uniform(0.5, 1.5) : 1.0;
        const double x = random.uniform(-options.radius, options.radius);
        const double z = random.uniform(-options.radius, options.radius);
        placement.object_to_world = glm::dmat4x3(
            rotation[0] * scale, rotation[1] * scale, rotation[2] * scale, on_grid({x, 0.0, z})
        );
        Box3d box;
        for (const Triangle3d& triangle : world.shapes[placement.prototype]) {
            for (const glm::dvec3& p : triangle) {
                box = unite(box, placement.object_to_world * glm::dvec4(p, 1.0));
            }
        }
        world.objects.push_back({box, options.shape_triangles, false});
        world.placements.push_back(placement);
    }
    for (std::size_t i = 0; i < options.whole_items; ++i) {
        const double x = random.uniform(-options.radius, options.radius);
        const double z = random.uniform(-options.radius, options.radius);
        const glm::dvec3 lo = on_grid({x, 4.0, z});
        world.objects.push_back({{lo, lo + 2.0}, 500, false});
        world.placements.emplace_back();
    }
    world.ground = make_ground(options.ground_cells, options.radius, random);
    if (!world.ground.empty()) {
        Box3d box;
        for (const Triangle3d& triangle : world.ground) {
            box = unite(box, bounds(triangle));
        }
        world.objects.push_back({box, world.ground.size(), true});
        world.placements.emplace_back();
    }
    for (const Object& object : world.objects) {
        world.item_primitives.push_back(object.primitives);
    }
    ColorCubeInput input;
    input.objects = world.objects;
    input.triangle = [&](std::uint32_t, std::uint32_t triangle) { return world.ground[triangle]; };
    input.prototypes = prototypes;
    input.prototype_triangle = [&](std::uint32_t shape, std::uint32_t triangle) {
        return world.shapes[shape][triangle];
    };
    input.placements = world.placements;
    SerialExecutor executor;
    auto model = build_color_cubes(input, EmptySampler(), {.rays = 1, .shared_rays = 0}, executor);
    INFO((model ? "" : model.error().message));
    REQUIRE(model.has_value());
    world.model = std::move(*model);
    fill_colors(world.model, options.gains, random);
    const auto valid = validate(world.model);
    INFO((valid ? "" : valid.error().message));
    REQUIRE(valid.has_value());
    auto tree =
        partition::build_bsp(world.objects, {}, [&](std::uint32_t, std::uint32_t primitive) {
            return bounds(world.ground[primitive]);
        });
    REQUIRE(tree.has_value());
    world.hierarchy = std::move(*tree);
    return world;
}

ColorCubeModel make_single_cells(
    const std::vector<CubeReference>& placed,
    const CubeCell& cell,
    float edge,
    const ColorCube& colors,
    const std::vector<CubeGain>& gains
) {
    ColorCubeModel model;
    model.item_count = static_cast<std::uint32_t>(placed.size());
    ColorCubeTree& shape = model.trees.emplace_back();
    shape.lo = glm::vec3(-0.5F * edge);
    shape.edge = edge;
    shape.cells = {{0, 0, cell.extent}};
    shape.cubes = {colors};
    shape.gains = gains;
    shape.contents = {0 | ColorCubeTree::kLast};
    shape.primitives = {{kNone<ItemId>, 0, 1}};
    shape.quality = {0, 1};
    ColorCubeTree& scene = model.trees.emplace_back();
    scene.lo = glm::vec3(-128.0F);
    scene.edge = 256.0F;
    scene.cells = {{}};
    scene.cubes = {{}};
    scene.reference_count = model.item_count;
    scene.quality = {0, 1};
    for (std::uint32_t i = 0; i < model.item_count; ++i) {
        CubeReference& reference = model.references.emplace_back(placed[i]);
        reference.item = make_id<ItemId>(i);
        reference.tree = 0;
        reference.light_set = 0;
        scene.contents.push_back(i);
    }
    scene.contents.back() |= ColorCubeTree::kLast;
    const auto valid = validate(model);
    INFO((valid ? "" : valid.error().message));
    REQUIRE(valid.has_value());
    return model;
}

Hierarchy make_item_hierarchy(std::size_t count) {
    const std::vector<Object> objects(count, {{glm::dvec3(-1.0), glm::dvec3(1.0)}, 1, false});
    auto tree = partition::build_bsp(objects);
    REQUIRE(tree.has_value());
    return std::move(*tree);
}

std::vector<CellPlace> places_of(const ColorCubeTree& tree) {
    std::vector<CellPlace> places(tree.cells.size());
    const std::vector<Box3f> boxes = contents_boxes(tree);
    places[0].contents = boxes[0];
    places[0].lo = tree.lo;
    places[0].edge = tree.edge;
    for (std::uint32_t i = 0; i < places.size(); ++i) {
        std::uint32_t child = tree.cells[i].first;
        for (unsigned octant = 0; octant < 8; ++octant) {
            if ((tree.cells[i].octants >> octant & 1U) != 0) {
                const double half = places[i].edge * 0.5;
                const glm::dvec3 upper(octant & 1U, octant >> 1U & 1U, octant >> 2U);
                places[child] = {
                    places[i].lo + upper * half,
                    half,
                    i,
                    boxes[child],
                    octant,
                    places[i].depth + 1};
                ++child;
            }
        }
    }
    return places;
}

CubePlanReader::CubePlanReader(const CubeWorld& world) : world_(&world) {
    for (const ColorCubeTree& tree : world.model.trees) {
        places_.push_back(support::places_of(tree));
        std::size_t numbers = tree.reference_count + tree.items.size();
        for (const CubePrimitives& primitives : tree.primitives) {
            numbers += primitives.count;
        }
        auto& holders = holders_.emplace_back(numbers);
        for (std::uint32_t cell = 0; cell < tree.cells.size(); ++cell) {
            if (tree.cells[cell].octants == 0) {
                for_each_content(tree, tree.cells[cell], [&](std::uint32_t number) {
                    holders[number].push_back(cell);
                });
            }
        }
    }
}

std::size_t CubePlanReader::tree_index(std::uint32_t reference) const {
    return reference == kScene ? world_->model.trees.size() - 1
                               : world_->model.references[reference].tree;
}

const ColorCubeTree& CubePlanReader::tree_of(std::uint32_t reference) const {
    return world_->model.trees[tree_index(reference)];
}

const std::vector<CellPlace>& CubePlanReader::places_of(std::uint32_t reference) const {
    return places_[tree_index(reference)];
}

const std::vector<std::uint32_t>&
CubePlanReader::leaves_with(std::uint32_t reference, std::uint32_t number) const {
    return holders_[tree_index(reference)][number];
}

glm::dvec3 CubePlanReader::to_tree(std::uint32_t reference, const glm::dvec3& point) const {
    const glm::dvec3 local = point - world_->model.origin;
    if (reference == kScene) {
        return local;
    }
    const CubeReference& of = world_->model.references[reference];
    return glm::transpose(glm::dmat3(of.rotation)) * (local - glm::dvec3(of.translation)) /
           double{of.scale};
}

std::uint32_t CubePlanReader::leaf_at(std::uint32_t reference, const glm::dvec3& point) const {
    const ColorCubeTree& tree = tree_of(reference);
    const std::vector<CellPlace>& places = places_of(reference);
    std::uint32_t cell = 0;
    while (tree.cells[cell].octants != 0) {
        const glm::dvec3 middle = places[cell].lo + places[cell].edge * 0.5;
        const unsigned octant = (point.x > middle.x ? 1U : 0U) | (point.y > middle.y ? 2U : 0U) |
                                (point.z > middle.z ? 4U : 0U);
        std::uint32_t found = UINT32_MAX;
        for (std::uint32_t i = 0; i < child_count(tree.cells[cell]); ++i) {
            const std::uint32_t child = tree.cells[cell].first + i;
            found = places[child].octant == octant ? child : found;
        }
        if (found == UINT32_MAX) {
            return found;
        }
        cell = found;
    }
    return cell;
}

std::uint32_t CubePlanReader::find_in(
    std::uint32_t reference, const FramePlan& plan, const ShownCube& cube
) const {
    const ColorCubeTree& tree = tree_of(reference);
    const std::vector<CellPlace>& places = places_of(reference);
    const double scale =
        reference == kScene ? 1.0 : double{world_->model.references[reference].scale};
    const glm::dvec3 middle = to_tree(reference, plan.origin + glm::dvec3(cube.center));
    const glm::dvec3 size = glm::dvec3(cube.size) / scale;
    // Places are sums of a few floats of less than 256 m, so each is off by some ulps of 2^-17 m.
    // Contents are no smaller than a sixteenth of a cell, and cells of these scenes than 0.1 m.
    const double tolerance = 1e-4 / scale;
    const auto fits = [&](std::uint32_t cell) {
        const Box3f& box = places[cell].contents;
        const glm::dvec3 apart = glm::abs(glm::dvec3(farfield::center(box)) - middle);
        const glm::dvec3 larger = glm::abs(glm::dvec3(extent(box)) - size);
        return std::max({apart.x, apart.y, apart.z, larger.x, larger.y, larger.z}) < tolerance;
    };
    std::uint32_t cell = 0;
    while (!fits(cell)) {
        const glm::dvec3 half = places[cell].lo + places[cell].edge * 0.5;
        const unsigned octant = (middle.x > half.x ? 1U : 0U) | (middle.y > half.y ? 2U : 0U) |
                                (middle.z > half.z ? 4U : 0U);
        std::uint32_t found = UINT32_MAX;
        for (std::uint32_t i = 0; i < child_count(tree.cells[cell]); ++i) {
            const std::uint32_t child = tree.cells[cell].first + i;
            found = places[child].octant == octant ? child : found;
        }
        if (found == UINT32_MAX) {
            return found;
        }
        cell = found;
    }
    return cell;
}

CubePlanReader::Shown CubePlanReader::find(const FramePlan& plan, const ShownCube& cube) const {
    if (cube.frame == 0) {
        const std::uint32_t cell = find_in(kScene, plan, cube);
        if (cell == UINT32_MAX) {
            throw std::runtime_error("a cube of the scene is no cell of its tree");
        }
        return {kScene, cell};
    }
    for (std::uint32_t i = 0; i < world_->model.references.size(); ++i) {
        if (world_->model.references[i].rotation == plan.cube_frames.at(cube.frame)) {
            const std::uint32_t cell = find_in(i, plan, cube);
            if (cell != UINT32_MAX) {
                return {i, cell};
            }
        }
    }
    throw std::runtime_error("a cube is no cell of any reference");
}

void CubePlanReader::read(const FramePlan& plan) {
    shown_.clear();
    cells_.clear();
    items_.clear();
    selected_.clear();
    for (const ShownCube& cube : plan.cubes) {
        shown_.push_back(find(plan, cube));
        if (!cells_[shown_.back().reference].insert(shown_.back().cell).second) {
            throw std::runtime_error("a cell is shown twice");
        }
    }
    for (const ItemId item : plan.items) {
        if (!items_.insert(item).second) {
            throw std::runtime_error("item " + std::to_string(index_of(item)) + " is drawn twice");
        }
    }
    for (const Selection& selection : plan.selections) {
        std::set<std::uint32_t>& of_item = selected_[selection.item];
        if (!of_item.empty() || selection.count == 0 || draws(selection.item)) {
            throw std::runtime_error("a selection is empty, or one of several of an item");
        }
        for (std::uint32_t i = selection.first; i < selection.first + selection.count; ++i) {
            if (!of_item.insert(plan.selected.at(i)).second) {
                throw std::runtime_error("a triangle is drawn twice");
            }
        }
    }
}

std::size_t CubePlanReader::covers(std::uint32_t reference, std::uint32_t leaf) const {
    const auto found = cells_.find(reference);
    if (found == cells_.end()) {
        return 0;
    }
    std::size_t count = 0;
    for (std::uint32_t cell = leaf; cell != UINT32_MAX; cell = places_of(reference)[cell].parent) {
        count += found->second.count(cell);
    }
    return count;
}

bool CubePlanReader::draws(ItemId item, std::uint32_t triangle) const {
    const auto found = selected_.find(item);
    return found != selected_.end() && found->second.count(triangle) > 0;
}

double diameter_px(const View& view, const std::array<glm::dvec3, 8>& corners) noexcept {
    const glm::dvec2 focal(
        view.width / (view.lens.right - view.lens.left),
        view.height / (view.lens.top - view.lens.bottom)
    );
    std::array<glm::dvec2, 8> shown{};
    for (std::size_t i = 0; i < 8; ++i) {
        const glm::dvec3 at = glm::transpose(view.camera_to_world) * (corners[i] - view.eye);
        if (at.z >= 0.0) {
            return std::numeric_limits<double>::infinity();
        }
        shown[i] = glm::dvec2(at) / -at.z * focal;
    }
    double largest = 0.0;
    for (const glm::dvec2& a : shown) {
        for (const glm::dvec2& b : shown) {
            largest = std::max(largest, glm::distance(a, b));
        }
    }
    return largest;
}

std::array<glm::dvec3, 8> corners_of(const FramePlan& plan, const ShownCube& cube) noexcept {
    const glm::dmat3 frame(plan.cube_frames[cube.frame]);
    std::array<glm::dvec3, 8> corners{};
    for (unsigned i = 0; i < 8; ++i) {
        const glm::dvec3 side = glm::dvec3(i & 1U, i >> 1U & 1U, i >> 2U) * 2.0 - glm::dvec3(1.0);
        corners[i] =
            plan.origin + glm::dvec3(cube.center) + frame * (side * 0.5 * glm::dvec3(cube.size));
    }
    return corners;
}

} // namespace farfield::support
