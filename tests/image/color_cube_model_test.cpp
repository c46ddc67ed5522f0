#include "image/hand_made_cubes.hpp"
#include <farfield/image/color_cube_model.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

using namespace farfield;
using farfield::support::hand_made_cubes;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kLast = ColorCubeTree::kLast;

/// One way of being wrong, and what the message has to say of it.
struct Damage {
    std::function<void(ColorCubeModel&)> apply;
    std::string expected;
};

void check_refused(const std::vector<Damage>& damages) {
    for (const Damage& damage : damages) {
        ColorCubeModel model = hand_made_cubes();
        damage.apply(model);
        const Result<void> checked = validate(model);
        INFO(damage.expected);
        REQUIRE_FALSE(checked.has_value());
        CHECK(checked.error().code == ErrorCode::bad_data);
        CHECK_THAT(checked.error().message, Catch::Contains(damage.expected));
    }
}

/// A tree that is a chain of `levels` cells, each the only child of the one before.
ColorCubeModel chain(std::uint32_t levels) {
    ColorCubeModel model;
    model.item_count = 1;
    ColorCubeTree& tree = model.trees.emplace_back();
    tree.edge = 1.0F;
    for (std::uint32_t i = 0; i < levels; ++i) {
        tree.cells.push_back({i + 1, 0x10, {0xF0, 0xF0, 0xF0}});
    }
    tree.cells.push_back({});
    tree.cubes.resize(tree.cells.size());
    tree.items = {ItemId{0}};
    tree.item_primitives = {1};
    tree.contents = {kLast};
    tree.quality = {levels, 1};
    return model;
}

} // namespace

TEST_CASE("A whole model is right, and so is the smallest") {
    const Result<void> whole = validate(hand_made_cubes());
    INFO((whole ? "" : whole.error().message));
    CHECK(whole.has_value());
    CHECK(validate(chain(0)).has_value());
}

TEST_CASE("Models without trees, or of other items than those of the scene, are refused") {
    check_refused({
        {[](auto& m) { m = {}; }, "no tree"},
        {[](auto& m) { m.origin.y = std::nan(""); }, "origin is 1000.5"},
        {[](auto& m) { m.item_count = 6; }, "item_count is 6, but 5 items"},
        {[](auto& m) { m.references[1].item = ItemId{5}; }, "reference 1: item is 5 of 5"},
        {[](auto& m) { m.references[0].item = ItemId{3}; }, "items 0: item is 3, which is there"},
        {[](auto& m) { m.trees[1].items[0] = kNone<ItemId>; }, "items 0: item is 4294967295"},
        {[](auto& m) { m.trees[1].primitives[1].item = ItemId{0}; }, "primitives 1: item is 0"},
        {[](auto& m) { m.trees[1].primitives[0].item = kNone<ItemId>; },
         "primitives 0: item is 4294967295"},
    });
}

TEST_CASE("References are checked number by number") {
    check_refused({
        {[](auto& m) { m.references[1].tree = 1; }, "reference 1: tree is 1, expected one before"},
        {[](auto& m) { m.references[0].light_set = 2; }, "reference 0: light_set is 2 of 2"},
        {[](auto& m) { m.references[0].scale = 0.0F; }, "reference 0: scale is 0"},
        {[](auto& m) { m.references[0].scale = -1.0F; }, "reference 0: scale is -1"},
        {[](auto& m) { m.trees[1].overhang = -0.5F; }, "tree 1: overhang is -0.5"},
        {[](auto& m) { m.trees[1].overhang = kInfinity; }, "tree 1: overhang is inf"},
        {[](auto& m) { m.references[0].scale = kInfinity; }, "reference 0: scale is inf"},
        {[](auto& m) { m.references[0].scale = kNan; }, "reference 0: scale is nan"},
        // A mirror image, a shear above 1e-4, something that is no number.
        {[](auto& m) { m.references[1].rotation[2][2] = -1.0F; }, "reference 1: rotation is no"},
        {[](auto& m) { m.references[1].rotation[1][0] = 2e-4F; }, "reference 1: rotation is no"},
        {[](auto& m) { m.references[1].rotation[0] *= 1.001F; }, "reference 1: rotation is no"},
        {[](auto& m) { m.references[1].rotation[0][1] = kNan; }, "rotation is no rotation: 1 nan"},
        {[](auto& m) { m.references[1].translation.z = kInfinity; }, "translation is 0 0 inf"},
    });
    ColorCubeModel model = hand_made_cubes();
    model.references[1].rotation[1][0] = 0.5e-4F;
    CHECK(validate(model).has_value());
}

