// Files of colour cubes, through the file system: packing and unpacking are most of it.
#include "image/cube_scenes.hpp"
#include <farfield/core/executor.hpp>
#include <farfield/io/color_cube_file.hpp>

#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <unistd.h>
#include <utility>

namespace {

using namespace farfield;

/// Cells of a hundred thousand triangles, in the colours of some balls.
const ColorCubeModel& model() {
    static const ColorCubeModel kModel = [] {
        support::TriangleSoup soup = support::random_soup(100'000, 0.5, 1);
        support::ShapeSampler sampler;
        support::Random random(2);
        for (int i = 0; i < 40; ++i) {
            sampler.add_ball(random.vector(-50.0F, 50.0F), 10.0F, random.vector(0.0F, 1.0F));
        }
        SerialExecutor executor;
        auto built = build_color_cubes(soup.input(), sampler, {}, executor);
        return built ? std::move(*built) : ColorCubeModel{};
    }();
    return kModel;
}

std::filesystem::path file() {
    return std::filesystem::temp_directory_path() /
           ("farfield_bench_" + std::to_string(::getpid()) + ".cubes");
}

void count(benchmark::State& state, const std::filesystem::path& path) {
    const std::uint64_t bytes = memory_bytes(model());
    state.SetBytesProcessed(static_cast<std::int64_t>(bytes) * state.iterations());
    std::error_code failure;
    const std::uint64_t packed = std::filesystem::file_size(path, failure);
    if (!failure) {
        state.counters["packed"] = static_cast<double>(packed) / static_cast<double>(bytes);
    }
    std::filesystem::remove(path, failure);
}

void write_cubes(benchmark::State& state) {
    const std::filesystem::path path = file();
    const ColorCubeModel& written_model = model(); // built before the clock runs
    while (state.KeepRunning()) {
        if (const auto written = io::write_color_cubes(path, written_model); !written) {
            state.SkipWithError(written.error().message.c_str());
            break;
        }
    }
    count(state, path);
}
BENCHMARK(write_cubes)->Unit(benchmark::kMillisecond);

void read_cubes(benchmark::State& state) {
    const std::filesystem::path path = file();
    if (const auto written = io::write_color_cubes(path, model()); !written) {
        state.SkipWithError(written.error().message.c_str());
    }
    while (state.KeepRunning()) {
        const auto read = io::read_color_cubes(path);
        if (!read) {
            state.SkipWithError(read.error().message.c_str());
            break;
        }
        benchmark::DoNotOptimize(read->trees.data());
    }
    count(state, path);
}
BENCHMARK(read_cubes)->Unit(benchmark::kMillisecond);

} // namespace
