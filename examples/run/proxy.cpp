#include "run/proxy.hpp"

#include <farfield/embree/closest_point.hpp>
#include <farfield/image/build_proxy.hpp>
#include <farfield/image/height_grid.hpp>
#include <farfield/io/coarse_mesh.hpp>
#include <farfield/parallel/parallel_executor.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

namespace farfield::run {

namespace {

constexpr std::uint32_t kRefinedTriangles = 16384;
constexpr std::uint32_t kMeshTriangles = 2000;

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
    World& world,
    std::size_t mesh,
    const GriddedMesh& gridded,
    const ProxyOptions& options,
    std::vector<ProxyPair>& pairs
) {
    Scene& scene = world.scene;
    const std::size_t items = resting_items(world);
    const auto build = [&](const ProxyItems& of) {
        return options.proxy == "grid"
                   ? build_grid_proxy(gridded.grid, of, {.squares = options.coarse})
                   : build_refined_proxy(
                         gridded.grid,
                         of,
                         {.max_triangles = options.coarse_triangles.value_or(kRefinedTriangles)}
                     );
    };
    // The triangles are the same wherever the grid stands: those of the mesh are made of it where
    // it is in its own frame.
    const auto own = build({ItemId{0}, ItemId{1}});
    if (!own) {
        return tl::unexpected(own.error());
    }
    Mesh coarse = make_coarse_mesh(scene.meshes[mesh], gridded, *own);
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

/// Adds a mesh of fewer triangles and pairs it with every instance.
Result<void> add_mesh(
    World& world, std::size_t mesh, const ProxyOptions& options, std::vector<ProxyPair>& pairs
) {
    Scene& scene = world.scene;
    const std::uint32_t triangles = options.coarse_triangles.value_or(kMeshTriangles);
    auto coarse = io::make_coarse_mesh(scene.meshes[mesh], {.triangles = triangles});
    if (!coarse) {
        return tl::unexpected(std::move(coarse).error());
    }
    const auto on_fine = embree::ClosestPointFinder::create(scene.meshes[mesh]);
    if (!on_fine) {
        return tl::unexpected(on_fine.error());
    }
    const auto on_coarse = embree::ClosestPointFinder::create(*coarse);
    if (!on_coarse) {
        return tl::unexpected(on_coarse.error());
    }
    const std::size_t added = scene.meshes.size();
    parallel::ParallelExecutor executor;
    for (const ProxyItems& of :
         add_coarse_mesh(scene, make_id<MeshId>(mesh), std::move(*coarse), resting_items(world))) {
        auto pair = build_mesh_proxy(
            {scene.meshes[mesh],
             scene.meshes[added],
             **on_fine,
             **on_coarse,
             scene.instances[index_of(of.fine)].object_to_world},
            of,
            executor
        );
        if (!pair) {
            return tl::unexpected(std::move(pair).error());
        }
        pairs.push_back(std::move(*pair));
    }
    return {};
}

/// Heights where there are some, or where they are asked for.
Result<void> add_either(
    World& world, std::size_t mesh, const ProxyOptions& options, std::vector<ProxyPair>& pairs
) {
    const auto gridded = height_grid_of(world.scene.meshes[mesh]);
    if (gridded) {
        return add_heights(world, mesh, *gridded, options, pairs);
    }
    if (!options.proxy.empty()) {
        return tl::unexpected(gridded.error());
    }
    return add_mesh(world, mesh, options, pairs);
}

/// That pairs of meshes fit into memory: each instance has samples of its own.
Result<void> check_samples(const World& world, const std::vector<std::uint32_t>& uses) {
    std::uint64_t samples = 0;
    for (std::size_t mesh = 0; mesh < uses.size(); ++mesh) {
        samples += std::uint64_t{uses[mesh]} * world.scene.meshes[mesh].positions.size();
    }
    if (samples > kMostProxySamples) {
        return fail(
            ErrorCode::unsupported,
            "the items have " + std::to_string(samples) +
                " vertices, too many for pairs: at most " + std::to_string(kMostProxySamples)
        );
    }
    return {};
}

} // namespace

Result<std::vector<ProxyPair>> make_proxies(World& world, const ProxyOptions& options) {
    const std::string& proxy = options.proxy;
    if (!proxy.empty() && proxy != "grid" && proxy != "refined" && proxy != "mesh") {
        return fail(
            ErrorCode::invalid_argument,
            "proxy \"" + proxy + "\" does not exist, expected one of grid, refined, mesh"
        );
    }
    std::vector<std::uint32_t> uses(world.scene.meshes.size(), 0);
    for (std::size_t i = 0; i < resting_items(world); ++i) {
        ++uses[index_of(world.scene.instances[i].mesh)];
    }
    if (Result<void> checked = check_samples(world, uses); !checked) {
        return tl::unexpected(std::move(checked).error());
    }
    std::vector<ProxyPair> pairs;
    for (std::size_t mesh = 0; mesh < uses.size(); ++mesh) {
        if (uses[mesh] == 0) {
            continue;
        }
        Result<void> added = proxy == "mesh" ? add_mesh(world, mesh, options, pairs)
                                             : add_either(world, mesh, options, pairs);
        if (!added) {
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