TEST_CASE("Trees have a place and as many numbers as they say") {
    check_refused({
        {[](auto& m) { m.trees[0].lo.x = kNan; }, "tree 0: lo is nan -1 -1"},
        {[](auto& m) { m.trees[1].edge = 0.0F; }, "tree 1: edge is 0"},
        {[](auto& m) { m.trees[0].bounds.hi.y = kNan; }, "tree 0: bounds is -1 -1 -1 to 1 nan 1"},
        {[](auto& m) { m.trees[0].bounds.lo.z = kInfinity; },
         "tree 0: bounds is -1 -1 inf to 1 1 1"},
        {[](auto& m) { std::swap(m.trees[0].bounds.lo.x, m.trees[0].bounds.hi.x); },
         "tree 0: bounds is 1 -1 -1 to -1 1 1"},
        {[](auto& m) { m.trees[0].gains[2].stored[1] = 0x80; },
         "tree 0, cell 2: gain 1 is stored as 128, expected at most 127"},
        {[](auto& m) { m.trees[0].gains[0].stored[2] = 0xFF; },
         "tree 0, cell 0: gain 2 is stored as 255"},
        {[](auto& m) { m.trees[0].level_factors.pop_back(); },
         "tree 0: the number of level_factors is 1, expected 2"},
        {[](auto& m) { m.trees[0].level_factors[1][4] = kNan; },
         "tree 0, level 1: factor 4 is nan"},
        {[](auto& m) { m.trees[0].level_factors[0][5] = 4.5F; },
         "tree 0, level 0: factor 5 is 4.5"},
        {[](auto& m) {
             m.trees[1].level_factors = {{1, 1, 1, 1, 1, 1}};
         },
         "tree 1 has level_factors and no gains"},
        {[](auto& m) { m.trees[1].edge = kNan; }, "tree 1: edge is nan"},
        {[](auto& m) { m.trees[1].edge = kInfinity; }, "tree 1: edge is inf"},
        {[](auto& m) { m.trees[1].edge = 1e-31F; }, "tree 1: edge is 1e-31"},
        {[](auto& m) {
             m.trees[1].lo.x = 3e38F;
             m.trees[1].edge = 3e38F;
         },
         "tree 1: edge is 3e+38 from 3e+38"},
        {[](auto& m) { m.trees[0].cells.clear(); }, "tree 0: the number of cells is 0"},
        {[](auto& m) { m.trees[0].reference_count = 1; }, "tree 0: reference_count is 1"},
        {[](auto& m) { m.trees[1].reference_count = 1; }, "reference_count is 1, expected 2"},
        {[](auto& m) { m.trees[1].item_primitives.push_back(3); }, "item_primitives is 2"},
        {[](auto& m) {
             m.trees[0].primitives.push_back({kNone<ItemId>, 5, 0});
         },
         "tree 0 is referred to and has 0 items and 2 groups"},
        {[](auto& m) { m.trees[0].primitives.clear(); }, "and 0 groups"},
        {[](auto& m) {
             m.trees[0].items = {ItemId{0}};
             m.trees[0].item_primitives = {1};
         },
         "tree 0 is referred to and has 1 items"},
        {[](auto& m) { m.trees[0].primitives[0].item = ItemId{0}; },
         "tree 0, primitives 0: item is 0, expected none"},
        {[](auto& m) { m.trees[0].primitives[0].first = 1; },
         "tree 0, primitives 0: first is 1, expected 0"},
        {[](auto& m) { m.trees[1].primitives[1].first = 6; },
         "tree 1, primitives 1: first is 6, expected 5"},
        // A number that would take much memory to follow.
        {[](auto& m) { m.trees[0].primitives[0].count = 1U << 30U; },
         "tree 0 has 6 contents for 1073741824"},
    });
}

