#include "forest.hpp"

#include "facets.hpp"
#include "random.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace farfield::scenes {

namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr int kMaxTrees = 10'000;
constexpr int kMinTriangles = 200;
constexpr int kMaxTriangles = 1'000'000;
constexpr int kGroundQuads = 30; // along each side

// A tree is grown at this size and scaled by the height asked for.
constexpr double kNaturalHeight = 10.0;
constexpr double kNaturalTriangles = 1050.0;
constexpr double kCrownMiddle = 6.3;
constexpr double kCrownRadius = 3.9;
constexpr double kCrownHalfHeight = 3.4;

const dvec3 kBarkDark(60.0, 50.0, 40.0);
const dvec3 kBarkLight(104.0, 90.0, 70.0);
const dvec3 kLeafShade(30.0, 52.0, 22.0);
const dvec3 kLeafGreen(86.0, 122.0, 46.0);
const dvec3 kLeafTip(156.0, 176.0, 84.0);
const dvec3 kMoss(112.0, 124.0, 66.0);
const dvec3 kUndergrowth(66.0, 66.0, 38.0);

int columns_of(const ForestOptions& options) noexcept {
    return static_cast<int>(std::ceil(std::sqrt(static_cast<double>(options.trees))));
}

dvec3 horizontal(double azimuth) noexcept {
    return {std::cos(azimuth), 0.0, std::sin(azimuth)};
}

/// One broad-leaved tree around the y axis through its foot, added where it stands.
class Tree {
  public:
    Tree(const dvec2& at, double scale, std::uint64_t seed)
        : at_(at), scale_(scale), random_(seed), width_(random_.between(0.95, 1.05)),
          hue_(random_.between(-10.0, 10.0)) {}

    [[nodiscard]] Mesh grow(int triangles) {
        grow_wood();
        grow_crown(triangles - facets_.count());
        return facets_.finish("tree");
    }

  private:
    [[nodiscard]] dvec3 place(const dvec3& local) const noexcept {
        return dvec3(at_.x, 0.0, at_.y) + local * scale_;
    }

    void grow_wood() {
        const dvec3 lean = horizontal(random_.between(0.0, kTwoPi)) * random_.between(0.0, 0.4);
        const dvec3 fork = lean + dvec3(0.0, 3.2, 0.0);
        add_tube({dvec3(0.0), lean * 0.3 + dvec3(0.0, 1.2, 0.0), fork}, {0.36, 0.26, 0.22}, 6);
        constexpr int kLimbs = 5;
        const double turn = random_.between(0.0, kTwoPi);
        for (int limb = 0; limb < kLimbs; ++limb) {
            const double azimuth = turn + (limb + random_.between(-0.2, 0.2)) * kTwoPi / kLimbs;
            const dvec3 outward = horizontal(azimuth);
            const double reach = random_.between(1.6, 2.4) * width_;
            const double top = random_.between(6.0, 8.2);
            const dvec3 bend = fork + outward * (0.5 * reach) + dvec3(0.0, 0.35 * (top - 3.2), 0.0);
            const dvec3 end = outward * reach + dvec3(0.0, top, 0.0);
            add_tube({fork - dvec3(0.0, 0.4, 0.0), bend, end}, {0.17, 0.12, 0.03}, 4);
        }
    }

    void
    add_tube(const std::array<dvec3, 3>& points, const std::array<double, 3>& radii, int sides) {
        for (std::size_t ring = 0; ring + 1 < points.size(); ++ring) {
            const auto rim = [&](std::size_t end, int side) {
                return points[end] + horizontal(kTwoPi * side / sides) * radii[end];
            };
            for (int side = 0; side < sides; ++side) {
                facets_.add(
                    std::array{
                        place(rim(ring, side + 1)),
                        place(rim(ring, side)),
                        place(rim(ring + 1, side)),
                        place(rim(ring + 1, side + 1))},
                    glm::mix(kBarkDark, kBarkLight, random_.unit())
                );
            }
        }
    }

