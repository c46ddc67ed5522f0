#pragma once

#include "image/layered_images.hpp"
#include "support/random.hpp"
#include <farfield/image/layered_depth_image.hpp>
#include <farfield/technique/placement_map.hpp>

#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

namespace farfield::support {

/// A map that passes `validate`: three cells, two sites under one root, and `images` images, by
/// turns of the one site and the other, each of them shown in one range of yaw.
[[nodiscard]] inline PlacementMap hand_made_placement(std::uint32_t images = 3) {
    PlacementMap map;
    map.options.max_primitives = 1000;
    map.options.target_primitives = 900;
    map.options.eyes = {{-1.0, 0.0, -2.0}, {3.0, 0.5, 2.0}};
    map.options.max_pitch = 0.25;
    map.origin = {1.0, 2.0, 3.0};
    map.primitives = 1500;
    for (std::uint32_t i = 0; i < 3; ++i) {
        const float x = 10.0F * static_cast<float>(i);
        map.cells.push_back({2 * i + 1, {{x, 0.0F, -30.0F}, {x + 5.0F, 4.0F, -20.0F}}, 500});
    }
    map.model_digest = model_digest(map.cells);
    map.spacing = {4.0, 0.5, 4.0};
    map.nodes = {{1, 1, UINT32_MAX}, {0, 0, 0}, {0, 0, 1}};
    for (std::uint32_t site = 0; site < 2; ++site) {
        const double x = -1.0 + 2.0 * site;
        const auto first_range = static_cast<std::uint32_t>(map.ranges.size());
        map.ranges.push_back({-std::numbers::pi, UINT32_MAX, 800});
        for (std::uint32_t image = site; image < images; image += 2) {
            map.ranges.push_back({-3.0 + 6.0 * image / images, image, 700 + image});
        }
        const auto count = static_cast<std::uint32_t>(map.ranges.size()) - first_range;
        map.sites.push_back({{{x, 0.0, -2.0}, {x + 2.0, 0.5, 2.0}}, 1, first_range, count});
    }
    for (std::uint32_t image = 0; image < images; ++image) {
        PlacedImage placed;
        placed.site = image % 2;
        placed.view = straight_view(8, 6);
        placed.near_depth = 10.0 + image;
        placed.far_depth = 40.0;
        placed.primitives = 500;
        placed.first_cell = image;
        placed.cell_count = 1;
        map.images.push_back(placed);
        map.replaced.push_back(image % 3);
    }
    map.quality = {17, 1, 702, 1500, 0.125};
    return map;
}

/// A small image, another one for each seed; every other one with points.
[[nodiscard]] inline LayeredDepthImage hand_made_layers(std::uint32_t seed, int width = 8) {
    Random random(seed + 1);
    LayeredDepthImage image = random_layers(random, straight_view(width, 6), 10.0, 40.0, 3);
    for (std::size_t i = 0; seed % 2 == 1 && i < image.samples.size(); ++i) {
        PositionTexel& point = image.points.emplace_back();
        point.point = random.vector(-5.0F, 5.0F);
        point.item = ItemId{random.below(100)};
    }
    return image;
}

} // namespace farfield::support
