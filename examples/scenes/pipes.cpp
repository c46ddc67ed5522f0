#include "pipes.hpp"

#include "pipe_network.hpp"
#include "random.hpp"
#include "solids.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

using glm::dvec3;
using glm::ivec3;

constexpr int kMinTriangles = 20'000;
constexpr int kMaxTriangles = 50'000'000;
constexpr int kLayers = 6;
constexpr int kFreeLayers = 2; // of an aisle
constexpr int kMinNodes = 12;
// Triangles of a node that has a pipe, and the share of nodes that have one.
constexpr double kNodeTriangles = 500.0;
constexpr double kFilled = 0.4;
constexpr int kColumnEvery = 6; // nodes

const dvec3 kConcrete(150.0, 148.0, 142.0);
const dvec3 kAislePaint(112.0, 118.0, 124.0);
const dvec3 kFrame(196.0, 146.0, 60.0);

/// Whether a row of nodes is in an aisle along it. Aisles are two nodes wide.
bool in_aisle(int row, int nodes, int aisle) {
    for (const int middle : {aisle, nodes / 2, nodes - aisle}) {
        if (row == middle || row + 1 == middle) {
            return true;
        }
    }
    return false;
}

/// Slabs of one node each, darker in the aisles.
Mesh make_floor(int nodes, int aisle, Random& random) {
    Solids floor;
    const double half = nodes * kPipeSpacing / 2.0;
    for (int row = 0; row < nodes; ++row) {
        for (int column = 0; column < nodes; ++column) {
            const bool walked = in_aisle(row, nodes, aisle) || in_aisle(column, nodes, aisle);
            floor.add_sheet(
                {column * kPipeSpacing - half, 0.0, row * kPipeSpacing - half},
                {0.0, 0.0, kPipeSpacing},
                {kPipeSpacing, 0.0, 0.0},
                (walked ? kAislePaint : kConcrete) * random.between(0.95, 1.05)
            );
        }
    }
    return floor.finish("floor", true);
}

/// Columns between the nodes and girders between the layers: no pipe comes near.
Mesh make_frame(int nodes, int aisle) {
    Solids frame;
    const double half = nodes * kPipeSpacing / 2.0;
    const auto line = [&](int between) { return between * kPipeSpacing - half; };
    constexpr double kTop = kLayers * kPipeSpacing;
    constexpr double kWidth = 0.18;
    constexpr double kColumn = 0.22; // wider, so that no two faces share a plane
    const auto free_of_aisles = [&](int between) {
        // A column between two nodes is in an aisle where both of them are.
        return !(in_aisle(between, nodes, aisle) && in_aisle(between - 1, nodes, aisle));
    };
    for (int z = kColumnEvery / 2; z < nodes; z += kColumnEvery) {
        for (int x = kColumnEvery / 2; x < nodes; x += kColumnEvery) {
            if (free_of_aisles(x) && free_of_aisles(z)) {
                frame.add_girder(
                    {line(x), 0.0, line(z)},
                    {line(x), kTop, line(z)},
                    kColumn,
                    kColumn,
                    kFrame,
                    kPipeSpacing
                );
            }
        }
    }
    // Girders along z lie on those along x, so that none goes through another.
    for (int level = kFreeLayers; level <= kLayers; level += kFreeLayers) {
        const double y = level * kPipeSpacing;
        for (int at = kColumnEvery / 2; at < nodes; at += kColumnEvery) {
            frame.add_girder(
                {-half, y - kWidth / 2.0, line(at)},
                {half, y - kWidth / 2.0, line(at)},
                kWidth,
                kWidth,
                kFrame * 0.92,
                kPipeSpacing
            );
            frame.add_girder(
                {line(at), y + kWidth / 2.0, -half},
                {line(at), y + kWidth / 2.0, half},
                kWidth,
                kWidth,
                kFrame,
                kPipeSpacing
            );
        }
    }
    return frame.finish("frame", true);
}

} // namespace

Result<void> validate(const PipesOptions& options) {
    if (options.triangles < kMinTriangles || options.triangles > kMaxTriangles) {
        return fail(
            ErrorCode::invalid_argument,
            "pipes: triangles is " + std::to_string(options.triangles) + ", expected " +
                std::to_string(kMinTriangles) + " to " + std::to_string(kMaxTriangles)
        );
    }
    return {};
}

int pipes_nodes(const PipesOptions& options) noexcept {
    const double columns = options.triangles / (kLayers * kFilled * kNodeTriangles);
    const int half = static_cast<int>(std::ceil(std::sqrt(columns) / 2.0));
    return std::max(2 * half, kMinNodes);
}

int pipes_aisle(const PipesOptions& options) noexcept {
    return pipes_nodes(options) / 5;
}

Result<Scene> make_pipes(const PipesOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    const int nodes = pipes_nodes(options);
    const int aisle = pipes_aisle(options);
    Random random(options.seed);
    Scene scene;
    scene.name = "pipes";
    scene.sky = glm::vec3(0.74F, 0.80F, 0.86F);
    for (Mesh& mesh : std::array{make_floor(nodes, aisle, random), make_frame(nodes, aisle)}) {
        io::optimize_for_drawing(mesh);
        scene.instances.push_back({make_id<MeshId>(scene.meshes.size())});
        scene.meshes.push_back(std::move(mesh));
    }
    const auto still = static_cast<std::int64_t>(options.triangles) -
                       static_cast<std::int64_t>(primitive_count(scene));
    const PipeLayer layer(scene, random);
    PipeLattice lattice;
    lattice.nodes = ivec3(nodes, kLayers, nodes);
    lattice.corner = dvec3(-nodes * kPipeSpacing / 2.0, 0.0, -nodes * kPipeSpacing / 2.0);
    lattice.taken.assign(static_cast<std::size_t>(nodes) * kLayers * nodes, false);
    for (int z = 0; z < nodes; ++z) {
        for (int x = 0; x < nodes; ++x) {
            if (in_aisle(x, nodes, aisle) || in_aisle(z, nodes, aisle)) {
                for (int y = 0; y < kFreeLayers; ++y) {
                    lattice.taken[lattice.index_of({x, y, z})] = true;
                }
            }
        }
    }
    layer.lay(scene, lattice, static_cast<int>(still), random);
    return scene;
}

} // namespace farfield::scenes
