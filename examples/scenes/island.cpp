#include "island.hpp"

#include "noise.hpp"
#include "quarter_turn.hpp"
#include "random.hpp"
#include "willow.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace farfield::scenes {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr double kTreeless = 0.03; // share of the radius along the shore
constexpr int kMaxTrees = 1'000'000;
constexpr int kMaxQuads = 4096;

const dvec3 kWetSand(184.0, 167.0, 128.0);
const dvec3 kSand(216.0, 201.0, 160.0);
const dvec3 kGrass(112.0, 130.0, 66.0);
const dvec3 kMeadow(146.0, 152.0, 84.0);
const dvec3 kRock(138.0, 134.0, 114.0);
const dvec3 kUndergrowth(64.0, 76.0, 40.0);

/// Noise of several octaves, each half as wide and 0.45 times as high; clamped to [-1, 1].
double fractal(double x, double z, double wavelength, int octaves, std::uint64_t seed) noexcept {
    double sum = 0.0;
    double weight = 1.0;
    double scale = 2.0 / wavelength;
    for (int octave = 0; octave < octaves; ++octave) {
        sum += weight * noise(x * scale, z * scale, seed + static_cast<std::uint64_t>(octave));
        weight *= 0.45;
        scale *= 2.03; // not exactly 2, so that the lattices do not line up
    }
    return std::clamp(sum, -1.0, 1.0);
}

/// Maps [-1, 1]^2 onto the unit disc; every quad of a grid keeps its share of the area.
/// Source: Shirley and Chiu, A low distortion map between disk and square, 1997.
dvec2 square_to_disc(double a, double b) noexcept {
    if (a == 0.0 && b == 0.0) {
        return {0.0, 0.0};
    }
    constexpr double kQuarter = std::numbers::pi / 4.0;
    if (std::abs(a) > std::abs(b)) {
        const double angle = kQuarter * (b / a);
        return {a * std::cos(angle), a * std::sin(angle)};
    }
    const double angle = kQuarter * (a / b);
    return {b * std::sin(angle), b * std::cos(angle)};
}

/// Points with a least distance from each other, found through a grid of cells.
class Places {
  public:
    Places(double radius, double spacing)
        : spacing_(spacing), cell_(std::max(spacing, radius / 256.0)),
          half_(static_cast<int>(std::ceil(radius / cell_)) + 1),
          cells_(static_cast<std::size_t>(2 * half_) * static_cast<std::size_t>(2 * half_)) {}

    /// Calls `use` with every place nearer than `distance`; stops when it returns true.
    template <typename Use>
    [[nodiscard]] bool any_near(const dvec2& point, double distance, Use use) const {
        const int reach = static_cast<int>(std::ceil(distance / cell_));
        const int column = cell_of(point.x);
        const int row = cell_of(point.y);
        for (int z = std::max(row - reach, 0); z <= std::min(row + reach, 2 * half_ - 1); ++z) {
            for (int x = std::max(column - reach, 0); x <= std::min(column + reach, 2 * half_ - 1);
                 ++x) {
                for (const dvec2& other : cells_[index(x, z)]) {
                    const double gap = glm::distance(point, other);
                    if (gap < distance && use(gap)) {
                        return true;
                    }
                }
            }
        }
        return false;
    }

    bool add(const dvec2& point) {
        if (any_near(point, spacing_, [](double) { return true; })) {
            return false;
        }
        cells_[index(cell_of(point.x), cell_of(point.y))].push_back(point);
        all_.push_back(point);
        return true;
    }

    [[nodiscard]] const std::vector<dvec2>& all() const { return all_; }

  private:
    [[nodiscard]] int cell_of(double coordinate) const {
        return std::clamp(
            static_cast<int>(std::floor(coordinate / cell_)) + half_, 0, 2 * half_ - 1
        );
    }

    [[nodiscard]] std::size_t index(int x, int z) const {
        return static_cast<std::size_t>(z) * static_cast<std::size_t>(2 * half_) +
               static_cast<std::size_t>(x);
    }

    double spacing_;
    double cell_;
    int half_;
    std::vector<std::vector<dvec2>> cells_;
    std::vector<dvec2> all_;
};

