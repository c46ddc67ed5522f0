#include "support/random.hpp"
#include <farfield/image/color_cube.hpp>
#include <farfield/image/color_cube_model.hpp>

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

using namespace farfield;
using farfield::support::Random;

namespace {

using Octants = std::array<ColorCube, 8>;

/// A premultiplied colour of any alpha, often empty or opaque.
glm::u8vec4 random_color(Random& random) {
    const unsigned kind = random.below(4);
    const unsigned alpha = kind == 0 ? 0 : kind == 1 ? 255 : random.below(256);
    const auto component = [&] { return static_cast<std::uint8_t>(random.below(alpha + 1)); };
    const std::uint8_t red = component();
    const std::uint8_t green = component();
    return {red, green, component(), static_cast<std::uint8_t>(alpha)};
}

Octants random_octants(Random& random) {
    Octants octants;
    for (ColorCube& cube : octants) {
        for (glm::u8vec4& face : cube.faces) {
            face = random_color(random);
        }
    }
    return octants;
}

/// A face by the definition, in double.
glm::dvec4 expected_face(const Octants& octants, std::size_t axis, bool positive) {
    glm::dvec4 sum(0.0);
    for (std::size_t octant = 0; octant < 8; ++octant) {
        const bool near_eye = ((octant >> axis & 1U) != 0) == positive;
        if (near_eye) {
            const std::size_t face = face_of(axis, positive);
            const glm::dvec4 over(octants[octant].faces[face]);
            const glm::dvec4 under(octants[octant ^ (1U << axis)].faces[face]);
            sum += over + under * (1.0 - over.a / 255.0);
        }
    }
    return sum / 4.0;
}

/// The same from alphas that are no bytes.
float alpha_aslant(
    const glm::vec3& alphas,
    const glm::vec3& direction,
    const glm::vec3& size,
    const glm::vec3& gains,
    float factor = 1.0F
) {
    const glm::vec3 depths(-std::log1p(-alphas.x), -std::log1p(-alphas.y), -std::log1p(-alphas.z));
    return oblique_alpha(depths, direction, size, gains, factor);
}

/// Steps of rounding that a handful of float operations may make.
constexpr float kRounding = 16 * 0x1p-24F;

} // namespace

TEST_CASE("Faces are numbered by axis and side") {
    CHECK(face_of(0, false) == 0);
    CHECK(face_of(0, true) == 1);
    CHECK(face_of(2, false) == 4);
    CHECK(face_of(2, true) == 5);
}

TEST_CASE("Composed cubes are those of the definition, rounded to nearest") {
    Random random(1);
    for (int run = 0; run < 2000; ++run) {
        const Octants octants = random_octants(random);
        const ColorCube cube = composed(octants);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const bool positive : {false, true}) {
                const glm::dvec4 expected = expected_face(octants, axis, positive);
                const glm::u8vec4& face = cube.faces[face_of(axis, positive)];
                INFO("run " << run << ", axis " << axis << ", positive " << positive);
                for (int i = 0; i < 4; ++i) {
                    CHECK(std::abs(static_cast<double>(face[i]) - expected[i]) <= 0.5 + 1e-9);
                }
                CHECK(face.r <= face.a);
                CHECK(face.g <= face.a);
                CHECK(face.b <= face.a);
            }
        }
    }
}

TEST_CASE("Nothing is composed of nothing, and equal opaque cubes of themselves") {
    CHECK(composed({}) == ColorCube{});
    ColorCube opaque;
    for (std::size_t face = 0; face < 6; ++face) {
        const auto value = static_cast<std::uint8_t>(face * 50);
        opaque.faces[face] = {value, 255 - value, 255, 255};
    }
    Octants octants;
    octants.fill(opaque);
    CHECK(composed(octants) == opaque);
}

TEST_CASE("What is far shows only through what is near") {
    Random random(2);
    for (int run = 0; run < 100; ++run) {
        Octants octants = random_octants(random);
        // The upper half of y is opaque for an eye above, and empty for one below.
        for (std::size_t octant = 0; octant < 8; ++octant) {
            if ((octant & 2U) != 0) {
                octants[octant].faces[face_of(1, true)].a = 255;
                octants[octant].faces[face_of(1, false)] = {};
            }
        }
        const ColorCube before = composed(octants);
        const Octants other = random_octants(random);
        Octants changed = octants;
        for (std::size_t octant = 0; octant < 8; ++octant) {
            if ((octant & 2U) == 0) {
                changed[octant] = other[octant];
            }
        }
        CHECK(composed(changed).faces[face_of(1, true)] == before.faces[face_of(1, true)]);
        // From below nothing is behind, so the near half is seen as it is, in the mean of four.
        glm::uvec4 sum(2U);
        for (const std::size_t octant : {0U, 1U, 4U, 5U}) {
            sum += glm::uvec4(octants[octant].faces[face_of(1, false)]);
        }
        CHECK(before.faces[face_of(1, false)] == glm::u8vec4(sum / 4U));
    }
}

