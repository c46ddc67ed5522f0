// What the backend is made of, where a picture would not show what is wrong.
#include "embree/blend.hpp"
#include "embree/quad_depths.hpp"
#include "embree/samples.hpp"
#include "embree/texture.hpp"
#include "embree/worker_pool.hpp"
#include "support/random.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <vector>

using namespace farfield;
using namespace farfield::embree;
using farfield::support::Random;

TEST_CASE("Samples are inside the pixel, centred and spread") {
    CHECK(sample_places(1) == std::vector<glm::vec2>{{0.5F, 0.5F}});
    for (int samples = 1; samples <= 64; ++samples) {
        INFO(samples);
        const std::vector<glm::vec2> places = sample_places(samples);
        REQUIRE(places.size() == static_cast<std::size_t>(samples));
        glm::dvec2 sum(0.0);
        std::set<int> columns;
        std::set<int> rows;
        for (const glm::vec2& place : places) {
            CHECK(place.x > 0.0F);
            CHECK(place.x < 1.0F);
            CHECK(place.y > 0.0F);
            CHECK(place.y < 1.0F);
            sum += glm::dvec2(place);
            columns.insert(static_cast<int>(place.x * static_cast<float>(samples)));
            rows.insert(static_cast<int>(place.y * static_cast<float>(samples)));
        }
        // Rounding to float of up to 64 places.
        CHECK(std::abs(sum.x / samples - 0.5) < 1e-6);
        CHECK(std::abs(sum.y / samples - 0.5) < 1e-6);
        CHECK(columns.size() == places.size());
        CHECK(rows.size() == places.size());
    }
    // Hammersley's four: 0, 2, 1, 3 quarters up.
    CHECK(
        sample_places(4) ==
        std::vector<glm::vec2>{
            {0.125F, 0.125F}, {0.375F, 0.625F}, {0.625F, 0.375F}, {0.875F, 0.875F}}
    );
}

TEST_CASE("Every task runs once, on a thread of the pool") {
    for (const unsigned threads : {1U, 2U, 7U}) {
        WorkerPool pool(threads);
        CHECK(pool.threads() == threads);
        // Short jobs in a row: a worker may still be on its way out of the one before.
        for (std::uint32_t job = 0; job < 300; ++job) {
            const std::uint32_t tasks = job % 40;
            std::vector<std::atomic<int>> runs(tasks);
            std::atomic<bool> known{true};
            pool.run(tasks, [&](std::uint32_t task, unsigned thread) {
                ++runs[task];
                known = known && thread < threads;
            });
            CHECK(known);
            for (const std::atomic<int>& count : runs) {
                REQUIRE(count == 1);
            }
        }
    }
}

TEST_CASE("Levels of a texture are means, down to one texel") {
    Texture texture;
    texture.width = 4;
    texture.height = 2;
    for (int i = 0; i < 8; ++i) {
        const auto value = static_cast<std::uint8_t>(i * 10);
        texture.pixels.insert(texture.pixels.end(), {value, 0, 255, 128});
    }
    const MipTexture mips(texture);
    CHECK(mips.bytes() == 44); // 8, 2 and 1 texels
    const auto red = [&](const glm::vec2& uv, float step) {
        return mips.sample(uv, {step, 0.0F}, {0.0F, 0.0F}).r;
    };
    // Texel centres of the finest level; a step of a texel is a quarter of the width.
    CHECK(red({0.125F, 0.25F}, 0.0F) == 0.0F);
    CHECK(red({0.375F, 0.25F}, 0.25F) == 10.0F);
    CHECK(red({0.125F, 0.75F}, 0.25F) == 40.0F);
    // Half way, and round the edge: the left neighbour of the first texel is the last.
    CHECK(red({0.25F, 0.25F}, 0.0F) == 5.0F);
    CHECK(red({0.0F, 0.25F}, 0.0F) == 15.0F);
    CHECK(red({-1.0F, 3.25F}, 0.0F) == 15.0F);
    // The next level has 2 x 1 texels: (0 + 10 + 40 + 50) / 4 and (20 + 30 + 60 + 70) / 4.
    CHECK(red({0.25F, 0.5F}, 0.5F) == 25.0F);
    CHECK(red({0.75F, 0.5F}, 0.5F) == 45.0F);
    CHECK(red({0.3F, 0.5F}, 1.0F) == 35.0F);
    CHECK(red({0.3F, 0.5F}, 1000.0F) == 35.0F);
    // Between two levels: sqrt(2) texels are half way.
    CHECK(
        red({0.25F, 0.5F}, 0.25F * std::sqrt(2.0F)) ==
        Approx((red({0.25F, 0.5F}, 0.0F) + 25.0F) / 2.0F).margin(1e-3)
    );
    CHECK(red({0.3F, 0.5F}, std::numeric_limits<float>::quiet_NaN()) == red({0.3F, 0.5F}, 0.0F));

    texture = {.width = 1, .height = 1, .pixels = {1, 2, 3, 4}};
    const MipTexture single(texture);
    CHECK(single.sample({0.7F, 0.2F}, {5.0F, 0.0F}, {0.0F, 5.0F}) == glm::vec4(1, 2, 3, 4));
}