/// Nothing when the trees do not fit.
std::optional<Places> place_trees(const IslandOptions& options, Random& random) {
    const double radius = options.radius_m * (1.0 - kTreeless);
    // Dart throwing stalls when about 55 % of the area is taken by discs of half the spacing; a
    // thousand misses for each hit come well after any density that is not.
    constexpr std::int64_t kDartsPerTree = 1000;
    // No packing of equal discs is denser than the hexagonal one; do not throw for what is beyond
    // it.
    constexpr double kDensest = 0.9069;
    const double disc = options.min_spacing_m / 2.0;
    if (options.trees * disc * disc > kDensest * (radius + disc) * (radius + disc)) {
        return std::nullopt;
    }
    Places places(radius, options.min_spacing_m);
    std::int64_t darts = kDartsPerTree * options.trees;
    for (int placed = 0; placed < options.trees && darts > 0; --darts) {
        const dvec2 point(random.between(-radius, radius), random.between(-radius, radius));
        if (glm::length(point) <= radius && places.add(point)) {
            ++placed;
        }
    }
    if (places.all().size() < static_cast<std::size_t>(options.trees)) {
        return std::nullopt;
    }
    return places;
}

/// [m per m] along x and z.
dvec2 slope(const IslandOptions& options, double x, double z) noexcept {
    const double step = options.radius_m / 2048.0;
    return {
        (island_height(options, x + step, z) - island_height(options, x - step, z)) / (2.0 * step),
        (island_height(options, x, z + step) - island_height(options, x, z - step)) / (2.0 * step)};
}

glm::u8vec4 ground_color(const IslandOptions& options, const Places& places, const dvec2& point) {
    const double x = point.x;
    const double z = point.y;
    const double broad = fractal(x, z, 90.0, 3, options.seed + 101);
    const double fine = fractal(x, z, 11.0, 2, options.seed + 202);
    dvec3 color = glm::mix(kGrass, kMeadow, std::clamp(0.45 + 1.1 * broad + 0.5 * fine, 0.0, 1.0));

    const double steep = glm::length(slope(options, x, z));
    color = glm::mix(color, kRock, glm::smoothstep(0.20, 0.32, steep + 0.08 * fine));

    // Beach: by height and by nearness to the shore, so that a flat island has one too.
    const double inland = (1.0 - glm::length(point) / options.radius_m) * 20.0;
    const double dry = std::min(inland + 0.5 * broad, 1.6) + 0.15 * fine;
    color = glm::mix(kSand, color, glm::smoothstep(0.75, 1.15, dry));
    color = glm::mix(kWetSand, color, glm::smoothstep(0.05, 0.30, inland));

    double open = 1.0;
    const double crown = 0.62 * options.tree_width_m;
    // Every tree near is visited; none ends the search.
    static_cast<void>(places.any_near(point, crown, [&](double gap) {
        open *= 0.35 + 0.65 * glm::smoothstep(0.25 * crown, crown, gap);
        return false;
    }));
    color = glm::mix(kUndergrowth, color, open);
    color *= 1.0 + 0.16 * fine;
    color = glm::clamp(color + 0.5, dvec3(0.0), dvec3(255.0));
    return {
        static_cast<std::uint8_t>(color.x),
        static_cast<std::uint8_t>(color.y),
        static_cast<std::uint8_t>(color.z),
        255};
}

Mesh make_terrain(const IslandOptions& options, const Places& places) {
    const int quads = options.terrain_quads;
    const auto posts = static_cast<std::uint32_t>(quads) + 1;
    Mesh mesh;
    mesh.name = "terrain";
    mesh.splittable = true;
    for (int row = 0; row <= quads; ++row) {
        for (int column = 0; column <= quads; ++column) {
            const dvec2 point =
                square_to_disc(2.0 * column / quads - 1.0, 2.0 * row / quads - 1.0) *
                options.radius_m;
            const double height = island_height(options, point.x, point.y);
            const dvec2 rise = slope(options, point.x, point.y);
            mesh.positions.emplace_back(dvec3(point.x, height, point.y));
            mesh.normals.emplace_back(glm::normalize(dvec3(-rise.x, 1.0, -rise.y)));
            mesh.colors.push_back(ground_color(options, places, point));
        }
    }
    for (std::uint32_t row = 0; row + 1 < posts; ++row) {
        for (std::uint32_t column = 0; column + 1 < posts; ++column) {
            const std::uint32_t a = row * posts + column;
            const std::uint32_t b = a + 1;
            const std::uint32_t c = a + posts;
            const std::uint32_t d = c + 1;
            // The shorter diagonal; the map slants quads near the diagonals of the square.
            const auto gap = [&](std::uint32_t i, std::uint32_t j) {
                return glm::distance(mesh.positions[i], mesh.positions[j]);
            };
            if (gap(a, d) < gap(b, c)) {
                mesh.indices.insert(mesh.indices.end(), {a, c, d, a, d, b});
            } else {
                mesh.indices.insert(mesh.indices.end(), {a, c, b, b, c, d});
            }
        }
    }
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size()), kNone<MaterialId>});
    update_bounds(mesh);
    return mesh;
}

