#pragma once

#include "../support/random.hpp"
#include <farfield/partition/hierarchy.hpp>

#include <catch2/catch.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

/// The order of drawing that a tree promises, held against rays.
namespace farfield::support {

/// Rank of every node in a traversal from far to near.
inline std::vector<std::uint32_t> back_to_front(const Hierarchy& tree, const glm::vec3& eye) {
    std::vector<std::uint32_t> ranks(tree.nodes.size(), 0);
    std::vector<std::uint32_t> waiting{0};
    std::uint32_t rank = 0;
    while (!waiting.empty()) {
        const std::uint32_t node = waiting.back();
        waiting.pop_back();
        ranks[node] = rank++;
        if (!is_leaf(tree.nodes[node])) {
            const unsigned far = far_child(tree.nodes[node], eye);
            waiting.push_back(tree.nodes[node].first_child + 1 - far);
            waiting.push_back(tree.nodes[node].first_child + far);
        }
    }
    return ranks;
}

struct Hit {
    double enter = 0.0;
    double leave = 0.0;
};

/// Where a ray is inside a box, from the eye on.
inline std::optional<Hit>
hit(const Box3d& box, const glm::dvec3& eye, const glm::dvec3& direction) {
    Hit result{0.0, std::numeric_limits<double>::infinity()};
    for (int axis = 0; axis < 3; ++axis) {
        const double a = (box.lo[axis] - eye[axis]) / direction[axis];
        const double b = (box.hi[axis] - eye[axis]) / direction[axis];
        result.enter = std::max(result.enter, std::min(a, b));
        result.leave = std::min(result.leave, std::max(a, b));
    }
    return result.enter <= result.leave ? std::optional(result) : std::nullopt;
}

struct Tally {
    std::uint64_t pairs = 0;
    std::uint64_t wrong = 0;
};

/// A box in a leaf, relative to the origin of the tree.
struct Placed {
    Box3d box;
    std::uint32_t leaf = 0;
};

/// Shoots rays through two boxes each and compares, for every two boxes of different leaves that a
/// ray meets, the order of drawing with the order along the ray.
inline Tally shoot(const Hierarchy& tree, const std::vector<Placed>& items, Random& random) {
    REQUIRE(items.size() >= 2);
    const auto point_in = [&random](const Box3d& box) {
        const double x = random.uniform(box.lo.x, box.hi.x);
        const double y = random.uniform(box.lo.y, box.hi.y);
        return glm::dvec3(x, y, random.uniform(box.lo.z, box.hi.z));
    };
    Tally tally;
    for (int ray = 0; ray < 1000; ++ray) {
        const glm::dvec3 near =
            point_in(items[random.below(static_cast<unsigned>(items.size()))].box);
        const glm::dvec3 far =
            point_in(items[random.below(static_cast<unsigned>(items.size()))].box);
        // Sometimes inside a box, mostly outside; a float, so that the tree sees the same point.
        const glm::vec3 eye(near + (near - far) * random.uniform(0.0, 2.0));
        const glm::dvec3 direction = far - glm::dvec3(eye);
        const std::vector<std::uint32_t> ranks = back_to_front(tree, eye);
        struct Met {
            std::uint32_t leaf = 0;
            std::uint32_t rank = 0;
            Hit hit;
        };
        std::vector<Met> met;
        for (const Placed& item : items) {
            if (const auto found = hit(item.box, glm::dvec3(eye), direction)) {
                met.push_back({item.leaf, ranks[item.leaf], *found});
            }
        }
        for (const Met& first : met) {
            for (const Met& later : met) {
                if (first.leaf != later.leaf && first.rank < later.rank) {
                    ++tally.pairs;
                    tally.wrong += later.hit.leave <= first.hit.enter ? 0U : 1U;
                }
            }
        }
    }
    return tally;
}

} // namespace farfield::support