TEST_CASE("Blending and depths are the same with whatever instructions") {
    constexpr std::int32_t kPage = 64;
    Random random(9);
    std::vector<std::uint32_t> texels(std::size_t{kPage} * kPage + kPage + 2);
    for (std::uint32_t& texel : texels) {
        // Premultiplied; a third is clear, a third opaque.
        const unsigned alpha = std::array<unsigned, 3>{0, 255, random.below(256)}[random.below(3)];
        texel = alpha << 24U;
        for (unsigned channel = 0; channel < 3; ++channel) {
            texel |= random.below(alpha + 1) << (8 * channel);
        }
    }
    auto before = std::make_unique<TileBuffer>();
    for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
        for (std::uint16_t& channel : before->colors[pixel]) {
            channel = static_cast<std::uint16_t>(random.below(0xFF01));
        }
        before->depths[pixel] = random.uniform(1.0F, 9.0F);
        before->orders[pixel] = random.below(8);
    }
    std::vector<std::uint16_t> kept(texels.size());
    for (std::uint16_t& depth : kept) {
        // A third keeps nothing.
        depth = static_cast<std::uint16_t>(random.below(3) == 0 ? 0xFFFF : random.below(0x10000));
    }
    const QuadDepthWork portable_depths = portable_depth_work();
    const QuadDepthWork fastest_depths = fastest_depth_work();
    int blended = 0;
    int written = 0;
    for (int i = 0; i < 300; ++i) {
        TileQuad quad;
        quad.stands = std::array{QuadDepth::none, QuadDepth::plane, QuadDepth::texel}[i % 3];
        quad.kept = kept.data();
        quad.viewpoint_depth = random.uniform(-9.0F, 9.0F);
        quad.near_ratio = random.uniform(0.0F, 1.0F);
        quad.far_ratio = random.uniform(1.0F, 3.0F);
        quad.nearest = random.uniform(0.5F, 1.5F);
        quad.farthest = random.uniform(4.0F, 40.0F);
        quad.u = random.uniform(-10.0F, 30.0F);
        quad.u_x = random.uniform(-1.0F, 1.0F);
        quad.u_y = random.uniform(-1.0F, 1.0F);
        quad.v = random.uniform(-10.0F, 30.0F);
        quad.v_x = random.uniform(-1.0F, 1.0F);
        quad.v_y = random.uniform(-1.0F, 1.0F);
        // Some pass the eye.
        quad.w = random.uniform(-0.2F, 1.0F);
        quad.w_x = random.uniform(-0.02F, 0.02F);
        quad.w_y = random.uniform(-0.02F, 0.02F);
        quad.width = random.uniform(10.0F, 60.0F);
        quad.height = random.uniform(10.0F, 60.0F);
        quad.rim_u = i % 2 == 0 ? 0.0F : random.uniform(0.0F, 3.0F);
        quad.rim_v = quad.rim_u;
        quad.texels = texels.data();
        quad.page_size = kPage;
        quad.first_u = static_cast<std::int32_t>(random.below(kPage));
        quad.first_v = static_cast<std::int32_t>(random.below(kPage));
        quad.depth = random.uniform(1.0F, 5.0F);
        quad.order = 3 + random.below(9);
        quad.left = static_cast<std::int32_t>(random.below(16)) / 8 * 8;
        quad.right = 24 + static_cast<std::int32_t>(random.below(2)) * 8;
        quad.bottom = static_cast<std::int32_t>(random.below(16));
        quad.top = 16 + static_cast<std::int32_t>(random.below(17));
        auto portable = std::make_unique<TileBuffer>(*before);
        auto fastest = std::make_unique<TileBuffer>(*before);
        const bool own_depths = quad.stands != QuadDepth::none;
        if (own_depths) {
            portable_depths.find(quad, *portable);
            fastest_depths.find(quad, *fastest);
            int differ = 0;
            for (std::int32_t row = quad.bottom; row < quad.top; ++row) {
                for (std::int32_t column = quad.left; column < quad.right; ++column) {
                    const std::size_t pixel = tile_pixel(column, row);
                    differ += portable->quad_depths[pixel] != fastest->quad_depths[pixel] ? 1 : 0;
                }
            }
            CHECK(differ == 0);
            quad.depths = portable->quad_depths.data();
        }
        blend_quad_portable(quad, *portable);
        fastest_blend_quad()(quad, *fastest);
        CHECK(portable->colors == fastest->colors);
        CHECK(portable->depths == before->depths);
        if (own_depths) {
            portable_depths.write(quad, *portable);
            fastest_depths.write(quad, *fastest);
            CHECK(portable->depths == fastest->depths);
            for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
                written += portable->depths[pixel] != before->depths[pixel] ? 1 : 0;
            }
        }
        for (std::size_t pixel = 0; pixel < kTilePixels; ++pixel) {
            blended += portable->colors[pixel] != before->colors[pixel] ? 1 : 0;
        }
    }
    CHECK(blended > 3000);
    CHECK(written > 1000);
}

TEST_CASE("Blending keeps what is clear and takes what is opaque") {
    constexpr std::array<std::uint16_t, 4> kAny = {0x1234, 0xFF00, 0x0001, 0x8000};
    Color16 target = kAny;
    blend({0, 0, 0, 0}, target);
    CHECK(target == kAny);
    blend({0xFF00, 0x4000, 0, 0xFF00}, target);
    // A step of 16 bits may be left of what was there.
    CHECK(target[0] - 0xFF00 <= 1);
    CHECK(target[1] - 0x4000 <= 1);
    CHECK(target[2] <= 1);
    CHECK(target[3] - 0xFF00 <= 1);
    // Half of each.
    target = {0xFF00, 0, 0, 0xFF00};
    blend({0, 0x7F80, 0, 0x7F80}, target);
    CHECK(std::abs(target[0] - 0x7F80) <= 1);
    CHECK(std::abs(target[1] - 0x7F80) <= 1);
    CHECK(std::abs(target[3] - 0xFF00) <= 1);
}
