#include "technique/sprite_world.hpp"

#include "support/random.hpp"
#include <farfield/image/build_proxy.hpp>
#include <farfield/partition/bsp.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

namespace farfield::support {

namespace {

/// Heights are multiples of 1/64 m, so that moving a world far away is exact.
double rounded(double value) {
    return std::round(value * 64.0) / 64.0;
}

} // namespace

double hills(double x, double z) {
    // Polynomials and corners alone, for plans that do not hang on the mathematics library.
    const auto wave = [](double t) {
        const double part = t - std::floor(t);
        return 16.0 * part * part * (1.0 - part) * (1.0 - part);
    };
    return 30.0 * wave(2.0 * x + 0.2) * wave(1.5 * z) + 12.0 * wave(7.0 * x + 3.0 * z) +
           6.0 * std::abs(wave(13.0 * z - 5.0 * x) - 0.5);
}

HeightGrid make_grid(const SpriteWorldOptions& options, const HeightAt& height) {
    HeightGrid grid;
    grid.columns = options.posts;
    grid.rows = options.posts;
    grid.spacing_m = options.side_m / (options.posts - 1);
    grid.origin = options.offset - glm::dvec3(options.side_m / 2.0, 0.0, options.side_m / 2.0);
    for (std::uint32_t row = 0; row < options.posts; ++row) {
        for (std::uint32_t column = 0; column < options.posts; ++column) {
            const double x = static_cast<double>(column) / (options.posts - 1);
            const double z = static_cast<double>(row) / (options.posts - 1);
            grid.heights.push_back(static_cast<float>(rounded(height(x, z))));
        }
    }
    return grid;
}

SpriteWorld make_sprite_world(const SpriteWorldOptions& options, const HeightAt& height) {
    SpriteWorld world;
    world.grid = make_grid(options, height);
    const std::uint32_t cells = options.posts - 1;
    std::vector<Box3d> triangles;
    Box3d all;
    for (std::uint32_t triangle = 0; triangle < 2 * cells * cells; ++triangle) {
        const std::uint32_t column = triangle / 2 % cells;
        const std::uint32_t row = triangle / 2 / cells;
        Box3d box;
        for (const std::size_t post :
             {world.grid.post(column, row),
              world.grid.post(column + 1, row),
              world.grid.post(column, row + 1),
              world.grid.post(column + 1, row + 1)}) {
            const std::size_t post_row = post / options.posts;
            const glm::dvec3 at(
                static_cast<double>(post % options.posts) * world.grid.spacing_m,
                double{world.grid.heights[post]},
                static_cast<double>(post_row) * world.grid.spacing_m
            );
            box = unite(box, world.grid.origin + at);
        }
        triangles.push_back(box);
        all = unite(all, box);
    }
    world.objects.push_back({all, triangles.size(), true});
    Random random(7);
    for (std::uint32_t i = 0; i < options.trees; ++i) {
        const double x = random.uniform(0.1, 0.9);
        const double z = random.uniform(0.1, 0.9);
        const glm::dvec3 foot =
            world.grid.origin +
            glm::dvec3(
                rounded(x * options.side_m), rounded(height(x, z)), rounded(z * options.side_m)
            );
        world.objects.push_back({{foot, foot + glm::dvec3(4.0, 8.0, 4.0)}, options.item_cost});
    }
    auto tree = partition::build_bsp(
        world.objects,
        {.max_piece_primitives = 128},
        [&](std::uint32_t, std::uint32_t primitive) { return triangles[primitive]; }
    );
    REQUIRE(tree.has_value());
    world.hierarchy = std::move(*tree);
    const ProxyItems items{ItemId{0}, make_id<ItemId>(world.objects.size())};
    auto proxy = options.refinable
                     ? build_refined_proxy(world.grid, items, {.root_squares = 2})
                     : build_grid_proxy(world.grid, items, {.squares = options.squares});
    INFO((proxy ? std::string() : proxy.error().message));
    REQUIRE(proxy.has_value());
    for (const Object& object : world.objects) {
        world.item_primitives.push_back(object.primitives);
    }
    world.item_primitives.push_back(proxy->pair.facets.size());
    world.posts = std::move(proxy->posts);
    world.pairs.push_back(std::move(proxy->pair));
    return world;
}

} // namespace farfield::support
