#include "io/distance_tree.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/io/mesh_tools.hpp>
#include <farfield/scene/surface_points.hpp>

#include <glm/geometric.hpp>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

namespace farfield::io {
namespace {

/// How much worse than the best the vertex cache may get to reduce overdraw.
constexpr float kOverdrawThreshold = 1.05F;

template <typename T>
void add_stream(std::vector<meshopt_Stream>& streams, const std::vector<T>& array) {
    if (!array.empty()) {
        streams.push_back({array.data(), sizeof(T), sizeof(T)});
    }
}

template <typename T>
void remap(std::vector<T>& array, const std::vector<unsigned>& numbers, std::size_t count) {
    if (array.empty()) {
        return;
    }
    std::vector<T> remapped(count);
    meshopt_remapVertexBuffer(
        remapped.data(), array.data(), array.size(), sizeof(T), numbers.data()
    );
    array.swap(remapped);
}

void apply(Mesh& mesh, const std::vector<unsigned>& numbers, std::size_t count) {
    meshopt_remapIndexBuffer(
        mesh.indices.data(), mesh.indices.data(), mesh.indices.size(), numbers.data()
    );
    remap(mesh.positions, numbers, count);
    remap(mesh.normals, numbers, count);
    remap(mesh.colors, numbers, count);
    remap(mesh.texcoords, numbers, count);
}

/// Relative to the extent of the mesh: levels are limited by their triangles, not by their error.
constexpr float kAnyError = 1.0F;

Result<void> check_options(const LevelOptions& options) {
    constexpr double kLeastRatio = 0.05;
    constexpr double kMostRatio = 0.9;
    if (!(options.ratio >= kLeastRatio && options.ratio <= kMostRatio)) {
        return fail(
            ErrorCode::invalid_argument,
            "levels of detail: ratio is " + std::to_string(options.ratio) + ", expected 0.05 to 0.9"
        );
    }
    if (options.least_triangles < 1) {
        return fail(
            ErrorCode::invalid_argument,
            "levels of detail: least_triangles is 0, expected 1 or more"
        );
    }
    return {};
}

/// Triangles of the parts, each reduced to `share` of its own. Parts that vanish are left out.
/// @param error_m the largest that the simplifier reports
Mesh simplify(const Mesh& original, Simplification method, double share, double& error_m) {
    const std::vector<glm::vec3>& positions = original.positions;
    Mesh level;
    float error = 0.0F;
    for (const MeshPart& part : original.parts) {
        const std::uint32_t* const indices = original.indices.data() + part.first_index;
        const std::uint32_t triangles = part.index_count / 3;
        const auto target = 3 * static_cast<std::size_t>(std::ceil(share * triangles));
        const std::size_t first = level.indices.size();
        level.indices.resize(first + part.index_count); // what meshoptimizer may need on the way
        float part_error = 0.0F;
        const std::size_t count = method == Simplification::collapse
                                      ? meshopt_simplify(
                                            level.indices.data() + first,
                                            indices,
                                            part.index_count,
                                            &positions.front().x,
                                            positions.size(),
                                            sizeof(glm::vec3),
                                            target,
                                            kAnyError,
                                            0,
                                            &part_error
                                        )
                                      : meshopt_simplifySloppy(
                                            level.indices.data() + first,
                                            indices,
                                            part.index_count,
                                            &positions.front().x,
                                            positions.size(),
                                            sizeof(glm::vec3),
                                            target,
                                            kAnyError,
                                            &part_error
                                        );
        level.indices.resize(first + count);
        if (count > 0) {
            level.parts.push_back(
                {static_cast<std::uint32_t>(first),
                 static_cast<std::uint32_t>(count),
                 part.material}
            );
        }
        error = std::max(error, part_error);
    }
    const float scale =
        meshopt_simplifyScale(&positions.front().x, positions.size(), sizeof(glm::vec3));
    error_m = double{error} * double{scale};
    return level;
}

/// Gives a level the vertices of the original, of which `optimize_for_drawing` keeps those in use.
void add_vertices(Mesh& level, const Mesh& original) {
    level.origin = original.origin;
    level.positions = original.positions;
    level.normals = original.normals;
    level.colors = original.colors;
    level.texcoords = original.texcoords;
    optimize_for_drawing(level);
}

/// Points of a surface, and what finds the distance of others from it.
struct SampledSurface {
    std::vector<glm::dvec3> samples;
    DistanceTree tree;
};

glm::dvec3 vertex_of(const Mesh& mesh, std::uint32_t index) {
    return mesh.origin + glm::dvec3(mesh.positions[index]);
}

void sample_triangles(const Mesh& mesh, std::uint32_t count, std::vector<glm::dvec3>& samples) {
    for (const glm::vec3& point : points_of_surface(mesh, count)) {
        samples.push_back(mesh.origin + glm::dvec3(point));
    }
}

/// Vertices in use, where a surface reaches out farthest: at most `count`, evenly by number.
void sample_vertices(const Mesh& mesh, std::uint32_t count, std::vector<glm::dvec3>& samples) {
    std::vector<std::uint32_t> used = mesh.indices;
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    const std::size_t taken = std::min<std::size_t>(count, used.size());
    for (std::size_t i = 0; i < taken; ++i) {
        samples.push_back(vertex_of(mesh, used[i * used.size() / taken]));
    }
}

SampledSurface sample_surface(const Mesh& mesh, std::uint32_t count) {
    SampledSurface surface{{}, DistanceTree(mesh)};
    sample_triangles(mesh, count, surface.samples);
    sample_vertices(mesh, count, surface.samples);
    return surface;
}

/// The farthest that a sample of `from` is from `to`. [m]
double farthest(const SampledSurface& from, const SampledSurface& to) {
    double farthest_sq = 0.0;
    for (const glm::dvec3& sample : from.samples) {
        farthest_sq = std::max(farthest_sq, to.tree.distance_sq(sample));
    }
    return std::sqrt(farthest_sq);
}

double surface_distance(const SampledSurface& a, const SampledSurface& b) {
    return std::max(farthest(a, b), farthest(b, a));
}

/// By how much an instance enlarges a length at most: the root of the largest row sum of A^T A,
/// which is its largest eigenvalue or more. Exact where axes stay at right angles.
double largest_scale(const Instance& instance) {
    const glm::dmat4x3& world = instance.object_to_world;
    double largest_sq = 0.0;
    for (int row = 0; row < 3; ++row) {
        double sum = 0.0;
        for (int column = 0; column < 3; ++column) {
            sum += std::abs(glm::dot(world[row], world[column]));
        }
        largest_sq = std::max(largest_sq, sum);
    }
    return std::sqrt(largest_sq);
}

/// Rounded up: an error never gets smaller.
float error_in_world(double error_m, const Instance& instance) {
    const double error = error_m * largest_scale(instance);
    return error > 0.0
               ? std::nextafter(static_cast<float>(error), std::numeric_limits<float>::infinity())
               : 0.0F;
}

/// The levels of each mesh of a scene; none where it gets none.
Result<std::vector<std::vector<MeshLevel>>>
make_scene_levels(const Scene& scene, const SceneLevelOptions& options) {
    std::vector<std::uint32_t> uses(scene.meshes.size(), 0);
    const std::size_t items = options.items.value_or(scene.instances.size());
    if (items > scene.instances.size()) {
        return fail(
            ErrorCode::invalid_argument,
            "levels of detail: items is " + std::to_string(items) + ", the scene has " +
                std::to_string(scene.instances.size()) + " instances"
        );
    }
    for (std::size_t i = 0; i < items; ++i) {
        ++uses[index_of(scene.instances[i].mesh)];
    }
    std::vector<std::vector<MeshLevel>> levels(scene.meshes.size());
    std::uint64_t instances = scene.instances.size();
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
        const Mesh& mesh = scene.meshes[m];
        if (uses[m] == 0 || uses[m] < options.min_instances || mesh.splittable ||
            primitive_count(mesh) < options.min_triangles) {
            continue;
        }
        auto made = make_levels(mesh, options.levels);
        if (!made) {
            return tl::unexpected(std::move(made).error());
        }
        instances += std::uint64_t{uses[m]} * made->size();
        levels[m] = std::move(*made);
    }
    if (instances >= UINT32_MAX) {
        return fail(
            ErrorCode::unsupported,
            "levels of detail: " + std::to_string(instances) +
                " instances with those of all levels, expected less than 2^32 - 1"
        );
    }
    return levels;
}

} // namespace

