// Image errors of pictures of 640x480: what a walk pays for each reference frame, outside its
// clock.
#include "../tests/support/random.hpp"
#include <farfield/eval/flip.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/structural_similarity.hpp>

#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>

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

BENCHMARK(psnr)->Unit(benchmark::kMillisecond);
BENCHMARK(ssim)->Unit(benchmark::kMillisecond);
BENCHMARK(flip)->Unit(benchmark::kMillisecond);

} // namespace
