#include "terrain.hpp"

#include "noise.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace farfield::scenes {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr int kLeastPosts = 9;
constexpr int kMostPosts = 4097;
/// Wavelength of the largest mountains, as a share of the side.
constexpr double kMountain = 0.62;
constexpr int kOctaves = 9;

const dvec3 kForest(66.0, 84.0, 48.0);
const dvec3 kMeadow(124.0, 134.0, 78.0);
const dvec3 kScree(150.0, 138.0, 118.0);
const dvec3 kRock(112.0, 104.0, 97.0);
const dvec3 kDarkRock(82.0, 77.0, 75.0);
const dvec3 kSnow(238.0, 242.0, 248.0);
const dvec3 kGravel(164.0, 156.0, 134.0);

/// Noise of several octaves, each about half as wide and as high.
double rough(const dvec2& place, double wavelength, int octaves, std::uint64_t seed) {
    double sum = 0.0;
    double weight = 1.0;
    double scale = 2.0 / wavelength;
    for (int octave = 0; octave < octaves; ++octave) {
        sum += weight *
               noise(place.x * scale, place.y * scale, seed + static_cast<std::uint64_t>(octave));
        weight *= 0.5;
        scale *= 2.03; // not exactly 2, so that the lattices do not line up
    }
    return sum;
}

/// Ridges about [0, 1]: octaves are weighed by what is below them, so that valleys stay smooth.
double ridges(const dvec2& place, double wavelength, std::uint64_t seed) {
    double sum = 0.0;
    double weight = 1.0;
    double height = 0.6;
    double scale = 2.0 / wavelength;
    for (int octave = 0; octave < kOctaves; ++octave) {
        const double wave =
            noise(place.x * scale, place.y * scale, seed + static_cast<std::uint64_t>(octave));
        double ridge = std::max(1.0 - 1.9 * std::abs(wave), 0.0);
        ridge *= ridge * weight;
        weight = std::clamp(1.9 * ridge, 0.0, 1.0);
        sum += height * ridge;
        height *= 0.43;
        scale *= 2.07;
    }
    return sum;
}

/// Height at a place in sides from the middle, before it is scaled.
double raw_height(const dvec2& place, std::uint64_t seed) {
    // Bent, so that ridges wind.
    const dvec2 bent = place + 0.07 * dvec2(
                                          rough(place, 0.5, 2, seed + 100),
                                          rough(place + dvec2(7.3, 1.9), 0.5, 2, seed + 200)
                                      );
    const double uplift = glm::smoothstep(-0.45, 0.45, rough(place, 0.9, 2, seed + 300));
    const double mountains = ridges(bent, kMountain, seed + 400);
    const double hills = 0.5 + 0.5 * rough(bent, 0.3, 5, seed + 500);
    return (0.25 + 0.75 * uplift) * mountains + 0.10 * hills;
}

/// Heights by post, row by row. [m]
std::vector<double> make_heights(const TerrainOptions& options) {
    const int posts = options.posts;
    std::vector<double> heights;
    heights.reserve(static_cast<std::size_t>(posts) * static_cast<std::size_t>(posts));
    for (int row = 0; row < posts; ++row) {
        for (int column = 0; column < posts; ++column) {
            const dvec2 place(
                static_cast<double>(column) / (posts - 1) - 0.5,
                static_cast<double>(row) / (posts - 1) - 0.5
            );
            heights.push_back(raw_height(place, options.seed));
        }
    }
    const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
    const double lowest = *low;
    const double scale = *high > lowest ? options.relief_m / (*high - lowest) : 0.0;
    for (double& height : heights) {
        height = (height - lowest) * scale;
    }
    return heights;
}

/// Heights between posts, for the picture.
class Heights {
  public:
    Heights(const TerrainOptions& options, const std::vector<double>& heights)
        : posts_(options.posts), spacing_m_(options.side_m / (options.posts - 1)),
          heights_(&heights) {}

