#include "support/small_scene.hpp"
#include <farfield/embree/scene_sampler.hpp>
#include <farfield/image/build_color_cubes.hpp>
#include <farfield/math/triangle_box.hpp>

#include <catch2/catch.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

std::unique_ptr<embree::SceneSampler>
make_sampler(const Scene& scene, const glm::dvec3& origin = glm::dvec3(0.0)) {
    REQUIRE(validate(scene).has_value());
    auto sampler = embree::SceneSampler::create(scene, origin);
    if (!sampler) {
        FAIL(sampler.error().message);
    }
    return std::move(*sampler);
}

SurfaceHit
cast(const SurfaceSampler& sampler, ItemId item, const SurfaceRay& ray, float spacing = 1e-3F) {
    std::array<SurfaceHit, 1> hits;
    sampler.cast(item, std::array{ray}, spacing, hits);
    return hits[0];
}

/// What a ray meets first, by trying every triangle in double.
struct Met {
    double t = 2.0;
    glm::dvec3 normal{0.0};
    glm::dvec3 color{0.0};
    double margin = 1.0; ///< how far from all rims it passes, in barycentric coordinates
};

void meet(const Scene& scene, const Instance& instance, const SurfaceRay& ray, Met& met) {
    const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
    const glm::dmat4x3& world = instance.object_to_world;
    const glm::dmat3 linear(world[0], world[1], world[2]);
    const glm::dvec3 from(ray.from);
    const glm::dvec3 along(ray.along);
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        Triangle3d corners{};
        for (std::size_t k = 0; k < 3; ++k) {
            const glm::dvec3 at(mesh.positions[mesh.indices[i + k]]);
            corners[k] = world * glm::dvec4(mesh.origin + at, 1.0);
        }
        const glm::dvec3 u_edge = corners[1] - corners[0];
        const glm::dvec3 v_edge = corners[2] - corners[0];
        const glm::dvec3 p = glm::cross(along, v_edge);
        const double determinant = glm::dot(u_edge, p);
        const glm::dvec3 s = from - corners[0];
        const double u = glm::dot(s, p) / determinant;
        const glm::dvec3 q = glm::cross(s, u_edge);
        const double v = glm::dot(along, q) / determinant;
        const double t = glm::dot(v_edge, q) / determinant;
        if (!(t > -1e-3 && t < 1.001)) {
            continue;
        }
        const double inside = std::min({u, v, 1.0 - u - v});
        met.margin = std::min({met.margin, std::abs(inside), std::abs(t), std::abs(t - 1.0)});
        // Seen from the side, the place where it is met is not certain.
        const double slope =
            std::abs(determinant) / (glm::length(glm::cross(u_edge, v_edge)) * glm::length(along));
        met.margin = std::min(met.margin, slope * 1e-2);
        if (inside < 0.0 || t < 0.0 || t > 1.0 || t >= met.t) {
            continue;
        }
        met.t = t;
        met.normal = glm::dvec3(0.0);
        met.color = glm::dvec3(0.0);
        const std::array<double, 3> weights = {1.0 - u - v, u, v};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t vertex = mesh.indices[i + k];
            met.normal += glm::dvec3(mesh.normals[vertex]) * weights[k];
            met.color += mesh.colors.empty() ? glm::dvec3(weights[k])
                                             : glm::dvec3(mesh.colors[vertex]) * weights[k] / 255.0;
        }
        met.normal = glm::normalize(linear * met.normal) * glm::length(met.normal);
        const MaterialId material = mesh.parts[0].material;
        if (material != kNone<MaterialId>) {
            met.color *= glm::dvec3(scene.materials[index_of(material)].base_color);
        }
    }
}

/// Trees and boxes of one colour each, turned every way and of all sizes.
Scene turned_scene() {
    Scene scene;
    const MaterialId brick = add_material(scene, {.base_color = {0.7F, 0.3F, 0.2F, 1.0F}});
    const MeshId tree = add_mesh(scene, tree_mesh(60), kNone<MaterialId>);
    Mesh shifted = box_mesh(glm::vec3(-1.0F), {1.0F, 2.0F, 0.5F});
    shifted.origin = {3.0, 1.0, -2.0};
    const MeshId box = add_mesh(scene, std::move(shifted), brick);
    Random random(5);
    for (int i = 0; i < 24; ++i) {
        const double scale = random.uniform(0.3, 3.0);
        glm::dmat4 world = glm::translate(glm::dmat4(1.0), random.vector(-15.0, 15.0));
        world = glm::rotate(world, random.uniform(0.0, 6.28), random.direction<double>());
        world = glm::scale(world, glm::dvec3(scale));
        scene.instances.push_back({i % 2 == 0 ? tree : box, glm::dmat4x3(world)});
    }
    return scene;
}

