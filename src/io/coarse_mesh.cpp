#include <farfield/core/assert.hpp>
#include <farfield/io/coarse_mesh.hpp>
#include <farfield/io/mesh_tools.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModHausdorffT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

// Takes for granted what the others include.
#include <OpenMesh/Core/Geometry/QuadricT.hh>

namespace farfield::io {

namespace {

constexpr std::uint32_t kNone32 = UINT32_MAX;
/// How much a rim or a seam weighs against the surface.
constexpr double kRimWeight = 5.0;

/// Doubled area over the longest edge squared, which is the height over the edge: thinner triangles
/// than this are not made of thicker ones, since their normals are no longer to be trusted.
constexpr double kThinnest = 1e-3;

struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
    VertexAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::Status);
    FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};
using Surface = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Quadric = OpenMesh::Geometry::QuadricT<double>;

/// Keeps OpenMesh from printing what it has against surfaces.
class Quiet {
  public:
    Quiet() : enabled_(omerr().is_enabled()) { omerr().disable(); }
    Quiet(const Quiet&) = delete;
    Quiet& operator=(const Quiet&) = delete;
    ~Quiet() {
        if (enabled_) {
            omerr().enable();
        }
    }

  private:
    bool enabled_;
};

/// A corner of a triangle of the surface. Vertices of the mesh that differ in their normals alone
/// look alike; others at the same place make a seam.
struct Corner {
    Surface::VertexHandle vertex;
    std::uint32_t look = 0;
};

/// A mesh as a surface whose vertices know each other, and what it looks like.
struct Model {
    Surface surface;
    std::vector<std::array<Corner, 3>> corners;    ///< by face
    std::vector<std::uint32_t> parts;              ///< by face
    std::vector<std::vector<std::uint32_t>> looks; ///< vertices of the mesh, by look
    double unit_m = 1.0;                           ///< of the surface's coordinates
};

/// Numbers for keys that are equal: sorts indices 0 to count - 1 and counts how often the key
/// changes.
template <typename Key>
std::vector<std::uint32_t> numbers_of(std::size_t count, const Key& key) {
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return key(a) < key(b);
    });
    std::vector<std::uint32_t> numbers(count);
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < count; ++i) {
        if (i > 0 && key(order[i - 1]) != key(order[i])) {
            ++number;
        }
        numbers[order[i]] = number;
    }
    return numbers;
}

/// By vertex of the mesh: the place that it has in common with others.
std::vector<std::uint32_t> places_of(const Mesh& mesh) {
    return numbers_of(mesh.positions.size(), [&](std::uint32_t i) {
        const glm::vec3 p = mesh.positions[i] + 0.0F; // -0 is 0
        return std::tuple(p.x, p.y, p.z);
    });
}

/// By corner of the mesh: what it looks like, its place included.
std::vector<std::uint32_t> looks_of(
    const Mesh& mesh,
    const std::vector<std::uint32_t>& places,
    const std::vector<std::uint32_t>& part_of
) {
    return numbers_of(mesh.indices.size(), [&](std::uint32_t corner) {
        const std::uint32_t vertex = mesh.indices[corner];
        const glm::vec2 texcoord =
            mesh.texcoords.empty() ? glm::vec2(0.0F) : mesh.texcoords[vertex] + 0.0F;
        const glm::u8vec4 color = mesh.colors.empty() ? glm::u8vec4(0) : mesh.colors[vertex];
        return std::tuple(
            places[vertex],
            part_of[corner / 3],
            texcoord.x,
            texcoord.y,
            color.r,
            color.g,
            color.b,
            color.a
        );
    });
}

/// Corners of triangles, joined into those of one vertex step by step.
class JoinedCorners {
  public:
    explicit JoinedCorners(std::size_t count) : next_(count) {
        std::iota(next_.begin(), next_.end(), 0U);
    }

    /// The lowest corner that one is joined with.
    [[nodiscard]] std::uint32_t first(std::uint32_t corner) {
        while (next_[corner] != corner) {
            next_[corner] = next_[next_[corner]];
            corner = next_[corner];
        }
        return corner;
    }

    void join(std::uint32_t a, std::uint32_t b) {
        const auto [low, high] = std::minmax({first(a), first(b)});
        next_[high] = low;
    }

  private:
    std::vector<std::uint32_t> next_; ///< lower, or itself
};

