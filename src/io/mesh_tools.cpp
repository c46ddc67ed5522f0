#include <farfield/core/assert.hpp>
#include <farfield/io/mesh_tools.hpp>

#include <meshoptimizer.h>

#include <vector>

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

} // namespace farfield::io
