#include "plant_site.hpp"

#include "plant_layout.hpp"
#include "quarter_turn.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

namespace farfield::scenes::plant {

namespace {

using glm::dvec2;
using glm::dvec3;

MeshId add_mesh(Scene& scene, Solids& solids, const char* name, bool splittable) {
    Mesh mesh = solids.finish(name, splittable);
    io::optimize_for_drawing(mesh);
    scene.meshes.push_back(std::move(mesh));
    return make_id<MeshId>(scene.meshes.size() - 1);
}

/// Sheet metal folded along its height, between two corners of a building seen from outside
/// from left to right, from one height to another.
void add_cladding(
    Solids& solids, const dvec2& from, const dvec2& to, double low, double high, const dvec3& color
) {
    constexpr double kFold = 0.6;
    const dvec2 way = to - from;
    const double length = glm::length(way);
    const dvec2 along = way / length;
    const dvec3 out(-along.y, 0.0, along.x);
    const int folds = std::max(static_cast<int>(std::lround(length / kFold)), 1);
    const double width = length / folds;
    const dvec3 step(along.x * width, 0.0, along.y * width);
    // Across a fold: in, slope out, out, slope in.
    constexpr std::array<dvec2, 5> kProfile = {
        {{0.0, 0.0}, {0.4, 0.0}, {0.5, 0.06}, {0.9, 0.06}, {1.0, 0.0}}};
    for (int fold = 0; fold < folds; ++fold) {
        const dvec3 foot = dvec3(from.x, low, from.y) + step * static_cast<double>(fold);
        for (std::size_t i = 0; i + 1 < kProfile.size(); ++i) {
            const dvec3 left = foot + step * kProfile.at(i).x + out * kProfile.at(i).y;
            const dvec3 right = foot + step * kProfile.at(i + 1).x + out * kProfile.at(i + 1).y;
            solids.add_sheet(left, right - left, kUp * (high - low), color, kStorey);
        }
    }
}

} // namespace

void Site::add_whole(Solids& solids, const char* name) {
    scene.instances.push_back({add_mesh(scene, solids, name, true)});
}

MeshId Site::add_part(Solids solids, const char* name) {
    return add_mesh(scene, solids, name, false);
}

void Site::place(MeshId mesh, const dvec3& at, std::uint64_t turns) {
    scene.instances.push_back({mesh, quarter_turned(turns, 1.0, at)});
}

void Site::fill(
    const PipeLayer& pipes,
    const dvec3& corner,
    const glm::ivec3& nodes,
    double spacing,
    int triangles
) {
    PipeLattice lattice{corner, spacing, nodes, {}};
    lattice.taken.assign(
        static_cast<std::size_t>(nodes.x) * static_cast<std::size_t>(nodes.y) *
            static_cast<std::size_t>(nodes.z),
        false
    );
    pipes.lay(scene, lattice, triangles, random);
}

dvec3 Site::shade(const dvec3& color, double by) noexcept {
    return color * random.between(1.0 - by, 1.0 + by);
}

void add_walls(Solids& solids, const Area& area, double top, double south, const dvec3& color) {
    add_cladding(solids, {area.lo.x, area.hi.y}, area.hi, south, top, color);
    add_cladding(solids, area.hi, {area.hi.x, area.lo.y}, 0.0, top, color * 0.97);
    add_cladding(solids, {area.hi.x, area.lo.y}, area.lo, 0.0, top, color * 0.95);
    add_cladding(solids, area.lo, {area.lo.x, area.hi.y}, 0.0, top, color * 0.97);
}

void add_bundle(Site& site, const dvec3& foot) {
    constexpr double kWidth = 6.6;
    for (int i = 0; i < site.panels; ++i) {
        const double z = kWidth * ((i + 0.5) / site.panels - 0.5);
        site.place(site.panel, foot + dvec3(0.0, 0.0, z));
    }
}

} // namespace farfield::scenes::plant
