#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/disparity_series.hpp>
#include <farfield/eval/run_report.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>
#include <farfield/technique/lod_sprite.hpp>

#include <glm/ext/matrix_double4x3.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace farfield {

/// A technique as a walk drives it, whatever it is.
struct Planner {
    /// The plan of the next frame; valid until the next call.
    std::function<const FramePlan&(const View&, const Motion&)> plan;
    /// What that plan did with images; empty: it has none.
    std::function<const ImageCacheStatistics&()> statistics;
    /// What it did with keyframes; empty: it has none.
    std::function<const LodSpriteStatistics&()> keyframes;
};

/// One technique on one backend: what is measured.
struct Contender {
    std::string name; ///< for messages
    Planner planner;
    /// Draws, and is timed. Of its own: the memory of its pages is the contender's.
    Backend* backend = nullptr;
    /// Executes every plan once more, outside the clock, and keeps positions; null: no disparity.
    Backend* positions = nullptr;
    /// Draws the plain geometry that the contender's times are divided by, with as many samples: on
    /// the same kind of device, or the ratio compares devices. It may be the contender's backend.
    /// Null: that of the setup.
    Backend* reference = nullptr;
    /// [px] What the technique promises; none: it shows no images, or promises nothing.
    std::optional<double> error_px;
    std::int32_t samples = 1; ///< per pixel of its frames
};

/// What is walked through, and against what contenders are held.
struct WalkSetup {
    std::span<const Contender> contenders;
    /// Draws plain geometry, the reference of pictures, and of times where a contender has none of
    /// its own; null: there is no reference at all. It may be the backend of a contender.
    Backend* reference = nullptr;
    std::int32_t reference_samples = 1; ///< per pixel of the reference
    /// Draws plain geometry with `truth_samples`; null: nothing is held against the truth.
    Backend* truth = nullptr;
    std::int32_t truth_samples = 16;
    const Hierarchy* hierarchy = nullptr;
    /// Triangles of every item, by `ItemId`.
    std::span<const std::uint64_t> item_primitives;
    /// Where points of every item are in the world, as `farfield::item_frames`; for disparity.
    std::span<const glm::dmat4x3> item_frames;
    /// View of frame 0, 1, ...; all of the same size.
    std::function<View(int)> view;
    /// Called outside the clock before each frame, for what changes in the world: it may change the
    /// hierarchy, where items are drawn and `item_frames`. An error ends the walk. Empty: nothing
    /// changes.
    std::function<Result<void>(int)> before_frame;
    FrameClear clear;
};

/// How it is measured.
struct WalkOptions {
    int frames = 0;                  ///< >= 1
    double frame_seconds = 1.0 / 60; ///< [s] of the walk, for the motion; > 0
    int reference_every = 40;        ///< the geometry baseline on every Nth frame; 0: never
    std::uint64_t seed = 1;          ///< of the sampling of reference frames
    int warm_up_frames = 3;          ///< of plain geometry, not counted
    int picture_every = 0;           ///< `on_pictures` on every Nth frame; 0: never
    bool reference_pictures = false; ///< `on_pictures` on every reference frame as well
    /// On reference frames SSIM and FLIP as well; they take longer than drawing does.
    bool perceptual_errors = true;
};

/// How one picture differs from another.
struct PictureErrors {
    double psnr_db = 0.0;
    std::optional<double> ssim;
    std::optional<double> flip;
    std::optional<double> missing_fraction; ///< none where the reference shows no geometry
    std::optional<double> extra_fraction;
};

/// One frame as it was measured.
struct WalkFrame {
    double frame_ms = 0.0; ///< plan, execute and finish
    double plan_ms = 0.0;
    std::optional<PictureErrors> image;     ///< against the reference, on sampled frames
    std::optional<PictureErrors> truth;     ///< against the truth, on sampled frames
    std::optional<double> disparity_p99_px; ///< of the pixels that show images
    std::optional<double> disparity_max_px;
    PlanWork work;
    ImageCacheStatistics cache;
    std::optional<LodSpriteStatistics> sprite; ///< of a technique that has keyframes
};

/// Pictures of one frame of one contender.
struct WalkPictures {
    int frame = 0;
    std::size_t contender = 0;
    const WalkFrame& measured;
    const Picture& picture;
    const Picture& reference;                  ///< plain geometry
    const Picture* truth = nullptr;            ///< where there is one
    const FrameDisparity* disparity = nullptr; ///< where the contender's positions are kept
};

/// What one contender did.
struct ContenderResult {
    std::vector<WalkFrame> frames;
    std::vector<SampledTime> reference; ///< plain geometry on its device, on sampled frames
    /// Pixels of background inside the reference's geometry, over all reference frames: cracks,
    /// where surfaces are closed. Gaps in foliage that move count as well.
    std::uint64_t sky_holes = 0;
    std::uint64_t image_bytes_peak = 0;    ///< of the backend
    std::uint64_t position_bytes_peak = 0; ///< of the backend that keeps positions
    std::optional<DisparitySummary> disparity;
};

/// The measured walk.
struct WalkResult {
    std::vector<ContenderResult> contenders;    ///< in the order of the setup
    std::vector<SampledTime> reference;         ///< plain geometry on the frames it was sampled on
    std::vector<PictureErrors> reference_truth; ///< plain geometry against the truth, likewise
};

/// Called outside the clock.
struct WalkObserver {
    std::function<void(int frame, int frames)> on_progress;
    /// An error ends the walk.
    std::function<Result<void>(const WalkPictures&)> on_pictures;
    /// After each frame was planned and drawn; technique and plan are still those of the frame.
    std::function<Result<void>(int frame, std::size_t contender, const View&, const FramePlan&)>
        on_frame;
};

namespace eval {

/// Walks with all contenders at once, and times every frame of each: wall time of plan, execute and
/// finish. They take turns, another one first on each frame, so that whatever else the machine does
/// meets all of them alike. Reference and truth are drawn once for all, interleaved, and other
/// plain geometry beside the contenders that are divided by it; the faster of sorted and stored
/// order counts; pictures are read and compared outside the clock.
/// @return an error of a backend, of a view, or of an observer
[[nodiscard]] Result<WalkResult>
walk(const WalkSetup& setup, const WalkOptions& options, const WalkObserver& observer = {});

/// Fills the figures of one contender into a report: times, speed-up, errors, work, memory.
[[nodiscard]] Result<void>
add_to_report(const WalkResult& result, std::size_t contender, RunReport& report);

/// The same for plain geometry itself: times of the frames it was drawn on, and its errors against
/// the truth.
[[nodiscard]] Result<void> add_reference_to_report(const WalkResult& result, RunReport& report);

/// Writes a table of all frames of one contender: frame, frame_ms, plan_ms, reference_ms, psnr_db,
/// truth_psnr_db, ssim, flip, disparity_p99_px, disparity_max_px, triangles, image_quads,
/// images_created, images_shown, image_bytes, texels_used, texels_allocated; cells of what was not
/// measured are empty.
[[nodiscard]] Result<void>
save_frames(const WalkResult& result, std::size_t contender, const std::filesystem::path& file);

} // namespace eval
} // namespace farfield
