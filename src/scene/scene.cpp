#include "core/digest.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/scene/scene.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <string>
#include <utility>

namespace farfield {
namespace {

/// Normals come from files and from sums of float products; a hundredth off unit length is not
/// visible in the shading, more is somebody's mistake.
constexpr float kNormalTolerance = 0.01F;
constexpr double kUpTolerance = 1e-6;
constexpr std::array<char, 3> kAxis = {'x', 'y', 'z'};

std::string text(double value) {
    std::array<char, 32> buffer{};
    const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
    return error == std::errc{} ? std::string(buffer.data(), end) : std::string("?");
}

std::string numbered(const char* what, std::size_t index) {
    return std::string(what) + ' ' + std::to_string(index);
}

std::string describe(const Mesh& mesh, std::size_t index) {
    std::string result = numbered("mesh", index);
    if (!mesh.name.empty()) {
        result += " (" + mesh.name + ')';
    }
    return result;
}

tl::unexpected<Error> bad(std::string message) {
    return fail(ErrorCode::bad_data, std::move(message));
}

bool in_unit_interval(float value) noexcept {
    return value >= 0.0F && value <= 1.0F; // false for NaN
}

/// Names the first coordinate that is not finite.
template <typename Vector>
Result<void> check_finite(const std::string& where, const char* what, const Vector& v) {
    for (int axis = 0; axis < Vector::length(); ++axis) {
        if (!std::isfinite(v[axis])) {
            return bad(
                where + ": " + what + '.' + kAxis[static_cast<std::size_t>(axis)] + " is " +
                text(static_cast<double>(v[axis]))
            );
        }
    }
    return {};
}

template <typename Vector>
Result<void>
check_finite(const std::string& where, const char* what, const std::vector<Vector>& all) {
    for (std::size_t i = 0; i < all.size(); ++i) {
        bool finite = true;
        for (int axis = 0; axis < Vector::length(); ++axis) {
            finite = finite && std::isfinite(all[i][axis]);
        }
        if (!finite) {
            return check_finite(where, numbered(what, i).c_str(), all[i]);
        }
    }
    return {};
}

Result<void>
check_count(const std::string& where, const char* what, std::size_t count, std::size_t positions) {
    if (count != positions) {
        return bad(
            where + " has " + std::to_string(count) + ' ' + what + " for " +
            std::to_string(positions) + " positions"
        );
    }
    return {};
}

Result<void> check_vertices(const Mesh& mesh, const std::string& where) {
    const std::size_t count = mesh.positions.size();
    if (count >= UINT32_MAX) {
        return bad(where + " has " + std::to_string(count) + " positions, more than 2^32 - 2");
    }
    if (auto checked = check_count(where, "normals", mesh.normals.size(), count); !checked) {
        return checked;
    }
    if (!mesh.colors.empty()) {
        if (auto checked = check_count(where, "colours", mesh.colors.size(), count); !checked) {
            return checked;
        }
    }
    if (!mesh.texcoords.empty()) {
        if (auto checked = check_count(where, "texcoords", mesh.texcoords.size(), count);
            !checked) {
            return checked;
        }
    }
    if (auto checked = check_finite(where, "origin", mesh.origin); !checked) {
        return checked;
    }
    if (auto checked = check_finite(where, "position", mesh.positions); !checked) {
        return checked;
    }
    if (auto checked = check_finite(where, "texcoord", mesh.texcoords); !checked) {
        return checked;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const float length_sq = glm::dot(mesh.normals[i], mesh.normals[i]);
        if (!(std::abs(length_sq - 1.0F) <= 2.0F * kNormalTolerance)) {
            return bad(
                where + ": normal " + std::to_string(i) + " has length " +
                text(std::sqrt(static_cast<double>(length_sq))) + " instead of 1"
            );
        }
    }
    if (!is_finite(mesh.bounds)) {
        return bad(where + ": bounds are not finite; update_bounds fills them");
    }
    for (std::size_t i = 0; i < count; ++i) {
        if (!contains(mesh.bounds, mesh.origin + glm::dvec3(mesh.positions[i]))) {
            return bad(where + ": position " + std::to_string(i) + " is outside the bounds");
        }
    }
    return {};
}

Result<void> check_parts(const Mesh& mesh, const std::string& where, std::size_t materials) {
    std::uint64_t next = 0;
    for (std::size_t p = 0; p < mesh.parts.size(); ++p) {
        const MeshPart& part = mesh.parts[p];
        const std::string name = where + ": part " + std::to_string(p);
        if (part.first_index != next) {
            return bad(
                name + " starts at index " + std::to_string(part.first_index) + " instead of " +
                std::to_string(next)
            );
        }
        if (part.index_count % 3 != 0) {
            return bad(
                name + " has " + std::to_string(part.index_count) + " indices, not a multiple of 3"
            );
        }
        if (part.material != kNone<MaterialId> && index_of(part.material) >= materials) {
            return bad(
                name + " has material " + std::to_string(index_of(part.material)) + " of " +
                std::to_string(materials)
            );
        }
        next += part.index_count;
    }
    if (next != mesh.indices.size()) {
        return bad(
            where + ": parts cover " + std::to_string(next) + " of " +
            std::to_string(mesh.indices.size()) + " indices"
        );
    }
    if (mesh.splittable && mesh.parts.size() != 1) {
        return bad(
            where + " is splittable and has " + std::to_string(mesh.parts.size()) +
            " parts instead of one"
        );
    }
    return {};
}

Result<void> check_mesh(const Mesh& mesh, std::size_t index, std::size_t materials) {
    const std::string where = describe(mesh, index);
    if (mesh.indices.empty()) {
        return bad(where + " has no triangles");
    }
    if (mesh.indices.size() % 3 != 0 || mesh.indices.size() > UINT32_MAX) {
        return bad(
            where + " has " + std::to_string(mesh.indices.size()) +
            " indices, not a multiple of 3 below 2^32"
        );
    }
    if (auto checked = check_vertices(mesh, where); !checked) {
        return checked;
    }
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
        if (mesh.indices[i] >= mesh.positions.size()) {
            return bad(
                where + ": index " + std::to_string(i) + " is " + std::to_string(mesh.indices[i]) +
                ", beyond the " + std::to_string(mesh.positions.size()) + " positions"
            );
        }
    }
    return check_parts(mesh, where, materials);
}

Result<void> check_texture(const Texture& texture, std::size_t index) {
    const std::string where = numbered("texture", index);
    if (texture.width < 1 || texture.height < 1) {
        return bad(
            where + " is " + std::to_string(texture.width) + " x " +
            std::to_string(texture.height) + " texels"
        );
    }
    const std::uint64_t expected = 4ULL * static_cast<std::uint64_t>(texture.width) *
                                   static_cast<std::uint64_t>(texture.height);
    if (texture.pixels.size() != expected) {
        return bad(
            where + " has " + std::to_string(texture.pixels.size()) + " bytes instead of " +
            std::to_string(expected)
        );
    }
    return {};
}

Result<void> check_material(const Material& material, std::size_t index, std::size_t textures) {
    const std::string where = numbered("material", index);
    for (int channel = 0; channel < 4; ++channel) {
        if (!in_unit_interval(material.base_color[channel])) {
            return bad(
                where + ": base_color[" + std::to_string(channel) + "] is " +
                text(static_cast<double>(material.base_color[channel])) + ", outside [0, 1]"
            );
        }
    }
    if (!in_unit_interval(material.alpha_cutoff)) {
        return bad(
            where + ": alpha_cutoff is " + text(static_cast<double>(material.alpha_cutoff)) +
            ", outside [0, 1]"
        );
    }
    if (material.texture != kNone<TextureId> && index_of(material.texture) >= textures) {
        return bad(
            where + " has texture " + std::to_string(index_of(material.texture)) + " of " +
            std::to_string(textures)
        );
    }
    return {};
}

Result<void> check_instance(const Scene& scene, std::size_t index) {
    const Instance& instance = scene.instances[index];
    const std::string where = numbered("instance", index);
    if (index_of(instance.mesh) >= scene.meshes.size()) {
        return bad(
            where + " has mesh " + std::to_string(index_of(instance.mesh)) + " of " +
            std::to_string(scene.meshes.size())
        );
    }
    return check_placement(
        make_id<ItemId>(index),
        scene.meshes[index_of(instance.mesh)].bounds,
        instance.object_to_world
    );
}

Result<void> check_surroundings(const Scene& scene) {
    if (auto checked = check_finite("light", "to_light", scene.light.to_light); !checked) {
        return checked;
    }
    if (scene.light.to_light == glm::vec3(0.0F)) {
        return bad("light: to_light is zero");
    }
    if (!in_unit_interval(scene.light.ambient)) {
        return bad(
            "light: ambient is " + text(static_cast<double>(scene.light.ambient)) +
            ", outside [0, 1]"
        );
    }
    for (int channel = 0; channel < 3; ++channel) {
        if (!in_unit_interval(scene.sky[channel])) {
            return bad(
                "sky[" + std::to_string(channel) + "] is " +
                text(static_cast<double>(scene.sky[channel])) + ", outside [0, 1]"
            );
        }
    }
    const double up_length = glm::length(scene.up);
    if (!(std::abs(up_length - 1.0) <= kUpTolerance)) {
        return bad("up has length " + text(up_length) + " instead of 1");
    }
    return {};
}

double longest_extent(const Box3d& box) noexcept {
    const glm::dvec3 size = extent(box);
    return std::max({size.x, size.y, size.z});
}

template <typename T>
std::uint64_t bytes(const std::vector<T>& array) noexcept {
    return array.size() * sizeof(T);
}

/// One part of a mesh with the vertices it uses, in order of first use. `renumbered` is as long as
/// the mesh has vertices, full of UINT32_MAX on entry and again on return.
Mesh extract_part(
    const Mesh& mesh, std::size_t part_index, std::vector<std::uint32_t>& renumbered
) {
    const MeshPart& part = mesh.parts[part_index];
    Mesh result;
    result.name = mesh.name + '[' + std::to_string(part_index) + ']';
    result.origin = mesh.origin;
    result.splittable = mesh.splittable;
    result.indices.reserve(part.index_count);
    const auto used = std::span(mesh.indices).subspan(part.first_index, part.index_count);
    for (const std::uint32_t vertex : used) {
        if (renumbered[vertex] == UINT32_MAX) {
            renumbered[vertex] = static_cast<std::uint32_t>(result.positions.size());
            result.positions.push_back(mesh.positions[vertex]);
            result.normals.push_back(mesh.normals[vertex]);
            if (!mesh.colors.empty()) {
                result.colors.push_back(mesh.colors[vertex]);
            }
            if (!mesh.texcoords.empty()) {
                result.texcoords.push_back(mesh.texcoords[vertex]);
            }
        }
        result.indices.push_back(renumbered[vertex]);
    }
    for (const std::uint32_t vertex : used) {
        renumbered[vertex] = UINT32_MAX;
    }
    result.parts.push_back({0, part.index_count, part.material});
    update_bounds(result);
    return result;
}

/// Gives every part of an instance's mesh a mesh of its own. The first keeps the ids of the mesh
/// and of the instance, the others are appended, so no other id of the scene changes.
void separate_parts(Scene& scene, std::size_t instance_index) {
    const Instance instance = scene.instances[instance_index];
    Mesh whole = std::move(scene.meshes[index_of(instance.mesh)]);
    std::erase_if(whole.parts, [](const MeshPart& part) { return part.index_count == 0; });
    if (whole.parts.size() == 1) {
        scene.meshes[index_of(instance.mesh)] = std::move(whole);
        return;
    }
    std::vector<std::uint32_t> renumbered(whole.positions.size(), UINT32_MAX);
    scene.meshes[index_of(instance.mesh)] = extract_part(whole, 0, renumbered);
    for (std::size_t part = 1; part < whole.parts.size(); ++part) {
        scene.instances.push_back({make_id<MeshId>(scene.meshes.size()), instance.object_to_world});
        scene.meshes.push_back(extract_part(whole, part, renumbered));
    }
}

} // namespace