/// Makes a surface of the triangles of a mesh. They are joined along edges that two of them have,
/// in opposite directions, and nowhere else.
class SurfaceMaker {
  public:
    SurfaceMaker(const Mesh& mesh, Model& model, double scale)
        : mesh_(&mesh), model_(&model), center_(center(mesh.bounds) - mesh.origin), scale_(scale),
          places_(places_of(mesh)) {}

    void add_all() {
        std::vector<std::uint32_t> part_of(mesh_->indices.size() / 3);
        for (std::uint32_t p = 0; p < mesh_->parts.size(); ++p) {
            const MeshPart& part = mesh_->parts[p];
            const auto first = part_of.begin() + part.first_index / 3;
            std::fill(first, first + part.index_count / 3, p);
        }
        const std::vector<std::uint32_t> looks = looks_of(*mesh_, places_, part_of);
        for (std::size_t i = 0; i < looks.size(); ++i) {
            if (looks[i] >= model_->looks.size()) {
                model_->looks.resize(looks[i] + std::size_t{1});
            }
            model_->looks[looks[i]].push_back(mesh_->indices[i]);
        }
        for (std::vector<std::uint32_t>& vertices : model_->looks) {
            std::sort(vertices.begin(), vertices.end());
            vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
        }
        const std::vector<std::uint32_t> kept = distinct_triangles();
        JoinedCorners joined = join(kept);
        std::vector<Surface::VertexHandle> vertices(mesh_->indices.size());
        for (const std::uint32_t triangle : kept) {
            std::array<Surface::VertexHandle, 3> corners;
            for (std::uint32_t k = 0; k < 3; ++k) {
                Surface::VertexHandle& vertex = vertices[joined.first(triangle * 3 + k)];
                if (!vertex.is_valid()) {
                    vertex = new_vertex(triangle, k);
                }
                corners[k] = vertex;
            }
            add(triangle, corners, looks, part_of[triangle]);
        }
    }

  private:
    /// Triangles with an area, one of each three corners, in order.
    [[nodiscard]] std::vector<std::uint32_t> distinct_triangles() const {
        std::vector<std::uint32_t> candidates;
        std::vector<std::array<std::uint32_t, 3>> corners(mesh_->indices.size() / 3);
        for (std::uint32_t t = 0; t < corners.size(); ++t) {
            const glm::dvec3 a = at(t, 0);
            if (glm::length(glm::cross(at(t, 1) - a, at(t, 2) - a)) > 0.0) {
                candidates.push_back(t);
            }
            for (std::uint32_t k = 0; k < 3; ++k) {
                corners[t][k] = place_of(t * 3 + k);
            }
            std::sort(corners[t].begin(), corners[t].end());
        }
        std::sort(candidates.begin(), candidates.end(), [&](std::uint32_t a, std::uint32_t b) {
            return std::tie(corners[a], a) < std::tie(corners[b], b);
        });
        const auto same = [&](std::uint32_t a, std::uint32_t b) {
            return corners[a] == corners[b];
        };
        candidates.erase(std::unique(candidates.begin(), candidates.end(), same), candidates.end());
        std::sort(candidates.begin(), candidates.end());
        return candidates;
    }

