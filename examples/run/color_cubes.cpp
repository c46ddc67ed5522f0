#include "run/color_cubes.hpp"

#include <farfield/embree/scene_sampler.hpp>
#include <farfield/io/color_cube_file.hpp>
#include <farfield/parallel/parallel_executor.hpp>

#include <chrono>
#include <filesystem>
#include <utility>

namespace farfield::run {

namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

} // namespace

Result<CubeModel> make_color_cubes(const World& world, const CubeModelOptions& options) {
    // What moves is never part of a cube, and stands at the end.
    Scene still;
    const Scene* scene = &world.scene;
    if (!world.movers.empty()) {
        still = world.scene;
        still.instances.resize(index_of(world.movers.front().item));
        scene = &still;
    }
    CubeModel result;
    const std::uint64_t key = digest(*scene, options.build, options.min_shared);
    auto start = std::chrono::steady_clock::now();
    std::error_code ignored;
    if (!options.file.empty() && std::filesystem::exists(options.file, ignored)) {
        auto read = io::read_color_cubes(options.file, key);
        if (!read) {
            return tl::unexpected(std::move(read).error());
        }
        result.model = std::move(*read);
        result.read_s = seconds_since(start);
        return result;
    }
    const auto sampler = embree::SceneSampler::create(*scene, center(scene_bounds(*scene)));
    if (!sampler) {
        return tl::unexpected(sampler.error());
    }
    parallel::ParallelExecutor executor;
    auto built = build_color_cubes(*scene, **sampler, options.build, executor, options.min_shared);
    if (!built) {
        return tl::unexpected(std::move(built).error());
    }
    result.model = std::move(*built);
    result.build_s = seconds_since(start);
    if (!options.file.empty()) {
        if (auto written = io::write_color_cubes(options.file, result.model, key); !written) {
            return tl::unexpected(std::move(written).error());
        }
    }
    return result;
}

} // namespace farfield::run