Result<void> validate(const Scene& scene) {
    if (scene.instances.size() >= UINT32_MAX || scene.meshes.size() >= UINT32_MAX ||
        scene.materials.size() >= UINT32_MAX || scene.textures.size() >= UINT32_MAX) {
        return bad("the scene has more than 2^32 - 2 instances, meshes, materials or textures");
    }
    for (std::size_t i = 0; i < scene.textures.size(); ++i) {
        if (auto checked = check_texture(scene.textures[i], i); !checked) {
            return checked;
        }
    }
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        if (auto checked = check_material(scene.materials[i], i, scene.textures.size()); !checked) {
            return checked;
        }
    }
    for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
        if (auto checked = check_mesh(scene.meshes[i], i, scene.materials.size()); !checked) {
            return checked;
        }
    }
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        if (auto checked = check_instance(scene, i); !checked) {
            return checked;
        }
    }
    return check_surroundings(scene);
}

Box3d item_bounds(const Scene& scene, ItemId item) noexcept {
    FARFIELD_ASSERT(index_of(item) < scene.instances.size());
    const Instance& instance = scene.instances[index_of(item)];
    return placed_bounds(scene.meshes[index_of(instance.mesh)].bounds, instance.object_to_world);
}

Box3d placed_bounds(const Box3d& mesh_bounds, const glm::dmat4x3& object_to_world) noexcept {
    if (is_empty(mesh_bounds)) {
        return {}; // infinite corners times a zero of the matrix would be NaN
    }
    Box3d world{object_to_world[3], object_to_world[3]};
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 a = object_to_world[axis] * mesh_bounds.lo[axis];
        const glm::dvec3 b = object_to_world[axis] * mesh_bounds.hi[axis];
        world.lo += glm::min(a, b);
        world.hi += glm::max(a, b);
    }
    return world;
}