    [[nodiscard]] JoinedCorners join(const std::vector<std::uint32_t>& triangles) const {
        // Edges by their places, the lower one first; the corner that an edge starts at tells the
        // direction.
        struct Edge {
            std::uint32_t low, high, corner;
        };
        std::vector<Edge> edges;
        edges.reserve(triangles.size() * 3);
        for (const std::uint32_t triangle : triangles) {
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint32_t corner = triangle * 3 + k;
                const auto [low, high] = std::minmax({place_of(corner), place_of(after(corner))});
                edges.push_back({low, high, corner});
            }
        }
        std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
            return std::tie(a.low, a.high, a.corner) < std::tie(b.low, b.high, b.corner);
        });
        JoinedCorners joined(mesh_->indices.size());
        for (std::size_t i = 0; i < edges.size();) {
            std::size_t end = i + 1;
            while (end < edges.size() && edges[end].low == edges[i].low &&
                   edges[end].high == edges[i].high) {
                ++end;
            }
            const std::uint32_t a = edges[i].corner;
            const std::uint32_t b = edges[end - 1].corner;
            if (end - i == 2 && place_of(a) != place_of(b)) {
                joined.join(a, after(b));
                joined.join(after(a), b);
            }
            i = end;
        }
        return joined;
    }

    [[nodiscard]] static std::uint32_t after(std::uint32_t corner) {
        return corner % 3 == 2 ? corner - 2 : corner + 1;
    }

    [[nodiscard]] std::uint32_t place_of(std::uint32_t corner) const {
        return places_[mesh_->indices[corner]];
    }

    [[nodiscard]] glm::dvec3 at(std::uint32_t triangle, std::size_t corner) const {
        const std::uint32_t vertex = mesh_->indices[std::size_t{triangle} * 3 + corner];
        return (glm::dvec3(mesh_->positions[vertex]) - center_) * scale_;
    }

    Surface::VertexHandle new_vertex(std::uint32_t triangle, std::size_t corner) {
        const glm::dvec3 p = at(triangle, corner);
        return Surface::VertexHandle(model_->surface.add_vertex({p.x, p.y, p.z}).idx());
    }

    void
    add(std::uint32_t triangle,
        std::array<Surface::VertexHandle, 3> vertices,
        const std::vector<std::uint32_t>& looks,
        std::uint32_t part) {
        auto face = model_->surface.add_face(vertices.data(), vertices.size());
        if (!face.is_valid()) {
            // Joined around both ends of an edge that is not joined itself: it stands alone.
            for (std::size_t k = 0; k < 3; ++k) {
                vertices[k] = new_vertex(triangle, k);
            }
            face = model_->surface.add_face(vertices.data(), vertices.size());
        }
        FARFIELD_ASSERT(face.is_valid()); // three new vertices are a face
        std::array<Corner, 3>& corners = model_->corners.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k] = {vertices[k], looks[std::size_t{triangle} * 3 + k]};
        }
        model_->parts.push_back(part);
    }

    const Mesh* mesh_;
    Model* model_;
    glm::dvec3 center_;
    double scale_;
    std::vector<std::uint32_t> places_;
};

/// Says what collapsing an edge costs, and forbids what would move a seam; keeps track of looks.
template <typename MeshT>
class Coarsening : public OpenMesh::Decimater::ModBaseT<MeshT> {
  public:
    DECIMATING_MODULE(Coarsening, MeshT, Coarsening);

    explicit Coarsening(MeshT& mesh) : Base(mesh, false) {}

    void follow(Model& model) { model_ = &model; }

    void initialize() override {
        Surface& surface = model_->surface;
        quadrics_.assign(surface.n_vertices(), Quadric(0.0, 0.0, 0.0, 0.0));
        for (const auto face : surface.faces()) {
            const std::array<Corner, 3>& corners = model_->corners[index(face)];
            std::array<Surface::Point, 3> points;
            for (std::size_t k = 0; k < 3; ++k) {
                points[k] = surface.point(corners[k].vertex);
            }
            Surface::Point normal = (points[1] - points[0]) % (points[2] - points[0]);
            const double doubled = normal.norm();
            if (!(doubled > 0.0)) {
                continue;
            }
            normal /= doubled;
            add_plane(corners, points[0], normal, doubled / 2.0);
            for (const auto halfedge : surface.fh_range(face)) {
                if (is_rim(halfedge)) {
                    const Surface::Point& from =
                        surface.point(surface.from_vertex_handle(halfedge));
                    const Surface::Point& to = surface.point(surface.to_vertex_handle(halfedge));
                    const Surface::Point edge = to - from;
                    const double length = edge.norm();
                    const Surface::Point across = (edge % normal) / length;
                    Quadric quadric(across, from);
                    quadric *= kRimWeight * length * length;
                    quadrics_[index(surface.from_vertex_handle(halfedge))] += quadric;
                    quadrics_[index(surface.to_vertex_handle(halfedge))] += quadric;
                }
            }
        }
    }

    float collapse_priority(const CollapseInfo& info) override {
        std::array<Change, 2> changes;
        if (!find_changes(info, changes) || makes_thin(info)) {
            return static_cast<float>(Base::ILLEGAL_COLLAPSE);
        }
        Quadric quadric = quadrics_[index(info.v0)];
        quadric += quadrics_[index(info.v1)];
        // Rounding may leave a little less than nothing.
        return static_cast<float>(std::max(quadric(info.p1), 0.0));
    }