void optimize_for_drawing(Mesh& mesh) {
    FARFIELD_ASSERT(mesh.normals.size() == mesh.positions.size());
    std::vector<meshopt_Stream> streams;
    add_stream(streams, mesh.positions);
    add_stream(streams, mesh.normals);
    add_stream(streams, mesh.colors);
    add_stream(streams, mesh.texcoords);
    std::vector<unsigned> numbers(mesh.positions.size());
    const std::size_t distinct = meshopt_generateVertexRemapMulti(
        numbers.data(),
        mesh.indices.data(),
        mesh.indices.size(),
        mesh.positions.size(),
        streams.data(),
        streams.size()
    );
    apply(mesh, numbers, distinct);

    for (const MeshPart& part : mesh.parts) {
        if (part.index_count == 0) {
            continue;
        }
        std::uint32_t* const indices = mesh.indices.data() + part.first_index;
        meshopt_optimizeVertexCache(indices, indices, part.index_count, distinct);
        meshopt_optimizeOverdraw(
            indices,
            indices,
            part.index_count,
            &mesh.positions.front().x,
            distinct,
            sizeof(glm::vec3),
            kOverdrawThreshold
        );
    }

    numbers.resize(distinct);
    const std::size_t used = meshopt_optimizeVertexFetchRemap(
        numbers.data(), mesh.indices.data(), mesh.indices.size(), distinct
    );
    apply(mesh, numbers, used);
    update_bounds(mesh); // unused vertices are gone
}