Instance plant(const IslandOptions& options, const dvec2& point, Random& random) {
    const double yaw = random.between(0.0, kTwoPi);
    const double scale = random.between(options.min_scale, options.max_scale);
    const dvec3 foot(point.x, island_height(options, point.x, point.y), point.y);
    if (options.quarter_turns) {
        const auto turns = static_cast<std::uint64_t>(std::lround(yaw / (kTwoPi / 4.0)));
        return {make_id<MeshId>(1), quarter_turned(turns, scale, foot)};
    }
    const double cosine = std::cos(yaw) * scale;
    const double sine = std::sin(yaw) * scale;
    Instance instance;
    instance.mesh = make_id<MeshId>(1);
    instance.object_to_world[0] = dvec3(cosine, 0.0, -sine);
    instance.object_to_world[1] = dvec3(0.0, scale, 0.0);
    instance.object_to_world[2] = dvec3(sine, 0.0, cosine);
    instance.object_to_world[3] = foot;
    return instance;
}

} // namespace

double island_height(const IslandOptions& options, double x, double z) noexcept {
    const double outward = std::hypot(x, z) / options.radius_m;
    if (outward >= 1.0) {
        return 0.0;
    }
    const double rest = 1.0 - outward * outward;
    const double dome = options.height_m * rest * std::sqrt(rest);
    // The hills fade out towards the centre, whose height is given.
    const double hills = fractal(x, z, 0.45 * options.radius_m, 6, options.seed);
    return dome * (1.0 + 0.75 * hills * glm::smoothstep(0.0, 0.3, outward));
}

Result<void> validate(const IslandOptions& options) {
    const auto wrong = [](const char* name, double value, const char* expected) {
        return fail(
            ErrorCode::invalid_argument,
            std::string("island: ") + name + " is " + std::to_string(value) + ", expected " +
                expected
        );
    };
    const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
    const auto not_negative = [](double value) { return value >= 0.0 && std::isfinite(value); };
    if (options.trees < 0 || options.trees > kMaxTrees) {
        return wrong("trees", options.trees, "0 to 1000000");
    }
    if (!positive(options.radius_m)) {
        return wrong("radius_m", options.radius_m, "a finite value above 0");
    }
    if (!not_negative(options.height_m)) {
        return wrong("height_m", options.height_m, "a finite value, 0 or more");
    }
    if (options.terrain_quads < 2 || options.terrain_quads > kMaxQuads) {
        return wrong("terrain_quads", options.terrain_quads, "2 to 4096");
    }
    if (!not_negative(options.min_spacing_m)) {
        return wrong("min_spacing_m", options.min_spacing_m, "a finite value, 0 or more");
    }
    if (!positive(options.min_scale)) {
        return wrong("min_scale", options.min_scale, "a finite value above 0");
    }
    if (!(options.max_scale >= options.min_scale) || !std::isfinite(options.max_scale)) {
        return wrong("max_scale", options.max_scale, "a finite value, min_scale or more");
    }
    return {};
}

Result<Scene> make_island(const IslandOptions& options) {
    if (auto valid = validate(options); !valid) {
        return tl::unexpected(valid.error());
    }
    auto willow = make_willow(
        {.triangles = options.tree_triangles,
         .height_m = options.tree_height_m,
         .width_m = options.tree_width_m,
         .seed = options.tree_seed}
    );
    if (!willow) {
        return tl::unexpected(willow.error());
    }
    Random random(options.seed);
    const std::optional<Places> places = place_trees(options, random);
    if (!places) {
        return fail(
            ErrorCode::invalid_argument,
            "island: " + std::to_string(options.trees) + " trees at least " +
                std::to_string(options.min_spacing_m) + " m apart do not fit on an island of " +
                std::to_string(options.radius_m) + " m radius"
        );
    }

    Scene scene;
    scene.name = "island";
    scene.sky = glm::vec3(0.69F, 0.80F, 0.89F); // haze, since the sea shows it too
    scene.meshes.push_back(make_terrain(options, *places));
    scene.meshes.push_back(std::move(*willow));
    for (Mesh& mesh : scene.meshes) {
        io::optimize_for_drawing(mesh);
    }
    Instance terrain;
    terrain.mesh = make_id<MeshId>(0);
    scene.instances.reserve(places->all().size() + 1);
    scene.instances.push_back(terrain);
    for (const dvec2& point : places->all()) {
        scene.instances.push_back(plant(options, point, random));
    }
    return scene;
}

} // namespace farfield::scenes
