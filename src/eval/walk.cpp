#include "eval/text_file.hpp"
#include <farfield/eval/disparity.hpp>
#include <farfield/eval/flip.hpp>
#include <farfield/eval/image_errors.hpp>
#include <farfield/eval/structural_similarity.hpp>
#include <farfield/eval/walk.hpp>

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>

namespace farfield::eval {

namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point begin) {
    return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// The target goes with the run, whatever way it ends.
class OwnedTarget {
  public:
    static Result<OwnedTarget> create(Backend* backend, const View& view, std::int32_t samples) {
        if (backend == nullptr) {
            return OwnedTarget(nullptr, TargetId{});
        }
        const Result<TargetId> made = backend->create_target(view.width, view.height, samples);
        if (!made) {
            return tl::unexpected(made.error());
        }
        return OwnedTarget(backend, *made);
    }
    OwnedTarget(OwnedTarget&& other) noexcept
        : backend_(std::exchange(other.backend_, nullptr)), id_(other.id_) {}
    OwnedTarget& operator=(OwnedTarget&&) = delete;
    OwnedTarget(const OwnedTarget&) = delete;
    OwnedTarget& operator=(const OwnedTarget&) = delete;
    ~OwnedTarget() {
        if (backend_ != nullptr) {
            backend_->destroy_target(id_);
        }
    }
    [[nodiscard]] TargetId id() const noexcept { return id_; }

  private:
    OwnedTarget(Backend* backend, TargetId id) : backend_(backend), id_(id) {}
    Backend* backend_;
    TargetId id_;
};

struct Timed {
    double frame_ms = 0.0;
    double plan_ms = 0.0;
    const FramePlan* plan = nullptr;
};

/// Plans and draws one frame with the device idle before and after.
template <typename MakePlan>
Result<Timed>
time_frame(Backend& backend, TargetId target, const FrameClear& clear, const MakePlan& make_plan) {
    backend.finish();
    const Clock::time_point begin = Clock::now();
    const FramePlan& plan = make_plan();
    Timed timed;
    timed.plan = &plan;
    timed.plan_ms = milliseconds_since(begin);
    if (Result<void> drawn = backend.execute(plan, target, clear); !drawn) {
        return tl::unexpected(std::move(drawn).error());
    }
    backend.finish();
    timed.frame_ms = milliseconds_since(begin);
    return timed;
}

/// A picture and which of its pixels show geometry.
struct Seen {
    Picture picture;
    CoverageMask mask;
};

Result<Seen> see(Backend& backend, TargetId target, const FrameClear& clear) {
    Result<Picture> read = backend.read_target(target);
    if (!read) {
        return tl::unexpected(std::move(read).error());
    }
    const glm::u8vec3 background(glm::vec3(clear.color) * 255.0F + 0.5F);
    Result<CoverageMask> mask = coverage_by_background(*read, background);
    if (!mask) {
        return tl::unexpected(std::move(mask).error());
    }
    return Seen{std::move(*read), std::move(*mask)};
}

Result<PictureErrors> errors_against(const Seen& reference, const Seen& seen, bool perceptual) {
    PictureErrors errors;
    const Result<double> psnr = psnr_db(reference.picture, seen.picture);
    if (!psnr) {
        return tl::unexpected(psnr.error());
    }
    errors.psnr_db = *psnr;
    const bool window_fits = std::min(seen.picture.width, seen.picture.height) >= kSsimWindow;
    if (perceptual && window_fits) {
        const Result<PixelMap> similarity = ssim_map(reference.picture, seen.picture);
        if (!similarity) {
            return tl::unexpected(similarity.error());
        }
        errors.ssim = mean(*similarity);
    }
    if (perceptual) {
        const Result<PixelMap> difference = flip_map(reference.picture, seen.picture);
        if (!difference) {
            return tl::unexpected(difference.error());
        }
        errors.flip = mean(*difference);
    }
    const Result<CoverageErrors> coverage = compare_coverage(reference.mask, seen.mask);
    if (!coverage) {
        return tl::unexpected(coverage.error());
    }
    errors.missing_fraction = coverage->missing_fraction;
    errors.extra_fraction = coverage->extra_fraction;
    return errors;
}

/// One walk: what it needs from frame to frame.
class Walk {
  public:
    Walk(const WalkSetup& setup, const WalkOptions& options, const WalkObserver& observer)
        : setup_(setup), options_(options), observer_(observer), clear_(setup.clear) {
        // Backends round a colour between two of 8 bits either way; one that is there they keep.
        const glm::vec4 steps = glm::floor(glm::clamp(clear_.color, 0.0F, 1.0F) * 255.0F + 0.5F);
        clear_.color = steps / 255.0F;
    }

    Result<WalkResult> run();

  private:
    /// Plain geometry on one backend.
    struct Baseline {
        Backend* backend = nullptr;
        std::int32_t samples = 1;
        OwnedTarget target;
        CulledGeometry geometry;
        std::vector<SampledTime> times;
    };
    /// What one contender keeps between frames.
    struct Runner {
        const Contender* contender = nullptr;
        std::optional<std::size_t> baseline; ///< that its times are divided by
        OwnedTarget target;
        OwnedTarget position_target;
        DisparitySeries disparity;
    };

    [[nodiscard]] Result<void> check() const;
    Result<void> make_views();
    Result<void> make_runners();
    Result<void> make_references();
    Result<std::size_t> find_baseline(Backend& backend, std::int32_t samples);
    Result<GeometryOrder> faster_order(Backend& backend, TargetId target) const;
    Result<void> draw_baseline(Baseline& baseline, int frame);
    [[nodiscard]] Motion motion_at(std::size_t frame) const;
    Result<void> run_frame(int frame);
    Result<void> draw_references(int frame);
    Result<void> run_contender(std::size_t index, int frame);
    Result<void>
    measure_positions(Runner& runner, int frame, const FramePlan& plan, WalkFrame& measured);
    Result<void> compare(std::size_t index, int frame, WalkFrame& measured);

    const WalkSetup& setup_;
    const WalkOptions& options_;
    const WalkObserver& observer_;
    FrameClear clear_;
    std::vector<View> views_;
    std::vector<Runner> runners_;
    std::vector<Baseline> baselines_; ///< the first is the reference of pictures, if there is one
    std::optional<OwnedTarget> truth_target_;
    std::vector<int> sampled_;
    std::size_t next_sample_ = 0;
    // Of the current frame.
    bool sample_ = false;
    bool show_ = false;
    std::optional<Seen> reference_;
    std::optional<Seen> truth_;
    std::optional<FrameDisparity> disparity_;
    WalkResult result_;
};

Result<void> Walk::check() const {
    if (options_.frames < 1) {
        return fail(
            ErrorCode::invalid_argument,
            "walk: frames is " + std::to_string(options_.frames) + ", expected at least 1"
        );
    }
    if (!(options_.frame_seconds > 0.0) || !std::isfinite(options_.frame_seconds)) {
        return fail(
            ErrorCode::invalid_argument,
            "walk: frame_seconds is " + std::to_string(options_.frame_seconds) +
                ", expected a finite time above 0 seconds"
        );
    }
    if (setup_.contenders.empty()) {
        return fail(ErrorCode::invalid_argument, "walk: no contenders");
    }
    for (const Contender& contender : setup_.contenders) {
        if (contender.backend == nullptr) {
            return fail(ErrorCode::invalid_argument, "walk: " + contender.name + ": no backend");
        }
    }
    if (observer_.on_pictures && options_.picture_every > 0 && setup_.reference == nullptr) {
        return fail(
            ErrorCode::invalid_argument, "walk: pictures without a reference to hold them against"
        );
    }
    if (setup_.truth != nullptr && setup_.reference == nullptr) {
        return fail(
            ErrorCode::invalid_argument,
            "walk: a truth without a reference, on whose frames it would be drawn"
        );
    }
    return {};
}

Result<void> Walk::make_views() {
    views_.reserve(static_cast<std::size_t>(options_.frames));
    for (int frame = 0; frame < options_.frames; ++frame) {
        views_.push_back(setup_.view(frame));
        if (Result<void> valid = validate(views_.back()); !valid) {
            return fail(
                valid.error().code, "frame " + std::to_string(frame) + ": " + valid.error().message
            );
        }
        const View& view = views_.back();
        if (view.width != views_[0].width || view.height != views_[0].height) {
            return fail(
                ErrorCode::invalid_argument,
                "frame " + std::to_string(frame) + ": " + std::to_string(view.width) + " x " +
                    std::to_string(view.height) + " pixels, frame 0 has " +
                    std::to_string(views_[0].width) + " x " + std::to_string(views_[0].height)
            );
        }
    }
    return {};
}

Result<void> Walk::make_runners() {
    for (const Contender& contender : setup_.contenders) {
        auto target = OwnedTarget::create(contender.backend, views_[0], contender.samples);
        if (!target) {
            return fail(target.error().code, contender.name + ": " + target.error().message);
        }
        auto positions = OwnedTarget::create(contender.positions, views_[0], 1);
        if (!positions) {
            return fail(positions.error().code, contender.name + ": " + positions.error().message);
        }
        runners_.push_back({&contender, {}, std::move(*target), std::move(*positions), {}});
    }
    result_.contenders.resize(setup_.contenders.size());
    return {};
}

Result<void> Walk::make_references() {
    if (setup_.reference == nullptr) {
        return {};
    }
    if (const auto made = find_baseline(*setup_.reference, setup_.reference_samples); !made) {
        return tl::unexpected(made.error());
    }
    for (Runner& runner : runners_) {
        if (runner.contender->reference == nullptr) {
            runner.baseline = 0;
            continue;
        }
        const auto made = find_baseline(*runner.contender->reference, runner.contender->samples);
        if (!made) {
            return fail(made.error().code, runner.contender->name + ": " + made.error().message);
        }
        runner.baseline = *made;
    }
    sampled_ = sampled_frames(options_.frames, options_.reference_every, options_.seed);
    auto truth = OwnedTarget::create(setup_.truth, views_[0], setup_.truth_samples);
    if (!truth) {
        return fail(truth.error().code, "truth: " + truth.error().message);
    }
    truth_target_.emplace(std::move(*truth));
    return {};
}

/// The baseline of a backend and a number of samples, made where there is none yet.
Result<std::size_t> Walk::find_baseline(Backend& backend, std::int32_t samples) {
    for (std::size_t i = 0; i < baselines_.size(); ++i) {
        if (baselines_[i].backend == &backend && baselines_[i].samples == samples) {
            return i;
        }
    }
    auto target = OwnedTarget::create(&backend, views_[0], samples);
    if (!target) {
        return tl::unexpected(std::move(target).error());
    }
    const auto order = faster_order(backend, target->id());
    if (!order) {
        return tl::unexpected(order.error());
    }
    baselines_.push_back(
        {&backend, samples, std::move(*target), CulledGeometry(*setup_.hierarchy, *order), {}}
    );
    return baselines_.size() - 1;
}

/// The faster of both orders for the first view, best of two each, after warming up.
Result<GeometryOrder> Walk::faster_order(Backend& backend, TargetId target) const {
    CulledGeometry stored(*setup_.hierarchy, GeometryOrder::stored);
    CulledGeometry sorted(*setup_.hierarchy, GeometryOrder::front_to_back);
    const auto timed = [&](CulledGeometry& geometry) {
        return time_frame(backend, target, clear_, [&]() -> const FramePlan& {
            return geometry.plan(views_[0]);
        });
    };
    for (int i = 0; i < options_.warm_up_frames; ++i) {
        if (const auto warmed = timed(sorted); !warmed) {
            return tl::unexpected(warmed.error());
        }
    }
    double best_stored = 0.0;
    double best_sorted = 0.0;
    for (int i = 0; i < 2; ++i) {
        const auto a = timed(stored);
        const auto b = timed(sorted);
        if (!a || !b) {
            return tl::unexpected(!a ? a.error() : b.error());
        }
        best_stored = i == 0 ? a->frame_ms : std::min(best_stored, a->frame_ms);
        best_sorted = i == 0 ? b->frame_ms : std::min(best_sorted, b->frame_ms);
    }
    return best_stored < best_sorted ? GeometryOrder::stored : GeometryOrder::front_to_back;
}

/// Motion comes from frames already seen: none on the first, no acceleration on the second.
Motion Walk::motion_at(std::size_t frame) const {
    Motion motion;
    motion.frame_seconds = options_.frame_seconds;
    if (frame >= 2) {
        return estimate_motion(
            views_[frame].eye, views_[frame - 1].eye, views_[frame - 2].eye, options_.frame_seconds
        );
    }
    if (frame == 1) {
        motion.velocity = (views_[1].eye - views_[0].eye) / options_.frame_seconds;
    }
    return motion;
}

/// Draws plain geometry on one backend, and times it on sampled frames.
Result<void> Walk::draw_baseline(Baseline& baseline, int frame) {
    const View& view = views_[static_cast<std::size_t>(frame)];
    const auto drawn =
        time_frame(*baseline.backend, baseline.target.id(), clear_, [&]() -> const FramePlan& {
            return baseline.geometry.plan(view);
        });
    if (!drawn) {
        return tl::unexpected(drawn.error());
    }
    if (sample_) {
        baseline.times.push_back({frame, drawn->frame_ms});
    }
    return {};
}

/// Draws plain geometry and the truth once for all contenders.
Result<void> Walk::draw_references(int frame) {
    reference_.reset();
    truth_.reset();
    if (setup_.reference == nullptr || (!sample_ && !show_)) {
        return {};
    }
    Baseline& baseline = baselines_[0];
    if (Result<void> drawn = draw_baseline(baseline, frame); !drawn) {
        return drawn;
    }
    auto seen = see(*baseline.backend, baseline.target.id(), clear_);
    if (!seen) {
        return tl::unexpected(std::move(seen).error());
    }
    reference_ = std::move(*seen);
    if (setup_.truth == nullptr) {
        return {};
    }
    const View& view = views_[static_cast<std::size_t>(frame)];
    const FramePlan& plan = baseline.geometry.plan(view);
    if (Result<void> drawn = setup_.truth->execute(plan, truth_target_->id(), clear_); !drawn) {
        return drawn;
    }
    auto truth = see(*setup_.truth, truth_target_->id(), clear_);
    if (!truth) {
        return tl::unexpected(truth.error());
    }
    truth_ = std::move(*truth);
    if (sample_) {
        const auto errors = errors_against(*truth_, *reference_, options_.perceptual_errors);
        if (!errors) {
            return tl::unexpected(errors.error());
        }
        result_.reference_truth.push_back(*errors);
    }
    return {};
}

Result<void>
Walk::measure_positions(Runner& runner, int frame, const FramePlan& plan, WalkFrame& measured) {
    const Contender& contender = *runner.contender;
    Backend& backend = *contender.positions;
    if (Result<void> drawn = backend.execute(plan, runner.position_target.id(), clear_); !drawn) {
        return drawn;
    }
    const Result<PositionPicture> picture = backend.read_positions(runner.position_target.id());
    if (!picture) {
        return tl::unexpected(picture.error());
    }
    Result<FrameDisparity> disparity = measure_disparity(
        *picture, views_[static_cast<std::size_t>(frame)], setup_.item_frames, contender.error_px
    );
    if (!disparity) {
        return tl::unexpected(std::move(disparity).error());
    }
    runner.disparity.add(frame, *disparity, images_made(plan));
    measured.disparity_p99_px = disparity->histogram.percentile(0.99);
    measured.disparity_max_px = disparity->histogram.max();
    disparity_ = std::move(*disparity);
    return {};
}

/// Holds what a contender drew against reference and truth.
Result<void> Walk::compare(std::size_t index, int frame, WalkFrame& measured) {
    const Contender& contender = setup_.contenders[index];
    const auto seen = see(*contender.backend, runners_[index].target.id(), clear_);
    if (!seen) {
        return tl::unexpected(seen.error());
    }
    if (sample_) {
        const auto image = errors_against(*reference_, *seen, options_.perceptual_errors);
        if (!image) {
            return tl::unexpected(image.error());
        }
        measured.image = *image;
        const auto holes = find_sky_holes(reference_->mask, seen->mask);
        if (!holes) {
            return tl::unexpected(holes.error());
        }
        result_.contenders[index].sky_holes += holes->pixels;
        if (truth_) {
            const auto truth = errors_against(*truth_, *seen, options_.perceptual_errors);
            if (!truth) {
                return tl::unexpected(truth.error());
            }
            measured.truth = *truth;
        }
    }
    if (!show_) {
        return {};
    }
    const WalkPictures pictures{
        .frame = frame,
        .contender = index,
        .measured = measured,
        .picture = seen->picture,
        .reference = reference_->picture,
        .truth = truth_ ? &truth_->picture : nullptr,
        .disparity = disparity_ ? &*disparity_ : nullptr};
    return observer_.on_pictures(pictures);
}

Result<void> Walk::run_contender(std::size_t index, int frame) {
    Runner& runner = runners_[index];
    const Contender& contender = *runner.contender;
    const View& view = views_[static_cast<std::size_t>(frame)];
    const Motion motion = motion_at(static_cast<std::size_t>(frame));
    const auto timed =
        time_frame(*contender.backend, runner.target.id(), clear_, [&]() -> const FramePlan& {
            return contender.planner.plan(view, motion);
        });
    if (!timed) {
        return tl::unexpected(timed.error());
    }
    ContenderResult& result = result_.contenders[index];
    WalkFrame measured;
    measured.frame_ms = timed->frame_ms;
    measured.plan_ms = timed->plan_ms;
    measured.work = work_of(*timed->plan, setup_.item_primitives);
    if (contender.planner.statistics) {
        measured.cache = contender.planner.statistics();
    }
    if (contender.planner.keyframes) {
        measured.sprite = contender.planner.keyframes();
    }
    result.image_bytes_peak = std::max(result.image_bytes_peak, contender.backend->image_bytes());
    disparity_.reset();
    if (contender.positions != nullptr) {
        if (Result<void> done = measure_positions(runner, frame, *timed->plan, measured); !done) {
            return done;
        }
        result.position_bytes_peak =
            std::max(result.position_bytes_peak, contender.positions->position_bytes());
    }
    if (observer_.on_frame) {
        if (Result<void> done = observer_.on_frame(frame, index, view, *timed->plan); !done) {
            return done;
        }
    }
    if (reference_) {
        if (Result<void> done = compare(index, frame, measured); !done) {
            return done;
        }
    }
    result.frames.push_back(measured);
    return {};
}

Result<void> Walk::run_frame(int frame) {
    sample_ = next_sample_ < sampled_.size() && sampled_[next_sample_] == frame;
    const bool every = options_.picture_every > 0 && frame % options_.picture_every == 0;
    show_ = observer_.on_pictures && (every || (options_.reference_pictures && sample_));
    if (Result<void> drawn = draw_references(frame); !drawn) {
        return drawn;
    }
    // Another one goes first on each frame.
    const std::size_t count = runners_.size();
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t index = (i + static_cast<std::size_t>(frame)) % count;
        // What times are divided by is drawn beside the first that is, and so as warm or cold.
        if (sample_ && runners_[index].baseline) {
            Baseline& baseline = baselines_[*runners_[index].baseline];
            const bool due = baseline.times.empty() || baseline.times.back().frame != frame;
            if (due) {
                if (Result<void> drawn = draw_baseline(baseline, frame); !drawn) {
                    return drawn;
                }
            }
        }
        if (Result<void> done = run_contender(index, frame); !done) {
            return fail(
                done.error().code,
                setup_.contenders[index].name + ", frame " + std::to_string(frame) + ": " +
                    done.error().message
            );
        }
    }
    next_sample_ += sample_ ? 1U : 0U;
    return {};
}

