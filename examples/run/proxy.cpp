#include "run/proxy.hpp"

#include <farfield/image/build_proxy.hpp>
#include <farfield/image/height_grid.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace farfield::run {

namespace {

/// Items of the hierarchy that stay where they are: what moves was added last.
std::size_t resting_items(const World& world) {
    return world.instances - world.movers.size();
}

/// Where an instance puts a grid; grids stay along the axes.
Result<glm::dvec3> shift_of(const Mesh& mesh, const Instance& instance) {
    const glm::dmat4x3& placed = instance.object_to_world;
    const glm::dmat4x3 unturned(1.0);
    for (int column = 0; column < 3; ++column) {
        if (placed[column] != unturned[column]) {
            return fail(
                ErrorCode::unsupported,
                "mesh \"" + mesh.name + "\" is a turned or scaled grid of heights, which has no " +
                    "coarse grid"
            );
        }
    }
    return placed[3];
}

/// Adds the coarse model of a grid of heights and pairs it with every instance.
Result<void> add_heights(
    World& world, std::size_t mesh, const ProxyOptions& options, std::vector<ProxyPair>& pairs
) {
    Scene& scene = world.scene;
    auto gridded = height_grid_of(scene.meshes[mesh]);
    if (!gridded) {
        return tl::unexpected(std::move(gridded).error());
    }
    const std::size_t items = resting_items(world);
    const auto build = [&](const ProxyItems& of) {
        return options.proxy == "grid"
                   ? build_grid_proxy(gridded->grid, of, {.squares = options.coarse})
                   : build_refined_proxy(
                         gridded->grid, of, {.max_triangles = options.coarse_triangles}
                     );
    };
    // The triangles are the same wherever the grid stands: those of the mesh are made of it where
    // it is in its own frame.
    const auto own = build({ItemId{0}, ItemId{1}});
    if (!own) {
        return tl::unexpected(own.error());
    }
    Mesh coarse = make_coarse_mesh(scene.meshes[mesh], *gridded, *own);
    for (const ProxyItems& of :
         add_coarse_mesh(scene, make_id<MeshId>(mesh), std::move(coarse), items)) {
        const auto shift = shift_of(scene.meshes[mesh], scene.instances[index_of(of.fine)]);
        if (!shift) {
            return tl::unexpected(shift.error());
        }
        ProxyPair& pair = pairs.emplace_back(own->pair);
        pair.fine = of.fine;
        pair.coarse = of.coarse;
        pair.origin += *shift;
    }
    return {};
}

} // namespace

Result<std::vector<ProxyPair>> make_proxies(World& world, const ProxyOptions& options) {
    if (!options.proxy.empty() && options.proxy != "grid" && options.proxy != "refined") {
        return fail(
            ErrorCode::invalid_argument,
            "proxy \"" + options.proxy + "\" does not exist, expected one of grid, refined"
        );
    }
    std::vector<ProxyPair> pairs;
    const std::size_t items = resting_items(world);
    std::vector<bool> used(world.scene.meshes.size(), false);
    for (std::size_t i = 0; i < items; ++i) {
        used[index_of(world.scene.instances[i].mesh)] = true;
    }
    for (std::size_t mesh = 0; mesh < used.size(); ++mesh) {
        if (!used[mesh]) {
            continue;
        }
        if (Result<void> added = add_heights(world, mesh, options, pairs); !added) {
            return tl::unexpected(std::move(added).error());
        }
    }
    std::sort(pairs.begin(), pairs.end(), [](const ProxyPair& a, const ProxyPair& b) {
        return a.fine < b.fine;
    });
    for (std::size_t i = world.item_primitives.size(); i < world.scene.instances.size(); ++i) {
        const Mesh& mesh = world.scene.meshes[index_of(world.scene.instances[i].mesh)];
        world.item_primitives.push_back(primitive_count(mesh));
    }
    world.item_frames = item_frames(world.scene);
    return pairs;
}

} // namespace farfield::run
