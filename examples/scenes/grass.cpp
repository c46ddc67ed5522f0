#include "grass.hpp"

#include "facets.hpp"
#include "quarter_turn.hpp"
#include "random.hpp"
#include <farfield/io/mesh_tools.hpp>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace farfield::scenes {

namespace {

using glm::dvec3;

constexpr double kTwoPi = 2.0 * std::numbers::pi;
constexpr int kTrianglesPerBlade = 2;
constexpr int kStep = kGrassPatches * kGrassPatches * kTrianglesPerBlade;
static_assert(kStep == 1250);
constexpr int kMaxTriangles = 2'000'000'000;
constexpr double kNaturalBladesPerSquareMetre = 20.0;
constexpr int kSoilQuads = 40; // along each side

const dvec3 kBladeBase(70.0, 92.0, 36.0);
const dvec3 kBladeGreen(112.0, 142.0, 52.0);
const dvec3 kBladeDry(186.0, 180.0, 98.0);
const dvec3 kSoilDark(86.0, 64.0, 46.0);
const dvec3 kSoilLight(122.0, 96.0, 70.0);

dvec3 horizontal(double azimuth) {
    return {std::cos(azimuth), 0.0, std::sin(azimuth)};
}

/// A rhombus that stands on its point and is bent across its middle.
void add_blade(Facets& patch, const dvec3& base, double width, Random& random) {
    const double height = random.between(0.30, 0.70);
    const dvec3 lean =
        horizontal(random.between(0.0, kTwoPi)) * (height * random.between(0.1, 0.6));
    const dvec3 middle = base + lean * 0.3 + dvec3(0.0, 0.55 * height, 0.0);
    const dvec3 tip = base + lean + dvec3(0.0, height, 0.0);
    // Most blades bend across their flat side.
    const dvec3 flat = glm::normalize(glm::cross(lean, dvec3(0.0, 1.0, 0.0)));
    const dvec3 turned = glm::normalize(flat + 0.6 * horizontal(random.between(0.0, kTwoPi)));
    const dvec3 across = turned * (0.5 * width * random.between(0.8, 1.2));
    const double dry = random.unit();
    const dvec3 color = glm::mix(kBladeGreen, kBladeDry, 0.8 * dry * dry);
    const auto normal = [&](const dvec3& from, const dvec3& to) {
        const dvec3 facet = glm::normalize(glm::cross(to - from, across));
        // Single blades would sparkle: most of the shading is that of the field.
        return glm::normalize(dvec3(0.0, 0.8, 0.0) + facet * (facet.y < 0.0 ? -0.4 : 0.4));
    };
    patch.add(
        std::array{base, middle + across, middle - across},
        normal(base, middle),
        glm::mix(kBladeBase, color, 0.3)
    );
    patch.add(std::array{middle - across, middle + across, tip}, normal(middle, tip), color);
}

Mesh make_patch(const GrassOptions& options, Random& random) {
    const double side = options.field_m / kGrassPatches;
    const int blades = options.triangles / kStep;
    const double natural = kNaturalBladesPerSquareMetre * side * side;
    const double width = 0.045 * std::clamp(natural / blades, 0.2, 8.0);
    Facets patch;
    for (int blade = 0; blade < blades; ++blade) {
        const dvec3 base(random.between(-side, side) / 2.0, 0.0, random.between(-side, side) / 2.0);
        add_blade(patch, base, width, random);
    }
    Mesh mesh = patch.finish("grass");
    mesh.splittable = false;
    io::optimize_for_drawing(mesh);
    return mesh;
}

Mesh make_soil(const GrassOptions& options, Random& random) {
    Mesh mesh;
    mesh.name = "soil";
    mesh.splittable = true;
    for (int row = 0; row <= kSoilQuads; ++row) {
        for (int column = 0; column <= kSoilQuads; ++column) {
            const double x = (static_cast<double>(column) / kSoilQuads - 0.5) * options.field_m;
            const double z = (static_cast<double>(row) / kSoilQuads - 0.5) * options.field_m;
            mesh.positions.emplace_back(dvec3(x, 0.0, z));
            mesh.normals.emplace_back(0.0F, 1.0F, 0.0F);
            mesh.colors.push_back(to_color(glm::mix(kSoilDark, kSoilLight, random.unit())));
        }
    }
    constexpr std::uint32_t kPosts = kSoilQuads + 1;
    for (std::uint32_t row = 0; row + 1 < kPosts; ++row) {
        for (std::uint32_t column = 0; column + 1 < kPosts; ++column) {
            const std::uint32_t a = row * kPosts + column;
            const std::uint32_t c = a + kPosts;
            mesh.indices.insert(mesh.indices.end(), {a, c, c + 1, a, c + 1, a + 1});
        }
    }
    mesh.parts.push_back({0, static_cast<std::uint32_t>(mesh.indices.size()), kNone<MaterialId>});
    update_bounds(mesh);
    io::optimize_for_drawing(mesh);
    return mesh;
}

} // namespace

Result<void> validate(const GrassOptions& options) {
    if (options.triangles < kStep || options.triangles > kMaxTriangles ||
        options.triangles % kStep != 0) {
        return fail(
            ErrorCode::invalid_argument,
            "grass: triangles is " + std::to_string(options.triangles) +
                ", expected a multiple of 1250, 1250 to 2000000000"
        );
    }
    if (!(options.field_m > 0.0) || !std::isfinite(options.field_m)) {
        return fail(
            ErrorCode::invalid_argument,
            "grass: field_m is " + std::to_string(options.field_m) +
                ", expected a finite value above 0"
        );
    }
    return {};
}

Result<Scene> make_grass(const GrassOptions& options) {
    if (Result<void> valid = validate(options); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    Random random(options.seed);
    Scene scene;
    scene.name = "grass";
    scene.sky = glm::vec3(0.72F, 0.82F, 0.92F);
    scene.meshes.push_back(make_patch(options, random));
    const double side = options.field_m / kGrassPatches;
    for (int row = 0; row < kGrassPatches; ++row) {
        for (int column = 0; column < kGrassPatches; ++column) {
            const dvec3 place = dvec3(column + 0.5, 0.0, row + 0.5) * side -
                                dvec3(options.field_m / 2.0, 0.0, options.field_m / 2.0);
            scene.instances.push_back(
                {make_id<MeshId>(0), quarter_turned(random.bits(), 1.0, place)}
            );
        }
    }
    if (options.ground) {
        scene.meshes.push_back(make_soil(options, random));
        scene.instances.push_back({make_id<MeshId>(1)});
    }
    return scene;
}

} // namespace farfield::scenes
