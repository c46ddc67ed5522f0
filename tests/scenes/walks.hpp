#pragma once

#include <farfield/eval/camera_path.hpp>
#include <farfield/math/closest_point.hpp>
#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

/// What tests ask of walks at head height.
namespace farfield::test {

/// Eyes of all frames of a path.
inline std::vector<glm::dvec3> eyes_of(const CameraPath& path) {
    std::vector<glm::dvec3> eyes;
    eyes.reserve(static_cast<std::size_t>(path.frame_count));
    for (int frame = 0; frame < path.frame_count; ++frame) {
        eyes.push_back(eval::pose_at(path, frame).eye);
    }
    return eyes;
}

/// [m] From the nearest of these points to the nearest triangle of the scene, or `limit` where
/// there is none within it.
inline double clearance(const Scene& scene, const std::vector<glm::dvec3>& points, double limit) {
    double nearest = limit;
    for (std::size_t item = 0; item < scene.instances.size(); ++item) {
        const Box3d all = item_bounds(scene, make_id<ItemId>(item));
        std::vector<glm::dvec3> near;
        Box3d around;
        for (const glm::dvec3& point : points) {
            if (distance(all, point) < nearest) {
                near.push_back(point);
                around = unite(around, point);
            }
        }
        if (near.empty()) {
            continue;
        }
        const Instance& instance = scene.instances[item];
        const Mesh& mesh = scene.meshes[index_of(instance.mesh)];
        for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
            std::array<glm::dvec3, 3> triangle{};
            Box3d box;
            for (std::size_t corner = 0; corner < 3; ++corner) {
                const glm::dvec3 local(mesh.positions[mesh.indices[i + corner]]);
                triangle.at(corner) = instance.object_to_world * glm::dvec4(mesh.origin + local, 1);
                box = unite(box, triangle.at(corner));
            }
            bool far = false;
            for (int axis = 0; axis < 3; ++axis) {
                far = far || box.lo[axis] > around.hi[axis] + nearest ||
                      box.hi[axis] < around.lo[axis] - nearest;
            }
            if (far) {
                continue;
            }
            for (const glm::dvec3& point : near) {
                if (distance(box, point) < nearest) {
                    const double off = glm::distance(closest_point(point, triangle), point);
                    nearest = std::min(nearest, off);
                }
            }
        }
    }
    return nearest;
}

/// Checks that every frame looks level and upright: no pitch, no roll.
inline void check_level(const CameraPath& path) {
    for (int frame = 0; frame < path.frame_count; ++frame) {
        const PathPose pose = eval::pose_at(path, frame);
        const glm::dvec3 look = pose.target - pose.eye;
        INFO("frame " << frame);
        // A sum of four products of numbers of some hundred metres: 1e-12 is a hundred roundings.
        REQUIRE(std::abs(look.y) <= 1e-12 * (1.0 + std::abs(pose.eye.y)));
        REQUIRE(glm::length(look) > 1.0);
        REQUIRE(std::abs(pose.up.x) + std::abs(pose.up.z) == 0.0);
        REQUIRE(pose.up.y > 0.0);
    }
}

/// [m] The least and the most that the eye goes from one frame to the next.
inline std::array<double, 2> paces(const CameraPath& path) {
    const std::vector<glm::dvec3> eyes = eyes_of(path);
    std::array<double, 2> found = {1e30, 0.0};
    for (std::size_t i = 1; i < eyes.size(); ++i) {
        const double pace = glm::distance(eyes[i - 1], eyes[i]);
        found = {std::min(found[0], pace), std::max(found[1], pace)};
    }
    return found;
}

} // namespace farfield::test
