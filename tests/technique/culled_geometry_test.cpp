#include "support/allocation_counter.hpp"
#include "support/random.hpp"
#include "technique/scenes.hpp"
#include <farfield/gpu/null/null_backend.hpp>
#include <farfield/math/frustum.hpp>
#include <farfield/partition/bsp.hpp>
#include <farfield/partition/changes.hpp>
#include <farfield/technique/culled_geometry.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using namespace farfield;
using farfield::support::Forest;
using farfield::support::Random;

/// How often a plan draws each item and each primitive of the ground.
struct Drawn {
    std::vector<int> items;
    std::vector<int> ground;
};

Drawn count(const FramePlan& plan, const Forest& forest) {
    Drawn drawn{std::vector<int>(forest.objects.size()), std::vector<int>(forest.ground.size())};
    REQUIRE(plan.passes.size() == 1);
    const Pass& pass = plan.passes[0];
    REQUIRE(pass.first_command == 0);
    REQUIRE(pass.command_count == plan.commands.size());
    for (const Command& command : plan.commands) {
        REQUIRE(command.kind == Command::Kind::geometry);
        REQUIRE(command.clip == Command::kNoClip);
        for (std::uint32_t i = 0; i < command.count; ++i) {
            ++drawn.items.at(index_of(plan.items.at(command.first + i)));
        }
        for (std::uint32_t i = 0; i < command.piece_count; ++i) {
            const Piece& piece = plan.pieces.at(command.first_piece + i);
            REQUIRE(index_of(piece.item) + 1 == forest.objects.size());
            for (std::uint32_t p = piece.first; p < piece.first + piece.count; ++p) {
                ++drawn.ground.at(forest.hierarchy.primitives.at(p));
            }
        }
    }
    return drawn;
}

/// True where the box certainly meets the frustum: one of its 5^3 grid points lies inside by more
/// than the rounding of plane distances (coordinates below 1000 m, an ulp is 6e-5 m).
bool surely_seen(const Frustum& frustum, const Box3f& box) {
    constexpr float kRounding = 1e-3F;
    for (int index = 0; index < 125; ++index) {
        const int layer = index / 25;
        const glm::vec3 fraction = glm::vec3(index % 5, index / 5 % 5, layer) / 4.0F;
        const glm::vec3 point = glm::mix(box.lo, box.hi, fraction);
        const bool inside =
            std::all_of(frustum.planes.begin(), frustum.planes.end(), [&](const Plane& plane) {
                return signed_distance(plane, point) > kRounding;
            });
        if (inside) {
            return true;
        }
    }
    return false;
}

View random_view(Random& random, double reach) {
    const glm::dvec3 eye = random.vector(-reach, reach);
    return support::view_at(eye, eye + random.direction<double>());
}

void check_against_brute_force(const Forest& forest, const View& view, GeometryOrder order) {
    CulledGeometry technique(forest.hierarchy, order);
    const FramePlan& plan = technique.plan(view);
    const Drawn drawn = count(plan, forest);
    const Frustum frustum = make_frustum(view, forest.hierarchy.origin);
    for (std::size_t item = 0; item < forest.objects.size(); ++item) {
        if (forest.objects[item].splittable) {
            REQUIRE(drawn.items[item] == 0);
            continue;
        }
        // Where it is now, which is where it was built unless a test has moved it.
        const Box3f box = partition::item_box(forest.hierarchy, make_id<ItemId>(item));
        CAPTURE(item);
        REQUIRE(drawn.items[item] <= 1);
        if (!is_empty(box) && surely_seen(frustum, box)) {
            REQUIRE(drawn.items[item] == 1);
        }
        const bool at_rest = forest.hierarchy.item_places[item] < forest.hierarchy.items.size();
        if (!at_rest && (is_empty(box) || classify(frustum, box) == Overlap::outside)) {
            REQUIRE(drawn.items[item] == 0); // culled by its own box, not by that of a node
        }
    }
    for (std::size_t triangle = 0; triangle < forest.ground.size(); ++triangle) {
        CAPTURE(triangle);
        REQUIRE(drawn.ground[triangle] <= 1);
        if (surely_seen(frustum, local_box(forest.ground[triangle], forest.hierarchy.origin))) {
            REQUIRE(drawn.ground[triangle] == 1);
        }
    }
}

