#pragma once

#include <farfield/core/result.hpp>
#include <farfield/eval/run_report.hpp>
#include <farfield/gpu/backend.hpp>
#include <farfield/gpu/plan_work.hpp>
#include <farfield/image/picture.hpp>
#include <farfield/math/view.hpp>
#include <farfield/partition/hierarchy.hpp>
#include <farfield/technique/culled_geometry.hpp>
#include <farfield/technique/image_cache.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace farfield {

/// What is measured: one technique on one backend along one walk.
struct WalkSetup {
    Backend* backend = nullptr;
    const Hierarchy* hierarchy = nullptr;
    /// Triangles of every item, by `ItemId`.
    std::span<const std::uint64_t> item_primitives;
    /// View of frame 0, 1, ...; all of the same size.
    std::function<View(int)> view;
    /// The technique; null: plain geometry, which is then its own reference.
    ImageCache* cache = nullptr;
    FrameClear clear;
};

/// How it is measured.
struct WalkOptions {
    int frames = 0;                  ///< >= 1
    double frame_seconds = 1.0 / 60; ///< [s] of the walk, for the motion; > 0
    int reference_every = 40;        ///< the geometry baseline on every Nth frame; 0: never
    std::uint64_t seed = 1;          ///< of the sampling of reference frames
    std::int32_t samples = 1;        ///< per pixel of the frame
    int warm_up_frames = 3;          ///< of plain geometry, not counted
    int picture_every = 0;           ///< `on_pictures` on every Nth frame; 0: never
};

/// Pictures of one frame.
struct WalkPictures {
    int frame = 0;
    const Picture& picture;
    const Picture& reference; ///< plain geometry
};

/// One frame as it was measured.
struct WalkFrame {
    double frame_ms = 0.0; ///< plan, execute and finish
    double plan_ms = 0.0;
    std::optional<double> reference_ms;
    std::optional<double> psnr_db; ///< against the reference, where it was rendered
    PlanWork work;
    ImageCacheStatistics cache;
};

/// The measured walk.
struct WalkResult {
    std::vector<WalkFrame> frames;
    GeometryOrder reference_order = GeometryOrder::stored; ///< the faster one, which was used
    double missing_fraction = 0.0;                         ///< mean over reference frames
    double extra_fraction = 0.0;
    /// Pixels of background inside the reference's geometry, over all reference frames: cracks,
    /// where surfaces are closed. Gaps in foliage that move count as well.
    std::uint64_t sky_holes = 0;
    bool compared = false;              ///< false: no reference frame, so no fractions
    std::uint64_t image_bytes_peak = 0; ///< of the backend
};

/// Called outside the clock.
struct WalkObserver {
    std::function<void(int frame, int frames)> on_progress;
    /// An error ends the walk.
    std::function<Result<void>(const WalkPictures&)> on_pictures;
    /// After each frame was planned and drawn; cache and plan are still those of the frame.
    std::function<Result<void>(int frame, const View&, const FramePlan&)> on_frame;
};

namespace eval {

/// Walks, and times every frame: wall time of plan, execute and finish. Reference frames are
/// interleaved and divided by the faster of sorted and stored order; pictures are read and compared
/// outside the clock.
/// @return an error of the backend, of a view, or of an observer
[[nodiscard]] Result<WalkResult>
walk(const WalkSetup& setup, const WalkOptions& options, const WalkObserver& observer = {});

/// Fills the figures that a walk gives into a report: times, speed-up, image errors, work, memory.
[[nodiscard]] Result<void> add_to_report(const WalkResult& result, RunReport& report);

/// Writes a table of all frames: frame, frame_ms, plan_ms, reference_ms, psnr_db, triangles,
/// image_quads, images_created, images_shown, image_bytes,
/// texels_used, texels_allocated; cells of what was not measured are
/// empty.
[[nodiscard]] Result<void> save_frames(const WalkResult& result, const std::filesystem::path& file);

} // namespace eval
} // namespace farfield
