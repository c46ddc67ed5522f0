#include "support/allocation_counter.hpp"
#include "support/random.hpp"
#include "technique/cube_world.hpp"
#include "technique/scenes.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/technique/color_cubes.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <catch2/catch.hpp>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr std::uint32_t kScene = CubePlanReader::kScene;

ColorCubes make_technique(
    const Hierarchy& hierarchy, const ColorCubeModel& model, const ColorCubesOptions& options = {}
) {
    auto technique = ColorCubes::create(hierarchy, model, options);
    INFO((technique ? "" : technique.error().message));
    REQUIRE(technique.has_value());
    return std::move(*technique);
}

ColorCubes make_technique(const CubeWorld& world, const ColorCubesOptions& options = {}) {
    return make_technique(world.hierarchy, world.model, options);
}

/// Cubes wherever cells are small enough, as boxes, which say exactly what they stand for.
ColorCubesOptions always_faces(double cell_px) {
    return {.cell_px = cell_px, .drawing = CubeDrawing::faces, .never_slower = false};
}

/// Looks about through any lens on a small picture, whose pixels are not square.
View random_view(Random& random, double reach) {
    glm::dvec3 eye = random.vector(-reach, reach);
    eye.y = random.uniform(-5.0, 0.4 * reach);
    const glm::dvec3 target = random.vector(-40.0, 40.0) * glm::dvec3(1.0, 0.1, 1.0);
    Lens lens;
    lens.left = random.uniform(-1.0, 0.3);
    lens.right = lens.left + random.uniform(0.4, 1.5);
    lens.bottom = random.uniform(-1.0, 0.3);
    lens.top = lens.bottom + random.uniform(0.4, 1.5);
    lens.near_distance = random.below(4) == 0 ? 20.0 : 0.25;
    lens.far_distance = random.below(4) == 0 ? 80.0 : 4096.0;
    const glm::dvec3 up = random.direction<double>();
    const int width = 60 + static_cast<int>(random.below(200));
    const int height = 60 + static_cast<int>(random.below(200));
    return look_at(eye, target, up, lens, width, height);
}

/// Looks from a distance at the middle, on 160 x 120 pixels.
View view_from(double distance, double height = 10.0) {
    return look_at(
        {0.0, height, distance}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, test_lens(), 160, 120
    );
}

/// Towards the middle and past it, 160 x 120 pixels. Places are multiples of 1/16 m, so that moving
/// all of it far away is exact.
std::vector<View> dolly(int frames, const glm::dvec3& offset = glm::dvec3(0.0)) {
    std::vector<View> views;
    for (int frame = 0; frame < frames; ++frame) {
        const glm::dvec3 eye(frame * 0.125, 12.0, 260.0 - frame * 300.0 / 256.0);
        const glm::dvec3 target(0.0, 4.0, -40.0);
        views.push_back(
            look_at(offset + eye, offset + target, {0.0, 1.0, 0.0}, test_lens(), 160, 120)
        );
    }
    return views;
}

/// Whether the frustum holds a point by more than plane distances are rounded by: of coordinates
/// below 256 m some ulps of 2^-16 m.
bool surely_inside(const Frustum& frustum, const glm::dvec3& local) {
    return std::all_of(frustum.planes.begin(), frustum.planes.end(), [&](const Plane& plane) {
        return signed_distance(plane, glm::vec3(local)) > 1e-3F;
    });
}

glm::dvec3 random_point(const Triangle3d& triangle, Random& random) {
    const double a = random.uniform(0.05, 0.9);
    const double b = random.uniform(0.05, 0.95 - a);
    return triangle[0] * (1.0 - a - b) + triangle[1] * a + triangle[2] * b;
}

glm::dvec3 random_point(const Box3d& box, Random& random) {
    return glm::mix(box.lo, box.hi, random.vector(0.0, 1.0));
}

/// Random points of the scene, held against what a plan shows.
struct CoverCheck {
    const CubeWorld& world;
    const CubePlanReader& reader;
    Random random{77};
    std::size_t seen = 0;   ///< points in a frustum
    std::size_t shown = 0;  ///< of them in cells shown
    std::size_t absent = 0; ///< in no leaf: on the boundary of cells

