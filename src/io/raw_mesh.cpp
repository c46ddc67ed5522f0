#include "io/raw_mesh.hpp"

#include "io/text.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace farfield::io {
namespace {

template <typename T>
void gather(std::vector<T>& array, const std::vector<std::uint32_t>& used) {
    if (array.empty()) {
        return;
    }
    for (std::size_t i = 0; i < used.size(); ++i) {
        array[i] = array[used[i]]; // used is ascending, so used[i] >= i
    }
    array.resize(used.size());
}

/// For both kinds of mesh.
template <typename AnyMesh>
void drop_unused_vertices(AnyMesh& raw) {
    constexpr std::uint32_t kUnused = UINT32_MAX;
    std::vector<std::uint32_t> renumbered(raw.positions.size(), kUnused);
    for (const std::uint32_t index : raw.indices) {
        renumbered[index] = 0;
    }
    std::vector<std::uint32_t> used;
    used.reserve(raw.positions.size());
    for (std::size_t i = 0; i < renumbered.size(); ++i) {
        if (renumbered[i] != kUnused) {
            renumbered[i] = static_cast<std::uint32_t>(used.size());
            used.push_back(static_cast<std::uint32_t>(i));
        }
    }
    if (used.size() == raw.positions.size()) {
        return;
    }
    for (std::uint32_t& index : raw.indices) {
        index = renumbered[index];
    }
    gather(raw.positions, used);
    gather(raw.normals, used);
    gather(raw.colors, used);
    gather(raw.texcoords, used);
}

} // namespace

std::uint8_t to_byte(double channel) noexcept {
    if (std::isnan(channel)) {
        return 255;
    }
    return static_cast<std::uint8_t>(std::lround(std::clamp(channel, 0.0, 1.0) * 255.0));
}

void drop_unused(Mesh& mesh) {
    drop_unused_vertices(mesh);
}

void complete_normals(Mesh& mesh) {
    bool complete = mesh.normals.size() == mesh.positions.size();
    for (glm::vec3& normal : mesh.normals) {
        // In double, where neither 1e30 nor 1e-30 leaves the range when it is squared.
        const glm::dvec3 given(normal);
        const double length = glm::length(given);
        const bool usable = std::isfinite(length) && length > 0.0;
        normal = usable ? glm::vec3(given / length) : glm::vec3(0.0F);
        complete = complete && usable;
    }
    if (complete) {
        return;
    }
    std::vector<glm::vec3> given = std::move(mesh.normals);
    compute_normals(mesh);
    for (std::size_t i = 0; i < given.size(); ++i) {
        if (given[i] != glm::vec3(0.0F)) {
            mesh.normals[i] = given[i];
        }
    }
}

Result<Mesh> finish_mesh(RawMesh raw, std::string_view file) {
    const std::string name(file);
    if (raw.indices.empty()) {
        return fail(ErrorCode::bad_data, name + ": no triangles");
    }
    if (raw.indices.size() >= UINT32_MAX || raw.positions.size() >= UINT32_MAX) {
        return fail(
            ErrorCode::unsupported,
            name + " has " + std::to_string(raw.indices.size() / 3) +
                " triangles, more indices than 32 bits count"
        );
    }
    drop_unused_vertices(raw);
    Box3d box;
    for (const glm::dvec3& position : raw.positions) {
        box = unite(box, position);
    }
    Mesh mesh;
    mesh.name = name.substr(0, name.rfind('.'));
    mesh.origin = center(box);
    mesh.positions.reserve(raw.positions.size());
    constexpr double kLargest = std::numeric_limits<float>::max();
    for (const glm::dvec3& position : raw.positions) {
        const glm::dvec3 local = position - mesh.origin;
        for (int axis = 0; axis < 3; ++axis) {
            if (!(std::abs(local[axis]) < kLargest)) {
                return fail(
                    ErrorCode::bad_data,
                    name + ": vertex coordinate " + text(position[axis]) +
                        " is too far from the others for single precision"
                );
            }
        }
        mesh.positions.emplace_back(local);
    }
    mesh.normals = std::move(raw.normals);
    mesh.colors = std::move(raw.colors);
    mesh.texcoords = std::move(raw.texcoords);
    mesh.indices = std::move(raw.indices);
    mesh.parts = std::move(raw.parts);
    if (mesh.parts.empty()) {
        mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size())});
    }
    complete_normals(mesh);
    update_bounds(mesh);
    return mesh;
}

} // namespace farfield::io
