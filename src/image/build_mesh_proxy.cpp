#include <farfield/image/build_proxy.hpp>
#include <farfield/scene/surface_points.hpp>

#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

namespace farfield {

namespace {

/// Points that are looked for at once.
constexpr std::size_t kBatch = 1024;

tl::unexpected<Error> bad(const Mesh& mesh, const std::string& why) {
    return fail(ErrorCode::invalid_argument, "proxy of meshes: mesh \"" + mesh.name + "\" " + why);
}

std::vector<SurfacePoint>
find(const SurfaceFinder& finder, std::span<const glm::vec3> points, Executor& executor) {
    std::vector<SurfacePoint> found(points.size());
    executor.run((points.size() + kBatch - 1) / kBatch, [&](std::size_t batch) {
        const std::size_t first = batch * kBatch;
        const std::size_t count = std::min(kBatch, points.size() - first);
        finder.find(points.subspan(first, count), std::span(found).subspan(first, count));
    });
    return found;
}

/// Vertices that a triangle has, in order.
std::vector<glm::vec3> used_positions(const Mesh& mesh) {
    std::vector<bool> used(mesh.positions.size(), false);
    for (const std::uint32_t index : mesh.indices) {
        used[index] = true;
    }
    std::vector<glm::vec3> positions;
    for (std::size_t i = 0; i < used.size(); ++i) {
        if (used[i]) {
            positions.push_back(mesh.positions[i]);
        }
    }
    return positions;
}

/// Points of a mesh in the world.
class Placed {
  public:
    Placed(const glm::dmat4x3& object_to_world, const glm::dvec3& mesh_origin)
        : object_to_world_(object_to_world), mesh_origin_(mesh_origin) {}

    [[nodiscard]] glm::dvec3 operator()(const glm::vec3& point) const {
        return object_to_world_ * glm::dvec4(mesh_origin_ + glm::dvec3(point), 1.0);
    }

  private:
    glm::dmat4x3 object_to_world_;
    glm::dvec3 mesh_origin_;
};

/// The facets of a coarse mesh. [m] Relative to the pair's origin.
Result<void> add_facets(const Mesh& coarse, const Placed& placed, ProxyPair& pair) {
    for (std::size_t i = 0; i < coarse.indices.size(); i += 3) {
        const auto corner = [&](std::size_t k) {
            return placed(coarse.positions[coarse.indices[i + k]]) - pair.origin;
        };
        const glm::dvec3 a = corner(0);
        const glm::dvec3 across = glm::cross(corner(1) - a, corner(2) - a);
        const double area = glm::length(across);
        const glm::dvec3 normal = across / area;
        if (!(area > 0.0) || !std::isfinite(glm::dot(normal, normal))) {
            return bad(coarse, "has a triangle without area: " + std::to_string(i / 3));
        }
        ProxyFacet& facet = pair.facets.emplace_back();
        facet.normal = glm::vec3(normal);
        facet.plane = static_cast<float>(glm::dot(glm::dvec3(facet.normal), a));
    }
    return {};
}

} // namespace

Result<ProxyPair>
build_mesh_proxy(const MeshProxyInput& input, const ProxyItems& items, Executor& executor) {
    for (const Mesh* mesh : {&input.fine, &input.coarse}) {
        if (mesh->indices.empty()) {
            return bad(*mesh, "has no triangles");
        }
    }
    if (items.fine == kNone<ItemId> || items.coarse == kNone<ItemId> ||
        items.fine == items.coarse) {
        return bad(input.coarse, "is of no item, or of that of the fine model");
    }
    if (input.fine.origin != input.coarse.origin) {
        return bad(input.coarse, "has another origin than the fine one");
    }
    const Placed placed(input.object_to_world, input.fine.origin);
    ProxyPair pair;
    pair.fine = items.fine;
    pair.coarse = items.coarse;
    pair.origin = center(placed_bounds(input.fine.bounds, input.object_to_world));
    if (Result<void> added = add_facets(input.coarse, placed, pair); !added) {
        return tl::unexpected(std::move(added).error());
    }
    const std::vector<glm::vec3> fine = used_positions(input.fine);
    const std::vector<SurfacePoint> on_coarse = find(input.on_coarse, fine, executor);
    double farthest = 0.0;
    double sum_sq = 0.0;
    for (std::size_t i = 0; i < fine.size(); ++i) {
        const glm::dvec3 point = placed(fine[i]);
        const double distance = glm::distance(point, placed(on_coarse[i].point));
        farthest = std::max(farthest, distance);
        sum_sq += distance * distance;
        pair.samples.push_back({local_point(point, pair.origin), on_coarse[i].triangle});
        const float height = height_over(pair.facets[on_coarse[i].triangle], pair.samples[i].point);
        pair.offset_m = std::max(pair.offset_m, std::abs(height));
    }
    std::vector<glm::vec3> coarse = used_positions(input.coarse);
    const std::vector<glm::vec3> between =
        points_of_surface(input.coarse, static_cast<std::uint32_t>(fine.size()));
    coarse.insert(coarse.end(), between.begin(), between.end());
    const std::vector<SurfacePoint> on_fine = find(input.on_fine, coarse, executor);
    for (std::size_t i = 0; i < coarse.size(); ++i) {
        farthest = std::max(farthest, glm::distance(placed(coarse[i]), placed(on_fine[i].point)));
    }
    pair.offset_m = std::max(
        pair.offset_m,
        std::nextafter(static_cast<float>(farthest), std::numeric_limits<float>::infinity())
    );
    build_proxy_nodes(pair);
    pair.quality.facets = static_cast<std::uint32_t>(pair.facets.size());
    pair.quality.samples = static_cast<std::uint32_t>(pair.samples.size());
    pair.quality.rms_m = std::sqrt(sum_sq / static_cast<double>(fine.size()));
    pair.quality.hausdorff_m = farthest;
    return pair;
}

} // namespace farfield