/// A sign of 8 x 8 texels, every other one a hole, in the plane z = 0; `scale` metres to each side.
Scene sign_scene(double scale, double yaw_rad) {
    Scene scene;
    scene.textures.push_back(checker_texture(8));
    const MaterialId sign = add_material(
        scene, {.base_color = glm::vec4(1.0F), .texture = TextureId{0}, .alpha_cutoff = 0.6F}
    );
    add_instance(scene, add_mesh(scene, quad_mesh(), sign), glm::dvec3(0.0), yaw_rad, scale);
    return scene;
}

/// Casts into the middle of each texel of a sign, from its front.
int count_met(
    const SurfaceSampler& sampler, ItemId item, double scale, double yaw_rad, float spacing
) {
    const glm::dvec3 right(std::cos(yaw_rad) * scale, 0.0, -std::sin(yaw_rad) * scale);
    const glm::dvec3 front(std::sin(yaw_rad) * scale, 0.0, std::cos(yaw_rad) * scale);
    int met = 0;
    for (int row = 0; row < 8; ++row) {
        for (int column = 0; column < 8; ++column) {
            const double x = (column + 0.5) / 4.0 - 1.0;
            const double y = 1.0 - (row + 0.5) / 4.0;
            const glm::dvec3 at = right * x + glm::dvec3(0.0, scale * y, 0.0);
            const SurfaceRay ray{glm::vec3(at + front * 0.5), glm::vec3(-front)};
            const SurfaceHit hit = cast(sampler, item, ray, spacing);
            met += hit.t <= 1.0F ? 1 : 0;
            if (hit.t <= 1.0F) {
                CHECK(hit.t == Approx(0.5F).margin(1e-4));
                CHECK((row + column) % 2 == 0); // holes are the others
                CHECK(hit.color.r == Approx(220.0 / 255.0).margin(0.5 / 255.0));
                CHECK(hit.color.g == Approx(60.0 / 255.0).margin(0.5 / 255.0));
                CHECK(glm::distance(hit.normal, glm::vec3(front / scale)) < 0.01F);
            }
        }
    }
    return met;
}

} // namespace

TEST_CASE("Rays of the world meet what every triangle tried one by one says") {
    const Scene scene = turned_scene();
    for (const glm::dvec3& offset : {glm::dvec3(0.0), glm::dvec3(8388608.0, 0.0, -4194304.0)}) {
        Scene moved = scene;
        for (Instance& instance : moved.instances) {
            instance.object_to_world[3] += offset;
        }
        const auto sampler = make_sampler(moved, offset);
        CHECK(sampler->origin() == offset);
        Random random(6);
        int compared = 0;
        int met_count = 0;
        for (int run = 0; run < 6000; ++run) {
            const SurfaceRay ray{
                random.vector(-25.0F, 25.0F),
                random.direction<float>() * random.uniform(1.0F, 60.0F)};
            Met met;
            for (const Instance& instance : scene.instances) {
                meet(scene, instance, ray, met);
            }
            if (met.margin < 1e-4) { // too near a rim to say
                continue;
            }
            ++compared;
            const SurfaceHit hit = cast(*sampler, kNone<ItemId>, ray);
            INFO("run " << run << ", t " << met.t << " and " << hit.t);
            REQUIRE((hit.t <= 1.0F) == (met.t <= 1.0));
            if (met.t > 1.0) {
                continue;
            }
            ++met_count;
            // Ten lengths are cast before the ray begins: floats of 11 have steps of 1e-6, and
            // triangles are met at slopes of down to 1e-2.
            CHECK(std::abs(static_cast<double>(hit.t) - met.t) < 1e-4);
            // Normals are kept in 10 bits a component; corners are some 1e-4 of a triangle off.
            CHECK(glm::distance(glm::dvec3(hit.normal), met.normal) < 0.01);
            CHECK(glm::distance(glm::dvec3(hit.color), met.color) < 0.01);
        }
        CHECK(compared > 3000);
        CHECK(met_count > 300);
    }
}