Result<WalkResult> Walk::run() {
    if (Result<void> valid = check(); !valid) {
        return tl::unexpected(std::move(valid).error());
    }
    if (Result<void> made = make_views(); !made) {
        return tl::unexpected(std::move(made).error());
    }
    if (Result<void> made = make_runners(); !made) {
        return tl::unexpected(std::move(made).error());
    }
    if (Result<void> made = make_references(); !made) {
        return tl::unexpected(std::move(made).error());
    }
    for (int frame = 0; frame < options_.frames; ++frame) {
        if (setup_.before_frame) {
            if (Result<void> changed = setup_.before_frame(frame); !changed) {
                return tl::unexpected(std::move(changed).error());
            }
        }
        if (Result<void> done = run_frame(frame); !done) {
            return tl::unexpected(std::move(done).error());
        }
        if (observer_.on_progress) {
            observer_.on_progress(frame + 1, options_.frames);
        }
    }
    if (!baselines_.empty()) {
        result_.reference = baselines_[0].times;
    }
    for (std::size_t i = 0; i < runners_.size(); ++i) {
        if (runners_[i].baseline) {
            result_.contenders[i].reference = baselines_[*runners_[i].baseline].times;
        }
        if (runners_[i].contender->positions != nullptr) {
            result_.contenders[i].disparity = runners_[i].disparity.summary();
        }
    }
    return std::move(result_);
}