/// Leaves in the order in which a plan draws their items.
std::vector<std::uint32_t> leaf_order(const FramePlan& plan, const Hierarchy& tree) {
    std::vector<std::uint32_t> leaf_of(tree.items.size());
    for (std::uint32_t index = 0; index < tree.nodes.size(); ++index) {
        const HierarchyNode& node = tree.nodes[index];
        for (std::uint32_t i = 0; is_leaf(node) && i < node.item_count; ++i) {
            leaf_of.at(index_of(tree.items[node.first_item + i])) = index;
        }
    }
    std::vector<std::uint32_t> leaves;
    for (const ItemId item : plan.items) {
        const std::uint32_t leaf = leaf_of.at(index_of(item));
        if (leaves.empty() || leaves.back() != leaf) {
            leaves.push_back(leaf);
        }
    }
    return leaves;
}

/// Whether every plane that parts two leaves has the nearer one first.
bool is_front_to_back(
    const std::vector<std::uint32_t>& leaves, const Hierarchy& tree, const glm::vec3& eye
) {
    for (std::size_t i = 0; i < leaves.size(); ++i) {
        for (std::size_t j = i + 1; j < leaves.size(); ++j) {
            std::uint32_t a = leaves[i];
            std::uint32_t b = leaves[j];
            // The greater number is never the ancestor, so it may climb.
            while (tree.nodes[a].parent != tree.nodes[b].parent) {
                (a > b ? a : b) = tree.nodes[a > b ? a : b].parent;
            }
            const HierarchyNode& parent = tree.nodes[tree.nodes[a].parent];
            const float distance = signed_distance(parent.plane, eye);
            const bool a_is_front = a == parent.first_child + 1;
            if (distance != 0.0F && a_is_front != (distance > 0.0F)) {
                return false;
            }
        }
    }
    return true;
}

} // namespace

TEST_CASE("a hierarchy without objects makes an empty frame") {
    const auto tree = partition::build_bsp({});
    REQUIRE(tree.has_value());
    CulledGeometry technique(*tree);
    const View view = support::view_at({0, 0, 0}, {0, 0, -1});
    const FramePlan& plan = technique.plan(view);
    REQUIRE(plan.passes.size() == 1);
    CHECK(plan.passes[0].command_count == 0);
    CHECK(plan.passes[0].page == kNone<PageId>);
    CHECK(plan.passes[0].viewport == Region{0, 0, 640, 480});
    CHECK(plan.passes[0].scissor == Region{0, 0, 640, 480});
    CHECK(plan.passes[0].view == view);
    CHECK(plan.commands.empty());
    CHECK(plan.items.empty());
    CHECK(plan.pieces.empty());
    CHECK(plan.pages.empty());
}

TEST_CASE("nothing is drawn of what is behind, beside or beyond the viewer") {
    const Forest forest = support::make_forest({.trees = 50, .ground_cells = 8});
    CulledGeometry technique(forest.hierarchy);
    for (const glm::dvec3 away :
         {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, -1), glm::dvec3(-1, 2, 1)}) {
        const glm::dvec3 eye = 1000.0 * glm::normalize(away);
        CHECK(technique.plan(support::view_at(eye, 2.0 * eye)).commands.empty());
        CHECK(technique.plan(support::view_at(10.0 * eye, {0, 0, 0})).commands.empty()); // too far
        CHECK_FALSE(technique.plan(support::view_at(eye, {0, 0, 0})).commands.empty());
    }
}

TEST_CASE("every primitive in the frustum is drawn once") {
    Random random(1);
    for (const std::uint32_t ground_cells : {0U, 1U, 24U}) {
        for (const std::size_t trees : {std::size_t{1}, std::size_t{2}, std::size_t{150}}) {
            const Forest forest = support::make_forest(
                {.trees = trees, .ground_cells = ground_cells, .seed = 10 + trees}
            );
            CAPTURE(ground_cells, trees);
            for (int view = 0; view < 40; ++view) {
                const View from = random_view(random, view % 2 == 0 ? 30.0 : 400.0);
                check_against_brute_force(forest, from, GeometryOrder::front_to_back);
                check_against_brute_force(forest, from, GeometryOrder::stored);
            }
        }
    }
}