TEST_CASE("Rays of an item are in its own frame and meet nothing else") {
    const Scene scene = turned_scene();
    const auto sampler = make_sampler(scene);
    Random random(7);
    int met_count = 0;
    for (int run = 0; run < 8000; ++run) {
        const std::size_t item = random.below(24);
        Instance alone = scene.instances[item];
        // As if the origin of its mesh were that of the world.
        alone.object_to_world = glm::dmat4x3(1.0);
        alone.object_to_world[3] = -scene.meshes[index_of(alone.mesh)].origin;
        const SurfaceRay ray{
            random.vector(-4.0F, 5.0F), random.direction<float>() * random.uniform(1.0F, 10.0F)};
        Met met;
        meet(scene, alone, ray, met);
        if (met.margin < 1e-4) {
            continue;
        }
        const SurfaceHit hit = cast(*sampler, make_id<ItemId>(item), ray);
        INFO("run " << run << ", t " << met.t << " and " << hit.t);
        REQUIRE((hit.t <= 1.0F) == (met.t <= 1.0));
        if (met.t <= 1.0) {
            ++met_count;
            CHECK(std::abs(static_cast<double>(hit.t) - met.t) < 1e-4);
            CHECK(glm::distance(glm::dvec3(hit.normal), met.normal) < 0.01);
            CHECK(glm::distance(glm::dvec3(hit.color), met.color) < 0.01);
        }
    }
    CHECK(met_count > 200);
}

TEST_CASE("Holes are holes, in items of any size and turn") {
    for (const double scale : {1.0, 0.02, 50.0}) {
        for (const double yaw : {0.0, 0.7, 2.5}) {
            const Scene scene = sign_scene(scale, yaw);
            const auto sampler = make_sampler(scene);
            INFO("scale " << scale << ", yaw " << yaw);
            // Rays a quarter of a texel apart.
            const auto spacing = static_cast<float>(scale / 16.0);
            CHECK(count_met(*sampler, kNone<ItemId>, scale, yaw, spacing) == 32);
            CHECK(count_met(*sampler, ItemId{0}, 1.0, 0.0, 1.0F / 16.0F) == 32);
            // Half of the texels are there: with rays that stand for many of them, too little for
            // the cutoff.
            CHECK(count_met(*sampler, kNone<ItemId>, scale, yaw, static_cast<float>(scale)) == 0);
            CHECK(count_met(*sampler, ItemId{0}, 1.0, 0.0, 1.0F) == 0);
        }
    }
}

TEST_CASE("Where nothing is, nothing is met") {
    const auto empty = make_sampler(Scene{});
    CHECK(cast(*empty, kNone<ItemId>, {{0, 0, 0}, {1, 0, 0}}).t > 1.0F);
    Scene scene;
    add_instance(scene, add_mesh(scene, quad_mesh(), kNone<MaterialId>), {0.0, 0.0, 0.0});
    const auto sampler = make_sampler(scene);
    const glm::vec3 forward(0.0F, 0.0F, -1.0F);
    CHECK(cast(*sampler, kNone<ItemId>, {{0.1F, 0.2F, 0.5F}, forward}).t == Approx(0.5F));
    // It ends before, begins behind, passes beside.
    CHECK(cast(*sampler, kNone<ItemId>, {{0.1F, 0.2F, 1.1F}, forward}).t > 1.0F);
    CHECK(cast(*sampler, kNone<ItemId>, {{0.1F, 0.2F, -0.1F}, forward}).t > 1.0F);
    CHECK(cast(*sampler, kNone<ItemId>, {{1.5F, 0.2F, 0.5F}, forward}).t > 1.0F);
    // From behind it is met as well, with the same normal; white, as it has no material.
    const SurfaceHit behind = cast(*sampler, kNone<ItemId>, {{0.1F, 0.2F, -0.5F}, -forward});
    CHECK(behind.t == Approx(0.5F));
    CHECK(behind.color == glm::vec3(1.0F));
    CHECK(glm::distance(behind.normal, -forward) < 0.01F);
}

TEST_CASE("Models of a scene are valid, and the same near and far from the origin") {
    const ColorCubeOptions options = {.rays = 2};
    std::vector<ColorCubeModel> models;
    for (const glm::dvec3& offset : {glm::dvec3(0.0), glm::dvec3(8388608.0, 0.0, -4194304.0)}) {
        const Scene scene = small_scene(offset);
        const auto sampler = make_sampler(scene, offset);
        SerialExecutor executor;
        auto model = build_color_cubes(scene, *sampler, options, executor, 100);
        REQUIRE(model.has_value());
        const Result<void> valid = validate(*model);
        INFO((valid ? "" : valid.error().message));
        REQUIRE(valid.has_value());
        CHECK(model->origin == offset);
        models.push_back(std::move(*model));
    }
    REQUIRE(models[1].trees.size() == 2);
    CHECK(models[1].trees[0] == models[0].trees[0]);
    CHECK(models[1].references.size() == models[0].references.size());
    // Places in the world are rounded to 1e-9 m, so that cells are the same unless one of them
    // passes that near to a corner.
    CHECK(models[1].trees[1].cells.size() == models[0].trees[1].cells.size());
    CHECK(models[1].trees[1].contents == models[0].trees[1].contents);
}
