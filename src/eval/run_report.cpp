#include "text_file.hpp"
#include <farfield/core/assert.hpp>
#include <farfield/eval/run_report.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

namespace farfield::eval {

namespace {

using nlohmann::ordered_json;

/// Percentile of samples that are sorted already.
double sorted_percentile(std::span<const double> sorted, double fraction) {
    const double position = fraction * static_cast<double>(sorted.size() - 1);
    const auto below = static_cast<std::size_t>(position);
    const std::size_t above = std::min(below + 1, sorted.size() - 1);
    const double share = position - static_cast<double>(below);
    return sorted[below] + share * (sorted[above] - sorted[below]);
}

std::vector<double> sorted_copy(std::span<const double> samples) {
    std::vector<double> sorted(samples.begin(), samples.end());
    std::sort(sorted.begin(), sorted.end());
    return sorted;
}

tl::unexpected<Error> invalid(std::string message) {
    return fail(ErrorCode::invalid_argument, std::move(message));
}

bool is_time(double ms) noexcept {
    return ms > 0.0 && std::isfinite(ms);
}

/// The splitmix64 generator: every platform's standard distributions differ, this does not.
/// Source: Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014.
std::uint64_t random_bits(std::uint64_t& state) noexcept {
    state += 0x9E3779B97F4A7C15ULL;
    std::uint64_t value = state;
    value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9ULL;
    value = (value ^ (value >> 27U)) * 0x94D049BB133111EBULL;
    return value ^ (value >> 31U);
}

template <typename T>
ordered_json number(const std::optional<T>& value) {
    if (!value) {
        return nullptr;
    }
    return *value; // the writer turns infinity and NaN into null
}

ordered_json scene_json(const RunReport::SceneFigures& scene) {
    return {
        {"name", scene.name},
        {"triangles", number(scene.triangles)},
        {"instances", number(scene.instances)},
        {"build_ms", number(scene.build_ms)},
        {"nodes", number(scene.nodes)},
        {"depth", number(scene.depth)}};
}

ordered_json image_json(const RunReport::ImageErrors& image) {
    return {
        {"psnr_db_min", number(image.psnr_db_min)},
        {"psnr_db_median", number(image.psnr_db_median)},
        {"ssim_median", number(image.ssim_median)},
        {"flip_mean", number(image.flip_mean)},
        {"missing_fraction", number(image.missing_fraction)},
        {"extra_fraction", number(image.extra_fraction)}};
}

ordered_json work_json(const RunReport::Work& work) {
    return {
        {"triangles_per_frame", number(work.triangles_per_frame)},
        {"draw_calls_per_frame", number(work.draw_calls_per_frame)},
        {"image_quads_per_frame", number(work.image_quads_per_frame)},
        {"splats_per_frame", number(work.splats_per_frame)},
        {"cubes_per_frame", number(work.cubes_per_frame)},
        {"images_created", number(work.images_created)},
        {"images_reused", number(work.images_reused)},
        {"texels_created", number(work.texels_created)},
        {"deferred", number(work.deferred)},
        {"evicted", number(work.evicted)},
        {"stale", number(work.stale)},
        {"new", number(work.new_count)},
        {"combined", number(work.combined)},
        {"reused", number(work.reused)},
        {"impossible", number(work.impossible)},
        {"keyframes", number(work.keyframes)},
        {"budget_misses", number(work.budget_misses)}};
}

ordered_json cost_model_json(const std::optional<CostModel>& model) {
    if (!model) {
        return nullptr;
    }
    return {
        {"triangle_s", model->triangle_s},
        {"draw_call_s", model->draw_call_s},
        {"image_quad_s", model->image_quad_s},
        {"image_pixel_s", model->image_pixel_s},
        {"pass_s", model->pass_s},
        {"texel_s", model->texel_s},
        {"geometry_pixel_s", model->geometry_pixel_s},
        {"splat_s", model->splat_s},
        {"cube_s", model->cube_s},
        {"cell_s", model->cell_s}};
}

} // namespace

double percentile(std::span<const double> samples, double fraction) {
    FARFIELD_ASSERT(!samples.empty() && fraction >= 0.0 && fraction <= 1.0);
    return sorted_percentile(sorted_copy(samples), fraction);
}

std::optional<Statistics> summarize(std::span<const double> samples) {
    if (samples.empty()) {
        return std::nullopt;
    }
    const std::vector<double> sorted = sorted_copy(samples);
    Statistics result;
    result.first = samples.front();
    result.total = std::accumulate(samples.begin(), samples.end(), 0.0);
    result.mean = result.total / static_cast<double>(samples.size());
    result.median = sorted_percentile(sorted, 0.5);
    result.p95 = sorted_percentile(sorted, 0.95);
    result.p99 = sorted_percentile(sorted, 0.99);
    result.max = sorted.back();
    return result;
}

std::vector<int> sampled_frames(int frame_count, int every, std::uint64_t seed) {
    FARFIELD_ASSERT(frame_count >= 0 && every >= 0);
    std::vector<int> frames;
    if (frame_count == 0 || every == 0) {
        return frames;
    }
    const int last = frame_count - 1;
    frames.push_back(0);
    std::uint64_t state = seed;
    for (std::int64_t begin = every; begin < last; begin += every) {
        const std::uint64_t jitter = random_bits(state) % static_cast<std::uint64_t>(every);
        const std::int64_t frame = begin + static_cast<std::int64_t>(jitter);
        if (frame < last) {
            frames.push_back(static_cast<int>(frame));
        }
    }
    if (last > 0) {
        frames.push_back(last);
    }
    return frames;
}

Result<std::vector<double>>
reference_times(std::span<const SampledTime> reference, int frame_count) {
    if (frame_count < 1) {
        return invalid(
            "reference times: frame_count is " + std::to_string(frame_count) +
            ", expected 1 or more"
        );
    }
    if (reference.empty() || reference.front().frame != 0 ||
        reference.back().frame != frame_count - 1) {
        return invalid(
            "reference times: frames " +
            (reference.empty() ? std::string("none")
                               : std::to_string(reference.front().frame) + " to " +
                                     std::to_string(reference.back().frame)) +
            " were sampled, expected 0 to " + std::to_string(frame_count - 1)
        );
    }
    for (std::size_t i = 0; i < reference.size(); ++i) {
        const SampledTime& sample = reference[i];
        if (!is_time(sample.ms)) {
            return invalid(
                "reference times: frame " + std::to_string(sample.frame) + " took " +
                std::to_string(sample.ms) + " ms, expected more than 0"
            );
        }
        if (i > 0 && sample.frame <= reference[i - 1].frame) {
            return invalid(
                "reference times: frame " + std::to_string(sample.frame) + " follows frame " +
                std::to_string(reference[i - 1].frame)
            );
        }
    }
    std::vector<double> times(static_cast<std::size_t>(frame_count), reference.front().ms);
    for (std::size_t i = 1; i < reference.size(); ++i) {
        const SampledTime& before = reference[i - 1];
        const SampledTime& after = reference[i];
        for (int frame = before.frame + 1; frame <= after.frame; ++frame) {
            const double share = static_cast<double>(frame - before.frame) /
                                 static_cast<double>(after.frame - before.frame);
            times[static_cast<std::size_t>(frame)] = std::lerp(before.ms, after.ms, share);
        }
    }
    return times;
}

Result<Speedup> speedup(std::span<const double> frame_ms, std::span<const SampledTime> reference) {
    const auto times = reference_times(reference, static_cast<int>(frame_ms.size()));
    if (!times) {
        return tl::unexpected(times.error());
    }
    double technique_total = 0.0;
    double reference_total = 0.0;
    for (std::size_t frame = 0; frame < frame_ms.size(); ++frame) {
        if (!is_time(frame_ms[frame])) {
            return invalid(
                "speed-up: frame " + std::to_string(frame) + " took " +
                std::to_string(frame_ms[frame]) + " ms, expected more than 0"
            );
        }
        technique_total += frame_ms[frame];
        reference_total += (*times)[frame];
    }
    Speedup result;
    result.overall = reference_total / technique_total;
    if (frame_ms.size() > 1) {
        result.without_first =
            (reference_total - times->front()) / (technique_total - frame_ms.front());
    }
    double least = std::numeric_limits<double>::infinity();
    double most = 0.0;
    for (const SampledTime& sample : reference) {
        const double ratio = sample.ms / frame_ms[static_cast<std::size_t>(sample.frame)];
        least = std::min(least, ratio);
        most = std::max(most, ratio);
    }
    result.min = least;
    result.max = most;
    return result;
}

RunReport::FrameTimes frame_times(std::span<const double> frame_ms) {
    const auto figures = summarize(frame_ms);
    if (!figures) {
        return {};
    }
    return {
        figures->first,
        figures->mean,
        figures->median,
        figures->p95,
        figures->p99,
        figures->max,
        figures->total};
}

Result<RunReport::ReferenceTimes>
reference_figures(std::span<const SampledTime> reference, int frame_count) {
    if (reference.empty()) {
        return RunReport::ReferenceTimes{};
    }
    const auto times = reference_times(reference, frame_count);
    if (!times) {
        return tl::unexpected(times.error());
    }
    std::vector<double> sampled;
    sampled.reserve(reference.size());
    for (const SampledTime& sample : reference) {
        sampled.push_back(sample.ms);
    }
    const Statistics figures = *summarize(sampled);
    return RunReport::ReferenceTimes{
        figures.first,
        figures.mean,
        figures.median,
        figures.p95,
        figures.max,
        sampled.size(),
        std::accumulate(times->begin(), times->end(), 0.0)};
}

std::string to_json(const RunReport& report) {
    ordered_json root;
    root["scene"] = scene_json(report.scene);
    root["technique"] = report.technique;
    root["preset"] = report.preset;
    root["backend"] = report.backend;
    root["device"] = report.device;
    root["width"] = report.width;
    root["height"] = report.height;
    root["fov_deg"] = report.fov_deg;
    root["error_px"] = number(report.error_px);
    root["frames"] = report.frames;
    const RunReport::FrameTimes& frame = report.frame_ms;
    root["frame_ms"] = {
        {"first", number(frame.first)},
        {"mean", number(frame.mean)},
        {"median", number(frame.median)},
        {"p95", number(frame.p95)},
        {"p99", number(frame.p99)},
        {"max", number(frame.max)},
        {"total", number(frame.total)}};
    const RunReport::ReferenceTimes& reference = report.reference_frame_ms;
    root["reference_frame_ms"] = {
        {"first", number(reference.first)},
        {"mean", number(reference.mean)},
        {"median", number(reference.median)},
        {"p95", number(reference.p95)},
        {"max", number(reference.max)},
        {"sampled", number(reference.sampled)},
        {"total", number(reference.total)}};
    root["speedup"] = {
        {"overall", number(report.speedup.overall)},
        {"without_first", number(report.speedup.without_first)},
        {"min", number(report.speedup.min)},
        {"max", number(report.speedup.max)}};
    root["plan_ms"] = {
        {"mean", number(report.plan_ms.mean)},
        {"p95", number(report.plan_ms.p95)},
        {"max", number(report.plan_ms.max)}};
    const RunReport::Disparity& disparity = report.disparity_px;
    root["disparity_px"] = {
        {"median", number(disparity.median)},
        {"p99", number(disparity.p99)},
        {"max", number(disparity.max)},
        {"bound", number(disparity.bound)},
        {"over_bound", number(disparity.over_bound)},
        {"tightness", number(disparity.tightness)}};
    root["image"] = image_json(report.image);
    root["truth"] = image_json(report.truth);
    root["truth"]["reference_psnr_db_median"] = number(report.truth.reference_psnr_db_median);
    root["work"] = work_json(report.work);
    const RunReport::Memory& memory = report.memory;
    root["memory"] = {
        {"image_bytes_peak", number(memory.image_bytes_peak)},
        {"image_budget_bytes", number(memory.image_budget_bytes)},
        {"aov_bytes", number(memory.aov_bytes)},
        {"hierarchy_bytes", number(memory.hierarchy_bytes)},
        {"scene_bytes", number(memory.scene_bytes)}};
    root["cost_model"] = cost_model_json(report.cost_model);
    constexpr int kIndent = 1;
    return root.dump(kIndent, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

Result<void> save(const RunReport& report, const std::filesystem::path& file) {
    return detail::write_text(file, to_json(report));
}

} // namespace farfield::eval