std::optional<double> median(std::span<const double> values) {
    const auto figures = summarize(values);
    return figures ? std::optional(figures->median) : std::nullopt;
}

std::optional<double> average(std::span<const double> values) {
    const auto figures = summarize(values);
    return figures ? std::optional(figures->mean) : std::nullopt;
}

/// Figures of a series of picture errors, as they go into a report.
void fill(std::span<const PictureErrors> errors, RunReport::ImageErrors& report) {
    std::vector<double> psnr;
    std::vector<double> ssim;
    std::vector<double> flip;
    std::vector<double> missing;
    std::vector<double> extra;
    const auto keep = [](std::vector<double>& values, std::optional<double> value) {
        if (value) {
            values.push_back(*value);
        }
    };
    for (const PictureErrors& one : errors) {
        psnr.push_back(one.psnr_db);
        keep(ssim, one.ssim);
        keep(flip, one.flip);
        keep(missing, one.missing_fraction);
        keep(extra, one.extra_fraction);
    }
    if (!psnr.empty()) {
        report.psnr_db_min = *std::min_element(psnr.begin(), psnr.end());
    }
    report.psnr_db_median = median(psnr);
    report.ssim_median = median(ssim);
    report.flip_mean = average(flip);
    report.missing_fraction = average(missing);
    report.extra_fraction = average(extra);
}