Result<void>
check_placement(ItemId item, const Box3d& mesh_bounds, const glm::dmat4x3& object_to_world) {
    if (is_finite(placed_bounds(mesh_bounds, object_to_world))) {
        return {}; // no column can be lost in it: whatever is not finite is summed up
    }
    const std::string where = numbered("instance", index_of(item));
    for (int column = 0; column < 4; ++column) {
        const std::string name = "column " + std::to_string(column);
        if (auto checked = check_finite(where, name.c_str(), object_to_world[column]); !checked) {
            return checked;
        }
    }
    return bad(where + ": its world box is not finite");
}

std::vector<glm::dmat4x3> item_frames(const Scene& scene) {
    std::vector<glm::dmat4x3> frames;
    frames.reserve(scene.instances.size());
    for (const Instance& instance : scene.instances) {
        glm::dmat4x3 frame = instance.object_to_world;
        frame[3] = frame * glm::dvec4(scene.meshes[index_of(instance.mesh)].origin, 1.0);
        frames.push_back(frame);
    }
    return frames;
}

Box3d scene_bounds(const Scene& scene) noexcept {
    Box3d box;
    for (std::size_t i = 0; i < scene.instances.size(); ++i) {
        box = unite(box, item_bounds(scene, make_id<ItemId>(i)));
    }
    return box;
}