TEST_CASE("Along the axes the measured alpha holds for every gain") {
    Random random(3);
    for (int run = 0; run < 500; ++run) {
        const glm::vec3 alphas = random.vector(0.0F, 0.998F);
        const glm::vec3 size = random.vector(0.1F, 10.0F);
        const glm::vec3 gain = glm::exp2(random.vector(-4.0F, 4.0F));
        for (int axis = 0; axis < 3; ++axis) {
            for (const float sign : {-1.0F, 1.0F}) {
                glm::vec3 direction(0.0F);
                direction[axis] = sign;
                const float alpha = alpha_aslant(alphas, direction, size, gain);
                // Depths up to 6.2 lose as many roundings, of which an exponential keeps its part.
                CHECK(std::abs(alpha - alphas[axis]) <= kRounding);
            }
        }
    }
}

TEST_CASE("Optical depths are those of the alphas, and finite") {
    // Rounding of alpha is up to 510 times as much of what it leaves, over depths of up to 6.
    constexpr double kRelative = 510 * 0x1p-24 / 5.0;
    for (unsigned alpha = 0; alpha < 255; ++alpha) {
        const double expected = -std::log1p(-static_cast<double>(alpha) / 255.0);
        CHECK(
            optical_depth(static_cast<std::uint8_t>(alpha)) ==
            Approx(expected).epsilon(kRelative).margin(1e-12)
        );
    }
    CHECK(optical_depth(0) == 0.0F);
    CHECK(optical_depth(255) == Approx(-std::log(0.5 / 255.0)).epsilon(kRelative));
}

TEST_CASE("A flat sheet covers the same part of itself from every direction") {
    Random random(4);
    constexpr float kThickness = 1e-5F;
    for (int run = 0; run < 2000; ++run) {
        const auto axis = static_cast<int>(random.below(3));
        const glm::vec3 direction = random.direction<float>();
        const float along = std::abs(direction[axis]);
        if (along < 0.05F) {
            continue;
        }
        glm::vec3 size(1.0F);
        size[axis] = kThickness;
        glm::vec3 alphas(0.0F);
        alphas[axis] = random.uniform(0.0F, 0.99F);
        const float alpha = alpha_aslant(alphas, direction, size, glm::vec3(1.0F));
        // Its sides take a part of the silhouette: t (|d_u| + |d_v|) / |d_a|, at most 1.5 t /
        // |d_a|, and the optical depth, at most 4.7, is less by it.
        CHECK(std::abs(alpha - alphas[axis]) <= 4.7F * 1.5F * kThickness / along + kRounding);
    }
}

TEST_CASE("A sparse medium has the same cross-section from every direction") {
    Random random(5);
    for (int run = 0; run < 2000; ++run) {
        const glm::vec3 size = random.vector(0.5F, 2.0F);
        constexpr float kDensity = 1e-3F;
        glm::vec3 alphas(0.0F);
        for (int axis = 0; axis < 3; ++axis) {
            alphas[axis] = -std::expm1(-kDensity * size[axis]);
        }
        const glm::vec3 d = glm::abs(random.direction<float>());
        const float silhouette =
            d.x * size.y * size.z + d.y * size.z * size.x + d.z * size.x * size.y;
        const float area = silhouette * alpha_aslant(alphas, d, size, glm::vec3(1.0F));
        const float volume = size.x * size.y * size.z;
        // Half of the optical depth is lost to what hides itself: at most density times diagonal.
        CHECK(area == Approx(kDensity * volume).epsilon(kDensity * glm::length(size)));
    }
}

TEST_CASE("More contents cover more, and never more than all") {
    Random random(6);
    for (int run = 0; run < 5000; ++run) {
        const glm::vec3 alphas = random.vector(0.0F, 1.0F);
        const glm::vec3 direction = random.direction<float>();
        const glm::vec3 size = random.vector(0.1F, 10.0F);
        const glm::vec3 gain = glm::exp2(random.vector(-4.0F, 3.9F));
        const float alpha = alpha_aslant(alphas, direction, size, gain);
        CHECK(alpha >= 0.0F);
        CHECK(alpha <= 1.0F);
        CHECK(alpha_aslant(alphas, -direction, size, gain) == alpha);
        for (int axis = 0; axis < 3; ++axis) {
            glm::vec3 larger = gain;
            larger[axis] *= 1.05F;
            CHECK(alpha_aslant(alphas, direction, size, larger) >= alpha - kRounding);
            glm::vec3 more = alphas;
            more[axis] += random.uniform(0.0F, 1.0F - alphas[axis]);
            CHECK(alpha_aslant(more, direction, size, gain) >= alpha - kRounding);
        }
        CHECK(alpha_aslant(alphas, direction, size, gain, 1.05F) >= alpha - kRounding);
        CHECK(alpha_aslant(glm::vec3(0.0F), direction, size, gain) == 0.0F);
    }
}