void fill(const ContenderResult& result, RunReport::Work& report) {
    PlanWork work;
    std::uint64_t created = 0;
    std::uint64_t combined = 0;
    std::uint64_t reused = 0;
    std::uint64_t impossible = 0;
    std::uint64_t stale = 0;
    std::uint64_t evicted = 0;
    std::uint64_t refused = 0;
    for (const WalkFrame& frame : result.frames) {
        work.triangles += frame.work.triangles;
        work.draws += frame.work.draws;
        work.image_quads += frame.work.image_quads;
        work.image_texels += frame.work.image_texels;
        work.splats += frame.work.splats;
        work.cubes += frame.work.cubes;
        created += frame.cache.images_created;
        combined += frame.cache.images_combined;
        reused += frame.cache.images_reused;
        impossible += frame.cache.images_impossible;
        stale += frame.cache.images_stale;
        evicted += frame.cache.images_evicted;
        refused += frame.cache.images_refused;
        if (frame.sprite) {
            const std::uint64_t made =
                frame.sprite->keyframes_made + frame.sprite->keyframes_predicted;
            report.keyframes = report.keyframes.value_or(0) + made;
        }
    }
    const auto frames = static_cast<double>(result.frames.size());
    report.triangles_per_frame = static_cast<double>(work.triangles) / frames;
    report.draw_calls_per_frame = static_cast<double>(work.draws) / frames;
    report.image_quads_per_frame = static_cast<double>(work.image_quads) / frames;
    report.splats_per_frame = static_cast<double>(work.splats) / frames;
    report.cubes_per_frame = static_cast<double>(work.cubes) / frames;
    report.images_created = created;
    report.images_reused = reused;
    report.texels_created = work.image_texels;
    report.evicted = evicted;
    report.stale = stale;
    report.new_count = created - combined;
    report.combined = combined;
    report.reused = reused;
    report.impossible = impossible;
    report.budget_misses = refused;
}

