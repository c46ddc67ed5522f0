#include "run/world.hpp"

#include <farfield/io/mesh_tools.hpp>
#include <farfield/io/scene_file.hpp>
#include <farfield/math/triangle_box.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/partition/octree.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <utility>

namespace farfield::run {

namespace {

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
        .count();
}

/// @param max_items of the leaves of a BSP
Result<Hierarchy>
build_hierarchy(const Scene& scene, const WorldOptions& options, std::uint32_t max_items) {
    std::vector<Object> objects;
    objects.reserve(scene.instances.size());
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        const Mesh& mesh = scene.meshes[index_of(scene.instances[i].mesh)];
        objects.push_back(
            {.bounds = item_bounds(scene, make_id<ItemId>(i)),
             .primitives = primitive_count(mesh),
             .splittable = mesh.splittable}
        );
    }
    const auto triangle = [&](std::uint32_t object, std::uint32_t primitive) -> Triangle3d {
        const Instance& instance = scene.instances[object];
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        const auto corner = [&](std::size_t k) -> glm::dvec3 {
            const glm::vec3& p = mesh.positions[mesh.indices[std::size_t{primitive} * 3 + k]];
            return instance.object_to_world * glm::dvec4(mesh.origin + glm::dvec3(p), 1.0);
        };
        return {corner(0), corner(1), corner(2)};
    };
    if (options.partition == "kdtree") {
        return partition::build_kdtree(objects, options.cells, triangle);
    }
    if (options.partition == "octree") {
        const partition::KdTreeOptions& cells = options.cells;
        return partition::build_octree(
            objects,
            {.max_primitives = cells.max_primitives,
             .max_depth = cells.max_depth,
             .inflation = cells.inflation,
             .max_copies = cells.max_copies},
            triangle
        );
    }
    if (options.partition != "bsp") {
        return fail(
            ErrorCode::invalid_argument,
            "partition \"" + options.partition +
                "\" does not exist, expected one of bsp, kdtree, octree"
        );
    }
    partition::BspOptions bsp = options.bsp;
    bsp.up = scene.up;
    bsp.max_items = max_items;
    return partition::build_bsp(objects, bsp, [&](std::uint32_t object, std::uint32_t primitive) {
        return bounds(triangle(object, primitive));
    });
}

/// A file of atoms, which is walked around as the molecule of the catalogue is.
bool is_molecule(const WorldOptions& options) {
    const std::string extension = std::filesystem::path(options.scene).extension().string();
    return extension == ".pdb" || extension == ".PDB";
}

void show(scenes::CatalogScene made, World& world) {
    world.scene = std::move(made.scene);
    world.path = std::move(made.path);
    world.fov_deg = made.fov_deg;
    world.width = made.width;
    world.height = made.height;
}

/// The scene and its walk, from the catalogue or from a file.
Result<void>
load_scene_and_path(const WorldOptions& options, World& world, std::uint32_t& max_items) {
    const auto catalog = scenes::scene_catalog();
    const bool known = std::any_of(catalog.begin(), catalog.end(), [&](const auto& entry) {
        return entry.name == options.scene;
    });
    if (known) {
        auto made = scenes::make_scene(options.scene, options.scene_values);
        if (!made) {
            return tl::unexpected(made.error());
        }
        max_items = made->max_items;
        show(std::move(*made), world);
    } else {
        if (!options.scene_values.empty()) {
            return fail(
                ErrorCode::invalid_argument,
                options.scene + ": a file has no parameter \"" +
                    options.scene_values.begin()->first + "\""
            );
        }
        io::LoadOptions load;
        load.up = options.up == "z" ? io::UpAxis::z : io::UpAxis::y;
        auto loaded = io::load_scene(options.scene, load);
        if (!loaded) {
            return tl::unexpected(loaded.error());
        }
        for (const std::string& warning : loaded->warnings) {
            std::fprintf(stderr, "warning: %s\n", warning.c_str());
        }
        if (is_molecule(options)) {
            auto shown = scenes::show_molecule(std::move(loaded->scene));
            if (!shown) {
                return tl::unexpected(shown.error());
            }
            show(std::move(*shown), world);
        } else {
            world.scene = std::move(loaded->scene);
        }
    }
    if (!options.path.empty()) {
        auto path = eval::load_camera_path(options.path);
        if (!path) {
            return tl::unexpected(path.error());
        }
        world.path = std::move(*path);
    } else if (!known && !is_molecule(options)) {
        const Box3d box = scene_bounds(world.scene);
        const bool height_field = std::filesystem::path(options.scene).extension() == ".png";
        auto path = height_field ? eval::height_field_path(box)
                                 : eval::default_path(
                                       box,
                                       {.frames = std::max(options.frames.value_or(1200), 2),
                                        .step_m = options.step_m,
                                        .up = world.scene.up}
                                   );
        if (!path) {
            return tl::unexpected(path.error());
        }
        world.path = std::move(*path);
    }
    return {};
}