    void preprocess_collapse(const CollapseInfo& info) override {
        std::array<Change, 2> changes;
        static_cast<void>(find_changes(info, changes));
        for (const auto face : model_->surface.vf_range(info.v0)) {
            for (Corner& corner : model_->corners[index(face)]) {
                if (corner.vertex == info.v0 && face != info.fl && face != info.fr) {
                    const std::uint32_t look = corner.look;
                    corner = {info.v1, changes[changes[0].from == look ? 0 : 1].to};
                }
            }
        }
        quadrics_[index(info.v1)] += quadrics_[index(info.v0)];
    }

  private:
    /// What a corner that moves from one end of an edge to the other turns into.
    struct Change {
        std::uint32_t from = kNone32;
        std::uint32_t to = kNone32;
    };

    template <typename Handle>
    static std::size_t index(Handle handle) {
        return static_cast<std::size_t>(handle.idx());
    }

    void add_plane(
        const std::array<Corner, 3>& corners,
        const Surface::Point& point,
        const Surface::Point& normal,
        double weight
    ) {
        Quadric quadric(normal, point);
        quadric *= weight;
        for (const Corner& corner : corners) {
            quadrics_[index(corner.vertex)] += quadric;
        }
    }

    [[nodiscard]] std::uint32_t
    look_at(Surface::FaceHandle face, Surface::VertexHandle vertex) const {
        for (const Corner& corner : model_->corners[index(face)]) {
            if (corner.vertex == vertex) {
                return corner.look;
            }
        }
        return kNone32;
    }

    /// Whether nothing lies on the other side of an edge, or something that looks different.
    [[nodiscard]] bool is_rim(Surface::HalfedgeHandle halfedge) const {
        const Surface& surface = model_->surface;
        const Surface::FaceHandle face = surface.face_handle(halfedge);
        const Surface::FaceHandle other =
            surface.face_handle(surface.opposite_halfedge_handle(halfedge));
        const Surface::VertexHandle from = surface.from_vertex_handle(halfedge);
        const Surface::VertexHandle to = surface.to_vertex_handle(halfedge);
        return !other.is_valid() || look_at(face, from) != look_at(other, from) ||
               look_at(face, to) != look_at(other, to);
    }

    /// Height of a triangle over its longest edge, relative to that edge.
    [[nodiscard]] static double
    thickness(const Surface::Point& a, const Surface::Point& b, const Surface::Point& c) {
        const double longest_sq =
            std::max({(b - a).sqrnorm(), (c - b).sqrnorm(), (a - c).sqrnorm()});
        return longest_sq > 0.0 ? ((b - a) % (c - a)).norm() / longest_sq : 0.0;
    }

    [[nodiscard]] bool makes_thin(const CollapseInfo& info) const {
        const Surface& surface = model_->surface;
        for (const auto face : surface.vf_range(info.v0)) {
            if (face == info.fl || face == info.fr) {
                continue;
            }
            std::array<Surface::Point, 3> before;
            std::array<Surface::Point, 3> after;
            for (std::size_t k = 0; k < 3; ++k) {
                const Surface::VertexHandle vertex = model_->corners[index(face)][k].vertex;
                before[k] = surface.point(vertex);
                after[k] = vertex == info.v0 ? info.p1 : before[k];
            }
            const double left = thickness(after[0], after[1], after[2]);
            if (left < kThinnest && left < thickness(before[0], before[1], before[2])) {
                return true;
            }
        }
        return false;
    }

    /// What looks turn into, as the faces beside the edge tell.
    /// @return false where a look would have none, or two, to turn into
    [[nodiscard]] bool
    find_changes(const CollapseInfo& info, std::array<Change, 2>& changes) const {
        const std::array<Surface::FaceHandle, 2> beside = {info.fl, info.fr};
        for (std::size_t k = 0; k < 2; ++k) {
            if (beside[k].is_valid()) {
                changes[k] = {look_at(beside[k], info.v0), look_at(beside[k], info.v1)};
            }
        }
        if (changes[0].from == changes[1].from && changes[0].to != changes[1].to) {
            return false;
        }
        for (const auto face : model_->surface.vf_range(info.v0)) {
            const std::uint32_t look = look_at(face, info.v0);
            if (look != changes[0].from && look != changes[1].from) {
                return false;
            }
        }
        return true;
    }