std::uint64_t primitive_count(const Mesh& mesh) noexcept {
    return mesh.indices.size() / 3;
}

std::uint64_t primitive_count(const Scene& scene) noexcept {
    std::uint64_t count = 0;
    for (const Instance& instance : scene.instances) {
        count += primitive_count(scene.meshes[index_of(instance.mesh)]);
    }
    return count;
}

std::uint64_t memory_bytes(const Scene& scene) noexcept {
    std::uint64_t total = bytes(scene.instances) + bytes(scene.materials);
    for (const Mesh& mesh : scene.meshes) {
        total += sizeof(Mesh) + bytes(mesh.positions) + bytes(mesh.normals) + bytes(mesh.colors) +
                 bytes(mesh.texcoords) + bytes(mesh.indices) + bytes(mesh.parts);
    }
    for (const Texture& texture : scene.textures) {
        total += sizeof(Texture) + bytes(texture.pixels);
    }
    return total;
}

std::uint64_t digest(const Scene& scene) noexcept {
    Digest digest;
    const auto add_array = [&digest](const auto& array) {
        digest.add(std::uint64_t{array.size()});
        digest.add(std::as_bytes(std::span(array)));
    };
    digest.add(std::uint64_t{scene.meshes.size()});
    for (const Mesh& mesh : scene.meshes) {
        digest.add(mesh.origin);
        add_array(mesh.positions);
        add_array(mesh.normals);
        add_array(mesh.colors);
        add_array(mesh.texcoords);
        add_array(mesh.indices);
        add_array(mesh.parts);
        digest.add(mesh.splittable);
    }
    digest.add(std::uint64_t{scene.materials.size()});
    for (const Material& material : scene.materials) {
        for (int i = 0; i < 4; ++i) {
            digest.add(material.base_color[i]);
        }
        digest.add(material.texture);
        digest.add(material.alpha_cutoff);
    }
    digest.add(std::uint64_t{scene.textures.size()});
    for (const Texture& texture : scene.textures) {
        digest.add(std::int32_t{texture.width});
        digest.add(std::int32_t{texture.height});
        add_array(texture.pixels);
    }
    digest.add(std::uint64_t{scene.instances.size()});
    for (const Instance& instance : scene.instances) {
        digest.add(instance.mesh);
        for (int column = 0; column < 4; ++column) {
            digest.add(instance.object_to_world[column]);
        }
    }
    digest.add(scene.light.to_light);
    digest.add(scene.light.ambient);
    return digest.value();
}

