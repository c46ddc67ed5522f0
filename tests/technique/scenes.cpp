#include "technique/scenes.hpp"

#include "support/random.hpp"
#include <farfield/partition/bsp.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <cmath>

namespace farfield::support {

namespace {

constexpr glm::dvec3 kUp(0.0, 1.0, 0.0);
constexpr double kFrameSeconds = 1.0 / 60;

double to_sixteenths(double value) {
    return std::round(value * 16.0) / 16.0;
}

/// A direction of the horizon and a little up or down.
glm::dvec3 random_direction(Random& random) {
    glm::dvec3 direction = random.direction<double>();
    direction.y *= 0.3;
    return glm::normalize(direction);
}

} // namespace

Forest make_forest(const ForestOptions& options) {
    Random random(options.seed);
    Forest forest;
    while (forest.objects.size() < options.trees) {
        const double x = to_sixteenths(random.uniform(-options.radius, options.radius));
        const double z = to_sixteenths(random.uniform(-options.radius, options.radius));
        const double half = to_sixteenths(random.uniform(1.0, 5.0));
        if (x * x + z * z > options.radius * options.radius) {
            continue;
        }
        const glm::dvec3 foot = options.offset + glm::dvec3(x, 0.0, z);
        forest.objects.push_back(
            {{foot - glm::dvec3(half, 0.0, half), foot + glm::dvec3(half, 2.0 * half, half)},
             options.primitives + random.below(1000),
             false}
        );
    }
    const std::uint32_t cells = options.ground_cells;
    const double cell = cells > 0 ? to_sixteenths(2.0 * options.radius / cells) : 0.0;
    const double half_side = cell * cells / 2.0;
    for (std::uint32_t triangle = 0; triangle < 2 * cells * cells; ++triangle) {
        const std::uint32_t column = triangle / 2 % cells;
        const std::uint32_t row = triangle / 2 / cells;
        const glm::dvec3 lo =
            options.offset + glm::dvec3(column * cell - half_side, 0.0, row * cell - half_side);
        forest.ground.push_back({lo, lo + glm::dvec3(cell, 0.0, cell)});
    }
    if (cells > 0) {
        const glm::dvec3 half(half_side, 0.0, half_side);
        forest.objects.push_back(
            {{options.offset - half, options.offset + half}, forest.ground.size(), true}
        );
    }
    auto tree = partition::build_bsp(
        forest.objects,
        {.inflation = options.inflation, .max_piece_primitives = 32},
        [&](std::uint32_t, std::uint32_t primitive) { return forest.ground[primitive]; }
    );
    REQUIRE(tree.has_value());
    REQUIRE(validate(*tree).has_value());
    forest.hierarchy = std::move(*tree);
    return forest;
}

Hierarchy make_row(std::uint32_t count, const glm::dvec3& offset) {
    constexpr float kSpacing = 16.0F;
    constexpr std::uint64_t kPrimitives = 20'000;
    Hierarchy tree;
    tree.origin = offset;
    tree.nodes.resize(1);
    tree.nodes[0].item_count = count;
    // Nodes are filled in the order in which they are made: parents before children.
    for (std::uint32_t index = 0; index < tree.nodes.size(); ++index) {
        HierarchyNode node = tree.nodes[index];
        const auto first = static_cast<float>(node.first_item);
        const auto last = static_cast<float>(node.first_item + node.item_count - 1);
        node.item_primitives = kPrimitives * node.item_count;
        node.items_box = {{first * kSpacing - 2, -2, -2}, {last * kSpacing + 2, 2, 2}};
        if (node.item_count > 1) {
            node.first_child = static_cast<std::uint32_t>(tree.nodes.size());
            node.plane = {{1, 0, 0}, (first + last) / 2 * kSpacing};
            HierarchyNode child;
            child.parent = index;
            child.item_count = node.item_count / 2;
            child.first_item = node.first_item;
            tree.nodes.push_back(child);
            child.first_item += child.item_count;
            tree.nodes.push_back(child);
        }
        tree.nodes[index] = node;
    }
    for (std::uint32_t item = 0; item < count; ++item) {
        tree.items.push_back(make_id<ItemId>(item));
    }
    tree.quality.leaves = count;
    for (std::uint32_t leaves = count; leaves > 1; leaves /= 2) {
        ++tree.quality.depth;
    }
    REQUIRE(validate(tree).has_value());
    return tree;
}

Lens test_lens() {
    return {-1.0, 1.0, -0.75, 0.75, 0.25, 4096.0};
}

View view_at(const glm::dvec3& eye, const glm::dvec3& target) {
    return look_at(eye, target, kUp, test_lens(), 640, 480);
}

std::vector<Step> walk_of(std::span<const View> views) {
    std::vector<Step> steps;
    for (std::size_t frame = 0; frame < views.size(); ++frame) {
        const std::size_t before = frame > 0 ? frame - 1 : 0;
        const std::size_t earlier = before > 0 ? before - 1 : 0;
        steps.push_back(
            {views[frame],
             estimate_motion(
                 views[frame].eye, views[before].eye, views[earlier].eye, kFrameSeconds
             )}
        );
    }
    return steps;
}

std::vector<Step> curved_walk(double radius, std::size_t frames, const glm::dvec3& offset) {
    std::vector<View> views;
    for (std::size_t frame = 0; frame < frames; ++frame) {
        // 6 m/s, on a grid fine enough and exact far away.
        const double way = to_sixteenths(static_cast<double>(frame) * 0.125);
        const double side = to_sixteenths(way * way / (4.0 * radius));
        const glm::dvec3 eye(side, 6.0, 2.0 * radius - way);
        views.push_back(view_at(offset + eye, offset + glm::dvec3(0.0, 4.0, 0.0)));
    }
    return walk_of(views);
}

std::vector<Step>
random_flight(std::size_t frames, std::uint64_t seed, const FlightOptions& options) {
    Random random(seed);
    const auto anywhere = [&] {
        glm::dvec3 place = random.vector(-options.reach, options.reach);
        place.y = random.uniform(0.5, 40.0);
        return place;
    };
    std::vector<View> views;
    glm::dvec3 eye = anywhere();
    glm::dvec3 heading = random_direction(random);
    glm::dvec3 gaze = heading;
    Lens lens = test_lens();
    int width = 640;
    bool still = false;
    for (std::size_t frame = 0; frame < frames; ++frame) {
        if (random.below(options.teleport_in) == 0) {
            eye = anywhere();
        }
        if (random.below(options.turn_in) == 0) {
            gaze = random_direction(random);
            heading = gaze;
        }
        if (random.below(options.lens_in) == 0) {
            lens.top = random.uniform(0.3, 1.0);
            width = random.below(2) == 0 ? 640 : 320;
        }
        still = random.below(100) == 0 ? !still : still;
        if (!still) {
            heading = glm::normalize(heading + 0.03 * random_direction(random));
            eye += heading * options.speed * kFrameSeconds;
        }
        gaze = glm::normalize(gaze + 0.02 * heading);
        View view = look_at(eye, eye + gaze, kUp, lens, width, 480);
        views.push_back(view);
    }
    return walk_of(views);
}

} // namespace farfield::support