    void points(const View& view, std::size_t count) {
        const Frustum frustum = make_frustum(view, world.model.origin);
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t object = random.below(static_cast<unsigned>(world.objects.size()));
            const std::size_t references = world.model.references.size();
            if (world.objects[object].splittable) {
                point_of_ground(frustum);
            } else if (object < references) {
                point_of_reference(frustum, object);
            } else {
                point_of_item(frustum, object);
            }
        }
        cells_of_references();
        no_more_than_needed();
    }

  private:
    /// @return whether a point that is in the frustum has to be drawn as geometry
    bool open(std::uint32_t reference, std::uint32_t leaf) {
        const std::size_t covers = reader.covers(reference, leaf);
        REQUIRE(covers <= 1);
        shown += covers;
        return covers == 0;
    }

    void point_of_ground(const Frustum& frustum) {
        const auto id = make_id<ItemId>(world.objects.size() - 1);
        const auto number = random.below(static_cast<unsigned>(world.ground.size()));
        const glm::dvec3 point = random_point(world.ground[number], random);
        const std::uint32_t leaf = reader.leaf_at(kScene, reader.to_tree(kScene, point));
        if (leaf == UINT32_MAX) {
            ++absent;
        } else if (surely_inside(frustum, point - world.model.origin)) {
            ++seen;
            CAPTURE(number);
            const std::uint32_t first = world.model.trees.back().primitives.back().first;
            REQUIRE(
                (!open(kScene, leaf) || !is_due(kScene, first + number, leaf) ||
                 reader.draws(id, number))
            );
        }
    }

    /// Whether a triangle is to be drawn where an open leaf shows its contents: it is one of them,
    /// or the leaf that has it instead is open.
    [[nodiscard]] bool
    is_due(std::uint32_t reference, std::uint32_t number, std::uint32_t leaf) const {
        const std::vector<std::uint32_t>& holders = reader.leaves_with(reference, number);
        return std::count(holders.begin(), holders.end(), leaf) > 0 ||
               (holders.size() == 1 && reader.covers(reference, holders.front()) == 0);
    }

    void point_of_item(const Frustum& frustum, std::size_t object) {
        const glm::dvec3 point = random_point(world.objects[object].bounds, random);
        const std::uint32_t leaf = reader.leaf_at(kScene, reader.to_tree(kScene, point));
        if (leaf == UINT32_MAX) {
            ++absent;
        } else if (surely_inside(frustum, point - world.model.origin)) {
            ++seen;
            CAPTURE(object);
            REQUIRE((!open(kScene, leaf) || reader.draws(make_id<ItemId>(object))));
        }
    }

    void point_of_reference(const Frustum& frustum, std::size_t object) {
        const auto id = make_id<ItemId>(object);
        const auto& references = world.model.references;
        const auto found =
            std::find_if(references.begin(), references.end(), [&](const CubeReference& r) {
                return r.item == id;
            });
        const auto reference = static_cast<std::uint32_t>(found - references.begin());
        const std::vector<Triangle3d>& shape = world.shapes[world.placements[object].prototype];
        const auto number = random.below(static_cast<unsigned>(shape.size()));
        const glm::dvec3 at = random_point(shape[number], random);
        const glm::dvec3 point = world.placements[object].object_to_world * glm::dvec4(at, 1.0);
        if (!surely_inside(frustum, point - world.model.origin)) {
            return;
        }
        const std::vector<std::uint32_t>& leaves = reader.leaves_with(kScene, reference);
        const std::uint32_t leaf = reader.leaf_at(reference, at);
        if (leaf == UINT32_MAX) {
            ++absent;
            return;
        }
        ++seen;
        CAPTURE(object, number);
        const auto covered = std::count_if(leaves.begin(), leaves.end(), [&](std::uint32_t of) {
            return reader.covers(kScene, of) > 0;
        });
        if (covered == static_cast<std::ptrdiff_t>(leaves.size())) {
            ++shown;
            REQUIRE_FALSE(reader.draws(id));
            REQUIRE(reader.selected().count(id) == 0);
            REQUIRE(reader.covers(reference, leaf) == 0);
        } else if (reader.draws(id)) {
            REQUIRE(reader.covers(reference, leaf) == 0);
        } else if (open(reference, leaf) && covered == 0) {
            const std::uint32_t first = reader.tree_of(reference).primitives.front().first;
            REQUIRE((!is_due(reference, first + number, leaf) || reader.draws(id, number)));
        }
    }

    /// Cells of references are shown where the leaf of the scene around their middle is open.
    void cells_of_references() {
        for (const CubePlanReader::Shown& cell : reader.shown()) {
            if (cell.reference == kScene) {
                continue;
            }
            const CellPlace& place = reader.places_of(cell.reference)[cell.cell];
            const Box3f& box = place.contents;
            const CubeReference& of = world.model.references[cell.reference];
            const glm::vec3 middle =
                of.translation + of.rotation * farfield::center(box) * of.scale;
            const std::uint32_t leaf = reader.leaf_at(kScene, glm::dvec3(middle));
            CAPTURE(cell.reference, cell.cell);
            REQUIRE((leaf == UINT32_MAX || reader.covers(kScene, leaf) == 0));
        }
    }

    /// What is drawn has a leaf that no cube covers.
    void no_more_than_needed() {
        const ColorCubeTree& scene = world.model.trees.back();
        const auto check = [&](std::uint32_t reference, std::uint32_t number) {
            const auto& leaves = reader.leaves_with(reference, number);
            REQUIRE(std::any_of(leaves.begin(), leaves.end(), [&](std::uint32_t leaf) {
                return reader.covers(reference, leaf) == 0;
            }));
        };
        for (std::uint32_t i = 0; i < scene.items.size(); ++i) {
            if (reader.draws(scene.items[i])) {
                check(kScene, scene.reference_count + i);
            }
        }
        for (const CubePrimitives& group : scene.primitives) {
            for (std::uint32_t i = 0; i < group.count; ++i) {
                if (reader.draws(group.item, i)) {
                    check(kScene, group.first + i);
                }
            }
        }
        for (std::uint32_t i = 0; i < world.model.references.size(); ++i) {
            const ItemId item = world.model.references[i].item;
            if (reader.draws(item) || reader.selected().count(item) > 0) {
                check(kScene, i);
            }
            const auto selected = reader.selected().find(item);
            if (selected != reader.selected().end()) {
                const std::uint32_t first = reader.tree_of(i).primitives.front().first;
                for (const std::uint32_t triangle : selected->second) {
                    check(i, first + triangle);
                }
            }
        }
    }
};