void update_bounds(Mesh& mesh) noexcept {
    mesh.bounds = {};
    for (const glm::vec3& position : mesh.positions) {
        mesh.bounds = unite(mesh.bounds, mesh.origin + glm::dvec3(position));
    }
}

void compute_normals(Mesh& mesh) {
    // In double: the squared area of a triangle of 1e30 m does not fit into a float, and that of
    // one of 1e-30 m would vanish.
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0.0));
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const glm::dvec3 a(mesh.positions[mesh.indices[i]]);
        const glm::dvec3 b(mesh.positions[mesh.indices[i + 1]]);
        const glm::dvec3 c(mesh.positions[mesh.indices[i + 2]]);
        const glm::dvec3 doubled_area = glm::cross(b - a, c - a);
        for (std::size_t k = 0; k < 3; ++k) {
            sums[mesh.indices[i + k]] += doubled_area;
        }
    }
    mesh.normals.resize(mesh.positions.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const double length = glm::length(sums[i]);
        mesh.normals[i] = length > 0.0 ? glm::vec3(sums[i] / length) : glm::vec3(0.0F, 1.0F, 0.0F);
    }
}

void flag_splittable(Scene& scene, std::uint64_t min_primitives, double min_extent) {
    std::vector<std::uint32_t> uses(scene.meshes.size(), 0);
    for (const Instance& instance : scene.instances) {
        ++uses[index_of(instance.mesh)];
    }
    const double threshold = min_extent * longest_extent(scene_bounds(scene));
    const std::size_t count = scene.instances.size();
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t mesh_index = index_of(scene.instances[i].mesh);
        Mesh& mesh = scene.meshes[mesh_index];
        if (uses[mesh_index] != 1 || primitive_count(mesh) < min_primitives ||
            !(longest_extent(item_bounds(scene, make_id<ItemId>(i))) > threshold)) {
            continue;
        }
        mesh.splittable = true;
        separate_parts(scene, i);
    }
}

} // namespace farfield