    Model* model_ = nullptr;
    std::vector<Quadric> quadrics_;
};

/// What is left of the surface, with vertices of the original.
Mesh mesh_of(const Model& model, const Mesh& fine) {
    Mesh coarse;
    coarse.name = fine.name + ", coarse";
    coarse.origin = fine.origin;
    coarse.positions = fine.positions;
    coarse.normals = fine.normals;
    coarse.colors = fine.colors;
    coarse.texcoords = fine.texcoords;
    std::vector<std::vector<std::uint32_t>> indices(fine.parts.size());
    for (const auto face : model.surface.faces()) { // those that are not deleted
        const auto number = static_cast<std::size_t>(face.idx());
        std::array<glm::dvec3, 3> points{};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t look = model.corners[number][k].look;
            points[k] = fine.positions[model.looks[look].front()];
        }
        const glm::dvec3 normal = glm::cross(points[1] - points[0], points[2] - points[0]);
        if (!(glm::length(normal) > 0.0)) {
            continue;
        }
        for (std::size_t k = 0; k < 3; ++k) {
            // Of those that look alike, the one that faces as the triangle does.
            const std::vector<std::uint32_t>& alike = model.looks[model.corners[number][k].look];
            std::uint32_t best = alike.front();
            for (const std::uint32_t vertex : alike) {
                if (glm::dot(glm::dvec3(fine.normals[vertex]), normal) >
                    glm::dot(glm::dvec3(fine.normals[best]), normal)) {
                    best = vertex;
                }
            }
            indices[model.parts[number]].push_back(best);
        }
    }
    for (std::size_t p = 0; p < indices.size(); ++p) {
        if (!indices[p].empty()) {
            coarse.parts.push_back(
                {static_cast<std::uint32_t>(coarse.indices.size()),
                 static_cast<std::uint32_t>(indices[p].size()),
                 fine.parts[p].material}
            );
            coarse.indices.insert(coarse.indices.end(), indices[p].begin(), indices[p].end());
        }
    }
    optimize_for_drawing(coarse);
    return coarse;
}

tl::unexpected<Error> bad(ErrorCode code, const Mesh& mesh, const std::string& why) {
    return fail(code, "coarse model of mesh \"" + mesh.name + "\": " + why);
}

} // namespace

Result<Mesh> make_coarse_mesh(const Mesh& fine, const CoarseMeshOptions& options) {
    if (options.triangles < 1) {
        return bad(ErrorCode::invalid_argument, fine, "triangles is 0, expected 1 or more");
    }
    if (!(options.error_m >= 0.0) || !std::isfinite(options.error_m)) {
        return bad(
            ErrorCode::invalid_argument,
            fine,
            "error_m is " + std::to_string(options.error_m) + ", expected 0 or more"
        );
    }
    const glm::dvec3 size = is_empty(fine.bounds) ? glm::dvec3(0.0) : extent(fine.bounds);
    const double largest = std::max({size.x, size.y, size.z});
    if (!(largest > 0.0)) {
        return bad(ErrorCode::bad_data, fine, "no triangle has an area");
    }
    const Quiet quiet;
    Model model;
    model.unit_m = largest;
    SurfaceMaker(fine, model, 1.0 / largest).add_all();
    if (model.surface.n_faces() == 0) {
        return bad(ErrorCode::bad_data, fine, "no triangle has an area");
    }
    model.surface.update_face_normals();
    {
        OpenMesh::Decimater::DecimaterT<Surface> decimater(model.surface);
        Coarsening<Surface>::Handle coarsening;
        OpenMesh::Decimater::ModNormalFlippingT<Surface>::Handle flipping;
        decimater.add(coarsening);
        decimater.add(flipping);
        decimater.module(coarsening).follow(model);
        if (options.error_m > 0.0) {
            OpenMesh::Decimater::ModHausdorffT<Surface>::Handle distance;
            decimater.add(distance);
            decimater.module(distance).set_tolerance(options.error_m / model.unit_m);
        }
        if (decimater.initialize()) {
            decimater.decimate_to_faces(0, options.triangles);
        }
    }
    Mesh coarse = mesh_of(model, fine);
    if (coarse.indices.empty()) {
        return bad(ErrorCode::bad_data, fine, "no triangle with an area is left");
    }
    return coarse;
}

} // namespace farfield::io
