#include "image/height_fields.hpp"
#include "support/thread_executor.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/image/build_proxy.hpp>
#include <farfield/math/closest_point.hpp>
#include <farfield/scene/surface_points.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using farfield::support::mesh_of;
using farfield::support::wavy_grid;

namespace {

constexpr ProxyItems kItems{ItemId{0}, ItemId{1}};

/// Looks at every triangle.
class PatientFinder final : public SurfaceFinder {
  public:
    explicit PatientFinder(const Mesh& mesh) : mesh_(&mesh) {}

    void find(std::span<const glm::vec3> points, std::span<SurfacePoint> closest)
        const noexcept override {
        for (std::size_t i = 0; i < points.size(); ++i) {
            double least = std::numeric_limits<double>::infinity();
            for (std::uint32_t triangle = 0; triangle < mesh_->indices.size() / 3; ++triangle) {
                std::array<glm::dvec3, 3> corners{};
                for (std::size_t k = 0; k < 3; ++k) {
                    corners[k] = glm::dvec3(mesh_->positions[mesh_->indices[triangle * 3 + k]]);
                }
                const glm::dvec3 from(points[i]);
                const glm::dvec3 found = closest_point(from, corners);
                const double distance = glm::distance(from, found);
                if (distance < least) {
                    least = distance;
                    closest[i] = {glm::vec3(found), triangle, static_cast<float>(distance)};
                }
            }
        }
    }

  private:
    const Mesh* mesh_;
};

Result<ProxyPair> build(
    const Mesh& fine,
    const Mesh& coarse,
    const glm::dmat4x3& placed = glm::dmat4x3(1.0),
    const ProxyItems& items = kItems
) {
    SerialExecutor executor;
    const PatientFinder on_fine(fine);
    const PatientFinder on_coarse(coarse);
    return build_mesh_proxy({fine, coarse, on_fine, on_coarse, placed}, items, executor);
}

ProxyPair
built(const Mesh& fine, const Mesh& coarse, const glm::dmat4x3& placed = glm::dmat4x3(1.0)) {
    auto pair = build(fine, coarse, placed);
    INFO((pair ? std::string() : pair.error().message));
    REQUIRE(pair.has_value());
    const Result<void> valid = validate(*pair);
    INFO((valid ? std::string() : valid.error().message));
    REQUIRE(valid.has_value());
    return std::move(*pair);
}

std::string refusal(const Result<ProxyPair>& pair) {
    return pair ? std::string("built") : pair.error().message;
}

/// One triangle in the plane of a height.
Mesh flat(float height) {
    Mesh mesh;
    mesh.name = "flat";
    mesh.positions = {{0, height, 0}, {0, height, 8}, {8, height, 0}, {9, 9, 9}};
    mesh.normals.resize(4, glm::vec3(0.0F, 1.0F, 0.0F));
    mesh.indices = {0, 1, 2};
    mesh.parts = {{0, 3}};
    update_bounds(mesh);
    return mesh;
}

} // namespace

TEST_CASE("Pairs of meshes name what they cannot be made of") {
    Mesh empty = flat(0.0F);
    empty.indices.clear();
    empty.parts.clear();
    CHECK_THAT(refusal(build(empty, flat(0.0F))), Catch::Contains("\"flat\" has no triangles"));
    CHECK_THAT(refusal(build(flat(0.0F), empty)), Catch::Contains("has no triangles"));
    Mesh thin = flat(0.0F);
    thin.indices = {0, 1, 1};
    CHECK_THAT(refusal(build(flat(0.0F), thin)), Catch::Contains("a triangle without area: 0"));
    Mesh elsewhere = flat(0.0F);
    elsewhere.origin.x = 1.0;
    CHECK_THAT(refusal(build(flat(0.0F), elsewhere)), Catch::Contains("another origin"));
    CHECK_THAT(
        refusal(build(flat(0.0F), flat(0.0F), glm::dmat4x3(1.0), {ItemId{1}, ItemId{1}})),
        Catch::Contains("of no item, or of that of the fine model")
    );
    // Flattened by its placement.
    CHECK_THAT(
        refusal(build(flat(0.0F), flat(0.0F), glm::dmat4x3(0.0))), Catch::Contains("without area")
    );
}

TEST_CASE("A mesh is no distance from itself") {
    const Mesh mesh = flat(2.0F);
    const ProxyPair pair = built(mesh, mesh);
    CHECK(pair.samples.size() == 3); // the fourth vertex is of no triangle
    CHECK(pair.facets.size() == 1);
    CHECK(pair.facets[0].normal == glm::vec3(0.0F, 1.0F, 0.0F));
    CHECK(pair.quality.hausdorff_m < 1e-6);
    CHECK(pair.offset_m < 1e-5F);
}