    /// @param at in posts, brought onto the grid
    [[nodiscard]] double height(const dvec2& at) const {
        const double last = posts_ - 1;
        const double x = std::clamp(at.x, 0.0, last);
        const double z = std::clamp(at.y, 0.0, last);
        const int column = std::min(static_cast<int>(x), posts_ - 2);
        const int row = std::min(static_cast<int>(z), posts_ - 2);
        return std::lerp(
            std::lerp(post(column, row), post(column + 1, row), x - column),
            std::lerp(post(column, row + 1), post(column + 1, row + 1), x - column),
            z - row
        );
    }

    /// Metres up a metre, over `reach` posts.
    [[nodiscard]] dvec2 slope(const dvec2& at, double reach) const {
        const dvec2 dx(reach, 0.0);
        const dvec2 dz(0.0, reach);
        return dvec2(height(at + dx) - height(at - dx), height(at + dz) - height(at - dz)) /
               (2.0 * reach * spacing_m_);
    }

    /// How far a place stands out over those around it: > 0 on ridges, < 0 in valleys.
    [[nodiscard]] double outstanding(const dvec2& at, double reach) const {
        const dvec2 dx(reach, 0.0);
        const dvec2 dz(0.0, reach);
        const double around =
            (height(at + dx) + height(at - dx) + height(at + dz) + height(at - dz)) / 4.0;
        return (height(at) - around) / (reach * spacing_m_);
    }

  private:
    [[nodiscard]] double post(int column, int row) const {
        return (*heights_
        )[static_cast<std::size_t>(row) * static_cast<std::size_t>(posts_) +
          static_cast<std::size_t>(column)];
    }

    int posts_;
    double spacing_m_;
    const std::vector<double>* heights_;
};

dvec3 ground_color(const TerrainOptions& options, const Heights& heights, const dvec2& share) {
    const dvec2 at = share * static_cast<double>(options.posts) - 0.5; // in posts
    const dvec2 place = share - 0.5;
    // Reaches are shares of the side, as what they tell should not depend on the posts.
    const double unit = std::max(options.posts / 512.0, 0.25);
    const double height = options.relief_m > 0.0 ? heights.height(at) / options.relief_m : 0.0;
    const double steep = glm::length(heights.slope(at, unit));
    const double stands_out = heights.outstanding(at, 2.0 * unit);
    const double in_valley = -heights.outstanding(at, 9.0 * unit);
    const double patches = rough(place, 0.06, 5, options.seed + 600);
    const double grain = rough(place, 0.012, 3, options.seed + 700);
    const double north = heights.slope(at, 2.0 * unit).y; // the north is -z: snow stays there

    // Each grows over what is before it, where it is.
    dvec3 color =
        glm::mix(kForest, kMeadow, glm::smoothstep(-0.25, 0.30, patches + 2.2 * (height - 0.30)));
    color = glm::mix(color, kScree, glm::smoothstep(0.38, 0.62, height + 0.16 * patches));
    color = glm::mix(
        color,
        glm::mix(kRock, kDarkRock, glm::smoothstep(-0.2, 0.35, grain)),
        glm::smoothstep(0.48, 0.85, steep + 0.25 * grain + 1.1 * std::max(stands_out, 0.0))
    );
    // Layers of the rock show on steep faces.
    const double layer = std::sin(height * 95.0 + 2.5 * patches);
    color *= 1.0 + 0.06 * layer * glm::smoothstep(0.6, 1.0, steep);
    const double snow =
        glm::smoothstep(0.58, 0.74, height + 0.10 * patches + 0.05 * grain - 0.06 * north) *
        (1.0 - glm::smoothstep(0.75, 1.15, steep + 0.3 * grain));
    color = glm::mix(color, kSnow, snow);
    // Streams wash gravel out where slopes are gentle.
    const double stream =
        glm::smoothstep(0.05, 0.14, in_valley) * (1.0 - glm::smoothstep(0.25, 0.5, steep));
    color = glm::mix(color, kGravel, 0.7 * stream * (1.0 - snow));
    // Light from the whole sky reaches ridges better than gullies.
    color *= 1.0 + std::clamp(0.9 * stands_out, -0.30, 0.18);
    color *= 1.0 + 0.10 * grain;
    return color;
}