Result<void> choose_picture(const WorldOptions& options, World& world) {
    if (options.fov_deg) {
        if (!(*options.fov_deg > 0.0 && *options.fov_deg < 180.0)) {
            return fail(
                ErrorCode::invalid_argument,
                "--fov-deg is " + std::to_string(*options.fov_deg) +
                    ", expected more than 0 and less than 180 degrees"
            );
        }
        world.fov_deg = *options.fov_deg;
    }
    if (options.size.empty()) {
        return {};
    }
    int width = 0;
    int height = 0;
    int read = 0;
    if (std::sscanf(options.size.c_str(), "%dx%d%n", &width, &height, &read) != 2 ||
        static_cast<std::size_t>(read) != options.size.size()) {
        return fail(
            ErrorCode::invalid_argument,
            "--size is '" + options.size + "', expected WIDTHxHEIGHT, as 640x480"
        );
    }
    if (width < 1 || height < 1) {
        return fail(
            ErrorCode::invalid_argument,
            "--size is '" + options.size + "', expected at least 1x1 pixels"
        );
    }
    world.width = width;
    world.height = height;
    return {};
}

Result<void> choose_frames(const WorldOptions& options, World& world) {
    world.whole_path = options.whole_path;
    world.frames = options.whole_path.value_or(options.frames.value_or(world.path.frame_count));
    if (!options.whole_path && world.frames > world.path.frame_count) {
        return fail(
            ErrorCode::invalid_argument,
            "--frames is " + std::to_string(world.frames) + ", the path has " +
                std::to_string(world.path.frame_count) +
                " (--whole-path walks all of it in any number of frames)"
        );
    }
    return validate(world.view(0));
}

Result<void> add_levels(World& world) {
    for (const auto& [method, table] :
         {std::pair{io::Simplification::collapse, &world.collapsed},
          std::pair{io::Simplification::cluster, &world.clustered}}) {
        io::SceneLevelOptions options;
        options.levels.method = method;
        options.items = world.instances; // and not the levels made before
        auto levels = io::add_levels_of_detail(world.scene, options);
        if (!levels) {
            return tl::unexpected(levels.error());
        }
        *table = std::move(*levels);
    }
    return {};
}

} // namespace

View World::view(int frame) const {
    const double at = whole_path ? eval::whole_path_frame(path, frame, *whole_path) : frame;
    const PathPose pose = eval::pose_at(path, at);
    // Reverse-z in float keeps its precision over any range; the near plane only has to stay off
    // what the eye may touch.
    const double near_distance = radius * 1e-4;
    const double far_distance =
        std::max(radius * 16.0, glm::distance(pose.eye, middle) + radius * 2.0);
    const Lens lens = perspective_lens(
        fov_deg * std::numbers::pi / 180.0,
        static_cast<double>(width) / static_cast<double>(height),
        near_distance,
        far_distance
    );
    return look_at(pose.eye, pose.target, pose.up, lens, width, height);
}

Result<void> World::move(int frame) {
    for (const Mover& mover : movers) {
        scene.instances[index_of(mover.item)].object_to_world = mover.object_to_world(frame);
        if (Result<void> moved =
                partition::update_bounds(hierarchy, mover.item, item_bounds(scene, mover.item));
            !moved) {
            return moved;
        }
        // The mesh of a balloon has its origin at 0.
        item_frames[index_of(mover.item)] = mover.object_to_world(frame);
    }
    return {};
}

Result<World> load_world(const WorldOptions& options) {
    World world;
    std::uint32_t max_items = partition::BspOptions{}.max_items;
    if (Result<void> loaded = load_scene_and_path(options, world, max_items); !loaded) {
        return tl::unexpected(std::move(loaded).error());
    }
    const Box3d box = scene_bounds(world.scene);
    world.middle = center(box);
    world.radius = glm::length(extent(box)) / 2.0;
    if (Result<void> chosen = choose_picture(options, world); !chosen) {
        return tl::unexpected(std::move(chosen).error());
    }
    if (Result<void> chosen = choose_frames(options, world); !chosen) {
        return tl::unexpected(std::move(chosen).error());
    }
    auto movers = add_movers(world.scene, options.movers);
    if (!movers) {
        return tl::unexpected(movers.error());
    }
    world.movers = std::move(*movers);
    const auto begin = std::chrono::steady_clock::now();
    auto hierarchy = build_hierarchy(world.scene, options, options.max_items.value_or(max_items));
    if (!hierarchy) {
        return tl::unexpected(hierarchy.error());
    }
    world.hierarchy = std::move(*hierarchy);
    world.build_ms = milliseconds_since(begin);
    world.triangles = primitive_count(world.scene);
    world.instances = world.scene.instances.size();
    world.scene_bytes = memory_bytes(world.scene);
    if (options.levels) {
        if (Result<void> made = add_levels(world); !made) {
            return tl::unexpected(std::move(made).error());
        }
    }
    for (const Instance& instance : world.scene.instances) {
        world.item_primitives.push_back(primitive_count(world.scene.meshes[index_of(instance.mesh)])
        );
    }
    world.item_frames = item_frames(world.scene);
    return world;
}

} // namespace farfield::run