TEST_CASE("Distances are those of the world, both ways") {
    const ProxyPair pair = built(flat(1.5F), flat(1.0F));
    CHECK(pair.quality.hausdorff_m == Approx(0.5));
    CHECK(pair.quality.rms_m == Approx(0.5));
    CHECK(pair.offset_m == Approx(0.5F));
    CHECK(pair.nodes[0].below == Approx(0.5F));
    CHECK(pair.nodes[0].above == Approx(0.5F));
    CHECK(pair.nodes[0].cosine == Approx(1.0F));
    // Three times as large, on its side, and far away.
    glm::dmat4x3 placed(0.0);
    placed[0] = {0.0, 3.0, 0.0};
    placed[1] = {-3.0, 0.0, 0.0};
    placed[2] = {0.0, 0.0, 3.0};
    placed[3] = {1e7, 0.0, -1e7};
    const ProxyPair far = built(flat(1.5F), flat(1.0F), placed);
    CHECK(far.quality.hausdorff_m == Approx(1.5));
    CHECK(far.facets[0].normal.x == Approx(-1.0F));
    CHECK(far.nodes[0].above == Approx(1.5F));
    // A coarse model that reaches beyond the fine one is found from its own side: its outer corner
    // is as far from the slanted side as half the square is wide.
    Mesh wide = flat(0.0F);
    wide.positions[3] = {8.0F, 0.0F, 8.0F};
    wide.indices = {0, 1, 2, 1, 3, 2};
    wide.parts[0].index_count = 6;
    update_bounds(wide);
    CHECK(built(flat(0.0F), wide).quality.hausdorff_m == Approx(std::sqrt(32.0)));
}

TEST_CASE("Many vertices are shared out and matched alike by any executor") {
    const Mesh fine = mesh_of(wavy_grid(60, 40));
    const auto gridded = height_grid_of(fine);
    REQUIRE(gridded.has_value());
    const auto heights = build_grid_proxy(gridded->grid, kItems, {.squares = 6});
    REQUIRE(heights.has_value());
    const Mesh coarse = make_coarse_mesh(fine, *gridded, *heights);
    const ProxyPair pair = built(fine, coarse);
    CHECK(pair.samples.size() == 60 * 40);
    CHECK(pair.facets.size() == heights->pair.facets.size());
    // The closest point is no farther than the one below: a bound, and not far off it.
    CHECK(pair.quality.hausdorff_m <= heights->pair.quality.hausdorff_m + 1e-6);
    CHECK(pair.quality.hausdorff_m > 0.5 * heights->pair.quality.hausdorff_m);

    support::ThreadExecutor executor(4);
    const PatientFinder on_fine(fine);
    const PatientFinder on_coarse(coarse);
    const auto threaded =
        build_mesh_proxy({fine, coarse, on_fine, on_coarse, glm::dmat4x3(1.0)}, kItems, executor);
    REQUIRE(threaded.has_value());
    CHECK(*threaded == pair);
}

TEST_CASE("Coarse meshes become items beside the fine ones") {
    Scene scene;
    scene.meshes = {flat(0.0F), flat(1.0F)};
    scene.instances = {{MeshId{0}}, {MeshId{1}}, {MeshId{0}}, {MeshId{0}}};
    scene.instances[2].object_to_world[3] = {5.0, 6.0, 7.0};
    const std::vector<ProxyItems> added = add_coarse_mesh(scene, MeshId{0}, flat(0.5F), 3);
    REQUIRE(added.size() == 2); // and not the last, which is not asked about
    CHECK(scene.meshes.size() == 3);
    REQUIRE(scene.instances.size() == 6);
    CHECK(added[0].fine == ItemId{0});
    CHECK(added[0].coarse == ItemId{4});
    CHECK(added[1].fine == ItemId{2});
    CHECK(added[1].coarse == ItemId{5});
    CHECK(scene.instances[5].mesh == MeshId{2});
    CHECK(scene.instances[5].object_to_world == scene.instances[2].object_to_world);
}

TEST_CASE("Points of a surface are spread by area, the same every time") {
    CHECK(points_of_surface(Mesh{}, 10).empty());
    Mesh thin = flat(0.0F);
    thin.indices = {0, 1, 1};
    CHECK(points_of_surface(thin, 10).empty());
    // A triangle, and one of a sixteenth of its area.
    Mesh two = flat(0.0F);
    two.positions.insert(two.positions.end(), {{20, 0, 0}, {20, 0, 2}, {22, 0, 0}});
    two.normals.resize(7, glm::vec3(0.0F, 1.0F, 0.0F));
    two.indices.insert(two.indices.end(), {4, 5, 6});
    two.parts[0].index_count = 6;
    const std::vector<glm::vec3> points = points_of_surface(two, 1700);
    REQUIRE(points.size() == 1700);
    int small = 0;
    for (const glm::vec3& point : points) {
        small += point.x > 10.0F ? 1 : 0;
        const float x = point.x > 10.0F ? point.x - 20.0F : point.x;
        const float side = point.x > 10.0F ? 2.0F : 8.0F;
        CHECK(x >= 0.0F);
        CHECK(x + point.z <= side + 1e-5F);
    }
    CHECK(small == 100);
    CHECK(points == points_of_surface(two, 1700));
}