/// Whether the first of two cells of one tree is certainly behind the second: every plane that
/// parts them has the second on the eye's side.
bool is_behind(
    const std::vector<CellPlace>& places, std::uint32_t a, std::uint32_t b, const glm::dvec3& eye
) {
    while (places[a].parent != places[b].parent) {
        if (a == 0 || b == 0) {
            return false;
        }
        (places[a].depth > places[b].depth ? a : b) =
            places[places[a].depth > places[b].depth ? a : b].parent;
        if (a != b && places[a].depth == places[b].depth && places[a].parent != places[b].parent) {
            a = places[a].parent;
            b = places[b].parent;
        }
    }
    if (a == b) {
        return false;
    }
    const CellPlace& parent = places[places[a].parent];
    const unsigned apart = places[a].octant ^ places[b].octant;
    for (unsigned axis = 0; axis < 3; ++axis) {
        const auto component = static_cast<int>(axis);
        const double beyond = eye[component] - (parent.lo[component] + parent.edge * 0.5);
        const bool upper = (places[b].octant >> axis & 1U) != 0;
        // So near the plane, an eye in float may be on the other side.
        const bool surely = std::abs(beyond) > 1e-3 && (beyond > 0.0) == upper;
        if ((apart >> axis & 1U) != 0 && !surely) {
            return false;
        }
    }
    return true;
}

std::uint64_t without_place(FramePlan plan) {
    plan.origin = glm::dvec3(0.0);
    for (Pass& pass : plan.passes) {
        pass.view.eye = glm::dvec3(0.0);
    }
    return digest(plan);
}

std::string refusal(const ColorCubesOptions& options) {
    const Hierarchy hierarchy = make_item_hierarchy(1);
    const ColorCubeModel model = make_single_cells({{}}, {}, 1.0F, {});
    const auto technique = ColorCubes::create(hierarchy, model, options);
    return technique ? "accepted" : technique.error().message;
}

static_assert(noexcept(std::declval<ColorCubes&>().plan(std::declval<const View&>())));

} // namespace

TEST_CASE("options out of range are refused by name and value") {
    CHECK(refusal({}) == "accepted");
    for (const auto& [value, text] :
         {std::pair{0.0, "0"},
          std::pair{-1.5, "-1.5"},
          std::pair{std::numeric_limits<double>::quiet_NaN(), "nan"},
          std::pair{std::numeric_limits<double>::infinity(), "inf"}}) {
        CHECK_THAT(refusal({.cell_px = value}), Catch::Contains(std::string("cell_px is ") + text));
    }
    CHECK_THAT(refusal({.drawing = CubeDrawing{7}}), Catch::Contains("drawing 7"));
    CHECK_THAT(refusal({.sheets = CubeSheets{9}}), Catch::Contains("sheets 9"));
    ColorCubesOptions options;
    options.costs.splat_s = -1.0;
    CHECK_THAT(refusal(options), Catch::Contains("splat_s is -1"));
    options.costs = {.triangle_s = 0.0};
    CHECK_THAT(refusal(options), Catch::Contains("triangle_s is 0"));
}

TEST_CASE("a view that sees nothing makes an empty frame") {
    const CubeWorld world = make_cube_world();
    for (const bool never_slower : {true, false}) {
        ColorCubes technique = make_technique(world, {.never_slower = never_slower});
        const View away =
            look_at({0.0, 2000.0, 0.0}, {0.0, 4000.0, 0.0}, {0.0, 0.0, 1.0}, test_lens(), 160, 120);
        const FramePlan& plan = technique.plan(away);
        REQUIRE(plan.passes.size() == 1);
        CHECK(plan.passes[0].view == away);
        CHECK(plan.passes[0].command_count == 0);
        CHECK(plan.commands.empty());
        CHECK(plan.items.empty());
        CHECK(plan.splats.empty());
        CHECK(technique.statistics().cubes == 0);
        CHECK(technique.statistics().cells == 1);
    }
}

TEST_CASE("one triangle is shown or drawn") {
    CubeReference near_by;
    near_by.translation = {0.0F, 0.0F, -4.0F};
    const Hierarchy hierarchy = make_item_hierarchy(1);
    ColorCube colors;
    colors.faces.fill({10, 20, 30, 40});
    // A pixel is 1/80 of the distance: 0.05 m at 4 m.
    const View view = look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, test_lens(), 160, 120);
    for (const float edge : {1.0F, 0.01F}) {
        const ColorCubeModel model = make_single_cells({near_by}, {}, edge, colors);
        ColorCubes technique = make_technique(hierarchy, model, {.never_slower = false});
        const FramePlan& plan = technique.plan(view);
        CAPTURE(edge);
        REQUIRE(plan.commands.size() == 1);
        CHECK(technique.statistics().references == 1);
        if (edge == 1.0F) {
            CHECK(plan.commands[0].kind == Command::Kind::geometry);
            CHECK(plan.commands[0].selection_count == 1);
            REQUIRE(plan.selections.size() == 1);
            CHECK(plan.selections[0].item == ItemId{0});
            CHECK(plan.selected == std::vector<std::uint32_t>{0});
            CHECK(technique.statistics().triangles == 1);
            CHECK(technique.statistics().cubes == 0);
        } else {
            CHECK(plan.commands[0].kind == Command::Kind::splats);
            CHECK(plan.commands[0].count == 1);
            CHECK(plan.splats.size() == 1);
            CHECK(technique.statistics().triangles == 0);
            CHECK(technique.statistics().cubes == 1);
        }
    }
    // A scene that is one triangle in one cell, without references.
    ColorCubeModel model;
    model.item_count = 1;
    ColorCubeTree& scene = model.trees.emplace_back();
    scene.lo = {-0.5F, -0.5F, -0.5F};
    scene.edge = 1.0F;
    scene.cells = {{}};
    scene.cubes = {colors};
    scene.contents = {0 | ColorCubeTree::kLast};
    scene.primitives = {{ItemId{0}, 0, 1}};
    scene.quality = {0, 1};
    REQUIRE(validate(model).has_value());
    ColorCubes technique = make_technique(hierarchy, model, {.never_slower = false});
    CHECK(technique.plan(view).selected == std::vector<std::uint32_t>{0});
    CHECK(technique.plan(view).splats.empty());
    CHECK(technique.plan(view_from(200.0)).splats.size() == 1);
    CHECK(technique.plan(view_from(200.0)).selected.empty());
}

