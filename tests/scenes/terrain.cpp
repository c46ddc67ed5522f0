#include "scenes/terrain.hpp"

#include <farfield/image/height_grid.hpp>
#include <farfield/scene/scene.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace {

using farfield::HeightGrid;
using farfield::Scene;
using farfield::scenes::TerrainOptions;
namespace scenes = farfield::scenes;

std::string message_of(const TerrainOptions& options) {
    const auto scene = scenes::make_terrain(options);
    return scene ? std::string("made") : scene.error().message;
}

HeightGrid grid_of(const Scene& scene) {
    const auto gridded = farfield::height_grid_of(scene.meshes[0]);
    REQUIRE(gridded.has_value());
    return gridded->grid;
}

} // namespace

TEST_CASE("terrain names what it cannot be made of", "[terrain]") {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    CHECK(message_of({.posts = 8}) == "terrain: posts is 8.000000, expected 9 to 4097");
    CHECK(message_of({.posts = 4098}) == "terrain: posts is 4098.000000, expected 9 to 4097");
    CHECK(
        message_of({.posts = 9, .side_m = 0.0}) ==
        "terrain: side_m is 0.000000, expected a finite value above 0"
    );
    CHECK(message_of({.posts = 9, .side_m = nan}).find("terrain: side_m is ") == 0);
    CHECK(message_of({.posts = 9, .relief_m = -1.0}).find("terrain: relief_m is -1.0") == 0);
    CHECK(message_of({.posts = 9, .relief_m = 0.0}) == "made"); // flat
}

TEST_CASE("terrain is a grid of the size asked for", "[terrain]") {
    for (const int posts : {9, 100, 513}) {
        const Scene scene = scenes::make_terrain({.posts = posts, .side_m = 5000.0}).value();
        const auto valid = farfield::validate(scene);
        INFO((valid ? std::string() : valid.error().message));
        REQUIRE(valid.has_value());
        const HeightGrid grid = grid_of(scene);
        CHECK(grid.columns == static_cast<std::uint32_t>(posts));
        CHECK(grid.rows == static_cast<std::uint32_t>(posts));
        CHECK(grid.spacing_m == Approx(5000.0 / (posts - 1)));
        CHECK(grid.origin.x == Approx(-2500.0));
        CHECK(scene.meshes[0].bounds.lo.y == Approx(0.0).margin(1e-6));
        CHECK(scene.meshes[0].bounds.hi.y == Approx(1200.0));
        CHECK(scene.meshes[0].splittable);
    }
}

TEST_CASE("terrain has ridges, slopes and colours worth looking at", "[terrain]") {
    const Scene scene = scenes::make_terrain().value();
    const HeightGrid grid = grid_of(scene);
    // Slopes of mountains: mostly 10 to 45 degrees, nearly none steeper than 70.
    int gentle = 0;
    int steep = 0;
    int walls = 0;
    double curvature = 0.0;
    for (std::uint32_t row = 1; row + 1 < grid.rows; ++row) {
        for (std::uint32_t column = 1; column + 1 < grid.columns; ++column) {
            const auto h = [&](std::uint32_t c, std::uint32_t r) {
                return double{grid.heights[grid.post(c, r)]};
            };
            const double rise = std::hypot(
                (h(column + 1, row) - h(column - 1, row)) / (2.0 * grid.spacing_m),
                (h(column, row + 1) - h(column, row - 1)) / (2.0 * grid.spacing_m)
            );
            gentle += rise < 0.18 ? 1 : 0;
            steep += rise > 1.0 ? 1 : 0;
            walls += rise > 2.7 ? 1 : 0;
            curvature += std::abs(h(column + 1, row) + h(column - 1, row) - 2.0 * h(column, row));
        }
    }
    const double all = 511.0 * 511.0;
    CHECK(gentle > 0.05 * all);
    CHECK(gentle < 0.6 * all);
    CHECK(steep > 0.005 * all);
    CHECK(steep < 0.3 * all);
    CHECK(walls < 0.01 * all);
    // Detail down to single posts, or a coarse model would be as good.
    CHECK(curvature / all > 0.5);

    const farfield::Texture& texture = scene.textures[0];
    CHECK(texture.width == scenes::kTerrainTexels);
    int snow = 0;
    int green = 0;
    double neighbours = 0.0;
    for (std::size_t i = 0; i + 4 < texture.pixels.size(); i += 4) {
        const int r = texture.pixels[i];
        const int g = texture.pixels[i + 1];
        const int b = texture.pixels[i + 2];
        snow += std::min({r, g, b}) > 200 ? 1 : 0;
        green += g > r && g > b + 10 ? 1 : 0;
        neighbours += std::abs(g - texture.pixels[i + 5]);
    }
    const double texels = 512.0 * 512.0;
    CHECK(snow > 0.01 * texels);
    CHECK(snow < 0.4 * texels);
    CHECK(green > 0.1 * texels);
    CHECK(neighbours / texels > 2.0);
}

TEST_CASE("terrain depends on its seed alone", "[terrain]") {
    const TerrainOptions small{.posts = 65};
    const Scene first = scenes::make_terrain(small).value();
    const Scene second = scenes::make_terrain(small).value();
    CHECK(farfield::digest(first) == farfield::digest(second));
    const Scene other = scenes::make_terrain({.posts = 65, .seed = 2}).value();
    CHECK(farfield::digest(first) != farfield::digest(other));
}