std::string cell(std::optional<double> value) {
    return value ? std::to_string(*value) : std::string();
}

} // namespace

Result<WalkResult>
walk(const WalkSetup& setup, const WalkOptions& options, const WalkObserver& observer) {
    return Walk(setup, options, observer).run();
}

Result<void> add_to_report(const WalkResult& result, std::size_t contender, RunReport& report) {
    const ContenderResult& mine = result.contenders[contender];
    std::vector<double> frame_ms;
    std::vector<double> plan_ms;
    std::vector<PictureErrors> image;
    std::vector<PictureErrors> truth;
    for (const WalkFrame& frame : mine.frames) {
        frame_ms.push_back(frame.frame_ms);
        plan_ms.push_back(frame.plan_ms);
        if (frame.image) {
            image.push_back(*frame.image);
        }
        if (frame.truth) {
            truth.push_back(*frame.truth);
        }
    }
    report.frames = static_cast<int>(mine.frames.size());
    report.frame_ms = frame_times(frame_ms);
    if (const auto plan = summarize(plan_ms)) {
        report.plan_ms = {.mean = plan->mean, .p95 = plan->p95, .max = plan->max};
    }
    if (!mine.reference.empty()) {
        auto figures = reference_figures(mine.reference, report.frames);
        if (!figures) {
            return tl::unexpected(figures.error());
        }
        report.reference_frame_ms = *figures;
        auto faster = speedup(frame_ms, mine.reference);
        if (!faster) {
            return tl::unexpected(faster.error());
        }
        report.speedup = *faster;
    }
    fill(image, report.image);
    fill(truth, report.truth);
    RunReport::ImageErrors reference_truth;
    fill(result.reference_truth, reference_truth);
    report.truth.reference_psnr_db_median = reference_truth.psnr_db_median;
    if (mine.disparity) {
        const DisparitySummary& disparity = *mine.disparity;
        report.disparity_px = {
            .median = disparity.median_px,
            .p99 = disparity.p99_px,
            .max = disparity.max_px,
            .bound = disparity.bound_px,
            .over_bound = disparity.over_bound,
            .tightness = disparity.tightness};
        report.memory.aov_bytes = mine.position_bytes_peak;
    }
    fill(mine, report.work);
    report.memory.image_bytes_peak = mine.image_bytes_peak;
    return {};
}