TEST_CASE("Cells are in one place each, after their parents") {
    check_refused({
        {[](auto& m) { m.trees[0].cells[0].first = 0; }, "tree 0, cell 0: first is 0 of 2"},
        {[](auto& m) { m.trees[1].cells[2].first = 2; }, "tree 1, cell 2: first is 2 of 1"},
        {[](auto& m) { m.trees[0].cells[0].first = 2; }, "tree 0, cell 0: first is 2 of 2"},
        {[](auto& m) { m.trees[0].cells[0].first = UINT32_MAX; }, "first is 4294967295 of 2"},
        {[](auto& m) { m.trees[1].cells[2].first = 3; },
         "tree 1, cell 2: first is 3, but cell 3 is the child of another"},
        {[](auto& m) { m.trees[0].cells[0].octants = 0x01; }, "tree 0, cell 2 is no child"},
        {[](auto& m) { m.trees[0].cells.push_back({}); }, "tree 0, cell 3 is no child"},
        {[](auto& m) { m.trees[0].cells[1].extent[2] = 0x89; },
         "tree 0, cell 1: extent is 9 to 8 along axis 2"},
        {[](auto& m) { m.trees[1].quality.leaves = 4; }, "tree 1: quality is 4 leaves and depth 2"},
        {[](auto& m) { m.trees[1].quality.depth = 1; }, "quality is 3 leaves and depth 1"},
    });
    CHECK(validate(chain(20)).has_value());
    const Result<void> deep = validate(chain(21));
    REQUIRE_FALSE(deep.has_value());
    CHECK_THAT(
        deep.error().message,
        Catch::Contains("tree 0, cell 20 has children 21 levels below the root")
    );
}

TEST_CASE("Lists of leaves end, are apart, and hold every number") {
    check_refused({
        {[](auto& m) { m.trees[0].contents[5] &= ~kLast; },
         "tree 0, cell 2: first is 3, whose list does not end within 6"},
        {[](auto& m) { m.trees[0].cells[2].first = 6; }, "cell 2: first is 6, whose list"},
        {[](auto& m) { m.trees[0].cells[2].first = UINT32_MAX - 1; }, "first is 4294967294, whose"},
        {[](auto& m) { m.trees[0].cells[2].first = CubeCell::kNothing; },
         "tree 0: 3 of the contents are in no leaf"},
        {[](auto& m) { m.trees[0].cells[2].first = 2; },
         "tree 0, cell 2: entry 2 of the contents is 2, which is in the list of another leaf"},
        {[](auto& m) { m.trees[0].contents[2] &= ~kLast; }, "entry 3 of the contents is 2, which"},
        {[](auto& m) { m.trees[0].contents[1] = 5; }, "entry 1 of the contents is 5, which does"},
        {[](auto& m) { m.trees[0].contents[1] = 0; }, "entry 1 of the contents is 0, which the"},
        {[](auto& m) { m.trees[0].contents[1] |= kLast; }, "tree 0: 1 of the contents are in no"},
        {[](auto& m) { m.trees[0].contents[1] = 3; }, "tree 0: number 1 of 5 is in no leaf"},
    });
}

TEST_CASE("Colours are as many as cells and premultiplied") {
    check_refused({
        {[](auto& m) { m.trees[1].light_sets = 0; }, "tree 1: the number of cubes is 5 for 0"},
        {[](auto& m) { m.trees[0].cubes.pop_back(); }, "the number of cubes is 5 for 2 light_sets"},
        {[](auto& m) { m.trees[0].gains.pop_back(); }, "tree 0: the number of gains is 2 for 3"},
        {[](auto& m) { m.trees[0].cubes[4].faces[5].r = 86; },
         "tree 0, cell 1, light set 1: face is 5 with 86 28 85, more than its alpha 85"},
        {[](auto& m) { m.trees[1].cubes[0].faces[0].g = 71; }, "face is 0 with 35 71 70"},
        {[](auto& m) { m.trees[1].cubes[0].faces[0].b = 71; }, "face is 0 with 35 23 71"},
    });
}

TEST_CASE("Bytes of a model are those of its arrays") {
    const ColorCubeModel model = hand_made_cubes();
    CHECK(memory_bytes(model.trees[0]) == 3 * 8 + 6 * 24 + 3 * 3 + 2 * 24 + 6 * 4 + 12);
    CHECK(memory_bytes(model.trees[1]) == 5 * 8 + 5 * 24 + 7 * 4 + 8 + 2 * 12);
    CHECK(
        memory_bytes(model) ==
        memory_bytes(model.trees[0]) + memory_bytes(model.trees[1]) + 2 * sizeof(CubeReference)
    );
}
