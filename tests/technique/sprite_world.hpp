#pragma once

#include <farfield/image/height_grid.hpp>
#include <farfield/image/proxy_pair.hpp>
#include <farfield/partition/hierarchy.hpp>

#include <glm/vec3.hpp>

#include <cstdint>
#include <functional>
#include <vector>

/// Terrains with a coarse model, and perhaps things on them: worlds for keyframes.
namespace farfield::support {

/// Height of a terrain at a place, both from 0 to 1. [m]
using HeightAt = std::function<double(double x, double z)>;

struct SpriteWorldOptions {
    std::uint32_t posts = 65; ///< a side
    double side_m = 1024.0;
    std::uint32_t squares = 8;        ///< a side of a fixed coarse model
    bool refinable = false;           ///< a coarse model in levels instead
    std::uint32_t trees = 0;          ///< items without a pair
    glm::dvec3 offset{0.0};           ///< of everything [m]
    std::uint64_t item_cost = 50'000; ///< triangles of each of the trees
};

/// Item 0 is the terrain, which is split; then trees; the last item is the coarse model.
struct SpriteWorld {
    HeightGrid grid;
    std::vector<Object> objects;
    Hierarchy hierarchy;
    std::vector<ProxyPair> pairs;
    std::vector<std::uint32_t> posts; ///< corners of the coarse model's triangles, three each
    std::vector<std::uint64_t> item_primitives; ///< coarse model included
};

[[nodiscard]] HeightGrid make_grid(const SpriteWorldOptions& options, const HeightAt& height);

/// Hills and ridges of up to 60 m on 1024.
[[nodiscard]] double hills(double x, double z);

[[nodiscard]] SpriteWorld
make_sprite_world(const SpriteWorldOptions& options, const HeightAt& height = hills);

} // namespace farfield::support