TEST_CASE("what moves, rests and hides is drawn once where it is") {
    for (const glm::dvec3& offset : {glm::dvec3(0.0), glm::dvec3(1e7, -2e6, 1e7)}) {
        Random random(11);
        Forest forest =
            support::make_forest({.trees = 80, .ground_cells = 8, .seed = 12, .offset = offset});
        const std::vector<std::uint64_t> primitives(forest.objects.size(), 1000);
        NullBackend backend(primitives, &forest.hierarchy);
        const TargetId target = backend.create_target(640, 480, 1).value();
        const std::size_t trees = forest.objects.size() - 1;
        std::size_t at_rest_elsewhere = 0;
        std::size_t most_moving = 0;
        for (int step = 0; step < 400; ++step) {
            CAPTURE(step);
            const std::size_t item = random.below(static_cast<unsigned>(trees));
            const auto id = make_id<ItemId>(item);
            if (step % 3 == 0) {
                const std::uint32_t place = forest.hierarchy.item_places[item];
                at_rest_elsewhere += partition::settle(forest.hierarchy, id) &&
                                             place != forest.hierarchy.item_places[item]
                                         ? 1U
                                         : 0U;
            } else if (step % 10 == 1) {
                REQUIRE(partition::hide(forest.hierarchy, id).has_value());
            } else {
                const glm::dvec3 by = random.vector(-100.0, 100.0);
                const Box3d& built = forest.objects[item].bounds;
                REQUIRE(
                    partition::update_bounds(forest.hierarchy, id, {built.lo + by, built.hi + by})
                        .has_value()
                );
            }
            most_moving = std::max(most_moving, forest.hierarchy.moving.size());
            const glm::dvec3 eye = offset + random.vector(-150.0, 150.0);
            const View view = support::view_at(eye, eye + random.direction<double>());
            for (const GeometryOrder order :
                 {GeometryOrder::front_to_back, GeometryOrder::stored}) {
                check_against_brute_force(forest, view, order);
                CulledGeometry technique(forest.hierarchy, order);
                REQUIRE(backend.execute(technique.plan(view), target, {}).has_value());
            }
        }
        CHECK(at_rest_elsewhere > 10);
        CHECK(most_moving > 40);
    }
}

TEST_CASE("an item that moves is drawn though nothing else is there") {
    Forest forest = support::make_forest({.trees = 1});
    CulledGeometry technique(forest.hierarchy);
    const glm::dvec3 eye(0, 2, 5000);
    const View away = support::view_at(eye, 2.0 * eye);
    CHECK(technique.plan(away).commands.empty());
    REQUIRE(partition::update_bounds(
                forest.hierarchy, ItemId{0}, {{-1, 0, 5100}, {1, 2, 5102}}
    ).has_value());
    CHECK(is_empty(bounds(forest.hierarchy.nodes[0])));
    CHECK(technique.plan(away).items == std::vector<ItemId>{ItemId{0}});
    CHECK(technique.plan(support::view_at(eye, {0, 0, 0})).commands.empty());
    REQUIRE(partition::hide(forest.hierarchy, ItemId{0}).has_value());
    CHECK(technique.plan(away).commands.empty());
}

TEST_CASE("holes leave one command, and none where nothing is left") {
    Forest forest = support::make_forest({.trees = 64});
    CulledGeometry technique(forest.hierarchy, GeometryOrder::stored);
    const View view = support::view_at({0, 500, 1000}, {0, 0, 0});
    for (std::size_t item = 0; item < 64; item += 2) {
        REQUIRE(partition::hide(forest.hierarchy, make_id<ItemId>(item)).has_value());
    }
    const FramePlan& plan = technique.plan(view);
    REQUIRE(plan.commands.size() == 1);
    CHECK(plan.commands[0].count == 32);
    CHECK(plan.items.size() == 32);
    CHECK(std::count(plan.items.begin(), plan.items.end(), kNone<ItemId>) == 0);
    for (std::size_t item = 1; item < 64; item += 2) {
        REQUIRE(partition::hide(forest.hierarchy, make_id<ItemId>(item)).has_value());
    }
    CHECK(technique.plan(view).commands.empty());
}

TEST_CASE("items and ground are culled apart") {
    // Looking down at the ground between the trees, whose leaf holds both.
    const Forest forest =
        support::make_forest({.trees = 3, .radius = 400.0, .ground_cells = 64, .seed = 3});
    CulledGeometry technique(forest.hierarchy);
    int ground_alone = 0;
    for (int step = -15; step <= 15; ++step) {
        const double x = 20.0 * step;
        const FramePlan& plan = technique.plan(support::view_at({x, 12, 0}, {x, 0, 0}));
        ground_alone += plan.items.empty() && !plan.pieces.empty() ? 1 : 0;
    }
    CHECK(ground_alone > 20);
}