Result<std::vector<MeshLevel>> make_levels(const Mesh& mesh, const LevelOptions& options) {
    if (Result<void> valid = check_options(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    std::vector<MeshLevel> levels;
    const auto triangles = static_cast<double>(primitive_count(mesh));
    std::vector<SampledSurface> original; // one, where errors are measured
    if (options.error_samples > 0) {
        original.push_back(sample_surface(mesh, options.error_samples));
    }
    // A level has to save at least half of what was asked for, or it is not worth its memory.
    const double largest = (1.0 + options.ratio) / 2.0;
    double last_count = triangles;
    double last_error_m = 0.0;
    for (double share = options.ratio; share * triangles >= options.least_triangles;
         share *= options.ratio) {
        double error_m = 0.0;
        Mesh level = simplify(mesh, options.method, share, error_m);
        const auto count = static_cast<double>(primitive_count(level));
        if (count == 0.0 || count > largest * last_count) {
            continue;
        }
        add_vertices(level, mesh);
        level.name = mesh.name + ", level " + std::to_string(levels.size() + 1);
        if (!original.empty()) {
            const SampledSurface sampled = sample_surface(level, options.error_samples);
            error_m = std::max(error_m, surface_distance(original.front(), sampled));
        }
        last_count = count;
        last_error_m = std::max(last_error_m, error_m);
        levels.push_back({std::move(level), last_error_m});
    }
    return levels;
}

double surface_distance(const Mesh& a, const Mesh& b, std::uint32_t samples) {
    FARFIELD_ASSERT(samples >= 1);
    return surface_distance(sample_surface(a, samples), sample_surface(b, samples));
}

Result<LodTable> add_levels_of_detail(Scene& scene, const SceneLevelOptions& options) {
    if (Result<void> valid = check_options(options.levels); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    auto levels = make_scene_levels(scene, options);
    if (!levels) {
        return tl::unexpected(std::move(levels).error());
    }
    std::vector<std::size_t> first_mesh; // of the levels of each mesh
    for (std::vector<MeshLevel>& of_mesh : *levels) {
        first_mesh.push_back(scene.meshes.size());
        for (MeshLevel& level : of_mesh) {
            scene.meshes.push_back(std::move(level.mesh));
        }
    }
    LodTable table;
    const std::size_t items = options.items.value_or(scene.instances.size());
    for (std::size_t i = 0; i < items; ++i) {
        const std::size_t mesh = index_of(scene.instances[i].mesh);
        const std::vector<MeshLevel>& of_mesh = (*levels)[mesh];
        LodItem& item = table.items.emplace_back();
        item.bounds = item_bounds(scene, make_id<ItemId>(i));
        item.primitives = primitive_count(scene.meshes[mesh]);
        item.first_level = static_cast<std::uint32_t>(table.levels.size());
        item.level_count = static_cast<std::uint32_t>(of_mesh.size());
        for (std::size_t k = 0; k < of_mesh.size(); ++k) {
            Instance instance = scene.instances[i];
            instance.mesh = make_id<MeshId>(first_mesh[mesh] + k);
            table.levels.push_back(
                {make_id<ItemId>(scene.instances.size()),
                 error_in_world(of_mesh[k].error_m, instance),
                 static_cast<std::uint32_t>(primitive_count(scene.meshes[first_mesh[mesh] + k]))}
            );
            scene.instances.push_back(instance);
        }
    }
    return table;
}

} // namespace farfield::io