    /// Sprays of leaves on and under the surface of an ellipsoid; an odd count ends with half a
    /// spray. Fewer are larger, so that the crown keeps its density.
    void grow_crown(int triangles) {
        // Turning by the golden angle spreads points on a ball without rows or seams.
        const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
        const int sprays = (triangles + 1) / 2;
        const double natural = kNaturalTriangles - 116.0; // what the wood leaves
        const double size = std::sqrt(natural / std::max(triangles, 1));
        for (int i = 0; i < sprays; ++i) {
            const double sine = 1.0 - 2.0 * (i + random_.unit()) / sprays;
            const double azimuth = golden_angle * i + random_.between(-0.3, 0.3);
            const dvec3 outward =
                horizontal(azimuth) * std::sqrt(std::max(1.0 - sine * sine, 0.0)) +
                dvec3(0.0, sine, 0.0);
            // Bumps of the crown, and more leaves outside than inside.
            const double bumps = 0.9 + 0.1 * std::sin(3.0 * azimuth + hue_) * std::cos(4.0 * sine);
            const double depth = std::cbrt(random_.between(0.2, 1.0)) * bumps;
            const dvec3 middle =
                dvec3(0.0, kCrownMiddle, 0.0) +
                depth * outward *
                    dvec3(kCrownRadius * width_, kCrownHalfHeight, kCrownRadius * width_);
            add_spray(middle, outward, depth, size, 2 * i + 2 <= triangles);
        }
    }

    void
    add_spray(const dvec3& middle, const dvec3& outward, double depth, double size, bool whole) {
        const dvec3 any = glm::normalize(
            dvec3(random_.between(-1.0, 1.0), random_.between(-1.0, 1.0), random_.between(0.2, 1.0))
        );
        const dvec3 axis = glm::normalize(any + outward * 0.6 + dvec3(0.0, -0.3, 0.0));
        const dvec3 other = std::abs(axis.y) < 0.9 ? dvec3(0.0, 1.0, 0.0) : dvec3(1.0, 0.0, 0.0);
        const dvec3 first = glm::normalize(glm::cross(axis, other));
        const double roll = random_.between(0.0, kTwoPi);
        const dvec3 side = first * std::cos(roll) + glm::cross(axis, first) * std::sin(roll);
        const dvec3 along = axis * (size * random_.between(0.42, 0.60));
        const dvec3 across = side * (size * random_.between(0.26, 0.38));
        dvec3 facet = glm::cross(axis, side);
        facet = glm::dot(facet, outward) < 0.0 ? -facet : facet;
        // Single sprays would sparkle: most of the shading comes from the crown they are in.
        const dvec3 normal = glm::normalize(outward * 0.75 + facet * 0.4);
        const dvec3 color = leaf_color(middle, depth);
        const dvec3 base = place(middle - along);
        const dvec3 tip = place(middle + along);
        const dvec3 left = place(middle + across);
        const dvec3 right = place(middle - across);
        if (whole) {
            facets_.add(std::array{base, right, tip, left}, normal, color);
        } else {
            facets_.add(std::array{base, right, tip}, normal, color);
        }
    }

    /// Nothing casts shadows, so the inside and the underside of the crown are darker.
    [[nodiscard]] dvec3 leaf_color(const dvec3& middle, double depth) {
        const double height = std::clamp((middle.y - 2.5) / 7.5, 0.0, 1.0);
        double light = 0.05 + 0.50 * depth * depth + 0.45 * height + random_.between(-0.15, 0.15);
        light = std::clamp(light, 0.0, 1.2);
        const dvec3 color = light < 0.8 ? glm::mix(kLeafShade, kLeafGreen, light / 0.8)
                                        : glm::mix(kLeafGreen, kLeafTip, (light - 0.8) / 0.4);
        return color + dvec3(hue_, 0.4 * hue_, 0.0);
    }

    dvec2 at_;
    double scale_;
    Random random_;
    double width_; ///< of the crown, over that of the mean tree
    double hue_;   ///< how far its green is from that of the others
    Facets facets_;
};

