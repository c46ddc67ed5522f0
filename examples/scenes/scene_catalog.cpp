#include "scene_catalog.hpp"

#include "dolly.hpp"
#include "flat_town.hpp"
#include "flat_town_path.hpp"
#include "forest.hpp"
#include "forest_path.hpp"
#include "grass.hpp"
#include "grass_path.hpp"
#include "island.hpp"
#include "island_path.hpp"
#include "knot.hpp"
#include "molecule.hpp"
#include "overview.hpp"
#include "pipes.hpp"
#include "pipes_path.hpp"
#include "plant.hpp"
#include "plant_path.hpp"
#include "terrain.hpp"
#include "trees.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

constexpr IslandOptions kIsland;
constexpr FlatTownOptions kFlatTown;
constexpr ForestOptions kForest;

constexpr std::array<SceneParameter, 13> kIslandParameters = {{
    {"trees", kIsland.trees, true, "number of trees, 0 to 1000000"},
    {"radius", kIsland.radius_m, false, "radius of the shore [m]"},
    {"height", kIsland.height_m, false, "height of the ground at the centre [m]"},
    {"terrain-quads", kIsland.terrain_quads, true, "quads a side of the terrain, 2 to 4096"},
    {"tree-triangles", kIsland.tree_triangles, true, "triangles of the tree, 2000 to 10000000"},
    {"tree-height", kIsland.tree_height_m, false, "height of a tree of scale 1 [m]"},
    {"tree-width", kIsland.tree_width_m, false, "width of a tree of scale 1 [m]"},
    {"min-spacing", kIsland.min_spacing_m, false, "least distance of two trunks [m]"},
    {"min-scale", kIsland.min_scale, false, "smallest scale of a tree"},
    {"max-scale", kIsland.max_scale, false, "largest scale of a tree"},
    {"quarter-turns", 0.0, true, "1: turns of trees are multiples of 90 degrees, 0: any"},
    {"seed", static_cast<double>(kIsland.seed), true, "of hills, places, turns and sizes"},
    {"tree-seed", static_cast<double>(kIsland.tree_seed), true, "of the tree"},
}};

constexpr std::array<SceneParameter, 4> kFlatTownParameters = {{
    {"blocks", kFlatTown.blocks, true, "blocks a side, 1 to 128"},
    {"block", kFlatTown.block_m, false, "side of a block [m]"},
    {"pace", kFlatTownPace, false, "of the diagonal walk [m a frame]"},
    {"seed", static_cast<double>(kFlatTown.seed), true, "of houses, trees and colours"},
}};

constexpr std::array<SceneParameter, 6> forest_parameters(double pace_m) {
    return {{
        {"trees", kForest.trees, true, "number of trees, 1 to 10000"},
        {"tree-triangles", kForest.tree_triangles, true, "triangles of each tree, 200 to 1000000"},
        {"spacing", kForest.spacing_m, false, "from trunk to trunk [m]"},
        {"tree-height", kForest.tree_height_m, false, "height of the mean tree [m]"},
        {"pace", pace_m, false, "along the forest or into it [m a frame]"},
        {"seed", static_cast<double>(kForest.seed), true, "of places and trees"},
    }};
}

constexpr BroadleafOptions kTree;
constexpr TreesOptions kTrees;
constexpr MoleculeOptions kMolecule;
constexpr GrassOptions kGrass;
constexpr KnotOptions kKnot;
constexpr double kKnotAngleDeg = 45.0;
constexpr double kTreeAngleDeg = 30.0;

// [px] Sides of pictures.
// Source: Chamberlain et al. 1996, section 4.
constexpr int kDollySide = 124;
constexpr int kOverviewSide = 512;

constexpr std::array<SceneParameter, 3> kTreeParameters = {{
    {"triangles", kTree.triangles, true, "of the tree, 5000 to 10000000"},
    {"seed", static_cast<double>(kTree.seed), true, "of the tree"},
    {"angle", kTreeAngleDeg, false, "of the view around the vertical [degrees]"},
}};

constexpr std::array<SceneParameter, 3> kMoleculeParameters = {{
    {"atoms", kMolecule.atoms, true, "number of atoms, 1 to 1000000"},
    {"seed", static_cast<double>(kMolecule.seed), true, "of the fold and the side chains"},
    {"angle", kMoleculeAngleDeg, false, "of the view around the vertical [degrees]"},
}};

constexpr std::array<SceneParameter, 3> kKnotParameters = {{
    {"along", kKnot.along, true, "rings of the tube, 24 to 10000"},
    {"around", kKnot.around, true, "corners of a ring, 3 to 2000"},
    {"angle", kKnotAngleDeg, false, "of the view around the vertical [degrees]"},
}};