Texture make_texture(const TerrainOptions& options, const Heights& heights) {
    Texture texture;
    texture.width = kTerrainTexels;
    texture.height = kTerrainTexels;
    for (int row = 0; row < kTerrainTexels; ++row) {
        for (int column = 0; column < kTerrainTexels; ++column) {
            const dvec2 share = (dvec2(column, row) + 0.5) / static_cast<double>(kTerrainTexels);
            const dvec3 color =
                glm::clamp(ground_color(options, heights, share) + 0.5, dvec3(0.0), dvec3(255.0));
            for (int i = 0; i < 3; ++i) {
                texture.pixels.push_back(static_cast<std::uint8_t>(color[i]));
            }
            texture.pixels.push_back(255);
        }
    }
    return texture;
}

Mesh make_mesh(const TerrainOptions& options, const std::vector<double>& heights) {
    const auto posts = static_cast<std::uint32_t>(options.posts);
    const double spacing_m = options.side_m / (options.posts - 1);
    Mesh mesh;
    mesh.name = "terrain";
    mesh.splittable = true;
    for (std::uint32_t row = 0; row < posts; ++row) {
        for (std::uint32_t column = 0; column < posts; ++column) {
            mesh.positions.emplace_back(
                column * spacing_m - options.side_m / 2.0,
                heights[std::size_t{row} * posts + column],
                row * spacing_m - options.side_m / 2.0
            );
            mesh.texcoords.emplace_back((column + 0.5) / posts, (row + 0.5) / posts);
        }
    }
    for (std::uint32_t row = 0; row + 1 < posts; ++row) {
        for (std::uint32_t column = 0; column + 1 < posts; ++column) {
            const std::uint32_t a = row * posts + column;
            const std::uint32_t c = a + posts;
            mesh.indices.insert(mesh.indices.end(), {a, c, c + 1, a, c + 1, a + 1});
        }
    }
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size()), MaterialId{0}});
    compute_normals(mesh);
    io::optimize_for_drawing(mesh);
    return mesh;
}

} // namespace

Result<void> validate(const TerrainOptions& options) {
    const auto wrong = [](const char* name, double value, const char* expected) {
        return fail(
            ErrorCode::invalid_argument,
            std::string("terrain: ") + name + " is " + std::to_string(value) + ", expected " +
                expected
        );
    };
    if (options.posts < kLeastPosts || options.posts > kMostPosts) {
        return wrong("posts", options.posts, "9 to 4097");
    }
    if (!(options.side_m > 0.0) || !std::isfinite(options.side_m)) {
        return wrong("side_m", options.side_m, "a finite value above 0");
    }
    if (!(options.relief_m >= 0.0) || !std::isfinite(options.relief_m)) {
        return wrong("relief_m", options.relief_m, "a finite value, 0 or more");
    }
    return {};
}

Result<Scene> make_terrain(const TerrainOptions& options) {
    if (auto valid = validate(options); !valid) {
        return tl::unexpected(valid.error());
    }
    const std::vector<double> heights = make_heights(options);
    Scene scene;
    scene.name = "terrain";
    scene.sky = glm::vec3(0.66F, 0.78F, 0.90F);
    scene.light.to_light = glm::vec3(-0.55F, 0.70F, 0.45F); // low, so that ridges stand out
    scene.textures.push_back(make_texture(options, Heights(options, heights)));
    Material ground;
    ground.texture = TextureId{0};
    scene.materials.push_back(ground);
    scene.meshes.push_back(make_mesh(options, heights));
    Instance instance;
    instance.mesh = MeshId{0};
    scene.instances.push_back(instance);
    return scene;
}

} // namespace farfield::scenes