std::vector<dvec2> places_of(const ForestOptions& options, Random& random) {
    constexpr double kMoved = 0.2;
    const int columns = columns_of(options);
    std::vector<dvec2> places;
    for (int tree = 0; tree < options.trees; ++tree) {
        const dvec2 lattice(tree % columns, tree / columns);
        const dvec2 moved(random.between(-kMoved, kMoved), random.between(-kMoved, kMoved));
        places.push_back((lattice + 0.5 - columns / 2.0 + moved) * options.spacing_m);
    }
    return places;
}

Mesh make_ground(const ForestOptions& options, const std::vector<dvec2>& places, Random& random) {
    const double half = forest_extent(options) / 2.0;
    const double crown = kCrownRadius * options.tree_height_m / kNaturalHeight;
    Mesh mesh;
    mesh.name = "ground";
    mesh.splittable = true;
    for (int row = 0; row <= kGroundQuads; ++row) {
        for (int column = 0; column <= kGroundQuads; ++column) {
            const dvec2 at = (dvec2(column, row) * (2.0 / kGroundQuads) - 1.0) * half;
            double nearest = std::numeric_limits<double>::infinity();
            for (const dvec2& tree : places) {
                nearest = std::min(nearest, glm::distance(at, tree));
            }
            const double open = glm::smoothstep(0.3 * crown, 1.1 * crown, nearest);
            mesh.positions.emplace_back(at.x, 0.0, at.y);
            mesh.normals.emplace_back(0.0F, 1.0F, 0.0F);
            mesh.colors.push_back(
                to_color(glm::mix(kUndergrowth, kMoss, open) * random.between(0.92, 1.08))
            );
        }
    }
    constexpr std::uint32_t kPosts = kGroundQuads + 1;
    for (std::uint32_t row = 0; row + 1 < kPosts; ++row) {
        for (std::uint32_t column = 0; column + 1 < kPosts; ++column) {
            const std::uint32_t a = row * kPosts + column;
            mesh.indices.insert(
                mesh.indices.end(), {a, a + kPosts, a + 1, a + 1, a + kPosts, a + kPosts + 1}
            );
        }
    }
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size()), kNone<MaterialId>});
    update_bounds(mesh);
    return mesh;
}

} // namespace

double forest_extent(const ForestOptions& options) noexcept {
    return columns_of(options) * options.spacing_m;
}

Result<void> validate(const ForestOptions& options) {
    const auto wrong = [](const char* name, double value, const char* expected) {
        return fail(
            ErrorCode::invalid_argument,
            std::string("forest: ") + name + " is " + std::to_string(value) + ", expected " +
                expected
        );
    };
    const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
    if (options.trees < 1 || options.trees > kMaxTrees) {
        return wrong("trees", options.trees, "1 to 10000");
    }
    if (options.tree_triangles < kMinTriangles || options.tree_triangles > kMaxTriangles) {
        return wrong("tree_triangles", options.tree_triangles, "200 to 1000000");
    }
    if (!positive(options.spacing_m)) {
        return wrong("spacing_m", options.spacing_m, "a finite value above 0");
    }
    if (!positive(options.tree_height_m)) {
        return wrong("tree_height_m", options.tree_height_m, "a finite value above 0");
    }
    return {};
}

Result<Scene> make_forest(const ForestOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    Random random(options.seed);
    const std::vector<dvec2> places = places_of(options, random);
    Scene scene;
    scene.name = "forest";
    scene.sky = glm::vec3(0.72F, 0.82F, 0.92F);
    scene.meshes.push_back(make_ground(options, places, random));
    for (const dvec2& at : places) {
        const double scale = options.tree_height_m / kNaturalHeight * random.between(0.9, 1.1);
        scene.meshes.push_back(Tree(at, scale, random.bits()).grow(options.tree_triangles));
    }
    for (std::size_t mesh = 0; mesh < scene.meshes.size(); ++mesh) {
        io::optimize_for_drawing(scene.meshes[mesh]);
        scene.instances.push_back({make_id<MeshId>(mesh)});
    }
    return scene;
}

} // namespace farfield::scenes
