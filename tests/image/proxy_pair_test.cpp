#include <farfield/image/proxy_pair.hpp>

#include <catch2/catch.hpp>

#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

using namespace farfield;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A node over `count` samples from `first`, all of them on facets that face up.
ProxyNode node(std::uint32_t first, std::uint32_t count, float lo_x, float hi_x) {
    ProxyNode made;
    made.bounds = {{lo_x, -1.0F, 0.0F}, {hi_x, 2.0F, 0.0F}};
    made.below = -1.0F;
    made.above = 2.0F;
    made.cosine = 0.9F;
    made.first = first;
    made.count = count;
    return made;
}

/// Four points over and under a flat square of two triangles, the first of which may be halved.
ProxyPair hand_made_pair() {
    ProxyPair pair;
    pair.fine = ItemId{0};
    pair.coarse = ItemId{1};
    pair.origin = {1e7, 0.0, -3.0};
    pair.facets.resize(4); // dot((0, 1, 0), x) = 0
    pair.samples = {
        {{0.0F, 0.0F, 0.0F}, 2},
        {{1.0F, 2.0F, 0.0F}, 3},
        {{2.0F, -1.0F, 0.0F}, 1},
        {{3.0F, 0.5F, 0.0F}, 1}};
    pair.nodes = {node(0, 4, 0.0F, 3.0F), node(0, 2, 0.0F, 1.0F), node(2, 2, 2.0F, 3.0F)};
    pair.nodes[0].first_child = 1;
    pair.offset_m = 2.0F;
    pair.splits = {
        {{1.0F, 0.0F, 0.0F}, 4.0F, 2.0F},
        {{1.0F, 0.0F, 0.0F}, 4.0F, 2.0F},
        {{0.0F, 0.0F, 0.0F}, 3.0F, 2.0F},
        {{2.0F, 0.0F, 0.0F}, 1.0F, 0.0F}};
    pair.children = {2, UINT32_MAX, UINT32_MAX, UINT32_MAX};
    pair.root_count = 2;
    pair.quality = {.facets = 3, .samples = 4, .rms_m = 1.1, .hausdorff_m = 2.0};
    return pair;
}

/// One way of being wrong, and what the message has to say of it.
struct Damage {
    std::function<void(ProxyPair&)> apply;
    std::string expected;
};

void check_refused(const std::vector<Damage>& damages) {
    for (const Damage& damage : damages) {
        ProxyPair pair = hand_made_pair();
        damage.apply(pair);
        const Result<void> checked = validate(pair);
        INFO(damage.expected);
        REQUIRE_FALSE(checked.has_value());
        CHECK(checked.error().code == ErrorCode::bad_data);
        CHECK_THAT(checked.error().message, Catch::Contains(damage.expected));
    }
}

} // namespace

TEST_CASE("A whole pair is right, and so is the smallest") {
    const Result<void> whole = validate(hand_made_pair());
    INFO((whole ? std::string() : whole.error().message));
    CHECK(whole.has_value());

    ProxyPair smallest;
    smallest.fine = ItemId{7};
    smallest.coarse = ItemId{2};
    smallest.samples.resize(1);
    smallest.facets.resize(1);
    smallest.nodes.resize(1);
    smallest.nodes[0].bounds = {glm::vec3(0.0F), glm::vec3(0.0F)};
    smallest.nodes[0].count = 1;
    smallest.quality = {.facets = 1, .samples = 1};
    CHECK(validate(smallest).has_value());
    CHECK_FALSE(is_refinable(smallest));
    CHECK(is_refinable(hand_made_pair()));
}

TEST_CASE("Pairs of nothing are refused") {
    check_refused({
        {[](ProxyPair& pair) { pair.coarse = kNone<ItemId>; }, "items: coarse is 4294967295"},
        {[](ProxyPair& pair) { pair.fine = kNone<ItemId>; }, "fine 4294967295"},
        {[](ProxyPair& pair) { pair.coarse = pair.fine; }, "expected two items"},
        {[](ProxyPair& pair) { pair.samples.clear(); }, "samples: their number is 0"},
        {[](ProxyPair& pair) { pair.facets.clear(); }, "facets: their number is 0"},
        {[](ProxyPair& pair) { pair.nodes.clear(); }, "nodes: their number is 0"},
    });
}

TEST_CASE("Numbers that do not exist are refused") {
    check_refused({
        {[](ProxyPair& pair) { pair.origin.z = double{kInfinity}; }, "whole: origin is"},
        {[](ProxyPair& pair) { pair.offset_m = kNan; }, "whole: offset_m is nan"},
        {[](ProxyPair& pair) { pair.offset_m = -1.0F; }, "whole: offset_m is -1"},
        {[](ProxyPair& pair) { pair.samples[2].point.x = kNan; }, "sample 2: point is nan"},
        {[](ProxyPair& pair) { pair.facets[3].normal.z = kNan; }, "facet 3: normal is"},
        {[](ProxyPair& pair) { pair.facets[3].normal *= 1.01F; }, "expected a unit one"},
        {[](ProxyPair& pair) { pair.facets[0].plane = kInfinity; }, "facet 0: plane is inf"},
        {[](ProxyPair& pair) { pair.nodes[1].axis = glm::vec3(0.0F); }, "node 1: axis is"},
        {[](ProxyPair& pair) { pair.nodes[1].bounds.lo.x = kNan; }, "node 1: bounds is nan"},
        {[](ProxyPair& pair) { pair.nodes[2].above = kNan; }, "node 2: below is -1 and above nan"},
        {[](ProxyPair& pair) { pair.nodes[0].cosine = kNan; }, "node 0: cosine is nan"},
        {[](ProxyPair& pair) { pair.splits[1].center.y = kNan; }, "split 1: center is"},
        {[](ProxyPair& pair) { pair.splits[1].radius = -1.0F; }, "split 1: radius is -1"},
        {[](ProxyPair& pair) { pair.splits[1].radius = kInfinity; }, "split 1: radius is inf"},
        {[](ProxyPair& pair) { pair.splits[3].offset = -0.1F; }, "split 3: offset is -0.1"},
        {[](ProxyPair& pair) { pair.quality.rms_m = -1.0; }, "rms_m -1"},
        {[](ProxyPair& pair) { pair.quality.hausdorff_m = double{kNan}; }, "hausdorff_m is nan"},
    });
}