Result<void> add_reference_to_report(const WalkResult& result, RunReport& report) {
    if (result.reference.empty()) {
        return {};
    }
    const auto frames = static_cast<int>(result.contenders[0].frames.size());
    const auto all_ms = reference_times(result.reference, frames);
    if (!all_ms) {
        return tl::unexpected(all_ms.error());
    }
    auto figures = reference_figures(result.reference, frames);
    if (!figures) {
        return tl::unexpected(figures.error());
    }
    report.frames = frames;
    report.frame_ms = frame_times(*all_ms);
    report.reference_frame_ms = *figures;
    report.speedup.overall = 1.0;
    fill(result.reference_truth, report.truth);
    report.truth.reference_psnr_db_median = report.truth.psnr_db_median;
    return {};
}

Result<void>
save_frames(const WalkResult& result, std::size_t contender, const std::filesystem::path& file) {
    std::string text =
        "frame,frame_ms,plan_ms,reference_ms,psnr_db,truth_psnr_db,ssim,flip,disparity_p99_px,"
        "disparity_max_px,triangles,image_quads,images_created,images_shown,image_bytes,"
        "texels_used,texels_allocated\n";
    const ContenderResult& mine = result.contenders[contender];
    auto sampled = mine.reference.begin();
    for (std::size_t i = 0; i < mine.frames.size(); ++i) {
        const WalkFrame& frame = mine.frames[i];
        std::optional<double> reference_ms;
        if (sampled != mine.reference.end() && static_cast<std::size_t>(sampled->frame) == i) {
            reference_ms = sampled->ms;
            ++sampled;
        }
        std::optional<double> psnr;
        std::optional<double> ssim;
        std::optional<double> flip;
        if (frame.image) {
            psnr = frame.image->psnr_db;
            ssim = frame.image->ssim;
            flip = frame.image->flip;
        }
        std::optional<double> truth_psnr;
        if (frame.truth) {
            truth_psnr = frame.truth->psnr_db;
        }
        text += std::to_string(i);
        for (const std::optional<double> value :
             {std::optional(frame.frame_ms),
              std::optional(frame.plan_ms),
              reference_ms,
              psnr,
              truth_psnr,
              ssim,
              flip,
              frame.disparity_p99_px,
              frame.disparity_max_px}) {
            text += "," + cell(value);
        }
        for (const std::uint64_t value :
             {frame.work.triangles,
              std::uint64_t{frame.work.image_quads},
              std::uint64_t{frame.cache.images_created},
              std::uint64_t{frame.cache.images_shown},
              frame.cache.image_bytes,
              frame.cache.texels_used,
              frame.cache.texels_allocated}) {
            text += "," + std::to_string(value);
        }
        text += "\n";
    }
    return detail::write_text(file, text);
}

} // namespace farfield::eval
