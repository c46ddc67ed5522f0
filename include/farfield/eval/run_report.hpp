#pragma once

#include <farfield/core/result.hpp>
#include <farfield/policy/cost_model.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace farfield {

/// Time of one sampled frame of the reference.
struct SampledTime {
    int frame = 0;   ///< >= 0
    double ms = 0.0; ///< [ms] > 0
};

/// The usual figures of a series. @see eval::summarize
struct Statistics {
    double first = 0.0;
    double mean = 0.0;
    double median = 0.0;
    double p95 = 0.0;
    double p99 = 0.0;
    double max = 0.0;
    double total = 0.0;
};

/// Reference time over the technique's time: above 1 the technique is faster.
struct Speedup {
    std::optional<double> overall;       ///< R / T over all frames
    std::optional<double> without_first; ///< the same without frame 0 in either
    std::optional<double> min;           ///< of the sampled frames
    std::optional<double> max;           ///< of the sampled frames
};

/// What one run measured. The structs and fields are the JSON of a run, name by name; a figure that
/// was not measured is none and becomes null, never zero.
struct RunReport {
    struct SceneFigures {
        std::string name;
        std::optional<std::uint64_t> triangles; ///< with every instance counted
        std::optional<std::uint64_t> instances;
        std::optional<double> build_ms; ///< of the hierarchy
        std::optional<std::uint64_t> nodes;
        std::optional<std::uint64_t> depth;
    };
    /// Wall time of plan, execute and finish, over all frames.
    struct FrameTimes {
        std::optional<double> first;
        std::optional<double> mean;
        std::optional<double> median;
        std::optional<double> p95;
        std::optional<double> p99;
        std::optional<double> max;
        std::optional<double> total;
    };
    /// Of the frames on which the reference was rendered; `total` is R, for all frames.
    struct ReferenceTimes {
        std::optional<double> first;
        std::optional<double> mean;
        std::optional<double> median;
        std::optional<double> p95;
        std::optional<double> max;
        std::optional<std::uint64_t> sampled; ///< frames
        std::optional<double> total;
    };
    struct PlanTimes {
        std::optional<double> mean;
        std::optional<double> p95;
        std::optional<double> max;
    };
    struct Disparity {
        std::optional<double> median;
        std::optional<double> p99;
        std::optional<double> max;
        std::optional<double> bound;
        std::optional<std::uint64_t> over_bound; ///< pixels
        std::optional<double> tightness;
    };
    struct ImageErrors {
        std::optional<double> psnr_db_min;
        std::optional<double> psnr_db_median;
        std::optional<double> ssim_median;
        std::optional<double> flip_mean;
        std::optional<double> missing_fraction;
        std::optional<double> extra_fraction;
    };
    struct TruthErrors : ImageErrors {
        std::optional<double> reference_psnr_db_median; ///< plain geometry against the truth
    };
    struct Work {
        std::optional<double> triangles_per_frame;
        std::optional<double> draw_calls_per_frame;
        std::optional<double> image_quads_per_frame;
        std::optional<double> splats_per_frame;
        std::optional<double> cubes_per_frame;
        std::optional<std::uint64_t> images_created;
        std::optional<std::uint64_t> images_reused;
        std::optional<std::uint64_t> texels_created;
        std::optional<std::uint64_t> deferred;
        std::optional<std::uint64_t> evicted;
        std::optional<std::uint64_t> stale;
        std::optional<std::uint64_t> new_count; ///< "new" in the JSON
        std::optional<std::uint64_t> combined;
        std::optional<std::uint64_t> reused;
        std::optional<std::uint64_t> impossible;
        std::optional<std::uint64_t> keyframes; ///< made; none: no technique of keyframes
        std::optional<std::uint64_t> budget_misses;
    };
    struct Memory {
        std::optional<std::uint64_t> image_bytes_peak; ///< whole pages, with depth, mips, scratch
        std::optional<std::uint64_t> image_budget_bytes;
        std::optional<std::uint64_t> aov_bytes;
        std::optional<std::uint64_t> hierarchy_bytes;
        std::optional<std::uint64_t> scene_bytes;
    };

    SceneFigures scene;
    std::string technique;
    std::string preset;
    std::string backend;
    std::string device; ///< name of the renderer
    int width = 0;      ///< [px]
    int height = 0;     ///< [px]
    double fov_deg = 0.0;
    std::optional<double> error_px;
    int frames = 0;
    FrameTimes frame_ms;
    ReferenceTimes reference_frame_ms;
    Speedup speedup;
    PlanTimes plan_ms;
    Disparity disparity_px;
    ImageErrors image;
    TruthErrors truth;
    Work work;
    Memory memory;
    std::optional<CostModel> cost_model;
};

namespace eval {

/// Value below which a share `fraction` of the samples lies, linear between order statistics: with
/// samples x[0] <= ... <= x[n-1] it is x at position fraction * (n - 1). The median of an even
/// count is so the mean of the middle two, and the percentile of one sample is the sample.
/// @param samples in any order, finite, not empty
/// @param fraction [0, 1]
[[nodiscard]] double percentile(std::span<const double> samples, double fraction);

/// All figures of a series; none for an empty one.
[[nodiscard]] std::optional<Statistics> summarize(std::span<const double> samples);

/// The frames on which the reference is rendered: the first, the last, and one at a random place
/// of every further stretch of `every` frames, so that no rhythm of the technique falls in step
/// with the sampling. Ascending, without repeats, the same for the same seed on every platform.
/// @param frame_count >= 0; 0: no frames
/// @param every 1: all frames; 0: none at all
[[nodiscard]] std::vector<int> sampled_frames(int frame_count, int every, std::uint64_t seed);

/// The reference's time of every frame: as measured on sampled frames, linear between them. [ms]
/// @param reference ascending; has to have the first and the last of the frames
/// @param frame_count >= 1
/// @return an error naming the frame and its value
[[nodiscard]] Result<std::vector<double>>
reference_times(std::span<const SampledTime> reference, int frame_count);

/// Speed-up of a walk: overall = R / T, T the sum of the technique's times and R that of
/// `reference_times`, over all frames; without_first leaves frame 0 out of both and is none for a
/// walk of one frame; min and max are over sampled frames, frame 0 included. Costs of the
/// technique that come rarely are so counted in full, whatever the sampling.
/// @param frame_ms [ms] the technique's time of every frame, each > 0
/// @return errors as `reference_times`
[[nodiscard]] Result<Speedup>
speedup(std::span<const double> frame_ms, std::span<const SampledTime> reference);

/// The technique's times as they go into the report.
[[nodiscard]] RunReport::FrameTimes frame_times(std::span<const double> frame_ms);

/// The reference's times as they go into the report; all none for an empty span.
/// @return errors as `reference_times`
[[nodiscard]] Result<RunReport::ReferenceTimes>
reference_figures(std::span<const SampledTime> reference, int frame_count);

/// The JSON of a run. Keys are always all there; none, and numbers that JSON does not have, are
/// null. Text that is not UTF-8 has its bad bytes replaced.
[[nodiscard]] std::string to_json(const RunReport& report);

/// Writes `to_json`; an existing file is replaced at once or not at all.
[[nodiscard]] Result<void> save(const RunReport& report, const std::filesystem::path& file);

} // namespace eval
} // namespace farfield
