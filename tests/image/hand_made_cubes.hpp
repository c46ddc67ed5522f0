#pragma once

#include <farfield/image/color_cube_model.hpp>

#include <cstdint>

namespace farfield::support {

/// A small model with something of everything, by hand: a shape of five triangles in two leaves
/// that is there twice, an item that is drawn whole, and two items of single triangles, the second
/// of which has none.
inline ColorCubeModel hand_made_cubes() {
    constexpr std::uint32_t kLast = ColorCubeTree::kLast;
    const auto cube = [](std::uint8_t seed) {
        ColorCube result;
        for (std::uint8_t face = 0; face < 6; ++face) {
            const auto alpha = static_cast<std::uint8_t>(seed + 7 * face);
            result.faces[face] = {alpha / 2, alpha / 3, alpha, alpha};
        }
        return result;
    };
    ColorCubeModel model;
    model.origin = {1000.5, -2.0, 3e6};
    model.item_count = 5;

    ColorCubeTree& shape = model.trees.emplace_back();
    shape.lo = {-1.0F, -1.0F, -1.0F};
    shape.edge = 2.0F;
    shape.cells = {{1, 0x81, {0xF0, 0xF0, 0xF0}}, {0, 0, {0xF3, 0x77, 0xE0}}, {3, 0, {}}};
    shape.light_sets = 2;
    shape.cubes = {cube(10), cube(20), cube(30), cube(40), cube(50), cube(60)};
    shape.gains = {{{64, 65, 66}}, {{0xFF, 0x7F, 0}}, {{0, 1, 2}}};
    shape.bounds = {{-1.0F, -1.0F, -1.0F}, {1.0F, 1.0F, 1.0F}};
    shape.level_factors = {{1.0F, 0.25F, 4.0F, 1.5F, 2.0F, 0.5F}, {1, 1, 1, 1, 1, 1}};
    shape.contents = {0, 1, 2 | kLast, 2, 3, 4 | kLast};
    shape.primitives = {{kNone<ItemId>, 0, 5}};
    shape.quality = {1, 2};

    ColorCubeTree& scene = model.trees.emplace_back();
    scene.lo = {-10.0F, 0.25F, 5.0F};
    scene.edge = 40.0F;
    // The second child of the root has a child of its own.
    scene.cells = {
        {1, 0x07, {0xF0, 0xF0, 0xF0}},
        {0, 0, {0xF0, 0xA5, 0xF0}},
        {4, 0x20, {0xF0, 0xF0, 0x10}},
        {2, 0, {0xF0, 0x00, 0xFF}},
        {5, 0, {0xF0, 0xF0, 0xF0}}};
    scene.cubes = {cube(70), cube(80), cube(90), cube(100), cube(110)};
    scene.contents = {0, 2 | kLast, 3, 4, 1 | kLast, 2, 4 | kLast};
    scene.reference_count = 2;
    scene.overhang = 0.5F;
    scene.items = {ItemId{3}};
    scene.item_primitives = {12};
    scene.primitives = {{ItemId{0}, 3, 2}, {ItemId{4}, 5, 0}};
    scene.quality = {2, 3};

    CubeReference reference;
    reference.item = ItemId{2};
    reference.light_set = 1;
    reference.scale = 2.5F;
    reference.rotation = {{0.0F, 0.0F, -1.0F}, {0.0F, 1.0F, 0.0F}, {1.0F, 0.0F, 0.0F}};
    reference.translation = {1.0F, 2.0F, 6.0F};
    model.references.push_back(reference);
    reference = {};
    reference.item = ItemId{1};
    model.references.push_back(reference);
    return model;
}

} // namespace farfield::support
