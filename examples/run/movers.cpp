#include "run/movers.hpp"

#include "scenes/facets.hpp"
#include "scenes/random.hpp"

#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace farfield::run {

namespace {

constexpr int kMost = 10'000;
constexpr double kFramesAround = 300.0;

/// A ball of radius 1 in gores of two colours, with a basket below: 240 triangles or so.
Mesh make_balloon() {
    constexpr int kGores = 12;
    constexpr int kRings = 10;
    const glm::dvec3 bright(242, 90, 26);
    const glm::dvec3 pale(250, 238, 205);
    const auto point = [](int ring, int gore) {
        const double down = std::numbers::pi * ring / kRings;
        const double round = 2.0 * std::numbers::pi * gore / kGores;
        return glm::dvec3(
            std::sin(down) * std::cos(round), std::cos(down), std::sin(down) * std::sin(round)
        );
    };
    scenes::Facets facets;
    for (int gore = 0; gore < kGores; ++gore) {
        const glm::dvec3& color = gore % 2 == 0 ? bright : pale;
        facets.add(std::array{point(0, 0), point(1, gore + 1), point(1, gore)}, color);
        for (int ring = 1; ring + 1 < kRings; ++ring) {
            facets.add(
                std::array{
                    point(ring, gore),
                    point(ring, gore + 1),
                    point(ring + 1, gore + 1),
                    point(ring + 1, gore)},
                color
            );
        }
        facets.add(
            std::array{point(kRings - 1, gore), point(kRings - 1, gore + 1), point(kRings, 0)},
            color
        );
    }
    const glm::dvec3 straw(115, 76, 38);
    constexpr double kHalf = 0.2;
    constexpr double kTop = -1.25;
    constexpr double kBottom = -1.55;
    const std::array<glm::dvec2, 4> corners = {
        glm::dvec2(-kHalf, -kHalf),
        glm::dvec2(kHalf, -kHalf),
        glm::dvec2(kHalf, kHalf),
        glm::dvec2(-kHalf, kHalf)};
    for (std::size_t side = 0; side < 4; ++side) {
        const glm::dvec2& a = corners[side];
        const glm::dvec2& b = corners[(side + 1) % 4];
        facets.add(
            std::array{
                glm::dvec3(a.x, kTop, a.y),
                glm::dvec3(b.x, kTop, b.y),
                glm::dvec3(b.x, kBottom, b.y),
                glm::dvec3(a.x, kBottom, a.y)},
            straw
        );
    }
    Mesh mesh = facets.finish("balloon");
    mesh.splittable = false;
    return mesh;
}

} // namespace

glm::dmat4x3 Mover::object_to_world(int frame) const noexcept {
    const double angle = phase + 2.0 * std::numbers::pi * frame / kFramesAround;
    const glm::dvec3 place = middle + across * std::cos(angle) + along * std::sin(angle);
    const glm::dvec3 x = glm::normalize(across);
    return {x * scale, up * scale, glm::cross(x, up) * scale, place};
}

Result<std::vector<Mover>> add_movers(Scene& scene, int count) {
    if (count < 0 || count > kMost) {
        return fail(
            ErrorCode::invalid_argument,
            "movers are " + std::to_string(count) + ", expected 0 to " + std::to_string(kMost)
        );
    }
    std::vector<Mover> movers;
    if (count == 0) {
        return movers;
    }
    const Box3d box = scene_bounds(scene);
    const glm::dvec3 half = extent(box) / 2.0;
    const glm::dvec3 magnitude = glm::abs(scene.up);
    const glm::dvec3 x = glm::normalize(
        glm::cross(scene.up, magnitude.x < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0))
    );
    const glm::dvec3 z = glm::cross(x, scene.up);
    const double height = glm::dot(glm::abs(scene.up), half);
    const double reach = std::min(glm::dot(glm::abs(x), half), glm::dot(glm::abs(z), half));
    const auto mesh = make_id<MeshId>(scene.meshes.size());
    scene.meshes.push_back(make_balloon());
    scenes::Random random(17);
    for (int i = 0; i < count; ++i) {
        Mover mover;
        mover.item = make_id<ItemId>(scene.instances.size());
        const double away = 0.7 * reach * std::sqrt(random.unit());
        const double angle = 2.0 * std::numbers::pi * random.unit();
        const double radius = reach * random.between(0.05, 0.2);
        mover.middle = center(box) + x * (away * std::cos(angle)) + z * (away * std::sin(angle)) +
                       scene.up * (height * random.between(-0.3, 0.5));
        mover.up = scene.up;
        mover.across = x * radius;
        mover.along = z * (i % 2 == 0 ? radius : -radius);
        mover.phase = 2.0 * std::numbers::pi * random.unit();
        mover.scale = reach * random.between(0.006, 0.012);
        scene.instances.push_back({mesh, mover.object_to_world(0)});
        movers.push_back(mover);
    }
    return movers;
}

} // namespace farfield::run
