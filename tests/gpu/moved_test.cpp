#include "gpu/drawer.hpp"
#include "gpu/drawing.hpp"
#include "support/small_scene.hpp"
#include <farfield/partition/changes.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <catch2/catch.hpp>
#include <glm/ext/matrix_double3x3.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

using namespace farfield;
using namespace farfield::support;

namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;

/// Turned about a slanted axis, scaled, and perhaps mirrored and stretched, at `place`.
glm::dmat4x3 transform_at(const glm::dvec3& place, double angle_rad, double scale, bool mirrored) {
    const double c = std::cos(angle_rad) * scale;
    const double s = std::sin(angle_rad) * scale;
    const double x = mirrored ? -1.5 : 1.0;
    return {
        {c * x, 0.6 * s * x, 0.8 * s * x},
        {-s, 0.6 * c, 0.8 * c},
        {0, -0.8 * scale, 0.6 * scale},
        place};
}

/// The picture of a scene that is made new; nothing where the test is skipped.
Picture picture_of(const Scene& scene, const Hierarchy& hierarchy, const View& view) {
    const auto drawer = make_drawer(scene, &hierarchy);
    if (drawer == nullptr) {
        return {};
    }
    CulledGeometry geometry(hierarchy);
    return draw(drawer->backend(), geometry.plan(view), kWidth, kHeight);
}

} // namespace

TEST_CASE("A scene whose items have moved is drawn as one made so") {
    for (const glm::dvec3& offset : {glm::dvec3(0.0), glm::dvec3(1e7, -2e6, 1e7)}) {
        SmallWorld world = make_world(small_scene(offset));
        const std::vector<Instance> before = world.scene.instances;
        const View view = small_walk(40, kWidth, kHeight, offset);
        const glm::dvec3 ahead = -view.camera_to_world[2];
        const Picture there_before = picture_of(world.scene, world.hierarchy, view);
        std::vector<ItemId> movers;
        for (const ItemId item : world.hierarchy.items) {
            if (index_of(item) % 3 == 0) {
                movers.push_back(item);
            }
        }
        REQUIRE(movers.size() > 3);
        for (std::size_t i = 0; i < movers.size(); ++i) {
            const auto n = static_cast<double>(i);
            const glm::dvec3 place =
                view.eye + (8.0 + n) * ahead + (n - 3.0) * view.camera_to_world[0];
            Instance& instance = world.scene.instances[index_of(movers[i])];
            instance.object_to_world = transform_at(place, n, 0.4 + 0.1 * n, i % 2 == 1);
            REQUIRE(partition::update_bounds(
                        world.hierarchy, movers[i], item_bounds(world.scene, movers[i])
            )
                        .has_value());
        }
        REQUIRE(validate(world.scene).has_value());
        const Picture expected = picture_of(world.scene, world.hierarchy, view);

        Scene start = world.scene;
        start.instances = before;
        const auto drawer = make_drawer(start, &world.hierarchy);
        if (drawer == nullptr) {
            return;
        }
        for (const ItemId item : movers) {
            REQUIRE(drawer
                        ->set_transform(item, world.scene.instances[index_of(item)].object_to_world)
                        .has_value());
        }
        CulledGeometry geometry(world.hierarchy);
        const Picture moved = draw(drawer->backend(), geometry.plan(view), kWidth, kHeight);
        CHECK(moved == expected);
        CHECK(count_different(moved, there_before, 8) > 500);

        // And back home.
        for (const ItemId item : movers) {
            REQUIRE(drawer->set_transform(item, before[index_of(item)].object_to_world).has_value()
            );
            REQUIRE(partition::update_bounds(world.hierarchy, item, item_bounds(start, item))
                        .has_value());
            REQUIRE(partition::settle(world.hierarchy, item));
        }
        CHECK(draw(drawer->backend(), geometry.plan(view), kWidth, kHeight) == there_before);
    }
}

TEST_CASE("A transform that cannot be is refused by name and nothing moves") {
    const SmallWorld world = make_world(small_scene());
    const auto drawer = make_drawer(world.scene, &world.hierarchy);
    if (drawer == nullptr) {
        return;
    }
    CulledGeometry geometry(world.hierarchy);
    const View view = small_walk(40, kWidth, kHeight);
    const Picture before = draw(drawer->backend(), geometry.plan(view), kWidth, kHeight);
    const std::size_t count = world.scene.instances.size();
    const auto refusal = [&](ItemId item, const glm::dmat4x3& transform, ErrorCode code) {
        const Result<void> moved = drawer->set_transform(item, transform);
        REQUIRE_FALSE(moved.has_value());
        CHECK(moved.error().code == code);
        return moved.error().message;
    };
    const glm::dmat4x3 here(1.0);
    CHECK(
        refusal(make_id<ItemId>(count), here, ErrorCode::not_found)
            .find("item " + std::to_string(count) + " of " + std::to_string(count)) !=
        std::string::npos
    );
    static_cast<void>(refusal(kNone<ItemId>, here, ErrorCode::not_found));
    glm::dmat4x3 wrong = here;
    wrong[2].y = std::numeric_limits<double>::quiet_NaN();
    CHECK(refusal(ItemId{0}, wrong, ErrorCode::bad_data) == "instance 0: column 2.y is nan");
    wrong = here;
    wrong[3].x = std::numeric_limits<double>::infinity();
    CHECK(refusal(ItemId{0}, wrong, ErrorCode::bad_data) == "instance 0: column 3.x is inf");
    wrong = here;
    wrong[1] *= 1e308;
    wrong[0].y = 1e308;
    CHECK(
        refusal(ItemId{0}, wrong, ErrorCode::bad_data) == "instance 0: its world box is not finite"
    );
    CHECK(draw(drawer->backend(), geometry.plan(view), kWidth, kHeight) == before);
}