TEST_CASE("Samples lie on facets that exist, no farther than announced") {
    check_refused({
        {[](ProxyPair& pair) { pair.samples[3].facet = 4; }, "sample 3: facet is 4 of 4"},
        {[](ProxyPair& pair) { pair.offset_m = 1.5F; },
         "sample 1: height over its facet is 2, more than offset_m 1.5"},
        {[](ProxyPair& pair) { pair.quality.samples = 3; }, "samples is 3, expected 4"},
    });
}

TEST_CASE("Nodes share out all samples and hold theirs") {
    check_refused({
        {[](ProxyPair& pair) { pair.nodes[0].count = 3; }, "node 0: count is 3 from 0"},
        {[](ProxyPair& pair) { pair.nodes[0].first_child = 2; }, "node 0: first_child is 2"},
        {[](ProxyPair& pair) { pair.nodes[1].first_child = 1; }, "node 1: first_child is 1"},
        {[](ProxyPair& pair) { pair.nodes[1].count = 1; }, "are not its own"},
        {[](ProxyPair& pair) { pair.nodes[2].first = UINT32_MAX; }, "are not its own"},
        {[](ProxyPair& pair) { pair.nodes[0].first_child = 0; }, "node 1: its parent is none"},
        {[](ProxyPair& pair) { pair.nodes[1].bounds.hi.x = 0.5F; }, "without sample 1"},
        {[](ProxyPair& pair) { pair.nodes[2].below = -0.5F; }, "sample 2 is -1"},
        {[](ProxyPair& pair) { pair.nodes[0].above = 1.0F; }, "sample 1 is 2"},
        {[](ProxyPair& pair) {
             pair.facets[3].normal = {0.8F, 0.6F, 0.0F};
         },
         "node 0: cosine is 0.9, the facet of sample 1 is outside the cone"},
    });
    // Rounding alone is not wrong: the unit vector is one only nearly.
    ProxyPair pair = hand_made_pair();
    for (ProxyNode& each : pair.nodes) {
        each.cosine = 1.0F;
    }
    const float one_less = 1.0F - std::numeric_limits<float>::epsilon();
    pair.facets[2].normal.y = one_less;
    CHECK(validate(pair).has_value());
}

TEST_CASE("Walks down the nodes fit their stack") {
    // A chain: each node leaves one sample aside.
    const auto chain = [](std::uint32_t levels) {
        ProxyPair pair = hand_made_pair();
        pair.samples.assign(levels, {{0.0F, 0.0F, 0.0F}, 1});
        pair.quality.samples = levels;
        pair.nodes = {node(0, levels, 0.0F, 0.0F)};
        for (std::uint32_t level = 1; level < levels; ++level) {
            pair.nodes[pair.nodes.size() - 1].first_child =
                static_cast<std::uint32_t>(pair.nodes.size());
            pair.nodes.push_back(node(level - 1, 1, 0.0F, 0.0F));
            pair.nodes.push_back(node(level, levels - level, 0.0F, 0.0F));
        }
        return pair;
    };
    CHECK(validate(chain(kMostProxyLevels)).has_value());
    const Result<void> deeper = validate(chain(kMostProxyLevels + 1));
    REQUIRE_FALSE(deeper.has_value());
    CHECK_THAT(deeper.error().message, Catch::Contains("its level is 41"));
}

TEST_CASE("Triangles are roots or children of one, their splits nested") {
    check_refused({
        {[](ProxyPair& pair) { pair.splits.pop_back(); }, "3 splits, 4 children and 2 roots"},
        {[](ProxyPair& pair) { pair.splits.clear(); }, "0 splits, 4 children"},
        {[](ProxyPair& pair) { pair.children.pop_back(); }, "3 children"},
        {[](ProxyPair& pair) { pair.root_count = 0; }, "0 roots"},
        {[](ProxyPair& pair) { pair.root_count = 5; }, "5 roots"},
        {[](ProxyPair& pair) { pair.root_count = 1; }, "triangle 1: its place is below none"},
        {[](ProxyPair& pair) { pair.root_count = 3; }, "triangle 2: its place is below another"},
        {[](ProxyPair& pair) { pair.children[0] = 3; }, "triangle 0: children is 3"},
        {[](ProxyPair& pair) { pair.children[0] = 0; }, "triangle 0: children is 0"},
        {[](ProxyPair& pair) { pair.children[1] = 2; }, "triangle 1: children is 2"},
        {[](ProxyPair& pair) { pair.splits[3].radius = 3.5F; }, "do not hold split 3"},
        {[](ProxyPair& pair) { pair.splits[0].offset = 1.0F; }, "do not hold split 2"},
        {[](ProxyPair& pair) { pair.splits[0].offset = 3.0F; }, "split 0: offset is 3"},
        {[](ProxyPair& pair) { pair.quality.facets = 4; }, "quality: facets is 4, expected 3"},
    });
}

TEST_CASE("Bytes of a pair are those of its arrays") {
    CHECK(memory_bytes(ProxyPair{}) == 0);
    CHECK(memory_bytes(hand_made_pair()) == 4 * 16 + 4 * 16 + 3 * 64 + 4 * 20 + 4 * 4);
}