constexpr std::array<SceneParameter, 5> kGrassParameters = {{
    {"triangles", kGrass.triangles, true, "of all blades, a multiple of 1250"},
    {"field", kGrass.field_m, false, "side of the field [m]"},
    {"ground", 1.0, true, "1: soil below the blades, 0: none"},
    {"distance", 0.0, false, "0: low flight; 1 to 1000: away from 1 to so many radii"},
    {"seed", static_cast<double>(kGrass.seed), true, "of blades and turns"},
}};

constexpr std::array<SceneParameter, 5> kTreesParameters = {{
    {"count", kTrees.count, true, "number of trees, a power of four, 1 to 4194304"},
    {"triangles", kTree.triangles, true, "of the tree, 5000 to 10000000"},
    {"seed", static_cast<double>(kTrees.seed), true, "of the quarter turns"},
    {"tree-seed", static_cast<double>(kTree.seed), true, "of the tree"},
    {"ground", 0.0, true, "1: a flat quad below it, 0: none"},
}};

constexpr TerrainOptions kTerrain;
constexpr int kTerrainSide = 512; // [px] of the picture

constexpr std::array<SceneParameter, 4> kTerrainParameters = {{
    {"posts", kTerrain.posts, true, "heights a side, 9 to 4097"},
    {"side", kTerrain.side_m, false, "of the square [m]"},
    {"relief", kTerrain.relief_m, false, "from the lowest place to the highest [m]"},
    {"seed", static_cast<double>(kTerrain.seed), true, "of ridges and colours"},
}};

constexpr PipesOptions kPipes;

constexpr std::array<SceneParameter, 2> kPipesParameters = {{
    {"triangles", kPipes.triangles, true, "in all, about; 20000 to 50000000"},
    {"seed", static_cast<double>(kPipes.seed), true, "of the ways of the pipes"},
}};

constexpr PlantOptions kPlant;

constexpr std::array<SceneParameter, 2> kPlantParameters = {{
    {"panels", kPlant.panels, true, "tube panels in each of 5 bundles, 1 to 120"},
    {"seed", static_cast<double>(kPlant.seed), true, "of pipes, colours and the coal"},
}};

constexpr auto kForestParameters = forest_parameters(kForestPace);
constexpr auto kForestZoomParameters = forest_parameters(kForestZoomPace);

double value_of(const SceneValues& values, std::string_view name) {
    return values.find(name)->second;
}

/// Values out of range of the type meet the scene's own check as the nearest end of the type.
template <typename T>
T whole(const SceneValues& values, std::string_view name) {
    const double value = value_of(values, name);
    if (value <= static_cast<double>(std::numeric_limits<T>::lowest())) {
        return std::numeric_limits<T>::lowest();
    }
    // 2^64 is the first double that a 64-bit number cannot take, 2^31 - 1 is a double itself.
    if (value >= static_cast<double>(std::numeric_limits<T>::max())) {
        return std::numeric_limits<T>::max();
    }
    return static_cast<T>(value);
}

/// 0 or 1 as a truth value.
Result<bool> flag_of(const SceneValues& values, std::string_view scene, std::string_view name) {
    const double value = value_of(values, name);
    if (value != 0.0 && value != 1.0) {
        return fail(
            ErrorCode::invalid_argument,
            std::string(scene) + ": " + std::string(name) + " is " + std::to_string(value) +
                ", expected 0 or 1"
        );
    }
    return value == 1.0;
}