TEST_CASE("A factor is as if as many cells were one behind the other") {
    Random random(8);
    for (int run = 0; run < 2000; ++run) {
        const glm::vec3 alphas = random.vector(0.0F, 0.9F);
        const glm::vec3 size = random.vector(0.1F, 10.0F);
        const glm::vec3 direction = random.direction<float>();
        const float passed = 1.0F - alpha_aslant(alphas, direction, size, glm::vec3(1.0F));
        const float twice = 1.0F - alpha_aslant(alphas, direction, size, glm::vec3(1.0F), 2.0F);
        CHECK(std::abs(twice - passed * passed) <= 4.0F * kRounding);
    }
}

TEST_CASE("Factors of a level are means of six") {
    Random random(9);
    for (int run = 0; run < 2000; ++run) {
        const glm::vec3 scale = random.vector(0.1F, 10.0F);
        const glm::vec3 direction = random.direction<float>();
        const LevelFactors weights = level_weights(direction, scale);
        float sum = 0.0F;
        for (const float weight : weights) {
            CHECK(weight >= 0.0F);
            sum += weight;
        }
        CHECK(std::abs(sum - 1.0F) <= kRounding);
        CHECK(level_weights(-direction, scale) == weights);
    }
    const LevelFactors factors = {2, 3, 5, 7, 11, 13};
    const glm::vec3 scale(1.0F, 4.0F, 0.25F);
    CHECK(level_factor(factors, {-1, 0, 0}, scale) == 2.0F);
    CHECK(level_factor(factors, {0, 1, 0}, scale) == 3.0F);
    CHECK(level_factor(factors, {0, 0, 1}, scale) == 5.0F);
    // Halfway, as the scale has it: a quarter of either end, half of what is between.
    CHECK(level_factor(factors, {0.8F, 0.2F, 0}, scale) == Approx(0.25 * (2 + 3) + 0.5 * 13));
    CHECK(level_factor(factors, {0, 0.25F, 4}, scale) == Approx(0.25 * (3 + 5) + 0.5 * 7));
    CHECK(level_factor(factors, {0.25F, 0, -1}, scale) == Approx(0.25 * (5 + 2) + 0.5 * 11));
}

TEST_CASE("Gains are kept within half a step") {
    Random random(7);
    constexpr float kSmallest = 1.0F / 16.0F;
    const float largest = std::exp2(63.0F / 16.0F);
    for (int run = 0; run < 2000; ++run) {
        const glm::vec3 gains = glm::exp2(random.vector(-4.0F, 63.0F / 16.0F));
        const bool sheet = random.below(2) == 0;
        const CubeGain kept = make_gain(gains, sheet);
        CHECK(is_sheet(kept) == sheet);
        const glm::vec3 steps = glm::abs(16.0F * glm::log2(gain_of(kept) / gains));
        CHECK(std::max({steps.x, steps.y, steps.z}) <= 0.5F + 1e-3F);
    }
    for (unsigned stored = 0; stored < 256; ++stored) {
        const auto byte = static_cast<std::uint8_t>(stored);
        const auto other = static_cast<std::uint8_t>(127U - stored % 128U);
        const CubeGain gain{{byte, other, static_cast<std::uint8_t>(stored % 128U)}};
        CHECK(make_gain(gain_of(gain), is_sheet(gain)) == gain);
    }
    CHECK(gain_of(CubeGain{}) == glm::vec3(1.0F));
    CHECK_FALSE(is_sheet(CubeGain{}));
    CHECK(gain_of(make_gain({1e-9F, 1.0F, 1e9F}, false)) == glm::vec3(kSmallest, 1.0F, largest));
    CHECK(gain_of(make_gain({1e9F, 1e-9F, 1.0F}, true)) == glm::vec3(largest, kSmallest, 1.0F));
}

TEST_CASE("The box of the contents is told in sixteenths of what is around it") {
    CubeCell cell;
    const Box3f everything{glm::vec3(-100.0F), glm::vec3(100.0F)};
    CHECK(contents_box(cell, everything, {1, 2, 3}, 4.0F) == Box3f{{1, 2, 3}, {5, 6, 7}});
    cell.extent = {0x00, 0xFF, 0x74};
    Box3f box = contents_box(cell, everything, {0, 0, 0}, 16.0F);
    CHECK(box == Box3f{{0, 15, 4}, {1, 16, 8}});
    // Contents of the parent from 8 m on, to 4 m, and between 2 and 6 m.
    box = contents_box(cell, {{8, -5, 2}, {30, 4, 6}}, {0, 0, 0}, 16.0F);
    CHECK(box == Box3f{{8, 3.75F, 3}, {8.5F, 4, 4}});
    // Where those are flat, a 64th of the cell, inside of it, also where they only touch it.
    box = contents_box(cell, {{16, 3, 0}, {16, 3, 0}}, {0, 0, 0}, 16.0F);
    CHECK(box == Box3f{{15.75F, 3.234375F, 0.0625F}, {15.765625F, 3.25F, 0.125F}});
    CHECK(child_count(cell) == 0);
    cell.octants = 0xA1;
    CHECK(child_count(cell) == 3);
}
