// Image errors and disparity of pictures of 640x480: what a measured frame costs outside the clock.
#include "../tests/support/random.hpp"
#include <farfield/eval/disparity.hpp>
#include <farfield/eval/disparity_series.hpp>
#include <farfield/eval/flip.hpp>
#include <farfield/eval/heat_map.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/structural_similarity.hpp>

#include <benchmark/benchmark.h>
#include <glm/ext/matrix_double4x3.hpp>

#include <cstdint>
#include <vector>

namespace {

using farfield::Picture;
namespace eval = farfield::eval;

constexpr int kWidth = 640;
constexpr int kHeight = 480;

/// Noise around a gradient: no two neighbours are equal, so nothing is spared.
Picture noisy(std::uint64_t seed) {
    farfield::support::Random random(seed);
    Picture picture{kWidth, kHeight, {}};
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            for (int channel = 0; channel < 4; ++channel) {
                const int level = (x + y * (channel + 1)) / 12 + static_cast<int>(random.below(60));
                picture.rgba.push_back(static_cast<std::uint8_t>(level));
            }
        }
    }
    return picture;
}

template <typename Measure>
void measure(benchmark::State& state, const Measure& error) {
    const Picture reference = noisy(1);
    const Picture picture = noisy(2);
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(error(reference, picture));
    }
    state.SetItemsProcessed(state.iterations() * kWidth * kHeight);
}

void psnr(benchmark::State& state) {
    measure(state, [](const Picture& a, const Picture& b) { return eval::psnr_db(a, b); });
}

void ssim(benchmark::State& state) {
    measure(state, [](const Picture& a, const Picture& b) { return eval::ssim_map(a, b); });
}

void flip(benchmark::State& state) {
    measure(state, [](const Picture& a, const Picture& b) { return eval::flip_map(a, b); });
}

void heat_map(benchmark::State& state) {
    const farfield::PixelMap map = *eval::flip_map(noisy(1), noisy(2));
    while (state.KeepRunning()) {
        benchmark::DoNotOptimize(eval::heat_map(map));
    }
    state.SetItemsProcessed(state.iterations() * kWidth * kHeight);
}

/// All pixels show images of 300 nodes, in patches as on a screen.
void disparity(benchmark::State& state) {
    farfield::support::Random random(3);
    farfield::View view;
    view.lens = farfield::perspective_lens(1.0, 4.0 / 3.0, 0.1, 1000.0);
    view.width = kWidth;
    view.height = kHeight;
    const std::vector<glm::dmat4x3> frames(1000, glm::dmat4x3(1.0));
    farfield::PositionPicture picture{kWidth, kHeight, {}};
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
            farfield::PositionTexel& texel = picture.texels.emplace_back();
            texel.point = {random.uniform(-5.0F, 5.0F), random.uniform(-5.0F, 5.0F), -10.0F};
            texel.item = farfield::make_id<farfield::ItemId>(random.below(1000));
            texel.texel_px = 1.0F;
            texel.node = static_cast<std::uint32_t>(x / 32 + 20 * (y / 32));
        }
    }
    farfield::DisparitySeries series;
    int frame = 0;
    while (state.KeepRunning()) {
        series.add(frame++, *eval::measure_disparity(picture, view, frames, 2.0), {});
    }
    benchmark::DoNotOptimize(series.summary());
    state.SetItemsProcessed(state.iterations() * kWidth * kHeight);
}

BENCHMARK(psnr)->Unit(benchmark::kMillisecond);
BENCHMARK(ssim)->Unit(benchmark::kMillisecond);
BENCHMARK(flip)->Unit(benchmark::kMillisecond);
BENCHMARK(heat_map)->Unit(benchmark::kMillisecond);
BENCHMARK(disparity)->Unit(benchmark::kMillisecond);

} // namespace