Result<CatalogScene> make_island_entry(const SceneValues& values) {
    IslandOptions options;
    options.trees = whole<int>(values, "trees");
    options.radius_m = value_of(values, "radius");
    options.height_m = value_of(values, "height");
    options.terrain_quads = whole<int>(values, "terrain-quads");
    options.tree_triangles = whole<int>(values, "tree-triangles");
    options.tree_height_m = value_of(values, "tree-height");
    options.tree_width_m = value_of(values, "tree-width");
    options.min_spacing_m = value_of(values, "min-spacing");
    options.min_scale = value_of(values, "min-scale");
    options.max_scale = value_of(values, "max-scale");
    options.seed = whole<std::uint64_t>(values, "seed");
    options.tree_seed = whole<std::uint64_t>(values, "tree-seed");
    const Result<bool> quarter_turns = flag_of(values, "island", "quarter-turns");
    if (!quarter_turns) {
        return tl::unexpected(quarter_turns.error());
    }
    options.quarter_turns = *quarter_turns;
    auto path = island_path(options);
    if (!path) {
        return tl::unexpected(path.error());
    }
    auto scene = make_island(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return CatalogScene{std::move(*scene), std::move(*path)};
}

Result<CatalogScene> make_flat_town_entry(const SceneValues& values) {
    FlatTownOptions options;
    options.blocks = whole<int>(values, "blocks");
    options.block_m = value_of(values, "block");
    options.seed = whole<std::uint64_t>(values, "seed");
    auto path = flat_town_path(options, value_of(values, "pace"));
    if (!path) {
        return tl::unexpected(path.error());
    }
    auto scene = make_flat_town(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return CatalogScene{std::move(*scene), std::move(*path)};
}

Result<CatalogScene> make_forest_entry(
    const SceneValues& values, Result<CameraPath> (*make_path)(const ForestOptions&, double)
) {
    ForestOptions options;
    options.trees = whole<int>(values, "trees");
    options.tree_triangles = whole<int>(values, "tree-triangles");
    options.spacing_m = value_of(values, "spacing");
    options.tree_height_m = value_of(values, "tree-height");
    options.seed = whole<std::uint64_t>(values, "seed");
    auto path = make_path(options, value_of(values, "pace"));
    if (!path) {
        return tl::unexpected(path.error());
    }
    auto scene = make_forest(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return CatalogScene{std::move(*scene), std::move(*path)};
}

Result<CatalogScene> make_forest_sideways_entry(const SceneValues& values) {
    return make_forest_entry(values, forest_sideways_path);
}

Result<CatalogScene> make_forest_zoom_entry(const SceneValues& values) {
    return make_forest_entry(values, forest_zoom_path);
}

/// A scene with the dolly around it.
Result<CatalogScene> with_dolly(Scene scene, double angle_deg) {
    auto path = dolly_path(bounding_sphere(scene), {.angle_deg = angle_deg});
    if (!path) {
        return tl::unexpected(path.error());
    }
    CatalogScene made{std::move(scene), std::move(*path)};
    made.width = kDollySide;
    made.height = kDollySide;
    return made;
}

Result<CatalogScene> make_tree_entry(const SceneValues& values) {
    TreesOptions options;
    options.count = 1;
    options.tree.triangles = whole<int>(values, "triangles");
    options.tree.seed = whole<std::uint64_t>(values, "seed");
    auto scene = make_trees(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return with_dolly(std::move(*scene), value_of(values, "angle"));
}

Result<CatalogScene> make_molecule_entry(const SceneValues& values) {
    MoleculeOptions options;
    options.atoms = whole<int>(values, "atoms");
    options.seed = whole<std::uint64_t>(values, "seed");
    auto scene = make_molecule(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return show_molecule(std::move(*scene), value_of(values, "angle"));
}

Result<CatalogScene> make_knot_entry(const SceneValues& values) {
    KnotOptions options;
    options.along = whole<int>(values, "along");
    options.around = whole<int>(values, "around");
    auto scene = make_knot(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return with_dolly(std::move(*scene), value_of(values, "angle"));
}

Result<CatalogScene> make_grass_entry(const SceneValues& values) {
    GrassOptions options;
    options.triangles = whole<int>(values, "triangles");
    options.field_m = value_of(values, "field");
    options.seed = whole<std::uint64_t>(values, "seed");
    const Result<bool> ground = flag_of(values, "grass", "ground");
    if (!ground) {
        return tl::unexpected(ground.error());
    }
    options.ground = *ground;
    const double distance = value_of(values, "distance");
    auto path = distance == 0.0 ? grass_flight(options) : grass_dolly(options, distance);
    if (!path) {
        return tl::unexpected(path.error());
    }
    auto scene = make_grass(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return CatalogScene{std::move(*scene), std::move(*path)};
}

Result<CatalogScene> make_trees_entry(const SceneValues& values) {
    TreesOptions options;
    options.count = whole<int>(values, "count");
    options.tree.triangles = whole<int>(values, "triangles");
    options.tree.seed = whole<std::uint64_t>(values, "tree-seed");
    options.seed = whole<std::uint64_t>(values, "seed");
    const Result<bool> ground = flag_of(values, "trees", "ground");
    if (!ground) {
        return tl::unexpected(ground.error());
    }
    options.ground = *ground;
    auto scene = make_trees(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    auto path = overview_path(scene_bounds(*scene));
    if (!path) {
        return tl::unexpected(path.error());
    }
    CatalogScene made{std::move(*scene), std::move(*path)};
    made.width = kOverviewSide;
    made.height = kOverviewSide;
    return made;
}

Result<CatalogScene> make_terrain_entry(const SceneValues& values) {
    TerrainOptions options;
    options.posts = whole<int>(values, "posts");
    options.side_m = value_of(values, "side");
    options.relief_m = value_of(values, "relief");
    options.seed = whole<std::uint64_t>(values, "seed");
    auto scene = make_terrain(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    auto path = eval::height_field_path(scene_bounds(*scene));
    if (!path) {
        return tl::unexpected(path.error());
    }
    CatalogScene made{std::move(*scene), std::move(*path)};
    made.width = kTerrainSide;
    made.height = kTerrainSide;
    return made;
}

Result<CatalogScene> make_pipes_entry(const SceneValues& values) {
    PipesOptions options;
    options.triangles = whole<int>(values, "triangles");
    options.seed = whole<std::uint64_t>(values, "seed");
    auto path = pipes_path(options);
    if (!path) {
        return tl::unexpected(path.error());
    }
    auto scene = make_pipes(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return CatalogScene{std::move(*scene), std::move(*path)};
}

Result<CatalogScene> make_plant_entry(const SceneValues& values) {
    PlantOptions options;
    options.panels = whole<int>(values, "panels");
    options.seed = whole<std::uint64_t>(values, "seed");
    auto path = plant_path(options);
    if (!path) {
        return tl::unexpected(path.error());
    }
    auto scene = make_plant(options);
    if (!scene) {
        return tl::unexpected(scene.error());
    }
    return CatalogScene{std::move(*scene), std::move(*path)};
}

constexpr std::array<CatalogEntry, 12> kCatalog = {{
    {"island",
     "round island with 1117 instances of a willow, 40.6 million triangles",
     kIslandParameters,
     make_island_entry},
    {"flat",
     "flat town of 256 equal blocks, 420,000 triangles; a diagonal walk above its roofs",
     kFlatTownParameters,
     make_flat_town_entry},
    {"forest",
     "100 different trees of 1050 triangles that may be cut; sideways along its front",
     kForestParameters,
     make_forest_sideways_entry},
    {"forest-zoom",
     "the same forest; from a corner to its middle, above the tree tops",
     kForestZoomParameters,
     make_forest_zoom_entry},
    {"tree",
     "one broad-leaved tree of 52,470 triangles, from 1.75 to 14 radii away",
     kTreeParameters,
     make_tree_entry},
    {"molecule",
     "globule of 6534 atoms of 800 triangles, 5.2 million; from 1.75 to 14 radii away",
     kMoleculeParameters,
     make_molecule_entry},
    {"trees",
     "16,384 quarter-turned instances of that tree, 860 million triangles, all in view",
     kTreesParameters,
     make_trees_entry},
    {"grass",
     "field of 200,000 blades of grass on soil; low over it, or away from it",
     kGrassParameters,
     make_grass_entry},
    {"knot",
     "smooth closed tube of 100,000 triangles, from 1.75 to 14 radii away",
     kKnotParameters,
     make_knot_entry},
    {"terrain",
     "mountains of 513 x 513 heights; from above, around and in to the middle",
     kTerrainParameters,
     make_terrain_entry},
    {"pipes",
     "array of pipes and elbows, 1 million triangles; a walk along its aisles",
     kPipesParameters,
     make_pipes_entry},
    {"plant",
     "coal-fired power plant, 2 million triangles; a walk around, in, up and out again",
     kPlantParameters,
     make_plant_entry},
}};

/// "a, b, c" for messages.
template <typename Named>
std::string names_of(std::span<const Named> all) {
    std::string names;
    for (const Named& one : all) {
        names += (names.empty() ? "" : ", ") + std::string(one.name);
    }
    return names;
}

tl::unexpected<Error> invalid(std::string message) {
    return fail(ErrorCode::invalid_argument, std::move(message));
}

} // namespace

Result<CatalogScene> show_molecule(Scene scene, double angle_deg) {
    return with_dolly(std::move(scene), angle_deg);
}

std::span<const CatalogEntry> scene_catalog() noexcept {
    return kCatalog;
}

Result<CatalogScene> make_scene(std::string_view name, const SceneValues& values) {
    const auto entry = std::find_if(kCatalog.begin(), kCatalog.end(), [&](const CatalogEntry& one) {
        return one.name == name;
    });
    if (entry == kCatalog.end()) {
        return fail(
            ErrorCode::not_found,
            "scene \"" + std::string(name) + "\" does not exist, expected one of " +
                names_of(std::span<const CatalogEntry>(kCatalog))
        );
    }
    SceneValues complete;
    for (const SceneParameter& parameter : entry->parameters) {
        complete.emplace(parameter.name, parameter.default_value);
    }
    for (const auto& [key, value] : values) {
        const auto parameter = std::find_if(
            entry->parameters.begin(),
            entry->parameters.end(),
            [&key = key](const SceneParameter& one) { return one.name == key; }
        );
        const std::string where = std::string(name) + ": " + key;
        if (parameter == entry->parameters.end()) {
            return invalid(
                where + " is no parameter, expected one of " + names_of(entry->parameters)
            );
        }
        if (!std::isfinite(value) || (parameter->whole && value != std::floor(value))) {
            return invalid(
                where + " is " + std::to_string(value) + ", expected a " +
                (parameter->whole ? "whole" : "finite") + " number"
            );
        }
        complete[key] = value;
    }
    return entry->make(complete);
}

} // namespace farfield::scenes