TEST_CASE("what a plan reads is counted once however often, and changes nothing") {
    ColorCube colors;
    colors.faces.fill({10, 20, 30, 40});
    const View view = look_at({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, test_lens(), 160, 120);
    std::vector<CubeReference> placed;
    for (std::size_t count = 1; count < 4; ++count) {
        CubeReference reference;
        reference.translation = {0.0F, 0.0F, -4.0F * static_cast<float>(count)};
        placed.push_back(reference);
        const ColorCubeModel model = make_single_cells(placed, {}, 0.01F, colors);
        const Hierarchy hierarchy = make_item_hierarchy(count);
        ColorCubesOptions options;
        options.never_slower = false;
        ColorCubes plain = make_technique(hierarchy, model, options);
        options.count_bytes = true;
        ColorCubes counting = make_technique(hierarchy, model, options);
        for (int frame = 0; frame < 2; ++frame) {
            CHECK(digest(counting.plan(view)) == digest(plain.plan(view)));
            CHECK(plain.statistics().bytes == 0);
            // Two cells, the entries of the scene's with what they name, and one colour cube.
            CHECK(
                counting.statistics().bytes ==
                2 * sizeof(CubeCell) + count * (4 + sizeof(CubeReference)) + sizeof(ColorCube)
            );
        }
    }
    const CubeWorld world = make_cube_world();
    ColorCubesOptions options = always_faces(1.0);
    options.count_bytes = true;
    ColorCubes technique = make_technique(world, options);
    for (const View& from : dolly(60)) {
        static_cast<void>(technique.plan(from));
        CHECK(technique.statistics().bytes > 0);
        CHECK(technique.statistics().bytes <= memory_bytes(world.model));
    }
}

TEST_CASE("cubes are as small as they should be") {
    Random random(3);
    std::size_t shown = 0;
    for (const Turns turns : {Turns::none, Turns::quarter, Turns::any}) {
        const CubeWorld world = make_cube_world({.turns = turns, .seed = 2});
        for (int i = 0; i < 60; ++i) {
            const View view = random_view(random, i % 3 == 0 ? 40.0 : 250.0);
            std::uint64_t cells = UINT64_MAX;
            for (const double cell_px : {0.5, 1.0, 1.7, 4.0}) {
                CAPTURE(i, cell_px);
                ColorCubes technique = make_technique(world, always_faces(cell_px));
                const FramePlan& plan = technique.plan(view);
                REQUIRE(technique.statistics().cubes == plan.cubes.size());
                REQUIRE_FALSE(technique.statistics().geometry);
                // Monotone: a larger limit never looks at more.
                REQUIRE(technique.statistics().cells <= cells);
                cells = technique.statistics().cells;
                shown += plan.cubes.size();
                for (const ShownCube& cube : plan.cubes) {
                    // Centre and eye are floats of less than 512 m, relative to each other off by
                    // a few ulps of 2^-16 m, which makes sizes as much larger as things are nearer.
                    const glm::dvec3 apart = plan.origin + glm::dvec3(cube.center) - view.eye;
                    const double depth = -glm::dot(view.camera_to_world[2], apart);
                    const double rounding = 1.0 + 4.0 * 1e-4 / depth + 1e-6;
                    REQUIRE(diameter_px(view, corners_of(plan, cube)) <= cell_px * rounding);
                }
            }
        }
    }
    CHECK(shown > 50'000);
}

TEST_CASE("what is in the frustum is covered by one cube or drawn") {
    Random random(4);
    std::size_t with_selections = 0;
    std::size_t with_items = 0;
    for (const Turns turns : {Turns::quarter, Turns::any}) {
        for (const bool never_slower : {false, true}) {
            const CubeWorld world = make_cube_world({.turns = turns, .seed = 5});
            CubePlanReader reader(world);
            CoverCheck check{world, reader};
            ColorCubesOptions options = always_faces(2.0);
            options.never_slower = never_slower;
            options.costs.cube_s = options.costs.triangle_s / 2.0;
            options.costs.cell_s = options.costs.cube_s / 8.0;
            ColorCubes technique = make_technique(world, options);
            for (int i = 0; i < 90; ++i) {
                CAPTURE(i, never_slower);
                const View view = random_view(random, i % 3 == 0 ? 40.0 : 150.0);
                const FramePlan& plan = technique.plan(view);
                if (technique.statistics().geometry) {
                    continue;
                }
                REQUIRE_NOTHROW(reader.read(plan));
                check.points(view, 400);
                with_selections += reader.selected().size() > 3 ? 1U : 0U;
                with_items += plan.items.size() > 3 ? 1U : 0U;
            }
            CAPTURE(check.seen, check.shown, check.absent);
            // Where cubes have to pay, most views are geometry.
            CHECK(check.seen > (never_slower ? 200U : 1000U));
            CHECK(check.shown > (never_slower ? 10U : 200U));
            CHECK(check.shown < check.seen);
            // Corners are on a grid and cells on another, and the points are in between.
            CHECK(check.absent == 0);
        }
    }
    CHECK(with_selections > 20);
    CHECK(with_items > 10);
}

TEST_CASE("splats are shown of the same cells in the same order as faces") {
    // Without gains no cell is transparent here, so none is dropped.
    const CubeWorld world = make_cube_world({.gains = false, .seed = 6});
    Random random(5);
    ColorCubes faces = make_technique(world, always_faces(1.5));
    ColorCubes splats = make_technique(world, {.cell_px = 1.5, .never_slower = false});
    std::size_t shown = 0;
    for (int i = 0; i < 50; ++i) {
        const View view = random_view(random, 200.0);
        const FramePlan& a = faces.plan(view);
        const FramePlan& b = splats.plan(view);
        REQUIRE(a.cubes.size() == b.splats.size());
        REQUIRE(a.splats.empty());
        REQUIRE(b.cubes.empty());
        REQUIRE(a.selected == b.selected);
        REQUIRE(a.items == b.items);
        for (std::size_t k = 0; k < a.cubes.size(); ++k) {
            REQUIRE(a.cubes[k].center == b.splats[k].center);
        }
        shown += a.cubes.size();
    }
    CHECK(shown > 5000);
}

TEST_CASE("cells of one octree are shown octant by octant from the back") {
    Random random(8);
    std::size_t pairs = 0;
    for (const std::uint64_t seed : {21U, 22U, 23U}) {
        const CubeWorld world = make_cube_world(
            {.references = 1,
             .radius = 25.0,
             .shape_triangles = 150,
             .ground_cells = 6,
             .seed = seed}
        );
        CubePlanReader reader(world);
        ColorCubes technique = make_technique(world, always_faces(4.0));
        for (int i = 0; i < 30; ++i) {
            CAPTURE(seed, i);
            const View view = random_view(random, i % 2 == 0 ? 30.0 : 120.0);
            REQUIRE_NOTHROW(reader.read(technique.plan(view)));
            const auto& shown = reader.shown();
            // Cells of two octrees are sorted by depth.
            const bool mixed = std::any_of(shown.begin(), shown.end(), [&](const auto& cell) {
                return cell.reference != shown.front().reference;
            });
            for (std::size_t a = 0; a < shown.size() && !mixed; ++a) {
                const glm::dvec3 eye = reader.to_tree(shown[a].reference, view.eye);
                const auto& places = reader.places_of(shown[a].reference);
                for (std::size_t b = a + 1; b < shown.size(); ++b) {
                    if (shown[b].reference == shown[a].reference) {
                        REQUIRE_FALSE(is_behind(places, shown[b].cell, shown[a].cell, eye));
                        ++pairs;
                    }
                }
            }
        }
    }
    CHECK(pairs > 50'000);
}

TEST_CASE("cells of references that overlap are shown in the order of their depths") {
    Random random(8);
    std::size_t pairs = 0;
    std::size_t mixed = 0;
    for (const std::uint64_t seed : {21U, 22U, 23U}) {
        const CubeWorld world = make_cube_world(
            {.references = 24,
             .radius = 25.0,
             .shape_triangles = 150,
             .ground_cells = 6,
             .seed = seed}
        );
        CubePlanReader reader(world);
        ColorCubes technique = make_technique(world, always_faces(4.0));
        for (int i = 0; i < 30; ++i) {
            CAPTURE(seed, i);
            const View view = random_view(random, i % 2 == 0 ? 30.0 : 120.0);
            const FramePlan& plan = technique.plan(view);
            if (plan.cubes.size() < 2) {
                continue;
            }
            REQUIRE_NOTHROW(reader.read(plan));
            std::vector<double> depths;
            for (const ShownCube& cube : plan.cubes) {
                const glm::dvec3 offset = glm::dvec3(cube.center) + plan.origin - view.eye;
                depths.push_back(-glm::dot(offset, view.camera_to_world[2]));
            }
            const auto [nearest, farthest] = std::minmax_element(depths.begin(), depths.end());
            // Depths are told apart in eight times as many steps as there are cells, or more; those
            // of floats are off by some 1e-6 of them.
            const double steps = std::min(65535.0, 8.0 * static_cast<double>(depths.size()) - 1.0);
            const double step = (*farthest - *nearest) / steps + 1e-5 * *farthest;
            for (std::size_t k = 1; k < depths.size(); ++k) {
                REQUIRE(depths[k] <= depths[k - 1] + step);
                mixed += reader.shown()[k].reference != reader.shown()[k - 1].reference ? 1U : 0U;
                ++pairs;
            }
        }
    }
    CHECK(pairs > 5000);
    CHECK(mixed > 1000);
}

TEST_CASE("each frame is drawn anew, whatever was drawn before") {
    const CubeWorld world = make_cube_world({.seed = 9});
    Random random(10);
    ColorCubes used = make_technique(world, always_faces(1.0));
    CubePlanReader reader(world);
    std::size_t near_references = 0;
    for (int i = 0; i < 40; ++i) {
        // Near the ground, among the references.
        const View view = random_view(random, 20.0);
        ColorCubes fresh = make_technique(world, always_faces(1.0));
        const FramePlan& plan = used.plan(view);
        REQUIRE(digest(plan) == digest(fresh.plan(view)));
        REQUIRE_NOTHROW(reader.read(plan));
        std::size_t of_one_shape = 0;
        for (const auto& [item, triangles] : reader.selected()) {
            of_one_shape += index_of(item) < 40 && index_of(item) % 2 == 0 ? 1U : 0U;
        }
        near_references += of_one_shape > 1 ? 1U : 0U;
    }
    CHECK(near_references > 20);
}

TEST_CASE("where nothing pays the plan is that of plain geometry") {
    const CubeWorld world = make_cube_world({.seed = 11});
    CulledGeometry geometry(world.hierarchy);
    Random random(12);
    std::vector<View> views = {view_from(1.0), view_from(100.0), view_from(1000.0)};
    for (int i = 0; i < 30; ++i) {
        views.push_back(random_view(random, 200.0));
    }
    for (const CubeDrawing drawing : {CubeDrawing::splats, CubeDrawing::faces}) {
        ColorCubesOptions options;
        options.drawing = drawing;
        options.costs.triangle_s = 1e-15;
        ColorCubes technique = make_technique(world, options);
        options.never_slower = false;
        ColorCubes always = make_technique(world, options);
        std::size_t cubes = 0;
        for (const View& view : views) {
            REQUIRE(digest(technique.plan(view)) == digest(geometry.plan(view)));
            REQUIRE(technique.statistics().geometry);
            static_cast<void>(always.plan(view));
            REQUIRE_FALSE(always.statistics().geometry);
            cubes += always.statistics().cubes;
        }
        CHECK(cubes > 1000);
    }
}

TEST_CASE("costs of nothing and of very much") {
    const CubeWorld world = make_cube_world({.seed = 11});
    const View far_off = view_from(300.0);
    ColorCubesOptions options;
    // Cubes are free, triangles very dear.
    options.costs = {.triangle_s = 1e300, .splat_s = 0.0, .cube_s = 0.0, .cell_s = 0.0};
    ColorCubes free_cubes = make_technique(world, options);
    CHECK(free_cubes.plan(far_off).splats.size() > 100);
    CHECK_FALSE(free_cubes.statistics().geometry);
    // Everything is infinitely dear as a sum: cubes do not seem cheaper.
    options.costs = {.triangle_s = 1e308, .splat_s = 1e308, .cube_s = 1e308, .cell_s = 1e308};
    ColorCubes dear = make_technique(world, options);
    CulledGeometry geometry(world.hierarchy);
    CHECK(digest(dear.plan(far_off)) == digest(geometry.plan(far_off)));
}

TEST_CASE("parts fall back to geometry while others are cubes") {
    const CubeWorld world = make_cube_world({.references = 60, .radius = 100.0, .seed = 13});
    ColorCubesOptions options;
    options.cell_px = 2.0;
    ColorCubes technique = make_technique(world, options);
    CubePlanReader reader(world);
    std::size_t mixed = 0;
    for (int i = 0; i < 60; ++i) {
        const FramePlan& plan = technique.plan(view_from(250.0 - 3.0 * i));
        const bool references = std::any_of(plan.items.begin(), plan.items.end(), [](ItemId item) {
            return index_of(item) < 60;
        });
        if (technique.statistics().geometry) {
            continue;
        }
        mixed += references && !plan.splats.empty() ? 1U : 0U;
        REQUIRE(technique.statistics().items == plan.items.size());
        REQUIRE(technique.statistics().triangles == plan.selected.size());
    }
    CHECK(mixed > 10);
}

TEST_CASE("what pays from near pays from afar, and cheaper cubes pay sooner") {
    const CubeWorld world = make_cube_world({.seed = 14});
    // Straight away from the middle, so that all cells get smaller on the screen, up to 3.5 km, of
    // the 4 km that the lens shows.
    const auto first_that_pays = [&](const CostModel& costs) {
        ColorCubes technique = make_technique(world, {.costs = costs});
        int first = 180;
        for (int step = 0; step < 180; ++step) {
            static_cast<void>(technique.plan(view_from(100.0 * std::pow(1.02, step))));
            if (!technique.statistics().geometry) {
                first = std::min(first, step);
            }
            REQUIRE(technique.statistics().geometry == (step < first));
        }
        return first;
    };
    CostModel costs;
    int before = 0;
    for (const double splat_s : {1e-9, 1e-8, 1e-7, 1e-6, 1e-5}) {
        CAPTURE(splat_s);
        costs.splat_s = splat_s;
        const int first = first_that_pays(costs);
        CHECK(first >= before);
        before = first;
    }
    CHECK(before > 10);
    for (const double triangle_s : {1.2e-7, 1e-6, 1e-5}) {
        CAPTURE(triangle_s);
        costs.triangle_s = triangle_s;
        const int first = first_that_pays(costs);
        CHECK(first <= before);
        before = first;
    }
    CHECK(before < 50);
}

TEST_CASE("what moves is drawn once, as geometry where it is") {
    CubeWorld world = make_cube_world({.seed = 15});
    CubePlanReader reader(world);
    NullBackend backend(world.item_primitives, &world.hierarchy);
    const TargetId target = backend.create_target(160, 120, 1).value();
    const std::vector<std::size_t> movers = {0, 1, 5, 42}; // references and a whole item
    for (const std::size_t item : movers) {
        const glm::dvec3 by(0.0, 0.5, 0.0);
        const Box3d& built = world.objects[item].bounds;
        REQUIRE(partition::update_bounds(
                    world.hierarchy, make_id<ItemId>(item), {built.lo + by, built.hi + by}
        )
                    .has_value());
    }
    std::size_t drawn = 0;
    for (const bool never_slower : {false, true}) {
        for (const double cell_px : {0.25, 1.0}) {
            ColorCubesOptions options = always_faces(cell_px);
            options.never_slower = never_slower;
            options.costs.cube_s = options.costs.triangle_s / 2.0;
            ColorCubes technique = make_technique(world, options);
            for (int i = 0; i < 80; ++i) {
                CAPTURE(i, never_slower, cell_px);
                const View view = view_from(100.0 - i);
                const FramePlan& plan = technique.plan(view);
                REQUIRE(backend.execute(plan, target, {}).has_value());
                if (technique.statistics().geometry) {
                    continue;
                }
                REQUIRE_NOTHROW(reader.read(plan)); // none is drawn twice
                const Frustum frustum = make_frustum(view, world.hierarchy.origin);
                for (const std::size_t item : movers) {
                    const auto id = make_id<ItemId>(item);
                    CAPTURE(item);
                    const Box3f box = partition::item_box(world.hierarchy, id);
                    REQUIRE(reader.draws(id) == (classify(frustum, box) != Overlap::outside));
                    REQUIRE(reader.selected().count(id) == 0);
                    drawn += reader.draws(id) ? 1U : 0U;
                }
                for (const CubePlanReader::Shown& shown : reader.shown()) {
                    const bool of_mover = shown.reference != kScene &&
                                          std::count(
                                              movers.begin(),
                                              movers.end(),
                                              index_of(world.model.references[shown.reference].item)
                                          ) > 0;
                    REQUIRE_FALSE(of_mover);
                }
            }
        }
    }
    CHECK(drawn > 200);
    // Gone for now.
    for (const std::size_t item : movers) {
        REQUIRE(partition::hide(world.hierarchy, make_id<ItemId>(item)).has_value());
    }
    ColorCubes technique = make_technique(world, always_faces(0.25));
    for (int i = 0; i < 80; ++i) {
        REQUIRE_NOTHROW(reader.read(technique.plan(view_from(100.0 - i))));
        for (const std::size_t item : movers) {
            REQUIRE_FALSE(reader.draws(make_id<ItemId>(item)));
            REQUIRE(reader.selected().count(make_id<ItemId>(item)) == 0);
        }
    }
}

TEST_CASE("an eye in the scene, in a cell, and on the planes between cells") {
    const CubeWorld world = make_cube_world({.turns = Turns::quarter, .seed = 16});
    CubePlanReader reader(world);
    CoverCheck check{world, reader};
    ColorCubes technique = make_technique(world, always_faces(2.0));
    const ColorCubeTree& scene = world.model.trees.back();
    const auto places = places_of(scene);
    std::vector<glm::dvec3> eyes = {
        glm::dvec3(scene.lo), glm::dvec3(scene.lo) + double{scene.edge} * 0.5};
    for (std::size_t cell = 1; cell < places.size(); cell += 1 + places.size() / 20) {
        eyes.push_back(places[cell].lo);
        eyes.push_back(places[cell].lo + places[cell].edge * 0.5);
        eyes.push_back(places[cell].lo + glm::dvec3(0.5, 0.0, 0.25) * places[cell].edge);
    }
    for (const glm::dvec3& local : eyes) {
        const glm::dvec3 eye = world.model.origin + local;
        for (const glm::dvec3& along :
             {glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0.5, -0.5, 0.25)}) {
            const View view = look_at(eye, eye + along, {0, 1, 0}, test_lens(), 160, 120);
            REQUIRE_NOTHROW(reader.read(technique.plan(view)));
            check.points(view, 50);
            for (const CubePlanReader::Shown& shown : reader.shown()) {
                if (shown.reference == kScene) { // a cell around the eye is never small
                    const CellPlace& place = places[shown.cell];
                    const Box3d box{place.lo, place.lo + place.edge};
                    REQUIRE_FALSE(contains(box, local));
                }
            }
        }
    }
    CHECK(check.seen > 1000);
}

TEST_CASE("the deepest trees are walked to their ends") {
    // A chain of 20 levels in which every cell has all eight children, the scene's and a shape's in
    // its last leaf: as many cells wait as ever can.
    constexpr unsigned kLevels = 20;
    const auto chain = [](ColorCubeTree& tree, unsigned way) {
        for (unsigned level = 0; level < kLevels; ++level) {
            const auto index =
                static_cast<std::uint32_t>(level == 0 ? 0 : tree.cells.size() - 8 + way);
            tree.cells.resize(std::max<std::size_t>(tree.cells.size(), 1));
            tree.cells[index].first = static_cast<std::uint32_t>(tree.cells.size());
            tree.cells[index].octants = 0xFF;
            tree.cells.resize(tree.cells.size() + 8);
        }
        for (CubeCell& cell : tree.cells) {
            if (cell.octants == 0) {
                cell.first = static_cast<std::uint32_t>(tree.contents.size());
                tree.contents.push_back(
                    static_cast<std::uint32_t>(tree.contents.size()) | ColorCubeTree::kLast
                );
            }
        }
        ColorCube colors;
        colors.faces.fill({1, 2, 3, 255});
        tree.cubes.assign(tree.cells.size(), colors);
        tree.quality = {kLevels, static_cast<std::uint32_t>(tree.contents.size())};
    };
    for (const unsigned way : {0U, 3U, 7U}) {
        ColorCubeModel model;
        model.item_count = 2;
        ColorCubeTree& shape = model.trees.emplace_back();
        shape.lo = glm::vec3(-0.5F);
        shape.edge = 1.0F;
        chain(shape, way);
        const auto leaves = static_cast<std::uint32_t>(shape.contents.size());
        shape.primitives = {{kNone<ItemId>, 0, leaves}};
        ColorCubeTree& scene = model.trees.emplace_back();
        scene.lo = glm::vec3(-512.0F);
        scene.edge = 1024.0F;
        chain(scene, way);
        // The reference is in the leaf that is deepest, and is the number 0.
        const CubeCell& deepest = scene.cells[scene.cells.size() - 8 + way];
        std::swap(scene.contents[0], scene.contents[deepest.first]);
        scene.reference_count = 1;
        scene.primitives = {{ItemId{1}, 1, leaves - 1}};
        CubeReference reference;
        reference.item = ItemId{0};
        model.references = {reference};
        const auto valid = validate(model);
        INFO((valid ? "" : valid.error().message));
        REQUIRE(valid.has_value());
        const Hierarchy hierarchy = make_item_hierarchy(2);
        ColorCubes technique =
            make_technique(hierarchy, model, {.cell_px = 1e-9, .never_slower = false});
        // All of the scene is in the frame.
        const View view =
            look_at({0.125, 0.25, 3000.0}, {0, 0, 0}, {0, 1, 0}, test_lens(), 160, 120);
        const FramePlan& plan = technique.plan(view);
        CAPTURE(way);
        CHECK(plan.splats.empty());
        REQUIRE(plan.selections.size() == 2);
        CHECK(plan.selections[0].item == ItemId{0});
        CHECK(plan.selections[0].count == leaves);
        CHECK(plan.selections[1].item == ItemId{1});
        CHECK(technique.statistics().references == 1);
        NullBackend backend(std::vector<std::uint64_t>{leaves, leaves - 1});
        const TargetId target = backend.create_target(160, 120, 1).value();
        CHECK(backend.execute(plan, target, {}).has_value());
        // Drawn whole, the same way down.
        ColorCubesOptions options;
        options.cell_px = 1e-9;
        ColorCubes whole = make_technique(hierarchy, model, options);
        static_cast<void>(whole.plan(view));
        CHECK(whole.statistics().geometry);
    }
}

TEST_CASE("a scene far from the origin is shown as one at it") {
    const CubeWorld here = make_cube_world({.seed = 17});
    CubeWorld there = make_cube_world({.seed = 17});
    const glm::dvec3 away(8388608.0, -4194304.0, 16777216.0);
    there.model.origin += away;
    there.hierarchy.origin += away;
    for (const CubeDrawing drawing : {CubeDrawing::splats, CubeDrawing::faces}) {
        ColorCubesOptions options;
        options.cell_px = 2.0;
        options.drawing = drawing;
        options.costs.cube_s = options.costs.triangle_s;
        ColorCubes a = make_technique(here, options);
        ColorCubes b = make_technique(there, options);
        std::size_t cubes = 0;
        const std::vector<View> views = dolly(240);
        const std::vector<View> moved = dolly(240, away);
        for (std::size_t frame = 0; frame < views.size(); ++frame) {
            const FramePlan& plan = b.plan(moved[frame]);
            REQUIRE(without_place(a.plan(views[frame])) == without_place(plan));
            REQUIRE(glm::distance(plan.origin, away) < 1000.0);
            cubes += b.statistics().cubes;
        }
        CHECK(cubes > 1000);
    }
}

TEST_CASE("planning is repeatable, valid, and allocates nothing once warm") {
    const CubeWorld world = make_cube_world({.seed = 18});
    const std::vector<View> views = dolly(240);
    for (const CubeDrawing drawing : {CubeDrawing::splats, CubeDrawing::faces}) {
        for (const bool never_slower : {true, false}) {
            ColorCubes technique = make_technique(
                world, {.cell_px = 2.0, .drawing = drawing, .never_slower = never_slower}
            );
            NullBackend backend(world.item_primitives, &world.hierarchy);
            const TargetId target = backend.create_target(160, 120, 1).value();
            std::uint64_t cubes = 0;
            std::vector<std::uint64_t> digests;
            digests.reserve(views.size());
            for (const View& view : views) {
                const FramePlan& plan = technique.plan(view);
                cubes += technique.statistics().cubes;
                const auto executed = backend.execute(plan, target, {});
                INFO((executed ? "" : executed.error().message));
                REQUIRE(executed.has_value());
                digests.push_back(digest(plan));
            }
            const std::uint64_t before = allocation_count();
            std::size_t different = 0;
            for (std::size_t frame = views.size(); frame-- > 0;) {
                different += digest(technique.plan(views[frame])) != digests[frame] ? 1U : 0U;
            }
            const std::uint64_t after = allocation_count();
            CHECK(different == 0);
            CHECK(after == before);
            CHECK(cubes > 1000);
        }
    }
}

TEST_CASE("a dolly makes the plans that it always made") {
    // Where decisions or colours are changed on purpose, the value printed by the failure is the
    // new one. Without gains, whose exponentials hang on the mathematics library.
    const CubeWorld world = make_cube_world({.gains = false, .seed = 19});
    std::uint64_t all = 0;
    std::uint64_t cubes = 0;
    std::uint64_t triangles = 0;
    for (const CubeDrawing drawing : {CubeDrawing::splats, CubeDrawing::faces}) {
        ColorCubes technique = make_technique(world, {.cell_px = 2.0, .drawing = drawing});
        for (const View& view : dolly(240)) {
            all = all * 1099511628211ULL + digest(technique.plan(view));
            cubes += technique.statistics().cubes;
            triangles += technique.statistics().triangles;
        }
    }
    CHECK(cubes == 191501);
    CHECK(triangles == 110460);
    CHECK(all == 0x226f12394c6befa2U);
}