TEST_CASE("front to back holds at every plane, stored order is the hierarchy's") {
    const Forest forest = support::make_forest({.trees = 200, .seed = 5});
    const Hierarchy& tree = forest.hierarchy;
    CulledGeometry technique(tree, GeometryOrder::front_to_back);
    CulledGeometry stored(tree, GeometryOrder::stored);
    Random random(2);
    std::vector<std::size_t> position(tree.items.size());
    for (std::size_t i = 0; i < tree.items.size(); ++i) {
        position.at(index_of(tree.items[i])) = i;
    }
    std::size_t pairs = 0;
    for (int index = 0; index < 50; ++index) {
        const View view = random_view(random, 250.0);
        const glm::vec3 eye = local_point(view.eye, tree.origin);
        const auto leaves = leaf_order(technique.plan(view), tree);
        CHECK(is_front_to_back(leaves, tree, eye));
        pairs += leaves.size() * leaves.size() / 2;
        const FramePlan& plain = stored.plan(view);
        const bool sorted =
            std::is_sorted(plain.items.begin(), plain.items.end(), [&](ItemId a, ItemId b) {
                return position[index_of(a)] < position[index_of(b)];
            });
        CHECK(sorted);
    }
    CHECK(pairs > 10'000);
}

TEST_CASE("a hierarchy seen as a whole is one command") {
    const Forest forest = support::make_forest({.trees = 64, .ground_cells = 8});
    CulledGeometry technique(forest.hierarchy, GeometryOrder::stored);
    const FramePlan& plan = technique.plan(support::view_at({0, 500, 1000}, {0, 0, 0}));
    REQUIRE(plan.commands.size() == 1);
    CHECK(plan.commands[0].count == 64);
    CHECK(plan.items == forest.hierarchy.items);
    // Neighbouring pieces of one item are one run.
    REQUIRE(plan.pieces.size() == 1);
    CHECK(plan.pieces[0].count == forest.ground.size());
}

TEST_CASE("a scene far from the origin is culled as one at it") {
    const glm::dvec3 far_away(1e7, -2e6, 1e7);
    const Forest here = support::make_forest({.trees = 100, .ground_cells = 8});
    const Forest there =
        support::make_forest({.trees = 100, .ground_cells = 8, .offset = far_away});
    CulledGeometry a(here.hierarchy);
    CulledGeometry b(there.hierarchy);
    for (int frame = 0; frame < 50; ++frame) {
        const glm::dvec3 eye(frame * 8.0 - 200.0, 4.0, 128.0);
        const glm::dvec3 target(0.0, 4.0, frame * 0.5);
        const FramePlan& plan_a = a.plan(support::view_at(eye, target));
        const FramePlan& plan_b = b.plan(support::view_at(far_away + eye, far_away + target));
        REQUIRE(plan_a.items == plan_b.items);
        REQUIRE(plan_a.pieces == plan_b.pieces);
    }
}

TEST_CASE("planning is repeatable and allocates nothing once warm") {
    Forest forest = support::make_forest({.trees = 200, .ground_cells = 16});
    const auto walk = support::curved_walk(200.0, 300);
    CulledGeometry technique(forest.hierarchy);
    std::vector<std::uint64_t> digests;
    digests.reserve(walk.size());
    for (const support::Step& step : walk) {
        digests.push_back(digest(technique.plan(step.view)));
    }
    // Things move and come to rest between the frames.
    forest.hierarchy.moving.reserve(1);
    const std::uint64_t before = support::allocation_count();
    std::size_t different = 0;
    for (std::size_t frame = 0; frame < walk.size(); ++frame) {
        const std::size_t item = frame % 200;
        const auto id = make_id<ItemId>(item);
        const bool moved =
            partition::update_bounds(forest.hierarchy, id, forest.objects[item].bounds).has_value();
        static_cast<void>(technique.plan(walk[frame].view));
        different += moved && partition::settle(forest.hierarchy, id) ? 0U : 1U;
        different += digest(technique.plan(walk[frame].view)) != digests[frame] ? 1U : 0U;
    }
    const std::uint64_t after = support::allocation_count();
    CHECK(different == 0);
    CHECK(after == before);
}
